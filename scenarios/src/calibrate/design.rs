//! The flows of a campaign: the scene's own, or those that tell most.

use crate::scene::InclineScene;
use colluvium_coupling::campaign::{
    Depths, Flow, GuessedLaw, Precision, Prospect, choose_flows, choose_slopes, cost,
    prospect_of_flows,
};
use std::f64::consts::PI;

/// Least distance of two flows (degrees).
const APART: f64 = 0.5;
/// Inertial number of the guess up to which slopes are chosen: beyond it flows are dilute.
const FASTEST: f64 = 1.0;
/// Solid fraction of a bed that is not settled yet.
const LOOSE: f64 = 0.55;

fn guess(body: &InclineScene) -> GuessedLaw {
    let guess = body.calibration.guess;
    GuessedLaw {
        mu_s: guess.mu_s,
        mu_2: guess.mu_2,
        i_0: guess.i_0,
    }
}

/// What depth does to flows of this scene, before its bed is settled.
fn depths(body: &InclineScene) -> Depths {
    let [length, width] = body.floor_edges().map(|edge| edge / body.grains.diameter);
    let grains = body.free_grains() as f64;
    // The base has about one grain on each square diameter.
    let base = length * width / grains;
    let full = grains * PI / 6.0 / (LOOSE * length * width);
    Depths::new(&body.calibration.depth_choices, full, base)
}

/// From the middle of the stop's bracket to where the guess has I = 1 (degrees).
fn range(body: &InclineScene, law: &GuessedLaw) -> [f64; 2] {
    let keys = &body.calibration;
    let fastest = (law.mu_s + (law.mu_2 - law.mu_s) * FASTEST / (FASTEST + law.i_0))
        .atan()
        .to_degrees();
    let low = 0.5 * (keys.stop.low + keys.stop.high);
    [low, fastest.max(low + APART * keys.flow_count as f64)]
}

/// Flows that are measured: those of the scene or, where it names none, the D-optimal ones for its guess: slopes at the full
/// depth or, where it gives depths to choose from, slopes and depths at the same cost.
pub fn flows(body: &InclineScene) -> Vec<Flow> {
    let keys = &body.calibration;
    let law = guess(body);
    let (precision, count) = (Precision::default(), keys.flow_count as usize);
    let slopes = if !keys.flow_degrees.is_empty() {
        keys.flow_degrees.clone()
    } else if keys.depth_choices.is_empty() {
        choose_slopes(&law, &precision, range(body, &law), count, APART)
    } else {
        // Whole quarters of a degree, as all others are.
        let range = range(body, &law).map(|end| (4.0 * end).floor() / 4.0);
        return choose_flows(&law, &precision, &depths(body), range, count, APART);
    };
    let full = |slope_degrees: f64| Flow {
        slope_degrees,
        depth: 1.0,
    };
    slopes.into_iter().map(full).collect()
}

/// Slopes of the flows of full depth (degrees).
pub fn flow_degrees(body: &InclineScene) -> Vec<f64> {
    let full = flows(body).into_iter().filter(|f| f.depth == 1.0);
    full.map(|f| f.slope_degrees).collect()
}

/// Depths other than the full one, the deepest first, and the slopes of their flows (degrees).
pub fn flows_of_depths(body: &InclineScene) -> Vec<(f64, Vec<f64>)> {
    let mut list: Vec<(f64, Vec<f64>)> = Vec::new();
    for flow in flows(body).iter().filter(|f| f.depth != 1.0) {
        match list.iter_mut().find(|(depth, _)| *depth == flow.depth) {
            Some((_, slopes)) => slopes.push(flow.slope_degrees),
            None => list.push((flow.depth, vec![flow.slope_degrees])),
        }
    }
    list
}

/// Flows, what they would tell about μ_s, μ_2 and I_0 if the guess were true, and their grain-steps over those of a full flow.
pub struct Design {
    /// The flows.
    pub flows: Vec<Flow>,
    /// What they would tell.
    pub prospect: Prospect,
    /// Their cost.
    pub cost: f64,
}

/// The campaign's flows, as many D-optimal slopes at the full depth, and slopes and depths at that cost: of the scene's choices
/// or, where it has none, of the usual ones.
pub fn designs(body: &InclineScene) -> [Design; 3] {
    /// Depths that are looked at where a scene names none.
    const USUAL: [f64; 5] = [0.5, 0.65, 0.8, 1.25, 1.5];
    let own = flows(body);
    let mut by_slopes = body.clone();
    let keys = &mut by_slopes.calibration;
    if !keys.flow_degrees.is_empty() {
        keys.flow_count = keys.flow_degrees.len() as u64;
    }
    keys.flow_degrees.clear();
    let mut by_both = by_slopes.clone();
    by_slopes.calibration.depth_choices.clear();
    if by_both.calibration.depth_choices.is_empty() {
        by_both.calibration.depth_choices = USUAL.to_vec();
    }
    let (law, depths) = (guess(body), depths(body));
    [own, flows(&by_slopes), flows(&by_both)].map(|flows| Design {
        prospect: prospect_of_flows(&law, &Precision::default(), &depths, &flows),
        cost: cost(&depths, &flows),
        flows,
    })
}
