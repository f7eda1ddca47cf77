//! Which surfaces may meet: a side that feels and a side that is felt.
//!
//! Both sides of a pair feel each other, but a ball feels for both: its one feeler knows all that there
//! is to know about the distance. Pairs of one body, of two that move as they are told, and of walls are
//! left out.

use super::feelers::{Feelers, Kind};
use super::rigid::Rigid;
use crate::walls::{Shape, Side, Standing};

/// One side that feels another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Encounter {
    /// Walls or parts by their numbers.
    pub prober: u32,
    pub target: u32,
    /// Which feelers the target asks for.
    pub kind: Kind,
    /// Whether rims are felt by their lowest points.
    pub flat: bool,
    /// Contacts of one pair of bodies, or of a body and a wall, share a group.
    pub group: u32,
}

/// Feelers that a target needs, and whether it is flat and without end.
fn needs(shape: &Shape) -> (Kind, bool) {
    match shape {
        Shape::Plane(_) => (Kind::Corner, true),
        Shape::Cylinder(c) if c.side == Side::Inside => (Kind::Rim, false),
        Shape::SphereShell(s) if s.side == Side::Inside => (Kind::Rim, false),
        _ => (Kind::Ridge, false),
    }
}

/// A ball from outside: it feels, and is felt only by other balls.
fn is_ball(shape: &Shape) -> bool {
    matches!(shape, Shape::SphereShell(shell) if shell.side == Side::Outside)
}

/// All pairs that may meet, those of one pair of owners together, in a fixed order.
pub(super) fn all(walls: &[Standing], rigid: &[Rigid], feelers: &[Feelers]) -> Vec<Encounter> {
    let fixed = walls.iter().filter(|w| w.carrier.is_none()).count();
    // Walls own themselves, parts belong to bodies.
    let owner = |k: usize| match &walls[k].carrier {
        Some(carrier) => fixed + carrier.body as usize,
        None => k,
    };
    let told = |owner: usize| owner < fixed || rigid[owner - fixed].is_driven();
    let mut found: Vec<([usize; 2], Encounter)> = Vec::new();
    for prober in 0..walls.len() {
        for target in 0..walls.len() {
            let owners = [owner(prober), owner(target)];
            if owners[0] == owners[1] || owners.iter().all(|&o| told(o)) {
                continue;
            }
            let shapes = [prober, target].map(|k| &walls[k].wall.shape);
            // Of two balls the first one feels.
            let spare = is_ball(shapes[1]) && (!is_ball(shapes[0]) || prober > target);
            if spare || feelers[prober].points.is_empty() {
                continue;
            }
            let (kind, flat) = needs(shapes[1]);
            let pair = [owners[0].min(owners[1]), owners[0].max(owners[1])];
            let encounter = Encounter {
                prober: prober as u32,
                target: target as u32,
                kind,
                flat,
                group: 0,
            };
            found.push((pair, encounter));
        }
    }
    found.sort_by_key(|(pair, _)| *pair);
    let (mut group, mut last) = (0, None);
    found
        .into_iter()
        .map(|(pair, encounter)| {
            if last.is_some_and(|last| last != pair) {
                group += 1;
            }
            last = Some(pair);
            Encounter { group, ..encounter }
        })
        .collect()
}
