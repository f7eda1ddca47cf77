//! A column of grains that collapses, in three ways: all grains, all continuum, and grains in front of a continuum; what of the
//! joint's error is the law's, the mesh's, the overlap's, and what two packings differ by.
//!
//! Each part is the difference of two runs that differ in one thing only. Places are compared where 99 % of the heap's area
//! end, over the grains' run-out to there, deposits by `∫|h − h'| dx / ∫ h dx`.

use super::{Check, Found, Options};
use crate::failure::Failure;
use crate::report::page::figure;
use crate::report::plot::{Mark, Plot};
use crate::rheology_file::RheologyFile;
use crate::run::heap::{apart, place_of_share};
use crate::run::{self, RunOptions};
use crate::scene::{CollapseScene, Scene, SceneBody};
use crate::summary::Summary;
use crate::table::Table;
use crate::{report, run_directory};
use maud::{Markup, html};
use std::path::Path;

/// The column: 20 grains high, four heights wide on both sides of its plane of symmetry.
const COLUMN: [&str; 4] = [
    "aspect=0.25",
    "grid.length_scaled=6",
    "grains.diameter=0.05",
    "output.pictures=0",
];
/// Share of the heap's area up to where it is said to reach.
const SHARE: f64 = 0.99;
/// How far two joined runs may be off in the mean of sizes: run-out (two packings of grains alone lie 5 % apart) and deposit, and the height
/// of the deposit.
const MOST: [f64; 3] = [0.05, 0.03, 0.03];
const FIGURES: [&str; 3] = ["run-out", "deposit", "height of the deposit"];
/// Width of the other overlap, and of the other cells, over those of the scene.
const WIDER: f64 = 1.5;
const FINER: f64 = 0.5;

/// Places and heights of a heap (m).
type Heap = (Vec<f64>, Vec<f64>);

/// A finished run.
struct Ran {
    deposit: Heap,
    summary: Summary,
}

impl Ran {
    fn value(&self, name: &str) -> f64 {
        let found = self.summary.results.get(name);
        found.and_then(|q| q.value).unwrap_or(f64::NAN)
    }

    /// Differences from another run, of places, deposits and heights.
    fn from(&self, other: &Ran, width: f64) -> [f64; 3] {
        differences(&self.deposit, &other.deposit, width)
    }
}

/// Differences of a deposit from another one, by [`FIGURES`]; the foot of the column lies at `width` (m).
fn differences(own: &Heap, other: &Heap, width: f64) -> [f64; 3] {
    let [place, reference] = [own, other].map(|heap| place_of_share(&heap.0, &heap.1, SHARE));
    let [top, least] = [own, other].map(|heap| heap.1.iter().copied().fold(0.0, f64::max));
    [
        (place - reference) / (reference - width),
        apart(other, own, |_| 1.0),
        top / least - 1.0,
    ]
}

/// What all runs of the suite share.
struct Suite<'a> {
    options: &'a Options,
    found: Found,
}

impl Suite<'_> {
    fn scene(&self, own: &[String]) -> Result<Scene, Failure> {
        let set = COLUMN.iter().map(|s| (*s).to_owned());
        let set: Vec<String> = set
            .chain(self.options.set.clone())
            .chain(own.iter().cloned())
            .collect();
        Ok(Scene::load("column-collapse", &set)?)
    }

    fn run(&mut self, name: &str, own: &[String]) -> Result<Ran, Failure> {
        let scene = self.scene(own)?;
        let out = self.options.out.join("column").join(name);
        let ended = run::run(
            &scene,
            &RunOptions {
                resume: run_directory::is_run(&out),
                out: Some(out.clone()),
                threads: self.options.threads,
                ..RunOptions::default()
            },
        )?;
        self.found
            .reports
            .push(format!("column/{name}/report.html"));
        let heap = table(&out, "deposit.csv")?;
        Ok(Ran {
            deposit: (heap.column("x").to_vec(), heap.column("h").to_vec()),
            summary: report::read_summary(&ended.directory)?,
        })
    }

    /// Tells or judges the figures of a case.
    fn tell(&mut self, case: &str, figures: [f64; 3], most: Option<[f64; 3]>, source: &str) {
        for (k, what) in FIGURES.iter().enumerate() {
            self.found.checks.push(Check {
                case: case.into(),
                what: (*what).into(),
                value: figures[k],
                error: None,
                reference: 0.0,
                reference_error: None,
                allowed: most.map(|m| m[k]),
                source: source.into(),
            });
        }
    }

    /// One figure of a case, beside zero.
    fn judge(&mut self, case: &str, what: &str, value: f64, most: f64, source: &str) {
        self.found.checks.push(Check {
            case: case.into(),
            what: what.into(),
            value,
            error: None,
            reference: 0.0,
            reference_error: None,
            allowed: Some(most),
            source: source.into(),
        });
    }
}

