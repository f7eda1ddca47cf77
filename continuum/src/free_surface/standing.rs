//! Columns that stand by friction, with nothing on their upright faces.
//!
//! A column that bears its weight w per area on its free faces' own has σ_zz = −w and σ = 0 along the axes across which it
//! is free. With n such axes, and no deviatoric stress along one across which it neither moves nor is free (plane strain),
//!
//! ```text
//! p = w/(n + 1),    s = p along the n axes,    s_zz = −n p,    |τ| = √(½ s:s) = p √(n (n + 1)/2):
//! ```
//!
//! μ ≥ 1 holds a straight face in plane strain, n = 1, and μ ≥ √3 a corner or a cylinder, n = 2.

use crate::grid::{Axis, Grid};
use crate::strain::stretching;

/// Horizontal axes along which something may vary.
pub(super) fn free_axes<const D: usize>(grid: &Grid<D>) -> usize {
    let axes = grid.axes()[..D - 1].iter();
    axes.filter(|axis| **axis != Axis::Flat).count()
}

/// Friction that holds a column that is free across so many axes.
pub(super) fn friction(axes: usize) -> f64 {
    let n = axes as f64;
    (0.5 * n * (n + 1.0)).sqrt()
}

/// Pressure of such a column over its weight per area, and the components of its stress over the pressure.
pub(super) fn stress<const D: usize, const C: usize>(grid: &Grid<D>) -> (f64, [f64; C]) {
    let n = free_axes(grid) as f64;
    let mut stress = [0.0; C];
    for (axis, kind) in grid.axes().iter().enumerate() {
        let along = match kind {
            _ if axis == D - 1 => -n,
            Axis::Flat => 0.0,
            _ => 1.0,
        };
        for &(row, factor) in stretching::<D>(axis) {
            stress[row] += 0.5 * factor * along;
        }
    }
    (1.0 / (n + 1.0), stress)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Boundary;
    use crate::rheology::strain_rate_norm;
    use crate::strain::deviator;

    fn axis() -> Axis {
        Axis::Bounded {
            length: 1.0,
            cells: 2,
            low: Boundary::FreeSlip,
            high: Boundary::FreeSlip,
        }
    }

    /// σ_zz = −w and nothing across free faces; |τ|/p is the friction that it takes.
    #[test]
    fn columns_bear_their_weight_with_nothing_on_their_faces() {
        let plane = Grid::with_moving_surface([axis(), axis()]).unwrap();
        assert_eq!(stress::<2, 2>(&plane), (0.5, [1.0, 0.0]));
        for (y, needs) in [(Axis::Flat, 1.0), (axis(), 3.0_f64.sqrt())] {
            let grid = Grid::with_moving_surface([axis(), y, axis()]).unwrap();
            let (p, s) = stress::<3, 5>(&grid);
            let [xx, yy, zz] = deviator(s).map(|s| p * (s - 1.0));
            assert!(xx.abs() < 1e-15 && (zz + 1.0).abs() < 1e-15, "{xx} {zz}");
            let across = if y == Axis::Flat { -0.5 } else { 0.0 };
            assert!((yy - across).abs() < 1e-15);
            assert!((strain_rate_norm(s) - needs).abs() < 1e-15);
            assert!((friction(free_axes(&grid)) - needs).abs() < 1e-15);
        }
    }
}
