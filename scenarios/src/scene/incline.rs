//! Keys of the inclined-plane scenes.

use super::overlap::{InclineModel, OverlapKeys};
use super::{LEAST_MASS, RheologyKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Grains on a rough inclined plane, periodic downslope and across.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InclineScene {
    /// What the layer is made of.
    #[serde(default)]
    pub model: InclineModel,
    /// Inclination of the plane to the horizontal (degrees).
    #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub slope_degrees: f64,
    /// Size of the run: both edges of the floor grow with it, grains with its square; depth stays.
    #[schemars(extend("minimum" = 0.84, "maximum" = 50.0))]
    pub scale: f64,
    /// Whether the bed starts at rest or already flowing.
    pub start: InclineStart,
    /// Inertial number of the Bagnold profile that a flowing start begins with.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub start_inertial_number: f64,
    /// Seed of the random numbers that draw the bed.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// Gravity (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// The grains.
    pub grains: GrainKeys,
    /// The floor.
    pub floor: FloorKeys,
    /// The contact law.
    pub contact: ContactKeys,
    /// The time step.
    pub timestep: TimestepKeys,
    /// How long it runs.
    pub time: TimeKeys,
    /// The continuum's material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rheology: Option<RheologyKeys>,
    /// Where grains end and continuum begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overlap: Option<OverlapKeys>,
    /// Angles of a calibration campaign.
    pub calibration: CalibrationKeys,
}

/// State of the bed at the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum InclineStart {
    /// The settled bed, tilted at once.
    Rest,
    /// The settled bed set in motion with a Bagnold velocity profile.
    Flow,
}

/// The grains of an incline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrainKeys {
    /// Mean diameter d (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub diameter: f64,
    /// Density of the grains' material (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub density: f64,
    /// Law of sizes.
    pub sizes: SizeLaw,
    /// Standard deviation over mean of the Gaussian; half width over mean of the uniform law.
    #[schemars(extend("minimum" = 0.0, "maximum" = 0.5))]
    pub spread: f64,
    /// Where the Gaussian is cut, in standard deviations; the uniform law ignores it.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 3.0))]
    pub cut: f64,
    /// Free grains at scale 1.
    #[schemars(extend("minimum" = 50, "maximum" = 1000000))]
    pub count: u64,
}

/// Law of grain sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SizeLaw {
    /// Gaussian, cut on both sides.
    Gaussian,
    /// Uniform between two limits.
    Uniform,
}

/// The floor of an incline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FloorKeys {
    /// Length downslope at scale 1, in diameters.
    #[schemars(extend("minimum" = 5.0, "maximum" = 1000.0))]
    pub length_diameters: f64,
    /// Width across at scale 1, in diameters.
    #[schemars(extend("minimum" = 5.0, "maximum" = 1000.0))]
    pub width_diameters: f64,
}

/// The contact law of an incline; exactly one of the three stiffness keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactKeys {
    /// Normal stiffness k_n d/(m g), m the mass of a grain of mean diameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 100.0, "maximum" = 1.0e10))]
    pub stiffness_scaled: Option<f64>,
    /// Normal stiffness k_n (N/m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e12))]
    pub stiffness: Option<f64>,
    /// Normal stiffness from the largest speed expected (m/s), so that it gives an overlap of 1 %
    /// of the smallest radius: k_n = m (v/x)².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub stiffness_from_speed: Option<f64>,
    /// Normal restitution ε_n.
    #[schemars(extend("minimum" = 0.01, "maximum" = 1.0))]
    pub restitution: f64,
    /// ε_t: sets the tangential dashpot as ε_n sets the normal one; 1 = none.
    #[schemars(extend("minimum" = 0.01, "maximum" = 1.0))]
    pub tangential_restitution: f64,
    /// Tangential over normal stiffness.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 2.0))]
    pub stiffness_ratio: f64,
    /// Coulomb friction μ_p between grains.
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub friction: f64,
    /// Rolling and twisting springs; leave the table out for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rolling: Option<super::RollingKeys>,
}

/// The time step of the grains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimestepKeys {
    /// Steps per undamped contact of two mean grains: Δt = π √(m/(2 k_n))/N.
    #[schemars(extend("minimum" = 10.0, "maximum" = 1.0e5))]
    pub steps_per_contact: f64,
    /// Factor on the step that those and all other limits allow.
    #[schemars(extend("minimum" = 0.01, "maximum" = 10.0))]
    pub safety: f64,
}

/// Duration of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimeKeys {
    /// Time before the first test for a steady state (s).
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e6))]
    pub relax: f64,
    /// Time over which profiles are averaged (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub average: f64,
    /// Longest time that is simulated (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e7))]
    pub limit: f64,
    /// Time between two samples of the averages (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub sample_every: f64,
    /// Thickness of the averaging layers, in diameters.
    #[schemars(extend("minimum" = 0.1, "maximum" = 10.0))]
    pub layer_diameters: f64,
    /// Relative drift of the mean velocity over the averaging time that still counts as steady.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub steady_tolerance: f64,
}

