//! Forces of four or eight pairs at a time.
//!
//! Reads positions and velocities, writes each pair's slot and history, touches nothing else.

use crate::contact::{COEFFICIENTS, HISTORY_MAX, Interaction, Lever, Step, Touch, Wrench};
use crate::domain::Images;
use crate::lanes::{Lanes, Row, Vec3};
use crate::rows::Rows;

/// What forces are made of.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub rows: Rows<'a>,
    pub material: &'a [u16],
    pub images: Images,
    pub lever: Lever,
    /// Largest gap that any established contact holds across (m).
    pub hold: f64,
    pub step: Step,
}

/// Rows of a slot under a law.
pub(crate) const fn slot_rows<I: Interaction>() -> usize {
    if I::ROLLING { 3 } else { 2 }
}

/// Coefficients of the first material, in all lanes.
#[inline(always)]
pub(crate) fn like_coefficients<L: Lanes, I: Interaction>(law: &I) -> [L; COEFFICIENTS] {
    let mut lanes = [L::splat(0.0); COEFFICIENTS];
    for (lane, &number) in lanes.iter_mut().zip(&law.table()[0]) {
        *lane = L::splat(number);
    }
    lanes
}

/// Coefficients of several pairs.
#[inline(always)]
fn mixed_coefficients<L: Lanes, I: Interaction>(
    law: &I,
    material: &[u16],
    i: &[u32],
    j: &[u32],
) -> [L; COEFFICIENTS] {
    const ROWS: u32 = (COEFFICIENTS / 4) as u32;
    let table = law.table().as_flattened().as_chunks::<4>().0;
    let n = law.materials() as u32;
    let mut rows = [0; WIDEST];
    for (row, (&i, &j)) in rows.iter_mut().zip(i.iter().zip(j)) {
        *row = u32::from(material[i as usize]) * n + u32::from(material[j as usize]);
        *row *= ROWS;
    }
    let mut lanes = [L::splat(0.0); COEFFICIENTS];
    for block in lanes.chunks_exact_mut(4) {
        block.copy_from_slice(&L::transpose(L::gather(table, &rows)));
        for row in &mut rows {
            *row += 1;
        }
    }
    lanes
}

/// Most pairs in a batch.
pub(crate) const WIDEST: usize = 8;

/// Pairs evaluated together, and what they leave.
pub(crate) struct Batch<'a> {
    pub i: &'a [u32],
    pub j: &'a [u32],
    /// Which of them touch, by bits, four at a time.
    pub lanes: &'a mut [u8],
    pub history: &'a mut [[f64; 4]],
    /// Of use only where a pair touches.
    pub slots: &'a mut [[f64; 4]],
}

/// Evaluates the law on a batch.
#[inline(always)]
pub(crate) fn batch<L: Lanes, I: Interaction>(
    law: &I,
    like: &[L; COEFFICIENTS],
    field: &Field,
    batch: Batch,
    deepest: &mut L,
) {
    let Batch {
        i,
        j,
        lanes,
        history,
        slots,
    } = batch;
    let zero = L::splat(0.0);
    let one = L::splat(1.0);
    // Differences of the vectors, sums of the fourth numbers.
    let minus = L::repeat(&[-1.0, -1.0, -1.0, 1.0]);
    let [dx, dy, dz, reach] = combine(field.rows.place, i, j, minus);
    let apart = [dx, dy, dz];
    let mut d = apart;
    if field.images.moves {
        d[0] = d[0] - L::splat(field.images.drift.offset) * turns_across(&field.images, &apart);
    }
    for (k, d) in d.iter_mut().enumerate() {
        let turns = (*d * L::splat(field.images.inverse[k])).round();
        *d = *d - L::splat(field.images.lengths[k]) * turns;
    }
    let d = Vec3(d);
    let r2 = d.dot(d);
    let far = if I::HOLDS {
        reach + L::splat(field.hold)
    } else {
        reach
    };
    let mut touching = r2.less(far * far);
    if L::lanes(touching) == 0 {
        if lanes.iter().any(|&touched| touched != 0) {
            history.fill([0.0; 4]);
            lanes.fill(0);
        }
        return;
    }
    let [mut vx, mut vy, mut vz, inverse_mass] = combine(field.rows.motion, i, j, minus);
    if field.images.moves {
        let [wx, wy, wz] = image_velocity(&field.images, &apart);
        (vx, vy, vz) = (vx - wx, vy - wy, vz - wz);
    }
    let [sx, sy, sz, curvature] = combine(field.rows.turn, i, j, one);
    // What a scene does not have costs nothing: one material reads no table.
    let mixed;
    let coefficients = if law.materials() > 1 {
        mixed = mixed_coefficients::<L, I>(law, field.material, i, j);
        &mixed
    } else {
        like
    };
    let mut springs = [zero; HISTORY_MAX];
    for (k, spring) in springs[..I::HISTORY].iter_mut().enumerate() {
        *spring = L::read(history, k, I::HISTORY);
    }
    if I::HOLDS {
        // The last number of history is 1 on an established contact, which holds across a gap.
        let held = law.hold(coefficients, curvature) * springs[I::HISTORY - 1];
        let far = reach + L::select(zero.less(held), held, zero);
        touching = r2.less(far * far);
    }
    let bits = L::lanes(touching);
    for (four, lanes) in lanes.iter_mut().enumerate() {
        *lanes = bits >> (4 * four) & 0b1111;
    }
    let distance = r2.sqrt();
    let normal = d.scale(one / distance);
    let overlap = reach - distance;
    let lever = match field.lever {
        Lever::ContactPoint => distance / reach,
        Lever::Radius => one,
    };
    // Surfaces move by the centres' velocities and by both spins: R_i ω_i + R_j ω_j.
    let spins = Vec3([sx, sy, sz]).scale(lever);
    let velocity = Vec3([vx, vy, vz]) - spins.cross(normal);
    let spin = if I::ROLLING {
        spin_difference(field.rows.turn, i, j)
    } else {
        Vec3::zero()
    };
    let inverse_inertia = if I::INERTIA {
        inverse_inertia_sum(field, i, j)
    } else {
        zero
    };
    let touch = Touch {
        normal,
        overlap,
        velocity,
        spin,
        inverse_mass,
        curvature,
        inverse_inertia,
    };
    let Wrench {
        force,
        tangential,
        moment,
    } = law.wrench(coefficients, &touch, &mut springs, field.step);
    for (k, spring) in springs[..I::HISTORY].iter().enumerate() {
        L::select(touching, *spring, zero).write(history, k, I::HISTORY);
    }
    let torque = tangential.cross(normal).scale(lever);
    store_vectors(touching, force, slots, 0, slot_rows::<I>());
    store_vectors(touching, torque, slots, 1, slot_rows::<I>());
    if I::ROLLING {
        store_vectors(touching, moment, slots, 2, slot_rows::<I>());
    }
    let depth = L::select(touching, overlap * curvature * L::splat(0.5), zero);
    *deepest = deepest.max(depth);
}

