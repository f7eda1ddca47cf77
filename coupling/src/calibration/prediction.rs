//! What a law says of flows that it was not fitted to.
//!
//! A flow gains speed across its bulk: S = ⟨u − u_foot⟩ over the layers that give points, u_foot the velocity of the
//! lowest of them, so that slip and the layered foot of the flow stay out of it. A law makes of the stress ratio that
//! momentum asks of the bulk (tan θ, less what accelerates the flow) an inertial number, and of that strain rates and S. The stress is not tan θ where the flow is not steady: u ∝ I has a long lever, a per cent of friction moves it by
//! 4–8 %.
//!
//! *Discrepancy.* Flows scatter about the law by more than their own errors: the law leaves things out. Of each flow,
//! m is the mean over its layers of μ asked − μ(I measured). The discrepancy of a flow to come is s_m t, with
//! s_m² = Σ m²/ν, ν = flows − 3 the degrees of freedom that three parameters leave, and t Student's with ν. The band of S
//! has both: each sample of the posterior, with a draw of the discrepancy taken from the stress ratio.
//!
//! *Test.* Each flow in turn is left out of fit, posterior and discrepancy alike, and its band is set beside what was
//! measured ([`left_out`]).

use super::mu_i::{MuIFit, Stress, fit_mu_i, mu_of_i};
use super::points::LocalPoint;
use super::posterior::{Posterior, sample_posterior};
use crate::coarse_graining::Profile;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StudentT};
use serde::{Deserialize, Serialize};

/// A layer of the bulk of a flow.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layer {
    /// Velocity [m/s].
    u: f64,
    inertial_number: f64,
    /// p/ρ_s [m²/s²], p = trace/3: what I is made with.
    pressure_over_density: f64,
    /// What momentum asks of |τ|/p and of |τ|/σ_zz.
    asked: [f64; 2],
}

/// The bulk of one flow, as a law is to predict it.
#[derive(Clone, Debug, PartialEq)]
pub struct BulkFlow {
    /// Slope (degrees).
    pub slope_degrees: f64,
    /// Its points.
    points: Vec<LocalPoint>,
    layers: Vec<Layer>,
    /// Thickness of a layer over the diameter.
    thickness: f64,
}

/// Which of a layer's two stress ratios belongs to a friction.
fn index(stress: Stress) -> usize {
    usize::from(stress != Stress::MeanPressure)
}

/// I at which the law has this friction: 0 up to μ_s, infinite from μ_2 on.
pub(crate) fn inertial_number([mu_s, mu_2, i_0]: [f64; 3], mu: f64) -> f64 {
    if mu <= mu_s {
        0.0
    } else if mu >= mu_2 {
        f64::INFINITY
    } else {
        i_0 * (mu - mu_s) / (mu_2 - mu)
    }
}

impl BulkFlow {
    /// The layers of a flow's points. `None` where they are fewer than three, or momentum was not booked.
    pub fn of(
        profile: &Profile,
        points: &[LocalPoint],
        diameter: f64,
        grain_density: f64,
    ) -> Option<BulkFlow> {
        let layers: Vec<Layer> = profile
            .rows
            .iter()
            .filter(|row| points.iter().any(|p| p.z == row.z))
            .map(|row| {
                let asked = row.mu_zz_balance?;
                Some(Layer {
                    u: row.u.value,
                    inertial_number: row.i?.value,
                    pressure_over_density: row.p.value / grain_density,
                    asked: [asked * row.sigma_zz.value / row.p.value, asked],
                })
            })
            .collect::<Option<_>>()?;
        (layers.len() >= 3 && layers.len() == points.len()).then(|| BulkFlow {
            slope_degrees: points[0].slope_degrees,
            points: points.to_vec(),
            layers,
            thickness: profile.layer / diameter,
        })
    }

    /// Mean stress ratio that momentum asks of the layers.
    pub fn asked(&self, stress: Stress) -> f64 {
        let all = self.layers.iter().map(|l| l.asked[index(stress)]);
        all.sum::<f64>() / self.layers.len() as f64
    }

    /// S as measured [m/s].
    pub fn gain(&self) -> f64 {
        let foot = self.layers[0].u;
        self.layers.iter().map(|l| l.u - foot).sum::<f64>() / self.layers.len() as f64
    }

