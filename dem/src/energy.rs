//! Energy of the grains, by kind.

use serde::{Deserialize, Serialize};

/// Energy at one instant (J); fixed grains do not count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Σ m v²/2.
    pub translation: f64,
    /// Σ I ω²/2.
    pub rotation: f64,
    /// Normal parts of contacts, with the energy of adhesive ones.
    pub normal: f64,
    /// Attraction of cohesive contacts, -Σ F_c x.
    #[serde(default)]
    pub cohesion: f64,
    /// Tangential springs, Σ k_t S²/2.
    pub tangential: f64,
    /// Rolling springs, Σ k_R δ_R²/2.
    pub rolling: f64,
    /// Twisting springs, Σ k_T δ_T²/2.
    pub twisting: f64,
    /// Bonds.
    #[serde(default)]
    pub bonds: f64,
    /// Potential energy in fields that differ from place to place; uniform gravity has none here.
    #[serde(default)]
    pub potential: f64,
}

impl Energy {
    /// Kinetic energy (J).
    pub fn kinetic(&self) -> f64 {
        self.translation + self.rotation
    }

    /// Energy of all contacts and bonds (J).
    pub fn elastic(&self) -> f64 {
        self.normal + self.cohesion + self.tangential + self.rolling + self.twisting + self.bonds
    }

    /// Kinetic, elastic and potential energy (J).
    pub fn total(&self) -> f64 {
        self.kinetic() + self.elastic() + self.potential
    }
}