fn table(folder: &Path, file: &str) -> Result<Table, Failure> {
    let path = folder.join(file);
    Table::from_csv(&path).map_err(|error| Failure::Run(format!("{}: {error}", path.display())))
}

fn words(set: &[&str]) -> Vec<String> {
    set.iter().map(|s| (*s).to_owned()).collect()
}

/// Keys of the scene with the calibrated law a standard error higher in both frictions; none where it has no calibrated law.
fn stiffer(scene: &CollapseScene) -> Result<Option<Vec<String>>, Failure> {
    let Some(word) = scene.grains.calibrated.word() else {
        return Ok(None);
    };
    let law = RheologyFile::read(Path::new(word))?;
    let up = |value: f64, error: Option<f64>| value + error.unwrap_or(0.0);
    Ok(Some(vec![
        "model=hybrid".into(),
        "grains.calibrated=none".into(),
        format!("rheology.mu_s={:?}", up(law.mu_s, law.mu_s_error)),
        format!("rheology.mu_2={:?}", up(law.mu_2, law.mu_2_error)),
        format!("rheology.i_0={:?}", law.i_0),
    ]))
}

pub(super) fn run(options: &Options) -> Result<Found, Failure> {
    let mut suite = Suite {
        options,
        found: Found::default(),
    };
    let hybrid = words(&["model=hybrid"]);
    let whole = suite.scene(&hybrid)?;
    let SceneBody::Collapse(body) = &whole.body else {
        return Err(Failure::Run("column-collapse is no collapse".into()));
    };
    let settings = body.overlap_settings(&whole.origin)?;
    let (d, width) = (body.grains.diameter, body.width());
    let another = format!("grains.seed={}", body.grains.seed + 1);
    let joined = |key: &str, value: f64| words(&["model=hybrid", &format!("{key}={value:?}")]);
    let wider = joined("overlap.width", WIDER * (settings.inner + settings.buffer));
    let finer = joined("overlap.cell_diameters", FINER * body.spacing() / d);
    let stiffer = stiffer(body)?;

    let grains = suite.run("grains", &words(&["model=dem"]))?;
    let again = words(&["model=dem", "grains.calibrated=none", &another]);
    let grains_again = suite.run("grains-again", &again)?;
    let joint = suite.run("hybrid", &hybrid)?;
    let joint_again = suite.run("hybrid-again", &words(&["model=hybrid", &another]))?;
    let of_width = suite.run("hybrid-wider", &wider)?;
    let of_cells = suite.run("hybrid-finer", &finer)?;
    let of_law = match &stiffer {
        Some(set) => Some(suite.run("hybrid-stiffer", set)?),
        None => None,
    };
    let control = words(&["model=hybrid", "overlap.uncoupled=true"]);
    let control = suite.run("uncoupled", &control)?;

    let packings = "the same with another packing of the grains: what is below it says nothing";
    suite.tell("grains", grains_again.from(&grains, width), None, packings);
    if let Some(heap) = continuum(&options.out.join("column/grains"), &grains)? {
        let own = differences(&heap, &grains.deposit, width);
        let source = "full grains: error of the law, and of the mesh, next line";
        suite.tell("continuum", own, None, source);
        let mesh = [
            -grains.value("runout_part_of_grid"),
            grains.value("deposit_part_of_grid"),
            f64::NAN,
        ];
        let source = "the same on half the cells: mesh (run-out to where the heap is front_height_scaled high)";
        for (k, what) in FIGURES.iter().take(2).enumerate() {
            suite.found.checks.push(Check {
                case: "continuum".into(),
                what: (*what).into(),
                value: mesh[k],
                error: None,
                reference: 0.0,
                reference_error: None,
                allowed: None,
                source: source.into(),
            });
        }
    }
    let [first, second] =
        [(&joint, &grains), (&joint_again, &grains_again)].map(|(own, full)| own.from(full, width));
    let source = "full grains of the same packing: all errors of the joined run";
    suite.tell("hybrid", first, None, source);
    suite.tell("hybrid, other packing", second, None, source);
    // Of sizes: errors of opposite signs do not make up for each other.
    let mean = [0, 1, 2].map(|k| 0.5 * (first[k].abs() + second[k].abs()));
    suite.tell("hybrid, mean size of both", mean, Some(MOST), source);
    let parts = [
        ("hybrid, cells half as wide", &of_cells, "the hybrid: mesh"),
        (
            "hybrid, overlap 1.5 times as wide",
            &of_width,
            "the hybrid: coupling",
        ),
    ];
    for (case, ran, source) in parts {
        suite.tell(case, ran.from(&joint, width), None, source);
    }
    if let Some(ran) = &of_law {
        let source = "the hybrid: law, within what it was measured to";
        suite.tell(
            "hybrid, mu_s and mu_2 an error higher",
            ran.from(&joint, width),
            None,
            source,
        );
    }
    monitors(&mut suite, &joint);
    // Without an exchange the deposit, which no single grain makes, must be farther off than a joined one may be.
    let missed = control.from(&grains, width);
    suite.tell(
        "uncoupled",
        missed,
        None,
        "full grains: what the joint is for",
    );
    suite.found.checks.push(Check {
        case: "control".into(),
        what: "1 if nothing exchanged misses the limit of the deposit".into(),
        value: f64::from(u8::from(missed[1] > MOST[1])),
        error: None,
        reference: 1.0,
        reference_error: None,
        allowed: Some(0.0),
        source: "negative control: nothing exchanged".into(),
    });
    let share = joint.value("grain_steps_share");
    suite.found.remarks.push(format!(
        "Grain-steps of the flow, hybrid over full grains: {share:.3}; wall time with the settling of the columns: {:.3}.",
        joint.summary.cost.wall_s / grains.summary.cost.wall_s
    ));
    let section = pictures([&grains, &joint, &control]);
    suite.found.sections.push(section);
    Ok(suite.found)
}

