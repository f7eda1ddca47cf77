//! Rows of `history.csv`: the whole of the grains in time, what walls and bodies have taken since the row before,
//! the periodic box, what the scene's own recipe looks at.

mod periodic_box;
mod walls;

use super::build::Stand;
use super::recipe::Recipe;
use crate::table::Table;
use colluvium_dem::{Record, Simulation, Snapshot, Wall};
use nalgebra::Vector3;

/// Columns of every scene.
const STATE: [(&str, &str); 16] = [
    ("t", "s"),
    ("step", "1"),
    ("grains", "1"),
    ("translation", "J"),
    ("rotation", "J"),
    ("elastic", "J"),
    ("x", "m"),
    ("y", "m"),
    ("z", "m"),
    ("vx", "m/s"),
    ("vy", "m/s"),
    ("vz", "m/s"),
    ("contacts", "1"),
    ("largest_overlap", "R"),
    ("bonds", "1"),
    ("broken_bonds", "1"),
];

/// Columns of a body: its centre of mass, velocity and spin, the quaternion of its own axes, and the mean
/// force and torque about its centre of mass (free), hinge or own origin since the row before.
const BODY: [(&str, &str); 19] = [
    ("x", "m"),
    ("y", "m"),
    ("z", "m"),
    ("vx", "m/s"),
    ("vy", "m/s"),
    ("vz", "m/s"),
    ("wx", "rad/s"),
    ("wy", "rad/s"),
    ("wz", "rad/s"),
    ("q0", "1"),
    ("q1", "1"),
    ("q2", "1"),
    ("q3", "1"),
    ("fx", "N"),
    ("fy", "N"),
    ("fz", "N"),
    ("tx", "N m"),
    ("ty", "N m"),
    ("tz", "N m"),
];

/// Columns of the ledger: heat of the contacts, work since the start (of walls and grains that move as they are told;
/// of a periodic box that moves; of uniform gravity; of fields of gravity; of steady loads; of bonds, what they store
/// counted against it), and what is not accounted for.
const LEDGER: [(&str, &str); 11] = [
    ("normal_loss", "J"),
    ("tangential_loss", "J"),
    ("rolling_loss", "J"),
    ("twisting_loss", "J"),
    ("drive_work", "J"),
    ("box_work", "J"),
    ("gravity_work", "J"),
    ("field_work", "J"),
    ("load_work", "J"),
    ("bond_work", "J"),
    ("ledger_error", "1"),
];

/// Name of the rows in a checkpoint.
const SAVED: &str = "history/rows";

/// The rows so far.
#[derive(Clone, Debug)]
pub struct History {
    columns: Vec<(String, &'static str)>,
    walls: Vec<(String, Wall)>,
    in_box: bool,
    ledger: bool,
    rows: Vec<Vec<f64>>,
}

impl History {
    /// No rows yet.
    pub fn new(stand: &Stand, recipe: &dyn Recipe) -> History {
        let (world, ledger) = (&stand.world, recipe.keys().output.ledger);
        let named = |list: &[(&str, &'static str)]| -> Vec<(String, &'static str)> {
            list.iter().map(|(n, u)| ((*n).to_owned(), *u)).collect()
        };
        let mut columns = named(&STATE);
        if ledger {
            columns.extend(named(&LEDGER));
        }
        let in_box = periodic_box::stands(stand);
        if in_box {
            columns.extend(periodic_box::columns());
        }
        columns.extend(walls::columns(&world.walls));
        for (name, _) in &world.bodies {
            columns.extend(BODY.map(|(column, unit)| (format!("{name}_{column}"), unit)));
        }
        columns.extend(recipe.columns());
        History {
            columns,
            walls: world.walls.clone(),
            in_box,
            ledger,
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

    /// Adds the row of this instant; forces on walls and bodies are means since the row before.
    pub fn look(
        &mut self,
        recipe: &dyn Recipe,
        simulation: &mut Simulation,
        seen: &mut Snapshot,
        state: &[f64],
    ) {
        simulation.snapshot(seen);
        let energy = simulation.energy();
        let bonds = simulation.bond_count();
        let mut mass = 0.0;
        let (mut place, mut velocity) = (Vector3::zeros(), Vector3::zeros());
        for grain in seen.grains.iter().filter(|g| !g.fixed) {
            mass += grain.mass;
            place += grain.mass * grain.position;
            velocity += grain.mass * grain.velocity;
        }
        if mass > 0.0 {
            (place, velocity) = (place / mass, velocity / mass);
        }
        let mut row = vec![
            simulation.time(),
            simulation.steps_done() as f64,
            seen.grains.len() as f64,
            energy.translation,
            energy.rotation,
            energy.elastic(),
            place.x,
            place.y,
            place.z,
            velocity.x,
            velocity.y,
            velocity.z,
            seen.contacts.len() as f64,
            simulation.largest_overlap(),
            bonds.whole as f64,
            (bonds.torn + bonds.sheared) as f64,
        ];
        if self.ledger {
            let booked = simulation.energy_ledger().map_or([f64::NAN; 11], |ledger| {
                let lost = ledger.dissipated();
                [
                    lost.normal,
                    lost.tangential,
                    lost.rolling,
                    lost.twisting,
                    ledger.drive,
                    ledger.boundary,
                    ledger.gravity,
                    ledger.fields.work,
                    ledger.loads,
                    ledger.bonds.work,
                    ledger.error(),
                ]
            });
            // A channel that nothing went through is 0, not -0.
            row.extend(booked.map(|x| x + 0.0));
        }
        if self.in_box {
            periodic_box::look(simulation, &mut row);
        }
        walls::look(&self.walls, simulation, &mut row);
        for (body, sample) in seen.bodies.iter().enumerate() {
            let taken = simulation.body_taken(body);
            let mean = |sum: Vector3<f64>, now: Vector3<f64>| {
                if taken.duration > 0.0 {
                    sum / taken.duration
                } else {
                    now
                }
            };
            let loads = [
                mean(taken.impulse, sample.force),
                mean(taken.angular, sample.torque),
            ];
            simulation.forget_body_taken(body);
            let q = sample.pose.orientation.quaternion();
            for v in [&sample.centre, &sample.velocity, &sample.spin] {
                row.extend(v.iter());
            }
            row.extend([q.w, q.i, q.j, q.k]);
            row.extend(loads.iter().flatten().map(|f| f + 0.0));
        }
        row.extend(recipe.look(simulation, seen, state));
        self.rows.push(row);
    }

    /// The table.
    pub fn table(&self) -> Table {
        let columns = self.columns.iter().enumerate();
        columns.fold(Table::new("history"), |table, (n, (name, unit))| {
            let value = |row: &Vec<f64>| row.get(n).copied().unwrap_or(f64::NAN);
            table.with(name, unit, self.rows.iter().map(value).collect())
        })
    }
}
