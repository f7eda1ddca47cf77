//! The force pass: all pairs within reach, four at a time.
//!
//! Reads positions and velocities, writes each pair's slot and history, touches nothing else: any
//! split over threads gives the same bits.

use crate::contact::{HISTORY_ROLLING, Interaction, Lever, Step, Touch, Wrench};
use crate::domain::Images;
use crate::grains::Grains;
use crate::lanes::{Lanes4, Portable, Vec3, has_avx2};
use crate::reach::Reach;

/// What the pass reads.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub place: &'a [[f64; 4]],
    pub motion: &'a [[f64; 4]],
    pub turn: &'a [[f64; 4]],
    pub images: Images,
    pub lever: Lever,
    pub step: Step,
}

/// Rows of a slot under a law.
pub(crate) const fn slot_rows<I: Interaction>() -> usize {
    if I::ROLLING { 3 } else { 2 }
}

/// Batches that one task works on at least.
const BATCHES_A_TASK: usize = 256;

/// Evaluates the law on all pairs within reach; the largest overlap over the harmonic mean radius.
pub(crate) fn evaluate<I: Interaction>(
    law: &I,
    grains: &Grains,
    field: &Field,
    reach: &mut Reach,
    parallel: bool,
) -> f64 {
    debug_assert_eq!(field.place.len(), grains.len() + 1);
    let task = Task {
        i: &reach.i,
        j: &reach.j,
        history: &mut reach.history,
        slots: &mut reach.slots,
    };
    task.run(law, field, parallel, has_avx2())
}

struct Task<'a> {
    i: &'a [u32],
    j: &'a [u32],
    history: &'a mut [[f64; 4]],
    slots: &'a mut [[f64; 4]],
}

impl Task<'_> {
    fn run<I: Interaction>(self, law: &I, field: &Field, parallel: bool, wide: bool) -> f64 {
        let batches = self.i.len() / 4;
        if parallel && batches >= 2 * BATCHES_A_TASK {
            let half = batches / 2;
            let (i0, i1) = self.i.split_at(4 * half);
            let (j0, j1) = self.j.split_at(4 * half);
            let (h0, h1) = self.history.split_at_mut(I::HISTORY * half);
            let (s0, s1) = self.slots.split_at_mut(slot_rows::<I>() * 4 * half);
            let left = Task {
                i: i0,
                j: j0,
                history: h0,
                slots: s0,
            };
            let right = Task {
                i: i1,
                j: j1,
                history: h1,
                slots: s1,
            };
            let (a, b) = rayon::join(
                || left.run(law, field, parallel, wide),
                || right.run(law, field, parallel, wide),
            );
            return a.max(b);
        }
        #[cfg(target_arch = "x86_64")]
        if wide {
            // SAFETY: `wide` is only set when the processor has AVX2.
            return unsafe { batches_avx2(law, field, self) };
        }
        let _ = wide;
        batches_in::<Portable, I>(law, field, self)
    }
}

/// The pass compiled for AVX2.
///
/// # Safety
/// The processor must have AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn batches_avx2<I: Interaction>(law: &I, field: &Field, task: Task) -> f64 {
    batches_in::<crate::lanes::avx2::Avx2, I>(law, field, task)
}

#[inline(always)]
fn batches_in<L: Lanes4, I: Interaction>(law: &I, field: &Field, task: Task) -> f64 {
    let rows = slot_rows::<I>();
    let mut deepest = L::splat(0.0);
    let batches = task
        .i
        .chunks_exact(4)
        .zip(task.j.chunks_exact(4))
        .zip(task.history.chunks_exact_mut(I::HISTORY))
        .zip(task.slots.chunks_exact_mut(4 * rows));
    for (((i, j), history), slots) in batches {
        batch::<L, I>(law, field, i, j, history, slots, &mut deepest);
    }
    let mut out = [0.0; 4];
    deepest.store(&mut out);
    out.iter().fold(0.0, |a: f64, &b| a.max(b))
}

#[inline(always)]
fn batch<L: Lanes4, I: Interaction>(
    law: &I,
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
    let touching = r2.less(reach * reach);
    if !L::any(touching) {
        // Lists are short-lived: writing zeros costs less than remembering which are zero.
        history.fill([0.0; 4]);
        slots.fill([0.0; 4]);
        return;
    }
    let [vx, vy, vz, inverse_mass] = combine(field.motion, i, j, minus);
    let [sx, sy, sz, curvature] = combine(field.turn, i, j, one);
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
    let touch = Touch {
        normal,
        overlap,
        velocity,
        spin,
        inverse_mass,
        curvature,
    };
    let mut springs = [zero; HISTORY_ROLLING];
    for (spring, row) in springs.iter_mut().zip(history.iter()) {
        *spring = L::load(row);
    }
    let Wrench {
        force,
        tangential,
        moment,
    } = law.wrench(&touch, &mut springs, field.step);
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
