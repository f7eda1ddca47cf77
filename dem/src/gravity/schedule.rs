//! Uniform gravity that changes with time.

use crate::setup::{SetupError, check};
use nalgebra::Vector3;

/// Gravity at rising times, straight lines between them; before the first and after the last it stays.
///
/// A box that is tilted is a box that rests while gravity turns, as long as it is tilted slowly.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule(Vec<(f64, Vector3<f64>)>);

impl Schedule {
    /// A schedule from times (s) and gravities (m/s²).
    ///
    /// # Errors
    /// If there is none, a number is not finite, or times do not rise.
    pub fn new(points: Vec<(f64, Vector3<f64>)>) -> Result<Schedule, SetupError> {
        let count = points.len() as f64;
        check("gravity.schedule, points", count, "at least 1", |n| n > 0.0)?;
        let mut last = f64::NEG_INFINITY;
        for (k, (time, gravity)) in points.iter().enumerate() {
            let key = format!("gravity.schedule[{k}].time");
            check(&key, *time, "above the one before", |t| t > last)?;
            last = *time;
            let key = format!("gravity.schedule[{k}].gravity");
            for g in gravity.iter() {
                check(&key, *g, "finite, m/s²", |_| true)?;
            }
        }
        Ok(Schedule(points))
    }

    /// Gravity at a time (m/s²).
    pub fn at(&self, time: f64) -> Vector3<f64> {
        let after = self.0.partition_point(|(t, _)| *t <= time);
        match (after.checked_sub(1).map(|k| self.0[k]), self.0.get(after)) {
            (Some((from, a)), Some((to, b))) => a + (b - a) * ((time - from) / (to - from)),
            (Some((_, only)), None) => only,
            (None, Some((_, only))) => *only,
            (None, None) => Vector3::zeros(),
        }
    }

    /// All numbers, four a point, for a checkpoint.
    pub(super) fn numbers(&self) -> Vec<f64> {
        let rows = self.0.iter().flat_map(|(t, g)| [*t, g.x, g.y, g.z]);
        rows.collect()
    }

    /// The schedule of a checkpoint; none where there was none.
    pub(super) fn from_numbers(numbers: &[f64]) -> Result<Option<Schedule>, String> {
        let (rows, []) = numbers.as_chunks::<4>() else {
            return Err("array `gravity/schedule` must have 4 numbers a point".into());
        };
        if rows.is_empty() {
            return Ok(None);
        }
        let points = rows.iter().map(|&[t, x, y, z]| (t, Vector3::new(x, y, z)));
        let schedule = Schedule::new(points.collect());
        schedule.map(Some).map_err(|e| e.to_string())
    }
}
