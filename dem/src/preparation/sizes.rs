//! Size laws of grains.
//!
//! A [`RadiusLaw`] says how radii are shared out; a [`SizeLaw`] says besides whether its shares are of
//! the *number* of grains or of their *mass*. With f(r) the law's density and equal densities of grains,
//!
//! ```text
//! number density n(r) ∝ f(r)            shares by number
//! number density n(r) ∝ f(r)/r³         shares by mass
//! ```
//! so that a power law by mass of index a is one by number of index a + 3.

use crate::setup::{SetupError, check};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, Normal};
use serde::{Deserialize, Serialize};

/// Distribution of radii (m).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// What lies above a radius falls as `r^{-index}` between two radii: density `∝ r^{-index-1}`.
    PowerLaw {
        /// Smallest radius (m).
        smallest: f64,
        /// Largest radius (m).
        largest: f64,
        /// Index of the cumulative law.
        index: f64,
    },
    /// The same power law gathered on equally spaced radii, each with the share of its bin, whose
    /// edges lie half way to its neighbours (Kappel et al. 2020, §2.5: 8 radii, 1:2, index 2.5).
    BinnedPowerLaw {
        /// Smallest radius (m).
        smallest: f64,
        /// Largest radius (m).
        largest: f64,
        /// Index of the cumulative law.
        index: f64,
        /// Number of radii.
        bins: usize,
    },
    /// Given radii.
    List {
        /// Radii (m).
        radii: Vec<f64>,
        /// Their shares, in any unit.
        shares: Vec<f64>,
    },
}

/// What the shares of a law are shares of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weight {
    /// The number of grains.
    #[default]
    Number,
    /// Their mass.
    Mass,
}

/// A law of radii and what its shares are shares of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeLaw {
    /// Radii.
    pub radius: RadiusLaw,
    /// Shares by number or by mass.
    pub weight: Weight,
}

impl From<RadiusLaw> for SizeLaw {
    /// Shares by number.
    fn from(radius: RadiusLaw) -> Self {
        SizeLaw {
            radius,
            weight: Weight::Number,
        }
    }
}

/// A law by number.
#[derive(Clone, Debug)]
pub(super) enum NumberLaw {
    /// Density `∝ r^{-index-1}`.
    Power {
        smallest: f64,
        largest: f64,
        index: f64,
    },
    /// A cut Gaussian, its density over r³ where it is one by mass.
    Normal {
        mean: f64,
        deviation: f64,
        cut: f64,
        weight: Weight,
    },
    /// Radii in rising order with shares that add up to 1.
    Points(Vec<[f64; 2]>),
}

