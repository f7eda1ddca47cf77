//! Checkpoints: a state, to the bit, as HDF5.

use crate::failure::Failure;
use crate::results_file::{attribute, put_in_place, read_attribute};
use colluvium_dem::Record;
use std::path::Path;

const FORMAT: &str = "colluvium checkpoint 1";

/// A saved state and what belongs to it.
#[derive(Debug, Default)]
pub struct Checkpoint {
    /// Named arrays of the simulation.
    pub record: Record,
    /// Which part of the work the state belongs to, as in `bed` or `flow`.
    pub stage: String,
    /// Wall time spent so far (s).
    pub wall_s: f64,
}

/// Writes a checkpoint under a temporary name, flushes it and renames it: an interrupted write
/// leaves the one before.
pub fn write(path: &Path, scene: &str, checkpoint: &Checkpoint) -> Result<(), Failure> {
    let partial = path.with_extension("h5.partial");
    let done = write_arrays(&partial, scene, checkpoint)
        .map_err(|error| error.to_string())
        .and_then(|()| put_in_place(&partial, path).map_err(|error| error.to_string()));
    done.map_err(|error| {
        let _ = std::fs::remove_file(&partial);
        Failure::Run(format!(
            "cannot write the checkpoint {}: {error}",
            path.display()
        ))
    })
}

fn write_arrays(path: &Path, scene: &str, checkpoint: &Checkpoint) -> hdf5::Result<()> {
    let file = hdf5::File::create(path)?;
    let numbers = file.create_group("numbers")?;
    for (name, values) in &checkpoint.record.numbers {
        numbers
            .new_dataset_builder()
            .with_data(values)
            .create(flat(name).as_str())?;
    }
    let counts = file.create_group("counts")?;
    for (name, values) in &checkpoint.record.counts {
        counts
            .new_dataset_builder()
            .with_data(values)
            .create(flat(name).as_str())?;
    }
    attribute(&file, "version", env!("CARGO_PKG_VERSION"))?;
    attribute(&file, "scene", scene)?;
    attribute(&file, "stage", &checkpoint.stage)?;
    file.new_attr::<f64>()
        .create("wall_s")?
        .write_scalar(&checkpoint.wall_s)?;
    // Last, so that a file without it was not finished.
    attribute(&file, "format", FORMAT)?;
    file.flush()
}

/// An array's name without slashes, which HDF5 takes for folders.
fn flat(name: &str) -> String {
    name.replace('/', ":")
}

/// Reads a checkpoint of a scene; says what is wrong with a truncated or foreign file.
pub fn read(path: &Path, scene: &str) -> Result<Checkpoint, Failure> {
    let refuse = |why: String| {
        Failure::Input(format!(
            "--resume: {} cannot be used: {why}; nothing was changed",
            path.display()
        ))
    };
    if !path.exists() {
        return Err(refuse("there is no such checkpoint".into()));
    }
    let file = hdf5::File::open(path)
        .map_err(|error| refuse(format!("not a whole HDF5 file ({})", first_line(&error))))?;
    let foreign = |what: &str| refuse(format!("not a checkpoint of this program ({what})"));
    match read_attribute(&file, "format") {
        Ok(format) if format == FORMAT => {}
        Ok(format) => return Err(foreign(&format!("format `{format}`"))),
        Err(_) => return Err(foreign("no format")),
    }
    let of = read_attribute(&file, "scene").unwrap_or_default();
    if of != scene {
        return Err(refuse(format!(
            "it belongs to the scene `{of}`, not `{scene}`"
        )));
    }
    read_arrays(&file).map_err(|error| refuse(format!("damaged ({})", first_line(&error))))
}

fn read_arrays(file: &hdf5::File) -> hdf5::Result<Checkpoint> {
    let mut checkpoint = Checkpoint {
        stage: read_attribute(file, "stage")?,
        wall_s: file.attr("wall_s")?.read_scalar()?,
        ..Checkpoint::default()
    };
    let numbers = file.group("numbers")?;
    for name in numbers.member_names()? {
        let values = numbers.dataset(&name)?.read_raw::<f64>()?;
        checkpoint
            .record
            .numbers
            .insert(name.replace(':', "/"), values);
    }
    let counts = file.group("counts")?;
    for name in counts.member_names()? {
        let values = counts.dataset(&name)?.read_raw::<u64>()?;
        checkpoint
            .record
            .counts
            .insert(name.replace(':', "/"), values);
    }
    Ok(checkpoint)
}

fn first_line(error: &hdf5::Error) -> String {
    error
        .to_string()
        .lines()
        .next()
        .unwrap_or_default()
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Checkpoint {
        let mut record = Record::default();
        record
            .numbers
            .insert("dem/grains/place".into(), vec![1.0 / 3.0, -0.0, 5e-324]);
        record.numbers.insert("empty".into(), Vec::new());
        record.counts.insert("partner".into(), vec![0, u64::MAX]);
        Checkpoint {
            record,
            stage: "flow".into(),
            wall_s: 2.5,
        }
    }

    #[test]
    fn reads_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint.h5");
        write(&path, "incline-moderate", &example()).unwrap();
        let again = read(&path, "incline-moderate").unwrap();
        let bits = |c: &Checkpoint| -> Vec<u64> {
            c.record
                .numbers
                .values()
                .flatten()
                .map(|x| x.to_bits())
                .collect()
        };
        assert_eq!(bits(&again), bits(&example()));
        assert_eq!(again.record.counts, example().record.counts);
        assert!(again.record.numbers["empty"].is_empty());
    }

    #[test]
    fn truncated_and_foreign_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint.h5");
        write(&path, "incline-moderate", &example()).unwrap();
        assert!(
            read(&path, "incline-gravel")
                .unwrap_err()
                .to_string()
                .contains("belongs")
        );
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let message = read(&path, "incline-moderate").unwrap_err().to_string();
        assert!(message.contains("HDF5"), "{message}");
        let other = hdf5::File::create(folder.path().join("other.h5")).unwrap();
        other.flush().unwrap();
        drop(other);
        let message = read(&folder.path().join("other.h5"), "incline-moderate")
            .unwrap_err()
            .to_string();
        assert!(message.contains("not a checkpoint"), "{message}");
    }
}
