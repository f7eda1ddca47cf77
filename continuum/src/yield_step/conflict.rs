//! Cells for which Newton's method finds neither a pressure nor a divergence, and what is held for them.

use super::threshold_pressure;
use crate::discretisation::QuadraturePoint;

/// Changes to and fro after which a cell or a point is in conflict with itself: one that finds its state
/// changes once or twice.
const CHANGES: u8 = 8;

/// Flags as they were last, and how often each has changed.
struct History {
    previous: Vec<bool>,
    changes: Vec<u8>,
}

impl History {
    fn new(count: usize) -> Self {
        Self {
            previous: vec![false; count],
            changes: vec![0; count],
        }
    }

    /// Takes note of a flag; says whether it has gone to and fro for too long.
    #[inline]
    fn note(&mut self, n: usize, now: bool) -> bool {
        if self.previous[n] == now {
            return false;
        }
        self.previous[n] = now;
        self.changes[n] += 1;
        self.changes[n] >= CHANGES
    }

    /// Forgets what was before, so that nothing depends on earlier steps. A flag that is set at first counts as
    /// changed once.
    fn begin(&mut self) {
        self.previous.fill(false);
        self.changes.fill(0);
    }

    fn is_undecided(&self, n: usize) -> bool {
        self.changes[n] > CHANGES / 2
    }
}

/// Cells that go to and fro between p = 0 and ∇·u = 0, points that do between a threshold with pressure and
/// one without, and what is held because of them.
pub(super) struct Conflicts {
    cells: History,
    points: History,
    is_cycling: bool,
    /// Threshold pressure of each point that is held; empty as long as none is.
    held: Vec<Option<f64>>,
}

impl Conflicts {
    pub(super) fn new(cells: usize, points: usize) -> Self {
        Self {
            cells: History::new(cells),
            points: History::new(points),
            is_cycling: false,
            held: Vec::new(),
        }
    }

    /// Holds nothing.
    pub(super) fn forget(&mut self) {
        self.held.clear();
    }

    /// Starts to count anew.
    pub(super) fn begin(&mut self) {
        self.cells.begin();
        self.points.begin();
        self.is_cycling = false;
    }

    /// Takes note of which cells an iteration lets go.
    pub(super) fn note_cells(&mut self, released: &[bool]) {
        for (cell, now) in released.iter().enumerate() {
            self.is_cycling |= self.cells.note(cell, *now);
        }
    }

    /// Takes note of whether there is pressure on a point.
    #[inline]
    pub(super) fn note_point(&mut self, q: usize, is_pressed: bool) {
        self.is_cycling |= self.points.note(q, is_pressed);
    }

    /// Whether a cell or a point has gone to and fro for too long.
    pub(super) fn is_cycling(&self) -> bool {
        self.is_cycling
    }

    /// Holds the thresholds that were undecided in the last attempt, or depend on cells that were, at the
    /// pressure given; says whether there is anything new to hold.
    pub(super) fn hold<const C: usize, const V: usize>(
        &mut self,
        points: &[QuadraturePoint<C, V>],
        p: &[f64],
    ) -> bool {
        let before = self.held();
        self.held.resize(points.len(), None);
        for (q, (held, point)) in self.held.iter_mut().zip(points).enumerate() {
            let (cells, _) = point.pressures();
            if self.points.is_undecided(q)
                || cells.iter().any(|&cell| self.cells.is_undecided(cell))
            {
                held.get_or_insert_with(|| point.pressure(p));
            }
        }
        self.held() > before
    }

    /// Number of points held.
    pub(super) fn held(&self) -> usize {
        self.held.iter().flatten().count()
    }

    /// Pressure of the threshold of a point, and whether it depends on that of the cells.
    #[inline]
    pub(super) fn pressure<const C: usize, const V: usize>(
        &self,
        q: usize,
        point: &QuadraturePoint<C, V>,
        p: &[f64],
    ) -> (f64, bool) {
        if let Some(Some(held)) = self.held.get(q) {
            return (threshold_pressure(*held).0, false);
        }
        threshold_pressure(point.pressure(p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(cell: usize) -> QuadraturePoint {
        let mut point = QuadraturePoint::new(1.0);
        point.add_pressure(cell, 0.5);
        point
    }

    /// A cell that goes to and fro is in conflict, and holds the points under its pressure; one that changes
    /// its mind twice is not.
    #[test]
    fn cells_in_conflict_hold_their_points() {
        let points = [point(0), point(1)];
        let pressures = [3.0, 4.0];
        let mut conflicts = Conflicts::new(2, 2);
        conflicts.begin();
        for n in 0..8 {
            assert!(!conflicts.is_cycling());
            conflicts.note_cells(&[n < 2, n % 2 == 0]);
        }
        assert!(conflicts.is_cycling());
        assert!(conflicts.hold(&points, &pressures) && conflicts.held() == 1);
        let later = [5.0, 6.0];
        assert_eq!(conflicts.pressure(0, &points[0], &later), (2.5, true));
        assert_eq!(conflicts.pressure(1, &points[1], &later), (2.0, false));
        // Nothing new to hold.
        assert!(!conflicts.hold(&points, &later));
        conflicts.forget();
        assert_eq!(conflicts.held(), 0);
    }

    /// So is a point that finds itself under pressure and without in turn.
    #[test]
    fn points_in_conflict_are_held() {
        let points = [point(0), point(0)];
        let mut conflicts = Conflicts::new(1, 2);
        conflicts.begin();
        for n in 0..8 {
            conflicts.note_point(1, n % 2 == 0);
        }
        assert!(conflicts.is_cycling() && conflicts.hold(&points, &[1.0]));
        assert_eq!(conflicts.held(), 1);
    }
}