impl RadiusLaw {
    /// Checks the law's numbers.
    pub fn validate(&self) -> Result<(), SetupError> {
        match self {
            &RadiusLaw::Gaussian {
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
                    "≥ 0.01, and cut · deviation < 1",
                    // Drawn again 125 times a grain in the mean, and without end as it goes to zero.
                    |v| v >= 0.01 && v * relative_deviation < 1.0,
                )
            }
            &RadiusLaw::Uniform { low, high } => between(low, high),
            &RadiusLaw::PowerLaw {
                smallest,
                largest,
                index,
            } => {
                between(smallest, largest)?;
                check_index(index)
            }
            &RadiusLaw::BinnedPowerLaw {
                smallest,
                largest,
                index,
                bins,
            } => {
                between(smallest, largest)?;
                check_index(index)?;
                check("grains.bins", bins as f64, "from 1 to 1000", |v| {
                    (1.0..=1000.0).contains(&v)
                })
            }
            RadiusLaw::List { radii, shares } => {
                let count = shares.len() as f64;
                check("grains.shares", count, "as many as radii, > 0", |_| {
                    !radii.is_empty() && radii.len() == shares.len()
                })?;
                for (k, (&radius, &share)) in radii.iter().zip(shares).enumerate() {
                    check(&format!("grains.radii[{k}]"), radius, "> 0 m", |v| v > 0.0)?;
                    check(&format!("grains.shares[{k}]"), share, "> 0", |v| v > 0.0)?;
                }
                Ok(())
            }
        }
    }

    /// Mean radius by number, where shares are by number (m).
    pub fn mean(&self) -> f64 {
        match *self {
            RadiusLaw::Gaussian { mean, .. } => mean,
            RadiusLaw::Uniform { low, high } => 0.5 * (low + high),
            _ => super::size_report::Cumulative::of(&self.clone().into()).mean(Weight::Number),
        }
    }

    /// Smallest radius that can be drawn (m).
    pub fn smallest(&self) -> f64 {
        match self {
            &RadiusLaw::Gaussian {
                mean,
                relative_deviation,
                cut,
            } => mean * (1.0 - relative_deviation * cut),
            &RadiusLaw::Uniform { low, .. } => low,
            &RadiusLaw::PowerLaw { smallest, .. } | &RadiusLaw::BinnedPowerLaw { smallest, .. } => {
                smallest
            }
            RadiusLaw::List { radii, .. } => radii.iter().copied().fold(f64::INFINITY, f64::min),
        }
    }

    /// Largest radius that can be drawn (m).
    pub fn largest(&self) -> f64 {
        match self {
            &RadiusLaw::Gaussian {
                mean,
                relative_deviation,
                cut,
            } => mean * (1.0 + relative_deviation * cut),
            &RadiusLaw::Uniform { high, .. } => high,
            // A single bin stands at the smallest radius.
            &RadiusLaw::BinnedPowerLaw {
                smallest, bins: 1, ..
            } => smallest,
            &RadiusLaw::PowerLaw { largest, .. } | &RadiusLaw::BinnedPowerLaw { largest, .. } => {
                largest
            }
            RadiusLaw::List { radii, .. } => radii.iter().copied().fold(0.0, f64::max),
        }
    }

    /// Draws a radius (m), shares being by number; the law must have been validated.
    pub fn draw(&self, random: &mut impl Rng) -> f64 {
        match *self {
            // A plain product: beds of old seeds keep their bits.
            RadiusLaw::Uniform { low, high } => low + (high - low) * random.random::<f64>(),
            _ => self.by_number(Weight::Number).draw(random),
        }
    }

    fn by_number(&self, weight: Weight) -> NumberLaw {
        let by_mass = weight == Weight::Mass;
        let shift = if by_mass { 3.0 } else { 0.0 };
        match self {
            &RadiusLaw::Gaussian {
                mean,
                relative_deviation: deviation,
                cut,
            } if deviation > 0.0 => NumberLaw::Normal {
                mean,
                deviation,
                cut,
                weight,
            },
            &RadiusLaw::Gaussian { mean, .. } => NumberLaw::Points(vec![[mean, 1.0]]),
            &RadiusLaw::Uniform {
                low: smallest,
                high: largest,
            } => power(smallest, largest, shift - 1.0),
            &RadiusLaw::PowerLaw {
                smallest,
                largest,
                index,
            } => power(smallest, largest, index + shift),
            &RadiusLaw::BinnedPowerLaw {
                smallest,
                largest,
                index,
                bins,
            } => points(bin(smallest, largest, index, bins), weight),
            RadiusLaw::List { radii, shares } => {
                let pairs = radii.iter().zip(shares).map(|(&r, &share)| [r, share]);
                points(pairs.collect(), weight)
            }
        }
    }
}

fn between(smallest: f64, largest: f64) -> Result<(), SetupError> {
    check("grains.smallest_radius", smallest, "> 0 m", |v| v > 0.0)?;
    check(
        "grains.largest_radius",
        largest,
        "≥ the smallest radius",
        |v| v >= smallest,
    )
}

fn check_index(index: f64) -> Result<(), SetupError> {
    check("grains.index", index, "in [-20, 20]", |v| v.abs() <= 20.0)
}

fn power(smallest: f64, largest: f64, index: f64) -> NumberLaw {
    if smallest == largest {
        return NumberLaw::Points(vec![[smallest, 1.0]]);
    }
    NumberLaw::Power {
        smallest,
        largest,
        index,
    }
}

/// Equally spaced radii with the shares of their bins.
fn bin(smallest: f64, largest: f64, index: f64, bins: usize) -> Vec<[f64; 2]> {
    if bins == 1 || smallest == largest {
        return vec![[smallest, 1.0]];
    }
    let width = (largest - smallest) / (bins - 1) as f64;
    // The lowest edge would leave the positive numbers where bins are wide.
    let edge = |r: f64| tail(r.max(0.5 * smallest), index);
    let bin = |k: usize| {
        let r = smallest + width * k as f64;
        [r, edge(r - 0.5 * width) - edge(r + 0.5 * width)]
    };
    (0..bins).map(bin).collect()
}

/// An antiderivative of `-r^{-index-1}`.
fn tail(r: f64, index: f64) -> f64 {
    if index == 0.0 {
        -r.ln()
    } else {
        r.powf(-index) / index
    }
}

