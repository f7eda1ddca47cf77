//! What goes through the surface of a joint in grains alone.

use super::material::{EDGE, settled_fraction, setup, spec};
use super::world::{DENSITY, STEP, STIFFNESS, law};
use colluvium_coupling::overlap::material_edge::Witness;
use colluvium_dem::*;
use nalgebra::Vector3;

/// Rows side by side.
const ROWS: usize = 4;

/// Balls in rows along x at these places, with these velocities, and nothing else.
fn rows(balls: &[[f64; 2]]) -> Simulation {
    let side_by_side = |[x, u]: &[f64; 2]| {
        let (x, u) = (*x, *u);
        (0..ROWS).map(move |n| {
            let mut grain =
                Grain::at_rest(Vector3::new(x, 1.2 * n as f64 + 0.6, 2.0), 0.5, DENSITY);
            grain.velocity.x = u;
            grain
        })
    };
    Simulation::new(Setup {
        domain: setup(Vec::new(), false).domain,
        gravity: Vector3::zeros(),
        law: law().into(),
        grains: balls.iter().flat_map(side_by_side).collect(),
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: STEP,
        threads: Threads::Serial,
    })
    .unwrap()
}

/// Rows of balls pressed together bear k δ each, whichever contact the surface crosses; balls that fly carry the surface along.
#[test]
fn rows_of_balls_bear_what_their_springs_say() {
    let spec = spec(settled_fraction(), false, EDGE, None);
    let surface = EDGE + spec.settings.buffer;
    let (overlap, mass, count) = (0.01, 1.0, ROWS as f64);
    for first in [surface - 1.7, surface - 2.4] {
        let places = [0.0, 1.0, 2.0, 3.0].map(|n| [first + n * (1.0 - overlap), 0.0]);
        let mut pressed = rows(&places);
        let through = Witness::new(spec, &mut pressed).look(&mut pressed);
        let exact = count * STIFFNESS * overlap;
        assert!((through.contacts / exact - 1.0).abs() < 1e-9, "{through:?}");
        assert!(through.kinetic.abs() < 1e-12);
    }
    // Apart, one half faster than the other by 2 v: a flux of m v² over the length of the band.
    let apart = [[surface - 0.6, 3.5], [surface + 0.6, 4.5]];
    let mut flying = rows(&apart);
    let mut witness = Witness::new(spec, &mut flying);
    let through = witness.look(&mut flying);
    assert_eq!(through.contacts, 0.0);
    assert!((through.kinetic - count * 2.0 * mass * 0.25 / 2.0).abs() < 1e-9);
    flying.advance(500).unwrap();
    witness.look(&mut flying);
    let moved = witness.handshake()[(2.0 / spec.spacing()) as usize] - surface;
    assert!((moved - 4.0 * 500.0 * STEP).abs() < 1e-9, "{moved}");
}
