//! Where grains are needed: how wrong a μ(I) continuum would be about its material, and where that material was
//! at the start.
//!
//! Every concern is an error of the friction coefficient, δμ/μ, so that they can be compared and summed:
//!
//! | concern | δμ/μ | source |
//! |---|---|---|
//! | [`Concern::Law`] | standard error of the fitted μ(I) at this I, √(∇μᵀ C ∇μ)/μ | covariance C of the calibration |
//! | [`Concern::Window`] | what μ(I) has changed by since the end of the calibrated window | the law itself |
//! | [`Concern::Thickness`] | (A d/L)², L the thickness of what flows here, A = 0.48 | non-local fluidity: Henann & Kamrin, *PNAS* 110 (2013) 6730 |
//! | [`Concern::Wall`] | 0.16 (1 − z/10 d) I μ'/μ: the velocity over a rough floor is wrong by 12–20 % up to 10 d above it | joined and full inclines of this toolkit |
//!
//! What counts for a piece of material is the shear strain that it makes under a wrong friction,
//!
//! ```text
//! ε = ∫ max(δμ/μ) γ̇ dt,
//! ```
//!
//! the *misplaced strain*: nothing where material rests however badly its law is known, and little where
//! it is in doubt for a moment. It is summed on [`Markers`] that move with the continuum, so that it belongs to
//! material: an edge between grains and continuum that moves with the material is chosen where the material lay
//! at the start ([`Survey::edge`]).

mod markers;
mod survey;

pub use markers::{Marker, Markers};
pub use survey::Survey;

use colluvium_continuum::rheology::MuI;

/// Non-local amplitude A of glass spheres.
const NON_LOCAL: f64 = 0.48;
/// Error of the velocity over a rough floor, at it, and how far up it is felt over d.
const WALL_ERROR: f64 = 0.16;
const WALL_REACH: f64 = 10.0;
/// Friction is never more wrong than this: nothing is known then.
const UNKNOWN: f64 = 1.0;

/// Why a continuum may be wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Concern {
    /// The fit's own errors.
    Law,
    /// The inertial number lies outside the calibrated window.
    Window,
    /// The flowing layer is only some grains thick.
    Thickness,
    /// A rough floor is near.
    Wall,
}

impl Concern {
    /// All of them, in the order of [`Concern::index`].
    pub const ALL: [Concern; 4] = [
        Concern::Law,
        Concern::Window,
        Concern::Thickness,
        Concern::Wall,
    ];

    /// Its place in [`Concern::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// Its name in tables.
    pub fn word(self) -> &'static str {
        match self {
            Concern::Law => "law",
            Concern::Window => "window",
            Concern::Thickness => "thickness",
            Concern::Wall => "wall",
        }
    }
}

/// What is known of flowing material at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Inertial number I.
    pub inertial_number: f64,
    /// Thickness of what flows above and below this place (m).
    pub thickness: f64,
    /// Height above a rough floor (m), if there is one.
    pub above_floor: Option<f64>,
}

/// Judges a μ(I) continuum.
#[derive(Clone, Debug, PartialEq)]
pub struct Oracle {
    /// The law.
    pub law: MuI,
    /// Inertial numbers at which it was measured.
    pub window: Option<[f64; 2]>,
    /// Covariance of (μ_s, μ_2, I_0).
    pub covariance: Option<[[f64; 3]; 3]>,
}

