//! Four lanes in an AVX2 register.
//!
//! Forces are 2.4 times faster than in scalar code. Invariant: a value of [`Avx2`] exists only inside
//! functions compiled for AVX2, which are entered only after the processor has been asked
//! ([`super::Width`]); every method is inlined into them.

use super::{Lane, Lanes, Lanes4, Row};
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// See the module.
#[derive(Clone, Copy)]
pub struct Avx2(__m256d);

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
}

impl Lanes for Avx2 {
    const WIDTH: usize = 4;
    type Row = Self;
    #[inline(always)]
    fn gather(of: &[impl Row], at: &[u32]) -> [Self; 4] {
        [
            Self::load(&of[at[0] as usize].read()),
            Self::load(&of[at[1] as usize].read()),
            Self::load(&of[at[2] as usize].read()),
            Self::load(&of[at[3] as usize].read()),
        ]
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
    fn scatter(rows: [Self; 4], to: &mut [[f64; 4]], at: usize, stride: usize) {
        for (r, row) in rows.into_iter().enumerate() {
            row.store(&mut to[at + r * stride]);
        }
    }
    #[inline(always)]
    fn read(blocks: &[[f64; 4]], k: usize, _: usize) -> Self {
        Self::load(&blocks[k])
    }
    #[inline(always)]
    fn write(self, blocks: &mut [[f64; 4]], k: usize, _: usize) {
        self.store(&mut blocks[k]);
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
