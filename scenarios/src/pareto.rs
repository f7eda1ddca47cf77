//! Error against cost: one scene run with several values of a key, or of several keys together.

mod observables;
mod variants;

use crate::calibrate;
use crate::cost::{Cost, processor_s};
use crate::failure::{Failure, Resumes};
use crate::report;
use crate::run::{self, RunOptions};
use crate::run_directory::{self, Replaces, RunDirectory};
use crate::scene::{Scene, SceneBody, SceneError};
use crate::summary::{Quantity, Status, Summary};
use crate::table::Table;
use observables::{Errors, TOLD, errors};
use std::path::{Path, PathBuf};
use std::time::Instant;
use variants::{Variant, label, parse, variants};

/// A scene, the values of the keys that vary, and what to compare with.
#[derive(Clone, Debug)]
pub struct Comparison {
    scene: Scene,
    /// The keys that vary.
    keys: Vec<String>,
    /// The scene with each combination of their values, the last key's changing first.
    variants: Vec<Variant>,
    /// The run that counts as right; none where the scene has an exact solution.
    reference: Option<Scene>,
    /// A run that is set beside the others, such as that of another model.
    beside: Option<Scene>,
}

/// One run of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The values of the keys as written.
    pub values: Vec<String>,
    /// Relative error; the largest where several observables are compared.
    pub error: f64,
    /// Relative error of each observable, where there are several.
    pub errors: Errors,
    /// Observed order between this and the run before, where one key varies.
    pub order: Option<f64>,
    /// Wall time (s).
    pub wall_s: f64,
    /// Processor time, preparation included (s).
    pub processor_s: f64,
    /// Wall time of the reference run over this one's.
    pub speed_up: Option<f64>,
    /// Grain-steps and cell-steps.
    pub steps: u64,
}

/// All runs of a comparison.
struct Ends {
    rows: Vec<Row>,
    /// Cost and processor time (s) of the reference.
    reference: Option<(Cost, f64)>,
    beside: Option<Row>,
}

impl Comparison {
    /// Checks the keys, each of their values, the reference and what is set beside.
    pub fn new(
        scene: Scene,
        vary: &[String],
        reference: &[String],
        beside: &[String],
    ) -> Result<Comparison, Failure> {
        let varied = parse(vary)?;
        let scene = of_one_duration(scene)?;
        let variants = variants(&scene, &varied)?;
        let keys = varied.into_iter().map(|(key, _)| key).collect();
        let with = |sets: &[String], from: &str| match sets {
            [] => Ok(None),
            sets => scene.with(sets, from).map(Some),
        };
        let reference = with(reference, "--reference")?;
        let beside = with(beside, "--beside")?;
        if reference.is_none() && !has_exact_solution(&scene) {
            return Err(Failure::Input(format!(
                "pareto {}: this scene has no exact solution; say what to compare with, as in `--reference {}`",
                scene.name,
                match scene.body {
                    SceneBody::Incline(_) => "timestep.steps_per_contact=100",
                    SceneBody::Grains(_) => "timestep.safety=0.3",
                    _ => "timestep=1e-5",
                }
            )));
        }
        Ok(Comparison {
            scene,
            keys,
            variants,
            reference,
            beside,
        })
    }

    /// Makes all runs; gives the table as text.
    pub fn run(&self, out: Option<PathBuf>, threads: Option<usize>) -> Result<String, Failure> {
        crate::interruption::listen();
        let name = format!("{}-pareto", self.scene.name);
        let place = run_directory::place(out.as_deref(), &name);
        let ends = self.reference.iter().chain(&self.beside);
        for scene in self.variants.iter().map(|v| &v.scene).chain(ends) {
            run::check(scene)?;
        }
        let directory = RunDirectory::create(&place, &self.scene, "pareto", Replaces::Finished)?;
        let start = Instant::now();
        self.finish(&directory, threads).map_err(|failure| {
            // A comparison has no state of its own to go on from.
            let failure = match failure.after_work() {
                Failure::Interrupted { .. } => Failure::Interrupted {
                    directory: directory.path().to_owned(),
                    resumes: Resumes::Never,
                },
                other => other,
            };
            directory.mark_ended(failure, start.elapsed().as_secs_f64())
        })
    }