impl Oracle {
    /// δμ/μ by concern.
    pub fn errors(&self, look: &Look) -> [f64; 4] {
        let law = &self.law;
        let i = look.inertial_number;
        let mu = law.mu(i);
        let part = law.i_0 / (law.i_0 + i);
        // ∂μ/∂(μ_s, μ_2, I_0) and I dμ/dI of μ_2 − (μ_2 − μ_s) I_0/(I_0 + I).
        let span = law.mu_2 - law.mu_s;
        let gradient = [part, 1.0 - part, -span * part * (1.0 - part) / law.i_0];
        let by_log_i = span * part * (1.0 - part);
        let variance = self.covariance.map_or(0.0, |c| {
            let row = |k: usize| (0..3).map(|l| c[k][l] * gradient[l]).sum::<f64>();
            (0..3).map(|k| gradient[k] * row(k)).sum::<f64>()
        });
        let outside = self
            .window
            .map_or(0.0, |[low, high]| (mu - law.mu(i.clamp(low, high))).abs());
        let layer = NON_LOCAL * law.diameter / look.thickness;
        let wall = look.above_floor.map_or(0.0, |z| {
            let near = 1.0 - z.max(0.0) / (WALL_REACH * law.diameter);
            WALL_ERROR * near.max(0.0) * by_log_i / mu
        });
        [
            variance.max(0.0).sqrt() / mu,
            outside / mu,
            layer * layer,
            wall,
        ]
        .map(|e| {
            if e.is_finite() {
                e.min(UNKNOWN)
            } else {
                UNKNOWN
            }
        })
    }

    /// The largest δμ/μ and its concern.
    pub fn worst(&self, look: &Look) -> (f64, Concern) {
        let errors = self.errors(look);
        let worse = |a: Concern, b: Concern| match errors[b.index()] > errors[a.index()] {
            true => b,
            false => a,
        };
        let concern = Concern::ALL.into_iter().fold(Concern::Law, worse);
        (errors[concern.index()], concern)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn oracle() -> Oracle {
        Oracle {
            law: MuI {
                mu_s: 0.55,
                mu_2: 0.91,
                i_0: 0.63,
                diameter: 0.01,
                solid_fraction: 0.5,
                grain_density: 2500.0,
                cohesion: 0.0,
            },
            window: Some([0.2, 0.85]),
            covariance: Some([[4e-4, 0.0, 0.0], [0.0, 1.6e-3, 0.0], [0.0, 0.0, 0.04]]),
        }
    }

    fn deep(inertial_number: f64) -> Look {
        Look {
            inertial_number,
            thickness: 1e3,
            above_floor: None,
        }
    }

    #[test]
    fn the_law_s_error_is_that_of_its_parameters() {
        // By differences of the law in each parameter instead of its gradient.
        let oracle = oracle();
        let i = 0.4;
        let by = |change: &dyn Fn(&mut MuI, f64), sd: f64| {
            let moved = |sign: f64| {
                let mut law = oracle.law;
                change(&mut law, sign * 1e-4 * sd);
                law.mu(i)
            };
            (moved(1.0) - moved(-1.0)) / 2e-4
        };
        let parts = [
            by(&|law, s| law.mu_s += s, 0.02),
            by(&|law, s| law.mu_2 += s, 0.04),
            by(&|law, s| law.i_0 += s, 0.2),
        ];
        let expected = parts.iter().map(|p| p * p).sum::<f64>().sqrt() / oracle.law.mu(i);
        let found = oracle.errors(&deep(i))[Concern::Law.index()];
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
    }

    #[test]
    fn each_concern_names_itself() {
        let mut oracle = oracle();
        let inside = deep(0.5);
        let [_, window, thickness, wall] = oracle.errors(&inside);
        assert_eq!((window, wall), (0.0, 0.0));
        assert!(thickness < 1e-10);
        assert_eq!(oracle.worst(&inside).1, Concern::Law);
        oracle.covariance = None;
        for i in [0.0, 0.01, 3.0] {
            assert_eq!(oracle.worst(&deep(i)).1, Concern::Window, "I = {i}");
        }
        let thin = Look {
            thickness: 0.02,
            ..inside
        };
        let (error, concern) = oracle.worst(&thin);
        assert_eq!(concern, Concern::Thickness);
        assert!((error - 0.24 * 0.24).abs() < 1e-12);
        let low = |z| Look {
            above_floor: Some(z),
            ..inside
        };
        assert_eq!(oracle.worst(&low(0.03)).1, Concern::Wall);
        assert!(oracle.worst(&low(0.11)).0 < 1e-10);
        let nothing_flows = Look {
            thickness: 0.0,
            ..inside
        };
        assert_eq!(oracle.worst(&nothing_flows), (UNKNOWN, Concern::Thickness));
    }
}
