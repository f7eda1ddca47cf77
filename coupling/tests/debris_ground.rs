//! Grains that fall on a bed that is a continuum.

use colluvium_continuum::column_collapse::{Collapse, CollapseCase, CollapseGround, Matter};
use colluvium_continuum::free_surface::{Contact, SurfaceOptions};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::terrain::Profile;
use colluvium_coupling::debris_ground::{DebrisGround, SurfaceContact, SurfaceLine};
use colluvium_coupling::handover::Room;
use colluvium_dem::{
    ContactLaw, Domain, Grain, GrainSample, Hooke, Setup, Simulation, TangentialSpring, Threads,
};
use nalgebra::Vector3;

const DIAMETER: f64 = 0.1;
const STEP: f64 = 2.5e-4;
/// Steps for which loads are kept, and layings between two exchanges.
const KEPT: u64 = 4;
const LAYINGS: u64 = 10;
const WIDTH: f64 = 0.4;

/// A bed half a metre deep and 3 m long between smooth walls.
fn bed(ground: &Profile, interval: f64) -> Collapse {
    let law = MuI {
        mu_s: 0.5,
        mu_2: 0.8,
        i_0: 0.3,
        diameter: DIAMETER,
        solid_fraction: 0.6,
        grain_density: 1000.0,
        cohesion: 0.0,
    };
    let case = CollapseCase {
        aspect: 1.0,
        height: 1.0,
        gravity: 1.0,
        rheology: law,
        cells: 30,
        length_scaled: 3.0,
        overhang_degrees: 0.0,
    };
    let options = SurfaceOptions {
        largest_step: 1.01 * interval,
        ..SurfaceOptions::default().of_first_order()
    };
    let ground = CollapseGround {
        profile: ground.clone(),
        contact: Contact::NoSlip,
    };
    let mut bed = Collapse::bare(&case, &options, &ground, 1.0).unwrap();
    let [columns, rows] = bed.flow().grid().cell_counts();
    let free = bed.flow().free_parts().unwrap().to_vec();
    let bottom = bed.origin()[1];
    let fraction = |at: usize| {
        let low = bottom + 0.1 * (at / columns) as f64;
        ((0.5 - low) / 0.1).clamp(0.0, 1.0) * free[at]
    };
    bed.fill(Matter {
        fractions: (0..columns * rows).map(fraction).collect(),
        velocity: [
            vec![0.0; (columns + 1) * rows],
            vec![0.0; columns * (rows + 1)],
        ],
    })
    .unwrap();
    bed
}

/// A block of grains over it, that moves forward and down.
fn block() -> Simulation {
    let mut grains = Vec::new();
    for k in 0..3 {
        for j in 0..4 {
            for i in 0..6 {
                let [i, j, k] = [i, j, k].map(f64::from);
                let place = Vector3::new(1.2 + 0.1 * i, 0.05 + 0.1 * j, 0.58 + 0.1 * k);
                grains.push(Grain {
                    velocity: Vector3::new(0.3, 0.0, -0.5),
                    ..Grain::at_rest(place, 0.5 * DIAMETER, 1000.0)
                });
            }
        }
    }
    Simulation::new(Setup {
        domain: Domain {
            lower: Vector3::zeros(),
            upper: Vector3::new(3.0, WIDTH, 3.0),
            periodic: [false, true, false],
        },
        gravity: -Vector3::z(),
        law: ContactLaw::linear(
            Hooke::matched(5e3, 0.5),
            TangentialSpring::matched(2.0 / 7.0, 0.5, 0.5),
            None,
        )
        .into(),
        grains,
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: STEP,
        threads: Threads::Serial,
    })
    .unwrap()
}

fn held(simulation: &Simulation) -> Vec<GrainSample> {
    let mut grains: Vec<GrainSample> = simulation.held(|_| true).collect();
    grains.sort_unstable_by_key(|g| g.id);
    grains
}

fn momentum(simulation: &Simulation) -> Vector3<f64> {
    held(simulation).iter().map(|g| g.mass * g.velocity).sum()
}

/// What a block's fall comes to: what its grains gained beyond gravity, what the continuum's own sum of momentum gained at
/// the exchanges, the momentum of the block at the start, the residual of the books, and the deepest sinking over the diameter.
struct Fall {
    grains: [f64; 2],
    continuum: [f64; 2],
    start: f64,
    residual: f64,
    deepest: f64,
    last_speed: f64,
}