// No closures in here: they would be compiled without AVX2, and every operation in them would
// become a call (measured: three times slower).

/// Rows of `i` plus `sign` times rows of `j`, as columns.
#[inline(always)]
fn combine<L: Lanes>(of: &[impl Row], i: &[u32], j: &[u32], sign: L) -> [L; 4] {
    let mut rows = L::gather(of, i);
    for (row, other) in rows.iter_mut().zip(L::gather(of, j)) {
        *row = *row + other * sign;
    }
    L::transpose(rows)
}

/// Boxes between two centres along the axis whose images are shifted along x.
#[inline(always)]
fn turns_across<L: Lanes>(images: &Images, apart: &[L; 3]) -> L {
    if images.drift.gradient == 1 {
        (apart[1] * L::splat(images.inverse[1])).round()
    } else {
        (apart[2] * L::splat(images.inverse[2])).round()
    }
}

/// Velocity of the nearest image against the grain itself, where images move.
#[inline(always)]
fn image_velocity<L: Lanes>(images: &Images, apart: &[L; 3]) -> [L; 3] {
    let across = turns_across(images, apart);
    let mut apart = *apart;
    apart[0] = apart[0] - L::splat(images.drift.offset) * across;
    let mut velocity = [L::splat(0.0); 3];
    for (k, velocity) in velocity.iter_mut().enumerate() {
        let turns = (apart[k] * L::splat(images.inverse[k])).round();
        *velocity = L::splat(images.drift.speeds[k]) * turns;
    }
    velocity[0] = velocity[0] + L::splat(images.drift.slip) * across;
    velocity
}

/// ω_i - ω_j.
#[inline(always)]
fn spin_difference<L: Lanes>(turn: &[impl Row], i: &[u32], j: &[u32]) -> Vec3<L> {
    let mut rows = L::gather(turn, i);
    for (row, other) in rows.iter_mut().zip(L::gather(turn, j)) {
        *row = *row * row.splat_last() - other * other.splat_last();
    }
    let [x, y, z, _] = L::transpose(rows);
    Vec3([x, y, z])
}

/// `1/(m_i R_i²) + 1/(m_j R_j²)`.
#[inline(always)]
fn inverse_inertia_sum<L: Lanes>(field: &Field, i: &[u32], j: &[u32]) -> L {
    let mut rows = inverse_inertias::<L>(field, i);
    for (row, other) in rows.iter_mut().zip(inverse_inertias::<L>(field, j)) {
        *row = *row + other;
    }
    let [_, _, _, sum] = L::transpose(rows);
    sum
}

/// Rows whose last number is 1/(m R²).
#[inline(always)]
fn inverse_inertias<L: Lanes>(field: &Field, at: &[u32]) -> [L; 4] {
    let mut rows = L::gather(field.rows.motion, at);
    for (row, turn) in rows.iter_mut().zip(L::gather(field.rows.turn, at)) {
        *row = *row * turn * turn;
    }
    rows
}

/// Writes a vector as row `row` of the slots of touching pairs.
#[inline(always)]
fn store_vectors<L: Lanes>(
    mask: L::Mask,
    v: Vec3<L>,
    slots: &mut [[f64; 4]],
    row: usize,
    rows: usize,
) {
    let zero = L::splat(0.0);
    let v = Vec3::select(mask, v, Vec3::zero());
    let out = L::transpose([v.0[0], v.0[1], v.0[2], zero]);
    L::scatter(out, slots, row, rows);
}
