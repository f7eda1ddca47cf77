//! Where a joined column puts its edge by the oracle (`coupling::zones`): a run of the continuum alone comes first.

use super::JoinedColumn;
use crate::failure::Failure;
use crate::run::collapse::options;
use crate::scene::world::Place;
use crate::scene::{CollapseScene, DENSE};
use crate::summary::Figure;
use crate::table::Table;
use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::rheology::AnyLaw;
use colluvium_coupling::zones::{Concern, Markers, Oracle, Survey};

/// Share of all material behind the edge that may be in need of grains.
const FORGIVEN: f64 = 0.02;
/// Cells of the survey over those of the run, and fewest of them.
const COARSER: usize = 2;
const FEWEST: usize = 32;
/// Material that the continuum alone moves by less than this many diameters rests; so much of a column's height in
/// front of the last such material is computed all the same.
const STILL: f64 = 0.02;
const MARGIN: f64 = 0.5;
/// Steps at rest after which the survey ends.
const REST_STEPS: usize = 3;

/// A scene whose edge the oracle has put.
pub(super) struct Surveyed {
    /// The scene with its edge.
    pub scene: CollapseScene,
    /// Misplaced strain by place at the start.
    pub table: Table,
    /// What the oracle says.
    pub words: String,
}

/// Asks the oracle, if the scene wants it to.
pub(super) fn survey(scene: &CollapseScene, origin: &str) -> Result<Option<Surveyed>, Failure> {
    let Some(asked) = scene.zones.tolerance else {
        return Ok(None);
    };
    let column = JoinedColumn::new(scene, origin);
    let Some(spec) = column.specs(DENSE)?.into_iter().next() else {
        return Ok(None);
    };
    let oracle = column.judge(spec.case.rheology)?;
    let case = CollapseCase {
        cells: (scene.cells() / COARSER).max(FEWEST),
        ..spec.case.with_law(spec.case.rheology.into())
    };
    let markers = follow(&case, scene, &oracle)?;
    let survey = Survey::of(&markers);
    let [least, most] = scene.edge_range(spec.settings.inner + spec.settings.buffer);
    let buffer = spec.settings.buffer;
    let whole = DENSE * scene.height * scene.width() * scene.slab() / scene.grain_volume();
    let mut tolerance = asked;
    if let Some(budget) = scene.zones.budget {
        let place = survey.place_of_share(budget as f64 / whole);
        tolerance =
            tolerance.max(survey.tolerance_for((place + buffer).min(scene.width()), FORGIVEN));
    }
    let needed = survey.edge(tolerance, FORGIVEN) - buffer;
    if needed < least {
        let enough = survey.tolerance_for(least + buffer, FORGIVEN);
        let range = format!(
            "at least {enough:.3}: below it all of this column needs grains (model = \"dem\"), or a column of smaller aspect"
        );
        let at = Place {
            origin,
            section: "zones",
        };
        return Err(at.refuse("tolerance", asked, range).into());
    }
    let edge = needed.min(most);
    let mut surveyed = scene.clone();
    surveyed.zones.edge_scaled = Some(edge / scene.height);
    let still = markers.still(STILL * scene.grains.diameter) / scene.height;
    let most = (edge - least) / scene.height;
    surveyed.zones.rest_scaled = Some((still - MARGIN).clamp(0.0, most));
    let volumes = markers.needy(tolerance);
    let all: f64 = markers.list.iter().map(|m| m.volume).sum();
    let concerns =
        Concern::ALL.map(|c| format!("{} {:.1} %", c.word(), 100.0 * volumes[c.index()] / all));
    let raised = match tolerance > asked {
        true => format!(" (raised from {asked} to keep within zones.budget)"),
        false => String::new(),
    };
    let words = format!(
        "by the oracle: material that misplaces more strain than {tolerance:.4}{raised} is grains but for {:.0} % of all; in need of them by their \
         first concern: {}",
        100.0 * FORGIVEN,
        concerns.join(", ")
    );
    Ok(Some(Surveyed {
        scene: surveyed,
        table: table(&markers),
        words,
    }))
}

/// Markers at the end of a run of the continuum alone.
fn follow(
    case: &CollapseCase<AnyLaw>,
    scene: &CollapseScene,
    oracle: &Oracle,
) -> Result<Markers, Failure> {
    let failed = |why: colluvium_continuum::Error| Failure::Run(format!("survey of zones: {why}"));
    let mut collapse = Collapse::new(case, &options(scene)).map_err(failed)?;
    let end = scene.duration_scaled * collapse.units().time();
    let mut markers = Markers::new(&collapse.fields());
    let (mut resting, mut before) = (0, 0.0);
    while collapse.time() < end * (1.0 - 1e-9) && resting < REST_STEPS {
        let step = collapse.step(end).map_err(failed)?;
        resting = match collapse.is_at_rest(&step) {
            true => resting + 1,
            false => 0,
        };
        let now = collapse.time();
        markers.follow(&collapse.fields(), oracle, Some(0.0), now - before);
        before = now;
    }
    Ok(markers)
}

/// Mean misplaced strain of the material by its place at the start, in all and by concern.
fn table(markers: &Markers) -> Table {
    let mut rows: Vec<[f64; 6]> = Vec::new();
    let mut sorted: Vec<_> = markers.list.iter().collect();
    sorted.sort_by(|a, b| a.start[0].total_cmp(&b.start[0]));
    for marker in sorted {
        let same = rows.last().is_some_and(|row| row[0] == marker.start[0]);
        if !same {
            rows.push([marker.start[0], 0.0, 0.0, 0.0, 0.0, 0.0]);
        }
        let Some(row) = rows.last_mut() else { continue };
        row[1] += marker.volume;
        for (sum, strain) in row[2..].iter_mut().zip(marker.misplaced) {
            *sum += marker.volume * strain;
        }
    }
    let mean = |k: usize| rows.iter().map(|r| r[k] / r[1]).collect::<Vec<f64>>();
    let mut table = Table::new("zones").with("x", "m", rows.iter().map(|r| r[0]).collect());
    for concern in Concern::ALL {
        table = table.with(concern.word(), "1", mean(2 + concern.index()));
    }
    table
}

/// The oracle's reasons in the report.
pub(super) fn figure() -> Figure {
    Figure::Curves {
        table: "zones".into(),
        x: ["x".into(), "place at the start x [m]".into()],
        y_label: "misplaced strain".into(),
        y: Concern::ALL
            .map(|c| [c.word().to_owned(), c.word().to_owned()])
            .to_vec(),
        log: false,
        caption: "Strain that material makes under a friction in doubt in the continuum alone, by where it lay at the start and by \
                  concern: what the edge was chosen by."
            .into(),
    }
}
