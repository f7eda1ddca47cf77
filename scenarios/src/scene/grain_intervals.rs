//! Intervals along x in which a joined column is grains, and what such intervals need.

use super::world::Place;
use super::{CollapseScene, SceneError};
use colluvium_coupling::overlap::material_edge::Side;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Fewest diameters of grains between overlaps, or in front of one.
pub(super) const LEAST_GRAINS: f64 = 4.0;
/// Fewest cells of a continuum between two edges.
const LEAST_BETWEEN: f64 = 3.0;

/// Low and high ends along x (m), rising.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "[from, to] in metres, or a list of such intervals, [[from, to], [from, to]]"
)]
pub enum GrainIntervals {
    /// `[from, to]`
    One([f64; 2]),
    /// `[[from, to], [from, to]]`
    Several(Vec<[f64; 2]>),
}

impl GrainIntervals {
    /// All of them.
    pub fn list(&self) -> &[[f64; 2]] {
        match self {
            Self::One(one) => std::slice::from_ref(one),
            Self::Several(list) => list,
        }
    }
}

impl fmt::Display for GrainIntervals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = |[from, to]: &[f64; 2]| format!("[{from}, {to}]");
        match self {
            Self::One(one) => f.write_str(&of(one)),
            Self::Several(list) => {
                let list: Vec<String> = list.iter().map(of).collect();
                write!(f, "[{}]", list.join(", "))
            }
        }
    }
}

impl CollapseScene {
    /// Edges of the grains along x, on which side of them their continuum lies and their places (m), given or computed.
    pub fn edges(&self) -> Vec<(Side, f64)> {
        let Some(intervals) = &self.zones.x else {
            return vec![(Side::Below, self.edge())];
        };
        let width = self.width();
        let ends = |[from, to]: &[f64; 2]| {
            let below = (*from > 0.0).then_some((Side::Below, *from));
            let above = (*to < width).then_some((Side::Above, *to));
            below.into_iter().chain(above)
        };
        intervals.list().iter().flat_map(ends).collect()
    }

    /// Low and high edges of the continua along x (m); none where one reaches the wall, or has the column's front.
    pub fn continua(&self) -> Vec<[Option<f64>; 2]> {
        let mut all = Vec::new();
        let mut low = None;
        for (side, place) in self.edges() {
            match side {
                Side::Below => all.push([low.take(), Some(place)]),
                Side::Above => low = Some(place),
            }
        }
        all.extend(low.map(|place| [Some(place), None]));
        all
    }

    /// Whether what runs out is a continuum.
    pub fn has_front_of_continuum(&self) -> bool {
        self.continua().iter().any(|[_, high]| high.is_none())
    }

    /// What intervals of grains need: continuum behind their edges, grains between their overlaps.
    pub(super) fn check_intervals(&self, origin: &str) -> Result<(), SceneError> {
        let Some(intervals) = &self.zones.x else {
            return Ok(());
        };
        let settings = self.overlap_settings(origin)?;
        let overlap = settings.inner + settings.buffer;
        let at = Place {
            origin,
            section: "zones",
        };
        let refuse = |range: String| Err(at.refuse("x", intervals, range));
        let width = self.width();
        let list = intervals.list();
        let is_one = |[from, to]: &[f64; 2]| from.is_finite() && to.is_finite() && from < to;
        let rises = list.windows(2).all(|pair| pair[0][1] < pair[1][0]);
        if list.is_empty() || !list.iter().all(is_one) || !rises {
            return refuse(
                "[from, to] with from < to, or a list of such intervals that rises, [[from, to], [from, to]]: grains lie in them, and continuum \
                 between them and beside them"
                    .into(),
            );
        }
        if list.iter().any(|[from, to]| *from >= width || *to <= 0.0) {
            return refuse(format!("within the column, which is {width:.4} m wide"));
        }
        let continua = self.continua();
        if continua.is_empty() {
            return refuse(format!(
                "narrower than the column, which is {width:.4} m wide: it leaves no continuum (model = \"dem\")"
            ));
        }
        let [least, _] = self.edge_range(0.0);
        for ends in &continua {
            let [from, to] = [ends[0].unwrap_or(0.0), ends[1].unwrap_or(width)];
            let least = match ends {
                [Some(_), Some(_)] => least.max(LEAST_BETWEEN * self.spacing()),
                _ => least,
            };
            if to - from >= least * (1.0 - 1e-12) {
                continue;
            }
            return refuse(match ends {
                [Some(_), Some(_)] => format!(
                    "at least {least:.4} m apart: some continuum lies between two intervals"
                ),
                _ => format!(
                    "at the end of the column (0 and {width:.4} m) or at least {least:.4} m from it: some continuum lies behind an edge"
                ),
            });
        }
        for [from, to] in list {
            let edges = usize::from(*from > 0.0) + usize::from(*to < width);
            let grains = edges as f64 * overlap + LEAST_GRAINS * self.grains.diameter;
            if to.min(width) - from.max(0.0) < grains * (1.0 - 1e-12) {
                return refuse(format!(
                    "at least {grains:.4} m wide: {} of {overlap:.4} m and {LEAST_GRAINS} diameters of grains",
                    if edges > 1 {
                        "two overlaps"
                    } else {
                        "an overlap"
                    },
                ));
            }
        }
        Ok(())
    }
}
