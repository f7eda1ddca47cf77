//! The command line: what `colluvium` understands, and what each command does.

use crate::averages::{Choice, Where};
use crate::calibrate;
use crate::coarse_grain;
use crate::failure::Failure;
use crate::grain_files::Unsaid;
use crate::map;
use crate::pareto;
use crate::plan;
use crate::render;
use crate::report;
use crate::run::{self, Ended, RunOptions};
use crate::run_directory::Replaces;
use crate::scene::{self, Scene};
use crate::validate;
use clap::{Args, Parser, Subcommand};
use colluvium_coupling::coarse_graining::Shape;
use std::io::{ErrorKind, Write};
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
    /// Run a scene into a directory; Ctrl-C writes a checkpoint, another one 2 s later or more abandons the run
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
    /// Measure angle of repose and μ(I) on a grid of β and μ_R; what is finished in the directory is not run again
    Map {
        #[command(flatten)]
        scene: SceneArguments,
        /// Values of β, the shape parameter of contact.rolling
        #[arg(
            long,
            value_name = "A,B,...",
            value_delimiter = ',',
            default_value = "0.1,0.3,1"
        )]
        beta: Vec<f64>,
        /// Values of μ_R, its rolling friction
        #[arg(
            long,
            value_name = "A,B,...",
            value_delimiter = ',',
            default_value = "0.5,1.05,2"
        )]
        rolling_friction: Vec<f64>,
        /// Beds whose angles of repose are averaged
        #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
        beds: u16,
        /// Directory of the runs, map.toml, map.csv and the report
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Threads
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
    },
    /// Run a scene with several values of a key, or of several keys together: error against cost
    Pareto {
        #[command(flatten)]
        scene: SceneArguments,
        /// A key and its values, as in grid.cells=16,32,64; given for several keys, all combinations are run
        #[arg(long, value_name = "KEY=A,B,C", required = true)]
        vary: Vec<String>,
        /// Compare with a run that has this setting, instead of an exact solution
        #[arg(long, value_name = "KEY=VALUE")]
        reference: Vec<String>,
        /// Set a run with this setting beside the others, such as that of another model
        #[arg(long, value_name = "KEY=VALUE")]
        beside: Vec<String>,
        /// Directory of the table, the plot and the runs
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Threads of each run
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
    },
    /// Fields of grains that lie in files: density, velocity, stress, temperature, fabric, spin, couple stress
    CoarseGrain(Box<CoarseGrainArguments>),
    /// Run the suites with references and write one report of how far off each figure is
    Validate {
        /// Suite: incline, overlap, column [default: all]
        suite: Option<String>,
        /// Directory of the runs and the report; what is finished there is not run again
        #[arg(long, value_name = "DIR", default_value = "results/validate")]
        out: PathBuf,
        /// Threads
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
        /// Change a key of every scene of the suite
        #[arg(long, value_name = "KEY=VALUE")]
        set: Vec<String>,
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
    /// Draw the series of a run as PNG pictures and as an animation, which its report then shows
    Render {
        /// Run directory with grains.vtkhdf or fields.vtkhdf
        #[arg(value_name = "DIR")]
        directory: PathBuf,
        /// The axis that is looked along
        #[arg(long, value_name = "AXIS", value_parser = ["x", "y", "z"], default_value = "y")]
        view: String,
        /// Colour by speed, by what hangs together, or by clump
        #[arg(long, value_name = "WHAT", value_parser = ["speed", "cluster", "clump"], default_value = "speed")]
        colour: String,
        /// Pictures a second
        #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=50))]
        per_second: u16,
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
struct CoarseGrainArguments {
    /// grains.vtkhdf of a run, dumps of LAMMPS or LIGGGHTS, legacy VTK files of LIGGGHTS; instants are averaged
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Local dump of the contacts beside a text dump
    #[arg(long, value_name = "FILE")]
    contacts: Option<PathBuf>,
    /// Columns of that dump: id1,id2,fx,fy,fz, and tx,ty,tz for torques; a+b adds two, as for LAMMPS' pair/local, whose
    /// fx,fy,fz are the normal force and p1,p2,p3 the tangential one; LIGGGHTS' pair/gran/local has forces from the fourth
    /// on [default: the first five]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    contact_columns: Vec<String>,
    /// Kernel
    #[arg(long, value_name = "NAME", value_parser = ["lucy", "gauss", "heaviside", "polynomial"], default_value = "lucy")]
    kernel: String,
    /// Radius of the kernel's support, of gauss the standard deviation (m) [default: a diameter, half of one]
    #[arg(long, value_name = "M")]
    width: Option<f64>,
    /// Along z, in x and z, in space, around --axis, or at each --point
    #[arg(long, value_name = "NAME", value_parser = ["line", "plane", "grid", "cylinder", "points"], default_value = "line")]
    geometry: String,
    /// Edge of a cell (m) [default: half a mean diameter]
    #[arg(long, value_name = "M")]
    cell: Option<f64>,
    /// A point (m)
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    point: Vec<String>,
    /// Where the axis of the cylinder meets z = 0 (m)
    #[arg(
        long,
        value_name = "X,Y",
        default_value = "0,0",
        allow_hyphen_values = true
    )]
    axis: String,
    /// Angles around the axis
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u16).range(1..=4096))]
    angles: u16,
    /// Radii (m) at which the species part: their fields are written one by one
    #[arg(long, value_name = "R,...", value_delimiter = ',')]
    species_radii: Vec<f64>,
    /// The box (m), where the file has none
    #[arg(
        long = "box",
        value_name = "X0,X1,Y0,Y1,Z0,Z1",
        allow_hyphen_values = true
    )]
    domain: Option<String>,
    /// Periodic axes, where the file does not say: xy, none
    #[arg(long, value_name = "AXES")]
    periodic: Option<String>,
    /// Gravity (m/s²)
    #[arg(
        long,
        value_name = "X,Y,Z",
        default_value = "0,0,0",
        allow_hyphen_values = true
    )]
    gravity: String,
    /// Density of the grains (kg/m³), where the file has no masses
    #[arg(long, value_name = "RHO")]
    density: Option<f64>,
    /// Seconds of a step, where the file counts steps
    #[arg(long, value_name = "S")]
    timestep: Option<f64>,
    /// A type of grains that are held fixed
    #[arg(long, value_name = "TYPE")]
    fixed_type: Vec<i64>,
    /// Directory of the tables
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Numbers between commas, as many as are wanted.
fn numbers<const N: usize>(option: &str, text: &str) -> Result<[f64; N], Failure> {
    let refuse = |why: String| {
        Failure::Input(format!(
            "{option} {text}: {why}; allowed: {N} numbers between commas"
        ))
    };
    let number = |word: &str| {
        let value = word.trim().parse().ok().filter(|x: &f64| x.is_finite());
        value.ok_or_else(|| refuse(format!("`{word}` is not a number")))
    };
    let list: Vec<f64> = text.split(',').map(number).collect::<Result<_, _>>()?;
    list.try_into()
        .map_err(|list: Vec<f64>| refuse(format!("{} numbers are given", list.len())))
}

