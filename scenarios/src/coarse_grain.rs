//! Fields from grains that lie in files: `colluvium coarse-grain`.

use crate::averages::{Averages, Choice};
use crate::failure::Failure;
use crate::grain_files::{self, Unsaid};
use crate::run_directory::write_in_place;
use crate::vtkhdf;
use colluvium_coupling::coarse_graining::AveragerError;
use colluvium_dem::{ContactSample, Snapshot};
use std::path::PathBuf;

/// What is to be averaged, and how.
#[derive(Clone, Debug)]
pub struct Request {
    /// Files with grains.
    pub files: Vec<PathBuf>,
    /// What they leave unsaid.
    pub unsaid: Unsaid,
    /// The averages.
    pub choice: Choice,
    /// Directory of the tables.
    pub out: PathBuf,
}

/// Fields of all instants together; gives what was done in words.
///
/// # Errors
/// Bad input, before anything is written.
pub fn coarse_grain(request: &Request) -> Result<String, Failure> {
    let bad = |error: AveragerError| Failure::Input(error.to_string());
    if request.choice.species.windows(2).any(|w| w[1] <= w[0]) {
        return Err(Failure::Input(format!(
            "--species-radii {:?}: must rise",
            request.choice.species
        )));
    }
    let mut averages: Option<Averages> = None;
    let mut instants = 0;
    let mut forces = Forces::default();
    for file in &request.files {
        instants += grain_files::read(file, &request.unsaid, &mut |snapshot| {
            forces.see(snapshot);
            let averages = match &mut averages {
                Some(averages) => averages,
                None => {
                    let begun =
                        Averages::begin(&request.choice, &snapshot.domain, &snapshot.grains);
                    averages.insert(begun.map_err(Failure::Input)?)
                }
            };
            averages.add(snapshot).map_err(bad)
        })?;
    }
    let Some(averages) = averages else {
        return Err(Failure::Input("no grains were given".into()));
    };
    std::fs::create_dir_all(&request.out)
        .map_err(|e| Failure::Input(format!("cannot make {}: {e}", request.out.display())))?;
    for table in averages.tables() {
        let path = request.out.join(format!("{}.csv", table.name));
        write_in_place(&path, table.to_csv().as_bytes())
            .map_err(|e| Failure::Run(format!("cannot write {}: {e}", path.display())))?;
    }
    vtkhdf::write(
        &request.out.join("fields.vtkhdf"),
        [Ok(averages.frame(0.0))],
    )?;
    Ok(format!(
        "{instants} instants, {} places, kernel {:?} of {} m: {}{}",
        averages.sums().places().len(),
        request.choice.shape,
        averages.sums().kernel().width(),
        request.out.display(),
        forces.doubt()
    ))
}

/// What the forces of contacts look like.
#[derive(Default)]
struct Forces {
    central: usize,
    all: usize,
}

impl Forces {
    fn see(&mut self, snapshot: &Snapshot) {
        // Forces from text have some ten digits.
        let central = |c: &&ContactSample| {
            let across = c.force.cross(&c.arm).norm();
            across <= 1e-6 * c.force.norm() * c.arm.norm()
        };
        self.all += snapshot.contacts.len();
        self.central += snapshot.contacts.iter().filter(central).count();
    }

    fn doubt(&self) -> &'static str {
        if self.all > 0 && self.central == self.all {
            "\nwarning: all forces lie along the lines of centres, as without friction; LAMMPS' pair/local gives tangential \
             forces as p1,p2,p3, to be added by --contact-columns id1,id2,fx+p1,fy+p2,fz+p3 with its own names"
        } else {
            ""
        }
    }
}
