//! Forces of a block of pairs, four or eight at a time.
//!
//! First it is *found* which pairs touch: their separations, springs and grains are packed one after the
//! other, in the order of the pairs. Then the law is evaluated on full batches of contacts, and what it
//! gives is added to the sums of both grains, in the same order.

use crate::contact::{COEFFICIENTS, HISTORY_MAX, Interaction, Lever, Step, Touch, Wrench};
use crate::domain::Images;
use crate::lanes::{Eight, Lanes, Lanes4, Vec3};
use crate::rows::Rows;

/// What forces are made of.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub rows: Rows<'a>,
    pub material: &'a [u16],
    /// The grain that fills up batches.
    pub dummy: u32,
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
    let table = law.table().as_flattened();
    let n = law.materials() as u32;
    let mut rows = [0; WIDEST];
    for (row, (&i, &j)) in rows.iter_mut().zip(i.iter().zip(j)) {
        *row = u32::from(material[i as usize]) * n + u32::from(material[j as usize]);
        *row *= ROWS;
    }
    // The last row of a pair is the largest number.
    assert!(
        rows.iter()
            .all(|row| (4 * (row + ROWS)) as usize <= table.len())
    );
    let mut lanes = [L::splat(0.0); COEFFICIENTS];
    for block in lanes.chunks_exact_mut(4) {
        // SAFETY: the table has these rows.
        block.copy_from_slice(&L::transpose(unsafe {
            L::gather(table.as_ptr(), rows.as_ptr())
        }));
        for row in &mut rows {
            *row += 1;
        }
    }
    lanes
}

/// Most pairs in a batch.
pub(crate) const WIDEST: usize = 8;

/// Pairs of a block, and where it is noted which of them touch.
pub(crate) struct Pairs<'a> {
    /// Whole batches of eight; all are numbers of rows.
    pub i: &'a [u32],
    pub j: &'a [u32],
    /// Axes along which some pair is one of images.
    pub wraps: [bool; 3],
    /// For each eight pairs, which of them touch, by bits.
    pub touching: &'a mut [u8],
    /// `I::HISTORY` rows for each eight pairs; zeros where they do not touch.
    pub history: &'a mut [Eight],
}

impl Pairs<'_> {
    /// Number of pairs, if there are numbers of all of them for a law.
    fn count<I: Interaction>(&self) -> usize {
        let count = self.i.len();
        let eights = count / WIDEST;
        assert!(count.is_multiple_of(WIDEST) && self.j.len() == count);
        assert!(self.touching.len() == eights && self.history.len() == eights * I::HISTORY);
        count
    }
}

/// The touching pairs of a block, packed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Contacts {
    pub count: usize,
    /// Room for so many, a multiple of [`WIDEST`].
    room: usize,
    /// Their grains.
    pub i: Vec<u32>,
    pub j: Vec<u32>,
    /// Their places in the block, for observers.
    pub place: Vec<u32>,
    /// Where the sums of both grains are.
    pub sums: [Vec<u32>; 2],
    /// Separation (m), sum of radii (m), springs: a row of `room` numbers each.
    columns: Vec<Eight>,
}

/// Columns before those of the springs.
const APART: usize = 4;

impl Contacts {
    /// Makes room for the contacts of a block of so many pairs and so many numbers of history.
    pub fn make_room(&mut self, pairs: usize, history: usize) {
        // A last batch is written beyond the last contact.
        let room = pairs.next_multiple_of(WIDEST) + WIDEST;
        let eights = (APART + history) * room / WIDEST;
        if self.room < room || self.columns.len() < eights {
            self.room = room;
            let [own, other] = &mut self.sums;
            for indices in [&mut self.i, &mut self.j, &mut self.place, own, other] {
                indices.resize(room, 0);
            }
            self.columns.resize(eights, Eight::default());
        }
    }

    /// Whether there is room for the contacts of so many pairs, and one batch more, under a law.
    fn takes<I: Interaction>(&self, pairs: usize) -> bool {
        let [own, other] = &self.sums;
        let all = [&self.i, &self.j, &self.place, own, other];
        pairs + WIDEST <= self.room
            && all.iter().all(|indices| indices.len() >= self.room)
            && self.columns.len() * WIDEST >= (APART + I::HISTORY) * self.room
    }
}

