//! The partially regularised μ(I) law of Barker and Gray, well posed at small inertial numbers.

use super::friction::{Friction, InertialFriction};
use super::{MuI, Rheology, ShearLaw, Threshold};
use crate::error::{Error, require};
use crate::units::Units;

/// τ = c + μ(I) p with
///
/// ```text
/// μ = √(α/ln(A/I))                              up to I_1,
/// μ = (μ_s I_0 + μ_2 I + μ_∞ I²)/(I_0 + I)      from I_1 on,
/// ```
///
/// where I_1 is the inertial number below which the second form is ill posed in plane flow (C = 0) and A makes μ
/// continuous. With α < 2 the first form is well posed there, and μ_∞ > 0 carries the second one to far
/// larger inertial numbers than μ(I) bears. In space flows whose middle stretching is negative are less well posed than
/// plane ones at the same I, those with a positive one better. The price: μ → 0 as I → 0, so nothing is ever rigid and a
/// slope of any angle creeps, at I = A exp(−α/tan²θ). Source: Barker & Gray, *J. Fluid Mech.* 828
/// (2017) 5, eqs. 6.3 and 6.4, where α = 1.9 and μ_∞ = 0.05.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarkerGray {
    base: MuI,
    mu_infinity: f64,
    alpha: f64,
    /// I_1.
    joint: f64,
    /// A.
    amplitude: f64,
}

/// Inertial numbers between which I_1 is sought, and halvings of their ratio: to round-off.
const JOINT_RANGE: [f64; 2] = [1e-12, 1e3];
const HALVINGS: usize = 200;

impl BarkerGray {
    /// The regularised form of a law.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for parameters of `base` out of range, α not between 0 and 2, a
    /// negative μ_∞, or a law without a well-posed window to continue from.
    pub fn new(base: MuI, alpha: f64, mu_infinity: f64) -> Result<Self, Error> {
        base.validate()?;
        require(
            base.mu_s > 0.0,
            "rheology.mu_s",
            base.mu_s,
            "greater than 0 for the regularised law",
        )?;
        require(
            alpha > 0.0 && alpha < 2.0,
            "rheology.alpha",
            alpha,
            "between 0 and 2, both excluded: from 2 on the law is ill posed at small I",
        )?;
        require(
            mu_infinity >= 0.0,
            "rheology.mu_infinity",
            mu_infinity,
            "at least 0 and finite",
        )?;
        let mut law = Self {
            base,
            mu_infinity,
            alpha,
            joint: 0.0,
            amplitude: 0.0,
        };
        law.joint = law.neutral_inertial_number().ok_or(Error::OutOfRange {
            key: "rheology.mu_2",
            value: base.mu_2,
            allowed: format!(
                "enough above rheology.mu_s = {} for a range of I with C(I) < 0",
                base.mu_s
            ),
        })?;
        let mu = law.upper(law.joint).mu;
        law.amplitude = law.joint * (alpha / (mu * mu)).exp();
        let below = law.lower(law.joint);
        let c = super::well_posedness(law.joint, below.mu, below.slope);
        require(
            c < 0.0,
            "rheology.alpha",
            alpha,
            format!(
                "smaller: the branch below I = {:.3e} is ill posed, C = {c:.3e}",
                law.joint
            ),
        )?;
        Ok(law)
    }

