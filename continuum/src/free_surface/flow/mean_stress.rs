//! The stress of a cell as one value.

use super::SurfaceFlow;
use crate::free_surface::operators::points_of;
use crate::grid::{Axis, unflatten};
use crate::rheology::Rheology;
use crate::strain::shear_row;

impl<R: Rheology, const D: usize, const C: usize, const V: usize> SurfaceFlow<R, D, C, V> {
    /// Mean stress over the filled part of a cell, by the trapezoidal rule: that of the points at its corners, each for
    /// what ground leaves free of its part of the cell. Corners beyond the surface hold no stress, as the surface does
    /// not, which under a level surface gives the exact mean of what grows with the depth. At a wall along which material
    /// slides the shear across it is the wall's: the material's points there see none.
    pub fn mean_stress(&self, cell: usize) -> [f64; C] {
        let sides = self
            .grid
            .axes()
            .map(|axis| if axis == Axis::Flat { 1 } else { 2 });
        let corners = match &self.bed {
            None => sides.iter().product(),
            Some(_) => points_of(D),
        };
        let (mut sum, mut weight) = ([0.0; C], 0.0);
        for (corner, stress) in self.stresses_in(cell).iter().enumerate().take(corners) {
            let mut stress = *stress;
            let part = match &self.bed {
                None => {
                    self.take_shear_of_walls(cell, unflatten(corner, sides), &mut stress);
                    1.0
                }
                Some(ground) => ground.part(cell, corner),
            };
            weight += part;
            for (sum, s) in sum.iter_mut().zip(stress) {
                *sum += part * s;
            }
        }
        sum.map(|sum| if weight > 0.0 { sum / weight } else { 0.0 })
    }

    /// Puts the shear of sliding walls through a corner into its stress; where two of them meet, their mean.
    fn take_shear_of_walls(&self, cell: usize, side: [usize; D], stress: &mut [f64; C]) {
        let mut walls = [0.0; C];
        let mut count = [0.0; C];
        for axis in 0..D {
            let Some(place) = self.sliding.at_corner(&self.grid, axis, cell, side) else {
                continue;
            };
            for along in (0..D).filter(|along| *along != axis) {
                let row = shear_row::<D>(along.min(axis), along.max(axis));
                walls[row] += self.state.stress[place][row];
                count[row] += 1.0;
            }
        }
        for ((stress, wall), count) in stress.iter_mut().zip(walls).zip(count) {
            if count > 0.0 {
                *stress = wall / count;
            }
        }
    }
}
