//! Beds of clumps: rest, accounts, the same bits for threads and after a restart.

use super::scene::*;
use colluvium_dem::*;
use nalgebra::Vector3;
use std::sync::OnceLock;

const SIDE: u32 = 6;
const LAYERS: u32 = 9;

/// Clumps of three on a lattice above a floor, periodic across.
fn rain(threads: Threads) -> Simulation {
    let mut grains = Vec::new();
    let step = 0.042;
    for k in 0..SIDE * SIDE * LAYERS {
        let cell = [k % SIDE, k / SIDE % SIDE, k / (SIDE * SIDE)].map(|c| f64::from(c) + 0.5);
        let at = v(cell[0], cell[1], cell[2]) * step;
        let motion = [
            v(0.3 * (f64::from(k % 3) - 1.0), 0.1, -0.2),
            v(f64::from(k % 5), 1.0, -2.0),
        ];
        grains.extend(put(&dogleg(), at, orientation(k), motion));
    }
    let width = step * f64::from(SIDE);
    let mut setup = setup(rough(), grains, 2e-5);
    setup.domain = Domain {
        lower: Vector3::zeros(),
        upper: v(width, width, 1.0),
        periodic: [true, true, false],
    };
    setup.gravity = v(0.0, 0.0, -9.81);
    setup.walls = vec![Wall::plane(Vector3::zeros(), Vector3::z())];
    setup.threads = threads;
    let mut bed = Simulation::new(setup).unwrap();
    bed.clump(&rows_of(0, SIDE * SIDE * LAYERS, 3)).unwrap();
    bed
}

/// State after a second: two runs of 25 000 steps, with a checkpoint between them.
fn halves() -> &'static (Record, String) {
    static HALVES: OnceLock<(Record, String)> = OnceLock::new();
    HALVES.get_or_init(|| {
        let mut bed = rain(Threads::Serial);
        bed.advance(6000).unwrap();
        let record = bed.checkpoint();
        bed.advance(6000).unwrap();
        (record, bed.state_hash())
    })
}

fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().unwrap().install(work)
}

#[test]
fn the_same_bits_for_one_two_and_three_threads() {
    let hash = &halves().1;
    for threads in [1, 2, 3] {
        let other = in_pool(threads, || {
            let mut bed = rain(Threads::Rayon);
            bed.advance(12_000).unwrap();
            bed.state_hash()
        });
        assert_eq!(&other, hash, "{threads}");
    }
}

#[test]
fn a_restart_goes_on_with_the_same_bits() {
    let (record, hash) = halves();
    let setup = || {
        let bed = rain(Threads::Serial);
        let mut setup = super::scene::setup(rough(), Vec::new(), 2e-5);
        setup.domain = *bed.domain();
        setup.gravity = bed.gravity();
        setup.walls = vec![Wall::plane(Vector3::zeros(), Vector3::z())];
        // Only their number counts: all else is in the record.
        setup.grains = vec![
            Grain::at_rest(Vector3::zeros(), 0.01, DENSITY);
            (SIDE * SIDE * LAYERS * 3) as usize
        ];
        for (k, grain) in setup.grains.iter_mut().enumerate() {
            grain.position.z = k as f64;
        }
        setup
    };
    let mut again = Simulation::resume(setup(), record).unwrap();
    assert_eq!(again.clump_count(), (SIDE * SIDE * LAYERS) as usize);
    again.advance(3000).unwrap();
    let second = again.checkpoint();
    let mut again = Simulation::resume(setup(), &second).unwrap();
    again.advance(3000).unwrap();
    assert_eq!(&again.state_hash(), hash);
    // Damaged ones are refused.
    type Spoil = fn(&mut Record);
    let spoils: [(&str, Spoil); 4] = [
        ("clumps/", |r| {
            r.counts.get_mut("clumps/grain").unwrap()[1] = 0;
        }),
        ("clumps/", |r| {
            r.counts.get_mut("clumps/count").unwrap()[0] = u64::MAX;
        }),
        ("clumps/", |r| {
            r.numbers.get_mut("clumps/state").unwrap()[0] = -1.0;
        }),
        ("clumps/state", |r| {
            r.numbers.get_mut("clumps/state").unwrap()[4] += 0.5;
        }),
    ];
    for (word, spoil) in spoils {
        let mut bad = record.clone();
        spoil(&mut bad);
        let error = Simulation::resume(setup(), &bad).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn a_bed_comes_to_rest_with_its_accounts_closed() {
    let mut bed = rain(Threads::Serial);
    bed.open_energy_ledger();
    bed.advance(2000).unwrap();
    assert!(bed.momentum_error() < 1e-12, "{:e}", bed.momentum_error());
    let ledger = bed.energy_ledger().unwrap();
    println!(
        "ledger {:.1e}, momentum {:.1e}",
        ledger.error(),
        bed.momentum_error()
    );
    assert!(ledger.error().abs() < 1e-11, "{:e}", ledger.error());
    let mut bed = rain(Threads::Serial);
    for _ in 0..80 {
        bed.advance(1000).unwrap();
        bed.damp(0.95);
    }
    bed.advance(10_000).unwrap();
    let rest = bed.rest_measures(9.81);
    println!("rest of {} clumps: {rest}", bed.clump_count());
    assert!(rest.kinetic < 1e-6 && rest.unbalanced < 0.02, "{rest}");
    // The floor bears all of it.
    let weight = bed.free_mass() * 9.81;
    assert!((bed.wall_load(0).force.z / -weight - 1.0).abs() < 0.01);
    let high = bed
        .grain_list()
        .iter()
        .map(|g| g.position.z)
        .fold(0.0, f64::max);
    assert!(high < 0.3, "{high}");
}
