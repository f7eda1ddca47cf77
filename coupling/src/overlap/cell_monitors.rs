//! What the monitors of joints by cells say.

use super::windows::{self, Of, Sums};
use colluvium_continuum::free_surface::SurfaceStep;

/// Sums over the exchanges for means in time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellMonitors {
    /// Exchanges seen.
    pub exchanges: f64,
    /// Σ of the force through the handshake surface (N), along x for a column, normal to the sides for a box: of the grains, by their
    /// contacts and for a column by fluctuations of their velocities, too, and of the continuum's stress.
    pub force: [f64; 2],
    /// Most grains beyond the edge by more than a diameter along its normal.
    pub escaped: f64,
    /// Steps of the continuum, and active cells in them.
    pub steps: [f64; 2],
    /// Newton iterations of the continuum's steps, and how often one was cut and tried again.
    pub newton: [f64; 2],
    /// Largest residual of the continuum's momentum.
    pub residual: f64,
    /// Σ of the granular temperature ⟨v′²⟩/3 of the buffer, of the inner overlap, and of as much of the grains beyond it
    /// (m²/s²).
    pub temperature: [f64; 3],
    /// Work on the grains of the traction, of the impedance, and of the relaxation with what carries those that lie in the
    /// continuum (J), by velocities when they are laid; negative where it takes energy from them.
    pub work: [f64; 3],
    /// Sizes of slip and relaxation.
    pub(in crate::overlap) windows: Sums,
}

/// Numbers of the monitors without those of the windows, and with them.
const OWN: usize = 15;
/// See `OWN`.
pub const MONITORED: usize = OWN + windows::NUMBERS;

impl CellMonitors {
    /// All of it in a row of numbers.
    pub fn numbers(&self) -> [f64; MONITORED] {
        let scalars = [self.exchanges, self.escaped, self.residual];
        let pairs = [self.force, self.steps, self.newton];
        let triples = [self.temperature, self.work];
        let own = scalars.iter().chain(pairs.as_flattened());
        let own = own.chain(triples.as_flattened()).copied();
        let mut all = own.chain(self.windows.numbers());
        std::array::from_fn(|_| all.next().unwrap_or_default())
    }

    /// From such numbers.
    pub fn of(n: &[f64; MONITORED]) -> Self {
        Self {
            exchanges: n[0],
            escaped: n[1],
            residual: n[2],
            force: [n[3], n[4]],
            steps: [n[5], n[6]],
            newton: [n[7], n[8]],
            temperature: [n[9], n[10], n[11]],
            work: [n[12], n[13], n[14]],
            windows: Sums::from_numbers(&std::array::from_fn(|k| n[OWN + k])),
        }
    }

    /// Takes in a step of the continuum.
    pub(super) fn take_step(&mut self, step: &SurfaceStep) {
        self.steps[0] += 1.0;
        self.steps[1] += step.active_cells as f64;
        self.newton[0] += step.newton_iterations as f64;
        self.newton[1] += step.cuts as f64;
        self.residual = self.residual.max(step.residuals.momentum);
    }

    /// Takes in an exchange.
    pub(super) fn take(&mut self, force: [f64; 2], escaped: usize, temperatures: [f64; 3]) {
        self.exchanges += 1.0;
        self.escaped = self.escaped.max(escaped as f64);
        let sums = self.force.iter_mut().chain(&mut self.temperature);
        for (sum, now) in sums.zip(force.into_iter().chain(temperatures)) {
            *sum += now;
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

    /// Mean forces of grains and continuum through the handshake surface (N).
    pub fn forces(&self) -> [f64; 2] {
        self.force.map(|sum| sum / self.exchanges.max(1.0))
    }

    /// Force of the grains over that of the continuum at the handshake surface.
    pub fn force_ratio(&self) -> f64 {
        self.force[0] / self.force[1]
    }

    /// Mean granular temperatures of the buffer, the inner overlap and the grains beyond it (m²/s²).
    pub fn temperatures(&self) -> [f64; 3] {
        self.temperature.map(|sum| sum / self.exchanges.max(1.0))
    }

    /// Impulse of the relaxation, cell by cell, over that of the traction, by rows or faces of the edge, by sizes of means over windows.
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
    fn monitors_come_back_from_their_numbers() {
        let numbers: [f64; MONITORED] = std::array::from_fn(|k| k as f64 + 0.5);
        assert_eq!(CellMonitors::of(&numbers).numbers(), numbers);
    }
}