    /// Makes the runs, writes table, summary and report.
    fn finish(&self, directory: &RunDirectory, threads: Option<usize>) -> Result<String, Failure> {
        let Ends {
            rows,
            reference,
            beside,
        } = self.run_all(directory, threads)?;
        let table = self.table(&rows);
        let ends = ends(reference.as_ref(), beside.as_ref());
        let tables: Vec<&Table> = [&table].into_iter().chain(&ends).collect();
        directory.write_tables(&tables)?;
        let mut summary = Summary::begun(&self.scene.name, "pareto");
        summary.status = Status::Done;
        summary.cost.wall_s = rows.iter().map(|r| r.wall_s).sum();
        summary.cost.threads = threads.unwrap_or_else(rayon::current_num_threads);
        summary.cost.peak_memory_bytes = crate::cost::peak_memory_bytes();
        summary.remarks.push(format!(
            "{} against {}",
            self.keys.join(", "),
            self.compared_with()
        ));
        for (n, key) in self.keys.iter().enumerate() {
            if let Some(words) = numbers(n, &rows).1 {
                summary
                    .remarks
                    .push(format!("{key} in pareto.csv: {words}."));
            }
        }
        for row in &rows {
            let at = label(&self.keys, &row.values);
            if !row.error.is_finite() {
                summary.remarks.push(format!(
                    "No error at {at}: the run, or what it is compared with, has no value to compare."
                ));
            }
            summary.put(
                &format!("error at {at}"),
                Quantity::new(row.error, "1").against(0.0, &self.compared_with()),
            );
        }
        if let Some(order) = rows.iter().rev().find_map(|r| r.order) {
            summary.put(
                "observed_order",
                Quantity::new(order, "1").from("between the last two runs"),
            );
        }
        let mut end_point = String::new();
        if let Some((cost, processor_s)) = &reference {
            let steps = cost.grain_steps + cost.cell_steps;
            end_point = format!(
                "\nreference: {:.4} s, {processor_s:.2} s of processors, {steps} steps",
                cost.wall_s
            );
            let source = "of the run that counts as right, the end point of error against cost";
            summary.put(
                "reference_wall_s",
                Quantity::new(cost.wall_s, "s").from(source),
            );
            summary.put(
                "reference_processor_s",
                Quantity::new(*processor_s, "s").from(source),
            );
            summary.put(
                "reference_steps",
                Quantity::new(steps as f64, "1").from(source),
            );
        }
        if let Some(row) = &beside {
            summary.put(
                "error at beside",
                Quantity::new(row.error, "1").against(0.0, &self.compared_with()),
            );
            end_point.push_str(&format!(
                "\nbeside: error {:.4e}, {:.4} s, {:.2} s of processors, {} steps",
                row.error, row.wall_s, row.processor_s, row.steps
            ));
        }
        directory.write_summary(&summary)?;
        report::write(directory.path())?;
        let mut text = self.text(&rows) + &end_point;
        text.push_str(&format!(
            "\n{}",
            directory.file(run_directory::REPORT).display()
        ));
        Ok(text)
    }

