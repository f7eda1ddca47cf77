//! Keys of a column that is grains in front and a continuum behind, of the collapse with `model = "hybrid"`.

use super::grain_intervals::{GrainIntervals, LEAST_GRAINS};
use super::overlap_width::OverlapWidth;
use super::world::Place;
use super::{CollapseScene, SceneError};
use colluvium_coupling::overlap::material_edge::Travel;
use colluvium_coupling::overlap::{
    DenseLimits, NormalMotion, OverlapError, OverlapSettings, Resolved, Scales,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where there are grains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColumnZoneKeys {
    /// Distance over the column's height at which grains begin, from the wall; what is left out is computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 50.0))]
    pub edge_scaled: Option<f64>,
    /// Low and high end of the grains along x (m), from the wall, instead of edge_scaled: continuum on both sides of them. At or
    /// beyond the wall, or the foot of the column, grains reach up to it. A list of such intervals, rising, has continuum between
    /// them: [[0, 1], [2.6, 99]] is grains at the wall and at the front, and a continuum with an edge at each end. A continuum that has
    /// the column's front runs out over the terrain; edges lie where that is level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<GrainIntervals>,
    /// Distance over the column's height, from the wall, within which the material is not computed: it rests behind a
    /// smooth wall. Left out, it is computed; 0 computes all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 50.0))]
    pub rest_scaled: Option<f64>,
    /// The edge moves: what has come to rest beside it becomes continuum, and what begins to move behind it becomes
    /// grains again.
    #[serde(default)]
    pub moving: bool,
    /// Rms speed over √(gravity diameter) below which grains beside a moving edge rest.
    #[serde(default = "rests")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub rest_speed_scaled: f64,
    /// The same above which the continuum behind a moving edge moves; above rest_speed_scaled.
    #[serde(default = "wakes")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub wake_speed_scaled: f64,
    /// Rest over √(height/gravity) after which grains become continuum; every return doubles it.
    #[serde(default = "holds")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1000.0))]
    pub hold_scaled: f64,
    /// Inertial number above which the continuum behind a moving edge becomes grains again, where a tenth of it exceeds it. Left
    /// out: none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub fastest_inertial: Option<f64>,
    /// Solid fraction of the grains in the inner overlap of a moving edge, over that of the settled column, below which what is
    /// behind it becomes grains again. Left out: none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub loosest_scaled: Option<f64>,
    /// Part of the pressure there that fluctuations of velocity make (kinetic over whole pressure) above which it does. Left out:
    /// none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub warmest_share: Option<f64>,
    /// The edge by the oracle instead: a run of the continuum alone comes first, and material that makes more strain
    /// than this under a friction in doubt is grains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub tolerance: Option<f64>,
    /// Most grains that are free (those of a rough floor do not count), with zones.tolerance or zones.moving. Where the oracle needs more, the tolerance is raised, and the
    /// plan says so; an edge that moves does not move where that would make more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 1.0e9))]
    pub budget: Option<u64>,
}

impl Default for ColumnZoneKeys {
    fn default() -> Self {
        Self {
            edge_scaled: None,
            x: None,
            rest_scaled: None,
            moving: false,
            rest_speed_scaled: rests(),
            wake_speed_scaled: wakes(),
            hold_scaled: holds(),
            fastest_inertial: None,
            loosest_scaled: None,
            warmest_share: None,
            tolerance: None,
            budget: None,
        }
    }
}

impl ColumnZoneKeys {
    /// What grains are needed for behind a moving edge, beside what moves.
    pub fn dense_limits(&self) -> DenseLimits {
        let DenseLimits {
            fastest,
            loosest,
            warmest,
        } = DenseLimits::NONE;
        DenseLimits {
            fastest: self.fastest_inertial.unwrap_or(fastest),
            loosest: self.loosest_scaled.unwrap_or(loosest),
            warmest: self.warmest_share.unwrap_or(warmest),
        }
    }
}

fn rests() -> f64 {
    0.06
}

fn wakes() -> f64 {
    0.3
}

fn holds() -> f64 {
    0.2
}

/// The overlap of both, from the edge into the grains. What is left out is computed; `colluvium plan` says it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColumnOverlapKeys {
    /// Width of the overlap as a whole (m): half of it buffer, half inner overlap, and the shell a third of it within the
    /// buffer, as where nothing is given. Instead of those three.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub width: Option<f64>,
    /// Width of the inner overlap, where stresses of grains enter the continuum, in diameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub inner_diameters: Option<f64>,
    /// Width of the buffer, where mean velocities relax to each other, in diameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub buffer_diameters: Option<f64>,
    /// Width of the shell of grains that bears the continuum's traction, in diameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub shell_diameters: Option<f64>,
    /// Width of the continuum's cells, about, in diameters; left out, that of grid.cells, or 1.5 where that is finer: a
    /// law of many grains has no finer features, and they cost most of a run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.25, "maximum" = 100.0))]
    pub cell_diameters: Option<f64>,
    /// Time over which stresses of grains are averaged (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub stress_time: Option<f64>,
    /// Time in which mean velocities in the buffer relax to each other (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub relaxation_time: Option<f64>,
    /// Time in which mean spins in the buffer relax to half of the curl of the continuum's velocity (s); left out, √(d/g), of an
    /// impact as long as the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub spin_time: Option<f64>,
    /// Time in which the continuum follows the grains in the inner overlap (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub following_time: Option<f64>,
    /// Time between two exchanges (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub exchange_time: Option<f64>,
    /// Time for which forces on grains of the overlap are held (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub load_time: Option<f64>,
    /// Acoustic impedance of the edge (Pa s/m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e15))]
    pub impedance: Option<f64>,
    /// Shear strain after which the continuum has forgotten how its grains pressed sideways at rest (K_0); 0.01 if left out, 0 for a
    /// continuum that presses sideways as μ(I) has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1000.0))]
    pub rest_strain: Option<f64>,
    /// Neither side acts on the other: what a coupling has to do better than.
    #[serde(default)]
    pub uncoupled: bool,
}

