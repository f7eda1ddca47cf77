//! The fit of both laws, and flows left out of it.

use super::{FluidityFlow, Seen};
use crate::calibration::least_squares::{System, minimise};
use crate::calibration::mu_i::mu_of_i;
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Amplitudes that are tried first; between the best of them a parabola.
const AMPLITUDES: [f64; 8] = [0.15, 0.3, 0.5, 0.75, 1.1, 1.6, 2.3, 3.3];
/// Flows below which no scatter between them is known.
const LEAST_FLOWS: usize = 4;
/// Largest ln of I_0 and of what μ_2 is above all friction seen: the law is a straight line long before.
const LARGEST: f64 = 4.0;

/// Both laws fitted to the same layers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FluidityFit {
    /// A.
    pub amplitude: f64,
    /// Where χ² is by ĉ more than at its least: 68 % of what layers scatter by. From 0 where the local law is no worse
    /// than that. Frictions that differ from flow to flow leave A up to a tenth too large, which the range does not know of.
    pub amplitude_range: [f64; 2],
    /// s: fluidity at the top of the base over the local one.
    pub base: f64,
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

/// What is fitted, in numbers that may take any value.
struct Problem<'a> {
    flows: Vec<&'a FluidityFlow>,
    /// σ_b/(I μ′(I)) of the layers, flow by flow.
    levers: Vec<Vec<f64>>,
    /// The largest μ of all nodes: μ_2 lies above, or a flow would have no steady state.
    largest: f64,
}

impl<'a> Problem<'a> {
    fn of(flows: Vec<&'a FluidityFlow>, levers: Vec<Vec<f64>>) -> Self {
        let nodes = flows.iter().flat_map(|f| &f.friction);
        Self {
            largest: nodes.fold(0.0, |a, b| f64::max(a, *b)),
            flows,
            levers,
        }
    }

    /// The flows that `keep` names.
    fn part(&self, keep: impl Fn(usize) -> bool) -> Self {
        let both = self.flows.iter().zip(&self.levers).enumerate();
        let kept = both.filter(|(k, _)| keep(*k));
        let (flows, levers) = kept.map(|(_, (f, l))| (*f, l.clone())).unzip();
        Self::of(flows, levers)
    }

    fn without(&self, flow: usize) -> Self {
        self.part(|k| k != flow)
    }

    fn only(&self, flow: usize) -> Self {
        self.part(|k| k == flow)
    }

    fn law(&self, [mu_s, above, i_0]: [f64; 3]) -> [f64; 3] {
        [mu_s, self.largest + above.exp(), i_0.exp()]
    }

    fn coordinates(&self, [mu_s, mu_2, i_0]: [f64; 3]) -> [f64; 3] {
        let within = |x: f64| x.ln().min(LARGEST - 0.1);
        [mu_s, within((mu_2 - self.largest).max(0.02)), within(i_0)]
    }

    fn residuals(&self, law: [f64; 3], amplitude: f64, base: f64) -> Vec<f64> {
        let mut all = Vec::new();
        for (flow, levers) in self.flows.iter().zip(&self.levers) {
            flow.residuals(&flow.predicted(law, amplitude, base), levers, &mut all);
        }
        all
    }

    /// Root-mean-square of ln I measured − predicted.
    fn rms(&self, law: [f64; 3], amplitude: f64, base: f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for flow in &self.flows {
            for (s, i) in flow.seen.iter().zip(flow.predicted(law, amplitude, base)) {
                sum += (s.inertial_number / i.max(1e-9 * s.inertial_number))
                    .ln()
                    .powi(2);
                count += 1.0;
            }
        }
        f64::sqrt(sum / count)
    }

