//! Slopes and depths of flows together, at a given cost.
//!
//! In a steady flow down an incline I is the same through the depth, so a deeper one does not show more of the law: it shows
//! the same I in more layers, n = h/d − 7 (three at the base and four at the surface do not count), and its grains cost as
//! much more. What a flow has of its own, all its layers share. A flow of depth h, against one of full depth H for which
//! [`Precision`] stands, thus has the relative variances
//!
//! > relative² + layer² (1/n(h) − 1/n(H)),
//!
//! a friction that a local law does not know, (πA d/2h)² − (πA d/2H)², the length by which thin layers hold (Kamrin and Henann
//! 2015) and which counts as an error, and, below tan θ = μ_s + (πA d/2h)², no flow at all. Its cost is that of its grains and
//! those of the base; a depth other than the full one needs a bed that is settled for it. Too thin a flow wastes its cuts, too
//! deep a one pays for layers that all share one error: there is a best depth, and the design finds it with the slopes, D-optimal
//! at equal cost.

use super::{GuessedLaw, Precision, Prospect, choose_slopes, grid, information};
use nalgebra::Matrix3;
use std::f64::consts::PI;

/// A flow of a design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// Slope (degrees).
    pub slope_degrees: f64,
    /// Depth over the full one.
    pub depth: f64,
}

/// What depth does to a flow.
#[derive(Clone, Debug, PartialEq)]
pub struct Depths {
    /// Depths to choose from, over the full one; the full one is always a choice.
    pub choices: Vec<f64>,
    /// Full depth H (d).
    pub full: f64,
    /// Fixed grains of the base over free grains of a full bed.
    pub base: f64,
    /// Amplitude A of the length by which thin layers hold.
    pub amplitude: f64,
    /// Relative standard error of μ of one layer, as if layers were independent.
    pub layer_mu: f64,
    /// The same of I.
    pub layer_i: f64,
    /// Grain-steps of settling a bed over those of a flow on it.
    pub bed: f64,
}

/// Diameters at base and surface whose layers do not count.
const CUT: f64 = 7.0;
/// Fewest layers of a flow.
const FEWEST: f64 = 3.0;
/// Most flows of a design.
const MOST: usize = 60;

impl Depths {
    /// For beds of this depth (d) over a base of this share of their grains. Layers err by 2.3 % of μ and 6 % of I, correlation
    /// of neighbours included, and settling takes 0.7 of a flow's steps: measured in the campaign of moderate friction; A = 1:
    /// where thin layers of glass beads stop.
    pub fn new(choices: &[f64], full: f64, base: f64) -> Self {
        Self {
            choices: choices.to_vec(),
            full,
            base,
            amplitude: 1.0,
            layer_mu: 0.023,
            layer_i: 0.06,
            bed: 0.7,
        }
    }

    /// Layers that count.
    fn layers(&self, depth: f64) -> f64 {
        depth * self.full - CUT
    }

    /// (πA d/2h)².
    fn hold(&self, depth: f64) -> f64 {
        (0.5 * PI * self.amplitude / (depth * self.full)).powi(2)
    }

    /// Of a flow of this depth.
    fn precision(&self, precision: &Precision, depth: f64) -> Precision {
        let more = 1.0 / self.layers(depth) - 1.0 / self.layers(1.0);
        let of = |relative: f64, layer: f64| {
            // Even the deepest keeps what a flow has of its own, and that is not nothing.
            let variance = relative * relative + layer * layer * more;
            variance.max(0.25 * relative * relative).sqrt()
        };
        Precision {
            relative_mu: of(precision.relative_mu, self.layer_mu),
            relative_i: of(precision.relative_i, self.layer_i),
        }
    }

    /// Whether there is such a flow, with layers enough.
    fn allows(&self, law: &GuessedLaw, flow: &Flow) -> bool {
        let t = flow.slope_degrees.to_radians().tan();
        self.layers(flow.depth) >= FEWEST && t > law.mu_s + self.hold(flow.depth)
    }

    /// Grain-steps of a flow over those of a full one.
    fn of_flow(&self, depth: f64) -> f64 {
        (depth + self.base) / (1.0 + self.base)
    }

    fn information(&self, law: &GuessedLaw, precision: &Precision, flow: &Flow) -> Matrix3<f64> {
        let shift = self.hold(flow.depth) - self.hold(1.0);
        let precision = self.precision(precision, flow.depth);
        information(law, &precision, shift, flow.slope_degrees)
    }
}

/// Grain-steps of flows, in full flows: with the beds of depths other than the full one, which the searches need anyway.
pub fn cost(depths: &Depths, flows: &[Flow]) -> f64 {
    let mut others: Vec<f64> = flows.iter().map(|f| f.depth).collect();
    others.retain(|d| *d != 1.0);
    others.sort_by(f64::total_cmp);
    others.dedup();
    let beds: f64 = others.iter().map(|d| depths.bed * depths.of_flow(*d)).sum();
    beds + flows.iter().map(|f| depths.of_flow(f.depth)).sum::<f64>()
}

