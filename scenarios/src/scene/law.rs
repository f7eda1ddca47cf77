//! The section `[contact]` of grain scenes: every law of the engine by name.
//!
//! A part that is not named is the usual partner of the normal law ([`LawKeys::parts`]). Keys that
//! the parts do not read are refused where somebody wrote them and dropped where they are defaults.

use super::SceneError;
use colluvium_dem::contact::mindlin::SpringMemory;
use colluvium_dem::{
    Cohesion, ContactLaw, Damping, Elasticity, Epsd, Hertz, Hooke, Jkr, Lever, Mindlin, Normal,
    Rolling, SetupError, ShapeParameter, SpringStiffness, Tangential, TangentialSpring,
    Viscoelastic,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The contact law, in parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LawKeys {
    /// Normal law; hooke where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal: Option<NormalKind>,
    /// Tangential law; left out: linear for hooke, mindlin for hertz and viscoelastic, jkr for jkr.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tangential: Option<TangentialKind>,
    /// Resistance to rolling and twisting; left out: jkr for jkr, else none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rolling: Option<RollingKind>,
    /// Attraction of touching grains; left out: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cohesion: Option<CohesionKind>,
    /// Lever arm of the tangential force; left out: contact-point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lever: Option<LeverKind>,
    /// Normal stiffness k_n (N/m).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e12))]
    pub stiffness: Option<f64>,
    /// Normal restitution that the dashpots of hooke, hertz and mindlin are matched to.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.01, "maximum" = 1.0))]
    pub restitution: Option<f64>,
    /// γ_n (1/s) of hooke: the dashpot is γ_n times the reduced mass; Γ (1/s) of jkr.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e15))]
    pub damping_rate: Option<f64>,
    /// Tangential over normal stiffness, of linear.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 2.0))]
    pub stiffness_ratio: Option<f64>,
    /// Tangential stiffness (N/m), of linear.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e12))]
    pub tangential_stiffness: Option<f64>,
    /// ε_t: sets the dashpot of linear as the restitution sets the normal one; 1 = none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.01, "maximum" = 1.0))]
    pub tangential_restitution: Option<f64>,
    /// γ_t (1/s): the dashpot of linear is γ_t times the reduced mass.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e15))]
    pub tangential_damping_rate: Option<f64>,
    /// Coulomb friction μ, of linear and mindlin.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub friction: Option<f64>,
    /// What a mindlin spring keeps when the load makes it stiffer; left out: energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<MemoryKind>,
    /// E (Pa), of hertz, viscoelastic, jkr and mindlin.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e13))]
    pub youngs_modulus: Option<f64>,
    /// ν, of the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = -1.0, "maximum" = 0.5))]
    pub poissons_ratio: Option<f64>,
    /// A (s), of viscoelastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e3))]
    pub dissipation: Option<f64>,
    /// γ (J/m²), of jkr.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub surface_energy: Option<f64>,
    /// ξ_crit (m), of jkr: rolling displacement at which rolling yields.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub critical_rolling: Option<f64>,
    /// Rolling friction, of epsd and shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub rolling_friction: Option<f64>,
    /// Damping ratio of rolling, of epsd; 1 is critical.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub rolling_damping: Option<f64>,
    /// β, of shape and of a constant cohesion: size of the contact patch over the reduced radius.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 5.0))]
    pub beta: Option<f64>,
    /// Twisting friction, of shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub twisting_friction: Option<f64>,
    /// w (J/m²), of dmt.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e4))]
    pub work_of_adhesion: Option<f64>,
    /// S_c, of scheeres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub cleanliness: Option<f64>,
    /// R_a (m), where asperities touch, of dmt and scheeres; left out: smooth grains.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub asperity_radius: Option<f64>,
    /// Strength c (Pa), of constant.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e12))]
    pub strength: Option<f64>,
}

macro_rules! kinds {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $word:literal),* $(,)? }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        pub enum $name {
            $($(#[$doc])* #[serde(rename = $word)] $variant),*
        }
        impl $name {
            /// Its name in a scene.
            pub fn word(self) -> &'static str {
                match self { $($name::$variant => $word),* }
            }
        }
    };
}

