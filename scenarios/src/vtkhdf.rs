//! VTKHDF: grains, contacts and fields through time in files that ParaView opens as they are.
//!
//! Layout: group `/VTKHDF` of type `PolyData`, or `UnstructuredGrid` for cells in space, version 2.0, one part
//! a time step; points and cells of all steps one behind the other, and in `Steps` where each step begins.
//! Cells in space share the points that they have in common, so that fields can be carried from cells to
//! points.
//! Source: VTK file format documentation, "VTKHDF File Format" (Kitware).

use crate::failure::Failure;
use crate::results_file::{put_in_place, reason};
use std::path::Path;

mod reading;
mod series;

pub use reading::{read_frame, read_series};
use series::Series;

/// What the cells of a frame are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// Every point is one.
    Points,
    /// Points 2 k and 2 k + 1 are the ends of line k.
    Lines,
    /// Points 3 k to 3 k + 2 go round triangle k.
    Triangles,
    /// Points 4 k to 4 k + 3 go round quadrilateral k.
    Quadrilaterals,
    /// Points 8 k to 8 k + 3 go round the base of hexahedron k, 8 k + 4 to 8 k + 7 round its top, in the same
    /// order.
    Hexahedra,
}

/// Values of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Real numbers.
    Scalars(Vec<f64>),
    /// Vectors.
    Vectors(Vec<[f64; 3]>),
    /// Quaternions of unit length, real part first: how something is turned.
    Quaternions(Vec<[f64; 4]>),
    /// Whole numbers.
    Counts(Vec<i64>),
}

/// A named field over the cells of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Its unit; an attribute of the dataset.
    pub unit: String,
    /// One value a cell.
    pub values: Values,
}

/// One instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Time (s).
    pub time: f64,
    /// Kind of the cells.
    pub cells: Cells,
    /// Points (m).
    pub points: Vec<[f64; 3]>,
    /// Fields over the cells.
    pub fields: Vec<Field>,
}

/// All kinds; their cells have different numbers of points.
const KINDS: [Cells; 5] = [
    Cells::Points,
    Cells::Lines,
    Cells::Triangles,
    Cells::Quadrilaterals,
    Cells::Hexahedra,
];

/// Attribute of a file: points of each of its cells.
const CORNERS: &str = "PointsOfACell";

impl Cells {
    /// Points of a cell.
    pub fn points_each(self) -> usize {
        match self {
            Cells::Points => 1,
            Cells::Lines => 2,
            Cells::Triangles => 3,
            Cells::Quadrilaterals => 4,
            Cells::Hexahedra => 8,
        }
    }

    /// Points and their only cells are the same: fields of points are drawn as spheres.
    fn data(self) -> &'static str {
        match self {
            Cells::Points => "PointData",
            Cells::Lines | Cells::Triangles | Cells::Quadrilaterals | Cells::Hexahedra => {
                "CellData"
            }
        }
    }
}

impl Frame {
    fn field(&self, name: &str) -> Result<&Field, String> {
        let found = self.fields.iter().find(|f| f.name == name);
        found.ok_or_else(|| format!("no field `{name}`: written by an older version?"))
    }

    /// A field of real numbers.
    pub fn scalars(&self, name: &str) -> Result<&[f64], String> {
        match &self.field(name)?.values {
            Values::Scalars(values) => Ok(values),
            _ => Err(format!("the field `{name}` is not of real numbers")),
        }
    }

    /// A field of vectors.
    pub fn vectors(&self, name: &str) -> Result<&[[f64; 3]], String> {
        match &self.field(name)?.values {
            Values::Vectors(values) => Ok(values),
            _ => Err(format!("the field `{name}` is not of vectors")),
        }
    }

    /// A field of whole numbers.
    pub fn counts(&self, name: &str) -> Result<&[i64], String> {
        match &self.field(name)?.values {
            Values::Counts(values) => Ok(values),
            _ => Err(format!("the field `{name}` is not of whole numbers")),
        }
    }

    fn cell_count(&self) -> usize {
        self.points.len() / self.cells.points_each()
    }
}

/// Writes frames into one file, under a temporary name until it is whole.
pub fn write(
    path: &Path,
    frames: impl IntoIterator<Item = Result<Frame, Failure>>,
) -> Result<(), Failure> {
    let partial = path.with_extension("vtkhdf.partial");
    let failed = |error: String| {
        let _ = std::fs::remove_file(&partial);
        Failure::Run(format!("cannot write {}: {error}", path.display()))
    };
    let done = (|| -> Result<(), Failure> {
        let run = |error: hdf5::Error| Failure::Run(reason(&error));
        let file = hdf5::File::create(&partial).map_err(run)?;
        let root = file.create_group("VTKHDF").map_err(run)?;
        let mut series: Option<Series> = None;
        for frame in frames {
            let frame = frame?;
            match &mut series {
                Some(series) => series.append(&frame).map_err(run)?,
                None => {
                    let mut begun = Series::begin(&root, &frame).map_err(run)?;
                    begun.append(&frame).map_err(run)?;
                    series = Some(begun);
                }
            }
        }
        if let Some(series) = &series {
            series.finish().map_err(run)?;
        }
        file.flush().map_err(run)
    })();
    done.map_err(|error| failed(error.to_string()))?;
    put_in_place(&partial, path).map_err(|error| failed(error.to_string()))
}

#[cfg(test)]
mod tests;
