//! Friction on walls: where material slides along a base, and where it rubs along side walls.
//!
//! A wall bears at most |τ| = c + μ p and moves against it beyond that, which is the law of a rigid
//! plastic material with one direction of motion. Both kinds of wall are therefore quadrature points like
//! those of the material, with a threshold of their own:
//!
//! - At a *base* the material next to the wall and the contact bear the same stress, so the smaller of
//!   their thresholds counts. What the threshold of the wall leaves over of the motion is slip.
//! - *Side walls* at a distance W along y, which a plane grid does not resolve, act on the thickness as
//!   a whole: with 2 c/W + (2 μ/W) p against the velocity in the plane, per volume (Jop, Forterre &
//!   Pouliquen, *J. Fluid Mech.* 541 (2005) 167).

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::rheology::{Rheology, Threshold};
use crate::units::Units;

/// Coulomb friction between the material and a wall.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WallFriction {
    /// Friction coefficient μ_b.
    pub friction: f64,
    /// Adhesion c_b (Pa): the shear stress borne at zero pressure.
    #[serde(default)]
    pub cohesion: f64,
}

impl WallFriction {
    /// Refuses what cannot bear a stress.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        for (key, value) in [
            ("wall.friction", self.friction),
            ("wall.cohesion", self.cohesion),
        ] {
            require(value >= 0.0, key, value, "at least 0 and finite")?;
        }
        Ok(())
    }

    /// The largest shear stress at a pressure: c + μ p.
    fn threshold(&self, pressure: f64) -> Threshold {
        let by_pressure = if pressure > 0.0 { self.friction } else { 0.0 };
        Threshold {
            stress: self.cohesion + by_pressure * pressure,
            by_rate: 0.0,
            by_pressure,
        }
    }

    /// The same friction with stresses divided by the given unit.
    pub fn in_units(&self, units: &Units) -> Self {
        Self {
            friction: self.friction,
            cohesion: self.cohesion / units.stress(),
        }
    }
}

/// Two parallel side walls.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SideWalls {
    /// Distance W between them (m).
    pub width: f64,
    /// Friction on each.
    pub friction: WallFriction,
}

impl SideWalls {
    /// Refuses walls without distance.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        require(
            self.width > 0.0,
            "walls.width",
            self.width,
            "greater than 0 m and finite",
        )?;
        self.friction.validate()
    }

    /// Force of both walls per volume, as a threshold.
    fn threshold(&self, pressure: f64) -> Threshold {
        let one = self.friction.threshold(pressure);
        Threshold {
            stress: 2.0 * one.stress / self.width,
            by_rate: 0.0,
            by_pressure: 2.0 * one.by_pressure / self.width,
        }
    }

    /// The same walls with lengths and stresses divided by the given units.
    pub fn in_units(&self, units: &Units) -> Self {
        Self {
            width: self.width / units.length,
            friction: self.friction.in_units(units),
        }
    }
}

/// Whose threshold holds at a quadrature point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum PointLaw {
    /// The material's.
    #[default]
    Material,
    /// The smaller one of the material's and a wall's.
    OnWall(WallFriction),
    /// That of side walls; the rate is the velocity.
    SideWalls(SideWalls),
    /// That of ground along which the material slides; the rate is the velocity, the weight an area.
    Sliding(WallFriction),
}

/// Halvings in the search for the rate at which the material bears what the wall does.
const HALVINGS: usize = 60;

impl PointLaw {
    #[inline]
    pub(crate) fn threshold<R: Rheology>(
        &self,
        material: &R,
        rate: f64,
        pressure: f64,
    ) -> Threshold {
        match self {
            PointLaw::Material => material.threshold(rate, pressure),
            PointLaw::OnWall(wall) => {
                let (inside, contact) =
                    (material.threshold(rate, pressure), wall.threshold(pressure));
                if contact.stress < inside.stress {
                    contact
                } else {
                    inside
                }
            }
            PointLaw::SideWalls(walls) => walls.threshold(pressure),
            PointLaw::Sliding(ground) => ground.threshold(pressure),
        }
    }

    /// ∫₀^rate of the threshold.
    pub(crate) fn potential<R: Rheology>(&self, material: &R, rate: f64, pressure: f64) -> f64 {
        match self {
            PointLaw::Material => material.potential(rate, pressure),
            PointLaw::OnWall(wall) => {
                let contact = wall.threshold(pressure).stress;
                let slips = |rate: f64| material.threshold(rate, pressure).stress > contact;
                if !slips(rate) {
                    return material.potential(rate, pressure);
                }
                let mut ends = [0.0, rate];
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (ends[0] + ends[1]);
                    ends[usize::from(slips(middle))] = middle;
                }
                material.potential(ends[0], pressure) + contact * (rate - ends[0])
            }
            PointLaw::SideWalls(walls) => walls.threshold(pressure).stress * rate,
            PointLaw::Sliding(ground) => ground.threshold(pressure).stress * rate,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rheology::MuI;

    const WALL: WallFriction = WallFriction {
        friction: 0.4,
        cohesion: 0.01,
    };

    fn material() -> MuI {
        MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0)
    }

    #[test]
    fn smaller_threshold_counts() {
        let law = PointLaw::OnWall(WALL);
        let slow = law.threshold(&material(), 0.5, 1.0);
        assert_eq!(slow, material().threshold(0.5, 1.0));
        let fast = law.threshold(&material(), 50.0, 1.0);
        assert!((fast.stress - 0.41).abs() < 1e-15);
        assert_eq!((fast.by_rate, fast.by_pressure), (0.0, 0.4));
        assert_eq!(law.threshold(&material(), 50.0, 0.0).stress, 0.0);
    }

    #[test]
    fn potential_is_the_integral_of_the_threshold() {
        let side = SideWalls {
            width: 0.5,
            friction: WALL,
        };
        for law in [
            PointLaw::Material,
            PointLaw::OnWall(WALL),
            PointLaw::SideWalls(side),
            PointLaw::Sliding(WALL),
        ] {
            for rate in [0.5, 4.0, 50.0] {
                let steps = 20_000;
                let sum: f64 = (0..steps)
                    .map(|k| {
                        let at = rate * (f64::from(k) + 0.5) / f64::from(steps);
                        law.threshold(&material(), at, 0.8).stress * rate / f64::from(steps)
                    })
                    .sum();
                let potential = law.potential(&material(), rate, 0.8);
                assert!(
                    (sum / potential - 1.0).abs() < 1e-6,
                    "{law:?} {sum} {potential}"
                );
            }
        }
    }

    #[test]
    fn bad_walls_are_refused_by_name() {
        let rough = WallFriction {
            friction: f64::NAN,
            cohesion: 0.0,
        };
        assert!(
            rough
                .validate()
                .unwrap_err()
                .to_string()
                .contains("wall.friction")
        );
        let walls = SideWalls {
            width: 0.0,
            friction: WALL,
        };
        assert!(
            walls
                .validate()
                .unwrap_err()
                .to_string()
                .contains("walls.width")
        );
    }
}
