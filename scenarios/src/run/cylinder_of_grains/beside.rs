//! The continuum beside a cylinder of grains: the same cylinder in space, with the law that they were calibrated to.

use crate::failure::Failure;
use crate::rheology_file::RheologyFile;
use crate::run::heap::{apart, edge, height_at};
use crate::run::steady_layer::failure;
use crate::scene::GrainCylinderScene;
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_continuum::cylinder_collapse::{CylinderCase, CylinderCollapse};
use colluvium_continuum::free_surface::{Contact, SurfaceOptions};
use colluvium_continuum::rheology::MuI;
use std::path::Path;

/// Steps at rest after which a run ends.
const REST_STEPS: u64 = 3;

/// What grains left; lengths in m.
pub struct Found {
    /// Distances from the axis and heights.
    pub deposit: (Vec<f64>, Vec<f64>),
    /// Height of the cylinder before, at its solid fraction.
    pub height: f64,
    /// (r_front − radius)/radius.
    pub runout: f64,
}

/// How the continuum ended.
struct Outcome {
    fronts: Vec<(f64, f64)>,
    deposit: (Vec<f64>, Vec<f64>),
    cells: u64,
    cell_steps: u64,
}

impl GrainCylinderScene {
    fn outcome(&self, law: MuI, height: f64, cells: u64) -> Result<Option<Outcome>, Failure> {
        let case = CylinderCase {
            aspect: height / self.radius(),
            height,
            gravity: self.gravity,
            rheology: law,
            cells: cells as usize,
            length_scaled: self.length() / height,
            whole: false,
            floor: Contact::NoSlip,
        };
        let mut collapse =
            CylinderCollapse::new(&case, &SurfaceOptions::default()).map_err(failure)?;
        let end = self.duration_scaled * collapse.units().time();
        let front = |collapse: &CylinderCollapse| {
            let (r, h) = collapse.profile();
            edge(&r, &h, self.threshold())
        };
        let mut fronts = vec![(0.0, front(&collapse))];
        let (mut resting, mut cell_steps) = (0, 0);
        while collapse.time() < end * (1.0 - 1e-9) && resting < REST_STEPS {
            let step = collapse.step(end).map_err(failure)?;
            resting = if collapse.is_at_rest(&step) {
                resting + 1
            } else {
                0
            };
            cell_steps += step.active_cells as u64;
            fronts.push((collapse.time(), front(&collapse)));
            if crate::interruption::requested() {
                return Ok(None);
            }
        }
        Ok(Some(Outcome {
            fronts,
            deposit: collapse.profile(),
            cells: collapse.flow().state().fractions.len() as u64,
            cell_steps,
        }))
    }

    /// Sets the continuum beside what grains left; a continuum that fails is told of.
    pub(super) fn set_beside(
        &self,
        grains: &Found,
        summary: &mut Summary,
    ) -> Result<Vec<Table>, Failure> {
        let Some(word) = self.grains.calibrated.word() else {
            return Ok(Vec::new());
        };
        match self.compare(word, grains, summary) {
            Err(Failure::Run(why)) => {
                let remark = format!("No continuum stands beside the grains: {why}");
                summary.remarks.push(remark);
                Ok(Vec::new())
            }
            other => other,
        }
    }

    fn compare(
        &self,
        word: &str,
        grains: &Found,
        summary: &mut Summary,
    ) -> Result<Vec<Table>, Failure> {
        let file = RheologyFile::read(Path::new(word))?;
        let law = MuI {
            mu_s: file.mu_s,
            mu_2: file.mu_2,
            i_0: file.i_0,
            diameter: self.grains.diameter,
            solid_fraction: file.solid_fraction,
            grain_density: self.grains.density,
            cohesion: 0.0,
        };
        let (fine, coarse) = (self.grid.cells, self.coarse_cells());
        let whole = self.outcome(law, grains.height, fine)?;
        let part = self.outcome(law, grains.height, coarse)?;
        let (Some(whole), Some(part)) = (whole, part) else {
            summary.remarks.push(
                "Interrupted beside the grains: their run is whole, the continuum is missing."
                    .into(),
            );
            return Ok(Vec::new());
        };
        let radius = self.radius();
        let runout = |outcome: &Outcome| {
            let (r, h) = &outcome.deposit;
            (edge(r, h, self.threshold()) - radius) / radius
        };
        let (r, h) = &whole.deposit;
        let within = super::TOP * self.grains.diameter;
        let inner = r.iter().zip(h).filter(|(r, _)| **r < within);
        let (volume, area) = inner.fold((0.0, 0.0), |(v, a), (r, h)| (v + r * h, a + r));
        let mut put = |name: &str, value: f64, unit: &str, source: String| {
            summary.put(name, Quantity::new(value, unit).from(&source));
        };
        put(
            "continuum_runout_scaled",
            runout(&whole),
            "1",
            format!("μ(I) in space with the law calibrated for {word}, {fine} cells"),
        );
        put(
            "continuum_deposit_height",
            if area > 0.0 { volume / area } else { h[0] },
            "m",
            "mean height of its deposit within 3 d of the axis".into(),
        );
        put(
            "runout_difference",
            runout(&whole) / grains.runout - 1.0,
            "1",
            "of the continuum from the grains, over theirs".into(),
        );
        put(
            "runout_part_of_grid",
            (runout(&part) - runout(&whole)) / grains.runout,
            "1",
            format!("of {coarse} from {fine} cells, over the grains' run-out"),
        );
        put(
            "deposit_difference",
            apart(&grains.deposit, &whole.deposit, |r| r),
            "1",
            "∫|h_grains − h_continuum| r dr over ∫h_grains r dr".into(),
        );
        summary.cost.cell_steps += whole.cell_steps + part.cell_steps;
        summary.model.cells = whole.cells;
        summary.remarks.push(format!(
            "The grains run out {:.3} radii, the continuum with their calibrated law {:.3} ({:+.1} %).",
            grains.runout,
            runout(&whole),
            100.0 * (runout(&whole) / grains.runout - 1.0)
        ));
        summary.figures.push(Figure::Curves {
            table: "sides".into(),
            x: ["r".into(), "r [m]".into()],
            y_label: "height h [m]".into(),
            y: [["h", "grains"], ["h_continuum", "continuum"]]
                .map(|pair| pair.map(str::to_owned))
                .to_vec(),
            log: false,
            caption: "Deposits of the grains and of the continuum with their calibrated law."
                .into(),
        });
        let (r, h) = &grains.deposit;
        let other = r.iter().map(|r| height_at(&whole.deposit, *r)).collect();
        let (t, x) = whole.fronts.into_iter().unzip();
        Ok(vec![
            Table::new("sides")
                .with("r", "m", r.clone())
                .with("h", "m", h.clone())
                .with("h_continuum", "m", other),
            Table::new("continuum")
                .with("t", "s", t)
                .with("r_front", "m", x),
        ])
    }
}
