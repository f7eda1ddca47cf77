//! Adhesive elastic spheres (Johnson, Kendall & Roberts 1971), with hysteresis.
//!
//! ```text
//! x   = a²/R - √(4 π γ a/E*)          overlap; a contact radius, 1/R = 1/R_i + 1/R_j
//! F   = 4 E* a³/(3R) - √(16 π γ E* a³)
//! F_c = 3 π γ R                       largest tension
//! a_0 = (9 π γ R²/E*)^{1/3}           contact radius without force
//! x_c = a_0²/(2 · 6^{1/3} R)          a contact is lost at x = -x_c, and made at x = 0
//! ```
//! γ (J/m²) surface energy of the pair, so that the work of adhesion is 2γ; E* (Pa) effective modulus.
//! Damping: `F = -Γ m v` with Γ = 2 k_d/t_c, k_d (–) about 0.01,
//! `t_c = 0.95 r^{7/6} ρ^{1/2}/(γ^{1/6} E*^{1/3})` for monomers of radius r; it changes nothing but
//! ringing. Source: Tatsuuma, Kataoka & Tanaka 2019; Dominik & Tielens 1997; Wada et al. 2007.
//!
//! **Solving for a.** With b = √a the first line is `b⁴/R - c b = x`, c = √(4πγ/E*). Its fold,
//! b_c³ = c R/4, is the point of loss. In s = b/b_c it reads `s⁴ - 4 s = y`, y = 3 x/x_c ≥ -3, s ≥ 1,
//! and the force is `2πγ R (s⁶/6 - s³)`. The closed form of the quartic loses its digits at the fold; in
//! e = s - 1 they stay: `e² (e² + 4 e + 6) = y + 3`. With √(e² + 4 e + 6) ≈ e + k, k between √6 at the fold
//! and 2 far from it, this is a quadratic in e; from its root two steps of Halley's method reach round-off.
//!
//! b_c, x_c and a_0 take the cube root of R. A contact finds it when it is made and remembers it: its last
//! number of history is R^{1/3}.

use super::Touch;
use super::composition::{NormalPart, Pressing};
use super::hertz::Elasticity;
use crate::lanes::Lane;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Adhesive contact of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jkr {
    /// γ (J/m²).
    pub surface_energy: f64,
    /// Elastic constants of the material.
    pub elasticity: Elasticity,
    /// Γ (1/s).
    pub damping_rate: f64,
    /// ξ_crit (m): rolling displacement at which rolling yields.
    pub critical_rolling: f64,
}

/// √(e² + 4 e + 6) less e where the guess is worst otherwise: 3 % off in e at the most, 2·10⁻¹⁵ after
/// [`HALLEY_STEPS`].
const GUESS: f64 = 2.37;
/// To round-off at any overlap.
const HALLEY_STEPS: usize = 2;

impl Jkr {
    /// E* (Pa).
    pub fn effective_modulus(&self) -> f64 {
        self.elasticity.effective_modulus(&self.elasticity)
    }

    /// F_c = 3 π γ R (N).
    pub fn pull_off_force(&self, reduced_radius: f64) -> f64 {
        3.0 * PI * self.surface_energy * reduced_radius
    }

    /// a_0 (m).
    pub fn equilibrium_radius(&self, reduced_radius: f64) -> f64 {
        (9.0 * PI * self.surface_energy * reduced_radius.powi(2) / self.effective_modulus()).cbrt()
    }

    /// x_c (m).
    pub fn pull_off_gap(&self, reduced_radius: f64) -> f64 {
        self.equilibrium_radius(reduced_radius).powi(2) / (2.0 * 6.0_f64.cbrt() * reduced_radius)
    }

    /// Overlap without force (m): a_0²/(3R).
    pub fn equilibrium_overlap(&self, reduced_radius: f64) -> f64 {
        self.equilibrium_radius(reduced_radius).powi(2) / (3.0 * reduced_radius)
    }

    /// t_c (s) of monomers of a radius (m) and a density (kg/m³).
    pub fn characteristic_time(&self, radius: f64, density: f64) -> f64 {
        0.95 * radius.powf(7.0 / 6.0) * density.sqrt()
            / (self.surface_energy.powf(1.0 / 6.0) * self.effective_modulus().cbrt())
    }

