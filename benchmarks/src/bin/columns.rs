//! Collapse of plane columns to rest: processor time and the share of each phase of a step, fronts and deposits beside
//! a peer's, and how far the core creeps that does not flow.
//!
//! `cargo run --release -p colluvium-benchmarks --bin columns -- --tables FOLDER` on 256, 256 and 384 cells along x for
//! a = 0.5, 1.42 and 6.26; `--aspect 0.5 --cells 128` for one of them, `--threads 2` on two threads. Prints Markdown.
//!
//! FOLDER holds the profiles of the peer ([`colluvium_benchmarks::columns`]) as `c<a>_N<cells>_h.csv`, with columns t, x and h in units of the column's height
//! H and √(H/g); the profiles are compared as ∫|h − h_peer| dx over the column's area.

use std::error::Error;
use std::fs::read_to_string;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Parser;
use colluvium_benchmarks::columns::{COLUMNS, Column, Profile};
use colluvium_benchmarks::peers::machine::{begin_peak_of_memory, memory, processor_time};
use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::free_surface::{Spent, SurfaceOptions, SurfaceStep};

type Outcome<T> = Result<T, Box<dyn Error>>;

#[derive(Parser)]
struct Arguments {
    /// Aspect ratio H/L; all three without it.
    #[arg(long)]
    aspect: Option<f64>,
    /// Cells along x.
    #[arg(long)]
    cells: Option<usize>,
    /// Largest Courant number.
    #[arg(long, default_value_t = 0.9)]
    courant: f64,
    /// Strain-rate floor ε in √(g/H).
    #[arg(long, default_value_t = 1e-5)]
    strain_rate_floor: f64,
    /// Threads.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Folder with the profiles of the peer.
    #[arg(long)]
    tables: Option<PathBuf>,
}

/// The front is where the heap is this high, over H.
const FRONT: f64 = 0.01;
/// Time between profiles in √(H/g).
const INTERVAL: f64 = 0.5;
/// Last time at which a column may come to rest,
const LONGEST: f64 = 15.0;
/// and how long it is watched at rest.
const WATCHED: f64 = 5.0;
/// Cells up to this x/L and z/H are the core, which does not flow at any time
const CORE: f64 = 0.25;
/// in columns of a smaller aspect ratio than this.
const ALL_FLOWS: f64 = 1.0;

/// The profiles of a peer by time, under a head line.
fn read_profiles(path: &Path) -> Outcome<Vec<(f64, Profile)>> {
    let mut profiles: Vec<(f64, Profile)> = Vec::new();
    for line in read_to_string(path)?.lines().skip(1) {
        let row: Vec<f64> = line
            .split(',')
            .map(str::parse)
            .collect::<Result<_, _>>()
            .map_err(|error| format!("{}: {line}: {error}", path.display()))?;
        let [t, x, h] = row[..] else {
            return Err(format!("{}: {line}: not t, x, h", path.display()).into());
        };
        if profiles.last().is_none_or(|(last, _)| *last != t) {
            profiles.push((t, Profile::default()));
        }
        if let Some((_, profile)) = profiles.last_mut() {
            profile.x.push(x);
            profile.h.push(h);
        }
    }
    Ok(profiles)
}

/// A run to rest.
struct Run {
    collapse: Collapse,
    steps: usize,
    iterations: usize,
    cell_steps: usize,
    cell_iterations: usize,
    cut: usize,
    profiles: Vec<(f64, Profile, f64)>,
    time_of_rest: Option<f64>,
    largest_core_speed: f64,
    seconds: f64,
    /// By the clock (s).
    wall: f64,
    spent: Spent,
    megabytes: f64,
}

impl Run {
    fn of(case: &CollapseCase, options: &SurfaceOptions) -> Outcome<Self> {
        begin_peak_of_memory()?;
        let start = processor_time().ok_or("no processor time on this system")?;
        let clock = Instant::now();
        let collapse = Collapse::new(case, options)?;
        let mut run = Self {
            profiles: vec![(0.0, Profile::of(&collapse), collapse.front(FRONT).position)],
            collapse,
            steps: 0,
            iterations: 0,
            cell_steps: 0,
            cell_iterations: 0,
            cut: 0,
            time_of_rest: None,
            largest_core_speed: 0.0,
            seconds: 0.0,
            wall: 0.0,
            spent: Spent::default(),
            megabytes: 0.0,
        };
        let mut samples = 1.0;
        while run.time_of_rest.is_none() && samples * INTERVAL <= LONGEST {
            let until = samples * INTERVAL;
            let step = run.collapse.step(until)?;
            run.count(&step);
            if run.collapse.is_at_rest(&step) {
                run.time_of_rest = Some(run.collapse.time());
            }
            if run.collapse.time() >= until - 1e-9 {
                run.profiles.push((
                    until,
                    Profile::of(&run.collapse),
                    run.collapse.front(FRONT).position,
                ));
                run.largest_core_speed = run.largest_core_speed.max(run.core_speed(case));
                samples += 1.0;
            }
        }
        run.seconds = processor_time().ok_or("no processor time on this system")? - start;
        run.wall = clock.elapsed().as_secs_f64();
        run.spent = run.collapse.flow().spent();
        run.megabytes = memory("VmHWM").ok_or("no memory on this system")? * 1e-6;
        Ok(run)
    }

