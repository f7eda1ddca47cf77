//! What a campaign found, as a summary and as tables.

use super::published_material;
use crate::report::calibration::{Campaign, Comparison, FrictionOf};
use crate::run::incline;
use crate::scene::Scene;
use crate::state_hash;
use crate::summary::{Quantity, Summary};
use crate::table::Table;
use colluvium_coupling::calibration::thesis::{Estimator, published_row};
use colluvium_coupling::calibration::{Fraction, LeftOut, Stress};
use colluvium_coupling::campaign::Threshold;
use colluvium_coupling::incline::{InclineResult, Outcome, Purpose, Start};

/// The summary of a campaign, without model, cost and status.
pub(super) fn summarise(scene: &Scene, record: &Campaign) -> Summary {
    let result = &record.result;
    let mut summary = Summary::begun(&scene.name, "calibrate");
    let published = published_material(scene).and_then(|m| published_row(m, Estimator::Top, true));
    let source = "thesis Table 2.6, top, with Φ";
    if let Some(fit) = &result.fit {
        let rows = [
            (
                "mu_s",
                fit.mu_s,
                fit.mu_s_error,
                published.map(|r| r.mu_s[0]),
            ),
            (
                "mu_2",
                fit.mu_2,
                fit.mu_2_error,
                published.map(|r| r.mu_2[0]),
            ),
            ("i_0", fit.i_0, fit.i_0_error, published.map(|r| r.i_0[0])),
        ];
        for (name, value, error, reference) in rows {
            let quantity = Quantity::new(value, "1").with_error(error);
            summary.put(
                name,
                match reference {
                    Some(reference) => quantity.against(reference, source),
                    None => quantity.from("fit of |τ|/p, p = trace/3"),
                },
            );
        }
        summary.put(
            "solid_fraction",
            Quantity::new(fit.solid_fraction, "1")
                .with_error(fit.solid_fraction_error.unwrap_or(f64::NAN)),
        );
        summary.put("valid_i_low", Quantity::new(fit.valid_i[0], "1"));
        summary.put("valid_i_high", Quantity::new(fit.valid_i[1], "1"));
        if let Some(peer) = record.peer(scene) {
            let (mu, error) = fit.band(peer.inertial_number);
            summary.put(
                "friction_at_peer_i",
                Quantity::new(mu, "1")
                    .with_error(error)
                    .against(peer.friction, peer.source),
            );
            if let Some(law) = &fit.solid_fraction_of_i {
                summary.put(
                    "solid_fraction_at_peer_i",
                    Quantity::new(law.intercept - law.slope * peer.inertial_number, "1")
                        .against(peer.solid_fraction, peer.source),
                );
            }
        }
    }
    if let Some(fit) = &result.fit_zz {
        for (name, value, error) in [
            ("mu_s_zz", fit.mu_s, fit.mu_s_error),
            ("mu_2_zz", fit.mu_2, fit.mu_2_error),
            ("i_0_zz", fit.i_0, fit.i_0_error),
        ] {
            summary.put(
                name,
                Quantity::new(value, "1")
                    .with_error(error)
                    .from("fit of |τ|/σ_zz"),
            );
        }
    }
    for (name, bracket) in [
        ("stop", result.stop_bracket_degrees),
        ("onset", result.onset_bracket_degrees),
    ] {
        if let Some((low, high)) = bracket {
            summary.put(
                &format!("{name}_low"),
                Quantity::new(low, "degree").from("highest at rest"),
            );
            summary.put(
                &format!("{name}_high"),
                Quantity::new(high, "degree").from("lowest that flows"),
            );
        }
    }
    for (name, threshold, source) in [
        ("stop", &result.stop, "half of the beds stop"),
        ("onset", &result.onset, "half of the beds set off"),
    ] {
        if let Some(t) = threshold {
            let value = Quantity::new(t.degrees, "degree").with_error(t.error);
            summary.put(name, value.from(source));
        }
    }
    if let Some(n) = &result.non_local {
        let source = "h_stop(θ): tan θ = tan θ_1 + (π A d/2h)²";
        summary.put(
            "non_local_amplitude",
            Quantity::new(n.amplitude, "1").from(source),
        );
    }
    if let Some((ratio, spread)) = result.pressure_ratio {
        let value = Quantity::new(ratio, "1").with_error(spread);
        summary.put(
            "pressure_ratio",
            value.from("p/σ_zz, mean and deviation of the points"),
        );
    }
    for a in &result.alternatives {
        let name = format!("weight_{}", format!("{:?}", a.law).to_lowercase());
        summary.put(
            &name,
            Quantity::new(a.weight, "1").from("Akaike weight of the law"),
        );
    }
    if let Some(joint) = &result.joint {
        let names = ["constant_phi", "phi_of_i", "dilatancy"];
        let source = "Akaike weight of μ(I) with this solid fraction, on μ and φ together, all laws of friction";
        for (name, weight) in names.iter().zip(joint.weights) {
            let value = Quantity::new(weight, "1").from(source);
            summary.put(&format!("weight_{name}"), value);
        }
        let with = joint.best(Fraction::Dilatancy);
        if let Some([k, error]) = with.and_then(|a| a.dilatancy) {
            let source = "K of μ = μ(I) + K (φ − φ(I)), of the best such law";
            let value = Quantity::new(k, "1").with_error(error);
            summary.put("dilatancy", value.from(source));
        }
    }
    if let Some(fit) = &result.fluidity {
        let source = "Akaike weight of non-local fluidity against the local law, on profiles through the depth";
        summary.put(
            "weight_non_local",
            Quantity::new(fit.weight, "1").from(source),
        );
        let [low, high] = fit.amplitude_range;
        let source = format!("non-local amplitude A from profiles; 68 %: {low:.2} to {high:.2}");
        summary.put(
            "non_local_amplitude_profiles",
            Quantity::new(fit.amplitude, "1").from(&source),
        );
    }
    for c in &record.comparisons {
        if let Some((difference, [_, within])) = c.against_grains() {
            let fit = match c.friction {
                FrictionOf::Pressure => "p",
                FrictionOf::NormalStress => "zz",
            };
            let name = format!("velocity_against_grains_{}_{fit}", c.slope_degrees);
            let words = if within { "inside" } else { "outside" };
            let source = format!(
                "continuum over grains less 1, above the foot of the bulk; the grains lie {words} 95 % of posterior and discrepancy"
            );
            summary.put(&name, Quantity::new(difference, "1").against(0.0, &source));
        }
    }
    for (name, stress) in [("p", Stress::MeanPressure), ("zz", Stress::NormalPressure)] {
        let rows: Vec<_> = result
            .left_out
            .iter()
            .filter(|r| r.stress == stress)
            .collect();
        if rows.is_empty() {
            continue;
        }
        let share = |of: &dyn Fn(&LeftOut) -> bool| {
            rows.iter().filter(|r| of(r)).count() as f64 / rows.len() as f64
        };
        let source = "share of flows left out of the fit within 95 % of posterior and discrepancy";
        summary.put(
            &format!("left_out_covered_{name}"),
            Quantity::new(share(&|r| r.covered()[1]), "1").from(source),
        );
        let source = "the same by the posterior alone";
        summary.put(
            &format!("left_out_covered_by_posterior_{name}"),
            Quantity::new(share(&|r| r.covered_by_posterior()[1]), "1").from(source),
        );
        let source = "the same of the law with 5 % more friction, the control";
        summary.put(
            &format!("left_out_covered_control_{name}"),
            Quantity::new(share(&|r| r.control_covered()[1]), "1").from(source),
        );
    }
    if let Some(fit) = &result.fit {
        summary.put(
            "identified",
            Quantity::new(f64::from(u8::from(fit.identified)), "1")
                .from("1 = the data determine mu_s, mu_2 and i_0"),
        );
    }
    let good = f64::from(u8::from(result.verdict.good));
    summary.put(
        "good",
        Quantity::new(good, "1").from("1 = fit to feed a continuum within valid_i"),
    );
    summary.remarks.push(result.verdict.text.clone());
    for c in record.comparisons.iter().filter(|c| !c.inside_valid_i) {
        summary.remarks.push(format!(
            "Continuum at {} degrees: I = {:.4} lies outside the measured range.",
            c.slope_degrees, c.inertial_number
        ));
    }
    let checks = result.runs.iter().filter_map(|r| r.checks);
    summary.ledger.mass_relative = checks
        .clone()
        .map(|c| c.mass_relative.abs())
        .fold(0.0, f64::max);
    summary.ledger.momentum_relative = checks.map(|c| c.normal_relative.abs()).reduce(f64::max);
    summary.state_hash = state_hash::of_hashes(result.runs.iter().map(|r| r.state_hash.as_str()));
    summary
}

