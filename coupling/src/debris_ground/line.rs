//! The surface of a plane continuum as a line over its columns of cells.

use colluvium_continuum::column_collapse::Collapse;
use colluvium_continuum::rheology::ShearLaw;

/// Part of a cell below which a column is bare.
const BARE: f64 = 1e-3;

/// The surface at an instant: one vertex over the middle of each column; SI units, coordinates of the grains.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct SurfaceLine {
    /// Places (m).
    pub points: Vec<[f64; 2]>,
    /// Whether matter lies there.
    pub covered: Vec<bool>,
    /// Velocity of the matter at the surface (m/s).
    pub velocity: Vec<[f64; 2]>,
    /// By how much a second the surface rises (m/s).
    pub rise: Vec<f64>,
}

/// Where a place is to a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Height over the line along its normal (m), negative below it.
    pub distance: f64,
    /// Outward normal.
    pub normal: [f64; 2],
    /// The nearest place of the line (m).
    pub place: [f64; 2],
    /// Velocity of the surface there: along it that of matter, across it that at which it rises (m/s).
    pub velocity: [f64; 2],
}

impl SurfaceLine {
    /// Of a continuum whose x = 0 is at `low` (m); rises from the line before in so much time (s), at rest without one.
    pub fn of<L: ShearLaw + Clone>(
        collapse: &Collapse<L>,
        low: f64,
        before: Option<(&SurfaceLine, f64)>,
    ) -> Self {
        let (x, heights) = collapse.profile();
        let ground = collapse.ground_heights();
        let least = BARE * collapse.spacing();
        let counts = collapse.flow().grid().cell_counts();
        let state = collapse.flow().state();
        let unit = collapse.units().velocity;
        let mut line = Self::default();
        for (i, (x, h)) in x.iter().zip(&heights).enumerate() {
            let z = ground[i] + h;
            let covered = *h > least;
            let top = (0..counts[1])
                .rev()
                .find(|k| state.fractions[i + counts[0] * k] > BARE);
            let velocity = match top {
                Some(k) if covered => {
                    let u = |i: usize| state.velocity[0][i + (counts[0] + 1) * k];
                    let w = |k: usize| state.velocity[1][i + counts[0] * k];
                    [
                        0.5 * (u(i) + u(i + 1)) * unit,
                        0.5 * (w(k) + w(k + 1)) * unit,
                    ]
                }
                _ => [0.0; 2],
            };
            let rise = match before {
                Some((before, interval)) if covered && before.covered[i] => {
                    (z - before.points[i][1]) / interval
                }
                _ => 0.0,
            };
            line.points.push([x + low, z]);
            line.covered.push(covered);
            line.velocity.push(velocity);
            line.rise.push(rise);
        }
        line
    }