    fn count(&mut self, step: &SurfaceStep) {
        self.steps += 1;
        self.iterations += step.newton_iterations;
        self.cell_steps += step.active_cells;
        self.cell_iterations += step.active_cells * step.newton_iterations;
        self.cut += step.cuts;
    }

    /// Largest speed of cells whose centre lies in the core.
    fn core_speed(&self, case: &CollapseCase) -> f64 {
        let fields = self.collapse.fields();
        let core = fields
            .iter()
            .filter(|f| f.upper[0] < CORE * case.width() && f.upper[1] < CORE * case.height);
        core.fold(0.0, |most, f| most.max(f.velocity[0].hypot(f.velocity[1])))
    }
}

fn share(part: f64, whole: f64) -> String {
    format!("{:.1} %", 100.0 * part / whole)
}

fn print_cost(column: &Column, cells: usize, run: &Run) {
    let spent = run.spent;
    let within = spent.within_newton;
    let whole = spent.transport + spent.operators + spent.analysis + spent.newton;
    let rows = (1.25 * cells as f64 / column.length).ceil();
    let rest = run
        .time_of_rest
        .map_or("no rest".to_owned(), |t| format!("{t:.2}"));
    println!("\n## a = {}, {cells} cells along x\n", column.aspect);
    println!(
        "| t of rest | CPU s | wall s | steps | cut | Newton iterations | active cells × steps /s | all cells × steps /s | µs/active cell and iteration | peak MB |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    let active = run.cell_steps as f64;
    println!(
        "| {rest} | {:.1} | {:.2} | {} | {} | {} | {:.2e} | {:.2e} | {:.1} | {:.0} |",
        run.seconds,
        run.wall,
        run.steps,
        run.cut,
        run.iterations,
        active / run.seconds,
        cells as f64 * rows * run.steps as f64 / run.seconds,
        run.seconds * 1e6 / run.cell_iterations as f64,
        run.megabytes,
    );
    println!(
        "\n| transport | unknowns and operators | analysis of the pattern | factors | Krylov iterations, substitution | parts | evaluation, assembly, update |\n|---|---|---|---|---|---|---|"
    );
    let evaluation = spent.newton - within.factors - within.krylov - within.parts;
    let phases = [
        spent.transport,
        spent.operators,
        spent.analysis,
        within.factors,
        within.krylov,
        within.parts,
        evaluation,
    ];
    println!("| {} |", phases.map(|part| share(part, whole)).join(" | "));
    println!(
        "| {} |",
        phases.map(|part| format!("{part:.2} s")).join(" | ")
    );
}

fn print_fronts(
    column: &Column,
    case: &CollapseCase,
    run: &Run,
    tables: Option<&Path>,
) -> Outcome<()> {
    println!(
        "\n| (x_f − L)/L at t = | 1 | 2 | 3 | 4 | 5 | 6 | rest |\n|---|---|---|---|---|---|---|---|"
    );
    let runout = |position: f64| position / case.width() - 1.0;
    // A heap that has come to rest stays.
    let rest = runout(run.collapse.front(FRONT).position);
    let last = Profile::of(&run.collapse);
    let at = |t: f64| {
        run.profiles
            .iter()
            .find(|(time, ..)| (time - t).abs() < 1e-9)
    };
    let ours = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
        .map(|t| at(t).map_or(rest, |(_, _, position)| runout(*position)))
        .map(|runout| format!("{runout:.3}"));
    println!("| ours | {} | {rest:.3} |", ours.join(" | "));
    for (cells, runouts) in column.peer {
        let row = runouts.map(|runout| format!("{runout:.3}"));
        println!("| Basilisk, {cells} | {} | – |", row.join(" | "));
    }
    let Some(folder) = tables else {
        return Ok(());
    };
    println!(
        "\n| ∫\\|h − h_peer\\| dx/A at t = | 1 | 2 | 3 | 4 | 5 | 6 | h(0) at 6, ours and peer |\n|---|---|---|---|---|---|---|---|"
    );
    for (cells, _) in column.peer {
        let path = folder.join(format!("c{:.2}_N{cells}_h.csv", column.aspect));
        if !path.exists() {
            println!("| Basilisk, {cells}: no {} |", path.display());
            continue;
        }
        let peer = read_profiles(&path)?;
        let found = |t: f64| peer.iter().find(|(time, _)| (time - t).abs() < 0.02);
        let row = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|t| {
            let profile = at(t).map_or(&last, |(_, profile, _)| profile);
            found(t).map_or("–".to_owned(), |(_, other)| {
                format!("{:.4}", profile.apart(other) / (case.height * case.width()))
            })
        });
        let centres = [
            Some(at(6.0).map_or(&last, |(_, p, _)| p)),
            found(6.0).map(|(_, p)| p),
        ]
        .map(|profile| profile.map_or("–".to_owned(), |p| format!("{:.4}", p.h[0])));
        println!(
            "| Basilisk, {cells} | {} | {} |",
            row.join(" | "),
            centres.join(", ")
        );
    }
    Ok(())
}

