//! Profiles of a joined run beside those of the full run in the same window.

use super::world::{DENSITY, steps};
use colluvium_coupling::coarse_graining::{Averager, Layering, Layers, Profile, ProfileRow};
use colluvium_dem::{Simulation, Snapshot};

/// Steps between samples.
const EVERY: u64 = 50;

/// Advances by `run_in` and then averages over `window`, in layers of 1 d.
pub fn profile(
    simulation: &mut Simulation,
    [run_in, window]: [f64; 2],
    mut advance: impl FnMut(&mut Simulation, u64, bool),
) -> Profile {
    let layers = Layering {
        lower: -2.0,
        thickness: 1.0,
        count: 40,
    };
    let mut averager = Averager::new(Layers, layers).unwrap();
    let mut snapshot = Snapshot::default();
    let [run_in, window] = [run_in, window].map(|t| steps(t) / EVERY);
    for k in 0..run_in + window {
        let measures = k >= run_in;
        advance(simulation, EVERY, measures);
        if measures {
            simulation.snapshot(&mut snapshot);
            averager.sample(&snapshot);
        }
    }
    averager.profile(1.0, DENSITY)
}

/// Relative errors of a joined run, over layers with centres between two heights: root mean squares over the
/// reference's, with the sign of the mean; of φ and T the error of the mean.
#[derive(Debug, Clone, Copy, Default)]
pub struct Errors {
    pub u: f64,
    pub pressure: f64,
    pub shear: f64,
    pub solid_fraction: f64,
    pub temperature: f64,
}

impl Errors {
    pub fn between(joined: &Profile, full: &Profile, [low, high]: [f64; 2]) -> Errors {
        // Square sum and sum of differences, square sum and sum of the reference.
        let sums = |value: fn(&ProfileRow) -> f64| {
            let mut sums = [0.0; 4];
            for row in joined.rows.iter().filter(|r| r.z > low && r.z < high) {
                let other = full.rows.iter().find(|o| (o.z - row.z).abs() < 1e-9);
                let Some(other) = other else { continue };
                let (a, b) = (value(row), value(other));
                let parts = [(a - b).powi(2), a - b, b * b, b];
                sums.iter_mut().zip(parts).for_each(|(s, p)| *s += p);
            }
            assert!(sums[2] > 0.0, "no layers between {low} and {high}");
            sums
        };
        let square = |value| {
            let [miss, sign, size, _] = sums(value);
            (miss / size).sqrt().copysign(sign)
        };
        let mean = |value| {
            let [_, miss, _, size] = sums(value);
            miss / size
        };
        Errors {
            u: square(|r| r.u.value),
            pressure: square(|r| r.sigma_zz.value),
            shear: square(|r| r.tau.value),
            solid_fraction: mean(|r| r.phi.value),
            temperature: mean(|r| r.temperature.value),
        }
    }

    /// Whether all lie within these.
    pub fn within(&self, limits: &Errors) -> bool {
        self.u.abs() < limits.u
            && self.pressure.abs() < limits.pressure
            && self.shear.abs() < limits.shear
            && self.solid_fraction.abs() < limits.solid_fraction
            && self.temperature.abs() < limits.temperature
    }
}

impl std::fmt::Display for Errors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let percent = |x: f64| format!("{:+.1} %", 100.0 * x);
        write!(
            f,
            "u {}, p {}, tau {}, phi {}, T {}",
            percent(self.u),
            percent(self.pressure),
            percent(self.shear),
            percent(self.solid_fraction),
            percent(self.temperature)
        )
    }
}

/// The mean of several runs over the same window.
pub fn mean(profiles: &[Profile]) -> Profile {
    let mut mean = profiles[0].clone();
    for row in &mut mean.rows {
        let same = profiles
            .iter()
            .filter_map(|p| p.rows.iter().find(|o| (o.z - row.z).abs() < 1e-9));
        let same: Vec<&ProfileRow> = same.collect();
        let over = |value: fn(&ProfileRow) -> f64| {
            same.iter().map(|r| value(r)).sum::<f64>() / same.len() as f64
        };
        let values = [
            over(|r| r.u.value),
            over(|r| r.sigma_zz.value),
            over(|r| r.tau.value),
            over(|r| r.phi.value),
            over(|r| r.temperature.value),
        ];
        row.u.value = values[0];
        row.sigma_zz.value = values[1];
        row.tau.value = values[2];
        row.phi.value = values[3];
        row.temperature.value = values[4];
    }
    mean
}

/// Largest relative error of the continuum's velocities against the full profile, at heights between two.
pub fn continuum_error(
    velocities: impl Iterator<Item = (f64, f64)>,
    full: &Profile,
    [low, high]: [f64; 2],
) -> f64 {
    let mut worst = 0.0_f64;
    for (z, u) in velocities.filter(|(z, _)| *z > low && *z < high) {
        let above = full.rows.iter().position(|r| r.z >= z).unwrap().max(1);
        let (a, b) = (&full.rows[above - 1], &full.rows[above]);
        let there = a.u.value + (z - a.z) / (b.z - a.z) * (b.u.value - a.u.value);
        let miss = u / there - 1.0;
        if miss.abs() > worst.abs() {
            worst = miss;
        }
    }
    worst
}
