//! Good enough or not, in words with figures.

use super::CampaignSpec;
use super::candidates::Candidates;
use super::causes::{causes, inherited, joint_laws, laws};
use super::search::NoBracket;
use super::threshold::{NonLocal, Threshold};
use crate::calibration::thesis::{Estimator, EstimatorFit, Row, published_row};
use crate::calibration::{
    Alternative, FitError, JointComparison, LocalPoint, MuIFit, Posterior, ResidualTests,
};
use crate::incline::InclineResult;
use serde::{Deserialize, Serialize};

/// The judgement on a calibration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Fit to feed a continuum solver, inside its validity window.
    pub good: bool,
    /// Why, sentence by sentence.
    pub text: String,
}

pub(super) struct Evidence<'a> {
    pub spec: &'a CampaignSpec,
    pub flows: &'a [InclineResult],
    pub used: usize,
    pub fit: &'a Result<MuIFit, FitError>,
    pub fit_zz: &'a Result<MuIFit, FitError>,
    pub estimators: &'a [EstimatorFit],
    pub stop: &'a Result<(f64, f64), NoBracket>,
    pub onset: &'a Result<(f64, f64), NoBracket>,
    pub thresholds: [&'a Option<Threshold>; 2],
    pub non_local: &'a Option<NonLocal>,
    pub residuals: &'a Option<ResidualTests>,
    pub alternatives: &'a [Alternative],
    pub joint: &'a Option<JointComparison>,
    pub posterior: &'a Option<Posterior>,
    pub points: &'a [LocalPoint],
    pub candidates: Candidates<'a>,
}

/// Root-mean-square residual, relative to μ, above which μ(I) does not describe the material.
pub(super) const LARGEST_MISFIT: f64 = 0.03;
/// Largest |σ_zz/weight − 1| of a trustworthy flow.
const LARGEST_WEIGHT_ERROR: f64 = 0.02;
/// Overlap over the harmonic mean of the radii above which grains are too soft for the limit of hard grains.
const LARGEST_OVERLAP: f64 = 0.05;

pub(super) fn judge(e: &Evidence) -> Verdict {
    let mut good = true;
    let mut text = Vec::new();
    match e.fit {
        Err(error) => {
            good = false;
            text.push(format!("No rheology: {error}."));
        }
        Ok(fit) => {
            judge_fit(fit, &mut good, &mut text);
            inherited(fit, e.posterior, &mut text);
        }
    }
    laws(e.alternatives, e.points, &mut text);
    text.extend(e.joint.as_ref().and_then(joint_laws));
    causes(e, &mut good, &mut text);
    e.candidates.tell(&mut text);
    if let Ok(fit) = e.fit_zz {
        text.push(format!(
            "Against sigma_zz instead of p: mu_s = {:.3} ± {:.3}, mu_2 = {:.3} ± {:.3}, I_0 = {:.3} ± {:.3}; \
             the two differ by the normal stress differences.",
            fit.mu_s, fit.mu_s_error, fit.mu_2, fit.mu_2_error, fit.i_0, fit.i_0_error
        ));
    }
    judge_runs(e, &mut good, &mut text);
    for (what, bracket, threshold) in [
        ("Flow stops", e.stop, e.thresholds[0]),
        ("A bed at rest starts to flow", e.onset, e.thresholds[1]),
    ] {
        text.push(match (bracket, threshold) {
            (Ok((low, high)), Some(t)) => format!(
                "{what} between {low:.2}° and {high:.2}°; half of all beds do at {:.1}° ± {:.1}° ({} runs).",
                t.degrees,
                t.error,
                t.trials.iter().map(|t| t.tried).sum::<u64>()
            ),
            (Ok((low, high)), None) => format!("{what} between {low:.2}° and {high:.2}°."),
            (Err(why), _) => {
                format!("{what} at a slope outside those tried: no bracket, because {why}.")
            }
        });
    }
    if let Some(n) = e.non_local {
        text.push(format!(
            "Thin layers stop at steeper slopes: tan theta_stop = {:.3} + (pi A d/2h)^2 with A = {:.2}, to {:.3}; a \
             non-local rheology would take this length, a local one cannot show it.",
            n.tangent, n.amplitude, n.rms_residual
        ));
    }
    let unit = (e.spec.base.diameter / e.spec.base.gravity).sqrt();
    text.push(format!(
        "These searches followed each bed for at most {:.0} √(d/g); a flow that still slowed down then counts as \
         flowing unless it had lost half of its speed.",
        e.spec.search_time / unit
    ));
    if let Some(material) = &e.spec.published_material {
        compare(e, material, &mut text);
    }
    Verdict {
        good,
        text: text.join(" "),
    }
}

