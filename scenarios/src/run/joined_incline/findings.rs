//! What a joined incline run has found: summary and tables.

use super::super::{Findings, Under, grain_table, incline, step};
use super::left_out;
use crate::cost::Cost;
use crate::scene::{InclineScene, RheologyKeys};
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use colluvium_coupling::overlap::joined_incline::{
    ContinuumRow, HistoryPoint, JoinedInclineResult,
};
use colluvium_dem::preparation::Bed;

/// Limits of the monitors: slip at m, stress ratios at m less 1, share of relaxation.
const MOST_SLIP: f64 = 0.01;
const MOST_RATIO: f64 = 0.05;
const MOST_RELAXATION: f64 = 0.1;

pub(super) fn of(
    scene: &InclineScene,
    rheology: &RheologyKeys,
    bed: &Bed,
    result: JoinedInclineResult,
    under: &Under,
) -> Findings {
    let mut summary = Summary::begun(&under.scene.name, "run");
    let step = incline::step(scene);
    summary.model = Model {
        grains: result.sizes[0] as u64,
        cells: result.sizes[1] as u64,
        dt_s: step.seconds,
        dt_limit: step::chosen(&step),
        left_out: left_out(scene),
    };
    let [grain_steps, cell_steps] = result.work_done;
    let settling = bed.report.grain_steps;
    summary.cost = Cost::measured(
        under.wall_s(),
        under.threads,
        grain_steps + settling,
        cell_steps,
    );
    ledger(&mut summary, &result);
    monitors(&mut summary, scene, &result);
    flow(&mut summary, scene, bed, &result);
    summary.remarks.extend(rheology.remarks());
    summary.state_hash = result.state_hash.clone();
    let tables = tables(scene, rheology, &result);
    Findings {
        summary,
        tables,
        grains: Some(grain_table::of(&result.snapshot)),
    }
}

/// Mass, momentum, and where energy went.
fn ledger(summary: &mut Summary, result: &JoinedInclineResult) {
    let [mass, grains, continuum] = result.ledger_errors;
    summary.ledger.mass_relative = mass;
    summary.ledger.momentum_relative = Some(grains.max(continuum));
    let work = &result.work;
    for (name, value) in [
        ("traction_J", work.traction),
        ("impedance_J", work.impedance),
        ("relaxation_J", work.relaxation),
    ] {
        summary.ledger.energy.insert(name.into(), value);
    }
    let l = &result.ledger;
    for (name, value, source) in [
        ("impulse_weight", l.weight[0], "of the grains, downslope"),
        (
            "impulse_weight_normal",
            l.weight[1],
            "of the grains, along z",
        ),
        (
            "impulse_shear",
            l.shear,
            "of the continuum on the grains, downslope",
        ),
        (
            "impulse_pressure",
            l.pressure,
            "of the continuum on the grains, along z",
        ),
        ("impulse_impedance", l.impedance, "on the grains, along z"),
        (
            "impulse_relaxation",
            l.relaxation,
            "on the grains, downslope; the continuum takes the opposite",
        ),
        (
            "impulse_inner_stress",
            l.inner_stress,
            "on the continuum at its inner end, downslope",
        ),
        ("impulse_continuum_weight", l.continuum_weight, "downslope"),
        (
            "impulse_following",
            l.following,
            "by which the copy was made to follow the grains",
        ),
        (
            "impulse_riding",
            l.riding,
            "that the continuum's motion along z took from the impedance",
        ),
    ] {
        summary.put(name, Quantity::new(value, "N s").from(source));
    }
    for (name, value) in [("ledger_grains", grains), ("ledger_continuum", continuum)] {
        let source = "momentum against its account, relative to the largest entry";
        summary.put(name, Quantity::new(value, "1").against(0.0, source));
    }
}

