//! Eight lanes in an AVX-512 register.
//!
//! Half the instructions of four lanes, and twice as many registers. Invariant: a value of [`Avx512`]
//! exists only inside functions compiled for AVX-512 (F, DQ, VL), which are entered only after the
//! processor has been asked ([`super::Width`]); every method is inlined into them.

use super::avx2::Avx2;
use super::{Lane, Lanes, Row};
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// See the module.
#[derive(Clone, Copy)]
pub struct Avx512(__m512d);

macro_rules! avx512_operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Avx512 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                // SAFETY: the module's invariant: AVX-512 is present.
                Avx512(unsafe { $intrinsic(self.0, o.0) })
            }
        }
    };
}
avx512_operator!(Add, add, _mm512_add_pd);
avx512_operator!(Sub, sub, _mm512_sub_pd);
avx512_operator!(Mul, mul, _mm512_mul_pd);
avx512_operator!(Div, div, _mm512_div_pd);

impl Neg for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx512(unsafe { _mm512_xor_pd(self.0, _mm512_set1_pd(-0.0)) })
    }
}

impl Lane for Avx512 {
    type Mask = __mmask8;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx512(unsafe { _mm512_set1_pd(value) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx512(unsafe { _mm512_sqrt_pd(self.0) })
    }
    #[inline(always)]
    fn cbrt(self) -> Self {
        // There is no instruction for it: eight calls.
        let mut numbers = self.numbers();
        for number in &mut numbers {
            *number = number.cbrt();
        }
        // SAFETY: the module's invariant; `numbers` is 64 readable bytes.
        Avx512(unsafe { _mm512_loadu_pd(numbers.as_ptr()) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx512(unsafe { _mm512_abs_pd(self.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present. `minpd` returns its second operand
        // where the comparison is false, as the scalar form does.
        Avx512(unsafe { _mm512_min_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx512(unsafe { _mm512_max_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn round(self) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx512(unsafe {
            _mm512_roundscale_pd::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)
        })
    }
    #[inline(always)]
    fn less(self, other: Self) -> __mmask8 {
        // SAFETY: the module's invariant: AVX-512 is present.
        unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    fn select(mask: __mmask8, yes: Self, no: Self) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx512(unsafe { _mm512_mask_blend_pd(mask, no.0, yes.0) })
    }
}

impl Avx512 {
    #[inline(always)]
    fn numbers(self) -> [f64; 8] {
        let mut numbers = [0.0; 8];
        // SAFETY: the module's invariant; `numbers` is 64 writable bytes.
        unsafe { _mm512_storeu_pd(numbers.as_mut_ptr(), self.0) };
        numbers
    }

    /// Two rows side by side.
    #[inline(always)]
    fn join(low: &[f64; 4], high: &[f64; 4]) -> Self {
        // SAFETY: the module's invariant; the rows are 32 readable bytes each.
        unsafe {
            let low = _mm512_castpd256_pd512(_mm256_loadu_pd(low.as_ptr()));
            Avx512(_mm512_insertf64x4::<1>(low, _mm256_loadu_pd(high.as_ptr())))
        }
    }

    #[inline(always)]
    fn store_low(self, row: &mut [f64; 4]) {
        // SAFETY: the module's invariant; `row` is 32 writable bytes.
        unsafe { _mm256_storeu_pd(row.as_mut_ptr(), _mm512_castpd512_pd256(self.0)) }
    }

    #[inline(always)]
    fn store_high(self, row: &mut [f64; 4]) {
        // SAFETY: the module's invariant; `row` is 32 writable bytes.
        unsafe { _mm256_storeu_pd(row.as_mut_ptr(), _mm512_extractf64x4_pd::<1>(self.0)) }
    }
}

impl Lanes for Avx512 {
    const WIDTH: usize = 8;
    type Row = Avx2;
    #[inline(always)]
    fn gather(of: &[impl Row], at: &[u32]) -> [Self; 4] {
        [
            Self::join(&of[at[0] as usize].read(), &of[at[4] as usize].read()),
            Self::join(&of[at[1] as usize].read(), &of[at[5] as usize].read()),
            Self::join(&of[at[2] as usize].read(), &of[at[6] as usize].read()),
            Self::join(&of[at[3] as usize].read(), &of[at[7] as usize].read()),
        ]
    }
    #[inline(always)]
    fn repeat(row: &[f64; 4]) -> Self {
        Self::join(row, row)
    }
    #[inline(always)]
    fn transpose(rows: [Self; 4]) -> [Self; 4] {
        // SAFETY: the module's invariant: AVX-512 is present.
        unsafe {
            let a = _mm512_unpacklo_pd(rows[0].0, rows[1].0);
            let b = _mm512_unpackhi_pd(rows[0].0, rows[1].0);
            let c = _mm512_unpacklo_pd(rows[2].0, rows[3].0);
            let d = _mm512_unpackhi_pd(rows[2].0, rows[3].0);
            // Numbers 0, 1 of both, and numbers 2, 3 of both, in each half.
            let front = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
            let back = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
            [
                Avx512(_mm512_permutex2var_pd(a, front, c)),
                Avx512(_mm512_permutex2var_pd(b, front, d)),
                Avx512(_mm512_permutex2var_pd(a, back, c)),
                Avx512(_mm512_permutex2var_pd(b, back, d)),
            ]
        }
    }
    #[inline(always)]
    fn splat_last(self) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx512(unsafe { _mm512_permutex_pd::<0xff>(self.0) })
    }
    #[inline(always)]
    fn scatter(rows: [Self; 4], to: &mut [[f64; 4]], at: usize, stride: usize) {
        for (r, row) in rows.into_iter().enumerate() {
            row.store_low(&mut to[at + r * stride]);
            row.store_high(&mut to[at + (r + 4) * stride]);
        }
    }
    #[inline(always)]
    fn read(blocks: &[[f64; 4]], k: usize, width: usize) -> Self {
        Self::join(&blocks[k], &blocks[k + width])
    }
    #[inline(always)]
    fn write(self, blocks: &mut [[f64; 4]], k: usize, width: usize) {
        self.store_low(&mut blocks[k]);
        self.store_high(&mut blocks[k + width]);
    }
    #[inline(always)]
    fn lanes(mask: __mmask8) -> u8 {
        mask
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.numbers().into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
}
