//! Friction as a table of measured points, without a formula between them.

use super::friction::{Friction, InertialFriction, validate_grains};
use super::{Rheology, ShearLaw, Threshold};
use crate::error::{Error, require};
use crate::units::Units;

/// τ = c + μ(I) p with μ(I) interpolated between points (I, μ) of rising μ.
///
/// Between the points runs the cubic of Fritsch and Carlson (*SIAM J. Numer. Anal.* 17 (1980) 238)
/// with the slopes of Fritsch and Butland (*SIAM J. Sci. Stat. Comput.* 5 (1984) 300): once
/// differentiable and monotone, so κ rises with the strain rate as a law must. Outside the points μ
/// stays what it is at the end. A point at I = 0 holds the static friction; without one the friction
/// of the first point is taken for it.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionTable {
    segments: Vec<Segment>,
    /// ∫μ dI from 0 to the first point and then to the end of each segment.
    integrals: Vec<f64>,
    last: [f64; 2],
    diameter: f64,
    solid_fraction: f64,
    grain_density: f64,
    cohesion: f64,
}

/// What a table belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grains {
    /// Grain diameter d (m).
    pub diameter: f64,
    /// Solid volume fraction φ.
    pub solid_fraction: f64,
    /// Density of the grains ρ_s (kg/m³).
    pub grain_density: f64,
    /// Cohesion c (Pa).
    pub cohesion: f64,
}

/// μ = Σ coefficients[n] (I − start)ⁿ up to start + length.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Segment {
    start: f64,
    length: f64,
    coefficients: [f64; 4],
}

impl Segment {
    #[inline]
    fn at(&self, x: f64) -> Friction {
        let [a, b, c, d] = self.coefficients;
        Friction {
            mu: a + x * (b + x * (c + x * d)),
            slope: b + x * (2.0 * c + x * 3.0 * d),
        }
    }

    #[inline]
    fn integral(&self, x: f64) -> f64 {
        let [a, b, c, d] = self.coefficients;
        x * (a + x * (b / 2.0 + x * (c / 3.0 + x * d / 4.0)))
    }
}

/// Fewest points of a table.
const MIN_POINTS: usize = 2;

impl FrictionTable {
    /// The law through `points` (I, μ).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if there are fewer than two points, if I does not rise or μ falls from
    /// one to the next, or for grains that mean nothing.
    pub fn new(points: &[[f64; 2]], grains: Grains) -> Result<Self, Error> {
        validate_grains(
            grains.diameter,
            grains.solid_fraction,
            grains.grain_density,
            grains.cohesion,
        )?;
        require(
            points.len() >= MIN_POINTS,
            "rheology.table",
            points.len() as f64,
            "at least 2 points (I, μ)",
        )?;
        for [i, mu] in points {
            require(*i >= 0.0, "rheology.table", *i, "I at least 0 and finite")?;
            require(*mu >= 0.0, "rheology.table", *mu, "μ at least 0 and finite")?;
        }
        for pair in points.windows(2) {
            require(
                pair[1][0] > pair[0][0],
                "rheology.table",
                pair[1][0],
                format!("I greater than that of the point before, {}", pair[0][0]),
            )?;
            require(
                pair[1][1] >= pair[0][1],
                "rheology.table",
                pair[1][1],
                format!(
                    "μ at least that of the point before, {}: a falling μ(I) is ill posed",
                    pair[0][1]
                ),
            )?;
        }
        let segments = interpolate(points);
        let mut integrals = vec![points[0][0] * points[0][1]];
        for segment in &segments {
            let before = integrals[integrals.len() - 1];
            integrals.push(before + segment.integral(segment.length));
        }
        Ok(Self {
            segments,
            integrals,
            last: points[points.len() - 1],
            diameter: grains.diameter,
            solid_fraction: grains.solid_fraction,
            grain_density: grains.grain_density,
            cohesion: grains.cohesion,
        })
    }

    /// The inertial numbers between which there are points: outside, the law was not measured.
    pub fn valid_inertial_numbers(&self) -> [f64; 2] {
        [self.segments[0].start, self.last[0]]
    }

    /// μ(I).
    pub fn mu(&self, inertial_number: f64) -> f64 {
        self.friction(inertial_number).mu
    }

