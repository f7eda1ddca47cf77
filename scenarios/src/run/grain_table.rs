//! The grains at the end of a run, as a table.

use crate::table::Table;
use colluvium_dem::{GrainSample, Snapshot};

/// Every grain of a snapshot, in the order of their numbers.
pub fn of(snapshot: &Snapshot) -> Table {
    let mut grains: Vec<&GrainSample> = snapshot.grains.iter().collect();
    grains.sort_by_key(|g| g.id);
    let mut table = Table::new("grains")
        .with("id", "1", grains.iter().map(|g| f64::from(g.id)).collect())
        .with(
            "fixed",
            "1",
            grains
                .iter()
                .map(|g| f64::from(u8::from(g.fixed)))
                .collect(),
        )
        .with("radius", "m", grains.iter().map(|g| g.radius).collect());
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        table = table
            .with(name, "m", grains.iter().map(|g| g.position[axis]).collect())
            .with(
                &format!("v{name}"),
                "m/s",
                grains.iter().map(|g| g.velocity[axis]).collect(),
            )
            .with(
                &format!("w{name}"),
                "rad/s",
                grains.iter().map(|g| g.spin[axis]).collect(),
            );
    }
    table
}
