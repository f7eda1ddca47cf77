//! The run that begins as grains and goes on joined: in pieces, resumed, and beside what it must refuse.

use super::comparison::continuum_error;
use super::world::{STIFFNESS, law, rheology, small_bed};
use colluvium_coupling::incline::{InclineSpec, Purpose, Start};
use colluvium_coupling::overlap::OverlapSettings;
use colluvium_coupling::overlap::joined_incline::{
    JoinedInclineResult, JoinedInclineRun, JoinedInclineSpec,
};
use colluvium_dem::Threads;

fn spec() -> JoinedInclineSpec {
    let bed = small_bed();
    JoinedInclineSpec {
        incline: InclineSpec {
            slope: 24.0_f64.to_radians(),
            gravity: 1.0,
            diameter: 1.0,
            grain_density: super::world::DENSITY,
            law: law(),
            domain: bed.domain,
            bed: bed.grains.clone(),
            start: Start::Flow {
                inertial_number: 0.16,
            },
            purpose: Purpose::Measure,
            timestep: super::world::STEP,
            relax_time: 6.0,
            average_time: 4.0,
            max_time: 12.0,
            sample_every: 50,
            layer: 1.0,
            steady_tolerance: 0.05,
            threads: Threads::Serial,
        },
        height: 10.0,
        from: 3.0,
        mass: None,
        rheology: rheology(),
        stiffness: STIFFNESS,
        settings: OverlapSettings::default(),
    }
}

/// Runs to the end in pieces of so many steps, restarted after each of them, on two threads.
fn in_pieces(steps: u64) -> JoinedInclineResult {
    let mut spec = spec();
    spec.incline.threads = Threads::Rayon;
    let spec = || spec.clone();
    let mut run = JoinedInclineRun::new(spec()).unwrap();
    while !run.finished() {
        run.advance(steps).unwrap();
        let record = run.checkpoint();
        run = JoinedInclineRun::resume(spec(), &record).unwrap();
    }
    run.finish().unwrap()
}

#[test]
fn a_run_in_pieces_is_the_same_run() {
    let mut run = JoinedInclineRun::new(spec()).unwrap();
    run.advance(u64::MAX).unwrap();
    assert!(run.finished() && run.progress() == 1.0);
    let whole = run.finish().unwrap();
    // 613 steps end in the middle of an exchange, and of the time between samples.
    let pieces = in_pieces(613);
    assert_eq!(whole.state_hash, pieces.state_hash);
    assert_eq!(whole.profile, pieces.profile);
    assert_eq!(whole.continuum, pieces.continuum);
    assert_eq!(whole.work_done, pieces.work_done);
    assert!(
        whole.ledger_errors.iter().all(|e| *e < 1e-11),
        "{:?}",
        whole.ledger_errors
    );
    // Continuum and grains tell of one flow where both are.
    let copy = whole.continuum.iter().filter(|row| row.is_copy);
    let miss = continuum_error(copy.map(|r| (r.z, r.u)), &whole.profile, [6.0, 8.0]);
    assert!(miss.abs() < 0.08, "{miss}");
    assert!(whole.report.slip.abs() < 0.02, "{:?}", whole.report);
    assert!(
        whole.heights[3] > whole.heights[2] + 4.0,
        "{:?}",
        whole.heights
    );
    assert!(whole.work_done[1] > 0 && whole.sizes[0] < small_bed().grains.len());
}

/// Forty diameters, nine of them grains; no other grain is ever made.
#[test]
fn the_upper_part_may_be_continuum_from_the_start() {
    let depth = 40.0;
    let area = small_bed().domain.floor_area();
    let weight = rheology().bulk_density() * 24.0_f64.to_radians().cos() * depth;
    let mut spec = spec();
    spec.height = 9.0;
    spec.from = 0.0;
    spec.mass = Some(depth * area * rheology().bulk_density());
    let mut run = JoinedInclineRun::new(spec.clone()).unwrap();
    while !run.finished() {
        run.advance(777).unwrap();
        run = JoinedInclineRun::resume(spec.clone(), &run.checkpoint()).unwrap();
    }
    let result = run.finish().unwrap();
    let rows = || {
        result
            .profile
            .rows
            .iter()
            .filter(|r| r.z > 1.0 && r.z < 3.0)
    };
    for row in rows() {
        let above = weight * (1.0 - row.z / depth);
        let miss = row.sigma_zz.value / above - 1.0;
        assert!(miss.abs() < 0.08, "{} {miss}", row.z);
    }
    assert_eq!(rows().count(), 2);
    let top = result.continuum.last().unwrap();
    // Bagnold's profile of all material, from the base to the surface.
    assert!(
        top.u > 4.0 * result.continuum[0].u && top.z > depth - 4.0,
        "{top:?}"
    );
    let errors = result.ledger_errors;
    assert!(errors.iter().all(|e| *e < 1e-11), "{errors:?}");
    let mut whole = JoinedInclineRun::new(spec).unwrap();
    whole.advance(u64::MAX).unwrap();
    assert_eq!(whole.finish().unwrap().state_hash, result.state_hash);
}

/// The control: neither side feels the other.
#[test]
fn uncoupled_sides_part() {
    let mut spec = spec();
    spec.settings.uncoupled = true;
    let mut run = JoinedInclineRun::new(spec).unwrap();
    run.advance(u64::MAX).unwrap();
    let result = run.finish().unwrap();
    let ledger = &result.ledger;
    let given = [
        ledger.shear,
        ledger.pressure,
        ledger.impedance,
        ledger.relaxation,
    ];
    assert_eq!(given, [0.0; 4]);
    assert!(result.report.slip.abs() > 0.05 && result.report.pressure_ratio.unwrap() < 0.8);
    let errors = result.ledger_errors;
    // As near as the residuals of the continuum's steps, which starts from far off its steady flow.
    assert!(errors.iter().all(|e| *e < 1e-10), "{errors:?}");
}

#[test]
fn numbers_out_of_range_are_refused_by_name() {
    let refused = |change: fn(&mut JoinedInclineSpec)| {
        let mut spec = spec();
        change(&mut spec);
        JoinedInclineRun::new(spec)
            .err()
            .expect("refused")
            .to_string()
    };
    for (key, change) in [
        (
            "overlap.from",
            (|s| s.from = 7.0) as fn(&mut JoinedInclineSpec),
        ),
        ("overlap.height", |s| s.height = 3.0),
        ("overlap.mass", |s| (s.from, s.mass) = (0.0, Some(100.0))),
        ("overlap.from", |s| s.mass = Some(1e4)),
        ("overlap.load_time", |s| s.settings.load_time = Some(0.05)),
        ("overlap.impedance", |s| {
            s.settings.impedance = Some(f64::NAN)
        }),
        ("incline.slope_degrees", |s| s.incline.slope = 2.0),
        ("rheology.mu_2", |s| s.rheology.mu_2 = 0.1),
    ] {
        let error = refused(change);
        assert!(error.contains(key), "{key}: {error}");
    }
    // Above the bed there is nothing to hand over: this shows when it is to be done.
    let mut high = spec();
    high.height = 40.0;
    let mut run = JoinedInclineRun::new(high).unwrap();
    let error = run.advance(u64::MAX).unwrap_err().to_string();
    assert!(error.starts_with("overlap.edge.position = 40"), "{error}");
}