impl CoarseGrainArguments {
    fn request(&self) -> Result<coarse_grain::Request, Failure> {
        let domain = self.domain.as_deref().map(|text| {
            let [a, b, c, d, e, f] = numbers("--box", text)?;
            Ok::<_, Failure>([[a, c, e], [b, d, f]])
        });
        let periodic = self.periodic.as_deref().map(|text| {
            let known = text == "none" || text.chars().all(|c| "xyz".contains(c));
            if !known {
                let why = format!("--periodic {text}: some of x, y and z, or none");
                return Err(Failure::Input(why));
            }
            let has = |c: char| text != "none" && text.contains(c);
            Ok([has('x'), has('y'), has('z')])
        });
        let points = self.point.iter().map(|text| numbers("--point", text));
        let points: Vec<[f64; 3]> = points.collect::<Result<_, _>>()?;
        if (self.geometry == "points") == points.is_empty() {
            let why = "--point belongs to --geometry points, which needs at least one";
            return Err(Failure::Input(why.into()));
        }
        Ok(coarse_grain::Request {
            files: self.files.clone(),
            unsaid: Unsaid {
                contacts: self.contacts.clone(),
                contact_columns: self.contact_columns.clone(),
                domain: domain.transpose()?,
                periodic: periodic.transpose()?,
                gravity: numbers("--gravity", &self.gravity)?,
                density: self.density,
                timestep: self.timestep,
                fixed_types: self.fixed_type.clone(),
            },
            choice: Choice {
                shape: match self.kernel.as_str() {
                    "gauss" => Shape::Gauss,
                    "heaviside" => Shape::Heaviside,
                    "polynomial" => Shape::Polynomial,
                    _ => Shape::Lucy,
                },
                width: self.width,
                place: match self.geometry.as_str() {
                    "plane" => Where::Plane,
                    "grid" => Where::Grid,
                    "points" => Where::Points(points),
                    "cylinder" => {
                        Where::Cylinder(numbers("--axis", &self.axis)?, usize::from(self.angles))
                    }
                    _ => Where::Line,
                },
                cell: self.cell,
                species: self.species_radii.clone(),
            },
            out: self.out.clone(),
        })
    }
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
    /// Replace a run in the directory that is not finished and could be gone on with
    #[arg(long, conflicts_with = "resume")]
    overwrite: bool,
}

