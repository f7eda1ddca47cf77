//! Forces of four pairs at a time.
//!
//! Reads positions and velocities, writes each pair's slot and history, touches nothing else.

use crate::contact::{COEFFICIENTS, HISTORY_MAX, Interaction, Lever, Step, Touch, Wrench};
use crate::domain::Images;
use crate::lanes::{Lanes4, Vec3};

/// What forces are made of.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub place: &'a [[f64; 4]],
    pub motion: &'a [[f64; 4]],
    pub turn: &'a [[f64; 4]],
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
pub(crate) fn like_coefficients<L: Lanes4, I: Interaction>(law: &I) -> [L; COEFFICIENTS] {
    let mut lanes = [L::splat(0.0); COEFFICIENTS];
    for (lane, &number) in lanes.iter_mut().zip(&law.table()[0]) {
        *lane = L::splat(number);
    }
    lanes
}

/// Coefficients of four pairs.
#[inline(always)]
fn mixed_coefficients<L: Lanes4, I: Interaction>(
    law: &I,
    material: &[u16],
    i: &[u32],
    j: &[u32],
) -> [L; COEFFICIENTS] {
    let (table, n) = (law.table(), law.materials());
    let mut lanes = [L::splat(0.0); COEFFICIENTS];
    let mut pair = [0; 4];
    for (pair, (&i, &j)) in pair.iter_mut().zip(i.iter().zip(j)) {
        *pair = usize::from(material[i as usize]) * n + usize::from(material[j as usize]);
    }
    for block in 0..COEFFICIENTS / 4 {
        let mut rows = [L::splat(0.0); 4];
        for (row, &pair) in rows.iter_mut().zip(&pair) {
            let numbers = &table[pair].as_chunks::<4>().0[block];
            *row = L::load(numbers);
        }
        let columns = L::transpose(rows);
        lanes[4 * block..4 * block + 4].copy_from_slice(&columns);
    }
    lanes
}

/// Evaluates the law on four pairs.
#[allow(clippy::too_many_arguments)]
#[inline(always)]
pub(crate) fn batch<L: Lanes4, I: Interaction>(
    law: &I,
    like: &[L; COEFFICIENTS],
    field: &Field,
    i: &[u32],
    j: &[u32],
    history: &mut [[f64; 4]],
    slots: &mut [[f64; 4]],
    deepest: &mut L,
) {
    let zero = L::splat(0.0);
    let one = L::splat(1.0);
    // Differences of the vectors, sums of the fourth numbers.
    let minus = L::load(&[-1.0, -1.0, -1.0, 1.0]);
    let [dx, dy, dz, reach] = combine(field.place, i, j, minus);
    let mut d = [dx, dy, dz];
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
    if !L::any(touching) {
        // Lists are short-lived: writing zeros costs less than remembering which are zero.
        history.fill([0.0; 4]);
        slots.fill([0.0; 4]);
        return;
    }
    let [vx, vy, vz, inverse_mass] = combine(field.motion, i, j, minus);
    let [sx, sy, sz, curvature] = combine(field.turn, i, j, one);
    // What a scene does not have costs nothing: one material reads no table.
    let mixed;
    let coefficients = if law.materials() > 1 {
        mixed = mixed_coefficients::<L, I>(law, field.material, i, j);
        &mixed
    } else {
        like
    };
    let mut springs = [zero; HISTORY_MAX];
    for (spring, row) in springs.iter_mut().zip(history.iter()) {
        *spring = L::load(row);
    }
    if I::HOLDS {
        // The last number of history is 1 on an established contact, which holds across a gap.
        let held = law.hold(coefficients, curvature) * springs[I::HISTORY - 1];
        let far = reach + L::select(zero.less(held), held, zero);
        touching = r2.less(far * far);
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
        let [x, y, z, _] = L::transpose([
            spin_difference(field.turn, i[0], j[0]),
            spin_difference(field.turn, i[1], j[1]),
            spin_difference(field.turn, i[2], j[2]),
            spin_difference(field.turn, i[3], j[3]),
        ]);
        Vec3([x, y, z])
    } else {
        Vec3::zero()
    };
    let inverse_inertia = if I::INERTIA {
        L::load(&[
            inverse_inertia_sum(field, i[0], j[0]),
            inverse_inertia_sum(field, i[1], j[1]),
            inverse_inertia_sum(field, i[2], j[2]),
            inverse_inertia_sum(field, i[3], j[3]),
        ])
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
    for (spring, row) in springs.iter().zip(history.iter_mut()) {
        L::select(touching, *spring, zero).store(row);
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

/// `1/(m_i R_i²) + 1/(m_j R_j²)`.
#[inline(always)]
fn inverse_inertia_sum(field: &Field, i: u32, j: u32) -> f64 {
    let (i, j) = (i as usize, j as usize);
    let (a, b) = (field.turn[i][3], field.turn[j][3]);
    field.motion[i][3] * a * a + field.motion[j][3] * b * b
}

// No closures in here: they would be compiled without AVX2, and every operation in them would
// become a call (measured: three times slower).

/// Rows of `i` plus `sign` times rows of `j`, as lanes.
#[inline(always)]
fn combine<L: Lanes4>(of: &[[f64; 4]], i: &[u32], j: &[u32], sign: L) -> [L; 4] {
    L::transpose([
        L::load(&of[i[0] as usize]) + L::load(&of[j[0] as usize]) * sign,
        L::load(&of[i[1] as usize]) + L::load(&of[j[1] as usize]) * sign,
        L::load(&of[i[2] as usize]) + L::load(&of[j[2] as usize]) * sign,
        L::load(&of[i[3] as usize]) + L::load(&of[j[3] as usize]) * sign,
    ])
}

/// ω_i - ω_j as a row.
#[inline(always)]
fn spin_difference<L: Lanes4>(turn: &[[f64; 4]], i: u32, j: u32) -> L {
    let (a, b) = (L::load(&turn[i as usize]), L::load(&turn[j as usize]));
    a * a.splat_last() - b * b.splat_last()
}

/// Writes a vector of four contacts as row `row` of their slots.
#[inline(always)]
fn store_vectors<L: Lanes4>(
    mask: L::Mask,
    v: Vec3<L>,
    slots: &mut [[f64; 4]],
    row: usize,
    rows: usize,
) {
    let zero = L::splat(0.0);
    let v = Vec3::select(mask, v, Vec3::zero());
    let out = L::transpose([v.0[0], v.0[1], v.0[2], zero]);
    for (k, contact) in out.into_iter().enumerate() {
        contact.store(&mut slots[k * rows + row]);
    }
}
