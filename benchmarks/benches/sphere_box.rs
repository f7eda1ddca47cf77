//! Exact volumes of spheres in the cells of a grid, with the error of their sum beside: `cargo bench --bench sphere_box`.

#![allow(clippy::unwrap_used)]

use colluvium_coupling::coarse_graining::sphere_box_volume;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::f64::consts::PI;
use std::hint::black_box;

/// Volumes of the cells that a sphere of unit radius meets, and how many they are.
fn cells_of(centre: [f64; 3], cell: f64) -> (f64, u64) {
    let [x, y, z] =
        centre.map(|c| ((c - 1.0) / cell).floor() as i64..=((c + 1.0) / cell).floor() as i64);
    let (mut sum, mut count) = (0.0, 0);
    for i in x {
        for j in y.clone() {
            for k in z.clone() {
                let lower = [i, j, k].map(|n| n as f64 * cell);
                let upper = [i, j, k].map(|n| (n + 1) as f64 * cell);
                sum += sphere_box_volume(black_box(centre), 1.0, lower, upper);
                count += 1;
            }
        }
    }
    (sum, count)
}

fn overlaps(c: &mut Criterion) {
    let mut group = c.benchmark_group("sphere in cells");
    for (name, cell) in [
        ("of a radius", 1.0),
        ("of a diameter", 2.0),
        ("of five diameters", 10.0),
    ] {
        // Places that no symmetry makes easy, by the golden ratio's multiples.
        let centres: Vec<[f64; 3]> = (0..1000)
            .map(|n| [0.618_034, 0.754_878, 0.569_840].map(|s| 10.0 * (f64::from(n) * s).fract()))
            .collect();
        let whole = 4.0 / 3.0 * PI;
        let error = |&c: &[f64; 3]| (cells_of(c, cell).0 / whole - 1.0).abs();
        let worst = centres.iter().map(error).fold(0.0, f64::max);
        group.throughput(Throughput::Elements(
            centres.iter().map(|&c| cells_of(c, cell).1).sum(),
        ));
        group.bench_function(
            BenchmarkId::new(
                "cells",
                format!("{name} (sums off by at most {worst:.1e} of the sphere)"),
            ),
            |b| b.iter(|| centres.iter().map(|&c| cells_of(c, cell).0).sum::<f64>()),
        );
    }
    group.finish();
}

criterion_group!(benches, overlaps);
criterion_main!(benches);