/// Finds the pairs that touch.
///
/// # Safety
/// All numbers of grains among the pairs, and the dummy's, must be of rows of the field.
#[inline(always)]
pub(crate) unsafe fn find<L: Lanes, I: Interaction>(
    law: &I,
    like: &[L; COEFFICIENTS],
    field: &Field,
    pairs: &mut Pairs,
    places: bool,
    contacts: &mut Contacts,
) {
    let zero = L::splat(0.0);
    // Differences of the vectors, sums of the fourth numbers.
    let minus = L::repeat(&[-1.0, -1.0, -1.0, 1.0]);
    let wraps = pairs.wraps;
    let all_lanes = ((1_u16 << L::WIDTH) - 1) as u8;
    let total = pairs.count::<I>();
    assert!(contacts.takes::<I>(total));
    let room = contacts.room;
    let (all_i, all_j) = (pairs.i.as_ptr(), pairs.j.as_ptr());
    let (touching, history) = (
        pairs.touching.as_mut_ptr(),
        pairs.history.as_mut_ptr().cast::<f64>(),
    );
    let columns = contacts.columns.as_mut_ptr().cast::<f64>();
    let (found_i, found_j) = (contacts.i.as_mut_ptr(), contacts.j.as_mut_ptr());
    let mut count = 0;
    for place in (0..total).step_by(L::WIDTH) {
        // Where eight pairs lie, and the first of these among them.
        let (eight, first) = (
            place / WIDEST,
            if L::WIDTH == WIDEST {
                0
            } else {
                place % WIDEST
            },
        );
        // SAFETY: pairs are whole batches, and each batch of eight has its numbers of history and its bits; no
        // more contacts have been packed than pairs have passed, and there is room for those and one batch
        // more (both asserted above). What is gathered is the caller's promise.
        unsafe {
            let (i, j) = (all_i.add(place), all_j.add(place));
            let [dx, dy, dz, reach] = combine(field.rows.place(), i, j, minus);
            let mut d = [dx, dy, dz];
            nearest_image(&field.images, wraps, &mut d);
            let r2 = Vec3(d).dot(Vec3(d));
            let far = if I::HOLDS {
                reach + L::splat(field.hold)
            } else {
                reach
            };
            let mut near = r2.less(far * far);
            let springs = history.add(eight * I::HISTORY * WIDEST + first);
            // Only pairs across a gap have to be asked whether they hold.
            if I::HOLDS && L::lanes(near) != L::lanes(r2.less(reach * reach)) {
                let memory = L::read(springs.add((I::HISTORY - 1) * WIDEST));
                let mixed;
                let coefficients = if law.materials() > 1 {
                    let (i, j) = (&pairs.i[place..][..L::WIDTH], &pairs.j[place..][..L::WIDTH]);
                    mixed = mixed_coefficients::<L, I>(law, field.material, i, j);
                    &mixed
                } else {
                    like
                };
                let far = reach + law.hold(coefficients, memory);
                near = r2.less(far * far);
            }
            let bits = L::lanes(near);
            let touched = &mut *touching.add(eight);
            let before = *touched >> first & all_lanes;
            *touched ^= (before ^ bits) << first;
            if bits == 0 {
                if before != 0 {
                    for k in 0..I::HISTORY {
                        zero.write(springs.add(k * WIDEST));
                    }
                }
                continue;
            }
            let packed = columns.add(count);
            for k in 0..I::HISTORY {
                let spring = L::read(springs.add(k * WIDEST));
                spring.pack(bits, packed.add((APART + k) * room));
            }
            for (k, apart) in d.iter().enumerate() {
                apart.pack(bits, packed.add(k * room));
            }
            reach.pack(bits, packed.add(3 * room));
            L::pack_indices(i, bits, found_i.add(count));
            L::pack_indices(j, bits, found_j.add(count));
            if places {
                let own: [u32; WIDEST] = std::array::from_fn(|k| (place + k) as u32);
                L::pack_indices(own.as_ptr(), bits, contacts.place.as_mut_ptr().add(count));
            }
            count += bits.count_ones() as usize;
        }
    }
    contacts.count = count;
    // The last batch is filled up with the dummy, a unit away from itself.
    for k in 0..APART + I::HISTORY {
        // It remembers something, or the law would have to find out what.
        let remembers = I::HOLDS && k == APART + I::HISTORY - 1;
        let number = if k == 0 || remembers { 1.0 } else { 0.0 };
        // SAFETY: there is room for a batch behind the last contact.
        unsafe { L::splat(number).write(columns.add(k * room + count)) };
    }
    contacts.i[count..count + WIDEST].fill(field.dummy);
    contacts.j[count..count + WIDEST].fill(field.dummy);
}

