//! What a simulation starts from, and what is wrong with it.

use crate::bodies::{Body, feeling_parts};
use crate::contact::{
    Cohesion, ContactLaw, Damping, Elasticity, LawTable, Laws, Normal, Rolling, SpringStiffness,
    Tangential,
};
use crate::domain::Domain;
use crate::grains::Grain;
use crate::preparation::{Rest, RestMeasures};
use crate::timestep::{self, Choice, Classes, Conditions, Pair, Shares};
use crate::walls::Wall;
use nalgebra::Vector3;

/// Whether a step is shared out over threads. The results are the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Threads {
    /// The calling thread alone; best when whole simulations run side by side.
    #[default]
    Serial,
    /// The current rayon pool.
    Rayon,
}

/// Everything a simulation starts from (SI).
#[derive(Clone, Debug)]
pub struct Setup {
    /// The box.
    pub domain: Domain,
    /// Acceleration of gravity (m/s²).
    pub gravity: Vector3<f64>,
    /// What touching surfaces do to each other, for all pairs of materials.
    pub law: Laws,
    /// The grains; their order is their number.
    pub grains: Vec<Grain>,
    /// Walls; their order is their number.
    pub walls: Vec<Wall>,
    /// Rigid bodies; their order is their number.
    pub bodies: Vec<Body>,
    /// Length of a step (s).
    pub timestep: f64,
    /// Sharing of a step over threads.
    pub threads: Threads,
}

/// A value that no simulation can start from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// A number outside its range.
    #[error("{key} = {value}: must be {allowed}")]
    OutOfRange {
        /// Which number.
        key: String,
        /// What it is.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// The periodic box is too narrow for a pair to have one nearest image.
    #[error(
        "domain: periodic axis {axis} is {length:e} m long: must be at least {least:e} m, \
         two largest diameters and the list's skin"
    )]
    NarrowDomain {
        /// x, y or z.
        axis: char,
        /// Its length (m).
        length: f64,
        /// What it must be (m).
        least: f64,
    },
    /// The step is longer than one contact of the stiffest pair allows.
    #[error(
        "timestep = {timestep:e} s: must be below {below:.4e} s (limit: {limit}, {pair}); {would_do:.3e} s would do"
    )]
    Unstable {
        /// The step (s).
        timestep: f64,
        /// Where one contact blows up (s).
        below: f64,
        /// What does.
        limit: &'static str,
        /// For whom.
        pair: Pair,
        /// The step that the limits allow (s).
        would_do: f64,
    },
    /// Parts of a law that do not go together.
    #[error("contact: {0}")]
    Composition(&'static str),
    /// Laws of two materials that cannot be mixed.
    #[error("contact: materials with different kinds of {0} cannot be mixed: give the pair's law")]
    Mixture(String),
    /// A material that no law is for.
    #[error("material {material}: there are laws for {materials} materials, numbered from 0")]
    Material {
        /// The number used.
        material: usize,
        /// How many there are.
        materials: usize,
    },
    /// A preparation was stopped by its observer.
    #[error("preparation was interrupted")]
    Interrupted,
    /// Random places are used up before all grains are in.
    #[error(
        "insertion: no room for grain {grain} of {grains} (radius {radius:.3e} m) in {tries} tries: a solid \
         fraction of {reached:.3} is reached of {asked:.3} asked for; random places end near 0.38 for equal \
         grains: insert less, or into a larger region and compact it"
    )]
    Full {
        /// Which grain, in falling order of size.
        grain: usize,
        /// How many there were to be.
        grains: usize,
        /// Its radius (m).
        radius: f64,
        /// Places tried for it.
        tries: u32,
        /// Solid fraction reached.
        reached: f64,
        /// That of all grains.
        asked: f64,
    },
    /// Grains did not come to rest in time.
    #[error(
        "preparation: not at rest after {patience} √(d/a): {measures}; asked for kinetic ≤ {:.1e}, \
         unbalanced ≤ {:.1e}: more damping, more patience or a shorter step may help",
        asked.kinetic, asked.unbalanced
    )]
    Restless {
        /// What was reached.
        measures: Box<RestMeasures>,
        /// What was asked for.
        asked: Rest,
        /// Time it was given, in √(d/a).
        patience: f64,
    },
    /// A packing does not get as dense, or as loose, as asked for.
    #[error("preparation: solid fraction {reached:.4} reached of {asked:.4} asked for: {why}")]
    Density {
        /// What was reached.
        reached: f64,
        /// What was asked for.
        asked: f64,
        /// Why it ends there.
        why: &'static str,
    },
    /// The grains flew apart while they were prepared.
    #[error("preparation: {0}")]
    Diverged(#[from] crate::Diverged),
    /// A checkpoint does not belong to this setup.
    #[error("checkpoint: {0}")]
    Record(String),
}

