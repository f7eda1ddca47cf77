//! Rheology: the stress that dense granular matter can bear, as a function of strain rate and
//! pressure.
//!
//! A material flows with τ = κ(γ̇, p) · 2D/γ̇ and stays rigid while |τ| ≤ κ(0, p), with
//! γ̇ = √(2 D:D) and |τ| = √(½ τ:τ). The function κ, the *threshold*, and its two derivatives are
//! all that a solver needs to know of a law.
//!
//! The laws, one file each: [`MuI`] with or without cohesion, [`Coulomb`] with its limits Bingham and
//! von Mises, [`BarkerGray`], which is well posed where μ(I) is not, and [`FrictionTable`] for
//! measured points; [`AnyLaw`] is whichever of them a file names. [`ShearLaw`] is what a law adds to have exact solutions.

mod any_law;
mod barker_gray;
mod coulomb;
mod friction;
mod mu_i;
pub(crate) mod shear_law;
mod table;
mod well_posedness;

pub use any_law::AnyLaw;
pub use barker_gray::BarkerGray;
pub use coulomb::Coulomb;
pub use mu_i::MuI;
pub use shear_law::ShearLaw;
pub use table::{FrictionTable, Grains};
pub use well_posedness::well_posedness;

/// Shear stress that the material bears at a strain rate and a pressure, with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Threshold {
    /// κ(γ̇, p) (Pa).
    pub stress: f64,
    /// ∂κ/∂γ̇ (Pa s).
    pub by_rate: f64,
    /// ∂κ/∂p (dimensionless).
    pub by_pressure: f64,
}

/// A law of dense granular flow with a yield stress.
///
/// The law must be isotropic, with κ non-negative and non-decreasing in γ̇: then a time step at
/// given pressure is a convex problem with one solution.
pub trait Rheology: Sync {
    /// κ(γ̇, p) and its derivatives, for a strain rate γ̇ ≥ 0 (1/s) and a pressure p (Pa); where
    /// p ≤ 0 only cohesion is left.
    fn threshold(&self, rate: f64, pressure: f64) -> Threshold;

    /// Ψ(γ̇, p) = ∫₀^γ̇ κ(g, p) dg (W/m³), the dissipation potential of a time step at given
    /// pressure.
    fn potential(&self, rate: f64, pressure: f64) -> f64;

    /// Whether the equations of motion are well posed in plane flow at this strain rate and pressure (short
    /// waves do not grow at a rate without bound).
    fn is_well_posed(&self, rate: f64, pressure: f64) -> bool {
        self.is_well_posed_in_space(rate, pressure, 0.0)
    }

    /// The same in a flow with the middle eigenvalue λ₂ of 2D/γ̇, 0 in plane flow: C alone does not decide in others.
    fn is_well_posed_in_space(&self, rate: f64, pressure: f64, middle: f64) -> bool {
        pressure > 0.0 && self.threshold(rate, pressure).is_well_posed(rate, middle)
    }

    /// The same law with lengths, densities and stresses divided by the given units.
    fn in_units(&self, units: &crate::units::Units) -> Self
    where
        Self: Sized;
}

/// Strain rate γ̇ = √(2 D:D) (1/s) of an incompressible plane flow, D = (∇u + ∇uᵀ)/2, from its two
/// components γ₁ = ∂u/∂x − ∂w/∂z and γ₂ = ∂u/∂z + ∂w/∂x: γ̇² = γ₁² + γ₂². In simple shear
/// γ̇ = |du/dz|.
///
/// Two other conventions are in use among codes, √(D:D) and √(½ D:D); they differ by factors √2
/// and 2, so this is the only place where the norm is formed. The norm of the stress components
/// ((σ_xx − σ_zz)/2, σ_xz) is the same function, and so are those of the five components of a flow in
/// space ([`crate::strain`]).
#[inline]
pub fn strain_rate_norm<const C: usize>(components: [f64; C]) -> f64 {
    squared_norm(&components).sqrt()
}

