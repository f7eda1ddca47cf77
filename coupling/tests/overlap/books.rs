//! What an overlap keeps account of: conservation, restarts, allocations, and what it refuses.

use super::world::{Bed, rheology, small_bed, steps};
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::overlap::{
    NormalMotion, Overlap, OverlapError, OverlapSettings, StressKernel,
};
use colluvium_dem::{Record, Simulation};

fn moving(normal_motion: NormalMotion) -> OverlapSettings {
    OverlapSettings {
        normal_motion: Some(normal_motion),
        ..Default::default()
    }
}

fn joined(bed: &Bed, height: f64, settings: OverlapSettings) -> (Simulation, Overlap<MuI>) {
    let mut simulation = bed.flow(24.0, 2.0);
    let overlap = Overlap::replace(bed.continuum_above(height, settings), &mut simulation);
    (simulation, overlap.unwrap())
}

/// Everything that may differ after a restart.
fn state(simulation: &mut Simulation, overlap: &Overlap<MuI>) -> (String, Record) {
    (simulation.state_hash(), overlap.checkpoint())
}

#[test]
fn a_restart_in_the_middle_of_an_exchange_changes_no_bit() {
    let (mut simulation, mut whole) = joined(small_bed(), 10.0, moving(NormalMotion::Riding));
    // Seven steps into an exchange of a hundred, two after the last loads were laid.
    whole.advance(&mut simulation, 107).unwrap();
    assert!(!whole.at_exchange());
    let (grains, record) = (simulation.checkpoint(), whole.checkpoint());
    let setup = small_bed().tilted(24.0);
    let mut resumed = Simulation::resume(setup, &grains).unwrap();
    let spec = || small_bed().continuum_above(10.0, moving(NormalMotion::Riding));
    let mut second = Overlap::resume(spec(), &resumed, &record).unwrap();
    for steps in [1, 12, 300] {
        whole.advance(&mut simulation, steps).unwrap();
        second.advance(&mut resumed, steps).unwrap();
        let (a, b) = (state(&mut simulation, &whole), state(&mut resumed, &second));
        assert_eq!(a.0, b.0);
        for (name, values) in &a.1.numbers {
            assert_eq!(values, &b.1.numbers[name], "{name}");
        }
        assert_eq!(a.1.counts, b.1.counts);
    }

    let refused = |record: &Record| {
        let error = Overlap::resume(spec(), &resumed, record)
            .err()
            .expect("refused");
        error.to_string()
    };
    for name in record.numbers.keys().chain(record.counts.keys()) {
        let mut poorer = record.clone();
        poorer.numbers.remove(name);
        poorer.counts.remove(name);
        assert!(refused(&poorer).contains(&format!("`{name}`")), "{name}");
        let mut shorter = record.clone();
        let emptied = shorter.numbers.get_mut(name).map(Vec::clear);
        emptied.or(shorter.counts.get_mut(name).map(Vec::clear));
        // Before the first step no grain has been pulled at.
        assert!(name == "pulls" || !refused(&shorter).is_empty(), "{name}");
    }
    let mut late = record.clone();
    late.counts.insert("made".into(), vec![100]);
    assert!(refused(&late).contains("`made`"));
    let mut endless = record;
    endless.counts.insert("cells".into(), vec![u64::MAX]);
    assert!(!refused(&endless).is_empty());
}

