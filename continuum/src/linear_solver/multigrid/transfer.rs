//! Interpolation between a grid and the one with cells twice as long.
//!
//! Velocities are interpolated linearly: along their own axis between faces, where a velocity that is no
//! unknown counts as zero, and across it between the middles of faces, where what is missing is left out.
//! So what flows out of a coarse cell spreads evenly over its cells. Pressures are constant in coarse
//! cells.

use super::Columns;
use crate::linear_solver::Place;

/// Stands for a place without an unknown.
const NONE: u32 = u32::MAX;

/// Interpolation from a coarse grid to a fine one; its transpose restricts.
pub(super) struct Transfer {
    /// Fine unknowns that a coarse one acts on, with weights, by coarse unknowns.
    pub(super) child_starts: Vec<u32>,
    pub(super) children: Vec<(u32, f64)>,
    /// The same by fine unknowns.
    pub(super) parent_starts: Vec<u32>,
    pub(super) parents: Vec<(u32, f64)>,
    pub(super) fine_definite: usize,
    /// Whether a fine pressure follows its coarse one.
    pub(super) is_free: Vec<bool>,
    correction: Vec<f64>,
}

/// Axis along which a face is crossed.
fn component<const D: usize>(place: &Place<D>) -> usize {
    place.iter().position(|p| p % 2 == 0).unwrap_or(0)
}

/// Positions of coarse unknowns (in coarse half cells) along one axis between which a fine one lies, with
/// weights.
fn between(place: u32, is_across: bool) -> [(Option<u32>, f64); 2] {
    let number = place / 2;
    if is_across {
        let own = number / 2;
        if number.is_multiple_of(2) {
            [(Some(2 * own), 1.0), (None, 0.0)]
        } else {
            [(Some(2 * own), 0.5), (Some(2 * own + 2), 0.5)]
        }
    } else {
        let own = number / 2;
        let other = if number.is_multiple_of(2) {
            own.checked_sub(1)
        } else {
            Some(own + 1)
        };
        [(Some(2 * own + 1), 0.75), (other.map(|o| 2 * o + 1), 0.25)]
    }
}

impl Transfer {
    /// The transfer from unknowns at the given places, with the places of the coarse unknowns and how many of
    /// them are velocities.
    pub(super) fn new<const D: usize>(
        places: &[Place<D>],
        definite: usize,
    ) -> (Self, Vec<Place<D>>, usize) {
        // Coarse unknowns, and which stands at a place.
        let extent: [usize; D] = std::array::from_fn(|axis| {
            let most = places.iter().map(|p| p[axis]).max().unwrap_or(0);
            most as usize / 2 + 4
        });
        let flat = |place: &Place<D>| {
            (0..D)
                .rev()
                .fold(0, |sum, axis| sum * extent[axis] + place[axis] as usize)
        };
        let mut at = vec![NONE; extent.iter().product()];
        let mut coarse: Vec<Place<D>> = Vec::new();
        let mut coarse_definite = 0;
        for (unknown, place) in places.iter().enumerate() {
            let own = if unknown < definite {
                let across = component(place);
                if place[across] % 4 != 0 {
                    continue;
                }
                let mut own = place.map(|p| p / 4 * 2 + 1);
                own[across] = place[across] / 2;
                own
            } else {
                place.map(|p| p / 4 * 2 + 1)
            };
            let entry = &mut at[flat(&own)];
            if *entry == NONE {
                *entry = coarse.len() as u32;
                coarse.push(own);
                if unknown < definite {
                    coarse_definite += 1;
                }
            }
        }
        let mut parent_starts = vec![0];
        let mut parents: Vec<(u32, f64)> = Vec::new();
        for (unknown, place) in places.iter().enumerate() {
            if unknown >= definite {
                parents.push((at[flat(&place.map(|p| p / 4 * 2 + 1))], 1.0));
                parent_starts.push(parents.len() as u32);
                continue;
            }
            let across = component(place);
            let ways: [[(Option<u32>, f64); 2]; D] =
                std::array::from_fn(|axis| between(place[axis], axis == across));
            for side in ways[across] {
                let first = parents.len();
                let mut found = 0.0;
                for corner in 0..1_usize << (D - 1) {
                    let mut bits = corner;
                    let mut weight = side.1;
                    let target: [Option<u32>; D] = std::array::from_fn(|axis| {
                        if axis == across {
                            return side.0;
                        }
                        let (position, share) = ways[axis][bits & 1];
                        bits >>= 1;
                        weight *= share;
                        position
                    });
                    if weight == 0.0 || target.contains(&None) {
                        continue;
                    }
                    let target = target.map(|t| t.unwrap_or(0));
                    let parent = at[flat(&target)];
                    if parent != NONE {
                        parents.push((parent, weight));
                        found += weight;
                    }
                }
                for (_, weight) in &mut parents[first..] {
                    *weight *= side.1 / found;
                }
            }
            parent_starts.push(parents.len() as u32);
        }
        let mut child_starts = vec![0_u32; coarse.len() + 1];
        for (parent, _) in &parents {
            child_starts[*parent as usize + 1] += 1;
        }
        for c in 0..coarse.len() {
            child_starts[c + 1] += child_starts[c];
        }
        let mut next = child_starts.clone();
        let mut children = vec![(0, 0.0); parents.len()];
        for fine in 0..places.len() {
            for p in parent_starts[fine]..parent_starts[fine + 1] {
                let (parent, weight) = parents[p as usize];
                let next = &mut next[parent as usize];
                children[*next as usize] = (fine as u32, weight);
                *next += 1;
            }
        }
        let transfer = Self {
            child_starts,
            children,
            parent_starts,
            parents,
            fine_definite: definite,
            is_free: vec![true; places.len() - definite],
            correction: vec![0.0; places.len()],
        };
        (transfer, coarse, coarse_definite)
    }

    pub(super) fn coarse_size(&self) -> usize {
        self.child_starts.len() - 1
    }

    #[inline]
    pub(super) fn children_of(&self, coarse: usize) -> &[(u32, f64)] {
        &self.children[self.child_starts[coarse] as usize..self.child_starts[coarse + 1] as usize]
    }

    #[inline]
    pub(super) fn parents_of(&self, fine: usize) -> &[(u32, f64)] {
        &self.parents[self.parent_starts[fine] as usize..self.parent_starts[fine + 1] as usize]
    }

    /// Whether a fine unknown takes part.
    #[inline]
    pub(super) fn takes_part(&self, fine: usize) -> bool {
        fine < self.fine_definite || self.is_free[fine - self.fine_definite]
    }

    /// Coarse residual: weighted sum of the fine one.
    pub(super) fn restrict(&self, fine: &[f64], coarse: &mut [f64]) {
        for (c, sum) in coarse.iter_mut().enumerate() {
            *sum = self
                .children_of(c)
                .iter()
                .filter(|(f, _)| self.takes_part(*f as usize))
                .map(|&(f, weight)| weight * fine[f as usize])
                .sum();
        }
    }

    /// Adds the interpolated correction to the solution and takes its part off the residual.
    pub(super) fn prolong(
        &mut self,
        matrix: &Columns,
        coarse: &[f64],
        solution: &mut [f64],
        residual: &mut [f64],
    ) {
        let mut correction = std::mem::take(&mut self.correction);
        for (f, (value, solution)) in correction.iter_mut().zip(solution).enumerate() {
            *value = 0.0;
            if self.takes_part(f) {
                for &(c, weight) in self.parents_of(f) {
                    *value += weight * coarse[c as usize];
                }
            }
            *solution += *value;
        }
        matrix.subtract_product(&correction, residual);
        self.correction = correction;
    }
}
