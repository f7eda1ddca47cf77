//! Numbers that are one contact wide or four contacts wide.
//!
//! Contact laws are written once, for any [`Lane`]: with `f64` they serve walls and tests, with
//! four-wide lanes they serve batches of pairs. All implementations use the same correctly rounded
//! operations in the same order (no fused multiply-add), so that every width gives the same bits.

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
    /// Whether any lane of the mask is set.
    fn any(mask: Self::Mask) -> bool;
}

/// Four contacts at a time, exchanged with memory as rows of four numbers.
pub trait Lanes4: Lane {
    /// Reads a row.
    fn load(row: &[f64; 4]) -> Self;
    /// Writes a row.
    fn store(self, row: &mut [f64; 4]);
    /// Rows to columns.
    fn transpose(rows: [Self; 4]) -> [Self; 4];
    /// The last number of a row in every lane.
    fn splat_last(self) -> Self;
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
    fn any(mask: bool) -> bool {
        mask
    }
}

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
    fn any(mask: [bool; 4]) -> bool {
        mask != [false; 4]
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
    fn transpose(rows: [Self; 4]) -> [Self; 4] {
        std::array::from_fn(|c| Portable(std::array::from_fn(|r| rows[r].0[c])))
    }
    #[inline(always)]
    fn splat_last(self) -> Self {
        Portable([self.0[3]; 4])
    }
}

/// Four lanes in an AVX2 register.
///
/// The force pass is 2.4 times faster on a contact than scalar code with it. Invariant: a value of
/// this type exists only inside functions compiled for AVX2, which are entered only after the
/// processor has been asked ([`has_avx2`]); every method is inlined into them.
#[cfg(target_arch = "x86_64")]
pub mod avx2 {
    use super::{Lane, Lanes4};
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
        #[inline(always)]
        fn any(mask: __m256d) -> bool {
            // SAFETY: the module's invariant: AVX2 is present.
            unsafe { _mm256_movemask_pd(mask) != 0 }
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
            // SAFETY: the module's invariant: AVX2 is present.
            Avx2(unsafe { _mm256_permute4x64_pd::<0xff>(self.0) })
        }
    }
}

/// Whether the four-wide registers of AVX2 may be used on this processor.
pub fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        std::arch::is_x86_feature_detected!("avx2")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
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

    #[test]
    fn portable_transposes_rows_to_columns() {
        let rows = std::array::from_fn(|r| Portable(std::array::from_fn(|c| (10 * r + c) as f64)));
        let columns = Portable::transpose(rows);
        assert_eq!(columns[2].0, [2.0, 12.0, 22.0, 32.0]);
    }
}
