//! Which runs a campaign makes.

use crate::incline::{InclineError, InclineResult, InclineSpec, Purpose, Start};
use colluvium_dem::{Domain, Grain};
use serde::{Deserialize, Serialize};

/// Range of slopes to search and how finely.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bracket {
    /// A slope thought to be at rest (degrees).
    pub low: f64,
    /// A slope thought to flow (degrees).
    pub high: f64,
    /// Width at which the search ends (degrees).
    pub resolution: f64,
}

/// The law from which starting velocities are guessed: the nearer to the truth, the sooner flows are steady.
/// Friction against σ_zz, which in a steady flow is tan θ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuessedLaw {
    /// μ_s.
    pub mu_s: f64,
    /// μ_2.
    pub mu_2: f64,
    /// I_0.
    pub i_0: f64,
}

impl GuessedLaw {
    /// I = I_0 (tan θ − μ_s)/(μ_2 − tan θ), kept within 0.05 and 0.8.
    pub fn inertial_number(&self, slope: f64) -> f64 {
        const RANGE: (f64, f64) = (0.05, 0.8);
        let t = slope.tan();
        // At μ_2 and beyond, the law has no steady flow.
        if t >= self.mu_2 {
            return RANGE.1;
        }
        (self.i_0 * (t - self.mu_s) / (self.mu_2 - t)).clamp(RANGE.0, RANGE.1)
    }
}

/// One more settled bed.
#[derive(Clone, Debug)]
pub struct OtherBed {
    /// Its box.
    pub domain: Domain,
    /// Its grains over their fixed base.
    pub grains: Vec<Grain>,
}

/// Flows that are measured on a bed of another depth.
#[derive(Clone, Debug)]
pub struct FlowsOfDepth {
    /// The bed.
    pub bed: OtherBed,
    /// Their slopes (degrees).
    pub slopes_degrees: Vec<f64>,
}

/// A campaign.
#[derive(Clone, Debug)]
pub struct CampaignSpec {
    /// Bed, law and times of a measuring run; its slope, start and purpose are set by the campaign.
    pub base: InclineSpec,
    /// Material in the thesis' Table 2.6 to compare with: `moderate` or `gravel`.
    pub published_material: Option<String>,
    /// Slopes of the measured flows (degrees).
    pub flow_angles_degrees: Vec<f64>,
    /// Flows measured besides, on beds of other depths.
    pub flows_of_depth: Vec<FlowsOfDepth>,
    /// Starting velocities of measured flows.
    pub guessed_law: GuessedLaw,
    /// Whether stop and onset are sought; without, flows alone are measured.
    pub searches: bool,
    /// Search for the slope where flow stops.
    pub stop: Bracket,
    /// Search for the slope where a bed at rest starts.
    pub onset: Bracket,
    /// Longest run of a search (s).
    pub search_time: f64,
    /// Inertial number at the start of the stop search; low, so that beds that stop do so soon.
    pub search_inertial_number: f64,
    /// Largest drift of the mean velocity over the averaging time, relative and its standard error included, of
    /// flows whose points are used: pairs (I, μ) are local and hold in a slow drift, though tan θ does not.
    pub usable_drift: f64,
    /// Beds of the same grains and depth from other seeds: at every slope of a search all beds are tried.
    pub other_beds: Vec<OtherBed>,
    /// How many of all beds, the first included, the flows are measured with; at least 1.
    pub flow_beds: usize,
    /// Beds of other depths, for which the stop is sought too: h_stop(θ).
    pub depths: Vec<OtherBed>,
    /// Seed of the posterior's samples.
    pub seed: u64,
}

