//! What grains and continuum give each other.

use crate::overlap::joint::miss_over;
use nalgebra::Vector3;

/// Impulses since the start (N s), and the bed's mass (kg).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Account {
    /// Mass of the bed at the start.
    pub mass: f64,
    /// Volume that the copy was given when it was made anew, in the continuum's own unit.
    pub copied: f64,
    /// Mass that became grains beyond that of the continuum whose place they took, and that no surface of the continuum
    /// was there to take off.
    pub carried: f64,
    /// Momentum of the grains when the bed was cut, with what walls had taken.
    pub grains_before: Vector3<f64>,
    /// Weight of the grains.
    pub weight: Vector3<f64>,
    /// Of the continuum's traction on the grains.
    pub traction: Vector3<f64>,
    /// Of the impedance on the grains.
    pub impedance: Vector3<f64>,
    /// Of the relaxation on the grains; the continuum takes the opposite.
    pub relaxation: Vector3<f64>,
    /// Of the relaxation on the continuum.
    pub answer: Vector3<f64>,
    /// Of the relaxation on cells that had no velocity to take it.
    pub untaken: Vector3<f64>,
    /// Momentum of grains that were put in, less that of grains taken out.
    pub handed: Vector3<f64>,
    /// Momentum that moves of the box added to both sides together, which the continuum gives back.
    pub settled: Vector3<f64>,
}

/// Numbers of an account.
pub const NUMBERS: usize = 30;

impl Account {
    /// All of it in a row of numbers.
    pub fn numbers(&self) -> [f64; NUMBERS] {
        let rows = [
            self.grains_before,
            self.weight,
            self.traction,
            self.impedance,
            self.relaxation,
            self.answer,
            self.untaken,
            self.handed,
            self.settled,
        ];
        std::array::from_fn(|k| match k.checked_sub(3) {
            None => [self.mass, self.copied, self.carried][k],
            Some(k) => rows[k / 3][k % 3],
        })
    }

    /// From such numbers.
    pub fn of(n: &[f64; NUMBERS]) -> Self {
        let row = |k: usize| Vector3::new(n[3 + 3 * k], n[4 + 3 * k], n[5 + 3 * k]);
        Self {
            mass: n[0],
            copied: n[1],
            carried: n[2],
            grains_before: row(0),
            weight: row(1),
            traction: row(2),
            impedance: row(3),
            relaxation: row(4),
            answer: row(5),
            untaken: row(6),
            handed: row(7),
            settled: row(8),
        }
    }

    /// Error of the grains' account over its largest entry, for their momentum now with what walls have taken.
    pub fn grains_error(&self, now: Vector3<f64>) -> f64 {
        let entries = [
            self.weight,
            self.traction,
            self.impedance,
            self.relaxation,
            self.handed,
        ];
        let miss = now - self.grains_before - entries.iter().sum::<Vector3<f64>>();
        miss_over(miss, entries.iter().chain([&now, &self.grains_before]))
    }

    /// Error of what the relaxation gave to both sides, `owed` being what the continuum has still to take, over the
    /// largest entry.
    pub fn exchange_error(&self, owed: Vector3<f64>) -> f64 {
        let miss = self.relaxation + self.answer + owed + self.settled;
        miss_over(miss, [&self.relaxation, &self.weight])
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
        let row = Vector3::new;
        let mut account = Account {
            grains_before: row(1.0, 0.0, 2.0),
            weight: row(0.0, 0.0, -8.0),
            traction: row(3.0, 1.0, 0.5),
            impedance: row(-1.0, 0.0, 0.0),
            relaxation: row(0.25, 0.0, 0.25),
            ..Account::default()
        };
        let now = row(3.25, 1.0, -5.25);
        assert_eq!(account.grains_error(now), 0.0);
        account.impedance = Vector3::zeros();
        assert_eq!(account.grains_error(now), 1.0 / 8.0);
        account.answer = row(-0.25, 0.0, -0.125);
        assert_eq!(account.exchange_error(row(0.0, 0.0, -0.125)), 0.0);
        assert!(account.exchange_error(Vector3::zeros()) > 0.01);
    }
}
