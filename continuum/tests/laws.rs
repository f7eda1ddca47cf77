//! The family of laws on an incline and in a chute, against their exact profiles.
use std::ops::ControlFlow;

use colluvium_continuum::bagnold::BagnoldCase;
use colluvium_continuum::layer::{LayerSolution, Options};
use colluvium_continuum::rheology::{BarkerGray, Coulomb, FrictionTable, Grains, MuI, ShearLaw};
use colluvium_continuum::vertical_chute::VerticalChuteCase;

fn mu_i() -> MuI {
    MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0)
}

fn barker_gray() -> BarkerGray {
    BarkerGray::of(mu_i()).unwrap()
}

fn bingham() -> Coulomb {
    Coulomb {
        mu: 0.0,
        cohesion: 0.1,
        viscosity: 0.2,
        density: 1.0,
    }
}

fn table() -> FrictionTable {
    let points: Vec<[f64; 2]> = [0.0, 0.01, 0.03, 0.1, 0.2, 0.4, 0.8, 1.6]
        .iter()
        .map(|i| [*i, mu_i().mu(*i)])
        .collect();
    let grains = Grains {
        diameter: 0.04,
        solid_fraction: 1.0,
        grain_density: 1.0,
        cohesion: 0.0,
    };
    FrictionTable::new(&points, grains).unwrap()
}

fn layer<L: ShearLaw>(rheology: L, slope: f64, cells: usize) -> BagnoldCase<L> {
    BagnoldCase {
        slope,
        depth: 1.0,
        gravity: 1.0,
        rheology,
        cells,
        columns: None,
    }
}

fn solve<L: ShearLaw>(case: &BagnoldCase<L>) -> LayerSolution {
    case.solve(&Options::default(), &mut |_| ControlFlow::Continue(()))
        .unwrap()
}

/// Errors on 16 to 128 cells, and the order from the first to the last.
fn orders<L: ShearLaw>(law: impl Fn() -> L, slope: f64) -> ([f64; 4], f64) {
    let errors = [16, 32, 64, 128]
        .map(|cells| solve(&layer(law(), slope, cells)).velocity_error_l2_relative);
    (errors, (errors[0] / errors[3]).log2() / 3.0)
}

/// The integral of the rate against the closed forms of μ(I) with and without cohesion, and of
/// Bingham's law.
#[test]
fn exact_profiles_are_the_closed_forms() {
    let (slope, i_0, d) = (0.43_f64, 0.4, 0.04);
    let (excess, margin) = (slope.tan() - 0.32, 0.60 - slope.tan());
    let scale = i_0 / d * slope.cos().sqrt();
    let dry = layer(mu_i(), slope, 16);
    for cohesion in [0.02, 1e-4] {
        let case = layer(MuI { cohesion, ..mu_i() }, slope, 16);
        let b = cohesion / slope.cos();
        let g = |y: f64| {
            let turn = (b / margin.powi(3)).sqrt() * (y * (margin / b).sqrt()).atan();
            2.0 / 3.0 * excess / margin * y.powi(3)
                - 2.0 * b * (1.0 + excess / margin) * (y / margin - turn)
        };
        for z in [0.05, 0.4, 0.8, 0.99] {
            let below = (1.0f64 - z).max(case.plug_thickness());
            let exact = scale * (g(1.0) - g(below.sqrt()));
            assert!((case.exact_velocity(z) / exact - 1.0).abs() < 1e-8, "{z}");
            let bagnold = 2.0 / 3.0 * scale * excess / margin * (1.0 - (1.0f64 - z).powf(1.5));
            assert!((dry.exact_velocity(z) / bagnold - 1.0).abs() < 1e-13);
        }
    }
    // Bingham: γ̇ = (ρ g sinθ ζ − c)/η below the plug.
    let case = layer(bingham(), 0.3, 16);
    let plug = 0.1 / 0.3_f64.sin();
    assert!((case.plug_thickness() - plug).abs() < 1e-14);
    for z in [0.1, 0.5, 0.9] {
        let below = (1.0f64 - z).max(plug);
        let exact = 0.5 * 0.3_f64.sin() / 0.2 * ((1.0 - plug).powi(2) - (below - plug).powi(2));
        assert!((case.exact_velocity(z) - exact).abs() < 1e-14);
    }
}

