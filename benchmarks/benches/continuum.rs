//! Time to the steady Bagnold layer, with the error beside it: `cargo bench --bench continuum`.

#![allow(clippy::unwrap_used)]

use colluvium_benchmarks::bagnold;
use colluvium_continuum::layer::Options;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::ops::ControlFlow;

fn steady_layer(c: &mut Criterion) {
    let mut group = c.benchmark_group("Bagnold from rest to steady");
    group.sample_size(20);
    for cells in [16, 32, 64, 128] {
        let case = bagnold(cells);
        let solve = || {
            case.solve(&Options::default(), &mut |_| ControlFlow::Continue(()))
                .unwrap()
        };
        let error = solve().velocity_error_l2_relative;
        group.bench_function(
            BenchmarkId::new("cells", format!("{cells} (relative L2 error {error:.2e})")),
            |b| b.iter(solve),
        );
    }
    group.finish();
}

criterion_group!(benches, steady_layer);
criterion_main!(benches);