    /// Energy for a monomer to roll a quarter way round its equal neighbour (J): 12 π² γ R ξ_crit. Both
    /// turn against each other by π meanwhile.
    pub fn rolling_energy(&self, reduced_radius: f64) -> f64 {
        12.0 * PI * PI * self.surface_energy * reduced_radius * self.critical_rolling
    }

    /// dF/dx (N/m) on the stable branch; infinite at the point of loss.
    pub fn stiffness(&self, reduced_radius: f64, overlap: f64) -> f64 {
        let gap = self.pull_off_gap(reduced_radius);
        let s = root((3.0 * overlap / gap).max(-3.0 + 1e-9));
        // F = 2πγR (s⁶/6 - s³), x = x_c/3 (s⁴ - 4s).
        2.0 * PI * self.surface_energy * reduced_radius * (s.powi(5) - 3.0 * s * s)
            / (4.0 * gap / 3.0 * (s.powi(3) - 1.0))
    }

    pub(super) fn coefficients(&self) -> [f64; 3] {
        let fold = (4.0 * PI * self.surface_energy / self.effective_modulus()).sqrt();
        // x_c = 3/4 c b_c, b_c = (c R/4)^{1/3}.
        [
            0.75 * fold * (0.25 * fold).cbrt(),
            2.0 * PI * self.surface_energy,
            self.damping_rate,
        ]
    }
}

/// s ≥ 1 with s⁴ - 4 s = y; 1 below the fold.
#[inline(always)]
pub(super) fn root<L: Lane>(y: L) -> L {
    let number = L::splat;
    let (one, two, four) = (number(1.0), number(2.0), number(4.0));
    let above = (y + number(3.0)).max(number(0.0));
    let w = above.sqrt();
    let mut e = two * w / (number(GUESS) + (number(GUESS * GUESS) + four * w).sqrt());
    for _ in 0..HALLEY_STEPS {
        let e2 = e * e;
        let residue = e2 * (e2 + four * e + number(6.0)) - above;
        let slope = four * e * (e2 + number(3.0) * e + number(3.0));
        let bend = number(12.0) * (one + e) * (one + e);
        // At the fold itself slope and residue vanish together; the guess is exact there.
        let below = (two * slope * slope - residue * bend).max(number(1e-300));
        e = e - two * residue * slope / below;
    }
    one + e
}

/// In the inner loop: x_c/R^{1/3}, 2πγ, Γ.
#[derive(Clone, Copy, Debug)]
pub struct Adhesive;

impl NormalPart for Adhesive {
    const COEFFICIENTS: usize = 3;
    const STIFFENS: bool = false;
    const HOLDS: bool = true;

    #[inline(always)]
    fn press<L: Lane>(c: &[L], touch: &Touch<L>, approach: L, memory: L) -> Pressing<L> {
        let zero = L::splat(0.0);
        let known = zero.less(memory);
        let memory = if L::all(known) {
            memory
        } else {
            L::select(known, memory, (L::splat(1.0) / touch.curvature).cbrt())
        };
        let radius = memory * memory * memory;
        let s = root(L::splat(3.0) * touch.overlap / Self::hold(c, memory));
        let s3 = s * s * s;
        let damping = c[2] / touch.inverse_mass;
        Pressing {
            force: c[1] * radius * (s3 * s3 * L::splat(1.0 / 6.0) - s3) + damping * approach,
            stiffness: zero,
            damping,
            memory,
        }
    }

    #[inline(always)]
    fn hold<L: Lane>(c: &[L], memory: L) -> L {
        c[0] * memory
    }

    /// ∫F dx, zero for surfaces apart: `8πγR x_c/3 · s⁴ (s⁶/60 - s³/6 + 1/4)`.
    fn stored(c: &[f64], overlap: f64, curvature: f64) -> f64 {
        let gap = Adhesive::hold(c, (1.0 / curvature).cbrt());
        let s = root(3.0 * overlap / gap);
        let scale = 4.0 / 3.0 * c[1] / curvature * gap;
        scale * s.powi(4) * (s.powi(6) / 60.0 - s.powi(3) / 6.0 + 0.25)
    }

