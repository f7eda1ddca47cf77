//! The continuum with the fitted laws beside the grains.

use crate::failure::Failure;
use crate::interruption;
use crate::report::calibration::{Comparison, FrictionOf};
use crate::run::bagnold;
use crate::run_directory::RunDirectory;
use crate::scene::{InclineScene, Scene, SceneBody};
use colluvium_continuum::bagnold::BagnoldCase;
use colluvium_continuum::layer::Options;
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::calibration::{MuIFit, Posterior};
use colluvium_coupling::campaign::CampaignResult;
use colluvium_coupling::incline::{InclineResult, Purpose};
use std::ops::ControlFlow;
use std::time::Instant;

/// Runs the continuum with the fitted laws at the angles of `calibration.compare_degrees`; also
/// says in words which comparisons could not be made. Only the user's wish to stop is a failure: the
/// grains' results stand without it.
pub(super) fn compare(
    body: &InclineScene,
    result: &CampaignResult,
    directory: &RunDirectory,
) -> Result<(Vec<Comparison>, Vec<String>), Failure> {
    let mut comparisons = Vec::new();
    let mut remarks = Vec::new();
    let options = solver()?;
    let fits = [
        (
            FrictionOf::Pressure,
            "|τ|/p",
            &result.fit,
            &result.posterior,
        ),
        (
            FrictionOf::NormalStress,
            "|τ|/σ_zz",
            &result.fit_zz,
            &result.posterior_zz,
        ),
    ];
    for angle in &body.calibration.compare_degrees {
        let run = result.runs.iter().find(|r| {
            r.purpose == Purpose::Measure
                && (r.slope_degrees - angle).abs() < 1e-9
                && r.profile.is_some()
        });
        let Some(run) = run else {
            remarks.push(format!(
                "Continuum at {angle} degrees: no flow was measured there, not compared."
            ));
            continue;
        };
        for (friction, name, fit, posterior) in fits {
            let Some(fit) = fit else { continue };
            match one(body, &options, fit, friction, run) {
                Ok(mut comparison) => {
                    comparison.band = band(posterior.as_ref(), &comparison);
                    comparisons.push(comparison);
                }
                Err(colluvium_continuum::Error::Stopped { .. }) => {
                    return Err(super::stopped(directory));
                }
                Err(error) => remarks.push(format!(
                    "Continuum at {angle} degrees with the fit of {name}: not compared: {error}."
                )),
            }
        }
    }
    for remark in &remarks {
        directory.journal.note(remark);
    }
    Ok((comparisons, remarks))
}

/// The solver's settings of the bundled continuum scene.
fn solver() -> Result<Options, Failure> {
    match Scene::load("bagnold", &[])?.body {
        SceneBody::Bagnold(layer) => Ok(bagnold::options(&layer)),
        _ => Ok(Options::default()),
    }
}

/// Quantiles of the velocity over that of the best law, from the posterior: in a uniform flow u ∝ I where μ(I) is the
/// slope's tangent. Samples that rest there, or have no steady flow, count as the ends.
fn band(posterior: Option<&Posterior>, comparison: &Comparison) -> Option<[f64; 5]> {
    let tangent = comparison.slope_degrees.to_radians().tan();
    let best = comparison.inertial_number;
    if !(best > 0.0 && best.is_finite()) {
        return None;
    }
    posterior?.band(|[mu_s, mu_2, i_0]| {
        if tangent <= mu_s {
            0.0
        } else if tangent >= mu_2 {
            f64::MAX
        } else {
            i_0 * (tangent - mu_s) / (mu_2 - tangent) / best
        }
    })
}

/// The continuum layer that stands beside a flow of grains.
fn one(
    body: &InclineScene,
    options: &Options,
    fit: &MuIFit,
    friction: FrictionOf,
    run: &InclineResult,
) -> Result<Comparison, colluvium_continuum::Error> {
    let slope = run.slope_degrees.to_radians();
    let case = BagnoldCase {
        slope,
        depth: run.height,
        gravity: body.gravity,
        rheology: MuI {
            mu_s: fit.mu_s,
            mu_2: fit.mu_2,
            i_0: fit.i_0,
            diameter: body.grains.diameter,
            solid_fraction: fit.solid_fraction,
            grain_density: body.grains.density,
            cohesion: 0.0,
        },
        cells: body.calibration.compare_cells as usize,
        columns: None,
    };
    let start = Instant::now();
    let solution = case.solve(options, &mut |_| {
        if interruption::requested() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })?;
    let inertial_number = case.rheology.inertial_number_at(slope.tan());
    Ok(Comparison {
        slope_degrees: run.slope_degrees,
        friction,
        inertial_number,
        inside_valid_i: (fit.valid_i[0]..=fit.valid_i[1]).contains(&inertial_number),
        velocity_error: solution.velocity_error_l2_relative,
        wall_s: start.elapsed().as_secs_f64(),
        z: solution.z,
        u: solution.u,
        p: solution.p,
        exact_u: solution.exact_u,
        band: None,
        grains_u: grains_beside(run),
    })
}

/// Mean velocity over the flow's height, of grains above the base (m/s).
fn grains_beside(run: &InclineResult) -> Option<f64> {
    let rows = &run.profile.as_ref()?.rows;
    let inside: Vec<f64> = rows
        .iter()
        .filter(|r| r.z > 0.0 && r.z < run.height)
        .map(|r| r.u.value)
        .collect();
    (!inside.is_empty()).then(|| inside.iter().sum::<f64>() / inside.len() as f64)
}
