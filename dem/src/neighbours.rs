//! Who may come to touch whom: a cell grid, a Verlet list with a skin, and how long it stays valid.
//!
//! Grains are kept sorted by cell, x fastest. All cells with the same (y, z) form a *row*: a
//! contiguous range of grains. The list holds all pairs closer than `R_i + R_j + skin`, each once,
//! i < j, ordered by i; it is valid as long as no two grains can have approached by more than the
//! skin.
//!
//! **How long is that?** Each row r gets a reference velocity w_r (the mean of its grains when the
//! list was built) and a travel bound `T_r = Σ dt max |v - w_r|`. Two grains of rows a and b can have
//! approached by at most `T_a + T_b + |w_a - w_b| t`. Rows up to two apart are checked against the
//! skin; with cells no narrower than a contact plus the skin, rows further apart are then safe by
//! the chain of rows between them. A flow as a whole, however fast, and its shear over distances
//! beyond two cells cost no rebuilds: only motion against the neighbourhood does. The bound needs no
//! stored positions and does not depend on threads.

use crate::domain::{Domain, Images};
use crate::grains::Grains;
use rayon::prelude::*;

/// Grains `start..end` share a (y, z) column of cells.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    pub start: u32,
    pub end: u32,
    /// Reference velocity w.
    pub drift: [f64; 3],
}

/// The cell grid as it was laid at the last build.
#[derive(Clone, Debug, Default)]
struct Grid {
    origin: [f64; 3],
    inverse_cell: [f64; 3],
    cells: [usize; 3],
    periodic: [bool; 3],
}

impl Grid {
    fn lay(grains: &Grains, domain: &Domain, reach: f64) -> Grid {
        let n = grains.len();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for x in &grains.place[..n] {
            for k in 0..3 {
                low[k] = low[k].min(x[k]);
                high[k] = high[k].max(x[k]);
            }
        }
        let mut grid = Grid {
            periodic: domain.periodic,
            ..Grid::default()
        };
        let lengths = domain.lengths();
        // Few grains in a large box, or a lone one far away, must not cost a grid of empty cells.
        let mut stretch = 1.0;
        loop {
            for k in 0..3 {
                let (from, length, size) = if domain.periodic[k] {
                    (domain.lower[k], lengths[k], reach * stretch)
                } else {
                    (low[k], (high[k] - low[k]).max(reach), reach * stretch)
                };
                grid.cells[k] = ((length / size) as usize).max(1);
                grid.origin[k] = from;
                grid.inverse_cell[k] = grid.cells[k] as f64 / length;
            }
            let count = grid.cells.iter().fold(1.0, |c, &m| c * m as f64);
            if count <= 8.0 * n as f64 + 4096.0 {
                return grid;
            }
            stretch *= 1.5;
        }
    }

    fn index(&self, x: &[f64; 4]) -> usize {
        let mut cell = [0; 3];
        for k in 0..3 {
            let c = (x[k] - self.origin[k]) * self.inverse_cell[k];
            cell[k] = (c.max(0.0) as usize).min(self.cells[k] - 1);
        }
        (cell[2] * self.cells[1] + cell[1]) * self.cells[0] + cell[0]
    }

    /// Distinct cell numbers within `reach` cells of `c` along an axis.
    fn around(&self, axis: usize, c: usize, reach: isize, into: &mut Vec<usize>) {
        into.clear();
        let n = self.cells[axis] as isize;
        for d in -reach..=reach {
            let mut m = c as isize + d;
            if self.periodic[axis] {
                m = m.rem_euclid(n);
            } else if m < 0 || m >= n {
                continue;
            }
            if !into.contains(&(m as usize)) {
                into.push(m as usize);
            }
        }
    }
}

/// Verlet list.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    /// Pairs of grain i: `first(i)..first[i + 1]`.
    pub first: Vec<u32>,
    /// The partner j > i of each pair.
    pub partner: Vec<u32>,
    pub rows: Vec<Row>,
    /// T of each row since the build (m).
    pub travel: Vec<f64>,
    /// Time since the build (s).
    pub age: f64,
    /// Row pairs up to two apart, a ≤ b.
    row_pairs: Vec<(u32, u32)>,
    grid: Grid,
    build: Build,
}

