//! A limit of the step, the choice among several, and what to say when a step was too long.

use std::fmt;

/// Two surfaces that a limit is for; a wall's radius is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Numbers of the materials.
    pub materials: [u16; 2],
    /// Radii (m).
    pub radii: [f64; 2],
}

impl fmt::Display for Pair {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [a, b] = self.materials;
        if a != b {
            write!(f, "materials {a} and {b}, ")?;
        }
        match self.radii {
            [r, wall] | [wall, r] if wall.is_infinite() => write!(f, "radius {r:.4e} m on a wall"),
            [r, s] if r == s => write!(f, "radii {r:.4e} m"),
            [r, s] => write!(f, "radii {r:.4e} m and {s:.4e} m"),
        }
    }
}

/// What a limit guards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guards {
    /// Accuracy: the step must resolve this time.
    Accuracy,
    /// Stability: beyond this time itself the energy of one contact grows without end.
    Stability,
}

/// A time that the step must stay below.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// In a word or two.
    pub name: &'static str,
    /// The time itself (s).
    pub seconds: f64,
    /// Share of it that a step may take.
    pub share: f64,
    /// What it guards.
    pub guards: Guards,
    /// What it is.
    pub why: &'static str,
    /// For whom it is shortest.
    pub pair: Pair,
}

impl Limit {
    /// A time that the step must resolve.
    pub(super) fn accuracy(
        pair: Pair,
        name: &'static str,
        seconds: f64,
        share: f64,
        why: &'static str,
    ) -> Limit {
        Limit {
            name,
            seconds,
            share,
            guards: Guards::Accuracy,
            why,
            pair,
        }
    }

    /// The step it allows (s).
    pub fn step(&self) -> f64 {
        self.share * self.seconds
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Limit {
            name, seconds, why, ..
        } = self;
        write!(f, "{name}: ")?;
        if self.share < 1.0 && (1.0 / self.share).fract() == 0.0 && self.share < 0.1 {
            write!(f, "1/{:.0}", 1.0 / self.share)?;
        } else {
            write!(f, "{:.3}", self.share)?;
        }
        write!(f, " of {seconds:.4e} s, {why} ({})", self.pair)
    }
}

/// A step and its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The step (s); infinite if nothing limits it.
    pub seconds: f64,
    /// What it is of the step that the limits allow: a scene's own safety factor.
    pub safety: f64,
    /// Name of the limit that binds.
    pub binding: &'static str,
    /// All limits, the binding one first.
    pub all: Vec<Limit>,
}

impl Choice {
    /// The limit that binds.
    pub fn limit(&self) -> Option<&Limit> {
        self.all.first()
    }

    /// The longest step within its share of every limit (s), whatever the safety factor.
    pub fn allowed(&self) -> f64 {
        self.limit().map_or(f64::INFINITY, Limit::step)
    }

    /// The shortest time at which a contact blows up, and its name.
    pub fn hard(&self) -> Option<&Limit> {
        hard(&self.all)
    }

    /// The limit at or beyond which `timestep` (s) lies, so that one contact blows up.
    pub fn broken_by(&self, timestep: f64) -> Option<&Limit> {
        self.hard().filter(|limit| timestep >= limit.seconds)
    }
}

/// The shortest of the limits that guard stability.
pub fn hard(limits: &[Limit]) -> Option<&Limit> {
    limits
        .iter()
        .filter(|l| l.guards == Guards::Stability)
        .min_by(|a, b| a.seconds.total_cmp(&b.seconds))
}

/// A step that would do where one has failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remedy {
    /// The step (s).
    pub seconds: f64,
    /// The limit that it comes from.
    pub limit: &'static str,
    /// Whether the failing step was longer.
    pub exceeded: bool,
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Remedy { seconds, limit, .. } = self;
        if !seconds.is_finite() {
            write!(f, "nothing in the contact laws limits it")
        } else if self.exceeded {
            write!(f, "{seconds:.3e} s would do (limit: {limit})")
        } else {
            write!(
                f,
                "though it is within its limits (the nearest is {limit}, {seconds:.3e} s): the grains \
                 are too soft for their speeds, or started inside each other"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_and_walls_are_named() {
        let pair = |materials, radii| Pair { materials, radii }.to_string();
        assert_eq!(pair([0, 0], [1e-3, 1e-3]), "radii 1.0000e-3 m");
        assert_eq!(
            pair([0, 1], [1e-3, f64::INFINITY]),
            "materials 0 and 1, radius 1.0000e-3 m on a wall"
        );
    }
}
