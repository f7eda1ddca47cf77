//! Cells of grains in steady shear, and pieces cut out of them.

use colluvium_dem::preparation::{
    Ingredient, RadiusLaw, ShearedCell, Shearing, shear, steady_shear,
};
use colluvium_dem::{
    ContactLaw, Domain, Grain, Hooke, Partner, Setup, Simulation, Snapshot, TangentialSpring,
    Threads,
};
use nalgebra::{Rotation3, Vector3};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Grains of d = 1 and ρ_s = 1 under p = 1, k = 2 000 p d.
fn spec(inertial: f64) -> Shearing {
    let law = ContactLaw::linear(
        Hooke::matched(2000.0, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 0.5),
        None,
    );
    let sizes = RadiusLaw::Uniform {
        low: 0.45,
        high: 0.55,
    };
    Shearing {
        grains: 400,
        ingredients: vec![Ingredient::alone(sizes, 1.0)],
        laws: law.into(),
        diameter: 1.0,
        density: 1.0,
        pressure: 1.0,
        inertial,
        strain: 4.0,
        timestep: 1e-3,
        seed: 3,
    }
}

/// Forces of contacts on grains by number.
fn forces(simulation: &mut Simulation) -> BTreeMap<u32, Vector3<f64>> {
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    let mut forces: BTreeMap<u32, Vector3<f64>> = seen
        .grains
        .iter()
        .map(|g| (g.id, Vector3::zeros()))
        .collect();
    for contact in &seen.contacts {
        let Partner::Grain(other) = contact.partner else {
            continue;
        };
        *forces.entry(seen.grains[contact.grain].id).or_default() += contact.force;
        *forces.entry(seen.grains[other].id).or_default() -= contact.force;
    }
    forces
}

/// Slower shear is denser and has less friction; the pressure is the one asked for.
#[test]
fn a_cell_comes_to_the_pressure_and_the_flow_asked_for() {
    let run = |inertial: f64| {
        let mut go = |_: &_| ControlFlow::Continue(());
        let (cell, report) = shear(&spec(inertial), &mut go).unwrap();
        println!("{report}");
        assert!((report.pressure - 1.0).abs() < 0.2, "{report}");
        assert_eq!(ShearedCell::of_numbers(&cell.numbers()), Some(cell));
        report
    };
    let [slow, fast] = [0.1, 0.4].map(run);
    assert!(slow.friction > 0.3 && fast.friction > slow.friction + 0.05);
    assert!(slow.solid_fraction < 0.6 && slow.solid_fraction > fast.solid_fraction + 0.02);
}

/// Grains of a turned piece stand under the forces of the cell, turned; with springs that are not turned they do not.
#[test]
fn a_turned_piece_has_the_forces_of_the_cell() {
    let spec = spec(0.1);
    let rate = spec.rate();
    let mut go = |_: &_| ControlFlow::Continue(());
    let (mut simulation, _) = steady_shear(&spec, &mut go).unwrap();
    let wanted = forces(&mut simulation);
    let ids: Vec<u32> = wanted.keys().copied().collect();
    let cell = ShearedCell::of(&mut simulation, rate);
    assert!(cell.lattice[2].x != 0.0);
    let frame = Rotation3::from_euler_angles(0.4, -1.1, 2.0);
    let origin = Vector3::new(3.0, -2.0, 1.0);
    let apart = |vectors: usize| {
        let cell = ShearedCell {
            vectors,
            ..cell.clone()
        };
        let far = Vector3::repeat(12.0);
        let mut piece = cell.cut(&frame, &origin, [origin - far, origin + far], |_| true);
        for grain in &mut piece.grains {
            let z = (frame.inverse() * (grain.position - origin)).z;
            grain.velocity += frame * (rate * z * Vector3::x());
            grain.spin += frame * (0.5 * rate * Vector3::y());
        }
        let mut setup = Setup {
            domain: Domain {
                lower: Vector3::repeat(-100.0),
                upper: Vector3::repeat(100.0),
                periodic: [false; 3],
            },
            gravity: Vector3::zeros(),
            law: spec.laws.clone(),
            grains: Vec::new(),
            walls: Vec::new(),
            bodies: Vec::new(),
            timestep: spec.timestep,
            threads: Threads::Serial,
        };
        // One grain far away: a run begins with some.
        setup
            .grains
            .push(Grain::at_rest(Vector3::repeat(90.0), 0.5, 1.0));
        let mut other = Simulation::new(setup).unwrap();
        let put = other.put_in(&piece).unwrap();
        assert_eq!(put.ids[0], 1);
        let found = forces(&mut other);
        // Of the cell at the origin those that lie well inside the piece.
        let (mut miss, mut all, mut count) = (0.0, 0.0, 0);
        for (number, grain) in cell.grains.iter().enumerate() {
            let at = origin + frame * grain.position;
            if (at - origin).amax() > 10.0 {
                continue;
            }
            let same = |g: &Grain| (g.position - at).norm() < 1e-9;
            let k = put.grains.iter().position(same).unwrap();
            let right = frame * wanted[&ids[number]];
            miss += (found[&put.ids[k]] - right).norm_squared();
            all += right.norm_squared();
            count += 1;
        }
        assert!(count > 200, "{count}");
        f64::sqrt(miss / all)
    };
    let [turned, not] = [cell.vectors, 0].map(apart);
    println!("forces off by {turned:.1e} of their rms; springs not turned {not:.1e}");
    // Velocities are held half a step back.
    assert!(turned < 0.08 && not > 1.0, "{turned} {not}");
}
