//! What a cliff has come to whose debris became a continuum.

use super::{JoinedCliff, Live};
use crate::failure::Failure;
use crate::run::cliff::record::CliffRecord;
use crate::run::land::Land;
use crate::run::world::Ran;
use crate::run::world::boulders::boulders;
use crate::state_hash;
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;

impl JoinedCliff<'_> {
    /// What the run has come to, with a continuum at its end.
    pub(super) fn find(
        &self,
        live: &Live,
        memory: &[f64],
        ran: &mut Ran,
        summary: &mut Summary,
    ) -> Result<Vec<Table>, Failure> {
        let Live { broken, runout } = live;
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
            "Its grains became a continuum {:.0} s after the start; contacts, turn, bonds and boulders are those of then.",
            runout.begun
        ));
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
        Ok(tables)
    }

    /// The hand-over, cost, and the ledger.
    fn book(&self, live: &Live, ran: &mut Ran, summary: &mut Summary) {
        let Live { broken, runout } = live;
        let grains = ran.packing.grains.len() as f64;
        let [steps, handed_over] = broken.counts;
        // Grains that are held cost nothing that counts as a grain-step.
        let counted = ran.simulation.steps_done() as f64 * grains;
        let spared = counted - steps * grains;
        summary.cost.grain_steps -= (spared as u64).min(summary.cost.grain_steps);
        let [made, iterations, cuts, cell_steps] = runout.steps;
        summary.cost.cell_steps = cell_steps;
        if summary.cost.wall_s > 0.0 {
            summary.cost.grain_steps_per_s = summary.cost.grain_steps as f64 / summary.cost.wall_s;
            summary.cost.cell_steps_per_s = cell_steps as f64 / summary.cost.wall_s;
        }
        summary.model.cells = runout.cells();
        let h = &runout.handed;
        summary.ledger.mass_relative = runout.volume_drift();
        let scale = (2.0 * h.kinetic[0] * runout.mass()).sqrt();
        let off = (0..2).map(|c| (h.momentum[1][c] - h.momentum[0][c]).abs());
        let off = off.fold(0.0, f64::max) / scale;
        let mut put = |name: &str, value: f64, unit: &str, source: &str| {
            summary.put(name, Quantity::new(value, unit).from(source));
        };
        put(
            "time_of_handover",
            runout.begun,
            "s",
            "when the grains became a continuum, from the start of the run",
        );
        put("handed_grains", handed_over, "1", "that became a continuum");
        put(
            "handed_volume_error",
            h.volume[1] / h.volume[0] - 1.0,
            "1",
            "volume of the continuum over that of the grains at the cliff's solid fraction, less 1",
        );
        put(
            "handed_momentum_error",
            off,
            "1",
            "over √(2 mass × kinetic energy)",
        );
        put(
            "handed_kinetic_share",
            h.kinetic[2] / (h.kinetic[0] + h.kinetic[1]),
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
