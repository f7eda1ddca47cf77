//! Dashpots of a contact against small motions, for the limits of the time step.

use super::hertz::{damping_factor, secant_stiffness};
use super::{ContactLaw, Normal, Rolling, Stiffness, Tangential};

/// Two surfaces about to touch, by what their laws need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Reduced mass, `1/m = 1/m_i + 1/m_j` (kg).
    pub reduced_mass: f64,
    /// Reduced radius, `1/R = 1/R_i + 1/R_j` (m).
    pub reduced_radius: f64,
    /// `1/(m_i R_i²) + 1/(m_j R_j²)` (kg⁻¹ m⁻²).
    pub inverse_inertia: f64,
}

/// Coefficients of a contact's dashpots.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dashpots {
    /// N s/m.
    pub normal: f64,
    /// N s/m.
    pub tangential: f64,
    /// N m s/rad.
    pub rolling: f64,
    /// N m s/rad.
    pub twisting: f64,
}

impl ContactLaw {
    /// Dashpots of a contact under `overlap` (m): what a small motion about that state meets.
    pub fn dashpots(&self, inertia: &Inertia, overlap: f64) -> Dashpots {
        let Inertia {
            reduced_mass: mass,
            reduced_radius: radius,
            inverse_inertia,
        } = *inertia;
        let Stiffness {
            tangential: k_t,
            rolling: k_r,
            ..
        } = self.stiffness(radius, overlap);
        let contact_radius = (radius * overlap.max(0.0)).sqrt();
        let normal = match &self.normal {
            Normal::Hooke(hooke) => hooke.damping.coefficient(hooke.stiffness, mass),
            Normal::Hertz(hertz) => {
                let s_n = 2.0 * hertz.effective_modulus * contact_radius;
                damping_factor(hertz.restitution) * (s_n * mass).sqrt()
            }
            Normal::Viscoelastic(v) => {
                v.dissipation * secant_stiffness(v.effective_modulus, radius, overlap)
            }
            Normal::Jkr(jkr) => jkr.damping_rate * mass,
        };
        let tangential = match &self.tangential {
            Tangential::Linear(spring) => spring.damping.coefficient(k_t, mass),
            Tangential::Mindlin(mindlin) => {
                damping_factor(mindlin.restitution) * (k_t * mass).sqrt()
            }
            Tangential::None | Tangential::Jkr => 0.0,
        };
        let (rolling, twisting) = match &self.rolling {
            Rolling::Epsd(epsd) => (epsd.coefficient(k_r, inverse_inertia), 0.0),
            Rolling::Shape(shape) => {
                let patch2 = (shape.beta * radius).powi(2);
                (normal * patch2, 2.0 * tangential * patch2)
            }
            Rolling::None | Rolling::Jkr => (0.0, 0.0),
        };
        Dashpots {
            normal,
            tangential,
            rolling,
            twisting,
        }
    }
}
