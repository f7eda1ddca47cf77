//! Uniform translation and rigid rotation of both sides at once exchange no force.

use super::*;
use crate::overlap::{OverlapSettings, Scales};
use colluvium_dem::{ContactLaw, Domain, Grain, Hooke, Setup, TangentialSpring, Threads, Wall};

const WIDTH: usize = 22;
const LAYERS: usize = 14;
/// Layers of cells, from the floor, between whose middles velocities are interpolated from both sides.
const INSIDE: usize = 5;

/// Grains on a cubic lattice with every third layer of x shifted up, which no mean is symmetric to.
fn grains(spin: Vector3<f64>) -> Vec<Grain> {
    let place = |n: usize| {
        let (i, j, k) = (n / (WIDTH * LAYERS), n / LAYERS % WIDTH, n % LAYERS);
        let shift = 0.07 * (i % 3) as f64;
        Vector3::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.45 + shift)
    };
    let ball = |n| Grain {
        spin,
        ..Grain::at_rest(place(n), 0.45 + 0.01 * (n % 5) as f64, 1.9)
    };
    (0..WIDTH * WIDTH * LAYERS).map(ball).collect()
}

/// A bowl in which both sides drift and turn, the grains at a rate of their own.
fn joined(rate: Vector3<f64>, drift: Vector3<f64>, ours: Vector3<f64>) -> Bowl {
    let law = ContactLaw::linear(
        Hooke::matched(1e4, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 0.5),
        None,
    );
    let width = WIDTH as f64;
    let mut simulation = Simulation::new(Setup {
        domain: Domain {
            lower: Vector3::repeat(-1.0),
            upper: Vector3::repeat(2.0 * width),
            periodic: [false; 3],
        },
        gravity: -Vector3::z(),
        law: law.into(),
        grains: grains(ours),
        walls: vec![Wall::plane(Vector3::zeros(), Vector3::z())],
        bodies: Vec::new(),
        timestep: 1e-3,
        threads: Threads::Serial,
    })
    .unwrap();
    let scales = Scales {
        diameter: 1.0,
        time: 1.0,
        density: 1.0,
        stiffness: 1e4,
    };
    let settings = OverlapSettings {
        cell: Some(2.0),
        inner: Some(2.0),
        buffer: Some(2.0),
        ..OverlapSettings::default()
    };
    let spec = BowlSpec {
        low: [0.0; 3],
        size: [width; 2],
        gravity: 1.0,
        law: MuI::new(0.36, 0.70, 0.3, 1.0, 1.9 * 0.52, 1.0),
        options: SurfaceOptions::default(),
        edges: [[0.5 * width - 9.0, 0.5 * width + 9.0]; 2],
        bottom: 2.0,
        settings: settings.resolve(&scales, false).unwrap(),
        ball: None,
        growth: None,
    };
    let mut bowl = Bowl::cut(spec, &mut simulation).unwrap();
    let centre = Vector3::new(0.4, 0.6, 0.5) * width;
    let turn = |rate: Vector3<f64>, at: Vector3<f64>| drift + rate.cross(&(at - centre));
    simulation.give_velocity(|g| turn(ours, g.position));
    let mut state = bowl.flow.state().clone();
    let cells = bowl.layout.cells;
    for axis in 0..3 {
        let mut counts = cells.counts;
        counts[axis] += 1;
        for (face, u) in state.velocity[axis].iter_mut().enumerate() {
            let index = [
                face % counts[0],
                face / counts[0] % counts[1],
                face / (counts[0] * counts[1]),
            ];
            let at = Vector3::from_fn(|a, _| {
                let half = if a == axis { 0.0 } else { 0.5 };
                (index[a] as f64 + half) * cells.spacing[a]
            });
            *u = turn(rate, at)[axis] / bowl.units.velocity;
        }
    }
    bowl.flow.set_state(state).unwrap();
    bowl.sighting.look(&mut simulation);
    bowl.see_grains();
    bowl.view.look(&bowl.flow, &cells, &bowl.units, 0.0);
    bowl.agree();
    bowl.lay(&mut simulation).unwrap();
    bowl
}

/// Largest acceleration of the relaxation, angular acceleration of spins, and slip of the shell on a face, below the surface.
fn exchanged(bowl: &Bowl) -> [f64; 3] {
    let cells = &bowl.layout.cells;
    let inside = |cell: usize| cells.index(cell)[2] < INSIDE;
    let largest = |rows: &[Vector3<f64>]| {
        let rows = rows.iter().enumerate().filter(|(cell, _)| inside(*cell));
        rows.fold(0.0, |most: f64, (_, row)| most.max(row.norm()))
    };
    let shells = bowl.faces.all.iter().zip(&bowl.scratch.shell);
    let slips = shells.filter(|(face, _)| inside(face.cells[0]));
    [
        largest(&bowl.joint.accelerations),
        largest(&bowl.joint.spins),
        slips.fold(0.0, |most: f64, (_, s)| most.max(s.slip().norm())),
    ]
}

#[test]
fn what_moves_and_turns_as_one_exchanges_nothing() {
    let row = Vector3::new;
    for (rate, drift) in [
        (row(0.0, 0.0, 0.0), row(0.3, -0.1, 0.2)),
        (row(0.0, 0.0, 0.2), row(0.0, 0.0, 0.0)),
        (row(0.1, -0.3, 0.2), row(0.2, 0.1, -0.1)),
    ] {
        let [acceleration, spin, slip] = exchanged(&joined(rate, drift, rate));
        println!("{rate:?} {drift:?}: {acceleration:.1e} {spin:.1e} {slip:.1e}");
        assert!(acceleration < 1e-12 && spin < 1e-12 && slip < 1e-12);
    }
}

/// The control: both turn, but not at the same rate.
#[test]
fn what_turns_at_another_rate_does() {
    let rate = Vector3::new(0.1, -0.3, 0.2);
    let [acceleration, spin, slip] = exchanged(&joined(rate, Vector3::zeros(), 1.1 * rate));
    assert!(
        acceleration > 1e-2 && spin > 1e-3 && slip > 1e-2,
        "{acceleration:e} {spin:e} {slip:e}"
    );
}

/// The continuum takes a couple as forces that move nothing and turn as much the other way.
#[test]
fn a_couple_is_answered_by_forces_of_its_moment() {
    let nothing = Vector3::zeros();
    let mut bowl = joined(nothing, nothing, nothing);
    let cells = bowl.layout.cells;
    let couple = Vector3::new(0.3, -0.7, 0.2);
    bowl.joint.owed.fill(nothing);
    bowl.joint.given.spin.fill(nothing);
    bowl.joint.given.spin[cells.cell([4, 5, 3])] = couple;
    // At the grid's end there is nothing to take one.
    bowl.joint.given.spin[cells.cell([0, 5, 3])] = couple;
    bowl.answer_couples();
    let force: Vector3<f64> = bowl.joint.owed.iter().sum();
    let rows = bowl.joint.owed.iter().enumerate();
    let moment: Vector3<f64> = rows.map(|(k, f)| cells.centre(k).cross(f)).sum();
    assert!(force.norm() < 1e-15, "{force}");
    assert!((moment + couple).norm() < 1e-14, "{moment} {couple}");
    assert_eq!(bowl.joint.owed.iter().filter(|f| **f != nothing).count(), 6);
}
