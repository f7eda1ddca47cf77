//! The energy ledger: closed to round-off, and no channel creates energy.

use crate::world::{MATERIAL, laws, setup};
use colluvium_dem::*;

const GRAINS: usize = 240;

#[test]
fn every_joule_is_accounted_for_under_every_law() {
    for (name, law) in laws() {
        let mut simulation = Simulation::new(setup(law, GRAINS, 5e-5)).unwrap();
        simulation.open_energy_ledger();
        simulation.advance(6_000).unwrap();
        let record = simulation.checkpoint();
        let mut simulation = Simulation::resume(setup(law, GRAINS, 5e-5), &record).unwrap();
        simulation.advance(6_000).unwrap();
        let ledger = simulation.energy_ledger().unwrap();
        assert!(ledger.error() < 1e-11, "{name}: {:e}", ledger.error());
        assert!(ledger.drive != 0.0, "{name}: the paddle works");
        assert!(ledger.gravity > 1.0, "{name}");
        let lost = ledger.dissipated();
        // A channel may be off by the step's own error, not more.
        let slack = 2e-3 * lost.sum();
        for (channel, lost) in [
            ("normal", lost.normal),
            ("tangential", lost.tangential),
            ("rolling", lost.rolling),
            ("twisting", lost.twisting),
        ] {
            assert!(lost > -slack, "{name}: {channel} created {:e} J", -lost);
        }
        assert!(lost.normal > 0.05 * lost.sum(), "{name}: {lost:?}");
        assert!(lost.tangential > 0.05 * lost.sum(), "{name}: {lost:?}");
        assert_eq!(lost.rolling != 0.0, law.rolling != Rolling::None, "{name}");
    }
}

#[test]
fn without_dashpots_and_friction_nothing_is_lost() {
    let law = ContactLaw {
        tangential: Tangential::None,
        ..ContactLaw::hertz_mindlin(MATERIAL, 1.0, 0.0)
    };
    let lost = |timestep: f64| {
        let mut simulation = Simulation::new(setup(law, GRAINS, timestep)).unwrap();
        // Opened under way, half a kick of the next step lies before it.
        simulation.advance(10).unwrap();
        simulation.open_energy_ledger();
        simulation.advance((0.3 / timestep) as u64).unwrap();
        let ledger = simulation.energy_ledger().unwrap();
        assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
        ledger.dissipated().normal / ledger.kinetic
    };
    let (coarse, fine) = (lost(4e-5).abs(), lost(1e-5).abs());
    assert!(fine < 1e-5, "{fine:e}");
    assert!(
        fine < 0.3 * coarse,
        "falls with the step: {coarse:e} to {fine:e}"
    );
}
