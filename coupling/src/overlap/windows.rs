//! Sizes of what has signs: means over patches and windows in time, of which only the sizes are summed.
//!
//! A patch is a layer of a flat edge or a cell of the others. Over a window of length T
//!
//! ```text
//! S = Σ_w Σ_j |∫ q_j dt| / Σ_w Σ_j ∫ M_j dt,
//! ```
//! q the slip of a patch times its mass M (kg m/s), or what goes through it (N) with M = 1: neither patches nor windows can cancel.
//!
//! Grains whose velocities have no mean but noise give a size, too. The sum of the momenta of independent grains, with weights h,
//! has the variance V = Σ (h m v′)² in a direction; the exchange lets a difference decay in a time τ, so that ⟨q(0) q(t)⟩ = V e^(−t/τ), and
//!
//! ```text
//! ⟨(∫ q dt)²⟩ = V T² f,    f = 2 (τ/T) [1 − (τ/T) (1 − e^(−T/τ))],
//! ```
//! the variance of the mean of an Ornstein–Uhlenbeck process. The mean size of a Gaussian vector with standard deviation σ along each of D axes
//! is c_D σ, c_D = √2 Γ((D + 1)/2)/Γ(D/2), which makes the floor c_D √(V T² f). Grains of dense flows move together, and V
//! takes them as independent: a size a few times the floor need not be a slip yet.

use super::joint::{over, towards};
use super::settings::Resolved;
use std::f64::consts::PI;

/// Windows are so many averaging times of the stresses: four in which the exchange lets a slip decay, with the defaults.
const AVERAGING_TIMES: f64 = 8.0;

/// What is summed.
#[derive(Clone, Copy, Debug)]
pub(super) enum Of {
    /// Continuum less grains at the handshake surface, times mass.
    Slip,
    /// The grains' velocity there, times mass.
    Flow,
    /// Impulse of the relaxation.
    Relaxation,
    /// Impulse of the traction.
    Traction,
}

/// Quantities.
const KINDS: usize = 4;

/// Integrals over the open window: three axes, M, V.
type Patch = [f64; 5];

/// Sums over windows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    /// Σ |∫ q dt|.
    pub size: f64,
    /// What noise alone would give.
    pub floor: f64,
    /// Σ ∫ M dt.
    pub weight: f64,
    /// Largest mean of one window.
    pub largest: f64,
}

impl Sum {
    /// Size of the mean.
    pub fn mean(&self) -> f64 {
        over(self.size, self.weight)
    }

    /// What noise alone would make it.
    pub fn noise(&self) -> f64 {
        over(self.floor, self.weight)
    }
}

/// Numbers of [`Sums`].
pub(super) const NUMBERS: usize = 4 * KINDS;

/// All of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums([Sum; KINDS]);

impl Sums {
    pub fn of(&self, kind: Of) -> Sum {
        self.0[kind as usize]
    }

    pub fn numbers(&self) -> [f64; NUMBERS] {
        let row = |s: &Sum| [s.size, s.floor, s.weight, s.largest];
        let rows = self.0.each_ref().map(row);
        std::array::from_fn(|n| rows[n / 4][n % 4])
    }

    pub fn from_numbers(n: &[f64; NUMBERS]) -> Self {
        Self(std::array::from_fn(|k| Sum {
            size: n[4 * k],
            floor: n[4 * k + 1],
            weight: n[4 * k + 2],
            largest: n[4 * k + 3],
        }))
    }
}

/// The window that is open.
#[derive(Clone, Debug)]
pub(super) struct Windows {
    /// Directions that q has.
    axes: usize,
    length: f64,
    relaxation: f64,
    memory: f64,
    passed: f64,
    patches: [Vec<Patch>; KINDS],
}

impl Windows {
    /// For q of so many directions, so many patches of slip and relaxation and of traction, with these times of the overlap.
    pub fn new(axes: usize, [patches, edge]: [usize; 2], times: &Resolved) -> Self {
        let none = |count| vec![[0.0; 5]; count];
        Self {
            axes,
            length: AVERAGING_TIMES * times.stress_time,
            relaxation: times.relaxation_time,
            memory: times.relaxation_time.max(times.following_time),
            passed: 0.0,
            patches: [none(patches), none(patches), none(patches), none(edge)],
        }
    }

