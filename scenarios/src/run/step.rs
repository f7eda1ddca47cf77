//! The time step of grains, and what limits it.

use colluvium_dem::timestep::{Choice, Conditions, Limit, Shares, choose as choose_among, limits};
use colluvium_dem::{ContactLaw, Grain, LawTable};

/// A time step and its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The step (s).
    pub seconds: f64,
    /// What limits it, in words.
    pub limit: String,
    /// All limits, the binding one first.
    pub all: Vec<Limit>,
}

impl From<Choice> for Step {
    fn from(choice: Choice) -> Step {
        Step {
            seconds: choice.seconds,
            limit: choice
                .limit()
                .map_or_else(|| "nothing".into(), ToString::to_string),
            all: choice.all,
        }
    }
}

/// The step of grains of one law: its own contact time over the steps per contact, unless another
/// limit of these grains (and of walls of the same material) is shorter.
pub fn choose(
    contact_time: f64,
    steps_per_contact: f64,
    law: &ContactLaw,
    grains: &[Grain],
    walled: bool,
    conditions: &Conditions,
) -> Step {
    let shares = Shares {
        steps_per_contact,
        contact_time: Some(contact_time),
        ..Shares::default()
    };
    // A law that does not stand is refused where the simulation is made, with its key.
    let Ok(laws) = LawTable::new(&(*law).into()) else {
        return Step {
            seconds: contact_time / steps_per_contact,
            limit: "contact time".into(),
            all: Vec::new(),
        };
    };
    let walls: &[u16] = if walled { &[0] } else { &[] };
    choose_among(
        limits(grains, walls, &laws, conditions, &shares),
        shares.safety,
    )
    .into()
}
