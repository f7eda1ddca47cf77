//! From sums to fields with standard errors.

use super::{Layering, sums::field};
use serde::{Deserialize, Deserializer, Serialize};

/// A mean and its standard error.
///
/// The error is the delete-one-block jackknife over 32 to 63 blocks in time, times √((1 + r)/(1 − r)), where r
/// is what correlation neighbouring blocks still have. r is negative where a flow breathes: the pressure swings
/// by tens of per cent with a period of about a block, about a mean that the weight holds fixed. That is counted
/// as r = 0: so few blocks do not tell a swing well enough to narrow an error by it, so there the error is wide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The mean.
    pub value: f64,
    /// Its standard error; not a number if there were fewer than 3 blocks, or one in which the mean is not defined.
    #[serde(deserialize_with = "number_or_none")]
    pub error: f64,
}

/// What is not a number is written as none.
fn number_or_none<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Option::deserialize(from).map(|number| number.unwrap_or(f64::NAN))
}

/// One layer of a profile. Pressures are positive in compression, stresses positive in tension.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProfileRow {
    /// Middle of the layer (m).
    pub z: f64,
    /// Solid fraction of free grains, by exact volumes.
    pub phi: Estimate,
    /// Density [kg/m³], by centres.
    pub density: Estimate,
    /// Velocity downslope [m/s].
    pub u: Estimate,
    /// Velocity across [m/s].
    pub v: Estimate,
    /// Velocity normal to the plane [m/s].
    pub w: Estimate,
    /// Total stress (Pa), contact and kinetic, positive in tension; row = direction of the force.
    pub stress: [[Estimate; 3]; 3],
    /// p = −trace(stress)/3 (Pa).
    pub p: Estimate,
    /// −σ_zz (Pa).
    pub sigma_zz: Estimate,
    /// |σ_xz| (Pa).
    pub tau: Estimate,
    /// Kinetic part of p (Pa).
    pub kinetic_p: Estimate,
    /// Granular temperature, trace⟨u′u′⟩/3 [m²/s²], about a velocity linear within the layer and in time.
    pub temperature: Estimate,
    /// What the temperature would gain if velocities were taken about the layer's mean [m²/s²]: (γ̇²/3) var z.
    pub shear_in_layer: Estimate,
    /// ∂u/∂z [1/s], by central difference of neighbouring layers; for a Bagnold profile a distance y below the
    /// surface it is too small by the fraction (Δz/y)²/24 (0.5 % three layers down).
    pub shear_rate: Option<Estimate>,
    /// I = |∂u/∂z| d √(ρ_s/p).
    pub i: Option<Estimate>,
    /// τ/p.
    pub mu: Option<Estimate>,
    /// τ/σ_zz.
    pub mu_zz: Option<Estimate>,
    /// What the momentum of all that lies above asks of τ/σ_zz: `(g_x M − ∂J_x/∂t + ρUW)/(∂J_z/∂t − ρW² − g_z M)`, M its mass, J
    /// its momentum and ρUW what the mean flow carries through the layer while it swells or sinks. In a steady flow tan θ;
    /// less where the flow becomes faster, most near its surface. None where a wall bears some of it.
    #[serde(default)]
    pub mu_zz_balance: Option<f64>,
}

/// How well the averages obey mass and momentum balance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BalanceCheck {
    /// Mass in all layers and outside them against the grains' mass, relative.
    pub mass_relative: f64,
    /// Share of the mass outside the layers.
    pub mass_outside: f64,
    /// Largest |σ_zz − weight above| over layers that carry at least 10 % of the weight and touch no wall,
    /// relative to the weight above them.
    pub weight_relative: f64,
    /// Largest residual of the balance normal to the plane, wall force and acceleration included, relative to
    /// the whole weight.
    pub normal_relative: f64,
    /// The same along the slope.
    pub downslope_relative: f64,
    /// Mean acceleration downslope [m/s²].
    pub acceleration: f64,
}

/// Averages through the depth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Layers that ever held a free grain, from below.
    pub rows: Vec<ProfileRow>,
    /// Thickness of a layer (m).
    pub layer: f64,
    /// Samples taken.
    pub samples: u64,
    /// Time from the first to the last sample (s).
    pub duration: f64,
    /// Blocks behind the standard errors.
    pub blocks: usize,
    /// Mass and momentum balance.
    pub balance: BalanceCheck,
}

