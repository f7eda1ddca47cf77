//! A list of every kind of contact law, for what all of them must do.

use crate::impacts::{material, scene, sphere};
use colluvium_dem::contact::mindlin::SpringMemory;
use colluvium_dem::{
    Cohesion, ContactLaw, Damping, Elasticity, Epsd, Grain, Hertz, Hooke, Jkr, Lever, Mindlin,
    Normal, Rolling, Setup, ShapeParameter, SpringStiffness, Tangential, TangentialSpring,
    Viscoelastic,
};
use nalgebra::Vector3;

const SOFT: Elasticity = material(1e7, 0.25);

/// Radius (m) and density (kg/m³) of grains that suit a law of the list.
pub fn grain(law: &ContactLaw) -> (f64, f64) {
    match law.normal {
        Normal::Jkr(_) => (1e-7, 1000.0),
        _ => (0.01, 2500.0),
    }
}

/// Every composition, and each cohesion where it is allowed, by name; a restitution of 1 leaves all
/// dashpots out.
pub fn all(e: f64) -> Vec<(String, ContactLaw)> {
    let (mu, damped) = (0.5, if e < 1.0 { 1.0 } else { 0.0 });
    let normals = [
        ("hooke", Normal::Hooke(Hooke::matched(1e5, e))),
        (
            "hooke by mass",
            Normal::Hooke(Hooke {
                stiffness: 1e5,
                damping: Damping::MassProportional(300.0 * damped),
            }),
        ),
        ("hertz", Normal::Hertz(Hertz::of(SOFT, e))),
        (
            "viscoelastic",
            Normal::Viscoelastic(Viscoelastic::of(SOFT, 1e-5 * damped)),
        ),
    ];
    let spring = |stiffness| {
        Tangential::Linear(TangentialSpring {
            stiffness,
            damping: Damping::Restitution(e),
            friction: mu,
        })
    };
    let mindlin = Tangential::Mindlin(Mindlin {
        memory: SpringMemory::Energy,
        ..Mindlin::of(SOFT, e, mu)
    });
    let tangentials = [
        ("frictionless", Tangential::None),
        ("linear", spring(SpringStiffness::Ratio(2.0 / 7.0))),
        ("linear", spring(SpringStiffness::Absolute(3e4))),
        ("mindlin", mindlin),
    ];
    let rollings = [
        ("free", Rolling::None),
        (
            "epsd",
            Rolling::Epsd(Epsd {
                rolling_friction: 0.3,
                damping_ratio: 0.3 * damped,
            }),
        ),
        (
            "shape",
            Rolling::Shape(ShapeParameter {
                beta: 0.6,
                rolling_friction: 1.05,
                twisting_friction: 1.3,
            }),
        ),
    ];
    let cohesions = [
        ("dry", Cohesion::None),
        (
            "dmt",
            Cohesion::Dmt {
                work_of_adhesion: 10.0,
                asperity_radius: None,
            },
        ),
        (
            "scheeres",
            Cohesion::Scheeres {
                cleanliness: 1.0,
                asperity_radius: None,
            },
        ),
        (
            "constant",
            Cohesion::Constant {
                strength: 1e3,
                patch: 0.6,
            },
        ),
    ];
    let mut laws = Vec::new();
    for (n, normal) in normals {
        for (t, tangential) in tangentials {
            for (r, rolling) in rollings {
                for (c, cohesion) in cohesions {
                    let law = ContactLaw {
                        normal,
                        tangential,
                        rolling,
                        cohesion,
                        lever: Lever::ContactPoint,
                    };
                    // What the composition refuses is not a law.
                    if law.validate().is_ok() {
                        laws.push((format!("{n}, {t}, {r}, {c}"), law));
                    }
                }
            }
        }
    }
    let jkr = Jkr {
        surface_energy: 0.1,
        elasticity: material(7e9, 0.25),
        damping_rate: 1e8 * damped,
        critical_rolling: 8e-10,
    };
    let adhesive = ContactLaw::adhesive(jkr);
    for (name, tangential, rolling) in [
        ("jkr", Tangential::None, Rolling::None),
        ("jkr, sliding", Tangential::Jkr, Rolling::None),
        ("jkr, sliding, rolling", Tangential::Jkr, Rolling::Jkr),
    ] {
        let law = ContactLaw {
            tangential,
            rolling,
            ..adhesive
        };
        laws.push((name.into(), law));
    }
    laws
}

/// 27 grains of several sizes flying into each other, all turning, in open space.
pub fn cloud(law: ContactLaw) -> Setup {
    let (radius, density) = grain(&law);
    let mass = sphere(radius, density, [0.0; 3], [0.0; 3]).mass();
    let dt = law.contact_time(0.5 * mass, 0.5 * radius, 1.0) / 40.0;
    let speed = radius / (300.0 * dt);
    let mut state = 3_u64;
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let grains = (0..27)
        .map(|k| {
            let cell = Vector3::new((k % 3) as f64, (k / 3 % 3) as f64, (k / 9) as f64);
            let at = (cell - Vector3::repeat(1.0)) * 2.1;
            let own = radius * (1.0 + 0.3 * random()).min(1.0);
            let mut g = Grain::at_rest(at * radius, own, density);
            let mut arrow = || Vector3::new(random(), random(), random());
            g.velocity = (arrow() - 0.2 * at) * speed;
            g.spin = arrow() * (speed / radius);
            g
        })
        .collect();
    scene(law, grains, vec![], dt)
}
