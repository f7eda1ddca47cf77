//! Reports: one self-contained HTML file from what a run directory holds.

pub mod calibration;
mod figures;
pub mod page;
pub mod plot;
mod sections;

use crate::failure::Failure;
use crate::run_directory::{REPORT, SCENE, SUMMARY, write_in_place};
use crate::scene::Scene;
use crate::summary::{Quantity, Status, Summary};
use crate::table::Table;
use maud::{Markup, html};
use page::{count, number, with_error};
use std::path::{Path, PathBuf};

/// What a report is made from.
#[derive(Debug)]
pub struct Record {
    /// The directory.
    pub path: PathBuf,
    /// The summary.
    pub summary: Summary,
    /// The resolved scene, as text.
    pub scene: String,
}

impl Record {
    /// Reads the directory of a run.
    pub fn read(path: &Path) -> Result<Record, Failure> {
        let summary = read_summary(path)?;
        let scene = std::fs::read_to_string(path.join(SCENE)).unwrap_or_default();
        Ok(Record {
            path: path.to_owned(),
            summary,
            scene,
        })
    }

    /// The resolved scene, if it can still be read.
    pub fn resolved(&self) -> Option<Scene> {
        Scene::from_text(&self.scene, SCENE).ok()
    }

    /// A table of the run, if it is there.
    pub fn table(&self, name: &str) -> Option<Table> {
        Table::from_csv(&self.path.join(format!("{name}.csv"))).ok()
    }
}

/// Reads the summary of a run directory.
pub fn read_summary(path: &Path) -> Result<Summary, Failure> {
    let file = path.join(SUMMARY);
    let text = std::fs::read_to_string(&file).map_err(|error| {
        Failure::Input(format!(
            "{}: no run directory: cannot read {SUMMARY}: {error}; allowed: a directory that a run wrote",
            path.display()
        ))
    })?;
    serde_json::from_str(&text)
        .map_err(|error| Failure::Input(format!("{}: {error}", file.display())))
}

/// Writes `report.html` into a run directory.
pub fn write(path: &Path) -> Result<PathBuf, Failure> {
    write_for(&[path.to_owned()], Some(&path.join(REPORT)))
}

/// Writes the report of one or more runs; without a place, into the one directory or here.
pub fn write_for(directories: &[PathBuf], out: Option<&Path>) -> Result<PathBuf, Failure> {
    let records = directories
        .iter()
        .map(|d| Record::read(d))
        .collect::<Result<Vec<_>, Failure>>()?;
    let place = match (out, directories) {
        (Some(out), _) => out.to_owned(),
        (None, [one]) => one.join(REPORT),
        (None, _) => PathBuf::from(REPORT),
    };
    let text = match records.as_slice() {
        [one] => {
            let (title, lead, body) = one_run(one);
            page::page(&title, &lead, &body)
        }
        many => {
            let body = html! {
                @for record in many {
                    @let (title, lead, body) = one_run(record);
                    h1 style="margin-top:3rem" { (title) }
                    p.lead { (lead) }
                    (body)
                }
            };
            page::page("Colluvium runs", &format!("{} runs", many.len()), &body)
        }
    };
    write_in_place(&place, text.as_bytes()).map_err(|error| {
        Failure::Input(format!(
            "--out {}: cannot write the report: {error}",
            place.display()
        ))
    })?;
    Ok(place)
}

/// A few lines about a finished run, for the terminal.
pub fn digest(path: &Path) -> Result<String, Failure> {
    let summary = read_summary(path)?;
    let mut lines = summary.remarks.clone();
    for (name, q) in &summary.results {
        let value = q
            .value
            .map_or_else(|| "–".into(), |v| with_error(v, q.error.unwrap_or(0.0)));
        let unit = if q.unit == "1" {
            String::new()
        } else {
            format!(" {}", q.unit)
        };
        let against = q
            .reference
            .map(|r| format!("   (reference {})", number(r)))
            .unwrap_or_default();
        lines.push(format!("{name:<28} {value}{unit}{against}"));
    }
    let cost = &summary.cost;
    lines.push(format!(
        "{:<28} {:.2} s on {} threads",
        "wall time", cost.wall_s, cost.threads
    ));
    if cost.grain_steps > 0 {
        lines.push(format!(
            "{:<28} {:.3e} per second",
            "grain-steps", cost.grain_steps_per_s
        ));
    }
    lines.push(format!("{}", path.join(REPORT).display()));
    Ok(lines.join("\n"))
}

