//! Room for grains of a stored packing among those that have moved since it was stored.
//!
//! Both sides of the seam have gone their ways by the same means, but single grains have not: some of the packing would lie
//! deep in others, with energies that nothing in the bed has. Pairs that overlap deeper than they may are moved apart along
//! their line of centres until none is left, those of the packing alone: what is there stays. Two of the packing may
//! overlap as they did in it, so that it keeps its forces, but no deeper than any contact of the bed; others no deeper than
//! that either, and where they did they are left as contacts of the bed usually are.

use colluvium_dem::Grain;
use nalgebra::Vector3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Excess over what is allowed, over the sum of radii, that moves nothing.
const SLACK: f64 = 1e-6;
/// Rounds after which what is still too deep is left so.
const ROUNDS: usize = 400;
/// How far apart surfaces may be of grains that moving others may bring together, in radii.
const NEAR: f64 = 0.5;

/// What making room did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Room {
    /// Grains that were moved.
    pub moved: f64,
    /// Deepest overlap over the sum of radii before and after.
    pub deepest: [f64; 2],
}

/// A ball by its centre and radius.
pub(super) type Ball = (Vector3<f64>, f64);

/// Overlaps of contacts over the sum of radii.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Overlaps {
    /// Their mean.
    pub usual: f64,
    /// The deepest.
    pub deepest: f64,
}

/// Moves grains apart from what is `there` and from each other until no pair overlaps deeper than allowed; `inside` takes a
/// ball back between the walls.
pub(super) fn make_room(
    grains: &mut [Grain],
    there: &[Ball],
    allowed: Overlaps,
    inside: impl Fn(&mut Vector3<f64>, f64),
) -> Room {
    let place = |at: &Vector3<f64>, number: usize| GeomWithData::new([at.x, at.y, at.z], number);
    let others = there.iter().enumerate();
    let others = RTree::bulk_load(others.map(|(n, (at, _))| place(at, n)).collect());
    let own = grains.iter().enumerate();
    let own = RTree::bulk_load(own.map(|(n, g)| place(&g.position, n)).collect());
    let largest = grains.iter().map(|g| g.radius);
    let largest = there
        .iter()
        .map(|(_, r)| *r)
        .chain(largest)
        .fold(0.0, f64::max);
    // Pairs that may come to overlap: a grain, and one there or another.
    let (mut foreign, mut among) = (Vec::new(), Vec::new());
    for (n, grain) in grains.iter().enumerate() {
        let reach = ((1.0 + NEAR) * grain.radius + (1.0 + NEAR) * largest).powi(2);
        let at: [f64; 3] = grain.position.into();
        let found = others.locate_within_distance(at, reach);
        foreign.extend(found.map(|other| (n, other.data)));
        let found = own.locate_within_distance(at, reach);
        among.extend(found.map(|o| (n, o.data)).filter(|(n, other)| n < other));
    }
    // What is found first depends on the tree.
    foreign.sort_unstable();
    among.sort_unstable();
    let of_pair = |&(a, b): &(usize, usize)| {
        let [a, b]: [&Grain; 2] = [&grains[a], &grains[b]];
        let overlap = 1.0 - (a.position - b.position).norm() / (a.radius + b.radius);
        overlap.clamp(0.0, allowed.deepest)
    };
    let own: Vec<f64> = among.iter().map(of_pair).collect();
    let foreigners = [allowed.deepest, allowed.usual];
    let before: Vec<Vector3<f64>> = grains.iter().map(|g| g.position).collect();
    let mut room = Room::default();
    for round in 0..ROUNDS {
        let mut deepest = 0.0_f64;
        // By how much a ball has to leave another, along which way.
        let mut way = |a: &Ball, b: &Ball, [most, left]: [f64; 2]| {
            let (apart, reach) = (a.0 - b.0, a.1 + b.1);
            let distance = apart.norm();
            deepest = deepest.max(1.0 - distance / reach);
            let is_deep = 1.0 - distance / reach > most + SLACK && distance > 0.0;
            is_deep.then(|| apart * (((1.0 - left) * reach - distance) / distance))
        };
        let ball = |g: &Grain| (g.position, g.radius);
        let mut still = true;
        for &(n, other) in &foreign {
            if let Some(way) = way(&ball(&grains[n]), &there[other], foreigners) {
                grains[n].position += way;
                still = false;
            }
        }
        for (&(n, other), own) in among.iter().zip(&own) {
            if let Some(way) = way(&ball(&grains[n]), &ball(&grains[other]), [*own; 2]) {
                grains[n].position += 0.5 * way;
                grains[other].position -= 0.5 * way;
                still = false;
            }
        }
        for grain in grains.iter_mut() {
            inside(&mut grain.position, grain.radius);
        }
        if round == 0 {
            room.deepest[0] = deepest;
        }
        room.deepest[1] = deepest;
        if still {
            break;
        }
    }
    let pairs = grains.iter().zip(&before);
    room.moved = pairs.filter(|(g, before)| g.position != **before).count() as f64;
    room
}

