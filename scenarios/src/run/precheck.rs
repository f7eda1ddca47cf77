//! What can be wrong with an incline or a campaign, found before anything is written.

use super::{continuum_incline, incline, joined_incline, step};
use crate::failure::Failure;
use crate::scene::{InclineModel, InclineScene, Scene, SceneError};
use colluvium_coupling::campaign::{CampaignError, CampaignSpec};
use colluvium_coupling::incline::{InclineError, InclineRun};
use colluvium_dem::preparation::{Bed, BedReport};
use colluvium_dem::{Domain, Grain, Threads};
use nalgebra::Vector3;

/// Solid fraction looser than any bed, so that the stand-in is at least as high as the real one.
const LOOSEST: f64 = 0.4;

/// A bed of one grain where the top of the settled bed would be at most: enough to check box, law
/// and times with, without settling anything.
pub fn stand_in_bed(scene: &InclineScene) -> Bed {
    let [length, width] = scene.floor_edges();
    let d = scene.grains.diameter;
    let volume = scene.free_grains() as f64 * scene.mean_mass() / scene.grains.density;
    let height = volume / (LOOSEST * length * width);
    let at = Vector3::new(0.5 * length, 0.5 * width, height.max(d));
    Bed {
        domain: Domain {
            lower: Vector3::new(0.0, 0.0, -d),
            upper: Vector3::new(length, width, height + 10.0 * d),
            periodic: [true, true, false],
        },
        grains: vec![Grain::at_rest(at, 0.5 * d, scene.grains.density)],
        report: BedReport::default(),
    }
}

/// Checks the run of an incline.
pub fn incline(scene: &Scene, body: &InclineScene) -> Result<(), Failure> {
    let bed = incline::bed(body);
    let plain =
        |error: colluvium_dem::SetupError| Failure::Input(format!("{}: {error}", scene.origin));
    bed.radius.validate().map_err(plain)?;
    bed.law.validate().map_err(plain)?;
    let step = incline::step(body);
    let safety = body.timestep.safety;
    step::check(scene, &step, step.seconds, "timestep.safety", safety)?;
    let spec = incline::spec(body, &stand_in_bed(body), Threads::Serial);
    if let Err(error) = InclineRun::new(spec) {
        return Err(explain(scene, error));
    }
    match body.model {
        InclineModel::Dem => Ok(()),
        InclineModel::Continuum => continuum_incline::check(scene, body),
        InclineModel::Hybrid => joined_incline::check(scene, body),
    }
}

/// Checks a campaign.
pub fn campaign(scene: &Scene, spec: &CampaignSpec) -> Result<(), Failure> {
    match spec.validate() {
        Ok(()) => Ok(()),
        Err(CampaignError::OutOfRange {
            key,
            value,
            allowed,
        }) => Err(refused(scene, campaign_key(key), value, allowed).into()),
        Err(CampaignError::Run(error)) => Err(explain(scene, error)),
        Err(error) => Err(Failure::Input(format!("{}: {error}", scene.origin))),
    }
}

/// An error of a run in the words of the scene.
pub(super) fn explain(scene: &Scene, error: InclineError) -> Failure {
    match error {
        InclineError::OutOfRange {
            key,
            value,
            allowed,
        } => refused(scene, incline_key(key), value, allowed).into(),
        error => Failure::Input(format!("{}: {error}", scene.origin)),
    }
}

fn refused(scene: &Scene, key: String, value: f64, allowed: impl ToString) -> SceneError {
    scene.out_of_range(&key, value, &allowed.to_string())
}

/// The scene's key for a key of a campaign.
fn campaign_key(key: &str) -> String {
    if let Some(rest) = key.strip_prefix("guessed_law.") {
        return format!("calibration.guess.{rest}");
    }
    let own = key.replace("flow_angles_degrees", "flow_degrees");
    format!("calibration.{own}")
}

/// The scene's key for a key of a run.
fn incline_key(key: &str) -> String {
    match key {
        "diameter" => "grains.diameter",
        "grain_density" => "grains.density",
        "grains" => "grains.count",
        "timestep" => "timestep.steps_per_contact (as a step in s)",
        "relax_time" => "time.relax",
        "average_time" => "time.average",
        "max_time" => "time.limit",
        "sample_every" => "time.sample_every (in steps)",
        "layer" => "time.layer_diameters (as a length in m)",
        "steady_tolerance" => "time.steady_tolerance",
        "start.inertial_number" => "start_inertial_number",
        other => other,
    }
    .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_the_scenes_own() {
        assert_eq!(
            campaign_key("flow_angles_degrees"),
            "calibration.flow_degrees"
        );
        assert_eq!(campaign_key("stop.low"), "calibration.stop.low");
        assert_eq!(campaign_key("guessed_law.mu_2"), "calibration.guess.mu_2");
        assert_eq!(incline_key("max_time"), "time.limit");
        assert_eq!(incline_key("slope_degrees"), "slope_degrees");
    }
}
