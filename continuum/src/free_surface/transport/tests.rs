use std::f64::consts::PI;

use super::*;
use crate::grid::{Axis, Boundary, Grid};

fn periodic(cells: usize) -> Axis {
    Axis::Periodic { length: 1.0, cells }
}

fn walls(cells: usize) -> Axis {
    Axis::Bounded {
        length: 1.0,
        cells,
        low: Boundary::FreeSlip,
        high: Boundary::FreeSlip,
    }
}

fn topology(axis: Axis) -> Topology {
    Topology::new(&Grid::with_moving_surface([axis, axis]).unwrap())
}

/// Fractions of a disc, by 32 × 32 samples a cell where the rim passes.
fn disc(cells: usize, centre: [f64; 2], radius: f64) -> Vec<f64> {
    let h = 1.0 / cells as f64;
    let samples = 32;
    (0..cells * cells)
        .map(|cell| {
            let low = [(cell % cells) as f64 * h, (cell / cells) as f64 * h];
            let inside = (0..samples * samples)
                .filter(|s| {
                    let x = low[0] + ((s % samples) as f64 + 0.5) * h / samples as f64;
                    let z = low[1] + ((s / samples) as f64 + 0.5) * h / samples as f64;
                    (x - centre[0]).hypot(z - centre[1]) < radius
                })
                .count();
            inside as f64 / (samples * samples) as f64
        })
        .collect()
}

/// Velocity of a stream function ψ(x, z): u = ∂ψ/∂z, w = −∂ψ/∂x, without discrete divergence.
fn of_stream(cells: usize, faces: [usize; 2], psi: impl Fn(f64, f64) -> f64) -> Velocity {
    let h = 1.0 / cells as f64;
    let at = |i: usize, k: usize| psi(i as f64 * h, k as f64 * h);
    let u = (0..faces[0] * cells)
        .map(|f| (f % faces[0], f / faces[0]))
        .map(|(i, k)| (at(i, k + 1) - at(i, k)) / h)
        .collect();
    let w = (0..cells * faces[1])
        .map(|f| (f % cells, f / cells))
        .map(|(i, k)| -(at(i + 1, k) - at(i, k)) / h)
        .collect();
    [u, w]
}

fn step(
    transport: &mut Transport,
    topology: &Topology,
    fractions: &mut Vec<f64>,
    velocity: &mut Velocity,
    (courant, nth): (f64, usize),
) {
    let incompressible: Vec<bool> = fractions.iter().map(|&f| f > 0.5).collect();
    let order = if nth.is_multiple_of(2) {
        vec![0, 1]
    } else {
        vec![1, 0]
    };
    let carrier = velocity.clone();
    let motion = Motion {
        carrier: &carrier,
        passes: 1,
        topology,
        courant: [courant; 2],
        orders: &[order],
        incompressible: &incompressible,
        ground: None,
        ends: None,
    };
    transport.advance(&motion, fractions, velocity);
}

/// Disc in a vortex that turns back after half the time (LeVeque); the L1 error of the shape.
fn vortex_error(cells: usize) -> f64 {
    let topology = topology(walls(cells));
    let mut fractions = disc(cells, [0.5, 0.75], 0.15);
    let start = fractions.clone();
    let volume: f64 = start.iter().sum();
    let mut transport = Transport::default();
    let period = 2.0;
    let steps = (period * cells as f64 / 0.25) as usize;
    for n in 0..steps {
        let time = (n as f64 + 0.5) * period / steps as f64;
        let mut velocity = of_stream(cells, [cells + 1; 2], |x, z| {
            (PI * time / period).cos() / PI * ((PI * x).sin() * (PI * z).sin()).powi(2)
        });
        let courant = period / steps as f64 * cells as f64;
        step(
            &mut transport,
            &topology,
            &mut fractions,
            &mut velocity,
            (courant, n),
        );
    }
    let now: f64 = fractions.iter().sum();
    assert!(
        (now / volume - 1.0).abs() < 1e-13,
        "{:e}",
        now / volume - 1.0
    );
    for f in &fractions {
        assert!((-1e-13..=1.0 + 1e-12).contains(f), "{f:e} {:e}", f - 1.0);
    }
    let miss: f64 = fractions
        .iter()
        .zip(&start)
        .map(|(a, b)| (a - b).abs())
        .sum();
    miss / (cells * cells) as f64
}

#[test]
fn vortex_there_and_back() {
    let errors = [32, 64].map(vortex_error);
    let order = (errors[0] / errors[1]).log2();
    eprintln!("vortex errors {errors:?}, order {order}");
    assert!(errors[1] < 1e-3 && order > 1.5, "{errors:?}");
}

/// A lump with a slanted plane side and a uniform velocity: the velocity stays uniform to round-off
/// in every material face, momentum and volume stay.
#[test]
fn uniform_motion_is_exact() {
    let cells = 48;
    let topology = topology(periodic(cells));
    let mut fractions = disc(cells, [0.4, 0.45], 0.21);
    let (u, w) = (0.71, -0.37);
    let mut velocity = [vec![u; cells * cells], vec![w; cells * cells]];
    let mut transport = Transport::default();
    let volume: f64 = fractions.iter().sum();
    for n in 0..400 {
        step(
            &mut transport,
            &topology,
            &mut fractions,
            &mut velocity,
            (0.4, n),
        );
    }
    for (component, expected) in [(0, u), (1, w)] {
        for (face, value) in velocity[component].iter().enumerate() {
            if topology.face_mean(component, face, &fractions) > 1e-6 {
                assert!((value - expected).abs() < 1e-9, "{value} {expected}");
            }
        }
    }
    assert!((fractions.iter().sum::<f64>() / volume - 1.0).abs() < 1e-13);
    // 400 steps of 0.4 cells: 160 · 0.71 and 160 · 0.37 cells.
    let moved = disc(
        cells,
        [0.4 + 160.0 * u / 48.0, 0.45 + 160.0 * w / 48.0].map(|x: f64| x.rem_euclid(1.0)),
        0.21,
    );
    let miss: f64 = fractions
        .iter()
        .zip(&moved)
        .map(|(a, b)| (a - b).abs())
        .sum();
    eprintln!("translated disc misses {:e} of its volume", miss / volume);
    assert!(miss / volume < 0.02);
}

/// Momentum of a lump in a swirl on a periodic grid.
#[test]
fn momentum_is_conserved() {
    let cells = 32;
    let topology = topology(periodic(cells));
    let mut fractions = disc(cells, [0.5, 0.6], 0.25);
    let momentum = |fractions: &[f64], velocity: &Velocity| {
        [0, 1].map(|c: usize| {
            (0..velocity[c].len())
                .map(|face| topology.face_mean(c, face, fractions) * velocity[c][face])
                .sum::<f64>()
        })
    };
    let mut transport = Transport::default();
    let scale: f64 = fractions.iter().sum();
    for n in 0..50 {
        // Without pressure the velocity would pick up divergence: each step begins in the swirl.
        let mut velocity = of_stream(cells, [cells; 2], |x, z| {
            0.1 * (2.0 * PI * x).sin() * (2.0 * PI * z).cos()
        });
        let old = momentum(&fractions, &velocity);
        step(
            &mut transport,
            &topology,
            &mut fractions,
            &mut velocity,
            (0.3, n),
        );
        let new = momentum(&fractions, &velocity);
        for c in 0..2 {
            assert!((new[c] - old[c]).abs() < 1e-14 * scale);
        }
    }
}
