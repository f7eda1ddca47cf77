//! `summary.json`, format 1: what scripts read of a run.

use crate::cost::Cost;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Number of the format; it changes when a key changes its meaning.
pub const FORMAT: u32 = 1;

/// How far a run came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// Begun; a run that was killed stays here.
    Running,
    /// Finished.
    Done,
    /// Stopped by the user, with a checkpoint.
    Interrupted,
    /// Ended with an error.
    Failed,
}

/// A run in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Always [`FORMAT`].
    pub format: u32,
    /// Kind of the scene.
    pub scene: String,
    /// What was done with it: `run`, `calibrate` or `pareto`.
    pub command: String,
    /// Version of Colluvium.
    pub version: String,
    /// How far it came.
    pub status: Status,
    /// What was modelled.
    pub model: Model,
    /// What it cost.
    pub cost: Cost,
    /// What should be conserved.
    pub ledger: Ledger,
    /// Bits of the final state, as hex.
    pub state_hash: String,
    /// What was found.
    pub results: BTreeMap<String, Quantity>,
    /// Warnings and remarks in words.
    #[serde(default)]
    pub remarks: Vec<String>,
    /// What was done to put grains in place, and how it went.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub preparation: Vec<Note>,
    /// Curves and pictures for the report.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
}

/// A step of a preparation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Note {
    /// What was done.
    pub step: String,
    /// What it achieved against what was asked for.
    pub text: String,
}

/// A figure of the report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Figure {
    /// Columns of a CSV table against one of them.
    Curves {
        /// Name of the table, without ending.
        table: String,
        /// Column along the horizontal axis, and its label.
        x: [String; 2],
        /// Label of the vertical axis.
        y_label: String,
        /// Columns, and what the legend calls them.
        y: Vec<[String; 2]>,
        /// Whether both axes are logarithmic.
        #[serde(default)]
        log: bool,
        /// What is to be seen.
        caption: String,
    },
    /// A picture in the run directory.
    Picture {
        /// Its file.
        file: String,
        /// What is to be seen.
        caption: String,
    },
}

impl Figure {
    /// Columns of `history.csv` in time.
    pub fn history(y_label: &str, y: &[(&str, &str)], caption: &str) -> Figure {
        Figure::Curves {
            table: "history".into(),
            x: ["t".into(), "time t [s]".into()],
            y_label: y_label.into(),
            y: y.iter()
                .map(|(column, label)| [(*column).to_owned(), (*label).to_owned()])
                .collect(),
            log: false,
            caption: caption.into(),
        }
    }
}

/// What was modelled.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Free and fixed grains.
    pub grains: u64,
    /// Cells.
    pub cells: u64,
    /// Time step (s).
    pub dt_s: f64,
    /// What limits the time step.
    pub dt_limit: String,
    /// Physics that the scene does not need and that was not computed.
    pub left_out: Vec<String>,
}

/// Relative errors of what should be conserved, and energies.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Mass: relative error; zero where no mass can move in or out.
    pub mass_relative: f64,
    /// Linear momentum: relative error of its balance; null where it was not drawn up.
    pub momentum_relative: Option<f64>,
    /// Angular momentum: the same.
    pub angular_momentum_relative: Option<f64>,
    /// Energies (J), by name.
    pub energy: BTreeMap<String, f64>,
}

/// One result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// The value; null where it could not be found.
    pub value: Option<f64>,
    /// Its unit; "1" for pure numbers.
    pub unit: String,
    /// Its standard error.
    pub error: Option<f64>,
    /// What it should be or is compared with.
    pub reference: Option<f64>,
    /// Where value and reference come from.
    pub source: String,
}

impl Quantity {
    /// A value without error or reference. What is not finite becomes null.
    pub fn new(value: f64, unit: &str) -> Quantity {
        Quantity {
            value: value.is_finite().then_some(value),
            unit: unit.to_owned(),
            error: None,
            reference: None,
            source: String::new(),
        }
    }

    /// With a standard error.
    pub fn with_error(mut self, error: f64) -> Quantity {
        self.error = error.is_finite().then_some(error);
        self
    }

    /// With a reference and where it comes from.
    pub fn against(mut self, reference: f64, source: &str) -> Quantity {
        self.reference = reference.is_finite().then_some(reference);
        self.source = source.to_owned();
        self
    }

    /// With a note on where the value comes from.
    pub fn from(mut self, source: &str) -> Quantity {
        self.source = source.to_owned();
        self
    }
}

impl Summary {
    /// The summary of a run that has just begun.
    pub fn begun(scene: &str, command: &str) -> Summary {
        Summary {
            format: FORMAT,
            scene: scene.to_owned(),
            command: command.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            status: Status::Running,
            model: Model::default(),
            cost: Cost::default(),
            ledger: Ledger::default(),
            state_hash: String::new(),
            results: BTreeMap::new(),
            remarks: Vec::new(),
            preparation: Vec::new(),
            figures: Vec::new(),
        }
    }

    /// Adds a result.
    pub fn put(&mut self, name: &str, quantity: Quantity) {
        self.results.insert(name.to_owned(), quantity);
    }
}
