//! Columns that stand by friction, with nothing on their upright faces.
//!
//! A column that bears its weight w per area on its free faces' own has σ_zz = −w and σ = 0 along the axes across which it
//! is free. With n such axes, and no deviatoric stress along one across which it neither moves nor is free (plane strain),
//!
//! ```text
//! p = w/(n + 1),    s = p along the n axes,    s_zz = −n p,    |τ| = √(½ s:s) = p √(n (n + 1)/2):
//! ```
//!
//! μ ≥ 1 holds a straight face in plane strain, n = 1, and μ ≥ √3 a corner or a cylinder, n = 2. In space a face is
//! straight where nothing varies along one of the horizontal axes, all of the grid long: a piece of a round face that looks
//! straight from near by is none.

use super::ground::Ground;
use super::topology::{NONE, Topology};
use crate::grid::{Axis, Grid};
use crate::strain::stretching;

/// Cells whose filled parts differ by no more than this are alike.
const ALIKE: f64 = 1e-6;

/// Horizontal axes across which faces of matter are free. Matter that varies along none of them has no faces of its own.
pub(super) fn free_axes<const D: usize>(
    grid: &Grid<D>,
    topology: &Topology<D>,
    fractions: &[f64],
    ground: Option<&Ground<D>>,
) -> [bool; D] {
    let bounded = std::array::from_fn(|axis| axis < D - 1 && grid.axes()[axis] != Axis::Flat);
    if count(bounded) < 2 {
        return bounded;
    }
    let free = ground.map(|ground| ground.free.as_slice());
    let varies = |axis: usize| {
        (0..fractions.len()).any(|cell| {
            let next = topology.cell_neighbours[cell][axis][1];
            let differs = |part: &[f64]| (part[next] - part[cell]).abs() > ALIKE;
            next != NONE && (differs(fractions) || free.is_some_and(differs))
        })
    };
    let varying = std::array::from_fn(|axis| bounded[axis] && varies(axis));
    if count(varying) == 0 {
        bounded
    } else {
        varying
    }
}

fn count<const D: usize>(free: [bool; D]) -> usize {
    free.into_iter().filter(|free| *free).count()
}

/// Friction that holds a column that is free across these axes.
pub(super) fn friction<const D: usize>(free: [bool; D]) -> f64 {
    let n = count(free) as f64;
    (0.5 * n * (n + 1.0)).sqrt()
}

/// Pressure of such a column over its weight per area, and the components of its stress over the pressure.
pub(super) fn stress<const D: usize, const C: usize>(free: [bool; D]) -> (f64, [f64; C]) {
    let n = count(free) as f64;
    let mut stress = [0.0; C];
    for (axis, free) in free.into_iter().enumerate() {
        let along = match free {
            _ if axis == D - 1 => -n,
            true => 1.0,
            false => 0.0,
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
        assert_eq!(stress::<2, 2>([true, false]), (0.5, [1.0, 0.0]));
        for (free, needs) in [
            ([true, false, false], 1.0),
            ([true, true, false], 3.0_f64.sqrt()),
        ] {
            let (p, s) = stress::<3, 5>(free);
            let [xx, yy, zz] = deviator(s).map(|s| p * (s - 1.0));
            assert!(xx.abs() < 1e-15 && (zz + 1.0).abs() < 1e-15, "{xx} {zz}");
            let across = if free[1] { 0.0 } else { -0.5 };
            assert!((yy - across).abs() < 1e-15);
            assert!((strain_rate_norm(s) - needs).abs() < 1e-15);
            assert!((friction(free) - needs).abs() < 1e-15);
        }
    }

    /// Straight faces are free across one axis, whichever it is; corners, and what has no faces, across both.
    #[test]
    fn straight_faces_are_free_across_one_axis() {
        let grid = Grid::with_moving_surface([axis(), axis(), axis()]).unwrap();
        let free = |filled: &dyn Fn([usize; 3]) -> f64| {
            let cells = (0..8).map(|n| filled([n % 2, n / 2 % 2, n / 4]));
            let fractions: Vec<f64> = cells.collect();
            free_axes(&grid, &Topology::new(&grid), &fractions, None)
        };
        let low = |i: usize| if i == 0 { 1.0 } else { 0.0 };
        assert_eq!(free(&|[i, _, _]| low(i)), [true, false, false]);
        assert_eq!(free(&|[_, j, k]| low(j) * low(k)), [false, true, false]);
        assert_eq!(free(&|[i, j, _]| low(i) * low(j)), [true, true, false]);
        assert_eq!(free(&|[_, _, k]| low(k)), [true, true, false]);
        assert_eq!(
            free(&|[i, j, _]| low(i) * (1.0 - 2e-6 * j as f64)),
            [true, true, false]
        );
        let thin = Grid::with_moving_surface([axis(), Axis::Flat, axis()]).unwrap();
        let level = free_axes(&thin, &Topology::new(&thin), &[1.0, 1.0, 0.0, 0.0], None);
        assert_eq!(level, [true, false, false]);
    }
}
