//! Eight numbers that are computed with at once.
//!
//! Compilers rearrange plain loops over a few columns of eight rows into gathers and permutations that take longer than
//! the arithmetic, so processors with AVX2 or AVX-512 are told what to do. Products are rounded before they are added: the bits
//! are the same on every processor.

/// How many.
pub(super) const LANES: usize = 8;

/// Eight numbers in double precision.
pub(super) trait Lanes: Copy {
    /// All the same.
    fn all(value: f64) -> Self;
    /// From memory.
    fn load(values: &[f64; LANES]) -> Self;
    /// From memory, in single precision.
    fn widen(values: &[f32; LANES]) -> Self;
    /// Into memory.
    fn store(self, values: &mut [f64; LANES]);
    /// self + a b.
    fn plus(self, a: Self, b: Self) -> Self;
    /// self − a.
    fn minus(self, a: Self) -> Self;

    /// Sum of the eight.
    #[inline(always)]
    fn sum(self) -> f64 {
        let mut values = [0.0; LANES];
        self.store(&mut values);
        let [a, b, c, d, e, f, g, h] = values;
        ((a + b) + (c + d)) + ((e + f) + (g + h))
    }
}

/// For any processor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plain([f64; LANES]);

impl Lanes for Plain {
    #[inline(always)]
    fn all(value: f64) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn load(values: &[f64; LANES]) -> Self {
        Self(*values)
    }

    #[inline(always)]
    fn widen(values: &[f32; LANES]) -> Self {
        Self(values.map(f64::from))
    }

    #[inline(always)]
    fn store(self, values: &mut [f64; LANES]) {
        *values = self.0;
    }

    #[inline(always)]
    fn plus(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|n| self.0[n] + a.0[n] * b.0[n]))
    }

    #[inline(always)]
    fn minus(self, a: Self) -> Self {
        Self(std::array::from_fn(|n| self.0[n] - a.0[n]))
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Halves;
#[cfg(target_arch = "x86_64")]
pub(super) use avx512::Wide;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::{
        __m256d, _mm_loadu_ps, _mm256_add_pd, _mm256_cvtps_pd, _mm256_loadu_pd, _mm256_mul_pd,
        _mm256_set1_pd, _mm256_storeu_pd, _mm256_sub_pd,
    };

    use super::{LANES, Lanes};

    /// Twice four, for processors with AVX2; only to be used in functions compiled for it, which are the only ones that call
    /// generic code with this type.
    #[derive(Debug, Clone, Copy)]
    pub(in super::super) struct Halves(__m256d, __m256d);

    impl Lanes for Halves {
        #[inline(always)]
        fn all(value: f64) -> Self {
            // SAFETY: the processor has AVX.
            let half = unsafe { _mm256_set1_pd(value) };
            Self(half, half)
        }

        #[inline(always)]
        fn load(values: &[f64; LANES]) -> Self {
            let from = values.as_ptr();
            // SAFETY: the processor has AVX, and eight numbers are there.
            unsafe { Self(_mm256_loadu_pd(from), _mm256_loadu_pd(from.add(4))) }
        }

        #[inline(always)]
        fn widen(values: &[f32; LANES]) -> Self {
            let from = values.as_ptr();
            // SAFETY: the processor has AVX, and eight numbers are there.
            unsafe {
                Self(
                    _mm256_cvtps_pd(_mm_loadu_ps(from)),
                    _mm256_cvtps_pd(_mm_loadu_ps(from.add(4))),
                )
            }
        }

        #[inline(always)]
        fn store(self, values: &mut [f64; LANES]) {
            let to = values.as_mut_ptr();
            // SAFETY: the processor has AVX, and there is room for eight numbers.
            unsafe {
                _mm256_storeu_pd(to, self.0);
                _mm256_storeu_pd(to.add(4), self.1);
            }
        }

        #[inline(always)]
        fn plus(self, a: Self, b: Self) -> Self {
            // SAFETY: the processor has AVX.
            unsafe {
                Self(
                    _mm256_add_pd(self.0, _mm256_mul_pd(a.0, b.0)),
                    _mm256_add_pd(self.1, _mm256_mul_pd(a.1, b.1)),
                )
            }
        }

        #[inline(always)]
        fn minus(self, a: Self) -> Self {
            // SAFETY: the processor has AVX.
            unsafe { Self(_mm256_sub_pd(self.0, a.0), _mm256_sub_pd(self.1, a.1)) }
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use std::arch::x86_64::{
        __m512d, _mm256_loadu_ps, _mm512_add_pd, _mm512_cvtps_pd, _mm512_loadu_pd, _mm512_mul_pd,
        _mm512_set1_pd, _mm512_storeu_pd, _mm512_sub_pd,
    };

    use super::{LANES, Lanes};

    /// For processors with AVX-512 F; only to be used in functions compiled for it, which are the only ones that call
    /// generic code with this type.
    #[derive(Debug, Clone, Copy)]
    pub(in super::super) struct Wide(__m512d);

    impl Lanes for Wide {
        #[inline(always)]
        fn all(value: f64) -> Self {
            // SAFETY: the processor has AVX-512 F.
            Self(unsafe { _mm512_set1_pd(value) })
        }

        #[inline(always)]
        fn load(values: &[f64; LANES]) -> Self {
            // SAFETY: the processor has AVX-512 F, and eight numbers are there.
            Self(unsafe { _mm512_loadu_pd(values.as_ptr()) })
        }

        #[inline(always)]
        fn widen(values: &[f32; LANES]) -> Self {
            // SAFETY: the processor has AVX-512 F, and eight numbers are there.
            Self(unsafe { _mm512_cvtps_pd(_mm256_loadu_ps(values.as_ptr())) })
        }

        #[inline(always)]
        fn store(self, values: &mut [f64; LANES]) {
            // SAFETY: the processor has AVX-512 F, and there is room for eight numbers.
            unsafe { _mm512_storeu_pd(values.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn plus(self, a: Self, b: Self) -> Self {
            // SAFETY: the processor has AVX-512 F.
            Self(unsafe { _mm512_add_pd(self.0, _mm512_mul_pd(a.0, b.0)) })
        }

        #[inline(always)]
        fn minus(self, a: Self) -> Self {
            // SAFETY: the processor has AVX-512 F.
            Self(unsafe { _mm512_sub_pd(self.0, a.0) })
        }
    }
}
