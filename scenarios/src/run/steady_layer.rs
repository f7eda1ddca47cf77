//! A layer of the continuum from rest to its steady flow, beside its exact solution: what the scenes of such flows have in
//! common.

use super::{Under, march_record};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::progress::Bar;
use crate::scene::{SolverKeys, SolverMethod};
use crate::state_hash;
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use colluvium_continuum::Error;
use colluvium_continuum::bagnold::BagnoldCase;
use colluvium_continuum::flow::{Marching, StepRecord, YieldMethod};
use colluvium_continuum::layer::{LayerRun, LayerSolution, Options};
use colluvium_continuum::plane_shear::PlaneShearCase;
use colluvium_continuum::rheology::ShearLaw;
use colluvium_continuum::vertical_chute::VerticalChuteCase;

/// A steady flow across a layer that has an exact solution.
pub trait SteadyCase {
    /// The material's law.
    type Law: ShearLaw;

    /// The material at rest.
    fn begin(&self, options: &Options) -> Result<LayerRun<Self::Law>, Error>;

    /// A run's flow beside the exact solution.
    fn solution(&self, run: &LayerRun<Self::Law>) -> LayerSolution;
}

macro_rules! steady_case {
    ($($case:ident),*) => {$(
        impl<L: ShearLaw> SteadyCase for $case<L> {
            type Law = L;

            fn begin(&self, options: &Options) -> Result<LayerRun<L>, Error> {
                $case::begin(self, options)
            }

            fn solution(&self, run: &LayerRun<L>) -> LayerSolution {
                $case::solution(self, run)
            }
        }
    )*};
}

steady_case!(BagnoldCase, PlaneShearCase, VerticalChuteCase);

/// The solver's settings that a scene describes.
pub fn options(solver: &SolverKeys) -> Options {
    Options {
        marching: Marching {
            time_step: solver.timestep_scaled,
            growth: solver.growth,
            max_steps: solver.steps as usize,
            steady_acceleration: solver.steady_tolerance,
            ..Marching::default()
        },
        method: match solver.method {
            SolverMethod::PrimalDual => YieldMethod::default(),
            SolverMethod::Regularised => YieldMethod::Regularised(Default::default()),
        },
        ..Options::default()
    }
}

/// What an error of the continuum means for the process.
pub fn failure(error: Error) -> Failure {
    match error {
        Error::OutOfRange { .. } => Failure::Input(error.to_string()),
        error => Failure::Run(error.to_string()),
    }
}

/// Marches from rest, or from where a run was left, to the steady flow.
pub(super) fn march<C: SteadyCase>(
    case: &C,
    solver: &SolverKeys,
    under: &mut Under,
) -> Result<LayerSolution, Failure> {
    let mut run = case.begin(&options(solver)).map_err(failure)?;
    if let Some(saved) = &under.resumed {
        march_record::take_up(&mut run, &saved.record).map_err(Failure::Input)?;
    }
    under.begin()?;
    let bar = Bar::new(&under.scene.name);
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
    let solution = case.solution(&run);
    under.directory.journal.note(&format!(
        "steady after {} steps, {} linear solves, {:.3} s",
        solution.steps,
        solution.linear_solves,
        under.wall_s()
    ));
    Ok(solution)
}

/// Velocity and pressure profile and the history of the march.
pub fn tables(solution: &LayerSolution) -> Vec<Table> {
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

/// Fills in what every such flow has: cost, state and errors against the exact solution.
pub(super) fn describe(
    summary: &mut Summary,
    solution: &LayerSolution,
    left_out: &[&str],
    exact: &str,
    wall_s: f64,
) {
    let cells = solution.cells as u64;
    summary.model = Model {
        grains: 0,
        cells,
        dt_s: solution.history.last().map_or(0.0, |r| r.dt),
        dt_limit: "none: the step is implicit; it starts at solver.timestep_scaled and grows"
            .into(),
        left_out: left_out.iter().map(|&part| part.to_owned()).collect(),
    };
    // One thread computes the layer, however many the pool has.
    summary.cost = Cost::measured(wall_s, 1, 0, cells * solution.steps as u64);
    summary.state_hash = state_hash::of(&[&solution.u, &solution.p]);
    let is_at_rest = solution.exact_u.iter().all(|&u| u == 0.0);
    let unit = if is_at_rest { "m/s" } else { "1" };
    for (name, error, unit) in [
        (
            "velocity_error_l2",
            solution.velocity_error_l2_relative,
            unit,
        ),
        (
            "velocity_error_max",
            solution.velocity_error_max_relative,
            unit,
        ),
        (
            "pressure_error_l2",
            solution.pressure_error_l2_relative,
            "1",
        ),
    ] {
        summary.put(name, Quantity::new(error, unit).against(0.0, exact));
    }
}

/// Fills in what yielded and what it took.
pub(super) fn describe_march(summary: &mut Summary, solution: &LayerSolution) {
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
    if solution.ill_posed_fraction > 0.0 {
        summary.remarks.push(format!(
            "Ill posed: in {:.0} % of the layer's volume μ(I) lies where short waves grow without bound in plane flow (Barker et al. 2015).",
            100.0 * solution.ill_posed_fraction
        ));
    }
}

/// Says so when an inertial number lies outside what the law was measured for.
pub(super) fn validity_remark(
    valid: Option<[f64; 2]>,
    inertial_number: f64,
    place: &str,
) -> Option<String> {
    let [low, high] = valid?;
    (inertial_number < low || inertial_number > high).then(|| {
        format!(
            "Outside the calibration: I = {inertial_number:.4} {place}, but the rheology was measured for I in [{low:.4}, {high:.4}]."
        )
    })
}
