//! The continuum between plates and in a vertical chute: from rest to the steady flow, beside its exact solution.

use super::steady_layer::{self, failure};
use super::{Findings, Under};
use crate::failure::Failure;
use crate::scene::{ExactFlow, Scene, ShearedCase, ShearedScene};
use crate::summary::{Quantity, Summary};
use colluvium_continuum::layer::LayerSolution;

/// What such a flow leaves out.
pub const LEFT_OUT: [&str; 5] = [
    "grains",
    "air",
    "dilatancy (constant solid fraction)",
    "advection of momentum (zero in a flow along the walls)",
    "non-local effects near the walls",
];

/// Checks the march before anything is written; the case itself was checked with the scene.
pub(super) fn check(scene: &Scene, body: &ShearedScene) -> Result<(), Failure> {
    let marching = steady_layer::options(body.solver()).marching;
    let named = |error| Failure::Input(format!("{}: {error}", scene.origin));
    marching.validate().map_err(named)
}

pub(super) fn run(scene: &ShearedScene, under: &mut Under) -> Result<Findings, Failure> {
    let exact = scene.exact().map_err(failure)?;
    let law = scene.rheology().any_law().map_err(failure)?;
    let solver = scene.solver();
    let solution = match scene.case(law) {
        ShearedCase::PlaneShear(case) => steady_layer::march(&case, solver, under),
        ShearedCase::VerticalChute(case) => steady_layer::march(&case, solver, under),
    }?;
    let mut summary = Summary::begun(scene.name(), "run");
    describe(&mut summary, scene, &exact, &solution, under.wall_s());
    Ok(Findings {
        summary,
        tables: steady_layer::tables(&solution),
        grains: None,
    })
}

/// Fills a summary from a solution.
fn describe(
    summary: &mut Summary,
    scene: &ShearedScene,
    exact: &ExactFlow,
    solution: &LayerSolution,
    wall_s: f64,
) {
    let [low, high] = solution.boundary_shear_stress;
    let source = match scene {
        ShearedScene::PlaneShear(_) => "exact: a straight line under uniform stress",
        ShearedScene::VerticalChute(_) => "exact: weight carried by the walls, integrated",
    };
    steady_layer::describe(summary, solution, &LEFT_OUT, source, wall_s);
    summary.remarks.extend(scene.rheology().remarks());
    match scene {
        ShearedScene::PlaneShear(_) => {
            // The plates carry the same shear stress, as nothing else acts along the flow.
            summary.ledger.momentum_relative = Some((low - high).abs() / exact.wall_stress);
        }
        ShearedScene::VerticalChute(_) => {
            let apart = (high.abs() - exact.wall_stress).abs() / exact.wall_stress;
            summary.ledger.momentum_relative = Some(apart);
            summary.put(
                "velocity_at_middle",
                Quantity::new(solution.u.first().copied().unwrap_or(0.0), "m/s")
                    .against(exact.velocity, source),
            );
            summary.put(
                "plug_half_width",
                Quantity::new(exact.plug, "m")
                    .from("exact: where the stress reaches the threshold"),
            );
        }
    }
    summary.put(
        "wall_shear_stress",
        Quantity::new(high.abs(), "Pa").against(exact.wall_stress, source),
    );
    steady_layer::describe_march(summary, solution);
    summary.put(
        "inertial_number",
        Quantity::new(exact.wall_inertial_number, "1").from("at the wall, of the exact flow"),
    );
    if exact.velocity == 0.0 {
        let rest = "Friction and cohesion carry the material's weight: it rests.";
        summary.remarks.push(rest.into());
    } else {
        summary.remarks.extend(validity_remark(scene, exact));
    }
}

/// Says so when the flow at the wall lies outside what the law was measured for.
pub fn validity_remark(scene: &ShearedScene, exact: &ExactFlow) -> Option<String> {
    let valid = scene.rheology().valid_inertial_numbers();
    steady_layer::validity_remark(valid, exact.wall_inertial_number, "at the wall")
}
