//! What joints of all forms have in common.

use colluvium_dem::{GrainSample, Partner, Simulation, Snapshot};
use nalgebra::{SVector, Vector3};

/// Parts of a full cell's mass at which grains begin to cover a surface, and cover it all.
const COVERS: [f64; 2] = [0.4, 0.7];
/// Cells with less of the mass of a full one are not spoken for by their grains.
const LEAST_COVER: f64 = 0.3;
/// Part of a full cell's mass from which on the mean velocity of its buffer is one.
pub(super) const LEAST_BUFFER: f64 = 0.1;
/// Cells of the continuum fuller than this have a pressure of their own.
pub(super) const FULL: f64 = 0.5;
/// Most by which the pressure of a cell at the surface is taken to be below the mean over its filled part.
const LARGEST_FACTOR: f64 = 2.0;

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
pub(super) fn vector_over<const D: usize>(sum: SVector<f64, D>, by: f64) -> SVector<f64, D> {
    if by > 0.0 { sum / by } else { SVector::zeros() }
}

/// The largest component of what an account misses over that of its entries.
pub(super) fn miss_over<'a, const D: usize>(
    miss: SVector<f64, D>,
    entries: impl IntoIterator<Item = &'a SVector<f64, D>>,
) -> f64 {
    let sizes = entries.into_iter().map(SVector::amax);
    let largest = sizes.fold(0.0, f64::max);
    miss.amax() / if largest > 0.0 { largest } else { 1.0 }
}

/// Components of a vector along the axes of a continuum in the plane x–z (D = 2) or in space (D = 3).
pub(super) fn along_axes<const D: usize>(v: &Vector3<f64>) -> SVector<f64, D> {
    SVector::from_fn(|axis, _| v[if axis + 1 == D { 2 } else { axis }])
}

/// Components of an axial vector about the axis across the plane x–z (S = 1), or about those of space (S = 3).
pub(super) fn about_axes<const S: usize>(v: &Vector3<f64>) -> SVector<f64, S> {
    SVector::from_fn(|axis, _| v[if S == 1 { 1 } else { axis }])
}

/// A vector's components, and zeros along axes that it has not.
pub(super) fn in_three<const D: usize>(v: &SVector<f64, D>) -> [f64; 3] {
    std::array::from_fn(|axis| v.get(axis).copied().unwrap_or(0.0))
}

/// Vectors one behind the other.
pub(super) fn flat<const D: usize>(rows: &[SVector<f64, D>]) -> impl Iterator<Item = f64> {
    rows.iter().flat_map(|row| row.iter().copied())
}

/// Vectors from such numbers.
pub(super) fn vectors<const D: usize>(numbers: &[f64]) -> Vec<SVector<f64, D>> {
    let rows = numbers.as_chunks::<D>().0;
    rows.iter().map(|row| SVector::from(*row)).collect()
}

/// The two cells of a row beside a place, in cells from the middle of the first, with their hats; beyond the first and the last that there
/// are it is those.
pub(super) fn beside(place: f64, [first, last]: [usize; 2]) -> [(usize, f64); 2] {
    let low = place.floor();
    let share = place - low;
    let index = |n: f64| (low + n).clamp(first as f64, last as f64) as usize;
    [(index(0.0), 1.0 - share), (index(1.0), share)]
}

/// Velocity at a place from the full cells around it; none without any.
pub(super) fn velocity_at<const D: usize>(
    hats: &[(usize, f64)],
    is_full: impl Fn(usize) -> bool,
    velocities: &[SVector<f64, D>],
) -> Option<SVector<f64, D>> {
    let (mut sum, mut weight) = (SVector::zeros(), 0.0);
    for &(cell, hat) in hats.iter().filter(|(cell, _)| is_full(*cell)) {
        weight += hat;
        sum += hat * velocities[cell];
    }
    (weight > 0.0).then(|| sum / weight)
}

/// By how much the pressure at the middle of a full cell's filled part, f > 1/2 of it, is larger than at the middle of the cell, where the
/// solver has it: linear from there to the surface.
pub(super) fn surface_factor(fraction: f64) -> f64 {
    (fraction / (2.0 * fraction - 1.0)).min(LARGEST_FACTOR)
}

/// Contacts of the grains that belong to the material, each with the middle of its line (m), the force (N) on the grain that it begins at,
/// and the part of the line to the other centre that is material (m). What does not belong is wall: its half of the line is not.
pub(super) fn lines(
    snapshot: &Snapshot,
    belongs: impl Fn(&GrainSample) -> bool,
) -> impl Iterator<Item = [Vector3<f64>; 3]> {
    snapshot.contacts.iter().filter_map(move |contact| {
        let grain = &snapshot.grains[contact.grain];
        let other = match contact.partner {
            Partner::Grain(j) => Some(&snapshot.grains[j]).filter(|other| belongs(other)),
            Partner::Wall(_) | Partner::Body(_) => None,
        };
        let (start, force, line) = match (belongs(grain), other) {
            (true, Some(_)) => (grain, contact.force, contact.arm - contact.partner_arm),
            (true, None) => (grain, contact.force, contact.arm),
            (false, Some(other)) => (other, -contact.force, contact.partner_arm),
            (false, None) => return None,
        };
        Some([start.position + 0.5 * line, force, line])
    })
}

/// Moment of inertia of a ball (kg m²).
pub(super) fn inertia(grain: &GrainSample) -> f64 {
    0.4 * grain.mass * grain.radius * grain.radius
}

/// For how long what was laid after so many steps has acted and is not booked yet (s).
pub(super) fn acting(simulation: &Simulation, laid_at: u64) -> f64 {
    simulation.kick_time(simulation.steps_done() - laid_at)
}
