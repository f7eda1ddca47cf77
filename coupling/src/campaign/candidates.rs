//! What else might serve, in words with figures: a non-local length, dilatancy, the other of the two frictions.

use super::threshold::NonLocal;
use crate::calibration::{
    BulkFlow, Discrepancy, FluidityFit, FluidityFlow, LeftOut, MuIFit, Stress, fit_fluidity, law_of,
};
use crate::incline::{InclineResult, InclineSpec};

/// The local law of |τ|/p against one with a length, on the profiles of the flows that the fit uses.
pub(super) fn fluidity(
    base: &InclineSpec,
    used: &[&InclineResult],
    bulks: &[BulkFlow],
    fit: &MuIFit,
) -> Option<FluidityFit> {
    if !fit.physical {
        return None;
    }
    let bulks: Vec<&BulkFlow> = bulks.iter().collect();
    let scatter = Discrepancy::of(&bulks, law_of(fit), Stress::MeanPressure)?;
    let flows: Vec<FluidityFlow> = used
        .iter()
        .filter_map(|run| {
            let profile = run.profile.as_ref()?;
            FluidityFlow::of(
                profile,
                &run.points,
                run.height,
                base.diameter,
                base.grain_density,
            )
        })
        .collect();
    fit_fluidity(&flows, law_of(fit), scatter.friction)
}

/// All candidates, each in a sentence or two.
pub(super) struct Candidates<'a> {
    pub fluidity: &'a Option<FluidityFit>,
    pub non_local: &'a Option<NonLocal>,
    pub used: &'a [&'a InclineResult],
    pub fit: Option<&'a MuIFit>,
    pub left_out: &'a [LeftOut],
}

impl Candidates<'_> {
    pub(super) fn tell(&self, text: &mut Vec<String>) {
        text.extend(
            self.fluidity
                .as_ref()
                .map(|fit| length(fit, self.non_local)),
        );
        text.extend(swelling(self.used));
        text.extend(self.fit.and_then(|fit| dilatancy(self.used, fit)));
        text.extend(frictions(self.left_out));
    }
}

fn length(fit: &FluidityFit, stops: &Option<NonLocal>) -> String {
    let left = &fit.left_out;
    let answer = match (fit.shows_a_length(), fit.rms[1] > POOR) {
        (true, false) => "the profiles ask for a length",
        (true, true) => "a length helps, but neither law foretells I",
        (false, true) => "neither law foretells I, with a length or without",
        (false, false) => "the profiles do not ask for a length",
    };
    let stops = stops.map_or(String::new(), |n| {
        format!(" (thin layers' stops give A = {:.2})", n.amplitude)
    });
    format!(
        "Non-local fluidity through the depth ({} layers of {} flows): A = {:.2} (68 %: {:.2} to {:.2}), fluidity at the base \
         {:.2} of the local one; ln I is missed by {:.3} rms, without a length by {:.3}, chi2 {:.0} against {:.0}, Akaike weight \
         {:.0} %; {} of {} flows left out are foretold better with it ({:.3} against {:.3} rms, {:.1} standard errors): \
         {answer}{stops}.",
        fit.points,
        fit.flows,
        fit.amplitude,
        fit.amplitude_range[0],
        fit.amplitude_range[1],
        fit.base,
        fit.rms[1],
        fit.rms[0],
        fit.chi_square[1],
        fit.chi_square[0],
        100.0 * fit.weight,
        left.better,
        left.flows,
        left.rms[1],
        left.rms[0],
        left.significance
    )
}

/// Root-mean-square of ln I above which a law does not foretell a flow.
const POOR: f64 = 0.3;

/// tan ψ = (∂W/∂z)/(∂U/∂z) between the lowest and the highest layer of the bulk: what friction a flow that swells has beyond
/// that of one that does not (Roux and Radjai, 1998).
fn dilation(run: &InclineResult) -> Option<f64> {
    let rows = &run.profile.as_ref()?.rows;
    let at = |z: f64| rows.iter().find(|r| r.z == z);
    let (foot, top) = (at(run.points.first()?.z)?, at(run.points.last()?.z)?);
    let gain = top.u.value - foot.u.value;
    (gain > 0.0).then(|| (top.w.value - foot.w.value) / gain)
}

fn swelling(used: &[&InclineResult]) -> Option<String> {
    let all: Vec<f64> = used.iter().filter_map(|r| dilation(r)).collect();
    let (low, high) = ends(&all)?;
    Some(format!(
        "Dilatancy: while averaged the flows swell by tan psi = {low:+.4} to {high:+.4} of their shear, which is what dilation \
         adds to mu."
    ))
}

/// Under a given weight the thickness of a flow, and with it its velocity, goes with 1/φ.
fn dilatancy(used: &[&InclineResult], fit: &MuIFit) -> Option<String> {
    let law = fit.solid_fraction_of_i?;
    let mut one = Vec::new();
    let mut by_law = Vec::new();
    for run in used.iter().filter(|r| !r.points.is_empty()) {
        let n = run.points.len() as f64;
        let phi = run.points.iter().map(|p| p.solid_fraction).sum::<f64>() / n;
        let i = run.points.iter().map(|p| p.inertial_number).sum::<f64>() / n;
        one.push(100.0 * (phi / fit.solid_fraction - 1.0));
        by_law.push(100.0 * (phi / (law.intercept - law.slope * i) - 1.0));
    }
    let ((low, high), (a, b)) = (ends(&one)?, ends(&by_law)?);
    Some(format!(
        "Under a given weight velocity goes with 1/phi: one solid fraction for all misses that by {low:+.0} to {high:+.0} %, \
         phi(I) = {:.3} - {:.3} I by {a:+.0} to {b:+.0} %.",
        law.intercept, law.slope
    ))
}

/// Which friction foretells flows that were left out.
fn frictions(left_out: &[LeftOut]) -> Option<String> {
    let told: Vec<String> = [
        (Stress::MeanPressure, "|tau|/p"),
        (Stress::NormalPressure, "|tau|/sigma_zz"),
    ]
    .iter()
    .filter_map(|(stress, name)| {
        let of = left_out.iter().filter(|r| r.stress == *stress);
        let rows: Vec<&LeftOut> = of.collect();
        if rows.is_empty() {
            return None;
        }
        let within = rows.iter().filter(|r| r.covered()[1]).count();
        let ratios: Vec<f64> = rows.iter().map(|r| r.ratio).collect();
        let (low, high) = ends(&ratios)?;
        let percent = |ratio: f64| match ratio {
            r if r <= 0.0 => "at rest".to_owned(),
            r if r > 100.0 => "without bound".to_owned(),
            r => format!("{:+.0} %", 100.0 * (r - 1.0)),
        };
        Some(format!(
            "by {name} {within} of {} lie within 95 %, velocities off by {} to {}, friction by {:.4} from flow to flow",
            rows.len(),
            percent(low),
            percent(high),
            rows.iter().map(|r| r.discrepancy.friction).sum::<f64>() / rows.len() as f64
        ))
    })
    .collect();
    (!told.is_empty()).then(|| {
        format!(
            "Each flow foretold by the law of the others: {}.",
            told.join("; ")
        )
    })
}

fn ends(values: &[f64]) -> Option<(f64, f64)> {
    let first = *values.first()?;
    Some(
        values
            .iter()
            .fold((first, first), |(a, b), x| (a.min(*x), b.max(*x))),
    )
}
