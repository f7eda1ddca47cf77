//! Grains put by outside the box, and by how much the continuum has sheared their neighbourhoods since.
//!
//! What is kept goes where the continuum goes. B = F Fᵀ says how far that has pulled neighbours apart,
//!
//! ```text
//! dB/dt = L B + B Lᵀ,  B(0) = 1,  L = ∂u_i/∂x_j,      γ = √(tr B − 3)
//! ```
//! γ is the shear of a simple shear that does as much. A shear that is taken back leaves nothing: the grains lie again as they did.

use colluvium_dem::{Grain, Patch};
use nalgebra::Matrix3;

/// Stored grains with their B.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Store {
    pub patch: Patch,
    /// xx, yy, zz, xy, xz, yz of B of each grain, in the order of its numbers.
    pub stretch: Vec<[f64; STRETCHES]>,
}

/// Numbers of B.
pub(super) const STRETCHES: usize = 6;
/// B of what has just been put by.
const NONE: [f64; STRETCHES] = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

impl Store {
    /// What has just been put by.
    pub fn fresh(patch: Patch) -> Self {
        Self {
            stretch: vec![NONE; patch.ids.len()],
            patch,
        }
    }

    /// Takes those grains out for which `f` says so by their numbers and themselves.
    pub fn split(&mut self, f: impl FnMut(u32, &Grain) -> bool) -> Self {
        let before = self.patch.ids.clone();
        let patch = self.patch.split(f);
        let stretches = std::mem::take(&mut self.stretch);
        let rows = before.iter().zip(stretches);
        let (mut taken, mut rest) = (Vec::new(), Vec::new());
        for (id, stretch) in rows {
            match patch.ids.binary_search(id).is_ok() {
                true => taken.push(stretch),
                false => rest.push(stretch),
            }
        }
        self.stretch = rest;
        Self {
            patch,
            stretch: taken,
        }
    }

    /// Takes others in, none of which it has.
    pub fn merge(&mut self, other: &Self) {
        let rows = |store: &Self| -> Vec<(u32, [f64; STRETCHES])> {
            let ids = store.patch.ids.iter().copied();
            ids.zip(store.stretch.iter().copied()).collect()
        };
        let mut all = [rows(self), rows(other)].concat();
        all.sort_unstable_by_key(|(id, _)| *id);
        self.stretch = all.into_iter().map(|(_, stretch)| stretch).collect();
        self.patch.merge(&other.patch);
    }

    /// Whether it has a grain of this number.
    pub fn has(&self, id: u32) -> bool {
        self.patch.ids.binary_search(&id).is_ok()
    }

    /// Its grains, each with its B.
    pub fn rows(&self) -> impl Iterator<Item = (&Grain, Matrix3<f64>)> {
        let stretches = self.stretch.iter().map(tensor);
        self.patch.grains.iter().zip(stretches)
    }
}

/// B of its numbers.
fn tensor(&[xx, yy, zz, xy, xz, yz]: &[f64; STRETCHES]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// B after a time in which the continuum moved by its gradient, F → (1 + Δt L) F: `step` is Δt L.
pub(super) fn stretched(stretch: &[f64; STRETCHES], step: &Matrix3<f64>) -> [f64; STRETCHES] {
    let by = Matrix3::identity() + step;
    let b = by * tensor(stretch) * by.transpose();
    [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|at| b[at])
}

/// γ of B.
pub(super) fn shear_of(b: &Matrix3<f64>) -> f64 {
    (b.trace() - 3.0).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn simple_shear_counts_as_its_shear_and_turning_as_none() {
        let sheared = |n: usize, rate: f64, mut b: [f64; STRETCHES]| {
            for _ in 0..n {
                let mut step = Matrix3::zeros();
                step[(0, 2)] = rate;
                b = stretched(&b, &step);
            }
            b
        };
        let b = sheared(50, 0.01, NONE);
        assert!((shear_of(&tensor(&b)) - 0.5).abs() < 1e-12);
        let back = sheared(50, -0.01, b);
        assert!(shear_of(&tensor(&back)) < 1e-6);
        let mut turned = NONE;
        for _ in 0..1000 {
            turned = stretched(
                &turned,
                &Matrix3::new(0.0, -1e-4, 0.0, 1e-4, 0.0, 0.0, 0.0, 0.0, 0.0),
            );
        }
        // Explicit steps swell by (Δt ω)² each.
        assert!(shear_of(&tensor(&turned)) < 5e-3);
    }

    #[test]
    fn what_is_split_and_merged_keeps_its_own() {
        let grain = |x: f64| Grain::at_rest(Vector3::new(x, 0.0, 0.0), 0.5, 1.0);
        let mut store = Store::fresh(Patch {
            grains: vec![grain(0.0), grain(1.0), grain(2.0)],
            ids: vec![3, 5, 9],
            ..Patch::default()
        });
        for (stretch, id) in store.stretch.iter_mut().zip([3.0, 5.0, 9.0]) {
            stretch[0] = id;
        }
        let whole = store.clone();
        let middle = store.split(|id, _| id == 5);
        assert_eq!((store.has(5), middle.has(5)), (false, true));
        assert_eq!(middle.stretch[0][0], 5.0);
        store.merge(&middle);
        assert_eq!(store, whole);
    }
}
