//! The thesis' Table 2.6 beside our fits.

use super::super::Record;
use super::super::page::with_error;
use super::Campaign;
use crate::calibrate::published_material;
use colluvium_coupling::calibration::thesis::{Estimator, Row, TABLE_2_6};
use maud::{Markup, html};

/// Published rows, ours, and the difference in joint standard errors.
pub(super) fn thesis(record: &Record, campaign: &Campaign) -> Markup {
    let Some(material) = record.resolved().and_then(|s| published_material(&s)) else {
        return html! {};
    };
    let name = |e: Estimator| match e {
        Estimator::Top => "top",
        Estimator::Mean => "mean",
        Estimator::MinimalResidual => "min(res)",
    };
    html! {
        h2 { "The thesis' Table 2.6 beside ours" }
        p {
            "F. Thuillet (2019) takes stress from the weight and I from the velocity; the rows below do the same with our flows. "
            "Differences are in joint standard errors. Its layer depth, box, stiffness and time step are not printed; ours are in the scene."
        }
        div.wide { table {
            tr { th { "estimator" } th { "" } th { "μ_s" } th { "μ_2" } th { "I_0" } }
            @for fit in &campaign.result.estimators {
                @let published = TABLE_2_6.iter().find(|r| r.material == material && r.estimator == fit.estimator && r.with_phi == fit.with_phi).map(|r| r.row);
                @let label = format!("{}{}", name(fit.estimator), if fit.with_phi { ", with Φ" } else { "" });
                tr.ours {
                    td { (label) } td.text { "ours" }
                    @match (&fit.row, &fit.failure) {
                        (Some(row), _) => (cells(row)),
                        (None, Some(why)) => td.text.wrap colspan="3" { (why) },
                        (None, None) => td colspan="3" { "–" },
                    }
                }
                @if let Some(theirs) = published {
                    tr { td { } td.text { "thesis" } (cells(&theirs)) }
                    @if let Some(ours) = &fit.row {
                        tr { td { } td.text { "difference" } @for d in ours.differences(&theirs) { td { (format!("{d:+.1} σ")) } } }
                    }
                }
            }
        } }
        @if let (Some(fit), Some(theirs)) = (&campaign.result.fit, TABLE_2_6.iter().find(|r| r.material == material && r.estimator == Estimator::Top && r.with_phi)) {
            @let ours = Row { mu_s: [fit.mu_s, fit.mu_s_error], mu_2: [fit.mu_2, fit.mu_2_error], i_0: [fit.i_0, fit.i_0_error] };
            h3 { "The measured-stress fit against “top, with Φ”" }
            table {
                tr { th { "" } th { "μ_s" } th { "μ_2" } th { "I_0" } }
                tr.ours { td { "ours, |τ|/p" } (cells(&ours)) }
                tr { td { "thesis" } (cells(&theirs.row)) }
                tr { td { "difference" } @for d in ours.differences(&theirs.row) { td { (format!("{d:+.1} σ")) } } }
            }
        }
    }
}

fn cells(row: &Row) -> Markup {
    html! { @for [value, error] in [row.mu_s, row.mu_2, row.i_0] { td { (with_error(value, error)) } } }
}