/// What turns sums into fields.
pub(super) struct Scale {
    pub floor_area: f64,
    pub diameter: f64,
    pub grain_density: f64,
}

/// Positions in the array of one layer's quantities; NaN = not defined there.
mod q {
    pub const PHI: usize = 0;
    pub const DENSITY: usize = 1;
    pub const U: usize = 2;
    pub const STRESS: usize = 5;
    pub const P: usize = 14;
    pub const SIGMA_ZZ: usize = 15;
    pub const TAU: usize = 16;
    pub const KINETIC_P: usize = 17;
    pub const TEMPERATURE: usize = 18;
    pub const SHEAR_IN_LAYER: usize = 19;
    pub const SHEAR_RATE: usize = 20;
    pub const I: usize = 21;
    pub const MU: usize = 22;
    pub const MU_ZZ: usize = 23;
    pub const CARRIED: usize = 24;
    pub const COUNT: usize = 27;
}

type Quantities = [f64; q::COUNT];

/// All quantities of all layers from sums over a number of samples.
pub(super) fn mean_rows(
    sums: &[f64],
    samples: u64,
    layers: &Layering,
    scale: &Scale,
) -> Vec<Quantities> {
    let n = layers.count;
    let volume = scale.floor_area * layers.thickness * samples as f64;
    let mut rows: Vec<Quantities> = (0..n)
        .map(|k| {
            let at = |f: usize| sums[f * n + k];
            let mut row = [f64::NAN; q::COUNT];
            let mass = at(field::MASS);
            row[q::PHI] = at(field::VOLUME) / volume;
            row[q::DENSITY] = mass / volume;
            let per_mass = |f: usize| if mass > 0.0 { at(f) / mass } else { 0.0 };
            let velocity: [f64; 3] = std::array::from_fn(|a| per_mass(field::MOMENTUM + a));
            if mass > 0.0 {
                row[q::U..q::U + 3].copy_from_slice(&velocity);
            }
            // The mean velocity varies within the layer and in time: V + s (ζ − ζ̄) + c (t − t̄), s and c by least
            // squares.
            let zeta = per_mass(field::MASS_ZETA);
            let spread = (per_mass(field::MASS_ZETA_2) - zeta * zeta).max(0.0);
            let slope: [f64; 3] = std::array::from_fn(|a| {
                if spread > 1e-4 * layers.thickness * layers.thickness {
                    (per_mass(field::MOMENTUM_ZETA + a) - velocity[a] * zeta) / spread
                } else {
                    0.0
                }
            });
            // A flow that gains speed while it is averaged: what its mean gains is no fluctuation either.
            let time = per_mass(field::MASS_TIME);
            let ages = (per_mass(field::MASS_TIME_2) - time * time).max(0.0);
            let gain: [f64; 3] = std::array::from_fn(|a| {
                if ages > 1e-9 * time * time {
                    (per_mass(field::MOMENTUM_TIME + a) - velocity[a] * time) / ages
                } else {
                    0.0
                }
            });
            const PART: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];
            let mut kinetic_trace = 0.0;
            for i in 0..3 {
                for j in 0..3 {
                    let mean_flow = velocity[i] * velocity[j]
                        + slope[i] * slope[j] * spread
                        + gain[i] * gain[j] * ages;
                    if j == 2 {
                        row[q::CARRIED + i] = row[q::DENSITY] * mean_flow;
                    }
                    let fluctuation = per_mass(field::FLUX + PART[i][j]) - mean_flow;
                    row[q::STRESS + 3 * i + j] =
                        at(field::CONTACT + 3 * i + j) / volume - row[q::DENSITY] * fluctuation;
                    if i == j {
                        kinetic_trace += fluctuation;
                    }
                }
            }
            let stress = |i: usize, j: usize| row[q::STRESS + 3 * i + j];
            let (p, szz, tau) = (
                -(stress(0, 0) + stress(1, 1) + stress(2, 2)) / 3.0,
                -stress(2, 2),
                stress(0, 2).abs(),
            );
            row[q::P] = p;
            row[q::SIGMA_ZZ] = szz;
            row[q::TAU] = tau;
            row[q::TEMPERATURE] = kinetic_trace / 3.0;
            row[q::KINETIC_P] = row[q::DENSITY] * kinetic_trace / 3.0;
            row[q::SHEAR_IN_LAYER] = slope.iter().map(|s| s * s).sum::<f64>() * spread / 3.0;
            if p > 0.0 {
                row[q::MU] = tau / p;
            }
            if szz > 0.0 {
                row[q::MU_ZZ] = tau / szz;
            }
            row
        })
        .collect();
    for k in 1..n.saturating_sub(1) {
        let rate = (rows[k + 1][q::U] - rows[k - 1][q::U]) / (2.0 * layers.thickness);
        rows[k][q::SHEAR_RATE] = rate;
        if rows[k][q::P] > 0.0 {
            rows[k][q::I] =
                rate.abs() * scale.diameter * (scale.grain_density / rows[k][q::P]).sqrt();
        }
    }
    rows
}

