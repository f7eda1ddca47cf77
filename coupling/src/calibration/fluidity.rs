//! Non-local fluidity beside the local law, on profiles through the depth.
//!
//! The granular fluidity g = γ̇/μ (1/s) of a steady flow obeys
//!
//! > ξ² ∇²g = g − g_loc(μ, p),   ξ(μ) = A d √((μ_2 − μ)/((μ_2 − μ_s)|μ − μ_s|)),
//!
//! with g_loc = I_loc(μ) √(p/ρ_s)/(μ d) and I_loc the inverse of μ(I), 0 up to μ_s (Kamrin and Henann, Soft Matter 11 (2015)
//! 179; near μ_s, ξ = A d/√|μ − μ_s|). A = 0 is the local law. On an incline the stress is known: μ is what momentum asks, a
//! straight line through the bulk, and p is measured. g then follows through the whole depth, with no flux through the
//! surface and with s g_loc at the top of the base, s one number for all flows: 0 where the base holds grains fast, 1 where it is
//! as the flow itself.
//!
//! *Comparison.* Both laws predict I of the same layers from the same stress. The residuals are of ln I. Layers err each for
//! itself, and each flow k has an offset b_k of friction of its own (standard deviation σ_b, what flows scatter by about the law): the law
//! is taken at μ + b_k, through the whole depth, and b_k is fitted together with everything else,
//!
//! > χ² = Σ_k [Σ_j (ln I_kj − ln I(z_j; μ + b_k))²/ε_kj² + (b_k/σ_b)²].
//!
//! To linearise it, as a covariance of the layers made with I μ′(I) of the local law, is not enough: near the base, where g is
//! not g_loc, that moves the wrong layers, and A came out a tenth too large. The parameters are μ_s, μ_2, I_0, and A, s with the
//! length; the rest is QAICc as for the other laws, its scatter ĉ widened by (1 + r)/(1 − r) where neighbouring layers' residuals
//! correlate by r > 0. The range of A is where χ², least over all else, has risen by ĉ (68 %) and 3.84 ĉ (95 %). Where layers
//! hang together so much that a flow is hardly more than one datum, the criterion has no more to say, and what counts is
//! foretelling: each flow in turn is left out of both fits, and D, the logarithm of its χ² without over that with the length, is
//! compared with its scatter from flow to flow.

mod fit;
mod problem;

pub use fit::{FluidityFit, Foretold, fit_fluidity};

use super::points::LocalPoint;
use super::prediction::inertial_number;
use crate::coarse_graining::Profile;

/// Nodes of the fluidity in a layer's thickness.
const NODES: usize = 4;
/// Least relative error of I: what thin slices of a steady flow differ by for other reasons than chance.
const LEAST_ERROR: f64 = 0.01;
/// A layer of a flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidityLayer {
    /// Middle of the layer above the base (m).
    pub z: f64,
    /// What momentum asks of |τ|/p; read of the bulk's layers only.
    pub friction: f64,
    /// p/ρ_s [m²/s²].
    pub pressure_over_density: f64,
    /// I and its standard error, of the layers that are compared: those of the bulk.
    pub inertial_number: Option<(f64, f64)>,
}

/// One layer that is compared.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    node: usize,
    inertial_number: f64,
    relative_error: f64,
}

/// A flow as both laws are to predict it; lengths in diameters.
#[derive(Clone, Debug, PartialEq)]
pub struct FluidityFlow {
    step: f64,
    /// μ at the nodes, from the base to the surface.
    friction: Vec<f64>,
    /// √(p/ρ_s) there [m/s].
    speed: Vec<f64>,
    seen: Vec<Seen>,
}

impl FluidityFlow {
    /// A flow of equal layers of this thickness from the base up to its surface (m); `None` with fewer than three layers to
    /// compare.
    pub fn new(layers: &[FluidityLayer], thickness: f64, diameter: f64) -> Option<Self> {
        let bulk: Vec<&FluidityLayer> = layers
            .iter()
            .filter(|l| l.inertial_number.is_some())
            .collect();
        let (first, last) = (bulk.first()?, bulk.last()?);
        if bulk.len() < 3 {
            return None;
        }
        let n = bulk.len() as f64;
        let mean = |of: &dyn Fn(&FluidityLayer) -> f64| bulk.iter().map(|l| of(l)).sum::<f64>() / n;
        let (z_mean, mu_mean) = (mean(&|l| l.z), mean(&|l| l.friction));
        let rise =
            mean(&|l| (l.z - z_mean) * (l.friction - mu_mean)) / mean(&|l| (l.z - z_mean).powi(2));
        let step = thickness / NODES as f64;
        let count = layers.len() * NODES;
        let least = 1e-9
            * layers
                .iter()
                .map(|l| l.pressure_over_density)
                .fold(0.0, f64::max);
        // Between middles of layers as a straight line.
        let pressure = |z: f64| {
            let right = layers
                .partition_point(|l| l.z < z)
                .clamp(1, layers.len() - 1);
            let (a, b) = (&layers[right - 1], &layers[right]);
            let share = ((z - a.z) / (b.z - a.z)).clamp(0.0, 1.0);
            a.pressure_over_density + share * (b.pressure_over_density - a.pressure_over_density)
        };
        let heights = (0..=count).map(|k| k as f64 * step);
        let flow = Self {
            step: step / diameter,
            friction: heights
                .clone()
                .map(|z| mu_mean + rise * (z.clamp(first.z, last.z) - z_mean))
                .collect(),
            speed: heights.map(|z| pressure(z).max(least).sqrt()).collect(),
            seen: bulk
                .iter()
                .filter_map(|l| {
                    let (i, error) = l.inertial_number?;
                    Some(Seen {
                        node: (l.z / step).round() as usize,
                        inertial_number: i,
                        relative_error: (error / i).hypot(LEAST_ERROR),
                    })
                })
                .collect(),
        };
        let sound = flow.friction.iter().all(|mu| *mu > 0.0)
            && flow.speed.iter().all(|v| *v > 0.0 && v.is_finite())
            && flow
                .seen
                .iter()
                .all(|s| s.node <= count && s.inertial_number > 0.0);
        sound.then_some(flow)
    }

