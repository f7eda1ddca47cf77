//! A continuum layer on an incline: from the scene to the steady flow.

use super::steady_layer::{self, failure, options};
use super::{Findings, Under};
use crate::failure::Failure;
use crate::scene::{BagnoldScene, LayerCase, Scene};
use crate::summary::{Quantity, Summary};
use colluvium_continuum::bagnold::BagnoldSolution;
use colluvium_continuum::layer::Progress;
use std::ops::ControlFlow;
use std::time::Instant;

/// What a continuum layer leaves out.
pub const LEFT_OUT: [&str; 6] = [
    "grains",
    "air",
    "dilatancy (constant solid fraction)",
    "a moving surface (the depth is constant in steady flow)",
    "advection of momentum (zero in a flow along the plane)",
    "non-local effects near the base",
];

/// Computes the flow; also gives the wall time (s).
pub fn solve(
    scene: &BagnoldScene,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(BagnoldSolution, f64), colluvium_continuum::Error> {
    let start = Instant::now();
    let solution = LayerCase::of(scene)?.solve(&options(&scene.solver), progress)?;
    Ok((solution, start.elapsed().as_secs_f64()))
}

/// Checks the case and the march before anything is written.
pub(super) fn check(scene: &Scene, body: &BagnoldScene) -> Result<(), Failure> {
    let named =
        |error: colluvium_continuum::Error| Failure::Input(format!("{}: {error}", scene.origin));
    LayerCase::of(body)
        .and_then(|layer| layer.validate())
        .map_err(named)?;
    options(&body.solver).marching.validate().map_err(named)
}

pub(super) fn run(scene: &BagnoldScene, under: &mut Under) -> Result<Findings, Failure> {
    let layer = LayerCase::of(scene).map_err(failure)?;
    let solution = steady_layer::march(&layer.0, &scene.solver, under)?;
    let mut summary = Summary::begun("bagnold", "run");
    describe(&mut summary, scene, &solution, under.wall_s())?;
    Ok(Findings {
        summary,
        tables: steady_layer::tables(&solution),
        grains: None,
    })
}

/// Fills a summary from a solution.
pub fn describe(
    summary: &mut Summary,
    scene: &BagnoldScene,
    solution: &BagnoldSolution,
    wall_s: f64,
) -> Result<(), Failure> {
    let layer = LayerCase::of(scene).map_err(failure)?;
    let exact = "exact Bagnold profile";
    steady_layer::describe(summary, solution, &LEFT_OUT, exact, wall_s);
    let weight = layer.base_shear_stress();
    if weight > 0.0 {
        summary.ledger.momentum_relative =
            Some((solution.boundary_shear_stress[0] - weight).abs() / weight);
    }
    summary.remarks.extend(scene.rheology.remarks());
    let surface = solution.u.last().copied().unwrap_or(0.0);
    let exact_surface = solution.exact_u.last().copied().unwrap_or(0.0);
    summary.put(
        "velocity_top_cell",
        Quantity::new(surface, "m/s").against(exact_surface, exact),
    );
    summary.put(
        "base_shear_stress",
        Quantity::new(solution.boundary_shear_stress[0], "Pa")
            .against(weight, "weight along the plane"),
    );
    steady_layer::describe_march(summary, solution);
    if !layer.rests() {
        let inertial_number = base_inertial_number(scene, &layer);
        summary.put(
            "inertial_number",
            Quantity::new(inertial_number, "1").from("on the base; without cohesion everywhere"),
        );
        summary
            .remarks
            .extend(validity_remark(scene, inertial_number));
    } else {
        summary
            .remarks
            .push("The slope lies below what friction and cohesion hold: the layer rests.".into());
    }
    Ok(())
}

/// Inertial number on the base, I = γ̇ d √(ρ_s/p).
pub fn base_inertial_number(scene: &BagnoldScene, layer: &LayerCase) -> f64 {
    let r = &scene.rheology;
    layer.base().0 * r.diameter * (r.grain_density / layer.base_pressure()).sqrt()
}

/// Says so when the flow lies outside what the rheology was measured for.
pub fn validity_remark(scene: &BagnoldScene, inertial_number: f64) -> Option<String> {
    let valid = scene.rheology.valid_inertial_numbers();
    let place = format!("at {} degrees", scene.slope_degrees);
    steady_layer::validity_remark(valid, inertial_number, &place)
}