/// The deposit of the continuum that the grains' run has set beside them.
fn continuum(folder: &Path, grains: &Ran) -> Result<Option<Heap>, Failure> {
    if !grains.value("continuum_runout_scaled").is_finite() {
        return Ok(None);
    }
    let beside = table(folder, "beside.csv")?;
    Ok(Some((
        beside.column("x").to_vec(),
        beside.column("continuum").to_vec(),
    )))
}

fn monitors(suite: &mut Suite, joint: &Ran) {
    for (name, what, most) in [
        ("slip", "slip over √(gH)", 0.01),
        ("relaxation_share", "relaxation over the traction", 0.1),
    ] {
        suite.judge(
            "hybrid",
            what,
            joint.value(name),
            most,
            "monitors of the overlap",
        );
    }
    for name in ["ledger_grains", "ledger_exchange"] {
        let what = name.replace('_', ", ");
        suite.judge("hybrid", &what, joint.value(name), 1e-10, "conservation");
    }
    let mass = joint.value("handshake_mass");
    suite.judge(
        "hybrid",
        "mass about the handshake",
        mass,
        0.01,
        "conservation",
    );
}

fn pictures([grains, joint, control]: [&Ran; 3]) -> Markup {
    let points = |ran: &Ran| {
        let (x, h) = &ran.deposit;
        x.iter().copied().zip(h.iter().copied()).collect::<Vec<_>>()
    };
    let plot = Plot::new("x [m]", "height h [m]")
        .with("grains", Mark::Dots, 0, points(grains))
        .with("hybrid", Mark::Line, 2, points(joint))
        .with("nothing exchanged", Mark::Dashes, 6, points(control))
        .svg(760, 400);
    html! { div.figures { (figure(&plot, "The deposits.")) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deposits_differ_by_place_area_and_height() {
        let x: Vec<f64> = (0..100).map(|i| 0.05 + 0.1 * f64::from(i)).collect();
        let block = |length: f64, height: f64| {
            let h = x.iter().map(|&x| if x < length { height } else { 0.0 });
            (x.clone(), h.collect::<Vec<f64>>())
        };
        let [own, other] = [block(5.0, 1.0), block(4.0, 1.25)];
        let [place, area, height] = differences(&own, &other, 2.0);
        assert!((place - 0.99 / 1.96).abs() < 1e-12, "{place}");
        // A quarter of a metre over four, and one metre beyond: 2 of 5 m².
        assert!((area - 0.4).abs() < 1e-12, "{area}");
        assert!((height + 0.2).abs() < 1e-12, "{height}");
        let same = differences(&own, &own, 2.0);
        assert!(same.iter().all(|part| part.abs() < 1e-14), "{same:?}");
    }
}