    fn run_all(&self, directory: &RunDirectory, threads: Option<usize>) -> Result<Ends, Failure> {
        let one = |label: &str, scene: &Scene| -> Result<(PathBuf, f64), Failure> {
            directory.journal.note(&format!("run {label}"));
            let before = processor_s();
            let out = Some(directory.path().join(label));
            let options = RunOptions {
                out,
                threads,
                // A comparison that is called again starts again.
                replaces: Replaces::Any,
                ..RunOptions::default()
            };
            let ended = if self.of_campaigns() {
                calibrate::calibrate(scene, &options)
            } else {
                run::run(scene, &options)
            };
            Ok((ended?.directory, processor_s() - before))
        };
        let reference = match &self.reference {
            Some(scene) => {
                let (path, seconds) = one("reference", scene)?;
                let cost = report::read_summary(&path)?.cost;
                Some((path, (cost, seconds)))
            }
            None => None,
        };
        let row = |label: &str, values: &[String], scene: &Scene| -> Result<Row, Failure> {
            let (path, processor_s) = one(label, scene)?;
            let summary = report::read_summary(&path)?;
            let (error, errors) = match &reference {
                Some((reference, _)) => self.against(&path, reference)?,
                None => (exact_error(&summary), Errors::new()),
            };
            let cost = summary.cost;
            let speed_up = reference.as_ref();
            Ok(Row {
                values: values.to_vec(),
                error,
                errors: match errors.len() {
                    0 | 1 => Errors::new(),
                    _ => errors,
                },
                order: None,
                wall_s: cost.wall_s,
                processor_s,
                speed_up: speed_up.map(|(_, (of, _))| of.wall_s / cost.wall_s),
                steps: cost.grain_steps + cost.cell_steps,
            })
        };
        let mut rows: Vec<Row> = Vec::new();
        for variant in &self.variants {
            let mut new = row(&variant.folder, &variant.values, &variant.scene)?;
            new.order = rows.last().and_then(|before| order_between(before, &new));
            rows.push(new);
        }
        let beside = match &self.beside {
            Some(scene) => Some(row("beside", &[], scene)?),
            None => None,
        };
        Ok(Ends {
            rows,
            reference: reference.map(|(_, cost)| cost),
            beside,
        })
    }

    /// Largest error of a run against another, and each.
    fn against(&self, run: &Path, reference: &Path) -> Result<(f64, Errors), Failure> {
        let errors = if self.of_campaigns() {
            observables::of_campaigns(run, reference)?
        } else {
            errors(&self.scene, run, reference)?
        };
        // A missing value counts as missing, not as the best.
        let worst = |a: f64, &(_, b): &(String, f64)| {
            if a.is_nan() || b.is_nan() {
                f64::NAN
            } else {
                a.max(b)
            }
        };
        let judged = errors
            .iter()
            .filter(|(name, _)| !TOLD.contains(&name.as_str()));
        Ok((judged.fold(0.0, worst), errors))
    }

    /// Keys of a campaign are compared by campaigns.
    fn of_campaigns(&self) -> bool {
        matches!(self.scene.body, SceneBody::Incline(_))
            && self.keys.iter().any(|key| key.starts_with("calibration."))
    }

    fn compared_with(&self) -> String {
        match &self.reference {
            Some(_) if self.of_campaigns() => "the reference campaign; largest relative error of the fitted friction over the range of I that both measured, and of the slopes where flow stops and sets off".to_owned(),
            Some(_) => observables::against_reference(&self.scene),
            None => match self.scene.body {
                SceneBody::Bagnold(_) | SceneBody::Sheared(_) => "exact profile, relative L2 error of u".to_owned(),
                _ => "restitution of the scene".to_owned(),
            },
        }
    }

    fn table(&self, rows: &[Row]) -> Table {
        let mut table = Table::new("pareto");
        for (n, key) in self.keys.iter().enumerate() {
            table = table.with(key, "", numbers(n, rows).0);
        }
        table = table
            .with("error", "1", rows.iter().map(|r| r.error).collect())
            .with(
                "order",
                "1",
                rows.iter().map(|r| r.order.unwrap_or(f64::NAN)).collect(),
            )
            .with("wall_s", "s", rows.iter().map(|r| r.wall_s).collect())
            .with(
                "processor_s",
                "s",
                rows.iter().map(|r| r.processor_s).collect(),
            )
            .with(
                "grain_and_cell_steps",
                "1",
                rows.iter().map(|r| r.steps as f64).collect(),
            )
            .with("on_front", "1", front(rows));
        if rows.iter().any(|r| r.speed_up.is_some()) {
            let speed_up = rows.iter().map(|r| r.speed_up.unwrap_or(f64::NAN));
            table = table.with("speed_up", "1", speed_up.collect());
        }
        for (n, (name, _)) in rows
            .first()
            .map_or(&[][..], |r| &r.errors)
            .iter()
            .enumerate()
        {
            let column = rows
                .iter()
                .map(|r| r.errors.get(n).map_or(f64::NAN, |e| e.1));
            table = table.with(&format!("error_{name}"), "1", column.collect());
        }
        table
    }

