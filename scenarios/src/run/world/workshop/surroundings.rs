//! What surrounds a packing while it is made: laws, walls and gravity, and the step that they allow.

use crate::scene::world::Materials;
use colluvium_dem::timestep::{Conditions, Shares};
use colluvium_dem::{
    Domain, Grain, Laws, Mindlin, Normal, Setup, Tangential, TangentialSpring, Threads, Wall,
};
use nalgebra::Vector3;

/// What surrounds a packing during a step.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// Contact laws of this step.
    pub laws: Laws,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Uniform acceleration (m/s²).
    pub gravity: Vector3<f64>,
    /// Largest speed of two surfaces against each other (m/s).
    pub speed: f64,
}

impl Surroundings {
    /// Nothing but the law.
    pub fn none(laws: Laws) -> Surroundings {
        Surroundings {
            laws,
            walls: Vec::new(),
            gravity: Vector3::zeros(),
            speed: 0.0,
        }
    }
}

/// The laws with another friction.
pub fn with_friction(laws: &Laws, friction: f64) -> Laws {
    let mut laws = laws.clone();
    let pairs = laws.pairs.iter_mut().map(|(_, _, law)| law);
    for law in laws.own.iter_mut().chain(pairs) {
        law.tangential = match law.tangential {
            Tangential::Linear(spring) => {
                Tangential::Linear(TangentialSpring { friction, ..spring })
            }
            Tangential::Mindlin(mindlin) => Tangential::Mindlin(Mindlin {
                friction,
                ..mindlin
            }),
            other => other,
        };
    }
    laws
}

/// The laws of Hooke and Hertz at a multiple of their stiffness; others as they are.
pub fn softened(laws: &Laws, factor: f64) -> Laws {
    let mut laws = laws.clone();
    let pairs = laws.pairs.iter_mut().map(|(_, _, law)| law);
    for law in laws.own.iter_mut().chain(pairs) {
        match &mut law.normal {
            Normal::Hooke(hooke) => hooke.stiffness *= factor,
            Normal::Hertz(hertz) => hertz.effective_modulus *= factor,
            _ => continue,
        }
        if let Tangential::Mindlin(mindlin) = &mut law.tangential {
            mindlin.effective_shear *= factor;
        }
    }
    laws
}

/// The step (s) of a preparation of such grains in such surroundings, where anything limits it.
pub fn step_for(materials: &Materials, around: &Surroundings, safety: f64) -> Option<f64> {
    let grains = stand_ins(materials);
    let fall = Conditions::of(&grains, &around.gravity);
    let conditions = Conditions {
        speed: fall.speed + around.speed,
        ..fall
    };
    let shares = Shares {
        safety,
        ..Shares::default()
    };
    let setup = Setup {
        domain: open_space(),
        gravity: around.gravity,
        law: around.laws.clone(),
        grains,
        walls: around.walls.clone(),
        bodies: Vec::new(),
        timestep: 1.0,
        threads: Threads::Serial,
    };
    let choice = setup.choose_step(&conditions, &shares).ok()?;
    choice.seconds.is_finite().then_some(choice.seconds)
}

/// Open space: a box that holds nothing in.
pub fn open_space() -> Domain {
    Domain {
        lower: Vector3::repeat(-1.0),
        upper: Vector3::repeat(1.0),
        periodic: [false; 3],
    }
}

/// The smallest and the largest grain of each kind, at the origin.
pub fn stand_ins(materials: &Materials) -> Vec<Grain> {
    let both = materials.ingredients.iter().flat_map(|i| {
        [i.sizes.smallest(), i.sizes.largest()].map(|radius| Grain {
            material: i.material,
            ..Grain::at_rest(Vector3::zeros(), radius, i.density)
        })
    });
    both.collect()
}