kinds! {
    /// Normal laws.
    NormalKind {
        /// Linear spring and dashpot.
        Hooke = "hooke",
        /// Elastic spheres with a dashpot matched to a restitution.
        Hertz = "hertz",
        /// Elastic spheres of viscous material.
        Viscoelastic = "viscoelastic",
        /// Adhesive elastic spheres.
        Jkr = "jkr",
    }
}
kinds! {
    /// Tangential laws.
    TangentialKind {
        /// No tangential force.
        None = "none",
        /// Linear spring with history, dashpot and Coulomb friction.
        Linear = "linear",
        /// Tangential stiffness of elastic spheres, with history.
        Mindlin = "mindlin",
        /// Sliding of adhesive contacts.
        Jkr = "jkr",
    }
}
kinds! {
    /// Rolling laws.
    RollingKind {
        /// Grains roll and twist freely.
        None = "none",
        /// Elastic-plastic spring and dashpot in rolling.
        Epsd = "epsd",
        /// Rolling and twisting springs of angular grains.
        Shape = "shape",
        /// Rolling and twisting of adhesive contacts.
        Jkr = "jkr",
    }
}
kinds! {
    /// Cohesions.
    CohesionKind {
        /// None.
        None = "none",
        /// Derjaguin, Muller and Toporov.
        Dmt = "dmt",
        /// Van der Waals attraction of lunar regolith.
        Scheeres = "scheeres",
        /// Constant strength on the contact patch.
        Constant = "constant",
    }
}
kinds! {
    /// Where the contact point lies on the line of centres.
    LeverKind {
        /// It divides the line as the radii do.
        ContactPoint = "contact-point",
        /// The arms are the undeformed radii.
        Radius = "radius",
    }
}
kinds! {
    /// What a spring keeps when the load makes it stiffer.
    MemoryKind {
        /// Its force: no cycle creates energy.
        Energy = "energy",
        /// Its displacement, as other codes do.
        Displacement = "displacement",
    }
}

/// The keys that name a part.
pub const KINDS: [&str; 4] = ["normal", "tangential", "rolling", "cohesion"];

/// Keys of which one at most may be given.
pub const CHOICES: [&[&str]; 3] = [
    &["contact.restitution", "contact.damping_rate"],
    &["contact.stiffness_ratio", "contact.tangential_stiffness"],
    &[
        "contact.tangential_restitution",
        "contact.tangential_damping_rate",
    ],
];

/// The parts that a section asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Normal law.
    pub normal: NormalKind,
    /// Tangential law.
    pub tangential: TangentialKind,
    /// Rolling law.
    pub rolling: RollingKind,
    /// Cohesion.
    pub cohesion: CohesionKind,
}

impl Parts {
    /// The keys these parts read.
    pub fn reads(self) -> Vec<&'static str> {
        let mut keys = match self.normal {
            NormalKind::Hooke => vec!["stiffness", "restitution", "damping_rate"],
            NormalKind::Hertz => vec!["youngs_modulus", "poissons_ratio", "restitution"],
            NormalKind::Viscoelastic => vec!["youngs_modulus", "poissons_ratio", "dissipation"],
            NormalKind::Jkr => vec![
                "youngs_modulus",
                "poissons_ratio",
                "surface_energy",
                "damping_rate",
                "critical_rolling",
            ],
        };
        keys.extend::<&[&str]>(match self.tangential {
            TangentialKind::Linear => &[
                "stiffness_ratio",
                "tangential_stiffness",
                "tangential_restitution",
                "tangential_damping_rate",
                "friction",
            ],
            TangentialKind::Mindlin => &[
                "youngs_modulus",
                "poissons_ratio",
                "restitution",
                "friction",
                "memory",
            ],
            TangentialKind::None | TangentialKind::Jkr => &[],
        });
        keys.extend::<&[&str]>(match self.rolling {
            RollingKind::Epsd => &["rolling_friction", "rolling_damping"],
            RollingKind::Shape => &["beta", "rolling_friction", "twisting_friction"],
            RollingKind::None | RollingKind::Jkr => &[],
        });
        keys.extend::<&[&str]>(match self.cohesion {
            CohesionKind::None => &[],
            CohesionKind::Dmt => &["work_of_adhesion", "asperity_radius"],
            CohesionKind::Scheeres => &["cleanliness", "asperity_radius"],
            CohesionKind::Constant => &["strength", "beta"],
        });
        keys.extend(KINDS);
        keys.push("lever");
        keys
    }
}