/// Angles of a calibration campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrationKeys {
    /// Angles run from flow to measure μ(I) (degrees); none: `flow_count` angles are chosen where, by the guess,
    /// they tell most about μ_s, μ_2 and I_0.
    #[schemars(extend("minItems" = 0, "maxItems" = 60, "items" = {"type": "number", "exclusiveMinimum": 0.0, "exclusiveMaximum": 90.0}))]
    pub flow_degrees: Vec<f64>,
    /// How many angles are chosen where `flow_degrees` is empty.
    #[serde(default = "seven")]
    #[schemars(extend("minimum" = 4, "maximum" = 60))]
    pub flow_count: u64,
    /// Depths, as factors of the depth, that such flows may have besides the full one: their number, slopes and depths are chosen
    /// for most information at the cost of `flow_count` full flows. None: all are of the full depth.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("minItems" = 0, "maxItems" = 20, "items" = {"type": "number", "minimum": 0.05, "maximum": 4.0}))]
    pub depth_choices: Vec<f64>,
    /// Beds of different seeds that the searches try at each slope: one alone leaves ±2 degrees.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1, "maximum" = 64))]
    pub beds: u64,
    /// With how many of these beds each flow is measured.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1, "maximum" = 64))]
    pub flow_beds: u64,
    /// Shallower (or deeper) beds, as factors of the depth, for which the stop is sought too: h_stop(θ). Not read with
    /// `search` = false.
    #[serde(default)]
    #[schemars(extend("minItems" = 0, "maxItems" = 20, "items" = {"type": "number", "minimum": 0.05, "maximum": 4.0}))]
    pub depths: Vec<f64>,
    /// Whether stop and onset are sought; false: flows alone are measured.
    #[serde(default = "yes")]
    pub search: bool,
    /// Where a flowing bed stops, bracketed from flow.
    pub stop: Bracket,
    /// Where a bed at rest starts to flow, bracketed from rest.
    pub onset: Bracket,
    /// Longest run of those two searches (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub search_time: f64,
    /// Inertial number that the search for the stop starts from.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub search_inertial_number: f64,
    /// Largest relative drift of the mean velocity of flows whose points enter the fit.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub usable_drift: f64,
    /// The law that starting velocities are taken from.
    pub guess: GuessKeys,
    /// Angle at which the continuum is compared with the grains (degrees).
    #[schemars(extend("minItems" = 0, "maxItems" = 60, "items" = {"type": "number", "minimum": 0.0, "exclusiveMaximum": 90.0}))]
    pub compare_degrees: Vec<f64>,
    /// Cells across the depth in that comparison.
    #[schemars(extend("minimum" = 8, "maximum" = 1024))]
    pub compare_cells: u64,
}

fn yes() -> bool {
    true
}

fn one() -> u64 {
    1
}

fn seven() -> u64 {
    7
}

/// A guess of μ(I) against σ_zz: the nearer to the truth, the sooner flows are steady. Results do
/// not depend on it otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GuessKeys {
    /// Friction at I → 0.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 5.0))]
    pub mu_s: f64,
    /// Friction at I → ∞.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 20.0))]
    pub mu_2: f64,
    /// Inertial number half way between.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub i_0: f64,
}

/// A range of angles that is halved until it is narrow enough.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bracket {
    /// An angle at which it rests (degrees).
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub low: f64,
    /// An angle at which it flows (degrees).
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub high: f64,
    /// Width at which halving ends (degrees).
    #[schemars(extend("minimum" = 0.05, "maximum" = 90.0))]
    pub resolution: f64,
}

/// Most free grains: about 20 GB of memory.
const MOST_GRAINS: usize = 20_000_000;
/// Largest floor, in squares of the diameter: its base has about as many grains.
const LARGEST_FLOOR: f64 = 2.0e6;

impl InclineScene {
    /// Normal stiffness k_n (N/m), from whichever of the three keys is given.
    pub fn stiffness(&self) -> f64 {
        let contact = &self.contact;
        let mass = self.mean_mass();
        match (contact.stiffness, contact.stiffness_from_speed) {
            (Some(stiffness), _) => stiffness,
            (None, Some(speed)) => {
                colluvium_dem::timestep::stiffness(mass, speed, 0.01 * self.smallest_radius())
            }
            (None, None) => {
                let scaled = contact.stiffness_scaled.unwrap_or_default();
                scaled * mass * self.gravity / self.grains.diameter
            }
        }
    }

    /// Mass of a grain of mean diameter (kg).
    pub fn mean_mass(&self) -> f64 {
        self.grains.density * std::f64::consts::PI / 6.0 * self.grains.diameter.powi(3)
    }

    /// Radius of the smallest grain that the size law allows (m).
    pub fn smallest_radius(&self) -> f64 {
        let cut = match self.grains.sizes {
            SizeLaw::Gaussian => self.grains.cut,
            SizeLaw::Uniform => 1.0,
        };
        0.5 * self.grains.diameter * (1.0 - self.grains.spread * cut)
    }