    /// Least squares of the residuals from a start.
    fn fit<const N: usize>(
        &self,
        start: [f64; N],
        residuals: impl Fn(&[f64; N]) -> Vec<f64>,
    ) -> Option<([f64; N], f64)> {
        const H: f64 = 1e-5;
        let system = |p: &SVector<f64, N>| -> Option<System<N>> {
            let at: [f64; N] = (*p).into();
            // μ_2 and I_0 run away together where the data see the straight part of the law only.
            if at[0] < 0.0 || at[1] > LARGEST || at[2] > LARGEST {
                return None;
            }
            let here = residuals(&at);
            let columns: Vec<Vec<f64>> = (0..N)
                .map(|k| {
                    let [mut low, mut high] = [at, at];
                    low[k] -= H;
                    high[k] += H;
                    let pairs = residuals(&high).into_iter().zip(residuals(&low));
                    pairs.map(|(b, a)| (b - a) / (2.0 * H)).collect()
                })
                .collect();
            let mut normal = SMatrix::<f64, N, N>::zeros();
            let mut gradient = SVector::<f64, N>::zeros();
            for (row, r) in here.iter().enumerate() {
                let slope = SVector::<f64, N>::from_fn(|k, _| columns[k][row]);
                normal += slope * slope.transpose();
                gradient -= *r * slope;
            }
            let chi_square: f64 = here.iter().map(|r| r * r).sum();
            chi_square
                .is_finite()
                .then_some((normal, gradient, chi_square))
        };
        let (p, (_, _, chi_square)) = minimise(SVector::from(start), system)?;
        Some((p.into(), chi_square))
    }

    /// The law without a length.
    fn local(&self, start: [f64; 3]) -> Option<([f64; 3], f64)> {
        let (p, chi_square) = self.fit(self.coordinates(start), |p| {
            self.residuals(self.law(*p), 0.0, 1.0)
        })?;
        Some((self.law(p), chi_square))
    }

    /// The law with this length: (μ_s, μ_2, I_0), s and χ².
    fn with_length(
        &self,
        amplitude: f64,
        (law, base): ([f64; 3], f64),
    ) -> Option<([f64; 3], f64, f64)> {
        let [a, b, c] = self.coordinates(law);
        let of = |p: &[f64; 4]| {
            let mut all = self.residuals(self.law([p[0], p[1], p[2]]), amplitude, p[3].exp());
            // Where no layer feels the base, s stays where it is.
            all.push(1e-3 * p[3]);
            all
        };
        let (p, chi_square) = self.fit([a, b, c, base.max(1e-3).ln()], of)?;
        Some((self.law([p[0], p[1], p[2]]), p[3].exp(), chi_square))
    }
}

/// A tried amplitude: χ², (μ_s, μ_2, I_0) and s.
type Tried = (f64, f64, [f64; 3], f64);

