//! Tables of a comparison: Markdown for readers, JSON for programs.

use super::case::State;
use super::find::Code;
use super::rounds::{Comparison, Entrant, rate};
use super::statistics::{Spread, spread};
use super::trace::Trace;
use serde::Serialize;
use std::fmt::Write;

/// A line of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Code.
    pub code: Code,
    /// Cores.
    pub threads: usize,
    /// What the code calls itself.
    pub version: String,
    /// The law it solves.
    pub law: String,
    /// Grain-steps per second of wall time.
    pub wall_rate: Option<Spread>,
    /// Grain-steps per second of CPU time.
    pub cpu_rate: Option<Spread>,
    /// Wall rate over that of LAMMPS on as many cores, round by round.
    pub wall_ratio: Option<Spread>,
    /// CPU rate over that of LAMMPS on as many cores, round by round.
    pub cpu_ratio: Option<Spread>,
    /// States of the first run at the compared steps.
    pub states: Vec<State>,
    /// Their kinetic energy over the reference's, less one.
    pub kinetic_errors: Vec<Option<f64>>,
    /// Their height over the reference's, less one.
    pub height_errors: Vec<Option<f64>>,
    /// Why there is no more.
    pub trouble: Option<String>,
}

/// Lines of the table, in the order of the entrants.
pub fn rows(comparison: &Comparison) -> Vec<Row> {
    comparison
        .entrants
        .iter()
        .map(|e| row(comparison, e))
        .collect()
}

fn row(c: &Comparison, entrant: &Entrant) -> Row {
    let wall = |t: &Trace| Some(rate(&c.case, t));
    let cpu = |t: &Trace| Some(rate(&c.case, t) * t.wall / t.cpu?);
    let rates =
        |f: &dyn Fn(&Trace) -> Option<f64>| spread(entrant.traces.iter().flatten().filter_map(f));
    let lammps = c
        .entrants
        .iter()
        .find(|e| e.code == Code::Lammps && e.threads == entrant.threads);
    let ratios = |f: &dyn Fn(&Trace) -> Option<f64>| {
        let pairs = entrant.traces.iter().zip(&lammps?.traces);
        spread(pairs.filter_map(|(ours, theirs)| Some(f(ours.as_ref()?)? / f(theirs.as_ref()?)?)))
    };
    let first = entrant.traces.iter().flatten().next();
    let states: Vec<State> = c
        .case
        .compared
        .iter()
        .filter_map(|s| first?.state(*s).copied())
        .collect();
    let error = |get: fn(&State) -> f64| -> Vec<Option<f64>> {
        let one = |s: &State| {
            let known = c.reference.iter().find(|r| r.step == s.step)?;
            Some(get(s) / get(known) - 1.0).filter(|e| e.is_finite())
        };
        states.iter().map(one).collect()
    };
    Row {
        code: entrant.code,
        threads: entrant.threads,
        version: first.map(|t| t.version.clone()).unwrap_or_default(),
        law: entrant.law.clone(),
        wall_rate: rates(&wall),
        cpu_rate: rates(&cpu),
        wall_ratio: ratios(&wall),
        cpu_ratio: ratios(&cpu),
        kinetic_errors: error(|s| s.kinetic),
        height_errors: error(|s| s.height),
        states,
        trouble: entrant.trouble.clone(),
    }
}

/// The comparison as Markdown. `missing` are codes that were not found, with what to do.
pub fn markdown(c: &Comparison, missing: &[(Code, String)]) -> String {
    let rows = rows(c);
    let case = &c.case;
    let mut m = format!(
        "# {}: side by side with other codes\n\n{}.\n",
        case.name, case.title
    );
    // Writing to a String cannot fail.
    let loads: Vec<String> = c.load.iter().flatten().map(|l| format!("{l:.1}")).collect();
    let _ = writeln!(
        m,
        "Δt {:e}; clock over {} steps after {} of warm-up; {} rounds in turns, each run held on its own \
         cores.\n{}, {} cores; load before each round and after the last: {}.\n",
        case.timestep,
        case.steps,
        case.warm_up,
        c.entrants.first().map_or(0, |e| e.traces.len()),
        c.machine.processor,
        c.machine.cores.len(),
        loads.join(", "),
    );
    m.push_str(
        "Million grain-steps per second, median [min, max], loop time only; ratios to LAMMPS on as many \
         cores, pair by pair of each round.\n\n\
         | code | cores | rate, wall | rate, CPU | ratio, wall | ratio, CPU |\n|---|---|---|---|---|---|\n",
    );
    for r in &rows {
        let name = r.code.name();
        if r.wall_rate.is_none() {
            let why = r.trouble.as_deref().unwrap_or("no run");
            let _ = writeln!(
                m,
                "| {name} | {} | {} | | | |",
                r.threads,
                why.replace('|', "/")
            );
            continue;
        }
        let _ = writeln!(
            m,
            "| {name} | {} | {} | {} | {} | {} |",
            r.threads,
            cell(r.wall_rate, 1e-6),
            cell(r.cpu_rate, 1e-6),
            cell(r.wall_ratio, 1.0),
            cell(r.cpu_ratio, 1.0)
        );
    }
    if rows
        .iter()
        .any(|r| r.code == Code::Esys && r.wall_rate.is_some())
    {
        m.push_str("\nESyS-Particle's master process waits on the same cores as its workers.\n");
    }
    physics(&mut m, c, &rows);
    if !missing.is_empty() {
        m.push_str("\nNot on this machine:\n\n");
        for (code, why) in missing {
            let _ = writeln!(m, "- {}: {why}", code.name());
        }
    }
    m
}

