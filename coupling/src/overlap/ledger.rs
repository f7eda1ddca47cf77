//! Mass and momentum across the overlap, closed to round-off, and energy by where it goes.
//!
//! Both sides hold their matter in full between a and b, so each side has an account of its own:
//!
//! ```text
//! grains:     Δ(Σ m v) = weight + what walls gave + traction + relaxation
//! continuum:  Δ(ρ A h Σ u) = weight + stress at its ends − relaxation + following
//! ```
//! Relaxation is the same number with opposite signs. Traction is what the continuum's own stress on the edge
//! does to the grains; the grains' stress at a and m is what they do to the continuum.

use serde::Serialize;

/// Accounts since the start (SI).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Ledger {
    /// Mass of grains and of the continuum beyond the edge at the start (kg).
    pub mass_before: f64,
    /// Momentum of the grains along the flow and outwards at the start, with what walls had taken (N s).
    pub grains_before: [f64; 2],
    /// Impulse of the weight of the grains along the flow and outwards.
    pub weight: [f64; 2],
    /// Impulse of the continuum's shear stress on the grains, along the flow.
    pub shear: f64,
    /// Impulse of its pressure, outwards.
    pub pressure: f64,
    /// Impulse of the impedance on the grains, outwards.
    pub impedance: f64,
    /// Impulse of relaxation on the grains, along the flow; the continuum takes the opposite.
    pub relaxation: f64,
    /// Moment of the relaxation of spins about n × t (N m s).
    pub spin: f64,
    /// Momentum of the whole continuum, copy included, along the flow at the start.
    pub continuum_before: f64,
    /// Impulse of its weight.
    pub continuum_weight: f64,
    /// Impulse of the stress at a, along the flow.
    pub inner_stress: f64,
    /// Impulse of the stress at the far end.
    pub far_stress: f64,
    /// Impulse by which the copy was made to follow the grains.
    pub following: f64,
    /// Momentum outwards that the continuum's normal motion has taken from the impedance.
    pub riding: f64,
}

impl Ledger {
    /// Number of entries.
    pub const NUMBERS: usize = 16;

    /// All entries.
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        let l = self;
        [
            l.mass_before,
            l.grains_before[0],
            l.grains_before[1],
            l.weight[0],
            l.weight[1],
            l.shear,
            l.pressure,
            l.impedance,
            l.relaxation,
            l.spin,
            l.continuum_before,
            l.continuum_weight,
            l.inner_stress,
            l.far_stress,
            l.following,
            l.riding,
        ]
    }

    /// From such numbers.
    pub fn from_numbers(n: &[f64]) -> Result<Self, String> {
        let &[
            mass_before,
            g0,
            g1,
            w0,
            w1,
            shear,
            pressure,
            impedance,
            relaxation,
            spin,
            continuum_before,
            continuum_weight,
            inner_stress,
            far_stress,
            following,
            riding,
        ] = n
        else {
            return Err(format!(
                "{} numbers of a ledger instead of {}",
                n.len(),
                Self::NUMBERS
            ));
        };
        Ok(Self {
            mass_before,
            grains_before: [g0, g1],
            weight: [w0, w1],
            shear,
            pressure,
            impedance,
            relaxation,
            spin,
            continuum_before,
            continuum_weight,
            inner_stress,
            far_stress,
            following,
            riding,
        })
    }

    /// How far the grains' momentum is from what the account says, along the flow and outwards, relative to the
    /// largest entry.
    pub fn grains_error(&self, now: [f64; 2]) -> f64 {
        let given = [self.shear + self.relaxation, self.pressure + self.impedance];
        let entries = [
            [self.shear, self.relaxation],
            [self.pressure, self.impedance],
        ];
        let mut worst = 0.0_f64;
        let mut scale = 0.0_f64;
        for axis in 0..2 {
            let expected = self.grains_before[axis] + self.weight[axis] + given[axis];
            worst = worst.max((now[axis] - expected).abs());
            for entry in [now[axis], self.grains_before[axis], self.weight[axis]] {
                scale = scale.max(entry.abs());
            }
            scale = entries[axis].iter().fold(scale, |s, e| s.max(e.abs()));
        }
        if scale > 0.0 { worst / scale } else { 0.0 }
    }

    /// The same of the continuum's momentum along the flow.
    pub fn continuum_error(&self, now: f64) -> f64 {
        let entries = [
            self.continuum_before,
            self.continuum_weight,
            self.inner_stress,
            self.far_stress,
            self.following,
            -self.relaxation,
        ];
        let expected: f64 = entries.iter().sum();
        let scale = entries.iter().fold(now.abs(), |s, e| s.max(e.abs()));
        if scale > 0.0 {
            (now - expected).abs() / scale
        } else {
            0.0
        }
    }
}
