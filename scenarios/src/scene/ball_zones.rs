//! Keys of a bed that is grains about the ball and a continuum beyond, of `ball-impact` with `model = "hybrid"`.

use super::SceneError;
use super::ball_impact::{BallImpactScene, BallModel};
use super::collapse_grains::CalibratedKind;
use super::collapse_zones::{DENSE, FEWEST_GRAINS};
use super::world::{Materials, Place};
use colluvium_coupling::overlap::bowl::Growth;
use colluvium_coupling::overlap::material_edge::Travel;
use colluvium_coupling::overlap::{DenseLimits, Resolved, Scales};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Diameters of grains between the ball and the overlap, where nobody says how wide the box is.
const AROUND: f64 = 4.0;
/// Diameters of the ball between the surface and the overlap, where nobody says how deep the box is.
const UNDER: f64 = 2.0;
/// Times d/v of which all times of the overlap are parts: waves cross a grain many times in it.
const TIME: f64 = 2.0;
/// The time between two exchanges over that: a third of it costs more and is no nearer to grains alone.
const EXCHANGE: f64 = 0.6;
/// Packings in steady shear, where nobody says: inertial numbers, and grains.
const SHEARED_INERTIAL: [f64; 2] = [0.05, 0.3];
const SHEARED_GRAINS: usize = 600;
/// Pressure beside a ball over ρ v².
const STRUCK: f64 = 0.1;

/// Where grains stay, at scale 1. What is left out is computed; `colluvium plan` says it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallZoneKeys {
    /// Half of the box's edges along x and y, about the axis (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub half_width: Option<f64>,
    /// Low and high edge of the box along x (m), from the axis, instead of half_width; at or beyond a wall of the container grains
    /// reach up to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<[f64; 2]>,
    /// The same along y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<[f64; 2]>,
    /// Depth of its bottom below the surface of the bed (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub depth: Option<f64>,
    /// Edge of the continuum's cells in diameters of the grains, about: whole cells fill the container.
    #[serde(default = "three")]
    #[schemars(extend("minimum" = 0.5, "maximum" = 100.0))]
    pub cell_diameters: f64,
    /// The box grows where the ball comes near its overlap or grains beside it are fast, and shrinks where nothing moves.
    #[serde(default)]
    pub moving: bool,
    /// Distance between the ball and the inner end of the overlap below which a side of a moving box goes outwards, in
    /// diameters of the grains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub near_diameters: Option<f64>,
    /// Rms speed of the grains beside the overlap, over that of the ball at the start, above which a side of a moving box goes
    /// outwards; above rest_speed_scaled.
    #[serde(default = "wakes")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub wake_speed_scaled: f64,
    /// The same below which grains rest.
    #[serde(default = "rests")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub rest_speed_scaled: f64,
    /// Rest over √(diameter of the ball/gravity) after which a side of a moving box goes inwards; every move outwards
    /// doubles it.
    #[serde(default = "holds")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1000.0))]
    pub hold_scaled: f64,
    /// Most grains, the ball included, with zones.moving: a box does not grow where that would make more. Stored grains are counted;
    /// packings that come in their place may bring a few per cent more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 1.0e9))]
    pub budget: Option<u64>,
    /// Inertial number of the continuum beside a side of a moving box above which the side goes outwards. Left out: that up to which
    /// the calibrated law was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub fastest_inertial: Option<f64>,
    /// Solid fraction of the grains in the inner overlap of a side of a moving box, over that of the bed, below which the side goes
    /// outwards. Left out: none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub loosest_scaled: Option<f64>,
    /// Part of the pressure there that fluctuations of velocity make (kinetic over whole pressure) above which the side goes
    /// outwards. Left out: none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub warmest_share: Option<f64>,
    /// Shear of what is stored beside a side of a moving box, since it was put by, above which the side goes outwards. Left out:
    /// none is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub misplaced_shear: Option<f64>,
    /// What comes back where that has been sheared farther, with zones.moving.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub returning: Option<ReturningKind>,
    /// Inertial numbers at which packings are sheared before the run, with zones.returning = "sheared"; left out: 0.05 and 0.3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minItems" = 1, "maxItems" = 8, "items" = {"type": "number", "minimum": 1.0e-3, "maximum": 1.0}))]
    pub sheared_inertial: Option<Vec<f64>>,
    /// Grains of each of these packings; left out: 600.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 100, "maximum" = 100000))]
    pub sheared_grains: Option<u64>,
}

