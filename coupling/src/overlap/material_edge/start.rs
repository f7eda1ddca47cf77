//! The continuum of an edge before anything moves.

use super::MaterialEdgeSpec;
use crate::overlap::OverlapError;
use colluvium_continuum::column_collapse::{Collapse, CollapseCase, Matter};
use colluvium_continuum::free_surface::SurfaceOptions;

/// A column that stands where the edge's does: at the wall of the grid, or away from it, with both faces free.
pub(super) fn column(
    spec: &MaterialEdgeSpec,
    case: &CollapseCase,
    options: &SurfaceOptions,
) -> Result<Collapse, OverlapError> {
    let mut collapse = Collapse::new(case, options)?;
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
    let fractions = (0..columns * rows).map(|cell| {
        filled(low, high, cell % columns) * filled(0.0, case.height / h, cell / columns)
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
