//! The fit of both laws, and flows left out of it.

use super::FluidityFlow;
use super::problem::{Free, Problem, State};
use serde::{Deserialize, Serialize};

/// Amplitudes that are tried first; the fit with A free begins at the best of them.
const AMPLITUDES: [f64; 8] = [0.15, 0.3, 0.5, 0.75, 1.1, 1.6, 2.3, 3.3];
/// Flows below which no scatter between them is known.
const LEAST_FLOWS: usize = 4;
/// Largest A that is told.
const LONGEST: f64 = 10.0;
/// Smallest A above 0 that is looked at.
const SHORTEST: f64 = 0.02;
/// What χ² over ĉ rises by at the ends of 68 and 95 %.
const RISES: [f64; 2] = [0.988_946, 3.841_459];

/// Both laws fitted to the same layers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FluidityFit {
    /// A.
    pub amplitude: f64,
    /// Where χ² is by 0.99 ĉ more than at its least: 68 %. From 0 where the local law is no worse than that, and up to 10 where
    /// no length is too long.
    pub amplitude_range: [f64; 2],
    /// The same for 95 %.
    pub amplitude_range_95: [f64; 2],
    /// s: fluidity at the top of the base over the local one.
    pub base: f64,
    /// b: friction of the flows beyond the law with this length.
    pub own: Vec<f64>,
    /// (μ_s, μ_2, I_0) beside this length.
    pub law: [f64; 3],
    /// (μ_s, μ_2, I_0) without a length, of the same layers.
    pub local: [f64; 3],
    /// χ² without and with the length.
    pub chi_square: [f64; 2],
    /// Root-mean-square of ln I measured − predicted, without and with the length.
    pub rms: [f64; 2],
    /// QAICc without and with the length.
    pub criterion: [f64; 2],
    /// Akaike weight of the law with a length.
    pub weight: f64,
    /// ĉ.
    pub scatter: f64,
    /// Layers.
    pub points: usize,
    /// Flows.
    pub flows: usize,
    /// Flows left out of both fits.
    pub left_out: Foretold,
}

/// Flows beside the laws of the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Foretold {
    /// Flows that could be left out.
    pub flows: usize,
    /// Of these, how many the law with a length foretells better.
    pub better: usize,
    /// Root-mean-square of ln I measured − foretold, without and with the length.
    pub rms: [f64; 2],
    /// Mean over the flows of D = ln(χ² without/χ² with), over its standard error.
    pub significance: f64,
}

/// Akaike weight from which a length counts as shown.
const SUPPORTED: f64 = 0.95;
/// Standard errors above 0 from which what is foretold better counts as shown: 95 % of Student's distribution with six
/// degrees of freedom, one-sided, is 1.9.
const FORETOLD: f64 = 2.0;

impl FluidityFit {
    /// Whether the profiles ask for a length: the criterion prefers it or, where that has no more to say, it foretells flows that
    /// were left out better than chance; and A = 0 lies outside its range.
    pub fn shows_a_length(&self) -> bool {
        let shown = self.weight > SUPPORTED || self.left_out.significance > FORETOLD;
        shown && self.amplitude_range[0] > 0.0
    }
}

/// The law without a length and the best one with a length, from a law and, where one is near, a length on.
fn both(problem: &Problem, law: [f64; 3], near: Option<&State>) -> Option<[State; 2]> {
    let local = problem.fit(&problem.state(law, 0.0, 1.0), Free::Law)?;
    let begin = match near {
        Some(near) => problem.state(near.law, near.amplitude, near.base),
        None => first(problem, &local).unwrap_or_else(|| local.clone()),
    };
    // A shorter one than can be told from none is none.
    let with = problem
        .fit(&begin, Free::Amplitude)
        .filter(|f| f.amplitude >= SHORTEST && f.chi_square < local.chi_square);
    let with = with.unwrap_or_else(|| local.clone());
    Some([local, with])
}

/// The best of some amplitudes; each fit begins where the one before ended.
fn first(problem: &Problem, local: &State) -> Option<State> {
    let mut start = local.clone();
    let mut best: Option<State> = None;
    for amplitude in AMPLITUDES {
        start.amplitude = amplitude;
        let Some(found) = problem.fit(&start, Free::Base) else {
            continue;
        };
        start = found.clone();
        let better = |b: &State| found.chi_square < b.chi_square;
        if best.as_ref().is_none_or(better) {
            best = Some(found);
        }
    }
    best
}