    /// S by a law (μ_s, μ_2, I_0) whose friction is `more` higher than written, from the stress that momentum asks
    /// [m/s]; infinite where that is more than the law can bear. The stress ratio is the bulk's mean: I rises ever faster
    /// with μ, and what layers scatter by would make every flow faster.
    pub fn gain_by(&self, law: [f64; 3], stress: Stress, more: f64) -> f64 {
        let i = inertial_number(law, self.asked(stress) - more);
        if !i.is_finite() {
            return i;
        }
        let rates = self
            .layers
            .iter()
            .map(|l| i * l.pressure_over_density.max(0.0).sqrt() * self.thickness);
        let (mut u, mut sum, mut below) = (0.0, 0.0, None);
        for rate in rates {
            u += below.map_or(0.0, |b: f64| 0.5 * (b + rate));
            sum += u;
            below = Some(rate);
        }
        sum / self.layers.len() as f64
    }

    /// Mean over the layers of μ asked − μ(I measured).
    fn miss(&self, law: [f64; 3], stress: Stress) -> f64 {
        let [mu_s, mu_2, i_0] = law;
        let miss = |l: &Layer| l.asked[index(stress)] - mu_of_i(mu_s, mu_2, i_0, l.inertial_number);
        self.layers.iter().map(miss).sum::<f64>() / self.layers.len() as f64
    }
}

/// What flows scatter by about a law of their own, beyond what its parameters can take up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Discrepancy {
    /// s_m, in μ.
    pub friction: f64,
    /// ν, the degrees of freedom behind it.
    pub freedom: f64,
}

/// Parameters of a law.
const PARAMETERS: usize = 3;

impl Discrepancy {
    /// From the flows that a law was fitted to; `None` for three and fewer.
    pub fn of(flows: &[&BulkFlow], law: [f64; 3], stress: Stress) -> Option<Discrepancy> {
        let freedom = flows.len().checked_sub(PARAMETERS).filter(|n| *n > 0)? as f64;
        let squares: f64 = flows.iter().map(|f| f.miss(law, stress).powi(2)).sum();
        Some(Discrepancy {
            friction: (squares / freedom).sqrt(),
            freedom,
        })
    }
}

/// Quantiles 0.025, 0.16, 0.5, 0.84 and 0.975 of S [m/s] of a flow: posterior and, where it is given, discrepancy.
/// Samples that rest there give 0, those that cannot bear the stress the largest number there is.
pub fn band(
    flow: &BulkFlow,
    posterior: &Posterior,
    discrepancy: Option<Discrepancy>,
    stress: Stress,
    seed: u64,
) -> Option<[f64; 5]> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let student = match discrepancy {
        Some(d) => Some((d.friction, StudentT::new(d.freedom).ok()?)),
        None => None,
    };
    let mut gain = |law: &[f64; 3]| {
        let more = student
            .as_ref()
            .map_or(0.0, |(scale, t)| scale * t.sample(&mut rng));
        flow.gain_by(*law, stress, more).min(f64::MAX)
    };
    let values: Vec<f64> = posterior.samples.iter().map(&mut gain).collect();
    Posterior::quantiles_of(&values)
}

/// One flow beside a law that was fitted without it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Slope (degrees).
    pub slope_degrees: f64,
    /// Which friction the law describes.
    pub stress: Stress,
    /// What momentum asks of it, mean over the bulk.
    pub asked: f64,
    /// S of the grains [m/s].
    pub grains: f64,
    /// S by the law without the flow, over that of the grains.
    pub ratio: f64,
    /// Quantiles of S over that of the grains by the posterior alone.
    pub by_posterior: [f64; 5],
    /// The same with the discrepancy.
    pub band: [f64; 5],
    /// The discrepancy of the other flows.
    pub discrepancy: Discrepancy,
    /// S over that of the grains by the control: the law without the flow, with 5 % more friction.
    pub control: f64,
    /// Whether the stress asked lies within what the other flows' law was measured for.
    pub inside: bool,
}

/// How much more friction the control has, relative.
pub const CONTROL: f64 = 0.05;

