//! Single grains that leave their neighbours at an edge which moves with the material: into the continuum, or over the heap.

use super::material::{EDGE, HEIGHT, Joined, settled, settled_fraction, setup, spec};
use colluvium_dem::*;
use nalgebra::Vector3;

fn rested(uncoupled: bool) -> Joined {
    let simulation = Simulation::new(setup(settled().to_vec(), true)).unwrap();
    let mut joined = Joined::cut(
        simulation,
        &[spec(settled_fraction(), uncoupled, EDGE, None)],
    );
    if !uncoupled {
        joined.advance(10.0, 0.9);
    }
    joined
}

/// The shell's grain nearest to a height.
fn of_shell(joined: &Joined, height: f64) -> u32 {
    let edge = joined.edge();
    let shell = joined.simulation.held(|_| true);
    let shell = shell.filter(|g| edge.label(g).is_some_and(|label| label < 0.6));
    let off = |g: &GrainSample| (g.position.z - height).abs();
    shell.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap().id
}

fn grain(joined: &Joined, id: u32) -> GrainSample {
    joined
        .simulation
        .held(|_| true)
        .find(|g| g.id == id)
        .unwrap()
}

/// Momentum along x and z (N s) that the grains get when one is given a velocity.
fn throw(joined: &mut Joined, id: u32, velocity: Vector3<f64>) -> [f64; 2] {
    let before = joined.zone.grain_momentum(&mut joined.simulation);
    let give = |g: &GrainSample| if g.id == id { velocity } else { g.velocity };
    joined.simulation.give_velocity(give);
    let after = joined.zone.grain_momentum(&mut joined.simulation);
    [0, 1].map(|axis| after[axis] - before[axis])
}

/// A grain of the shell that is torn out of it backwards stays where the continuum stops it, and rests. What was beside it settles
/// into its place, but nothing falls along the edge to be thrown back by the pressure below. Where there is no continuum to
/// lie in, it falls to the floor.
#[test]
fn a_grain_torn_out_of_the_edge_is_carried_by_the_continuum() {
    let fall = |uncoupled: bool| {
        let mut joined = rested(uncoupled);
        let id = of_shell(&joined, 0.6 * HEIGHT);
        let place = grain(&joined, id).position;
        let given = throw(&mut joined, id, Vector3::new(-20.0, 0.0, 0.0));
        let mut fastest = 0.0_f64;
        joined.advance(0.5, 1.0);
        for _ in 0..45 {
            joined.advance(0.1, 1.0);
            let speeds = joined.simulation.held(|_| true).map(|g| g.velocity.norm());
            fastest = speeds.fold(fastest, f64::max);
        }
        let now = grain(&joined, id);
        println!(
            "uncoupled {uncoupled}: from {place:.2?} to {:.2?}, {:.1e}; fastest {fastest:.2}",
            now.position,
            now.velocity.norm()
        );
        (
            place - now.position,
            now.velocity.norm(),
            fastest,
            joined,
            given,
        )
    };
    let (moved, speed, fastest, mut joined, given) = fall(false);
    assert!(
        moved.x > 1.0 && moved.x < 4.0 && moved.z.abs() < 0.5,
        "{moved}"
    );
    assert!(speed < 0.01 && fastest < 1.6, "{speed:e} {fastest}");
    let books = joined.books(given);
    assert!(
        books[1..].iter().all(|error| error.abs() < 1e-12),
        "{books:?}"
    );
    // Its weight is the continuum's to bear: without what that was given the exchange would not close.
    assert!(
        joined
            .zone
            .account(&joined.simulation)
            .exchange_error([0.0; 2])
            > 0.0
    );
    let (moved, _, fastest, ..) = fall(true);
    assert!(moved.z > 0.3 * HEIGHT && fastest > 2.0, "{moved} {fastest}");
}

/// A grain of the shell that flies over the heap bears no traction where it lands, and takes the edge nowhere.
#[test]
fn a_grain_that_flies_off_the_edge_is_of_the_shell_no_more() {
    let mut joined = rested(false);
    // What rests is among its neighbours.
    assert_eq!(joined.edge().renewed(), 0.0);
    let shell = joined.simulation.held(|_| true);
    let shell = shell.filter(|g| joined.edge().label(g).is_some_and(|label| label < 1.5));
    let highest = shell.max_by(|a, b| a.position.z.total_cmp(&b.position.z));
    let thrown = highest.unwrap();
    let before = joined.edge().handshake().to_vec();
    throw(&mut joined, thrown.id, Vector3::new(1.0, 0.0, 5.0));
    joined.advance(15.0, 1.0);
    let landed = grain(&joined, thrown.id);
    let label = joined.edge().label(&landed).unwrap();
    println!(
        "landed {:.1} d off with label {label:.1}; the handshake moved {:.2e} d",
        landed.position.x - EDGE,
        joined.moved(&before)
    );
    assert!(landed.position.x > EDGE + 5.0);
    // It is beyond what anything is exchanged with.
    assert!(label > 6.0, "{label}");
    assert!(joined.edge().renewed() > 0.0);
    assert!(joined.moved(&before) < 0.3);
}
