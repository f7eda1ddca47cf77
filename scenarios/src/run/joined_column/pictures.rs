//! The continuum of a joined column through time, for pictures.

use crate::run::surface_fields::{SurfaceFields, field};
use crate::vtkhdf::{Cells, Frame, Values};
use colluvium_coupling::overlap::material_edge::GrainZone;

/// Cells of the continuum as quadrilaterals in the plane y = 0, in the coordinates of its grains; `counted` is 1 where totals
/// count it, behind the handshake surface, and 0 in its copy of the grains; `edge` is the number of the continuum that it belongs to,
/// along x from 0. It is what the last exchange left. Of a continuum that runs over ground that follows, where `ground` is 1.
pub(super) fn cells(zone: &GrainZone, time: f64) -> Frame {
    let (mut cells, mut counted, mut edges) = (Vec::new(), Vec::new(), Vec::new());
    for (number, continuum) in zone.fields().into_iter().enumerate() {
        for (cell, is_counted) in continuum {
            cells.push(cell);
            counted.push(i64::from(is_counted));
            edges.push(number as i64);
        }
    }
    let over = zone.continua().iter();
    let ground: Vec<[[f64; 2]; 4]> = over.flat_map(|own| own.ground_outline()).collect();
    let is_ground = |of: i64| std::iter::repeat_n(of, ground.len());
    counted.extend(is_ground(0));
    edges.extend(is_ground(0));
    // All continua are of one material.
    let law = zone.edges().first().map(|edge| edge.spec().case.rheology);
    let inertia = law.map_or(0.0, |law| law.diameter * law.grain_density.sqrt());
    let fields = SurfaceFields {
        cells: &cells,
        inertia,
        others: ground.len(),
    };
    let corners = ground.iter().flatten().map(|&[x, z]| [x, 0.0, z]);
    let mut frame = Frame {
        time,
        cells: Cells::Quadrilaterals,
        points: fields.quadrilaterals().chain(corners).collect(),
        fields: fields.of_plane(),
    };
    for (name, values) in [("counted", counted), ("edge", edges)] {
        let values = Values::Counts(values);
        frame.fields.push(field(name, "1", values));
    }
    if !ground.is_empty() {
        let of_cells = std::iter::repeat_n(0, cells.len());
        let values = Values::Counts(of_cells.chain(is_ground(1)).collect());
        frame.fields.push(field("ground", "1", values));
    }
    frame
}