/// Kinetic energy and height at the compared steps.
fn physics(m: &mut String, c: &Comparison, rows: &[Row]) {
    let _ = writeln!(
        m,
        "\nKinetic energy (translation) and height of the centre of mass, first round; in brackets the \
         relative difference from the reference, step and law together: {}.\n",
        c.reference_source
    );
    m.push_str("| code | law |");
    for step in &c.case.compared {
        let _ = write!(m, " E_kin, step {step} |");
    }
    for step in &c.case.compared {
        let _ = write!(m, " z, step {step} |");
    }
    let _ = writeln!(m, "\n|---|---|{}", "---|".repeat(2 * c.case.compared.len()));
    if !c.reference.is_empty() {
        m.push_str("| reference | |");
        for get in [(|s| s.kinetic) as fn(&State) -> f64, |s| s.height] {
            for step in &c.case.compared {
                let known = c.reference.iter().find(|r| r.step == *step).map(get);
                let known = known.filter(|x| x.is_finite());
                let _ = write!(m, " {} |", known.map_or("–".into(), number));
            }
        }
        m.push('\n');
    }
    for r in rows.iter().filter(|r| !r.states.is_empty()) {
        let cores = if r.threads == 1 {
            String::new()
        } else {
            format!(", {} cores", r.threads)
        };
        let _ = write!(m, "| {}{cores} | {} |", r.version, r.law);
        let columns = [
            ((|s| s.kinetic) as fn(&State) -> f64, &r.kinetic_errors),
            (|s| s.height, &r.height_errors),
        ];
        for (get, errors) in columns {
            for (state, error) in r.states.iter().zip(errors) {
                let error = error.map_or(String::new(), |e| format!(" ({e:+.1e})"));
                let _ = write!(m, " {}{error} |", number(get(state)));
            }
        }
        m.push('\n');
    }
}

/// Eight digits, whatever the size.
fn number(x: f64) -> String {
    if (1e-3..1e6).contains(&x.abs()) {
        let digits = (7.0 - x.abs().log10().floor()).max(0.0) as usize;
        format!("{x:.digits$}")
    } else {
        format!("{x:.4e}")
    }
}

fn cell(spread: Option<Spread>, scale: f64) -> String {
    spread.map_or("–".into(), |s| {
        format!(
            "{:.2} [{:.2}, {:.2}]",
            s.median * scale,
            s.min * scale,
            s.max * scale
        )
    })
}

/// The comparison as JSON: the table, and every trace behind it.
///
/// # Errors
/// If a value cannot be written.
pub fn json(c: &Comparison, missing: &[(Code, String)]) -> Result<String, serde_json::Error> {
    serde_json::to_string_pretty(&serde_json::json!({
        "rows": rows(c),
        "missing": missing,
        "comparison": c,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::case::case;
    use crate::peers::machine::Machine;

    fn entrant(code: Code, walls: &[f64], kinetic: f64) -> Entrant {
        let trace = |wall: &f64| {
            Some(Trace {
                version: code.name().into(),
                states: vec![State {
                    step: 200,
                    kinetic,
                    height: 17.0,
                }],
                steps: 800,
                wall: *wall,
                cpu: Some(0.5 * wall),
            })
        };
        Entrant {
            code,
            threads: 1,
            law: "a law".into(),
            traces: walls.iter().map(trace).collect(),
            trouble: None,
        }
    }

    fn comparison() -> Comparison {
        let case = case("chute").unwrap();
        Comparison {
            machine: Machine {
                processor: "P".into(),
                cores: vec![0],
            },
            load: vec![Some(1.0)],
            entrants: vec![
                entrant(Code::Colluvium, &[2.0, 4.0, 2.0], 4866.2732 * 1.01),
                entrant(Code::Lammps, &[4.0, 4.0, 8.0], 4866.2732),
            ],
            reference_source: "a reference".into(),
            reference: vec![State {
                step: 200,
                kinetic: 4866.2732,
                height: f64::NAN,
            }],
            case,
        }
    }

    #[test]
    fn ratios_are_taken_round_by_round() {
        let rows = rows(&comparison());
        let ratio = rows[0].wall_ratio.unwrap();
        assert_eq!((ratio.median, ratio.min, ratio.max), (2.0, 1.0, 4.0));
        assert_eq!(rows[0].cpu_rate.unwrap().max, 32_000.0 * 800.0);
        assert!((rows[0].kinetic_errors[0].unwrap() - 0.01).abs() < 1e-12);
        assert_eq!(rows[0].height_errors[0], None);
        assert_eq!(rows[1].wall_ratio.unwrap().median, 1.0);
    }

    #[test]
    fn the_table_names_what_is_missing() {
        let missing = [(Code::Yade, "no `yade`".to_owned())];
        let text = markdown(&comparison(), &missing);
        assert!(
            text.contains("- YADE: no `yade`") && text.contains("(+1.0e-2)"),
            "{text}"
        );
        assert!(
            json(&comparison(), &missing)
                .unwrap()
                .contains("\"wall_ratio\"")
        );
    }

    #[test]
    fn eight_digits() {
        assert_eq!(number(4866.2732), "4866.2732");
        assert_eq!(number(0.0595464), "0.059546400");
        assert_eq!(number(4.2e-7), "4.2000e-7");
    }
}
