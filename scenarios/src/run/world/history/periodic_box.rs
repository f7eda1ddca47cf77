//! Columns of a box without sides, or of one that moves: how large it is and what it bears.

use colluvium_dem::{BoxMotion, Simulation};

use super::super::build::Stand;

/// Lengths of the edges, and the mean stress of the box at the instant, positive in tension: `xz` is force along x across
/// z, which is what shear along x works with. Soft grains with friction have a stress that is not quite symmetric.
const COLUMNS: [(&str, &str); 9] = [
    ("box_length_x", "m"),
    ("box_length_y", "m"),
    ("box_length_z", "m"),
    ("box_stress_xx", "Pa"),
    ("box_stress_yy", "Pa"),
    ("box_stress_zz", "Pa"),
    ("box_stress_yz", "Pa"),
    ("box_stress_xz", "Pa"),
    ("box_stress_xy", "Pa"),
];

/// Whether a run has such a box: walls would bear some of its stress.
pub fn stands(stand: &Stand) -> bool {
    let all_around = stand.setup.domain.periodic == [true; 3] && stand.world.walls.is_empty();
    all_around || stand.world.box_motion != BoxMotion::Rest
}

/// Names of the columns, with units.
pub fn columns() -> Vec<(String, &'static str)> {
    COLUMNS.map(|(name, unit)| (name.to_owned(), unit)).to_vec()
}

/// Adds the values of this instant to a row.
pub fn look(simulation: &mut Simulation, row: &mut Vec<f64>) {
    let stress = simulation.stress();
    row.extend(simulation.domain().lengths().iter());
    let parts = [
        stress.m11, stress.m22, stress.m33, stress.m23, stress.m13, stress.m12,
    ];
    row.extend(parts.map(|x| x + 0.0));
}