/// Brings the springs of the contacts back to their pairs; the others' are zero.
#[inline(always)]
pub(crate) fn put_back<L: Lanes, I: Interaction>(pairs: &mut Pairs, contacts: &Contacts) {
    let total = pairs.count::<I>();
    assert!(contacts.takes::<I>(total));
    let room = contacts.room;
    let columns = contacts.columns.as_ptr().cast::<f64>();
    let history = pairs.history.as_mut_ptr().cast::<f64>();
    let all_lanes = ((1_u16 << L::WIDTH) - 1) as u8;
    let mut count = 0;
    for place in (0..total).step_by(L::WIDTH) {
        let (eight, first) = (
            place / WIDEST,
            if L::WIDTH == WIDEST {
                0
            } else {
                place % WIDEST
            },
        );
        let bits = pairs.touching[eight] >> first & all_lanes;
        if bits == 0 {
            continue;
        }
        for k in 0..I::HISTORY {
            // SAFETY: as in `find`, where as many contacts were packed.
            unsafe {
                let spring = L::unpack(columns.add((APART + k) * room + count), bits);
                spring.write(history.add((eight * I::HISTORY + k) * WIDEST + first));
            }
        }
        count += bits.count_ones() as usize;
    }
}

/// Where forces go.
pub(crate) enum Into<'a> {
    /// To the sums of both grains: [`sum_eights`] for each.
    Sums(&'a mut [Eight]),
    /// To the slots of the pairs.
    Slots(&'a mut [[f64; 4]]),
}

/// Eights of numbers that a sum of so many rows of four takes.
pub(crate) const fn sum_eights(rows: usize) -> usize {
    rows.div_ceil(2)
}

/// Evaluates the law on all contacts.
///
/// # Safety
/// The contacts must be what [`find`] has left in the same field; there must be sums where
/// [`Contacts::sums`] says, counted in numbers.
#[inline(always)]
pub(crate) unsafe fn press<L: Lanes, I: Interaction, const ROWS: usize>(
    law: &I,
    like: &[L; COEFFICIENTS],
    field: &Field,
    contacts: &mut Contacts,
    mut into: Into,
    deepest: &mut L,
) {
    let zero = L::splat(0.0);
    let one = L::splat(1.0);
    let minus = L::repeat(&[-1.0, -1.0, -1.0, 1.0]);
    let (room, count) = (contacts.room, contacts.count);
    assert!(contacts.takes::<I>(count));
    let columns = contacts.columns.as_mut_ptr().cast::<f64>();
    for at in (0..count).step_by(L::WIDTH) {
        // SAFETY: there is room for the contacts and a batch more (asserted above); what is gathered and where
        // sums are is the caller's promise.
        unsafe {
            let (i, j) = (contacts.i.as_ptr().add(at), contacts.j.as_ptr().add(at));
            let packed = columns.add(at);
            let [mut vx, mut vy, mut vz, inverse_mass] = combine(field.rows.motion(), i, j, minus);
            let [sx, sy, sz, curvature] = combine(field.rows.turn(), i, j, one);
            let d = Vec3([
                L::read(packed),
                L::read(packed.add(room)),
                L::read(packed.add(2 * room)),
            ]);
            let reach = L::read(packed.add(3 * room));
            if field.images.moves {
                let [x, y, z, _] = combine(field.rows.place(), i, j, minus);
                let [wx, wy, wz] = image_velocity(&field.images, &[x, y, z]);
                (vx, vy, vz) = (vx - wx, vy - wy, vz - wz);
            }
            // What a scene does not have costs nothing: one material reads no table.
            let mixed;
            let coefficients = if law.materials() > 1 {
                let (i, j) = (&contacts.i[at..][..L::WIDTH], &contacts.j[at..][..L::WIDTH]);
                mixed = mixed_coefficients::<L, I>(law, field.material, i, j);
                &mixed
            } else {
                like
            };
            let mut springs = [zero; HISTORY_MAX];
            for (k, spring) in springs[..I::HISTORY].iter_mut().enumerate() {
                *spring = L::read(packed.add((APART + k) * room));
            }
            let distance = d.dot(d).sqrt();
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
                spin_difference(field.rows.turn(), i, j)
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
                spring.write(packed.add((APART + k) * room));
            }
            let torque = tangential.cross(normal).scale(lever);
            // The dummy's depth is not above zero: it has no curvature.
            *deepest = deepest.max(overlap * curvature * L::splat(0.5));
            let parts = [force, torque, moment];
            let mut rows = [[zero; 4]; ROWS];
            for (rows, Vec3([x, y, z])) in rows.iter_mut().zip(parts) {
                *rows = L::transpose([x, y, z, zero]);
            }
            let those = (count - at).min(L::WIDTH);
            match &mut into {
                Into::Sums(sums) => {
                    let sums = sums.as_mut_ptr().cast::<f64>();
                    let [own, other] = [0, 1].map(|side| contacts.sums[side].as_ptr().add(at));
                    for p in 0..L::WIDTH {
                        if p == those {
                            break;
                        }
                        let [own, other] = [own, other].map(|s| sums.add(*s.add(p) as usize));
                        L::add_pair(&rows, p, own, other);
                    }
                }
                Into::Slots(slots) => {
                    let slots = slots.as_chunks_mut::<ROWS>().0;
                    for (p, place) in contacts.place[at..][..those].iter().enumerate() {
                        for (k, rows) in rows.iter().enumerate() {
                            L::pair(rows, p).store(&mut slots[*place as usize][k]);
                        }
                    }
                }
            }
        }
    }
}

