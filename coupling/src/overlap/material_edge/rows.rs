//! The edge row by row: where it is, and what the continuum presses on it with.
//!
//! In a row of cells the edge has moved with the grains of the shell, X = x_b + Σ q (x − x_b − ξ)/Σ q; its area
//! vector, outwards of the grains, is A = f h W (−1, dX/dz) with f the filled part of the row. The continuum's
//! traction on it is T = σ A; to it comes the impedance, −Z |A| (s·n) n, with s the mean of v − u over the shell's grains,
//! u at each one's place: what moves and turns as one feels none of it.

use super::cells::Cells;
use crate::overlap::cell_joint::Shell;
use crate::overlap::joint::over;
use nalgebra::Vector2;

/// What a row of the edge is pressed with until the next exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Where the edge is (m).
    pub place: f64,
    /// Its area vector along x and z (m²).
    pub area: Vector2<f64>,
    /// Force of the continuum (N).
    pub traction: Vector2<f64>,
    /// Velocity of the continuum there (m/s).
    pub velocity: Vector2<f64>,
}

/// Numbers of a row.
pub const NUMBERS: usize = 7;

impl Row {
    /// All of it in a row of numbers.
    pub fn numbers(&self) -> [f64; NUMBERS] {
        let [a, t, u] = [self.area, self.traction, self.velocity];
        [self.place, a[0], a[1], t[0], t[1], u[0], u[1]]
    }

    /// From such numbers.
    pub fn of(n: &[f64; NUMBERS]) -> Self {
        Self {
            place: n[0],
            area: Vector2::new(n[1], n[2]),
            traction: Vector2::new(n[3], n[4]),
            velocity: Vector2::new(n[5], n[6]),
        }
    }

    /// Force of an impedance on grains that move so much faster than the continuum (N).
    pub fn impedance(&self, impedance: f64, slip: Vector2<f64>) -> Vector2<f64> {
        let size = self.area[0].hypot(self.area[1]);
        if size <= 0.0 {
            return Vector2::zeros();
        }
        let n = self.area / size;
        -impedance * size * slip.dot(&n) * n
    }
}

/// For each row the one whose grains bear what presses on it: itself, or the next below with grains, or above.
pub fn bearers(loads: &[Shell<2>], least: f64, into: &mut Vec<usize>) {
    into.clear();
    let borne = |k: &usize| loads[*k].weight > least;
    let first = (0..loads.len()).find(borne);
    let mut last = first;
    for k in 0..loads.len() {
        if borne(&k) {
            last = Some(k);
        }
        into.push(last.unwrap_or(usize::MAX));
    }
}

/// Displacements of the edge, row by row, where they are not known those of the row below (m); then smoothed over
/// three rows.
pub fn displacements(sums: &[[f64; 2]], least: f64) -> Vec<f64> {
    let mut last = sums
        .iter()
        .find(|[weight, _]| *weight > least)
        .map_or(0.0, |[weight, moment]| over(*moment, *weight));
    let raw: Vec<f64> = sums
        .iter()
        .map(|[weight, moment]| {
            if *weight > least {
                last = moment / weight;
            }
            last
        })
        .collect();
    let at = |k: i64| raw[k.clamp(0, raw.len() as i64 - 1) as usize];
    (0..raw.len() as i64)
        .map(|k| 0.25 * at(k - 1) + 0.5 * at(k) + 0.25 * at(k + 1))
        .collect()
}

/// Slope dX/dz of the edge in each row.
pub fn slopes(places: &[f64], cells: &Cells) -> Vec<f64> {
    let last = places.len() - 1;
    (0..places.len())
        .map(|k| {
            // Rows below the floor have no grains.
            if k < cells.below {
                return 0.0;
            }
            let (low, high) = (k.saturating_sub(1).max(cells.below), (k + 1).min(last));
            (places[high] - places[low]) / ((high - low).max(1) as f64 * cells.spacing)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_without_grains_are_borne_by_the_next_below() {
        let load = |weight| {
            let mut shell = Shell::NONE;
            shell.weight = weight;
            shell
        };
        let loads = [0.0, 2.0, 0.0, 1.0, 0.0].map(load);
        let mut found = Vec::new();
        bearers(&loads, 0.1, &mut found);
        assert_eq!(found, [1, 1, 1, 3, 3]);
        bearers(&[Shell::NONE; 2], 0.1, &mut found);
        assert_eq!(found, [usize::MAX; 2]);
    }

    #[test]
    fn an_edge_that_leans_has_the_slope_of_its_displacements() {
        let cells = Cells {
            counts: [4, 6],
            low: 0.0,
            below: 0,
            spacing: 0.5,
            slab: 1.0,
        };
        let sums: Vec<[f64; 2]> = (0..6).map(|k| [2.0, 2.0 * 0.3 * f64::from(k)]).collect();
        let places = displacements(&sums, 0.1);
        assert!((places[3] - 0.9).abs() < 1e-14);
        assert!((slopes(&places, &cells)[2] - 0.6).abs() < 1e-12);
        // What no grain says is as below.
        let known = displacements(&[[1.0, 0.5], [0.0, 0.0], [0.0, 0.0]], 0.1);
        assert_eq!(known, [0.5; 3]);
    }

    /// The impedance acts along the normal alone, against the difference of velocities.
    #[test]
    fn an_impedance_resists_what_comes_near_and_nothing_along() {
        let row = Row {
            area: Vector2::new(-3.0, 4.0),
            velocity: Vector2::new(1.0, 1.0),
            ..Row::default()
        };
        let along = row.impedance(2.0, Vector2::new(4.0, 3.0));
        assert!(along.iter().all(|f| f.abs() < 1e-13), "{along:?}");
        let against = row.impedance(2.0, Vector2::new(-0.6, 0.8));
        // Z |A| times a speed of one along (-0.6, 0.8), the other way.
        assert!((against[0] - 6.0).abs() < 1e-12 && (against[1] + 8.0).abs() < 1e-12);
        assert_eq!(Row::of(&row.numbers()), row);
    }
}
