//! Keys of what holds on a floor or a wall.

use super::{ContactKind, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What holds on a floor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceKeys {
    /// No slip, Coulomb friction or free slip.
    #[serde(default)]
    pub contact: ContactKind,
    /// Friction coefficient of the material on it, under contact = "coulomb".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub friction: Option<f64>,
}

impl SurfaceKeys {
    /// Friction goes with Coulomb's contact, and only with it; `table` names the keys in messages.
    pub(super) fn check_together(&self, origin: &str, table: &str) -> Result<(), SceneError> {
        match (self.contact, self.friction) {
            (ContactKind::Coulomb, None) => Err(SceneError::MissingKey {
                file: origin.to_owned(),
                key: format!("{table}.friction"),
                wanted: "the friction coefficient of contact = \"coulomb\"".into(),
            }),
            (ContactKind::NoSlip | ContactKind::FreeSlip, Some(friction)) => {
                Err(SceneError::OutOfRange {
                    file: origin.to_owned(),
                    key: format!("{table}.friction"),
                    value: friction.to_string(),
                    range: format!("left out, unless {table}.contact is \"coulomb\""),
                })
            }
            _ => Ok(()),
        }
    }
}
