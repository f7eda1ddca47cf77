//! Contact laws: what two touching surfaces do to each other.
//!
//! A law is composed of a normal part, a tangential part and, where the scene asks for it, rolling
//! and twisting resistance and cohesion. Pairs and walls call the *same* functions: a wall is a
//! partner of infinite mass and radius. Laws are written for any lane width and know nothing of
//! grains, lists or threads.
//!
//! | part | laws |
//! |---|---|
//! | normal | [`Hooke`], [`Hertz`], [`Viscoelastic`], [`Jkr`] |
//! | tangential | [`TangentialSpring`] (linear), [`Mindlin`], sliding of [`Jkr`] contacts |
//! | rolling, twisting | [`Epsd`], [`ShapeParameter`], rolling and twisting of [`Jkr`] contacts |
//! | cohesion | [`Cohesion`]: DMT, Scheeres, constant strength on the contact patch |
//!
//! [`composition`] says which parts go together and why others do not; [`table`] what happens where
//! materials differ; [`parcels`] how a law changes when one parcel stands for many grains.
//!
//! **Springs under a changing load.** Where the normal stiffness grows with the overlap (Hertz), so
//! does that of springs derived from it. A spring that becomes stiffer keeps its *force*, one that
//! becomes softer keeps its *displacement*: the energy stored, f²/2k = k s²/2, then only falls when
//! the load changes, and no cycle of loading and shearing creates energy (Walton & Braun's and
//! LAMMPS' rescaling have the same aim; storing the force alone gains energy on unloading, storing
//! the displacement alone gains it on loading).

pub mod cohesion;
pub mod composition;
#[cfg(test)]
mod cycles;
pub mod dashpots;
pub mod epsd;
pub mod hertz;
pub mod hooke;
pub mod jkr;
pub mod jkr_springs;
pub mod mindlin;
pub mod parcels;
pub mod shape_springs;
pub mod slider;
pub mod table;
pub mod tangential;
pub mod viscoelastic;

use crate::lanes::{Lane, Vec3};
pub use cohesion::Cohesion;
pub use composition::Composition;
pub use dashpots::{Dashpots, Inertia};
pub use epsd::Epsd;
pub use hertz::{Elasticity, Hertz};
pub use hooke::{Damping, Hooke};
pub use jkr::Jkr;
pub use mindlin::Mindlin;
use serde::{Deserialize, Serialize};
pub use shape_springs::ShapeParameter;
pub use table::{LawTable, Laws};
pub use tangential::{SpringStiffness, TangentialSpring};
pub use viscoelastic::Viscoelastic;

/// Where the contact point lies on the line of centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lever {
    /// The lever arms share the distance of the centres as the radii do, `l_i = R_i r/(R_i + R_j)`:
    /// `l_i + l_j = r`, so angular momentum is conserved exactly. On a wall the arm ends at the plane,
    /// shorter than the radius by the overlap: not the limit of a growing partner, which takes the
    /// overlap's share with its radius.
    #[default]
    ContactPoint,
    /// The arms are the undeformed radii, as in LAMMPS `gran/hooke/history`: angular momentum is
    /// conserved up to the overlap.
    Radius,
}

/// Normal part of a law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Normal {
    /// Linear spring and dashpot.
    Hooke(Hooke),
    /// Elastic spheres with a dashpot matched to the restitution.
    Hertz(Hertz),
    /// Elastic spheres of viscous material; never attractive.
    Viscoelastic(Viscoelastic),
    /// Adhesive elastic spheres.
    Jkr(Jkr),
}

impl Normal {
    /// E* (Pa) of elastic spheres; linear springs have none.
    pub fn elastic_modulus(&self) -> Option<f64> {
        match self {
            Normal::Hooke(_) => None,
            Normal::Hertz(hertz) => Some(hertz.effective_modulus),
            Normal::Viscoelastic(v) => Some(v.effective_modulus),
            Normal::Jkr(jkr) => Some(jkr.effective_modulus()),
        }
    }

    /// Stiffness against a small motion about `overlap`, and force over overlap where the force is
    /// elastic alone (N/m, N/m).
    fn stiffness(&self, reduced_radius: f64, overlap: f64) -> (f64, f64) {
        match self {
            Normal::Hooke(hooke) => (hooke.stiffness, hooke.stiffness),
            Normal::Hertz(Hertz {
                effective_modulus, ..
            })
            | Normal::Viscoelastic(Viscoelastic {
                effective_modulus, ..
            }) => {
                let secant = hertz::secant_stiffness(*effective_modulus, reduced_radius, overlap);
                (1.5 * secant, secant)
            }
            Normal::Jkr(jkr) => {
                let tangent = jkr.stiffness(reduced_radius, overlap);
                (tangent, tangent)
            }
        }
    }
}