    /// Nothing seen yet.
    pub fn clear(&mut self) {
        self.passed = 0.0;
        self.patches.iter_mut().for_each(|p| p.fill([0.0; 5]));
    }

    /// Adds q Δt of a patch, with M Δt and V Δt.
    pub fn add(&mut self, kind: Of, patch: usize, q: [f64; 3], [mass, variance]: [f64; 2]) {
        let sums = &mut self.patches[kind as usize][patch];
        let more = [q[0], q[1], q[2], mass, variance];
        sums.iter_mut()
            .zip(more)
            .for_each(|(sum, more)| *sum += more);
    }

    /// Adds the impulse of a patch's relaxation over Δt, V being the variance of the momentum that it acts on.
    pub fn relax(&mut self, patch: usize, impulse: [f64; 3], variance: f64, dt: f64) {
        let variance = towards(dt, self.relaxation).powi(2) * variance;
        self.add(Of::Relaxation, patch, impulse, [dt, variance * dt]);
    }

    /// So much time has passed (s); closes the window where it is over.
    pub fn pass(&mut self, time: f64, sums: &mut Sums) {
        self.passed += time;
        if self.passed >= self.length * (1.0 - 1e-9) {
            *sums = self.closed(sums);
            self.clear();
        }
    }

    /// Sums with the window as it is.
    pub fn closed(&self, sums: &Sums) -> Sums {
        let mean_size = [(2.0 / PI).sqrt(), (PI / 2.0).sqrt(), (8.0 / PI).sqrt()];
        let noise = mean_size[self.axes - 1] * (self.passed * self.remembered()).sqrt();
        let mut sums = *sums;
        for (sum, patches) in sums.0.iter_mut().zip(&self.patches) {
            let (mut size, mut weight) = (0.0, 0.0);
            for [x, y, z, mass, variance] in patches {
                size += (x * x + y * y + z * z).sqrt();
                weight += mass;
                sum.floor += noise * variance.sqrt();
            }
            sum.size += size;
            sum.weight += weight;
            sum.largest = sum.largest.max(over(size, weight));
        }
        sums
    }

    /// f.
    fn remembered(&self) -> f64 {
        if self.passed == 0.0 {
            return 1.0;
        }
        let part = self.memory / self.passed;
        2.0 * part * (1.0 + part * (-1.0 / part).exp_m1())
    }

    /// The open window in a row of numbers: patches with nothing in them are left out.
    pub fn numbers(&self) -> Vec<f64> {
        let mut row = vec![self.passed];
        for (kind, patches) in self.patches.iter().enumerate() {
            for (k, patch) in patches.iter().enumerate().filter(|(_, p)| **p != [0.0; 5]) {
                row.extend([kind as f64, k as f64]);
                row.extend(patch);
            }
        }
        row
    }

