//! `steps.csv`: what every step of a continuum run did, and how far it ended from solving its equations.

use crate::table::Table;
use colluvium_continuum::flow::StepRecord;
use colluvium_continuum::free_surface::SurfaceStep;
use colluvium_continuum::units::Units;
use colluvium_continuum::yield_step::Residuals;
use colluvium_dem::Record;

/// The rows in a checkpoint.
const ROWS: &str = "course/step_rows";

/// Columns and units.
const COLUMNS: [(&str, &str); 10] = [
    ("t", "s"),
    ("dt", "s"),
    ("iterations", "1"),
    ("halvings", "1"),
    ("momentum_residual", "1"),
    ("divergence_residual", "1"),
    ("stress_residual", "1"),
    ("strain_rate_floor", "1/s"),
    ("largest_speed", "m/s"),
    ("volume_error", "1"),
];

/// Columns that layers have too, which neither lose volume nor have a surface that moves.
const OF_LAYERS: usize = 8;

/// The steps that were accepted, one after the other: residuals of momentum over gravity, of the divergence over
/// √(gravity/height), of the stress relative; iterations and halvings with those of failed attempts.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct StepTable {
    rows: Vec<[f64; COLUMNS.len()]>,
}

impl StepTable {
    fn put(
        &mut self,
        [time, dt]: [f64; 2],
        [iterations, halvings]: [usize; 2],
        residuals: &Residuals,
        units: &Units,
        [speed, volume_error]: [f64; 2],
    ) {
        self.rows.push([
            time,
            dt,
            iterations as f64,
            halvings as f64,
            residuals.momentum,
            residuals.divergence,
            residuals.stress,
            residuals.strain_rate_floor / units.time(),
            speed,
            volume_error,
        ]);
    }

    /// Takes down a step of a flow with a moving surface, and the volume gained since the start.
    pub fn book(&mut self, step: &SurfaceStep, units: &Units, volume_error: f64) {
        self.put(
            [step.time, step.dt].map(|t| t * units.time()),
            [step.newton_iterations, step.cuts],
            &step.residuals,
            units,
            [step.max_speed * units.velocity, volume_error],
        );
    }

    /// Takes down a step of a layer, in natural units.
    pub fn book_layer(&mut self, step: &StepRecord, units: &Units) {
        self.put(
            [step.time, step.dt].map(|t| t * units.time()),
            [step.newton_iterations, step.cuts],
            &step.residuals,
            units,
            [f64::NAN; 2],
        );
    }

    /// The table.
    pub fn table(&self) -> Table {
        let is_layer = self.rows.iter().all(|row| row[OF_LAYERS].is_nan());
        let columns = if is_layer { OF_LAYERS } else { COLUMNS.len() };
        let named = COLUMNS.iter().enumerate().take(columns);
        named.fold(Table::new("steps"), |table, (n, (name, unit))| {
            table.with(name, unit, self.rows.iter().map(|row| row[n]).collect())
        })
    }

    pub fn put_into(&self, record: &mut Record) {
        let rows = self.rows.as_flattened().to_vec();
        record.numbers.insert(ROWS.into(), rows);
    }

    pub fn of(record: &Record) -> Option<Self> {
        let (rows, rest) = record.numbers.get(ROWS)?.as_chunks();
        rest.is_empty().then(|| Self {
            rows: rows.to_vec(),
        })
    }
}
