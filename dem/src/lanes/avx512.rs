//! Eight lanes in an AVX-512 register.
//!
//! Half the instructions of four lanes, and twice as many registers. Invariant: a value of [`Avx512`]
//! exists only inside functions compiled for AVX-512 (F, DQ, VL), which are entered only after the
//! processor has been asked ([`super::Width`]); every method is inlined into them.

use super::avx2::Avx2;
use super::{Lane, Lanes, Lanes4};
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
        // SAFETY: eight numbers.
        unsafe { Self::read(numbers.as_ptr()) }
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
    #[inline(always)]
    fn all(mask: __mmask8) -> bool {
        mask == u8::MAX
    }
}

impl Avx512 {
    #[inline(always)]
    fn numbers(self) -> [f64; 8] {
        let mut numbers = [0.0; 8];
        // SAFETY: eight numbers.
        unsafe { self.write(numbers.as_mut_ptr()) };
        numbers
    }

    /// Two rows side by side.
    #[inline(always)]
    fn join(low: Avx2, high: Avx2) -> Self {
        // SAFETY: the module's invariant: AVX-512 is present.
        unsafe {
            let low = _mm512_castpd256_pd512(low.0);
            Avx512(_mm512_insertf64x4::<1>(low, high.0))
        }
    }

    /// The first of two rows side by side.
    #[inline(always)]
    fn low(self) -> Avx2 {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx2(unsafe { _mm512_castpd512_pd256(self.0) })
    }

    /// The second.
    #[inline(always)]
    fn high(self) -> Avx2 {
        // SAFETY: the module's invariant: AVX-512 is present.
        Avx2(unsafe { _mm512_extractf64x4_pd::<1>(self.0) })
    }
}

impl Lanes for Avx512 {
    const WIDTH: usize = 8;
    type Row = Avx2;
    #[inline(always)]
    unsafe fn gather(rows: *const f64, at: *const u32) -> [Self; 4] {
        // SAFETY: the caller's promise.
        unsafe {
            [
                Self::join(Avx2::row(rows, at), Avx2::row(rows, at.add(4))),
                Self::join(Avx2::row(rows, at.add(1)), Avx2::row(rows, at.add(5))),
                Self::join(Avx2::row(rows, at.add(2)), Avx2::row(rows, at.add(6))),
                Self::join(Avx2::row(rows, at.add(3)), Avx2::row(rows, at.add(7))),
            ]
        }
    }
    #[inline(always)]
    fn repeat(row: &[f64; 4]) -> Self {
        let row = Avx2::load(row);
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
    fn pair(rows: &[Self; 4], p: usize) -> Avx2 {
        if p < 4 {
            rows[p].low()
        } else {
            rows[p & 3].high()
        }
    }
    #[inline(always)]
    unsafe fn read(numbers: *const f64) -> Self {
        // SAFETY: the module's invariant; the caller's promise.
        Avx512(unsafe { _mm512_loadu_pd(numbers) })
    }
    #[inline(always)]
    unsafe fn write(self, numbers: *mut f64) {
        // SAFETY: the module's invariant; the caller's promise.
        unsafe { _mm512_storeu_pd(numbers, self.0) }
    }
    #[inline(always)]
    unsafe fn pack(self, bits: u8, numbers: *mut f64) {
        // In the register: packing while writing takes a hundred cycles on some processors.
        // SAFETY: the module's invariant; the caller's promise.
        unsafe { Avx512(_mm512_maskz_compress_pd(bits, self.0)).write(numbers) }
    }
    #[inline(always)]
    unsafe fn unpack(numbers: *const f64, bits: u8) -> Self {
        // SAFETY: the module's invariant; the caller's promise.
        Avx512(unsafe { _mm512_maskz_expand_pd(bits, Self::read(numbers).0) })
    }
    #[inline(always)]
    unsafe fn pack_indices(indices: *const u32, bits: u8, packed: *mut u32) {
        // SAFETY: the module's invariant; the caller's promise.
        unsafe {
            let indices = _mm256_loadu_si256(indices.cast());
            let indices = _mm256_maskz_compress_epi32(bits, indices);
            _mm256_storeu_si256(packed.cast(), indices);
        }
    }
    #[inline(always)]
    unsafe fn add_pair<const ROWS: usize>(
        rows: &[[Self; 4]; ROWS],
        p: usize,
        own: *mut f64,
        other: *mut f64,
    ) {
        // The first two rows of a pair side by side.
        let (a, b) = (rows[0][p & 3].0, rows[1][p & 3].0);
        // SAFETY: the module's invariant; the caller's promise.
        unsafe {
            let both = Avx512(if p < 4 {
                _mm512_insertf64x4::<1>(a, _mm512_castpd512_pd256(b))
            } else {
                _mm512_shuffle_f64x2::<0b1110_1110>(a, b)
            });
            (Self::read(own) + both).write(own);
            let turned = _mm512_setr_pd(-0.0, -0.0, -0.0, -0.0, 0.0, 0.0, 0.0, 0.0);
            let turned = Avx512(_mm512_xor_pd(both.0, turned));
            if ROWS == 2 {
                (Self::read(other) + turned).write(other);
                return;
            }
            let row = Self::pair(&rows[2], p);
            let own = own.add(8);
            (Avx2::read(own) + row).write(own);
            (Self::read(other) + turned).write(other);
            let other = other.add(8);
            (Avx2::read(other) - row).write(other);
        }
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