/// γ̇² of the components of a strain rate.
#[inline]
pub(crate) fn squared_norm<const C: usize>(components: &[f64; C]) -> f64 {
    let mut sum = components[0] * components[0];
    for x in &components[1..] {
        sum += x * x;
    }
    sum
}

/// What every law has to pass.
#[cfg(test)]
mod laws_under_test {
    use super::*;
    use crate::units::Units;

    /// κ_γ, κ_p and Ψ′ = κ against central differences.
    pub(super) fn derivatives_agree(law: &impl Rheology, rate: f64, pressure: f64) {
        let exact = law.threshold(rate, pressure);
        let step = 1e-5;
        let difference = |f: &dyn Fn(f64) -> f64| (f(step) - f(-step)) / (2.0 * step);
        let by_rate = difference(&|e| law.threshold(rate * (1.0 + e), pressure).stress) / rate;
        let by_pressure =
            difference(&|e| law.threshold(rate, pressure * (1.0 + e)).stress) / pressure;
        let potential = difference(&|e| law.potential(rate * (1.0 + e), pressure)) / rate;
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs() + 1e-9 * exact.stress / rate;
        assert!(near(by_rate, exact.by_rate), "{by_rate} {exact:?}");
        assert!((by_pressure - exact.by_pressure).abs() < 1e-6, "{exact:?}");
        assert!(near(potential, exact.stress), "{potential} {exact:?}");
    }

    /// `rate_under` and κ undo each other.
    pub(super) fn rate_inverts_the_threshold(law: &impl ShearLaw, rate: f64, pressure: f64) {
        let stress = law.threshold(rate, pressure).stress;
        let found = law.rate_under(stress, pressure);
        assert!((found / rate - 1.0).abs() < 1e-9, "{found} {rate}");
    }

    /// The same stress in SI and in natural units.
    pub(super) fn scales(law: &impl ShearLaw) {
        let units = Units::of_gravity(3.0, law.bulk_density(), 1.8e-4);
        let scaled = law.in_units(&units);
        for (rate, pressure) in [(1e-3, 0.4), (2.0, 0.01)] {
            let natural = scaled.threshold(rate * units.time(), pressure / units.stress());
            let direct = law.threshold(rate, pressure);
            assert!((natural.stress * units.stress() / direct.stress - 1.0).abs() < 1e-12);
            assert!((natural.by_pressure - direct.by_pressure).abs() < 1e-12);
        }
        assert!((scaled.bulk_density() - 1.0).abs() < 1e-12);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// γ₁ and γ₂ of a gradient `gradient[i][j]` = ∂u_i/∂x_j.
    fn components([[xx, xz], [zx, zz]]: [[f64; 2]; 2]) -> [f64; 2] {
        [xx - zz, xz + zx]
    }

    #[test]
    fn strain_rate_is_the_slope_of_the_velocity_in_simple_shear() {
        let rate = |gradient| strain_rate_norm(components(gradient));
        assert!((rate([[0.0, -3.5], [0.0, 0.0]]) - 3.5).abs() < 1e-15);
        // Pure shear along the diagonals: u = x, w = −z, γ̇ = 2.
        assert!((rate([[1.0, 0.0], [0.0, -1.0]]) - 2.0).abs() < 1e-15);
        // A rigid rotation does not strain.
        assert_eq!(rate([[0.0, 2.0], [-2.0, 0.0]]), 0.0);
    }

    #[test]
    fn the_norm_is_that_of_the_tensor_without_divergence() {
        let gradient = [[0.3, 1.1], [-0.4, -0.3]];
        let shear: f64 = 0.5 * (gradient[0][1] + gradient[1][0]);
        let diagonal: f64 = gradient[0][0].powi(2) + gradient[1][1].powi(2);
        let tensor = (2.0 * (diagonal + 2.0 * shear * shear)).sqrt();
        assert!((strain_rate_norm(components(gradient)) - tensor).abs() < 1e-15);
    }
}