/// Which grains overlap one that is there, or one before them that does not, deeper than this over the sum of radii.
pub(super) fn too_deep(grains: &[Grain], there: &[Ball], most: f64) -> Vec<bool> {
    let own = grains.iter().enumerate();
    let own = own.map(|(k, g)| (g.position, g.radius, Some(k)));
    let others = there.iter().map(|(at, radius)| (*at, *radius, None));
    let entry = |(at, radius, number): (Vector3<f64>, f64, Option<usize>)| {
        GeomWithData::new(<[f64; 3]>::from(at), (radius, number))
    };
    let all: Vec<_> = others.chain(own).map(entry).collect();
    let largest = all.iter().map(|ball| ball.data.0).fold(0.0, f64::max);
    let tree = RTree::bulk_load(all);
    let mut goes = vec![false; grains.len()];
    for (k, grain) in grains.iter().enumerate() {
        let reach = (grain.radius + largest).powi(2);
        let mut near = tree.locate_within_distance(grain.position.into(), reach);
        goes[k] = near.any(|entry| {
            let (radius, number) = entry.data;
            let way = (Vector3::from(*entry.geom()) - grain.position).norm();
            let counts = number.is_none_or(|n| n < k && !goes[n]);
            counts && way < (1.0 - most) * (grain.radius + radius)
        });
    }
    goes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_too_deep_is_moved_and_nothing_else() {
        let at = |x: f64| Grain::at_rest(Vector3::new(x, 0.0, 0.0), 0.5, 1.0);
        // In one that is there; in contact with the first; deeper in the second than any contact; far away.
        let mut grains = vec![at(0.8), at(1.798), at(2.698), at(9.0)];
        let far = grains[3];
        let there = [(Vector3::zeros(), 0.5)];
        let allowed = Overlaps {
            usual: 1e-3,
            deepest: 5e-3,
        };
        let room = make_room(&mut grains, &there, allowed, |_, _| ());
        assert!((0.2..0.21).contains(&room.deepest[0]) && room.deepest[1] < 5.1e-3);
        assert_eq!((room.moved, grains[3]), (3.0, far));
        let x = [0, 1, 2].map(|n| grains[n].position.x);
        let overlaps = [1.0 - x[0], 1.0 - x[1] + x[0], 1.0 - x[2] + x[1]];
        assert!(
            (1e-3 - 1e-5..5e-3 + 1e-5).contains(&overlaps[0]),
            "{overlaps:?}"
        );
        for (found, allowed) in overlaps.into_iter().skip(1).zip([2e-3, 5e-3]) {
            assert!((found - allowed).abs() < 1e-5, "{overlaps:?}");
        }
        let settled = grains.clone();
        let again = make_room(&mut grains, &there, allowed, |_, _| ());
        assert!(again.moved == 0.0 && grains == settled);
    }

    #[test]
    fn of_two_that_lie_too_deep_the_later_one_is() {
        let at = |x: f64| Grain::at_rest(Vector3::new(x, 0.0, 0.0), 0.5, 1.0);
        let grains = [at(0.7), at(0.85), at(1.6), at(2.55)];
        let there = [(Vector3::zeros(), 0.5)];
        // In one that is there; in the one before, which goes; in none; less deep than asked for.
        let goes = too_deep(&grains, &there, 0.2);
        assert_eq!(goes, [true, false, true, false]);
        assert_eq!(too_deep(&grains, &there, 0.01), [true, true, false, true]);
    }

    #[test]
    fn walls_are_kept() {
        let mut grains = vec![Grain::at_rest(Vector3::new(0.6, 0.0, 0.0), 0.5, 1.0)];
        let there = [(Vector3::new(0.9, 0.0, 0.0), 0.5)];
        let wall = |at: &mut Vector3<f64>, r: f64| at.x = at.x.max(r);
        make_room(&mut grains, &there, Overlaps::default(), wall);
        assert_eq!(grains[0].position.x, 0.5);
    }
}
