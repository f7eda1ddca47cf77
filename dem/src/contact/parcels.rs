//! Parcels: one grain of a run stands for many of the material (Bierwisch et al. 2009).
//!
//! Radii grow by the factor cg; densities, gravity, velocities, stresses and solid fractions stay. Then
//! masses grow as cg³ and forces must grow as cg², so that a law keeps its dimensionless numbers if
//!
//! ```text
//! k (N/m) → cg k       w, γ (J/m²) → cg w        γ_n, Γ (1/s) → /cg       A (s) → cg A
//! E, ν, e, μ, μ_r, η_r, β, c (Pa)  stay           R_a, ξ_crit (m) → cg R_a, cg ξ_crit
//! ```
//! and the time step grows as cg. The cost of a given volume and time falls as cg⁻⁴.
//! Source: Kappel et al. 2020, §2.5.

use super::{
    Cohesion, ContactLaw, Damping, Hooke, Jkr, Normal, SpringStiffness, Tangential,
    TangentialSpring, Viscoelastic,
};

impl ContactLaw {
    /// The law of parcels `factor` times the size of the grains that this law is for.
    pub fn coarse_grained(&self, factor: f64) -> ContactLaw {
        let damping = |damping: Damping| match damping {
            Damping::Restitution(_) => damping,
            Damping::MassProportional(rate) => Damping::MassProportional(rate / factor),
        };
        ContactLaw {
            normal: match self.normal {
                Normal::Hooke(hooke) => Normal::Hooke(Hooke {
                    stiffness: factor * hooke.stiffness,
                    damping: damping(hooke.damping),
                }),
                Normal::Hertz(_) => self.normal,
                Normal::Viscoelastic(v) => Normal::Viscoelastic(Viscoelastic {
                    dissipation: factor * v.dissipation,
                    ..v
                }),
                Normal::Jkr(jkr) => Normal::Jkr(Jkr {
                    surface_energy: factor * jkr.surface_energy,
                    damping_rate: jkr.damping_rate / factor,
                    critical_rolling: factor * jkr.critical_rolling,
                    ..jkr
                }),
            },
            tangential: match self.tangential {
                Tangential::Linear(spring) => Tangential::Linear(TangentialSpring {
                    stiffness: match spring.stiffness {
                        SpringStiffness::Absolute(k) => SpringStiffness::Absolute(factor * k),
                        ratio => ratio,
                    },
                    damping: damping(spring.damping),
                    ..spring
                }),
                other => other,
            },
            rolling: self.rolling,
            cohesion: match self.cohesion {
                Cohesion::Dmt {
                    work_of_adhesion,
                    asperity_radius,
                } => Cohesion::Dmt {
                    work_of_adhesion: factor * work_of_adhesion,
                    asperity_radius: asperity_radius.map(|r| factor * r),
                },
                // 0.036 J/m² S_c² is a surface energy too.
                Cohesion::Scheeres {
                    cleanliness,
                    asperity_radius,
                } => Cohesion::Scheeres {
                    cleanliness: factor.sqrt() * cleanliness,
                    asperity_radius: asperity_radius.map(|r| factor * r),
                },
                other => other,
            },
            lever: self.lever,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Elasticity, Epsd, Rolling};

    #[test]
    fn forces_grow_as_the_square_at_a_scaled_overlap() {
        let cg = 7.0;
        let mut law = ContactLaw::hertz_mindlin(
            Elasticity {
                youngs_modulus: 1e8,
                poissons_ratio: 0.3,
            },
            0.3,
            0.8,
        );
        law.rolling = Rolling::Epsd(Epsd {
            rolling_friction: 0.2,
            damping_ratio: 0.3,
        });
        law.cohesion = Cohesion::Dmt {
            work_of_adhesion: 0.028,
            asperity_radius: None,
        };
        let parcel = law.coarse_grained(cg);
        let (r, x) = (0.01, 1e-5);
        let (small, large) = (law.stiffness(r, x), parcel.stiffness(cg * r, cg * x));
        assert!((large.normal / small.normal / cg - 1.0).abs() < 1e-12);
        assert!((large.tangential / small.tangential / cg - 1.0).abs() < 1e-12);
        // Torques per angle grow as the volume.
        assert!((large.rolling / small.rolling / cg.powi(3) - 1.0).abs() < 1e-12);
        let pull = parcel.cohesion.force(cg * r) / law.cohesion.force(r);
        assert!((pull / cg.powi(2) - 1.0).abs() < 1e-12);
    }
}
