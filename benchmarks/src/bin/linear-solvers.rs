//! Cost of the linear solvers by size: CPU time per active cell and Newton iteration, and memory, with factors and
//! with multigrid.
//!
//! `cargo run --release -p colluvium-benchmarks --bin linear-solvers -- space 0.1 1e-3 16 24 32 40` collapses a quarter
//! of a cylinder until t = 0.1 √(H/g) on these numbers of cells, with linear systems solved to 1e-3; `plane` a column.
//! `--threads 2` before these takes two threads. Each case runs in a process of its own, both solvers by turns, because memory belongs to a process and
//! a machine's speed changes with time.

use std::process::Command;
use std::time::Instant;

use colluvium_benchmarks::peers::machine::{memory, processor_time};
use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::cylinder_collapse::{CylinderCase, CylinderCollapse};
use colluvium_continuum::free_surface::{Contact, SurfaceOptions, SurfaceStep};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::yield_step::LinearSolver;

type Outcome = Result<(), Box<dyn std::error::Error>>;

const USAGE: &str = "arguments: [--threads N] space|plane END TOLERANCE CELLS...";

fn main() -> Outcome {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut threads = "1".to_owned();
    if arguments.first().is_some_and(|first| first == "--threads") && arguments.len() > 1 {
        threads = arguments.drain(..2).nth(1).unwrap_or_default();
    }
    match arguments.as_slice() {
        [flow, end, tolerance, cells, solver] if solver.parse::<usize>().is_err() => {
            let solver = match solver.as_str() {
                "factors" => LinearSolver::Factors,
                _ => LinearSolver::Multigrid,
            };
            let (end, tolerance, cells) = (end.parse()?, tolerance.parse()?, cells.parse()?);
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads.parse()?)
                .build()?;
            let run = || run(flow, end, tolerance, cells, solver).map_err(|e| e.to_string());
            Ok(pool.install(run)?)
        }
        [flow, end, tolerance, cells @ ..] if !cells.is_empty() => {
            println!(
                "solver    cells  active  steps  iterations  CPU (s)  wall (s)  us/cell/iteration  MB  run-out  asymmetry  factors, Krylov, all (s)"
            );
            let program = std::env::current_exe()?;
            for cells in cells {
                for solver in ["factors", "multigrid"] {
                    let status = Command::new(&program)
                        .args(["--threads", &threads, flow, end, tolerance, cells, solver])
                        .status()?;
                    if !status.success() {
                        println!("{solver} {cells}: {status}");
                    }
                }
            }
            Ok(())
        }
        _ => Err(USAGE.into()),
    }
}

/// What a run took.
#[derive(Default)]
struct Work {
    active: usize,
    steps: usize,
    iterations: usize,
    cell_iterations: usize,
}

impl Work {
    fn add(&mut self, step: &SurfaceStep) {
        self.active = step.active_cells;
        self.steps += 1;
        self.iterations += step.newton_iterations;
        self.cell_iterations += step.active_cells * step.newton_iterations;
    }
}

fn run(flow: &str, end: f64, tolerance: f64, cells: usize, solver: LinearSolver) -> Outcome {
    let mut options = SurfaceOptions::default();
    options.solver.linear_tolerance = tolerance;
    options.solver.linear_solver = solver;
    let no_time = "no processor time on this system";
    let begin = processor_time().ok_or(no_time)?;
    let clock = Instant::now();
    let mut work = Work::default();
    let (run_out, asymmetry, spent) = match flow {
        "space" => {
            let case = CylinderCase {
                aspect: 1.0,
                height: 1.0,
                gravity: 1.0,
                rheology: MuI::new(0.382, 0.643, 0.279, 0.02, 1.0, 1.0),
                cells,
                length_scaled: 2.9,
                whole: false,
                floor: Contact::NoSlip,
            };
            let mut collapse = CylinderCollapse::new(&case, &options)?;
            while collapse.time() < end - 1e-9 {
                let step = collapse.step(end)?;
                work.add(&step);
                if collapse.is_at_rest(&step) {
                    break;
                }
            }
            let front = collapse.front(0.02).radius;
            (front - 1.0, collapse.asymmetry(), collapse.flow().spent())
        }
        "plane" => {
            let case = CollapseCase {
                aspect: 1.42,
                height: 1.0,
                gravity: 1.0,
                rheology: MuI::new(0.32, 0.60, 0.4, 1.0 / 65.0, 1.0, 1.0),
                cells,
                length_scaled: 5.0,
                overhang_degrees: 0.0,
            };
            let mut collapse = Collapse::new(&case, &options)?;
            while collapse.time() < end - 1e-9 {
                let step = collapse.step(end)?;
                work.add(&step);
                if collapse.is_at_rest(&step) {
                    break;
                }
            }
            let front = collapse.front(0.02).position;
            (front * 1.42 - 1.0, 0.0, collapse.flow().spent())
        }
        _ => return Err(USAGE.into()),
    };
    let cpu = processor_time().ok_or(no_time)? - begin;
    let wall = clock.elapsed().as_secs_f64();
    println!(
        "{:9} {cells:5} {:7} {:6} {:11} {cpu:8.2} {wall:8.2} {:18.1} {:4.0} {run_out:.12} {asymmetry:.1e} {:.2} {:.2} {:.2}",
        format!("{solver:?}").to_lowercase(),
        work.active,
        work.steps,
        work.iterations,
        cpu * 1e6 / work.cell_iterations as f64,
        memory("VmHWM").ok_or("no memory on this system")? * 1e-6,
        spent.within_newton.factors,
        spent.within_newton.krylov,
        spent.transport + spent.operators + spent.analysis + spent.newton,
    );
    Ok(())
}
