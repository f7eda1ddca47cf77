//! What keeps a flow from settling: jams and crystals.

use super::SeriesPoint;
use colluvium_dem::{Partner, Snapshot};
use std::f64::consts::PI;

/// Largest kinetic energy that a run lost within `window` (s), over the largest it ever had; 0 for none. A flow that
/// rearranges and jams loses most of it at once, a flow that slows down does not (thesis 2.3.2).
pub(super) fn sudden_loss(series: &[SeriesPoint], window: f64) -> f64 {
    let most = series.iter().map(|p| p.kinetic_energy).fold(0.0, f64::max);
    let mut largest: f64 = 0.0;
    let mut later = 0;
    for point in series {
        while later < series.len() && series[later].time < point.time + window {
            later += 1;
        }
        let Some(after) = series.get(later) else {
            break;
        };
        largest = largest.max(point.kinetic_energy - after.kinetic_energy);
    }
    if most > 0.0 { largest / most } else { 0.0 }
}

/// Global bond order Q_6 of contacts between free grains (Steinhardt, Nelson and Ronchetti 1983): 0.57 in a face-centred
/// cubic crystal, 0.48 in a hexagonal one, about 1/√(number of contacts) where there is no order.
pub(super) fn bond_order(snapshot: &Snapshot) -> f64 {
    let mut sums = [(0.0, 0.0); 7];
    let mut count = 0.0;
    for contact in &snapshot.contacts {
        let free = |g: usize| !snapshot.grains[g].fixed;
        let pair = matches!(contact.partner, Partner::Grain(j) if free(contact.grain) && free(j));
        if let (true, Some(n)) = (pair, (contact.arm - contact.partner_arm).try_normalize(0.0)) {
            count += 1.0;
            for (m, (re, im)) in sums.iter_mut().enumerate() {
                let (value, phase) = (legendre_6(m, n.z), m as f64 * n.y.atan2(n.x));
                *re += value * phase.cos();
                *im += value * phase.sin();
            }
        }
    }
    if count == 0.0 {
        return 0.0;
    }
    let square = |(re, im): &(f64, f64)| (re * re + im * im) / (count * count);
    // Orders −m and m are as large.
    let sum = square(&sums[0]) + 2.0 * sums[1..].iter().map(square).sum::<f64>();
    (4.0 * PI / 13.0 * sum).sqrt()
}

/// The part of the spherical harmonic Y_6m that depends on cos θ = x, orthonormal.
fn legendre_6(m: usize, x: f64) -> f64 {
    let s2 = 1.0 - x * x;
    let s = s2.max(0.0).sqrt();
    let x2 = x * x;
    let (polynomial, power) = match m {
        0 => (
            (231.0 * x2.powi(3) - 315.0 * x2 * x2 + 105.0 * x2 - 5.0) / 16.0,
            1.0,
        ),
        1 => (21.0 / 8.0 * x * (33.0 * x2 * x2 - 30.0 * x2 + 5.0), s),
        2 => (105.0 / 8.0 * (33.0 * x2 * x2 - 18.0 * x2 + 1.0), s2),
        3 => (315.0 / 2.0 * x * (11.0 * x2 - 3.0), s * s2),
        4 => (945.0 / 2.0 * (11.0 * x2 - 1.0), s2 * s2),
        5 => (10395.0 * x, s * s2 * s2),
        _ => (10395.0, s2 * s2 * s2),
    };
    let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
    (13.0 / (4.0 * PI) * factorial(6 - m) / factorial(6 + m)).sqrt() * polynomial * power
}

#[cfg(test)]
mod tests {
    use super::*;
    use colluvium_dem::{ContactSample, GrainSample};
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn along(normals: &[Vector3<f64>]) -> Snapshot {
        let grain = |id| GrainSample {
            id,
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
            radius: 0.5,
            mass: 1.0,
            fixed: false,
            clump: None,
        };
        let contact = |n: &Vector3<f64>| ContactSample {
            grain: 0,
            partner: Partner::Grain(1),
            overlap: 0.0,
            force: -n,
            arm: 0.5 * n,
            partner_arm: -0.5 * n,
            torque: Vector3::zeros(),
            partner_torque: Vector3::zeros(),
        };
        Snapshot {
            grains: vec![grain(0), grain(1)],
            contacts: normals.iter().map(contact).collect(),
            ..Snapshot::default()
        }
    }

    #[test]
    fn a_crystal_is_told_from_disorder_however_it_is_turned() {
        let mut fcc = Vec::new();
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            for sign in [1.0, -1.0] {
                let mut n = Vector3::zeros();
                (n[a], n[b]) = (1.0, sign);
                fcc.push(n.normalize());
            }
        }
        let found = bond_order(&along(&fcc));
        assert!((found - 0.574_524).abs() < 1e-5, "{found}");
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, 1.1, -0.7);
        let turned: Vec<_> = fcc.iter().map(|n| turn * n).collect();
        assert!((bond_order(&along(&turned)) - found).abs() < 1e-12);

        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let random: Vec<_> = (0..4000)
            .map(|_| {
                Vector3::from_fn(|_, _| rng.sample::<f64, _>(rand_distr::StandardNormal))
                    .normalize()
            })
            .collect();
        assert!(bond_order(&along(&random)) < 0.04);
        assert_eq!(bond_order(&along(&[])), 0.0);
    }

    #[test]
    fn a_jam_is_a_sudden_loss() {
        let series = |energy: &dyn Fn(f64) -> f64| -> Vec<SeriesPoint> {
            (0..200)
                .map(|k| 0.1 * f64::from(k))
                .map(|time| SeriesPoint {
                    time,
                    kinetic_energy: energy(time),
                    mean_velocity: 0.0,
                    mass: 1.0,
                    mean_height: 0.0,
                })
                .collect()
        };
        assert!(sudden_loss(&series(&|t| if t < 12.0 { 5.0 } else { 1.0 }), 2.0) > 0.79);
        assert!(sudden_loss(&series(&|t| (-0.05 * t).exp()), 2.0) < 0.12);
        assert_eq!(sudden_loss(&series(&|t| 1.0 + t), 2.0), 0.0);
    }
}
