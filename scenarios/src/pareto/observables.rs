//! What runs are compared by, scene by scene.

use crate::calibrate::RHEOLOGY;
use crate::failure::Failure;
use crate::report;
use crate::rheology_file::RheologyFile;
use crate::scene::{Scene, SceneBody};
use crate::table::Table;
use colluvium_coupling::calibration::mu_of_i;
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
        SceneBody::Grains(ref kind) => {
            let names = kind.recipe().compared();
            let error = |name: &str| Ok((name.to_owned(), result(run, reference, name)?));
            names
                .into_iter()
                .map(error)
                .collect::<Result<_, Failure>>()?
        }
        SceneBody::Impact(_) => vec![(
            "restitution".to_owned(),
            result(run, reference, "restitution")?,
        )],
        SceneBody::Collapse(_) => vec![
            ("deposit".to_owned(), curve(run, reference, DEPOSIT)),
            ("front".to_owned(), result(run, reference, "x_front")?),
        ],
        SceneBody::Cylinder(_) => {
            vec![("front".to_owned(), result(run, reference, "runout_scaled")?)]
        }
        SceneBody::OpenChute(_) => vec![
            ("velocity".to_owned(), curve(run, reference, SPEEDS)),
            ("depth".to_owned(), result(run, reference, "depth_at_end")?),
        ],
        SceneBody::SiloDischarge(_) => vec![("rate".to_owned(), result(run, reference, "rate")?)],
        SceneBody::Incline(ref body) if body.rheology.is_some() => [
            ("velocity", "u"),
            ("normal_stress", "sigma_zz"),
            ("shear_stress", "tau"),
        ]
        .map(|(name, column)| {
            let [file, z, _] = PROFILE;
            (name.to_owned(), curve(run, reference, [file, z, column]))
        })
        .to_vec(),
        SceneBody::Incline(_) | SceneBody::Bagnold(_) | SceneBody::Sheared(_) => {
            vec![("velocity".to_owned(), curve(run, reference, PROFILE))]
        }
    })
}

/// Errors that are told beside the others: a fit may move μ_s, μ_2 and I_0 along a line on which μ(I) hardly changes.
pub const TOLD: [&str; 3] = ["mu_s", "mu_2", "i_0"];

/// Relative errors of a campaign against another: of the fitted friction, largest over the inertial numbers that both
/// measured, of its parameters, and, where the reference sought them, of the slopes where flow stops and sets off. NaN where
/// one has none.
pub fn of_campaigns(run: &Path, reference: &Path) -> Result<Errors, Failure> {
    let laws = [run, reference].map(|path| RheologyFile::read(&path.join(RHEOLOGY)).ok());
    let friction = match &laws {
        [Some(ours), Some(theirs)] => friction_error(ours, theirs),
        _ => f64::NAN,
    };
    let mut errors = vec![("friction".to_owned(), friction)];
    for name in TOLD {
        errors.push((name.to_owned(), result(run, reference, name)?));
    }
    let sought = report::read_summary(reference)?.results;
    for name in ["stop", "onset"] {
        if sought.contains_key(name) {
            errors.push((name.to_owned(), result(run, reference, name)?));
        }
    }
    Ok(errors)
}

fn friction_error(ours: &RheologyFile, theirs: &RheologyFile) -> f64 {
    let (Some(a), Some(b)) = (ours.valid_i, theirs.valid_i) else {
        return f64::NAN;
    };
    let (low, high) = (a[0].max(b[0]), a[1].min(b[1]));
    if low <= 0.0 || low >= high {
        return f64::NAN;
    }
    let friction = |law: &RheologyFile, i: f64| mu_of_i(law.mu_s, law.mu_2, law.i_0, i);
    (0..=32)
        .map(|k| low * (high / low).powf(f64::from(k) / 32.0))
        .map(|i| (friction(ours, i) / friction(theirs, i) - 1.0).abs())
        .fold(0.0, f64::max)
}

/// What the error is, in words.
pub fn against_reference(scene: &Scene) -> String {
    match &scene.body {
        SceneBody::Grains(kind) => format!(
            "the reference run; largest relative error of {}",
            kind.recipe().compared().join(", ")
        ),
        SceneBody::Chute(_) | SceneBody::Settle(_) => {
            "the reference run; largest relative error of kinetic energy (L2 over the time of the run), height of the centre of mass, solid fraction and coordination at the end".to_owned()
        }
        SceneBody::Collapse(_) => {
            "the reference run; the larger of the relative L2 error of the deposit's height and the relative error of the front".to_owned()
        }
        SceneBody::Cylinder(_) => {
            "the reference run; relative error of the run-out".to_owned()
        }
        SceneBody::OpenChute(_) => {
            "the reference run; the larger of the relative L2 error of the speeds half way down and the relative error of the depth at the open end".to_owned()
        }
        SceneBody::SiloDischarge(_) => {
            "the reference run; relative error of the steady rate".to_owned()
        }
        SceneBody::Incline(body) if body.rheology.is_some() => {
            "the reference run; largest relative L2 error through the depth of velocity, normal and shear stress".to_owned()
        }
        _ => "the reference run".to_owned(),
    }
}

/// A curve in a table: its file, argument and value.
type Curve = [&'static str; 3];

const ENERGY: Curve = ["energy.csv", "t", "kinetic_energy"];
const SPEEDS: Curve = ["speeds.csv", "z", "u"];
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
    fn laws_are_compared_where_both_were_measured() {
        let law = |mu_s: f64, low: f64, high: f64| -> RheologyFile {
            let text = format!(
                "mu_s = {mu_s}\nmu_2 = 0.9\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.5\nvalid_i = [{low}, {high}]\n"
            );
            toml::from_str(&text).unwrap()
        };
        assert_eq!(
            friction_error(&law(0.4, 0.1, 0.5), &law(0.4, 0.2, 0.9)),
            0.0
        );
        // Furthest apart at the lowest common I, 0.2: 0.624 against 0.6.
        let error = friction_error(&law(0.44, 0.1, 0.5), &law(0.4, 0.2, 0.9));
        assert!((error - 0.04).abs() < 1e-12, "{error}");
        assert!(friction_error(&law(0.4, 0.1, 0.2), &law(0.4, 0.3, 0.9)).is_nan());
    }

    #[test]
    fn interpolation_does_not_go_beyond_its_points() {
        let points = [(0.0, 0.0), (1.0, 2.0)];
        assert_eq!(interpolate(&points, 0.25), Some(0.5));
        assert_eq!(interpolate(&points, 1.5), None);
        assert_eq!(interpolate(&points, -0.5), None);
    }
}
