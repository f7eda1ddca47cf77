//! Scenes of one's own: walls, boxes, fields and preparations as a file names them, against what is exact.

mod boundaries;
mod gravity;
pub mod preparations;
mod walls;

use crate::command::{Columns, succeed};
use std::path::Path;

/// Writes a scene of these sections.
fn write(folder: &Path, name: &str, sections: &[&str]) {
    std::fs::write(folder.join(name), sections.concat()).unwrap();
}

/// Runs a scene on one thread; gives its rows, whose ledger closes where there is one.
fn run(folder: &Path, scene: &str, out: &str, sets: &[&str]) -> Columns {
    let mut list = vec!["run", scene, "--out", out, "--threads", "1"];
    for set in sets {
        list.extend(["--set", set]);
    }
    succeed(folder, &list);
    let columns = Columns::read(&folder.join(out).join("history.csv"));
    let errors = columns.find("ledger_error").unwrap_or(&[]);
    assert!(errors.iter().all(|e| *e < 1e-9), "{out}: {errors:?}");
    columns
}

/// Columns of the grains at the end of a run, grain by grain.
fn grains<const N: usize>(directory: &Path, columns: [&str; N]) -> Vec<[f64; N]> {
    let file = hdf5::File::open(directory.join("results.h5")).unwrap();
    let group = file.group("grains").unwrap();
    let read = |name: &str| group.dataset(name).unwrap().read_raw::<f64>().unwrap();
    let columns = columns.map(read);
    let row = |k: usize| columns.each_ref().map(|column| column[k]);
    (0..columns[0].len()).map(row).collect()
}
