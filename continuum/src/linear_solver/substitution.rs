//! Forward and backward substitution through supernodal LDLᵀ factors for one right-hand side.
//!
//! Supernodes of plane problems have a few columns, so a general matrix product costs more in
//! dispatch than in arithmetic; plain loops over the columns are several times faster. Sums run in
//! one order.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// Overwrites x with (L D Lᵀ)⁻¹ x, in the order of the factors. D stands on the diagonal of the
/// blocks of L.
pub(super) fn substitute(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    values: &[f64],
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
        let top = &mut x[begins[s]..ends[s]];
        work.clear();
        work.resize(pattern.len(), 0.0);
        for j in 0..columns {
            let column = &block[j * rows..(j + 1) * rows];
            let value = top[j];
            for (x, l) in top[j + 1..].iter_mut().zip(&column[j + 1..columns]) {
                *x -= l * value;
            }
            for (w, l) in work.iter_mut().zip(&column[columns..]) {
                *w += l * value;
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
        work.clear();
        work.extend(pattern.iter().map(|&row| x[row]));
        let top = &mut x[begins[s]..ends[s]];
        for j in (0..columns).rev() {
            let column = &block[j * rows..(j + 1) * rows];
            let inner = dot(&column[j + 1..columns], &top[j + 1..]);
            let outer = dot(&column[columns..], work);
            top[j] = top[j] / column[j] - inner - outer;
        }
    }
}

/// Σ a b in four strands, so that additions need not wait for each other.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut strands = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4
        .remainder()
        .iter()
        .zip(b4.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a4.zip(b4) {
        for (strand, (a, b)) in strands.iter_mut().zip(a.iter().zip(b)) {
            *strand += a * b;
        }
    }
    (strands[0] + strands[1]) + (strands[2] + strands[3]) + rest
}