impl ColumnOverlapKeys {
    /// How wide it is.
    pub(super) fn how_wide(&self) -> OverlapWidth {
        OverlapWidth {
            width: self.width,
            parts: [
                self.inner_diameters,
                self.buffer_diameters,
                self.shell_diameters,
            ],
        }
    }

    /// The settings, for grains of this mean diameter (m) and this √(d/g) (s).
    pub(super) fn settings(&self, diameter: f64, time: f64) -> OverlapSettings {
        let soon = Some(TOGETHER * time);
        let [inner, buffer, shell] = self.how_wide().parts(diameter);
        OverlapSettings {
            inner,
            buffer,
            shell,
            stress_time: self.stress_time,
            relaxation_time: self.relaxation_time.or(soon),
            spin_time: self.spin_time,
            following_time: self.following_time.or(soon),
            exchange_time: self.exchange_time,
            load_time: self.load_time,
            impedance: self.impedance,
            rest_strain: self.rest_strain,
            normal_motion: Some(NormalMotion::Held),
            uncoupled: self.uncoupled,
            ..OverlapSettings::default()
        }
    }
}

/// An overlap in words, for grains of this diameter (m).
pub fn overlap_words(s: &Resolved, d: f64) -> String {
    format!(
        "overlap.width {:.4} m, of which shell {:.1} d, buffer {:.1} d (the shell in it), inner overlap {:.1} d; loads held {:.2e} s, exchange every {:.2e} s, stresses averaged over \
         {:.2e} s, relaxation {:.2e} s, of spins {:.2e} s, following {:.2e} s, impedance {:.3e} Pa s/m",
        s.inner + s.buffer,
        s.shell / d,
        s.buffer / d,
        s.inner / d,
        s.load_time,
        s.exchange_time,
        s.stress_time,
        s.relaxation_time,
        s.spin_time,
        s.following_time,
        s.impedance
    )
}

/// Relaxation and following times over √(d/g): with 1 of it, as on an incline, the continuum behind a heap that has
/// come to rest goes on creeping past its grains.
const TOGETHER: f64 = 0.2;
/// Width of cells in diameters below which nobody says that they are to be finer.
const CELL: f64 = 1.5;
/// Solid fraction of a settled column, before it is there to be measured.
pub const DENSE: f64 = 0.57;
/// Column heights in front of the foot's end that begin to flow: a collapse fails along a plane from there, which
/// in grains of friction 0.5 to 0.6 is 55 to 60 degrees steep, and its surface eats its way back beyond that.
const FLOWS: f64 = 0.8;
/// Column heights behind the edge of which the continuum is computed, if nobody says how many.
const BEHIND: f64 = 1.5;
/// Fewest grains beyond the overlap of an edge that moves.
pub(super) const FEWEST_GRAINS: f64 = 50.0;
/// Fewest diameters of continuum behind the edge.
const LEAST_CONTINUUM: f64 = 3.0;

