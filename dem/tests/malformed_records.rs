//! Records that no simulation has written: refused with the name of an array, or taken; no panic.

use colluvium_dem::*;
use nalgebra::Vector3;

/// A record of a cloud with contacts, walls, bonds, loads, gravity of its own and an open ledger.
fn record(setup: &Setup) -> Record {
    let mut s = Simulation::new(setup.clone()).unwrap();
    s.open_energy_ledger();
    let load = Load {
        grain: 3,
        force: 1e-3 * Vector3::x(),
        moment: 1e-5 * Vector3::y(),
    };
    s.set_loads(&[load]).unwrap();
    s.set_self_gravity(Some(SelfGravity::newton())).unwrap();
    s.advance(900).unwrap();
    let rule = BondRule {
        cement: Cement::sinter(1e5),
        gap: 0.1,
        materials: Vec::new(),
        within: Region::Everywhere,
    };
    assert!(s.bond(&rule).unwrap() > 0);
    s.advance(20).unwrap();
    s.checkpoint()
}

/// Ways to spoil an array of real numbers.
const SPOILS: [fn(&mut Vec<f64>); 8] = [
    |v| v.clear(),
    |v| {
        v.pop();
    },
    |v| v.push(1.0),
    |v| v.fill(f64::NAN),
    |v| v.fill(f64::INFINITY),
    |v| v.fill(1e300),
    |v| v.fill(-1.0),
    |v| v.reverse(),
];

/// Ways to spoil an array of whole numbers.
const MISCOUNTS: [fn(&mut Vec<u64>); 8] = [
    |v| v.clear(),
    |v| {
        v.pop();
    },
    |v| v.push(1),
    |v| v.fill(u64::MAX),
    |v| v.fill(u64::from(u32::MAX)),
    |v| v.fill(0),
    |v| v.fill(3),
    |v| v.reverse(),
];

#[test]
fn spoilt_arrays_are_refused_by_name_or_taken() {
    let (name, law) = crate::world::laws().swap_remove(4);
    let mut setup = crate::world::setup(law, 200, 1e-4);
    // Self-gravity has no images.
    setup.domain.periodic = [false; 3];
    let sound = record(&setup);
    assert!(
        !sound.numbers["contacts/history"].is_empty() && !sound.numbers["walls/history"].is_empty()
    );
    let (mut refused, mut taken, mut failed) = (0, 0, 0);
    let mut see = |array: &str, how: usize, spoilt: &Record| {
        if *spoilt == sound {
            return;
        }
        match Simulation::resume(setup.clone(), spoilt) {
            Err(error) => {
                let message = error.to_string();
                let group = array.split('/').next().unwrap();
                assert!(message.contains(group), "{array} {how}: {message}");
                refused += 1;
            }
            // What is a possible state goes on or blows up, and says so.
            Ok(mut simulation) => match simulation.advance(20) {
                Ok(()) => taken += 1,
                Err(error) => {
                    assert!(!error.to_string().is_empty());
                    failed += 1;
                }
            },
        }
    };
    for array in sound.numbers.keys() {
        for (how, spoil) in SPOILS.iter().enumerate() {
            let mut spoilt = sound.clone();
            spoil(spoilt.numbers.get_mut(array).unwrap());
            see(array, how, &spoilt);
        }
    }
    for array in sound.counts.keys() {
        for (how, spoil) in MISCOUNTS.iter().enumerate() {
            let mut spoilt = sound.clone();
            spoil(spoilt.counts.get_mut(array).unwrap());
            see(array, how, &spoilt);
        }
    }
    println!("{name}: {refused} refused, {taken} taken, {failed} failed in the run");
    assert!(refused > 200, "{refused}");
}
