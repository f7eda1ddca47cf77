//! Takes turns: every code once, then every code again.

use super::case::{Case, Reference, State};
use super::find::{Code, Found};
use super::machine::{Machine, load};
use super::run::{Place, law, prepare, run, unfit};
use super::trace::Trace;
use serde::Serialize;
use std::path::Path;

/// A code on so many cores, and what its runs left.
#[derive(Clone, Debug, Serialize)]
pub struct Entrant {
    /// Which code.
    pub code: Code,
    /// Cores it may use.
    pub threads: usize,
    /// The law it solves.
    pub law: String,
    /// One trace a round; none where it failed.
    pub traces: Vec<Option<Trace>>,
    /// Why it failed or does not take part.
    pub trouble: Option<String>,
}

/// All runs of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// The case.
    pub case: Case,
    /// Where it ran.
    pub machine: Machine,
    /// Load of the machine before each round and after the last.
    pub load: Vec<Option<f64>>,
    /// Who ran.
    pub entrants: Vec<Entrant>,
    /// What errors are measured against, in words.
    pub reference_source: String,
    /// Its states; empty where there is no reference.
    pub reference: Vec<State>,
}

/// What a comparison is asked to do.
#[derive(Clone, Debug)]
pub struct Order<'a> {
    /// How many rounds.
    pub rounds: usize,
    /// Numbers of cores that every code is run on.
    pub threads: &'a [usize],
    /// Folder for the runs' files.
    pub folder: &'a Path,
    /// Seconds a run may take.
    pub limit: u64,
}

/// Runs a case: the reference if it is our own, then the rounds. `say` is told what goes on.
pub fn compare(
    case: Case,
    codes: &[Found],
    order: &Order,
    say: &mut dyn FnMut(&str),
) -> Comparison {
    let machine = Machine::here();
    let (reference_source, reference) = reference(&case, codes, order, &machine, say);
    let mut entrants = entrants(&case, codes, order, &machine);
    let mut loads = Vec::new();
    for round in 1..=order.rounds {
        loads.push(load());
        for (entrant, found) in &mut entrants {
            if entrant.trouble.is_some() {
                entrant.traces.push(None);
                continue;
            }
            let name = entrant.code.name();
            let folder = order.folder.join(case.name).join(name.to_lowercase());
            let place = Place {
                folder: &folder,
                cores: machine.cores_for(entrant.threads),
                limit: order.limit,
            };
            let result = run(found, &case, &place, 1);
            let threads = entrant.threads;
            match result {
                Ok(trace) => {
                    let rate = rate(&case, &trace);
                    say(&format!(
                        "round {round}: {name} on {threads}: {:.2} million grain-steps/s, {:.1} s",
                        rate * 1e-6,
                        trace.wall
                    ));
                    entrant.traces.push(Some(trace));
                }
                Err(error) => {
                    say(&format!("round {round}: {name} on {threads}: {error}"));
                    entrant.trouble = Some(error);
                    entrant.traces.push(None);
                }
            }
        }
    }
    loads.push(load());
    let entrants: Vec<Entrant> = entrants.into_iter().map(|(e, _)| e).collect();
    let mut comparison = Comparison {
        case,
        machine,
        load: loads,
        entrants,
        reference_source,
        reference,
    };
    if matches!(comparison.case.reference, Reference::Lammps) {
        let lammps = comparison.first(Code::Lammps);
        comparison.reference = lammps.map(|t| t.states.clone()).unwrap_or_default();
    }
    comparison
}

/// Grain-steps per second of wall time.
pub fn rate(case: &Case, trace: &Trace) -> f64 {
    case.grains.len() as f64 * trace.steps as f64 / trace.wall
}

impl Comparison {
    /// The first run of a code on one core.
    pub fn first(&self, code: Code) -> Option<&Trace> {
        let entrant = self
            .entrants
            .iter()
            .find(|e| e.code == code && e.threads == 1)?;
        entrant.traces.iter().flatten().next()
    }
}

fn entrants<'a>(
    case: &Case,
    codes: &'a [Found],
    order: &Order,
    machine: &Machine,
) -> Vec<(Entrant, &'a Found)> {
    let mut entrants = Vec::new();
    for &threads in order.threads {
        for found in codes {
            let folder = order
                .folder
                .join(case.name)
                .join(found.code.name().to_lowercase());
            let trouble = match unfit(found.code, case) {
                Some(why) => Some(why.to_owned()),
                None if threads > machine.cores.len() => {
                    Some(format!("this machine has {} cores", machine.cores.len()))
                }
                None => prepare(found.code, case, &folder).err(),
            };
            let entrant = Entrant {
                code: found.code,
                threads,
                law: law(found.code, case),
                traces: Vec::new(),
                trouble,
            };
            entrants.push((entrant, found));
        }
    }
    entrants
}

fn reference(
    case: &Case,
    codes: &[Found],
    order: &Order,
    machine: &Machine,
    say: &mut dyn FnMut(&str),
) -> (String, Vec<State>) {
    match case.reference {
        Reference::Known { source, states } => (source.into(), states.to_vec()),
        Reference::Lammps => ("LAMMPS in the same go, first round".into(), Vec::new()),
        Reference::FinerStep(finer) => {
            let source = format!("our own run with a step {finer} times smaller");
            let Some(found) = codes.iter().find(|f| f.code == Code::Colluvium) else {
                return (source, Vec::new());
            };
            say(&format!("reference: {source}"));
            let folder = order.folder.join(case.name).join("reference");
            let place = Place {
                folder: &folder,
                cores: machine.cores_for(1),
                limit: order.limit * finer,
            };
            let trace =
                prepare(found.code, case, &folder).and_then(|()| run(found, case, &place, finer));
            match trace {
                Ok(trace) => (source, trace.states),
                Err(error) => (format!("{source}: {error}"), Vec::new()),
            }
        }
    }
}
