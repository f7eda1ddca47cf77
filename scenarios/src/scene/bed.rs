//! What the two scenes of a bed of grains, `chute` and `settle`, have in common.

use super::SceneError;

/// Most steps of a run.
const MOST_STEPS: f64 = 1.0e9;
/// Most grains of a run: about 20 GB of memory.
const MOST_GRAINS: f64 = 2.0e7;

/// Keys of which exactly one gives the length of a run.
pub const LENGTH: &[&str] = &["steps", "duration"];

/// How long a bed runs, and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Step (s): the scene's `timestep`, times the parcels' size.
    pub timestep: f64,
    /// Steps of the run.
    pub steps: u64,
    /// Steps between two rows of `energy.csv`.
    pub record_every: u64,
    /// Instants in `grains.vtkhdf` and `contacts.vtkhdf` besides the start; none writes no files.
    pub frames: u64,
}

impl Pace {
    /// From the keys `timestep`, `coarse_graining`, `steps` or `duration`, `record_every` and `frames`.
    pub fn of(
        timestep: f64,
        coarse_graining: f64,
        steps: Option<u64>,
        duration: Option<f64>,
        [record_every, frames]: [u64; 2],
    ) -> Pace {
        let timestep = timestep * coarse_graining;
        let wanted = match (steps, duration) {
            (Some(steps), _) => steps,
            // A duration is a number of steps that a division may miss by a bit.
            (None, duration) => (duration.unwrap_or_default() / timestep - 1e-6).ceil() as u64,
        };
        Pace {
            timestep,
            steps: wanted,
            record_every,
            frames,
        }
    }

    /// Checks that a run ends, and that it holds so many grains.
    pub fn check(
        &self,
        duration: Option<f64>,
        grains: f64,
        origin: &str,
    ) -> Result<(), SceneError> {
        let refuse = |key: &str, value: f64, range: String| {
            Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: key.to_owned(),
                value: value.to_string(),
                range,
            })
        };
        if self.steps as f64 > MOST_STEPS {
            let (key, value) = match duration {
                Some(duration) => ("duration", duration),
                None => ("steps", self.steps as f64),
            };
            return refuse(
                key,
                value,
                format!(
                    "such that the run takes at most {MOST_STEPS:e} steps; it would take {:.3e} of {:e} s",
                    self.steps as f64, self.timestep
                ),
            );
        }
        if grains > MOST_GRAINS {
            return refuse(
                "scale",
                grains,
                format!(
                    "such that there are at most {MOST_GRAINS:e} grains (this many are asked for)"
                ),
            );
        }
        Ok(())
    }
}

/// One of the two keys of the length must be there.
pub fn check_length(
    steps: Option<u64>,
    duration: Option<f64>,
    origin: &str,
) -> Result<(), SceneError> {
    if steps.is_none() && duration.is_none() {
        return Err(SceneError::MissingKey {
            file: origin.to_owned(),
            key: "steps".into(),
            wanted: "one of steps, duration".into(),
        });
    }
    Ok(())
}
