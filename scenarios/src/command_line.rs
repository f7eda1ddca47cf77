//! The command line: what `colluvium` understands, and what each command does.

use crate::calibrate;
use crate::failure::Failure;
use crate::pareto;
use crate::plan;
use crate::report;
use crate::run::{self, Ended, RunOptions};
use crate::scene::{self, Scene};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::time::Duration;

/// Granular flow by grains, by a continuum, and from one to the other.
#[derive(Debug, Parser)]
#[command(name = "colluvium", version, about, max_term_width = 100)]
#[command(
    after_help = "Exit status: 0 done, 1 run failed, 2 bad input (nothing written), \
                        130 interrupted (the message says what --resume does)."
)]
pub struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// List the bundled scenes, or print one
    Scenes {
        #[command(subcommand)]
        show: Option<Show>,
    },
    /// Read and check a scene; write nothing
    Check {
        #[command(flatten)]
        scene: SceneArguments,
    },
    /// Say what would be modelled and why, what is left out, and what it would cost
    Plan {
        #[command(flatten)]
        scene: SceneArguments,
    },
    /// Run a scene into a directory
    Run {
        #[command(flatten)]
        scene: SceneArguments,
        #[command(flatten)]
        how: RunArguments,
        /// Wall time between two checkpoints, in seconds [default: 20, or what keeps their cost below
        /// a twentieth]
        #[arg(long, value_name = "SECONDS", value_parser = seconds)]
        checkpoint_every: Option<Duration>,
    },
    /// Fit μ(I) to a campaign of inclined-plane runs and compare the continuum with it
    Calibrate {
        #[command(flatten)]
        scene: SceneArguments,
        #[command(flatten)]
        how: RunArguments,
    },
    /// Run a scene with several values of one key: error against cost
    Pareto {
        #[command(flatten)]
        scene: SceneArguments,
        /// The key and its values, as in grid.cells=16,32,64
        #[arg(long, value_name = "KEY=A,B,C")]
        vary: String,
        /// Compare with a run that has this setting, instead of an exact solution
        #[arg(long, value_name = "KEY=VALUE")]
        reference: Vec<String>,
        /// Directory of the table, the plot and the runs
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Threads of each run
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
    },
    /// Write the HTML report of one or more runs
    Report {
        /// Run directories
        #[arg(required = true, value_name = "DIR")]
        directories: Vec<PathBuf>,
        /// The file; default: report.html in the directory, or here for several directories
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Print the JSON Schema of scene files
    Schema,
}

#[derive(Debug, Subcommand)]
enum Show {
    /// Print a bundled scene as TOML
    Show {
        /// Its name
        name: String,
    },
}

#[derive(Debug, Args)]
struct SceneArguments {
    /// A bundled scene's name or a TOML file
    #[arg(value_name = "SCENE")]
    scene: String,
    /// Change a key of the scene, as in slope_degrees=25 or rheology.mu_s=0.38
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl SceneArguments {
    fn load(&self) -> Result<Scene, Failure> {
        Ok(Scene::load(&self.scene, &self.set)?)
    }
}

/// A wall time in seconds.
fn seconds(text: &str) -> Result<Duration, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    Duration::try_from_secs_f64(value)
        .ok()
        .filter(|d| d.as_secs_f64() <= 1e6)
        .ok_or_else(|| "allowed: [0, 1e6]".into())
}

#[derive(Debug, Args)]
struct RunArguments {
    /// Directory of the results [default: the first free results/SCENE-N]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads [default: as many as the machine has cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Go on from the checkpoint in the directory
    #[arg(long)]
    resume: bool,
}

impl RunArguments {
    fn options(&self) -> RunOptions {
        RunOptions {
            out: self.out.clone(),
            threads: self.threads.map(usize::from),
            resume: self.resume,
            checkpoint_every: None,
        }
    }
}

/// Does what the command line asks for.
pub fn execute(line: CommandLine) -> Result<(), Failure> {
    match line.command {
        Command::Scenes { show: None } => {
            for (name, text) in scene::BUNDLED {
                print(&format!("{name:<18} {}", first_sentence(text)));
            }
        }
        Command::Scenes {
            show: Some(Show::Show { name }),
        } => {
            let text = scene::bundled(&name).ok_or_else(|| {
                let names = scene::BUNDLED.map(|(n, _)| n).join(", ");
                Failure::Input(format!(
                    "no bundled scene is called `{name}`; allowed: {names}"
                ))
            })?;
            print(text.trim_end());
        }
        Command::Check { scene } => {
            let checked = scene.load()?;
            run::check(&checked)?;
            print(&format!(
                "{}: a valid `{}` scene",
                scene.scene, checked.name
            ));
        }
        Command::Plan { scene } => {
            let checked = scene.load()?;
            run::check(&checked)?;
            print(plan::plan(&checked)?.trim_end());
        }
        Command::Run {
            scene,
            how,
            checkpoint_every,
        } => {
            let options = RunOptions {
                checkpoint_every,
                ..how.options()
            };
            say(&run::run(&scene.load()?, &options)?)?;
        }
        Command::Calibrate { scene, how } => {
            say(&calibrate::calibrate(&scene.load()?, &how.options())?)?;
        }
        Command::Pareto {
            scene,
            vary,
            reference,
            out,
            threads,
        } => {
            let loaded = scene.load()?;
            let comparison = pareto::Comparison::new(loaded, &vary, &reference)?;
            print(&comparison.run(out, threads.map(usize::from))?);
        }
        Command::Report { directories, out } => {
            let path = report::write_for(&directories, out.as_deref())?;
            print(&path.display().to_string());
        }
        Command::Schema => {
            let text = serde_json::to_string_pretty(&scene::json_schema())
                .map_err(|error| Failure::Run(error.to_string()))?;
            print(&text);
        }
    }
    Ok(())
}

/// Tells what a run has come to.
fn say(ended: &Ended) -> Result<(), Failure> {
    for warning in &ended.warnings {
        eprintln!("colluvium: {warning}");
    }
    if ended.already_done {
        print("already done: nothing to resume");
    }
    print(&report::digest(&ended.directory)?);
    Ok(())
}

/// Prints to stdout. A reader that has gone away (`| head`) is not an error.
fn print(text: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stdout(), "{text}");
}

/// The first sentence of a scene's leading comment.
fn first_sentence(text: &str) -> String {
    let comment: Vec<&str> = text
        .lines()
        .map_while(|line| line.strip_prefix('#'))
        .map(str::trim)
        .collect();
    let joined = comment.join(" ");
    joined
        .split_once(". ")
        .map_or(joined.clone(), |(sentence, _)| sentence.to_owned())
}
