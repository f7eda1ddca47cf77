//! Smoother: for one cell after the other, its pressure and the velocities on its faces together.

use super::Columns;
use crate::linear_solver::Place;

/// Blocks of unknowns that are solved for together, with the inverses of their matrices.
pub(super) struct CellBlocks {
    starts: Vec<u32>,
    unknowns: Vec<u32>,
    /// Where the inverse of a block begins.
    places: Vec<u32>,
    inverses: Vec<f64>,
    /// Place of an unknown in the present block.
    slot: Vec<u32>,
    definite: usize,
    scratch: Vec<f64>,
    work: Vec<f64>,
    step: Vec<f64>,
}

const NONE: u32 = u32::MAX;
/// Least share of what a pressure does to its own cell without friction.
const WEAKEST: f64 = 0.2;
/// Part of a block's solution that is added.
const RELAXATION: f64 = 0.8;

impl CellBlocks {
    /// Blocks of all cells; velocities of no cell are blocks of their own.
    pub(super) fn new<const D: usize>(
        matrix: &Columns,
        definite: usize,
        places: &[Place<D>],
        is_finest: bool,
    ) -> Self {
        let size = matrix.size();
        let mut faces: Vec<Vec<u32>> = vec![Vec::new(); size - definite];
        let mut lone = Vec::new();
        for j in 0..definite {
            let mut is_lone = true;
            let (rows, _) = matrix.column(j);
            for &row in rows.iter().filter(|row| **row as usize >= definite) {
                let apart = places[j].iter().zip(&places[row as usize]);
                let apart: u32 = apart.map(|(a, b)| a.abs_diff(*b)).sum();
                if is_finest || apart == 1 {
                    faces[row as usize - definite].push(j as u32);
                    is_lone = false;
                }
            }
            if is_lone {
                lone.push(j as u32);
            }
        }
        let mut blocks = Self {
            starts: vec![0],
            unknowns: Vec::new(),
            places: vec![0],
            inverses: Vec::new(),
            slot: vec![NONE; size],
            definite,
            scratch: Vec::new(),
            work: Vec::new(),
            step: Vec::new(),
        };
        for j in lone {
            blocks.push(&[j]);
        }
        for (cell, mut faces) in faces.into_iter().enumerate() {
            faces.push((definite + cell) as u32);
            blocks.push(&faces);
        }
        let end = blocks.places.last().copied().unwrap_or(0);
        blocks.inverses = vec![0.0; end as usize];
        blocks
    }

    fn push(&mut self, unknowns: &[u32]) {
        self.unknowns.extend(unknowns);
        self.starts.push(self.unknowns.len() as u32);
        let end = self.places.last().copied().unwrap_or(0);
        self.places
            .push(end + (unknowns.len() * unknowns.len()) as u32);
    }

    /// Makes the inverses.
    pub(super) fn invert(&mut self, matrix: &Columns) {
        for b in 0..self.starts.len() - 1 {
            let members = &self.unknowns[self.starts[b] as usize..self.starts[b + 1] as usize];
            let n = members.len();
            for (k, &j) in members.iter().enumerate() {
                self.slot[j as usize] = k as u32;
            }
            self.work.clear();
            self.work.resize(n * n, 0.0);
            for (column, &j) in members.iter().enumerate() {
                let (rows, values) = matrix.column(j as usize);
                for (&row, value) in rows.iter().zip(values) {
                    let slot = self.slot[row as usize];
                    if slot != NONE {
                        self.work[slot as usize + n * column] = *value;
                    }
                }
            }
            let inverse = &mut self.inverses[self.places[b] as usize..self.places[b + 1] as usize];
            let has_pressure = members.last().is_some_and(|&j| j as usize >= self.definite);
            invert_block(&self.work, inverse, n, has_pressure, &mut self.scratch);
            for &j in members {
                self.slot[j as usize] = NONE;
            }
        }
    }

