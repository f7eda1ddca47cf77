//! χ² of layers and of the frictions that are the flows' own, and its least.

use super::FluidityFlow;
use crate::calibration::least_squares::{System, minimise};
use nalgebra::{DMatrix, DVector, Dyn};

/// Largest ln of I_0 and of what μ_2 is above all friction seen: the law is a straight line long before.
const LARGEST: f64 = 4.0;
/// What χ² may still be above its least.
const ENOUGH: f64 = 1e-7;
/// Half of the difference that slopes are taken over.
const H: f64 = 1e-5;

/// What a fit has found, or begins with.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct State {
    /// (μ_s, μ_2, I_0).
    pub(super) law: [f64; 3],
    /// A; 0 is the local law.
    pub(super) amplitude: f64,
    /// s.
    pub(super) base: f64,
    /// b_k/σ_b of the flows.
    pub(super) own: Vec<f64>,
    /// χ².
    pub(super) chi_square: f64,
}

/// Which parameters move, besides the flows' own frictions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Free {
    /// None.
    Own,
    /// μ_s, μ_2, I_0.
    Law,
    /// These and s.
    Base,
    /// These and A.
    Amplitude,
}

impl Free {
    fn count(self) -> usize {
        match self {
            Free::Own => 0,
            Free::Law => 3,
            Free::Base => 4,
            Free::Amplitude => 5,
        }
    }
}

/// Layers of flows, and how far flows may lie off the law.
#[derive(Clone, Debug)]
pub(super) struct Problem<'a> {
    pub(super) flows: Vec<&'a FluidityFlow>,
    /// σ_b.
    scatter: f64,
    /// The largest μ of all nodes: μ_2 lies above, or a flow would have no steady state.
    pub(super) largest: f64,
}

impl<'a> Problem<'a> {
    pub(super) fn of(flows: Vec<&'a FluidityFlow>, scatter: f64) -> Self {
        let nodes = flows.iter().flat_map(|f| &f.friction);
        Self {
            largest: nodes.fold(0.0, |a, b| f64::max(a, *b)),
            flows,
            scatter,
        }
    }

    pub(super) fn without(&self, flow: usize) -> Self {
        let kept = self.flows.iter().enumerate().filter(|(k, _)| *k != flow);
        Self::of(kept.map(|(_, f)| *f).collect(), self.scatter)
    }

    pub(super) fn only(&self, flow: usize) -> Self {
        Self::of(vec![self.flows[flow]], self.scatter)
    }

    /// Layers that are compared.
    pub(super) fn points(&self) -> usize {
        self.flows.iter().map(|f| f.seen.len()).sum()
    }

    /// A law, a length and a base, with no friction of the flows' own.
    pub(super) fn state(&self, law: [f64; 3], amplitude: f64, base: f64) -> State {
        State {
            law,
            amplitude,
            base,
            own: vec![0.0; self.flows.len()],
            chi_square: f64::INFINITY,
        }
    }

    /// What is fitted, in numbers that may take any value.
    fn coordinates(&self, state: &State, free: Free) -> DVector<f64> {
        let within = |x: f64| x.ln().min(LARGEST - 0.1);
        let [mu_s, mu_2, i_0] = state.law;
        let all = [
            mu_s,
            within((mu_2 - self.largest).max(0.02)),
            within(i_0),
            state.base.max(1e-3).ln(),
            state.amplitude.max(1e-3).ln(),
        ];
        let moving = all[..free.count()].iter().chain(&state.own);
        DVector::from_vec(moving.copied().collect())
    }

    fn at(&self, p: &DVector<f64>, from: &State, free: Free) -> State {
        let count = free.count();
        let mut state = from.clone();
        if count >= 3 {
            state.law = [p[0], self.largest + p[1].exp(), p[2].exp()];
        }
        if count >= 4 {
            state.base = p[3].exp();
        }
        if count >= 5 {
            state.amplitude = p[4].exp();
        }
        state.own = p.iter().skip(count).copied().collect();
        state
    }

    /// Residuals of the layers of one flow, in their errors.
    fn residuals_of(&self, flow: usize, state: &State) -> Vec<f64> {
        let own = self.scatter * state.own[flow];
        let flow = self.flows[flow];
        let misses = flow.misses(state.law, state.amplitude, state.base, own);
        let rows = misses.iter().zip(&flow.seen);
        rows.map(|(miss, s)| miss / s.relative_error).collect()
    }

    /// Residuals of the layers, flow by flow.
    pub(super) fn residuals(&self, state: &State) -> Vec<Vec<f64>> {
        let flows = 0..self.flows.len();
        flows.map(|k| self.residuals_of(k, state)).collect()
    }

    /// Root-mean-square of ln I measured − predicted, by the law and nothing of the flow's own.
    pub(super) fn rms(&self, state: &State) -> f64 {
        let all = self
            .flows
            .iter()
            .flat_map(|f| f.misses(state.law, state.amplitude, state.base, 0.0));
        let squares: f64 = all.map(|miss| miss * miss).sum();
        f64::sqrt(squares / self.points() as f64)
    }

    /// JᵀJ, −Jᵀr and χ² at some parameters.
    fn system(&self, p: &DVector<f64>, from: &State, free: Free) -> Option<System<Dyn>> {
        let globals = free.count();
        // μ_2 and I_0 run away together where the data see the straight part of the law only.
        if globals >= 3 && (p[0] < 0.0 || p[1] > LARGEST || p[2] > LARGEST) {
            return None;
        }
        let mut normal = DMatrix::zeros(p.len(), p.len());
        let mut gradient = DVector::zeros(p.len());
        let mut chi_square = 0.0;
        let here = self.at(p, from, free);
        for flow in 0..self.flows.len() {
            // A flow knows what all share, and what is its own.
            let moving: Vec<usize> = (0..globals).chain([globals + flow]).collect();
            let residuals = self.residuals_of(flow, &here);
            let columns: Vec<Vec<f64>> = moving
                .iter()
                .map(|&k| {
                    let shifted = |by: f64| {
                        let mut q = p.clone();
                        q[k] += by;
                        self.residuals_of(flow, &self.at(&q, from, free))
                    };
                    let pairs = shifted(H).into_iter().zip(shifted(-H));
                    pairs.map(|(b, a)| (b - a) / (2.0 * H)).collect()
                })
                .collect();
            for (a, left) in moving.iter().zip(&columns) {
                for (b, right) in moving.iter().zip(&columns) {
                    normal[(*a, *b)] += left.iter().zip(right).map(|(x, y)| x * y).sum::<f64>();
                }
                gradient[*a] -= left.iter().zip(&residuals).map(|(x, y)| x * y).sum::<f64>();
            }
            chi_square += residuals.iter().map(|r| r * r).sum::<f64>();
            let own = p[globals + flow];
            normal[(globals + flow, globals + flow)] += 1.0;
            gradient[globals + flow] -= own;
            chi_square += own * own;
        }
        if globals >= 4 {
            // Where no layer feels the base, or s is as good as 0, it stays where it is.
            normal[(3, 3)] += 1e-6;
        }
        chi_square
            .is_finite()
            .then_some((normal, gradient, chi_square))
    }

    /// The least χ² from a start on.
    pub(super) fn fit(&self, start: &State, free: Free) -> Option<State> {
        let from = self.coordinates(start, free);
        let (p, (_, _, chi_square)) = minimise(from, ENOUGH, |p| self.system(p, start, free))?;
        Some(State {
            chi_square,
            ..self.at(&p, start, free)
        })
    }
}
