//! Size laws: `sizes = { law = "power-law", smallest = 0.5e-3, largest = 1.0e-3, index = 2.5 }`.

use super::Place;
use crate::scene::SceneError;
use colluvium_dem::preparation::{RadiusLaw, SizeLaw, Weight};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How radii are shared out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SizeKind {
    /// One radius.
    Equal,
    /// Uniform between two radii.
    Uniform,
    /// A normal distribution, cut.
    Gaussian,
    /// What lies above a radius falls as its power.
    PowerLaw,
    /// The same on equally spaced radii.
    BinnedPowerLaw,
    /// Given radii.
    List,
}

/// What shares are shares of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WeightKind {
    /// The number of grains.
    Number,
    /// Their mass.
    Mass,
}

/// A law of radii (m).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SizeKeys {
    /// The law.
    pub law: SizeKind,
    /// Radius of equal grains, mean radius of gaussian (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub radius: Option<f64>,
    /// Smallest radius of uniform and power laws (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub smallest: Option<f64>,
    /// Largest radius of uniform and power laws (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub largest: Option<f64>,
    /// Index of power laws: N(> r) ∝ r^-index.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = -20.0, "maximum" = 20.0))]
    pub index: Option<f64>,
    /// Radii of a binned power law.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 1000))]
    pub bins: Option<usize>,
    /// Standard deviation of gaussian over its mean.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 0.5))]
    pub relative_deviation: Option<f64>,
    /// Where gaussian is cut, in standard deviations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub cut: Option<f64>,
    /// Radii of a list (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radii: Option<Vec<f64>>,
    /// Their shares, in any unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shares: Option<Vec<f64>>,
    /// What shares are shares of; left out: the number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<WeightKind>,
}

impl SizeKeys {
    /// The law of grains, or of parcels that are `factor` times as large.
    pub fn law(&self, factor: f64, at: Place) -> Result<SizeLaw, SceneError> {
        let m = |value: &Option<f64>, key: &str| -> Result<f64, SceneError> {
            Ok(factor * at.need(value, key, "a radius in m")?)
        };
        let number = "a number";
        let ends = || -> Result<[f64; 2], SceneError> {
            let ends = [m(&self.smallest, "smallest")?, m(&self.largest, "largest")?];
            if ends[1] < ends[0] {
                let range = format!("at least the smallest, {} m", ends[0] / factor);
                return Err(at.refuse("largest", ends[1] / factor, range));
            }
            Ok(ends)
        };
        let radius = match self.law {
            SizeKind::Equal => {
                let radius = m(&self.radius, "radius")?;
                RadiusLaw::Uniform {
                    low: radius,
                    high: radius,
                }
            }
            SizeKind::Uniform => {
                let [low, high] = ends()?;
                RadiusLaw::Uniform { low, high }
            }
            SizeKind::Gaussian => RadiusLaw::Gaussian {
                mean: m(&self.radius, "radius")?,
                relative_deviation: at.need(
                    &self.relative_deviation,
                    "relative_deviation",
                    number,
                )?,
                cut: at.need(&self.cut, "cut", number)?,
            },
            SizeKind::PowerLaw => {
                let [smallest, largest] = ends()?;
                let index = at.need(&self.index, "index", number)?;
                RadiusLaw::PowerLaw {
                    smallest,
                    largest,
                    index,
                }
            }
            SizeKind::BinnedPowerLaw => {
                let [smallest, largest] = ends()?;
                RadiusLaw::BinnedPowerLaw {
                    smallest,
                    largest,
                    index: at.need(&self.index, "index", number)?,
                    bins: at.need(&self.bins, "bins", "a number of radii")?,
                }
            }
            SizeKind::List => {
                let radii: Vec<f64> = at.need(&self.radii, "radii", "radii in m")?;
                let shares = at.need(&self.shares, "shares", "a share for each radius")?;
                let radii = radii.into_iter().map(|r| factor * r).collect();
                RadiusLaw::List { radii, shares }
            }
        };
        self.check_unread(at)?;
        let law = SizeLaw {
            radius,
            weight: match self.by {
                Some(WeightKind::Mass) => Weight::Mass,
                _ => Weight::Number,
            },
        };
        law.validate().map_err(|error| SceneError::Unreadable {
            file: at.origin.to_owned(),
            message: format!("{}: {error}", at.section),
        })?;
        Ok(law)
    }

    fn check_unread(&self, at: Place) -> Result<(), SceneError> {
        use SizeKind::{BinnedPowerLaw, Equal, Gaussian, List, PowerLaw, Uniform};
        let read = |laws: &[SizeKind]| laws.contains(&self.law);
        let (power, ends) = (
            [PowerLaw, BinnedPowerLaw],
            [Uniform, PowerLaw, BinnedPowerLaw],
        );
        at.unread(
            &[
                ("radius", self.radius.is_some() && !read(&[Equal, Gaussian])),
                ("smallest", self.smallest.is_some() && !read(&ends)),
                ("largest", self.largest.is_some() && !read(&ends)),
                ("index", self.index.is_some() && !read(&power)),
                ("bins", self.bins.is_some() && !read(&[BinnedPowerLaw])),
                (
                    "relative_deviation",
                    self.relative_deviation.is_some() && !read(&[Gaussian]),
                ),
                ("cut", self.cut.is_some() && !read(&[Gaussian])),
                ("radii", self.radii.is_some() && !read(&[List])),
                ("shares", self.shares.is_some() && !read(&[List])),
            ],
            &format!("the size law {:?}", self.law),
        )
    }
}
