//! A file in the making: its groups and datasets, to which frames are appended.

use super::{CORNERS, Cells, Frame, Values};
use crate::results_file::attribute;
use hdf5::types::FixedAscii;
use hdf5::{Dataset, Extent, Group, H5Type};
use std::borrow::Cow;
use std::collections::HashMap;

/// Kinds of cells of polygonal data in the order of the format.
const TOPOLOGIES: [&str; 4] = ["Vertices", "Lines", "Polygons", "Strips"];
/// Values of a chunk of a dataset.
const CHUNK: usize = 4096;
/// What VTK calls a hexahedron.
const HEXAHEDRON: u8 = 12;

impl Cells {
    /// Which of the kinds of polygonal data they are; cells in space are the only kind of their file.
    fn topology(self) -> usize {
        match self {
            Cells::Points | Cells::Hexahedra => 0,
            Cells::Lines => 1,
            Cells::Triangles | Cells::Quadrilaterals => 2,
        }
    }
}

/// A file in the making.
pub(super) struct Series {
    root: Group,
    cells: Cells,
    /// Groups of the kinds of cells.
    topologies: Vec<Group>,
    frames: usize,
}

impl Series {
    /// Lays the groups of a file whose frames all are like this one.
    pub(super) fn begin(root: &Group, like: &Frame) -> hdf5::Result<Series> {
        root.new_attr::<i64>()
            .shape(2)
            .create("Version")?
            .write_raw(&[2_i64, 0])?;
        // A series may hold instants without cells, or none with any: their kind stands here.
        root.new_attr::<i64>()
            .create(CORNERS)?
            .write_scalar(&(like.cells.points_each() as i64))?;
        let counts = |at: &Group, name: &str| list::<i64>(at, name);
        counts(root, "NumberOfPoints")?;
        table::<f64>(root, "Points", 3)?;
        let topologies = if like.cells == Cells::Hexahedra {
            name_kind::<16>(root, "UnstructuredGrid")?;
            list::<u8>(root, "Types")?;
            vec![root.clone()]
        } else {
            name_kind::<8>(root, "PolyData")?;
            let groups = TOPOLOGIES.iter().map(|name| root.create_group(name));
            groups.collect::<hdf5::Result<_>>()?
        };
        for group in &topologies {
            for name in [
                "NumberOfCells",
                "NumberOfConnectivityIds",
                "Offsets",
                "Connectivity",
            ] {
                counts(group, name)?;
            }
        }
        let steps = root.create_group("Steps")?;
        list::<f64>(&steps, "Values")?;
        for name in ["PartOffsets", "NumberOfParts", "PointOffsets"] {
            counts(&steps, name)?;
        }
        for name in ["CellOffsets", "ConnectivityIdOffsets"] {
            table::<i64>(&steps, name, topologies.len())?;
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
            topologies,
            frames: 0,
        })
    }

    pub(super) fn append(&mut self, frame: &Frame) -> hdf5::Result<()> {
        if frame.cells != self.cells {
            return Err("frames of different cells in one file".into());
        }
        let (root, data) = (&self.root, self.cells.data());
        let steps = root.group("Steps")?;
        let (own_points, own_ids) = match self.cells {
            Cells::Hexahedra => {
                let (points, ids) = shared(&frame.points);
                (Cow::Owned(points), ids)
            }
            _ => (
                Cow::Borrowed(frame.points.as_slice()),
                (0..frame.points.len() as i64).collect(),
            ),
        };
        let points = root.dataset("Points")?;
        let points_before = points.shape()[0] as i64;
        push(&steps.dataset("Values")?, &[frame.time])?;
        push(&steps.dataset("PartOffsets")?, &[self.frames as i64])?;
        push(&steps.dataset("NumberOfParts")?, &[1_i64])?;
        push(&steps.dataset("PointOffsets")?, &[points_before])?;
        push(&root.dataset("NumberOfPoints")?, &[own_points.len() as i64])?;
        push_rows(&points, &own_points)?;
        let (mut cells_before, mut ids_before) = (Vec::new(), Vec::new());
        for (k, group) in self.topologies.iter().enumerate() {
            let connectivity = group.dataset("Connectivity")?;
            let offsets = group.dataset("Offsets")?;
            // One more offset than cells in every frame.
            cells_before.push(offsets.shape()[0] as i64 - self.frames as i64);
            ids_before.push(connectivity.shape()[0] as i64);
            let own = k == self.cells.topology();
            let cells = if own { frame.cell_count() } else { 0 };
            let each = self.cells.points_each();
            let ids = if own { &own_ids[..cells * each] } else { &[] };
            let ends: Vec<i64> = (0..=cells).map(|cell| (cell * each) as i64).collect();
            push(&group.dataset("NumberOfCells")?, &[cells as i64])?;
            push(
                &group.dataset("NumberOfConnectivityIds")?,
                &[ids.len() as i64],
            )?;
            push(&offsets, &ends)?;
            push(&connectivity, ids)?;
        }
        if self.cells == Cells::Hexahedra {
            let kinds = vec![HEXAHEDRON; frame.cell_count()];
            push(&root.dataset("Types")?, &kinds)?;
        }
        push_row(&steps.dataset("CellOffsets")?, &cells_before)?;
        push_row(&steps.dataset("ConnectivityIdOffsets")?, &ids_before)?;
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

    pub(super) fn finish(&self) -> hdf5::Result<()> {
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

/// Appends one row to a table with a column for each kind of cells.
fn push_row(to: &Dataset, row: &[i64]) -> hdf5::Result<()> {
    match *row {
        [only] => push_rows(to, &[[only]]),
        [a, b, c, d] => push_rows(to, &[[a, b, c, d]]),
        _ => Err(format!("{} kinds of cells", row.len()).into()),
    }
}

/// Says which kind of data a file holds.
fn name_kind<const N: usize>(root: &Group, name: &str) -> hdf5::Result<()> {
    let kind =
        FixedAscii::<N>::from_ascii(name).map_err(|error| hdf5::Error::from(error.to_string()))?;
    root.new_attr::<FixedAscii<N>>()
        .create("Type")?
        .write_scalar(&kind)
}

/// Points without those that were there before, and for every point the number of the one that stands for it.
/// Points are the same where their coordinates are, to the last bit.
fn shared(points: &[[f64; 3]]) -> (Vec<[f64; 3]>, Vec<i64>) {
    let mut distinct = Vec::new();
    let mut known = HashMap::new();
    let ids = points.iter().map(|point| {
        *known.entry(point.map(f64::to_bits)).or_insert_with(|| {
            distinct.push(*point);
            distinct.len() as i64 - 1
        })
    });
    let ids = ids.collect();
    (distinct, ids)
}
