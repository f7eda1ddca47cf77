//! The continuum with the fitted laws beside the grains.

use crate::failure::Failure;
use crate::interruption;
use crate::report::calibration::{Comparison, FrictionOf};
use crate::run::steady_layer;
use crate::run_directory::RunDirectory;
use crate::scene::{InclineScene, Scene, SceneBody};
use colluvium_continuum::bagnold::BagnoldCase;
use colluvium_continuum::layer::Options;
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::calibration::{
    BulkFlow, Discrepancy, LocalPoint, MuIFit, Posterior, Stress, band, law_of,
};
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
    let flows: Vec<BulkFlow> = result
        .runs
        .iter()
        .filter(|r| result.points.iter().any(|p| used(p, r)))
        .filter_map(|r| Sides::of(body, r).map(|s| s.bulk))
        .collect();
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
        let Some(sides) = Sides::of(body, run) else {
            remarks.push(format!(
                "Continuum at {angle} degrees: the flow has too few layers in its bulk, or its momentum was not booked; not compared."
            ));
            continue;
        };
        for (friction, name, fit, posterior) in fits {
            let Some(fit) = fit else { continue };
            match sides.beside(&options, fit, friction, result.pressure_ratio) {
                Ok(mut comparison) => {
                    comparison.band = sides.band(&flows, fit, posterior.as_ref(), body.seed);
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

/// Whether a point is one of the run's.
fn used(point: &LocalPoint, run: &InclineResult) -> bool {
    run.purpose == Purpose::Measure && run.points.contains(point)
}

/// The solver's settings of the bundled continuum scene.
fn solver() -> Result<Options, Failure> {
    match Scene::load("bagnold", &[])?.body {
        SceneBody::Bagnold(layer) => Ok(steady_layer::options(&layer.solver)),
        _ => Ok(Options::default()),
    }
}

/// A flow of grains, and what a continuum layer has to share with it.
struct Sides<'a> {
    body: &'a InclineScene,
    run: &'a InclineResult,
    bulk: BulkFlow,
    /// Heights of the bulk's layers (m).
    heights: Vec<f64>,
    /// Mass of the grains above the base (kg/m²).
    mass: f64,
    /// Mean velocity over the height of the flow [m/s].
    mean: f64,
    /// The same by mass [m/s].
    mean_by_mass: f64,
}

impl<'a> Sides<'a> {
    fn of(body: &'a InclineScene, run: &'a InclineResult) -> Option<Self> {
        let profile = run.profile.as_ref()?;
        let bulk = BulkFlow::of(
            profile,
            &run.points,
            body.grains.diameter,
            body.grains.density,
        )?;
        let above = || profile.rows.iter().filter(|r| r.z > 0.0);
        let mass: f64 = above().map(|r| r.density.value * profile.layer).sum();
        let momentum: f64 = above()
            .map(|r| r.density.value * profile.layer * r.u.value)
            .sum();
        let inside: Vec<f64> = above()
            .filter(|r| r.z < run.height)
            .map(|r| r.u.value)
            .collect();
        Some(Self {
            body,
            run,
            bulk,
            heights: run.points.iter().map(|p| p.z).collect(),
            mass,
            mean: inside.iter().sum::<f64>() / inside.len().max(1) as f64,
            mean_by_mass: momentum / mass,
        })
    }

    /// The law as a continuum of one pressure reads it. That pressure is σ_zz on an incline, while the points' I is made
    /// with p = trace/3: I by σ_zz is smaller by √(p/σ_zz), and so is I_0.
    fn law(&self, fit: &MuIFit, friction: FrictionOf, ratio: f64) -> MuI {
        let i_0 = match friction {
            FrictionOf::Pressure => fit.i_0,
            FrictionOf::NormalStress => fit.i_0 * ratio.sqrt(),
        };
        MuI {
            mu_s: fit.mu_s,
            mu_2: fit.mu_2,
            i_0,
            diameter: self.body.grains.diameter,
            solid_fraction: fit.solid_fraction,
            grain_density: self.body.grains.density,
            cohesion: 0.0,
        }
    }

    /// The finite-volume layer of the grains' weight under the stress ratio that momentum asks of the grains' bulk: the
    /// steady layer of a slope as steep as that.
    fn beside(
        &self,
        options: &Options,
        fit: &MuIFit,
        friction: FrictionOf,
        pressure_ratio: Option<(f64, f64)>,
    ) -> Result<Comparison, colluvium_continuum::Error> {
        let slope = self.run.slope_degrees.to_radians();
        let law = self.law(fit, friction, pressure_ratio.map_or(1.0, |r| r.0));
        let tangent = self.bulk.asked(Stress::NormalPressure);
        let weight = self.body.gravity * slope.cos();
        let depth = self.mass / (law.solid_fraction * law.grain_density);
        let case = BagnoldCase {
            slope: tangent.atan(),
            depth,
            gravity: weight / tangent.atan().cos(),
            rheology: law,
            cells: self.body.calibration.compare_cells as usize,
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
        let inertial_number = law.inertial_number_at(tangent);
        // Between cell centres as a straight line.
        let at = |z: f64| {
            let right = solution.z.partition_point(|c| *c < z);
            let right = right.clamp(1, solution.z.len() - 1);
            let [a, b] = [solution.z[right - 1], solution.z[right]];
            let [u, v] = [solution.u[right - 1], solution.u[right]];
            u + (v - u) * ((z - a) / (b - a)).clamp(0.0, 1.0)
        };
        let foot = at(self.heights[0]);
        let layers = self.heights.len() as f64;
        let gain = self.heights.iter().map(|z| at(*z) - foot).sum::<f64>() / layers;
        // ⟨u⟩ of Bagnold's profile is 2/5 I √(φ g cos θ) H^{3/2}/d.
        let mean = |tangent: f64, depth: f64| {
            0.4 * law.inertial_number_at(tangent)
                * (law.solid_fraction * weight).sqrt()
                * depth.powf(1.5)
                / law.diameter
        };
        let causes = vec![
            (
                "as if steady: tan θ, up to the highest layer, from the base".to_owned(),
                mean(slope.tan(), self.run.height) / self.mean - 1.0,
            ),
            (
                "the same weight as the grains'".to_owned(),
                mean(slope.tan(), depth) / self.mean_by_mass - 1.0,
            ),
            (
                "and the stress that momentum leaves: the flow is not steady".to_owned(),
                mean(tangent, depth) / self.mean_by_mass - 1.0,
            ),
            (
                "and above the foot: slip and the base's layers left out".to_owned(),
                gain / self.bulk.gain() - 1.0,
            ),
        ];
        Ok(Comparison {
            slope_degrees: self.run.slope_degrees,
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
            grains_u: Some(self.mean),
            tangent: Some(tangent),
            gains: Some([gain, self.bulk.gain()]),
            causes,
        })
    }

    /// Quantiles of the velocity over that of the best law: posterior and discrepancy.
    fn band(
        &self,
        flows: &[BulkFlow],
        fit: &MuIFit,
        posterior: Option<&Posterior>,
        seed: u64,
    ) -> Option<[f64; 5]> {
        let law = law_of(fit);
        let all: Vec<&BulkFlow> = flows.iter().collect();
        let discrepancy = Discrepancy::of(&all, law, fit.stress)?;
        let best = self.bulk.gain_by(law, fit.stress, 0.0);
        let quantiles = band(&self.bulk, posterior?, Some(discrepancy), fit.stress, seed)?;
        (best > 0.0 && best.is_finite()).then(|| quantiles.map(|s| (s / best).min(f64::MAX)))
    }
}
