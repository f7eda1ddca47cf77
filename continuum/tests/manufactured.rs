//! A manufactured solution of the full law in two dimensions: velocity, pressure and viscosity vary
//! along both axes, and the force that sustains them is put in from outside.
//!
//! Without advection of momentum. Stream function ψ = U z²/2 + a sin(kx) f(z), f = z²(3 − 2z), between a
//! fixed rough wall and one that moves at U and gives way normally, under the normal stress of the
//! solution; p = 1 + 0.3 sin(kx + 1) cos(2z). The inertial number runs from 0.08 to 0.3, inside the
//! well-posed window.
use std::f64::consts::TAU;

use colluvium_continuum::discretisation::{Discretisation, ThresholdPressure};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::{BarkerGray, MuI, Rheology, strain_rate_norm};
use colluvium_continuum::yield_step::{
    FlowState, PrimalDual, PrimalDualOptions, StepProblem, StepReport, YieldSolver,
};

const WALL_VELOCITY: f64 = 1.0;
const AMPLITUDE: f64 = 0.01;

fn law() -> MuI {
    MuI::new(0.32, 0.60, 0.4, 0.2, 1.0, 1.0)
}

/// f, f′ and f″.
fn shape(z: f64) -> [f64; 3] {
    [z * z * (3.0 - 2.0 * z), 6.0 * z * (1.0 - z), 6.0 - 12.0 * z]
}

fn velocity(x: f64, z: f64) -> [f64; 2] {
    let [f, slope, _] = shape(z);
    [
        WALL_VELOCITY * z + AMPLITUDE * (TAU * x).sin() * slope,
        -AMPLITUDE * TAU * (TAU * x).cos() * f,
    ]
}

fn pressure(x: f64, z: f64) -> f64 {
    1.0 + 0.3 * (TAU * x + 1.0).sin() * (2.0 * z).cos()
}

fn strain_rate(x: f64, z: f64) -> [f64; 2] {
    let [f, slope, bend] = shape(z);
    let (sine, cosine) = (TAU * x).sin_cos();
    [
        2.0 * AMPLITUDE * TAU * cosine * slope,
        WALL_VELOCITY + AMPLITUDE * sine * (bend + TAU * TAU * f),
    ]
}

/// τ_xx = −τ_zz and τ_xz.
fn stress(law: &impl Rheology, x: f64, z: f64) -> [f64; 2] {
    let gamma = strain_rate(x, z);
    let rate = strain_rate_norm(gamma);
    let kappa = law.threshold(rate, pressure(x, z)).stress;
    gamma.map(|g| kappa * g / rate)
}

/// Central difference of sixth order.
fn derivative(f: impl Fn(f64) -> f64) -> f64 {
    let h = 2e-3;
    let pair = |n: f64| (f(n * h) - f(-n * h)) / h;
    0.75 * pair(1.0) - 0.15 * pair(2.0) + pair(3.0) / 60.0
}

/// ∇p − ∇·τ.
fn force(law: &impl Rheology, x: f64, z: f64) -> [f64; 2] {
    let s = |x, z| stress(law, x, z);
    [
        derivative(|e| pressure(x + e, z) - s(x + e, z)[0]) - derivative(|e| s(x, z + e)[1]),
        derivative(|e| pressure(x, z + e) + s(x, z + e)[0]) - derivative(|e| s(x + e, z)[1]),
    ]
}

struct Errors {
    velocity: f64,
    pressure: f64,
    report: StepReport,
}

/// Relative L2 errors of the steady state on cells × cells, in one step from rest.
fn errors(law: &impl Rheology, cells: usize, threshold_pressure: ThresholdPressure) -> Errors {
    errors_under(law, law, cells, threshold_pressure)
}

