//! Ground in the plane, as a line.

use super::{CutCells, GridLines, require_positions};
use crate::error::{Error, require};

/// The surface of ground in the plane (x, z): a line of straight pieces with the ground on its right
/// hand, that is below it where it runs towards larger x. It may turn back under itself, as an
/// overhang does, but must not cross itself. Ground reaches down without end.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    pub(super) points: Vec<[f64; 2]>,
}

impl Profile {
    /// The line through the given points (m).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for fewer than two points or coordinates that are not finite.
    pub fn new(points: Vec<[f64; 2]>) -> Result<Self, Error> {
        require(
            points.len() >= 2,
            "terrain.profile",
            points.len() as f64,
            "at least 2 points (x, z)",
        )?;
        require_positions("terrain.profile", &points)?;
        Ok(Self { points })
    }

    /// A height z(x) (m) at the ends of equal intervals.
    ///
    /// # Errors
    /// As [`new`](Self::new), and for intervals without length.
    pub fn of_height(
        [from, to]: [f64; 2],
        intervals: usize,
        height: impl Fn(f64) -> f64,
    ) -> Result<Self, Error> {
        require(
            to > from && intervals >= 1,
            "terrain.intervals",
            intervals as f64,
            "at least 1, over a length greater than 0 m",
        )?;
        let step = (to - from) / intervals as f64;
        let points = (0..=intervals).map(|n| {
            let x = if n == intervals {
                to
            } else {
                from + n as f64 * step
            };
            [x, height(x)]
        });
        Self::new(points.collect())
    }

    /// The points (m).
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// Area of ground in a box (m²).
    pub fn area_in(&self, low: [f64; 2], high: [f64; 2]) -> f64 {
        let mut sum = 0.0;
        for piece in self.points.windows(2) {
            let (from, to) = (piece[0], piece[1]);
            let (left, right) = if to[0] >= from[0] {
                (from, to)
            } else {
                (to, from)
            };
            let (a, b) = (left[0].max(low[0]), right[0].min(high[0]));
            if b <= a {
                continue;
            }
            let slope = (right[1] - left[1]) / (right[0] - left[0]);
            let [ha, hb] = [a, b].map(|x| left[1] + slope * (x - left[0]));
            let below = |z: f64| area_below(a, b, ha, hb, z);
            sum += if to[0] > from[0] { 1.0 } else { -1.0 } * (below(low[1]) - below(high[1]));
        }
        sum
    }

    /// Height of the highest ground at x (m), if there is ground.
    pub fn height_at(&self, x: f64) -> Option<f64> {
        let pieces = self.points.windows(2).filter_map(|piece| {
            let (from, to) = (piece[0], piece[1]);
            let (low, high) = (from[0].min(to[0]), from[0].max(to[0]));
            if x < low || x > high {
                None
            } else if low == high {
                Some(from[1].max(to[1]))
            } else {
                Some(from[1] + (to[1] - from[1]) * (x - from[0]) / (to[0] - from[0]))
            }
        });
        pieces.fold(None, |most: Option<f64>, z| {
            Some(most.map_or(z, |m| m.max(z)))
        })
    }

    /// Distance of a point from the line (m).
    pub fn distance(&self, point: [f64; 2]) -> f64 {
        let pieces = self.points.windows(2).map(|piece| {
            let (from, to) = (piece[0], piece[1]);
            let along = [to[0] - from[0], to[1] - from[1]];
            let away = [point[0] - from[0], point[1] - from[1]];
            let square = along[0] * along[0] + along[1] * along[1];
            let share = if square > 0.0 {
                ((away[0] * along[0] + away[1] * along[1]) / square).clamp(0.0, 1.0)
            } else {
                0.0
            };
            (away[0] - share * along[0]).hypot(away[1] - share * along[1])
        });
        pieces.fold(f64::INFINITY, f64::min)
    }

    /// How the ground cuts the cells of a grid, which it has to span along x.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a grid that reaches beyond the line.
    pub fn cut(&self, lines: &GridLines<2>) -> Result<CutCells<2>, Error> {
        let mut cut = CutCells::open(*lines)?;
        let mut points = lines.local(&self.points);
        let last = points.len() - 1;
        lines.require_inside(0, points[0][0], points[last][0], "terrain.profile")?;
        lines.snap(&mut points);
        for piece in points.windows(2) {
            add_piece(&mut cut, piece[0], piece[1]);
        }
        Ok(cut.finish())
    }
}

