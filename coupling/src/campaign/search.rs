//! Search for the slope where beds begin to flow, and what a set of runs says about it.

use super::{Bracket, CampaignError};
use crate::incline::InclineResult;
use std::fmt;

/// Slopes at one end that are tried before a search is given up.
const TRIES: usize = 3;
/// Steepest slope that a search moves out to (degrees); at 90° nothing holds the grains to the plane.
const STEEPEST: f64 = 89.0;

/// Bisection for the slope where most beds begin to flow, between a low and a high end that are run first. If an end
/// is not what it should be, the search moves outward by the bracket's width, twice at most and not beyond level
/// ground or 89°. `run` gives all beds at a slope. Runs by rising slope; without a resting and a flowing end there is
/// no bisection.
pub(super) fn search(
    bracket: &Bracket,
    run: &dyn Fn(f64) -> Result<Vec<InclineResult>, CampaignError>,
) -> Result<Vec<InclineResult>, CampaignError> {
    let mut results = Vec::new();
    let mut flows_at = |angle: f64| -> Result<bool, CampaignError> {
        let beds = run(angle)?;
        let flowing = beds.iter().filter(|r| r.flows()).count();
        let flows = 2 * flowing > beds.len();
        results.extend(beds);
        Ok(flows)
    };
    let width = bracket.high - bracket.low;
    let (mut low, mut high) = (bracket.low, bracket.high);
    let (mut low_rests, mut high_flows) = (false, false);
    for attempt in 1..=TRIES {
        if !flows_at(low)? {
            low_rests = true;
            break;
        }
        (high, high_flows) = (low, true);
        if attempt == TRIES || low <= 0.0 {
            break;
        }
        low = (low - width).max(0.0);
    }
    if low_rests && !high_flows {
        for attempt in 1..=TRIES {
            if flows_at(high)? {
                high_flows = true;
                break;
            }
            low = high;
            if attempt == TRIES || high >= STEEPEST {
                break;
            }
            high = (high + width).min(STEEPEST);
        }
    }
    if low_rests && high_flows {
        while high - low > bracket.resolution * (1.0 + 1e-9) {
            let middle = 0.5 * (low + high);
            if flows_at(middle)? {
                high = middle;
            } else {
                low = middle;
            }
        }
    }
    results.sort_by(|a, b| a.slope_degrees.total_cmp(&b.slope_degrees));
    Ok(results)
}

/// Why runs do not bracket the slope where beds begin to flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NoBracket {
    /// There are no runs.
    NoRuns,
    /// All of them flow, down to this slope (degrees).
    AllFlow(f64),
    /// None of them flows, up to this slope (degrees).
    NoneFlows(f64),
    /// The lowest flow and the lowest rest, which is above it (degrees).
    RestAboveFlow(f64, f64),
}

impl fmt::Display for NoBracket {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NoRuns => write!(f, "no slope was tried"),
            Self::AllFlow(low) => {
                write!(f, "every bed flows, down to the lowest slope of {low:.2}°")
            }
            Self::NoneFlows(high) => {
                write!(f, "no bed flows, up to the highest slope of {high:.2}°")
            }
            Self::RestAboveFlow(flow, rest) => write!(
                f,
                "one bed flows at {flow:.2}° and none rests below that, though one does at {rest:.2}°"
            ),
        }
    }
}

