//! Well-posedness: whether short waves grow at a rate without bound.
//!
//! A plane wave of wavenumber k in a uniform flow of rate γ̇ and pressure p grows at
//!
//! ```text
//! σ = (k²/ρ) [(η − κ_γ) a²/(1 − κ_p b) − η],    η = κ/γ̇,    b = ξ·A ξ,    a² = |A ξ|² − b²,
//! ```
//!
//! where ξ is the direction of the wave and A = 2D/γ̇, with tr A = 0 and A:A = 2. (Linearise ρ ∂u/∂t =
//! −∇p + ∇·(κ A) with δu ⊥ ξ: δγ̇ = ik δu·Aξ, δτ ξ = (κ_γ − η) δγ̇ Aξ + κ_p δp Aξ + ikη δu. The part along ξ gives
//! ik δp (1 − κ_p b) = k² (η − κ_γ) b (δu·Aξ), the rest is along w = Aξ − bξ, |w| = a: waves along w grow as said, those
//! across w and ξ decay with η. Advection by the base flow only turns and stretches the wave.)
//!
//! b and a are the normal and shear parts of A on the plane across ξ. With the eigenvalues λ₁ ≥ λ₂ ≥ λ₃ of A they lie
//! within the outer one of Mohr's circles and outside the other two, so that the largest a² for a given b is
//!
//! ```text
//! a² = R² − (b − c)²,    c = (λ₁ + λ₃)/2 = −λ₂/2,    R² = (λ₁ − λ₃)²/4 = 1 − 3c²,
//! ```
//!
//! by waves in the plane of the fastest stretching and shortening. In plane flow λ₂ = 0 and a² = 1 − b², b being 0 along
//! and across a shear flow. With m = 1 − κ_p c the fastest wave has
//!
//! ```text
//! 1 − κ_p b = √(m² − κ_p² R²) = √((1 − κ_p λ₁)(1 − κ_p λ₃)),
//! a²/(1 − κ_p b) = 2R²/(m + √(m² − κ_p² R²)),
//! ```
//!
//! and σ > 0 there wherever
//!
//! ```text
//! C = 4r² − 4r + κ_p² + 4(1 − r) c [κ_p − 3(1 − r) c] > 0,    r = γ̇ κ_γ/κ,
//! ```
//!
//! as long as 2(1 − r)R² > m (in a plane: r < ½); beyond, C no longer decides, because its direction is not one of a wave:
//! there a law is well posed as long as κ_p λ₁ < 1. Of flows at the same r and κ_p those with λ₂ < 0 (matter that
//! stretches along one axis and shortens along two) are less well posed than plane ones, up to c = κ_p/(3(1 − r)), those
//! with λ₂ > 0 (a heap that spreads) better.
//!
//! For μ(I) without cohesion r = I μ′/μ and κ_p = μ (1 − r/2): in a plane the condition of Barker, Schaeffer,
//! Bohorquez & Gray, *J. Fluid Mech.* 779 (2015) 794, in the form of Barker & Gray, *J. Fluid Mech.*
//! 828 (2017) 5, eq. 3.9.

use super::Threshold;

/// C = 4r² − 4r + μ²(1 − r/2)² with r = I μ′/μ (dimensionless): incompressible plane μ(I) flow is well
/// posed where C < 0 and ill posed where C > 0, where waves grow faster the shorter they are.
///
/// `mu` is μ(I), `slope` is μ′(I), `inertial_number` is I.
pub fn well_posedness(inertial_number: f64, mu: f64, slope: f64) -> f64 {
    let r = inertial_number * slope / mu;
    criterion(r, mu * (1.0 - 0.5 * r))
}

/// C = 4r² − 4r + κ_p².
fn criterion(r: f64, by_pressure: f64) -> f64 {
    4.0 * r * r - 4.0 * r + by_pressure * by_pressure
}

