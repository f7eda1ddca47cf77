//! Speed of every law on one bed: `cargo run --release -p colluvium-benchmarks --bin law-speed`.
//!
//! All laws take turns on the 32 000 grains of the chute, each from the same start, on one thread; what
//! is compared is processor time, as a ratio to the chute's own law in the same round. The laws' numbers
//! are chosen to press the grains about as much as the chute's springs do. Prints a Markdown table.

use colluvium_benchmarks::peers::machine::processor_time;
use colluvium_benchmarks::peers::statistics::spread;
use colluvium_dem::{
    Cohesion, ContactLaw, Damping, Domain, Elasticity, Epsd, Hooke, Jkr, Laws, Lever, Normal,
    Rolling, Setup, ShapeParameter, Simulation, SpringStiffness, Tangential, TangentialSpring,
    Threads, Viscoelastic,
};
use nalgebra::Vector3;
use std::error::Error;

const ROUNDS: usize = 5;
const WARM_UP: u64 = 200;
const STEPS: u64 = 200;

/// The chute's law first.
fn laws() -> Vec<(&'static str, Laws)> {
    let spring = TangentialSpring {
        stiffness: SpringStiffness::Ratio(2.0 / 7.0),
        damping: Damping::MassProportional(0.0),
        friction: 0.5,
    };
    let hooke = Hooke {
        stiffness: 2e5,
        damping: Damping::MassProportional(50.0),
    };
    let chute = ContactLaw {
        lever: Lever::Radius,
        ..ContactLaw::linear(hooke, spring, None)
    };
    let shape = ShapeParameter {
        beta: 0.2,
        rolling_friction: 1.05,
        twisting_friction: 1.3,
    };
    let rolling = Rolling::Epsd(Epsd {
        rolling_friction: 0.2,
        damping_ratio: 0.3,
    });
    let material = Elasticity {
        youngs_modulus: 2e7,
        poissons_ratio: 0.3,
    };
    let hertz = ContactLaw::hertz_mindlin(material, 0.5, 0.5);
    let viscoelastic = ContactLaw {
        normal: Normal::Viscoelastic(Viscoelastic::of(material, 1e-3)),
        ..hertz
    };
    let jkr = ContactLaw::adhesive(Jkr {
        surface_energy: 0.4,
        elasticity: material,
        damping_rate: 50.0,
        critical_rolling: 1e-3,
    });
    let frictionless = ContactLaw {
        tangential: Tangential::None,
        ..chute
    };
    let cohesion = Cohesion::Dmt {
        work_of_adhesion: 0.5,
        asperity_radius: None,
    };
    let pair = |a: ContactLaw, b: ContactLaw| Laws {
        own: vec![a, b],
        pairs: vec![],
    };
    vec![
        ("Hooke, linear spring (the chute)", chute.into()),
        ("Hooke, frictionless", frictionless.into()),
        (
            "Hooke, linear spring, EPSD",
            ContactLaw { rolling, ..chute }.into(),
        ),
        (
            "Hooke, linear spring, shape springs",
            ContactLaw {
                rolling: Rolling::Shape(shape),
                ..chute
            }
            .into(),
        ),
        (
            "Hooke, linear spring, DMT",
            ContactLaw { cohesion, ..chute }.into(),
        ),
        ("Hooke, linear spring, two materials", pair(chute, chute)),
        ("Hertz, Mindlin", hertz.into()),
        (
            "Hertz, Mindlin, EPSD",
            ContactLaw { rolling, ..hertz }.into(),
        ),
        (
            "Hertz, Mindlin, EPSD, DMT",
            ContactLaw {
                rolling,
                cohesion,
                ..hertz
            }
            .into(),
        ),
        (
            "Hertz, Mindlin, EPSD, DMT, two materials",
            pair(
                ContactLaw {
                    rolling,
                    cohesion,
                    ..hertz
                },
                ContactLaw {
                    rolling,
                    cohesion,
                    ..hertz
                },
            ),
        ),
        (
            "Hertz, Mindlin, shape springs",
            ContactLaw {
                rolling: Rolling::Shape(shape),
                ..hertz
            }
            .into(),
        ),
        ("viscoelastic, Mindlin", viscoelastic.into()),
        ("JKR, sliding, rolling, twisting", jkr.into()),
    ]
}

fn setup(law: &Laws) -> Result<Setup, Box<dyn Error>> {
    let mut grains = colluvium_tests::chute_start();
    if law.own.len() > 1 {
        for (k, grain) in grains.iter_mut().enumerate() {
            grain.material = (k % 2) as u16;
        }
    }
    let slope = 26_f64.to_radians();
    Ok(Setup {
        domain: Domain {
            lower: Vector3::zeros(),
            upper: Vector3::new(40.0, 20.0, 60.0),
            periodic: [true, true, false],
        },
        gravity: Vector3::new(slope.sin(), 0.0, -slope.cos()),
        law: law.clone(),
        grains,
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: 1e-4,
        threads: Threads::Serial,
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let laws = laws();
    let mut beds = Vec::new();
    for (_, law) in &laws {
        let mut bed = Simulation::new(setup(law)?)?;
        bed.advance(WARM_UP)?;
        beds.push(bed);
    }
    let mut times = vec![Vec::new(); laws.len()];
    for _ in 0..ROUNDS {
        for (bed, times) in beds.iter_mut().zip(&mut times) {
            let before = processor_time().ok_or("this system tells no processor time")?;
            bed.advance(STEPS)?;
            let after = processor_time().ok_or("this system tells no processor time")?;
            times.push(after - before);
        }
    }
    println!("| law | million grain-steps a processor second | of the chute's |");
    println!("|---|---|---|");
    for (k, (name, _)) in laws.iter().enumerate() {
        let steps = beds[k].grain_count() as f64 * STEPS as f64;
        let rate = spread(times[k].iter().map(|t| steps / t / 1e6)).ok_or("no rounds")?;
        let ratio =
            spread(times[k].iter().zip(&times[0]).map(|(t, c)| c / t)).ok_or("no rounds")?;
        println!(
            "| {name} | {:.1} [{:.1}, {:.1}] | {:.2} |",
            rate.median, rate.min, rate.max, ratio.median
        );
    }
    Ok(())
}
