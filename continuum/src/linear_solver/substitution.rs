//! Forward and backward substitution through supernodal LDLᵀ factors for one right-hand side.
//!
//! Supernodes of plane problems have a few columns, so a general matrix product costs more in
//! dispatch than in arithmetic; plain loops over the columns are several times faster. Sums run in
//! one order.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// Overwrites x with (L D Lᵀ)⁻¹ x, in the order of the factors. D stands on the diagonal of the
/// blocks of L. The bits are the same on every processor.
pub(super) fn substitute(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    values: &[f32],
    x: &mut [f64],
    work: &mut Vec<f64>,
) {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx512f")
            && std::arch::is_x86_feature_detected!("avx512vl")
        {
            // SAFETY: the processor has been asked for AVX-512 F and VL.
            return unsafe { substitute_avx512(symbolic, values, x, work) };
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has been asked for AVX2.
            return unsafe { substitute_avx2(symbolic, values, x, work) };
        }
    }
    substitute_plainly(symbolic, values, x, work);
}

/// The substitution compiled for AVX2.
///
/// # Safety
/// The processor must have AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn substitute_avx2(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    values: &[f32],
    x: &mut [f64],
    work: &mut Vec<f64>,
) {
    substitute_plainly(symbolic, values, x, work);
}

/// The substitution compiled for AVX-512.
///
/// # Safety
/// The processor must have AVX-512 (F, VL).
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512vl")]
unsafe fn substitute_avx512(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    values: &[f32],
    x: &mut [f64],
    work: &mut Vec<f64>,
) {
    substitute_plainly(symbolic, values, x, work);
}

#[inline(always)]
fn substitute_plainly(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    values: &[f32],
    x: &mut [f64],
    work: &mut Vec<f64>,
) {
    let (begins, ends) = (symbolic.supernode_begin(), symbolic.supernode_end());
    let places = symbolic.col_ptr_for_val();
    let count = symbolic.n_supernodes();
    for s in 0..count {
        let columns = ends[s] - begins[s];
        let pattern = symbolic.supernode(s).pattern();
        let block = &values[places[s]..places[s + 1]];
        let rows = columns + pattern.len();
        if columns == 1 {
            let value = x[begins[s]];
            for (&row, l) in pattern.iter().zip(&block[1..]) {
                x[row] -= f64::from(*l) * value;
            }
            continue;
        }
        let top = &mut x[begins[s]..ends[s]];
        work.clear();
        work.resize(pattern.len(), 0.0);
        for j in 0..columns {
            let column = &block[j * rows..(j + 1) * rows];
            let value = top[j];
            for (x, l) in top[j + 1..].iter_mut().zip(&column[j + 1..columns]) {
                *x -= f64::from(*l) * value;
            }
            for (w, l) in work.iter_mut().zip(&column[columns..]) {
                *w += f64::from(*l) * value;
            }
        }
        for (&row, w) in pattern.iter().zip(work.iter()) {
            x[row] -= w;
        }
    }
    for s in (0..count).rev() {
        let columns = ends[s] - begins[s];
        let pattern = symbolic.supernode(s).pattern();
        let block = &values[places[s]..places[s + 1]];
        let rows = columns + pattern.len();
        if columns == 1 {
            let outer = pattern.iter().zip(&block[1..]);
            let outer: f64 = outer.map(|(&row, l)| f64::from(*l) * x[row]).sum();
            x[begins[s]] = x[begins[s]] / f64::from(block[0]) - outer;
            continue;
        }
        work.clear();
        work.extend(pattern.iter().map(|&row| x[row]));
        let top = &mut x[begins[s]..ends[s]];
        for j in (0..columns).rev() {
            let column = &block[j * rows..(j + 1) * rows];
            let inner = dot(&column[j + 1..columns], &top[j + 1..]);
            let outer = dot(&column[columns..], work);
            top[j] = top[j] / f64::from(column[j]) - inner - outer;
        }
    }
}

/// Σ a b in eight strands, so that additions need not wait for each other.
#[inline(always)]
fn dot(a: &[f32], b: &[f64]) -> f64 {
    let mut strands = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8
        .remainder()
        .iter()
        .zip(b8.remainder())
        .map(|(a, b)| f64::from(*a) * b)
        .sum();
    for (a, b) in a8.zip(b8) {
        for (strand, (a, b)) in strands.iter_mut().zip(a.iter().zip(b)) {
            *strand += f64::from(*a) * b;
        }
    }
    let [a, b, c, d, e, f, g, h] = strands;
    ((a + b) + (c + d)) + ((e + f) + (g + h)) + rest
}
