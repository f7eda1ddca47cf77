//! One point of the map: where its angle of repose is looked for, the slopes of its campaign, and its measurement.

use super::{Request, curve};
use crate::calibrate;
use crate::failure::Failure;
use crate::report::calibration::Campaign;
use crate::report::read_summary;
use crate::run::{self, RunOptions};
use crate::run_directory::is_run;
use crate::scene::{InclineScene, Scene, SceneBody};
use colluvium_coupling::calibration::{MapCell, Stress, WithError};
use std::path::Path;

/// Slopes of a cell above its angle of repose (degrees), at β = 0.1 and at β = 1; between them by ln β.
pub(super) const ABOVE: [[f64; 2]; 5] = [
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
pub(super) struct Cell {
    pub(super) cell: MapCell,
    pub(super) campaign: Campaign,
    pub(super) folder: String,
    pub(super) grain_steps: f64,
}

/// Checks the scenes of a point before anything is run.
///
/// # Errors
/// If one of them is out of range.
pub(super) fn check(
    scene: &Scene,
    incline: &InclineScene,
    (beta, mu_r): (f64, f64),
) -> Result<(), Failure> {
    let around = near(beta, mu_r);
    run::check(&repose_scene(incline, beta, mu_r, (around - WINDOW[0], 1))?)?;
    run::check(&campaign_scene(scene, beta, mu_r, around)?)
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
///
/// # Errors
/// What the scene refuses.
pub fn campaign_scene(scene: &Scene, beta: f64, mu_r: f64, repose: f64) -> Result<Scene, Failure> {
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
        ..RunOptions::default()
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
pub(super) fn cell(
    request: &Request,
    incline: &InclineScene,
    beta: f64,
    mu_r: f64,
) -> Result<Cell, Failure> {
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
    let of = |fit: &Option<_>, stress| curve::measured(fit.as_ref(), &result.points, stress);
    let found = of(&result.fit, Stress::MeanPressure).ok_or_else(|| {
        Failure::Run(format!(
            "no law could be fitted at beta = {beta}, mu_r = {mu_r}; see {}",
            out.display()
        ))
    })?;
    let found_zz = of(&result.fit_zz, Stress::NormalPressure);
    Ok(Cell {
        cell: MapCell {
            beta,
            mu_r,
            curve: found.curve,
            curve_zz: found_zz.map(|f| f.curve),
            repose: mean_angle(&angles),
            solid_fraction: found.solid_fraction,
            valid_i: found.valid_i,
        },
        folder: name,
        grain_steps,
        campaign,
    })
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bed_is_looked_for_near_its_angle_and_beds_are_averaged() {
        assert_eq!(near(0.2, 1.05), 28.0);
        assert_eq!(near(0.1, 0.5), 24.0);
        let angle = mean_angle(&[30.5, 31.5]);
        assert_eq!(angle.value, 31.0);
        assert!((angle.error - f64::hypot(0.5, 2.0 / 24f64.sqrt())).abs() < 1e-9);
    }
}
