//! Which feelers may touch before long.
//!
//! A distance changes by no more than the surfaces on both sides move. Each part keeps the sum of the ways
//! that the farthest point of its surface may have gone; while those of both sides together stay within
//! what there was room for, only the feelers that were near are asked. Looking again at any time
//! changes no bit.

use super::encounters::Encounter;
use super::feelers::Feelers;
use crate::domain::Domain;
use crate::walls::{Motion, Pose, Shape, Standing};
use nalgebra::Vector3;

/// What is near in an encounter.
#[derive(Clone, Debug, Default)]
pub(super) struct Lookout {
    /// Feelers that may touch, in order.
    pub near: Vec<u32>,
    /// Whether anything may.
    pub awake: bool,
    /// Way of both sides up to which this holds (m).
    until: f64,
}

/// Ways that surfaces have gone since the start (m).
#[derive(Clone, Debug, Default)]
pub(super) struct Ways(Vec<f64>);

impl Ways {
    /// Of walls and parts; a wall in motion has no bound.
    pub fn new(walls: &[Standing]) -> Ways {
        let told = |w: &Standing| w.carrier.is_none() && w.wall.motion != Motion::Fixed;
        let way = |w: &Standing| if told(w) { f64::NAN } else { 0.0 };
        Ways(walls.iter().map(way).collect())
    }

    /// A part goes from where it is to a pose.
    pub fn go(&mut self, part: usize, wall: &Standing, to: &Pose) {
        let turn = to.orientation * wall.pose.orientation.inverse();
        let extent = wall.wall.shape.extent() + wall.rounding;
        let moved = (to.position - wall.pose.position).norm();
        self.0[part] += moved + 2.0 * turn.imag().norm() * extent;
    }

    fn of(&self, encounter: &Encounter) -> f64 {
        self.0[encounter.prober as usize] + self.0[encounter.target as usize]
    }
}

impl Lookout {
    /// Looks again if the sides may have come too near.
    pub fn look(
        &mut self,
        encounter: &Encounter,
        ways: &Ways,
        walls: &[Standing],
        feelers: &Feelers,
        domain: &Domain,
        hold: f64,
    ) {
        let now = ways.of(encounter);
        if now < self.until {
            return;
        }
        self.near.clear();
        let [prober, target] = [encounter.prober, encounter.target].map(|k| &walls[k as usize]);
        let radius = feelers.points.last().map_or(0.0, |f| f.radius);
        let margin = radius.max(target.rounding) + hold;
        let gap = |at: &Vector3<f64>| {
            let x = prober.pose.position + prober.pose.outward(at);
            match &target.wall.shape {
                // Its nearest triangle may be that of another image.
                Shape::Mesh(_) if domain.periodic.iter().any(|p| *p) => 0.0,
                _ => target.foot(&target.seen(&x, domain)).distance,
            }
        };
        let room = gap(&feelers.middle) - feelers.reach - hold;
        self.awake = room < margin;
        if !self.awake {
            self.until = now + room;
            return;
        }
        let (centre, reach) = around(target, prober, domain);
        feelers.near(
            encounter.kind,
            &centre,
            reach + radius + 2.0 * margin,
            &mut self.near,
        );
        self.near.retain(|&k| {
            let feeler = &feelers.points[k as usize];
            gap(&feeler.at) - feeler.radius < 2.0 * margin
        });
        self.until = now + margin;
    }
}

/// A ball around the target in the prober's own coordinates: centre and radius.
fn around(target: &Standing, prober: &Standing, domain: &Domain) -> (Vector3<f64>, f64) {
    let reach = target.wall.shape.extent() + target.rounding;
    if !reach.is_finite() || domain.periodic.iter().any(|p| *p) {
        return (Vector3::zeros(), f64::INFINITY);
    }
    let apart = target.pose.position - prober.pose.position;
    (prober.pose.inward(&apart), reach)
}
