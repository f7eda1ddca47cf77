//! What grains and continuum give each other, and what the monitors say.

use crate::overlap::joint::miss_over;
use crate::overlap::windows::{self, Of, Sums};
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

/// Sums over the exchanges for means in time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Monitors {
    /// Exchanges seen.
    pub exchanges: f64,
    /// Σ of the normal force of the contacts that cross the handshake surface, and of the continuum's stress (N).
    pub force: [f64; 2],
    /// Most grains beyond the box by more than a diameter.
    pub escaped: f64,
    /// Grains times their steps.
    pub grain_steps: f64,
    /// Steps of the continuum, and active cells in them.
    pub steps: [f64; 2],
    /// Newton iterations of the continuum.
    pub iterations: f64,
    /// Largest residual of the continuum's momentum.
    pub residual: f64,
    /// Σ of the granular temperature ⟨v′²⟩/3 of the buffer, of the inner overlap, and of as much of the grains beyond it
    /// (m²/s²).
    pub temperature: [f64; 3],
    /// Work on the grains of the traction, of the impedance and of the relaxation (J), by velocities when they are laid;
    /// negative where it takes energy from them.
    pub work: [f64; 3],
    /// Sizes of slip and relaxation.
    pub(in crate::overlap) windows: Sums,
}

/// Numbers of the monitors without those of the windows, and with them.
const OWN: usize = 15;
/// See `OWN`.
pub const MONITORED: usize = OWN + windows::NUMBERS;

impl Monitors {
    /// All of it in a row of numbers.
    pub fn numbers(&self) -> [f64; MONITORED] {
        let own: [f64; OWN] = [
            self.exchanges,
            self.force[0],
            self.force[1],
            self.escaped,
            self.grain_steps,
            self.steps[0],
            self.steps[1],
            self.iterations,
            self.residual,
            self.temperature[0],
            self.temperature[1],
            self.temperature[2],
            self.work[0],
            self.work[1],
            self.work[2],
        ];
        let windows = self.windows.numbers();
        std::array::from_fn(|k| match k.checked_sub(OWN) {
            None => own[k],
            Some(k) => windows[k],
        })
    }

    /// From such numbers.
    pub fn of(n: &[f64; MONITORED]) -> Self {
        Self {
            exchanges: n[0],
            force: [n[1], n[2]],
            escaped: n[3],
            grain_steps: n[4],
            steps: [n[5], n[6]],
            iterations: n[7],
            residual: n[8],
            temperature: [n[9], n[10], n[11]],
            work: [n[12], n[13], n[14]],
            windows: Sums::from_numbers(&std::array::from_fn(|k| n[OWN + k])),
        }
    }

    /// Size of the slip at the handshake surface, by means over windows in time ([`windows`]), mean over cells and windows (m/s).
    pub fn mean_slip(&self) -> f64 {
        self.windows.of(Of::Slip).mean()
    }

    /// What the noise of the grains' velocities alone would make it (m/s).
    pub fn slip_noise(&self) -> f64 {
        self.windows.of(Of::Slip).noise()
    }

    /// Largest mean of one window (m/s).
    pub fn largest_slip(&self) -> f64 {
        self.windows.of(Of::Slip).largest
    }

    /// Mean granular temperatures of the buffer, the inner overlap and the grains beyond it (m²/s²).
    pub fn temperatures(&self) -> [f64; 3] {
        self.temperature.map(|sum| sum / self.exchanges.max(1.0))
    }

    /// Normal force of the grains' contacts over that of the continuum's at the handshake surface.
    pub fn force_ratio(&self) -> f64 {
        self.force[0] / self.force[1]
    }

    /// Impulse of the relaxation, cell by cell, over that of the traction, face by face, by sizes of means over windows.
    pub fn relaxation_share(&self) -> f64 {
        self.windows.of(Of::Relaxation).size / self.windows.of(Of::Traction).size
    }

    /// What the noise of the grains' velocities alone would make it.
    pub fn relaxation_noise(&self) -> f64 {
        self.windows.of(Of::Relaxation).floor / self.windows.of(Of::Traction).size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accounts_and_monitors_come_back_from_their_numbers() {
        let numbers: [f64; NUMBERS] = std::array::from_fn(|k| k as f64 + 0.5);
        assert_eq!(Account::of(&numbers).numbers(), numbers);
        let numbers: [f64; MONITORED] = std::array::from_fn(|k| k as f64 + 0.5);
        assert_eq!(Monitors::of(&numbers).numbers(), numbers);
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