    /// Takes them up; nothing if they are not of such a window.
    pub fn take_up(&mut self, numbers: &[f64]) -> Option<()> {
        let (passed, rows) = numbers.split_first()?;
        let (rows, rest) = rows.as_chunks::<7>();
        self.clear();
        for &[kind, k, a, b, c, d, e] in rows {
            let patches = self.patches.get_mut(kind as usize)?;
            *patches.get_mut(k as usize)? = [a, b, c, d, e];
        }
        self.passed = *passed;
        rest.is_empty().then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::overlap::{OverlapSettings, Scales};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const MEMORY: f64 = 1.0;
    const DT: f64 = 0.2;

    fn times(averaging: f64) -> Resolved {
        let settings = OverlapSettings {
            stress_time: Some(averaging),
            ..OverlapSettings::default()
        };
        let scales = Scales {
            diameter: 1.0,
            time: MEMORY,
            density: 0.6,
            stiffness: 1e4,
        };
        settings.resolve(&scales, true).unwrap()
    }

    /// A slip with this mean and this noise in each of a number of patches, and the signed mean.
    fn seen(axes: usize, slip: impl Fn(usize, f64) -> f64, noise: f64, averaging: f64) -> [Sum; 2] {
        const PATCHES: usize = 6;
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut windows = Windows::new(axes, [PATCHES, 1], &times(averaging));
        let mut sums = Sums::default();
        let mut signed = Sum::default();
        let decay = f64::exp(-DT / MEMORY);
        let mut state = [[0.0; 3]; PATCHES];
        for step in 0..40_000 {
            for (k, state) in state.iter_mut().enumerate() {
                let mut q = [0.0; 3];
                for axis in 0..axes {
                    let kick = (1.0 - decay * decay).sqrt()
                        * noise
                        * random.sample::<f64, _>(StandardNormal);
                    state[axis] = decay * state[axis] + kick;
                    q[axis] = state[axis] * DT;
                }
                q[0] += slip(k, step as f64 * DT) * DT;
                windows.add(Of::Slip, k, q, [DT, noise * noise * DT]);
                signed.size += q[0];
                signed.weight += DT;
            }
            windows.pass(DT, &mut sums);
        }
        [sums.of(Of::Slip), signed]
    }

    #[test]
    fn noise_without_slip_gives_the_floor() {
        for axes in 1..=3 {
            // Windows of less than the memory and of many of it.
            for averaging in [0.05, 0.5, 5.0] {
                let [sum, _] = seen(axes, |_, _| 0.0, 0.05, averaging);
                let ratio = sum.mean() / sum.noise();
                println!("{axes} {averaging}: {:.4} {ratio:.3}", sum.noise());
                assert!((ratio - 1.0).abs() < 0.05, "{axes} {averaging}: {ratio}");
            }
        }
        // The longer, the less is left.
        let floor = |averaging| seen(1, |_, _| 0.0, 0.05, averaging)[0].noise();
        assert!(floor(5.0) < 0.3 * floor(0.05));
    }

    #[test]
    fn slips_of_both_signs_do_not_cancel() {
        let places = |k: usize, _: f64| if k.is_multiple_of(2) { 0.05 } else { -0.05 };
        // Signs that change every second window.
        let times = |_: usize, t: f64| {
            if ((t / 80.0) as u64).is_multiple_of(2) {
                0.05
            } else {
                -0.05
            }
        };
        let by: [&dyn Fn(usize, f64) -> f64; 2] = [&places, &times];
        for slip in by {
            let [sum, signed] = seen(1, slip, 0.02, 5.0);
            println!("{:.4} {:.4} {:.5}", sum.mean(), sum.noise(), signed.mean());
            assert!((sum.mean() / 0.05 - 1.0).abs() < 0.05);
            assert!(sum.mean() > 10.0 * sum.noise());
            // The control: a sum with signs sees nothing.
            assert!(signed.mean().abs() < 0.001);
        }
    }

    #[test]
    fn a_window_goes_on_from_its_numbers() {
        let new = || Windows::new(2, [3, 2], &times(0.5));
        let (mut whole, mut sums) = (new(), Sums::default());
        whole.add(Of::Slip, 1, [0.3, -0.1, 0.0], [2.0, 0.5]);
        whole.add(Of::Traction, 1, [1.0, 2.0, 0.0], [1.0, 0.0]);
        whole.pass(1.0, &mut sums);
        let mut again = new();
        assert_eq!(again.take_up(&whole.numbers()), Some(()));
        assert_eq!(again.closed(&sums), whole.closed(&sums));
        assert_eq!(whole.closed(&sums).of(Of::Traction).size, 5.0_f64.sqrt());
        assert_eq!(
            Sums::from_numbers(&whole.closed(&sums).numbers()),
            whole.closed(&sums)
        );
        assert_eq!(new().take_up(&[1.0, 0.0]), None);
        assert_eq!(
            new().take_up(&[1.0, 3.0, 2.0, 1.0, 0.0, 0.0, 1.0, 0.0]),
            None
        );
    }
}
