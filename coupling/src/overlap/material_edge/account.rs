//! What grains and continuum give each other.

use super::side::Side;
use crate::overlap::joint::miss_over;
use nalgebra::Vector2;

/// Momentum along x and z since the start (N s), and masses (kg).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Account {
    /// Of grains and continuum together at the start, each counted on its side of the handshake surface.
    pub mass: f64,
    /// Of the grains when the edge was cut, with what walls had taken.
    pub grains_before: Vector2<f64>,
    /// Of the continuum then.
    pub continuum_before: Vector2<f64>,
    /// Weight of the grains.
    pub weight: Vector2<f64>,
    /// Of the continuum's traction on the grains.
    pub traction: Vector2<f64>,
    /// Of the impedance on the grains.
    pub impedance: Vector2<f64>,
    /// Of the relaxation on the grains, and of what carries those that lie in the continuum; it takes the opposite.
    pub relaxation: Vector2<f64>,
    /// Of the relaxation on the continuum.
    pub answer: Vector2<f64>,
    /// That the copy was given when it was made anew from the grains.
    pub following: Vector2<f64>,
    /// Of the relaxation on cells that had no velocity to take it.
    pub untaken: Vector2<f64>,
    /// Weight of the continuum, copy included.
    pub continuum_weight: Vector2<f64>,
    /// That of grains which came when the edge moved, less that of those which went.
    pub handed: Vector2<f64>,
    /// Volume that the copy was given when it was made anew, in the continuum's own unit.
    pub copied: f64,
}

/// Numbers of an account.
pub const NUMBERS: usize = 24;

impl Account {
    /// All of it in a row of numbers.
    pub fn numbers(&self) -> [f64; NUMBERS] {
        let rows = self.rows();
        std::array::from_fn(|k| match k.checked_sub(2) {
            None => [self.mass, self.copied][k],
            Some(k) => rows[k / 2][k % 2],
        })
    }

    fn rows(&self) -> [Vector2<f64>; 11] {
        [
            self.grains_before,
            self.continuum_before,
            self.weight,
            self.traction,
            self.impedance,
            self.relaxation,
            self.answer,
            self.following,
            self.untaken,
            self.continuum_weight,
            self.handed,
        ]
    }

    /// Adds the account of an edge, along its own axis. Volumes have units of their own and are left out.
    pub(super) fn add(&mut self, edge: &Self, side: Side) {
        let (own, more) = (self.rows(), edge.rows());
        let mut sum = self.numbers();
        for (k, (own, more)) in own.iter().zip(more).enumerate() {
            let more = side.in_plane(more.into());
            for axis in 0..2 {
                sum[2 + 2 * k + axis] = own[axis] + more[axis];
            }
        }
        *self = Self::of(&sum);
    }

    /// From such numbers.
    pub fn of(n: &[f64; NUMBERS]) -> Self {
        let row = |k: usize| Vector2::new(n[2 + 2 * k], n[3 + 2 * k]);
        Self {
            mass: n[0],
            copied: n[1],
            grains_before: row(0),
            continuum_before: row(1),
            weight: row(2),
            traction: row(3),
            impedance: row(4),
            relaxation: row(5),
            answer: row(6),
            following: row(7),
            untaken: row(8),
            continuum_weight: row(9),
            handed: row(10),
        }
    }

    /// Error of the grains' account over its largest entry, for their momentum now with what walls have taken.
    pub fn grains_error(&self, now: [f64; 2]) -> f64 {
        let now = now.into();
        let given = [
            self.weight,
            self.traction,
            self.impedance,
            self.relaxation,
            self.handed,
        ];
        let miss = now - self.grains_before - given.iter().sum::<Vector2<f64>>();
        miss_over(miss, given.iter().chain([&now, &self.grains_before]))
    }

    /// Error of what the relaxation gave to both sides, `owed` being what the continuum has still to take, over the
    /// largest entry.
    pub fn exchange_error(&self, owed: [f64; 2]) -> f64 {
        let miss = self.relaxation + self.answer + Vector2::from(owed);
        miss_over(miss, [&self.relaxation, &self.weight])
    }

    /// What the continuum has had from walls, from the ground and from the stress on its surface: what is left of its momentum now
    /// (N s).
    pub fn from_walls_and_surface(&self, now: [f64; 2]) -> Vector2<f64> {
        Vector2::from(now)
            - self.continuum_before
            - self.continuum_weight
            - self.answer
            - self.following
            + self.untaken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_account_comes_back_from_its_numbers() {
        let numbers: [f64; NUMBERS] = std::array::from_fn(|k| k as f64 + 0.5);
        assert_eq!(Account::of(&numbers).numbers(), numbers);
    }

    #[test]
    fn an_account_that_lacks_an_entry_does_not_close() {
        let mut account = Account {
            grains_before: Vector2::new(1.0, 2.0),
            weight: Vector2::new(0.0, -8.0),
            traction: Vector2::new(3.0, 0.5),
            impedance: Vector2::new(-1.0, 0.0),
            relaxation: Vector2::new(0.25, 0.25),
            ..Account::default()
        };
        let now = [3.25, -5.25];
        assert_eq!(account.grains_error(now), 0.0);
        account.impedance.fill(0.0);
        assert_eq!(account.grains_error(now), 1.0 / 8.0);
        account.answer = Vector2::new(-0.25, -0.125);
        assert_eq!(account.exchange_error([0.0, -0.125]), 0.0);
        assert!(account.exchange_error([0.0; 2]) > 0.01);
    }
}
