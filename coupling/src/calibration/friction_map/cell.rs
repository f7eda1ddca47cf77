//! One campaign of a map.

use super::curve::{Curve, law_through};
use super::{MapError, WithError};
use serde::{Deserialize, Serialize};

/// One campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapCell {
    /// β: size of the contact patch over the reduced radius.
    pub beta: f64,
    /// μ_R: rolling friction.
    pub mu_r: f64,
    /// |τ|/p.
    pub curve: Curve,
    /// |τ|/σ_zz, where a law fits it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve_zz: Option<Curve>,
    /// Angle of repose (degrees).
    pub repose: WithError,
    /// φ of the flows.
    pub solid_fraction: WithError,
    /// Inertial numbers that were measured.
    pub valid_i: [f64; 2],
}

impl MapCell {
    /// Whether its numbers can be, and a law goes through its curve.
    pub(super) fn check(&self, inertial_numbers: [f64; 3]) -> Result<(), MapError> {
        let check = |key, value: f64, ok: bool, allowed| {
            if ok && value.is_finite() {
                Ok(())
            } else {
                Err(MapError::BadCell {
                    beta: self.beta,
                    mu_r: self.mu_r,
                    key,
                    value,
                    allowed,
                })
            }
        };
        check("beta", self.beta, self.beta > 0.0, "positive")?;
        check("mu_r", self.mu_r, self.mu_r > 0.0, "positive")?;
        let law = law_through(inertial_numbers, self.curve.friction).is_some();
        let allowed = "three values that rise ever more slowly, as a law of mu(I) does";
        check("friction", self.curve.friction[1], law, allowed)?;
        let variances = (0..3).map(|k| self.curve.covariance[k][k]);
        for variance in variances.chain([self.repose.error, self.solid_fraction.error]) {
            check("error", variance, variance >= 0.0, "at least 0")?;
        }
        let angle = self.repose.value;
        check("repose", angle, angle > 0.0 && angle < 90.0, "(0, 90)")?;
        let phi = self.solid_fraction.value;
        check("solid_fraction", phi, phi > 0.0 && phi < 1.0, "(0, 1)")?;
        let [low, high] = self.valid_i;
        let rises = low >= 0.0 && low < high;
        check("valid_i", low, rises, "[low, high] that rise")
    }
}
