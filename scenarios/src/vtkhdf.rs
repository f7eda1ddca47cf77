//! VTKHDF: grains, contacts and fields through time in files that ParaView opens as they are.
//!
//! Layout: group `/VTKHDF` of type `PolyData`, version 2.0, one part a time step; points and cells of all
//! steps one behind the other, and in `Steps` where each step begins.
//! Source: VTK file format documentation, "VTKHDF File Format" (Kitware).

use crate::failure::Failure;
use crate::results_file::{attribute, put_in_place, reason};
use hdf5::types::FixedAscii;
use hdf5::{Dataset, Extent, Group, H5Type};
use std::path::Path;

mod reading;

pub use reading::{read_frame, read_series};

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

/// Kinds of cells in the order of the format.
const TOPOLOGIES: [&str; 4] = ["Vertices", "Lines", "Polygons", "Strips"];
/// Values of a chunk of a dataset.
const CHUNK: usize = 4096;

impl Cells {
    fn topology(self) -> usize {
        match self {
            Cells::Points => 0,
            Cells::Lines => 1,
            Cells::Triangles | Cells::Quadrilaterals => 2,
        }
    }

    /// Points of a cell.
    pub fn points_each(self) -> usize {
        match self {
            Cells::Points => 1,
            Cells::Lines => 2,
            Cells::Triangles => 3,
            Cells::Quadrilaterals => 4,
        }
    }