/// What comes back where stored grains have been sheared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ReturningKind {
    /// The stored grains, where the continuum has carried them.
    Stored,
    /// Grains of packings in steady shear, made before the run.
    Sheared,
}

fn wakes() -> f64 {
    0.1
}

fn rests() -> f64 {
    0.001
}

fn holds() -> f64 {
    0.5
}

fn three() -> f64 {
    3.0
}

impl Default for BallZoneKeys {
    fn default() -> Self {
        Self {
            half_width: None,
            x: None,
            y: None,
            depth: None,
            cell_diameters: three(),
            moving: false,
            near_diameters: None,
            wake_speed_scaled: wakes(),
            rest_speed_scaled: rests(),
            hold_scaled: holds(),
            budget: None,
            fastest_inertial: None,
            loosest_scaled: None,
            warmest_share: None,
            misplaced_shear: None,
            returning: None,
            sheared_inertial: None,
            sheared_grains: None,
        }
    }
}

/// The law of the continuum around the grains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BedContinuumKeys {
    /// The calibrated law that it takes, of grains most like those of the bed.
    #[serde(default = "glass")]
    pub calibrated: CalibratedKind,
    /// Friction μ_s at I → 0, in place of the calibrated one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 5.0))]
    pub mu_s: Option<f64>,
    /// Friction μ_2 at I → ∞, in place of the calibrated one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub mu_2: Option<f64>,
    /// Inertial number I_0 half way between, in place of the calibrated one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub i_0: Option<f64>,
}

fn glass() -> CalibratedKind {
    CalibratedKind::Glass
}

impl Default for BedContinuumKeys {
    fn default() -> Self {
        Self {
            calibrated: glass(),
            mu_s: None,
            mu_2: None,
            i_0: None,
        }
    }
}

impl BallImpactScene {
    /// Mean diameter of the bed's grains by volume (m).
    pub fn grain_diameter(&self, materials: &Materials) -> f64 {
        let volumes = materials.ingredients.iter();
        let parts: f64 = volumes.clone().map(|i| i.parts_by_volume).sum();
        let mean = volumes.map(|i| i.parts_by_volume * 2.0 * i.sizes.mean());
        mean.sum::<f64>() / parts
    }

    /// Density of the bed's grains by volume (kg/m³).
    pub fn grain_density(&self, materials: &Materials) -> f64 {
        let volumes = materials.ingredients.iter();
        let parts: f64 = volumes.clone().map(|i| i.parts_by_volume).sum();
        volumes.map(|i| i.parts_by_volume * i.density).sum::<f64>() / parts
    }

    /// Width of the overlap (m).
    fn overlap_width(&self, diameter: f64) -> f64 {
        self.overlap.how_wide().whole(diameter)
    }

    /// Half of the box's edges along x and y (m), given or computed.
    pub fn half_width(&self, diameter: f64) -> f64 {
        match self.zones.half_width {
            Some(given) => self.scale * given,
            None => self.ball_radius() + AROUND * diameter + self.overlap_width(diameter),
        }
    }

    /// Low and high edge of the box along x and y (m), given or computed.
    pub fn zone_edges(&self, diameter: f64) -> [[f64; 2]; 2] {
        let half = self.half_width(diameter);
        [self.zones.x, self.zones.y].map(|given| match given {
            Some(edges) => edges.map(|edge| self.scale * edge),
            None => [-half, half],
        })
    }

    /// Half of the container's extent along x and y (m).
    pub fn container_edges(&self) -> [f64; 2] {
        [self.container.length, self.container.width].map(|e| 0.5 * self.scale * e)
    }

    /// Edges of the box that are given: each ends beyond the ball and the overlap, or at a wall.
    fn check_edges(&self, origin: &str, overlap: f64) -> Result<(), SceneError> {
        let zones = &self.zones;
        let place = Place {
            origin,
            section: "zones",
        };
        if let (Some(half), Some(_), Some(_)) = (zones.half_width, zones.x, zones.y) {
            let range = "left out where zones.x and zones.y are given";
            return Err(place.refuse("half_width", half, range));
        }
        let least = self.ball_radius() + overlap;
        for ((key, given), wall) in [("x", zones.x), ("y", zones.y)]
            .into_iter()
            .zip(self.container_edges())
        {
            let Some(given) = given else { continue };
            for (n, outwards) in [-1.0, 1.0].into_iter().enumerate() {
                let edge = outwards * self.scale * given[n];
                if !edge.is_finite() || edge < least.min(wall) {
                    let [least, wall] = [least, wall].map(|w| outwards * w / self.scale);
                    let range = format!(
                        "at or beyond {least} (the ball and the overlap lie inside the box), or at the wall, {wall}"
                    );
                    return Err(place.refuse(&format!("{key}[{n}]"), given[n], range));
                }
            }
        }
        Ok(())
    }

