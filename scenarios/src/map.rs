//! A map β, μ_R → (μ_s, μ_2, I_0, angle of repose): the angle of repose and a small campaign at every point of a grid.
//!
//! The angle of repose comes first: it says where slopes begin to flow, and the flows of the campaign lie above it by
//! amounts that shrink with β, because the friction of angular grains saturates and steeper slopes have no steady flow.
//! Every run has its own directory and is not made again when the command is given again.

mod cell;
mod curve;
mod file;
mod page;

pub use cell::campaign_scene;
pub use file::MapFile;

use crate::failure::Failure;
use crate::run_directory::write_in_place;
use crate::scene::{InclineModel, InclineScene, Scene, SceneBody};
use crate::table::Table;
use cell::{ABOVE, Cell};
use colluvium_coupling::calibration::FrictionMap;
use curve::INERTIAL_NUMBERS;
use std::path::PathBuf;

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Request {
    /// The incline whose contact law is varied.
    pub scene: Scene,
    /// Values of β.
    pub betas: Vec<f64>,
    /// Values of μ_R.
    pub rolling: Vec<f64>,
    /// Beds whose angles of repose are averaged.
    pub beds: u64,
    /// Directory of the runs and the map.
    pub out: PathBuf,
    /// Threads.
    pub threads: Option<usize>,
}

/// Measures a map; gives the paths of `map.toml` and the report.
///
/// # Errors
/// If the scene is no incline of grains with rolling springs, values are too few or out of range, or a run fails. Nothing is
/// written for bad input.
pub fn measure(request: &Request) -> Result<(PathBuf, PathBuf), Failure> {
    let incline = grains(&request.scene)?;
    let places = places(request)?;
    for &place in &places {
        cell::check(&request.scene, incline, place)?;
    }
    std::fs::create_dir_all(&request.out)
        .map_err(|error| Failure::Input(format!("--out {}: {error}", request.out.display())))?;
    let mut cells = Vec::new();
    for &(beta, mu_r) in &places {
        cells.push(cell::cell(request, incline, beta, mu_r)?);
    }
    write(request, incline, &cells)
}

fn grains(scene: &Scene) -> Result<&InclineScene, Failure> {
    match &scene.body {
        SceneBody::Incline(body)
            if body.model == InclineModel::Dem && body.contact.rolling.is_some() =>
        {
            Ok(body)
        }
        _ => Err(Failure::Input(format!(
            "map: `{}` is no incline of grains with [contact.rolling]; allowed: incline-moderate, incline-gravel, or a scene file of one of these kinds",
            scene.name
        ))),
    }
}

/// The points of the grid.
fn places(request: &Request) -> Result<Vec<(f64, f64)>, Failure> {
    let mut all = Vec::new();
    for (option, values) in [
        ("--beta", &request.betas),
        ("--rolling-friction", &request.rolling),
    ] {
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.dedup();
        let positive = sorted.iter().all(|v| v.is_finite() && *v > 0.0);
        if sorted.len() < 2 || sorted.len() != values.len() || !positive {
            return Err(Failure::Input(format!(
                "{option} {values:?}: allowed: two or more positive values, each once"
            )));
        }
        all.push(sorted);
    }
    let rolling = all.pop().unwrap_or_default();
    let betas = all.pop().unwrap_or_default();
    let row = |beta: f64| rolling.iter().map(move |mu_r| (beta, *mu_r));
    Ok(betas.iter().flat_map(|beta| row(*beta)).collect())
}

