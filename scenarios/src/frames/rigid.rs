//! Bodies and clumps as frames: `bodies.vtkhdf` has the surfaces of the bodies as triangles, every one with
//! the motion and the load of its body, `clumps.vtkhdf` a point at the centre of mass of each clump.

use super::{field, vectors};
use crate::body_facets::{self, Facet};
use crate::vtkhdf::{Cells, Frame, Values};
use colluvium_dem::{BodySample, ClumpSample, Simulation, Snapshot};
use nalgebra::{UnitQuaternion, Vector3};

/// Corners of what is round.
const ROUND: usize = 24;

/// What quaternions are given as.
const TURN: &str = "quaternion w, x, y, z";

fn quaternions(turns: impl Iterator<Item = UnitQuaternion<f64>>) -> Values {
    let numbers = |turn: UnitQuaternion<f64>| [turn.w, turn.i, turn.j, turn.k];
    Values::Quaternions(turns.map(numbers).collect())
}

/// Surfaces of all bodies. `body` counts them from 0 in the order of their names; place, velocity, spin, force
/// and torque are of and about the centre of mass, the orientation is that of the body's own axes.
pub fn bodies(simulation: &Simulation, snapshot: &Snapshot) -> Frame {
    let (mut of, mut points) = (Vec::new(), Vec::new());
    for (k, body) in snapshot.bodies.iter().enumerate() {
        let facets = body_facets::of(simulation.body_setup(k), &body.pose, ROUND);
        of.extend(std::iter::repeat_n(k, facets.len()));
        let corners = |facet: Facet| facet.map(<[f64; 3]>::from);
        points.extend(facets.into_iter().flat_map(corners));
    }
    let all = |read: fn(&BodySample) -> Vector3<f64>| {
        vectors(of.iter().map(|&k| read(&snapshot.bodies[k])))
    };
    let masses = of.iter().map(|&k| snapshot.bodies[k].mass).collect();
    let turns = of.iter().map(|&k| snapshot.bodies[k].pose.orientation);
    Frame {
        time: snapshot.time,
        cells: Cells::Triangles,
        points,
        fields: vec![
            field(
                "body",
                "1",
                Values::Counts(of.iter().map(|&k| k as i64).collect()),
            ),
            field("mass", "kg", Values::Scalars(masses)),
            field("centre", "m", all(|b| b.centre)),
            field("orientation", TURN, quaternions(turns)),
            field("velocity", "m/s", all(|b| b.velocity)),
            field("spin", "rad/s", all(|b| b.spin)),
            field("force", "N", all(|b| b.force)),
            field("torque", "N m", all(|b| b.torque)),
        ],
    }
}

/// All clumps as points, in the order in which they were made; `clump` is the number that `grains.vtkhdf` gives
/// their grains, the orientation that of the principal axes.
pub fn clumps(simulation: &mut Simulation) -> Frame {
    let seen = simulation.clump_samples();
    let all = |read: fn(&ClumpSample) -> Vector3<f64>| vectors(seen.iter().map(read));
    let counts = |read: fn(&ClumpSample) -> i64| Values::Counts(seen.iter().map(read).collect());
    Frame {
        time: simulation.time(),
        cells: Cells::Points,
        points: seen.iter().map(|c| c.centre.into()).collect(),
        fields: vec![
            field("clump", "1", counts(|c| i64::from(c.number))),
            field("grains", "1", counts(|c| c.grains as i64)),
            field(
                "mass",
                "kg",
                Values::Scalars(seen.iter().map(|c| c.mass).collect()),
            ),
            field(
                "orientation",
                TURN,
                quaternions(seen.iter().map(|c| c.orientation)),
            ),
            field("velocity", "m/s", all(|c| c.velocity)),
            field("spin", "rad/s", all(|c| c.spin)),
            field("angular_momentum", "kg m^2/s", all(|c| c.angular_momentum)),
            field("force", "N", all(|c| c.force)),
        ],
    }
}