impl LeftOut {
    /// Whether the grains lie within 68 and within 95 % of a band.
    fn within(band: &[f64; 5], truth: f64) -> [bool; 2] {
        [
            (band[1]..=band[3]).contains(&truth),
            (band[0]..=band[4]).contains(&truth),
        ]
    }

    /// Within 68 and 95 % of the band.
    pub fn covered(&self) -> [bool; 2] {
        Self::within(&self.band, 1.0)
    }

    /// Within 68 and 95 % of the posterior alone.
    pub fn covered_by_posterior(&self) -> [bool; 2] {
        Self::within(&self.by_posterior, 1.0)
    }

    /// The same for the control: the band moves with the law.
    pub fn control_covered(&self) -> [bool; 2] {
        let shift = if self.ratio > 0.0 && self.ratio.is_finite() {
            self.control / self.ratio
        } else {
            0.0
        };
        Self::within(&self.band.map(|b| b * shift), 1.0)
    }
}

/// Leaves each flow out in turn. Empty where fewer than five flows are left to tell a discrepancy from three parameters,
/// or where no law can be fitted to them.
pub fn left_out(flows: &[BulkFlow], stress: Stress, seed: u64) -> Vec<LeftOut> {
    if flows.len() < PARAMETERS + 2 {
        return Vec::new();
    }
    let one = |k: usize| {
        let flow = &flows[k];
        let others: Vec<&BulkFlow> = (0..flows.len())
            .filter(|j| *j != k)
            .map(|j| &flows[j])
            .collect();
        let points: Vec<LocalPoint> = others.iter().flat_map(|f| f.points.clone()).collect();
        let fit = fit_mu_i(&points, stress).ok().filter(|f| f.physical)?;
        let law = law_of(&fit);
        let posterior = sample_posterior(&points, &fit, seed)?;
        let discrepancy = Discrepancy::of(&others, law, stress)?;
        let grains = flow.gain();
        // What a law cannot bear is the largest number there is, over a slow flow too: files hold no infinity.
        let over_grains = |s: f64| (s / grains).min(f64::MAX);
        let relative = |b: [f64; 5]| b.map(over_grains);
        let asked = flow.asked(stress);
        let seen = fit.valid_i.map(|i| mu_of_i(law[0], law[1], law[2], i));
        let heavier = [law[0] * (1.0 + CONTROL), law[1] * (1.0 + CONTROL), law[2]];
        Some(LeftOut {
            slope_degrees: flow.slope_degrees,
            stress,
            asked,
            grains,
            ratio: over_grains(flow.gain_by(law, stress, 0.0)),
            by_posterior: relative(band(flow, &posterior, None, stress, seed)?),
            band: relative(band(flow, &posterior, Some(discrepancy), stress, seed)?),
            discrepancy,
            control: over_grains(flow.gain_by(heavier, stress, 0.0)),
            inside: (seen[0]..=seen[1]).contains(&asked),
        })
    };
    (0..flows.len()).filter_map(one).collect()
}