/// χ² along A, from 0 on, and where it is least; each fit begins where the one before ended.
fn along(problem: &Problem, law: [f64; 3]) -> Option<(Vec<Tried>, usize)> {
    let (local, chi) = problem.local(law)?;
    let mut start = (local, 1.0);
    let mut tried = vec![(0.0, chi, local, 1.0)];
    for amplitude in AMPLITUDES {
        let Some((law, base, chi)) = problem.with_length(amplitude, start) else {
            continue;
        };
        start = (law, base);
        tried.push((amplitude, chi, law, base));
    }
    let least = |tried: &[Tried]| {
        let all = tried.iter().enumerate();
        all.min_by(|a, b| a.1.1.total_cmp(&b.1.1)).map(|(k, _)| k)
    };
    // Twice a parabola through the least and its neighbours.
    for _ in 0..2 {
        if tried.len() < 3 {
            break;
        }
        let k = least(&tried)?.clamp(1, tried.len() - 2);
        let Some(amplitude) = vertex([k - 1, k, k + 1].map(|k| (tried[k].0, tried[k].1))) else {
            break;
        };
        if let Some((law, base, chi)) = problem.with_length(amplitude, (tried[k].2, tried[k].3)) {
            tried.push((amplitude, chi, law, base));
            tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
    }
    let best = least(&tried)?;
    Some((tried, best))
}

/// Leaves each flow out of both fits.
fn foretold(problem: &Problem, law: [f64; 3]) -> Foretold {
    let mut gains = Vec::new();
    let (mut squares, mut points) = ([0.0; 2], 0.0);
    for k in 0..problem.flows.len() {
        let others = problem.without(k);
        let Some((tried, best)) = along(&others, law) else {
            continue;
        };
        let own = problem.only(k);
        let both = [&tried[0], &tried[best]].map(|(amplitude, _, law, base)| {
            // A flow that asks for more friction than the others' law can bear has no steady state by it.
            let bears = law[1] > own.largest;
            let chi = own.residuals(*law, *amplitude, *base);
            bears.then(|| {
                let chi: f64 = chi.iter().map(|r| r * r).sum();
                (chi, own.rms(*law, *amplitude, *base))
            })
        });
        let [Some(local), Some(with)] = both else {
            continue;
        };
        let n = own.flows[0].seen.len() as f64;
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
/// from which both begin and which says how friction moves I; `friction_scatter` is σ_b.
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
    let [mu_s, mu_2, i_0] = law;
    let lever = |s: &Seen| {
        let i = s.inertial_number;
        let rise = (mu_of_i(mu_s, mu_2, i_0, 1.01 * i) - mu_of_i(mu_s, mu_2, i_0, 0.99 * i)) / 0.02;
        friction_scatter / rise.abs().max(1e-6)
    };
    let levers = flows.iter().map(|f| f.seen.iter().map(lever).collect());
    let problem = Problem::of(flows.iter().collect(), levers.collect());
    let (tried, best) = along(&problem, law)?;
    let (_, local_chi, local, _) = tried[0];
    let (amplitude, chi, with, base) = tried[best];
    let points: usize = flows.iter().map(|f| f.seen.len()).sum();
    let parameters = [3.0, 5.0];
    let residuals = problem.residuals(with, amplitude, base);
    let scatter =
        (chi / (points as f64 - parameters[1]).max(1.0)).max(1.0) * neighbours(&residuals, flows);
    let effective = (points as f64 / scatter).max(flows.len() as f64);
    let criterion = [(local_chi, parameters[0]), (chi, parameters[1])].map(|(chi, k)| {
        let few = (effective - k - 1.0).max(1.0);
        chi / scatter + 2.0 * k + 2.0 * k * (k + 1.0) / few
    });
    Some(FluidityFit {
        amplitude,
        amplitude_range: range(&tried, best, scatter),
        base,
        law: with,
        local,
        chi_square: [local_chi, chi],
        rms: [
            problem.rms(local, 0.0, 1.0),
            problem.rms(with, amplitude, base),
        ],
        criterion,
        weight: 1.0 / (1.0 + (0.5 * (criterion[1] - criterion[0])).exp()),
        scatter,
        points,
        flows: flows.len(),
        left_out: foretold(&problem, law),
    })
}

/// Where the parabola through three points of rising x is least, if that lies between them and is none of them.
fn vertex([a, b, c]: [(f64, f64); 3]) -> Option<f64> {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let curvature = (right - left) / (c.0 - a.0);
    let x = 0.5 * (a.0 + b.0 - left / curvature);
    let apart = |y: f64| (x - y).abs() > 1e-3 * c.0;
    (curvature > 0.0 && x > a.0 && x < c.0 && apart(a.0) && apart(b.0) && apart(c.0)).then_some(x)
}

/// (1 + r)/(1 − r) for the correlation r of neighbouring layers' residuals; 1 where it is negative.
fn neighbours(residuals: &[f64], flows: &[FluidityFlow]) -> f64 {
    let (mut product, mut square, mut from) = (0.0, 0.0, 0);
    for flow in flows {
        let own = &residuals[from..from + flow.seen.len()];
        product += own.windows(2).map(|w| w[0] * w[1]).sum::<f64>();
        square += own[1..].iter().map(|r| r * r).sum::<f64>();
        from += flow.seen.len();
    }
    let r = (product / square.max(f64::MIN_POSITIVE)).clamp(0.0, 0.95);
    (1.0 + r) / (1.0 - r)
}

/// Amplitudes about the best where χ² has risen by ĉ, straight lines between those tried; the ends where it never does.
fn range(tried: &[Tried], best: usize, scatter: f64) -> [f64; 2] {
    let limit = tried[best].1 + scatter;
    let crossing = |inner: usize, outer: usize| {
        let (a, b) = (tried[inner], tried[outer]);
        a.0 + (b.0 - a.0) * ((limit - a.1) / (b.1 - a.1)).clamp(0.0, 1.0)
    };
    let below = (1..=best).rev().find(|k| tried[k - 1].1 > limit);
    let above = (best..tried.len() - 1).find(|k| tried[k + 1].1 > limit);
    [
        below.map_or(tried[0].0, |k| crossing(k, k - 1)),
        above.map_or(tried[tried.len() - 1].0, |k| crossing(k, k + 1)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_has_its_least_where_it_is() {
        let f = |x: f64| 3.0 + 2.0 * (x - 0.7) * (x - 0.7);
        let points = [0.4, 0.6, 1.1].map(|x| (x, f(x)));
        assert!((vertex(points).unwrap() - 0.7).abs() < 1e-12);
        assert_eq!(vertex([0.8, 0.9, 1.1].map(|x| (x, f(x)))), None);
        assert_eq!(vertex([0.4, 0.6, 1.1].map(|x| (x, -f(x)))), None);
    }
}