/// Sorted, by number, with a sum of 1.
fn points(mut points: Vec<[f64; 2]>, weight: Weight) -> NumberLaw {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    if weight == Weight::Mass {
        points.iter_mut().for_each(|[r, share]| *share /= r.powi(3));
    }
    let sum: f64 = points.iter().map(|p| p[1]).sum();
    points.iter_mut().for_each(|p| p[1] /= sum);
    NumberLaw::Points(points)
}

impl NumberLaw {
    /// Draws a radius (m).
    fn draw(&self, random: &mut impl Rng) -> f64 {
        match self {
            &NumberLaw::Power {
                smallest,
                largest,
                index,
            } => {
                let u = random.random::<f64>();
                let (low, high) = (tail(smallest, index), tail(largest, index));
                let at = low + (high - low) * u;
                let r = if index == 0.0 {
                    (-at).exp()
                } else {
                    (at * index).powf(-1.0 / index)
                };
                r.clamp(smallest, largest)
            }
            &NumberLaw::Normal {
                mean,
                deviation,
                cut,
                weight,
            } => loop {
                let z: f64 = match Normal::new(0.0, 1.0) {
                    Ok(normal) => normal.sample(random),
                    Err(_) => return mean,
                };
                if z.abs() > cut {
                    continue;
                }
                let smallest = 1.0 - deviation * cut;
                let r = 1.0 + deviation * z;
                if weight == Weight::Number || random.random::<f64>() < (smallest / r).powi(3) {
                    return mean * r;
                }
            },
            NumberLaw::Points(points) => {
                // Nothing to draw: grains of one size take no random number.
                if let [[r, _]] = points[..] {
                    return r;
                }
                let mut u = random.random::<f64>();
                for &[r, share] in points {
                    if u < share {
                        return r;
                    }
                    u -= share;
                }
                // Round-off in the sum of the shares.
                points.last().map_or(0.0, |p| p[0])
            }
        }
    }

    /// Number density at a radius, up to a factor.
    pub(super) fn density(&self, r: f64) -> f64 {
        match self {
            NumberLaw::Power { index, .. } => r.powf(-index - 1.0),
            NumberLaw::Normal {
                mean,
                deviation,
                weight,
                ..
            } => {
                let z = (r / mean - 1.0) / deviation;
                let gauss = (-0.5 * z * z).exp();
                if *weight == Weight::Mass {
                    gauss * (mean / r).powi(3)
                } else {
                    gauss
                }
            }
            NumberLaw::Points(_) => 0.0,
        }
    }
}

impl SizeLaw {
    /// Checks the law's numbers.
    pub fn validate(&self) -> Result<(), SetupError> {
        self.radius.validate()?;
        match self.radius {
            // Rejection would take a thousand draws a grain.
            RadiusLaw::Gaussian {
                relative_deviation,
                cut,
                ..
            } if self.weight == Weight::Mass => check(
                "grains.cut_deviations",
                cut,
                "such that cut · deviation ≤ 0.9 in a law by mass",
                |v| v * relative_deviation <= 0.9,
            ),
            _ => Ok(()),
        }
    }

    /// Smallest radius that can be drawn (m).
    pub fn smallest(&self) -> f64 {
        self.radius.smallest()
    }

    /// Largest radius that can be drawn (m).
    pub fn largest(&self) -> f64 {
        self.radius.largest()
    }

    /// Mean radius by number (m).
    pub fn mean(&self) -> f64 {
        super::size_report::Cumulative::of(self).mean(Weight::Number)
    }

    /// Draws a radius (m); the law must have been validated.
    pub fn draw(&self, random: &mut impl Rng) -> f64 {
        match self.weight {
            Weight::Number => self.radius.draw(random),
            Weight::Mass => self.by_number().draw(random),
        }
    }

