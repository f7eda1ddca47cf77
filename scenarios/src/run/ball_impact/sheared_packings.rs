//! Packings in steady shear that a box takes grains from, made before the run and kept in its directory: `sheared.h5`.

use crate::failure::Failure;
use crate::journal::Journal;
use crate::progress::Bar;
use crate::results_file::{attribute, put_in_place, read_attribute, reason};
use crate::run_directory::{RunDirectory, SHEARED};
use crate::scene::BallImpactScene;
use crate::scene::world::Materials;
use crate::seal;
use colluvium_dem::preparation::{RestMeasures, ShearedCell, Shearing, shear};
use std::ops::ControlFlow;
use std::path::Path;

const FORMAT: &str = "colluvium sheared packings 1";
/// Shear of each packing: fabric and solid fraction are steady after one or two.
const STRAIN: f64 = 4.0;

/// The packings of a run: of this run before it was stopped, or made now.
pub(super) fn packings(
    all: &[Shearing],
    scene: &str,
    directory: &RunDirectory,
) -> Result<Vec<ShearedCell>, Failure> {
    let path = directory.file(SHEARED);
    if path.exists() {
        return read(&path).map_err(|why| {
            Failure::Input(format!(
                "--resume: {} cannot be used: {why}",
                path.display()
            ))
        });
    }
    let cells = make(all, &directory.journal)?;
    write(&path, scene, &cells)?;
    Ok(cells)
}

/// What is made.
pub(super) fn wanted(
    scene: &BallImpactScene,
    materials: &Materials,
    depth: f64,
    timestep: f64,
) -> Vec<Shearing> {
    let (diameter, density) = (
        scene.grain_diameter(materials),
        scene.grain_density(materials),
    );
    let pressures = scene.sheared_pressures(crate::scene::DENSE * density, depth);
    let pairs = pressures.iter().flat_map(|pressure| {
        let all = scene.sheared_inertial();
        all.into_iter().map(move |inertial| (*pressure, inertial))
    });
    let one = |(number, (pressure, inertial))| Shearing {
        grains: scene.sheared_grains(),
        ingredients: materials.ingredients.clone(),
        laws: materials.laws.clone(),
        diameter,
        density,
        pressure,
        inertial,
        strain: STRAIN,
        timestep,
        seed: scene.seed.wrapping_add(number as u64),
    };
    pairs.enumerate().map(one).collect()
}

fn make(all: &[Shearing], journal: &Journal) -> Result<Vec<ShearedCell>, Failure> {
    let bar = Bar::new("sheared packings");
    let mut watch = |rest: &RestMeasures| {
        bar.say(&rest.to_string());
        match crate::interruption::requested() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    };
    let mut cells = Vec::new();
    for spec in all {
        let made = shear(spec, &mut watch);
        let (cell, report) =
            made.map_err(|error| Failure::Run(format!("sheared packings: {error}")))?;
        journal.note(&format!("packing of {} grains {report}", spec.grains));
        cells.push(cell);
    }
    bar.clear();
    Ok(cells)
}

/// Writes them under a temporary name and renames it when they are whole.
fn write(path: &Path, scene: &str, cells: &[ShearedCell]) -> Result<(), Failure> {
    let partial = path.with_extension("h5.partial");
    let arrays = || -> hdf5::Result<()> {
        let file = hdf5::File::create(&partial)?;
        for (number, cell) in cells.iter().enumerate() {
            let name = format!("cell_{number}");
            let numbers = cell.numbers();
            file.new_dataset_builder()
                .with_data(&numbers)
                .create(name.as_str())?;
        }
        attribute(&file, "version", env!("CARGO_PKG_VERSION"))?;
        attribute(&file, "scene", scene)?;
        attribute(&file, "cells", &cells.len().to_string())?;
        attribute(&file, "format", FORMAT)?;
        file.flush()
    };
    let done = arrays()
        .map_err(|error| reason(&error))
        .and_then(|()| seal::close(&partial).map_err(|error| error.to_string()))
        .and_then(|()| put_in_place(&partial, path).map_err(|error| error.to_string()));
    done.map_err(|error| {
        let _ = std::fs::remove_file(&partial);
        Failure::Run(format!("cannot write {}: {error}", path.display()))
    })
}

fn read(path: &Path) -> Result<Vec<ShearedCell>, String> {
    seal::check(path)?;
    let damaged = |error: hdf5::Error| format!("damaged ({})", reason(&error));
    let file = hdf5::File::open(path).map_err(damaged)?;
    let format = read_attribute(&file, "format").map_err(damaged)?;
    if format != FORMAT {
        return Err(format!("not packings of this program (format `{format}`)"));
    }
    let count = read_attribute(&file, "cells").map_err(damaged)?;
    let count: usize = count.parse().map_err(|_| "damaged (cells)".to_owned())?;
    let cell = |number: usize| {
        let rows = file
            .dataset(&format!("cell_{number}"))
            .and_then(|rows| rows.read_raw::<f64>());
        let numbers = rows.map_err(damaged)?;
        ShearedCell::of_numbers(&numbers).ok_or_else(|| "damaged (numbers of a cell)".to_owned())
    };
    (0..count).map(cell).collect()
}
