//! The continuum beside a column of grains: the same column with the law that the grains were calibrated to.
//!
//! What is left between them is the model's, as far as it is not the grid's, the calibrated numbers' or the
//! column's own: each of those is measured by a run of its own on half the cells.

use super::options;
use crate::cost::Cost;
use crate::failure::Failure;
use crate::rheology_file::RheologyFile;
use crate::run::heap::{apart, edge, height_at};
use crate::run::steady_layer::failure;
use crate::run::{Findings, Under};
use crate::scene::CollapseScene;
use crate::summary::{Figure, Quantity};
use crate::table::Table;
use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::rheology::{AnyLaw, MuI};
use std::path::Path;

/// Steps at rest after which a run ends.
const REST_STEPS: u64 = 3;
/// Instants of the front over the duration.
const FRONTS: f64 = 240.0;

/// How a continuum's column ended.
struct Outcome {
    /// Time (s) and front (m).
    fronts: Vec<(f64, f64)>,
    /// The deposit: places and heights (m).
    deposit: (Vec<f64>, Vec<f64>),
    cells: u64,
    cell_steps: u64,
}

impl Outcome {
    fn front(&self, threshold: f64) -> f64 {
        edge(&self.deposit.0, &self.deposit.1, threshold)
    }
}

/// What all runs of the continuum share.
struct Beside<'a> {
    scene: &'a CollapseScene,
    law: RheologyFile,
    /// Height of the column that holds the grains at their solid fraction (m).
    height: f64,
}

impl Beside<'_> {
    fn case(&self, [mu_s, mu_2, i_0]: [f64; 3], cells: usize) -> CollapseCase<AnyLaw> {
        let scene = self.scene;
        CollapseCase {
            aspect: self.height / scene.width(),
            height: self.height,
            gravity: scene.gravity,
            rheology: AnyLaw::MuI(MuI {
                mu_s,
                mu_2,
                i_0,
                diameter: scene.grains.diameter,
                solid_fraction: self.law.solid_fraction,
                grain_density: scene.grains.density,
                cohesion: 0.0,
            }),
            cells,
            length_scaled: scene.grid.length_scaled * scene.height / self.height,
            overhang_degrees: scene.overhang_degrees,
        }
    }

    fn run(&self, law: [f64; 3], cells: usize, under: &Under) -> Result<Outcome, Failure> {
        let scene = self.scene;
        let (case, options) = (self.case(law, cells), options(scene));
        let ground = scene.land_of_continuum(&under.scene.origin)?;
        let mut collapse = match &ground {
            None => Collapse::new(&case, &options),
            Some(ground) => Collapse::over_ground(&case, &options, ground, None),
        }
        .map_err(failure)?;
        let end = scene.duration_scaled * collapse.units().time();
        let threshold = scene.front_height_scaled * scene.height;
        let mut fronts = vec![(0.0, collapse.front(threshold).position)];
        let (mut resting, mut cell_steps) = (0, 0);
        while collapse.time() < end * (1.0 - 1e-9) && resting < REST_STEPS {
            let next = (collapse.time() / end * FRONTS + 1e-6).floor() + 1.0;
            let step = collapse
                .step((next / FRONTS * end).min(end))
                .map_err(failure)?;
            resting = if collapse.is_at_rest(&step) {
                resting + 1
            } else {
                0
            };
            cell_steps += step.active_cells as u64;
            fronts.push((collapse.time(), collapse.front(threshold).position));
            if crate::interruption::requested() {
                return Err(under.interrupted());
            }
        }
        Ok(Outcome {
            fronts,
            deposit: collapse.profile(),
            cells: collapse.flow().state().fractions.len() as u64,
            cell_steps,
        })
    }
}

/// Sets the continuum beside what a run of grains found; a continuum that fails is told of.
pub fn set_beside(
    scene: &CollapseScene,
    findings: &mut Findings,
    under: &Under,
) -> Result<(), Failure> {
    let Some(word) = scene.grains.calibrated.word() else {
        return Ok(());
    };
    match compare(scene, word, findings, under) {
        Err(Failure::Run(why)) => {
            let remark = format!("No continuum stands beside the grains: {why}");
            findings.summary.remarks.push(remark);
            Ok(())
        }
        other => other,
    }
}