/// Tangential part of a law.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tangential {
    /// No tangential force.
    #[default]
    None,
    /// Linear spring with history, dashpot and Coulomb friction.
    Linear(TangentialSpring),
    /// Tangential stiffness of a Hertz contact, with history.
    Mindlin(Mindlin),
    /// Elastic–plastic sliding of a [`Jkr`] contact, from its own constants.
    Jkr,
}

/// Resistance to rolling and twisting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rolling {
    /// Grains roll and twist freely.
    #[default]
    None,
    /// Elastic–plastic spring and dashpot in rolling (model C of Ai et al. 2011).
    Epsd(Epsd),
    /// Rolling and twisting springs of angular grains (pkdgrav).
    Shape(ShapeParameter),
    /// Rolling and twisting of a [`Jkr`] contact, from its own constants.
    Jkr,
}

impl From<Option<ShapeParameter>> for Rolling {
    fn from(shape: Option<ShapeParameter>) -> Self {
        shape.map_or(Rolling::None, Rolling::Shape)
    }
}

/// What two touching surfaces do to each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactLaw {
    /// Normal part.
    pub normal: Normal,
    /// Tangential part.
    pub tangential: Tangential,
    /// Rolling and twisting.
    pub rolling: Rolling,
    /// Attraction of touching grains.
    pub cohesion: Cohesion,
    /// Lever arm of the tangential force.
    pub lever: Lever,
}

impl ContactLaw {
    /// Linear springs and dashpots (Thuillet 2019, Eq. 2.1–2.13): the law of the inclined planes.
    pub fn linear(
        normal: Hooke,
        tangential: TangentialSpring,
        shape: Option<ShapeParameter>,
    ) -> ContactLaw {
        ContactLaw {
            normal: Normal::Hooke(normal),
            tangential: Tangential::Linear(tangential),
            rolling: shape.into(),
            cohesion: Cohesion::None,
            lever: Lever::ContactPoint,
        }
    }

    /// Hertz–Mindlin contacts of one material (LIGGGHTS' `hertz` with `tangential history`).
    pub fn hertz_mindlin(elasticity: Elasticity, restitution: f64, friction: f64) -> ContactLaw {
        ContactLaw {
            normal: Normal::Hertz(Hertz::of(elasticity, restitution)),
            tangential: Tangential::Mindlin(Mindlin::of(elasticity, restitution, friction)),
            rolling: Rolling::None,
            cohesion: Cohesion::None,
            lever: Lever::ContactPoint,
        }
    }

    /// Adhesive elastic spheres that slide, roll and twist (Dominik & Tielens 1997).
    pub fn adhesive(jkr: Jkr) -> ContactLaw {
        ContactLaw {
            normal: Normal::Jkr(jkr),
            tangential: Tangential::Jkr,
            rolling: Rolling::Jkr,
            cohesion: Cohesion::None,
            lever: Lever::ContactPoint,
        }
    }

    /// Stiffness of a contact under `overlap` (m) at a reduced radius (m): what a small motion about
    /// that state meets. (N/m, N/m, N m/rad, N m/rad)
    pub fn stiffness(&self, reduced_radius: f64, overlap: f64) -> Stiffness {
        let (normal, secant) = self.normal.stiffness(reduced_radius, overlap);
        let tangential = match (&self.tangential, &self.normal) {
            (Tangential::None, _) => 0.0,
            (Tangential::Linear(spring), _) => spring.stiffness(secant),
            (Tangential::Mindlin(mindlin), _) => mindlin.stiffness(reduced_radius, overlap),
            (Tangential::Jkr, Normal::Jkr(jkr)) => jkr.sliding_stiffness(reduced_radius),
            (Tangential::Jkr, _) => 0.0,
        };
        let (rolling, twisting) = match (&self.rolling, &self.normal) {
            (Rolling::None, _) => (0.0, 0.0),
            (Rolling::Epsd(epsd), _) => (epsd.stiffness(secant, reduced_radius), 0.0),
            (Rolling::Shape(shape), _) => (
                shape.rolling_stiffness(secant, reduced_radius),
                shape.twisting_stiffness(tangential, reduced_radius),
            ),
            (Rolling::Jkr, Normal::Jkr(jkr)) => (
                jkr.rolling_stiffness(reduced_radius),
                jkr.twisting_stiffness(reduced_radius),
            ),
            (Rolling::Jkr, _) => (0.0, 0.0),
        };
        Stiffness {
            normal,
            tangential,
            rolling,
            twisting,
        }
    }

