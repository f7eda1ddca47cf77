//! Validation: suites of cases with references, and one report of how far off each is.
//!
//! A suite is a function from a directory to [`Check`]s: it runs its cases into the directory (what is finished there
//! is not run again) and says what it compares with what. Adding a suite = one file and one line in [`SUITES`].

mod column;
mod incline;
mod overlap;

use crate::failure::Failure;
use crate::report::page::{number, page, with_error};
use crate::run_directory::write_in_place;
use maud::{Markup, html};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// One figure beside its reference.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// Case, as a scene and what was changed.
    pub case: String,
    /// What is compared.
    pub what: String,
    /// Ours.
    pub value: f64,
    /// Its standard error.
    pub error: Option<f64>,
    /// What it should be.
    pub reference: f64,
    /// Its standard error.
    pub reference_error: Option<f64>,
    /// Largest difference, in the unit of the value, that still agrees; none: the figure is told, not judged.
    pub allowed: Option<f64>,
    /// Where the reference comes from.
    pub source: String,
}

impl Check {
    /// Ours less theirs.
    pub fn difference(&self) -> f64 {
        self.value - self.reference
    }

    /// The difference in joint standard errors.
    pub fn in_errors(&self) -> Option<f64> {
        let joint = self
            .error
            .unwrap_or(0.0)
            .hypot(self.reference_error.unwrap_or(0.0));
        (joint > 0.0).then(|| self.difference() / joint)
    }

    /// Whether it agrees, if it is judged. What is not a number does not agree.
    pub fn agrees(&self) -> Option<bool> {
        self.allowed.map(|most| self.difference().abs() <= most)
    }
}

/// What a suite found.
#[derive(Debug, Default)]
pub struct Found {
    /// Figures.
    pub checks: Vec<Check>,
    /// Remarks in words.
    pub remarks: Vec<String>,
    /// Reports of its runs, relative to the directory.
    pub reports: Vec<String>,
    /// More sections: tables and pictures.
    pub sections: Vec<Markup>,
}

/// Options of a validation.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Directory of the runs and the report.
    pub out: PathBuf,
    /// Threads.
    pub threads: Option<usize>,
    /// Changes to every scene of the suite, as `--set`.
    pub set: Vec<String>,
}

/// A suite.
#[derive(Clone, Copy)]
pub struct Suite {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is about.
    pub about: &'static str,
    /// Runs it.
    pub run: fn(&Options) -> Result<Found, Failure>,
}

/// All suites.
pub const SUITES: &[Suite] = &[
    Suite {
        name: "incline",
        about: "grains and continuum on rough inclined planes against theory, published values and another code",
        run: incline::run,
    },
    Suite {
        name: "overlap",
        about: "a slope as grains, as continuum and as both joined, with a joint that exchanges nothing as the control",
        run: overlap::run,
    },
    Suite {
        name: "column",
        about: "a column that collapses as grains, as continuum and as both joined: parts of law, mesh, coupling and packing, with a joint that exchanges nothing as the control",
        run: column::run,
    },
];

/// Runs one suite, or all of them; gives the report's path and how many judged figures do not agree.
///
/// # Errors
/// An unknown name, or what a suite fails with.
pub fn validate(name: Option<&str>, options: &Options) -> Result<(PathBuf, usize), Failure> {
    let chosen: Vec<&Suite> = SUITES
        .iter()
        .filter(|s| name.is_none_or(|n| n == s.name))
        .collect();
    if chosen.is_empty() {
        let names: Vec<&str> = SUITES.iter().map(|s| s.name).collect();
        return Err(Failure::Input(format!(
            "no suite is called `{}`; allowed: {}",
            name.unwrap_or_default(),
            names.join(", ")
        )));
    }
    std::fs::create_dir_all(&options.out).map_err(|error| {
        Failure::Input(format!("cannot make {}: {error}", options.out.display()))
    })?;
    let (mut body, mut all) = (Vec::new(), Vec::new());
    for suite in chosen {
        let start = Instant::now();
        let found = (suite.run)(options)?;
        body.push(section(suite, &found, start.elapsed().as_secs_f64()));
        all.extend(found.checks);
    }
    let missed = all.iter().filter(|c| c.agrees() == Some(false)).count();
    let judged = all.iter().filter(|c| c.allowed.is_some()).count();
    let lead = format!(
        "{} of {judged} judged figures agree with their references.",
        judged - missed
    );
    let text = page(
        "Validation",
        &lead,
        &html! { @for part in &body { (part) } },
    );
    let report = options.out.join("report.html");
    write(&report, text.as_bytes())?;
    let json = serde_json::to_vec_pretty(&all).map_err(|e| Failure::Run(e.to_string()))?;
    write(&options.out.join("checks.json"), &json)?;
    Ok((report, missed))
}

fn write(path: &Path, content: &[u8]) -> Result<(), Failure> {
    write_in_place(path, content)
        .map_err(|error| Failure::Run(format!("cannot write {}: {error}", path.display())))
}

fn section(suite: &Suite, found: &Found, wall_s: f64) -> Markup {
    html! {
        h2 { (suite.name) }
        p { (suite.about) ". " (format!("{wall_s:.0} s now; runs that were finished before are not run again.")) }
        @for remark in &found.remarks { p { (remark) } }
        div.wide { table {
            tr {
                th { "case" } th.text { "figure" } th { "ours" } th { "reference" } th { "difference" } th { "in errors" }
                th.text { "" } th.text { "source" }
            }
            @for c in &found.checks {
                tr {
                    td { (c.case) }
                    td.text { (c.what) }
                    td { (with_error(c.value, c.error.unwrap_or(0.0))) }
                    td { (with_error(c.reference, c.reference_error.unwrap_or(0.0))) }
                    td {
                        @if c.reference == 0.0 { (number(c.difference())) }
                        @else { (format!("{:+.1} %", 100.0 * c.difference() / c.reference.abs())) }
                    }
                    td { @if let Some(n) = c.in_errors() { (format!("{n:+.1}")) } }
                    td.text { @match c.agrees() {
                        Some(true) => span.tag.good { "agrees" },
                        Some(false) => span.tag.bad { "differs" },
                        None => "",
                    } }
                    td.text.wrap { (c.source) }
                }
            }
        } }
        @for part in &found.sections { (part) }
        @if !found.reports.is_empty() {
            p { "Reports of the runs: " @for (k, r) in found.reports.iter().enumerate() { @if k > 0 { ", " } a href=(r) { (r) } } "." }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_judged_by_what_is_allowed() {
        let check = |value: f64, allowed| Check {
            case: "c".into(),
            what: "w".into(),
            value,
            error: Some(0.03),
            reference: 1.0,
            reference_error: Some(0.04),
            allowed,
            source: String::new(),
        };
        assert_eq!(check(1.1, Some(0.2)).agrees(), Some(true));
        assert_eq!(check(1.3, Some(0.2)).agrees(), Some(false));
        assert_eq!(check(f64::NAN, Some(0.2)).agrees(), Some(false));
        assert_eq!(check(1.3, None).agrees(), None);
        assert!((check(1.1, None).in_errors().unwrap() - 2.0).abs() < 1e-9);
    }
}
