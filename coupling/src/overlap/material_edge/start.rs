//! The continuum of an edge before anything moves.

use super::{MaterialEdgeSpec, floor};
use crate::overlap::OverlapError;
use colluvium_continuum::column_collapse::{Collapse, CollapseCase, CollapseGround, Matter};
use colluvium_continuum::free_surface::SurfaceOptions;

/// A column that stands where the edge's does: at the wall of the grid, or away from it, with both faces free; over ground if it is given.
/// The far face may lean out.
pub(super) fn column(
    spec: &MaterialEdgeSpec,
    case: &CollapseCase,
    options: &SurfaceOptions,
    ground: Option<&CollapseGround>,
) -> Result<Collapse, OverlapError> {
    let mut collapse = match ground {
        Some(ground) => {
            floor::check(ground, spec)?;
            let ground = floor::under_grid(ground, spec)?;
            Collapse::bare_in_rows(case, options, &ground, [0.0, case.height])?
        }
        None => Collapse::new(case, options)?,
    };
    if spec.back <= spec.wall {
        return Ok(collapse);
    }
    let axes = collapse.flow().grid().axes();
    let [columns, rows] = [axes[0].cells(), axes[1].cells()];
    let h = spec.spacing();
    let [low, high] = [spec.back, spec.back + case.width()].map(|x| (x - spec.wall) / h);
    let filled = |from: f64, to: f64, cell: usize| {
        let cell = cell as f64;
        (to.min(cell + 1.0) - from.max(cell)).clamp(0.0, 1.0)
    };
    let below = (-collapse.origin()[1] / h).round();
    let (top, lean) = (case.height / h, spec.lean());
    let fractions = (0..columns * rows).map(|cell| {
        let (i, k) = (cell % columns, cell / columns);
        match lean {
            0.0 => filled(low, high, i) * filled(below, below + top, k),
            lean => {
                let row = k as f64 - below;
                let [from, to] = [row.max(0.0), (row + 1.0).min(top)];
                behind_face([low, high], lean, i, [from, to.max(from)])
            }
        }
    });
    collapse.fill(Matter {
        fractions: fractions.collect(),
        velocity: [
            vec![0.0; (columns + 1) * rows],
            vec![0.0; columns * (rows + 1)],
        ],
    })?;
    Ok(collapse)
}

/// Part of a cell of a column that lies between a face which leans out by `lean` a row and an upright one, in rows from one to
/// another: the integral of `clamp(e - face(z), 0, e - i)` over them, e the end of the column in the cell. Its mean is found from
/// how much of the face lies in the cell and beyond it, which a face that hardly leans leaves exact.
fn behind_face([low, high]: [f64; 2], lean: f64, column: usize, [from, to]: [f64; 2]) -> f64 {
    let begin = column as f64;
    let end = high.clamp(begin, begin + 1.0);
    let width = end - begin;
    let [deep, deepest] = [from, to].map(|z| end - low + lean * z);
    let rise = deepest - deep;
    if rise <= 0.0 {
        return (to - from) * deep.clamp(0.0, width);
    }
    let (first, last) = (deep.clamp(0.0, width), deepest.clamp(0.0, width));
    let beyond = (deepest - deep.max(width)).max(0.0);
    let mean = ((last - first) * 0.5 * (first + last) + beyond * width) / rise;
    (to - from) * mean.min(width)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All cells of a column together have its area, and a face that hardly leans cuts as an upright one does.
    #[test]
    fn a_leaning_face_leaves_the_area_of_the_column() {
        let (ends, top) = ([6.3, 14.8], 7.6);
        for lean in [1e-9, 0.2, 0.7] {
            let rows = |k: usize| [(k as f64).min(top), (k as f64 + 1.0).min(top)];
            let cells = (0..20).flat_map(|i| (0..9).map(move |k| (i, k)));
            let parts: Vec<f64> = cells
                .map(|(i, k)| behind_face(ends, lean, i, rows(k)))
                .collect();
            assert!(parts.iter().all(|part| (0.0..=1.0 + 1e-12).contains(part)));
            let area = (ends[1] - ends[0]) * top + 0.5 * lean * top * top;
            let sum: f64 = parts.iter().sum();
            assert!((sum / area - 1.0).abs() < 1e-6, "{lean}: {sum} {area}");
        }
        // The lower half of a cell's row behind a face that crosses it.
        assert!((behind_face([1.5, 9.0], 1.0, 1, [0.0, 1.0]) - 0.875).abs() < 1e-12);
        assert!((behind_face([6.3, 14.8], 1e-9, 6, [0.0, 1.0]) - 0.7).abs() < 1e-6);
    }
}
