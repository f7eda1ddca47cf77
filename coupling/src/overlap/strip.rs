//! The overlap along the outward normal: faces, nodes and their weights.

use super::settings::Resolved;

/// Cells of the continuum's copy between a and b, as distances s from the edge b (negative inside).
///
/// Nodes are the cells' centres. A grain shares itself out to the two nodes beside it by hat functions; beyond
/// the outermost node it belongs to that node alone, and inside of a to none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strip {
    /// Height of a cell (m).
    pub cell: f64,
    /// Cells between a and m.
    pub inner: usize,
    /// Cells between m and b.
    pub buffer: usize,
    /// Width of the shell that bears traction (m).
    pub shell: f64,
}

/// Nodes and weights of one place.
pub type Shares = [(usize, f64); 2];

impl Strip {
    /// The strip of these settings on cells of the given height; widths are rounded to whole cells.
    pub fn new(settings: &Resolved, cell: f64) -> Self {
        let cells = |width: f64| ((width / cell).round() as usize).max(1);
        Self {
            cell,
            inner: cells(settings.inner),
            buffer: cells(settings.buffer),
            shell: settings.shell,
        }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.inner + self.buffer
    }

    /// Place of a face, counted from a (m).
    #[inline]
    pub fn face(&self, face: usize) -> f64 {
        (face as f64 - self.nodes() as f64) * self.cell
    }

    /// Place of a node (m).
    pub fn node(&self, node: usize) -> f64 {
        self.face(node) + 0.5 * self.cell
    }

    /// Place of the handshake surface m (m).
    pub fn handshake(&self) -> f64 {
        self.face(self.inner)
    }

    /// Share w of the grains' stress on a face: 1 at a, 0 from m on, linear between.
    pub fn share(&self, face: usize) -> f64 {
        1.0 - (face.min(self.inner) as f64 / self.inner as f64)
    }

    /// Nodes of a place and their weights.
    #[inline]
    pub fn shares(&self, s: f64) -> Shares {
        let last = self.nodes() - 1;
        let t = (s - self.node(0)) / self.cell;
        if t <= -1.0 {
            [(0, 0.0); 2]
        } else if t < 0.0 {
            [(0, 1.0 + t), (0, 0.0)]
        } else if t < last as f64 {
            let k = (t as usize).min(last - 1);
            let part = t - k as f64;
            [(k, 1.0 - part), (k + 1, part)]
        } else {
            [(last, 1.0), (last, 0.0)]
        }
    }

    /// Weight of the traction on a grain of this mass: q = m min(1, (s + b)/b) over the shell of width b.
    #[inline]
    pub fn traction_weight(&self, mass: f64, s: f64) -> f64 {
        mass * ((s + self.shell) / self.shell).clamp(0.0, 1.0)
    }

    /// Whether a node lies in the buffer.
    pub fn in_buffer(&self, node: usize) -> bool {
        node >= self.inner
    }
}

/// Linear interpolation between the values of cell centres at `first + k cell`, continued beyond the ends.
pub fn interpolate(values: &[f64], first: f64, cell: f64, s: f64) -> f64 {
    let Some(last) = values.len().checked_sub(2) else {
        return values.first().copied().unwrap_or(0.0);
    };
    let t = (s - first) / cell;
    let k = (t.max(0.0) as usize).min(last);
    values[k] + (t - k as f64) * (values[k + 1] - values[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRIP: Strip = Strip {
        cell: 0.5,
        inner: 3,
        buffer: 4,
        shell: 1.0,
    };

    #[test]
    fn places_lie_where_they_should() {
        assert_eq!((STRIP.face(0), STRIP.face(7)), (-3.5, 0.0));
        assert_eq!(STRIP.handshake(), -2.0);
        assert_eq!(
            (STRIP.share(0), STRIP.share(3), STRIP.share(6)),
            (1.0, 0.0, 0.0)
        );
        assert!((STRIP.share(1) - 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(STRIP.traction_weight(2.0, -1.5), 0.0);
        assert_eq!(STRIP.traction_weight(2.0, -0.5), 1.0);
        assert_eq!(STRIP.traction_weight(2.0, 9.0), 2.0);
    }

    #[test]
    fn hats_add_up_to_one_and_keep_the_place() {
        for i in 0..200 {
            let s = -3.25 + 0.0149 * f64::from(i);
            let shares = STRIP.shares(s);
            let sum: f64 = shares.iter().map(|(_, h)| h).sum();
            assert!((sum - 1.0).abs() < 1e-14);
            if s <= STRIP.node(6) {
                let place: f64 = shares.iter().map(|&(k, h)| h * STRIP.node(k)).sum();
                assert!((place - s).abs() < 1e-13);
            }
        }
        assert_eq!(STRIP.shares(-4.0)[0].1, 0.0);
    }

    #[test]
    fn a_straight_profile_is_interpolated_exactly() {
        let values = [1.0, 3.0, 5.0];
        for s in [-7.0, -0.3, 0.0, 1.7, 9.0] {
            assert!((interpolate(&values, 0.0, 1.0, s) - (1.0 + 2.0 * s)).abs() < 1e-13);
        }
        assert_eq!(interpolate(&[4.0], 0.0, 1.0, 3.0), 4.0);
    }
}