fn judge_fit(fit: &MuIFit, good: &mut bool, text: &mut Vec<String>) {
    text.push(format!(
        "mu_s = {:.3} ± {:.3}, mu_2 = {:.3} ± {:.3}, I_0 = {:.3} ± {:.3} for mu = |tau|/p with \
                 p = trace/3, from {} points of {} flows, valid for I = {:.3} to {:.3}.",
        fit.mu_s,
        fit.mu_s_error,
        fit.mu_2,
        fit.mu_2_error,
        fit.i_0,
        fit.i_0_error,
        fit.degrees_of_freedom + 3,
        fit.runs,
        fit.valid_i[0],
        fit.valid_i[1],
    ));
    let (middle, error) = fit.band((fit.valid_i[0] * fit.valid_i[1]).sqrt());
    let misfit = fit.rms_residual / middle;
    if misfit > LARGEST_MISFIT {
        *good = false;
        text.push(format!(
                    "Points scatter by {:.1} % of mu about the curve (more than {:.0} %): one mu(I) does not \
                     describe this material.",
                    100.0 * misfit, 100.0 * LARGEST_MISFIT
                ));
    } else {
        text.push(format!(
                    "mu(I) describes the points to {:.1} % of mu; in the middle of the range mu is known to \
                     {:.1} %.",
                    100.0 * misfit, 100.0 * error / middle
                ));
    }
    text.push(fit.identifiability.clone());
    *good &= fit.identified;
    if !fit.physical {
        *good = false;
        text.push(unphysical(fit));
    }
    text.push(format!(
        "Errors are {:.1} times those of counting, because layers of one run are not independent.",
        fit.error_scale
    ));
}

/// Why no material has this law.
fn unphysical(fit: &MuIFit) -> String {
    let mut reasons = Vec::new();
    if fit.mu_s < 0.0 {
        reasons.push("friction would be negative at slow shear (mu_s below 0)");
    }
    if fit.mu_2 <= fit.mu_s {
        reasons.push("friction would not rise with the shear rate (mu_2 not above mu_s)");
    }
    if fit.i_0 <= 0.0 {
        reasons.push("the law would be singular (I_0 not above 0)");
    }
    if reasons.is_empty() {
        reasons.push("a parameter or its error is not a finite number");
    }
    format!(
        "No material has this law: {}; do not use it.",
        reasons.join("; ")
    )
}

fn judge_runs(e: &Evidence, good: &mut bool, text: &mut Vec<String>) {
    let measured = e.flows.len();
    if e.used < measured {
        text.push(format!(
            "{} of {measured} flows left out (at rest, or not known to drift by less than {:.0} % while averaged).",
            measured - e.used,
            100.0 * e.spec.usable_drift
        ));
    }
    let drifting: Vec<String> = e
        .flows
        .iter()
        .filter(|r| e.spec.is_usable(r))
        .filter_map(|r| Some((r, r.unsettled()?)))
        .map(|(r, why)| {
            format!(
                "{:.1}° ({}, {:+.0} ± {:.0} %)",
                r.slope_degrees,
                why.words(),
                100.0 * r.steady.drift,
                100.0 * r.steady.drift_error
            )
        })
        .collect();
    if !drifting.is_empty() {
        text.push(format!(
            "Not shown to be steady, used as local pairs (I, mu) but not to be read as tan theta: {}.",
            drifting.join(", ")
        ));
    }
    let used = || e.flows.iter().filter(|r| e.spec.is_usable(r));
    let weight = used()
        .filter_map(|r| r.checks)
        .map(|c| c.weight_relative)
        .fold(0.0, f64::max);
    if weight > LARGEST_WEIGHT_ERROR {
        *good = false;
        text.push(format!(
            "sigma_zz misses the weight above by up to {:.1} % (more than {:.0} %): averages are short or the bed still swings.",
            100.0 * weight, 100.0 * LARGEST_WEIGHT_ERROR
        ));
    } else if e.used > 0 {
        text.push(format!(
            "sigma_zz carries the weight above to {:.2} %.",
            100.0 * weight
        ));
    }
    let lost = used()
        .filter_map(|r| r.checks)
        .map(|c| c.mass_outside)
        .fold(0.0, f64::max);
    if lost > 0.0 {
        text.push(format!(
            "Up to {:.2} % of a flow's mass lies outside the averaging layers: thrown up, or through the base.",
            100.0 * lost
        ));
    }
    let overlap = used().map(|r| r.largest_overlap).fold(0.0, f64::max);
    if overlap > LARGEST_OVERLAP {
        text.push(format!(
            "The largest overlap of any contact at any step since the start, the first moments of the flow \
             included, is {:.1} % of the harmonic mean of the two radii (more than {:.0} %): these grains may be \
             softer than the limit of hard grains.",
            100.0 * overlap, 100.0 * LARGEST_OVERLAP
        ));
    }
}

