//! Grain-steps per second of the DEM engine: `cargo bench --bench grains`.

#![allow(clippy::unwrap_used)]

use colluvium_benchmarks::sheared_bed;
use colluvium_dem::Threads;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Steps that one measurement advances.
const STEPS: u64 = 200;

fn steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("grain-steps on a 33° incline");
    group.sample_size(20);
    for (name, beta) in [("spheres", None), ("rolling springs", Some(0.2))] {
        for (grains, floor) in [(1700, [12.0, 6.0]), (6800, [24.0, 12.0])] {
            let bed = sheared_bed(grains, floor, beta, Threads::Serial).unwrap();
            for (threads, kind) in [("serial", Threads::Serial), ("rayon", Threads::Rayon)] {
                let mut simulation = bed.clone();
                simulation.set_threads(kind);
                let count = simulation.grain_count() as u64;
                group.throughput(Throughput::Elements(STEPS * count));
                group.bench_function(format!("{name}, {grains} grains, {threads}"), |b| {
                    b.iter(|| simulation.advance(STEPS).unwrap());
                });
            }
        }
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