    fn text(&self, rows: &[Row]) -> String {
        let widths: Vec<usize> = self.keys.iter().map(|key| key.len().max(12)).collect();
        let aligned = |cells: &[String]| {
            let cells = cells.iter().zip(&widths);
            let cells: Vec<String> = cells.map(|(c, width)| format!("{c:>width$}")).collect();
            cells.join("  ")
        };
        let names: Vec<&str> = rows
            .first()
            .map_or(&[][..], |r| &r.errors)
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        let mut text = format!(
            "{}  {:>12}  {:>8}  {:>10}  {:>13}  {:>8}  {:>20}",
            aligned(&self.keys),
            "error",
            "order",
            "wall [s]",
            "processor [s]",
            "speed-up",
            "grain and cell steps"
        );
        for name in &names {
            text.push_str(&format!("  {name:>12}"));
        }
        for row in rows {
            let some =
                |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |o| format!("{o:.3}"));
            let error = |error: f64| {
                if error.is_finite() {
                    format!("{error:.4e}")
                } else {
                    "none".to_owned()
                }
            };
            text.push_str(&format!(
                "\n{}  {:>12}  {:>8}  {:>10.4}  {:>13.2}  {:>8}  {:>20}",
                aligned(&row.values),
                error(row.error),
                some(row.order),
                row.wall_s,
                row.processor_s,
                some(row.speed_up),
                row.steps
            ));
            for (name, (_, value)) in names.iter().zip(&row.errors) {
                let width = name.len().max(12);
                text.push_str(&format!("  {:>width$}", error(*value)));
            }
        }
        text.push_str(&format!("\nerror: {}", self.compared_with()));
        text
    }
}

/// The values of a key, run by run, as numbers: what is no number is counted, 1 for the first; the second tells which is which.
fn numbers(key: usize, rows: &[Row]) -> (Vec<f64>, Option<String>) {
    let values: Vec<&str> = rows.iter().map(|r| r.values[key].as_str()).collect();
    if let Some(numbers) = values.iter().map(|v| number(v)).collect() {
        return (numbers, None);
    }
    let mut words: Vec<&str> = Vec::new();
    let mut places = Vec::new();
    for value in values {
        let known = words.iter().position(|word| *word == value);
        let place = known.unwrap_or(words.len());
        if known.is_none() {
            words.push(value);
        }
        places.push((place + 1) as f64);
    }
    let told = words
        .iter()
        .zip(1..)
        .map(|(word, n)| format!("{n} is {word}"));
    let told: Vec<String> = told.collect();
    (places, Some(told.join(", ")))
}

/// What stands at the ends of error against cost: the reference, whose error is 0, and a run beside, if there are any.
fn ends(reference: Option<&(Cost, f64)>, beside: Option<&Row>) -> Option<Table> {
    let mut rows: Vec<[f64; 4]> = Vec::new();
    if let Some((cost, seconds)) = reference {
        let steps = cost.grain_steps + cost.cell_steps;
        rows.push([0.0, cost.wall_s, *seconds, steps as f64]);
    }
    rows.extend(beside.map(|r| [r.error, r.wall_s, r.processor_s, r.steps as f64]));
    let column = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
    (!rows.is_empty()).then(|| {
        Table::new("ends")
            .with("error", "1", column(0))
            .with("wall_s", "s", column(1))
            .with("processor_s", "s", column(2))
            .with("grain_and_cell_steps", "1", column(3))
    })
}

