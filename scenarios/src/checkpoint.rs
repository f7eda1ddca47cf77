//! Checkpoints: a state, to the bit, as HDF5.
//!
//! The one before the last is kept beside it. Each file ends in a seal over all bytes before it
//! ([`seal`]), so that a damaged one is found before anything is read from it.

use crate::failure::Failure;
use crate::results_file::{attribute, put_in_place, read_attribute, reason};
use crate::run_directory::{CHECKPOINT, CHECKPOINT_BEFORE};
use crate::seal;
use colluvium_dem::Record;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

const FORMAT: &str = "colluvium checkpoint 5";

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

/// The checkpoints in a run directory.
#[derive(Debug)]
pub struct Checkpoints {
    directory: PathBuf,
    /// Whether the last one is worth keeping as the one before.
    sound: bool,
}

impl Checkpoints {
    /// The checkpoints in a run directory.
    pub fn of(directory: &Path) -> Checkpoints {
        Checkpoints {
            directory: directory.to_owned(),
            sound: true,
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.join(name)
    }

    /// Whether there is one.
    pub fn exist(&self) -> bool {
        [CHECKPOINT, CHECKPOINT_BEFORE]
            .iter()
            .any(|name| self.path(name).exists())
    }

    /// Writes a checkpoint under a temporary name, flushes it and renames it; the last one becomes
    /// the one before. Wherever that is cut off, a whole one is left.
    pub fn write(&mut self, scene: &str, checkpoint: &Checkpoint) -> Result<(), Failure> {
        let path = self.path(CHECKPOINT);
        let partial = path.with_extension("h5.partial");
        let done = write_arrays(&partial, scene, checkpoint)
            .map_err(|error| reason(&error))
            .and_then(|()| {
                seal::close(&partial).map_err(|error| error.to_string())?;
                if self.sound && path.exists() {
                    std::fs::rename(&path, self.path(CHECKPOINT_BEFORE))
                        .map_err(|error| error.to_string())?;
                }
                put_in_place(&partial, &path).map_err(|error| error.to_string())
            });
        match done {
            Ok(()) => {
                self.sound = true;
                Ok(())
            }
            Err(error) => {
                let _ = std::fs::remove_file(&partial);
                let left = if self.exist() {
                    "the last one is kept"
                } else {
                    "none was written before"
                };
                Err(Failure::Run(format!(
                    "cannot write the checkpoint {}: {error}; {left}",
                    path.display()
                )))
            }
        }
    }

    /// Reads the last checkpoint that is whole, if there is any; also says when that is not the last
    /// one written.
    pub fn read(&mut self, scene: &str) -> Result<Option<(Checkpoint, Option<String>)>, Failure> {
        let [last, before] = [CHECKPOINT, CHECKPOINT_BEFORE].map(|name| self.path(name));
        if !last.exists() {
            // Cut off between two renames, or never begun.
            return if before.exists() {
                read(&before, scene).map(|checkpoint| Some((checkpoint, None)))
            } else {
                Ok(None)
            };
        }
        let failure = match read(&last, scene) {
            Ok(checkpoint) => return Ok(Some((checkpoint, None))),
            Err(failure) => failure,
        };
        if !before.exists() {
            return Err(failure);
        }
        match read(&before, scene) {
            Ok(checkpoint) => {
                self.sound = false;
                let warning = format!(
                    "{}: going on from the one before, {}",
                    failure
                        .to_string()
                        .trim_start_matches("--resume: ")
                        .trim_end_matches("; nothing was changed"),
                    before.display()
                );
                Ok(Some((checkpoint, Some(warning))))
            }
            Err(also) => Err(Failure::Input(format!(
                "{failure}; {}",
                also.to_string().trim_start_matches("--resume: ")
            ))),
        }
    }

    /// Removes what a finished run does not need.
    pub fn remove(&self) -> Result<(), Failure> {
        for name in [CHECKPOINT, CHECKPOINT_BEFORE, "checkpoint.h5.partial"] {
            let path = self.path(name);
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    let path = path.display();
                    return Err(Failure::Run(format!("cannot remove {path}: {error}")));
                }
                _ => {}
            }
        }
        Ok(())
    }
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
    attribute(&file, "format", FORMAT)?;
    file.flush()
}

/// An array's name without slashes, which HDF5 takes for folders.
fn flat(name: &str) -> String {
    name.replace('/', ":")
}

