//! Lanes in plain Rust.

use super::{Lane, Lanes, Lanes4};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Four lanes in plain Rust, for processors without AVX2.
#[derive(Clone, Copy)]
pub struct Portable([f64; 4]);

impl Portable {
    #[inline(always)]
    fn zip(self, o: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Portable(std::array::from_fn(|k| f(self.0[k], o.0[k])))
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Portable(self.0.map(f))
    }
}

macro_rules! portable_operator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for Portable {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.zip(o, |a, b| a $op b)
            }
        }
    };
}
portable_operator!(Add, add, +);
portable_operator!(Sub, sub, -);
portable_operator!(Mul, mul, *);
portable_operator!(Div, div, /);

impl Neg for Portable {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl Lane for Portable {
    type Mask = [bool; 4];
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Portable([value; 4])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }
    #[inline(always)]
    fn cbrt(self) -> Self {
        self.map(f64::cbrt)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f64::abs)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn round(self) -> Self {
        self.map(f64::round_ties_even)
    }
    #[inline(always)]
    fn less(self, other: Self) -> [bool; 4] {
        std::array::from_fn(|k| self.0[k] < other.0[k])
    }
    #[inline(always)]
    fn select(mask: [bool; 4], yes: Self, no: Self) -> Self {
        Portable(std::array::from_fn(|k| {
            if mask[k] { yes.0[k] } else { no.0[k] }
        }))
    }
    #[inline(always)]
    fn all(mask: [bool; 4]) -> bool {
        mask == [true; 4]
    }
}

impl Lanes4 for Portable {
    #[inline(always)]
    fn load(row: &[f64; 4]) -> Self {
        Portable(*row)
    }
    #[inline(always)]
    fn store(self, row: &mut [f64; 4]) {
        *row = self.0;
    }
    #[inline(always)]
    fn splat_last(self) -> Self {
        Portable([self.0[3]; 4])
    }
    #[inline(always)]
    fn sum_of_three(self) -> f64 {
        self.0[0] + self.0[1] + self.0[2]
    }
}

impl Lanes for Portable {
    const WIDTH: usize = 4;
    type Row = Self;
    #[inline(always)]
    unsafe fn gather(rows: *const f64, at: *const u32) -> [Self; 4] {
        std::array::from_fn(|r| {
            // SAFETY: the caller's promise.
            unsafe { Self::read(rows.add(4 * *at.add(r) as usize)) }
        })
    }
    #[inline(always)]
    fn repeat(row: &[f64; 4]) -> Self {
        Portable(*row)
    }
    #[inline(always)]
    fn transpose(rows: [Self; 4]) -> [Self; 4] {
        std::array::from_fn(|c| Portable(std::array::from_fn(|r| rows[r].0[c])))
    }
    #[inline(always)]
    fn splat_last(self) -> Self {
        Lanes4::splat_last(self)
    }
    #[inline(always)]
    fn pair(rows: &[Self; 4], p: usize) -> Self {
        rows[p & 3]
    }
    #[inline(always)]
    unsafe fn read(numbers: *const f64) -> Self {
        // SAFETY: the caller's promise.
        Portable(unsafe { numbers.cast::<[f64; 4]>().read() })
    }
    #[inline(always)]
    unsafe fn write(self, numbers: *mut f64) {
        // SAFETY: the caller's promise.
        unsafe { numbers.cast::<[f64; 4]>().write(self.0) }
    }
    #[inline(always)]
    unsafe fn pack(self, bits: u8, numbers: *mut f64) {
        let (mut packed, mut count) = ([0.0; 4], 0);
        for (k, number) in self.0.into_iter().enumerate() {
            packed[count & 3] = number;
            count += usize::from(bits >> k & 1);
        }
        // SAFETY: the caller's promise.
        unsafe { Portable(packed).write(numbers) }
    }
    #[inline(always)]
    unsafe fn unpack(numbers: *const f64, bits: u8) -> Self {
        // SAFETY: the caller's promise.
        let Portable(packed) = unsafe { Self::read(numbers) };
        let mut count = 0;
        Portable(std::array::from_fn(|k| {
            let set = bits >> k & 1 == 1;
            let number = if set { packed[count & 3] } else { 0.0 };
            count += usize::from(set);
            number
        }))
    }
    #[inline(always)]
    unsafe fn pack_indices(indices: *const u32, bits: u8, packed: *mut u32) {
        // SAFETY: the caller's promise.
        unsafe { super::pack_four(indices, bits, packed) }
    }
    #[inline(always)]
    fn lanes(mask: [bool; 4]) -> u8 {
        let [a, b, c, d] = mask.map(u8::from);
        a | b << 1 | c << 2 | d << 3
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.0.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
}
