//! The slopes of a campaign: the scene's own, or those that tell most.

use crate::scene::InclineScene;
use colluvium_coupling::campaign::{GuessedLaw, Precision, Prospect, choose_slopes, prospect};

/// Least distance of two flows (degrees).
const APART: f64 = 0.5;
/// Inertial number of the guess up to which slopes are chosen: beyond it flows are dilute.
const FASTEST: f64 = 1.0;

fn guess(body: &InclineScene) -> GuessedLaw {
    let guess = body.calibration.guess;
    GuessedLaw {
        mu_s: guess.mu_s,
        mu_2: guess.mu_2,
        i_0: guess.i_0,
    }
}

/// Slopes that are measured (degrees): those of the scene or, where it names none, the D-optimal ones for its guess from
/// the middle of the stop's bracket to where the guess has I = 1.
pub fn flow_degrees(body: &InclineScene) -> Vec<f64> {
    let keys = &body.calibration;
    if !keys.flow_degrees.is_empty() {
        return keys.flow_degrees.clone();
    }
    let law = guess(body);
    let fastest = (law.mu_s + (law.mu_2 - law.mu_s) * FASTEST / (FASTEST + law.i_0))
        .atan()
        .to_degrees();
    let low = 0.5 * (keys.stop.low + keys.stop.high);
    let range = [low, fastest.max(low + APART * keys.flow_count as f64)];
    choose_slopes(
        &law,
        &Precision::default(),
        range,
        keys.flow_count as usize,
        APART,
    )
}

/// What the flows of a campaign would tell about μ_s, μ_2 and I_0 if the guess were true, and what as many D-optimal
/// slopes would.
pub fn prospects(body: &InclineScene) -> [Prospect; 2] {
    let (law, precision) = (guess(body), Precision::default());
    let own = flow_degrees(body);
    let mut designed = body.clone();
    designed.calibration.flow_degrees.clear();
    designed.calibration.flow_count = own.len() as u64;
    [own, flow_degrees(&designed)].map(|slopes| prospect(&law, &precision, &slopes))
}
