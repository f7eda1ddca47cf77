//! Contact laws that codes are asked for, in physical terms.

use super::case::Case;
use serde::Serialize;

/// The contact law every code is asked for, in physical terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Law {
    /// Linear springs; normal dashpot of `damping` × reduced mass, no tangential one.
    Hooke {
        /// k_n (N/m).
        stiffness: f64,
        /// k_t (N/m).
        tangential: f64,
        /// γ_n (1/s).
        damping: f64,
        /// Coulomb coefficient.
        friction: f64,
    },
    /// Hertz and Mindlin with history, dashpots from the restitution.
    HertzMindlin {
        /// Young's modulus (Pa).
        young: f64,
        /// Poisson's ratio.
        poisson: f64,
        /// Normal restitution.
        restitution: f64,
        /// Coulomb coefficient.
        friction: f64,
    },
    /// Hertz with a dashpot of viscous material; Mindlin with history.
    Viscoelastic {
        /// Young's modulus (Pa).
        young: f64,
        /// Poisson's ratio.
        poisson: f64,
        /// A (s) of the dashpot 4/3 A E* a.
        dissipation: f64,
        /// Coulomb coefficient.
        friction: f64,
    },
    /// Johnson, Kendall and Roberts, with its own sliding, rolling and twisting.
    Jkr {
        /// Young's modulus (Pa).
        young: f64,
        /// Poisson's ratio.
        poisson: f64,
        /// γ (J/m²); the work of adhesion is 2γ.
        surface_energy: f64,
        /// Damping over the reduced mass (1/s).
        damping_rate: f64,
        /// ξ_crit (m).
        critical_rolling: f64,
    },
}

/// Resistance to rolling and twisting, in physical terms; that of [`Law::Jkr`] is its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Rolling {
    /// None.
    Free,
    /// Elastic–plastic spring and dashpot.
    Epsd {
        /// μ_r.
        friction: f64,
        /// η_r.
        damping_ratio: f64,
    },
    /// Rolling and twisting springs of angular grains.
    Shape {
        /// β.
        beta: f64,
        /// μ_R.
        rolling_friction: f64,
        /// μ_T.
        twisting_friction: f64,
    },
}

/// Attraction of touching grains, in physical terms; that of [`Law::Jkr`] is its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Cohesion {
    /// None.
    None,
    /// Strength times contact area.
    ContactArea {
        /// J/m³.
        density: f64,
    },
    /// Derjaguin, Muller and Toporov.
    Dmt {
        /// w (J/m²).
        work_of_adhesion: f64,
    },
}

/// Whether a case has springs or Hertz–Mindlin contacts alone.
pub fn plain(case: &Case) -> bool {
    matches!(case.law, Law::Hooke { .. } | Law::HertzMindlin { .. })
        && case.rolling == Rolling::Free
        && case.cohesion == Cohesion::None
}

/// E*, G* (Pa) of two equal materials.
pub fn moduli(young: f64, poisson: f64) -> [f64; 2] {
    [
        young / (2.0 * (1.0 - poisson * poisson)),
        young / (4.0 * (2.0 - poisson) * (1.0 + poisson)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moduli_are_those_of_two_equal_bodies() {
        let [e, g] = moduli(1e7, 0.3);
        assert!((e - 1e7 / 1.82).abs() < 1e-6 && (g - 1e7 / 8.84).abs() < 1e-6);
    }
}
