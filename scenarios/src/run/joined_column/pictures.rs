//! The continuum of a joined column through time, for pictures.

use crate::run::surface_fields::{SurfaceFields, field};
use crate::vtkhdf::{Cells, Frame, Values};
use colluvium_coupling::overlap::material_edge::MaterialEdge;

/// Cells of the continuum as quadrilaterals in the plane y = 0, in the coordinates of its grains; `counted` is 1 where totals
/// count it, behind the handshake surface, and 0 in its copy of the grains. It is what the last exchange left.
pub(super) fn cells(edge: &MaterialEdge, time: f64) -> Frame {
    let mut cells = edge.collapse().fields();
    let grid = edge.cells();
    for cell in &mut cells {
        cell.lower[0] += grid.low;
        cell.upper[0] += grid.low;
    }
    let handshake = edge.handshake();
    let counted = cells.iter().map(|cell| {
        let row = (cell.lower[1] / grid.spacing).round() as usize;
        let middle = 0.5 * (cell.lower[0] + cell.upper[0]);
        i64::from(handshake.get(row).is_none_or(|place| middle < *place))
    });
    let counted = Values::Counts(counted.collect());
    let law = &edge.spec().case.rheology;
    let fields = SurfaceFields {
        cells: &cells,
        inertia: law.diameter * law.grain_density.sqrt(),
        others: 0,
    };
    let mut frame = Frame {
        time,
        cells: Cells::Quadrilaterals,
        points: fields.quadrilaterals().collect(),
        fields: fields.of_plane(),
    };
    frame.fields.push(field("counted", "1", counted));
    frame
}