/// What is rigid creeps, by ε at most: the core during the run, and all of the heap at rest. The top at x = 0 is part of the
/// core until the flow at the surface has come back to it.
fn print_creep(case: &CollapseCase, floor: f64, mut run: Run) -> Outcome<()> {
    println!("\n| creep, allowed {floor:.0e} H √(g/H) | found | over allowed |\n|---|---|---|");
    let Some(start) = run.time_of_rest else {
        println!("| no rest | – | – |");
        return Ok(());
    };
    if case.aspect < ALL_FLOWS {
        for (t, profile, _) in run
            .profiles
            .iter()
            .filter(|(t, ..)| t.fract() == 0.0 && *t > 0.0)
        {
            let fall = case.height - profile.h[0];
            println!(
                "| fall of h(0) until t = {t}, H | {fall:.2e} | {:.2} |",
                fall / (floor * t)
            );
        }
        let speed = run.largest_core_speed;
        println!(
            "| largest speed at x < L/4, z < H/4 until rest, √(gH) | {speed:.2e} | {:.2} |",
            speed / floor
        );
    }
    let before = Profile::of(&run.collapse);
    let mut speed = 0.0_f64;
    while run.collapse.time() < start + WATCHED - 1e-9 {
        speed = speed.max(run.collapse.step(start + WATCHED)?.max_speed);
    }
    let after = Profile::of(&run.collapse);
    println!(
        "| largest speed of all in {WATCHED} √(H/g) after rest | {speed:.2e} | {:.2} |",
        speed / floor
    );
    let last = run.collapse.flow().max_speed();
    println!(
        "| largest speed of all at the end of that | {last:.2e} | {:.2} |",
        last / floor
    );
    let core = run.core_speed(case);
    println!(
        "| largest speed at x < L/4, z < H/4 then | {core:.2e} | {:.2} |",
        core / floor
    );
    let allowed = floor * WATCHED;
    let fall = before.h[0] - after.h[0];
    println!(
        "| fall of h(0) in that time, H | {fall:.2e} | {:.2} |",
        fall / allowed
    );
    let changes = before.h.iter().zip(&after.h).map(|(a, b)| (a - b).abs());
    let change = changes.fold(0.0, f64::max);
    println!(
        "| largest change of h in that time, H | {change:.2e} | {:.2} |",
        change / allowed
    );
    Ok(())
}

fn main() -> Outcome<()> {
    let arguments = Arguments::parse();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.threads)
        .build()?;
    pool.install(|| columns(&arguments).map_err(|error| error.to_string()))?;
    Ok(())
}

fn columns(arguments: &Arguments) -> Outcome<()> {
    let mut options = SurfaceOptions {
        courant: arguments.courant,
        ..SurfaceOptions::default()
    };
    options.solver.strain_rate_floor = arguments.strain_rate_floor;
    println!("# Collapse of columns (natural units of H and g)");
    for column in &COLUMNS {
        if arguments
            .aspect
            .is_some_and(|aspect| aspect != column.aspect)
        {
            continue;
        }
        let cells = arguments.cells.unwrap_or(column.cells);
        let case = column.case(cells);
        let run = Run::of(&case, &options)?;
        print_cost(column, cells, &run);
        print_fronts(column, &case, &run, arguments.tables.as_deref())?;
        print_creep(&case, arguments.strain_rate_floor, run)?;
    }
    Ok(())
}