    /// Of a flow's profile up to its height (m); `None` where momentum was not booked.
    pub fn of(
        profile: &Profile,
        points: &[LocalPoint],
        height: f64,
        diameter: f64,
        grain_density: f64,
    ) -> Option<Self> {
        let layers = profile
            .rows
            .iter()
            .filter(|row| row.z > 0.0 && row.z < height)
            .map(|row| {
                let compared = points.iter().find(|p| p.z == row.z);
                let friction = match compared {
                    Some(_) => row.mu_zz_balance? * row.sigma_zz.value / row.p.value,
                    None => 0.0,
                };
                Some(FluidityLayer {
                    z: row.z,
                    friction,
                    pressure_over_density: row.p.value / grain_density,
                    inertial_number: compared.map(|p| (p.inertial_number, p.inertial_number_error)),
                })
            })
            .collect::<Option<Vec<_>>>()?;
        Self::new(&layers, profile.layer, diameter)
    }

    /// g d at the nodes [m/s], with `own` added to the friction that momentum asks.
    fn fluidity(&self, law: [f64; 3], amplitude: f64, base: f64, own: f64) -> Vec<f64> {
        let [mu_s, mu_2, _] = law;
        let nodes = self.friction.iter().zip(&self.speed);
        let local: Vec<f64> = nodes
            .map(|(mu, speed)| inertial_number(law, mu + own) * speed / (mu + own))
            .collect();
        if amplitude <= 0.0 {
            return local;
        }
        // A² g″ = q (g − g_loc), q = A²/ξ² in diameters; three unknowns a row, from the base on.
        let across = (amplitude / self.step).powi(2);
        let last = local.len() - 1;
        let mut fluidity = local.clone();
        fluidity[0] = base * local[0];
        let (mut upper, mut right) = (vec![0.0; last + 1], vec![0.0; last + 1]);
        right[0] = fluidity[0];
        for k in 1..=last {
            let mu = self.friction[k] + own;
            let q = (mu_2 - mu_s) * (mu - mu_s).abs() / (mu_2 - mu);
            // No flux through the surface: what lies beyond is its mirror image.
            let (below, above) = if k == last {
                (2.0 * across, 0.0)
            } else {
                (across, across)
            };
            let pivot = 2.0 * across + q - below * upper[k - 1];
            upper[k] = above / pivot;
            right[k] = (q * local[k] + below * right[k - 1]) / pivot;
        }
        fluidity[last] = right[last];
        for k in (1..last).rev() {
            fluidity[k] = right[k] + upper[k] * fluidity[k + 1];
        }
        fluidity
    }

    /// I of the layers that are compared; `base` is s, `own` the friction that the flow has beyond the law (b).
    pub fn predicted(&self, law: [f64; 3], amplitude: f64, base: f64, own: f64) -> Vec<f64> {
        let fluidity = self.fluidity(law, amplitude, base, own);
        let of = |s: &Seen| fluidity[s.node] * (self.friction[s.node] + own) / self.speed[s.node];
        self.seen.iter().map(of).collect()
    }

    /// ln I measured − predicted.
    fn misses(&self, law: [f64; 3], amplitude: f64, base: f64, own: f64) -> Vec<f64> {
        let predicted = self.predicted(law, amplitude, base, own);
        let rows = self.seen.iter().zip(predicted);
        // A law under which the layer rests is as far off as numbers go.
        rows.map(|(s, i)| (s.inertial_number / i.max(1e-9 * s.inertial_number)).ln())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform stress: g = g_loc (1 + (s − 1) cosh((h − z)/ξ)/cosh(h/ξ)).
    #[test]
    fn fluidity_under_uniform_stress_is_the_exact_one_to_second_order() {
        let law = [0.5, 0.9, 0.3];
        let (mu, amplitude, base, height) = (0.6, 0.48, 0.2, 20.0);
        let xi = amplitude * f64::sqrt((law[1] - mu) / ((law[1] - law[0]) * (mu - law[0])));
        let i = inertial_number(law, mu);
        let error = |thickness: f64| {
            let count = (height / thickness) as usize;
            let layers: Vec<FluidityLayer> = (0..count)
                .map(|k| FluidityLayer {
                    z: 0.01 * thickness * (k as f64 + 0.5),
                    friction: mu,
                    pressure_over_density: 2.0,
                    inertial_number: Some((0.3, 0.01)),
                })
                .collect();
            let flow = FluidityFlow::new(&layers, 0.01 * thickness, 0.01).unwrap();
            let found = flow.predicted(law, amplitude, base, 0.0);
            let misses = found.iter().enumerate().map(|(k, found)| {
                let z = thickness * (k as f64 + 0.5);
                let exact =
                    i * (1.0 + (base - 1.0) * ((height - z) / xi).cosh() / (height / xi).cosh());
                (found / exact - 1.0).abs()
            });
            misses.fold(0.0, f64::max)
        };
        let (coarse, fine) = (error(1.0), error(0.5));
        println!("worst relative error {coarse:.2e}, {fine:.2e} on half the spacing");
        assert!(coarse < 3e-3, "{coarse}");
        assert!((3.5..4.5).contains(&(coarse / fine)), "{coarse} {fine}");
    }
}
