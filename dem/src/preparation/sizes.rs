//! Size laws of grains.

use crate::setup::{SetupError, check};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, Normal};
use serde::{Deserialize, Serialize};

/// Distribution of radii (m).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "law", rename_all = "kebab-case")]
pub enum RadiusLaw {
    /// Normal distribution, drawn again beyond `cut` standard deviations.
    Gaussian {
        /// Mean radius (m).
        mean: f64,
        /// Standard deviation over the mean.
        relative_deviation: f64,
        /// Where it is cut, in standard deviations.
        cut: f64,
    },
    /// Uniform between two radii.
    Uniform {
        /// Smallest radius (m).
        low: f64,
        /// Largest radius (m).
        high: f64,
    },
}

impl RadiusLaw {
    /// Checks the law's numbers.
    pub fn validate(&self) -> Result<(), SetupError> {
        match *self {
            RadiusLaw::Gaussian {
                mean,
                relative_deviation,
                cut,
            } => {
                check("grains.radius", mean, "> 0 m", |v| v > 0.0)?;
                check(
                    "grains.relative_deviation",
                    relative_deviation,
                    "in [0, 0.5]",
                    |v| (0.0..=0.5).contains(&v),
                )?;
                check(
                    "grains.cut_deviations",
                    cut,
                    "> 0, and cut · deviation < 1",
                    |v| v > 0.0 && v * relative_deviation < 1.0,
                )
            }
            RadiusLaw::Uniform { low, high } => {
                check("grains.smallest_radius", low, "> 0 m", |v| v > 0.0)?;
                check(
                    "grains.largest_radius",
                    high,
                    "≥ the smallest radius",
                    |v| v >= low,
                )
            }
        }
    }

    /// Mean radius (m).
    pub fn mean(&self) -> f64 {
        match *self {
            RadiusLaw::Gaussian { mean, .. } => mean,
            RadiusLaw::Uniform { low, high } => 0.5 * (low + high),
        }
    }

    /// Largest radius that can be drawn (m).
    pub fn largest(&self) -> f64 {
        match *self {
            RadiusLaw::Gaussian {
                mean,
                relative_deviation,
                cut,
            } => mean * (1.0 + relative_deviation * cut),
            RadiusLaw::Uniform { high, .. } => high,
        }
    }

    /// Draws a radius (m); the law must have been validated.
    pub fn draw(&self, random: &mut impl Rng) -> f64 {
        match *self {
            RadiusLaw::Gaussian {
                mean,
                relative_deviation,
                cut,
            } => match Normal::new(0.0, 1.0) {
                Ok(normal) if relative_deviation > 0.0 => loop {
                    let z: f64 = normal.sample(random);
                    if z.abs() <= cut {
                        return mean * (1.0 + relative_deviation * z);
                    }
                },
                _ => mean,
            },
            RadiusLaw::Uniform { low, high } => low + (high - low) * random.random::<f64>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_cut_gaussian_has_its_mean_and_its_narrowed_width() {
        let law = RadiusLaw::Gaussian {
            mean: 0.5,
            relative_deviation: 0.1,
            cut: 1.0,
        };
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let n = 100_000;
        let draws: Vec<f64> = (0..n).map(|_| law.draw(&mut random)).collect();
        assert!(draws.iter().all(|r| (0.45..=0.55).contains(r)));
        let mean = draws.iter().sum::<f64>() / n as f64;
        let variance = draws.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / n as f64;
        assert!((mean - 0.5).abs() < 5e-4);
        // A normal law cut at one standard deviation has the variance 1 - 2φ(1)/(2Φ(1)-1) = 0.2911.
        assert!((variance / 0.05_f64.powi(2) - 0.2911).abs() < 0.01);
    }

    #[test]
    fn bad_numbers_are_named() {
        let law = RadiusLaw::Gaussian {
            mean: -0.5,
            relative_deviation: 0.1,
            cut: 1.0,
        };
        let message = law.validate().unwrap_err().to_string();
        assert!(message.contains("grains.radius = -0.5"), "{message}");
    }
}