impl Threshold {
    /// r = γ̇ κ_γ/κ, 0 where nothing is borne.
    fn rate_exponent(&self, rate: f64) -> f64 {
        if self.stress > 0.0 {
            rate * self.by_rate / self.stress
        } else {
            0.0
        }
    }

    /// C = 4r² − 4r + κ_p² of this threshold in plane flow at strain rate γ̇ (1/s), for any law.
    pub fn well_posedness(&self, rate: f64) -> f64 {
        criterion(self.rate_exponent(rate), self.by_pressure)
    }

    /// Growth ρσ/k² (Pa s) of a plane wave in plane flow in the direction b = ξ·Aξ, −1 to 1: negative where it
    /// decays. Where κ_p b ≥ 1 the pressure no longer restores what it disturbs: +∞.
    pub fn wave_growth(&self, rate: f64, direction: f64) -> f64 {
        self.growth(rate, direction, 1.0 - direction * direction)
    }

    /// The same in any flow, by b and a².
    fn growth(&self, rate: f64, normal: f64, shear_squared: f64) -> f64 {
        let viscosity = self.stress / rate;
        let restoring = 1.0 - self.by_pressure * normal;
        if restoring <= 0.0 {
            return f64::INFINITY;
        }
        (viscosity - self.by_rate) * shear_squared / restoring - viscosity
    }

    /// The direction b in which waves grow fastest in plane flow: κ_p/(1 + √(1 − κ_p²)), if κ grows with the rate
    /// less than in proportion; none where κ_p ≥ 1.
    pub fn fastest_direction(&self) -> Option<f64> {
        let rest = 1.0 - self.by_pressure * self.by_pressure;
        (rest > 0.0).then(|| self.by_pressure / (1.0 + rest.sqrt()))
    }

