//! A march of the continuum as named arrays: what its checkpoint holds.

use colluvium_continuum::flow::{March, StepRecord};
use colluvium_continuum::layer::LayerRun;
use colluvium_continuum::rheology::Rheology;
use colluvium_continuum::yield_step::{FlowState, Residuals};
use colluvium_dem::Record;

/// Real numbers of a step.
const NUMBERS: usize = 8;

/// A run's state.
pub fn save<L: Rheology>(run: &LayerRun<L>) -> Record {
    let (state, time, march) = run.state();
    let mut record = Record::default();
    let mut numbers = |name: &str, values: Vec<f64>| {
        record.numbers.insert(name.into(), values);
    };
    numbers("flow/u", state.u.clone());
    numbers("flow/p", state.p.clone());
    numbers("flow/s", state.s.iter().flatten().copied().collect());
    numbers("flow/march", vec![time, march.scheduled, march.next]);
    let steps = march.history.iter().flat_map(|r| {
        [
            r.time,
            r.dt,
            r.residuals.momentum,
            r.residuals.divergence,
            r.residuals.stress,
            r.residuals.strain_rate_floor,
            r.mean_velocity,
            r.acceleration,
        ]
    });
    numbers("history/numbers", steps.collect());
    let solves = march.history.iter();
    let solves =
        solves.flat_map(|r| [r.newton_iterations, r.linear_solves, r.cuts].map(|n| n as u64));
    let mut counts = |name: &str, values: Vec<u64>| {
        record.counts.insert(name.into(), values);
    };
    counts("history/solves", solves.collect());
    counts("flow/over", vec![u64::from(march.over)]);
    record
}

/// Lets a run go on from a state.
pub fn take_up<L: Rheology>(run: &mut LayerRun<L>, record: &Record) -> Result<(), String> {
    let &[time, scheduled, next] = record.numbers("flow/march")? else {
        return Err("array `flow/march` must have 3 numbers".into());
    };
    let numbers = record.numbers("history/numbers")?.as_chunks::<NUMBERS>();
    let solves = record.counts("history/solves")?.as_chunks::<3>();
    if numbers.0.len() != solves.0.len() || !numbers.1.is_empty() || !solves.1.is_empty() {
        return Err("arrays `history/numbers` and `history/solves` do not fit each other".into());
    }
    let history = numbers.0.iter().zip(solves.0);
    let history = history.map(|(numbers, &[newton, linear, cuts])| {
        let &[
            time,
            dt,
            momentum,
            divergence,
            stress,
            floor,
            mean_velocity,
            acceleration,
        ] = numbers;
        StepRecord {
            time,
            dt,
            newton_iterations: newton as usize,
            linear_solves: linear as usize,
            cuts: cuts as usize,
            residuals: Residuals {
                momentum,
                divergence,
                stress,
                strain_rate_floor: floor,
            },
            mean_velocity,
            acceleration,
        }
    });
    let march = March {
        history: history.collect(),
        scheduled,
        next,
        over: record.counts("flow/over")? == [1],
    };
    let state = FlowState {
        u: record.numbers("flow/u")?.to_vec(),
        p: record.numbers("flow/p")?.to_vec(),
        s: record.numbers("flow/s")?.as_chunks::<2>().0.to_vec(),
    };
    let all = state
        .u
        .iter()
        .chain(&state.p)
        .chain(state.s.iter().flatten());
    if !all.chain([&time, &scheduled, &next]).all(|x| x.is_finite()) {
        return Err("array `flow/u`, `flow/p`, `flow/s` or `flow/march` is not finite".into());
    }
    run.take_up(state, time, march)
}
