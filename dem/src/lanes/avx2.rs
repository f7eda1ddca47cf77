//! Four lanes in an AVX2 register.
//!
//! Forces are 2.4 times faster than in scalar code. Invariant: a value of [`Avx2`] exists only inside
//! functions compiled for AVX2, which are entered only after the processor has been asked
//! ([`super::Width`]); every method is inlined into them.

use super::{Lane, Lanes, Lanes4};
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// See the module.
#[derive(Clone, Copy)]
pub struct Avx2(pub(super) __m256d);

macro_rules! avx2_operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Avx2 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                // SAFETY: the module's invariant: AVX2 is present.
                Avx2(unsafe { $intrinsic(self.0, o.0) })
            }
        }
    };
}
avx2_operator!(Add, add, _mm256_add_pd);
avx2_operator!(Sub, sub, _mm256_sub_pd);
avx2_operator!(Mul, mul, _mm256_mul_pd);
avx2_operator!(Div, div, _mm256_div_pd);

impl Neg for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: the module's invariant: AVX2 is present.
        Avx2(unsafe { _mm256_xor_pd(self.0, _mm256_set1_pd(-0.0)) })
    }
}

/// For every choice of lanes, which halves of numbers, two each, bring the chosen ones to the front.
const PACK: [[u32; 8]; 16] = halves(true);

/// The same for bringing them back.
const UNPACK: [[u32; 8]; 16] = halves(false);

/// All bits of the chosen lanes.
const MASK: [[u64; 4]; 16] = {
    let mut masks = [[0; 4]; 16];
    let mut bits = 0;
    while bits < 16 {
        let mut lane = 0;
        while lane < 4 {
            if bits >> lane & 1 == 1 {
                masks[bits][lane] = u64::MAX;
            }
            lane += 1;
        }
        bits += 1;
    }
    masks
};

