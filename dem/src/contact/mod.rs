//! Contact laws: what two touching surfaces do to each other.
//!
//! A law is composed of a normal part, a tangential spring and, where the scene asks for it, rolling
//! and twisting springs. Pairs and walls call the *same* functions: a wall is a partner of infinite
//! mass and radius. Laws are written for any lane width and know nothing of grains, lists or threads.

pub mod hooke;
pub mod shape_springs;
pub mod slider;
pub mod tangential;

use crate::lanes::{Lane, Vec3};
pub use hooke::Hooke;
use serde::{Deserialize, Serialize};
pub use shape_springs::ShapeParameter;
pub use tangential::TangentialSpring;

/// Where the contact point lies on the line of centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lever {
    /// The lever arms share the distance of the centres as the radii do, `l_i = R_i r/(R_i + R_j)`:
    /// `l_i + l_j = r`, so angular momentum is conserved exactly.
    #[default]
    ContactPoint,
    /// The arms are the undeformed radii, as in LAMMPS `gran/hooke/history`: angular momentum is
    /// conserved up to the overlap.
    Radius,
}

/// Contact law of a scene: linear springs and dashpots (Thuillet 2019, Eq. 2.1–2.13).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactLaw {
    /// Normal spring and dashpot.
    pub normal: Hooke,
    /// Tangential spring, dashpot and Coulomb slider.
    pub tangential: TangentialSpring,
    /// Rolling and twisting springs of angular grains; none for spheres.
    pub rolling: Option<ShapeParameter>,
    /// Lever arm of the tangential force.
    pub lever: Lever,
}

/// Numbers of history a contact carries: tangential spring (3), rolling spring (3), twist (1).
pub const HISTORY_SLIDING: usize = 3;
/// See [`HISTORY_SLIDING`].
pub const HISTORY_ROLLING: usize = 7;

impl ContactLaw {
    /// Numbers of history each contact carries under this law.
    pub fn history(&self) -> usize {
        if self.rolling.is_some() {
            HISTORY_ROLLING
        } else {
            HISTORY_SLIDING
        }
    }

    /// Normal dashpot coefficient C_n (N s/m) at a reduced mass (kg).
    pub fn normal_damping(&self, reduced_mass: f64) -> f64 {
        self.normal.damping_factor() * reduced_mass.sqrt()
    }
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

/// A law ready to be evaluated in the inner loop; the compiler makes one loop for each kind.
pub trait Interaction: Copy + Send + Sync {
    /// Numbers of history of a contact.
    const HISTORY: usize;
    /// Whether there are rolling and twisting moments.
    const ROLLING: bool;
    /// Force and moment on `i`; `history` holds the springs before and after.
    fn wrench<L: Lane>(
        &self,
        touch: &Touch<L>,
        history: &mut [L; HISTORY_ROLLING],
        step: Step,
    ) -> Wrench<L>;
}

/// Normal and tangential springs of smooth spheres.
#[derive(Clone, Copy, Debug)]
pub struct Sliding {
    normal: hooke::Coefficients,
    tangential: tangential::Coefficients,
}

/// The same with rolling and twisting springs.
#[derive(Clone, Copy, Debug)]
pub struct Rolling {
    sliding: Sliding,
    springs: shape_springs::Coefficients,
}

impl Sliding {
    /// Coefficients of a scene's law.
    pub fn new(law: &ContactLaw) -> Self {
        Sliding {
            normal: law.normal.coefficients(),
            tangential: law.tangential.coefficients(&law.normal),
        }
    }
}

impl Rolling {
    /// Coefficients of a scene's law.
    pub fn new(law: &ContactLaw, shape: &ShapeParameter) -> Self {
        Rolling {
            sliding: Sliding::new(law),
            springs: shape.coefficients(&law.normal, &law.tangential),
        }
    }
}

impl Interaction for Sliding {
    const HISTORY: usize = HISTORY_SLIDING;
    const ROLLING: bool = false;

    #[inline(always)]
    fn wrench<L: Lane>(
        &self,
        touch: &Touch<L>,
        history: &mut [L; HISTORY_ROLLING],
        step: Step,
    ) -> Wrench<L> {
        let approach = -touch.velocity.dot(touch.normal);
        let normal = self
            .normal
            .force(touch.overlap, approach, touch.inverse_mass);
        let spring = Vec3([history[0], history[1], history[2]]);
        let (tangential, spring) = self.tangential.force(touch, spring, normal.abs(), step);
        history[..3].copy_from_slice(&spring.0);
        Wrench {
            force: touch.normal.scale(normal) + tangential,
            tangential,
            moment: Vec3::zero(),
        }
    }
}

impl Interaction for Rolling {
    const HISTORY: usize = HISTORY_ROLLING;
    const ROLLING: bool = true;

    #[inline(always)]
    fn wrench<L: Lane>(
        &self,
        touch: &Touch<L>,
        history: &mut [L; HISTORY_ROLLING],
        step: Step,
    ) -> Wrench<L> {
        let mut wrench = self.sliding.wrench(touch, history, step);
        let normal = wrench.force.dot(touch.normal).abs();
        let rolled = Vec3([history[3], history[4], history[5]]);
        let (moment, rolled, twisted) =
            self.springs.moment(touch, rolled, history[6], normal, step);
        history[3..6].copy_from_slice(&rolled.0);
        history[6] = twisted;
        wrench.moment = moment;
        wrench
    }
}
