//! Our own side: the case as a `Simulation`, run in a process of its own like the others.

use super::case::{Case, Law};
use super::machine::processor_time;
use colluvium_dem::contact::mindlin::SpringMemory;
use colluvium_dem::contact::{Damping, Elasticity, Mindlin, SpringStiffness, Tangential};
use colluvium_dem::{
    ContactLaw, Diverged, Domain, Hooke, Lever, Setup, SetupError, Simulation, Snapshot,
    TangentialSpring, Threads, Wall,
};
use nalgebra::Vector3;
use std::time::Instant;

/// Why our own run failed.
#[derive(Debug, thiserror::Error)]
pub enum OursFailed {
    /// The case cannot be set up.
    #[error("setup: {0}")]
    Setup(#[from] SetupError),
    /// The run left the range of numbers.
    #[error("run: {0}")]
    Diverged(#[from] Diverged),
}

/// The law of our own run, in words.
pub fn law_in_words(case: &Case) -> &'static str {
    match case.law {
        Law::Hooke { .. } => "the case's; radii as arms, pull at release kept",
        Law::HertzMindlin { .. } => {
            "the case's: Hertz, Mindlin with the spring's displacement kept; arms to the contact point"
        }
    }
}

/// The chute's law, with LAMMPS' lever arms.
fn chute_law(stiffness: f64, tangential: f64, damping: f64, friction: f64) -> ContactLaw {
    let law = ContactLaw::linear(
        Hooke {
            stiffness,
            damping: Damping::MassProportional(damping),
        },
        TangentialSpring {
            stiffness: SpringStiffness::Absolute(tangential),
            damping: Damping::MassProportional(0.0),
            friction,
        },
        None,
    );
    ContactLaw {
        lever: Lever::Radius,
        ..law
    }
}

/// The settled bed's law. The other codes keep the displacement of a spring whose contact stiffens, so
/// we do here.
fn settled_law(young: f64, poisson: f64, restitution: f64, friction: f64) -> ContactLaw {
    let material = Elasticity {
        youngs_modulus: young,
        poissons_ratio: poisson,
    };
    let spring = Mindlin {
        memory: SpringMemory::Displacement,
        ..Mindlin::of(material, restitution, friction)
    };
    ContactLaw {
        tangential: Tangential::Mindlin(spring),
        ..ContactLaw::hertz_mindlin(material, restitution, friction)
    }
}

fn law(case: &Case) -> ContactLaw {
    match case.law {
        Law::Hooke {
            stiffness,
            tangential,
            damping,
            friction,
        } => chute_law(stiffness, tangential, damping, friction),
        Law::HertzMindlin {
            young,
            poisson,
            restitution,
            friction,
        } => settled_law(young, poisson, restitution, friction),
    }
}

fn setup(case: &Case, timestep: f64, threads: Threads) -> Setup {
    let walls = case.walls.iter().map(|wall| {
        let mut normal = Vector3::zeros();
        normal[wall.axis] = if wall.grains_above { 1.0 } else { -1.0 };
        Wall::plane(normal.abs() * wall.position, normal)
    });
    Setup {
        domain: Domain {
            lower: case.lower.into(),
            upper: case.upper.into(),
            periodic: case.periodic,
        },
        gravity: case.gravity.into(),
        law: law(case).into(),
        grains: case.grains.clone(),
        walls: walls.collect(),
        bodies: Vec::new(),
        timestep,
        threads,
    }
}

/// Kinetic energy of translation and height of the centre of mass of the free grains.
fn state(simulation: &mut Simulation, snapshot: &mut Snapshot) -> [f64; 2] {
    simulation.snapshot(snapshot);
    let (mut mass, mut moment, mut kinetic) = (0.0, 0.0, 0.0);
    for g in snapshot.grains.iter().filter(|g| !g.fixed) {
        mass += g.mass;
        moment += g.mass * g.position.z;
        kinetic += 0.5 * g.mass * g.velocity.norm_squared();
    }
    [kinetic, moment / mass]
}

/// Runs a case with steps divided by `finer` and prints the lines that [`super::trace`] reads.
///
/// Looking at the state counts as loop time, as it does in LAMMPS.
///
/// # Errors
/// If the case cannot be set up or diverges.
pub fn run(case: &Case, finer: u64, threads: usize) -> Result<(), OursFailed> {
    let kind = if threads > 1 {
        Threads::Rayon
    } else {
        Threads::Serial
    };
    let mut simulation = Simulation::new(setup(case, case.timestep / finer as f64, kind))?;
    let mut snapshot = Snapshot::default();
    println!("version Colluvium {}", env!("CARGO_PKG_VERSION"));
    let mut stretch = |from: u64, to: u64| -> Result<(), OursFailed> {
        for step in (from + case.every..=to).step_by(case.every as usize) {
            simulation.advance(case.every * finer)?;
            let [kinetic, height] = state(&mut simulation, &mut snapshot);
            println!("state {step} {kinetic:.12e} {height:.12e}");
        }
        Ok(())
    };
    stretch(0, case.warm_up)?;
    let (clock, processor) = (Instant::now(), processor_time());
    stretch(case.warm_up, case.warm_up + case.steps)?;
    let wall = clock.elapsed().as_secs_f64();
    let cpu = match (processor, processor_time()) {
        (Some(before), Some(after)) => format!("{:.6}", after - before),
        _ => "-".into(),
    };
    println!("loop {} {wall:.6} {cpu}", case.steps * finer);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::case::{CASES, Reference, case};

    #[test]
    fn every_case_can_be_set_up() {
        for name in CASES {
            let case = case(name).unwrap();
            let mut simulation =
                Simulation::new(setup(&case, case.timestep, Threads::Serial)).unwrap();
            let [kinetic, height] = state(&mut simulation, &mut Snapshot::default());
            assert!(kinetic > 0.0 && height > 0.0);
        }
    }

    #[test]
    fn the_chute_has_lammps_energy_to_nine_digits() {
        let case = case("chute").unwrap();
        let Reference::Known { states, .. } = &case.reference else {
            panic!("the chute's reference is known");
        };
        let mut simulation = Simulation::new(setup(&case, case.timestep, Threads::Serial)).unwrap();
        simulation.advance(states[0].step).unwrap();
        let [kinetic, height] = state(&mut simulation, &mut Snapshot::default());
        assert!(
            (kinetic / states[0].kinetic - 1.0).abs() < 1e-9,
            "{kinetic}"
        );
        assert!((height / states[0].height - 1.0).abs() < 1e-9, "{height}");
    }
}
