//! Impacts of two spheres, or of one on a plane: how they are set up, run and watched.

use colluvium_dem::{
    ContactLaw, ContactSample, Domain, Elasticity, Grain, GrainSample, Hertz, Laws, Mindlin,
    Normal, Partner, Setup, Simulation, Snapshot, Tangential, Threads, Wall,
};
use nalgebra::Vector3;

/// A box that holds nothing back.
pub fn open_space() -> Domain {
    Domain {
        lower: Vector3::repeat(-50.0),
        upper: Vector3::repeat(50.0),
        periodic: [false; 3],
    }
}

/// The plane z = 0.
pub fn floor() -> Wall {
    Wall::plane(Vector3::zeros(), Vector3::z())
}

/// Grains in open space without gravity.
pub fn scene(law: impl Into<Laws>, grains: Vec<Grain>, walls: Vec<Wall>, timestep: f64) -> Setup {
    Setup {
        domain: open_space(),
        gravity: Vector3::zeros(),
        law: law.into(),
        grains,
        walls,
        bodies: Vec::new(),
        timestep,
        threads: Threads::Serial,
    }
}

/// A moving sphere; where it is, the scene decides.
pub fn sphere(radius: f64, density: f64, velocity: [f64; 3], spin: [f64; 3]) -> Grain {
    Grain {
        velocity: velocity.into(),
        spin: spin.into(),
        ..Grain::at_rest(Vector3::zeros(), radius, density)
    }
}

/// A sphere just above the floor.
///
/// # Panics
/// If the law is refused.
pub fn on_floor(law: impl Into<Laws>, sphere: Grain, timestep: f64) -> Simulation {
    let at = Vector3::new(0.0, 0.0, sphere.radius * (1.0 + 1e-9));
    let sphere = Grain {
        position: at,
        ..sphere
    };
    simulate(scene(law, vec![sphere], vec![floor()], timestep))
}

/// Two spheres just apart on the z axis, the first below.
///
/// # Panics
/// If the law is refused.
pub fn pair(law: impl Into<Laws>, lower: Grain, upper: Grain, timestep: f64) -> Simulation {
    let gap = 1e-9 * lower.radius.min(upper.radius);
    let lower = Grain {
        position: Vector3::new(0.0, 0.0, -lower.radius),
        ..lower
    };
    let upper = Grain {
        position: Vector3::new(0.0, 0.0, upper.radius + gap),
        ..upper
    };
    simulate(scene(law, vec![lower, upper], vec![], timestep))
}

/// The simulation of a setup that is known to be sound.
///
/// # Panics
/// If it is not.
pub fn simulate(setup: Setup) -> Simulation {
    match Simulation::new(setup) {
        Ok(simulation) => simulation,
        Err(error) => panic!("{error}"),
    }
}

/// Grains and contacts now, grains by number; contacts refer to grains by number too.
pub fn look(simulation: &mut Simulation) -> Snapshot {
    let mut snapshot = Snapshot::default();
    simulation.snapshot(&mut snapshot);
    let ids: Vec<_> = snapshot.grains.iter().map(|g| g.id as usize).collect();
    for contact in &mut snapshot.contacts {
        contact.grain = ids[contact.grain];
        if let Partner::Grain(j) = contact.partner {
            contact.partner = Partner::Grain(ids[j]);
        }
    }
    snapshot.grains.sort_by_key(|g| g.id);
    snapshot
}

/// What an impact left.
#[derive(Clone, Debug)]
pub struct Impact {
    /// The grains, by number.
    pub grains: Vec<GrainSample>,
    /// Duration of the contact (s), to a step.
    pub time: f64,
    /// Largest overlap (m).
    pub overlap: f64,
    /// Largest normal force (N).
    pub force: f64,
    /// Energy after over before, -1.
    pub gain: f64,
}

/// Unit normal of a contact, from the partner to the grain.
pub fn normal(contact: &ContactSample) -> Vector3<f64> {
    -(contact.arm - contact.partner_arm).normalize()
}

/// Runs until what touched has parted.
///
/// # Panics
/// If that never happens.
pub fn collide(simulation: &mut Simulation) -> Impact {
    watch(simulation, |_| {})
}

/// The same, looking at every step with contact.
///
/// # Panics
/// If the spheres never part.
pub fn watch(simulation: &mut Simulation, mut seen: impl FnMut(&Snapshot)) -> Impact {
    let before = simulation.energy().total();
    let (mut touched, mut overlap, mut force) = (0_u64, 0.0_f64, 0.0_f64);
    for _ in 0..2_000_000 {
        if let Err(error) = simulation.advance(1) {
            panic!("{error}");
        }
        let snapshot = look(simulation);
        if !snapshot.contacts.is_empty() {
            touched += 1;
            for c in &snapshot.contacts {
                overlap = overlap.max(c.overlap);
                force = force.max(c.force.dot(&normal(c)));
            }
            seen(&snapshot);
        } else if touched > 0 {
            return Impact {
                grains: snapshot.grains,
                time: touched as f64 * simulation.timestep(),
                overlap,
                force,
                gain: simulation.energy().total() / before - 1.0,
            };
        }
    }
    panic!("the spheres never part");
}

/// Hertz–Mindlin contact of two materials, the same restitution in both parts.
pub fn elastic(a: Elasticity, b: Elasticity, restitution: f64, friction: f64) -> ContactLaw {
    ContactLaw {
        normal: Normal::Hertz(Hertz::between(a, b, restitution)),
        tangential: Tangential::Mindlin(Mindlin::between(a, b, restitution, friction)),
        ..ContactLaw::hertz_mindlin(a, restitution, friction)
    }
}

/// Elastic constants by Young's modulus (Pa) and Poisson's ratio.
pub const fn material(youngs_modulus: f64, poissons_ratio: f64) -> Elasticity {
    Elasticity {
        youngs_modulus,
        poissons_ratio,
    }
}

/// Asserts that a value lies within a relative tolerance of what is expected.
///
/// # Panics
/// If it does not.
#[track_caller]
pub fn assert_close(what: &str, value: f64, expected: f64, tolerance: f64) {
    let off = (value / expected - 1.0).abs();
    assert!(
        off <= tolerance,
        "{what}: {value:e} instead of {expected:e}, off by {off:.2e} (allowed {tolerance:.0e})"
    );
}