/// A bed compared at several time steps has to run for one time, not for one number of steps.
fn of_one_duration(scene: Scene) -> Result<Scene, SceneError> {
    let pace = match &scene.body {
        SceneBody::Chute(body) => body.pace(),
        SceneBody::Settle(body) => body.pace(),
        _ => return Ok(scene),
    };
    let duration = pace.steps as f64 * pace.timestep;
    scene.with(&[format!("duration={duration:?}")], "pareto")
}

fn has_exact_solution(scene: &Scene) -> bool {
    matches!(
        scene.body,
        SceneBody::Bagnold(_) | SceneBody::Sheared(_) | SceneBody::Impact(_)
    )
}

fn exact_error(summary: &Summary) -> f64 {
    let value = |name: &str| summary.results.get(name).and_then(|q| q.value);
    if let Some(error) = value("velocity_error_l2") {
        return error;
    }
    let reference = summary.results.get("restitution").and_then(|q| q.reference);
    match (value("restitution"), reference) {
        (Some(value), Some(reference)) => (value - reference).abs() / reference,
        _ => f64::NAN,
    }
}

/// A value as a number; true and false as 1 and 0.
fn number(value: &str) -> Option<f64> {
    match value {
        "true" => Some(1.0),
        "false" => Some(0.0),
        value => value.parse().ok(),
    }
}

/// ln(e_1/e_2)/ln(v_2/v_1): positive where the error falls as the value grows; none where several keys vary.
fn order_between(before: &Row, new: &Row) -> Option<f64> {
    let ([a], [b]) = (&before.values[..], &new.values[..]) else {
        return None;
    };
    let order = (before.error / new.error).ln() / (number(b)? / number(a)?).ln();
    order.is_finite().then_some(order)
}

/// 1 for runs of which no other has both a smaller error and a smaller cost, 0 for the others.
fn front(rows: &[Row]) -> Vec<f64> {
    let beaten = |row: &Row| {
        let better = |other: &&Row| other.error < row.error && other.processor_s < row.processor_s;
        !row.error.is_finite() || rows.iter().any(|other| better(&other))
    };
    rows.iter().map(|row| f64::from(!beaten(row))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(values: &[&str], error: f64, processor_s: f64) -> Row {
        Row {
            values: values.iter().map(|v| (*v).to_owned()).collect(),
            error,
            errors: Errors::new(),
            order: None,
            wall_s: 1.0,
            processor_s,
            speed_up: None,
            steps: 1,
        }
    }

    #[test]
    fn the_order_of_a_halved_error_is_read_off() {
        let coarse = row(&["16"], 4e-3, 1.0);
        let order = order_between(&coarse, &row(&["32"], 1e-3, 1.0)).unwrap();
        assert!((order - 2.0).abs() < 1e-12);
        assert_eq!(order_between(&coarse, &row(&["fine"], 1e-3, 1.0)), None);
        let two = row(&["32", "2"], 1e-3, 1.0);
        assert_eq!(order_between(&coarse, &two), None);
    }

    #[test]
    fn words_are_counted_and_numbers_stand() {
        let rows = [
            row(&["8", "dem"], 0.1, 1.0),
            row(&["16", "hybrid"], 0.1, 1.0),
        ];
        assert_eq!(numbers(0, &rows), (vec![8.0, 16.0], None));
        let words = Some("1 is dem, 2 is hybrid".to_owned());
        assert_eq!(numbers(1, &rows), (vec![1.0, 2.0], words));
    }

    #[test]
    fn the_front_leaves_out_what_is_worse_and_dearer() {
        let rows = [
            row(&["a"], 0.1, 1.0),
            row(&["b"], 0.2, 2.0),
            row(&["c"], 0.05, 3.0),
            row(&["d"], f64::NAN, 0.5),
        ];
        assert_eq!(front(&rows), [1.0, 0.0, 1.0, 0.0]);
    }
}
