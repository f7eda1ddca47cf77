//! Rows of `energy.csv`: the state of a bed at an instant, and with the ledger what has come of its
//! energy since the start.

use crate::table::Table;
use colluvium_dem::{Record, Simulation, Snapshot};

/// Columns of every bed with their units.
const STATE: [(&str, &str); 13] = [
    ("t", "s"),
    ("step", "1"),
    ("translation", "J"),
    ("rotation", "J"),
    ("kinetic_energy", "J"),
    ("normal", "J"),
    ("tangential", "J"),
    ("rolling", "J"),
    ("twisting", "J"),
    ("cohesion", "J"),
    ("height", "m"),
    ("velocity", "m/s"),
    ("contacts", "1"),
];

/// Columns of the ledger: work of gravity, heat by channel of the contacts, what is not accounted for
/// over the largest entry.
const LEDGER: [(&str, &str); 6] = [
    ("gravity_work", "J"),
    ("normal_loss", "J"),
    ("tangential_loss", "J"),
    ("rolling_loss", "J"),
    ("twisting_loss", "J"),
    ("ledger_error", "1"),
];

/// Name of the rows in a checkpoint.
const SAVED: &str = "watch/rows";

/// The rows so far.
#[derive(Clone, Debug)]
pub struct EnergyTable {
    floor: f64,
    columns: Vec<(&'static str, &'static str)>,
    rows: Vec<Vec<f64>>,
}

impl EnergyTable {
    /// No rows yet; heights are above `floor` (m).
    pub fn new(floor: f64, ledger: bool) -> EnergyTable {
        let more: &[_] = if ledger { &LEDGER } else { &[] };
        EnergyTable {
            floor,
            columns: [&STATE, more].concat(),
            rows: Vec::new(),
        }
    }

    /// The rows of a checkpoint.
    pub fn restore(&mut self, record: &Record) -> Result<(), String> {
        let (flat, width) = (record.numbers(SAVED)?, self.columns.len());
        if !flat.len().is_multiple_of(width) {
            return Err(format!("array `{SAVED}` must have rows of {width} numbers"));
        }
        self.rows = flat.chunks(width).map(<[f64]>::to_vec).collect();
        Ok(())
    }

    /// Adds the rows to a checkpoint.
    pub fn save(&self, record: &mut Record) {
        let flat = self.rows.iter().flatten().copied().collect();
        record.numbers.insert(SAVED.into(), flat);
    }

    /// Adds the row of this instant.
    pub fn look(&mut self, simulation: &mut Simulation, snapshot: &mut Snapshot) {
        simulation.snapshot(snapshot);
        let energy = simulation.energy();
        let mut mass = 0.0;
        let (mut height, mut velocity) = (0.0, 0.0);
        for grain in snapshot.grains.iter().filter(|g| !g.fixed) {
            mass += grain.mass;
            height += grain.mass * grain.position.z;
            velocity += grain.mass * grain.velocity.x;
        }
        let mut row = vec![
            simulation.time(),
            simulation.steps_done() as f64,
            energy.translation,
            energy.rotation,
            energy.kinetic(),
            energy.normal,
            energy.tangential,
            energy.rolling,
            energy.twisting,
            energy.cohesion,
            height / mass - self.floor,
            velocity / mass,
            snapshot.contacts.len() as f64,
        ];
        if let Some(ledger) = simulation.energy_ledger() {
            let lost = ledger.dissipated();
            let booked = [
                ledger.gravity,
                lost.normal,
                lost.tangential,
                lost.rolling,
                lost.twisting,
                ledger.error(),
            ];
            // A channel that nothing went through is 0, not -0.
            row.extend(booked.map(|x| x + 0.0));
        }
        self.rows.push(row);
    }

    /// The last value of a column.
    pub fn last(&self, name: &str) -> f64 {
        let column = self.columns.iter().position(|(known, _)| *known == name);
        let last = column.and_then(|n| self.rows.last()?.get(n).copied());
        last.unwrap_or(f64::NAN)
    }

    /// Names of the ledger's columns of energy, if they are there.
    pub fn ledger(&self) -> impl Iterator<Item = &'static str> {
        let booked = self.columns[STATE.len()..].iter();
        booked
            .filter(|(_, unit)| *unit == "J")
            .map(|(name, _)| *name)
    }

    /// The table.
    pub fn table(&self) -> Table {
        let table = Table::new("energy");
        let columns = self.columns.iter().enumerate();
        columns.fold(table, |table, (n, (name, unit))| {
            let values = self.rows.iter().map(|row| row[n]).collect();
            table.with(name, unit, values)
        })
    }
}