fn compare(
    scene: &CollapseScene,
    word: &str,
    findings: &mut Findings,
    under: &Under,
) -> Result<(), Failure> {
    let value = |name: &str| {
        let found = findings.summary.results.get(name).and_then(|q| q.value);
        found.ok_or_else(|| Failure::Run(format!("the grains have no {name}")))
    };
    let beside = Beside {
        scene,
        law: RheologyFile::read(Path::new(word))?,
        height: value("column_height")?,
    };
    let grains_front = value("x_front")?;
    let file = &beside.law;
    let law = [file.mu_s, file.mu_2, file.i_0];
    let up = [
        file.mu_s + file.mu_s_error.unwrap_or(0.0),
        file.mu_2 + file.mu_2_error.unwrap_or(0.0),
        file.i_0,
    ];
    let read = file
        .mu_zz
        .as_ref()
        .map_or(law, |fit| [fit.mu_s, fit.mu_2, fit.i_0]);
    let (fine, coarse) = (scene.cells(), (scene.cells() / 2).max(8));
    let whole = beside.run(law, fine, under)?;
    let half = beside.run(law, coarse, under)?;
    let stiffer = beside.run(up, coarse, under)?;
    let other = beside.run(read, coarse, under)?;

    let table = |name: &str| findings.tables.iter().find(|t| t.name == name);
    let missing = || Failure::Run("the grains have no deposit".into());
    let own = table("deposit").ok_or_else(missing)?;
    let deposit = (own.column("x").to_vec(), own.column("h").to_vec());
    let fronts = table("front").ok_or_else(missing)?.pairs("t", "x_front");
    let threshold = scene.front_height_scaled * scene.height;
    let width = scene.width();
    let runout = |outcome: &Outcome| (outcome.front(threshold) - width) / width;
    let continuum = (
        whole.fronts.iter().map(|f| f.0).collect::<Vec<f64>>(),
        whole.fronts.iter().map(|f| f.1).collect::<Vec<f64>>(),
    );
    let last = continuum.1.last().copied().unwrap_or(width);
    let of_continuum = |t: f64| match continuum.0.last() {
        Some(end) if t < *end => height_at(&continuum, t),
        _ => last,
    };
    let squares: f64 = fronts
        .iter()
        .map(|(t, x)| (x - of_continuum(*t)).powi(2))
        .sum();
    let lag = (squares / fronts.len().max(1) as f64).sqrt();

    let [fine_runout, half_runout, stiffer_runout, other_runout] =
        [&whole, &half, &stiffer, &other].map(runout);
    let grains_runout = (grains_front - width) / width;
    let summary = &mut findings.summary;
    let mut put = |name: &str, value: f64, source: String| {
        summary.put(name, Quantity::new(value, "1").from(&source));
    };
    put(
        "continuum_runout_scaled",
        fine_runout,
        format!("μ(I) with the law calibrated for {word}, {fine} cells"),
    );
    put(
        "runout_difference",
        (fine_runout - grains_runout) / grains_runout,
        "of the continuum from the grains, over theirs: the model's, and the three parts below"
            .into(),
    );
    put(
        "deposit_difference",
        apart(&deposit, &whole.deposit, |_| 1.0),
        "∫|h_grains − h_continuum| dx over the area".into(),
    );
    put(
        "front_difference",
        lag / (grains_front - width),
        "rms of the front in time, over the grains' run-out".into(),
    );
    let part = |of: f64, from: f64| (of - from) / grains_runout;
    put(
        "runout_part_of_grid",
        part(half_runout, fine_runout),
        format!("of {coarse} from {fine} cells, over the grains' run-out"),
    );
    put(
        "runout_part_of_law",
        part(stiffer_runout, half_runout),
        "mu_s and mu_2 a standard error higher, over the grains' run-out".into(),
    );
    put(
        "runout_part_of_reading",
        part(other_runout, half_runout),
        "the fit for |τ|/σ_zz in the place of |τ|/p, over the grains' run-out".into(),
    );
    put(
        "deposit_part_of_grid",
        apart(&whole.deposit, &half.deposit, |_| 1.0),
        format!("∫|h − h_half| dx over the area, {fine} and {coarse} cells"),
    );
    put(
        "deposit_part_of_law",
        apart(&half.deposit, &stiffer.deposit, |_| 1.0),
        "the same, mu_s and mu_2 a standard error higher".into(),
    );
    put(
        "deposit_part_of_reading",
        apart(&half.deposit, &other.deposit, |_| 1.0),
        "the same, the fit for |τ|/σ_zz".into(),
    );
    summary.remarks.push(format!(
        "The grains run out {grains_runout:.3} widths, the continuum with their calibrated law {fine_runout:.3} ({:+.1} %).",
        100.0 * (fine_runout / grains_runout - 1.0)
    ));
    let cell_steps = [&whole, &half, &stiffer, &other].map(|o| o.cell_steps);
    summary.model.cells = whole.cells;
    summary.cost = Cost::measured(
        under.wall_s(),
        under.threads,
        summary.cost.grain_steps,
        cell_steps.iter().sum(),
    );
    let curves = |table: &str, x: [&str; 2], y_label: &str, caption: &str| Figure::Curves {
        table: table.into(),
        x: x.map(String::from),
        y_label: y_label.into(),
        y: [["grains", "grains"], ["continuum", "continuum"]]
            .map(|pair| pair.map(String::from))
            .to_vec(),
        log: false,
        caption: caption.into(),
    };
    summary.figures.insert(
        0,
        curves(
            "beside",
            ["x", "x [m]"],
            "height h [m]",
            "The deposit of the grains and that of the continuum with their calibrated law.",
        ),
    );
    summary.figures.insert(
        1,
        curves(
            "fronts",
            ["t", "time t [s]"],
            "front x [m]",
            "Both fronts in time.",
        ),
    );
    let heights = deposit.0.iter().map(|&x| height_at(&whole.deposit, x));
    let heights = heights.collect();
    let (times, places): (Vec<f64>, Vec<f64>) = fronts.into_iter().unzip();
    let theirs = times.iter().map(|&t| of_continuum(t)).collect();
    findings.tables.push(
        Table::new("beside")
            .with("x", "m", deposit.0)
            .with("grains", "m", deposit.1)
            .with("continuum", "m", heights),
    );
    findings.tables.push(
        Table::new("fronts")
            .with("t", "s", times)
            .with("grains", "m", places)
            .with("continuum", "m", theirs),
    );
    Ok(())
}
