//! Boulders, grains that hang together by bonds or as clumps: their table, and the law of their sizes.

use crate::table::Table;
use colluvium_dem::Clusters;
use std::f64::consts::PI;

/// Diameter of the ball that a boulder's grains fill at a solid fraction (m).
fn bulk_diameter(volume: f64, solid_fraction: f64) -> f64 {
    (6.0 / PI * volume / solid_fraction).cbrt()
}

/// Boulders, clusters joined by bonds, the heaviest first.
pub fn boulders(clusters: &Clusters, solid_fraction: f64) -> Table {
    let list: Vec<_> = clusters.boulders().collect();
    let column = |f: &dyn Fn(&colluvium_dem::Cluster) -> f64| list.iter().map(|c| f(c)).collect();
    Table::new("boulders")
        .with("grains", "1", column(&|c| c.grains as f64))
        .with("bonds", "1", column(&|c| c.bonds as f64))
        .with("mass", "kg", column(&|c| c.mass))
        .with(
            "diameter",
            "m",
            column(&|c| bulk_diameter(c.volume, solid_fraction)),
        )
        .with("length", "m", column(&|c| c.extent.max()))
        .with("x", "m", column(&|c| c.center.x))
        .with("y", "m", column(&|c| c.center.y))
        .with("z", "m", column(&|c| c.center.z))
}

/// Fewest sizes from which an index is told.
const FEWEST_SIZES: usize = 10;

/// Index a of a cumulative power law N(> D) ∝ D^-a of sizes, the largest likelihood's, and its standard error:
/// `a = n/Σ ln(D_i/D_min)`, error a/√n (Hill 1975). Not a number for fewer than ten.
pub fn size_index(sizes: &[f64]) -> [f64; 2] {
    if sizes.len() < FEWEST_SIZES {
        return [f64::NAN; 2];
    }
    let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
    let sum: f64 = sizes.iter().map(|d| (d / least).ln()).sum();
    let n = (sizes.len() - 1) as f64;
    let index = n / sum;
    [index, index / n.sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_of_sizes_is_found_with_its_error() {
        // Quantiles of N(> D) ∝ D^-3.6.
        let n = 400;
        let sizes: Vec<f64> = (0..n)
            .map(|k| ((f64::from(k) + 0.5) / f64::from(n)).powf(-1.0 / 3.6))
            .collect();
        let [index, error] = size_index(&sizes);
        assert!(
            (index - 3.6).abs() < 2.0 * error && error < 0.2,
            "{index} {error}"
        );
        assert!(size_index(&sizes[..9])[0].is_nan());
    }
}
