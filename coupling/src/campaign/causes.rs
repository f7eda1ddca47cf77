//! What a continuum run inherits from a fit, which law the points support, and why one law may not describe them.

use super::verdict::{Evidence, LARGEST_MISFIT};
use crate::calibration::{
    Alternative, Fraction, JointComparison, Law, LocalPoint, MuIFit, Posterior, inertial_number,
    mu_of_i, pressure_ratio,
};

/// Where the error of the law matters to a continuum: in an inclined flow u ∝ I, and I follows from μ(I) = tan θ.
pub(super) fn inherited(fit: &MuIFit, posterior: &Option<Posterior>, text: &mut Vec<String>) {
    let i = (fit.valid_i[0] * fit.valid_i[1]).sqrt();
    let mu = mu_of_i(fit.mu_s, fit.mu_2, fit.i_0, i);
    let rise = (fit.mu_2 - fit.mu_s) * fit.i_0 / ((i + fit.i_0) * (i + fit.i_0));
    if !fit.physical || rise <= 0.0 {
        return;
    }
    let at = |law: [f64; 3]| inertial_number(law, mu);
    let misfit = fit.rms_residual / rise / i;
    let from_fit = posterior.as_ref().and_then(|p| p.band(at)).map(|b| {
        format!(
            "the parameters' errors move it between {:+.0} and {:+.0} % (68 % of the posterior), and ",
            100.0 * (b[1] / i - 1.0),
            100.0 * (b[3] / i - 1.0)
        )
    });
    text.push(format!(
        "What a continuum run inherits: at tan theta = {mu:.3} (I = {i:.3}) the velocity goes with I; {}points that \
         scatter as these do are {:.0} % of I off the curve.",
        from_fit.unwrap_or_default(),
        100.0 * misfit
    ));
}

/// Share of Akaike weight below which a law is not supported.
const SUPPORTED: f64 = 0.05;

/// Which of the competing laws the points support.
pub(super) fn laws(alternatives: &[Alternative], points: &[LocalPoint], text: &mut Vec<String>) {
    let Some(best) = alternatives.first() else {
        return;
    };
    let list: Vec<String> = alternatives
        .iter()
        .map(|a| {
            format!(
                "{} {:.0} % (rms {:.4})",
                a.law.title(),
                100.0 * a.weight,
                a.rms_residual
            )
        })
        .collect();
    text.push(format!("Support by Akaike weight: {}.", list.join(", ")));
    let mean = points.iter().map(|p| p.friction).sum::<f64>() / points.len().max(1) as f64;
    let least = alternatives
        .iter()
        .map(|a| a.rms_residual)
        .fold(f64::INFINITY, f64::min);
    if least > LARGEST_MISFIT * mean {
        text.push(format!(
            "None of these laws describes the points to {:.0} % of mu.",
            100.0 * LARGEST_MISFIT
        ));
        return;
    }
    let jop = alternatives.iter().find(|a| a.law == Law::Jop);
    if best.law != Law::Jop && jop.is_none_or(|a| a.weight < SUPPORTED) {
        let values: Vec<String> = best
            .law
            .parameter_names()
            .iter()
            .zip(best.parameters.iter().zip(&best.errors))
            .map(|(name, (value, error))| format!("{name} = {value:.3} ± {error:.3}"))
            .collect();
        text.push(format!(
            "Of these the law that serves best is {}: {}.",
            best.law.title(),
            values.join(", ")
        ));
    }
}

/// Whether φ(I) and dilatancy are supported beside one φ.
pub(super) fn joint_laws(joint: &JointComparison) -> Option<String> {
    let best = joint.alternatives.first()?;
    let list: Vec<String> = Fraction::ALL
        .iter()
        .zip(joint.weights)
        .map(|(fraction, weight)| format!("{} {:.0} %", fraction.title(), 100.0 * weight))
        .collect();
    let d = &joint.deviation;
    let told = joint
        .best(Fraction::Dilatancy)
        .and_then(|a| a.dilatancy)
        .map_or(
            "no K above 0 makes friction of a layer's excess of phi".to_owned(),
            |[k, error]| {
                format!("mu rises by K = {k:.2} ± {error:.2} times a layer's excess of phi")
            },
        );
    Some(format!(
        "Friction and solid fraction together, by the same criterion: {}; best is {} with {}. Beside phi(I) flows differ by {:.4} \
         and layers by {:.4} more than the {:.4} of counting; {told}.",
        list.join(", "),
        best.friction.title(),
        best.fraction.title(),
        d.flows,
        d.layers,
        d.counting
    ))
}

/// Smallest change of μ over the depth, relative, that is worth a word.
const NOTICED: f64 = 0.01;
/// I above which flows leave the dense range (GDR MiDi 2004).
const DENSE: f64 = 0.5;

/// Why points may not lie on one curve.
pub(super) fn causes(e: &Evidence, good: &mut bool, text: &mut Vec<String>) {
    let points = e.points;
    if points.is_empty() {
        return;
    }
    let n = points.len() as f64;
    let mean_mu = points.iter().map(|p| p.friction).sum::<f64>() / n;
    if let Some(r) = e.residuals {
        let change = r.depth_change / mean_mu;
        let mut found = Vec::new();
        if r.depends_on_place() && change.abs() > NOTICED {
            found.push(format!(
                "mu at equal I changes by {:+.1} ± {:.1} % from the lowest to the highest layer of a flow (p = {:.0e}): \
                 it depends on more than the local I",
                100.0 * change,
                100.0 * r.depth_change_error / mean_mu,
                r.depth
            ));
        }
        if r.depends_on_run() {
            found.push(format!(
                "flows differ by more than their layers do (p = {:.0e})",
                r.between_runs
            ));
        }
        if r.wrong_shape() {
            found.push(format!(
                "residuals keep their sign over stretches of I (p = {:.0e}): the curve has another shape",
                r.signs
            ));
        }
        if !found.is_empty() {
            text.push(format!("Residuals are not noise: {}.", found.join("; ")));
        }
        // A place dependence as large as the whole rise of the law is not a law.
        if let (Ok(fit), true) = (e.fit, r.depends_on_place()) {
            let rise = fit.band(fit.valid_i[1]).0 - fit.band(fit.valid_i[0]).0;
            if r.depth_change.abs() > 0.3 * rise.abs() {
                *good = false;
                text.push(format!(
                    "That is {:.0} % of the rise of mu(I) over the measured range: no local law of I alone serves here.",
                    100.0 * r.depth_change.abs() / rise.abs().max(1e-12)
                ));
            }
        }
    }
    if let Some((ratio, spread)) = pressure_ratio(points) {
        text.push(format!(
            "Normal-stress differences: p = trace/3 is {ratio:.3} ± {spread:.3} of sigma_zz, so |tau|/p stands {:.0} % \
             above |tau|/sigma_zz, which in a steady flow is tan theta.",
            100.0 * (1.0 / ratio - 1.0)
        ));
    }
    let beyond = points.iter().filter(|p| p.inertial_number > DENSE).count();
    if beyond > 0 {
        text.push(format!(
            "{beyond} of {} points lie above I = {DENSE}, outside the dense range.",
            points.len()
        ));
    }
    let (low, high) = points.iter().fold((1.0f64, 0.0f64), |(a, b), p| {
        (a.min(p.solid_fraction), b.max(p.solid_fraction))
    });
    if high - low > 0.05 {
        text.push(format!(
            "The solid fraction goes from {low:.3} to {high:.3}: an incompressible continuum carries one value of it."
        ));
    }
}
