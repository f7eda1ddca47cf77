//! What a heap measures: its heights, how far it reaches.

use serde::Serialize;

use super::CylinderCollapse;

/// Where the heap is at one time; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct CylinderFront {
    /// Time (s).
    pub time: f64,
    /// Radius of the disc of the same area as the ground under a heap as high as the threshold (m).
    pub radius: f64,
    /// Where the heap reaches down to the threshold along an axis of the grid (m).
    pub along_axis: f64,
    /// The same along the diagonal between two axes (m).
    pub along_diagonal: f64,
    /// Greatest height of the heap (m).
    pub height: f64,
}

impl CylinderCollapse {
    /// Middles of the columns of cells along x, and along y (m); the axis of the cylinder is at 0.
    pub fn middles(&self) -> Vec<f64> {
        let spacing = self.case.spacing() * self.case.height;
        let first = if self.case.whole { self.case.cells } else { 0 };
        let place = |n: usize| (n as f64 + 0.5 - first as f64) * spacing;
        (0..self.case.columns()).map(place).collect()
    }

    /// Height of material in each column of cells (m), x fastest.
    pub fn heights(&self) -> Vec<f64> {
        let heights = self.flow.heights();
        heights.into_iter().map(|h| h * self.case.height).collect()
    }

    /// Heights of material above the cells of a quarter of the floor (m), x fastest, from the axis outwards.
    fn quarter_heights(&self) -> Vec<f64> {
        let columns = self.case.columns();
        let first = columns - self.case.cells;
        let heights = self.flow.heights();
        (first..columns)
            .flat_map(|j| (first..columns).map(move |i| i + columns * j))
            .map(|column| heights[column] * self.case.height)
            .collect()
    }

    /// Heights of the heap by distance from the axis: mean distance and mean height of the columns of cells
    /// in rings one cell wide (m); over ground of all around, else of a quarter.
    pub fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        match self.ground {
            None => self.rings(self.case.cells, &|n| n, &self.quarter_heights()),
            Some(_) => self.rings_of_all(&self.heights()),
        }
    }

    /// Mean heights of the ground in the same rings (m).
    pub fn ground_profile(&self) -> Vec<f64> {
        self.rings_of_all(self.ground_heights()).1
    }

    fn rings_of_all(&self, heights: &[f64]) -> (Vec<f64>, Vec<f64>) {
        self.rings(
            self.case.columns(),
            &|n| self.case.cells_to_axis(n),
            heights,
        )
    }

    /// Mean distance from the axis and mean height in rings one cell wide (m), of columns of cells, so many along each
    /// axis, of which so many lie between one and the axis.
    fn rings(
        &self,
        columns: usize,
        to_axis: &dyn Fn(usize) -> usize,
        heights: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
        let spacing = self.case.spacing() * self.case.height;
        let mut rings = vec![[0.0; 3]; self.case.cells];
        for (column, height) in heights.iter().enumerate() {
            let [x, y] = [column % columns, column / columns].map(|n| to_axis(n) as f64 + 0.5);
            let distance = x.hypot(y);
            if let Some(ring) = rings.get_mut(distance as usize) {
                ring[0] += 1.0;
                ring[1] += distance * spacing;
                ring[2] += height;
            }
        }
        let filled = rings.iter().filter(|ring| ring[0] > 0.0);
        filled.map(|[n, r, h]| (r / n, h / n)).unzip()
    }

    /// How far the heap is at least so high (m): its smallest and largest x, and y.
    pub fn reach(&self, threshold: f64) -> [[f64; 2]; 2] {
        let columns = self.case.columns();
        let (heights, middles) = (self.heights(), self.middles());
        // Where a line of heights along an axis rises to the threshold first, seen from either end.
        let edge = |line: &[f64]| {
            let first = line.iter().position(|h| *h >= threshold)?;
            Some(match first {
                0 => 0.0,
                n => n as f64 - (line[n] - threshold) / (line[n] - line[n - 1]),
            })
        };
        let spacing = self.case.spacing() * self.case.height;
        [1, columns].map(|step| {
            let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
            for n in 0..columns {
                let start = if step == 1 { n * columns } else { n };
                let mut line: Vec<f64> = (0..columns).map(|k| heights[start + k * step]).collect();
                if let Some(low) = edge(&line) {
                    reach[0] = reach[0].min(middles[0] + low * spacing);
                }
                line.reverse();
                if let Some(high) = edge(&line) {
                    reach[1] = reach[1].max(middles[columns - 1] - high * spacing);
                }
            }
            if reach[0] > reach[1] { [0.0; 2] } else { reach }
        })
    }

    /// Area on which the heap is at least so high (m²), by columns of cells; where a quarter is computed, of all four.
    pub fn covered_area(&self, threshold: f64) -> f64 {
        let covered = self.heights().iter().filter(|h| **h >= threshold).count();
        let spacing = self.case.spacing() * self.case.height;
        let quarters = if self.case.whole { 1.0 } else { 4.0 };
        quarters * covered as f64 * spacing * spacing
    }

    /// Where the heap reaches down to a height (m).
    pub fn front(&self, threshold: f64) -> CylinderFront {
        let cells = self.case.cells;
        let spacing = self.case.spacing() * self.case.height;
        let heights = self.quarter_heights();
        // Cells from the axis at which a line of heights falls to the threshold for good.
        let reach = |line: &dyn Fn(usize) -> f64| {
            let last = (0..cells).rev().find(|&i| line(i) >= threshold);
            match last {
                None => 0.0,
                Some(i) if i + 1 == cells => cells as f64,
                Some(i) => {
                    let (here, next) = (line(i), line(i + 1));
                    i as f64 + 0.5 + (here - threshold) / (here - next)
                }
            }
        };
        // Along both axes, so that neither is preferred.
        let area: f64 = (0..cells)
            .map(|n| {
                let along_x = reach(&|i| heights[i + cells * n]);
                let along_y = reach(&|j| heights[n + cells * j]);
                0.5 * (along_x + along_y)
            })
            .sum();
        CylinderFront {
            time: self.time(),
            radius: (4.0 / std::f64::consts::PI * area).sqrt() * spacing,
            along_axis: reach(&|i| heights[i]) * spacing,
            along_diagonal: reach(&|i| heights[i * (cells + 1)])
                * spacing
                * std::f64::consts::SQRT_2,
            height: heights.iter().fold(0.0, |most, h| h.max(most)),
        }
    }
}
