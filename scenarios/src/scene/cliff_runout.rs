//! Keys of the debris of a cliff as a continuum.

use super::collapse_terrain::ContactKind;
use super::world::Place;
use super::{CliffScene, SceneError};
use colluvium_continuum::free_surface::Contact;
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::wall_friction::WallFriction;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// When grains of a cliff become a continuum, and which; with `model = "hybrid"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CliffRunoutKeys {
    /// They do once the cliff has failed and their kinetic energy, past its peak, has fallen to this share of it.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub kinetic_share: f64,
    /// And they lie no steeper than this (degrees), by the wedge of their area and length: pieces that stand may tip over,
    /// which a continuum does not. 90: whatever stands.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 90.0))]
    pub steepest_degrees: f64,
    /// Where the debris as a whole stands more steeply, the part of it that lies goes by itself, in instalments of at least this
    /// share of what stood before the crack, while the rest goes on as grains. 1: as a whole only.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub least_share: f64,
    /// How deep a grain that fell from the cliff's height sinks into debris that is a continuum, over the mean diameter of the
    /// parcels: the stiffness of its surface, and the time between two exchanges with grains.
    #[schemars(extend("minimum" = 0.001, "maximum" = 0.5))]
    pub sinking_diameters: f64,
    /// Static friction μ_s of the debris.
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub mu_s: f64,
    /// Friction μ_2 at large inertial number.
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub mu_2: f64,
    /// Inertial number at which friction is half-way between.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub i_0: f64,
    /// Cohesion (Pa), at the size of the grains, not of the parcels.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e9))]
    pub cohesion: f64,
    /// What holds on the ground and on what is left of the cliff.
    pub contact: ContactKind,
    /// Friction on them, where it slides (`coulomb`).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub friction: Option<f64>,
    /// Edge of a cell over the mean diameter of the parcels.
    #[schemars(extend("minimum" = 0.25, "maximum" = 4.0))]
    pub cell_diameters: f64,
    /// Reach over which grains are smoothed when they become continuum, over the mean diameter of the parcels.
    #[schemars(extend("minimum" = 1.0, "maximum" = 10.0))]
    pub reach_diameters: f64,
}

impl Default for CliffRunoutKeys {
    fn default() -> Self {
        Self {
            kinetic_share: 0.1,
            steepest_degrees: 45.0,
            least_share: 1.0,
            sinking_diameters: 0.05,
            mu_s: 0.6,
            mu_2: 0.9,
            i_0: 0.3,
            cohesion: 0.0,
            contact: ContactKind::NoSlip,
            friction: None,
            cell_diameters: 1.0,
            reach_diameters: 2.0,
        }
    }
}

impl CliffRunoutKeys {
    /// What holds on the ground.
    pub fn contact(&self) -> Contact {
        match self.contact {
            ContactKind::NoSlip => Contact::NoSlip,
            ContactKind::FreeSlip => Contact::FreeSlip,
            ContactKind::Coulomb => Contact::Coulomb(WallFriction {
                friction: self.friction.unwrap_or(0.0),
                cohesion: 0.0,
            }),
        }
    }

    /// The law of debris of grains of a diameter (m) and a density (kg/m³) at a solid fraction.
    pub fn law(&self, diameter: f64, grain_density: f64, solid_fraction: f64) -> MuI {
        MuI {
            mu_s: self.mu_s,
            mu_2: self.mu_2,
            i_0: self.i_0,
            diameter,
            solid_fraction,
            grain_density,
            cohesion: self.cohesion,
        }
    }
}

impl CliffScene {
    /// Refuses keys of the run-out that do not fit together.
    pub(super) fn check_runout(&self, origin: &str) -> Result<(), SceneError> {
        let at = Place {
            origin,
            section: "runout",
        };
        let keys = &self.runout;
        let slides = keys.contact == ContactKind::Coulomb;
        if slides && keys.friction.is_none() {
            return Err(at.refuse("friction", "missing", "given where contact = \"coulomb\""));
        }
        if let (false, Some(friction)) = (slides, keys.friction) {
            return Err(at.refuse(
                "friction",
                friction,
                "given where contact = \"coulomb\" alone",
            ));
        }
        if keys.mu_2 < keys.mu_s {
            let range = format!("at least mu_s, {}", keys.mu_s);
            return Err(at.refuse("mu_2", keys.mu_2, range));
        }
        let law = keys.law(1.0, 1.0, 0.5);
        law.validate()
            .map_err(|why| at.refuse("mu_s", keys.mu_s, why.to_string()))
    }
}
