//! What no dense continuum beside an edge can be: for that the edge makes room for grains.
//!
//! Of the grains of the inner overlap, in cells beneath the surface,
//!
//! ```text
//! φ/φ_full = Σ m / (n m_full)                p_k/p = (Σ m |v − ū(x)|²/3 / n V) / max(p̄, ρ g h/2)
//! ```
//! m mass of grains (kg), n cells of volume V (m³), m_full the mass that one of them holds as the material lay, ū mean velocity
//! of the grains about a place (m/s), p̄ mean pressure of the continuum's copy (Pa), h height of a cell (m). A continuum of one
//! solid fraction knows no looser state, and none carries the share of pressure that fluctuations make (kinetic pressure ρ T;
//! Jenkins & Savage, *J. Fluid Mech.* 130 (1983) 187). Of the continuum beyond it, a strip wide,
//!
//! ```text
//! I = γ̇ d √(ρ_s/max(p, ρ g h/2))             exceeded in a tenth of the cells beneath the surface
//! ```

/// Part of the cells that may exceed the I that a strip is judged by.
const EXCEEDED: f64 = 0.1;
/// Pressure below which shares and I are taken at it, in weights of a layer of cells.
pub(super) const LEAST_PRESSURE: f64 = 0.5;

/// Limits beyond which grains are needed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenseLimits {
    /// I of the continuum beside an edge; infinite: none is too large.
    pub fastest: f64,
    /// Solid fraction of the grains of its inner overlap over that of the material as it lay; 0: none is too small.
    pub loosest: f64,
    /// Part of the pressure there that fluctuations of velocity make; infinite: none is too large.
    pub warmest: f64,
}

impl DenseLimits {
    /// Nothing is of concern.
    pub const NONE: DenseLimits = DenseLimits {
        fastest: f64::INFINITY,
        loosest: 0.0,
        warmest: f64::INFINITY,
    };

    /// What of these grains is, with its measure.
    pub(super) fn of_grains(
        &self,
        found: impl FnOnce() -> Option<Dilution>,
    ) -> Option<(Reason, f64)> {
        if self.loosest <= 0.0 && self.warmest.is_infinite() {
            return None;
        }
        let Dilution { packing, kinetic } = found()?;
        let loose = (packing < self.loosest).then_some((Reason::Loose, packing));
        loose.or_else(|| (kinetic > self.warmest).then_some((Reason::Warm, kinetic)))
    }

    /// Whether the inertial numbers of these cells of continuum are.
    pub(super) fn of_continuum(&self, rows: impl FnOnce() -> Vec<f64>) -> Option<(Reason, f64)> {
        if self.fastest.is_infinite() {
            return None;
        }
        let mut rows = rows();
        rows.sort_unstable_by(f64::total_cmp);
        let place = ((1.0 - EXCEEDED) * rows.len() as f64).ceil() as usize;
        let inertial = rows.get(place.saturating_sub(1)).copied()?;
        (inertial > self.fastest).then_some((Reason::Inertial, inertial))
    }
}

/// What the grains beside an edge are like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dilution {
    /// Solid fraction over that of the material as it lay.
    pub packing: f64,
    /// Part of the pressure that fluctuations of velocity make.
    pub kinetic: f64,
}

/// Why an edge, or a side of a box, moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The ball has come near: with its distance from the overlap (m).
    Ball,
    /// Grains beside the overlap are fast: with their rms speed (m/s).
    Speed,
    /// Nothing moves: with the rms speed (m/s).
    Rest,
    /// The caller wants it.
    Asked,
    /// The continuum beside it is sheared faster than its law was calibrated for: with its inertial number.
    Inertial,
    /// What is stored beside it has been sheared since: with its shear.
    Misplaced,
    /// The grains of its inner overlap are packed loosely: with their solid fraction over the bed's.
    Loose,
    /// Fluctuations make much of the pressure there: with their share.
    Warm,
}

impl Reason {
    /// All of them, by their numbers.
    pub const ALL: [Reason; 8] = [
        Reason::Ball,
        Reason::Speed,
        Reason::Rest,
        Reason::Asked,
        Reason::Inertial,
        Reason::Misplaced,
        Reason::Loose,
        Reason::Warm,
    ];

    /// Its number in tables.
    pub fn number(self) -> usize {
        self as usize
    }

    /// Its name.
    pub fn word(self) -> &'static str {
        let words = [
            "ball",
            "speed",
            "rest",
            "asked",
            "inertial",
            "misplaced",
            "loose",
            "warm",
        ];
        words[self as usize]
    }
}
