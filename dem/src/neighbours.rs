//! Who may come to touch whom: cell grids and a Verlet list with a skin.
//!
//! Grains are sorted into *levels* by size, a factor of two each and the finest first, so that a few
//! large grains do not widen the cells of all small ones. Within a level they are kept sorted by
//! cell. All cells along one axis form a *row* (`grid.rs`): a contiguous range of grains. Grains of one level
//! find each other in their own grid; each grain finds larger ones in the coarser grids, whose cells
//! are wide enough. Grains of similar size make one level.
//!
//! The list holds all pairs closer than `R_i + R_j + skin`, each once, i < j, ordered by i; it is valid
//! as long as no two grains can have approached by more than the skin: see `validity.rs`.

use crate::clumps::ALONE;
use crate::domain::{Cell, Images};
use crate::grains::Grains;
use crate::grid::Grid;
use crate::validity::{Allowance, Watch};
use rayon::prelude::*;
use std::ops::Range;

/// Grains `start..end` share a row of cells.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    pub start: u32,
    pub end: u32,
    /// Reference velocity w (m/s).
    pub drift: [f64; 3],
}

impl Row {
    /// Whether no grain is in it.
    pub fn is_empty(&self) -> bool {
        self.start == self.end
    }
}

/// Grains of similar size and their grid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Level {
    pub grid: Grid,
    pub first_row: usize,
    /// Largest radius (m).
    pub radius: f64,
    /// Skin of the list (m).
    pub skin: f64,
    first_cell: usize,
    count: usize,
}

/// Verlet list.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    /// Pairs of grain i: `first(i)..first[i + 1]`.
    pub first: Vec<u32>,
    /// The partner j > i of each pair.
    pub partner: Vec<u32>,
    /// Rows of all levels.
    pub rows: Vec<Row>,
    /// Travel of each row since the build (m).
    pub travel: Vec<f64>,
    /// Time since the build (s).
    pub age: f64,
    pub allowance: Allowance,
    pub levels: Vec<Level>,
    pub watch: Watch,
    /// Clump of each grain by number: pairs of one clump are left out. Empty where there are none.
    pub clumps: Vec<u32>,
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
    rows: Range<usize>,
    counts: Vec<u32>,
    partner: Vec<u32>,
    /// Cells around, along rows and the two axes across.
    around: [Vec<usize>; 3],
}

/// Rows handled by one task of a build: small enough to share, large enough not to matter.
const ROWS_A_PART: usize = 16;

/// Parts that each thread works on between two times of putting results together.
const PARTS_A_THREAD: usize = 8;

/// Pairs of a grain that room is made for at first: pages that are never written take no memory.
const PAIRS_EXPECTED: usize = 6;

/// More levels than a size ratio of a million needs.
const LEVELS: usize = 24;

impl Neighbours {
    /// Sorts the grains and lists all pairs closer than `R_i + R_j + skin`.
    pub fn build(&mut self, grains: &mut Grains, cell: &Cell, skin: f64, parallel: bool) {
        let n = grains.len();
        for x in &mut grains.place[..n] {
            let (wrapped, _) = cell.wrap(crate::grains::vector(x));
            (x[0], x[1], x[2]) = (wrapped.x, wrapped.y, wrapped.z);
        }
        self.sort(grains, cell, skin);
        self.lay_rows(grains);
        self.find_pairs(grains, cell, skin, parallel);
        self.age = 0.0;
    }

    /// Whether some pair outside the list may have come closer than the skin.
    pub fn outdated(&mut self, skin: f64) -> bool {
        let (rows, allowance) = (&self.rows, &mut self.allowance);
        self.watch
            .outdated(rows, &self.travel, self.age, skin, allowance)
    }

    /// Partners j > i of grain i.
    pub fn partners(&self, i: usize) -> &[u32] {
        &self.partner[self.first[i] as usize..self.first[i + 1] as usize]
    }

    /// How many pairs have their lower grain among these.
    pub fn count(&self, grains: &Range<usize>) -> usize {
        (self.first[grains.end] - self.first[grains.start]) as usize
    }

    /// Where a grain of the previous order stands now.
    pub fn new_index(&self, old: u32) -> u32 {
        self.build.new_index[old as usize]
    }