/// The same under the force that another law would need.
fn errors_under(
    law: &impl Rheology,
    forced: &impl Rheology,
    cells: usize,
    threshold_pressure: ThresholdPressure,
) -> Errors {
    let along = Axis::Periodic { length: 1.0, cells };
    let across = Axis::Bounded {
        length: 1.0,
        cells,
        low: Boundary::NoSlip { velocity: 0.0 },
        high: Boundary::LoadedWall {
            velocity: WALL_VELOCITY,
            pressure: 0.0,
        },
    };
    let discretisation =
        Discretisation::new(Grid::new([along, across]).unwrap(), threshold_pressure);
    let h = 1.0 / cells as f64;
    let grid = discretisation.grid();
    // Positions of the unknowns: u on the left faces of cells, w on the upper ones.
    let position = |component: usize, n: usize| {
        let (i, k) = ((n % cells) as f64, (n / cells) as f64);
        match component {
            0 => [i * h, (k + 0.5) * h],
            _ => [(i + 0.5) * h, (k + 1.0) * h],
        }
    };
    let mut load = vec![0.0; grid.velocities()];
    let mut exact = vec![0.0; grid.velocities()];
    for component in 0..2 {
        for (n, unknown) in grid.component(component).enumerate() {
            let [x, z] = position(component, n);
            let is_top = component == 1 && n / cells == cells - 1;
            // Half a cell belongs to a face on the edge of the grid.
            let centre = if is_top { z - 0.25 * h } else { z };
            exact[unknown] = velocity(x, z)[component];
            load[unknown] = discretisation.mass()[unknown] * force(forced, x, centre)[component];
            if is_top {
                load[unknown] -= h * (pressure(x, z) + stress(forced, x, z)[0]);
            }
        }
    }
    let mut state = FlowState::at_rest(&discretisation, vec![1.0; grid.cells()]);
    let problem = StepProblem {
        discretisation: &discretisation,
        rheology: law,
        load: &load,
        dt: 1e8,
    };
    let mut solver = PrimalDual::new(&discretisation, PrimalDualOptions::default()).unwrap();
    let report = solver.step(&problem, &mut state).unwrap();
    assert!(report.converged, "{report:?}");
    let exact_pressure: Vec<f64> = (0..grid.cells())
        .map(|n| {
            pressure(
                ((n % cells) as f64 + 0.5) * h,
                ((n / cells) as f64 + 0.5) * h,
            )
        })
        .collect();
    let relative = |values: &[f64], exact: &[f64]| {
        let miss: f64 = values.iter().zip(exact).map(|(a, b)| (a - b).powi(2)).sum();
        (miss / exact.iter().map(|b| b * b).sum::<f64>()).sqrt()
    };
    Errors {
        velocity: relative(&state.u, &exact),
        pressure: relative(&state.p, &exact_pressure),
        report,
    }
}

/// Orders of velocity and pressure over two doublings.
fn orders(law: &impl Rheology, threshold_pressure: ThresholdPressure) -> ([f64; 2], Errors) {
    let [coarse, middle, fine] = [8, 16, 32].map(|cells| errors(law, cells, threshold_pressure));
    for errors in [&coarse, &middle, &fine] {
        assert!(errors.report.linear_solves <= 12, "{:?}", errors.report);
    }
    let order = |a: f64, b: f64| 0.5 * (a / b).log2();
    (
        [
            order(coarse.velocity, fine.velocity),
            order(coarse.pressure, fine.pressure),
        ],
        fine,
    )
}

#[test]
fn velocity_and_pressure_converge_at_second_order() {
    let (order, fine) = orders(&law(), ThresholdPressure::Corner);
    assert!(order[0] >= 1.95 && order[1] >= 1.9, "{order:?}");
    assert!(fine.velocity < 3.5e-4 && fine.pressure < 3.4e-4);
}

#[test]
fn regularised_law_of_barker_and_gray_converges_likewise() {
    let (order, fine) = orders(&BarkerGray::of(law()).unwrap(), ThresholdPressure::Corner);
    assert!(order[0] >= 1.95 && order[1] >= 1.9, "{order:?}");
    assert!(fine.velocity < 3.5e-4 && fine.pressure < 3.4e-4);
}

/// Negative control: the force of another friction sustains another flow.
#[test]
fn force_of_another_law_is_told_apart() {
    let other = MuI {
        mu_s: 0.40,
        ..law()
    };
    let right = errors(&law(), 16, ThresholdPressure::Corner).velocity;
    let wrong = errors_under(&law(), &other, 16, ThresholdPressure::Corner).velocity;
    assert!(wrong > 5.0 * right, "{wrong:e} {right:e}");
}