pub(crate) fn check(
    key: &str,
    value: f64,
    allowed: &'static str,
    ok: impl Fn(f64) -> bool,
) -> Result<(), SetupError> {
    if value.is_finite() && ok(value) {
        return Ok(());
    }
    Err(SetupError::OutOfRange {
        key: key.into(),
        value,
        allowed,
    })
}

fn positive(key: &str, value: f64) -> Result<(), SetupError> {
    check(key, value, "> 0", |v| v > 0.0)
}

fn not_negative(key: &str, value: f64) -> Result<(), SetupError> {
    check(key, value, "≥ 0", |v| v >= 0.0)
}

fn restitution(key: &str, value: f64) -> Result<(), SetupError> {
    check(key, value, "in (0, 1]", |v| v > 0.0 && v <= 1.0)
}

fn damping(prefix: &str, damping: &Damping) -> Result<(), SetupError> {
    match *damping {
        Damping::Restitution(e) => restitution(&format!("contact.{prefix}restitution"), e),
        Damping::MassProportional(rate) => {
            not_negative(&format!("contact.{prefix}damping_rate"), rate)
        }
    }
}

fn elasticity(material: &Elasticity) -> Result<(), SetupError> {
    positive("contact.youngs_modulus", material.youngs_modulus)?;
    check(
        "contact.poissons_ratio",
        material.poissons_ratio,
        "in (-1, 0.5]",
        |v| v > -1.0 && v <= 0.5,
    )
}

impl ContactLaw {
    /// Checks every number of the law, and that its parts go together.
    pub fn validate(&self) -> Result<(), SetupError> {
        match &self.normal {
            Normal::Hooke(hooke) => {
                check("contact.stiffness", hooke.stiffness, "> 0 N/m", |v| v > 0.0)?;
                damping("", &hooke.damping)?;
            }
            Normal::Hertz(hertz) => {
                positive("contact.effective_modulus", hertz.effective_modulus)?;
                restitution("contact.restitution", hertz.restitution)?;
            }
            Normal::Viscoelastic(v) => {
                positive("contact.effective_modulus", v.effective_modulus)?;
                not_negative("contact.dissipation", v.dissipation)?;
            }
            Normal::Jkr(jkr) => {
                elasticity(&jkr.elasticity)?;
                positive("contact.surface_energy", jkr.surface_energy)?;
                not_negative("contact.damping_rate", jkr.damping_rate)?;
                positive("contact.critical_rolling", jkr.critical_rolling)?;
            }
        }
        match &self.tangential {
            Tangential::None | Tangential::Jkr => {}
            Tangential::Linear(spring) => {
                match spring.stiffness {
                    SpringStiffness::Ratio(ratio) => {
                        not_negative("contact.tangential_stiffness_ratio", ratio)?;
                    }
                    SpringStiffness::Absolute(stiffness) => {
                        not_negative("contact.tangential_stiffness", stiffness)?;
                    }
                }
                damping("tangential_", &spring.damping)?;
                not_negative("contact.friction", spring.friction)?;
            }
            Tangential::Mindlin(mindlin) => {
                positive("contact.effective_shear", mindlin.effective_shear)?;
                restitution("contact.restitution", mindlin.restitution)?;
                not_negative("contact.friction", mindlin.friction)?;
            }
        }
        match &self.rolling {
            Rolling::None | Rolling::Jkr => {}
            Rolling::Epsd(epsd) => {
                not_negative("contact.rolling_friction", epsd.rolling_friction)?;
                not_negative("contact.rolling_damping", epsd.damping_ratio)?;
            }
            Rolling::Shape(shape) => {
                not_negative("contact.beta", shape.beta)?;
                not_negative("contact.rolling_friction", shape.rolling_friction)?;
                not_negative("contact.twisting_friction", shape.twisting_friction)?;
            }
        }
        let asperity = |radius: Option<f64>| match radius {
            Some(radius) => positive("contact.asperity_radius", radius),
            None => Ok(()),
        };
        match self.cohesion {
            Cohesion::None => Ok(()),
            Cohesion::Dmt {
                work_of_adhesion,
                asperity_radius,
            } => {
                not_negative("contact.work_of_adhesion", work_of_adhesion)?;
                asperity(asperity_radius)
            }
            Cohesion::Scheeres {
                cleanliness,
                asperity_radius,
            } => {
                not_negative("contact.cleanliness", cleanliness)?;
                asperity(asperity_radius)
            }
            Cohesion::Constant { strength, patch } => {
                not_negative("contact.strength", strength)?;
                not_negative("contact.patch", patch)
            }
        }?;
        crate::contact::Composition::of(&[*self])
            .map(|_| ())
            .map_err(SetupError::Composition)
    }
}

