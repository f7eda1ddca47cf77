//! Where coefficients go and what each supernode takes: found once for a pattern.

use faer::perm::PermRef;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// What an earlier supernode contributes to a later one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Update {
    pub from: u32,
    /// Rows of it that are columns of the later one: from this one on,
    pub first: u32,
    /// and so many.
    pub count: u32,
}

/// What belongs to each supernode of a pattern.
pub(in crate::linear_solver) struct Layout {
    /// What each supernode takes, one after the other, and where that ends.
    pub(super) updates: Vec<Update>,
    pub(super) ends_of_updates: Vec<u32>,
    /// Coefficients of the lower triangle of the matrix, by supernodes: which one, and where it goes.
    pub(super) entries: Vec<[u32; 2]>,
    pub(super) ends_of_entries: Vec<u32>,
    /// Signs of the pivots.
    pub(super) signs: Vec<i8>,
}

impl Layout {
    /// The layout for the lower triangle of a pattern in an order.
    pub(in crate::linear_solver) fn new(
        pattern: SymbolicSparseColMatRef<'_, usize>,
        order: PermRef<'_, usize>,
        symbolic: &SymbolicSupernodalCholesky<usize>,
        sign: impl Fn(usize) -> i8,
    ) -> Self {
        let (forward, back) = order.arrays();
        let (begins, ends) = (symbolic.supernode_begin(), symbolic.supernode_end());
        let count = symbolic.n_supernodes();
        let mut owners = vec![0_u32; symbolic.nrows()];
        for (s, (&begin, &end)) in begins.iter().zip(ends).enumerate() {
            owners[begin..end].fill(s as u32);
        }
        let (updates, ends_of_updates) = all_updates(symbolic, &owners);
        // Coefficients by the supernode of their column.
        let lower = || {
            (0..pattern.ncols()).flat_map(|column| {
                let slots = pattern.col_range(column);
                let rows = &pattern.row_idx()[slots.clone()];
                let below = slots.zip(rows).filter(move |(_, row)| **row >= column);
                below.map(move |(slot, &row)| {
                    let [a, b] = [back[row], back[column]];
                    (slot, a.max(b), a.min(b))
                })
            })
        };
        let mut next = vec![0_u32; count + 1];
        for (_, _, column) in lower() {
            next[owners[column] as usize + 1] += 1;
        }
        for s in 0..count {
            next[s + 1] += next[s];
        }
        let total = next[count] as usize;
        let mut entries = vec![[0_u32; 2]; total];
        let mut rows = vec![0_u32; total];
        for (slot, row, column) in lower() {
            let place = &mut next[owners[column] as usize];
            entries[*place as usize] = [slot as u32, column as u32];
            rows[*place as usize] = row as u32;
            *place += 1;
        }
        next.truncate(count);
        let ends_of_entries = next;
        let mut places = vec![0_usize; symbolic.nrows()];
        let mut first = 0;
        for s in 0..count {
            let [begin, end] = [begins[s], ends[s]];
            let below = symbolic.supernode(s).pattern();
            let height = end - begin + below.len();
            for (place, row) in (begin..end).chain(below.iter().copied()).enumerate() {
                places[row] = place;
            }
            let last = ends_of_entries[s] as usize;
            for (entry, &row) in entries[first..last].iter_mut().zip(&rows[first..last]) {
                let column = entry[1] as usize - begin;
                entry[1] = (column * height + places[row as usize]) as u32;
            }
            first = last;
        }
        Self {
            updates,
            ends_of_updates,
            entries,
            ends_of_entries,
            signs: forward.iter().map(|&unknown| sign(unknown)).collect(),
        }
    }
}

/// What each supernode takes from earlier ones, in their order.
fn all_updates(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    owners: &[u32],
) -> (Vec<Update>, Vec<u32>) {
    let count = symbolic.n_supernodes();
    let runs = |s: usize| {
        let pattern = symbolic.supernode(s).pattern();
        let mut first = 0;
        std::iter::from_fn(move || {
            let owner = owners[*pattern.get(first)?];
            let run = pattern[first..].iter();
            let length = run.take_while(|row| owners[**row] == owner).count();
            first += length;
            Some((owner as usize, first - length, length))
        })
    };
    let mut next = vec![0_u32; count + 1];
    for s in 0..count {
        runs(s).for_each(|(owner, ..)| next[owner + 1] += 1);
    }
    for s in 0..count {
        next[s + 1] += next[s];
    }
    let none = Update {
        from: 0,
        first: 0,
        count: 0,
    };
    let mut updates = vec![none; next[count] as usize];
    for s in 0..count {
        for (owner, first, length) in runs(s) {
            updates[next[owner] as usize] = Update {
                from: s as u32,
                first: first as u32,
                count: length as u32,
            };
            next[owner] += 1;
        }
    }
    next.truncate(count);
    (updates, next)
}
