//! A quadrature point: a cell and one of its corners, with its rows of the operators.

use super::{COMPONENTS, VELOCITIES};
use crate::wall_friction::PointLaw;

/// A pair of a cell and a corner, with its rows of the strain-rate and interpolation operators.
#[derive(Debug, Clone)]
pub struct QuadraturePoint<const C: usize = COMPONENTS, const V: usize = VELOCITIES> {
    /// Share of the cell's volume.
    pub(crate) weight: f64,
    velocities: [usize; V],
    velocity_count: usize,
    rates: [[f64; V]; C],
    /// Strain rate due to moving walls.
    pub(super) offset: [f64; C],
    pressures: [usize; V],
    pressure_count: u32,
    /// Pressures for which there was no room.
    crowded_out: u32,
    pressure_weights: [f64; V],
    /// Part of the threshold pressure that is known beforehand.
    pub(crate) pressure_offset: f64,
    /// The boundary across z on which the corner lies: 0 low, 1 high.
    pub(crate) side: Option<usize>,
    /// Whose threshold holds here.
    pub(crate) law: PointLaw,
}

impl<const C: usize, const V: usize> QuadraturePoint<C, V> {
    pub(crate) fn new(weight: f64) -> Self {
        Self {
            weight,
            velocities: [0; V],
            velocity_count: 0,
            rates: [[0.0; V]; C],
            offset: [0.0; C],
            pressures: [0; V],
            pressure_count: 0,
            crowded_out: 0,
            pressure_weights: [0.0; V],
            pressure_offset: 0.0,
            side: None,
            law: PointLaw::Material,
        }
    }

    pub(crate) fn add_velocity(&mut self, unknown: usize, component: usize, coefficient: f64) {
        let known = &self.velocities[..self.velocity_count];
        let slot = known
            .iter()
            .position(|&v| v == unknown)
            .unwrap_or(self.velocity_count);
        if slot == self.velocity_count {
            self.velocities[slot] = unknown;
            self.velocity_count += 1;
        }
        self.rates[component][slot] += coefficient;
    }

    /// The same point of a problem in which only some unknowns are left, by their new numbers; the others keep the
    /// values given.
    pub(crate) fn restricted(
        &self,
        velocities: &[Option<usize>],
        cells: &[Option<usize>],
        u: &[f64],
        p: &[f64],
    ) -> Self {
        let mut point = Self {
            offset: self.offset,
            pressure_offset: self.pressure_offset,
            side: self.side,
            law: self.law,
            ..Self::new(self.weight)
        };
        for (slot, &j) in self.velocities().iter().enumerate() {
            for component in 0..C {
                let rate = self.rates[component][slot];
                match velocities[j] {
                    Some(unknown) => point.add_velocity(unknown, component, rate),
                    None => point.offset[component] += rate * u[j],
                }
            }
        }
        let (known, weights) = self.pressures();
        for (&cell, weight) in known.iter().zip(weights) {
            match cells[cell] {
                Some(unknown) => point.add_pressure(unknown, *weight),
                None => point.pressure_offset += weight * p[cell],
            }
        }
        point
    }

    /// Multiplies a component of the strain rate.
    pub(crate) fn scale_rate(&mut self, component: usize, factor: f64) {
        for rate in &mut self.rates[component] {
            *rate *= factor;
        }
        self.offset[component] *= factor;
    }

    /// Adds to the strain rate what a given velocity contributes.
    pub(crate) fn add_known_rate(&mut self, component: usize, rate: f64) {
        self.offset[component] += rate;
    }

    pub(crate) fn add_pressure(&mut self, cell: usize, weight: f64) {
        let count = self.pressure_count as usize;
        let known = &self.pressures[..count];
        let slot = known.iter().position(|&c| c == cell).unwrap_or(count);
        if slot == count {
            if slot == V {
                // No room for one more, which only a surface torn to shreds asks for: the nearest stands
                // for it.
                self.pressure_weights[0] += weight;
                self.crowded_out += 1;
                return;
            }
            self.pressures[slot] = cell;
            self.pressure_count += 1;
        }
        self.pressure_weights[slot] += weight;
    }

    /// The velocities that the point depends on.
    #[inline]
    pub(crate) fn velocities(&self) -> &[usize] {
        &self.velocities[..self.velocity_count]
    }

    /// ∂γ_c/∂u for each of [`velocities`](Self::velocities).
    pub(crate) fn rates(&self, component: usize) -> &[f64] {
        &self.rates[component][..self.velocity_count]
    }

    /// Cells from which the threshold pressure is interpolated, and their weights.
    #[inline]
    pub(crate) fn pressures(&self) -> (&[usize], &[f64]) {
        (
            &self.pressures[..self.pressure_count as usize],
            &self.pressure_weights[..self.pressure_count as usize],
        )
    }

    /// Whether cells had no room among these, so that the first of them stands for them.
    pub(crate) fn is_crowded(&self) -> bool {
        self.crowded_out > 0
    }

    /// Strain rate, walls included.
    #[inline]
    pub(crate) fn strain_rate(&self, u: &[f64]) -> [f64; C] {
        let mut rate = self.strain_rate_change(u);
        for (rate, offset) in rate.iter_mut().zip(self.offset) {
            *rate += offset;
        }
        rate
    }

    /// Power of a stress per volume by one of the velocities: the force on it.
    #[inline]
    pub(crate) fn force(&self, slot: usize, stress: &[f64; C]) -> f64 {
        let mut force = self.rates[0][slot] * stress[0];
        for (rates, s) in self.rates[1..].iter().zip(&stress[1..]) {
            force += rates[slot] * s;
        }
        force
    }

    /// Strain rate of a change of velocity, to which walls do not contribute.
    #[inline]
    pub(crate) fn strain_rate_change(&self, u: &[f64]) -> [f64; C] {
        let mut gamma = [0.0; C];
        for (slot, &v) in self.velocities().iter().enumerate() {
            for (gamma, rates) in gamma.iter_mut().zip(&self.rates) {
                *gamma += rates[slot] * u[v];
            }
        }
        gamma
    }

    /// Threshold pressure, not yet cut at zero.
    #[inline]
    pub(crate) fn pressure(&self, p: &[f64]) -> f64 {
        self.pressure_offset + self.pressure_change(p)
    }

    /// Threshold pressure of a change of pressure.
    #[inline]
    pub(crate) fn pressure_change(&self, p: &[f64]) -> f64 {
        let (cells, weights) = self.pressures();
        cells
            .iter()
            .zip(weights)
            .map(|(&c, w)| w * p[c])
            .sum::<f64>()
    }
}
