//! What joints of all forms have in common.

use colluvium_dem::{GrainSample, Simulation};
use nalgebra::Vector3;

/// Parts of a full cell's mass at which grains begin to cover a surface, and cover it all.
const COVERS: [f64; 2] = [0.4, 0.7];
/// Cells with less of the mass of a full one are not spoken for by their grains.
const LEAST_COVER: f64 = 0.3;
/// Part of a full cell's mass from which on the mean velocity of its buffer is one.
pub(super) const LEAST_BUFFER: f64 = 0.1;

/// How far grains of a part of a full cell's mass cover the continuum's surface there, from 0 to 1.
pub(super) fn cover(part: f64) -> f64 {
    ((part - COVERS[0]) / (COVERS[1] - COVERS[0])).clamp(0.0, 1.0)
}

/// Share of the grains' stress in a cell with such a part of their mass and this mean label: none at the handshake surface, all at the
/// inner end of the overlap.
pub(super) fn share(part: f64, label: f64, [handshake, inner]: [f64; 2]) -> f64 {
    match part > LEAST_COVER {
        true => ((label - handshake) / (inner - handshake)).clamp(0.0, 1.0),
        false => 0.0,
    }
}

/// Part of a difference that a relaxation in a time (s) takes back for each second until the next exchange, after `dt` (s); at most all of it
/// by then (1/s).
pub(super) fn towards(dt: f64, time: f64) -> f64 {
    (dt / time).min(1.0) / dt
}

/// A quotient, zero where there is nothing to divide by.
pub(super) fn over(sum: f64, by: f64) -> f64 {
    if by > 0.0 { sum / by } else { 0.0 }
}

/// The same of a vector.
pub(super) fn vector_over(sum: Vector3<f64>, by: f64) -> Vector3<f64> {
    if by > 0.0 { sum / by } else { Vector3::zeros() }
}

/// Moment of inertia of a ball (kg m²).
pub(super) fn inertia(grain: &GrainSample) -> f64 {
    0.4 * grain.mass * grain.radius * grain.radius
}

/// For how long what was laid after so many steps has acted and is not booked yet (s).
pub(super) fn acting(simulation: &Simulation, laid_at: u64) -> f64 {
    simulation.kick_time(simulation.steps_done() - laid_at)
}