/// What can be wrong with a campaign.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CampaignError {
    /// A number is out of range.
    #[error("campaign.{key} = {value}: must be {allowed}")]
    OutOfRange {
        /// Name of the key.
        key: &'static str,
        /// The value found.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A run failed.
    #[error(transparent)]
    Run(#[from] InclineError),
    /// The stop flag was set.
    #[error("the campaign was stopped; finished runs are kept")]
    Stopped,
}

impl CampaignSpec {
    /// Checks the campaign's numbers; those of its runs are checked when they start, the base here.
    ///
    /// # Errors
    /// The first number out of range, by name.
    pub fn validate(&self) -> Result<(), CampaignError> {
        let check = |key, value: f64, ok: bool, allowed| {
            if ok && value.is_finite() {
                Ok(())
            } else {
                Err(CampaignError::OutOfRange {
                    key,
                    value,
                    allowed,
                })
            }
        };
        let of_depth = self.flows_of_depth.iter().flat_map(|f| &f.slopes_degrees);
        for angle in self.flow_angles_degrees.iter().chain(of_depth.clone()) {
            let ok = *angle > 0.0 && *angle < 90.0;
            check("flow_angles_degrees", *angle, ok, "above 0 and below 90")?;
        }
        let count = (self.flow_angles_degrees.len() + of_depth.clone().count()) as f64;
        check(
            "flow_angles_degrees (number)",
            count,
            count >= 1.0,
            "at least 1",
        )?;
        for (key_low, key_width, bracket) in [
            ("stop.low", "stop.high - stop.low", &self.stop),
            ("onset.low", "onset.high - onset.low", &self.onset),
        ] {
            let width = bracket.high - bracket.low;
            let ok = bracket.low > 0.0 && bracket.low < 90.0;
            check(key_low, bracket.low, ok, "above 0 and below 90")?;
            check(
                key_width,
                width,
                width > 0.0 && bracket.high < 90.0,
                "positive, with high below 90",
            )?;
        }
        let finest = |b: &Bracket| b.resolution >= 0.01;
        check(
            "stop.resolution",
            self.stop.resolution,
            finest(&self.stop),
            "at least 0.01 degrees",
        )?;
        let onset = &self.onset;
        check(
            "onset.resolution",
            onset.resolution,
            finest(onset),
            "at least 0.01 degrees",
        )?;
        check(
            "search_time",
            self.search_time,
            self.search_time > 0.0,
            "positive",
        )?;
        let i = self.search_inertial_number;
        check("search_inertial_number", i, i > 0.0, "positive")?;
        check(
            "usable_drift",
            self.usable_drift,
            self.usable_drift > 0.0,
            "positive",
        )?;
        let g = &self.guessed_law;
        let ok = g.mu_s > 0.0 && g.mu_2 > g.mu_s;
        check(
            "guessed_law.mu_2",
            g.mu_2,
            ok,
            "above guessed_law.mu_s, both positive",
        )?;
        check("guessed_law.i_0", g.i_0, g.i_0 > 0.0, "positive")?;
        let mut angles = self.flow_angles_degrees.iter().chain(of_depth);
        let first = angles.next().copied().unwrap_or(self.stop.high);
        self.flow_run(first, 0).validate()?;
        Ok(())
    }

    /// Slopes of the measured flows, rising, each once.
    pub fn sorted_flow_angles(&self) -> Vec<f64> {
        let mut angles = self.flow_angles_degrees.clone();
        angles.sort_by(f64::total_cmp);
        angles.dedup();
        angles
    }

    /// The base on one of the beds: the first, then the others, then those of other depths, for stops and then for flows.
    fn on_bed(&self, bed: usize) -> InclineSpec {
        let mut spec = self.base.clone();
        let of_flows = self.flows_of_depth.iter().map(|f| &f.bed);
        let others = self.other_beds.iter().chain(&self.depths).chain(of_flows);
        if let Some(other) = bed.checked_sub(1).and_then(|k| others.clone().nth(k)) {
            spec.domain = other.domain;
            spec.bed = other.grains.clone();
        }
        spec
    }

    /// Numbers of the beds of full depth.
    pub(super) fn full_beds(&self) -> std::ops::Range<usize> {
        0..1 + self.other_beds.len()
    }

    /// Numbers of the beds of other depths.
    pub(super) fn depth_beds(&self) -> std::ops::Range<usize> {
        let first = 1 + self.other_beds.len();
        first..first + self.depths.len()
    }

    /// Slopes and beds of the flows of other depths.
    pub(super) fn flows_elsewhere(&self) -> Vec<(f64, usize)> {
        let first = self.depth_beds().end;
        let beds = self.flows_of_depth.iter().enumerate();
        beds.flat_map(|(k, f)| f.slopes_degrees.iter().map(move |s| (*s, first + k)))
            .collect()
    }

    pub(super) fn flow_run(&self, angle: f64, bed: usize) -> InclineSpec {
        let slope = angle.to_radians();
        let inertial_number = self.guessed_law.inertial_number(slope);
        InclineSpec {
            slope,
            start: Start::Flow { inertial_number },
            purpose: Purpose::Measure,
            ..self.on_bed(bed)
        }
    }

    pub(super) fn stop_run(&self, angle: f64, bed: usize) -> InclineSpec {
        InclineSpec {
            slope: angle.to_radians(),
            start: Start::Flow {
                inertial_number: self.search_inertial_number,
            },
            purpose: Purpose::StopSearch,
            relax_time: 0.5 * self.search_time,
            max_time: self.search_time,
            ..self.on_bed(bed)
        }
    }

    pub(super) fn onset_run(&self, angle: f64, bed: usize) -> InclineSpec {
        InclineSpec {
            slope: angle.to_radians(),
            start: Start::Rest,
            purpose: Purpose::OnsetSearch,
            max_time: self.search_time,
            ..self.on_bed(bed)
        }
    }

    /// May the points of this run enter the fit? It must have flowed, and be known not to have drifted far.
    pub fn is_usable(&self, run: &InclineResult) -> bool {
        let test = &run.steady;
        run.profile.is_some()
            && run.flows()
            && test.drift_known
            && test.drift.abs() + test.drift_error <= self.usable_drift
    }

    /// Most grain-steps the campaign can take if no search has to move outward.
    pub fn largest_cost(&self) -> u64 {
        let steps = |time: f64| time / self.base.timestep;
        let runs = |b: &Bracket| 2.0 + ((b.high - b.low) / b.resolution).log2().ceil().max(0.0);
        let flows = self.flow_angles_degrees.len() as f64 * steps(self.base.max_time);
        let beds = 1.0 + self.other_beds.len() as f64;
        let sought = if self.searches {
            runs(&self.stop) + runs(&self.onset)
        } else {
            0.0
        };
        let searches = sought * steps(self.search_time);
        let full = flows * self.flow_beds as f64 + searches * beds;
        let shallow: usize = self.depths.iter().map(|bed| bed.grains.len()).sum();
        let depths = runs(&self.stop) * steps(self.search_time) * shallow as f64;
        let elsewhere: usize = self
            .flows_of_depth
            .iter()
            .map(|f| f.bed.grains.len() * f.slopes_degrees.len())
            .sum();
        let elsewhere = elsewhere as f64 * steps(self.base.max_time);
        (full * self.base.bed.len() as f64 + depths + elsewhere) as u64
    }
}
