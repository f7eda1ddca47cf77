//! Pictures of a run through time: `grains.vtkhdf`, `contacts.vtkhdf`, `bodies.vtkhdf`, `clumps.vtkhdf`, `continuum.vtkhdf`,
//! `fields.vtkhdf`.
//!
//! While a run goes on, every instant lies in a file of its own in the folder `frames`, put in place
//! whole: a killed run or a full disk leaves all earlier ones, and a run that is resumed writes the same
//! ones again. At the end they are joined into one file each.

use crate::failure::Failure;
use crate::vtkhdf::{self, Cells, Field, Frame, Values};
use colluvium_dem::{Clusters, ContactSample, GrainSample, Partner, Simulation, Snapshot};
use nalgebra::Vector3;
use std::fs;
use std::path::{Path, PathBuf};

pub mod rigid;

/// Folder of single frames in a run directory.
pub const FOLDER: &str = "frames";
/// Series at the end of a run with grains.
pub const SERIES: [&str; 2] = ["grains", "contacts"];
/// Series at the end of a run with bodies, and of one with clumps.
pub const RIGID: [&str; 2] = ["bodies", "clumps"];
/// Series of a continuum beside grains.
pub const CONTINUUM: &str = "continuum";
/// Series at the end of a run of a continuum.
pub const FIELDS: &str = "fields";

/// The frames of a run.
#[derive(Debug)]
pub struct Frames {
    directory: PathBuf,
    /// Steps of the run.
    steps: u64,
    /// How many frames it has besides that of the start; none writes no files.
    count: u64,
    /// Which of the series [`RIGID`] it has.
    rigid: [bool; 2],
    /// Whether it has the series [`CONTINUUM`].
    continuum: bool,
}

impl Frames {
    /// Frames of a run of so many steps, `count` besides that of the start, at equal distances.
    pub fn new(directory: &Path, steps: u64, count: u64) -> Frames {
        Frames {
            directory: directory.to_owned(),
            steps,
            count: count.min(steps),
            rigid: [false; 2],
            continuum: false,
        }
    }

    /// Takes bodies along, and clumps.
    pub fn with_rigid(mut self, bodies: bool, clumps: bool) -> Frames {
        self.rigid = [bodies, clumps];
        self
    }

    /// Takes a continuum along.
    pub fn with_continuum(mut self, continuum: bool) -> Frames {
        self.continuum = continuum;
        self
    }

    /// The series that it has.
    fn series(&self) -> impl Iterator<Item = &'static str> {
        let rigid = RIGID.into_iter().zip(self.rigid);
        let rigid = rigid.filter_map(|(series, given)| given.then_some(series));
        let continuum = self.continuum.then_some(CONTINUUM);
        SERIES.into_iter().chain(rigid).chain(continuum)
    }

    fn step_of(&self, frame: u64) -> u64 {
        (u128::from(frame) * u128::from(self.steps) / u128::from(self.count.max(1))) as u64
    }

    /// The first step after `done` at which a frame is taken, if there is one.
    pub fn next(&self, done: u64) -> Option<u64> {
        if self.count == 0 || done >= self.steps {
            return None;
        }
        let at = (u128::from(done) * u128::from(self.count) / u128::from(self.steps)) as u64;
        (at..=self.count)
            .map(|frame| self.step_of(frame))
            .find(|&step| step > done)
    }

    /// Whether a frame is due at a step.
    pub fn is_due(&self, step: u64) -> bool {
        let due = || step.checked_sub(1).and_then(|before| self.next(before)) == Some(step);
        self.count > 0 && (step == 0 || due())
    }

    /// Writes what the continuum is at a step at which a frame is due.
    pub fn take_continuum(&self, step: u64, frame: Frame) -> Result<(), Failure> {
        put(&self.directory, CONTINUUM, step, frame)
    }

    /// Writes a frame if one is due at this step; `snapshot` is room for it.
    pub fn take(
        &self,
        simulation: &mut Simulation,
        snapshot: &mut Snapshot,
    ) -> Result<(), Failure> {
        let step = simulation.steps_done();
        if !self.is_due(step) {
            return Ok(());
        }
        simulation.snapshot(snapshot);
        let clusters = simulation.clusters();
        let frames = [grains(snapshot, &clusters), contacts(snapshot)];
        for (series, frame) in SERIES.into_iter().zip(frames) {
            put(&self.directory, series, step, frame)?;
        }
        let [bodies, clumps] = self.rigid;
        if bodies {
            let frame = rigid::bodies(simulation, snapshot);
            put(&self.directory, RIGID[0], step, frame)?;
        }
        if clumps {
            put(&self.directory, RIGID[1], step, rigid::clumps(simulation))?;
        }
        Ok(())
    }

    /// Joins all frames up to the last step `done` into one file a series. The single ones stay until the run
    /// is done: one that is killed in between joins them again.
    pub fn join(&self, done: u64) -> Result<(), Failure> {
        if self.count == 0 {
            return Ok(());
        }
        let mut steps: Vec<u64> = (0..=self.count).map(|frame| self.step_of(frame)).collect();
        steps.dedup();
        steps.retain(|&step| step <= done);
        for series in self.series() {
            join(&self.directory, series, &steps)?;
        }
        Ok(())
    }
}

