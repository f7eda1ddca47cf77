//! Hard cases of an edge that moves with the material: a pile that rests, a spray, contacts much stiffer and grains much
//! lighter than the continuum's step would like, and a million steps of rest.

use super::material::{EDGE, HEIGHT, Joined, settled, settled_fraction, setup, spec, stiff_spec};
use super::world::{DENSITY, STEP, STIFFNESS};
use colluvium_dem::*;
use nalgebra::Vector3;

impl Joined {
    /// How far the books of mass (the handshake surface's), volume, and of both sides' momentum are from closing, when the
    /// grains were given this momentum besides what damping took.
    pub fn books(&mut self, mut given: [f64; 2]) -> [f64; 4] {
        for (given, damped) in given.iter_mut().zip(self.damped) {
            *given += damped;
        }
        let account = self.zone.account(&self.simulation);
        let owed = self.zone.owed(&self.simulation);
        let now = self.zone.grain_momentum(&mut self.simulation);
        [
            self.zone.mass_error(&self.simulation),
            self.zone.volume_error(),
            account.grains_error([now[0] - given[0], now[1] - given[1]]),
            account.exchange_error(owed),
        ]
    }

    /// Most by which the handshake surface has moved from these places (d).
    pub fn moved(&self, before: &[f64]) -> f64 {
        let pairs = self.edge().handshake().iter().zip(before);
        pairs
            .map(|(x, before)| (x - before).abs())
            .fold(0.0, f64::max)
    }
}

/// A column that has fallen and come to rest, as grains.
fn pile() -> Simulation {
    let mut simulation = Simulation::new(setup(settled().to_vec(), false)).unwrap();
    simulation.advance(20_000).unwrap();
    for _ in 0..20 {
        simulation.advance(250).unwrap();
        simulation.damp(0.5);
    }
    simulation
}

/// Heights of grains over the floor in strips of 2 d (d), from a diameter in front of a place on.
fn outline(simulation: &Simulation, place: f64) -> Vec<f64> {
    let mut heights = vec![0.0_f64; 30];
    for grain in simulation.held(|x| x.x > place + 1.0) {
        if let Some(height) = heights.get_mut((0.5 * grain.position.x) as usize) {
            *height = height.max(grain.position.z);
        }
    }
    heights
}

/// A zone boundary through a pile that rests: it goes on resting, and its outline with it. With nothing exchanged the pile's
/// back falls off.
#[test]
fn a_pile_that_rests_goes_on_resting() {
    let place = 4.0;
    let run = |uncoupled: bool| {
        let mut joined = Joined::cut(pile(), &[spec(settled_fraction(), uncoupled, place, None)]);
        let before = joined.edge().handshake().to_vec();
        let start = outline(&joined.simulation, place);
        joined.advance(10.0, 1.0);
        let sunk = start.iter().zip(outline(&joined.simulation, place));
        let sunk = sunk
            .map(|(before, now)| (before - now).abs())
            .fold(0.0, f64::max);
        let books = joined.books([0.0; 2]);
        let (speeds, moved) = (joined.speeds(), joined.moved(&before));
        let escaped = joined.edge().monitors().escaped;
        println!(
            "uncoupled {uncoupled}: speeds {speeds:?}, handshake moved {moved:.3}, outline {sunk:.3}, escaped {escaped}, books {books:?}"
        );
        (speeds, moved, sunk, escaped, books)
    };
    let (speeds, moved, sunk, escaped, books) = run(false);
    assert!(speeds[0] < 0.05 && speeds[1] < 1e-3, "{speeds:?}");
    assert!(moved < 0.3 && sunk < 0.5, "{moved} {sunk}");
    assert_eq!(escaped, 0.0);
    assert!(
        books[0].abs() < 0.02 && books[1].abs() < 1e-12 && books[2] < 1e-12 && books[3] < 1e-12
    );
    let (_, moved, _, escaped, _) = run(true);
    assert!(moved > 0.5 && escaped > 0.0, "{moved} {escaped}");
}

/// The upper half of all grains is thrown up and about, as a spray far more dilute than the continuum's law knows: it falls
/// back through the overlap and rests, nothing is lost, and every book closes.
#[test]
fn a_spray_through_the_overlap_falls_back_and_keeps_its_books() {
    let simulation = Simulation::new(setup(settled().to_vec(), true)).unwrap();
    let mut joined = Joined::cut(simulation, &[spec(settled_fraction(), false, EDGE, None)]);
    joined.advance(5.0, 0.9);
    let count = joined.simulation.grain_count();
    let before = joined.zone.grain_momentum(&mut joined.simulation);
    joined.simulation.give_velocity(|grain| {
        let turn = 2.4 * f64::from(grain.id);
        match grain.position.z > 0.5 * HEIGHT {
            true => Vector3::new(turn.cos(), turn.sin(), 3.0 + turn.sin()),
            false => grain.velocity,
        }
    });
    let after = joined.zone.grain_momentum(&mut joined.simulation);
    let given = [after[0] - before[0], after[1] - before[1]];
    let highest = |joined: &Joined| {
        let heights = joined.simulation.held(|_| true).map(|g| g.position.z);
        heights.fold(0.0, f64::max)
    };
    joined.advance(3.0, 1.0);
    let up = highest(&joined);
    joined.advance(27.0, 1.0);
    let (speeds, books) = (joined.speeds(), joined.books(given));
    println!(
        "thrown to {up:.1}, then {:.1}; speeds {speeds:?}, escaped {}, books {books:?}",
        highest(&joined),
        joined.edge().monitors().escaped
    );
    assert!(up > HEIGHT + 3.0);
    assert_eq!(joined.simulation.grain_count(), count);
    assert!(highest(&joined) < HEIGHT + 1.5);
    assert!(speeds[0] < 0.1 && speeds[1] < 0.01, "{speeds:?}");
    assert!(books[0].abs() < 0.05 && books[1].abs() < 1e-12);
    // After a throw the first step changes velocities by half a step: a step's weight is 3e-5 of the whole.
    assert!(books[2] < 1e-12 && books[3] < 1e-12, "{books:?}");
    // Without it the books are open.
    assert!(joined.books([0.0; 2])[2] > 1e-3);
}