    /// Rows of a level.
    pub fn rows_of(&self, level: usize) -> Range<usize> {
        let end = self.levels.get(level + 1);
        self.levels[level].first_row..end.map_or(self.rows.len(), |l| l.first_row)
    }

    /// Lays the bookkeeping of a list that was read back from a checkpoint.
    pub fn restore(&mut self, levels: Vec<Level>) {
        self.levels = levels;
        self.watch.lay(&self.levels, &self.rows);
        self.allowance = Allowance::default();
    }

    /// Lays the levels' grids.
    fn lay_levels(&mut self, grains: &Grains, cell: &Cell, skin: f64) -> Sizes {
        let domain = &cell.domain;
        let place = &grains.place[..grains.len()];
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
        for x in place {
            for k in 0..3 {
                low[k] = low[k].min(x[k]);
                high[k] = high[k].max(x[k]);
            }
            (smallest, largest) = (smallest.min(x[3]), largest.max(x[3]));
        }
        let mut sizes = Sizes {
            largest,
            several: largest >= 2.0 * smallest,
            level: [0; LEVELS],
        };
        let (mut radius, mut count) = ([0.0_f64; LEVELS], [0; LEVELS]);
        for x in place {
            let class = sizes.class(x[3]);
            radius[class] = radius[class].max(x[3]);
            count[class] += 1;
        }
        if place.is_empty() {
            (radius[0], count[0]) = (1.0, 1);
        }
        self.levels.clear();
        let (mut first_cell, mut first_row) = (0, 0);
        for class in (0..LEVELS).rev().filter(|&c| count[c] > 0) {
            let reach = 2.0 * radius[class] + skin;
            let mut grid = Grid::lay(count[class], [low, high], domain, reach);
            match self.levels.first() {
                // All levels count their axes alike, so that their rows can be dealt out together.
                Some(finest) => (grid.along, grid.across) = (finest.grid.along, finest.grid.across),
                None => grid.order_axes(Images::of(cell).sheared().is_some()),
            }
            sizes.level[class] = self.levels.len();
            let (cells, rows) = (grid.cells.iter().product::<usize>(), grid.rows());
            self.levels.push(Level {
                grid,
                first_row,
                radius: radius[class],
                skin,
                first_cell,
                count: cells,
            });
            first_cell += cells;
            first_row += rows;
        }
        sizes
    }

    fn sort(&mut self, grains: &mut Grains, cell: &Cell, skin: f64) {
        let sizes = self.lay_levels(grains, cell, skin);
        let n = grains.len();
        let b = &mut self.build;
        let cells = self.levels.iter().map(|l| l.count).sum::<usize>();
        // Cells first; each is replaced by its grain's new place.
        b.new_index.clear();
        b.new_index.reserve_exact(n);
        for x in &grains.place[..n] {
            let level = &self.levels[sizes.level[sizes.class(x[3])]];
            b.new_index
                .push((level.first_cell + level.grid.index(x)) as u32);
        }
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
        self.rows.clear();
        for level in &self.levels {
            let nx = level.grid.row_cells();
            for row in 0..level.grid.rows() {
                let cell = level.first_cell + row * nx;
                let start = self.build.cell_first[cell];
                let end = self.build.cell_first[cell + nx];
                let mut drift = [0.0; 3];
                for v in &grains.motion[start as usize..end as usize] {
                    for k in 0..3 {
                        drift[k] += v[k];
                    }
                }
                if end > start {
                    drift = drift.map(|d| d / f64::from(end - start));
                }
                self.rows.push(Row { start, end, drift });
            }
        }
        self.drift_of_empty_rows();
        self.travel.clear();
        self.travel.resize(self.rows.len(), 0.0);
        self.watch.lay(&self.levels, &self.rows);
        self.allowance = Allowance::default();
    }

