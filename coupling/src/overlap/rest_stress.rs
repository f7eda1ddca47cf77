//! The stress of a bed at rest, which μ(I) does not know.
//!
//! Grains that were poured or settled press sideways by K_0 < 1 of what they bear, K_0 = σ_hh/σ_zz (Jaky 1944: about 1 − sin φ).
//! A rigid-plastic continuum has no stress of its own below yield, and between walls that do not give it comes to σ_hh = σ_zz: a joint
//! that takes this for the truth pushes the grains by the difference until their friction on the floor bears it, or squeezes
//! them. So the continuum of a joint keeps K_0 as its grains had it when it was cut off, until it is sheared:
//!
//! ```text
//! σ_hh = σ_hh(μ(I)) + (K_0 − 1) σ_zz e^(−γ/γ_c)
//! ```
//! for each horizontal h, with the shear strain γ of the place since then, γ_c that which wipes the memory out, and σ_zz the
//! continuum's. Grains' stresses reach the continuum less the same term, so that both sides speak of differences from one state
//! of rest. An edge in a column that has lost its gate is another matter: what lies behind it yields at once, its stress is
//! what its motion makes it, and a memory would count that twice (σ_xx of grains over continuum 1.15 for 0.94). Under a level bed the term depends on the height alone, is a gradient of nothing along the horizontal and
//! moves nothing.

use colluvium_continuum::rheology::strain_rate_norm;
use colluvium_continuum::strain::SPACE_COMPONENTS;

/// What a continuum remembers of its grains' rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestStress {
    /// K_0; one where nothing is remembered.
    pub ratio: f64,
    /// Shear of each cell since, in components whose squares add up to γ² (`continuum::strain`): what is taken back leaves nothing.
    pub strain: Vec<[f64; SPACE_COMPONENTS]>,
    /// Strain γ_c that wipes it out; without one nothing is remembered.
    pub scale: f64,
}

impl RestStress {
    /// Of so many cells, nothing yet.
    pub fn nothing(cells: usize, scale: f64) -> Self {
        Self {
            ratio: 1.0,
            strain: vec![[0.0; SPACE_COMPONENTS]; cells],
            scale,
        }
    }

    /// Takes K_0 from sums of horizontal and vertical stresses of grains at rest.
    pub fn measure(&mut self, horizontal: f64, vertical: f64) {
        let ratio = horizontal / vertical;
        if ratio.is_finite() && ratio > 0.0 {
            self.ratio = ratio;
        }
    }

    /// What comes to a cell's horizontal stress for its vertical one (Pa, positive in tension).
    pub fn beyond(&self, cell: usize, vertical: f64) -> f64 {
        if self.scale <= 0.0 {
            return 0.0;
        }
        let strain = strain_rate_norm(self.strain[cell]);
        (self.ratio - 1.0) * vertical * (-strain / self.scale).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sheared_forgets_how_it_rested() {
        let mut rest = RestStress::nothing(2, 0.01);
        assert_eq!(rest.beyond(0, -100.0), 0.0);
        rest.measure(-60.0, -100.0);
        assert!((-100.0 + rest.beyond(0, -100.0) + 60.0).abs() < 1e-12);
        rest.strain[1] = [0.0, 0.006, 0.0, -0.008, 0.0];
        assert!((rest.beyond(1, -100.0) - 40.0 * (-1.0_f64).exp()).abs() < 1e-12);
        // Grains without weight say nothing, and no scale is no memory.
        rest.measure(0.0, 0.0);
        assert_eq!(rest.ratio, 0.6);
        rest.scale = 0.0;
        assert_eq!(rest.beyond(0, -100.0), 0.0);
    }
}