/// Writes one frame of a series.
pub fn put(directory: &Path, series: &str, number: u64, frame: Frame) -> Result<(), Failure> {
    let folder = directory.join(FOLDER);
    fs::create_dir_all(&folder).map_err(|error| {
        Failure::Run(format!(
            "cannot make the folder {}: {error}",
            folder.display()
        ))
    })?;
    vtkhdf::write(&path(directory, series, number), [Ok(frame)])
}

/// Joins single frames into the file of their series.
pub fn join(directory: &Path, series: &str, numbers: &[u64]) -> Result<(), Failure> {
    let frames = numbers
        .iter()
        .map(|&number| vtkhdf::read_frame(&path(directory, series, number)));
    vtkhdf::write(&directory.join(format!("{series}.vtkhdf")), frames)
}

fn path(directory: &Path, series: &str, number: u64) -> PathBuf {
    let name = format!("{series}_{number:012}.vtkhdf");
    directory.join(FOLDER).join(name)
}

/// Removes the single frames of a run directory; files of other names stay.
pub fn remove(directory: &Path) -> std::io::Result<()> {
    let folder = directory.join(FOLDER);
    if !folder.is_dir() {
        return Ok(());
    }
    let own = |name: &str| {
        let mut all = SERIES.iter().chain(&RIGID).chain([&CONTINUUM, &FIELDS]);
        let series = all.any(|series| name.starts_with(&format!("{series}_")));
        series && (name.ends_with(".vtkhdf") || name.ends_with(".partial"))
    };
    for entry in fs::read_dir(&folder)? {
        let entry = entry?;
        if entry.file_name().to_str().is_some_and(own) {
            fs::remove_file(entry.path())?;
        }
    }
    match fs::remove_dir(&folder) {
        Err(error) if error.kind() != std::io::ErrorKind::DirectoryNotEmpty => Err(error),
        _ => Ok(()),
    }
}

fn field(name: &str, unit: &str, values: Values) -> Field {
    Field {
        name: name.into(),
        unit: unit.into(),
        values,
    }
}

fn vectors(values: impl Iterator<Item = Vector3<f64>>) -> Values {
    Values::Vectors(values.map(Into::into).collect())
}

/// Grains as points, in the order of their numbers.
pub fn grains(snapshot: &Snapshot, clusters: &Clusters) -> Frame {
    let (force, touching) = sums(snapshot);
    let mut order: Vec<usize> = (0..snapshot.grains.len()).collect();
    order.sort_by_key(|&g| snapshot.grains[g].id);
    let of = |read: fn(&GrainSample) -> Vector3<f64>| {
        vectors(order.iter().map(|&g| read(&snapshot.grains[g])))
    };
    let scalars = |read: fn(&GrainSample) -> f64| {
        Values::Scalars(order.iter().map(|&g| read(&snapshot.grains[g])).collect())
    };
    let counts =
        |read: &dyn Fn(usize) -> i64| Values::Counts(order.iter().map(|&g| read(g)).collect());
    let first = |g: usize| i64::from(clusters.list[clusters.of[g]].first);
    Frame {
        time: snapshot.time,
        cells: Cells::Points,
        points: order
            .iter()
            .map(|&g| snapshot.grains[g].position.into())
            .collect(),
        fields: vec![
            field("id", "1", counts(&|g| i64::from(snapshot.grains[g].id))),
            field("radius", "m", scalars(|g| g.radius)),
            field("mass", "kg", scalars(|g| g.mass)),
            field("velocity", "m/s", of(|g| g.velocity)),
            field("spin", "rad/s", of(|g| g.spin)),
            field("force", "N", vectors(order.iter().map(|&g| force[g]))),
            field("contacts", "1", counts(&|g| touching[g])),
            field("cluster", "1", counts(&first)),
            field(
                "clump",
                "number of its first grain, -1 for a grain alone",
                counts(&|g| snapshot.grains[g].clump.map_or(-1, i64::from)),
            ),
            field(
                "fixed",
                "1",
                counts(&|g| i64::from(snapshot.grains[g].fixed)),
            ),
        ],
    }
}

