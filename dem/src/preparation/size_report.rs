//! The sizes that came out against the law asked for.

use super::sizes::{NumberLaw, SizeLaw, Weight};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A number asked for and the one achieved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// What the law says.
    pub asked: f64,
    /// What came out.
    pub achieved: f64,
}

/// How well drawn radii follow their law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeReport {
    /// Grains drawn.
    pub grains: usize,
    /// Volume of the spheres (m³).
    pub volume: f64,
    /// Mean radius by number (m).
    pub mean: Compared,
    /// Mean radius by mass, `⟨r⁴⟩/⟨r³⟩` (m).
    pub mean_by_mass: Compared,
    /// Radii below which 10, 50 and 90 % of the number lie (m).
    pub percentiles: [Compared; 3],
    /// Radii below which 10, 50 and 90 % of the mass lie (m).
    pub percentiles_by_mass: [Compared; 3],
    /// Kolmogorov distance: largest difference of the two cumulative shares by number.
    pub distance: f64,
    /// The distance that chance exceeds in 5 % of samples of this size, `1.36/√n`.
    pub distance_of_chance: f64,
}

const SHARES: [f64; 3] = [0.1, 0.5, 0.9];

impl SizeReport {
    /// Compares radii (m) with their law.
    pub fn of(law: &SizeLaw, radii: &[f64]) -> SizeReport {
        let asked = Cumulative::of(law);
        let mut sorted = radii.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len() as f64;
        let points = sorted.iter().map(|&r| [r, 1.0 / n]).collect();
        let achieved = Cumulative::stepped(points);
        let compare = |f: &dyn Fn(&Cumulative) -> f64| Compared {
            asked: f(&asked),
            achieved: f(&achieved),
        };
        let percentiles =
            |weight| SHARES.map(|share| compare(&|c: &Cumulative| c.quantile(share, weight)));
        SizeReport {
            grains: radii.len(),
            volume: radii.iter().map(|r| ball_volume(*r)).sum(),
            mean: compare(&|c| c.mean(Weight::Number)),
            mean_by_mass: compare(&|c| c.mean(Weight::Mass)),
            percentiles: percentiles(Weight::Number),
            percentiles_by_mass: percentiles(Weight::Mass),
            distance: asked.distance(&sorted),
            distance_of_chance: 1.36 / n.sqrt(),
        }
    }
}

/// Volume of a ball (m³).
pub(super) fn ball_volume(radius: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * radius.powi(3)
}

impl fmt::Display for SizeReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let pair = |c: &Compared| format!("{:.4e} ({:.4e})", c.achieved, c.asked);
        let three = |c: &[Compared; 3]| c.each_ref().map(pair).join(", ");
        writeln!(
            f,
            "{} grains, radii in m, asked for in brackets",
            self.grains
        )?;
        writeln!(
            f,
            "mean by number {}, by mass {}",
            pair(&self.mean),
            pair(&self.mean_by_mass)
        )?;
        writeln!(
            f,
            "10, 50, 90 % by number: {}; by mass: {}",
            three(&self.percentiles),
            three(&self.percentiles_by_mass)
        )?;
        write!(
            f,
            "Kolmogorov distance {:.4}, by chance up to {:.4}",
            self.distance, self.distance_of_chance
        )
    }
}

/// Shares below a radius by number and by mass; jumps at radii, or straight between them.
pub(super) struct Cumulative {
    radii: Vec<f64>,
    number: Vec<f64>,
    mass: Vec<f64>,
    /// Means by number and by mass (m).
    means: [f64; 2],
    jumps: bool,
}

/// Intervals of a tabulated density; Simpson's rule in ln r leaves 1e-10 of the moments.
const INTERVALS: usize = 2048;

impl Cumulative {
    pub fn of(law: &SizeLaw) -> Cumulative {
        let ends = (law.smallest(), law.largest());
        match law.by_number() {
            NumberLaw::Points(points) => Cumulative::stepped(points),
            density => Cumulative::smooth(ends, |r| density.density(r)),
        }
    }

    /// Radii in rising order with their shares.
    fn stepped(points: Vec<[f64; 2]>) -> Cumulative {
        let radii: Vec<f64> = points.iter().map(|p| p[0]).collect();
        let moment = |k: i32| points.iter().map(move |[r, share]| share * r.powi(k));
        let mass: f64 = moment(3).sum();
        let means = [
            moment(1).sum::<f64>() / moment(0).sum::<f64>(),
            moment(4).sum::<f64>() / mass,
        ];
        Cumulative {
            number: running(moment(0)),
            mass: running(moment(3)),
            radii,
            means,
            jumps: true,
        }
    }

    /// A number density between two radii.
    fn smooth((low, high): (f64, f64), density: impl Fn(f64) -> f64) -> Cumulative {
        let width = (high / low).ln() / INTERVALS as f64;
        let at = |k: f64| low * (width * k).exp();
        let piece = |k: usize, power: i32| {
            let f = |k: f64| density(at(k)) * at(k).powi(power + 1);
            let k = k as f64;
            (f(k) + 4.0 * f(k + 0.5) + f(k + 1.0)) * width / 6.0
        };
        let pieces = |power| (0..INTERVALS).map(move |k| (k, power));
        let sum = |power| pieces(power).map(|(k, p)| piece(k, p)).sum::<f64>();
        let from_zero = |power| {
            let mut running = running(pieces(power).map(|(k, p)| piece(k, p)));
            running.insert(0, 0.0);
            running
        };
        let mut radii: Vec<f64> = (0..=INTERVALS).map(|k| at(k as f64)).collect();
        radii[INTERVALS] = high;
        Cumulative {
            number: from_zero(0),
            mass: from_zero(3),
            radii,
            means: [sum(1) / sum(0), sum(4) / sum(3)],
            jumps: false,
        }
    }