/// Buffers of a build, kept between builds.
#[derive(Clone, Debug, Default)]
struct Build {
    cell_first: Vec<u32>,
    order: Vec<u32>,
    new_index: Vec<u32>,
    parts: Vec<Part>,
}

/// Pairs found for a range of rows.
#[derive(Clone, Debug, Default)]
struct Part {
    rows: std::ops::Range<usize>,
    counts: Vec<u32>,
    partner: Vec<u32>,
    scratch: [Vec<usize>; 3],
}

/// Rows handled by one task of a build: small enough to share, large enough not to matter.
const ROWS_A_PART: usize = 16;

/// Parts that each thread works on between two times of putting results together.
const PARTS_A_THREAD: usize = 8;

impl Neighbours {
    /// Sorts the grains and lists all pairs closer than `R_i + R_j + skin`.
    pub fn build(
        &mut self,
        grains: &mut Grains,
        domain: &Domain,
        largest_radius: f64,
        skin: f64,
        parallel: bool,
    ) {
        let n = grains.len();
        for x in &mut grains.place[..n] {
            let wrapped = domain.wrap(crate::grains::vector(x));
            (x[0], x[1], x[2]) = (wrapped.x, wrapped.y, wrapped.z);
        }
        self.grid = Grid::lay(grains, domain, 2.0 * largest_radius + skin);
        self.sort(grains);
        self.lay_rows(grains);
        self.find_pairs(grains, domain, skin, parallel);
        self.age = 0.0;
    }

    /// Whether some pair outside the list may have come closer than the skin.
    pub fn outdated(&self, skin: f64) -> bool {
        outdated(&self.row_pairs, &self.rows, &self.travel, self.age, skin)
    }

    /// The same question for a shorter list that was made later from this one.
    pub fn outdated_since(&self, travel: &[f64], age: f64, skin: f64) -> bool {
        outdated(&self.row_pairs, &self.rows, travel, age, skin)
    }

    /// Partners j > i of grain i.
    pub fn partners(&self, i: usize) -> &[u32] {
        &self.partner[self.first[i] as usize..self.first[i + 1] as usize]
    }

    /// Where a grain of the previous order stands now.
    pub fn new_index(&self, old: u32) -> u32 {
        self.build.new_index[old as usize]
    }

    /// Number of cells along each axis; with the rows it restores the list's bookkeeping.
    pub fn cells(&self) -> [usize; 3] {
        self.grid.cells
    }

    /// Lays the bookkeeping of a list that was read back from a checkpoint.
    pub fn restore(&mut self, cells: [usize; 3], periodic: [bool; 3]) {
        self.grid.cells = cells;
        self.grid.periodic = periodic;
        self.pair_rows();
    }

    fn sort(&mut self, grains: &mut Grains) {
        let n = grains.len();
        let b = &mut self.build;
        let cells = self.grid.cells.iter().product::<usize>();
        // Cells first; each is replaced by its grain's new place.
        b.new_index.clear();
        b.new_index.reserve_exact(n);
        b.new_index
            .extend(grains.place[..n].iter().map(|x| self.grid.index(x) as u32));
        b.cell_first.clear();
        // Counted two places on: filling moves each cell's start to its end, one place on.
        b.cell_first.resize(cells + 2, 0);
        for &c in &b.new_index {
            b.cell_first[c as usize + 2] += 1;
        }
        for c in 2..cells + 2 {
            b.cell_first[c] += b.cell_first[c - 1];
        }
        b.order.clear();
        b.order.resize(n, 0);
        for (old, place) in b.new_index.iter_mut().enumerate() {
            let next = &mut b.cell_first[*place as usize + 1];
            *place = *next;
            *next += 1;
            b.order[*place as usize] = old as u32;
        }
        b.cell_first.truncate(cells + 1);
        grains.reorder(&b.order);
    }

    fn lay_rows(&mut self, grains: &Grains) {
        let [nx, ny, nz] = self.grid.cells;
        self.rows.clear();
        for row in 0..ny * nz {
            let start = self.build.cell_first[row * nx];
            let end = self.build.cell_first[(row + 1) * nx];
            let mut drift = [0.0; 3];
            for v in &grains.motion[start as usize..end as usize] {
                for k in 0..3 {
                    drift[k] += v[k];
                }
            }
            if end > start {
                drift = drift.map(|d| d / (end - start) as f64);
            } else if row >= ny {
                // An empty row links its neighbours in the chain of the bound: any value is right,
                // a value like theirs is tight.
                drift = self.rows[row - ny].drift;
            }
            self.rows.push(Row { start, end, drift });
        }
        self.travel.clear();
        self.travel.resize(self.rows.len(), 0.0);
        self.pair_rows();
    }