const fn halves(pack: bool) -> [[u32; 8]; 16] {
    let mut all = [[0; 8]; 16];
    let mut bits = 0;
    while bits < 16 {
        let (mut lane, mut count) = (0, 0);
        while lane < 4 {
            if bits >> lane & 1 == 1 {
                let (to, from) = if pack { (count, lane) } else { (lane, count) };
                all[bits][2 * to] = 2 * from as u32;
                all[bits][2 * to + 1] = 2 * from as u32 + 1;
                count += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    all
}

impl Avx2 {
    /// The row with this number, out of rows of four.
    ///
    /// # Safety
    /// It must be there.
    #[inline(always)]
    pub(super) unsafe fn row(rows: *const f64, at: *const u32) -> Self {
        // SAFETY: the caller's promise.
        unsafe { Self::read(rows.add(4 * *at as usize)) }
    }

    /// Takes halves of numbers by their places.
    #[inline(always)]
    fn pick(self, halves: &[u32; 8]) -> Self {
        // SAFETY: the module's invariant; `halves` is 32 readable bytes.
        unsafe {
            let halves = _mm256_loadu_si256(halves.as_ptr().cast());
            let picked = _mm256_permutevar8x32_ps(_mm256_castpd_ps(self.0), halves);
            Avx2(_mm256_castps_pd(picked))
        }
    }
}

impl Lane for Avx2 {
    type Mask = __m256d;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: the module's invariant: AVX2 is present.
        Avx2(unsafe { _mm256_set1_pd(value) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: the module's invariant: AVX2 is present.
        Avx2(unsafe { _mm256_sqrt_pd(self.0) })
    }
    #[inline(always)]
    fn cbrt(self) -> Self {
        // There is no instruction for it: four calls.
        let mut row = [0.0; 4];
        self.store(&mut row);
        Self::load(&[row[0].cbrt(), row[1].cbrt(), row[2].cbrt(), row[3].cbrt()])
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: the module's invariant: AVX2 is present.
        Avx2(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: the module's invariant: AVX2 is present. `minpd` returns its second operand
        // where the comparison is false, as the scalar form does.
        Avx2(unsafe { _mm256_min_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: the module's invariant: AVX2 is present.
        Avx2(unsafe { _mm256_max_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn round(self) -> Self {
        // SAFETY: the module's invariant: AVX2 is present.
        Avx2(unsafe {
            _mm256_round_pd::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)
        })
    }
    #[inline(always)]
    fn less(self, other: Self) -> __m256d {
        // SAFETY: the module's invariant: AVX2 is present.
        unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    fn select(mask: __m256d, yes: Self, no: Self) -> Self {
        // SAFETY: the module's invariant: AVX2 is present.
        Avx2(unsafe { _mm256_blendv_pd(no.0, yes.0, mask) })
    }
    #[inline(always)]
    fn all(mask: __m256d) -> bool {
        Self::lanes(mask) == 0b1111
    }
}

impl Lanes4 for Avx2 {
    #[inline(always)]
    fn load(row: &[f64; 4]) -> Self {
        // SAFETY: the module's invariant; `row` is 32 readable bytes.
        Avx2(unsafe { _mm256_loadu_pd(row.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, row: &mut [f64; 4]) {
        // SAFETY: the module's invariant; `row` is 32 writable bytes.
        unsafe { _mm256_storeu_pd(row.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn splat_last(self) -> Self {
        // SAFETY: the module's invariant: AVX2 is present.
        Avx2(unsafe { _mm256_permute4x64_pd::<0xff>(self.0) })
    }
    #[inline(always)]
    fn sum_of_three(self) -> f64 {
        // SAFETY: the module's invariant: AVX2 is present.
        unsafe {
            let (front, back) = (
                _mm256_castpd256_pd128(self.0),
                _mm256_extractf128_pd::<1>(self.0),
            );
            let two = _mm_add_sd(front, _mm_unpackhi_pd(front, front));
            _mm_cvtsd_f64(_mm_add_sd(two, back))
        }
    }
}

impl Lanes for Avx2 {
    const WIDTH: usize = 4;
    type Row = Self;
    #[inline(always)]
    unsafe fn gather(rows: *const f64, at: *const u32) -> [Self; 4] {
        // SAFETY: the caller's promise.
        unsafe {
            [
                Self::row(rows, at),
                Self::row(rows, at.add(1)),
                Self::row(rows, at.add(2)),
                Self::row(rows, at.add(3)),
            ]
        }
    }
    #[inline(always)]
    fn repeat(row: &[f64; 4]) -> Self {
        Self::load(row)
    }
    #[inline(always)]
    fn transpose(rows: [Self; 4]) -> [Self; 4] {
        // SAFETY: the module's invariant: AVX2 is present.
        unsafe {
            let a = _mm256_unpacklo_pd(rows[0].0, rows[1].0);
            let b = _mm256_unpackhi_pd(rows[0].0, rows[1].0);
            let c = _mm256_unpacklo_pd(rows[2].0, rows[3].0);
            let d = _mm256_unpackhi_pd(rows[2].0, rows[3].0);
            [
                Avx2(_mm256_permute2f128_pd::<0x20>(a, c)),
                Avx2(_mm256_permute2f128_pd::<0x20>(b, d)),
                Avx2(_mm256_permute2f128_pd::<0x31>(a, c)),
                Avx2(_mm256_permute2f128_pd::<0x31>(b, d)),
            ]
        }
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
        // SAFETY: the module's invariant; the caller's promise.
        Avx2(unsafe { _mm256_loadu_pd(numbers) })
    }
    #[inline(always)]
    unsafe fn write(self, numbers: *mut f64) {
        // SAFETY: the module's invariant; the caller's promise.
        unsafe { _mm256_storeu_pd(numbers, self.0) }
    }
    #[inline(always)]
    unsafe fn pack(self, bits: u8, numbers: *mut f64) {
        // SAFETY: the caller's promise.
        unsafe { self.pick(&PACK[usize::from(bits & 15)]).write(numbers) }
    }
    #[inline(always)]
    unsafe fn unpack(numbers: *const f64, bits: u8) -> Self {
        let bits = usize::from(bits & 15);
        // SAFETY: the module's invariant; the caller's promise; masks are 32 readable bytes.
        unsafe {
            let mask = _mm256_loadu_si256(MASK[bits].as_ptr().cast());
            let numbers = Self::read(numbers).pick(&UNPACK[bits]);
            Avx2(_mm256_and_pd(_mm256_castsi256_pd(mask), numbers.0))
        }
    }
    #[inline(always)]
    unsafe fn pack_indices(indices: *const u32, bits: u8, packed: *mut u32) {
        // SAFETY: the caller's promise.
        unsafe { super::pack_four(indices, bits, packed) }
    }
    #[inline(always)]
    fn lanes(mask: __m256d) -> u8 {
        // SAFETY: the module's invariant: AVX2 is present.
        unsafe { _mm256_movemask_pd(mask) as u8 }
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        let mut row = [0.0; 4];
        self.store(&mut row);
        row.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
}