impl Setup {
    /// Checks all numbers; the list's skin decides how narrow a periodic box may be.
    pub(crate) fn validate(&self, skin: f64) -> Result<LawTable, SetupError> {
        let law = LawTable::new(&self.law)?;
        check("timestep", self.timestep, "> 0 s", |v| v > 0.0)?;
        check_gravity(&self.gravity)?;
        let materials = self.law.own.len();
        let largest = check_grains(&self.grains, materials)?;
        for (k, wall) in self.walls.iter().enumerate() {
            wall.validate(&format!("walls[{k}]"))?;
            known_material(wall.material, materials)?;
            wall.check_images(&self.domain, &format!("walls[{k}]"))?;
        }
        for (k, body) in self.bodies.iter().enumerate() {
            body.validate(&format!("bodies[{k}]"), materials)?;
            body.check_images(&self.domain, &format!("bodies[{k}]"))?;
        }
        check_box(&self.domain, largest, skin)?;
        Ok(law)
    }

    /// The limits of the step for these grains, walls and laws, and the step they allow.
    pub fn choose_step(
        &self,
        conditions: &Conditions,
        shares: &Shares,
    ) -> Result<Choice, SetupError> {
        let laws = LawTable::new(&self.law)?;
        for grain in &self.grains {
            known_material(grain.material, laws.materials())?;
        }
        for wall in &self.walls {
            known_material(wall.material, laws.materials())?;
        }
        let walls: Vec<u16> = self.walls.iter().map(|w| w.material).collect();
        for (k, body) in self.bodies.iter().enumerate() {
            body.validate(&format!("bodies[{k}]"), laws.materials())?;
        }
        let grains = self.grains.iter().map(timestep::Body::from);
        let classes = Classes::of(grains.chain(feeling_parts(self, &laws)?), &walls);
        let limits = timestep::limits_of(&classes, &laws, conditions, shares);
        Ok(timestep::choose(limits, shares.safety))
    }

    /// Refuses a step beyond which one contact of the stiffest pair blows up, whatever its accuracy.
    ///
    /// Not part of [`crate::Simulation::new`]: where a pair never touches, its limit does not matter.
    pub fn check_timestep(&self, conditions: &Conditions) -> Result<(), SetupError> {
        let choice = self.choose_step(conditions, &Shares::default())?;
        match choice.broken_by(self.timestep) {
            Some(limit) => Err(SetupError::Unstable {
                timestep: self.timestep,
                below: limit.seconds,
                limit: limit.name,
                pair: limit.pair,
                would_do: choice.allowed(),
            }),
            None => Ok(()),
        }
    }
}

pub(crate) fn check_gravity(gravity: &Vector3<f64>) -> Result<(), SetupError> {
    let mut parts = gravity.iter().enumerate();
    parts.try_for_each(|(k, g)| check(&format!("gravity[{k}]"), *g, "finite, m/s²", |_| true))
}

/// Beyond this a position counts as lost (m), and a square overflows.
pub(crate) const FARTHEST: f64 = 1e150;

/// Checks grains; their largest radius.
pub(crate) fn check_grains(grains: &[Grain], materials: usize) -> Result<f64, SetupError> {
    let mut largest: f64 = 0.0;
    for (k, g) in grains.iter().enumerate() {
        check(&format!("grains[{k}].radius"), g.radius, "> 0 m", |v| {
            v > 0.0
        })?;
        check(
            &format!("grains[{k}].density"),
            g.density,
            "> 0 kg/m³",
            |v| v > 0.0,
        )?;
        for (name, v) in [
            ("position", &g.position),
            ("velocity", &g.velocity),
            ("spin", &g.spin),
        ] {
            for c in v.iter() {
                // What a run would call lost.
                check(&format!("grains[{k}].{name}"), *c, "below 1e150", |v| {
                    v.abs() < FARTHEST
                })?;
            }
        }
        known_material(g.material, materials)?;
        largest = largest.max(g.radius);
    }
    Ok(largest)
}

/// Checks that a pair has one nearest image, with this largest radius and skin of the list.
pub(crate) fn check_box(domain: &Domain, largest: f64, skin: f64) -> Result<(), SetupError> {
    let least = 2.0 * (2.0 * largest + skin);
    for (k, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
        let length = domain.lengths()[k];
        if !(length > 0.0 && length.is_finite()) {
            check(&format!("domain.{axis}"), length, "> 0 m", |v| v > 0.0)?;
        }
        if domain.periodic[k] && length < least {
            return Err(SetupError::NarrowDomain {
                axis,
                length,
                least,
            });
        }
    }
    Ok(())
}

pub(crate) fn known_material(material: u16, materials: usize) -> Result<(), SetupError> {
    let material = usize::from(material);
    if material < materials {
        return Ok(());
    }
    Err(SetupError::Material {
        material,
        materials,
    })
}