    fn pair_rows(&mut self) {
        let [_, ny, nz] = self.grid.cells;
        self.row_pairs.clear();
        let (mut ys, mut zs) = (Vec::new(), Vec::new());
        for z in 0..nz {
            for y in 0..ny {
                let a = z * ny + y;
                self.grid.around(2, z, 2, &mut zs);
                self.grid.around(1, y, 2, &mut ys);
                for &zb in &zs {
                    for &yb in &ys {
                        let b = zb * ny + yb;
                        if b >= a {
                            self.row_pairs.push((a as u32, b as u32));
                        }
                    }
                }
            }
        }
    }

    fn find_pairs(&mut self, grains: &Grains, domain: &Domain, skin: f64, parallel: bool) {
        let rows = self.rows.len();
        let mut parts = std::mem::take(&mut self.build.parts);
        let threads = if parallel {
            rayon::current_num_threads()
        } else {
            1
        };
        // A few parts at a time, so that pairs are not held twice.
        parts.resize_with((PARTS_A_THREAD * threads).max(1), Part::default);
        self.first.clear();
        self.first.push(0);
        self.partner.clear();
        let (grid, first) = (&self.grid, &self.build.cell_first);
        let search = |part: &mut Part| search_rows(part, grid, first, grains, domain, skin);
        let mut total = 0;
        for group in (0..rows).step_by(ROWS_A_PART * parts.len()) {
            for (p, part) in parts.iter_mut().enumerate() {
                let from = (group + p * ROWS_A_PART).min(rows);
                part.rows = from..(from + ROWS_A_PART).min(rows);
            }
            if threads > 1 {
                parts.par_iter_mut().for_each(search);
            } else {
                parts.iter_mut().for_each(search);
            }
            for part in &parts {
                for &count in &part.counts {
                    total += count;
                    self.first.push(total);
                }
                self.partner.extend_from_slice(&part.partner);
            }
        }
        self.build.parts = parts;
    }
}

fn outdated(pairs: &[(u32, u32)], rows: &[Row], travel: &[f64], age: f64, skin: f64) -> bool {
    pairs.iter().any(|&(a, b)| {
        let (ra, rb) = (&rows[a as usize], &rows[b as usize]);
        let d: [f64; 3] = std::array::from_fn(|k| ra.drift[k] - rb.drift[k]);
        let apart = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt() * age;
        let approach = travel[a as usize] + travel[b as usize] + apart;
        approach > skin || approach.is_nan()
    })
}

fn search_rows(
    part: &mut Part,
    grid: &Grid,
    first: &[u32],
    grains: &Grains,
    domain: &Domain,
    skin: f64,
) {
    let [nx, ny, _] = grid.cells;
    let images = Images::of(domain);
    part.counts.clear();
    part.partner.clear();
    let [xs, ys, zs] = &mut part.scratch;
    for row in part.rows.clone() {
        grid.around(1, row % ny, 1, ys);
        grid.around(2, row / ny, 1, zs);
        for x in 0..nx {
            grid.around(0, x, 1, xs);
            let cell = row * nx + x;
            for i in first[cell]..first[cell + 1] {
                let before = part.partner.len();
                let xi = &grains.place[i as usize];
                let reach = xi[3] + skin;
                let held = grains.motion[i as usize][3] == 0.0;
                for &z in zs.iter() {
                    for &y in ys.iter() {
                        for &xc in xs.iter() {
                            let other = (z * ny + y) * nx + xc;
                            let from = first[other].max(i + 1);
                            for j in from..first[other + 1].max(from) {
                                let xj = &grains.place[j as usize];
                                let r2 = images.distance_squared(xi, xj);
                                let near = reach + xj[3];
                                // Two fixed grains have nothing to say to each other.
                                let idle = held && grains.motion[j as usize][3] == 0.0;
                                if r2 < near * near && !idle {
                                    part.partner.push(j);
                                }
                            }
                        }
                    }
                }
                part.counts.push((part.partner.len() - before) as u32);
            }
        }
    }
}
