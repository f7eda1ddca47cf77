//! Planes that fit the matter above ground in a cell and around it, in the sense of least squares: see
//! [`shores`](super::shores).

use std::f64::consts::FRAC_PI_6;

use super::Ground;
use super::volumes::common_volume;
use crate::free_surface::fraction::{EXACT, Neighbourhood, STENCIL};
use crate::free_surface::plane::Plane;

/// Planes whose misses differ by less than this part are averaged.
const ALIKE: f64 = 1e-4;
/// Steps to the plane that holds a given volume.
const STEPS: usize = 60;
/// Volumes that differ by less, in cells, are the same.
const SAME: f64 = 1e-15;
/// Most planes to begin with: that of the cell itself, those of the cells beside it, a level one.
const MOST_CANDIDATES: usize = 8;
/// Planes that miss by more, in squares of cells, are too far off to begin with.
const FAR: f64 = 1e-2;
/// Turns of a plane towards the least miss.
const TURNS: usize = 8;
/// Angle over which the change of volumes with a turn is taken.
const SMALL_ANGLE: f64 = 1e-6;
/// Largest turn at once.
const LARGEST_TURN: f64 = FRAC_PI_6;
/// A turn that leaves more than this part of a miss is the last one.
const SETTLED: f64 = 0.5;
/// Smallest square of the change of volumes, in cells, with an angle by which a plane is determined.
const DETERMINED: f64 = 1e-4;

/// Misses of a plane in the cells of a neighbourhood, and the sum of their squares.
type Misses = ([f64; STENCIL], f64);

impl<const D: usize> Ground<D> {
    /// The plane that misses the matter around a cell least, from the best one of those at hand, and the sum of the squares of
    /// its misses; none where the neighbours do not tell, or none at hand comes near.
    pub(super) fn fitted_plane(
        &self,
        around: &Neighbourhood<'_, D>,
        at_hand: impl Iterator<Item = Plane>,
    ) -> Option<(Plane, f64)> {
        let mut plane = self.best_plane(around, at_hand)?;
        let mut misses = self.misses(around, &plane);
        for _ in 0..TURNS {
            if misses.1 <= EXACT {
                break;
            }
            let Some(mut turn) = self.turn(around, &plane, &misses) else {
                break;
            };
            let before = misses.1;
            for _ in 0..4 {
                let normal = std::array::from_fn(|axis| plane.normal[axis] + turn[axis]);
                let turned = self.holding(around.cell(), normal, around.fraction());
                let found = self.misses(around, &turned);
                if found.1 < misses.1 {
                    plane = turned;
                    misses = found;
                    break;
                }
                turn = turn.map(|t| 0.25 * t);
            }
            if misses.1 > SETTLED * before {
                break;
            }
        }
        Some((plane, misses.1))
    }

    /// The change of a plane's normal by Gauss's and Newton's method; none where it is not determined.
    fn turn(
        &self,
        around: &Neighbourhood<'_, D>,
        plane: &Plane,
        misses: &Misses,
    ) -> Option<[f64; 3]> {
        let ways = tangents::<D>(plane.normal);
        let mut changes = [[0.0; STENCIL]; 2];
        for (way, changes) in ways.iter().zip(&mut changes).take(D - 1) {
            let normal = std::array::from_fn(|axis| plane.normal[axis] + SMALL_ANGLE * way[axis]);
            let turned = self.holding(around.cell(), normal, around.fraction());
            let (there, _) = self.misses(around, &turned);
            for ((change, there), here) in changes.iter_mut().zip(there).zip(misses.0) {
                *change = (there - here) / SMALL_ANGLE;
            }
        }
        let dot = |a: &[f64; STENCIL], b: &[f64; STENCIL]| -> f64 {
            a.iter().zip(b).map(|(a, b)| a * b).sum()
        };
        let [a, b, c] = [(0, 0), (0, 1), (1, 1)].map(|(n, m)| dot(&changes[n], &changes[m]));
        let [f, g] = [0, 1].map(|n| -dot(&changes[n], &misses.0));
        let angles = if D == 2 {
            (a > DETERMINED).then(|| [f / a, 0.0])?
        } else {
            let determinant = a * c - b * b;
            // Over the trace: not more than the smaller eigenvalue.
            (determinant > DETERMINED * (a + c))
                .then(|| [(c * f - b * g) / determinant, (a * g - b * f) / determinant])?
        };
        let length = angles[0].hypot(angles[1]);
        let part = (LARGEST_TURN / length).min(1.0);
        Some(std::array::from_fn(|axis| {
            part * (angles[0] * ways[0][axis] + angles[1] * ways[1][axis])
        }))
    }

