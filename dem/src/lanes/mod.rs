//! Numbers that are one contact wide, or four or eight contacts wide.
//!
//! Contact laws are written once, for any [`Lane`]: with `f64` they serve walls and tests, with
//! [`Lanes`] of four or eight they serve batches of pairs. All implementations use the same correctly
//! rounded operations in the same order (no fused multiply-add), so that every width gives the same bits.

#[cfg(target_arch = "x86_64")]
pub mod avx2;
#[cfg(target_arch = "x86_64")]
pub mod avx512;
mod portable;

pub use portable::Portable;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Arithmetic on one or several contacts at a time.
pub trait Lane:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Outcome of a comparison, lane by lane.
    type Mask: Copy;
    /// The same value in every lane.
    fn splat(value: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Cube root.
    fn cbrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Smaller of the two; `other` where either is not a number.
    fn min(self, other: Self) -> Self;
    /// Larger of the two; `other` where either is not a number.
    fn max(self, other: Self) -> Self;
    /// Nearest integer, ties to even.
    fn round(self) -> Self;
    /// `self < other`.
    fn less(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is set, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Whether the mask is set in every lane.
    fn all(mask: Self::Mask) -> bool;
}

/// A row of four numbers.
pub trait Lanes4: Lane {
    /// Reads a row.
    fn load(row: &[f64; 4]) -> Self;
    /// Writes a row.
    fn store(self, row: &mut [f64; 4]);
    /// The last number of the row in every lane.
    fn splat_last(self) -> Self;
    /// The first three numbers added, from the first.
    fn sum_of_three(self) -> f64;
}

/// As many pairs as there are lanes, four or eight; or a row of four numbers of each of a quarter of
/// them: row `r` of `[Self; 4]` holds those of pair `r`, and of pair `r + 4` if there are eight.
pub trait Lanes: Lane {
    /// Number of pairs.
    const WIDTH: usize;
    /// Rows one at a time, on the same processor.
    type Row: Lanes4 + Lanes;
    /// The rows with these numbers, out of rows of four.
    ///
    /// # Safety
    /// There must be as many numbers as lanes, and rows with all of them.
    unsafe fn gather(rows: *const f64, at: *const u32) -> [Self; 4];
    /// The same four numbers for every pair.
    fn repeat(row: &[f64; 4]) -> Self;
    /// Rows of pairs to columns, and back.
    fn transpose(rows: [Self; 4]) -> [Self; 4];
    /// The last of each pair's four numbers in all four places.
    fn splat_last(self) -> Self;
    /// Reads as many numbers as there are lanes.
    ///
    /// # Safety
    /// They must be there.
    unsafe fn read(numbers: *const f64) -> Self;
    /// Writes them.
    ///
    /// # Safety
    /// There must be room for them.
    unsafe fn write(self, numbers: *mut f64);
    /// Writes the lanes of the set bits, one after the other; what follows them, as far as one number a
    /// lane would reach, is of no use.
    ///
    /// # Safety
    /// There must be room for as many numbers as lanes.
    unsafe fn pack(self, bits: u8, numbers: *mut f64);
    /// Undoes it: the lanes of the set bits take one number after the other, the rest are zero.
    ///
    /// # Safety
    /// There must be as many numbers as lanes.
    unsafe fn unpack(numbers: *const f64, bits: u8) -> Self;
    /// Packs as many indices as there are lanes.
    ///
    /// # Safety
    /// There must be as many of them, and room for as many.
    unsafe fn pack_indices(indices: *const u32, bits: u8, packed: *mut u32);
    /// Adds the rows of pair `p` to those of one grain, and to those of another with the signs of all but the
    /// second row changed.
    ///
    /// # Safety
    /// Both must be as many rows of four as `rows`.
    #[inline(always)]
    unsafe fn add_pair<const ROWS: usize>(
        rows: &[[Self; 4]; ROWS],
        p: usize,
        own: *mut f64,
        other: *mut f64,
    ) {
        for (k, rows) in rows.iter().enumerate() {
            let row = Self::pair(rows, p);
            // SAFETY: the caller's promise.
            unsafe {
                let own = own.add(4 * k);
                (Self::Row::read(own) + row).write(own);
            }
        }
        for (k, rows) in rows.iter().enumerate() {
            let row = Self::pair(rows, p);
            // SAFETY: the caller's promise.
            unsafe {
                let other = other.add(4 * k);
                let before = Self::Row::read(other);
                let after = if k == 1 { before + row } else { before - row };
                after.write(other);
            }
        }
    }
    /// The row of pair `p` out of such rows.
    fn pair(rows: &[Self; 4], p: usize) -> Self::Row;
    /// Which lanes of a mask are set, the first by the lowest bit.
    fn lanes(mask: Self::Mask) -> u8;
    /// The largest number.
    fn largest(self) -> f64;
}

/// Packs four indices.
///
/// # Safety
/// There must be four of them, and room for four.
#[inline(always)]
unsafe fn pack_four(indices: *const u32, bits: u8, packed: *mut u32) {
    let (mut four, mut count) = ([0; 4], 0);
    for k in 0..4 {
        // SAFETY: the caller's promise.
        four[count & 3] = unsafe { *indices.add(k) };
        count += usize::from(bits >> k & 1);
    }
    // SAFETY: the caller's promise.
    unsafe { packed.cast::<[u32; 4]>().write_unaligned(four) }
}

/// Eight numbers that share a line of the cache.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Eight(pub [f64; 8]);

/// The numbers of eights in a row.
#[inline(always)]
pub fn flat(eights: &[Eight]) -> &[f64] {
    // SAFETY: an eight is eight numbers and nothing else.
    unsafe { std::slice::from_raw_parts(eights.as_ptr().cast(), 8 * eights.len()) }
}

/// The same to be changed.
#[inline(always)]
pub fn flat_mut(eights: &mut [Eight]) -> &mut [f64] {
    // SAFETY: an eight is eight numbers and nothing else.
    unsafe { std::slice::from_raw_parts_mut(eights.as_mut_ptr().cast(), 8 * eights.len()) }
}

/// A vector in space, each component a lane.
#[derive(Clone, Copy)]
pub struct Vec3<L>(pub [L; 3]);

impl<L: Lane> Vec3<L> {
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Vec3([L::splat(0.0); 3])
    }
    /// Inner product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> L {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }
    /// Cross product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        let (a, b) = (self.0, o.0);
        Vec3([
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ])
    }
    /// Product with a scalar.
    #[inline(always)]
    pub fn scale(self, s: L) -> Self {
        Vec3([self.0[0] * s, self.0[1] * s, self.0[2] * s])
    }
    /// Euclidean length.
    #[inline(always)]
    pub fn norm(self) -> L {
        self.dot(self).sqrt()
    }
    /// The part normal to the unit vector `n`.
    #[inline(always)]
    pub fn reject(self, n: Self) -> Self {
        self - n.scale(self.dot(n))
    }
    /// `yes` where the mask is set, `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: L::Mask, yes: Self, no: Self) -> Self {
        Vec3([
            L::select(mask, yes.0[0], no.0[0]),
            L::select(mask, yes.0[1], no.0[1]),
            L::select(mask, yes.0[2], no.0[2]),
        ])
    }
}