/// Angles, points, continuum and the profile of each measured flow.
pub(super) fn tables(record: &Campaign) -> Vec<Table> {
    let runs = &record.result.runs;
    let column = |f: &dyn Fn(&InclineResult) -> f64| runs.iter().map(f).collect();
    let flag = |yes: bool| f64::from(u8::from(yes));
    let angles = Table::new("angles")
        .with("slope_degrees", "degree", column(&|r| r.slope_degrees))
        .with(
            "from_rest",
            "1",
            column(&|r| flag(matches!(r.start, Start::Rest))),
        )
        .with("flows", "1", column(&|r| flag(r.flows())))
        .with(
            "steady",
            "1",
            column(&|r| flag(r.outcome == Outcome::Steady)),
        )
        .with("bed", "1", column(&|r| r.bed as f64))
        .with("sudden_loss", "1", column(&|r| r.sudden_loss))
        .with("bond_order", "1", column(&|r| r.bond_order))
        .with("mean_velocity", "m/s", column(&|r| r.steady.mean))
        .with(
            "mean_velocity_error",
            "m/s",
            column(&|r| r.steady.mean_error),
        )
        .with("height", "m", column(&|r| r.height))
        .with("distance", "m", column(&|r| r.distance))
        .with("largest_overlap", "R", column(&|r| r.largest_overlap))
        .with("grain_steps", "1", column(&|r| r.cost.grain_steps as f64))
        .with("wall_s", "s", column(&|r| r.cost.wall_s));
    let mut tables = vec![angles, incline::points_table(runs)];
    let rows: Vec<(&Comparison, usize)> = record
        .comparisons
        .iter()
        .flat_map(|c| (0..c.z.len()).map(move |k| (c, k)))
        .collect();
    let of = |f: &dyn Fn(&Comparison, usize) -> f64| rows.iter().map(|(c, k)| f(c, *k)).collect();
    tables.push(
        Table::new("continuum")
            .with("slope_degrees", "degree", of(&|c, _| c.slope_degrees))
            .with(
                "friction_zz",
                "1",
                of(&|c, _| flag(c.friction == FrictionOf::NormalStress)),
            )
            .with("z", "m", of(&|c, k| c.z[k]))
            .with("u", "m/s", of(&|c, k| c.u[k]))
            .with("p", "Pa", of(&|c, k| c.p[k]))
            .with("u_exact", "m/s", of(&|c, k| c.exact_u[k])),
    );
    let result = &record.result;
    if let Some(posterior) = &result.posterior {
        let part = |k: usize| posterior.samples.iter().map(|s| s[k]).collect();
        tables.push(
            Table::new(super::POSTERIOR)
                .with("mu_s", "1", part(0))
                .with("mu_2", "1", part(1))
                .with("i_0", "1", part(2)),
        );
    }
    if let Some(table) = &result.free_form {
        tables.push(
            Table::new("free_form")
                .with("i", "1", table.inertial_number.clone())
                .with("mu", "1", table.friction.clone()),
        );
    }
    if !result.stop_curve.is_empty() {
        let of = |f: &dyn Fn(&Threshold) -> f64| result.stop_curve.iter().map(f).collect();
        tables.push(
            Table::new("stop_curve")
                .with("height", "m", of(&|t| t.height))
                .with("slope_degrees", "degree", of(&|t| t.degrees))
                .with("slope_degrees_error", "degree", of(&|t| t.error)),
        );
    }
    for run in runs.iter().filter(|r| r.purpose == Purpose::Measure) {
        if let Some(profile) = &run.profile {
            let name = match run.bed {
                0 => format!("profile_{}", run.slope_degrees),
                bed => format!("profile_{}_bed_{}", run.slope_degrees, bed + 1),
            };
            tables.push(incline::profile_table(&name, profile));
        }
    }
    tables
}