    /// The plane of the direction of that one which misses the matter around a cell least; in space the mean of those as
    /// good.
    fn best_plane(
        &self,
        around: &Neighbourhood<'_, D>,
        at_hand: impl Iterator<Item = Plane>,
    ) -> Option<Plane> {
        let mut found: [Option<(Plane, f64)>; MOST_CANDIDATES] = [None; MOST_CANDIDATES];
        let mut least = FAR;
        for (slot, plane) in found.iter_mut().zip(at_hand) {
            let miss = self.miss(around, &plane, (1.0 + ALIKE) * least + EXACT);
            least = least.min(miss);
            *slot = Some((plane, miss));
        }
        let mut sum = [0.0; 3];
        let mut best: Option<(Plane, f64)> = None;
        let mut count = 0;
        for (plane, miss) in found.into_iter().flatten().filter(|found| found.1 <= FAR) {
            if best.is_none_or(|(_, least)| miss < least) {
                best = Some((plane, miss));
            }
            if miss <= (1.0 + ALIKE) * least + EXACT {
                count += 1;
                for (sum, n) in sum.iter_mut().zip(plane.normal) {
                    *sum += n;
                }
            }
        }
        let (mut plane, _) = best?;
        if D > 2 && count > 1 && sum.iter().any(|n| n.abs() > 0.1) {
            plane.normal = sum;
        }
        Some(self.holding(around.cell(), plane.normal, around.fraction()))
    }

    /// By how much a plane of a cell misses the matter in it and around it, cell by cell.
    fn misses(&self, around: &Neighbourhood<'_, D>, plane: &Plane) -> Misses {
        let mut all = [0.0; STENCIL];
        let mut sum = 0.0;
        for (slot, (cell, low, fraction)) in all.iter_mut().zip(around.places()) {
            *slot = self.miss_in(cell, plane, low, fraction);
            sum += *slot * *slot;
        }
        (all, sum)
    }

    /// The sum of their squares, given up beyond `most`.
    pub(super) fn miss(&self, around: &Neighbourhood<'_, D>, plane: &Plane, most: f64) -> f64 {
        let mut sum = 0.0;
        for (cell, low, fraction) in around.places() {
            let miss = self.miss_in(cell, plane, low, fraction);
            sum += miss * miss;
            if sum > most {
                break;
            }
        }
        sum
    }

    fn miss_in(&self, cell: usize, plane: &Plane, low: [f64; 3], fraction: f64) -> f64 {
        self.matter_under(cell, &seen_from(plane, low)) - fraction
    }

    /// Matter under a plane in a cell, in cells.
    pub(super) fn matter_under(&self, cell: usize, plane: &Plane) -> f64 {
        if self.free[cell] == 0.0 {
            return 0.0;
        }
        let all = plane.volume_in([0.0; 3], [1.0; 3]);
        if let Ok(at) = self.bends.binary_search_by_key(&cell, |bend| bend.0) {
            return all - self.bends[at].1.under(plane);
        }
        match &self.planes[cell] {
            None => (all - self.solid[cell]).max(0.0),
            Some(ground) => all - common_volume(plane, ground),
        }
    }

    /// The plane of a normal under which a cell holds so much matter.
    pub(super) fn holding(&self, cell: usize, normal: [f64; 3], fraction: f64) -> Plane {
        let mut plane = Plane::of_fraction(normal, (fraction + self.solid[cell]).min(1.0));
        // Without ground that stands out this is all. Where some does the plane lies lower.
        let excess = |plane: &Plane| self.matter_under(cell, plane) - fraction;
        let mut high = (plane.offset, excess(&plane));
        if high.1 <= SAME {
            return plane;
        }
        let lowest = plane.normal.iter().map(|m| m.min(0.0)).sum();
        let mut low = (lowest, -fraction);
        // Regula falsi; an end that stays counts half (Illinois).
        let mut last = 0.0;
        for _ in 0..STEPS {
            if high.1 - low.1 <= 0.0 || high.0 <= low.0 {
                break;
            }
            plane.offset = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let found = excess(&plane);
            if found.abs() <= SAME {
                break;
            }
            if found > 0.0 {
                high = (plane.offset, found);
                low.1 *= if last > 0.0 { 0.5 } else { 1.0 };
            } else {
                low = (plane.offset, found);
                high.1 *= if last < 0.0 { 0.5 } else { 1.0 };
            }
            last = found;
        }
        plane
    }
}

/// A plane in the coordinates of the cell with its lower corner there.
pub(super) fn seen_from(plane: &Plane, low: [f64; 3]) -> Plane {
    Plane {
        offset: plane.depth(low),
        ..*plane
    }
}

/// Directions of unit length across a normal and across each other; in a plane one.
fn tangents<const D: usize>(normal: [f64; 3]) -> [[f64; 3]; 2] {
    let [x, y, z] = normal;
    if D == 2 {
        return [[-y, x, 0.0], [0.0; 3]];
    }
    let least = if x.abs() <= y.abs() && x.abs() <= z.abs() {
        [1.0, 0.0, 0.0]
    } else if y.abs() <= z.abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let one = cross(normal, least);
    let length = one.iter().map(|x| x * x).sum::<f64>().sqrt();
    let one = one.map(|x| x / length);
    [one, cross(normal, one)]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
}
