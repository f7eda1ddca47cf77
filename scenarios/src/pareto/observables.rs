//! What runs are compared by, scene by scene.

use crate::failure::Failure;
use crate::report;
use crate::scene::{Scene, SceneBody};
use crate::table::Table;
use std::path::Path;

/// Relative errors by the observables' names.
pub type Errors = Vec<(String, f64)>;

/// Results of a bed that are compared at its end.
const OF_A_BED: [&str; 3] = ["centre_of_mass_height", "solid_fraction", "coordination"];

/// Relative errors of a run against another.
pub fn errors(scene: &Scene, run: &Path, reference: &Path) -> Result<Errors, Failure> {
    Ok(match scene.body {
        SceneBody::Chute(_) | SceneBody::Settle(_) => {
            let mut errors = vec![("kinetic_energy".to_owned(), curve(run, reference, ENERGY))];
            for name in OF_A_BED {
                errors.push((name.to_owned(), result(run, reference, name)?));
            }
            errors
        }
        SceneBody::Impact(_) => vec![(
            "restitution".to_owned(),
            result(run, reference, "restitution")?,
        )],
        SceneBody::Collapse(_) => vec![
            ("deposit".to_owned(), curve(run, reference, DEPOSIT)),
            ("front".to_owned(), result(run, reference, "x_front")?),
        ],
        SceneBody::Incline(_) | SceneBody::Bagnold(_) => {
            vec![("velocity".to_owned(), curve(run, reference, PROFILE))]
        }
    })
}

/// What the error is, in words.
pub fn against_reference(scene: &Scene) -> String {
    match scene.body {
        SceneBody::Chute(_) | SceneBody::Settle(_) => {
            "the reference run; largest relative error of kinetic energy (L2 over the time of the run), height of the centre of mass, solid fraction and coordination at the end".to_owned()
        }
        SceneBody::Collapse(_) => {
            "the reference run; the larger of the relative L2 error of the deposit's height and the relative error of the front".to_owned()
        }
        _ => "the reference run".to_owned(),
    }
}

/// A curve in a table: its file, argument and value.
type Curve = [&'static str; 3];

const ENERGY: Curve = ["energy.csv", "t", "kinetic_energy"];
const DEPOSIT: Curve = ["deposit.csv", "x", "h"];
const PROFILE: Curve = ["profile.csv", "z", "u"];

/// Relative L2 difference of a curve, at the run's own points; NaN where one has none.
fn curve(run: &Path, reference: &Path, [file, x, y]: Curve) -> f64 {
    let points = |path: &Path| {
        Table::from_csv(&path.join(file)).map_or(Vec::new(), |table| table.pairs(x, y))
    };
    let right = points(reference);
    let mut miss = 0.0;
    let mut size = 0.0;
    for (x, y) in points(run) {
        if let Some(right) = interpolate(&right, x) {
            miss += (y - right) * (y - right);
            size += right * right;
        }
    }
    (miss / size).sqrt()
}

/// Relative difference of a result; NaN where one has none.
fn result(run: &Path, reference: &Path, name: &str) -> Result<f64, Failure> {
    let value = |path: &Path| -> Result<f64, Failure> {
        let summary = report::read_summary(path)?;
        let value = summary.results.get(name).and_then(|q| q.value);
        Ok(value.unwrap_or(f64::NAN))
    };
    let right = value(reference)?;
    Ok((value(run)? - right).abs() / right.abs())
}

/// Linear interpolation in points of rising x; none outside of them.
fn interpolate(points: &[(f64, f64)], x: f64) -> Option<f64> {
    let after = points.iter().position(|p| p.0 >= x)?;
    let (x1, y1) = points[after];
    if x1 == x {
        return Some(y1);
    }
    let (x0, y0) = *points.get(after.checked_sub(1)?)?;
    Some(y0 + (y1 - y0) * (x - x0) / (x1 - x0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_does_not_go_beyond_its_points() {
        let points = [(0.0, 0.0), (1.0, 2.0)];
        assert_eq!(interpolate(&points, 0.25), Some(0.5));
        assert_eq!(interpolate(&points, 1.5), None);
        assert_eq!(interpolate(&points, -0.5), None);
    }
}