/// What the monitors say, and in words what they should not.
fn monitors(summary: &mut Summary, scene: &InclineScene, result: &JoinedInclineResult) {
    let report = &result.report;
    let density = scene.grains.density;
    let mut against = |name: &str, value: f64, unit: &str, right: f64, source: &str| {
        summary.put(name, Quantity::new(value, unit).against(right, source));
    };
    against(
        "slip",
        report.slip,
        "1",
        0.0,
        "velocity of the continuum less the grains' at the handshake surface, over theirs, by sizes of means over windows of time; to be below 1 %",
    );
    against(
        "slip_noise",
        report.slip_noise,
        "1",
        0.0,
        "what the noise of the grains' velocities alone would make the slip",
    );
    let ratio = "grains over continuum at the handshake surface; to be within 5 %";
    let none = "none: the continuum has no such stress at the handshake surface, but for round-off";
    let ratios = [
        ("shear_ratio", "shear stresses", report.shear_ratio),
        ("pressure_ratio", "pressures", report.pressure_ratio),
    ];
    for (name, _, value) in ratios {
        let source = if value.is_some() { ratio } else { none };
        against(name, value.unwrap_or(f64::NAN), "1", 1.0, source);
    }
    against(
        "relaxation_share",
        report.relaxation_share,
        "1",
        0.0,
        "impulse of relaxation, layer by layer, over that of the shear traction, by sizes of means over windows of time; to be below 10 %",
    );
    against(
        "relaxation_noise",
        report.relaxation_noise,
        "1",
        0.0,
        "what the noise of the grains' velocities alone would make the relaxation_share",
    );
    against(
        "grains_escaped",
        report.escaped,
        "1",
        0.0,
        "most grains beyond the edge by more than a cell, at any exchange",
    );
    let mut told = |name: &str, value: f64, unit: &str, source: &str| {
        summary.put(name, Quantity::new(value, unit).from(source));
    };
    let [inner, buffer] = [
        "of the grains in the inner overlap",
        "of the grains in the buffer",
    ];
    told(
        "inner_solid_fraction",
        report.inner_density / density,
        "1",
        inner,
    );
    told(
        "buffer_solid_fraction",
        report.buffer_density / density,
        "1",
        buffer,
    );
    told(
        "inner_temperature",
        report.inner_temperature,
        "m²/s²",
        inner,
    );
    told(
        "buffer_temperature",
        report.buffer_temperature,
        "m²/s²",
        buffer,
    );
    let misses = [
        (
            report.slip.is_nan() || report.slip.abs() > MOST_SLIP,
            "the slip",
            report.slip,
        ),
        (
            report.relaxation_share.is_nan() || report.relaxation_share > MOST_RELAXATION,
            "the share of relaxation",
            report.relaxation_share,
        ),
        (
            report.escaped > 0.0,
            "the number of grains beyond the edge",
            report.escaped,
        ),
    ];
    for (_, what, value) in misses.into_iter().filter(|(missed, ..)| *missed) {
        summary.remarks.push(format!(
            "A monitor of the overlap is outside its limit: {what} is {value:.4}."
        ));
    }
    for (_, of, value) in ratios {
        match value {
            Some(value) if (value - 1.0).abs() <= MOST_RATIO => {}
            Some(value) => summary.remarks.push(format!(
                "A monitor of the overlap is outside its limit: the ratio of {of} is {value:.4}."
            )),
            None => summary.remarks.push(format!(
                "The overlap has no ratio of {of}: the continuum has none at the handshake surface, but for round-off."
            )),
        }
    }
    if result.settings.uncoupled {
        summary
            .remarks
            .push("Neither side acts on the other (overlap.uncoupled).".into());
    }
}

/// Heights, velocities and what it cost beside all grains.
fn flow(summary: &mut Summary, scene: &InclineScene, bed: &Bed, result: &JoinedInclineResult) {
    let mut told = |name: &str, value: f64, unit: &str, source: &str| {
        summary.put(name, Quantity::new(value, unit).from(source));
    };
    let [inner, handshake, edge, surface] = result.heights;
    told(
        "height_inner",
        inner,
        "m",
        "a: from here on the continuum has a copy",
    );
    told(
        "height_handshake",
        handshake,
        "m",
        "m: from here on its stress is its own, and totals count it",
    );
    told("height_edge", edge, "m", "b: where grains end");
    told("height", surface, "m", "of the continuum's surface");
    let averaged: Vec<&HistoryPoint> = result
        .history
        .iter()
        .filter(|p| p.time > scene.time.relax)
        .collect();
    let mean = |value: fn(&HistoryPoint) -> f64| {
        averaged.iter().map(|p| value(p)).sum::<f64>() / averaged.len() as f64
    };
    told(
        "mean_velocity",
        mean(|p| p.mean_velocity),
        "m/s",
        "of all material, over the averaging time",
    );
    told(
        "surface_velocity",
        mean(|p| p.surface_velocity),
        "m/s",
        "of the uppermost cell, over the averaging time",
    );
    let [first, last] =
        [averaged.first(), averaged.last()].map(|p| p.map_or(f64::NAN, |p| p.mean_velocity));
    told(
        "drift",
        last / first - 1.0,
        "1",
        "of the mean velocity over the averaging time",
    );
    let steps = (scene.time.relax + scene.time.average) / incline::step(scene).seconds;
    let all = steps * (scene.free_grains() + bed.report.base_grains) as f64;
    told(
        "grain_steps_share",
        result.work_done[0] as f64 / all,
        "1",
        "grain-steps of the flow, over those that all grains would have taken; settling apart",
    );
    told(
        "grain_steps_settling",
        bed.report.grain_steps as f64,
        "1",
        "for the bed of grains",
    );
    let [loads, exchange] = result.steps_held;
    told(
        "steps_of_loads",
        loads as f64,
        "1",
        "for which forces on grains are held",
    );
    told(
        "steps_of_an_exchange",
        exchange as f64,
        "1",
        "of the grains in one of the continuum",
    );
}