    /// Points and their only cells are the same: fields of points are drawn as spheres.
    fn data(self) -> &'static str {
        match self {
            Cells::Points => "PointData",
            Cells::Lines | Cells::Triangles | Cells::Quadrilaterals => "CellData",
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

/// A file in the making.
struct Series {
    root: Group,
    cells: Cells,
    frames: usize,
}

impl Series {
    /// Lays the groups of a file whose frames all are like this one.
    fn begin(root: &Group, like: &Frame) -> hdf5::Result<Series> {
        root.new_attr::<i64>()
            .shape(2)
            .create("Version")?
            .write_raw(&[2_i64, 0])?;
        let kind = FixedAscii::<8>::from_ascii("PolyData")
            .map_err(|error| hdf5::Error::from(error.to_string()))?;
        root.new_attr::<FixedAscii<8>>()
            .create("Type")?
            .write_scalar(&kind)?;
        let counts = |at: &Group, name: &str| list::<i64>(at, name);
        counts(root, "NumberOfPoints")?;
        table::<f64>(root, "Points", 3)?;
        for topology in TOPOLOGIES {
            let group = root.create_group(topology)?;
            for name in [
                "NumberOfCells",
                "NumberOfConnectivityIds",
                "Offsets",
                "Connectivity",
            ] {
                counts(&group, name)?;
            }
        }
        let steps = root.create_group("Steps")?;
        list::<f64>(&steps, "Values")?;
        for name in ["PartOffsets", "NumberOfParts", "PointOffsets"] {
            counts(&steps, name)?;
        }
        for name in ["CellOffsets", "ConnectivityIdOffsets"] {
            table::<i64>(&steps, name, TOPOLOGIES.len())?;
        }
        let data = root.create_group(like.cells.data())?;
        let offsets = steps.create_group(&format!("{}Offsets", like.cells.data()))?;
        for field in &like.fields {
            let dataset = match field.values {
                Values::Scalars(_) => list::<f64>(&data, &field.name)?,
                Values::Vectors(_) => table::<f64>(&data, &field.name, 3)?,
                Values::Quaternions(_) => table::<f64>(&data, &field.name, 4)?,
                Values::Counts(_) => counts(&data, &field.name)?,
            };
            attribute(&dataset, "unit", &field.unit)?;
            counts(&offsets, &field.name)?;
        }
        Ok(Series {
            root: root.clone(),
            cells: like.cells,
            frames: 0,
        })
    }

    fn append(&mut self, frame: &Frame) -> hdf5::Result<()> {
        if frame.cells != self.cells {
            return Err("frames of different cells in one file".into());
        }
        let (root, data) = (&self.root, self.cells.data());
        let steps = root.group("Steps")?;
        let points = root.dataset("Points")?;
        let points_before = points.shape()[0] as i64;
        push(&steps.dataset("Values")?, &[frame.time])?;
        push(&steps.dataset("PartOffsets")?, &[self.frames as i64])?;
        push(&steps.dataset("NumberOfParts")?, &[1_i64])?;
        push(&steps.dataset("PointOffsets")?, &[points_before])?;
        push(
            &root.dataset("NumberOfPoints")?,
            &[frame.points.len() as i64],
        )?;
        push_rows(&points, &frame.points)?;
        let (mut cells_before, mut ids_before) = ([0_i64; 4], [0_i64; 4]);
        for (k, topology) in TOPOLOGIES.into_iter().enumerate() {
            let group = root.group(topology)?;
            let connectivity = group.dataset("Connectivity")?;
            let offsets = group.dataset("Offsets")?;
            // One more offset than cells in every frame.
            cells_before[k] = offsets.shape()[0] as i64 - self.frames as i64;
            ids_before[k] = connectivity.shape()[0] as i64;
            let own = k == self.cells.topology();
            let cells = if own { frame.cell_count() } else { 0 };
            let each = self.cells.points_each();
            let ids: Vec<i64> = (0..(cells * each) as i64).collect();
            let ends: Vec<i64> = (0..=cells).map(|cell| (cell * each) as i64).collect();
            push(&group.dataset("NumberOfCells")?, &[cells as i64])?;
            push(
                &group.dataset("NumberOfConnectivityIds")?,
                &[ids.len() as i64],
            )?;
            push(&offsets, &ends)?;
            push(&connectivity, &ids)?;
        }
        push_rows(&steps.dataset("CellOffsets")?, &[cells_before])?;
        push_rows(&steps.dataset("ConnectivityIdOffsets")?, &[ids_before])?;
        let offsets = steps.group(&format!("{data}Offsets"))?;
        let data = root.group(data)?;
        for field in &frame.fields {
            let dataset = data.dataset(&field.name)?;
            push(&offsets.dataset(&field.name)?, &[dataset.shape()[0] as i64])?;
            match &field.values {
                Values::Scalars(values) => push(&dataset, values)?,
                Values::Vectors(values) => push_rows(&dataset, values)?,
                Values::Quaternions(values) => push_rows(&dataset, values)?,
                Values::Counts(values) => push(&dataset, values)?,
            }
        }
        self.frames += 1;
        Ok(())
    }

    fn finish(&self) -> hdf5::Result<()> {
        self.root
            .group("Steps")?
            .new_attr::<i64>()
            .create("NSteps")?
            .write_scalar(&(self.frames as i64))
    }
}

/// An empty list that can grow.
fn list<T: H5Type>(at: &Group, name: &str) -> hdf5::Result<Dataset> {
    at.new_dataset::<T>()
        .chunk(CHUNK)
        .shuffle()
        .deflate(1)
        .shape(Extent::resizable(0))
        .create(name)
}

/// An empty table that can grow.
fn table<T: H5Type>(at: &Group, name: &str, columns: usize) -> hdf5::Result<Dataset> {
    at.new_dataset::<T>()
        .chunk((CHUNK, columns))
        .shuffle()
        .deflate(1)
        .shape((Extent::resizable(0), Extent::fixed(columns)))
        .create(name)
}

fn push<T: H5Type>(to: &Dataset, values: &[T]) -> hdf5::Result<()> {
    let from = to.shape()[0];
    to.resize(from + values.len())?;
    if values.is_empty() {
        return Ok(());
    }
    to.write_slice::<_, T, _, _>(values, from..from + values.len())
}

fn push_rows<T: H5Type, const N: usize>(to: &Dataset, rows: &[[T; N]]) -> hdf5::Result<()> {
    let from = to.shape()[0];
    to.resize((from + rows.len(), N))?;
    if rows.is_empty() {
        return Ok(());
    }
    to.write_slice::<_, T, _, _>(rows, (from..from + rows.len(), 0..N))
}

#[cfg(test)]
mod tests;