/// Takes separations to those of the nearest images, along the axes where there may be others.
#[inline(always)]
pub(crate) fn nearest_image<L: Lanes>(images: &Images, wraps: [bool; 3], d: &mut [L; 3]) {
    if images.moves {
        d[0] = d[0] - L::splat(images.drift.offset) * turns_across(images, d);
    }
    for (k, d) in d.iter_mut().enumerate() {
        if wraps[k] {
            let turns = (*d * L::splat(images.inverse[k])).round();
            *d = *d - L::splat(images.lengths[k]) * turns;
        }
    }
}

// No closures in here: they would be compiled without AVX2, and every operation in them would
// become a call (measured: three times slower).

/// Rows of `i` plus `sign` times rows of `j`, as columns.
///
/// # Safety
/// There must be as many numbers as lanes, and rows with all of them.
#[inline(always)]
pub(crate) unsafe fn combine<L: Lanes>(
    of: *const f64,
    i: *const u32,
    j: *const u32,
    sign: L,
) -> [L; 4] {
    // SAFETY: the caller's promise.
    let (mut rows, others) = unsafe { (L::gather(of, i), L::gather(of, j)) };
    for (row, other) in rows.iter_mut().zip(others) {
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
///
/// # Safety
/// As for [`combine`].
#[inline(always)]
unsafe fn spin_difference<L: Lanes>(turn: *const f64, i: *const u32, j: *const u32) -> Vec3<L> {
    // SAFETY: the caller's promise.
    let (mut rows, others) = unsafe { (L::gather(turn, i), L::gather(turn, j)) };
    for (row, other) in rows.iter_mut().zip(others) {
        *row = *row * row.splat_last() - other * other.splat_last();
    }
    let [x, y, z, _] = L::transpose(rows);
    Vec3([x, y, z])
}

/// `1/(m_i R_i²) + 1/(m_j R_j²)`.
///
/// # Safety
/// As for [`combine`].
#[inline(always)]
unsafe fn inverse_inertia_sum<L: Lanes>(field: &Field, i: *const u32, j: *const u32) -> L {
    // SAFETY: the caller's promise.
    let (mut rows, others) =
        unsafe { (inverse_inertias::<L>(field, i), inverse_inertias(field, j)) };
    for (row, other) in rows.iter_mut().zip(others) {
        *row = *row + other;
    }
    let [_, _, _, sum] = L::transpose(rows);
    sum
}

/// Rows whose last number is 1/(m R²).
///
/// # Safety
/// As for [`combine`].
#[inline(always)]
unsafe fn inverse_inertias<L: Lanes>(field: &Field, at: *const u32) -> [L; 4] {
    // SAFETY: the caller's promise.
    let (mut rows, turns) = unsafe {
        (
            L::gather(field.rows.motion(), at),
            L::gather(field.rows.turn(), at),
        )
    };
    for (row, turn) in rows.iter_mut().zip(turns) {
        *row = *row * turn * turn;
    }
    rows
}