/// (μ_s, μ_2, I_0) of a fit.
pub fn law_of(fit: &MuIFit) -> [f64; 3] {
    [fit.mu_s, fit.mu_2, fit.i_0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_distr::StandardNormal;

    const LAW: [f64; 3] = [0.5, 0.9, 0.6];

    /// A flow that obeys the law with a friction of its own `more` higher, seen through noise.
    fn flow(slope: f64, more: f64, rng: &mut ChaCha8Rng) -> BulkFlow {
        let count = 14;
        let mut layers: Vec<Layer> = Vec::new();
        let mut points = Vec::new();
        let asked = slope.to_radians().tan();
        let mut u = 1.0;
        for k in 0..count {
            let pressure = 2.0 - 0.1 * f64::from(k);
            let truth = inertial_number(LAW, asked - more);
            if let Some(last) = layers.last() {
                let below = last.pressure_over_density.sqrt();
                u += 0.5 * truth * (below + pressure.sqrt());
            }
            let i = truth * (1.0 + 0.02 * rng.sample::<f64, _>(StandardNormal));
            layers.push(Layer {
                u,
                inertial_number: i,
                pressure_over_density: pressure,
                asked: [asked * 1.07, asked],
            });
            let mu = asked + 0.003 * rng.sample::<f64, _>(StandardNormal);
            points.push(LocalPoint {
                slope_degrees: slope,
                z: f64::from(k),
                inertial_number: i,
                inertial_number_error: 0.02 * truth,
                friction: 1.07 * mu,
                friction_error: 0.003,
                friction_zz: mu,
                friction_zz_error: 0.003,
                solid_fraction: 0.5,
                solid_fraction_error: 0.001,
            });
        }
        BulkFlow {
            slope_degrees: slope,
            points,
            layers,
            thickness: 1.0,
        }
    }

    #[test]
    fn bands_cover_flows_that_were_left_out_at_their_rate() {
        // Each flow has a friction of its own: what no parameter of the law can take up.
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (mut tried, mut plain, mut wide, mut wrong) = (0.0, [0.0; 2], [0.0; 2], 0.0);
        for round in 0..14 {
            let flows: Vec<BulkFlow> = (0..9)
                .map(|k| {
                    let own = 0.005 * rng.sample::<f64, _>(StandardNormal);
                    flow(29.0 + f64::from(k), own, &mut rng)
                })
                .collect();
            for out in left_out(&flows, Stress::NormalPressure, round) {
                tried += 1.0;
                for k in 0..2 {
                    plain[k] += f64::from(u8::from(out.covered_by_posterior()[k]));
                    wide[k] += f64::from(u8::from(out.covered()[k]));
                }
                wrong += f64::from(u8::from(out.control_covered()[1]));
            }
        }
        let share = |n: f64| n / tried;
        println!(
            "{tried} flows: posterior {:.2} {:.2}, with discrepancy {:.2} {:.2}, control {:.2}",
            share(plain[0]),
            share(plain[1]),
            share(wide[0]),
            share(wide[1]),
            share(wrong)
        );
        assert!(tried >= 120.0, "{tried}");
        // 126 trials of 0.68 and 0.95 scatter by 0.04 and 0.02.
        assert!((0.55..0.85).contains(&share(wide[0])), "{wide:?}");
        assert!((0.88..1.0).contains(&share(wide[1])), "{wide:?}");
        assert!(share(plain[0]) < 0.45, "{plain:?}");
        assert!(share(wrong) < 0.3, "{wrong}");
    }

    #[test]
    fn a_slow_flow_beyond_what_laws_can_bear_is_told_in_finite_numbers() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let flows: Vec<BulkFlow> = (0..6)
            .map(|k| {
                let own = 0.01 * rng.sample::<f64, _>(StandardNormal);
                let mut slow = flow(33.0 + 1.7 * f64::from(k), own, &mut rng);
                for layer in &mut slow.layers {
                    layer.u *= 1e-3;
                    layer.pressure_over_density *= 1e-6;
                }
                slow
            })
            .collect();
        let rows = left_out(&flows, Stress::NormalPressure, 1);
        let unbounded = |r: &LeftOut| r.by_posterior[4] > 1e300 || r.band[4] > 1e300;
        assert!(rows.iter().any(unbounded), "{rows:?}");
        for r in &rows {
            let all = [&r.by_posterior[..], &r.band[..], &[r.ratio, r.control]].concat();
            assert!(all.iter().all(|x| x.is_finite()), "{r:?}");
        }
    }

    #[test]
    fn a_law_gives_its_own_flow_back() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let own = flow(32.0, 0.0, &mut rng);
        let by = own.gain_by(LAW, Stress::NormalPressure, 0.0);
        assert!((by / own.gain() - 1.0).abs() < 1e-12);
        // |τ|/p is 7 % higher here: by the law of |τ|/σ_zz it would be more than that law can bear, or much faster.
        assert!(own.gain_by(LAW, Stress::MeanPressure, 0.0) > 1.2 * own.gain());
        assert_eq!(
            own.gain_by([0.7, 0.9, 0.6], Stress::NormalPressure, 0.0),
            0.0
        );
        assert!(
            own.gain_by([0.3, 0.6, 0.6], Stress::NormalPressure, 0.0)
                .is_infinite()
        );
        // Too few flows tell no discrepancy.
        let few: Vec<BulkFlow> = (0..4)
            .map(|k| flow(30.0 + f64::from(k), 0.0, &mut rng))
            .collect();
        assert!(left_out(&few, Stress::NormalPressure, 1).is_empty());
    }
}