    /// α = 1.9 and μ_∞ = 0.05, the values of the source.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of(base: MuI) -> Result<Self, Error> {
        Self::new(base, 1.9, 0.05)
    }

    /// I_1, where the two forms meet.
    pub fn joint(&self) -> f64 {
        self.joint
    }

    /// μ(I).
    pub fn mu(&self, inertial_number: f64) -> f64 {
        self.friction(inertial_number).mu
    }

    /// The smallest I at which C of the second form falls through zero.
    fn neutral_inertial_number(&self) -> Option<f64> {
        let c = |i: f64| {
            let Friction { mu, slope } = self.upper(i);
            super::well_posedness(i, mu, slope)
        };
        let [low, high] = JOINT_RANGE;
        let steps = 1500;
        let ratio = (high / low).powf(1.0 / f64::from(steps));
        let mut left = low;
        for step in 1..=steps {
            let right = low * ratio.powi(step);
            if c(right) < 0.0 {
                let mut ends = [left, right];
                for _ in 0..HALVINGS {
                    let middle = (ends[0] * ends[1]).sqrt();
                    ends[usize::from(c(middle) < 0.0)] = middle;
                }
                return Some(ends[1]);
            }
            left = right;
        }
        None
    }

    /// μ′ = μ³/(2 α I), because 1/ln(A/I) = μ²/α.
    #[inline]
    fn lower(&self, inertial_number: f64) -> Friction {
        if inertial_number <= 0.0 {
            return Friction {
                mu: 0.0,
                slope: 0.0,
            };
        }
        let mu = (self.alpha / (self.amplitude / inertial_number).ln()).sqrt();
        Friction {
            mu,
            slope: mu * mu * mu / (2.0 * self.alpha * inertial_number),
        }
    }

    #[inline]
    fn upper(&self, inertial_number: f64) -> Friction {
        let law = &self.base;
        let i = inertial_number;
        let inverse = 1.0 / (law.i_0 + i);
        let mu = (law.mu_s * law.i_0 + (law.mu_2 + self.mu_infinity * i) * i) * inverse;
        Friction {
            mu,
            slope: (law.mu_2 + 2.0 * self.mu_infinity * i - mu) * inverse,
        }
    }
}

impl InertialFriction for BarkerGray {
    #[inline]
    fn friction(&self, inertial_number: f64) -> Friction {
        if inertial_number <= self.joint {
            self.lower(inertial_number)
        } else {
            self.upper(inertial_number)
        }
    }

    /// Below I_1, with s = ln(A/I): A √(πα) erfc(√s). Above: the quotient divided out.
    fn integral(&self, inertial_number: f64) -> f64 {
        let lower = |i: f64| {
            if i <= 0.0 {
                return 0.0;
            }
            let s = (self.amplitude / i).ln();
            self.amplitude * (std::f64::consts::PI * self.alpha).sqrt() * libm::erfc(s.sqrt())
        };
        if inertial_number <= self.joint {
            return lower(inertial_number);
        }
        let law = &self.base;
        let constant = law.mu_2 - self.mu_infinity * law.i_0;
        let rest = (law.mu_s - constant) * law.i_0;
        let (from, to) = (self.joint, inertial_number);
        lower(from)
            + 0.5 * self.mu_infinity * (to * to - from * from)
            + constant * (to - from)
            + rest * ((law.i_0 + to) / (law.i_0 + from)).ln()
    }

    #[inline]
    fn rate_scale(&self, pressure: f64) -> f64 {
        (pressure / self.base.grain_density).sqrt() / self.base.diameter
    }

    fn cohesion(&self) -> f64 {
        self.base.cohesion
    }
}

impl Rheology for BarkerGray {
    #[inline]
    fn threshold(&self, rate: f64, pressure: f64) -> Threshold {
        self.threshold_of_friction(rate, pressure)
    }

    fn potential(&self, rate: f64, pressure: f64) -> f64 {
        self.potential_of_friction(rate, pressure)
    }

    fn in_units(&self, units: &Units) -> Self {
        Self {
            base: self.base.in_units(units),
            ..*self
        }
    }
}

impl ShearLaw for BarkerGray {
    fn validate(&self) -> Result<(), Error> {
        // A value of this type has passed `new`.
        Ok(())
    }

    fn bulk_density(&self) -> f64 {
        self.base.bulk_density()
    }

    fn friction_limits(&self) -> [f64; 2] {
        let largest = if self.mu_infinity > 0.0 {
            f64::INFINITY
        } else {
            self.base.mu_2
        };
        [0.0, largest]
    }

    fn cohesion(&self) -> f64 {
        self.base.cohesion
    }

    /// I = A exp(−α/μ²) up to I_1, then the positive root of μ_∞ I² + (μ_2 − μ) I = (μ − μ_s) I_0.
    fn rate_under(&self, shear_stress: f64, pressure: f64) -> f64 {
        let mu = (shear_stress - self.base.cohesion) / pressure;
        if mu <= 0.0 {
            return 0.0;
        }
        let law = &self.base;
        let inertial_number = if mu <= self.upper(self.joint).mu {
            self.amplitude * (-self.alpha / (mu * mu)).exp()
        } else {
            let (b, c) = (law.mu_2 - mu, (mu - law.mu_s) * law.i_0);
            let root = (b * b + 4.0 * self.mu_infinity * c).sqrt();
            // The form without cancellation on each side.
            if b > 0.0 {
                2.0 * c / (b + root)
            } else {
                (root - b) / (2.0 * self.mu_infinity)
            }
        };
        inertial_number * self.rate_scale(pressure)
    }
}

