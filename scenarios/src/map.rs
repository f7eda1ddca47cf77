//! A map β, μ_R → (μ_s, μ_2, I_0, angle of repose): the angle of repose and a small campaign at every point of a grid.
//!
//! The angle of repose comes first: it says where slopes begin to flow, and the flows of the campaign lie above it by
//! amounts that shrink with β, because the friction of angular grains saturates and steeper slopes have no steady flow.
//! Every run has its own directory and is not made again when the command is given again.

mod file;
mod page;

pub use file::MapFile;

use crate::calibrate;
use crate::failure::Failure;
use crate::report::calibration::Campaign;
use crate::report::read_summary;
use crate::run::{self, RunOptions};
use crate::run_directory::{is_run, write_in_place};
use crate::scene::{InclineModel, InclineScene, Scene, SceneBody};
use crate::table::Table;
use colluvium_coupling::calibration::{Curve, FrictionMap, MapCell, WithError};
use std::path::{Path, PathBuf};

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

/// Slopes of a cell above its angle of repose (degrees), at β = 0.1 and at β = 1; between them by ln β.
const ABOVE: [[f64; 2]; 5] = [
    [1.0, -1.0],
    [2.5, -0.25],
    [4.0, 0.5],
    [6.0, 1.5],
    [8.5, 2.75],
];
/// Where angles of repose are looked for first (degrees), by β at μ_R = 1.05: near F. Thuillet, PhD thesis, Université Côte
/// d'Azur 2019, Table 2.2.
const NEAR: [[f64; 2]; 4] = [[0.1, 25.0], [0.2, 28.0], [0.45, 33.0], [1.0, 38.0]];
/// Half of the range that is searched first, and the width at which the search ends (degrees).
const WINDOW: [f64; 2] = [4.0, 2.0];
/// Ranges that are searched at most.
const WINDOWS: u64 = 4;

/// One point of the grid, measured.
struct Cell {
    cell: MapCell,
    campaign: Campaign,
    folder: String,
    grain_steps: f64,
}

