//! Cells of a continuum as they are painted, coloured by speed.

use super::canvas::Plate;
use super::speed_colour;
use crate::vtkhdf::{Cells, Frame};

/// Corners round the sides of a hexahedron.
const SIDES: [[usize; 4]; 6] = [
    [0, 1, 2, 3],
    [4, 5, 6, 7],
    [0, 1, 5, 4],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 0, 4, 7],
];

/// Magnitude of a velocity.
pub fn speed(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Quadrilaterals and hexahedra of a frame as triangles; `axes` takes a place to its coordinates right, up and away in the
/// picture (m), `top` is the speed of the brightest colour (m/s).
///
/// # Errors
/// What the frame lacks or holds instead.
pub fn plates(
    frame: &Frame,
    axes: impl Fn([f64; 3]) -> [f64; 3],
    top: f64,
) -> Result<Vec<Plate>, String> {
    let velocity = frame.vectors("velocity")?;
    let corners: Vec<[f64; 3]> = frame.points.iter().map(|&p| axes(p)).collect();
    let colour = |v: &[f64; 3]| speed_colour(speed(v) / top.max(f64::MIN_POSITIVE));
    let halves = |[a, b, c, d]: [[f64; 3]; 4], colour| {
        [[a, b, c], [a, c, d]].map(|corners| Plate { corners, colour })
    };
    match frame.cells {
        Cells::Quadrilaterals => {
            let cells = corners.as_chunks::<4>().0.iter().zip(velocity);
            Ok(cells.flat_map(|(c, v)| halves(*c, colour(v))).collect())
        }
        Cells::Hexahedra => {
            let cells = corners.as_chunks::<8>().0.iter().zip(velocity);
            let sides = |c: &[[f64; 3]; 8]| SIDES.map(|side| side.map(|corner| c[corner]));
            Ok(cells
                .flat_map(|(c, v)| sides(c).map(|side| halves(side, colour(v))))
                .flatten()
                .collect())
        }
        Cells::Points => Err("holds grains, not cells".into()),
        Cells::Lines => Err("holds lines, not grains or cells".into()),
        Cells::Triangles => Err("holds bodies alone, not grains or cells".into()),
    }
}

/// The same triangles, farther away than anything up to a depth (m).
pub fn behind(plates: Vec<Plate>, depth: f64) -> impl Iterator<Item = Plate> {
    plates.into_iter().map(move |plate| Plate {
        corners: plate.corners.map(|[x, y, own]| [x, y, own + depth]),
        ..plate
    })
}
