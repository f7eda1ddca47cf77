//! Uniform translation and rigid rotation of both sides at once exchange no force.

use super::*;
use crate::overlap::{OverlapSettings, Scales};
use colluvium_continuum::column_collapse::CollapseGround;
use colluvium_continuum::free_surface::Contact;
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::terrain::Profile;
use colluvium_dem::{ContactLaw, Domain, Grain, Hooke, Setup, TangentialSpring, Threads, Wall};
use nalgebra::{Vector1, Vector2, Vector3};

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

/// Those of them on a floor.
fn lattice(spin: Vector3<f64>) -> Simulation {
    let law = ContactLaw::linear(
        Hooke::matched(1e4, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 0.5),
        None,
    );
    Simulation::new(Setup {
        domain: Domain {
            lower: Vector3::new(0.0, 0.0, -1.0),
            upper: Vector3::new(3.0 * LENGTH, WIDTH, 4.0 * HEIGHT),
            periodic: [false, true, false],
        },
        gravity: -Vector3::z(),
        law: law.into(),
        grains: grains(spin),
        walls: vec![Wall::plane(Vector3::zeros(), Vector3::z())],
        bodies: Vec::new(),
        timestep: 1e-3,
        threads: Threads::Serial,
    })
    .unwrap()
}

/// Continuum at the wall, up to an edge, with settings as nothing says.
fn behind_edge(travel: Option<Travel>) -> MaterialEdgeSpec {
    let scales = Scales {
        diameter: 1.0,
        time: 1.0,
        density: 1.0,
        stiffness: 1e4,
    };
    let settings = OverlapSettings::default();
    MaterialEdgeSpec {
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
        travel,
    }
}

fn joined(rate: f64, drift: [f64; 2], ours: f64) -> (GrainZone, Simulation) {
    let mut simulation = lattice(-ours * Vector3::y());
    let mut zone = GrainZone::cut(&[behind_edge(None)], None, &mut simulation).unwrap();
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
        .flat_map(|k| &edge.joint.accelerations[k * columns..(k + 1) * columns]);
    let accelerations = accelerations.map(|a| a.amax());
    let spins = inside
        .clone()
        .flat_map(|k| &edge.joint.spins[k * columns..(k + 1) * columns]);
    let spins = spins.map(|a| a.amax()).fold(0.0, f64::max);
    let forces = inside.map(|k| {
        let row = &edge.held.rows[k];
        let slip = edge.scratch.shell[k].slip();
        row.impedance(edge.spec.settings.impedance, slip).norm()
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
    edge.joint.owed.fill(Vector2::zeros());
    edge.joint.given.spin.fill(Vector1::zeros());
    edge.joint.given.spin[7 + 4 * columns] = Vector1::new(0.3);
    // On the floor there is nothing to take one.
    edge.joint.given.spin[7] = Vector1::new(0.3);
    edge.answer_couples();
    let (mut force, mut moment) = ([0.0; 2], 0.0);
    for (cell, owed) in edge.joint.owed.iter().enumerate() {
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

const TRAVEL: Travel = Travel {
    width: 3.0,
    rest: 0.05,
    wake: 0.06,
    hold: 0.4,
    budget: f64::INFINITY,
    fewest: 20.0,
    dense: crate::overlap::DenseLimits::NONE,
};

/// Where grains are put back, cells of the inner overlap bear at once what the continuum bore there, and no average of what was behind
/// the edge or in its shell.
#[test]
fn grains_that_come_back_bear_what_the_continuum_bore() {
    let mut simulation = lattice(Vector3::zeros());
    let spec = behind_edge(Some(TRAVEL));
    let mut zone = GrainZone::cut(&[spec], None, &mut simulation).unwrap();
    let edge = &mut zone.edges[0];
    let columns = edge.cells.counts[0];
    // As of many exchanges with no grains behind the edge.
    edge.sums.stress.fill([0.0; 3]);
    let depth = |cell: usize| HEIGHT - edge.cells.height(cell / columns);
    let pressure = (0..edge.cells.count()).map(|cell| spec.density() * depth(cell).max(0.0));
    edge.view.pressure = pressure.collect();
    edge.view.stress.fill([0.0; 2]);
    edge.view.rest.ratio = 0.6;
    let before = edge.held.handshake.clone();
    let reason = (crate::overlap::Reason::Speed, 0.1);
    assert!(edge.come_back(&TRAVEL, reason, &mut simulation).unwrap());
    let [handshake, inner] = spec.zones();
    let mut count = 0;
    for (cell, [xx, zz, xz]) in edge.sums.stress.iter().enumerate() {
        let (cover, centre) = (&edge.sums.cover[cell], edge.cells.centre(cell % columns));
        let is_inner = cover.mass > 0.0 && (handshake..inner).contains(&cover.label());
        if !is_inner || !edge.view.is_full(cell) || centre > before[cell / columns] {
            continue;
        }
        let weight = edge.view.pressure[cell];
        assert!((zz + weight).abs() < 1e-9 * weight && *xz == 0.0, "{zz}");
        assert!((xx / zz - 0.6).abs() < 1e-9, "{xx} {zz}");
        count += 1;
    }
    assert!(count > 10, "{count}");
    // What was beyond the handshake surface keeps its average.
    let far = edge.cells.counts[1] / 2 * columns + (EDGE + handshake) as usize + 2;
    assert_eq!(edge.sums.stress[far], [0.0; 3]);
}

/// A continuum with the front over a step down, the handshake surface of whose lowest rows has come to beyond the step: what has run
/// down there is no copy, stays and is not booked.
#[test]
fn what_lies_below_the_floor_is_no_copy() {
    let (foot, far) = (LENGTH + 0.5, 60.0);
    let line = vec![[0.0, 0.0], [foot, 0.0], [foot, -2.0], [far + 5.0, -2.0]];
    let ground = CollapseGround {
        profile: Profile::new(line).unwrap(),
        contact: Contact::NoSlip,
    };
    let mut spec = MaterialEdgeSpec {
        side: Side::Above,
        place: EDGE - LENGTH,
        wall: -far,
        back: -LENGTH,
        ..behind_edge(None)
    };
    spec.case.cells = far as usize;
    spec.case.length_scaled = far / HEIGHT;
    let mut simulation = lattice(Vector3::zeros());
    let mut zone = GrainZone::cut(&[spec], Some(&ground), &mut simulation).unwrap();
    let (edge, continuum) = (&mut zone.edges[0], &mut zone.continua[0]);
    let (columns, below) = (edge.cells.counts[0], edge.cells.below);
    assert!(below > 0 && edge.level == -foot);
    let mut state = continuum.collapse.flow().state().clone();
    let down: Vec<usize> = (0..columns)
        .filter(|i| (-foot - 5.0..-foot - 2.0).contains(&edge.cells.centre(*i)))
        .collect();
    for &cell in &down {
        state.fractions[cell] = 0.8;
    }
    continuum.collapse.set_state(state).unwrap();
    edge.look_at(continuum);
    edge.held.handshake[..below].fill(-foot - 7.0);
    edge.copy_the_grains(continuum, f64::INFINITY).unwrap();
    let now = &continuum.collapse.flow().state().fractions;
    assert!(down.len() == 3 && down.iter().all(|cell| now[*cell] == 0.8));
}
