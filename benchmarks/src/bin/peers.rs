//! Runs the comparisons with other DEM codes: `cargo run --release -p colluvium-benchmarks --bin peers`.

use clap::{Parser, Subcommand};
use colluvium_benchmarks::peers::case::{CASES, Case, case};
use colluvium_benchmarks::peers::find::{CODES, Code, Found, cache_folder, find, install};
use colluvium_benchmarks::peers::ours;
use colluvium_benchmarks::peers::report::{json, markdown};
use colluvium_benchmarks::peers::rounds::{Order, compare};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Side by side with LAMMPS, LIGGGHTS, YADE and ESyS-Particle, as far as they are installed.
#[derive(Parser)]
#[command(args_conflicts_with_subcommands = true)]
struct CommandLine {
    #[command(subcommand)]
    worker: Option<Worker>,
    /// chute, settled, settle or settled-LAW (hooke, viscoelastic, epsd, shape, cohesion, dmt, mixed, jkr); may
    /// be repeated.
    #[arg(long = "case", default_values_t = ["chute".to_owned(), "settled".to_owned()])]
    cases: Vec<String>,
    /// How often every code runs.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=100))]
    rounds: u16,
    /// Numbers of cores each code runs on.
    #[arg(long, value_delimiter = ',', default_values_t = [1])]
    threads: Vec<u16>,
    /// Only these codes (LAMMPS stays, ratios need it).
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Installs what is missing: LAMMPS into the cache folder, the others by apt.
    #[arg(long)]
    install: bool,
    /// Folder of the tables.
    #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/results"))]
    out: PathBuf,
    /// Folder that peers are installed in and run in [default: $XDG_CACHE_HOME/colluvium/peers].
    #[arg(long)]
    cache: Option<PathBuf>,
    /// Seconds after which a run is stopped.
    #[arg(long, default_value_t = 900)]
    limit: u64,
}

#[derive(Subcommand)]
enum Worker {
    /// One run of our own, in a process of its own.
    #[command(hide = true)]
    Worker {
        case: String,
        finer: u64,
        threads: usize,
    },
}

fn main() -> ExitCode {
    let result = match CommandLine::parse() {
        CommandLine {
            worker:
                Some(Worker::Worker {
                    case,
                    finer,
                    threads,
                }),
            ..
        } => work(&case, finer, threads),
        line => peers(&line),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("peers: {error}");
            ExitCode::FAILURE
        }
    }
}

fn named_case(name: &str) -> Result<Case, String> {
    case(name).ok_or_else(|| format!("--case {name}: must be one of {}", CASES.join(", ")))
}

fn work(name: &str, finer: u64, threads: usize) -> Result<(), String> {
    ours::run(&named_case(name)?, finer, threads).map_err(|e| format!("{name}: {e}"))
}

fn peers(line: &CommandLine) -> Result<(), String> {
    let cases = line
        .cases
        .iter()
        .map(|n| named_case(n))
        .collect::<Result<Vec<_>, _>>()?;
    let cache = match &line.cache {
        Some(folder) => folder.clone(),
        None => cache_folder().ok_or("--cache: neither XDG_CACHE_HOME nor HOME is set")?,
    };
    // Runs happen in folders of their own: the path has to hold from there.
    let cache = std::path::absolute(&cache).map_err(|e| format!("{}: {e}", cache.display()))?;
    let (codes, missing) = gather(line, &cache)?;
    std::fs::create_dir_all(&line.out).map_err(|e| format!("{}: {e}", line.out.display()))?;
    let threads: Vec<usize> = line
        .threads
        .iter()
        .map(|t| usize::from(*t).max(1))
        .collect();
    for case in cases {
        let name = case.name;
        let order = Order {
            rounds: line.rounds.into(),
            threads: &threads,
            folder: &cache.join("runs"),
            limit: line.limit,
        };
        let comparison = compare(case, &codes, &order, &mut |text| {
            eprintln!("{name}: {text}")
        });
        let text = markdown(&comparison, &missing);
        println!("{text}");
        let data = json(&comparison, &missing).map_err(|e| format!("{name}.json: {e}"))?;
        for (ending, content) in [("md", &text), ("json", &data)] {
            let path = line.out.join(format!("{name}.{ending}"));
            std::fs::write(&path, content).map_err(|e| format!("{}: {e}", path.display()))?;
            eprintln!("{name}: wrote {}", path.display());
        }
    }
    Ok(())
}

/// The codes that can be run, and what to do about the others.
type Gathered = (Vec<Found>, Vec<(Code, String)>);

fn gather(line: &CommandLine, cache: &Path) -> Result<Gathered, String> {
    for name in &line.only {
        if !CODES.iter().any(|c| c.name().eq_ignore_ascii_case(name)) {
            let known = CODES.map(Code::name).join(", ");
            return Err(format!("--only {name}: must be of {known}"));
        }
    }
    let wanted = |code: &Code| {
        line.only.is_empty()
            || *code == Code::Lammps
            || line
                .only
                .iter()
                .any(|n| code.name().eq_ignore_ascii_case(n))
    };
    let (mut codes, mut missing) = (Vec::new(), Vec::new());
    for code in CODES.into_iter().filter(wanted) {
        let mut found = find(code, cache);
        if found.is_err() && line.install {
            eprintln!("installing {}", code.name());
            if let Err(error) = install(code, cache) {
                eprintln!("{} could not be installed: {error}", code.name());
            }
            found = find(code, cache);
        }
        match found {
            Ok(found) => codes.push(found),
            Err(why) => {
                eprintln!("{} is missing: {why}", code.name());
                missing.push((code, why));
            }
        }
    }
    Ok((codes, missing))
}
