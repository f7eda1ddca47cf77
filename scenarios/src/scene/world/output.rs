//! `[output]` and `[timestep]`.

use super::AverageKeys;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a run writes, and how often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputKeys {
    /// Rows of `history.csv` over the planned length of the run.
    #[schemars(extend("minimum" = 1, "maximum" = 1000000))]
    pub rows: u64,
    /// Instants in `grains.vtkhdf` and `contacts.vtkhdf` besides the start, for ParaView; 0 writes none,
    /// from 10 on an animation of them stands in the report.
    #[schemars(extend("minimum" = 0, "maximum" = 100000))]
    pub frames: u64,
    /// Pictures in the report besides those of start and end.
    #[schemars(extend("minimum" = 0, "maximum" = 100))]
    pub pictures: u64,
    /// Whether rows also hold work and heat by channel of the contacts.
    pub ledger: bool,
    /// Coarse-grained fields, gathered as the run goes on: `fields.csv` and `fields.vtkhdf`. Left out: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub average: Option<AverageKeys>,
}

impl Default for OutputKeys {
    fn default() -> Self {
        OutputKeys {
            rows: 200,
            frames: 0,
            pictures: 1,
            ledger: false,
            average: None,
        }
    }
}

/// The time step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StepKeys {
    /// Step (s) for grains; that of parcels is as much longer as they are larger. Left out: from the
    /// limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub seconds: Option<f64>,
    /// Step over that which the limits allow.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub safety: f64,
    /// The same for the steps of the preparation.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub preparation: f64,
}

impl Default for StepKeys {
    fn default() -> Self {
        StepKeys {
            seconds: None,
            safety: 1.0,
            preparation: 1.0,
        }
    }
}
