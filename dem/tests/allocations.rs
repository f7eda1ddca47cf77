//! A step allocates nothing; rebuilds only where a buffer has to grow.

#![allow(clippy::unwrap_used)]

use colluvium_dem::preparation::{Bed, InclineBed, RadiusLaw, settle_incline_bed};
use colluvium_dem::walls::{Mesh, Sine};
use colluvium_dem::*;
use nalgebra::Vector3;
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use std::alloc::System;
use std::ops::ControlFlow;
use std::sync::Arc;

#[global_allocator]
static COUNTING: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Allocations of all threads since the start.
fn allocations() -> u64 {
    let counts = COUNTING.stats();
    (counts.allocations + counts.reallocations) as u64
}

fn law() -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(2e4, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 0.5),
        None,
    )
}

/// Grains at rest, for all flows.
fn settled() -> Bed {
    let spec = InclineBed {
        grains: 1500,
        radius: RadiusLaw::Gaussian {
            mean: 0.5,
            relative_deviation: 0.1,
            cut: 1.0,
        },
        density: 6.0 / std::f64::consts::PI,
        length: 12.0,
        width: 10.0,
        law: law(),
        gravity: 1.0,
        timestep: 5e-4,
        seed: 5,
    };
    settle_incline_bed(&spec, Threads::Serial, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn flow(bed: &Bed, threads: Threads, floor: impl Fn(f64) -> Wall) -> Simulation {
    let slope = 33_f64.to_radians();
    let mut s = Simulation::new(Setup {
        domain: bed.domain,
        gravity: Vector3::new(slope.sin(), 0.0, -slope.cos()),
        law: law().into(),
        grains: bed.grains.clone(),
        walls: vec![floor(bed.domain.lower.z)],
        bodies: Vec::new(),
        timestep: 5e-4,
        threads,
    })
    .unwrap();
    s.give_velocity(|g| Vector3::new(1.2 * g.position.z, 0.0, 0.0));
    s
}

fn plane(height: f64) -> Wall {
    Wall::plane(Vector3::z() * height, Vector3::z())
}

/// A floor of triangles under the whole box, that shakes.
fn mesh(height: f64) -> Wall {
    let across: u32 = 12;
    let vertices = (0..(across + 1) * (across + 1)).map(|k| {
        let [x, y] = [k % (across + 1), k / (across + 1)].map(f64::from);
        Vector3::new(x, y * 10.0 / 12.0, height)
    });
    let cells = (0..across * across).map(|k| k / across * (across + 1) + k % across);
    let triangles: Vec<[u32; 3]> = cells
        .flat_map(|k| {
            [
                [k, k + 1, k + across + 1],
                [k + 1, k + across + 2, k + across + 1],
            ]
        })
        .collect();
    let mesh = Mesh::new(vertices.collect(), &triangles).unwrap();
    Wall::mesh(Arc::new(mesh)).moving(Motion::Sine(Sine {
        amplitude: Vector3::z() * 0.01,
        frequency: Vector3::z(),
        phase: Vector3::zeros(),
    }))
}

/// Allocations of a few steps without a rebuild, and of many with rebuilds.
fn count(s: &mut Simulation) -> (u64, u64, u64) {
    s.advance(1500).unwrap();
    let mut quiet = u64::MAX;
    // The list of pairs within reach is renewed every few steps: look at single ones.
    for _ in 0..50 {
        let before = allocations();
        s.advance(1).unwrap();
        quiet = quiet.min(allocations() - before);
    }
    let (before, builds) = (allocations(), s.list_builds());
    s.advance(1500).unwrap();
    let after = allocations();
    (quiet, after - before, s.list_builds() - builds)
}

#[test]
fn steps_allocate_nothing() {
    let bed = settled();
    let (quiet, busy, builds) = count(&mut flow(&bed, Threads::Serial, plane));
    println!("serial: {quiet} a step, {busy} over {builds} rebuilds");
    let mut parallel = flow(&bed, Threads::Rayon, plane);
    let (quiet_threads, busy_threads, _) = rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build()
        .unwrap()
        .install(|| count(&mut parallel));
    println!("two threads: {quiet_threads} a step, {busy_threads} over the rebuilds");
    assert!(builds > 3, "{builds}");
    assert_eq!((quiet, quiet_threads), (0, 0));
    // A buffer grows now and then, when a list is longer than any before it.
    assert!(busy < 2 * builds, "{busy}");
    assert!(busy_threads < 2 * builds, "{busy_threads}");
    // One test: the counter sees all threads of the process.
    let (quiet, busy, builds) = count(&mut flow(&bed, Threads::Serial, mesh));
    println!("on a mesh: {quiet} a step, {busy} over {builds} rebuilds");
    assert_eq!(quiet, 0);
    assert!(busy < 2 * builds, "{busy}");
}