fn tables(
    scene: &InclineScene,
    rheology: &RheologyKeys,
    result: &JoinedInclineResult,
) -> Vec<Table> {
    let [inner, handshake, edge, _] = result.heights;
    let of = |z: f64| -> f64 {
        f64::from(u8::from(z > inner) + u8::from(z > handshake) + u8::from(z > edge))
    };
    let grains = incline::profile_table("profile_grains", &result.profile);
    let zones: Vec<f64> = grains.column("z").iter().map(|z| of(*z)).collect();
    let grains = grains.with("zone", "1", zones);
    let continuum = continuum_table("profile_continuum", scene, rheology, &result.continuum);
    let zones: Vec<f64> = continuum.column("z").iter().map(|z| of(*z)).collect();
    let continuum = continuum.with("zone", "1", zones);
    let history = &result.history;
    let column = |value: fn(&HistoryPoint) -> f64| history.iter().map(value).collect();
    vec![
        together(&grains, &continuum, handshake),
        grains,
        continuum,
        Table::new("history")
            .with("t", "s", column(|p| p.time))
            .with("mean_velocity", "m/s", column(|p| p.mean_velocity))
            .with("edge_velocity", "m/s", column(|p| p.edge_velocity))
            .with("surface_velocity", "m/s", column(|p| p.surface_velocity))
            .with("edge_height", "m", column(|p| p.edge_height)),
    ]
}

/// Columns of a profile that a continuum has too.
const SHARED: [(&str, &str); 9] = [
    ("phi", "1"),
    ("u", "m/s"),
    ("p", "Pa"),
    ("sigma_zz", "Pa"),
    ("tau", "Pa"),
    ("i", "1"),
    ("mu", "1"),
    ("mu_zz", "1"),
    ("temperature", "m²/s²"),
];

/// A continuum's profile in the columns of the grains': its pressure is σ_zz, and it has no temperature.
pub(in crate::run) fn continuum_table(
    name: &str,
    scene: &InclineScene,
    rheology: &RheologyKeys,
    rows: &[ContinuumRow],
) -> Table {
    let column = |value: &dyn Fn(usize) -> f64| (0..rows.len()).map(value).collect::<Vec<f64>>();
    let slope = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(rows.len() - 1));
        if a == b {
            return f64::NAN;
        }
        (rows[b].u - rows[a].u) / (rows[b].z - rows[a].z)
    };
    let root = |k: usize| scene.grains.diameter * (rheology.grain_density / rows[k].p).sqrt();
    let friction = column(&|k| rows[k].tau / rows[k].p);
    let values = [
        column(&|_| rheology.solid_fraction),
        column(&|k| rows[k].u),
        column(&|k| rows[k].p),
        column(&|k| rows[k].p),
        column(&|k| rows[k].tau),
        column(&|k| slope(k) * root(k)),
        friction.clone(),
        friction,
        column(&|_| f64::NAN),
    ];
    let mut table = Table::new(name).with("z", "m", column(&|k| rows[k].z));
    for ((name, unit), values) in SHARED.into_iter().zip(values) {
        table = table.with(name, unit, values);
    }
    table
}

/// One profile of both: grains up to the handshake surface, continuum beyond it.
fn together(grains: &Table, continuum: &Table, handshake: f64) -> Table {
    let pick = |name: &str| -> Vec<f64> {
        let of = |table: &Table, keep: &dyn Fn(f64) -> bool| -> Vec<f64> {
            let rows = table.column("z").iter().zip(table.column(name));
            rows.filter(|(z, _)| keep(**z)).map(|(_, v)| *v).collect()
        };
        let mut values = of(grains, &|z| z <= handshake);
        values.extend(of(continuum, &|z| z > handshake));
        values
    };
    let mut table = Table::new("profile").with("z", "m", pick("z"));
    for (name, unit) in SHARED {
        table = table.with(name, unit, pick(name));
    }
    table.with("zone", "1", pick("zone"))
}