/// Where χ², least over all but A, is by `rise` more than at its least.
fn range(problem: &Problem, local: &State, best: &State, rise: f64) -> [f64; 2] {
    let least = best.chi_square;
    // √(χ² − its least) is nearly a straight line in A; from that of `rise`.
    let beyond = |state: &State| (state.chi_square - least).max(0.0).sqrt() - rise.sqrt();
    let end = |factor: f64| -> f64 {
        let limit = if factor < 1.0 { SHORTEST } else { LONGEST };
        let mut inner = best.clone();
        if inner.amplitude < SHORTEST {
            inner.amplitude = SHORTEST;
        }
        let mut outer = loop {
            let next = inner.amplitude * factor;
            if (next - limit) * (factor - 1.0) >= 0.0 {
                return limit;
            }
            let mut start = inner.clone();
            start.amplitude = next;
            let Some(found) = problem.fit(&start, Free::Base) else {
                return next;
            };
            if beyond(&found) > 0.0 {
                break found;
            }
            inner = found;
        };
        for _ in 0..12 {
            let (a, b) = (beyond(&inner), beyond(&outer));
            let share = (a / (a - b)).clamp(0.1, 0.9);
            let mut start = inner.clone();
            start.amplitude += share * (outer.amplitude - inner.amplitude);
            let Some(found) = problem.fit(&start, Free::Base) else {
                break;
            };
            let off = beyond(&found);
            if off > 0.0 {
                outer = found;
            } else {
                inner = found;
            }
            if off.abs() < 1e-3 * rise.sqrt() {
                break;
            }
        }
        0.5 * (inner.amplitude + outer.amplitude)
    };
    let low = if beyond(local) <= 0.0 { 0.0 } else { end(0.8) };
    [low, end(1.25)]
}

/// Leaves each flow out of both fits.
fn foretold(problem: &Problem, law: [f64; 3], with: &State) -> Foretold {
    let near = Some(with).filter(|w| w.amplitude >= SHORTEST);
    let mut gains = Vec::new();
    let (mut squares, mut points) = ([0.0; 2], 0.0);
    for k in 0..problem.flows.len() {
        let Some(laws) = both(&problem.without(k), law, near) else {
            continue;
        };
        let own = problem.only(k);
        let seen = laws.map(|s| {
            // A flow that asks for more friction than the others' law can bear has no steady state by it.
            let bears = s.law[1] > own.largest;
            let beside = own.state(s.law, s.amplitude, s.base);
            let chi_square = own.fit(&beside, Free::Own).map(|f| f.chi_square);
            chi_square
                .filter(|_| bears)
                .map(|chi| (chi, own.rms(&beside)))
        });
        let [Some(local), Some(with)] = seen else {
            continue;
        };
        let n = own.points() as f64;
        squares[0] += n * local.1 * local.1;
        squares[1] += n * with.1 * with.1;
        points += n;
        gains.push((local.0 / with.0.max(f64::MIN_POSITIVE)).ln());
    }
    let n = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / n.max(1.0);
    let spread: f64 = gains.iter().map(|d| (d - mean).powi(2)).sum();
    let error = (spread / (n * (n - 1.0))).sqrt();
    Foretold {
        flows: gains.len(),
        better: gains.iter().filter(|d| **d > 0.0).count(),
        rms: squares.map(|s| (s / f64::max(points, 1.0)).sqrt()),
        significance: if error > 0.0 { mean / error } else { 0.0 },
    }
}

/// Fits the local law and non-local fluidity to the layers of the flows. `law` (μ_s, μ_2, I_0) is a fit of the same points,
/// from which both begin; `friction_scatter` is σ_b.
///
/// `None` for fewer than four flows, or where the local law has no fit.
pub fn fit_fluidity(
    flows: &[FluidityFlow],
    law: [f64; 3],
    friction_scatter: f64,
) -> Option<FluidityFit> {
    if flows.len() < LEAST_FLOWS {
        return None;
    }
    let problem = Problem::of(flows.iter().collect(), friction_scatter);
    let [local, with] = both(&problem, law, None)?;
    let points = problem.points();
    let parameters = [3.0, 5.0];
    let scatter = (with.chi_square / (points as f64 - parameters[1]).max(1.0)).max(1.0)
        * neighbours(&problem.residuals(&with));
    let effective = (points as f64 / scatter).max(flows.len() as f64);
    let chi_square = [local.chi_square, with.chi_square];
    let criterion = [0, 1].map(|law| {
        let k: f64 = parameters[law];
        let few = (effective - k - 1.0).max(1.0);
        chi_square[law] / scatter + 2.0 * k + 2.0 * k * (k + 1.0) / few
    });
    let [range_68, range_95] = RISES.map(|rise| range(&problem, &local, &with, rise * scatter));
    Some(FluidityFit {
        amplitude: with.amplitude,
        amplitude_range: range_68,
        amplitude_range_95: range_95,
        base: with.base,
        own: with.own.iter().map(|z| z * friction_scatter).collect(),
        law: with.law,
        local: local.law,
        chi_square,
        rms: [problem.rms(&local), problem.rms(&with)],
        criterion,
        weight: 1.0 / (1.0 + (0.5 * (criterion[1] - criterion[0])).exp()),
        scatter,
        points,
        flows: flows.len(),
        left_out: foretold(&problem, law, &with),
    })
}

/// (1 + r)/(1 − r) for the correlation r of neighbouring layers' residuals; 1 where it is negative.
fn neighbours(residuals: &[Vec<f64>]) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for own in residuals {
        product += own.windows(2).map(|w| w[0] * w[1]).sum::<f64>();
        square += own.iter().skip(1).map(|r| r * r).sum::<f64>();
    }
    let r = (product / square.max(f64::MIN_POSITIVE)).clamp(0.0, 0.95);
    (1.0 + r) / (1.0 - r)
}