/// From which to which part of its length a piece lies in a box, if for more than a point. `is_beside` says whether one
/// that runs across an axis counts.
pub(super) fn share_within(
    [from, to]: [[f64; 2]; 2],
    [low, high]: [[f64; 2]; 2],
    is_beside: impl Fn(usize) -> bool,
) -> Option<[f64; 2]> {
    let mut span = [0.0_f64, 1.0];
    for axis in 0..2 {
        let along = to[axis] - from[axis];
        if along == 0.0 {
            if !is_beside(axis) {
                return None;
            }
            continue;
        }
        let ends = [low[axis], high[axis]].map(|x| (x - from[axis]) / along);
        span = [
            span[0].max(ends[0].min(ends[1])),
            span[1].min(ends[0].max(ends[1])),
        ];
    }
    (span[1] > span[0]).then_some(span)
}

/// Ground below a piece of the line, in all cells.
fn add_piece(cut: &mut CutCells<2>, from: [f64; 2], to: [f64; 2]) {
    let lines = cut.lines;
    let dx = to[0] - from[0];
    let (left, right) = if dx >= 0.0 { (from, to) } else { (to, from) };
    let sign = if dx > 0.0 { 1.0 } else { -1.0 };
    let height = |x: f64| {
        if x <= left[0] {
            left[1]
        } else if x >= right[0] {
            right[1]
        } else {
            left[1] + (right[1] - left[1]) * ((x - left[0]) / (right[0] - left[0]))
        }
    };
    for i in lines.reach(0, left[0], right[0]) {
        let [x0, x1] = [lines.local_line(0, i), lines.local_line(0, i + 1)];
        let [a, b] = [left[0].max(x0), right[0].min(x1)];
        let covers = b > a;
        for k in 0..lines.cells[1] {
            let [z0, z1] = [lines.local_line(1, k), lines.local_line(1, k + 1)];
            let cell = lines.number([i, k], None);
            if covers {
                let [ha, hb] = [height(a), height(b)];
                cut.volumes[cell] +=
                    sign * (area_below(a, b, ha, hb, z0) - area_below(a, b, ha, hb, z1));
                let face = lines.number([i, k], Some(1));
                cut.apertures[1][face] += sign * length_above(a, b, ha, hb, z0);
                if k + 1 == lines.cells[1] {
                    let top = lines.number([i, k + 1], Some(1));
                    cut.apertures[1][top] += sign * length_above(a, b, ha, hb, z1);
                }
            }
            // Faces across x see the ground on their left, but for the first one.
            for (line, x) in [(i, x0), (i + 1, x1)] {
                let is_new = line == i || line == lines.cells[0];
                if is_new && lines.crosses(line, x, left[0], right[0]) {
                    let face = lines.number([line, k], Some(0));
                    cut.apertures[0][face] += sign * (height(x) - z0).clamp(0.0, z1 - z0);
                }
            }
            add_wall(cut, [i, k], (from, to), ([x0, z0], [x1, z1]));
        }
    }
}

/// ∫ max(h − z, 0) dx over [a, b], h linear from ha to hb.
pub(super) fn area_below(a: f64, b: f64, ha: f64, hb: f64, z: f64) -> f64 {
    let (p, q) = (ha - z, hb - z);
    match (p > 0.0, q > 0.0) {
        (true, true) => 0.5 * (p + q) * (b - a),
        (false, false) => 0.0,
        (true, false) => 0.5 * p * (b - a) * (p / (p - q)),
        (false, true) => 0.5 * q * (b - a) * (q / (q - p)),
    }
}

/// Length of the part of [a, b] where h ≥ z.
fn length_above(a: f64, b: f64, ha: f64, hb: f64, z: f64) -> f64 {
    let (p, q) = (ha - z, hb - z);
    match (p >= 0.0, q >= 0.0) {
        (true, true) => b - a,
        (false, false) => 0.0,
        (true, false) => (b - a) * (p / (p - q)),
        (false, true) => (b - a) * (q / (q - p)),
    }
}

/// The part of a piece within a cell.
fn add_wall(
    cut: &mut CutCells<2>,
    index: [usize; 2],
    (from, to): ([f64; 2], [f64; 2]),
    (low, high): ([f64; 2], [f64; 2]),
) {
    let lines = cut.lines;
    let holds = |axis: usize| lines.holds(axis, index[axis], from[axis], low[axis], high[axis]);
    let Some(span) = share_within([from, to], [low, high], holds) else {
        return;
    };
    let direction = [to[0] - from[0], to[1] - from[1]];
    let share = span[1] - span[0];
    let middle = 0.5 * (span[0] + span[1]);
    // Ground on the right: the normal out of it lies on the left.
    let cell = cut.lines.number(index, None);
    cut.walls[cell].add(
        [-direction[1] * share, direction[0] * share],
        [
            from[0] + middle * direction[0],
            from[1] + middle * direction[1],
        ],
    );
}
