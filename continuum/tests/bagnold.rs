//! Bagnold flow against its exact solution.
//!
//! The reference material (μ_s 0.32, Δμ 0.28, I_0 0.4, d = 0.04 H, slope 0.43 rad, φ = 1) is the one
//! of the Basilisk test case; Basilisk C 25-02-26 on a fixed flat surface has relative L2 errors
//! 7.22e-3, 1.97e-3, 5.21e-4, 1.39e-4 at 16, 32, 64, 128 cells (own measurement).
use std::ops::ControlFlow;

use colluvium_continuum::Error;
use colluvium_continuum::bagnold::{BagnoldCase, BagnoldSolution};
use colluvium_continuum::discretisation::ThresholdPressure;
use colluvium_continuum::flow::YieldMethod;
use colluvium_continuum::layer::Options;
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::yield_step::{PrimalDualOptions, RegularisedOptions};

const BASILISK_L2: [(usize, f64); 4] =
    [(16, 7.22e-3), (32, 1.97e-3), (64, 5.21e-4), (128, 1.39e-4)];

fn reference(cells: usize) -> BagnoldCase {
    BagnoldCase {
        slope: 0.43,
        depth: 1.0,
        gravity: 1.0,
        rheology: MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0),
        cells,
        columns: None,
    }
}

fn solve_with(case: &BagnoldCase, options: &Options) -> BagnoldSolution {
    case.solve(options, &mut |_| ControlFlow::Continue(()))
        .unwrap()
}

fn solve(case: &BagnoldCase) -> BagnoldSolution {
    solve_with(case, &Options::default())
}

fn with_floor(strain_rate_floor: f64) -> Options {
    Options {
        method: YieldMethod::PrimalDual(PrimalDualOptions {
            strain_rate_floor,
            ..PrimalDualOptions::default()
        }),
        ..Options::default()
    }
}

#[test]
fn exact_velocity_is_that_of_the_basilisk_case() {
    let case = reference(16);
    let inertial_number = 0.4 * (0.43_f64.tan() - 0.32) / (0.60 - 0.43_f64.tan());
    let surface = 2.0 / 3.0 * inertial_number / 0.04 * 0.43_f64.cos().sqrt();
    assert!((case.exact_velocity(1.0) - surface).abs() < 1e-13);
    assert!((surface - 6.232).abs() < 1e-3);
    assert_eq!(case.exact_velocity(0.0), 0.0);
}

#[test]
fn second_order_and_ten_times_below_the_peer() {
    let errors: Vec<f64> = BASILISK_L2
        .iter()
        .map(|&(cells, _)| solve(&reference(cells)).velocity_error_l2_relative)
        .collect();
    for (error, (cells, peer)) in errors.iter().zip(BASILISK_L2) {
        assert!(*error < 0.105 * peer, "{cells} cells: {error:e}");
    }
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!(order >= 1.9, "order {order}");
    }
}

/// Negative control: with the threshold's pressure in cells, as where the viscosity lives in cells,
/// the error is twenty times as large, and the bound of the test above is missed on every grid.
#[test]
fn pressure_in_cells_spoils_the_accuracy() {
    let options = Options {
        threshold_pressure: ThresholdPressure::Cell,
        ..Options::default()
    };
    for (cells, peer) in BASILISK_L2 {
        let error = solve_with(&reference(cells), &options).velocity_error_l2_relative;
        assert!(error > peer, "{cells} cells: {error:e}");
    }
}

#[test]
fn few_iterations_lead_from_rest_to_the_steady_state() {
    for cells in [16, 64, 512] {
        let solution = solve(&reference(cells));
        assert!(solution.history[0].newton_iterations <= 10);
        assert!(solution.linear_solves <= 12);
        let last = solution.history[solution.steps - 1].residuals;
        assert!(last.momentum < 1e-10 && last.divergence < 1e-12 && last.stress < 1e-10);
    }
}

#[test]
fn base_carries_the_weight_of_the_layer() {
    let case = reference(64);
    let solution = solve(&case);
    let weight = case.exact_shear_stress(0.0);
    assert!((weight - 0.43_f64.sin()).abs() < 1e-15);
    assert!((solution.boundary_shear_stress[0] / weight - 1.0).abs() < 1e-12);
    assert_eq!(solution.boundary_shear_stress[1], 0.0);
    assert!(solution.pressure_error_l2_relative < 1e-13);
}