/// What flows of a design would say.
pub fn prospect_of_flows(
    law: &GuessedLaw,
    precision: &Precision,
    depths: &Depths,
    flows: &[Flow],
) -> Prospect {
    let of = |flow: &Flow| depths.information(law, precision, flow);
    Prospect::of(flows.iter().map(of).sum())
}

/// A search for the best design.
struct Search<'a> {
    law: &'a GuessedLaw,
    precision: &'a Precision,
    depths: &'a Depths,
    /// With what each would tell.
    candidates: Vec<(Flow, Matrix3<f64>)>,
    budget: f64,
    apart: f64,
}

impl Search<'_> {
    fn sum(&self, flows: &[Flow]) -> Matrix3<f64> {
        let of = |flow: &Flow| self.depths.information(self.law, self.precision, flow);
        flows.iter().map(of).sum()
    }

    /// The best of one more flow, if one is left that can be paid and keeps apart.
    fn with_one_more(&self, flows: &[Flow]) -> Option<Flow> {
        if flows.len() >= MOST {
            return None;
        }
        let sum = self.sum(flows);
        let spent = cost(self.depths, flows);
        let mut best: Option<(f64, Flow)> = None;
        for (flow, information) in &self.candidates {
            let own = self.depths.of_flow(flow.depth);
            let settled = flow.depth == 1.0 || flows.iter().any(|f| f.depth == flow.depth);
            let bed = if settled { 0.0 } else { self.depths.bed * own };
            let near = |f: &Flow| {
                let between = (f.slope_degrees - flow.slope_degrees).abs();
                f.depth == flow.depth && between < self.apart - 1e-9
            };
            if spent + bed + own > self.budget + 1e-9 || flows.iter().any(near) {
                continue;
            }
            // Fewer than three flows have no determinant yet: there the trace stands for it.
            let with = sum + information;
            let worth = if flows.len() < 2 {
                with.trace()
            } else {
                with.determinant()
            };
            if best.is_none_or(|(most, _)| worth > most) {
                best = Some((worth, *flow));
            }
        }
        best.map(|(_, flow)| flow)
    }

    fn filled(&self, mut flows: Vec<Flow>) -> Vec<Flow> {
        while let Some(next) = self.with_one_more(&flows) {
            flows.push(next);
        }
        flows
    }

    /// Takes out one flow, or two, and fills up again, until that does not help.
    fn improved(&self, start: Vec<Flow>) -> (f64, Vec<Flow>) {
        let mut flows = self.filled(start);
        let determinant = |flows: &[Flow]| Prospect::of(self.sum(flows)).determinant;
        let mut best = determinant(&flows);
        loop {
            let mut better = None;
            for a in 0..flows.len() {
                for b in a..flows.len() {
                    let keep = flows.iter().enumerate().filter(|(k, _)| *k != a && *k != b);
                    let trial = self.filled(keep.map(|(_, f)| *f).collect());
                    let worth = determinant(&trial);
                    if worth > best * (1.0 + 1e-9) {
                        (best, better) = (worth, Some(trial));
                    }
                }
            }
            match better {
                Some(next) => flows = next,
                None => return (best, flows),
            }
        }
    }
}

/// The D-optimal flows from `low` to `high` (degrees) and of the depths given whose cost is at most that of `budget` full
/// flows, those of one depth at least `apart`: by depth, the deepest first, and slope.
pub fn choose_flows(
    law: &GuessedLaw,
    precision: &Precision,
    depths: &Depths,
    range: [f64; 2],
    budget: usize,
    apart: f64,
) -> Vec<Flow> {
    let mut choices = depths.choices.clone();
    choices.push(1.0);
    choices.sort_by(f64::total_cmp);
    choices.dedup();
    let of_depth = |depth: f64, slopes: Vec<f64>| -> Vec<Flow> {
        let flow = |slope_degrees: f64| Flow {
            slope_degrees,
            depth,
        };
        slopes.into_iter().map(flow).collect()
    };
    let candidates = choices.iter().flat_map(|d| of_depth(*d, grid(range)));
    let search = Search {
        law,
        precision,
        depths,
        candidates: candidates
            .filter(|f| depths.allows(law, f))
            .map(|f| (f, depths.information(law, precision, &f)))
            .collect(),
        budget: budget as f64,
        apart,
    };
    // From slopes alone at each depth, as many as can be paid.
    let starts = choices.iter().map(|depth| {
        let bed = if *depth == 1.0 { 0.0 } else { depths.bed };
        let count = (budget as f64 / depths.of_flow(*depth) - bed + 1e-9) as usize;
        let own = depths.precision(precision, *depth);
        let slopes = choose_slopes(law, &own, range, count.min(MOST), apart);
        let flows = of_depth(*depth, slopes).into_iter();
        flows.filter(|f| depths.allows(law, f)).collect::<Vec<_>>()
    });
    let found = starts
        .map(|start| search.improved(start))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let mut flows = found.map_or(Vec::new(), |(_, flows)| flows);
    flows.sort_by(|a, b| {
        let by_slope = a.slope_degrees.total_cmp(&b.slope_degrees);
        b.depth.total_cmp(&a.depth).then(by_slope)
    });
    flows
}
