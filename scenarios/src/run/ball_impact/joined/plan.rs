//! What `colluvium plan` says of a joined bed: where grains are, why, and what they cost.

use super::super::super::world::Recipe;
use super::JoinedBed;
use crate::scene::{DENSE, overlap_words};
use colluvium_coupling::overlap::bowl::Growth;

impl JoinedBed<'_> {
    /// What `colluvium plan` says of it.
    pub(super) fn plan_lines(&self) -> Vec<(String, String)> {
        let mut lines = self.scene.plan();
        let scene = self.scene;
        let (Ok(materials), Ok(s)) = (
            scene.materials(&self.origin),
            scene.overlap_settings(&self.origin),
        ) else {
            return lines;
        };
        let d = scene.grain_diameter(&materials);
        let why = |given: Option<f64>| match given {
            Some(_) => "given",
            None => "computed",
        };
        lines.push((
            "zones".into(),
            format!(
                "grains in a box: {} (from the axis), {:.4} m ({:.1} d; zones.depth {}) deep below the surface, continuum beyond; {:.0} % of \
                 the grain-steps of a bed of grains",
                self.edges_in_words(d),
                scene.zone_depth(d),
                scene.zone_depth(d) / d,
                why(scene.zones.depth),
                100.0 * self.expected_shares()[0]
            ),
        ));
        let valid = self.law(DENSE).map_or(f64::INFINITY, |(_, valid)| valid);
        if let Some(growth) = scene.growth(d, &s, valid) {
            let travel = &growth.travel;
            let most = match scene.zones.budget {
                Some(most) => format!(
                    "to no more than {most} stored grains and the ball (zones.budget; packings may bring a few per cent more)"
                ),
                None => "as far as the container reaches (zones.budget left out)".into(),
            };
            lines.push((
                "box".into(),
                format!(
                    "moves by {:.4} m: a side goes outwards where the ball is nearer than {:.4} m (zones.near_diameters {}) to the inner end of its \
                     overlap, or grains beside that are faster than {:.3e} m/s (zones.wake_speed_scaled), {most}; inwards where they have been slower \
                     than {:.3e} m/s (zones.rest_speed_scaled) for {:.3e} s (zones.hold_scaled); predicted, if it comes to be as deep as a box that \
                     stays: {:.0} % of the grain-steps of a bed of grains in the end",
                    s.buffer,
                    growth.near,
                    why(scene.zones.near_diameters),
                    travel.wake,
                    travel.rest,
                    travel.hold,
                    100.0 * self.expected_shares()[1]
                ),
            ));
            lines.push(("strips".into(), self.strips(&growth)));
        }
        lines.push((
            "overlap".into(),
            format!(
                "from the box's sides inwards: {}, sideways pressure at rest forgotten in a strain of {}",
                overlap_words(&s, d),
                s.rest_strain
            ),
        ));
        let law = scene.continuum.calibrated.word().unwrap_or("none");
        lines.push((
            "continuum".into(),
            format!(
                "in space, the law calibrated for `{law}` (|τ|/p), cells of about {:.1} d",
                scene.zones.cell_diameters
            ),
        ));
        lines
    }

    /// What else a side goes outwards for, and what comes back.
    fn strips(&self, growth: &Growth) -> String {
        let scene = self.scene;
        let limit = |value: f64, key: &str| match value.is_finite() {
            true => format!("{value:.3} ({key})"),
            false => format!("none ({key} left out)"),
        };
        let back = match scene.returns_sheared() {
            true => format!(
                "there grains of packings come in their place: of {} grains each, sheared before the run at I of {:?} under one or two \
                 pressures (zones.returning, zones.sheared_inertial, zones.sheared_grains)",
                scene.sheared_grains(),
                scene.sheared_inertial(),
            ),
            false => "stored grains come back where the continuum has carried them".into(),
        };
        format!(
            "a side goes outwards, too, where the continuum beside it is sheared faster than I = {}, or what is stored there has been \
             sheared by more than {}, or grains of its inner overlap are packed to less than {} of the bed's solid fraction, or fluctuations \
             make more than {} of the pressure there; {back}",
            match (
                scene.zones.fastest_inertial,
                growth.travel.dense.fastest.is_finite()
            ) {
                (None, true) => format!(
                    "{:.3} (computed: the calibrated law's range ends there; zones.fastest_inertial left out)",
                    growth.travel.dense.fastest
                ),
                _ => limit(growth.travel.dense.fastest, "zones.fastest_inertial"),
            },
            limit(growth.misplaced, "zones.misplaced_shear"),
            match growth.travel.dense.loosest > 0.0 {
                true => limit(growth.travel.dense.loosest, "zones.loosest_scaled"),
                false => limit(f64::INFINITY, "zones.loosest_scaled"),
            },
            limit(growth.travel.dense.warmest, "zones.warmest_share"),
        )
    }

    /// Where the box ends along x and y.
    fn edges_in_words(&self, d: f64) -> String {
        let scene = self.scene;
        let axes = [("x", scene.zones.x), ("y", scene.zones.y)].into_iter();
        let edges = scene.zone_edges(d).into_iter().zip(scene.container_edges());
        let words: Vec<String> = axes
            .zip(edges)
            .map(|((name, given), (edges, wall))| {
                let why = match (given, scene.zones.half_width) {
                    (Some(_), _) => format!("zones.{name} given"),
                    (None, Some(_)) => "zones.half_width given".into(),
                    (None, None) => "zones.half_width computed".into(),
                };
                let [low, high] = edges.map(|edge| match edge.abs() >= wall {
                    true => "the wall".into(),
                    false => format!("{edge:.4} m ({:.1} d)", edge / d),
                });
                format!("{name} from {low} to {high} ({why})")
            })
            .collect();
        words.join(", ")
    }
}