#[test]
fn one_huge_step_equals_a_march_to_the_steady_state() {
    let at_once = solve(&reference(32));
    let mut options = Options::default();
    options.marching.time_step = 0.1;
    options.marching.growth = 1.3;
    let marched = solve_with(&reference(32), &options);
    assert!(marched.steps > 20);
    for (a, b) in at_once.u.iter().zip(&marched.u) {
        assert!((a - b).abs() < 1e-4 * at_once.max_speed, "{a} {b}");
    }
}

/// One step from rest at time steps from 0.01 to 1e8 √(H/g); the peer blows up at 0.5.
#[test]
fn step_from_rest_converges_at_any_time_step() {
    for cells in [32, 128] {
        let mut slower = 0.0;
        for exponent in -2..=8 {
            let dt = 10.0_f64.powi(exponent);
            let mut options = Options::default();
            options.marching.time_step = dt;
            options.marching.end_time = Some(dt);
            let solution = solve_with(&reference(cells), &options);
            assert_eq!((solution.steps, solution.history[0].dt), (1, dt));
            assert!(solution.history[0].newton_iterations <= 40);
            assert!(solution.history[0].residuals.momentum < 1e-9);
            // The layer gains momentum with time and never overshoots the steady flow.
            let mean = solution.history[0].mean_velocity;
            assert!(mean > slower && mean < 0.601 * 6.232);
            slower = mean;
        }
    }
}

#[test]
fn momentum_grows_by_weight_less_friction() {
    let mut options = Options::default();
    options.marching.time_step = 0.2;
    options.marching.end_time = Some(0.2);
    let solution = solve_with(&reference(48), &options);
    let impulse = 0.2 * (0.43_f64.sin() - solution.boundary_shear_stress[0]);
    let mean = solution.history[0].mean_velocity;
    assert!((mean / impulse - 1.0).abs() < 1e-10);
    // Stopped on its way, which is not to be taken for its end.
    assert!(!solution.is_steady && solve(&reference(48)).is_steady);
}

#[test]
fn periodic_columns_give_the_flat_answer() {
    let flat = solve(&reference(24));
    let case = BagnoldCase {
        columns: Some(5),
        ..reference(24)
    };
    let periodic = solve(&case);
    assert_eq!(periodic.cells, 5 * 24);
    // Linear systems, the first of a step solved to 1e-2, leave that much of a velocity of 10.
    assert!(periodic.spread_along_x < 5e-11);
    for (a, b) in flat.u.iter().zip(&periodic.u) {
        assert!((a - b).abs() < 1e-9);
    }
}

#[test]
fn layer_below_the_static_angle_rests() {
    for tangent in [0.0_f64, 0.1, 0.25, 0.309] {
        let case = BagnoldCase {
            slope: tangent.atan(),
            ..reference(64)
        };
        for time_step in [0.01, 1.0, 1e8] {
            let mut options = with_floor(1e-6);
            options.marching.time_step = time_step;
            let solution = solve_with(&case, &options);
            assert!(solution.exact_u.iter().all(|u| *u == 0.0));
            assert!(solution.max_speed < 5e-6, "{:e}", solution.max_speed);
            assert_eq!(solution.yielded_fraction, 0.0);
        }
    }
}

/// What is left of motion at rest is the strain-rate floor: γ̇ = ε r/√(1 − r²) where the stress is a
/// fraction r of the yield stress.
#[test]
fn creep_at_rest_is_the_strain_rate_floor() {
    for (tangent, floor) in [(0.25_f64, 1e-5), (0.25, 1e-6), (0.31, 1e-6)] {
        let case = BagnoldCase {
            slope: tangent.atan(),
            ..reference(64)
        };
        let ratio = tangent / 0.32;
        let surface = floor * ratio / (1.0 - ratio * ratio).sqrt();
        let speed = solve_with(&case, &with_floor(floor)).max_speed;
        assert!(
            (speed / surface - 1.0).abs() < 0.01,
            "{speed:e} {surface:e}"
        );
    }
}