/// Rest of a column behind a gate with contacts so much stiffer, and every fourth grain so much lighter, than usual.
fn rests(stiffer: f64, lighter: f64, step: f64) {
    let stiffness = stiffer * STIFFNESS;
    let mut grains = settled().to_vec();
    for grain in grains.iter_mut().step_by(4) {
        grain.density /= lighter;
    }
    let mut at = setup(grains, true);
    at.law = ContactLaw::linear(
        Hooke::matched(stiffness, 0.6),
        TangentialSpring::matched(2.0 / 7.0, 0.6, 0.5),
        None,
    )
    .into();
    at.timestep = step;
    // Its continuum is as heavy as its grains, whatever each of them weighs.
    let mean = (3.0 + 1.0 / lighter) / 4.0;
    let mut spec = stiff_spec(settled_fraction(), stiffness, false, EDGE, None);
    spec.case.rheology.grain_density = mean * DENSITY;
    let mut simulation = Simulation::new(at).unwrap();
    // What pressed softer contacts in bursts apart under stiffer ones.
    for _ in 0..100 {
        simulation.advance(100).unwrap();
        simulation.damp(0.3);
    }
    for _ in 0..20 {
        simulation.advance(500).unwrap();
        simulation.damp(0.8);
    }
    let mut joined = Joined::cut(simulation, &[spec]);
    joined.advance(8.0, 0.9);
    let before = joined.edge().handshake().to_vec();
    joined.advance(4.0, 1.0);
    let (speeds, moved, books) = (
        joined.speeds(),
        joined.moved(&before),
        joined.books([0.0; 2]),
    );
    let monitors = joined.edge().monitors();
    println!(
        "{stiffer} times as stiff, {lighter} times lighter: speeds {speeds:?}, moved {moved:.3}, force ratio {:.2}, escaped {}, books {books:?}",
        monitors.force_ratio(),
        monitors.escaped
    );
    assert!(speeds[0] < 0.1 && speeds[1] < 1e-3, "{speeds:?}");
    assert!(moved < 0.1 && monitors.escaped == 0.0);
    // The column was cut in the midst of what would be the steps between two loads since the grains' own start.
    let closed = books[1..].iter().all(|error| error.abs() < 1e-12);
    assert!(closed, "{books:?}");
}

/// Sound is ten times as fast, the impedance ten times as large, and loads are held a tenth as long.
#[test]
fn contacts_a_hundred_times_as_stiff_rest() {
    rests(100.0, 1.0, 0.1 * STEP);
}

/// A force that is shared by mass throws no light grain out.
#[test]
fn grains_twenty_times_lighter_rest_among_others() {
    rests(1.0, 20.0, 0.25 * STEP);
}

/// A million steps of rest: no drift of the surface, of mass or of momentum.
#[test]
#[ignore = "minutes; run by tests/validate.sh"]
fn a_million_steps_of_rest() {
    let simulation = Simulation::new(setup(settled().to_vec(), true)).unwrap();
    let mut joined = Joined::cut(simulation, &[spec(settled_fraction(), false, EDGE, None)]);
    joined.advance(15.0, 0.9);
    let before = joined.edge().handshake().to_vec();
    let mass = joined.books([0.0; 2])[0];
    for part in 1..=10 {
        joined.advance(1e5 * STEP, 1.0);
        let (speeds, moved, books) = (
            joined.speeds(),
            joined.moved(&before),
            joined.books([0.0; 2]),
        );
        println!("{part} 1e5 steps: speeds {speeds:?}, moved {moved:.4}, books {books:?}");
    }
    let (speeds, moved, books) = (
        joined.speeds(),
        joined.moved(&before),
        joined.books([0.0; 2]),
    );
    assert!(speeds[0] < 0.03 && speeds[1] < 1e-4, "{speeds:?}");
    assert!(
        moved < 0.05 && (books[0] - mass).abs() < 1e-3,
        "{moved} {books:?}"
    );
    assert!(
        books[1].abs() < 1e-10 && books[2] < 1e-10 && books[3] < 1e-10,
        "{books:?}"
    );
    assert_eq!(joined.edge().monitors().escaped, 0.0);
}