#[cfg(test)]
mod tests {
    use super::super::laws_under_test::{derivatives_agree, rate_inverts_the_threshold, scales};
    use super::*;

    /// The material of the source: μ_s 0.342, μ_2 0.557, I_0 0.069.
    fn source() -> MuI {
        MuI::new(0.342, 0.557, 0.069, 1e-3, 0.6, 2500.0)
    }

    #[test]
    fn joint_is_the_lower_limit_of_the_well_posed_window() {
        let plain = BarkerGray::new(source(), 1.9, 0.0).unwrap();
        assert!((plain.joint() - 0.00397).abs() < 5e-6, "{}", plain.joint());
        let law = BarkerGray::of(source()).unwrap();
        let c = |i: f64| {
            let Friction { mu, slope } = law.friction(i);
            super::super::well_posedness(i, mu, slope)
        };
        assert!(c(law.joint() * (1.0 + 1e-9)).abs() < 1e-6);
        // Continuous, and well posed from creep to I = 16; the bare law only from 0.004 to 0.28.
        let (below, above) = (law.lower(law.joint()).mu, law.upper(law.joint()).mu);
        assert!((below - above).abs() < 1e-14);
        for exponent in -200..=120 {
            let i = 10f64.powf(0.01 * f64::from(exponent));
            assert!(c(i) < 0.0 || (i - law.joint()).abs() < 1e-9, "I = {i}");
        }
        for exponent in -300..=-24 {
            assert!(c(10f64.powf(0.1 * f64::from(exponent))) < 0.0);
        }
        assert!(c(16.0) < 0.0 && c(18.0) > 0.0);
    }

    #[test]
    fn derivatives_potential_inverse_and_units() {
        let law = BarkerGray::of(MuI {
            cohesion: 12.0,
            ..source()
        })
        .unwrap();
        // Inertial numbers from 4e-5 (first form) to 3 (second).
        for (rate, pressure) in [(0.02, 900.0), (0.5, 5000.0), (37.0, 420.0), (600.0, 80.0)] {
            derivatives_agree(&law, rate, pressure);
            rate_inverts_the_threshold(&law, rate, pressure);
        }
        scales(&law);
        // Steeper than μ_2: borne by μ_∞ I.
        rate_inverts_the_threshold(&law, 1e5, 80.0);
    }

    /// The integral of μ against a sum of trapezia in √I, through the joint.
    #[test]
    fn integral_is_that_of_mu() {
        let law = BarkerGray::of(source()).unwrap();
        for end in [2e-3, 0.3] {
            let steps = 200_000;
            let mut sum = 0.0;
            for k in 0..steps {
                let at = |k: i32| {
                    let y = f64::from(k) / f64::from(steps) * f64::sqrt(end);
                    2.0 * y * law.mu(y * y)
                };
                sum += 0.5 * (at(k) + at(k + 1)) * f64::sqrt(end) / f64::from(steps);
            }
            assert!((sum / law.integral(end) - 1.0).abs() < 1e-7);
        }
    }

    #[test]
    fn nothing_is_rigid() {
        let law = BarkerGray::of(source()).unwrap();
        assert!(law.threshold(1e-30, 100.0).stress < 20.0);
        assert_eq!(law.threshold(0.0, 100.0).stress, 0.0);
        assert!(law.rate_under(30.0, 100.0) > 0.0);
    }

    #[test]
    fn laws_that_cannot_be_cured_are_refused_by_name() {
        let message = |law: Result<BarkerGray, Error>| law.unwrap_err().to_string();
        assert!(message(BarkerGray::new(source(), 2.0, 0.05)).contains("rheology.alpha"));
        assert!(message(BarkerGray::new(source(), 1.9, -0.05)).contains("rheology.mu_infinity"));
        let coulomb = MuI::new(0.4, 0.4, 0.1, 1e-3, 0.6, 2500.0);
        assert!(message(BarkerGray::new(coulomb, 1.9, 0.0)).contains("rheology.mu_2"));
    }
}