fn ledger_closes(height: f64, time: f64) {
    for normal_motion in [NormalMotion::Held, NormalMotion::Riding] {
        let settings = moving(normal_motion);
        let (mut simulation, mut overlap) = joined(small_bed(), height, settings);
        simulation.open_energy_ledger();
        overlap.advance(&mut simulation, steps(time)).unwrap();
        assert!(overlap.at_exchange());
        let errors = overlap.ledger_errors(&mut simulation);
        let energy = simulation.energy_ledger().unwrap();
        let work = overlap.work(&simulation);
        let booked = work.traction + work.impedance + work.relaxation;
        println!(
            "{:?}: mass {:.1e}, momentum of grains {:.1e}, of the continuum {:.1e}; energy {:.1e}, work {work:?}",
            overlap.settings().normal_motion,
            errors[0],
            errors[1],
            errors[2],
            energy.error()
        );
        assert!(errors.iter().all(|e| *e < 1e-11), "{errors:?}");
        assert!(energy.error() < 1e-10, "{:e}", energy.error());
        // The two books of the same work: of every step, and of velocities before and after loads that are held.
        let size = work.traction.abs() + work.impedance.abs() + work.relaxation.abs();
        assert!(
            (booked - energy.loads).abs() < 1e-3 * size,
            "{booked} {}",
            energy.loads
        );
        assert!(work.impedance < 0.0, "an impedance absorbs: {work:?}");
        let ledger = overlap.ledger();
        // What rides has taken what the grains have lost.
        let riding = if overlap.settings().normal_motion == NormalMotion::Riding {
            -ledger.impedance
        } else {
            0.0
        };
        assert!((ledger.riding - riding).abs() < 1e-9 * ledger.pressure.abs());
    }
}

#[test]
fn mass_and_momentum_close_to_round_off() {
    ledger_closes(10.0, 8.0);
}

#[test]
#[ignore = "half a minute; run by tests/validate.sh"]
fn mass_and_momentum_close_in_a_long_run() {
    ledger_closes(10.0, 200.0);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let bed = small_bed();
    let refused = |settings: OverlapSettings, height: f64| -> OverlapError {
        let mut simulation = Simulation::new(bed.tilted(24.0)).unwrap();
        let grains = simulation.grain_count();
        let spec = bed.continuum_above(height, settings);
        let error = Overlap::replace(spec, &mut simulation)
            .err()
            .expect("refused");
        assert_eq!(simulation.grain_count(), grains, "nothing has changed");
        error
    };
    let base = OverlapSettings::default();
    let negative = Some(-1.0);
    let cases = [
        (
            "cell",
            OverlapSettings {
                cell: negative,
                ..base
            },
        ),
        (
            "inner",
            OverlapSettings {
                inner: negative,
                ..base
            },
        ),
        (
            "buffer",
            OverlapSettings {
                buffer: Some(f64::NAN),
                ..base
            },
        ),
        (
            "shell",
            OverlapSettings {
                shell: Some(3.5),
                ..base
            },
        ),
        (
            "stress_time",
            OverlapSettings {
                stress_time: Some(0.0),
                ..base
            },
        ),
        (
            "relaxation_time",
            OverlapSettings {
                relaxation_time: negative,
                ..base
            },
        ),
        (
            "following_time",
            OverlapSettings {
                following_time: negative,
                ..base
            },
        ),
        (
            "spin_time",
            OverlapSettings {
                spin_time: negative,
                ..base
            },
        ),
        (
            "exchange_time",
            OverlapSettings {
                exchange_time: Some(f64::INFINITY),
                ..base
            },
        ),
        (
            "impedance",
            OverlapSettings {
                impedance: negative,
                ..base
            },
        ),
        (
            "cell",
            OverlapSettings {
                cell: Some(4.0),
                ..base
            },
        ),
        (
            "kernel.lucy",
            OverlapSettings {
                kernel: StressKernel::Lucy(0.0),
                ..base
            },
        ),
        // Forces on the shell would reach the stresses of the grains.
        (
            "kernel.lucy",
            OverlapSettings {
                kernel: StressKernel::Lucy(1.6),
                ..base
            },
        ),
        (
            "shell",
            OverlapSettings {
                shell: Some(2.1),
                ..base
            },
        ),
    ];
    for (key, settings) in cases {
        let error = refused(settings, 10.0).to_string();
        assert!(error.starts_with(&format!("overlap.{key} = ")), "{error}");
    }
    let error = refused(base, 40.0).to_string();
    assert!(error.starts_with("overlap.edge.position = 40"), "{error}");
    let mut nothing = rheology();
    nothing.solid_fraction = 0.0;
    let mut spec = bed.continuum_above(10.0, base);
    spec.rheology = nothing;
    let mut simulation = Simulation::new(bed.tilted(24.0)).unwrap();
    assert!(Overlap::replace(spec, &mut simulation).is_err());
}
