//! Measured friction as a table, for materials that no formula describes.

use super::LocalPoint;

/// Most points of a table, and fewest local points behind each of them.
const MOST_ROWS: usize = 12;
const LEAST_BEHIND_A_ROW: usize = 4;

/// Points (I, μ = |τ|/p) through the local points: weighted means of groups of equal count in order of I, of
/// which neighbours with falling μ are joined (isotonic regression by pooling adjacent violators,
/// Ayer et al., *Ann. Math. Stat.* 26 (1955) 641), because a falling μ(I) is ill posed.
///
/// None if fewer than two rows are left, that is where friction does not rise with I at all.
pub fn friction_table(points: &[LocalPoint]) -> Option<Vec<[f64; 2]>> {
    let mut measured: Vec<[f64; 3]> = points
        .iter()
        .map(|point| {
            let error = point.friction_error;
            [point.inertial_number, point.friction, 1.0 / (error * error)]
        })
        .filter(|row| row.iter().all(|x| x.is_finite()) && row[2] > 0.0)
        .collect();
    measured.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let rows = (measured.len() / LEAST_BEHIND_A_ROW).min(MOST_ROWS);
    if rows < 2 {
        return None;
    }
    let mut pooled: Vec<[f64; 3]> = Vec::with_capacity(rows);
    for row in 0..rows {
        let (from, to) = (
            row * measured.len() / rows,
            (row + 1) * measured.len() / rows,
        );
        let mut mean = measured[from..to].iter().copied().reduce(joined)?;
        while let Some(before) = pooled.last().copied() {
            if before[1] < mean[1] && before[0] < mean[0] {
                break;
            }
            pooled.pop();
            mean = joined(before, mean);
        }
        pooled.push(mean);
    }
    (pooled.len() >= 2).then(|| pooled.iter().map(|[i, mu, _]| [*i, *mu]).collect())
}

/// The weighted mean of two groups (I, μ, weight).
fn joined(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let weight = a[2] + b[2];
    let mean = |x: f64, y: f64| (a[2] * x + b[2] * y) / weight;
    [mean(a[0], b[0]), mean(a[1], b[1]), weight]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(inertial_number: f64, friction: f64) -> LocalPoint {
        LocalPoint {
            slope_degrees: 30.0,
            z: 0.1,
            inertial_number,
            inertial_number_error: 1e-3,
            friction,
            friction_error: 1e-2,
            friction_zz: friction - 0.05,
            friction_zz_error: 1e-2,
            solid_fraction: 0.5,
            solid_fraction_error: 1e-3,
        }
    }

    #[test]
    fn rising_friction_is_kept() {
        let points: Vec<LocalPoint> = (0..80)
            .map(|k| point(0.01 * f64::from(k), 0.3 + 0.002 * f64::from(k)))
            .collect();
        let table = friction_table(&points).unwrap();
        assert_eq!(table.len(), MOST_ROWS);
        for [i, mu] in &table {
            assert!((mu - (0.3 + 0.2 * i)).abs() < 1e-12);
        }
    }

    #[test]
    fn falling_stretches_are_pooled_and_falling_laws_have_no_table() {
        let hump = |k: i32| {
            let x = f64::from(k) / 40.0;
            0.3 + x - 2.0 * x * x + 1.4 * x * x * x
        };
        let points: Vec<LocalPoint> = (0..40).map(|k| point(f64::from(k), hump(k))).collect();
        let table = friction_table(&points).unwrap();
        assert!(
            table.len() < 10
                && table
                    .windows(2)
                    .all(|p| p[1][0] > p[0][0] && p[1][1] > p[0][1])
        );
        let falling: Vec<LocalPoint> = (0..40)
            .map(|k| point(f64::from(k), 1.0 - 0.01 * f64::from(k)))
            .collect();
        assert_eq!(friction_table(&falling), None);
        assert_eq!(friction_table(&points[..7]), None);
    }
}