    /// Mean radius (m).
    pub fn mean(&self, weight: Weight) -> f64 {
        self.means[usize::from(weight == Weight::Mass)]
    }

    /// Radius below which a share lies (m).
    fn quantile(&self, share: f64, weight: Weight) -> f64 {
        let below = match weight {
            Weight::Number => &self.number,
            Weight::Mass => &self.mass,
        };
        let Some(last) = self.radii.len().checked_sub(1) else {
            return f64::NAN;
        };
        let k = below.partition_point(|&b| b < share).min(last);
        if self.jumps || k == 0 {
            return self.radii[k];
        }
        let part = (share - below[k - 1]) / (below[k] - below[k - 1]);
        self.radii[k - 1] + part * (self.radii[k] - self.radii[k - 1])
    }

    /// Shares by number below a radius, without and with the radius itself.
    fn below(&self, r: f64) -> [f64; 2] {
        let share = |count: usize| count.checked_sub(1).map_or(0.0, |k| self.number[k]);
        // Radii that differ by round-off only are the same.
        let hair = 1e-12 * r;
        let before = self.radii.partition_point(|&x| x < r - hair);
        if self.jumps {
            let with = self.radii.partition_point(|&x| x <= r + hair);
            return [share(before), share(with)];
        }
        let k = before.clamp(1, self.radii.len() - 1);
        let part = (r - self.radii[k - 1]) / (self.radii[k] - self.radii[k - 1]);
        let at = self.number[k - 1] + part.clamp(0.0, 1.0) * (self.number[k] - self.number[k - 1]);
        [at, at]
    }

    /// Largest difference to the shares of a sorted sample.
    fn distance(&self, sorted: &[f64]) -> f64 {
        let n = sorted.len() as f64;
        let mut farthest: f64 = 0.0;
        let mut from = 0;
        while from < sorted.len() {
            let r = sorted[from];
            let to = from + sorted[from..].partition_point(|&x| x <= r);
            let [before, with] = self.below(r);
            farthest = farthest
                .max((from as f64 / n - before).abs())
                .max((to as f64 / n - with).abs());
            from = to;
        }
        farthest
    }
}

/// Sums so far over the whole sum.
fn running(terms: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums: Vec<f64> = terms
        .map(|t| {
            sum += t;
            sum
        })
        .collect();
    sums.iter_mut().for_each(|s| *s /= sum);
    sums
}

#[cfg(test)]
mod tests {
    use super::super::RadiusLaw;
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn laws() -> Vec<RadiusLaw> {
        vec![
            RadiusLaw::Gaussian {
                mean: 1.0,
                relative_deviation: 0.3,
                cut: 1.0,
            },
            RadiusLaw::Uniform {
                low: 1.0,
                high: 3.0,
            },
            RadiusLaw::PowerLaw {
                smallest: 1.0,
                largest: 10.0,
                index: 2.5,
            },
            RadiusLaw::BinnedPowerLaw {
                smallest: 1.0,
                largest: 2.0,
                index: 2.5,
                bins: 8,
            },
            RadiusLaw::List {
                radii: vec![1.0, 5.0, 2.0],
                shares: vec![0.5, 0.1, 0.4],
            },
        ]
    }

    #[test]
    fn a_sample_of_its_own_law_is_close_and_one_of_another_law_is_far() {
        for radius in laws() {
            for weight in [Weight::Number, Weight::Mass] {
                let law = SizeLaw {
                    radius: radius.clone(),
                    weight,
                };
                let mut random = ChaCha8Rng::seed_from_u64(5);
                let radii: Vec<f64> = (0..20_000).map(|_| law.draw(&mut random)).collect();
                let report = SizeReport::of(&law, &radii);
                assert!(
                    report.distance < report.distance_of_chance,
                    "{law:?} {report}"
                );
                let off = report.mean.achieved / report.mean.asked - 1.0;
                assert!(off.abs() < 0.02, "{law:?} {report}");
                let other = SizeLaw {
                    weight: match weight {
                        Weight::Number => Weight::Mass,
                        Weight::Mass => Weight::Number,
                    },
                    ..law
                };
                let wrong = SizeReport::of(&other, &radii);
                assert!(wrong.distance > 5.0 * wrong.distance_of_chance, "{wrong}");
            }
        }
    }

    #[test]
    fn percentiles_of_a_uniform_law_are_exact() {
        let law: SizeLaw = RadiusLaw::Uniform {
            low: 1.0,
            high: 3.0,
        }
        .into();
        let report = SizeReport::of(&law, &[1.0, 2.0, 3.0]);
        let [low, half, high] = report.percentiles.map(|p| p.asked);
        assert!((low - 1.2).abs() < 1e-6 && (half - 2.0).abs() < 1e-6 && (high - 2.8).abs() < 1e-6);
        // By mass: (r⁴ - 1)/80 = 1/2.
        let by_mass = report.percentiles_by_mass[1].asked;
        assert!((by_mass - 41.0_f64.powf(0.25)).abs() < 1e-5);
        // The sample jumps at 1, 2 and 3: its largest difference is at either end, 1/3.
        assert!((report.distance - 1.0 / 3.0).abs() < 1e-9);
    }
}
