//! Numbers that are one contact wide or four contacts wide.
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
}

/// Four numbers in memory.
pub trait Row {
    /// The numbers.
    fn read(&self) -> [f64; 4];
}

impl Row for [f64; 4] {
    #[inline(always)]
    fn read(&self) -> [f64; 4] {
        *self
    }
}

/// A row of four numbers.
pub trait Lanes4: Lane {
    /// Reads a row.
    fn load(row: &[f64; 4]) -> Self;
    /// Writes a row.
    fn store(self, row: &mut [f64; 4]);
    /// The last number of the row in every lane.
    fn splat_last(self) -> Self;
}

/// As many pairs as there are lanes, four or eight; or a row of four numbers of each of a quarter of
/// them: row `r` of `[Self; 4]` holds those of pair `r`, and of pair `r + 4` if there are eight.
pub trait Lanes: Lane {
    /// Number of pairs.
    const WIDTH: usize;
    /// Rows one at a time, on the same processor.
    type Row: Lanes4;
    /// Rows `at` of an array.
    fn gather(of: &[impl Row], at: &[u32]) -> [Self; 4];
    /// The same four numbers for every pair.
    fn repeat(row: &[f64; 4]) -> Self;
    /// Rows of pairs to columns, and back.
    fn transpose(rows: [Self; 4]) -> [Self; 4];
    /// The last of each pair's four numbers in all four places.
    fn splat_last(self) -> Self;
    /// Writes rows `at`, `at + stride`, … of an array, a pair after the other.
    fn scatter(rows: [Self; 4], to: &mut [[f64; 4]], at: usize, stride: usize);
    /// Reads number `k` of histories in blocks of four pairs and `width` rows.
    fn read(blocks: &[[f64; 4]], k: usize, width: usize) -> Self;
    /// Writes it.
    fn write(self, blocks: &mut [[f64; 4]], k: usize, width: usize);
    /// Which lanes of a mask are set, the first by the lowest bit.
    fn lanes(mask: Self::Mask) -> u8;
    /// The largest number.
    fn largest(self) -> f64;
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
            let avx2 = std::arch::is_x86_feature_detected!("avx2");
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
        let columns = L::transpose(L::gather(&rows, &at));
        let mut block = vec![[0.0; 4]; L::WIDTH / 4];
        columns[2].write(&mut block, 0, 1);
        let expected: Vec<f64> = at.iter().map(|&r| f64::from(10 * r + 2)).collect();
        assert_eq!(block.as_flattened(), expected);
        assert_eq!(columns[2].largest(), expected[0]);
        let again = L::read(&block, 0, 1);
        assert_eq!(
            L::lanes(again.less(columns[3])),
            (1u16 << L::WIDTH).wrapping_sub(1) as u8
        );
        assert_eq!(L::lanes(again.less(L::splat(25.0))).count_ones(), 3);
        let mut out = vec![[0.0; 4]; 2 * L::WIDTH];
        L::scatter(L::transpose(columns), &mut out, 1, 2);
        let last = L::gather(&rows, &at)[0].splat_last() + L::repeat(&[0.0, 1.0, 2.0, 3.0]);
        for (k, &r) in at.iter().enumerate() {
            assert_eq!(out[2 * k + 1], rows[r as usize]);
        }
        L::scatter([last; 4], &mut out, 0, 2);
        let end = rows[L::WIDTH - 1][3];
        assert_eq!(out[0], [end, end + 1.0, end + 2.0, end + 3.0]);
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
    #[target_feature(enable = "avx2")]
    unsafe fn there_and_back_avx2() {
        there_and_back::<avx2::Avx2>();
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,avx512f,avx512dq,avx512vl")]
    unsafe fn there_and_back_avx512() {
        there_and_back::<avx512::Avx512>();
    }
}
