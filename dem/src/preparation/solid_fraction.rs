//! Solid fraction of a region, from the parts of grains that lie in it.
//!
//! ```text
//! φ = Σ V(grain ∩ region) / V(region)
//! ```
//! Grains that lie inside count whole; of those that the boundary cuts, the part inside: exactly where
//! the region is a ball (two balls share a lens), else by [`POINTS`] points spread evenly over the grain.
//! Where grains overlap, what they share counts twice, as in the sum of their masses.

use super::size_report::ball_volume;
use crate::domain::Domain;
use crate::grains::Grain;
use crate::region::Region;
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Points in a grain that is cut by the boundary.
const POINTS: usize = 512;

/// Solid fraction of a region that is bounded within the box or by its periodic axes.
pub fn solid_fraction(grains: &[Grain], domain: &Domain, region: &Region) -> f64 {
    let [mut low, mut high] = region.bounds();
    for k in (0..3).filter(|&k| domain.periodic[k]) {
        low[k] = low[k].max(domain.lower[k]);
        high[k] = high[k].min(domain.upper[k]);
    }
    // A grain across a periodic boundary counts on both sides of the block.
    let block = Region::Block {
        lower: low,
        upper: high,
    };
    let cut = match region {
        Region::Ball { .. } if block.bounds() == region.bounds() => region.clone(),
        Region::Everywhere | Region::Block { .. } => block,
        region => Region::All(vec![block, region.clone()]),
    };
    let points = points();
    let images = images(domain);
    let grains = grains.iter().flat_map(|grain| {
        let home = domain.wrap(grain.position);
        images.iter().map(move |image| (home + image, grain.radius))
    });
    let solid: f64 = grains.map(|(x, r)| part(&cut, &x, r, &points)).sum();
    solid / volume(region, [low, high])
}

/// Shifts to the images of a point (m).
fn images(domain: &Domain) -> Vec<Vector3<f64>> {
    let mut images = vec![Vector3::zeros()];
    for k in (0..3).filter(|&k| domain.periodic[k]) {
        for image in images.clone() {
            for way in [-1.0, 1.0] {
                let mut shifted = image;
                shifted[k] += way * domain.lengths()[k];
                images.push(shifted);
            }
        }
    }
    images
}

/// Volume of a ball's part in a region (m³).
fn part(region: &Region, x: &Vector3<f64>, radius: f64, points: &[Vector3<f64>]) -> f64 {
    let depth = region.depth(x);
    if depth >= radius {
        return ball_volume(radius);
    }
    if depth <= -radius {
        return 0.0;
    }
    if let Region::Ball {
        center,
        radius: about,
    } = region
    {
        return lens(radius, *about, (x - center).norm());
    }
    let inside = |p: &&Vector3<f64>| region.contains(&(x + *p * radius));
    ball_volume(radius) * points.iter().filter(inside).count() as f64 / points.len() as f64
}

/// What two balls share at a distance of their centres (m³).
fn lens(a: f64, b: f64, distance: f64) -> f64 {
    if distance >= a + b {
        return 0.0;
    }
    if distance <= (a - b).abs() {
        return ball_volume(a.min(b));
    }
    let (sum, gap) = (a + b - distance, a - b);
    PI * sum * sum * (distance * (distance + 2.0 * (a + b)) - 3.0 * gap * gap) / (12.0 * distance)
}

/// Points spread evenly over the unit ball: equal volumes by radius, a golden spiral over directions.
fn points() -> Vec<Vector3<f64>> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let share = |k: usize| (k as f64 + 0.5) / POINTS as f64;
    // The radius runs through its range many times for each turn over the directions.
    let radical = |k: usize| (k as f64 * 0.754_877_666_246_692_8).fract();
    (0..POINTS)
        .map(|k| {
            let z = 1.0 - 2.0 * share(k);
            let (sin, cos) = (golden * k as f64).sin_cos();
            let across = (1.0 - z * z).sqrt();
            Vector3::new(across * cos, across * sin, z) * radical(k).cbrt()
        })
        .collect()
}

/// Volume of a region inside a block (m³): exact for blocks and for balls within it, else from the
/// middles of 10⁶ cells, to about 1e-4.
pub(super) fn volume(region: &Region, [low, high]: [Vector3<f64>; 2]) -> f64 {
    const CELLS: usize = 100;
    let size = high - low;
    let box_volume = size.product();
    match region {
        Region::Everywhere => return box_volume,
        Region::Block { lower, upper } => {
            return (upper.inf(&high) - lower.sup(&low))
                .map(|l| l.max(0.0))
                .product();
        }
        Region::Ball { radius, .. } if region.bounds() == [low, high] => {
            return ball_volume(*radius);
        }
        _ => {}
    }
    let inside = |k: &usize| {
        let cell = Vector3::new(k % CELLS, k / CELLS % CELLS, k / (CELLS * CELLS));
        let share = cell.map(|c| (c as f64 + 0.5) / CELLS as f64);
        region.contains(&(low + size.component_mul(&share)))
    };
    let cells = CELLS.pow(3);
    box_volume * (0..cells).filter(inside).count() as f64 / cells as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simple cubic: touching spheres of radius 1/2, π/6.
    fn lattice() -> (Vec<Grain>, Domain) {
        let at = |k: usize| Vector3::new(k % 6, k / 6 % 6, k / 36).map(|c| c as f64 + 0.2);
        let grains = (0..216).map(|k| Grain::at_rest(at(k), 0.5, 1.0));
        let domain = Domain {
            lower: Vector3::zeros(),
            upper: Vector3::repeat(6.0),
            periodic: [true; 3],
        };
        (grains.collect(), domain)
    }

    #[test]
    fn a_lattice_has_its_fraction_however_it_is_cut() {
        let (grains, domain) = lattice();
        let measure = |region: &Region| solid_fraction(&grains, &domain, region) / (PI / 6.0);
        assert!((measure(&Region::Everywhere) - 1.0).abs() < 1e-3);
        // Whole periods, cut anywhere.
        let block = Region::Block {
            lower: Vector3::new(0.4, 1.1, 2.7),
            upper: Vector3::new(3.4, 5.1, 4.7),
        };
        assert!((measure(&block) - 1.0).abs() < 5e-3, "{}", measure(&block));
        let ball = Region::Ball {
            center: Vector3::repeat(3.0),
            radius: 2.9,
        };
        let exact = measure(&ball);
        assert!((exact - 1.0).abs() < 0.03, "{exact}");
        // The same ball as a combination is measured by points.
        let by_points = measure(&Region::All(vec![ball]));
        assert!(
            (by_points / exact - 1.0).abs() < 3e-3,
            "{by_points} {exact}"
        );
    }

    #[test]
    fn a_lens_has_the_volume_of_its_caps() {
        // Two unit balls at distance 1: 5π/12.
        assert!((lens(1.0, 1.0, 1.0) - 5.0 * PI / 12.0).abs() < 1e-14);
        assert_eq!(lens(1.0, 3.0, 1.5), ball_volume(1.0));
        assert_eq!(lens(1.0, 1.0, 2.0), 0.0);
        let half = 0.5 * ball_volume(1e-3);
        assert!((lens(1e-3, 1e3, 1e3) / half - 1.0).abs() < 1e-5);
    }
}
