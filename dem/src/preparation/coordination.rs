//! Contacts a grain has, with and without rattlers.

use crate::snapshot::{Partner, Snapshot};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Contacts of the free grains; those with walls and fixed grains count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Coordination {
    /// Mean over all free grains.
    pub all: f64,
    /// Mean over those that are no rattlers, of contacts among them and with what is fixed.
    pub without_rattlers: f64,
    /// Share of the free grains that are rattlers.
    pub rattlers: f64,
    /// Contacts below which a grain is a rattler.
    pub least: usize,
}

/// Contacts that hold a grain without friction: d + 1.
pub const HELD_FRICTIONLESS: usize = 4;
/// Contacts that hold a grain with friction.
pub const HELD_BY_FRICTION: usize = 2;

impl Coordination {
    /// Counts contacts; grains with fewer than `least` are taken out until none is left.
    pub fn of(snapshot: &Snapshot, least: usize) -> Coordination {
        let grains = &snapshot.grains;
        let free: Vec<bool> = grains.iter().map(|g| !g.fixed).collect();
        let pairs: Vec<[Option<usize>; 2]> = snapshot.contacts.iter().map(ends).collect();
        let (all, count) = mean(&pairs, &free, &free);
        let mut kept = free.clone();
        loop {
            let touches = touches(&pairs, &free, &kept);
            let rattles = |&i: &usize| kept[i] && touches[i] < least;
            let goes: Vec<usize> = (0..kept.len()).filter(rattles).collect();
            if goes.is_empty() {
                break;
            }
            goes.into_iter().for_each(|i| kept[i] = false);
        }
        let (without_rattlers, held) = mean(&pairs, &free, &kept);
        Coordination {
            all,
            without_rattlers,
            rattlers: 1.0 - held as f64 / count.max(1) as f64,
            least,
        }
    }
}

fn ends(contact: &crate::ContactSample) -> [Option<usize>; 2] {
    let other = match contact.partner {
        Partner::Grain(j) => Some(j),
        _ => None,
    };
    [Some(contact.grain), other]
}

/// Contacts of each grain that is kept with others that are kept or held from outside.
fn touches(pairs: &[[Option<usize>; 2]], free: &[bool], kept: &[bool]) -> Vec<usize> {
    let mut touches = vec![0; free.len()];
    let stands = |end: Option<usize>| end.is_none_or(|i| kept[i] || !free[i]);
    for &[a, b] in pairs {
        if stands(a) && stands(b) {
            for i in [a, b].into_iter().flatten().filter(|&i| kept[i]) {
                touches[i] += 1;
            }
        }
    }
    touches
}

fn mean(pairs: &[[Option<usize>; 2]], free: &[bool], kept: &[bool]) -> (f64, usize) {
    let count = kept.iter().filter(|&&k| k).count();
    let sum: usize = touches(pairs, free, kept).iter().sum();
    (sum as f64 / count.max(1) as f64, count)
}

impl fmt::Display for Coordination {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "{:.3} contacts a grain, {:.3} without the {:.1} % that have fewer than {}",
            self.all,
            self.without_rattlers,
            100.0 * self.rattlers,
            self.least
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ContactSample, GrainSample};
    use nalgebra::Vector3;

    fn snapshot(fixed: &[bool], contacts: &[(usize, Option<usize>)]) -> Snapshot {
        let zero = Vector3::zeros();
        let grain = |(id, &fixed): (usize, &bool)| GrainSample {
            id: id as u32,
            position: zero,
            velocity: zero,
            spin: zero,
            radius: 1.0,
            mass: 1.0,
            fixed,
            clump: None,
        };
        let contact = |&(grain, partner): &(usize, Option<usize>)| ContactSample {
            grain,
            partner: partner.map_or(Partner::Wall(0), Partner::Grain),
            overlap: 0.1,
            force: zero,
            arm: zero,
            partner_arm: zero,
            torque: zero,
            partner_torque: zero,
        };
        Snapshot {
            grains: fixed.iter().enumerate().map(grain).collect(),
            contacts: contacts.iter().map(contact).collect(),
            ..Snapshot::default()
        }
    }

    #[test]
    fn rattlers_go_one_after_the_other() {
        // A ring of three on a wall, a tail of two, a loner; grain 6 is fixed and touches the ring.
        let contacts = [
            (0, Some(1)),
            (1, Some(2)),
            (2, Some(0)),
            (0, None),
            (2, Some(3)),
            (3, Some(4)),
            (6, Some(1)),
        ];
        let fixed = [false, false, false, false, false, false, true];
        let c = Coordination::of(&snapshot(&fixed, &contacts), 2);
        assert!((c.all - 12.0 / 6.0).abs() < 1e-15, "{c:?}");
        // Left: the ring, 6 ends, a wall and the fixed grain.
        assert!((c.without_rattlers - 8.0 / 3.0).abs() < 1e-15, "{c:?}");
        assert!((c.rattlers - 0.5).abs() < 1e-15, "{c:?}");
    }
}