    /// The smallest I at which μ(I) = `mu`: 0 up to the first point's μ, ∞ beyond the last one's.
    pub fn inertial_number_at(&self, mu: f64) -> f64 {
        if mu <= self.segments[0].coefficients[0] {
            return 0.0;
        }
        if mu > self.last[1] {
            return f64::INFINITY;
        }
        let after = self.segments.partition_point(|s| s.coefficients[0] < mu);
        let segment = &self.segments[after - 1];
        // μ is monotone here: halve to round-off.
        let mut ends = [0.0, segment.length];
        for _ in 0..100 {
            let middle = 0.5 * (ends[0] + ends[1]);
            ends[usize::from(segment.at(middle).mu >= mu)] = middle;
        }
        segment.start + ends[1]
    }

    /// The segment that holds I, which lies between the first and the last point.
    #[inline]
    fn segment(&self, inertial_number: f64) -> usize {
        self.segments
            .partition_point(|s| s.start <= inertial_number)
            .saturating_sub(1)
    }
}

/// The cubics between points.
fn interpolate(points: &[[f64; 2]]) -> Vec<Segment> {
    let secants: Vec<[f64; 2]> = points
        .windows(2)
        .map(|p| {
            let length = p[1][0] - p[0][0];
            [length, (p[1][1] - p[0][1]) / length]
        })
        .collect();
    let last = points.len() - 1;
    let slope = |k: usize| {
        if k == 0 || k == last {
            // A parabola through three points, held between 0 and three times the secant.
            let ([h0, s0], next) = if k == 0 {
                (secants[0], secants.get(1))
            } else {
                (
                    secants[last - 1],
                    last.checked_sub(2).map(|before| &secants[before]),
                )
            };
            return next.map_or(s0, |[h1, s1]| {
                (((2.0 * h0 + h1) * s0 - h0 * s1) / (h0 + h1)).clamp(0.0, 3.0 * s0)
            });
        }
        let ([h0, s0], [h1, s1]) = (secants[k - 1], secants[k]);
        if s0 <= 0.0 || s1 <= 0.0 {
            return 0.0;
        }
        // A weighted harmonic mean of the secants.
        let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
        (w0 + w1) / (w0 / s0 + w1 / s1)
    };
    secants
        .iter()
        .enumerate()
        .map(|(k, [h, s])| {
            let (left, right) = (slope(k), slope(k + 1));
            Segment {
                start: points[k][0],
                length: *h,
                coefficients: [
                    points[k][1],
                    left,
                    (3.0 * s - 2.0 * left - right) / h,
                    (left + right - 2.0 * s) / (h * h),
                ],
            }
        })
        .collect()
}

impl InertialFriction for FrictionTable {
    #[inline]
    fn friction(&self, inertial_number: f64) -> Friction {
        let first = &self.segments[0];
        if inertial_number < first.start {
            return Friction {
                mu: first.coefficients[0],
                slope: 0.0,
            };
        }
        if inertial_number >= self.last[0] {
            return Friction {
                mu: self.last[1],
                slope: 0.0,
            };
        }
        let segment = &self.segments[self.segment(inertial_number)];
        segment.at(inertial_number - segment.start)
    }

    fn integral(&self, inertial_number: f64) -> f64 {
        let first = &self.segments[0];
        if inertial_number < first.start {
            return inertial_number * first.coefficients[0];
        }
        if inertial_number >= self.last[0] {
            let whole = self.integrals[self.segments.len()];
            return whole + (inertial_number - self.last[0]) * self.last[1];
        }
        let k = self.segment(inertial_number);
        let segment = &self.segments[k];
        self.integrals[k] + segment.integral(inertial_number - segment.start)
    }

    #[inline]
    fn rate_scale(&self, pressure: f64) -> f64 {
        (pressure / self.grain_density).sqrt() / self.diameter
    }

    fn cohesion(&self) -> f64 {
        self.cohesion
    }
}

impl Rheology for FrictionTable {
    #[inline]
    fn threshold(&self, rate: f64, pressure: f64) -> Threshold {
        self.threshold_of_friction(rate, pressure)
    }

    fn potential(&self, rate: f64, pressure: f64) -> f64 {
        self.potential_of_friction(rate, pressure)
    }

    fn in_units(&self, units: &Units) -> Self {
        Self {
            diameter: self.diameter / units.length,
            grain_density: self.grain_density / units.density,
            cohesion: self.cohesion / units.stress(),
            ..self.clone()
        }
    }
}

impl ShearLaw for FrictionTable {
    fn validate(&self) -> Result<(), Error> {
        // A value of this type has passed `new`.
        Ok(())
    }