fn one_run(record: &Record) -> (String, String, Markup) {
    let summary = &record.summary;
    let title = match summary.command.as_str() {
        "calibrate" => format!("Calibration of {}", summary.scene),
        "pareto" => format!("Error against cost: {}", summary.scene),
        _ => format!("Run of {}", summary.scene),
    };
    let status = match summary.status {
        Status::Done => "done",
        Status::Running => "not finished",
        Status::Interrupted => "interrupted",
        Status::Failed => "failed",
    };
    let lead = format!(
        "{status} · {} · {:.1} s on {} {}",
        record.path.display(),
        summary.cost.wall_s,
        summary.cost.threads,
        if summary.cost.threads == 1 {
            "thread"
        } else {
            "threads"
        }
    );
    let campaign = calibration::Campaign::read(&record.path);
    let body = html! {
        @match &campaign {
            Some(campaign) => { (calibration::sections(record, campaign)) }
            None => {
                (remarks(summary))
                (sections::plots(record))
                (figures::figures(record))
                (results(summary))
                (figures::preparation(summary))
            }
        }
        (model(summary))
        (cost(summary))
        details {
            summary { "The resolved scene" }
            pre { (record.scene) }
        }
    };
    (title, lead, body)
}

fn remarks(summary: &Summary) -> Markup {
    html! {
        @if !summary.remarks.is_empty() {
            div.verdict {
                @for remark in &summary.remarks { p { (remark) } }
            }
        }
    }
}

/// Table of results with references.
pub fn results(summary: &Summary) -> Markup {
    let shown = |q: &Quantity| match q.value {
        Some(value) => with_error(value, q.error.unwrap_or(0.0)),
        None => "–".to_owned(),
    };
    html! {
        @if !summary.results.is_empty() {
            h2 { "Results" }
            div.wide {
                table {
                    tr {
                        th { "quantity" } th { "value" } th { "unit" } th { "reference" }
                        th.text { "source" }
                    }
                    @for (name, q) in &summary.results {
                        tr {
                            td { (name.replace('_', " ")) }
                            td { (shown(q)) }
                            td { (q.unit) }
                            td { @if let Some(r) = q.reference { (number(r)) } }
                            td.text.wrap { (q.source) }
                        }
                    }
                }
            }
        }
    }
}

fn model(summary: &Summary) -> Markup {
    let model = &summary.model;
    html! {
        @if model.grains + model.cells > 0 {
            h2 { "What was modelled" }
            table {
                @if model.grains > 0 { tr { td { "grains" } td { (count(model.grains)) } } }
                @if model.cells > 0 { tr { td { "cells" } td { (count(model.cells)) } } }
                tr { td { "time step" } td { (number(model.dt_s)) " s" } }
                tr { td { "limited by" } td { (model.dt_limit) } }
            }
            @if !model.left_out.is_empty() {
                p { "Left out: " (model.left_out.join(", ")) "." }
            }
        }
    }
}

fn cost(summary: &Summary) -> Markup {
    let cost = &summary.cost;
    let ledger = &summary.ledger;
    html! {
        h2 { "Cost and conservation" }
        table {
            tr { td { "wall time" } td { (number(cost.wall_s)) " s" } }
            tr { td { "threads" } td { (cost.threads) } }
            @if cost.grain_steps > 0 {
                tr { td { "grain-steps" } td { (count(cost.grain_steps)) } }
                tr { td { "grain-steps per second" } td { (number(cost.grain_steps_per_s)) } }
            }
            @if cost.cell_steps > 0 {
                tr { td { "cell-steps" } td { (count(cost.cell_steps)) } }
                tr { td { "cell-steps per second" } td { (number(cost.cell_steps_per_s)) } }
            }
            tr { td { "peak memory" } td { (number(cost.peak_memory_bytes as f64 / 1.048_576e6)) " MiB" } }
            tr { td { "mass, relative error" } td { (number(ledger.mass_relative)) } }
            @if let Some(error) = ledger.momentum_relative {
                tr { td { "momentum balance, relative error" } td { (number(error)) } }
            }
            @if let Some(error) = ledger.angular_momentum_relative {
                tr { td { "angular momentum, relative error" } td { (number(error)) } }
            }
            @if !summary.state_hash.is_empty() {
                tr { td { "state hash" } td { code { (summary.state_hash) } } }
            }
        }
    }
}