fn fall(reacts: bool) -> Fall {
    let profile = Profile::new(vec![[-1.0, 0.0], [4.0, 0.0]]).unwrap();
    let interval = STEP * (KEPT * LAYINGS) as f64;
    let mut bed = bed(&profile, interval);
    let mut simulation = block();
    let contact = SurfaceContact {
        frequency: 1.0 / interval,
        damping: 0.3,
        friction: 0.5,
        reacts,
    };
    let cell_mass = 600.0 * 0.01 * WIDTH;
    let line = SurfaceLine::of(&bed, 0.0, None);
    let mut ground = DebrisGround::new(contact, line, &Room::of(&bed, 0.0, &profile));
    ground.admit(SurfaceLine::of(&bed, 0.0, None), &held(&simulation), 0.1);
    let before = momentum(&simulation);
    let mass: f64 = held(&simulation).iter().map(|g| g.mass).sum();
    let unit = bed.units().velocity;
    let weigh = |bed: &Collapse| bed.flow().momentum().map(|p| 600.0 * WIDTH * unit * p);
    let mut gained = [0.0; 2];
    for exchange in 1..=240 {
        for laying in 0..LAYINGS {
            let later = (laying * KEPT) as f64 * STEP;
            let kept = simulation.next_kick() + (KEPT - 1) as f64 * STEP;
            let fractions = bed.flow().state().fractions.clone();
            let room = Room::of(&bed, 0.0, &profile);
            let cells = (&room, fractions.as_slice(), cell_mass);
            let loads = ground.press(&held(&simulation), cells, [later, kept]);
            simulation.set_loads(&loads).unwrap();
            simulation.advance(KEPT).unwrap();
        }
        let old = weigh(&bed);
        let mut state = bed.flow().state().clone();
        let fractions = state.fractions.clone();
        let [u, w] = &mut state.velocity;
        for u in u.iter_mut().chain(w.iter_mut()) {
            *u *= unit;
        }
        let room = Room::of(&bed, 0.0, &profile);
        ground.deliver((&room, &fractions, cell_mass), [u, w]);
        for u in u.iter_mut().chain(w.iter_mut()) {
            *u /= unit;
        }
        bed.set_state(state).unwrap();
        for (sum, (new, old)) in gained.iter_mut().zip(weigh(&bed).iter().zip(old)) {
            *sum += new - old;
        }
        let until = f64::from(exchange) * interval;
        while bed.time() < until * (1.0 - 1e-12) {
            bed.step(until).unwrap();
        }
        ground.line = SurfaceLine::of(&bed, 0.0, Some((&ground.line, interval)));
    }
    let steps = simulation.steps_done();
    let fallen = Vector3::z() * -mass * simulation.kick_time(steps);
    let own = momentum(&simulation) - before - fallen;
    let fastest = held(&simulation).into_iter().map(|g| g.velocity.norm());
    Fall {
        grains: [own.x, own.z],
        continuum: gained,
        start: before.norm(),
        residual: ground.ledger.residual(),
        deepest: ground.ledger.deepest,
        last_speed: fastest.fold(0.0, f64::max),
    }
}

/// What the grains lose the continuum gets, to round-off, and no grain sinks deeper than a fifth of its diameter. Without the
/// reaction the block's momentum is gone.
#[test]
fn a_block_that_falls_on_a_bed_gives_it_its_momentum() {
    let found = fall(true);
    for c in 0..2 {
        let off = (found.grains[c] + found.continuum[c]).abs();
        assert!(off < 1e-12 * found.start, "{off} {}", found.start);
    }
    assert!(found.residual < 1e-12, "{}", found.residual);
    assert!(found.deepest < 0.2, "{}", found.deepest);
    assert!(
        found.deepest > 1e-3 && found.last_speed < 0.3,
        "{} {}",
        found.deepest,
        found.last_speed
    );
    let control = fall(false);
    let off =
        (control.grains[0] + control.continuum[0]).hypot(control.grains[1] + control.continuum[1]);
    assert!(off > 0.8 * control.start, "{off} {}", control.start);
    assert!(control.residual > 0.1, "{}", control.residual);
}