    /// Depth of its bottom below the surface (m), given or computed.
    pub fn zone_depth(&self, diameter: f64) -> f64 {
        match self.zones.depth {
            Some(given) => self.scale * given,
            None if self.zones.moving => {
                let free = self.ball_radius() + AROUND * diameter;
                free + self.overlap_width(diameter)
            }
            None => self.lasting_depth(diameter),
        }
    }

    /// Depth of a box that need not grow, where nobody says how deep it is (m).
    pub fn lasting_depth(&self, diameter: f64) -> f64 {
        2.0 * UNDER * self.ball_radius() + self.overlap_width(diameter)
    }

    /// Diameters between ball and overlap below which a side goes outwards, given or computed: a box that is rounded to whole
    /// cells is not too narrow from the start.
    pub fn near_diameters(&self) -> f64 {
        let computed = (AROUND - 0.5 * self.zones.cell_diameters).max(1.0);
        self.zones.near_diameters.unwrap_or(computed)
    }

    /// When the box grows and shrinks, if it moves; `valid` is the I up to which the law was measured.
    pub fn growth(&self, diameter: f64, settings: &Resolved, valid: f64) -> Option<Growth> {
        let zones = &self.zones;
        zones.moving.then(|| Growth {
            travel: Travel {
                width: settings.buffer,
                rest: zones.rest_speed_scaled * self.speed,
                wake: zones.wake_speed_scaled * self.speed,
                hold: zones.hold_scaled * (2.0 * self.ball_radius() / self.gravity).sqrt(),
                budget: zones.budget.map_or(f64::INFINITY, |most| most as f64),
                fewest: FEWEST_GRAINS,
                dense: DenseLimits {
                    fastest: zones.fastest_inertial.unwrap_or(valid),
                    loosest: zones.loosest_scaled.unwrap_or(0.0),
                    warmest: zones.warmest_share.unwrap_or(f64::INFINITY),
                },
            },
            near: self.near_diameters() * diameter,
            misplaced: zones.misplaced_shear.unwrap_or(f64::INFINITY),
        })
    }

    /// Whether packings in steady shear are made.
    pub fn returns_sheared(&self) -> bool {
        self.zones.returning == Some(ReturningKind::Sheared)
    }

    /// I of these packings, given or not.
    pub fn sheared_inertial(&self) -> Vec<f64> {
        let given = self.zones.sheared_inertial.clone();
        given.unwrap_or_else(|| SHEARED_INERTIAL.to_vec())
    }

    /// Their grains.
    pub fn sheared_grains(&self) -> usize {
        self.zones
            .sheared_grains
            .map_or(SHEARED_GRAINS, |n| n as usize)
    }

    /// Pressures that they are sheared under (Pa): of half of the bed's depth at rest, and of its inertia beside the ball, a
    /// tenth of ρ v².
    pub fn sheared_pressures(&self, density: f64, depth: f64) -> Vec<f64> {
        let rest = 0.5 * density * self.gravity * depth;
        let struck = STRUCK * density * self.speed.powi(2);
        let more = (struck > rest).then_some(struck);
        std::iter::once(rest).chain(more).collect()
    }

    /// The overlap's settings with nothing left out.
    pub fn overlap_settings(&self, origin: &str) -> Result<Resolved, SceneError> {
        let materials = self.materials(origin)?;
        let (d, rho) = (
            self.grain_diameter(&materials),
            DENSE * self.grain_density(&materials),
        );
        let law = materials.first_law();
        // Springs are as stiff as under the pressure of the impact, F = ½ ρ v² d²/φ on a contact.
        let force = 0.5 * rho * self.speed.powi(2) * d * d / DENSE;
        let stiffness = match law.normal.elastic_modulus() {
            Some(modulus) => (6.0 * modulus * modulus * 0.25 * d * force).cbrt(),
            None => law.stiffness(0.25 * d, 0.0).normal,
        };
        let scales = Scales {
            diameter: d,
            time: TIME * d / self.speed,
            density: rho,
            stiffness,
        };
        let mut settings = self.overlap.settings(d, scales.time);
        settings.exchange_time = settings.exchange_time.or(Some(EXCHANGE * scales.time));
        settings.cell = Some(self.zones.cell_diameters * d);
        super::collapse_zones::resolved(&settings, &scales, origin)
    }

