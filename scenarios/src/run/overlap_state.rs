//! What the monitors of an overlap say of temperature and energy, for the summary.

use crate::summary::{Quantity, Summary};

/// Granular temperatures through an overlap (buffer, inner overlap, grains beyond it; m²/s²), and the work on the grains of
/// traction, impedance and relaxation (J), which is negative where they take energy.
pub(super) fn put(temperatures: [f64; 3], work: [f64; 3], summary: &mut Summary) {
    let zones = [
        ("buffer_temperature", "of the grains in the buffer"),
        ("inner_temperature", "of the grains in the inner overlap"),
        (
            "beyond_temperature",
            "of the grains beyond the overlap, up to the width of the inner one",
        ),
    ];
    for ((name, of), value) in zones.into_iter().zip(temperatures) {
        let source = format!("granular temperature {of}, mean in time");
        summary.put(name, Quantity::new(value, "m²/s²").from(&source));
    }
    let names = ["traction_J", "impedance_J", "relaxation_J"];
    for (name, value) in names.into_iter().zip(work) {
        summary.ledger.energy.insert(name.into(), value);
    }
}
