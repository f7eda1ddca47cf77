//! How the copy beyond the handshake surface moves: as its grains do.
//!
//! ```text
//! u += (1 − e^(−Δt/t_f)) (v̄ − u),      v̄ = Σ M v̄_c/Σ M
//! ```
//! on a face between two cells of the copy, v̄_c and M the mean velocity and the mass of the grains of each, Δt since the last time, t_f the
//! time in which the copy follows; at once on faces beside no full cell. Without grains it rests.

use nalgebra::SVector;

/// Cells with less than this part of a full cell's mass in grains have no velocity to follow.
pub(super) const LEAST: f64 = 0.05;

/// What follows.
pub(super) struct Following<const D: usize> {
    /// Cells along each axis.
    pub counts: [usize; D],
    /// Faces up to this one along each axis are walls, or ground, and the last ones are walls.
    pub walls: [usize; D],
    /// Mass of a full cell (kg).
    pub full: f64,
    /// Part of the difference that is taken back on faces beside full cells.
    pub part: f64,
    /// Unit of the continuum's velocities (m/s).
    pub unit: f64,
}

impl<const D: usize> Following<D> {
    /// Moves the copy that fills these fractions; `grains` are the mass (kg) and momentum (N s) of those of a cell.
    pub fn follow(
        &self,
        velocity: &mut [Vec<f64>; D],
        fractions: &[f64],
        is_copy: impl Fn(usize) -> bool,
        grains: impl Fn(usize) -> (f64, SVector<f64, D>),
    ) {
        for (axis, velocity) in velocity.iter_mut().enumerate() {
            let step = self.counts[..axis].iter().product::<usize>();
            for (face, u) in velocity.iter_mut().enumerate() {
                let (mut rest, mut high, mut stride, mut place) = (face, 0, 1, 0);
                for (other, &count) in self.counts.iter().enumerate() {
                    let faces = count + usize::from(other == axis);
                    let index = rest % faces;
                    rest /= faces;
                    high += index * stride;
                    stride *= count;
                    if other == axis {
                        place = index;
                    }
                }
                if place <= self.walls[axis] || place == self.counts[axis] {
                    continue;
                }
                let pair = [high - step, high];
                if !pair.into_iter().all(&is_copy) {
                    continue;
                }
                let [low, high] = pair.map(&grains);
                let mass = low.0 + high.0;
                if mass < LEAST * self.full {
                    *u = 0.0;
                    continue;
                }
                let mean = (low.1[axis] + high.1[axis]) / mass / self.unit;
                let is_inside = pair.into_iter().any(|cell| fractions[cell] > 0.5);
                *u += if is_inside { self.part } else { 1.0 } * (mean - *u);
            }
        }
    }
}