fn compare(e: &Evidence, material: &str, text: &mut Vec<String>) {
    let Some(published) = published_row(material, Estimator::Top, true) else {
        text.push(format!("The thesis has no row for `{material}`."));
        return;
    };
    let mut differ = Vec::new();
    let mut list = |ours: &Row, name: &str| {
        let d = ours.differences(published);
        text.push(format!(
            "Against the thesis' \"top, with Phi\" row ({:.3} ± {:.3}, {:.3} ± {:.3}, {:.3} ± {:.3}), {name} \
             differs by {:+.1}, {:+.1} and {:+.1} joint errors in mu_s, mu_2 and I_0.",
            published.mu_s[0], published.mu_s[1], published.mu_2[0], published.mu_2[1],
            published.i_0[0], published.i_0[1], d[0], d[1], d[2]
        ));
        differ.push(d.iter().any(|x| x.is_nan() || x.abs() > 1.0));
    };
    if let Ok(fit) = e.fit {
        let row = Row {
            mu_s: [fit.mu_s, fit.mu_s_error],
            mu_2: [fit.mu_2, fit.mu_2_error],
            i_0: [fit.i_0, fit.i_0_error],
        };
        list(&row, "our fit of measured stress");
    }
    let same = e
        .estimators
        .iter()
        .find(|f| f.estimator == Estimator::Top && f.with_phi);
    if let Some(row) = same.and_then(|f| f.row) {
        list(&row, "the same estimator on our flows");
    }
    if differ.contains(&true) {
        text.push(
            "Where this is more than one joint error, these are possible reasons: the thesis prints neither \
             its height, box, stiffness nor time step, and ours are our own; it takes mu = tan theta where we \
             measure |tau|/p with p = trace/3, higher by the normal stress differences (5 to 10 %); its flows \
             start from a falling cloud; its I is one number per flow, ours one per layer, without the top 4 d \
             and the base 3 d; our flows are a few hundred diameters of shear long and may still drift."
                .into(),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::{LocalPoint, Stress, fit_mu_i, mu_of_i};

    #[test]
    fn an_unphysical_law_is_refused_in_words() {
        let fit = |mu_s: f64, mu_2: f64| {
            let points: Vec<LocalPoint> = (1..30)
                .map(|k| {
                    let i = 0.05 * f64::from(k);
                    let friction = mu_of_i(mu_s, mu_2, 0.3, i);
                    LocalPoint {
                        slope_degrees: f64::from(k / 5),
                        z: 0.0,
                        inertial_number: i,
                        inertial_number_error: 0.0,
                        friction,
                        friction_error: 1e-3,
                        friction_zz: friction,
                        friction_zz_error: 1e-3,
                        solid_fraction: 0.58 - 0.1 * i,
                        solid_fraction_error: 1e-3,
                    }
                })
                .collect();
            fit_mu_i(&points, Stress::MeanPressure).unwrap()
        };
        let judged = |fit: &MuIFit| {
            let (mut good, mut text) = (true, Vec::new());
            judge_fit(fit, &mut good, &mut text);
            (good, text.join(" "))
        };
        let (good, text) = judged(&fit(0.45, 0.8));
        assert!(good && !text.contains("No material"), "{text}");
        let (good, text) = judged(&fit(-0.3, 0.8));
        assert!(!good && text.contains("negative at slow shear"), "{text}");
        let (good, text) = judged(&fit(0.8, 0.45));
        assert!(!good && text.contains("would not rise"), "{text}");
    }
}