/// Settings with nothing left out, or what is wrong with them by the keys that they have in a scene.
pub(super) fn resolved(
    settings: &OverlapSettings,
    scales: &Scales,
    origin: &str,
) -> Result<Resolved, SceneError> {
    settings
        .resolve(scales, false)
        .map_err(|error| match error {
            OverlapError::OutOfRange {
                key,
                value,
                allowed,
            } => {
                let (key, unit) = match key {
                    "inner" | "buffer" | "shell" => {
                        (format!("overlap.{key}_diameters"), scales.diameter)
                    }
                    "cell" => (format!("zones.{key}_diameters"), scales.diameter),
                    _ => (format!("overlap.{key}"), 1.0),
                };
                SceneError::OutOfRange {
                    file: origin.to_owned(),
                    key,
                    // Diameters there and back leave digits behind that nobody wrote.
                    value: ((value / unit * 1e9).round() / 1e9).to_string(),
                    range: allowed.to_owned(),
                }
            }
            other => SceneError::Unreadable {
                file: origin.to_owned(),
                message: other.to_string(),
            },
        })
}

impl CollapseScene {
    /// Distance from the wall of the edge that has its continuum there (m), given or computed; 0 without one.
    pub fn edge(&self) -> f64 {
        let first = self.zones.x.as_ref().map(|x| x.list().first());
        match (first, self.zones.edge_scaled) {
            (Some(first), _) => first.map_or(0.0, |[from, _]| from.max(0.0)),
            (None, Some(scaled)) => scaled * self.height,
            (None, None) => {
                let d = self.grains.diameter;
                let overlap = self.overlap.how_wide().whole(d);
                self.width() - (FLOWS * self.height).max(overlap + LEAST_GRAINS * d)
            }
        }
    }

    /// How far from the wall the material rests (m), given or computed.
    pub fn rest(&self) -> f64 {
        match self.zones.rest_scaled {
            Some(scaled) => scaled * self.height,
            None => (self.edge() - BEHIND * self.height).max(0.0),
        }
    }

    /// When the edge moves on to other material, for an overlap with these settings.
    pub fn travel(&self, settings: &Resolved) -> Option<Travel> {
        let unit = (self.gravity * self.grains.diameter).sqrt();
        self.zones.moving.then(|| Travel {
            width: settings.buffer,
            rest: self.zones.rest_speed_scaled * unit,
            wake: self.zones.wake_speed_scaled * unit,
            hold: self.zones.hold_scaled * (self.height / self.gravity).sqrt(),
            budget: self.zones.budget.map_or(f64::INFINITY, |most| most as f64),
            fewest: FEWEST_GRAINS,
            dense: self.zones.dense_limits(),
        })
    }

    /// The overlap's settings with nothing left out.
    pub fn overlap_settings(&self, origin: &str) -> Result<Resolved, SceneError> {
        let (d, grains) = (self.grains.diameter, &self.grains);
        let mass = grains.density * std::f64::consts::PI / 6.0 * d.powi(3);
        let law = self.law_keys();
        let scales = Scales {
            diameter: d,
            time: (d / self.gravity).sqrt(),
            density: DENSE * grains.density,
            // Grains without springs of a fixed stiffness are as stiff as the scaled key says.
            stiffness: law
                .stiffness
                .unwrap_or(grains.stiffness_scaled * mass * self.gravity / d),
        };
        resolved(&self.overlap.settings(d, scales.time), &scales, origin)
    }

    /// Where the edge may lie with an overlap so wide (m).
    pub fn edge_range(&self, overlap: f64) -> [f64; 2] {
        let d = self.grains.diameter;
        [
            (LEAST_CONTINUUM * d).max(2.0 * self.spacing()),
            self.width() - overlap - LEAST_GRAINS * d,
        ]
    }

    /// Whether a column of grains alone could be joined where its keys say, on level ground.
    pub fn has_room_for_a_joint(&self) -> bool {
        let Ok(settings) = self.overlap_settings("") else {
            return false;
        };
        let [least, most] = self.edge_range(settings.inner + settings.buffer);
        let has_place = match &self.zones.x {
            None => (least..=most * (1.0 + 1e-12)).contains(&self.edge()),
            Some(_) => self.check_intervals("").is_ok(),
        };
        has_place && self.zones.tolerance.is_none() && self.terrain.is_none()
    }