/// Writes `map.toml`, `map.csv` and the report.
fn write(
    request: &Request,
    incline: &InclineScene,
    cells: &[Cell],
) -> Result<(PathBuf, PathBuf), Failure> {
    let map = FrictionMap::new(
        INERTIAL_NUMBERS,
        cells.iter().map(|c| c.cell.clone()).collect(),
    )
    .map_err(|error| Failure::Run(error.to_string()))?;
    let grain_steps: f64 = cells.iter().map(|c| c.grain_steps).sum();
    let measured = format!(
        "{} with {} grains of {} m on {} x {} diameters, {} slopes a cell, {} s averaged after {} s, stiffness {:.4e} N/m, \
         seed {}; angles of repose of {} bed(s) each by angle-of-repose on 8 x 5 diameters; {:.2e} grain-steps",
        request.scene.name,
        incline.free_grains(),
        incline.grains.diameter,
        incline.floor.length_diameters,
        incline.floor.width_diameters,
        ABOVE.len(),
        incline.time.average,
        incline.time.relax,
        incline.stiffness(),
        incline.seed,
        request.beds,
        grain_steps
    );
    let file = MapFile {
        inertial_numbers: INERTIAL_NUMBERS,
        diameter: incline.grains.diameter,
        grain_density: incline.grains.density,
        version: env!("CARGO_PKG_VERSION").into(),
        measured,
        interpolation_error: map.error(),
        cell: map.cells().to_vec(),
    };
    let put = |name: &str, content: &[u8]| {
        let path = request.out.join(name);
        write_in_place(&path, content)
            .map_err(|error| Failure::Run(format!("cannot write {}: {error}", path.display())))
            .map(|()| path)
    };
    put("map.csv", table(cells).to_csv().as_bytes())?;
    let report = put("report.html", page::report(&file, &map, cells).as_bytes())?;
    Ok((put("map.toml", file.to_toml()?.as_bytes())?, report))
}

fn table(cells: &[Cell]) -> Table {
    let column = |f: &dyn Fn(&Cell) -> f64| cells.iter().map(f).collect::<Vec<f64>>();
    let mut table = Table::new("map")
        .with("beta", "1", column(&|c| c.cell.beta))
        .with("mu_r", "1", column(&|c| c.cell.mu_r))
        .with("repose", "degree", column(&|c| c.cell.repose.value))
        .with("repose_error", "degree", column(&|c| c.cell.repose.error));
    for (suffix, zz) in [("", false), ("_zz", true)] {
        let fit = |c: &Cell| {
            let result = &c.campaign.result;
            if zz {
                result.fit_zz.clone()
            } else {
                result.fit.clone()
            }
        };
        let of = |f: &dyn Fn(&colluvium_coupling::calibration::MuIFit) -> f64| {
            column(&|c| fit(c).map_or(f64::NAN, |x| f(&x)))
        };
        table = table
            .with(&format!("mu_s{suffix}"), "1", of(&|f| f.mu_s))
            .with(&format!("mu_s{suffix}_error"), "1", of(&|f| f.mu_s_error))
            .with(&format!("mu_2{suffix}"), "1", of(&|f| f.mu_2))
            .with(&format!("mu_2{suffix}_error"), "1", of(&|f| f.mu_2_error))
            .with(&format!("i_0{suffix}"), "1", of(&|f| f.i_0))
            .with(&format!("i_0{suffix}_error"), "1", of(&|f| f.i_0_error))
            .with(&format!("rms{suffix}"), "1", of(&|f| f.rms_residual));
    }
    for (k, i) in INERTIAL_NUMBERS.iter().enumerate() {
        let at = |c: &Cell| c.cell.curve.friction[k];
        let error = |c: &Cell| c.cell.curve.covariance[k][k].sqrt();
        table = table.with(&format!("mu_at_{i}"), "1", column(&at)).with(
            &format!("mu_at_{i}_error"),
            "1",
            column(&error),
        );
    }
    table
        .with(
            "solid_fraction",
            "1",
            column(&|c| c.cell.solid_fraction.value),
        )
        .with("valid_i_low", "1", column(&|c| c.cell.valid_i[0]))
        .with("valid_i_high", "1", column(&|c| c.cell.valid_i[1]))
        .with("grain_steps", "1", column(&|c| c.grain_steps))
}
