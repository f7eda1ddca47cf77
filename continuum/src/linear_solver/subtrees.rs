//! Parts of the elimination tree that know nothing of each other: nested dissection leaves two halves and the strip
//! between them, whose unknowns are eliminated after both.

use std::ops::Range;

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

use super::dissection::Pieces;

/// A subtree of the elimination tree.
#[derive(Debug, Clone)]
pub(super) struct Subtree {
    /// All its supernodes.
    pub supernodes: Range<usize>,
    /// The first of those that belong to no half.
    pub own: usize,
    /// What is eliminated before them, each half without the other.
    pub halves: Option<Box<[Subtree; 2]>>,
}

impl Subtree {
    /// The tree of a pattern that was put into order by dissection.
    pub(super) fn new(
        symbolic: &SymbolicSupernodalCholesky<usize>,
        pieces: Option<&Pieces>,
    ) -> Self {
        let all = 0..symbolic.n_supernodes();
        match pieces {
            Some(pieces) => Self::of(symbolic, pieces, all),
            None => Self::whole(all),
        }
    }

    fn whole(supernodes: Range<usize>) -> Self {
        Self {
            own: supernodes.start,
            supernodes,
            halves: None,
        }
    }

    fn of(
        symbolic: &SymbolicSupernodalCholesky<usize>,
        pieces: &Pieces,
        supernodes: Range<usize>,
    ) -> Self {
        let Some(halves) = &pieces.halves else {
            return Self::whole(supernodes);
        };
        // A supernode that lies across an end belongs to what comes later.
        let before = |end: usize| {
            let ends = &symbolic.supernode_end()[supernodes.clone()];
            supernodes.start + ends.partition_point(|&e| e <= end)
        };
        let [middle, own] = [before(halves[0].end), before(halves[1].end)];
        let column = |supernode: usize| {
            let begins = symbolic.supernode_begin();
            begins.get(supernode).copied().unwrap_or(symbolic.nrows())
        };
        let high = column(middle)..column(own);
        // What dissection holds for apart has to be: coefficients may reach farther than it knows.
        let reaches = |s: usize| {
            let rows = symbolic.supernode(s).pattern();
            let first = rows.partition_point(|&row| row < high.start);
            rows.get(first).is_some_and(|&row| row < high.end)
        };
        if middle == supernodes.start
            || own == middle
            || own == supernodes.end
            || (supernodes.start..middle).any(reaches)
        {
            return Self::whole(supernodes);
        }
        let low = Self::of(symbolic, &halves[0], supernodes.start..middle);
        let high = Self::of(symbolic, &halves[1], middle..own);
        Self {
            supernodes,
            own,
            halves: Some(Box::new([low, high])),
        }
    }

    /// Its own supernodes, eliminated last.
    pub(super) fn own(&self) -> Range<usize> {
        self.own..self.supernodes.end
    }
}