/// Jackknife standard error from the estimates that leave one block out.
fn jackknife_error(without: &[f64]) -> f64 {
    let b = without.len() as f64;
    let mean = without.iter().sum::<f64>() / b;
    let squares: f64 = without.iter().map(|x| (x - mean) * (x - mean)).sum();
    if squares <= 0.0 {
        return 0.0;
    }
    let neighbours: f64 = without
        .windows(2)
        .map(|w| (w[0] - mean) * (w[1] - mean))
        .sum();
    // The estimate of the correlation is low by about 1/b.
    let r = (neighbours / squares + 1.0 / b).clamp(0.0, 0.9);
    ((b - 1.0) / b * squares * (1.0 + r) / (1.0 - r)).sqrt()
}

impl Profile {
    pub(super) fn assemble(
        means: &[Quantities],
        without: &[Vec<Quantities>],
        layers: &Layering,
        (balance, asked): (BalanceCheck, Vec<Option<f64>>),
        samples: u64,
        duration: f64,
    ) -> Self {
        let mut values = vec![0.0; without.len()];
        let mut rows = Vec::new();
        for (k, mean) in means
            .iter()
            .enumerate()
            .filter(|(_, m)| m[q::DENSITY] > 0.0)
        {
            let mut get = |which: usize| {
                for (value, block) in values.iter_mut().zip(without) {
                    *value = block[k][which];
                }
                // A layer that is empty in some blocks has no error bar worth the name.
                let defined = values.iter().all(|v| v.is_finite());
                let error = if values.is_empty() {
                    f64::NAN
                } else {
                    jackknife_error(&values)
                };
                (mean[which].is_finite() && defined).then_some(Estimate {
                    value: mean[which],
                    error,
                })
            };
            let plain = |e: Option<Estimate>, which: usize| {
                e.unwrap_or(Estimate {
                    value: if mean[which].is_finite() {
                        mean[which]
                    } else {
                        0.0
                    },
                    error: f64::NAN,
                })
            };
            let mut all = |which: usize| plain(get(which), which);
            let stress =
                std::array::from_fn(|i| std::array::from_fn(|j| all(q::STRESS + 3 * i + j)));
            rows.push(ProfileRow {
                z: layers.centre(k),
                phi: all(q::PHI),
                density: all(q::DENSITY),
                u: all(q::U),
                v: all(q::U + 1),
                w: all(q::U + 2),
                stress,
                p: all(q::P),
                sigma_zz: all(q::SIGMA_ZZ),
                tau: all(q::TAU),
                kinetic_p: all(q::KINETIC_P),
                temperature: all(q::TEMPERATURE),
                shear_in_layer: all(q::SHEAR_IN_LAYER),
                shear_rate: get(q::SHEAR_RATE),
                i: get(q::I),
                mu: get(q::MU),
                mu_zz: get(q::MU_ZZ),
                mu_zz_balance: asked.get(k).copied().flatten(),
            });
        }
        Self {
            rows,
            layer: layers.thickness,
            samples,
            duration,
            blocks: without.len(),
            balance,
        }
    }
}

