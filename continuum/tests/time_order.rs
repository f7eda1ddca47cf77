//! Order in time of a flow with a moving surface, on grids that stay the same.
// A helper of a test may panic like the test itself.
#![allow(clippy::unwrap_used)]

use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::free_surface::{SurfaceFlow, SurfaceOptions};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;

fn grains(diameter: f64) -> MuI {
    MuI::new(0.32, 0.60, 0.4, diameter, 1.0, 1.0)
}

/// Velocities of a layer of depth 1 on a slope of 0.43 rad a time of 2 after it was let go, in so many steps, of which each
/// second one is longer by half if they are `uneven`.
fn started_layer(steps: usize, second_order: bool, uneven: bool) -> Vec<f64> {
    let (cells, slope, end) = (40, 0.43_f64, 2.0);
    let across = Axis::Bounded {
        length: 1.25,
        cells,
        low: Boundary::NoSlip { velocity: 0.0 },
        high: Boundary::FreeSlip,
    };
    let mut options = SurfaceOptions {
        second_order,
        ..SurfaceOptions::default()
    };
    options.solver.strain_rate_floor = 1e-6;
    options.solver.stress_tolerance = 1e-9;
    options.solver.momentum_tolerance = 1e-10;
    options.solver.tolerance_in_motion = 1.0;
    let mut flow = SurfaceFlow::at_rest(
        Grid::with_moving_surface([Axis::Flat, across]).unwrap(),
        (0..cells).map(|k| if k < 32 { 1.0 } else { 0.0 }).collect(),
        grains(0.04),
        [slope.sin(), -slope.cos()],
        options,
    )
    .unwrap();
    for n in 0..steps {
        let factor = match (uneven, n % 2) {
            (false, _) => 1.0,
            (true, 0) => 0.8,
            (true, _) => 1.2,
        };
        flow.accelerate_in_place(factor * end / steps as f64)
            .unwrap();
    }
    flow.state().velocity[0].clone()
}

/// Orders between 20, 40 and 80 steps.
fn orders(exact: &[f64], second_order: bool, uneven: bool) -> [f64; 2] {
    let errors = [20, 40, 80].map(|steps| {
        let found = started_layer(steps, second_order, uneven);
        let misses = found.iter().zip(exact).map(|(a, b)| (a - b).powi(2));
        (misses.sum::<f64>() / exact.iter().map(|u| u * u).sum::<f64>()).sqrt()
    });
    println!("second order: {second_order}, uneven steps: {uneven}: errors {errors:.6?}");
    [0, 1].map(|n| (errors[n] / errors[n + 1]).log2())
}

/// A layer that begins to flow: order two for even and uneven steps; one, as the negative control, where stress is taken
/// at the end of each step.
#[test]
fn a_layer_begins_to_flow_with_second_order() {
    let exact = started_layer(640, true, false);
    for uneven in [false, true] {
        let found = orders(&exact, true, uneven);
        assert!(found.iter().all(|order| *order >= 1.7), "{found:?}");
    }
    let control = orders(&exact, false, false);
    assert!(control.iter().all(|order| *order < 1.2), "{control:?}");
}

/// Heights of a collapsing column (a = 0.5, 128 cells) at a time.
fn heights(courant: f64, second_order: bool, end: f64) -> Vec<f64> {
    let case = CollapseCase {
        aspect: 0.5,
        height: 1.0,
        gravity: 1.0,
        rheology: grains(1.0 / 30.0),
        cells: 128,
        length_scaled: 5.0,
        overhang_degrees: 0.0,
    };
    let options = SurfaceOptions {
        courant,
        second_order,
        ..SurfaceOptions::default()
    };
    let mut collapse = Collapse::new(&case, &options).unwrap();
    while collapse.time() < end - 1e-9 {
        collapse.step(end).unwrap();
    }
    collapse.profile().1
}

/// In the bulk of a collapse, which accelerates and is carried along, the error of a step is several times that of first order
/// less. (The tip, a few cells thick, meets new cells all the time.)
#[test]
fn a_collapse_has_a_smaller_error_in_time() {
    let errors = [true, false].map(|second_order| {
        let fine = heights(0.1, second_order, 1.0);
        let found = heights(0.9, second_order, 1.0);
        let deep = fine.iter().zip(&found).filter(|(h, _)| **h > 0.6);
        deep.map(|(a, b)| (a - b).abs()).sum::<f64>() / fine.iter().sum::<f64>()
    });
    println!("error of the bulk with second and first order: {errors:.6?}");
    assert!(errors[0] < 0.4 * errors[1], "{errors:?}");
}