/// A key that is missing from a section, and what belongs there.
struct Missing(&'static str, String);

impl LawKeys {
    /// The parts, with the usual partners of the normal law where none is named.
    pub fn parts(&self) -> Parts {
        let normal = self.normal.unwrap_or(NormalKind::Hooke);
        Parts {
            normal,
            tangential: self.tangential.unwrap_or(match normal {
                NormalKind::Hooke => TangentialKind::Linear,
                NormalKind::Hertz | NormalKind::Viscoelastic => TangentialKind::Mindlin,
                NormalKind::Jkr => TangentialKind::Jkr,
            }),
            rolling: self.rolling.unwrap_or(match normal {
                NormalKind::Jkr => RollingKind::Jkr,
                _ => RollingKind::None,
            }),
            cohesion: self.cohesion.unwrap_or(CohesionKind::None),
        }
    }

    /// The law, or which key of which file stands against it.
    pub fn law(&self, origin: &str) -> Result<ContactLaw, SceneError> {
        self.check_parts(origin)?;
        let law = self
            .compose()
            .map_err(|Missing(key, wanted)| SceneError::MissingKey {
                file: origin.to_owned(),
                key: format!("contact.{key}"),
                wanted,
            })?;
        law.validate().map_err(|error| SceneError::Unreadable {
            file: origin.to_owned(),
            message: error.to_string(),
        })?;
        Ok(law)
    }

    /// Whether the parts go together, whatever their numbers: that is said before numbers are asked for.
    fn check_parts(&self, origin: &str) -> Result<(), SceneError> {
        let Ok(law) = self.filled().compose() else {
            return Ok(());
        };
        let Err(SetupError::Composition(reason)) = law.validate() else {
            return Ok(());
        };
        let (key, word) = self.misfit(&law);
        Err(SceneError::Composition {
            file: origin.to_owned(),
            key: format!("contact.{key}"),
            value: word.to_owned(),
            reason: reason.to_owned(),
        })
    }

    /// The section with some allowed number wherever there is none.
    fn filled(&self) -> LawKeys {
        let some = |value: Option<f64>| value.or(Some(0.3));
        LawKeys {
            stiffness: some(self.stiffness),
            restitution: some(self.restitution),
            damping_rate: some(self.damping_rate),
            tangential_stiffness: match self.stiffness_ratio {
                None => some(self.tangential_stiffness),
                Some(_) => self.tangential_stiffness,
            },
            tangential_restitution: some(self.tangential_restitution),
            friction: some(self.friction),
            youngs_modulus: some(self.youngs_modulus),
            poissons_ratio: some(self.poissons_ratio),
            dissipation: some(self.dissipation),
            surface_energy: some(self.surface_energy),
            critical_rolling: some(self.critical_rolling),
            rolling_friction: some(self.rolling_friction),
            rolling_damping: some(self.rolling_damping),
            beta: some(self.beta),
            twisting_friction: some(self.twisting_friction),
            work_of_adhesion: some(self.work_of_adhesion),
            cleanliness: some(self.cleanliness),
            strength: some(self.strength),
            ..*self
        }
    }

    /// The part without which the law would do, and its name.
    fn misfit(&self, law: &ContactLaw) -> (&'static str, &'static str) {
        let parts = self.parts();
        let mut without = *law;
        without.cohesion = Cohesion::None;
        if without.validate().is_ok() {
            return ("cohesion", parts.cohesion.word());
        }
        without.cohesion = law.cohesion;
        without.rolling = Rolling::None;
        if without.validate().is_ok() {
            return ("rolling", parts.rolling.word());
        }
        ("tangential", parts.tangential.word())
    }

    fn compose(&self) -> Result<ContactLaw, Missing> {
        let parts = self.parts();
        let normal = match parts.normal {
            NormalKind::Hooke => Normal::Hooke(Hooke {
                stiffness: need(self.stiffness, "stiffness", "N/m")?,
                damping: damping(
                    self.restitution,
                    self.damping_rate,
                    "restitution",
                    "contact.restitution or contact.damping_rate",
                )?,
            }),
            NormalKind::Hertz => {
                let restitution = need(self.restitution, "restitution", "in [0.01, 1]")?;
                Normal::Hertz(Hertz::of(self.elasticity()?, restitution))
            }
            NormalKind::Viscoelastic => {
                let dissipation = need(self.dissipation, "dissipation", "A in s")?;
                Normal::Viscoelastic(Viscoelastic::of(self.elasticity()?, dissipation))
            }
            NormalKind::Jkr => Normal::Jkr(Jkr {
                surface_energy: need(self.surface_energy, "surface_energy", "γ in J/m²")?,
                elasticity: self.elasticity()?,
                damping_rate: need(self.damping_rate, "damping_rate", "Γ in 1/s")?,
                critical_rolling: need(self.critical_rolling, "critical_rolling", "ξ_crit in m")?,
            }),
        };
        Ok(ContactLaw {
            normal,
            tangential: self.compose_tangential(parts.tangential)?,
            rolling: self.compose_rolling(parts.rolling)?,
            cohesion: self.compose_cohesion(parts.cohesion)?,
            lever: match self.lever {
                Some(LeverKind::Radius) => Lever::Radius,
                _ => Lever::ContactPoint,
            },
        })
    }

    fn compose_tangential(&self, kind: TangentialKind) -> Result<Tangential, Missing> {
        let friction = || need(self.friction, "friction", "μ in [0, 10]");
        Ok(match kind {
            TangentialKind::None => Tangential::None,
            TangentialKind::Jkr => Tangential::Jkr,
            TangentialKind::Linear => Tangential::Linear(TangentialSpring {
                stiffness: match (self.tangential_stiffness, self.stiffness_ratio) {
                    (Some(stiffness), _) => SpringStiffness::Absolute(stiffness),
                    (None, Some(ratio)) => SpringStiffness::Ratio(ratio),
                    // Only a linear spring has one stiffness to be in proportion to.
                    (None, None) if self.parts().normal != NormalKind::Hooke => {
                        return Err(Missing("tangential_stiffness", "N/m".into()));
                    }
                    (None, None) => {
                        let wanted = "contact.stiffness_ratio or contact.tangential_stiffness";
                        return Err(Missing("stiffness_ratio", wanted.into()));
                    }
                },
                damping: damping(
                    self.tangential_restitution,
                    self.tangential_damping_rate,
                    "tangential_restitution",
                    "contact.tangential_restitution or contact.tangential_damping_rate",
                )?,
                friction: friction()?,
            }),
            TangentialKind::Mindlin => {
                let restitution = need(self.restitution, "restitution", "in [0.01, 1]")?;
                let mut mindlin = Mindlin::of(self.elasticity()?, restitution, friction()?);
                mindlin.memory = match self.memory {
                    Some(MemoryKind::Displacement) => SpringMemory::Displacement,
                    _ => SpringMemory::Energy,
                };
                Tangential::Mindlin(mindlin)
            }
        })
    }

    fn compose_rolling(&self, kind: RollingKind) -> Result<Rolling, Missing> {
        let friction = || need(self.rolling_friction, "rolling_friction", "in [0, 10]");
        Ok(match kind {
            RollingKind::None => Rolling::None,
            RollingKind::Jkr => Rolling::Jkr,
            RollingKind::Epsd => Rolling::Epsd(Epsd {
                rolling_friction: friction()?,
                damping_ratio: need(self.rolling_damping, "rolling_damping", "in [0, 10]")?,
            }),
            RollingKind::Shape => Rolling::Shape(ShapeParameter {
                beta: need(self.beta, "beta", "in (0, 5]")?,
                rolling_friction: friction()?,
                twisting_friction: need(self.twisting_friction, "twisting_friction", "in [0, 10]")?,
            }),
        })
    }

    fn compose_cohesion(&self, kind: CohesionKind) -> Result<Cohesion, Missing> {
        let asperity_radius = self.asperity_radius;
        Ok(match kind {
            CohesionKind::None => Cohesion::None,
            CohesionKind::Dmt => Cohesion::Dmt {
                work_of_adhesion: need(self.work_of_adhesion, "work_of_adhesion", "w in J/m²")?,
                asperity_radius,
            },
            CohesionKind::Scheeres => Cohesion::Scheeres {
                cleanliness: need(self.cleanliness, "cleanliness", "S_c in [0, 1]")?,
                asperity_radius,
            },
            CohesionKind::Constant => Cohesion::Constant {
                strength: need(self.strength, "strength", "c in Pa")?,
                patch: need(self.beta, "beta", "in (0, 5]")?,
            },
        })
    }

    fn elasticity(&self) -> Result<Elasticity, Missing> {
        Ok(Elasticity {
            youngs_modulus: need(self.youngs_modulus, "youngs_modulus", "E in Pa")?,
            poissons_ratio: need(self.poissons_ratio, "poissons_ratio", "ν in (-1, 0.5]")?,
        })
    }
}

fn need(value: Option<f64>, key: &'static str, wanted: &str) -> Result<f64, Missing> {
    value.ok_or_else(|| Missing(key, wanted.to_owned()))
}

fn damping(
    restitution: Option<f64>,
    rate: Option<f64>,
    key: &'static str,
    wanted: &str,
) -> Result<Damping, Missing> {
    match (rate, restitution) {
        (Some(rate), _) => Ok(Damping::MassProportional(rate)),
        (None, Some(restitution)) => Ok(Damping::Restitution(restitution)),
        (None, None) => Err(Missing(key, wanted.to_owned())),
    }
}