/// Negative control: a viscosity of limited size lets a layer below the static angle creep at
/// g sinθ h²/(2 η_max), as the peers' layers do.
#[test]
fn regularised_viscosity_creeps_where_the_layer_should_rest() {
    let case = BagnoldCase {
        slope: 0.25_f64.atan(),
        ..reference(64)
    };
    for largest_viscosity in [10.0, 100.0] {
        let options = Options {
            method: YieldMethod::Regularised(RegularisedOptions {
                largest_viscosity,
                passes: 1,
            }),
            ..Options::default()
        };
        let speed = solve_with(&case, &options).max_speed;
        let expected = case.slope.sin() / (2.0 * largest_viscosity);
        assert!((speed / expected - 1.0).abs() < 1e-3);
        assert!(speed > 5e-6);
    }
}

/// The comparison solver reaches the same steady state, in two hundred times the linear solves.
#[test]
fn regularised_viscosity_agrees_where_nothing_is_rigid() {
    let newton = solve(&reference(32));
    let mut options = Options {
        method: YieldMethod::Regularised(RegularisedOptions {
            largest_viscosity: 1e3,
            passes: 1,
        }),
        ..Options::default()
    };
    options.marching.time_step = 1.0;
    let lagged = solve_with(&reference(32), &options);
    for (a, b) in newton.u.iter().zip(&lagged.u) {
        assert!((a - b).abs() < 1e-5 * newton.max_speed);
    }
    assert!(lagged.linear_solves > 100 * newton.linear_solves);
}

#[test]
fn cohesive_layer_has_its_plug() {
    let mut case = reference(128);
    case.rheology.cohesion = 0.02;
    let plug = 0.02 / (0.43_f64.cos() * (0.43_f64.tan() - 0.32));
    assert!((case.plug_thickness() - plug).abs() < 1e-14);
    // The exact profile satisfies τ = c + μ(I) p below the plug.
    for z in [0.2, 0.5, 0.8] {
        let step = 1e-5;
        let rate = (case.exact_velocity(z + step) - case.exact_velocity(z - step)) / (2.0 * step);
        let law = case.rheology;
        let mu = law.mu(law.inertial_number(rate, case.exact_pressure(z)));
        let bearing = 0.02 + mu * case.exact_pressure(z);
        assert!((bearing / case.exact_shear_stress(z) - 1.0).abs() < 1e-8);
    }
    let errors: Vec<f64> = [16, 32, 64, 128]
        .iter()
        .map(|&cells| solve(&BagnoldCase { cells, ..case }).velocity_error_l2_relative)
        .collect();
    assert!(errors[0] < 1.4e-3 && errors[3] < 2.1e-5, "{errors:?}");
    let order = (errors[0] / errors[3]).log2() / 3.0;
    assert!(order >= 1.9, "order {order}");
    let solution = solve(&case);
    assert!((solution.yielded_fraction - (1.0 - plug)).abs() < 0.02);
}

#[test]
fn units_do_not_matter() {
    let here = solve(&reference(64));
    // A 30 m layer on a comet, g = 1.8e-4 m/s², grains of 1.2 m = 0.04 h.
    let depth = 30.0;
    let gravity = 1.8e-4;
    let mut case = reference(64);
    case.depth = depth;
    case.gravity = gravity;
    case.rheology = MuI::new(0.32, 0.60, 0.4, 1.2, 1.0, 533.0);
    let there = solve(&case);
    let scale = (gravity * depth).sqrt();
    for (a, b) in here.u.iter().zip(&there.u) {
        assert!((b / (a * scale) - 1.0).abs() < 1e-10);
    }
    assert!(
        (there.velocity_error_l2_relative / here.velocity_error_l2_relative - 1.0).abs() < 1e-6
    );
    assert_eq!(here.linear_solves, there.linear_solves);
}

#[test]
fn solid_fraction_enters_through_the_grain_density() {
    // u ∝ √φ at given grain density: I is formed with ρ_s, the weight with φ ρ_s.
    let mut loose = reference(32);
    loose.rheology.solid_fraction = 0.25;
    let (full, loose) = (solve(&reference(32)), solve(&loose));
    for (a, b) in full.u.iter().zip(&loose.u) {
        assert!((b / (0.5 * a) - 1.0).abs() < 1e-7);
    }
    assert!((loose.p[0] / (0.25 * full.p[0]) - 1.0).abs() < 1e-12);
}

