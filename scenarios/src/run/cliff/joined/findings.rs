//! What a cliff has come to whose debris became a continuum.

use super::{JoinedCliff, Live};
use crate::failure::Failure;
use crate::run::cliff::debris::volume_beyond;
use crate::run::cliff::record::CliffRecord;
use crate::run::cliff::runout::Runout;
use crate::run::land::Land;
use crate::run::world::Ran;
use crate::run::world::boulders::boulders;
use crate::state_hash;
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_coupling::handover::Handed;

impl JoinedCliff<'_> {
    /// What the run has come to, with a continuum at its end.
    pub(super) fn find(
        &self,
        live: &Live,
        memory: &[f64],
        ran: &mut Ran,
        summary: &mut Summary,
    ) -> Result<Vec<Table>, Failure> {
        let Live { broken, runout, .. } = live;
        let none = || Failure::Run("the cliff was never looked at".into());
        let axis = self.scene.heap_axis(runout.diameter());
        let record = CliffRecord::read(memory, axis.columns).ok_or_else(none)?;
        let deposit = self.heights(&mut ran.simulation, live, record.heap.solid_fraction);
        let places = axis.positions();
        self.scene.put_times(&record, ran, summary);
        let land = self.scene.land(&self.origin)?;
        let heap = [places.as_slice(), &deposit];
        self.scene
            .put_pile(heap, runout.diameter(), land.as_ref(), summary);
        let across = ran.simulation.domain().lengths().y;
        let beyond = runout.parcels().into_iter().filter(|[x, _]| *x > 0.0);
        let beyond: f64 = beyond.map(|[_, volume]| volume).sum();
        // What stands beside it is grains.
        let beyond = beyond + volume_beyond(&ran.seen.grains, 0.0);
        let share = beyond / (record.heap.solid_fraction * across * self.scene.areas()[1]);
        // The columns' names are those of any boulders.
        let mut sizes = boulders(
            &ran.simulation.clusters(),
            self.scene.material.solid_fraction(),
        );
        for (column, values) in sizes.columns.iter_mut().zip(&broken.boulders) {
            column.values.clone_from(values);
        }
        let broken_at = [broken.held, broken.turned];
        self.scene.put_broken(share, broken_at, &record, summary);
        self.scene.put_boulders(broken.bonds, &sizes, summary);
        summary.remarks.push(format!(
            "Its grains became a continuum {:.0} s after the start{}; contacts, turn, bonds and boulders are those of the first time.",
            runout.begun,
            match runout.instalments.last() {
                Some((last, _)) if *last > runout.begun => format!(", the last of them {last:.0} s after it"),
                _ => String::new(),
            }
        ));
        if live.standing.as_ref().is_some_and(|s| s.free > 0) {
            let word = "Some of it stands to the end and stayed grains.";
            summary.remarks.push(word.into());
        }
        self.book(live, ran, summary);
        summary.figures.push(Figure::history(
            "kinetic energy [J]",
            &[
                ("translation", "grains, translation"),
                ("rotation", "grains, rotation"),
                ("continuum_kinetic", "continuum"),
            ],
            "The fall and the run-out: kinetic energy of grains and continuum in time.",
        ));
        summary.figures.push(Figure::history(
            "length [m]",
            &[("sunk", "sunk on the mean"), ("x_front", "front")],
            "How far what stood before the crack has sunk while it was grains, and where the debris ends.",
        ));
        let tables = record.heap.tables(places.clone(), deposit);
        let mut tables = Land::beside(land.as_ref(), &places, tables);
        tables.push(sizes);
        tables.push(instalments(runout));
        Ok(tables)
    }

    /// The hand-over, cost, and the ledger.
    fn book(&self, live: &Live, ran: &mut Ran, summary: &mut Summary) {
        let Live {
            broken,
            runout,
            standing,
        } = live;
        let grains = ran.packing.grains.len() as f64;
        let begun = broken.counts[0];
        let beside = standing.as_ref().map_or(0, |s| s.grain_steps) as f64;
        // Grains that are held cost nothing that counts as a grain-step.
        let counted = ran.simulation.steps_done() as f64 * grains;
        let spared = counted - begun * grains - beside;
        summary.cost.grain_steps -= (spared as u64).min(summary.cost.grain_steps);
        let [made, iterations, cuts, cell_steps] = runout.steps;
        summary.cost.cell_steps = cell_steps;
        if summary.cost.wall_s > 0.0 {
            summary.cost.grain_steps_per_s = summary.cost.grain_steps as f64 / summary.cost.wall_s;
            summary.cost.cell_steps_per_s = cell_steps as f64 / summary.cost.wall_s;
        }
        summary.model.cells = runout.cells();
        summary.ledger.mass_relative = runout.volume_drift();
        let all = || runout.instalments.iter().map(|(_, handed)| handed);
        let sum = |of: &dyn Fn(&Handed) -> f64| all().map(of).sum::<f64>();
        let off = all().map(momentum_error).fold(0.0, f64::max);
        let volume = [0, 1].map(|k| sum(&|h| h.volume[k]));
        let kinetic = [0, 1, 2].map(|k| sum(&|h| h.kinetic[k]));
        let handed_over = sum(&|h| h.grains as f64);
        let mass = sum(&|h| h.mass);
        let mut put = |name: &str, value: f64, unit: &str, source: &str| {
            summary.put(name, Quantity::new(value, unit).from(source));
        };
        put(
            "time_of_handover",
            runout.begun,
            "s",
            "when the first grains became a continuum, from the start of the run",
        );
        put(
            "instalments",
            runout.instalments.len() as f64,
            "1",
            "in which grains became a continuum",
        );
        put(
            "grain_step_share",
            (begun * grains + beside) / counted,
            "1",
            "of the steps of all grains to the end of the run; what is held is not counted",
        );
        put(
            "handed_mass_error",
            runout.mass() / mass - 1.0,
            "1",
            "of the continuum, which has one density, over its grains, less 1",
        );
        if let Some(standing) = standing {
            let ledger = &standing.ground.ledger;
            put(
                "exchange_error",
                ledger.residual(),
                "1",
                "of the impulses of grains and continuum on each other, over the sum of their sizes",
            );
            put(
                "deepest_in_continuum",
                ledger.deepest,
                "1",
                "over its diameter, how far a grain sank into the continuum",
            );
        }
        put("handed_grains", handed_over, "1", "that became a continuum");
        put(
            "handed_volume_error",
            volume[1] / volume[0] - 1.0,
            "1",
            "volume of the continuum over that of the grains at the cliff's solid fraction, less 1",
        );
        put(
            "handed_momentum_error",
            off,
            "1",
            "over √(2 mass × kinetic energy), the largest of the instalments",
        );
        put(
            "handed_kinetic_share",
            kinetic[2] / (kinetic[0] + kinetic[1]),
            "1",
            "kinetic energy of the continuum over that of its grains: spin and agitation about the mean are left",
        );
        put("continuum_steps", made as f64, "1", "");
        put(
            "newton_iterations",
            iterations as f64,
            "1",
            "failed attempts included",
        );
        put("steps_cut", cuts as f64, "1", "halved and tried again");
        summary.state_hash = state_hash::of_hashes(
            [ran.simulation.state_hash(), state_hash::of(&[&ran.state])]
                .iter()
                .map(String::as_str),
        );
    }
}

/// Momentum that an instalment missed, over √(2 mass × kinetic energy).
fn momentum_error(h: &Handed) -> f64 {
    let scale = (2.0 * h.kinetic[0] * h.mass).sqrt();
    let off = (0..2).map(|c| (h.momentum[1][c] - h.momentum[0][c]).abs());
    off.fold(0.0, f64::max) / scale
}

/// When grains became continuum, and what of them.
fn instalments(runout: &Runout) -> Table {
    let rows = &runout.instalments;
    let column = |of: &dyn Fn(&Handed) -> f64| rows.iter().map(|(_, h)| of(h)).collect();
    Table::new("instalments")
        .with("t", "s", rows.iter().map(|(time, _)| *time).collect())
        .with("grains", "1", column(&|h| h.grains as f64))
        .with("mass", "kg", column(&|h| h.mass))
        .with("volume", "m³", column(&|h| h.volume[1]))
        .with(
            "volume_error",
            "1",
            column(&|h| h.volume[1] / h.volume[0] - 1.0),
        )
        .with("momentum_error", "1", column(&momentum_error))
        .with("kinetic", "J", column(&|h| h.kinetic[0] + h.kinetic[1]))
}
