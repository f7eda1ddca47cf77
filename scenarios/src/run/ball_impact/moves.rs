//! Moves of a box of grains that grows and shrinks, with their reasons: a table, and what it comes to in words.

use crate::summary::{Quantity, Summary};
use crate::table::Table;
use colluvium_coupling::overlap::Reason;
use colluvium_coupling::overlap::bowl::{Bowl, Move};

/// Sides of a box by their numbers.
const SIDES: [&str; 5] = ["x low", "x high", "y low", "y high", "bottom"];

/// Moves in a table and in words; no table without any.
pub(super) fn table(bowl: &Bowl, summary: &mut Summary) -> Option<Table> {
    let all = bowl.moves();
    let sum = |sign: f64| {
        let of = all.iter().map(|m| m.mass * sign);
        of.filter(|m| *m > 0.0).sum::<f64>()
    };
    let because = |reason: Reason| {
        let of = all.iter().filter(|m| m.reason == reason);
        format!("{} by {}", of.count(), reason.word())
    };
    let of_side = |side: usize| {
        let of = all.iter().filter(|m| m.side == side);
        format!("{} {}", SIDES[side], of.count())
    };
    let reasons = [
        Reason::Ball,
        Reason::Speed,
        Reason::Loose,
        Reason::Warm,
        Reason::Inertial,
        Reason::Misplaced,
        Reason::Rest,
    ]
    .map(because);
    let sides = [0, 1, 2, 3, 4].map(of_side);
    let displaced: f64 = all.iter().map(|m| m.displaced).sum();
    let replaced: f64 = all.iter().map(|m| m.replaced).sum();
    summary.remarks.push(format!(
        "The box moved {} times ({}; {}): {:.4} kg became grains and {:.4} kg continuum; {displaced} grains were moved to make room, {replaced} came from \
         sheared packings.",
        all.len(),
        reasons.join(", "),
        sides.join(", "),
        sum(1.0),
        sum(-1.0),
    ));
    if bowl.refused_moves() > 0.0 {
        summary.remarks.push(format!(
            "Refused moves outwards: {}: zones.budget is too small for what the box needs, or it would have filled the container.",
            bowl.refused_moves()
        ));
    }
    for (name, value, source) in [
        (
            "moves",
            all.len() as f64,
            "of sides of the box; moves.csv has them",
        ),
        (
            "refused_moves",
            bowl.refused_moves(),
            "moves outwards that zones.budget or the walls did not allow; one wanted for many exchanges counts once",
        ),
        (
            "displaced",
            displaced,
            "grains that were moved to make room for them among others",
        ),
        (
            "replaced",
            replaced,
            "grains of sheared packings that came in the place of stored ones",
        ),
    ] {
        summary.put(name, Quantity::new(value, "1").from(source));
    }
    let column = |f: fn(&Move) -> f64| all.iter().map(f).collect::<Vec<f64>>();
    let table = Table::new("moves")
        .with("t", "s", column(|m| m.time))
        .with("side", "1", column(|m| m.side as f64))
        .with("place", "m", column(|m| m.place))
        .with("reason", "1", column(|m| m.reason.number() as f64))
        .with("value", "m, m/s or 1", column(|m| m.value))
        .with("mass", "kg", column(|m| m.mass))
        .with("grains", "1", column(|m| m.grains))
        .with("displaced", "1", column(|m| m.displaced))
        .with("replaced", "1", column(|m| m.replaced))
        .with("remainder", "kg", column(|m| m.remainder));
    (!all.is_empty()).then_some(table)
}