#[test]
fn same_input_gives_the_same_bits() {
    let case = BagnoldCase {
        columns: Some(4),
        ..reference(16)
    };
    let (first, second) = (solve(&case), solve(&case));
    assert_eq!(first, second);
}

#[test]
fn well_posedness_is_reported() {
    assert_eq!(solve(&reference(32)).ill_posed_fraction, 0.0);
    // Just above the static angle I is below the well-posed window.
    let case = BagnoldCase {
        slope: 0.325_f64.atan(),
        ..reference(32)
    };
    let solution = solve(&case);
    assert!(solution.yielded_fraction > 0.999 && solution.ill_posed_fraction > 0.999);
}

#[test]
fn bad_input_is_refused_by_name() {
    let message = |case: BagnoldCase| {
        case.solve(&Options::default(), &mut |_| ControlFlow::Continue(()))
            .unwrap_err()
            .to_string()
    };
    let steep = message(BagnoldCase {
        slope: 0.61_f64.atan(),
        ..reference(16)
    });
    assert!(
        steep.contains("slope_degrees") && steep.contains("31.38") && steep.contains("30.96"),
        "{steep}"
    );
    let empty = message(BagnoldCase {
        cells: 0,
        ..reference(16)
    });
    assert!(empty.contains("grid.cells") && empty.contains("= 0"));
    let weightless = message(BagnoldCase {
        gravity: f64::NAN,
        ..reference(16)
    });
    assert!(weightless.contains("gravity"));
    let floor = reference(16).solve(&with_floor(1e-12), &mut |_| ControlFlow::Continue(()));
    assert!(matches!(
        floor,
        Err(Error::OutOfRange {
            key: "solver.strain_rate_floor",
            ..
        })
    ));
}

fn one_step(max_iterations: usize, dt: f64) -> Result<BagnoldSolution, Error> {
    let mut options = Options {
        method: YieldMethod::PrimalDual(PrimalDualOptions {
            max_iterations,
            ..PrimalDualOptions::default()
        }),
        ..Options::default()
    };
    options.marching.time_step = dt;
    options.marching.end_time = Some(dt);
    reference(32).solve(&options, &mut |_| ControlFlow::Continue(()))
}

/// With too few iterations allowed for the fast descent, the slow one with line search finds the
/// same state.
#[test]
fn line_search_finds_the_same_state() {
    let (fast, slow) = (one_step(40, 0.1).unwrap(), one_step(10, 0.1).unwrap());
    assert!(fast.linear_solves < 20 && slow.linear_solves > 20);
    assert_eq!(slow.steps, 1);
    for (a, b) in fast.u.iter().zip(&slow.u) {
        assert!((a - b).abs() < 1e-6 * fast.max_speed, "{a} {b}");
    }
}

#[test]
fn step_that_does_not_converge_is_halved() {
    let halved = one_step(8, 0.01).unwrap();
    let halvings = (0.01 / halved.history[0].dt).log2();
    assert!(halvings >= 1.0 && halvings.fract() == 0.0);
    assert!((halved.history[halved.steps - 1].time - 0.01).abs() < 1e-15);
    assert!(halved.history.iter().all(|r| r.residuals.momentum < 1e-9));
}

#[test]
fn step_that_cannot_converge_is_an_error() {
    let Err(Error::NotConverged {
        strain_rate_floor, ..
    }) = one_step(3, 0.01)
    else {
        panic!("a step was accepted");
    };
    assert!(strain_rate_floor > 1e-6);
}

#[test]
fn caller_may_stop_a_run() {
    let mut options = Options::default();
    options.marching.time_step = 0.1;
    let mut seen = 0;
    let outcome = reference(16).solve(&options, &mut |progress| {
        seen = progress.step;
        if progress.step == 3 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    assert_eq!(outcome.unwrap_err(), Error::Stopped { steps: 3 });
    assert_eq!(seen, 3);
}