/// Reads a checkpoint of a scene; says what is wrong with a damaged or foreign file.
pub fn read(path: &Path, scene: &str) -> Result<Checkpoint, Failure> {
    let refuse = |why: String| {
        Failure::Input(format!(
            "--resume: {} cannot be used: {why}; nothing was changed",
            path.display()
        ))
    };
    seal::check(path).map_err(&refuse)?;
    let file = hdf5::File::open(path)
        .map_err(|error| refuse(format!("not a whole HDF5 file ({})", reason(&error))))?;
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
    read_arrays(&file).map_err(|error| refuse(format!("damaged ({})", reason(&error))))
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

#[cfg(test)]
mod tests {
    use super::*;

    fn example(stage: &str) -> Checkpoint {
        let mut record = Record::default();
        record
            .numbers
            .insert("dem/grains/place".into(), vec![1.0 / 3.0, -0.0, 5e-324]);
        record.numbers.insert("empty".into(), Vec::new());
        record.counts.insert("partner".into(), vec![0, u64::MAX]);
        Checkpoint {
            record,
            stage: stage.into(),
            wall_s: 2.5,
        }
    }

    const SCENE: &str = "incline-moderate";

    #[test]
    fn reads_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let mut checkpoints = Checkpoints::of(folder.path());
        assert!(checkpoints.read(SCENE).unwrap().is_none() && !checkpoints.exist());
        checkpoints.write(SCENE, &example("flow")).unwrap();
        let (again, warning) = checkpoints.read(SCENE).unwrap().unwrap();
        assert_eq!(warning, None);
        let bits = |c: &Checkpoint| -> Vec<u64> {
            c.record
                .numbers
                .values()
                .flatten()
                .map(|x| x.to_bits())
                .collect()
        };
        assert_eq!(bits(&again), bits(&example("flow")));
        assert_eq!(again.record.counts, example("flow").record.counts);
        assert!(again.record.numbers["empty"].is_empty());
        checkpoints.remove().unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_found_and_the_one_before_takes_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(CHECKPOINT);
        let mut checkpoints = Checkpoints::of(folder.path());
        checkpoints.write(SCENE, &example("first")).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        // Alone, a damaged file is refused.
        for at in (0..bytes.len()).step_by(97) {
            let mut flipped = bytes.clone();
            flipped[at] ^= 1 << (at % 8);
            for damaged in [&flipped[..], &bytes[..at]] {
                std::fs::write(&path, damaged).unwrap();
                let message = checkpoints.read(SCENE).unwrap_err().to_string();
                assert!(
                    message.contains("checkpoint.h5") && message.contains("damaged"),
                    "{message}"
                );
            }
        }
        std::fs::write(&path, &bytes).unwrap();
        checkpoints.write(SCENE, &example("second")).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let (one, warning) = checkpoints.read(SCENE).unwrap().unwrap();
        assert_eq!(one.stage, "first");
        assert!(warning.unwrap().contains("the one before"));
        // The next one does not push the damaged one into the place of the sound one.
        checkpoints.write(SCENE, &example("third")).unwrap();
        let stage = |name: &str| read(&folder.path().join(name), SCENE).unwrap().stage;
        assert_eq!(
            [stage(CHECKPOINT), stage(CHECKPOINT_BEFORE)],
            ["third", "first"]
        );
        checkpoints.write(SCENE, &example("fourth")).unwrap();
        assert_eq!(
            [stage(CHECKPOINT), stage(CHECKPOINT_BEFORE)],
            ["fourth", "third"]
        );
        // Cut off between the two renames: the one before is the last.
        std::fs::remove_file(&path).unwrap();
        let (one, warning) = checkpoints.read(SCENE).unwrap().unwrap();
        assert_eq!((one.stage.as_str(), warning), ("third", None));
    }

    #[test]
    fn foreign_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut checkpoints = Checkpoints::of(folder.path());
        checkpoints.write(SCENE, &example("flow")).unwrap();
        let message = checkpoints.read("incline-gravel").unwrap_err().to_string();
        assert!(message.contains("belongs"), "{message}");
        let path = folder.path().join("other.h5");
        hdf5::File::create(&path).unwrap().flush().unwrap();
        let message = read(&path, SCENE).unwrap_err().to_string();
        assert!(message.contains("not a file of this"), "{message}");
        // A sealed file of something else.
        seal::close(&path).unwrap();
        let message = read(&path, SCENE).unwrap_err().to_string();
        assert!(message.contains("not a checkpoint"), "{message}");
        let message = read(folder.path(), SCENE).unwrap_err().to_string();
        assert!(message.contains("cannot be used"), "{message}");
    }

    #[test]
    fn a_checkpoint_that_cannot_be_written_leaves_the_last_one() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        std::fs::create_dir(&run).unwrap();
        let mut checkpoints = Checkpoints::of(&run);
        checkpoints.write(SCENE, &example("first")).unwrap();
        // The temporary name is taken by a folder: as good as a full disk.
        std::fs::create_dir(run.join("checkpoint.h5.partial")).unwrap();
        let message = checkpoints.write(SCENE, &example("second")).unwrap_err();
        assert!(
            message.to_string().contains("the last one is kept"),
            "{message}"
        );
        assert_eq!(checkpoints.read(SCENE).unwrap().unwrap().0.stage, "first");
        // The whole folder has gone.
        std::fs::remove_dir_all(&run).unwrap();
        let message = checkpoints.write(SCENE, &example("third")).unwrap_err();
        assert!(
            message.to_string().contains("none was written"),
            "{message}"
        );
        assert!(!run.exists());
    }
}