impl<L: Lane> Add for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Vec3([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<L: Lane> Sub for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Vec3([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl<L: Lane> Neg for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Vec3([-self.0[0], -self.0[1], -self.0[2]])
    }
}

impl Lane for f64 {
    type Mask = bool;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn cbrt(self) -> Self {
        f64::cbrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn round(self) -> Self {
        self.round_ties_even()
    }
    #[inline(always)]
    fn less(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn all(mask: bool) -> bool {
        mask
    }
}

/// Registers that a sweep uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// Plain Rust.
    Portable,
    /// Four pairs at a time.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Eight pairs at a time.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Width {
    /// All that this processor has, the widest last.
    pub fn present() -> impl Iterator<Item = Width> {
        #[cfg(target_arch = "x86_64")]
        let wider = {
            let avx2 = std::arch::is_x86_feature_detected!("avx2")
                && std::arch::is_x86_feature_detected!("popcnt");
            let avx512 = avx2
                && std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512dq")
                && std::arch::is_x86_feature_detected!("avx512vl");
            let avx2 = avx2.then_some(Width::Avx2);
            [avx2, avx512.then_some(Width::Avx512)]
        };
        #[cfg(not(target_arch = "x86_64"))]
        let wider = [None, None];
        std::iter::once(Width::Portable).chain(wider.into_iter().flatten())
    }

    /// The widest that this processor has.
    pub fn widest() -> Width {
        Self::present().last().unwrap_or(Width::Portable)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vector_algebra_holds() {
        let a = Vec3([1.0, 2.0, 3.0]);
        let b = Vec3([-2.0, 0.5, 4.0]);
        let c = a.cross(b);
        assert_eq!(c.0, [6.5, -10.0, 4.5]);
        assert_eq!(c.dot(a), 0.0);
        let n = Vec3([0.0, 0.0, 1.0]);
        assert_eq!(a.reject(n).0, [1.0, 2.0, 0.0]);
    }

    /// Rows of eight pairs, gathered, turned to columns and back, and put down again.
    fn there_and_back<L: Lanes>() {
        let rows: Vec<[f64; 4]> = (0..8)
            .map(|r| std::array::from_fn(|c| f64::from(10 * r + c as i32)))
            .collect();
        let at: Vec<u32> = (0..L::WIDTH as u32).rev().collect();
        let gather = || {
            // SAFETY: eight rows, and numbers below that.
            unsafe { L::gather(rows.as_flattened().as_ptr(), at.as_ptr()) }
        };
        let columns = L::transpose(gather());
        let written = |lanes: L| {
            let mut numbers = vec![0.0; L::WIDTH];
            // SAFETY: as many as lanes.
            unsafe { lanes.write(numbers.as_mut_ptr()) };
            numbers
        };
        let expected: Vec<f64> = at.iter().map(|&r| f64::from(10 * r + 2)).collect();
        assert_eq!(written(columns[2]), expected);
        assert_eq!(columns[2].largest(), expected[0]);
        // SAFETY: as many as lanes.
        let again = unsafe { L::read(expected.as_ptr()) };
        assert_eq!(
            L::lanes(again.less(columns[3])),
            (1u16 << L::WIDTH).wrapping_sub(1) as u8
        );
        assert_eq!(L::lanes(again.less(L::splat(25.0))).count_ones(), 3);
        for bits in 0..(1u16 << L::WIDTH) {
            let set = |k: &usize| bits >> k & 1 == 1;
            let lanes: Vec<usize> = (0..L::WIDTH).filter(set).collect();
            let (mut packed, mut indices) = (vec![0.0; L::WIDTH], vec![0; L::WIDTH]);
            // SAFETY: as many as lanes.
            let unpacked = unsafe {
                again.pack(bits as u8, packed.as_mut_ptr());
                L::pack_indices(at.as_ptr(), bits as u8, indices.as_mut_ptr());
                L::unpack(packed.as_ptr(), bits as u8)
            };
            for (k, &lane) in lanes.iter().enumerate() {
                assert_eq!((packed[k], indices[k]), (expected[lane], at[lane]));
            }
            for (k, &number) in written(unpacked).iter().enumerate() {
                assert_eq!(number, if set(&k) { expected[k] } else { 0.0 });
            }
        }
        let back = L::transpose(columns);
        let last = gather()[0].splat_last() + L::repeat(&[0.0, 1.0, 2.0, 3.0]);
        let mut row = [0.0; 4];
        for (p, &r) in at.iter().enumerate() {
            let pair = L::pair(&back, p);
            pair.store(&mut row);
            assert_eq!(row, rows[r as usize]);
            assert_eq!(pair.sum_of_three(), row[0] + row[1] + row[2]);
        }
        L::pair(&[last; 4], 0).store(&mut row);
        let end = rows[L::WIDTH - 1][3];
        assert_eq!(row, [end, end + 1.0, end + 2.0, end + 3.0]);
        sides::<L, 2>(&rows, &back);
        sides::<L, 3>(&rows, &back);
    }

    /// Sums of both sides of pairs.
    fn sides<L: Lanes, const ROWS: usize>(rows: &[[f64; 4]], back: &[L; 4]) {
        for p in 0..L::WIDTH {
            let (mut own, mut other) = ([[1.0; 4]; ROWS], [[2.0; 4]; ROWS]);
            let [a, b] = [&mut own, &mut other].map(|sum| sum.as_flattened_mut().as_mut_ptr());
            // SAFETY: as many rows.
            unsafe { L::add_pair(&[*back; ROWS], p, a, b) };
            let row = rows[L::WIDTH - 1 - p];
            for k in 0..ROWS {
                let sign = if k == 1 { 1.0 } else { -1.0 };
                assert_eq!(own[k], row.map(|x| 1.0 + x));
                assert_eq!(other[k], row.map(|x| 2.0 + sign * x));
            }
        }
    }

    #[test]
    fn rows_and_columns_of_every_width() {
        there_and_back::<Portable>();
        #[cfg(target_arch = "x86_64")]
        for width in Width::present() {
            match width {
                Width::Portable => {}
                // SAFETY: the processor has been asked.
                Width::Avx2 => unsafe { there_and_back_avx2() },
                // SAFETY: the processor has been asked.
                Width::Avx512 => unsafe { there_and_back_avx512() },
            }
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt")]
    unsafe fn there_and_back_avx2() {
        there_and_back::<avx2::Avx2>();
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt,avx512f,avx512dq,avx512vl")]
    unsafe fn there_and_back_avx512() {
        there_and_back::<avx512::Avx512>();
    }
}