    /// Where a place is to the line so much later (s), if the line is covered within a reach (m) to both sides.
    pub fn near(&self, [x, z]: [f64; 2], reach: f64, later: f64) -> Option<Near> {
        let first = self.points.partition_point(|p| p[0] < x - reach);
        let last = self.points.partition_point(|p| p[0] <= x + reach);
        let point = |i: usize| {
            let [x, z] = self.points[i];
            [x, z + self.rise[i] * later]
        };
        // Height over the line, which has one at each place, says the side: beside a ridge both segments, prolonged, may not.
        let right = self
            .points
            .partition_point(|p| p[0] <= x)
            .clamp(1, self.points.len().max(2) - 1);
        let over = match self.points.get(right) {
            Some(_) => {
                let (a, b) = (point(right - 1), point(right));
                let share = ((x - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
                z - (a[1] + share * (b[1] - a[1]))
            }
            None => z,
        };
        let mut best: Option<(f64, Near)> = None;
        for i in first.saturating_sub(1)..last.min(self.points.len().saturating_sub(1)) {
            if !(self.covered[i] || self.covered[i + 1]) {
                continue;
            }
            let (a, b) = (point(i), point(i + 1));
            let along = [b[0] - a[0], b[1] - a[1]];
            let square = along[0] * along[0] + along[1] * along[1];
            let way = ((x - a[0]) * along[0] + (z - a[1]) * along[1]) / square;
            let t = way.clamp(0.0, 1.0);
            let place = [a[0] + t * along[0], a[1] + t * along[1]];
            let apart = [x - place[0], z - place[1]];
            let far = apart[0] * apart[0] + apart[1] * apart[1];
            if best.as_ref().is_some_and(|(least, _)| *least <= far) {
                continue;
            }
            let length = square.sqrt();
            let mut normal = [-along[1] / length, along[0] / length];
            let distance = far.sqrt().copysign(over);
            if t != way && far > 0.0 {
                normal = apart.map(|c| c / distance);
            }
            let between = |of: &dyn Fn(usize) -> f64| of(i) + t * (of(i + 1) - of(i));
            let matter = [0, 1].map(|c| between(&|i| self.velocity[i][c]));
            let rise = between(&|i| self.rise[i]) * normal[1];
            let tangent = [normal[1], -normal[0]];
            let slide = matter[0] * tangent[0] + matter[1] * tangent[1];
            let velocity = [0, 1].map(|c| slide * tangent[c] + rise * normal[c]);
            let near = Near {
                distance,
                normal,
                place,
                velocity,
            };
            best = Some((far, near));
        }
        best.map(|(_, near)| near)
    }

    /// Appends it to a memory.
    pub fn write(&self, memory: &mut Vec<f64>) {
        memory.push(self.points.len() as f64);
        for (i, point) in self.points.iter().enumerate() {
            memory.extend(point);
            memory.extend(self.velocity[i]);
            memory.extend([self.rise[i], f64::from(u8::from(self.covered[i]))]);
        }
    }

    /// Reads it from the front of a memory, and says what follows.
    pub fn read(memory: &[f64]) -> Option<(Self, &[f64])> {
        let (count, rest) = memory.split_first()?;
        let (rows, rest) = rest.split_at_checked(6 * *count as usize)?;
        let mut line = Self::default();
        for [x, z, u, w, rise, covered] in rows.as_chunks::<6>().0 {
            line.points.push([*x, *z]);
            line.velocity.push([*u, *w]);
            line.rise.push(*rise);
            line.covered.push(*covered > 0.0);
        }
        Some((line, rest))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)] // a test may panic
    use super::*;

    fn roof() -> SurfaceLine {
        SurfaceLine {
            points: vec![[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [3.0, 0.0], [4.0, 0.0]],
            covered: vec![false, true, true, true, false],
            velocity: vec![[1.0, 0.0]; 5],
            rise: vec![0.5; 5],
        }
    }

    #[test]
    fn distances_to_a_roof_are_exact() {
        let half = 0.5_f64.sqrt();
        let above = roof().near([1.0, 1.0], 3.0, 0.0).unwrap();
        assert!((above.distance - half).abs() < 1e-15 && (above.normal[0] + half).abs() < 1e-15);
        let below = roof().near([1.6, 0.4], 3.0, 0.0).unwrap();
        assert!((below.distance + 0.2 * half).abs() < 1e-15, "{below:?}");
        assert!(below.normal[1] > 0.0);
        // Over the ridge the normal points to the place.
        let ridge = roof().near([2.0, 1.5], 3.0, 0.0).unwrap();
        assert!((ridge.distance - 0.5).abs() < 1e-15 && (ridge.normal[1] - 1.0).abs() < 1e-15);
        // A second later it has risen; matter slides along it.
        let later = roof().near([2.0, 2.5], 3.0, 1.0).unwrap();
        assert!((later.distance - 1.0).abs() < 1e-15 && (later.velocity[1] - 0.5).abs() < 1e-15);
        assert!((later.velocity[0] - 1.0).abs() < 1e-15);
        assert_eq!(roof().near([9.0, 0.1], 0.5, 0.0), None);
    }

    #[test]
    fn a_bluff_has_its_sides() {
        let bluff = SurfaceLine {
            points: vec![[0.0, 0.0], [1.0, 0.3], [2.0, 0.6], [3.0, -5.4], [4.0, -5.4]],
            covered: vec![true; 5],
            velocity: vec![[0.0; 2]; 5],
            rise: vec![0.0; 5],
        };
        let beside = bluff.near([4.5, 1.4], 8.0, 0.0).unwrap();
        assert!(beside.distance > 0.0, "{beside:?}");
        for i in 0..60 {
            for k in 0..60 {
                let at = [0.5 + 0.05 * f64::from(i), -7.0 + 0.2 * f64::from(k)];
                let share = |a: [f64; 2], b: [f64; 2]| a[1] + (at[0] - a[0]) * (b[1] - a[1]);
                let left = (at[0] as usize).min(3);
                let line = share(bluff.points[left], bluff.points[left + 1]);
                let near = bluff.near(at, 8.0, 0.0).unwrap();
                let outside = at[1] - line;
                assert!(near.distance * outside >= 0.0, "{at:?} {near:?}");
                // The normal leads from the place of the line to the one asked about, or away from it below.
                let apart = [at[0] - near.place[0], at[1] - near.place[1]];
                let off = [0, 1].map(|c| apart[c] - near.distance * near.normal[c]);
                assert!(off[0].hypot(off[1]) < 1e-12 && near.normal.iter().all(|n| n.is_finite()));
            }
        }
    }

    #[test]
    fn a_line_is_remembered() {
        let mut memory = Vec::new();
        roof().write(&mut memory);
        memory.push(7.0);
        assert_eq!(SurfaceLine::read(&memory), Some((roof(), &[7.0][..])));
    }
}