/// Force of all contacts and bonds on each grain (N), and the number of its contacts.
fn sums(snapshot: &Snapshot) -> (Vec<Vector3<f64>>, Vec<i64>) {
    let n = snapshot.grains.len();
    let (mut force, mut touching) = (vec![Vector3::zeros(); n], vec![0; n]);
    for contact in &snapshot.contacts {
        force[contact.grain] += contact.force;
        touching[contact.grain] += 1;
        if let Partner::Grain(j) = contact.partner {
            force[j] -= contact.force;
            touching[j] += 1;
        }
    }
    for bond in &snapshot.bonds {
        let [i, j] = bond.grains;
        force[i] += bond.force;
        force[j] -= bond.force;
    }
    (force, touching)
}

/// Kind of a line in `contacts.vtkhdf`.
#[derive(Clone, Copy)]
enum Kind {
    Pair,
    Wall,
    Bond,
}

/// One contact or bond: its line, and what acts along it.
struct Link {
    contact: ContactSample,
    kind: Kind,
    stress: [f64; 2],
}

/// Contacts and bonds as lines from centre to centre, to the contact point at walls; a line across a
/// periodic boundary leaves the box at its second end.
pub fn contacts(snapshot: &Snapshot) -> Frame {
    let grains = &snapshot.grains;
    let touching = snapshot.contacts.iter().map(|contact| Link {
        contact: *contact,
        kind: match contact.partner {
            Partner::Grain(_) => Kind::Pair,
            Partner::Wall(_) | Partner::Body(_) => Kind::Wall,
        },
        stress: [0.0; 2],
    });
    let bonded = snapshot.bonds.iter().map(|bond| Link {
        contact: bond.as_contact(),
        kind: Kind::Bond,
        stress: [bond.stress.tensile, bond.stress.shear],
    });
    let ends = |c: &ContactSample| {
        let at = grains[c.grain].position;
        [at, at + c.arm - c.partner_arm]
    };
    let other = |c: &ContactSample| match c.partner {
        Partner::Grain(j) => i64::from(grains[j].id),
        Partner::Wall(_) | Partner::Body(_) => -1,
    };
    let links: Vec<Link> = touching.chain(bonded).collect();
    let scalars = |read: fn(&Link) -> f64| Values::Scalars(links.iter().map(read).collect());
    Frame {
        time: snapshot.time,
        cells: Cells::Lines,
        points: links
            .iter()
            .flat_map(|link| ends(&link.contact))
            .map(Into::into)
            .collect(),
        fields: vec![
            field(
                "force",
                "N",
                vectors(links.iter().map(|link| link.contact.force)),
            ),
            field("overlap", "m", scalars(|link| link.contact.overlap)),
            field(
                "first",
                "id of the grain the force acts on",
                Values::Counts(
                    links
                        .iter()
                        .map(|l| i64::from(grains[l.contact.grain].id))
                        .collect(),
                ),
            ),
            field(
                "second",
                "id of the other grain, -1 for a wall",
                Values::Counts(links.iter().map(|l| other(&l.contact)).collect()),
            ),
            field("arm", "m", vectors(links.iter().map(|l| l.contact.arm))),
            field(
                "torque",
                "N m",
                vectors(links.iter().map(|l| l.contact.torque)),
            ),
            field(
                "other_torque",
                "N m",
                vectors(links.iter().map(|l| l.contact.partner_torque)),
            ),
            field(
                "kind",
                "0 pair of grains, 1 wall, 2 bond",
                Values::Counts(links.iter().map(|link| link.kind as i64).collect()),
            ),
            field("bond_tension", "Pa", scalars(|link| link.stress[0])),
            field("bond_shear", "Pa", scalars(|link| link.stress[1])),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_fall_on_equal_steps() {
        let frames = Frames::new(Path::new("nowhere"), 10, 4);
        let mut steps = vec![0];
        while let Some(step) = frames.next(steps[steps.len() - 1]) {
            steps.push(step);
        }
        assert_eq!(steps, [0, 2, 5, 7, 10]);
        assert_eq!(Frames::new(Path::new("nowhere"), 10, 0).next(0), None);
        // No more frames than steps.
        assert_eq!(Frames::new(Path::new("nowhere"), 2, 9).next(0), Some(1));
    }
}
