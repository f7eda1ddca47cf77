//! What a joined bed tells of its books and of its joint.

use super::super::super::overlap_state;
use super::super::super::world::Ran;
use super::JoinedBed;
use crate::summary::{Quantity, Summary};
use colluvium_coupling::overlap::bowl::Bowl;

/// Limits of the monitors: slip over the ball's speed, ratio of forces less 1.
const MOST_SLIP: f64 = 0.01;
const MOST_RATIO: f64 = 0.05;
impl JoinedBed<'_> {
    /// Cost, mass and momentum.
    pub(super) fn book(&self, ran: &mut Ran, bowl: &Bowl, summary: &mut Summary) {
        let steps = ran.simulation.steps_done();
        let before = ran.packing.grains.len() + 1;
        let monitors = bowl.monitors();
        let counted = summary.cost.grain_steps.min(steps * before as u64);
        summary.cost.grain_steps += bowl.grain_steps() as u64;
        summary.cost.grain_steps -= counted;
        summary.cost.cell_steps = monitors.steps[1] as u64;
        if summary.cost.wall_s > 0.0 {
            summary.cost.grain_steps_per_s = summary.cost.grain_steps as f64 / summary.cost.wall_s;
            summary.cost.cell_steps_per_s = monitors.steps[1] / summary.cost.wall_s;
        }
        summary.model.grains = ran.simulation.grain_count() as u64;
        summary.model.cells = bowl.cells().count() as u64;
        let one = |value: f64| Quantity::new(value, "1");
        let share = bowl.grain_steps() / (steps * before as u64) as f64;
        summary.put(
            "grain_steps_share",
            one(share).from("grain-steps of the run over those of the whole bed"),
        );
        let account = bowl.account(&ran.simulation);
        let grains = account.grains_error(bowl.grain_momentum(&mut ran.simulation));
        let exchange = account.exchange_error(bowl.owed(&ran.simulation));
        let volume = bowl.volume_error();
        let mass = bowl.mass_error(&ran.simulation);
        summary.ledger.mass_relative = f64::max(volume.abs(), mass.abs());
        summary.ledger.momentum_relative = Some(grains.max(exchange));
        for (name, value, source) in [
            (
                "handshake_mass",
                mass,
                "mass of grains and continuum on their sides of the handshake surface over that of the bed, less 1",
            ),
            (
                "ledger_volume",
                volume,
                "volume of the continuum against its account, what its copy was given included, relative",
            ),
            (
                "ledger_grains",
                grains,
                "momentum of grains and ball against its account, relative to the largest entry",
            ),
            (
                "ledger_exchange",
                exchange,
                "what the relaxation gave to both sides, relative to the largest entry",
            ),
        ] {
            summary.put(name, one(value).against(0.0, source));
        }
        for (name, impulse, source) in [
            ("weight", account.weight, "of grains and ball"),
            (
                "traction",
                account.traction,
                "of the continuum on the grains",
            ),
            ("impedance", account.impedance, "on the grains"),
            (
                "relaxation",
                account.relaxation,
                "on the grains; the continuum takes the opposite",
            ),
        ] {
            let name = format!("impulse_{name}_z");
            summary.put(&name, Quantity::new(impulse.z, "N s").from(source));
        }
    }

    /// What the monitors say, and in words what they should not.
    pub(super) fn watch(&self, bowl: &Bowl, summary: &mut Summary) {
        let monitors = bowl.monitors();
        let d = bowl.spec().law.diameter;
        let slip = monitors.mean_slip() / self.scene.speed;
        let ratio = monitors.force_ratio();
        for (name, value, right, source) in [
            (
                "slip",
                slip,
                0.0,
                "difference of mean velocities at the handshake surface over the ball's speed, by sizes of means over windows of time; to be below 1 %",
            ),
            (
                "slip_noise",
                monitors.slip_noise() / self.scene.speed,
                0.0,
                "what the noise of the grains' velocities alone would make the slip",
            ),
            (
                "largest_slip",
                monitors.largest_slip() / self.scene.speed,
                0.0,
                "the slip of the worst window",
            ),
            (
                "force_ratio",
                ratio,
                1.0,
                "of normal forces through the handshake surface, grains over continuum, means in time; to be within 5 %",
            ),
            (
                "rest_ratio",
                bowl.rest_ratio(),
                1.0,
                "K_0: horizontal over vertical stress of the grains when the box was cut, which the continuum remembers until it is sheared",
            ),
            (
                "relaxation_share",
                monitors.relaxation_share(),
                0.0,
                "impulse of the relaxation over that of the traction, by sizes of means over windows of time",
            ),
            (
                "relaxation_noise",
                monitors.relaxation_noise(),
                0.0,
                "what the noise of the grains' velocities alone would make the relaxation_share",
            ),
            (
                "grains_escaped",
                monitors.escaped,
                0.0,
                "most grains beyond the box by more than a diameter, at any exchange",
            ),
            (
                "box_moved",
                bowl.farthest_moved() / d,
                0.0,
                "farthest mean way of grains through a face of the box, outwards, in diameters: it should be small",
            ),
        ] {
            summary.put(name, Quantity::new(value, "1").against(right, source));
        }
        overlap_state::put(monitors.temperatures(), monitors.work, summary);
        summary.put(
            "newton_iterations",
            Quantity::new(monitors.newton[0] / monitors.steps[0], "1")
                .from("of the continuum, a step"),
        );
        summary.put(
            "momentum_residual",
            Quantity::new(monitors.residual, "1").from("of the continuum, largest of any step"),
        );
        let misses = [
            (slip > MOST_SLIP, "the slip", slip),
            (
                (ratio - 1.0).abs() > MOST_RATIO,
                "the ratio of forces",
                ratio,
            ),
            (
                monitors.escaped > 0.0,
                "the number of grains beyond the box",
                monitors.escaped,
            ),
        ];
        for (_, what, value) in misses.into_iter().filter(|(misses, ..)| *misses) {
            summary
                .remarks
                .push(format!("Overlap: {what} is {value:.4}, outside its limit."));
        }
    }
}