impl BalanceCheck {
    /// Integrates ∂ₜj + ∇·(ρuu − σ) = t + ρg from the top down to each layer, averaged over the layer:
    /// −σ_αz = ∂ₜJ_above − g_α M_above − T_above − ρ U_α W (per floor area): a flow that swells or sinks while it is
    /// averaged carries its momentum through the layer, which is no stress. With it, what that makes of τ/σ_zz in each
    /// layer.
    pub(super) fn of(
        sums: &[f64],
        samples: u64,
        means: &[Quantities],
        layers: &Layering,
        floor_area: f64,
        gravity: [f64; 3],
        momentum_rate_above: &dyn Fn(usize, usize) -> f64,
    ) -> (Self, Vec<Option<f64>>) {
        let n = layers.count;
        let mut asked = vec![None; n];
        if samples == 0 {
            return (Self::default(), asked);
        }
        let s = samples as f64;
        let tail = &sums[field::COUNT * n..];
        let in_layers: f64 = sums[field::MASS * n..(field::MASS + 1) * n].iter().sum();
        let outside = tail[field::MASS_OVER_TOP] + tail[field::MASS_UNDER_BOTTOM];
        let total = tail[field::TOTAL_MASS];
        let mut check = Self {
            mass_relative: ((in_layers + outside) / total - 1.0).abs(),
            mass_outside: outside / total,
            ..Self::default()
        };
        let magnitude = gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
        let whole = magnitude * total / s / floor_area;
        let mut mass_higher = tail[field::MASS_OVER_TOP];
        let mut wall_higher = [0.0; 3];
        let mut any_wall = false;
        for k in (0..n).rev() {
            let at = |f: usize| sums[f * n + k];
            let mass_above = (mass_higher + at(field::MASS_ABOVE)) / s / floor_area;
            let momentum = |axis: usize| {
                gravity[axis] * mass_above - momentum_rate_above(axis, k) / floor_area
                    + means[k][q::CARRIED + axis]
            };
            let residual = |axis: usize| {
                let wall = (wall_higher[axis] + at(field::WALL_ABOVE + axis)) / s / floor_area;
                momentum(axis) + wall - means[k][q::STRESS + 3 * axis + 2]
            };
            any_wall |= at(field::WALL + 2) != 0.0;
            check.normal_relative = check.normal_relative.max(residual(2).abs() / whole);
            check.downslope_relative = check.downslope_relative.max(residual(0).abs() / whole);
            asked[k] = (!any_wall && momentum(2) < 0.0).then(|| momentum(0).abs() / -momentum(2));
            let weight = -gravity[2] * mass_above;
            if !any_wall && weight > 0.1 * whole && weight > 0.0 {
                let carried = means[k][q::SIGMA_ZZ];
                check.weight_relative = check.weight_relative.max((carried / weight - 1.0).abs());
            }
            mass_higher += at(field::MASS);
            for (axis, force) in wall_higher.iter_mut().enumerate() {
                *force += at(field::WALL + axis);
            }
        }
        // At the lowest layer everything lies above, but for half of that layer.
        check.acceleration = momentum_rate_above(0, 0) * s / total;
        (check, asked)
    }
}

#[cfg(test)]
mod tests {
    use super::{jackknife_error, number_or_none};
    use serde::de::IntoDeserializer;

    /// Estimates without one block each, of a mean over blocks.
    fn without(blocks: &[f64]) -> Vec<f64> {
        let (n, sum) = (blocks.len() as f64, blocks.iter().sum::<f64>());
        blocks.iter().map(|x| (sum - x) / (n - 1.0)).collect()
    }

    #[test]
    fn swinging_blocks_do_not_narrow_the_error_and_slow_ones_widen_it() {
        let n = 40;
        let plain = |blocks: &[f64]| {
            let mean = blocks.iter().sum::<f64>() / n as f64;
            let squares: f64 = blocks.iter().map(|x| (x - mean).powi(2)).sum();
            (squares / (n * (n - 1)) as f64).sqrt()
        };
        let swing: Vec<f64> = (0..n).map(|k| [1.0, -1.0][k % 2]).collect();
        let error = jackknife_error(&without(&swing));
        assert!((error / plain(&swing) - 1.0).abs() < 1e-9, "{error}");
        let slow: Vec<f64> = (0..n).map(|k| (0.2 * k as f64).sin()).collect();
        assert!(jackknife_error(&without(&slow)) > 2.0 * plain(&slow));
        assert_eq!(jackknife_error(&without(&[3.0; 40])), 0.0);
    }

    #[test]
    fn an_error_that_is_not_known_comes_back_as_such() {
        let read: Result<f64, serde::de::value::Error> = number_or_none(().into_deserializer());
        assert!(read.unwrap().is_nan());
    }
}