#[test]
fn barker_gray_converges_at_second_order_on_gentle_and_steep_slopes() {
    // Below μ_s, where the law creeps; between μ_s and μ_2; and beyond μ_2, where μ(I) has no
    // steady flow.
    for slope in [0.30_f64, 0.43, 0.60] {
        let (errors, order) = orders(barker_gray, slope);
        assert!(
            order >= 1.9 && errors[2] < 1e-4,
            "{slope}: {order} {errors:?}"
        );
    }
}

#[test]
fn bingham_converges_at_second_order() {
    let (errors, order) = orders(bingham, 0.3);
    assert!(order >= 1.9 && errors[3] < 5e-4, "{order} {errors:?}");
}

/// The table of a law flows as its own exact solution says, and near the law it was taken from.
#[test]
fn table_converges_at_second_order() {
    let (errors, order) = orders(table, 0.43);
    assert!(order >= 1.9 && errors[2] < 1e-4, "{order} {errors:?}");
    let law = layer(mu_i(), 0.43, 16).exact_velocity(1.0);
    let tabled = layer(table(), 0.43, 16).exact_velocity(1.0);
    assert!((tabled / law - 1.0).abs() < 0.02, "{tabled} {law}");
}

#[test]
fn chute_of_bingham_and_of_barker_gray_material() {
    fn errors<L: ShearLaw>(law: impl Fn() -> L) -> [f64; 3] {
        [16, 32, 64].map(|cells| {
            let case = VerticalChuteCase {
                half_width: 1.0,
                load: 1.0,
                gravity: 0.5,
                rheology: law(),
                cells,
                columns: None,
            };
            case.solve(&Options::default(), &mut |_| ControlFlow::Continue(()))
                .unwrap()
                .velocity_error_l2_relative
        })
    }
    for errors in [errors(bingham), errors(barker_gray)] {
        let order = (errors[0] / errors[2]).log2() / 2.0;
        assert!(order > 1.8 && errors[2] < 3e-3, "{order} {errors:?}");
    }
}

/// A slope below μ_s at rest under Coulomb's law and μ(I), and creeping at the exact speed under
/// Barker and Gray's, a thousand times as fast as the floor that the solver needs.
#[test]
fn only_the_regularised_law_creeps() {
    let slope = 0.29_f64.atan();
    let coulomb = Coulomb {
        mu: 0.32,
        cohesion: 0.0,
        viscosity: 0.0,
        density: 1.0,
    };
    assert!(solve(&layer(coulomb, slope, 32)).max_speed < 5e-6);
    assert!(solve(&layer(mu_i(), slope, 32)).max_speed < 5e-6);
    let creeping = layer(barker_gray(), slope, 32);
    let solution = solve(&creeping);
    // I = A exp(−α/tan²θ), with A from μ(I_1) on both branches.
    let joint = barker_gray().joint();
    let amplitude = joint * (1.9 / barker_gray().mu(joint).powi(2)).exp();
    let inertial_number = amplitude * (-1.9 / 0.29_f64.powi(2)).exp();
    let exact = 2.0 / 3.0 * inertial_number / 0.04 * slope.cos().sqrt();
    assert!((creeping.exact_velocity(1.0) / exact - 1.0).abs() < 1e-9);
    assert!(exact > 1e-3 && (solution.max_speed / exact - 1.0).abs() < 5e-3);
    assert!(solution.velocity_error_l2_relative < 1e-3);
}

#[test]
fn layers_without_steady_state_are_refused() {
    let coulomb = Coulomb {
        mu: 0.32,
        cohesion: 0.0,
        viscosity: 0.0,
        density: 1.0,
    };
    let message = layer(coulomb, 0.43, 16).validate().unwrap_err().to_string();
    assert!(
        message.contains("slope_degrees") && message.contains("17.74"),
        "{message}"
    );
    assert!(layer(table(), 0.52, 16).validate().is_err());
    assert!(layer(barker_gray(), 1.2, 16).validate().is_ok());
}
