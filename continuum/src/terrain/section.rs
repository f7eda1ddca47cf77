//! The line in which a vertical plane cuts a surface of triangles: ground for a plane flow.

use super::{Profile, Surface};
use crate::error::{Error, require};

/// Ends of pieces are the same point if they differ by less than this part of the surface's extent.
const SAME: f64 = 1e-9;

impl Surface {
    /// The profile along x at y (m). It has to be one line without branches from its smallest x to its
    /// largest, as open terrain gives it; a closed body gives a loop, which is no ground to stand on.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] where the plane meets no triangle, or a loop, or several lines.
    pub fn profile(&self, y: f64) -> Result<Profile, Error> {
        let ends = (self.vertices().iter()).fold([f64::INFINITY, f64::NEG_INFINITY], |ends, x| {
            [ends[0].min(x[1]), ends[1].max(x[1])]
        });
        // An edge is met where it is nearer than round-off.
        let is_met = |end: &f64| (y - end).abs() <= SAME * (ends[1] - ends[0]);
        let y = ends.into_iter().find(is_met).unwrap_or(y);
        // Corners on the plane count as beyond it, but on the first edge of the surface, where nothing lies before them.
        let [lowest, _] = ends;
        let is_before = |place: f64| place < y || (y == lowest && place == y);
        let mut pieces = Vec::new();
        for corners in self.triangles() {
            pieces.extend(self.piece(corners, y, is_before));
        }
        require(
            !pieces.is_empty(),
            "terrain.y",
            y,
            "a y (m) at which there is terrain",
        )?;
        let extent = pieces
            .iter()
            .flatten()
            .flatten()
            .fold(0.0_f64, |most, x| most.max(x.abs()));
        let key = |point: [f64; 2]| point.map(|x| (x / (SAME * extent.max(1e-300))).round() as i64);
        let mut from: std::collections::BTreeMap<[i64; 2], usize> = Default::default();
        let mut ends: std::collections::BTreeSet<[i64; 2]> = Default::default();
        for (n, piece) in pieces.iter().enumerate() {
            from.insert(key(piece[0]), n);
            ends.insert(key(piece[1]));
        }
        let starts: Vec<usize> = (0..pieces.len())
            .filter(|&n| !ends.contains(&key(pieces[n][0])))
            .collect();
        require(
            starts.len() == 1 && from.len() == pieces.len(),
            "terrain.lines",
            starts.len() as f64,
            format!(
                "1: at y = {y} m the surface has to be one line that neither branches nor closes"
            ),
        )?;
        let mut points = vec![pieces[starts[0]][0]];
        let mut next = Some(starts[0]);
        while let Some(n) = next {
            points.push(pieces[n][1]);
            next = from.get(&key(pieces[n][1])).copied();
        }
        require(
            points.len() == pieces.len() + 1,
            "terrain.lines",
            2.0,
            format!(
                "1: at y = {y} m the surface has to be one line that neither branches nor closes"
            ),
        )?;
        Profile::new(points)
    }

    /// The piece in which the plane cuts a triangle, with the ground on its right hand.
    fn piece(
        &self,
        corners: &[usize; 3],
        y: f64,
        is_before: impl Fn(f64) -> bool,
    ) -> Option<[[f64; 2]; 2]> {
        let corner = |n: usize| self.vertices()[corners[n % 3]];
        let [mut up, mut down] = [None; 2];
        for n in 0..3 {
            let (from, to) = (corner(n), corner(n + 1));
            if is_before(from[1]) == is_before(to[1]) {
                continue;
            }
            // The same order of both ends in both triangles of an edge gives the same digits.
            let (a, b) = if from[1] < to[1] {
                (from, to)
            } else {
                (to, from)
            };
            let share = (y - a[1]) / (b[1] - a[1]);
            let point = Some([a[0] + share * (b[0] - a[0]), a[2] + share * (b[2] - a[2])]);
            if is_before(from[1]) {
                up = point;
            } else {
                down = point;
            }
        }
        // Corners run counterclockwise seen from outside: with x to the right and y away from the
        // reader, the edge that goes up in y lies at the end towards larger x of ground seen from above.
        let piece = [down?, up?];
        (piece[0] != piece[1]).then_some(piece)
    }
}