impl RunArguments {
    fn options(&self) -> RunOptions {
        RunOptions {
            out: self.out.clone(),
            threads: self.threads.map(usize::from),
            resume: self.resume,
            replaces: match self.overwrite {
                true => Replaces::Any,
                false => Replaces::Finished,
            },
            checkpoint_every: None,
        }
    }
}

/// Does what the command line asks for.
pub fn execute(line: CommandLine) -> Result<(), Failure> {
    match line.command {
        Command::Scenes { show: None } => {
            for (name, text) in scene::BUNDLED {
                print(&format!("{name:<18} {}", first_sentence(text)))?;
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
            print(text.trim_end())?;
        }
        Command::Check { scene } => {
            let checked = scene.load()?;
            run::check(&checked)?;
            print(&format!(
                "{}: a valid `{}` scene",
                scene.scene, checked.name
            ))?;
        }
        Command::Plan { scene } => {
            let checked = scene.load()?;
            run::check(&checked)?;
            print(plan::plan(&checked)?.trim_end())?;
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
        Command::Map {
            scene,
            beta,
            rolling_friction,
            beds,
            out,
            threads,
        } => {
            let (file, report) = map::measure(&map::Request {
                scene: scene.load()?,
                betas: beta,
                rolling: rolling_friction,
                beds: u64::from(beds),
                out,
                threads: threads.map(usize::from),
            })?;
            print(&format!("{}\n{}", file.display(), report.display()))?;
        }
        Command::Pareto {
            scene,
            vary,
            reference,
            beside,
            out,
            threads,
        } => {
            let loaded = scene.load()?;
            let comparison = pareto::Comparison::new(loaded, &vary, &reference, &beside)?;
            print(&comparison.run(out, threads.map(usize::from))?)?;
        }
        Command::CoarseGrain(arguments) => {
            print(&coarse_grain::coarse_grain(&arguments.request()?)?)?;
        }
        Command::Validate {
            suite,
            out,
            threads,
            set,
        } => {
            let options = validate::Options {
                out,
                threads: threads.map(usize::from),
                set,
            };
            let (report, missed) = validate::validate(suite.as_deref(), &options)?;
            print(&report.display().to_string())?;
            if missed > 0 {
                return Err(Failure::Run(format!(
                    "{missed} figures do not agree with their references; see {}",
                    report.display()
                )));
            }
        }
        Command::Report { directories, out } => {
            let path = report::write_for(&directories, out.as_deref())?;
            print(&path.display().to_string())?;
        }
        Command::Render {
            directory,
            view,
            colour,
            per_second,
        } => {
            let request = render::Request {
                view: match view.as_str() {
                    "x" => render::View::X,
                    "z" => render::View::Z,
                    _ => render::View::Y,
                },
                colour: match colour.as_str() {
                    "cluster" => render::Colour::Cluster,
                    "clump" => render::Colour::Clump,
                    _ => render::Colour::Speed,
                },
                per_second,
            };
            let rendered = render::render(&directory, &request)?;
            print(&rendered.display().to_string())?;
        }
        Command::Schema => {
            let text = serde_json::to_string_pretty(&scene::json_schema())
                .map_err(|error| Failure::Run(error.to_string()))?;
            print(&text)?;
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
        print("already done: nothing to resume")?;
    }
    print(&report::digest(&ended.directory)?)?;
    Ok(())
}

/// Prints to stdout. A reader that has gone away (`| head`) is not an error.
fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::Run(format!("cannot write to stdout: {error}")))
        }
        _ => Ok(()),
    }
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