    #[inline]
    fn relax(&mut self, b: usize, matrix: &Columns, residual: &mut [f64], solution: &mut [f64]) {
        let members = &self.unknowns[self.starts[b] as usize..self.starts[b + 1] as usize];
        let n = members.len();
        let inverse = &self.inverses[self.places[b] as usize..self.places[b + 1] as usize];
        self.step.clear();
        self.step.resize(n, 0.0);
        for (k, &j) in members.iter().enumerate() {
            let r = RELAXATION * residual[j as usize];
            for (step, a) in self.step.iter_mut().zip(&inverse[k * n..(k + 1) * n]) {
                *step += a * r;
            }
        }
        for (&j, &step) in members.iter().zip(&self.step) {
            solution[j as usize] += step;
            let (rows, values) = matrix.column(j as usize);
            for (&row, value) in rows.iter().zip(values) {
                residual[row as usize] -= value * step;
            }
        }
    }

    pub(super) fn sweep_forward(
        &mut self,
        matrix: &Columns,
        residual: &mut [f64],
        solution: &mut [f64],
    ) {
        for b in 0..self.starts.len() - 1 {
            self.relax(b, matrix, residual, solution);
        }
    }

    pub(super) fn sweep_backward(
        &mut self,
        matrix: &Columns,
        residual: &mut [f64],
        solution: &mut [f64],
    ) {
        for b in (0..self.starts.len() - 1).rev() {
            self.relax(b, matrix, residual, solution);
        }
    }
}

/// Inverse of [[K, b], [c, d]] (by columns), or of K alone where there is no pressure.
///
/// Where friction takes so much of what a pressure does that it hardly moves its own cell, the block is next to
/// singular: there the pressure is taken to act as the divergence does, b = cᵀ.
fn invert_block(
    a: &[f64],
    inverse: &mut [f64],
    n: usize,
    has_pressure: bool,
    scratch: &mut Vec<f64>,
) {
    if !has_pressure {
        inverse.copy_from_slice(a);
        invert_definite(inverse, n, n);
        return;
    }
    let m = n - 1;
    // K⁻¹ stands in the upper left part of the inverse.
    inverse.fill(0.0);
    for j in 0..m {
        inverse[j * n..j * n + m].copy_from_slice(&a[j * n..j * n + m]);
    }
    invert_definite(inverse, m, n);
    scratch.clear();
    scratch.resize(2 * m, 0.0);
    let (by_c, by_b) = scratch.split_at_mut(m);
    let c = |j: usize| a[j * n + m];
    for j in 0..m {
        for i in 0..m {
            by_c[i] += inverse[j * n + i] * c(j);
            by_b[i] += inverse[j * n + i] * a[m * n + j];
        }
    }
    let symmetric: f64 = (0..m).map(|j| c(j) * by_c[j]).sum();
    let mut product: f64 = (0..m).map(|j| c(j) * by_b[j]).sum();
    let d = a[n * n - 1];
    if d == 0.0 && product <= WEAKEST * symmetric {
        product = symmetric;
        by_b.copy_from_slice(by_c);
    }
    let pivot = d - product;
    if pivot == 0.0 {
        return;
    }
    for j in 0..m {
        for i in 0..m {
            inverse[j * n + i] += by_b[i] * by_c[j] / pivot;
        }
        inverse[j * n + m] = -by_c[j] / pivot;
    }
    for i in 0..m {
        inverse[m * n + i] = -by_b[i] / pivot;
    }
    inverse[n * n - 1] = 1.0 / pivot;
}

/// Overwrites the first m columns of a symmetric positive definite matrix, kept n apart, with those of its inverse
/// (Gauss and Jordan in place). A column without a positive pivot gives zero.
fn invert_definite(a: &mut [f64], m: usize, n: usize) {
    for k in 0..m {
        let pivot = a[k * n + k];
        let inverse = if pivot > 0.0 { 1.0 / pivot } else { 0.0 };
        a[k * n + k] = 1.0;
        for j in 0..m {
            a[j * n + k] *= inverse;
        }
        for i in (0..m).filter(|&i| i != k) {
            let factor = a[k * n + i];
            a[k * n + i] = 0.0;
            for j in 0..m {
                a[j * n + i] -= factor * a[j * n + k];
            }
        }
    }
}