    /// What a joined bed needs beyond one of grains.
    pub(super) fn check_zones(&self, origin: &str) -> Result<(), SceneError> {
        let at = |section| Place { origin, section };
        if self.model == BallModel::Dem {
            return Ok(());
        }
        let materials = self.materials(origin)?;
        let d = self.grain_diameter(&materials);
        // Which edges the box then has room for is said of the edges.
        self.overlap.how_wide().check(d, f64::INFINITY, origin)?;
        self.overlap_settings(origin)?;
        let zones = &self.zones;
        if let (Some(budget), false) = (zones.budget, zones.moving) {
            let range =
                "given with zones.moving = true: a box that stays has no other number of grains";
            return Err(at("zones").refuse("budget", budget, range));
        }
        if let (Some(near), false) = (zones.near_diameters, zones.moving) {
            let range = "given with zones.moving = true: a box that stays is never too near";
            return Err(at("zones").refuse("near_diameters", near, range));
        }
        let given = [
            ("fastest_inertial", zones.fastest_inertial.is_some()),
            ("loosest_scaled", zones.loosest_scaled.is_some()),
            ("warmest_share", zones.warmest_share.is_some()),
            ("misplaced_shear", zones.misplaced_shear.is_some()),
            ("returning", zones.returning.is_some()),
        ];
        if let Some((key, _)) = given.iter().find(|(_, given)| *given && !zones.moving) {
            let range = "given with zones.moving = true: a box that stays gives nothing back";
            return Err(at("zones").refuse(key, "given", range));
        }
        if self.returns_sheared() && zones.misplaced_shear.is_none() {
            let range =
                "\"stored\", or given with zones.misplaced_shear, from which on packings are taken";
            return Err(at("zones").refuse("returning", "sheared", range));
        }
        let given = [
            ("sheared_inertial", zones.sheared_inertial.is_some()),
            ("sheared_grains", zones.sheared_grains.is_some()),
        ];
        if let Some((key, _)) = given
            .iter()
            .find(|(_, given)| *given && !self.returns_sheared())
        {
            let range = "given with zones.returning = \"sheared\": else no packing is made";
            return Err(at("zones").refuse(key, "given", range));
        }
        if zones.wake_speed_scaled <= zones.rest_speed_scaled {
            let range = format!(
                "above zones.rest_speed_scaled = {}",
                zones.rest_speed_scaled
            );
            return Err(at("zones").refuse("wake_speed_scaled", zones.wake_speed_scaled, range));
        }
        let keys = &self.continuum;
        let own = [keys.mu_s, keys.mu_2, keys.i_0];
        if keys.calibrated.word().is_none() && own.iter().any(Option::is_none) {
            let range =
                "moderate, gravel or glass, or mu_s, mu_2 and i_0 given: the continuum needs a law";
            return Err(at("continuum").refuse("calibrated", "none", range));
        }
        let [half, depth] = [self.half_width(d), self.zone_depth(d)];
        let overlap = self.overlap_width(d);
        self.check_edges(origin, overlap)?;
        let both_given = zones.x.is_some() && zones.y.is_some();
        for (key, value, least, is_used) in [
            (
                "half_width",
                half,
                self.ball_radius() + overlap,
                !both_given,
            ),
            ("depth", depth, overlap, true),
        ] {
            if is_used && value <= least {
                let range = format!("above {}: the overlap lies inside it", least / self.scale);
                return Err(at("zones").refuse(key, value / self.scale, range));
            }
        }
        let edges = self.container_edges();
        if zones.x.is_none() && zones.y.is_none() && edges.iter().all(|edge| half >= *edge) {
            let range = format!(
                "below {}: beyond it lies the continuum",
                edges.iter().fold(0.0, |most: f64, e| most.max(*e)) / self.scale
            );
            return Err(at("zones").refuse("half_width", half / self.scale, range));
        }
        Ok(())
    }
}
