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
//! of rest. Under a level bed the term depends on the height alone, is a gradient of nothing along the horizontal and
//! moves nothing.
//!
//! Behind the edge of a column that has lost its gate the continuum comes close to yield, where its own stress has unloaded already.
//! What it remembers must not count that twice: no material without cohesion bears less sideways than when it yields actively
//! (Rankine), so the memory takes no stress below
//!
//! ```text
//! σ_hh = K_a σ_zz,      K_a = (1 − μ_s)/(1 + μ_s)
//! ```
//! which is that of the coaxial law in the plane, whose sin φ is μ_s.

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
    /// K_a, below which the memory takes no stress; 0 where it may take any.
    pub active: f64,
}

impl RestStress {
    /// Of so many cells, nothing yet.
    pub fn nothing(cells: usize, scale: f64) -> Self {
        Self {
            ratio: 1.0,
            strain: vec![[0.0; SPACE_COMPONENTS]; cells],
            scale,
            active: 0.0,
        }
    }

    /// Takes K_0 from sums of horizontal and vertical stresses of grains at rest.
    pub fn measure(&mut self, horizontal: f64, vertical: f64) {
        let ratio = horizontal / vertical;
        if ratio.is_finite() && ratio > 0.0 {
            self.ratio = ratio;
        }
    }

    /// Horizontal stress of a cell's grains for that of its continuum and the vertical one (Pa, positive in tension).
    pub fn of_grains(&self, cell: usize, horizontal: f64, vertical: f64) -> f64 {
        let remembered = horizontal + self.beyond(cell, vertical);
        // Both are negative in compression.
        remembered.min(horizontal.max(self.active * vertical))
    }

    /// Horizontal stress of a cell's continuum for that of its grains and the vertical one (Pa, positive in tension).
    pub fn of_continuum(&self, cell: usize, horizontal: f64, vertical: f64) -> f64 {
        horizontal - self.beyond(cell, vertical)
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

    #[test]
    fn no_memory_takes_stress_below_that_of_yield() {
        let mut rest = RestStress::nothing(1, 0.01);
        rest.active = 0.3;
        let horizontals = [-100.0, -60.0, -20.0];
        let same = horizontals.map(|xx| rest.of_grains(0, xx, -100.0));
        assert_eq!(same, horizontals);
        rest.measure(-60.0, -100.0);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        // Level bed; near yield; the continuum itself beyond it.
        for (xx, expected) in [
            (-100.0, -60.0),
            (-90.0, -50.0),
            (-60.0, -30.0),
            (-20.0, -20.0),
        ] {
            close(rest.of_grains(0, xx, -100.0), expected);
        }
        // Both ways, while nothing yields.
        close(rest.of_continuum(0, -50.0, -100.0), -90.0);
        // With no bound it would count the unloading twice.
        rest.active = 0.0;
        close(rest.of_grains(0, -45.0, -100.0), -5.0);
    }
}