    fn bulk_density(&self) -> f64 {
        self.solid_fraction * self.grain_density
    }

    fn friction_limits(&self) -> [f64; 2] {
        [self.segments[0].coefficients[0], self.last[1]]
    }

    fn cohesion(&self) -> f64 {
        self.cohesion
    }

    fn rate_under(&self, shear_stress: f64, pressure: f64) -> f64 {
        self.inertial_number_at((shear_stress - self.cohesion) / pressure)
            * self.rate_scale(pressure)
    }
}

#[cfg(test)]
mod tests {
    use super::super::laws_under_test::{derivatives_agree, rate_inverts_the_threshold, scales};
    use super::*;
    use crate::rheology::MuI;

    const GRAINS: Grains = Grains {
        diameter: 5.3e-4,
        solid_fraction: 0.6,
        grain_density: 2450.0,
        cohesion: 12.0,
    };

    fn glass() -> MuI {
        MuI {
            cohesion: 12.0,
            ..MuI::new(0.382, 0.643, 0.279, 5.3e-4, 0.6, 2450.0)
        }
    }

    fn sampled(points: usize) -> FrictionTable {
        let points: Vec<[f64; 2]> = (0..points)
            .map(|k| {
                // From I = 0 to I = 2, closer where μ bends.
                let i = 2.0 * (k as f64 / (points - 1) as f64).powi(2);
                [i, glass().mu(i)]
            })
            .collect();
        FrictionTable::new(&points, GRAINS).unwrap()
    }

    #[test]
    fn points_are_met_and_the_law_they_come_from_is_approached() {
        let worst = |points: usize| {
            let table = sampled(points);
            (0..1000).fold(0.0_f64, |m, k| {
                let i = 2.0 * f64::from(k) / 1000.0;
                m.max((table.mu(i) - glass().mu(i)).abs())
            })
        };
        let order = (worst(10) / worst(80)).log2() / 3.0;
        assert!(worst(80) < 1e-5 && order > 1.9, "{:e} {order}", worst(80));
        assert_eq!(sampled(5).mu(0.5), glass().mu(0.5));
    }

    #[test]
    fn interpolation_is_monotone_through_uneven_points() {
        let points = [
            [1e-3, 0.3],
            [2e-3, 0.3],
            [1e-2, 0.45],
            [1.1e-2, 0.451],
            [0.3, 0.452],
            [0.31, 0.8],
        ];
        let table = FrictionTable::new(&points, GRAINS).unwrap();
        let mut last = 0.0;
        for k in 0..20_000 {
            let Friction { mu, slope } = table.friction(f64::from(k) * 2e-5);
            assert!(mu >= last - 1e-15 && slope >= -1e-10);
            last = mu;
        }
        for [i, mu] in points {
            assert!((table.mu(i) - mu).abs() < 1e-15);
        }
        // Outside: the values of the ends, and the ends are told.
        assert_eq!((table.mu(0.0), table.mu(9.0)), (0.3, 0.8));
        assert_eq!(table.valid_inertial_numbers(), [1e-3, 0.31]);
        assert_eq!(table.friction_limits(), [0.3, 0.8]);
        assert_eq!(table.inertial_number_at(0.81), f64::INFINITY);
    }

    #[test]
    fn derivatives_potential_inverse_and_units() {
        for (rate, pressure) in [(0.3, 5.0), (37.0, 420.0), (2e3, 80.0)] {
            derivatives_agree(&sampled(20), rate, pressure);
        }
        for (rate, pressure) in [(0.3, 5.0), (37.0, 420.0)] {
            rate_inverts_the_threshold(&sampled(20), rate, pressure);
        }
        scales(&sampled(20));
    }

    #[test]
    fn bad_tables_are_refused_by_name() {
        let refused = |points: &[[f64; 2]], word: &str| {
            let message = FrictionTable::new(points, GRAINS).unwrap_err().to_string();
            assert!(
                message.contains("rheology.table") && message.contains(word),
                "{message}"
            );
        };
        refused(&[[0.1, 0.4]], "at least 2 points");
        refused(
            &[[0.1, 0.4], [0.1, 0.5]],
            "greater than that of the point before, 0.1",
        );
        refused(
            &[[0.1, 0.4], [0.2, 0.3]],
            "at least that of the point before, 0.4",
        );
        refused(&[[0.1, 0.4], [f64::NAN, 0.5]], "NaN");
    }
}
