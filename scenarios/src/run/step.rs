//! The time step of grains, chosen or given: what limits it, in words, and which one is refused.

use crate::scene::{Scene, SceneError};
use colluvium_dem::timestep::{self, Choice, Conditions, Shares};
use colluvium_dem::{ContactLaw, Grain, LawTable};

/// The step of grains of one law: what the shares take of its own contact time, unless another limit of
/// these grains (and of walls of the same material) is shorter.
pub fn choose(
    law: &ContactLaw,
    grains: &[Grain],
    walled: bool,
    conditions: &Conditions,
    shares: &Shares,
) -> Choice {
    // A law that does not stand is refused where the simulation is made, with its key.
    let limits = LawTable::new(&(*law).into()).map_or_else(
        |_| Vec::new(),
        |laws| {
            let walls: &[u16] = if walled { &[0] } else { &[] };
            timestep::limits(grains, walls, &laws, conditions, shares)
        },
    );
    timestep::choose(limits, shares.safety)
}

/// What a chosen step goes by.
pub fn chosen(choice: &Choice) -> String {
    let limit = choice
        .limit()
        .map_or_else(|| "nothing".into(), ToString::to_string);
    if choice.safety == 1.0 {
        limit
    } else {
        format!("safety factor {} on {limit}", choice.safety)
    }
}

/// How a given step (s) stands to what its limits allow.
pub fn given(step: f64, choice: &Choice) -> String {
    match choice.limit() {
        Some(limit) => format!(
            "given: {:.0} % of what its limits allow, {:.4e} s ({limit})",
            100.0 * step / choice.allowed(),
            choice.allowed()
        ),
        None => "given: nothing limits it".into(),
    }
}

/// Refuses a step (s) at which one contact blows up; the step is in proportion to the `value` of `key`.
pub fn check(
    scene: &Scene,
    choice: &Choice,
    step: f64,
    key: &str,
    value: f64,
) -> Result<(), SceneError> {
    let Some(limit) = choice.broken_by(step) else {
        return Ok(());
    };
    let of_key = |seconds: f64| shortened(seconds * value / step);
    let does = of_key(choice.allowed());
    let does = if does.is_normal() {
        format!("{does:?} would do")
    } else {
        "no step that a computer can hold would do".into()
    };
    let range = format!(
        "(0, {:?}): from there on one contact is unstable ({}, {}); {does}",
        of_key(limit.seconds),
        limit.name,
        limit.pair,
    );
    Err(scene.out_of_range(key, value, &range))
}

/// To four digits.
fn shortened(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}
