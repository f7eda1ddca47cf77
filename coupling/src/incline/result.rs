//! What an inclined-plane run leaves.

use super::{Purpose, Start};
use crate::calibration::LocalPoint;
use crate::coarse_graining::{BalanceCheck, Profile};
use crate::steady_state::SteadyTest;
use colluvium_dem::Snapshot;
use serde::{Deserialize, Serialize};

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The grains came, or stayed, at rest.
    Rest,
    /// They flow, and the mean velocity is stationary.
    Steady,
    /// They flow ever faster.
    Accelerating,
    /// They flow ever slower.
    Decelerating,
    /// They move, and the series is too short or noisy to say more.
    Undecided,
}

/// The flow at one instant, free grains only.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeriesPoint {
    /// Time (s).
    pub time: f64,
    /// Kinetic energy, translation and rotation (J).
    pub kinetic_energy: f64,
    /// Mean velocity downslope, by mass [m/s].
    pub mean_velocity: f64,
    /// Mass of the free grains (kg).
    pub mass: f64,
    /// Height of their centre of mass (m).
    pub mean_height: f64,
}

impl SeriesPoint {
    pub(super) fn of(snapshot: &Snapshot) -> Self {
        let (mut mass, mut energy, mut momentum, mut height) = (0.0, 0.0, 0.0, 0.0);
        for g in snapshot.grains.iter().filter(|g| !g.fixed) {
            let spin = 0.4 * g.radius * g.radius * g.spin.norm_squared();
            mass += g.mass;
            energy += 0.5 * g.mass * (g.velocity.norm_squared() + spin);
            momentum += g.mass * g.velocity.x;
            height += g.mass * g.position.z;
        }
        // `new` has made sure that there is a free grain.
        Self {
            time: snapshot.time,
            kinetic_energy: energy,
            mean_velocity: momentum / mass,
            mass,
            mean_height: height / mass,
        }
    }
}

/// What a run cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Steps.
    pub steps: u64,
    /// Steps times grains, fixed ones included.
    pub grain_steps: u64,
    /// Time on the clock (s).
    pub wall_s: f64,
}

/// Result of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InclineResult {
    /// Slope (degrees).
    pub slope_degrees: f64,
    /// What the run was for.
    pub purpose: Purpose,
    /// How it started.
    pub start: Start,
    /// How it ended.
    pub outcome: Outcome,
    /// Test of the mean velocity over the averaging time (without one: over the second half of the run).
    pub steady: SteadyTest,
    /// Distance travelled downslope, mean over the grains (m).
    pub distance: f64,
    /// Mean diameter of the grains d (m).
    pub diameter: f64,
    /// Series of energy and mean velocity.
    pub series: Vec<SeriesPoint>,
    /// Averages, if the run came to averaging and still moved.
    pub profile: Option<Profile>,
    /// Mass and momentum balance of the averages.
    pub checks: Option<BalanceCheck>,
    /// Local points (I, μ, φ) of the profile.
    pub points: Vec<LocalPoint>,
    /// Height of the flow (m); of the bed, without a profile.
    pub height: f64,
    /// Cost.
    pub cost: Cost,
    /// Largest overlap of any contact at any step since the start, over the harmonic mean of the two radii.
    pub largest_overlap: f64,
    /// Hash of the last state's bits.
    pub state_hash: String,
    /// Which of a campaign's beds it was; 0 for the first.
    #[serde(default)]
    pub bed: u64,
    /// Free grains; 0 in results that do not tell.
    #[serde(default)]
    pub grains: u64,
    /// Largest kinetic energy lost within 3 √(d/g), over the largest there was, both after the first 10 √(d/g).
    #[serde(default)]
    pub sudden_loss: f64,
    /// Global bond order Q_6 of the contacts at the end: 0.57 in a face-centred cubic crystal, near 0 in disorder.
    #[serde(default)]
    pub bond_order: f64,
}

/// Why a flow has not settled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unsettled {
    /// It gains speed: the slope is steeper than any friction of the material, or the run too short.
    Accelerating,
    /// It slows down without having stopped.
    Decelerating,
    /// It lost most of its energy at once, as grains rearranged.
    Jamming,
    /// Its contacts are ordered: it flows, or stopped, as a crystal.
    Crystallising,
    /// Too short or noisy to tell.
    Undecided,
}

/// Bond order above which grains are a crystal: half of the way to the least ordered one.
const CRYSTAL: f64 = 0.25;
/// Loss of energy at once that counts as a jam.
const JAM: f64 = 0.7;

impl Unsettled {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Accelerating => "accelerating",
            Self::Decelerating => "slowing down",
            Self::Jamming => "jamming",
            Self::Crystallising => "crystallising",
            Self::Undecided => "too short to tell",
        }
    }
}

/// Loses more than this share of its mean speed over the second half of a run: it is about to stop.
const STOPPING_DRIFT: f64 = -0.5;

impl InclineResult {
    /// What keeps the run from a steady flow; nothing if it is steady, or was at rest from the start.
    pub fn unsettled(&self) -> Option<Unsettled> {
        let flowed = matches!(self.start, Start::Flow { .. });
        if self.bond_order > CRYSTAL {
            return Some(Unsettled::Crystallising);
        }
        match self.outcome {
            Outcome::Steady => None,
            Outcome::Rest if flowed && self.sudden_loss > JAM => Some(Unsettled::Jamming),
            Outcome::Rest => None,
            Outcome::Accelerating => Some(Unsettled::Accelerating),
            Outcome::Decelerating if self.sudden_loss > JAM => Some(Unsettled::Jamming),
            Outcome::Decelerating => Some(Unsettled::Decelerating),
            Outcome::Undecided => Some(Unsettled::Undecided),
        }
    }

    /// Does the bed flow at this slope? A run whose time was over counts as a flow unless it was about to stop
    /// (more than half of its mean speed lost over the second half; a drift that is not known does not show
    /// that). Started from rest, it counts as a flow only if it moved on by more than a diameter, and in an
    /// onset search only if it was not left slowing down or undecided.
    pub fn flows(&self) -> bool {
        let moved_on = self.distance > self.diameter;
        let goes_on = !self.steady.drift_known || self.steady.drift > STOPPING_DRIFT;
        match (self.outcome, self.start) {
            (Outcome::Rest, _) => false,
            (Outcome::Steady | Outcome::Accelerating, Start::Flow { .. }) => true,
            (Outcome::Steady | Outcome::Accelerating, Start::Rest) => moved_on,
            (Outcome::Decelerating | Outcome::Undecided, Start::Flow { .. }) => goes_on,
            (Outcome::Decelerating | Outcome::Undecided, Start::Rest) => {
                self.purpose == Purpose::Measure && moved_on && goes_on
            }
        }
    }
}