    /// Free grains at this scale.
    pub fn free_grains(&self) -> usize {
        (self.grains.count as f64 * self.scale * self.scale).round() as usize
    }

    /// Edges of the floor at this scale (m).
    pub fn floor_edges(&self) -> [f64; 2] {
        [self.floor.length_diameters, self.floor.width_diameters]
            .map(|n| n * self.grains.diameter * self.scale)
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let out_of_range = |key: &str, value: f64, range: String| {
            Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: key.to_owned(),
                value: value.to_string(),
                range,
            })
        };
        let contact = &self.contact;
        let given = [
            contact.stiffness,
            contact.stiffness_scaled,
            contact.stiffness_from_speed,
        ];
        if given.iter().all(Option::is_none) {
            return Err(SceneError::MissingKey {
                file: origin.to_owned(),
                key: "contact.stiffness_scaled".into(),
                wanted: "one of contact.stiffness_scaled, contact.stiffness, contact.stiffness_from_speed".into(),
            });
        }
        if self.mean_mass() <= LEAST_MASS {
            return out_of_range(
                "grains.diameter",
                self.grains.diameter,
                format!("such that a grain is heavier than {LEAST_MASS:e} kg"),
            );
        }
        if self.free_grains() > MOST_GRAINS {
            let most = MOST_GRAINS as f64 / (self.scale * self.scale);
            return out_of_range(
                "grains.count",
                self.grains.count as f64,
                format!("at most {most:.0} at scale {}", self.scale),
            );
        }
        let area =
            self.floor.length_diameters * self.floor.width_diameters * self.scale * self.scale;
        if area > LARGEST_FLOOR {
            let most = LARGEST_FLOOR / (self.floor.width_diameters * self.scale * self.scale);
            return out_of_range(
                "floor.length_diameters",
                self.floor.length_diameters,
                format!(
                    "at most {most} at floor.width_diameters {} and scale {}",
                    self.floor.width_diameters, self.scale
                ),
            );
        }
        // Two largest diameters and the search list's skin have to fit twice into a periodic axis.
        let least = 5.0;
        for (key, length) in [
            ("floor.length_diameters", self.floor.length_diameters),
            ("floor.width_diameters", self.floor.width_diameters),
        ] {
            if length * self.scale < least {
                return out_of_range(
                    key,
                    length,
                    format!("at least {} at scale {}", least / self.scale, self.scale),
                );
            }
        }
        if self.smallest_radius() < 0.1 * self.grains.diameter {
            return out_of_range(
                "grains.cut",
                self.grains.cut,
                format!(
                    "at most {} at spread {}",
                    0.8 / self.grains.spread,
                    self.grains.spread
                ),
            );
        }
        // Sums of decimal numbers may miss by a bit.
        if self.time.limit < (self.time.relax + self.time.average) * (1.0 - 1e-9) {
            return out_of_range(
                "time.limit",
                self.time.limit,
                format!(
                    "at least time.relax + time.average = {}",
                    self.time.relax + self.time.average
                ),
            );
        }
        if self.time.sample_every > self.time.average / 4.0 {
            return out_of_range(
                "time.sample_every",
                self.time.sample_every,
                format!(
                    "(0, {}], a quarter of time.average",
                    self.time.average / 4.0
                ),
            );
        }
        for (name, bracket) in [
            ("calibration.stop", self.calibration.stop),
            ("calibration.onset", self.calibration.onset),
        ] {
            if bracket.high <= bracket.low {
                return out_of_range(
                    &format!("{name}.high"),
                    bracket.high,
                    format!("({}, 90), above {name}.low", bracket.low),
                );
            }
        }
        if self.calibration.flow_beds > self.calibration.beds {
            return out_of_range(
                "calibration.flow_beds",
                self.calibration.flow_beds as f64,
                format!("[1, {}], at most calibration.beds", self.calibration.beds),
            );
        }
        let calibration = &self.calibration;
        if !calibration.depth_choices.is_empty() && !calibration.flow_degrees.is_empty() {
            return out_of_range(
                "calibration.depth_choices",
                calibration.depth_choices[0],
                "none where calibration.flow_degrees names the flows; flow_degrees = [] lets slopes and depths be chosen"
                    .to_owned(),
            );
        }
        let guess = self.calibration.guess;
        if guess.mu_2 <= guess.mu_s {
            return out_of_range(
                "calibration.guess.mu_2",
                guess.mu_2,
                format!("above calibration.guess.mu_s = {}", guess.mu_s),
            );
        }
        self.check_model(origin)?;
        let rolling_without_friction =
            self.contact.friction == 0.0 && self.contact.rolling.is_some();
        if rolling_without_friction {
            return out_of_range(
                "contact.friction",
                0.0,
                "above 0 where contact.rolling is given".to_owned(),
            );
        }
        Ok(())
    }
}