    /// What a joined column needs beyond one of grains.
    pub(super) fn check_zones(&self, origin: &str) -> Result<(), SceneError> {
        self.check_grains(origin)?;
        let at = |section| Place { origin, section };
        let (d, h) = (self.grains.diameter, self.height);
        let [behind, room] = self.edge_range(0.0);
        self.overlap.how_wide().check(d, room - behind, origin)?;
        let settings = self.overlap_settings(origin)?;
        let overlap = settings.inner + settings.buffer;
        let [least, most] = self.edge_range(overlap).map(|x| x / h);
        if least >= most {
            let range = format!(
                "smaller: a column of width {:.4} m has no room for {:.4} m of continuum, an overlap of {overlap:.4} m and {:.4} m of \
                 grains; at least {:.4} m",
                self.width(),
                least * h,
                LEAST_GRAINS * d,
                least * h + overlap + LEAST_GRAINS * d
            );
            return Err(at("").refuse("aspect", self.aspect, &range));
        }
        let zones = &self.zones;
        if zones.budget.is_some() && zones.tolerance.is_none() && !zones.moving {
            let range = "given with zones.tolerance or zones.moving = true: an edge that is given and stays has no other number of grains";
            return Err(at("zones").refuse("budget", zones.budget.unwrap_or(0), range));
        }
        let given = [
            ("fastest_inertial", zones.fastest_inertial),
            ("loosest_scaled", zones.loosest_scaled),
            ("warmest_share", zones.warmest_share),
        ];
        if let Some((key, Some(value))) = given.iter().find(|(_, value)| value.is_some())
            && !zones.moving
        {
            let range =
                "given with zones.moving = true: an edge that stays makes no room for grains";
            return Err(at("zones").refuse(key, value, range));
        }
        if let (Some(_), Some(edge)) = (zones.tolerance, zones.edge_scaled) {
            let range = "left out where zones.tolerance is given: the oracle puts the edge";
            return Err(at("zones").refuse("edge_scaled", edge, range));
        }
        if let (Some(_), Some(edge)) = (&zones.x, zones.edge_scaled) {
            let range = "left out where zones.x is given";
            return Err(at("zones").refuse("edge_scaled", edge, range));
        }
        if zones.wake_speed_scaled <= zones.rest_speed_scaled {
            let range = format!(
                "above zones.rest_speed_scaled = {}",
                zones.rest_speed_scaled
            );
            return Err(at("zones").refuse("wake_speed_scaled", zones.wake_speed_scaled, range));
        }
        if let Some(x) = &zones.x {
            if zones.tolerance.is_some() {
                let range = "left out where zones.tolerance is given: the oracle puts one edge";
                return Err(at("zones").refuse("x", x, range));
            }
            self.check_intervals(origin)?;
            return self.check_rest(least, origin);
        }
        if let Some(tolerance) = zones.tolerance {
            // The oracle's run of the continuum alone is of an upright column on level ground.
            if self.terrain.is_some() || self.overhang_degrees != 0.0 {
                let range = "left out with [terrain] or an overhang: the oracle follows an upright column on level ground; give zones.edge_scaled or zones.x";
                return Err(at("zones").refuse("tolerance", tolerance, range));
            }
            return match zones.rest_scaled {
                None => Ok(()),
                Some(rest) => {
                    let range =
                        "left out where zones.tolerance is given: the oracle says what rests";
                    Err(at("zones").refuse("rest_scaled", rest, range))
                }
            };
        }
        let edge = self.edge() / h;
        if !(least..=most * (1.0 + 1e-12)).contains(&edge) {
            let range = format!("[{least:.4}, {most:.4}] for this column and overlap");
            return match self.zones.edge_scaled {
                Some(_) => Err(at("zones").refuse("edge_scaled", edge, &range)),
                None => Err(at("zones").refuse(
                    "edge_scaled",
                    format!("{edge:.4} (computed: what lies {FLOWS} heights behind the foot hardly flows)"),
                    format!("{range}: a column of smaller aspect, or an edge of your own"),
                )),
            };
        }
        self.check_rest(least, origin)
    }

    /// Some continuum lies behind the edge on the wall's side: at least so many heights of it.
    fn check_rest(&self, least: f64, origin: &str) -> Result<(), SceneError> {
        let at = Place {
            origin,
            section: "zones",
        };
        if self.edge() <= 0.0 {
            return match self.zones.rest_scaled {
                None => Ok(()),
                Some(rest) => Err(at.refuse(
                    "rest_scaled",
                    rest,
                    "left out where grains reach up to the wall",
                )),
            };
        }
        let (rest, most) = (self.rest() / self.height, self.edge() / self.height - least);
        if rest > most {
            let range = format!("[0, {most:.4}]: some continuum lies behind the edge");
            return Err(at.refuse("rest_scaled", rest, range));
        }
        Ok(())
    }

    /// Cells of the continuum beside grains along x.
    pub fn joined_cells(&self) -> usize {
        let length = self.grid.length_scaled * self.height;
        let wide = |diameters: f64| length / (diameters * self.grains.diameter);
        let cells = match self.overlap.cell_diameters {
            Some(diameters) => wide(diameters),
            None => wide(CELL).min(self.cells() as f64),
        };
        cells.round().max(8.0) as usize
    }

    /// Edge of one of them (m).
    pub fn spacing(&self) -> f64 {
        self.grid.length_scaled * self.height / self.joined_cells() as f64
    }
}
