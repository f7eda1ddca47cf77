//! Keys of one impact: two spheres, or a sphere on a plane.

use super::{LEAST_MASS, LawKeys, RollingKind, SceneError};
use colluvium_dem::ContactLaw;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A sphere that hits another sphere or the plane z = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImpactScene {
    /// Speed of approach (m/s).
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e4))]
    pub speed: f64,
    /// Angle between the velocity and the normal of the contact (degrees).
    #[schemars(extend("minimum" = 0.0, "maximum" = 90.0))]
    pub impact_degrees: f64,
    /// Spin of the moving sphere about y, normal to the plane of the impact (rad/s).
    #[schemars(extend("minimum" = -1.0e6, "maximum" = 1.0e6))]
    pub spin: f64,
    /// Radius (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub radius: f64,
    /// Density (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub density: f64,
    /// Normal restitution ε_n.
    #[schemars(extend("minimum" = 0.01, "maximum" = 1.0))]
    pub restitution: f64,
    /// Coulomb friction μ_p.
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub friction: f64,
    /// ε_t: sets the tangential dashpot as ε_n sets the normal one; 1 = none.
    #[schemars(extend("minimum" = 0.01, "maximum" = 1.0))]
    pub tangential_restitution: f64,
    /// Normal stiffness k_n (N/m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e12))]
    pub stiffness: f64,
    /// Tangential over normal stiffness.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 2.0))]
    pub stiffness_ratio: f64,
    /// Gap between the surfaces at the start (m); negative where they start pressed together.
    #[schemars(extend("minimum" = -1.0, "maximum" = 100.0))]
    pub gap: f64,
    /// Gravity along -z (m/s²).
    #[schemars(extend("minimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Duration (s); 0 ends one contact time after the spheres have parted.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e4))]
    pub duration: f64,
    /// Steps per undamped contact.
    #[schemars(extend("minimum" = 10.0, "maximum" = 1.0e6))]
    pub steps_per_contact: f64,
    /// Factor on the step that those and all other limits allow.
    #[schemars(extend("minimum" = 0.01, "maximum" = 10.0))]
    pub safety: f64,
    /// Rows of `trajectory.csv`.
    #[schemars(extend("minimum" = 2, "maximum" = 1000000))]
    pub rows: u64,
    /// Rolling and twisting springs; leave the table out for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rolling: Option<RollingKeys>,
    /// Another contact law, or more of it; restitution, friction, stiffness and the ratio of
    /// stiffnesses have their home above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<LawKeys>,
}

/// Keys of `[contact]` that have their home at the top of an impact.
pub const AT_THE_TOP: [&str; 5] = [
    "stiffness",
    "restitution",
    "friction",
    "stiffness_ratio",
    "tangential_restitution",
];

/// A key at the top, and the key of `[contact]` that takes its place.
pub const INSTEAD: [(&str, &str); 4] = [
    ("restitution", "damping_rate"),
    ("tangential_restitution", "tangential_damping_rate"),
    ("stiffness_ratio", "tangential_stiffness"),
    ("rolling", "rolling"),
];

/// Rolling and twisting springs with a shape parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RollingKeys {
    /// Shape parameter β: size of the contact patch over the reduced radius r_i r_j/(r_i + r_j).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 5.0))]
    pub beta: f64,
    /// Rolling friction μ_R.
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub rolling_friction: f64,
    /// Twisting friction μ_T.
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub twisting_friction: f64,
}

impl ImpactScene {
    /// Mass of one sphere (kg).
    pub fn mass(&self) -> f64 {
        self.density * 4.0 / 3.0 * std::f64::consts::PI * self.radius.powi(3)
    }

    /// The law as one section: the keys at the top, and what `[contact]` puts in their place.
    pub fn law_keys(&self) -> LawKeys {
        let given = self.contact.unwrap_or_default();
        let mut keys = LawKeys {
            stiffness: Some(self.stiffness),
            restitution: Some(self.restitution),
            friction: Some(self.friction),
            stiffness_ratio: given
                .tangential_stiffness
                .is_none()
                .then_some(self.stiffness_ratio),
            tangential_restitution: Some(self.tangential_restitution),
            ..given
        };
        // Over an elastic contact a ratio of stiffnesses has no meaning; it is only the default here.
        if keys.parts().normal != super::NormalKind::Hooke {
            keys.stiffness_ratio = None;
        }
        if let Some(rolling) = self.rolling {
            keys.rolling = Some(RollingKind::Shape);
            keys.beta = Some(rolling.beta);
            keys.rolling_friction = Some(rolling.rolling_friction);
            keys.twisting_friction = Some(rolling.twisting_friction);
        }
        keys
    }

    /// The contact law.
    pub fn law(&self, origin: &str) -> Result<ContactLaw, SceneError> {
        self.law_keys().law(origin)
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        self.law(origin)?;
        if self.mass() <= LEAST_MASS {
            // Whichever of the two is the slip.
            let (key, value) = if self.radius < 1e-20 {
                ("radius", self.radius)
            } else {
                ("density", self.density)
            };
            return Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: key.into(),
                value: value.to_string(),
                range: format!("such that the sphere is heavier than {LEAST_MASS:e} kg"),
            });
        }
        if self.gap < -0.5 * self.radius {
            return Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: "gap".into(),
                value: self.gap.to_string(),
                range: format!("at least {}, half a radius pressed in", -0.5 * self.radius),
            });
        }
        Ok(())
    }
}