/// Highest slope below the lowest flow that does not flow, and that lowest flow above it. A bed at rest on a
/// slope steeper than the lowest flow does not hide that flow. Of several beds at a slope most decide.
pub(super) fn bracket<'a>(
    runs: impl Iterator<Item = &'a InclineResult>,
) -> Result<(f64, f64), NoBracket> {
    let mut slopes: Vec<(f64, i64)> = Vec::new();
    for run in runs {
        let vote = if run.flows() { 1 } else { -1 };
        match slopes.iter_mut().find(|s| s.0 == run.slope_degrees) {
            Some(known) => known.1 += vote,
            None => slopes.push((run.slope_degrees, vote)),
        }
    }
    let those = |flowing: bool| -> Vec<f64> {
        let most = slopes.iter().filter(|s| (s.1 > 0) == flowing);
        most.map(|s| s.0).collect()
    };
    let (mut resting, flowing) = (those(false), those(true));
    let lowest = |angles: &[f64]| angles.iter().copied().min_by(f64::total_cmp);
    let highest = |angles: &[f64]| angles.iter().copied().max_by(f64::total_cmp);
    let (high, lowest_rest) = match (lowest(&flowing), lowest(&resting)) {
        (Some(flow), Some(rest)) => (flow, rest),
        (Some(flow), None) => return Err(NoBracket::AllFlow(flow)),
        (None, Some(_)) => {
            return Err(highest(&resting).map_or(NoBracket::NoRuns, NoBracket::NoneFlows));
        }
        (None, None) => return Err(NoBracket::NoRuns),
    };
    resting.retain(|rest| *rest < high);
    highest(&resting)
        .map(|low| (low, high))
        .ok_or(NoBracket::RestAboveFlow(high, lowest_rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::incline::{Cost, Outcome, Purpose, Start};
    use crate::steady_state::steady_test;

    fn result(slope_degrees: f64, flows: bool) -> InclineResult {
        InclineResult {
            slope_degrees,
            purpose: Purpose::OnsetSearch,
            start: Start::Rest,
            outcome: if flows {
                Outcome::Accelerating
            } else {
                Outcome::Rest
            },
            steady: steady_test(&[], 1.0, 0.05),
            distance: 1.1,
            diameter: 1.0,
            series: Vec::new(),
            profile: None,
            checks: None,
            points: Vec::new(),
            height: 1.0,
            cost: Cost::default(),
            largest_overlap: 0.0,
            state_hash: String::new(),
            bed: 0,
            grains: 0,
            sudden_loss: 0.0,
            bond_order: 0.0,
        }
    }

    /// Slopes tried where beds flow from `truth` on, and what they say.
    fn tried(low: f64, high: f64, truth: f64) -> (Vec<f64>, Result<(f64, f64), NoBracket>) {
        let range = Bracket {
            low,
            high,
            resolution: 1.0,
        };
        let runs = search(&range, &|angle| {
            assert!((0.0..90.0).contains(&angle), "{angle}");
            Ok(vec![result(angle, angle >= truth)])
        })
        .unwrap();
        let slopes = runs.iter().map(|r| r.slope_degrees).collect();
        (slopes, bracket(runs.iter()))
    }

    #[test]
    fn a_search_halves_and_moves_outward() {
        assert_eq!(tried(24.0, 28.0, 26.5).1, Ok((26.0, 27.0)));
        assert_eq!(tried(24.0, 28.0, 23.2).1, Ok((23.0, 24.0)));
        assert_eq!(tried(24.0, 28.0, 34.5).1, Ok((34.0, 35.0)));
        // Given up after moving out twice.
        assert_eq!(tried(24.0, 28.0, 1.0).0, [16.0, 20.0, 24.0]);
        let (slopes, none) = tried(24.0, 28.0, 80.0);
        assert_eq!(slopes, [24.0, 28.0, 32.0, 36.0]);
        assert_eq!(none, Err(NoBracket::NoneFlows(36.0)));
    }

    #[test]
    fn a_search_stays_between_level_and_upright() {
        let (slopes, none) = tried(4.0, 10.0, -1.0);
        assert_eq!(slopes, [0.0, 4.0]);
        let why = none.unwrap_err().to_string();
        assert!(why.contains("every bed flows") && why.contains("0.00°"));
        // A low end of level ground is an end like others.
        assert_eq!(tried(2.0, 6.0, 0.5).1, Ok((0.0, 1.0)));
        let (slopes, none) = tried(70.0, 85.0, 95.0);
        assert_eq!(slopes, [70.0, 85.0, 89.0]);
        assert!(none.unwrap_err().to_string().contains("89.00°"));
        // A high end of 80° and more is run.
        assert_eq!(tried(80.0, 89.5, 89.2).0.last(), Some(&89.5));
        assert!(tried(80.0, 89.5, 89.2).1.is_ok());
    }

    #[test]
    fn a_late_stop_does_not_hide_a_gentler_flow() {
        let runs = |list: &[(f64, bool)]| {
            let runs: Vec<_> = list.iter().map(|(a, flows)| result(*a, *flows)).collect();
            bracket(runs.iter())
        };
        let list = [(24.0, false), (27.0, false), (29.0, true), (35.0, false)];
        assert_eq!(runs(&list), Ok((27.0, 29.0)));
        assert_eq!(runs(&[(24.0, false), (29.0, true)]), Ok((24.0, 29.0)));
        assert_eq!(
            runs(&[(29.0, true), (35.0, false)]),
            Err(NoBracket::RestAboveFlow(29.0, 35.0))
        );
        assert_eq!(runs(&[]), Err(NoBracket::NoRuns));
    }

    #[test]
    fn from_rest_a_creep_is_not_a_flow() {
        for outcome in [Outcome::Steady, Outcome::Accelerating] {
            let mut creep = result(30.0, true);
            creep.outcome = outcome;
            assert!(creep.flows());
            creep.distance = 0.01;
            assert!(!creep.flows(), "{outcome:?}");
            creep.start = Start::Flow {
                inertial_number: 0.1,
            };
            assert!(creep.flows(), "{outcome:?}");
        }
        // From rest to a measured flow: the same rule, if the drift is not known either.
        let mut measured = result(30.0, true);
        (measured.purpose, measured.outcome) = (Purpose::Measure, Outcome::Undecided);
        assert!(measured.flows());
        measured.distance = 0.9;
        assert!(!measured.flows());
    }
}
