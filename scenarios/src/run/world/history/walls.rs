//! Columns of walls: what they have taken since the row before, and where those that move are.

use colluvium_dem::{Motion, Simulation, Wall};
use nalgebra::Vector3;

/// Columns of every wall: mean force and torque since the row before, and their integrals over that time.
/// Torques are about the wall's origin, where it is at each instant.
const TAKEN: [(&str, &str); 12] = [
    ("fx", "N"),
    ("fy", "N"),
    ("fz", "N"),
    ("tx", "N m"),
    ("ty", "N m"),
    ("tz", "N m"),
    ("jx", "N s"),
    ("jy", "N s"),
    ("jz", "N s"),
    ("lx", "N m s"),
    ("ly", "N m s"),
    ("lz", "N m s"),
];

/// Columns of a wall that moves: where its origin is.
const PLACE: [(&str, &str); 3] = [("x", "m"), ("y", "m"), ("z", "m")];

/// Names of the columns, with units.
pub fn columns(walls: &[(String, Wall)]) -> Vec<(String, &'static str)> {
    let of = |(name, wall): &(String, Wall)| {
        let place = if moves(wall) { &PLACE[..] } else { &[] };
        let named = TAKEN.iter().chain(place);
        let columns: Vec<_> = named
            .map(|(c, unit)| (format!("{name}_{c}"), *unit))
            .collect();
        columns
    };
    walls.iter().flat_map(of).collect()
}

/// Adds the values of this instant to a row; a new interval begins.
pub fn look(walls: &[(String, Wall)], simulation: &mut Simulation, row: &mut Vec<f64>) {
    for (k, (_, wall)) in walls.iter().enumerate() {
        let taken = simulation.wall_taken(k);
        let means = if taken.duration > 0.0 {
            [taken.impulse, taken.angular].map(|sum| sum / taken.duration)
        } else {
            let load = simulation.wall_load(k);
            [load.force, load.torque]
        };
        simulation.forget_wall_taken(k);
        let both = means.iter().chain([&taken.impulse, &taken.angular]);
        // What nothing pushed is 0, not -0.
        row.extend(both.flat_map(Vector3::iter).map(|x| x + 0.0));
        if moves(wall) {
            row.extend(simulation.wall_pose(k).position.iter());
        }
    }
}

fn moves(wall: &Wall) -> bool {
    wall.motion != Motion::Fixed
}