    pub(super) fn by_number(&self) -> NumberLaw {
        self.radius.by_number(self.weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const N: usize = 200_000;

    fn draws(law: &SizeLaw) -> Vec<f64> {
        law.validate().unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        (0..N).map(|_| law.draw(&mut random)).collect()
    }

    fn mean(draws: &[f64], f: impl Fn(f64) -> f64) -> f64 {
        draws.iter().map(|&r| f(r)).sum::<f64>() / draws.len() as f64
    }

    #[test]
    fn the_cut_gaussian_has_its_mean_and_its_narrowed_width() {
        let law = RadiusLaw::Gaussian {
            mean: 0.5,
            relative_deviation: 0.1,
            cut: 1.0,
        };
        let draws = draws(&law.into());
        assert!(draws.iter().all(|r| (0.45..=0.55).contains(r)));
        let variance = mean(&draws, |r| (r - 0.5).powi(2));
        assert!((mean(&draws, |r| r) - 0.5).abs() < 5e-4);
        // A normal law cut at one standard deviation has the variance 1 - 2φ(1)/(2Φ(1)-1) = 0.2911.
        assert!((variance / 0.05_f64.powi(2) - 0.2911).abs() < 0.01);
    }

    #[test]
    fn the_power_law_has_its_moments_by_number_and_by_mass() {
        let law = |weight| SizeLaw {
            radius: RadiusLaw::PowerLaw {
                smallest: 1.0,
                largest: 2.0,
                index: 2.5,
            },
            weight,
        };
        // ⟨r^k⟩ of a density r^{-a-1} between 1 and 2.
        let moment =
            |k: f64, a: f64| (a / (a - k)) * (1.0 - 2.0_f64.powf(k - a)) / (1.0 - 2.0_f64.powf(-a));
        let by_number = draws(&law(Weight::Number));
        assert!((mean(&by_number, |r| r) / moment(1.0, 2.5) - 1.0).abs() < 3e-3);
        assert!((mean(&by_number, |r| r.powi(3)) / moment(3.0, 2.5) - 1.0).abs() < 0.01);
        // By mass: the mean weighted by r³ is that of the law, and the plain mean is not.
        let by_mass = draws(&law(Weight::Mass));
        let weighted = mean(&by_mass, |r| r.powi(4)) / mean(&by_mass, |r| r.powi(3));
        assert!(
            (weighted / moment(1.0, 2.5) - 1.0).abs() < 5e-3,
            "{weighted}"
        );
        assert!(mean(&by_mass, |r| r) / moment(1.0, 2.5) < 0.95);
        // The table that reports use knows the same moments.
        for weight in [Weight::Number, Weight::Mass] {
            let a = if weight == Weight::Mass { 5.5 } else { 2.5 };
            let off = law(weight).mean() / moment(1.0, a) - 1.0;
            assert!(off.abs() < 1e-9, "{weight:?} {off}");
        }
    }

    #[test]
    fn bins_and_lists_are_met_share_by_share() {
        let law: SizeLaw = RadiusLaw::BinnedPowerLaw {
            smallest: 1.0,
            largest: 2.0,
            index: 2.5,
            bins: 8,
        }
        .into();
        let drawn = draws(&law);
        let NumberLaw::Points(points) = law.by_number() else {
            panic!("bins are points");
        };
        assert_eq!(points.len(), 8);
        for [r, share] in points {
            let met = drawn.iter().filter(|&&d| d == r).count() as f64 / N as f64;
            assert!((met - share).abs() < 4.0 * (share / N as f64).sqrt());
        }
        // Half the mass in each of two sizes: eight times as many small ones.
        let list = SizeLaw {
            radius: RadiusLaw::List {
                radii: vec![2.0, 1.0],
                shares: vec![3.0, 3.0],
            },
            weight: Weight::Mass,
        };
        let large = mean(&draws(&list), |r| f64::from(u8::from(r > 1.5)));
        assert!((large - 1.0 / 9.0).abs() < 3e-3);
    }

    #[test]
    fn a_gaussian_by_mass_has_its_mean_by_mass() {
        let law = SizeLaw {
            radius: RadiusLaw::Gaussian {
                mean: 1.0,
                relative_deviation: 0.33,
                cut: 1.0,
            },
            weight: Weight::Mass,
        };
        let draws = draws(&law);
        let weighted = mean(&draws, |r| r.powi(4)) / mean(&draws, |r| r.powi(3));
        assert!((weighted - 1.0).abs() < 3e-3, "{weighted}");
        assert!((mean(&draws, |r| r) / law.mean() - 1.0).abs() < 2e-3);
    }

    #[test]
    fn bad_numbers_are_named() {
        let says = |law: RadiusLaw, what: &str| {
            let message = law.validate().unwrap_err().to_string();
            assert!(message.contains(what), "{message}");
        };
        says(
            RadiusLaw::Gaussian {
                mean: -0.5,
                relative_deviation: 0.1,
                cut: 1.0,
            },
            "grains.radius = -0.5",
        );
        says(
            RadiusLaw::List {
                radii: vec![1.0, 2.0],
                shares: vec![1.0],
            },
            "grains.shares = 1",
        );
        says(
            RadiusLaw::PowerLaw {
                smallest: 2.0,
                largest: 1.0,
                index: 2.5,
            },
            "grains.largest_radius = 1",
        );
    }
}