    /// Whether no wave grows, in any direction, in a flow with the middle eigenvalue λ₂ of A = 2D/γ̇, −1/√3 to 1/√3: 0
    /// in plane flow.
    pub fn is_well_posed(&self, rate: f64, middle: f64) -> bool {
        let centre = -0.5 * middle;
        let radius_squared = 1.0 - 3.0 * centre * centre;
        let mean = 1.0 - self.by_pressure * centre;
        let rest = mean * mean - self.by_pressure * self.by_pressure * radius_squared;
        rest > 0.0 && 2.0 * (1.0 - self.rate_exponent(rate)) * radius_squared <= mean + rest.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rheology::{MuI, Rheology};

    /// Limits of the well-posed window for parameter sets of the literature, from the roots of C.
    #[test]
    fn window_of_published_materials() {
        for (mu_s, mu_2, i_0, low, high) in [
            // Jop, Forterre & Pouliquen's glass beads: tan 20.9°, tan 32.76°.
            (0.381863, 0.643468, 0.279, 0.01935, 0.8523),
            (0.32, 0.60, 0.4, 0.01363, 1.810),
            (0.342, 0.557, 0.069, 0.00397, 0.2802),
        ] {
            let law = MuI::new(mu_s, mu_2, i_0, 1e-3, 0.6, 2500.0);
            assert!(law.well_posedness(low * 0.998) > 0.0);
            assert!(law.well_posedness(low * 1.002) < 0.0);
            assert!(law.well_posedness(high * 0.998) < 0.0);
            assert!(law.well_posedness(high * 1.002) > 0.0);
        }
    }

    /// C of the threshold is C(I), and its sign is that of the fastest growth among directions
    /// tried one by one.
    #[test]
    fn sign_of_c_is_that_of_the_fastest_wave() {
        let law = MuI::new(0.32, 0.60, 0.4, 0.04, 0.6, 1.0);
        let pressure = 0.7;
        for exponent in -30..=10 {
            let inertial_number = 10f64.powf(0.1 * f64::from(exponent));
            let rate = inertial_number / (0.04 * (1.0f64 / pressure).sqrt());
            let threshold = law.threshold(rate, pressure);
            let c = threshold.well_posedness(rate);
            assert!((c - law.well_posedness(inertial_number)).abs() < 1e-13);
            let tried = (-1000..=1000)
                .map(|i| threshold.wave_growth(rate, f64::from(i) * 1e-3))
                .fold(f64::NEG_INFINITY, f64::max);
            let fastest = threshold.wave_growth(rate, threshold.fastest_direction().unwrap());
            assert!(fastest >= tried && fastest - tried < 1e-5 * threshold.stress / rate);
            assert_eq!(c > 0.0, fastest > 0.0, "I = {inertial_number}");
            assert_eq!(c < 0.0, threshold.is_well_posed(rate, 0.0));
        }
    }

    /// A fluid whose viscosity is proportional to pressure: C > 0, and yet no wave grows while
    /// κ_p < 1.
    #[test]
    fn c_says_nothing_beyond_one_half() {
        for (by_pressure, well_posed) in [(0.3, true), (0.99, true), (1.01, false)] {
            let fluid = Threshold {
                stress: 2.0,
                by_rate: 1.0,
                by_pressure,
            };
            assert!(fluid.well_posedness(2.0) > 0.0);
            assert_eq!(fluid.is_well_posed(2.0, 0.0), well_posed);
            let tried = (-1000..=1000)
                .map(|i| fluid.wave_growth(2.0, f64::from(i) * 1e-3))
                .fold(f64::NEG_INFINITY, f64::max);
            assert_eq!(tried <= 0.0, well_posed);
        }
    }

    /// The growth rate from the linearised balance itself: the pressure and velocity of a wave
    /// solved as a 2 × 2 system, for directions all round.
    #[test]
    fn growth_agrees_with_the_linearised_balance() {
        let law = MuI {
            cohesion: 0.1,
            ..MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0)
        };
        let (rate, pressure) = (0.3, 0.8);
        let t = law.threshold(rate, pressure);
        // A flow that shears at some angle: A = [[c, s], [s, −c]].
        let (c, s) = (0.6, 0.8);
        for i in 0..24 {
            let angle = f64::from(i) * std::f64::consts::PI / 24.0;
            let (xi, normal) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]);
            let apply = |v: [f64; 2]| [c * v[0] + s * v[1], s * v[0] - c * v[1]];
            let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
            let (a, b) = (dot(normal, apply(xi)), dot(xi, apply(xi)));
            // δτ·ξ for a velocity δu = n (∂ → i k, factors ik left out) and for a pressure of one.
            let viscosity = t.stress / rate;
            let of_velocity = |d: [f64; 2]| {
                (t.by_rate - viscosity) * a * dot(d, apply(xi)) + viscosity * dot(d, normal)
            };
            let of_pressure = |d: [f64; 2]| t.by_pressure * dot(d, apply(xi));
            // Along ξ: δp = of_velocity(ξ) + of_pressure(ξ) δp, along n: −growth = the rest.
            let dp = of_velocity(xi) / (1.0 - of_pressure(xi));
            let growth = -(of_velocity(normal) + of_pressure(normal) * dp);
            assert!((growth - t.wave_growth(rate, b)).abs() < 1e-13, "{angle}");
        }
    }

    /// A with these eigenvalues in axes turned at random angles, and what it makes of a direction.
    fn turned(eigenvalues: [f64; 3]) -> impl Fn([f64; 3]) -> [f64; 3] {
        let (s, c) = (0.6, 0.8);
        let turn = move |[x, y, z]: [f64; 3], sign: f64| {
            let turned = [c * x - sign * s * y, sign * s * x + c * y, z];
            [
                turned[0],
                c * turned[1] - sign * s * z,
                sign * s * turned[1] + c * z,
            ]
        };
        let back = move |[x, y, z]: [f64; 3]| {
            let [y, z] = [c * y + s * z, c * z - s * y];
            [c * x + s * y, c * y - s * x, z]
        };
        move |v| {
            let own = turn(v, 1.0);
            back(std::array::from_fn(|i| eigenvalues[i] * own[i]))
        }
    }

    fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// λ₁ ≥ λ₂ ≥ λ₃ with sum 0 and squares that sum to 2.
    fn eigenvalues(middle: f64) -> [f64; 3] {
        let radius = (1.0 - 0.75 * middle * middle).sqrt();
        [radius - 0.5 * middle, middle, -radius - 0.5 * middle]
    }

    /// Directions all over half a sphere.
    fn directions() -> impl Iterator<Item = [f64; 3]> {
        (0..=120).flat_map(|i| {
            (0..240).map(move |j| {
                let unit = std::f64::consts::PI / 240.0;
                let (polar, azimuth) = (f64::from(i) * unit, f64::from(j) * 2.0 * unit);
                let across = polar.sin();
                [across * azimuth.cos(), across * azimuth.sin(), polar.cos()]
            })
        })
    }

    /// In space: the growth is that of the linearised balance, whose velocity and pressure are solved for as they stand,
    /// and the verdict that of all directions tried one by one. Where the plane criterion says otherwise, it is wrong.
    #[test]
    fn in_space_the_middle_stretching_counts() {
        let law = MuI::new(0.32, 0.60, 0.4, 0.04, 0.6, 1.0);
        let pressure = 0.7;
        let mut differs = [0, 0];
        for exponent in -25..=6 {
            let rate = 10f64.powf(0.1 * f64::from(exponent)) / (0.04 * (1.0f64 / pressure).sqrt());
            let t = law.threshold(rate, pressure);
            let viscosity = t.stress / rate;
            for middle in [-0.577, -0.4, -0.2, 0.0, 0.3, 0.577] {
                let apply = turned(eigenvalues(middle));
                let mut fastest = f64::NEG_INFINITY;
                for xi in directions() {
                    let a_xi = apply(xi);
                    let b = dot(xi, a_xi);
                    let w: [f64; 3] = std::array::from_fn(|i| a_xi[i] - b * xi[i]);
                    let squared = dot(w, w);
                    let growth = t.growth(rate, b, squared);
                    fastest = fastest.max(growth);
                    if squared < 1e-3 {
                        continue;
                    }
                    // δu = w: δτ ξ without the factor −k², its part along ξ is balanced by δp.
                    let of_velocity = |i: usize| {
                        (t.by_rate - viscosity) * dot(w, a_xi) * a_xi[i] + viscosity * w[i]
                    };
                    let of_velocity: [f64; 3] = std::array::from_fn(of_velocity);
                    let dp = dot(xi, of_velocity) / (1.0 - t.by_pressure * b);
                    let force: [f64; 3] = std::array::from_fn(|i| {
                        -(of_velocity[i] + (t.by_pressure * a_xi[i] - xi[i]) * dp)
                    });
                    let miss: f64 = force
                        .iter()
                        .zip(w)
                        .map(|(f, w)| (f - growth * w).abs())
                        .sum();
                    assert!(miss < 1e-12 * viscosity.max(1.0), "{middle} {xi:?}");
                }
                let well_posed = t.is_well_posed(rate, middle);
                // What lies between the directions that are tried.
                if fastest.abs() > 2e-3 * viscosity {
                    assert_eq!(well_posed, fastest < 0.0, "{exponent} {middle}: {fastest}");
                    let plane = t.is_well_posed(rate, 0.0);
                    differs[0] += usize::from(plane && !well_posed);
                    differs[1] += usize::from(well_posed && !plane);
                }
                let (r, c) = (t.rate_exponent(rate), -0.5 * middle);
                let by_middle = 4.0 * (1.0 - r) * c * (t.by_pressure - 3.0 * (1.0 - r) * c);
                assert_eq!(well_posed, t.well_posedness(rate) + by_middle <= 0.0);
            }
        }
        // Mostly to the better: what makes flows less well posed is of second order in κ_p.
        assert!(differs[0] > 0 && differs[1] > 20, "{differs:?}");
    }
}