/// Measures a map; gives the paths of `map.toml` and the report.
///
/// # Errors
/// If the scene is no incline of grains with rolling springs, values are too few or out of range, or a run fails. Nothing is
/// written for bad input.
pub fn measure(request: &Request) -> Result<(PathBuf, PathBuf), Failure> {
    let incline = grains(&request.scene)?;
    let places = places(request)?;
    let mut scenes = Vec::new();
    for &(beta, mu_r) in &places {
        let first = (near(beta, mu_r) - WINDOW[0], 1);
        run::check(&repose_scene(incline, beta, mu_r, first)?)?;
        scenes.push(campaign_scene(
            &request.scene,
            beta,
            mu_r,
            near(beta, mu_r),
        )?);
    }
    for scene in &scenes {
        run::check(scene)?;
    }
    std::fs::create_dir_all(&request.out)
        .map_err(|error| Failure::Input(format!("--out {}: {error}", request.out.display())))?;
    let mut cells = Vec::new();
    for &(beta, mu_r) in &places {
        cells.push(cell(request, incline, beta, mu_r)?);
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

/// Where the angle of repose is looked for (degrees).
fn near(beta: f64, mu_r: f64) -> f64 {
    let right = NEAR
        .partition_point(|n| n[0] < beta)
        .clamp(1, NEAR.len() - 1);
    let [[a, low], [b, high]] = [NEAR[right - 1], NEAR[right]];
    let share = ((beta / a).ln() / (b / a).ln()).clamp(0.0, 1.0);
    let rolling = if mu_r > 1.05 {
        2.0 * (mu_r / 1.05).ln() / (2.0f64 / 1.05).ln()
    } else {
        -1.5 * (1.05 / mu_r).ln() / 2.1f64.ln()
    };
    (low + (high - low) * share + rolling)
        .round_ties_even()
        .clamp(10.0, 50.0)
}

/// The scene that finds the angle of repose, from `low` (degrees) on.
fn repose_scene(
    incline: &InclineScene,
    beta: f64,
    mu_r: f64,
    (low, seed): (f64, u64),
) -> Result<Scene, Failure> {
    let contact = &incline.contact;
    let twisting = contact
        .rolling
        .as_ref()
        .map_or(0.0, |r| r.twisting_friction);
    let set = [
        format!("seed={seed}"),
        "floor.length_diameters=8".to_owned(),
        "floor.width_diameters=5".to_owned(),
        "floor.filling=10".to_owned(),
        "output.pictures=0".to_owned(),
        format!("contact.restitution={}", contact.restitution),
        format!(
            "contact.tangential_restitution={}",
            contact.tangential_restitution
        ),
        format!("contact.stiffness_ratio={}", contact.stiffness_ratio),
        format!("contact.friction={}", contact.friction),
        format!("contact.twisting_friction={twisting}"),
        format!("contact.beta={beta}"),
        format!("contact.rolling_friction={mu_r}"),
        format!("search.low={low}"),
        format!("search.high={}", low + 2.0 * WINDOW[0]),
        format!("search.resolution={}", WINDOW[1]),
    ];
    Ok(Scene::load("angle-of-repose", &set)?)
}

/// The campaign of a cell whose first bed has this angle of repose (degrees).
fn campaign_scene(scene: &Scene, beta: f64, mu_r: f64, repose: f64) -> Result<Scene, Failure> {
    let along = (beta / 0.1).log10();
    let slopes: Vec<String> = ABOVE
        .iter()
        .map(|[a, b]| {
            let slope = (4.0 * (repose + a + (b - a) * along)).round() / 4.0;
            format!("{slope:?}")
        })
        .collect();
    // Starting velocities only, against σ_zz.
    let places = |x: f64| (x * 1e4).round() / 1e4;
    let mu_s = (repose - 1.0 - 2.0 * along).to_radians().tan();
    let mu_2 = mu_s + 0.50 - 0.05 * along;
    let set = [
        format!("contact.rolling.beta={beta}"),
        format!("contact.rolling.rolling_friction={mu_r}"),
        "calibration.search=false".to_owned(),
        format!("calibration.flow_degrees=[{}]", slopes.join(",")),
        format!("calibration.guess.mu_s={}", places(mu_s)),
        format!("calibration.guess.mu_2={}", places(mu_2)),
        "calibration.guess.i_0=0.6".to_owned(),
        "calibration.compare_degrees=[]".to_owned(),
    ];
    Ok(scene.with(&set, "map")?)
}

/// Runs a scene into a directory unless it has been.
fn once(scene: &Scene, out: &Path, threads: Option<usize>) -> Result<(), Failure> {
    let options = RunOptions {
        resume: is_run(out),
        out: Some(out.to_owned()),
        threads,
        checkpoint_every: None,
    };
    match scene.body {
        SceneBody::Incline(_) => calibrate::calibrate(scene, &options),
        _ => run::run(scene, &options),
    }
    .map(|_| ())
}

/// The angle of repose of one bed (degrees), and the grain-steps it took.
fn angle(
    request: &Request,
    incline: &InclineScene,
    (beta, mu_r): (f64, f64),
    folder: &Path,
    seed: u64,
) -> Result<(f64, f64), Failure> {
    let mut low = near(beta, mu_r) - WINDOW[0];
    let mut steps = 0.0;
    // Whether the range before ended too low: a bed may rest in one range at a slope where it flows in the next, and is
    // not to be sent to and fro.
    let mut upwards = None;
    for window in 1..=WINDOWS {
        let scene = repose_scene(incline, beta, mu_r, (low, seed))?;
        let name = match window {
            1 => format!("repose_{seed}"),
            _ => format!("repose_{seed}_range_{window}"),
        };
        let out = folder.join(name);
        once(&scene, &out, request.threads)?;
        let summary = read_summary(&out)?;
        let found = summary.results.get("angle_of_repose").and_then(|q| q.value);
        let found = found
            .ok_or_else(|| Failure::Run(format!("{} found no angle of repose", out.display())))?;
        steps += summary.cost.grain_steps as f64;
        // At an end of the range the angle may lie beyond.
        let width = 2.0 * WINDOW[0];
        let higher = found > low + width - WINDOW[1];
        let lower = found < low + WINDOW[1] && low > 2.0;
        if !(higher || lower) || upwards == Some(!higher) {
            return Ok((found, steps));
        }
        upwards = Some(higher);
        low = if higher {
            low + width - 2.0 * WINDOW[1]
        } else {
            (low - width + 2.0 * WINDOW[1]).max(1.0)
        };
    }
    Err(Failure::Run(format!(
        "no angle of repose was found in {WINDOWS} ranges at beta = {beta}, mu_r = {mu_r}"
    )))
}

/// Measures one point of the grid.
fn cell(request: &Request, incline: &InclineScene, beta: f64, mu_r: f64) -> Result<Cell, Failure> {
    let name = format!("beta-{beta}_mu_r-{mu_r}");
    let folder = request.out.join(&name);
    let mut grain_steps = 0.0;
    let mut angles = Vec::new();
    for seed in 1..=request.beds {
        let (found, steps) = angle(request, incline, (beta, mu_r), &folder, seed)?;
        angles.push(found);
        grain_steps += steps;
    }
    let scene = campaign_scene(&request.scene, beta, mu_r, angles[0])?;
    let out = folder.join("campaign");
    once(&scene, &out, request.threads)?;
    let campaign = Campaign::read(&out)
        .ok_or_else(|| Failure::Run(format!("{} holds no campaign", out.display())))?;
    grain_steps += campaign.result.cost.grain_steps as f64;
    let result = &campaign.result;
    let fit = result.fit.as_ref().filter(|f| f.physical).ok_or_else(|| {
        Failure::Run(format!(
            "no law could be fitted at beta = {beta}, mu_r = {mu_r}; see {}",
            out.display()
        ))
    })?;
    let fit_zz = result.fit_zz.as_ref().filter(|f| f.physical);
    Ok(Cell {
        cell: MapCell {
            beta,
            mu_r,
            curve: Curve::of(fit, INERTIAL_NUMBERS),
            curve_zz: fit_zz.map(|f| Curve::of(f, INERTIAL_NUMBERS)),
            repose: mean_angle(&angles),
            solid_fraction: WithError {
                value: fit.solid_fraction,
                error: fit.solid_fraction_error,
            },
            valid_i: fit.valid_i,
        },
        folder: name,
        grain_steps,
        campaign,
    })
}

/// Inertial numbers at which curves are kept: within what every cell measures.
const INERTIAL_NUMBERS: [f64; 3] = [0.1, 0.25, 0.5];

/// Mean over the beds. Its error is that of a bracket of the search's width, and the scatter of the beds where there are more.
fn mean_angle(angles: &[f64]) -> WithError {
    let n = angles.len() as f64;
    let value = angles.iter().sum::<f64>() / n;
    let squares: f64 = angles.iter().map(|a| (a - value).powi(2)).sum();
    let bracket = WINDOW[1] / 12f64.sqrt() / n.sqrt();
    let scatter = if n > 1.0 {
        (squares / (n * (n - 1.0))).sqrt()
    } else {
        0.0
    };
    WithError {
        value,
        error: bracket.hypot(scatter),
    }
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
    Ok((put("map.toml", file.to_toml().as_bytes())?, report))
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

#[cfg(test)]
mod tests {
    use super::*;

    fn request(scene: &str, betas: &[f64]) -> Request {
        Request {
            scene: Scene::load(scene, &[]).unwrap(),
            betas: betas.to_vec(),
            rolling: vec![0.5, 2.0],
            beds: 1,
            out: PathBuf::from("/nonexistent/never"),
            threads: Some(1),
        }
    }

    #[test]
    fn bad_requests_are_refused_before_anything_is_written() {
        let why = |r: &Request| measure(r).unwrap_err().to_string();
        assert!(why(&request("incline-glass", &[0.1, 1.0])).contains("incline-moderate"));
        assert!(why(&request("bagnold", &[0.1, 1.0])).contains("bagnold"));
        assert!(why(&request("incline-moderate", &[0.1])).contains("--beta"));
        assert!(why(&request("incline-moderate", &[0.1, -1.0])).contains("positive"));
        let far = why(&request("incline-moderate", &[0.1, 1e9]));
        assert!(far.contains("beta") && far.contains("allowed"), "{far}");
    }

    #[test]
    fn a_cell_s_campaign_has_its_law_and_slopes_about_its_angle_of_repose() {
        let scene = Scene::load("incline-moderate", &[]).unwrap();
        let made = campaign_scene(&scene, 1.0, 2.0, 39.5).unwrap();
        let SceneBody::Incline(body) = &made.body else {
            panic!("{:?}", made.name)
        };
        let rolling = body.contact.rolling.as_ref().unwrap();
        assert_eq!((rolling.beta, rolling.rolling_friction), (1.0, 2.0));
        assert_eq!(
            body.calibration.flow_degrees,
            [38.5, 39.25, 40.0, 41.0, 42.25]
        );
        assert!(!body.calibration.search);
        assert_eq!(near(0.2, 1.05), 28.0);
        assert_eq!(near(0.1, 0.5), 24.0);
        let angle = mean_angle(&[30.5, 31.5]);
        assert_eq!(angle.value, 31.0);
        assert!((angle.error - f64::hypot(0.5, 2.0 / 24f64.sqrt())).abs() < 1e-9);
    }
}
