//! How long a list of pairs stays valid.
//!
//! Each row r has a reference velocity w_r (the mean of its grains when the list was built) and a
//! travel bound `T_r = Σ dt max |v - w_r|`. Grains of rows a and b can have approached each other by
//! at most `T_a + T_b + |w_a - w_b| t`.
//!
//! **One level.** Rows up to two apart are checked against the skin. With cells no narrower than a
//! contact plus the skin, rows further apart are then safe by the chain of rows between them: each
//! link of it uses up at most a skin, and each link more is a cell more to go.
//!
//! **Two levels.** A row a of finer grains is checked against the rows of coarser grains that it is
//! in or beside: these may be one skin away from a contact. Rows B two coarse cells away have a whole
//! cell w between, so their grains may approach by `w - R_a - R_B`, which is no less than the skin,
//! with the largest radii of both levels; empty rows are checked in the same way. Any coarse row
//! further away is safe by the chain from a over such a row.
//!
//! A flow as a whole, however fast, costs no rebuilds: only motion against the neighbourhood does. The
//! bound needs no stored positions and does not depend on threads.

use crate::neighbours::{Level, Row};

/// Two rows whose grains may come to touch, and by how much more than the skin they may approach (m).
#[derive(Clone, Copy, Debug)]
struct Pair {
    a: u32,
    b: u32,
    slack: f64,
}

/// The pairs of rows to be watched.
#[derive(Clone, Debug, Default)]
pub(crate) struct Watch {
    pairs: Vec<Pair>,
    /// Largest |w_a - w_b| of all pairs (m/s).
    shear: f64,
    scratch: Scratch,
}

/// Cell numbers across rows, and rows.
#[derive(Clone, Debug, Default)]
struct Scratch {
    fast: Vec<usize>,
    slow: Vec<usize>,
    near: Vec<usize>,
}

/// By how much grains of any two rows may still approach before the pairs are looked at again (m).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Allowance(f64);

impl Watch {
    /// Finds the pairs of rows; levels are ordered from fine to coarse.
    pub fn lay(&mut self, levels: &[Level], rows: &[Row]) {
        self.pairs.clear();
        let mut scratch = std::mem::take(&mut self.scratch);
        for (l, level) in levels.iter().enumerate() {
            for row in 0..level.grid.rows() {
                let a = (level.first_row + row) as u32;
                let [m, s] = level.grid.row(row);
                let [across_m, across_s] = level.grid.across;
                level.grid.around(across_m, [m, m], 2, &mut scratch.fast);
                level.grid.around(across_s, [s, s], 2, &mut scratch.slow);
                for &s in &scratch.slow {
                    for &m in &scratch.fast {
                        let b = (level.first_row + level.grid.row_at([m, s])) as u32;
                        if b >= a {
                            self.pairs.push(Pair { a, b, slack: 0.0 });
                        }
                    }
                }
                if rows[a as usize].is_empty() {
                    continue;
                }
                for coarse in &levels[l + 1..] {
                    self.watch_coarser(level, row, coarse, rows, &mut scratch);
                }
            }
        }
        self.scratch = scratch;
        self.shear = 0.0;
        for pair in &self.pairs {
            self.shear = self.shear.max(shear(pair, rows));
        }
    }

    fn watch_coarser(
        &mut self,
        level: &Level,
        row: usize,
        coarse: &Level,
        rows: &[Row],
        scratch: &mut Scratch,
    ) {
        let Scratch { fast, slow, near } = scratch;
        let a = (level.first_row + row) as u32;
        let axes = level.grid.across;
        let cells = level.grid.row(row);
        // The two grids may count their axes in a different order.
        let mut beside = [[0; 2]; 3];
        for (axis, cell) in axes.into_iter().zip(cells) {
            beside[axis] = coarse.grid.beside(axis, &level.grid, cell);
        }
        let [across_m, across_s] = coarse.grid.across;
        let slack = coarse.grid.width() - level.radius - coarse.radius - coarse.skin;
        coarse.grid.around(across_m, beside[across_m], 1, fast);
        coarse.grid.around(across_s, beside[across_s], 1, slow);
        near.clear();
        for &s in slow.iter() {
            for &m in fast.iter() {
                near.push(coarse.grid.row_at([m, s]));
            }
        }
        coarse.grid.around(across_m, beside[across_m], 2, fast);
        coarse.grid.around(across_s, beside[across_s], 2, slow);
        for &s in slow.iter() {
            for &m in fast.iter() {
                let other = coarse.grid.row_at([m, s]);
                let b = (coarse.first_row + other) as u32;
                let beside = near.contains(&other);
                if beside && rows[b as usize].is_empty() {
                    continue;
                }
                let slack = if beside { 0.0 } else { slack.max(0.0) };
                self.pairs.push(Pair { a, b, slack });
            }
        }
    }

    /// Whether some two grains may have approached by more than the skin; the allowance tells when
    /// that has to be looked at again.
    pub fn outdated(
        &self,
        rows: &[Row],
        travel: &[f64],
        age: f64,
        skin: f64,
        allowance: &mut Allowance,
    ) -> bool {
        if allowance.0 > 0.0 {
            return false;
        }
        let mut left = f64::INFINITY;
        for pair in &self.pairs {
            let (a, b) = (pair.a as usize, pair.b as usize);
            let approach = travel[a] + travel[b] + shear(pair, rows) * age;
            let rest = skin + pair.slack - approach;
            if rest < 0.0 || rest.is_nan() {
                return true;
            }
            left = left.min(rest);
        }
        // Less a hair, so that round-off never decides.
        *allowance = Allowance(left - 1e-9 * skin);
        false
    }

    /// Takes a step off an allowance: `farthest` is the largest travel of any row in it.
    pub fn spend(&self, allowance: &mut Allowance, farthest: f64, dt: f64) {
        let rest = allowance.0 - 2.0 * farthest - self.shear * dt;
        // Not a number must lead to a look.
        allowance.0 = if rest > 0.0 { rest } else { 0.0 };
    }
}

#[inline(always)]
fn shear(pair: &Pair, rows: &[Row]) -> f64 {
    let (a, b) = (&rows[pair.a as usize].drift, &rows[pair.b as usize].drift);
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
}