    fn secant(_: &[f64], _: f64, _: f64) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Vec3;

    /// Ice monomers of Tatsuuma et al.: 0.1 µm, 100 mJ/m², 7 GPa, 0.25.
    const ICE: Jkr = Jkr {
        surface_energy: 0.1,
        elasticity: Elasticity {
            youngs_modulus: 7e9,
            poissons_ratio: 0.25,
        },
        damping_rate: 0.0,
        critical_rolling: 8e-10,
    };
    const R: f64 = 0.5e-7;

    fn force(overlap: f64) -> f64 {
        let touch = Touch {
            normal: Vec3([0.0, 0.0, 1.0]),
            overlap,
            velocity: Vec3::zero(),
            spin: Vec3::zero(),
            inverse_mass: 1.0,
            curvature: 1.0 / R,
            inverse_inertia: 1.0,
        };
        let c = ICE.coefficients();
        let new = Adhesive::press(&c, &touch, 0.0, 0.0);
        // A contact that remembers what it found is pressed to the same bits.
        let known = Adhesive::press(&c, &touch, 0.0, new.memory);
        assert_eq!((new.force, new.memory), (known.force, known.memory));
        new.force
    }

    #[test]
    fn contact_radius_solves_the_equation_to_round_off() {
        for y in [
            -3.0,
            -3.0 + 1e-12,
            -2.9,
            -1.0,
            0.0,
            1.0,
            9.0,
            50.0,
            1e3,
            1e4,
            1e6,
            1e9,
        ] {
            let s: f64 = root(y);
            let residue = (s.powi(4) - 4.0 * s - y).abs();
            assert!(residue < 1e-14 * y.abs().max(4.0), "y {y}: {residue:e}");
            assert!(s >= 1.0);
        }
    }

    #[test]
    fn force_has_the_values_of_the_theory() {
        let (f_c, x_c) = (ICE.pull_off_force(R), ICE.pull_off_gap(R));
        // At zero overlap -8/9 F_c; none at equilibrium; -5/9 F_c where contact is lost.
        assert!((force(0.0) / f_c + 8.0 / 9.0).abs() < 1e-12);
        assert!(force(ICE.equilibrium_overlap(R)).abs() < 1e-10 * f_c);
        assert!((force(-x_c) / f_c + 5.0 / 9.0).abs() < 1e-6);
        let deepest = (0..20_000)
            .map(|k| force(x_c * (f64::from(k) / 10_000.0 - 1.0)))
            .fold(0.0, f64::min);
        assert!((deepest / f_c + 1.0).abs() < 1e-6, "pull-off force");
        assert!((Adhesive::hold(&ICE.coefficients(), R.cbrt()) / x_c - 1.0).abs() < 1e-14);
        assert_eq!(Adhesive::hold(&ICE.coefficients(), 0.0), 0.0);
        // Printed by the paper: E_roll = 4.7e-16 J, t_c = 1.94e-10 s.
        assert!((ICE.rolling_energy(R) / 4.7e-16 - 1.0).abs() < 0.01);
        assert!((ICE.characteristic_time(1e-7, 1000.0) / 1.94e-10 - 1.0).abs() < 0.02);
    }

    #[test]
    fn far_beyond_adhesion_the_force_is_hertz() {
        let hertz = |x: f64| 4.0 / 3.0 * ICE.effective_modulus() * (R * x.powi(3)).sqrt();
        let x = 1e5 * ICE.pull_off_gap(R);
        assert!((force(x) / hertz(x) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn energy_is_the_integral_of_the_force() {
        let x_c = ICE.pull_off_gap(R);
        let c = ICE.coefficients();
        for x in [-0.9 * x_c, 0.0, 3.0 * x_c] {
            let h = 1e-4 * x_c;
            let slope = (Adhesive::stored(&c, x + h, 1.0 / R)
                - Adhesive::stored(&c, x - h, 1.0 / R))
                / (2.0 * h);
            assert!((slope - force(x)).abs() < 1e-6 * ICE.pull_off_force(R));
            let stiffness = (force(x + h) - force(x - h)) / (2.0 * h);
            assert!((ICE.stiffness(R, x) / stiffness - 1.0).abs() < 1e-4);
        }
    }
}
