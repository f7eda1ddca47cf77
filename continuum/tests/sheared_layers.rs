//! Plane shear and the vertical chute against their exact solutions.
use std::ops::ControlFlow;

use colluvium_continuum::flow::YieldMethod;
use colluvium_continuum::layer::{LayerSolution, Options};
use colluvium_continuum::plane_shear::PlaneShearCase;
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::vertical_chute::VerticalChuteCase;
use colluvium_continuum::yield_step::{PrimalDualOptions, RegularisedOptions};

fn material() -> MuI {
    MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0)
}

fn chute(cells: usize) -> VerticalChuteCase {
    VerticalChuteCase {
        half_width: 1.0,
        load: 1.0,
        gravity: 0.5,
        rheology: material(),
        cells,
        columns: None,
    }
}

fn solve_chute(case: &VerticalChuteCase, options: &Options) -> LayerSolution {
    case.solve(options, &mut |_| ControlFlow::Continue(()))
        .unwrap()
}

#[test]
fn plane_shear_is_linear_to_round_off() {
    for wall_velocity in [1e-3, 1.0, -50.0] {
        for columns in [None, Some(4)] {
            let case = PlaneShearCase {
                gap: 2.0,
                wall_velocity,
                load: 300.0,
                rheology: MuI::new(0.32, 0.60, 0.4, 0.04, 0.6, 2500.0),
                cells: 16,
                columns,
            };
            let solution = case
                .solve(&Options::default(), &mut |_| ControlFlow::Continue(()))
                .unwrap();
            assert!(solution.velocity_error_max_relative < 1e-10);
            assert!(solution.pressure_error_l2_relative < 1e-12);
            // A shear rate γ̇ carries the stress at √(γ̇² + ε²), times γ̇/√(γ̇² + ε²).
            let stress = case.exact_shear_stress();
            let rate = wall_velocity.abs() / solution.units.velocity;
            let tolerance = (1e-6 / rate).powi(2) + 1e-10;
            for side in solution.boundary_shear_stress {
                assert!((side / stress - 1.0).abs() < tolerance, "{side} {stress}");
            }
            assert_eq!(solution.yielded_fraction, 1.0);
        }
    }
}

/// Half chute, plug for y < 0.64: errors and plug velocity of a converged independent prototype.
#[test]
fn chute_converges_at_second_order_through_the_yield_surface() {
    assert!((chute(16).exact_velocity(0.0) - 2.16587).abs() < 1e-5);
    assert!((chute(16).plug_half_width() - 0.64).abs() < 1e-14);
    let expected = [2.43e-2, 6.28e-3, 1.44e-3, 3.65e-4, 9.36e-5];
    let errors: Vec<f64> = [16, 32, 64, 128, 256]
        .iter()
        .map(|&cells| solve_chute(&chute(cells), &Options::default()).velocity_error_l2_relative)
        .collect();
    for (error, expected) in errors.iter().zip(expected) {
        assert!(
            (error / expected - 1.0).abs() < 0.01,
            "{error:e} {expected:e}"
        );
    }
    // Basilisk C: 1.95e-2 at 32 cells at best (harmonic mean), 7.3e-2 as it comes.
    assert!(errors[1] < 8e-3);
    let order = (errors[0] / errors[4]).log2() / 4.0;
    assert!(order >= 1.9, "order {order}");
}

#[test]
fn chute_has_a_rigid_plug_whose_strain_falls_with_the_floor() {
    for (strain_rate_floor, bound) in [(1e-4, 6e-4), (1e-6, 6e-6)] {
        let options = Options {
            method: YieldMethod::PrimalDual(PrimalDualOptions {
                strain_rate_floor,
                ..PrimalDualOptions::default()
            }),
            ..Options::default()
        };
        let solution = solve_chute(&chute(64), &options);
        let rigid = solution.z.iter().filter(|y| **y < 0.6).count();
        let fastest = solution.u[..rigid]
            .windows(2)
            .fold(0.0_f64, |m, pair| m.max((pair[1] - pair[0]).abs() * 64.0));
        assert!(fastest < bound, "{fastest:e}");
        assert!((solution.yielded_fraction - 0.36).abs() < 0.02);
        // τ at the wall is the weight of the half width, −ρ g W in the sense of rising y.
        assert!((solution.boundary_shear_stress[1] + 0.5).abs() < 1e-12);
    }
}

/// Negative control: the regularised viscosity shears the plug a hundred times as fast.
#[test]
fn regularised_viscosity_has_no_plug() {
    let options = Options {
        method: YieldMethod::Regularised(RegularisedOptions {
            largest_viscosity: 30.0,
            passes: 200,
        }),
        ..Options::default()
    };
    let solution = solve_chute(&chute(64), &options);
    let inner = (solution.u[0] - solution.u[31]) / 0.5;
    assert!(inner > 1e-3, "{inner:e}");
}

#[test]
fn chute_under_a_heavy_load_rests_and_under_a_light_one_is_refused() {
    let resting = VerticalChuteCase {
        load: 2.0,
        ..chute(32)
    };
    assert!(solve_chute(&resting, &Options::default()).max_speed < 5e-6);
    let light = VerticalChuteCase {
        load: 0.8,
        ..chute(32)
    };
    let message = light.validate().unwrap_err().to_string();
    assert!(
        message.contains("`load` = 0.8") && message.contains("0.8333"),
        "{message}"
    );
}

#[test]
fn chute_does_not_depend_on_columns_or_units() {
    let flat = solve_chute(&chute(24), &Options::default());
    let wide = VerticalChuteCase {
        columns: Some(4),
        ..chute(24)
    };
    let periodic = solve_chute(&wide, &Options::default());
    // ρ g W/P = 0.5 and d/W = 0.04 again, at half the solid fraction: I is formed with the density
    // of the grains, so u/√(P/ρ) falls by √½.
    let large = VerticalChuteCase {
        half_width: 3.0,
        load: 4.2,
        gravity: 1e-3,
        rheology: MuI::new(0.32, 0.60, 0.4, 0.12, 0.5, 1400.0),
        ..chute(24)
    };
    let scaled = solve_chute(&large, &Options::default());
    assert!(periodic.spread_along_x < 1e-9);
    for (a, b) in flat.u.iter().zip(&periodic.u) {
        assert!((a - b).abs() < 1e-8);
    }
    let scale = (0.5 * 4.2_f64 / 700.0).sqrt();
    for (a, b) in flat.u.iter().zip(&scaled.u) {
        assert!((b / (a * scale) - 1.0).abs() < 1e-5, "{a} {b}");
    }
}
