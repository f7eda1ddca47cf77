//! Uniform translation and rigid rotation of both sides at once exchange no force.

use super::*;
use crate::overlap::{OverlapSettings, Scales};
use colluvium_continuum::rheology::MuI;
use colluvium_dem::{ContactLaw, Domain, Grain, Hooke, Setup, TangentialSpring, Threads, Wall};
use nalgebra::Vector3;

const LENGTH: f64 = 24.0;
const HEIGHT: f64 = 10.0;
const WIDTH: f64 = 4.0;
const EDGE: f64 = 8.0;

/// A column of grains on a cubic lattice with every other layer of x shifted up, which no mean of rows is symmetric to.
fn grains(spin: Vector3<f64>) -> Vec<Grain> {
    let place = |n: usize| {
        let (i, j, k) = (n / 40, n / 10 % 4, n % 10);
        let shift = 0.07 * (i % 3) as f64;
        Vector3::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.45 + shift)
    };
    let count = LENGTH as usize * 40;
    let ball = |n| Grain {
        spin,
        ..Grain::at_rest(place(n), 0.45 + 0.01 * (n % 5) as f64, 1.9)
    };
    (0..count).map(ball).collect()
}

fn joined(rate: f64, drift: [f64; 2], ours: f64) -> (GrainZone, Simulation) {
    let law = ContactLaw::linear(
        Hooke::matched(1e4, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 0.5),
        None,
    );
    let mut simulation = Simulation::new(Setup {
        domain: Domain {
            lower: Vector3::new(0.0, 0.0, -1.0),
            upper: Vector3::new(3.0 * LENGTH, WIDTH, 4.0 * HEIGHT),
            periodic: [false, true, false],
        },
        gravity: -Vector3::z(),
        law: law.into(),
        grains: grains(-ours * Vector3::y()),
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
    let settings = OverlapSettings::default();
    let spec = MaterialEdgeSpec {
        case: CollapseCase {
            aspect: HEIGHT / LENGTH,
            height: HEIGHT,
            gravity: 1.0,
            rheology: MuI::new(0.36, 0.70, 0.3, 1.0, 1.9 * 0.52, 1.0),
            cells: 48,
            length_scaled: 48.0 / HEIGHT,
            overhang_degrees: 0.0,
        },
        options: SurfaceOptions::default(),
        side: Side::Below,
        place: EDGE,
        wall: 0.0,
        back: 0.0,
        slab: WIDTH,
        settings: settings.resolve(&scales, false).unwrap(),
        travel: None,
    };
    let mut zone = GrainZone::cut(&[spec], None, &mut simulation).unwrap();
    let (edge, continuum) = (&mut zone.edges[0], &mut zone.continua[0]);
    let centre = [EDGE, 0.5 * HEIGHT];
    let turn = |rate: f64, x: f64, z: f64| {
        [
            drift[0] - rate * (z - centre[1]),
            drift[1] + rate * (x - centre[0]),
        ]
    };
    simulation.give_velocity(|g| {
        let [u, w] = turn(ours, g.position.x, g.position.z);
        Vector3::new(u, 0.0, w)
    });
    let mut state = continuum.collapse.flow().state().clone();
    let (h, unit) = (edge.cells.spacing, continuum.collapse.units().velocity);
    let [columns, rows] = edge.cells.counts;
    for k in 0..rows {
        for i in 0..=columns {
            let [u, _] = turn(rate, i as f64 * h, (k as f64 + 0.5) * h);
            state.velocity[0][i + (columns + 1) * k] = u / unit;
        }
    }
    for k in 0..=rows {
        for i in 0..columns {
            let [_, w] = turn(rate, (i as f64 + 0.5) * h, k as f64 * h);
            state.velocity[1][i + columns * k] = w / unit;
        }
    }
    continuum.collapse.set_state(state).unwrap();
    edge.look(&mut simulation);
    edge.see_grains();
    edge.look_at(continuum);
    edge.agree();
    edge.lay(&simulation, &mut Vec::new(), None);
    (zone, simulation)
}

/// Largest acceleration of the relaxation, angular acceleration of spins, and force of the impedance, of rows away from floor and surface, where velocities
/// are interpolated from both sides.
fn exchanged(edge: &MaterialEdge) -> [f64; 3] {
    let columns = edge.cells.counts[0];
    let inside = 2..(HEIGHT as usize - 3);
    let accelerations = inside
        .clone()
        .flat_map(|k| &edge.held.accelerations[k * columns..(k + 1) * columns]);
    let accelerations = accelerations.flatten().map(|a| a.abs());
    let spins = inside
        .clone()
        .flat_map(|k| &edge.held.spins[k * columns..(k + 1) * columns]);
    let spins = spins.map(|a| a.abs()).fold(0.0, f64::max);
    let forces = inside.map(|k| {
        let load = &edge.scratch.shell[k];
        let slip = load.slip.map(|p| cells::over(p, load.weight));
        let force = edge.held.rows[k].impedance(edge.spec.settings.impedance, slip);
        force[0].hypot(force[1])
    });
    [
        accelerations.fold(0.0, f64::max),
        spins,
        forces.fold(0.0, f64::max),
    ]
}

#[test]
fn what_moves_and_turns_as_one_exchanges_nothing() {
    for (rate, drift) in [
        (0.0, [0.3, 0.0]),
        (0.0, [0.1, -0.2]),
        (0.2, [0.0, 0.0]),
        (-0.3, [0.2, 0.1]),
    ] {
        let (zone, _) = joined(rate, drift, rate);
        let [acceleration, spin, force] = exchanged(&zone.edges[0]);
        println!("{rate} {drift:?}: {acceleration:.1e} {spin:.1e} {force:.1e}");
        assert!(acceleration < 1e-13 && spin < 1e-13 && force < 1e-10);
    }
}

/// The control: both turn, but not at the same rate.
#[test]
fn what_turns_at_another_rate_does() {
    let (zone, _) = joined(0.2, [0.0; 2], 0.22);
    let [acceleration, spin, force] = exchanged(&zone.edges[0]);
    assert!(
        acceleration > 1e-3 && spin > 1e-3 && force > 1.0,
        "{acceleration:e} {spin:e} {force:e}"
    );
}

/// The continuum takes a couple as forces that move nothing and turn as much the other way.
#[test]
fn a_couple_is_answered_by_forces_of_its_moment() {
    let (mut zone, _) = joined(0.0, [0.0; 2], 0.0);
    let edge = &mut zone.edges[0];
    let columns = edge.cells.counts[0];
    edge.owed.fill([0.0; 2]);
    edge.given.spin.fill(0.0);
    edge.given.spin[7 + 4 * columns] = 0.3;
    // On the floor there is nothing to take one.
    edge.given.spin[7] = 0.3;
    edge.answer_couples();
    let (mut force, mut moment) = ([0.0; 2], 0.0);
    for (cell, owed) in edge.owed.iter().enumerate() {
        let at = [
            edge.cells.centre(cell % columns),
            edge.cells.height(cell / columns),
        ];
        // y of x × F.
        moment += at[1] * owed[0] - at[0] * owed[1];
        force = [0, 1].map(|axis| force[axis] + owed[axis]);
    }
    assert!(force.iter().all(|f: &f64| f.abs() < 1e-15), "{force:?}");
    assert!((moment + 0.3).abs() < 1e-14, "{moment}");
}