    /// Duration of an isolated impact at `speed` (m/s), s; that of a JKR contact is half the period of
    /// its oscillation about equilibrium, the elastic ones' leave their dashpots out.
    pub fn contact_time(&self, reduced_mass: f64, reduced_radius: f64, speed: f64) -> f64 {
        match &self.normal {
            Normal::Hooke(hooke) => hooke.contact_time(reduced_mass),
            Normal::Hertz(Hertz {
                effective_modulus, ..
            })
            | Normal::Viscoelastic(Viscoelastic {
                effective_modulus, ..
            }) => hertz::impact_time(*effective_modulus, reduced_mass, reduced_radius, speed),
            Normal::Jkr(jkr) => {
                let stiffness =
                    jkr.stiffness(reduced_radius, jkr.equilibrium_overlap(reduced_radius));
                std::f64::consts::PI * (reduced_mass / stiffness).sqrt()
            }
        }
    }

    /// How far apart two surfaces may be pulled before an established contact is lost (m).
    pub fn reach(&self, reduced_radius: f64) -> f64 {
        match &self.normal {
            Normal::Jkr(jkr) => jkr.pull_off_gap(reduced_radius),
            _ => 0.0,
        }
    }
}

/// Stiffness of a contact against small motions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stiffness {
    /// N/m.
    pub normal: f64,
    /// N/m.
    pub tangential: f64,
    /// N m/rad.
    pub rolling: f64,
    /// N m/rad.
    pub twisting: f64,
}

/// Geometry and motion of a touching contact, seen from side `i`.
#[derive(Clone, Copy)]
pub struct Touch<L> {
    /// Unit vector from `j` to `i`.
    pub normal: Vec3<L>,
    /// Overlap, positive when pressed together (m).
    pub overlap: L,
    /// Velocity of `i`'s surface against `j`'s at the contact point (m/s).
    pub velocity: Vec3<L>,
    /// Angular velocity of `i` minus that of `j` (rad/s); only read by laws that roll.
    pub spin: Vec3<L>,
    /// `1/m_i + 1/m_j` (1/kg).
    pub inverse_mass: L,
    /// `1/R_i + 1/R_j` (1/m).
    pub curvature: L,
    /// `1/(m_i R_i²) + 1/(m_j R_j²)` (kg⁻¹ m⁻²); only read by laws that ask for it.
    pub inverse_inertia: L,
}

/// What side `i` feels; side `j` feels the opposite force and moment at the same contact point.
#[derive(Clone, Copy)]
pub struct Wrench<L> {
    /// Force (N).
    pub force: Vec3<L>,
    /// Its tangential part (N).
    pub tangential: Vec3<L>,
    /// Rolling and twisting moment beyond the force's own (N m).
    pub moment: Vec3<L>,
}

/// Everything about a step that a law needs.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Time by which springs are stretched at this evaluation (s): the step, or 0 at the first
    /// evaluation of a run, when no time has passed yet.
    pub stretch: f64,
}

/// Energy stored by a contact, by channel (J).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stored {
    /// Normal part, with the energy of adhesion.
    pub normal: f64,
    /// Attraction of a [`Cohesion`]: -F_c times the overlap.
    pub cohesion: f64,
    /// Tangential spring.
    pub tangential: f64,
    /// Rolling spring.
    pub rolling: f64,
    /// Twisting spring.
    pub twisting: f64,
}

/// Numbers that a law keeps for one pair of materials; four rows of four, so that tables of mixed
/// materials turn into lanes by transposing rows.
pub const COEFFICIENTS: usize = 16;

/// History of a contact at the most: tangential (3), rolling (3), twist (1), memory (1).
pub const HISTORY_MAX: usize = 8;

/// A law ready to be evaluated in the inner loop; the compiler makes one loop for each composition.
///
/// History is ordered: vectors of `i` against `j` first (they change sign when a pair changes order),
/// then the twist about the normal and the memory of the normal part, which do not.
pub trait Interaction: Copy + Send + Sync {
    /// Numbers of history of a contact.
    const HISTORY: usize;
    /// How many of them, from the first, change sign with the order of the pair.
    const FLIPS: usize;
    /// Whether there are rolling and twisting moments.
    const ROLLING: bool;
    /// Whether `Touch::inverse_inertia` is read.
    const INERTIA: bool;
    /// Whether an established contact holds across a gap.
    const HOLDS: bool;
    /// Coefficients of all pairs of materials, `first · materials + second`.
    fn table(&self) -> &[[f64; COEFFICIENTS]];
    /// Number of materials.
    fn materials(&self) -> usize;
    /// Force and moment on `i`; `history` holds the springs before and after.
    fn wrench<L: Lane>(
        &self,
        coefficients: &[L; COEFFICIENTS],
        touch: &Touch<L>,
        history: &mut [L; HISTORY_MAX],
        step: Step,
    ) -> Wrench<L>;
    /// Gap up to which a contact holds (m) whose last number of history is `memory`; zero where that is.
    fn hold<L: Lane>(&self, coefficients: &[L; COEFFICIENTS], memory: L) -> L;
    /// Energy stored by a contact.
    fn stored(
        &self,
        coefficients: &[f64; COEFFICIENTS],
        overlap: f64,
        curvature: f64,
        history: &[f64],
    ) -> Stored;
}
