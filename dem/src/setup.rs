//! What a simulation starts from, and what is wrong with it.

use crate::contact::ContactLaw;
use crate::domain::Domain;
use crate::grains::Grain;
use crate::planes::Plane;
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
    /// What touching surfaces do to each other.
    pub law: ContactLaw,
    /// The grains; their order is their number.
    pub grains: Vec<Grain>,
    /// Plane walls.
    pub planes: Vec<Plane>,
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
    /// A preparation was stopped by its observer.
    #[error("preparation was interrupted")]
    Interrupted,
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

impl ContactLaw {
    /// Checks every number of the law.
    pub fn validate(&self) -> Result<(), SetupError> {
        let (n, t) = (&self.normal, &self.tangential);
        check("contact.stiffness", n.stiffness, "> 0 N/m", |v| v > 0.0)?;
        check("contact.restitution", n.restitution, "in (0, 1]", |v| {
            v > 0.0 && v <= 1.0
        })?;
        check(
            "contact.tangential_stiffness_ratio",
            t.stiffness_ratio,
            "≥ 0",
            |v| v >= 0.0,
        )?;
        check(
            "contact.tangential_restitution",
            t.restitution,
            "in (0, 1]",
            |v| v > 0.0 && v <= 1.0,
        )?;
        check("contact.friction", t.friction, "≥ 0", |v| v >= 0.0)?;
        if let Some(shape) = &self.rolling {
            check("contact.beta", shape.beta, "≥ 0", |v| v >= 0.0)?;
            check(
                "contact.rolling_friction",
                shape.rolling_friction,
                "≥ 0",
                |v| v >= 0.0,
            )?;
            check(
                "contact.twisting_friction",
                shape.twisting_friction,
                "≥ 0",
                |v| v >= 0.0,
            )?;
        }
        Ok(())
    }
}

impl Setup {
    /// Checks all numbers; the list's skin decides how narrow a periodic box may be.
    pub(crate) fn validate(&self, skin: f64) -> Result<(), SetupError> {
        self.law.validate()?;
        check("timestep", self.timestep, "> 0 s", |v| v > 0.0)?;
        for (k, g) in self.gravity.iter().enumerate() {
            check(&format!("gravity[{k}]"), *g, "finite, m/s²", |_| true)?;
        }
        let mut largest: f64 = 0.0;
        for (k, g) in self.grains.iter().enumerate() {
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
                    check(&format!("grains[{k}].{name}"), *c, "finite", |_| true)?;
                }
            }
            largest = largest.max(g.radius);
        }
        for (k, p) in self.planes.iter().enumerate() {
            check(
                &format!("planes[{k}].normal"),
                p.normal.norm(),
                "a unit vector",
                |v| (v - 1.0).abs() < 1e-9,
            )?;
        }
        let least = 2.0 * (2.0 * largest + skin);
        for (k, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
            let length = self.domain.lengths()[k];
            check(&format!("domain.{axis}"), length, "> 0 m", |v| v > 0.0)?;
            if self.domain.periodic[k] && length < least {
                return Err(SetupError::NarrowDomain {
                    axis,
                    length,
                    least,
                });
            }
        }
        Ok(())
    }
}
