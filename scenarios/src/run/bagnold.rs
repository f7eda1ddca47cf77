//! A continuum layer on an incline: from the scene to the steady flow.

use super::{Findings, Under, march_record};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::progress::Bar;
use crate::scene::{BagnoldScene, LayerCase, LayerVisitor, Scene, SolverMethod};
use crate::state_hash;
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use colluvium_continuum::bagnold::{BagnoldCase, BagnoldSolution};
use colluvium_continuum::flow::{Marching, StepRecord, YieldMethod};
use colluvium_continuum::layer::{Options, Progress};
use colluvium_continuum::rheology::ShearLaw;
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

/// The solver's settings that a scene describes.
pub fn options(scene: &BagnoldScene) -> Options {
    Options {
        marching: Marching {
            time_step: scene.solver.timestep_scaled,
            growth: scene.solver.growth,
            max_steps: scene.solver.steps as usize,
            steady_acceleration: scene.solver.steady_tolerance,
            ..Marching::default()
        },
        method: match scene.solver.method {
            SolverMethod::PrimalDual => YieldMethod::default(),
            SolverMethod::Regularised => YieldMethod::Regularised(Default::default()),
        },
        ..Options::default()
    }
}

/// Computes the flow; also gives the wall time (s).
pub fn solve(
    scene: &BagnoldScene,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(BagnoldSolution, f64), colluvium_continuum::Error> {
    let start = Instant::now();
    let solution = LayerCase::of(scene)?.solve(&options(scene), progress)?;
    Ok((solution, start.elapsed().as_secs_f64()))
}

/// What an error of the continuum means for the process.
pub fn failure(error: colluvium_continuum::Error) -> Failure {
    match error {
        colluvium_continuum::Error::OutOfRange { .. } => Failure::Input(error.to_string()),
        error => Failure::Run(error.to_string()),
    }
}

/// Checks the case and the march before anything is written.
pub(super) fn check(scene: &Scene, body: &BagnoldScene) -> Result<(), Failure> {
    let named =
        |error: colluvium_continuum::Error| Failure::Input(format!("{}: {error}", scene.origin));
    LayerCase::of(body)
        .and_then(|layer| layer.validate())
        .map_err(named)?;
    options(body).marching.validate().map_err(named)
}

pub(super) fn run(scene: &BagnoldScene, under: &mut Under) -> Result<Findings, Failure> {
    let layer = LayerCase::of(scene).map_err(failure)?;
    let solution = layer.visit(SteadyFlow {
        options: options(scene),
        under,
    })?;
    let wall_s = under.wall_s();
    under.directory.journal.note(&format!(
        "steady after {} steps, {} linear solves, {wall_s:.3} s",
        solution.steps, solution.linear_solves
    ));
    let mut summary = Summary::begun("bagnold", "run");
    describe(&mut summary, scene, &solution, wall_s)?;
    // One thread computes the layer, however many the pool has.
    summary.cost.threads = 1;
    Ok(Findings {
        summary,
        tables: tables(&solution),
        grains: None,
    })
}

/// A march from rest, or from where a run was left, to the steady flow.
struct SteadyFlow<'a, 'u> {
    options: Options,
    under: &'a mut Under<'u>,
}

impl LayerVisitor for SteadyFlow<'_, '_> {
    type Output = Result<BagnoldSolution, Failure>;

    fn visit<L: ShearLaw>(self, case: &BagnoldCase<L>) -> Self::Output {
        let under = self.under;
        let mut run = case.begin(&self.options).map_err(failure)?;
        if let Some(saved) = &under.resumed {
            march_record::take_up(&mut run, &saved.record).map_err(Failure::Input)?;
        }
        under.begin()?;
        let bar = Bar::new("bagnold");
        let mut farthest = 1.0_f64;
        while !run.is_over() {
            run.advance().map_err(failure)?;
            let progress = run.progress();
            // Convergence is about geometric, so the logarithm of the distance runs evenly.
            farthest = farthest.max(progress.distance_to_steady);
            let left = progress.distance_to_steady.max(1.0).ln() / farthest.ln().max(1e-9);
            bar.set(1.0 - left);
            bar.say(&format!(
                "step {}, {:.3} m/s",
                progress.step, progress.mean_velocity
            ));
            under.checkpoint("march", || march_record::save(&run))?;
        }
        bar.clear();
        Ok(case.solution(&run))
    }
}

/// Velocity and pressure profile and the history of the march.
pub fn tables(solution: &BagnoldSolution) -> Vec<Table> {
    let of_steps =
        |value: &dyn Fn(&StepRecord) -> f64| solution.history.iter().map(value).collect();
    vec![
        Table::new("profile")
            .with("z", "m", solution.z.clone())
            .with("u", "m/s", solution.u.clone())
            .with("p", "Pa", solution.p.clone())
            .with("u_exact", "m/s", solution.exact_u.clone())
            .with("p_exact", "Pa", solution.exact_p.clone()),
        Table::new("history")
            .with("t", "s", of_steps(&|r| r.time))
            .with("dt", "s", of_steps(&|r| r.dt))
            .with("mean_velocity", "m/s", of_steps(&|r| r.mean_velocity))
            .with("acceleration", "m/s²", of_steps(&|r| r.acceleration))
            .with("linear_solves", "1", of_steps(&|r| r.linear_solves as f64))
            .with("iterations", "1", of_steps(&|r| r.newton_iterations as f64))
            .with("halvings", "1", of_steps(&|r| r.cuts as f64))
            .with(
                "momentum_residual",
                "1",
                of_steps(&|r| r.residuals.momentum),
            )
            .with(
                "divergence_residual",
                "1",
                of_steps(&|r| r.residuals.divergence),
            )
            .with("stress_residual", "1", of_steps(&|r| r.residuals.stress))
            .with(
                "strain_rate_floor",
                "1/s",
                of_steps(&|r| r.residuals.strain_rate_floor / solution.units.time()),
            ),
    ]
}

/// Fills a summary from a solution.
pub fn describe(
    summary: &mut Summary,
    scene: &BagnoldScene,
    solution: &BagnoldSolution,
    wall_s: f64,
) -> Result<(), Failure> {
    let layer = LayerCase::of(scene).map_err(failure)?;
    let cells = solution.cells as u64;
    summary.model = Model {
        grains: 0,
        cells,
        dt_s: solution.history.last().map_or(0.0, |r| r.dt),
        dt_limit: "none: the step is implicit; it starts at solver.timestep_scaled and grows"
            .into(),
        left_out: LEFT_OUT.map(String::from).to_vec(),
    };
    summary.cost = Cost::measured(wall_s, 1, 0, cells * solution.steps as u64);
    let weight = layer.base_shear_stress();
    if weight > 0.0 {
        summary.ledger.momentum_relative =
            Some((solution.boundary_shear_stress[0] - weight).abs() / weight);
    }
    summary.state_hash = state_hash::of(&[&solution.u, &solution.p]);
    summary.remarks.extend(scene.rheology.remarks());
    let exact = "exact Bagnold profile";
    let rests = layer.rests();
    let error_unit = if rests { "m/s" } else { "1" };
    summary.put(
        "velocity_error_l2",
        Quantity::new(solution.velocity_error_l2_relative, error_unit).against(0.0, exact),
    );
    summary.put(
        "velocity_error_max",
        Quantity::new(solution.velocity_error_max_relative, error_unit).against(0.0, exact),
    );
    summary.put(
        "pressure_error_l2",
        Quantity::new(solution.pressure_error_l2_relative, "1").against(0.0, exact),
    );
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
    summary.put(
        "yielded_fraction",
        Quantity::new(solution.yielded_fraction, "1"),
    );
    summary.put(
        "ill_posed_fraction",
        Quantity::new(solution.ill_posed_fraction, "1")
            .from("volume where C(I) > 0, of the total volume"),
    );
    summary.put("steps", Quantity::new(solution.steps as f64, "1"));
    summary.put(
        "linear_solves",
        Quantity::new(solution.linear_solves as f64, "1"),
    );
    if !rests {
        let inertial_number = base_inertial_number(scene, &layer);
        summary.put(
            "inertial_number",
            Quantity::new(inertial_number, "1").from("on the base; without cohesion everywhere"),
        );
        summary
            .remarks
            .extend(validity_remark(scene, &layer, inertial_number));
    } else {
        summary
            .remarks
            .push("The slope lies below what friction and cohesion hold: the layer rests.".into());
    }
    if solution.ill_posed_fraction > 0.0 {
        summary.remarks.push(format!(
            "Ill posed: in {:.0} % of the layer's volume μ(I) lies where short waves grow without bound in two or three dimensions (Barker et al. 2015).",
            100.0 * solution.ill_posed_fraction
        ));
    }
    Ok(())
}

/// Inertial number on the base, I = γ̇ d √(ρ_s/p).
pub fn base_inertial_number(scene: &BagnoldScene, layer: &LayerCase) -> f64 {
    let r = &scene.rheology;
    layer.base().0 * r.diameter * (r.grain_density / layer.base_pressure()).sqrt()
}

/// Says so when the flow lies outside what the rheology was measured for.
pub fn validity_remark(
    scene: &BagnoldScene,
    layer: &LayerCase,
    inertial_number: f64,
) -> Option<String> {
    let [low, high] = match scene.rheology.valid_i.as_deref() {
        Some([low, high]) => [*low, *high],
        _ => layer.valid_inertial_numbers()?,
    };
    (inertial_number < low || inertial_number > high).then(|| {
        format!(
            "Outside the calibration: I = {inertial_number:.4} at {} degrees, but the rheology was measured for I in [{low:.4}, {high:.4}].",
            scene.slope_degrees
        )
    })
}
