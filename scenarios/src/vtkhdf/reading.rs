//! Series read back.

use super::{CORNERS, Cells, Field, Frame, KINDS, Values};
use crate::failure::Failure;
use crate::results_file::{read_attribute, reason};
use hdf5::{Dataset, Group};
use std::path::Path;

/// Reads a file of one frame that [`super::write()`] has written.
pub fn read_frame(path: &Path) -> Result<Frame, Failure> {
    read_one(path).map_err(|error| {
        let (path, reason) = (path.display(), reason(&error));
        Failure::Run(format!("cannot read the frame {path}: {reason}"))
    })
}

/// Reads all frames of a file that [`super::write()`] has written.
pub fn read_series(path: &Path) -> Result<Vec<Frame>, Failure> {
    read(path).map_err(|error| {
        let (path, reason) = (path.display(), reason(&error));
        Failure::Run(format!("cannot read the series {path}: {reason}"))
    })
}

fn read_one(path: &Path) -> hdf5::Result<Frame> {
    let mut frames = read(path)?;
    match (frames.pop(), frames.len()) {
        (Some(frame), 0) => Ok(frame),
        (_, before) => Err(format!("{} steps instead of one", before + 1).into()),
    }
}

fn read(path: &Path) -> hdf5::Result<Vec<Frame>> {
    let root = hdf5::File::open(path)?.group("VTKHDF")?;
    let cells = kind_of(&root)?;
    let times: Vec<f64> = root.dataset("Steps/Values")?.read_raw()?;
    let sizes: Vec<i64> = root.dataset("NumberOfPoints")?.read_raw()?;
    if sizes.len() != times.len() {
        return Err(format!("{} steps, but points of {}", times.len(), sizes.len()).into());
    }
    let all = vectors(&root.dataset("Points")?)?;
    let mut frames = Vec::with_capacity(times.len());
    let mut corners = match cells {
        Cells::Hexahedra => Corners::of(&root)?,
        _ => Corners::default(),
    };
    let mut begin = 0;
    for (&time, &size) in times.iter().zip(&sizes) {
        let end = begin + usize::try_from(size).map_err(|e| e.to_string())?;
        let own = all.get(begin..end).ok_or("points are missing")?;
        let points = match cells {
            Cells::Hexahedra => corners.next_of(own)?,
            _ => own.to_vec(),
        };
        frames.push(Frame {
            time,
            cells,
            points,
            fields: Vec::new(),
        });
        begin = end;
    }
    let data = root.group(cells.data())?;
    for name in data.member_names()? {
        let dataset = data.dataset(&name)?;
        let unit: String = read_attribute(&dataset, "unit")?;
        let whole = if dataset.dtype()?.is::<i64>() {
            Values::Counts(dataset.read_raw()?)
        } else if dataset.ndim() == 2 && dataset.shape()[1] == 4 {
            let numbers = dataset.read_raw::<f64>()?;
            Values::Quaternions(numbers.as_chunks::<4>().0.to_vec())
        } else if dataset.ndim() == 2 {
            Values::Vectors(vectors(&dataset)?)
        } else {
            Values::Scalars(dataset.read_raw()?)
        };
        let mut begin = 0;
        for frame in &mut frames {
            let end = begin + frame.cell_count();
            let values = whole.part(begin..end).ok_or("values are missing")?;
            begin = end;
            frame.fields.push(Field {
                name: name.clone(),
                unit: unit.clone(),
                values,
            });
        }
    }
    Ok(frames)
}

/// Kind of the cells of a file, whether it holds any or not.
fn kind_of(root: &Group) -> hdf5::Result<Cells> {
    let corners: i64 = root.attr(CORNERS)?.read_scalar()?;
    let kind = KINDS
        .into_iter()
        .find(|kind| kind.points_each() as i64 == corners);
    kind.ok_or_else(|| format!("cells of {corners} points").into())
}

/// Numbers of the shared points at the corners of cells, step by step.
#[derive(Default)]
struct Corners {
    all: Vec<i64>,
    counts: std::vec::IntoIter<i64>,
    read: usize,
}

impl Corners {
    fn of(root: &Group) -> hdf5::Result<Corners> {
        let counts: Vec<i64> = root.dataset("NumberOfConnectivityIds")?.read_raw()?;
        Ok(Corners {
            all: root.dataset("Connectivity")?.read_raw()?,
            counts: counts.into_iter(),
            read: 0,
        })
    }

    /// The points of the next step, cell by cell.
    fn next_of(&mut self, points: &[[f64; 3]]) -> hdf5::Result<Vec<[f64; 3]>> {
        let count = self.counts.next().and_then(|n| usize::try_from(n).ok());
        let end = self.read + count.ok_or("corners are missing")?;
        let ids = self.all.get(self.read..end).ok_or("corners are missing")?;
        self.read = end;
        let at = |id: &i64| usize::try_from(*id).ok().and_then(|id| points.get(id));
        ids.iter()
            .map(|id| {
                at(id)
                    .copied()
                    .ok_or_else(|| "a corner has no point".into())
            })
            .collect()
    }
}

impl Values {
    /// Some of them.
    fn part(&self, range: std::ops::Range<usize>) -> Option<Values> {
        Some(match self {
            Values::Scalars(v) => Values::Scalars(v.get(range)?.to_vec()),
            Values::Vectors(v) => Values::Vectors(v.get(range)?.to_vec()),
            Values::Quaternions(v) => Values::Quaternions(v.get(range)?.to_vec()),
            Values::Counts(v) => Values::Counts(v.get(range)?.to_vec()),
        })
    }
}

fn vectors(dataset: &Dataset) -> hdf5::Result<Vec<[f64; 3]>> {
    Ok(dataset.read_raw::<f64>()?.as_chunks::<3>().0.to_vec())
}
