//! Between two exchanges a joined step allocates nothing.

#![allow(clippy::unwrap_used)]

use colluvium_continuum::grid::Boundary;
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::overlap::{
    FlatEdge, NormalMotion, Overlap, OverlapSettings, OverlapSpec, Scales,
};
use colluvium_dem::*;
use nalgebra::Vector3;
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use std::alloc::System;

#[global_allocator]
static COUNTING: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Allocations of all threads since the start.
fn allocations() -> u64 {
    let counts = COUNTING.stats();
    (counts.allocations + counts.reallocations) as u64
}

#[test]
fn steps_between_exchanges_allocate_nothing() {
    let (pitch, side) = (0.999, 6);
    let length = pitch * f64::from(side);
    let domain = Domain {
        lower: Vector3::new(0.0, 0.0, -1.0),
        upper: Vector3::new(length, length, 60.0),
        periodic: [true, true, false],
    };
    let places =
        (0..20).flat_map(|k| (0..side).flat_map(move |j| (0..side).map(move |i| [i, j, k])));
    let grains = places.map(|place| {
        let centre = place.map(|p| pitch * (f64::from(p) + 0.5));
        let mut grain = Grain::at_rest(centre.into(), 0.5, 1.9);
        grain.fixed = place[2] == 0;
        grain.velocity.x = if grain.fixed { 0.0 } else { 0.1 * centre[2] };
        grain
    });
    let law = ContactLaw::linear(
        Hooke::matched(5000.0, 0.6),
        TangentialSpring::matched(2.0 / 7.0, 0.6, 0.5),
        None,
    );
    let mut simulation = Simulation::new(Setup {
        domain,
        gravity: Vector3::new(0.4, 0.0, -0.9),
        law: law.into(),
        grains: grains.collect(),
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: 2e-3,
        threads: Threads::Serial,
    })
    .unwrap();
    let rheology = MuI::new(0.3, 0.7, 0.3, 1.0, 0.52, 1.9);
    let spec = OverlapSpec {
        edge: FlatEdge::across(&domain, 2, 0, true, 12.0),
        rheology,
        mass: None,
        far_end: Boundary::FreeSurface,
        scales: Scales {
            diameter: 1.0,
            time: 1.0,
            density: 1.9 * 0.52,
            stiffness: 5000.0,
        },
        settings: OverlapSettings {
            normal_motion: Some(NormalMotion::Riding),
            exchange_time: Some(0.04),
            ..Default::default()
        },
        strain_rate_floor: 1e-6,
    };
    let mut overlap = Overlap::replace(spec, &mut simulation).unwrap();
    overlap.advance(&mut simulation, 20 * 40).unwrap();
    let mut counts = Vec::new();
    for _ in 0..100 {
        assert!(overlap.at_exchange());
        let before = allocations();
        overlap.advance(&mut simulation, 19).unwrap();
        counts.push(allocations() - before);
        overlap.advance(&mut simulation, 1).unwrap();
    }
    // The grains' lists may have to grow where they are made anew.
    let quiet = counts.iter().filter(|count| **count == 0).count();
    assert!(quiet >= 90, "{counts:?}");
}
