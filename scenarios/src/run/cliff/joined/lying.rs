//! What of a cliff's debris lies, while the rest stands.
//!
//! A column lies if no place around it is so low that a slope from there would pass below the column's top,
//!
//! ```text
//! s(x) ≤ min_x' s(x') + tan β |x − x'|,      s surface, β steepest slope
//! ```
//!
//! up to half a parcel. Whole columns lie: what is in one above the others is held up by them.

use crate::run::cliff::watch::EDGE;
use crate::scene::CliffScene;
use colluvium_dem::Simulation;
use std::collections::BTreeSet;

/// By how much a column may stand out, over the width of a column.
const TOLERANCE: f64 = 0.5;
/// Fewest columns side by side that lie.
const FEWEST: usize = 3;

/// Which columns of thickness h (m) over ground (m), this far from each other (m), lie no more steeply than a slope (tan).
fn columns_that_lie([heights, ground]: [&[f64]; 2], spacing: f64, tan: f64) -> Vec<bool> {
    let surface: Vec<f64> = heights.iter().zip(ground).map(|(h, z)| h + z).collect();
    let mut lowest = surface.clone();
    let step = tan * spacing;
    for i in 1..lowest.len() {
        lowest[i] = lowest[i].min(lowest[i - 1] + step);
    }
    for i in (1..lowest.len()).rev() {
        lowest[i - 1] = lowest[i - 1].min(lowest[i] + step);
    }
    let mut lies: Vec<bool> = (0..surface.len())
        .map(|i| heights[i] > EDGE * spacing && surface[i] <= lowest[i] + TOLERANCE * spacing)
        .collect();
    let mut first = 0;
    while first < lies.len() {
        let run = lies[first..].iter().take_while(|lies| **lies).count();
        if run < FEWEST {
            lies[first..first + run].fill(false);
        }
        first += run.max(1);
    }
    lies
}

impl CliffScene {
    /// Height of the ground of the debris over the foot: what stands behind the crack, and a plane before it, as by thickness
    /// alone what lies on a slope is no pillar.
    fn behind(&self, x: f64) -> f64 {
        let head = self.crack_head();
        if x >= 0.0 {
            0.0
        } else if x <= -head {
            self.face()
        } else {
            self.face() * -x / head
        }
    }

    /// Numbers of the free grains in columns that lie, of debris and the parcels (place, volume) of a continuum, but those that
    /// are bonded to others; `base` is solid fraction times width (m).
    pub(super) fn lying(
        &self,
        simulation: &mut Simulation,
        debris: &BTreeSet<u32>,
        parcels: Vec<[f64; 2]>,
        (diameter, base): (f64, f64),
    ) -> BTreeSet<u32> {
        let axis = self.heap_axis(diameter);
        let clusters = simulation.clusters();
        let rows: Vec<_> = simulation.held(|_| true).collect();
        let volume = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let mut places: Vec<(u32, [f64; 2])> = rows
            .iter()
            .filter(|g| debris.contains(&g.id))
            .map(|g| (g.id, [g.position.x, volume(g.radius)]))
            .collect();
        places.sort_unstable_by_key(|(id, _)| *id);
        let own = places.iter().map(|(_, row)| *row);
        let heights = axis.heights(own.chain(parcels), base);
        let ground: Vec<f64> = axis
            .positions()
            .into_iter()
            .map(|x| self.behind(x))
            .collect();
        let tan = self.runout.steepest_degrees.to_radians().tan();
        let lies = columns_that_lie([&heights, &ground], axis.spacing, tan);
        let column =
            |x: f64| (((x - axis.start) / axis.spacing).max(0.0) as usize).min(lies.len() - 1);
        let goes: Vec<bool> = rows
            .iter()
            .map(|g| debris.contains(&g.id) && lies[column(g.position.x)])
            .collect();
        let mut whole = vec![true; clusters.list.len()];
        for (goes, cluster) in goes.iter().zip(&clusters.of) {
            whole[*cluster] &= *goes;
        }
        let marked = rows.iter().zip(&goes).zip(&clusters.of);
        marked
            .filter(|((_, goes), cluster)| **goes && whole[**cluster])
            .map(|((g, _), _)| g.id)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pillar_stands_and_what_is_around_it_lies() {
        let heights = [3.0, 4.0, 4.0, 3.5, 12.0, 13.0, 12.0, 2.0, 1.0, 0.1];
        let flat = [0.0; 10];
        let lies = columns_that_lie([&heights, &flat], 1.0, 1.0);
        assert_eq!(lies[..4], [true; 4]);
        assert_eq!(lies[4..7], [false; 3]);
        // Two columns are too few, a bare one is none.
        assert_eq!(lies[7..], [false; 3]);
        // A slope as steep as allowed lies, a steeper one only where it is low; whatever stands lies at 90°.
        let slope = [6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0];
        assert_eq!(
            columns_that_lie([&slope, &flat[..7]], 1.0, 1.0)[..6],
            [true; 6]
        );
        let steep = slope.map(|h| 2.0 * h);
        assert!(!columns_that_lie([&steep, &flat[..7]], 1.0, 1.0)[0]);
        let upright = 90f64.to_radians().tan();
        assert_eq!(
            columns_that_lie([&steep, &flat[..7]], 1.0, upright)[..6],
            [true; 6]
        );
        // High ground beside it holds nothing up and takes nothing away.
        let ground = [20.0, 10.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let before = [0.0, 0.0, 4.0, 3.0, 2.0, 1.0, 0.0];
        assert_eq!(
            columns_that_lie([&before, &ground], 1.0, 1.0)[2..6],
            [true; 4]
        );
    }
}
