//! Our own side: the case as a `Simulation`, run in a process of its own like the others.

use super::case::Case;
use super::law::{Cohesion, Law, Rolling};
use super::machine::processor_time;
use colluvium_dem as dem;
use colluvium_dem::contact::mindlin::SpringMemory;
use colluvium_dem::contact::{Damping, Elasticity, Mindlin, SpringStiffness, Tangential};
use colluvium_dem::{
    ContactLaw, Diverged, Domain, Epsd, Hooke, Jkr, Laws, Lever, Normal, Setup, SetupError,
    ShapeParameter, Simulation, Snapshot, TangentialSpring, Threads, Viscoelastic, Wall,
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
pub fn law_in_words(case: &Case) -> String {
    let normal = match case.law {
        Law::Hooke { .. } => "the case's; radii as arms, pull at release kept",
        Law::HertzMindlin { .. } => {
            "the case's: Hertz, Mindlin with the spring's displacement kept; arms to the contact point"
        }
        Law::Viscoelastic { .. } => {
            "the case's: viscous elastic spheres, Mindlin with the spring's displacement kept"
        }
        Law::Jkr { .. } => "the case's: JKR, sliding, rolling, twisting",
    };
    let turning = match case.rolling {
        Rolling::Free => "",
        Rolling::Epsd { .. } => ", EPSD",
        Rolling::Shape { .. } => ", rolling and twisting springs",
    };
    let cohesion = match case.cohesion {
        Cohesion::None => "",
        Cohesion::ContactArea { .. } => ", constant strength on the patch of a typical contact",
        Cohesion::Dmt { .. } => ", DMT",
    };
    let materials = if case.two_materials {
        ", two materials in turns"
    } else {
        ""
    };
    format!("{normal}{turning}{cohesion}{materials}")
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

/// Friction of a Hertz contact. The other codes keep the displacement of a spring whose contact
/// stiffens, so we do here.
fn mindlin(material: Elasticity, restitution: f64, friction: f64) -> Tangential {
    Tangential::Mindlin(Mindlin {
        memory: SpringMemory::Displacement,
        ..Mindlin::of(material, restitution, friction)
    })
}

fn law(case: &Case) -> ContactLaw {
    let material = |young, poisson| Elasticity {
        youngs_modulus: young,
        poissons_ratio: poisson,
    };
    let law = match case.law {
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
        } => {
            let material = material(young, poisson);
            ContactLaw {
                tangential: mindlin(material, restitution, friction),
                ..ContactLaw::hertz_mindlin(material, restitution, friction)
            }
        }
        Law::Viscoelastic {
            young,
            poisson,
            dissipation,
            friction,
        } => {
            let material = material(young, poisson);
            // Of the restitution only the tangential dashpot is made.
            ContactLaw {
                normal: Normal::Viscoelastic(Viscoelastic::of(material, dissipation)),
                tangential: mindlin(material, 0.5, friction),
                ..ContactLaw::hertz_mindlin(material, 0.5, friction)
            }
        }
        Law::Jkr {
            young,
            poisson,
            surface_energy,
            damping_rate,
            critical_rolling,
        } => ContactLaw::adhesive(Jkr {
            surface_energy,
            elasticity: material(young, poisson),
            damping_rate,
            critical_rolling,
        }),
    };
    ContactLaw {
        rolling: match case.rolling {
            Rolling::Free => law.rolling,
            Rolling::Epsd {
                friction,
                damping_ratio,
            } => dem::Rolling::Epsd(Epsd {
                rolling_friction: friction,
                damping_ratio,
            }),
            Rolling::Shape {
                beta,
                rolling_friction,
                twisting_friction,
            } => dem::Rolling::Shape(ShapeParameter {
                beta,
                rolling_friction,
                twisting_friction,
            }),
        },
        cohesion: match case.cohesion {
            Cohesion::None => dem::Cohesion::None,
            Cohesion::ContactArea { density } => constant_strength(density),
            Cohesion::Dmt { work_of_adhesion } => dem::Cohesion::Dmt {
                work_of_adhesion,
                asperity_radius: None,
            },
        },
        ..law
    }
}

/// A strength on a patch that pulls as `density` does on the contact area 2π R x at an overlap x of 1 % of
/// the reduced radius R: c 4 (βR)² = density · 2π R · 0.01 R.
fn constant_strength(density: f64) -> dem::Cohesion {
    let patch: f64 = 0.2;
    dem::Cohesion::Constant {
        strength: density * 2.0 * std::f64::consts::PI * 0.01 / (4.0 * patch * patch),
        patch,
    }
}

fn setup(case: &Case, timestep: f64, threads: Threads) -> Setup {
    let walls = case.walls.iter().map(|wall| {
        let mut normal = Vector3::zeros();
        normal[wall.axis] = if wall.grains_above { 1.0 } else { -1.0 };
        Wall::plane(normal.abs() * wall.position, normal)
    });
    let law = law(case);
    let mut grains = case.grains.clone();
    let mut laws = Laws::from(law);
    if case.two_materials {
        laws.own.push(law);
        for (k, grain) in grains.iter_mut().enumerate() {
            grain.material = (k % 2) as u16;
        }
    }
    Setup {
        domain: Domain {
            lower: case.lower.into(),
            upper: case.upper.into(),
            periodic: case.periodic,
        },
        gravity: case.gravity.into(),
        law: laws,
        grains,
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
