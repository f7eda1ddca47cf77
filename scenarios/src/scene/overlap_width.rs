//! How wide an overlap is: as a whole by `overlap.width`, or part by part.

use super::SceneError;
use super::world::Place;

/// Buffer and inner overlap, in diameters, where nothing is given.
const DEFAULT: f64 = 3.0;
/// Least width of an overlap that is given as a whole, in diameters: its halves hold a grain each.
const LEAST: f64 = 2.0;

/// What a scene says of the width of its overlap.
#[derive(Clone, Copy, Debug)]
pub(super) struct OverlapWidth {
    /// All of it (m).
    pub width: Option<f64>,
    /// Inner overlap, buffer and shell in diameters.
    pub parts: [Option<f64>; 3],
}

impl OverlapWidth {
    /// Inner overlap, buffer and shell (m) as far as they are given, for grains of this mean diameter (m).
    pub fn parts(&self, diameter: f64) -> [Option<f64>; 3] {
        match self.width {
            Some(width) => [2.0, 2.0, 3.0].map(|part| Some(width / part)),
            None => self.parts.map(|part| part.map(|n| n * diameter)),
        }
    }

    /// Inner overlap and buffer together (m), given or computed.
    pub fn whole(&self, diameter: f64) -> f64 {
        let [inner, buffer, _] = self.parts(diameter);
        [inner, buffer]
            .map(|part| part.unwrap_or(DEFAULT * diameter))
            .iter()
            .sum()
    }

    /// Refuses a width beside its parts, one with less than two grains in it, and one for which there is no room (m).
    pub fn check(&self, diameter: f64, room: f64, origin: &str) -> Result<(), SceneError> {
        let Some(width) = self.width else {
            return Ok(());
        };
        let at = Place {
            origin,
            section: "overlap",
        };
        let names = ["inner_diameters", "buffer_diameters", "shell_diameters"];
        if let Some((name, _)) = names.iter().zip(self.parts).find(|(_, p)| p.is_some()) {
            let range = format!("left out where overlap.{name} is given: that is a part of it");
            return Err(at.refuse("width", width, range));
        }
        let least = LEAST * diameter;
        if width < least || width >= room {
            let range = if room > least && room.is_finite() {
                format!(
                    "[{least:.4}, {room:.4}) m: from two mean diameters up to what leaves room for continuum and grains beside it"
                )
            } else {
                format!(
                    "at least two mean diameters, {least:.4} m, where there is room for that much"
                )
            };
            return Err(at.refuse("width", width, range));
        }
        Ok(())
    }
}
