//! How far matter at rest creeps: by the strain-rate floor ε of the solver and no more under μ(I), by itself under the
//! regularised law of Barker and Gray.

use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::free_surface::plane::Plane;
use colluvium_continuum::free_surface::{SurfaceFlow, SurfaceOptions};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::{BarkerGray, MuI, Rheology};

fn grains(diameter: f64) -> MuI {
    MuI::new(0.32, 0.60, 0.4, diameter, 1.0, 1.0)
}

fn with_floor(strain_rate_floor: f64) -> SurfaceOptions {
    let mut options = SurfaceOptions::default();
    options.solver.strain_rate_floor = strain_rate_floor;
    options
}

/// A column twice as wide as high. The lower half of what lies within a quarter of its width of the wall never flows: it creeps
/// at 0.27 ε H at most. The top comes down by 0.4 ε H t until the flow along the surface has come back to x = 0, at
/// t = 3.25 √(H/g), and by 0.62 ε H t from the time of rest on, when no speed exceeds 0.76 ε H.
#[test]
fn core_of_a_column_stays() {
    let case = CollapseCase {
        aspect: 0.5,
        height: 1.0,
        gravity: 1.0,
        rheology: grains(1.0 / 30.0),
        cells: 64,
        length_scaled: 5.0,
        overhang_degrees: 0.0,
    };
    let top = |collapse: &Collapse| collapse.profile().1[0];
    let core_speed = |collapse: &Collapse| {
        let fields = collapse.fields();
        let core = fields
            .iter()
            .filter(|f| f.upper[0] < 0.5 && f.upper[1] < 0.5);
        core.map(|f| f.velocity[0].hypot(f.velocity[1]))
            .fold(0.0, f64::max)
    };
    for floor in [1e-5, 1e-6] {
        let mut collapse = Collapse::new(&case, &with_floor(floor)).unwrap();
        let (mut rests, mut in_motion, mut early_fall) = (false, 0.0_f64, 0.0);
        while !rests {
            let step = collapse.step(12.0).unwrap();
            rests = collapse.is_at_rest(&step);
            assert!(collapse.time() < 8.0);
            in_motion = in_motion.max(core_speed(&collapse) / floor);
            if collapse.time() < 3.0 {
                early_fall = (1.0 - top(&collapse)) / (floor * collapse.time());
            }
        }
        let (start, before) = (collapse.time(), top(&collapse));
        let mut at_rest = 0.0_f64;
        while collapse.time() < start + 5.0 - 1e-9 {
            let step = collapse.step(start + 5.0).unwrap();
            at_rest = at_rest.max(step.max_speed / floor);
        }
        let fall = (before - top(&collapse)) / (floor * 5.0);
        println!(
            "ε = {floor:e}: core in motion {in_motion:.2} ε, its top falls by {early_fall:.3} ε t; from rest on {fall:.3} ε t, all speeds {at_rest:.3} ε"
        );
        assert!((0.0..1.0).contains(&early_fall) && (0.0..1.0).contains(&fall));
        assert!(at_rest <= 1.0 && in_motion <= 1.0, "{at_rest} {in_motion}");
    }
}

/// Speed with which a pile of slope 0.3 on a rough floor creeps, and how far the highest column of it has sunk, after a
/// time of 2 √(H/g).
fn pile<R: Rheology>(law: R, floor: f64) -> (f64, f64) {
    let (columns, rows, h) = (48, 12, 1.0 / 16.0);
    let axis = |cells: usize, low| Axis::Bounded {
        length: cells as f64 * h,
        cells,
        low,
        high: Boundary::FreeSlip,
    };
    let rough = Boundary::NoSlip { velocity: 0.0 };
    let fractions = (0..columns * rows).map(|cell| {
        let (x, z) = ((cell % columns) as f64, (cell / columns) as f64);
        let surface = Plane {
            normal: [0.3, 1.0, 0.0],
            offset: 0.7 / h - 0.3 * x - z,
        };
        surface.volume_in([0.0; 3], [1.0; 3])
    });
    let mut flow = SurfaceFlow::at_rest(
        Grid::with_moving_surface([axis(columns, Boundary::FreeSlip), axis(rows, rough)]).unwrap(),
        fractions.collect(),
        law,
        [0.0, -1.0],
        with_floor(floor),
    )
    .unwrap();
    let before = flow.heights()[0];
    while flow.state().time < 2.0 - 1e-9 {
        flow.step(2.0 - flow.state().time).unwrap();
    }
    (flow.max_speed(), before - flow.heights()[0])
}

/// Under μ(I) a pile of slope 0.3 creeps at 0.82 ε H, whatever ε. Under Barker and Gray's law it sinks by itself, at
/// 5.95e-5 √(gH): the speed does not depend on ε, and as the law knows grains by γ̇ d alone a creep without inertia is
/// inverse to d.
#[test]
fn piles_creep_under_the_regularised_law_only() {
    let [coarse, fine] = [1e-6, 5e-7].map(|floor| {
        let (speed, sinks) = pile(grains(1.0 / 30.0), floor);
        println!("μ(I), ε = {floor:e}: {speed:.3e}, sinks by {sinks:.3e}");
        assert!(speed < floor && sinks < 2.0 * floor, "{speed} {sinks}");
        speed
    });
    assert!((coarse / fine - 2.0).abs() < 0.02, "{coarse} {fine}");
    let creeping = |diameter, floor| {
        let (speed, sinks) = pile(BarkerGray::of(grains(diameter)).unwrap(), floor);
        println!(
            "Barker & Gray, d = {diameter:.4}, ε = {floor:e}: {speed:.3e}, sinks by {sinks:.3e}"
        );
        assert!(sinks > 50.0 * 2.0 * floor && speed > 50.0 * coarse);
        speed
    };
    let speeds = [1e-6, 5e-7].map(|floor| creeping(1.0 / 30.0, floor));
    assert!((speeds[0] / speeds[1] - 1.0).abs() < 0.02, "{speeds:?}");
    let of_half = creeping(1.0 / 60.0, 5e-7);
    assert!((of_half / speeds[1] - 2.0).abs() < 0.02, "{of_half}");
}