    /// An empty row links its neighbours in the chain of the bound: any value is right, a value like
    /// theirs is tight. It is that of the finest grains in its place, or of the row before.
    fn drift_of_empty_rows(&mut self) {
        for l in 0..self.levels.len() {
            let (level, finest) = (&self.levels[l], &self.levels[0]);
            let layer = level.grid.cells[level.grid.across[0]];
            for row in 0..level.grid.rows() {
                let at = level.first_row + row;
                if !self.rows[at].is_empty() {
                    continue;
                }
                if l > 0 {
                    let cells = level.grid.row(row);
                    let mut center = [0; 3];
                    for (axis, cell) in level.grid.across.into_iter().zip(cells) {
                        let grid = &level.grid;
                        let x = grid.origin[axis] + (cell as f64 + 0.5) / grid.inverse_cell[axis];
                        center[axis] = finest.grid.coordinate(axis, x);
                    }
                    let fine = finest
                        .grid
                        .row_at(finest.grid.across.map(|axis| center[axis]));
                    self.rows[at].drift = self.rows[fine].drift;
                } else if row >= layer {
                    self.rows[at].drift = self.rows[at - layer].drift;
                }
            }
        }
    }

    fn find_pairs(&mut self, grains: &Grains, cell: &Cell, skin: f64, parallel: bool) {
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
        self.first.reserve_exact(grains.len() + 1);
        self.first.push(0);
        self.partner.clear();
        self.partner.reserve_exact(PAIRS_EXPECTED * grains.len());
        let finder = Finder {
            levels: &self.levels,
            first: &self.build.cell_first,
            grains,
            images: Images::of(cell),
            skin,
            clumps: &self.clumps,
        };
        let mut total = 0;
        for group in (0..rows).step_by(ROWS_A_PART * parts.len()) {
            for (p, part) in parts.iter_mut().enumerate() {
                let from = (group + p * ROWS_A_PART).min(rows);
                part.rows = from..(from + ROWS_A_PART).min(rows);
            }
            if threads > 1 {
                parts.par_iter_mut().for_each(|part| finder.search(part));
            } else {
                parts.iter_mut().for_each(|part| finder.search(part));
            }
            let found = parts.iter().map(|part| part.partner.len()).sum::<usize>();
            if self.partner.capacity() - self.partner.len() < found {
                // Growing by doubling would take twice what is needed.
                self.partner
                    .reserve_exact(found.max(self.partner.len() / 8));
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

/// Classes of size: class c holds radii between `largest/2^(c+1)` and `largest/2^c`.
struct Sizes {
    largest: f64,
    several: bool,
    /// The level of each class that has grains.
    level: [usize; LEVELS],
}

impl Sizes {
    fn class(&self, radius: f64) -> usize {
        if self.several {
            ((self.largest / radius).log2() as usize).min(LEVELS - 1)
        } else {
            0
        }
    }
}

/// What a search reads.
struct Finder<'a> {
    levels: &'a [Level],
    first: &'a [u32],
    grains: &'a Grains,
    images: Images,
    skin: f64,
    clumps: &'a [u32],
}

impl Finder<'_> {
    fn search(&self, part: &mut Part) {
        part.counts.clear();
        part.partner.clear();
        for row in part.rows.clone() {
            let l = self.levels.partition_point(|l| l.first_row <= row) - 1;
            let level = &self.levels[l];
            let across = level.grid.row(row - level.first_row);
            level.around_row(across, &mut part.around);
            let (nx, along) = (level.grid.row_cells(), level.grid.along);
            let cell = level.first_cell + (row - level.first_row) * nx;
            for x in 0..nx {
                level.grid.around(along, [x, x], 1, &mut part.around[0]);
                for i in self.first[cell + x]..self.first[cell + x + 1] {
                    let before = part.partner.len();
                    self.scan(level, i, &part.around, &mut part.partner);
                    if l + 1 < self.levels.len() {
                        self.scan_coarser(l, i, part);
                        let at = &self.grains.place[i as usize];
                        // The cells of its own level are needed again.
                        level.around_row(across, &mut part.around);
                        let x = level.grid.coordinate(along, at[along]);
                        level.grid.around(along, [x, x], 1, &mut part.around[0]);
                    }
                    part.counts.push((part.partner.len() - before) as u32);
                }
            }
        }
    }

    fn scan_coarser(&self, l: usize, i: u32, part: &mut Part) {
        let at = &self.grains.place[i as usize];
        for coarse in &self.levels[l + 1..] {
            let grid = &coarse.grid;
            let across = grid.across.map(|axis| grid.coordinate(axis, at[axis]));
            coarse.around_row(across, &mut part.around);
            let x = grid.coordinate(grid.along, at[grid.along]);
            grid.around(grid.along, [x, x], 1, &mut part.around[0]);
            self.scan(coarse, i, &part.around, &mut part.partner);
        }
    }

    /// Lists the grains behind i in cells of a level.
    fn scan(&self, level: &Level, i: u32, around: &[Vec<usize>; 3], partner: &mut Vec<u32>) {
        let nx = level.grid.row_cells();
        let xi = &self.grains.place[i as usize];
        for &slow in &around[2] {
            for &fast in &around[1] {
                let row = level.first_cell + level.grid.row_at([fast, slow]) * nx;
                // Beyond a sheared boundary partners may lie anywhere along x.
                if self.images.moves && self.beyond_shear(level, xi, [fast, slow]) {
                    self.scan_cells(i, [row, row + nx], partner);
                    continue;
                }
                for &x in &around[0] {
                    self.scan_cells(i, [row + x, row + x + 1], partner);
                }
            }
        }
    }

    /// Whether a row of cells may be seen from a point through the boundary whose images are shifted.
    fn beyond_shear(&self, level: &Level, x: &[f64; 4], [fast, slow]: [usize; 2]) -> bool {
        let Some(axis) = self.images.sheared() else {
            return false;
        };
        let cell = if level.grid.across[0] == axis {
            fast
        } else {
            slow
        };
        let (own, last) = (
            level.grid.coordinate(axis, x[axis]),
            level.grid.cells[axis] - 1,
        );
        own == 0 && cell == last || own == last && cell == 0
    }

    /// Lists the grains behind i in consecutive cells.
    #[inline(always)]
    fn scan_cells(&self, i: u32, [from, to]: [usize; 2], partner: &mut Vec<u32>) {
        let grains = self.grains;
        let xi = &grains.place[i as usize];
        let reach = xi[3] + self.skin;
        let held = grains.motion[i as usize][3] == 0.0;
        let first = self.first[from].max(i + 1);
        for j in first..self.first[to].max(first) {
            let xj = &grains.place[j as usize];
            let r2 = self.images.distance_squared(xi, xj);
            let near = reach + xj[3];
            // Two fixed grains have nothing to say to each other.
            let idle = held && grains.motion[j as usize][3] == 0.0;
            if r2 < near * near && !idle && !self.share_clump(i, j) {
                partner.push(j);
            }
        }
    }

    /// Whether two grains belong to one clump.
    #[inline(always)]
    fn share_clump(&self, i: u32, j: u32) -> bool {
        let clump = |row: u32| self.clumps.get(self.grains.id[row as usize] as usize);
        !self.clumps.is_empty()
            && clump(i).is_some_and(|&own| own != ALONE && clump(j) == Some(&own))
    }
}

impl Level {
    /// A level as a checkpoint has it.
    pub fn restored(grid: Grid, first_row: usize, radius: f64, skin: f64) -> Self {
        Level {
            grid,
            first_row,
            radius,
            skin,
            ..Level::default()
        }
    }

    /// Cells up to one away across the row with these cell numbers.
    fn around_row(&self, [fast, slow]: [usize; 2], around: &mut [Vec<usize>; 3]) {
        let [across_fast, across_slow] = self.grid.across;
        self.grid
            .around(across_fast, [fast, fast], 1, &mut around[1]);
        self.grid
            .around(across_slow, [slow, slow], 1, &mut around[2]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Domain, Grain};
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::collections::BTreeSet;

    const SKIN: f64 = 0.3;

    /// Grains anywhere in a box, overlapping or not, radii of a power law from 0.5 to 0.5 `ratio`.
    fn cloud(seed: u64, n: usize, ratio: f64, periodic: [bool; 3]) -> (Vec<Grain>, Domain) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let size = Vector3::new(3.0, 2.5, 4.0) * (2.0 * ratio + 2.0);
        let grains = (0..n).map(|k| {
            let mut unit = || random.random::<f64>();
            // As many grains by volume in each class of size.
            let u = if k == 0 { 1.0 } else { unit() };
            let radius = 0.5 * (1.0 - u * (1.0 - ratio.powi(-3))).powf(-1.0 / 3.0);
            // Dense towards a corner, where all images meet.
            let at = Vector3::new(unit(), unit(), unit()).map(|x| x.powi(3));
            let at = at.component_mul(&size);
            let mut grain = Grain::at_rest(at, radius, 1.0);
            let noise = Vector3::new(unit(), unit(), unit()) - Vector3::repeat(0.5);
            grain.velocity = 0.2 * noise + Vector3::new(0.5 * at.z, 0.0, 0.1 * at.x);
            grain.fixed = unit() < 0.05;
            if grain.fixed {
                grain.velocity = Vector3::zeros();
            }
            grain
        });
        let grains = grains.collect();
        let domain = Domain {
            lower: Vector3::zeros(),
            upper: size,
            periodic,
        };
        (grains, domain)
    }

    /// All pairs closer than a contact plus `gap`, by trying every one.
    fn close(grains: &Grains, domain: &Domain, gap: f64) -> BTreeSet<(u32, u32)> {
        let images = Images::of(&(*domain).into());
        let mut pairs = BTreeSet::new();
        for i in 0..grains.len() {
            for j in i + 1..grains.len() {
                let (a, b) = (&grains.place[i], &grains.place[j]);
                let near = a[3] + b[3] + gap;
                let idle = grains.is_fixed(i) && grains.is_fixed(j);
                if images.distance_squared(a, b) < near * near && !idle {
                    pairs.insert((i as u32, j as u32));
                }
            }
        }
        pairs
    }

    fn listed(list: &Neighbours, n: usize) -> BTreeSet<(u32, u32)> {
        let mut pairs = BTreeSet::new();
        for i in 0..n {
            for &j in list.partners(i) {
                assert!(j as usize > i);
                assert!(pairs.insert((i as u32, j)), "listed twice: {i}, {j}");
            }
        }
        pairs
    }

    #[test]
    fn every_close_pair_is_listed_once_at_any_ratio_of_sizes() {
        for (ratio, levels) in [(1.0, 1), (1.9, 1), (5.0, 3), (50.0, 3)] {
            for periodic in [[false; 3], [true, true, false], [true; 3]] {
                let (setup, domain) = cloud(3, 1200, ratio, periodic);
                let mut grains = Grains::new(&setup);
                let mut list = Neighbours::default();
                list.build(&mut grains, &domain.into(), SKIN, false);
                assert!(list.levels.len() >= levels, "{}", list.levels.len());
                assert!(levels > 1 || list.levels.len() == 1);
                let expected = close(&grains, &domain, SKIN);
                assert!(expected.len() > 100, "{}", expected.len());
                assert_eq!(
                    listed(&list, grains.len()),
                    expected,
                    "{ratio} {periodic:?}"
                );
            }
        }
    }

    #[test]
    fn no_pair_comes_to_touch_unlisted_while_the_list_is_said_to_be_valid() {
        for (ratio, periodic) in [
            (1.0, [true; 3]),
            (5.0, [false; 3]),
            (20.0, [true, true, false]),
            (50.0, [true; 3]),
        ] {
            let (setup, domain) = cloud(7, 900, ratio, periodic);
            let mut grains = Grains::new(&setup);
            let mut list = Neighbours::default();
            let dt = 1e-3 / ratio;
            let (mut steps, mut builds) = (0, 0);
            while builds < 4 {
                list.build(&mut grains, &domain.into(), SKIN, false);
                builds += 1;
                let known = listed(&list, grains.len());
                loop {
                    let mut farthest = 0.0_f64;
                    for (travel, row) in list.travel.iter_mut().zip(&list.rows) {
                        let mut own = 0.0_f64;
                        for g in row.start as usize..row.end as usize {
                            let v = grains.motion[g];
                            for (x, v) in grains.place[g].iter_mut().zip(&v[..3]) {
                                *x += dt * v;
                            }
                            let against = crate::grains::vector(&v) - Vector3::from(row.drift);
                            own = own.max(dt * against.norm());
                        }
                        *travel += own;
                        farthest = farthest.max(own);
                    }
                    list.age += dt;
                    let list = &mut list;
                    list.watch.spend(&mut list.allowance, farthest, dt);
                    if list.outdated(SKIN) {
                        break;
                    }
                    steps += 1;
                    if steps % 20 == 0 {
                        let touching = close(&grains, &domain, 0.0);
                        assert!(touching.is_subset(&known), "{ratio} {periodic:?}");
                    }
                }
            }
            assert!(
                steps > 20,
                "the list must last: {steps} steps at ratio {ratio}"
            );
        }
    }
}
