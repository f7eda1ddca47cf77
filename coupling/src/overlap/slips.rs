//! Grains of an overlap compared with the continuum at their own places, with the same hats h over the centres of cells on both sides.

use super::joint::{about_axes, along_axes, inertia, over};
use colluvium_dem::GrainSample;
use nalgebra::{SVector, Vector3};

/// Sums over the grains of the overlap that cover a cell, along D axes and about S of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slip<const D: usize, const S: usize> {
    /// Σ m h over the grains of the buffer (kg).
    pub buffer: f64,
    /// Σ m h (u − v) over them, u the continuum's velocity at their places (N s).
    pub buffer_slip: SVector<f64, D>,
    /// Σ I h over them, I = 2 m r²/5 (kg m²).
    pub turning: f64,
    /// Σ I h ω over them (N m s).
    pub spin: SVector<f64, S>,
    /// Σ m h over those of the inner overlap (kg).
    pub inner: f64,
    /// Σ m h (u − v) over them (N s).
    pub inner_slip: SVector<f64, D>,
}

impl<const D: usize, const S: usize> Default for Slip<D, S> {
    fn default() -> Self {
        Self {
            buffer: 0.0,
            buffer_slip: SVector::zeros(),
            turning: 0.0,
            spin: SVector::zeros(),
            inner: 0.0,
            inner_slip: SVector::zeros(),
        }
    }
}

impl<const D: usize, const S: usize> Slip<D, S> {
    /// Σ m h of buffer and inner overlap together (kg).
    pub fn mass(&self) -> f64 {
        self.buffer + self.inner
    }

    /// Σ m h (u − v) of both (N s).
    pub fn both(&self) -> SVector<f64, D> {
        self.buffer_slip + self.inner_slip
    }
}

/// A grain of the overlap that lies in the continuum.
pub(super) struct Met<'a, const D: usize, const N: usize> {
    pub grain: &'a GrainSample,
    /// Whether it lies in the buffer, else in the inner overlap.
    pub is_buffer: bool,
    /// The cells around it.
    pub hats: [(usize, f64); N],
    /// Velocity of the continuum at its place (m/s).
    pub velocity: SVector<f64, D>,
}

/// Sums them, from nothing.
pub(super) fn compare<'a, const D: usize, const S: usize, const N: usize>(
    met: impl Iterator<Item = Met<'a, D, N>>,
    slips: &mut [Slip<D, S>],
) {
    slips.fill(Slip::default());
    for met in met {
        let grain = met.grain;
        let difference = met.velocity - along_axes(&grain.velocity);
        for (cell, hat) in met.hats {
            let (slip, mass) = (&mut slips[cell], grain.mass * hat);
            if met.is_buffer {
                slip.buffer += mass;
                slip.buffer_slip += mass * difference;
                let turning = inertia(grain) * hat;
                slip.turning += turning;
                slip.spin += turning * about_axes(&grain.spin);
            } else {
                slip.inner += mass;
                slip.inner_slip += mass * difference;
            }
        }
    }
}

/// Variance in a direction of the momenta of the grains that each of so many cells is compared with, if they move independently, Σ (h m v′)²:
/// of the buffer, and of the whole overlap (N² s²). v′ is the `fluctuation` of a grain (m/s).
pub(super) fn variances<'a, const D: usize, const N: usize>(
    met: impl Iterator<Item = Met<'a, D, N>>,
    cells: usize,
    fluctuation: impl Fn(&GrainSample) -> Vector3<f64>,
) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; cells];
    for met in met {
        let apart: SVector<f64, D> = along_axes(&fluctuation(met.grain));
        let square = met.grain.mass.powi(2) * apart.norm_squared() / D as f64;
        for (cell, hat) in met.hats {
            let variance = hat * hat * square;
            sums[cell][1] += variance;
            if met.is_buffer {
                sums[cell][0] += variance;
            }
        }
    }
    sums
}

/// Granular temperature ⟨v′²⟩/3 of grains with labels, which grow from the edge on into the grains (in the unit of their ends): of the buffer, of the inner overlap, and of grains beyond it
/// up to its width (m²/s²).
pub(super) fn temperatures<'a>(
    grains: impl Iterator<Item = (&'a GrainSample, f64)>,
    [handshake, inner]: [f64; 2],
    fluctuation: impl Fn(&GrainSample) -> Vector3<f64>,
) -> [f64; 3] {
    let ends = [handshake, inner, 2.0 * inner - handshake];
    let mut sums = [[0.0; 2]; 3];
    for (grain, label) in grains {
        let Some(zone) = ends.iter().position(|end| label < *end) else {
            continue;
        };
        sums[zone][0] += grain.mass * fluctuation(grain).norm_squared() / 3.0;
        sums[zone][1] += grain.mass;
    }
    sums.map(|[energy, mass]| over(energy, mass))
}
