//! Keys of an incline that is grains, continuum, or both.

use super::overlap_width::OverlapWidth;
use super::{FrictionLaw, InclineScene, RheologyKeys, SceneError};
use colluvium_coupling::overlap::{NormalMotion, OverlapSettings, StressKernel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the layer on an incline is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum InclineModel {
    /// Grains.
    #[default]
    Dem,
    /// A μ(I) continuum of the same mass.
    Continuum,
    /// Grains below the edge of `[overlap]`, continuum above it.
    Hybrid,
}

impl InclineModel {
    /// Its name in a scene.
    pub fn word(self) -> &'static str {
        match self {
            InclineModel::Dem => "dem",
            InclineModel::Continuum => "continuum",
            InclineModel::Hybrid => "hybrid",
        }
    }
}

/// Where grains end and continuum begins. What is left out is computed; `colluvium plan` says it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OverlapKeys {
    /// Height of the edge where grains end, in diameters.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub height_diameters: f64,
    /// Until then all are grains (s). At 0 no grain is ever made above the edge.
    #[serde(default)]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e6))]
    pub from: f64,
    /// Height of the continuum's cells, about, in diameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.25, "maximum" = 100.0))]
    pub cell_diameters: Option<f64>,
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
    /// Half width of Lucy's kernel for the grains' stress, in diameters; without it the mean over a cell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub kernel_diameters: Option<f64>,
    /// Time over which stresses of grains are averaged (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub stress_time: Option<f64>,
    /// Time in which mean velocities in the buffer relax to each other (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub relaxation_time: Option<f64>,
    /// Time in which the continuum follows the grains in the inner overlap (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub following_time: Option<f64>,
    /// Time in which mean spins in the buffer relax to half the vorticity (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub spin_time: Option<f64>,
    /// Time step of the continuum (s).
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
    /// What the continuum does along the normal of the edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_motion: Option<NormalMotionKind>,
    /// Neither side acts on the other: what a coupling has to do better than.
    #[serde(default)]
    pub uncoupled: bool,
}

/// What the continuum does along the normal of the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NormalMotionKind {
    /// It keeps its place, and absorbs what goes through the impedance.
    Held,
    /// It rides on the grains as a rigid body of its mass.
    Riding,
}

impl OverlapKeys {
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

    /// The settings, for grains of this mean diameter (m).
    pub fn settings(&self, diameter: f64) -> OverlapSettings {
        let length = |diameters: Option<f64>| diameters.map(|n| n * diameter);
        let [inner, buffer, shell] = self.how_wide().parts(diameter);
        OverlapSettings {
            cell: length(self.cell_diameters),
            inner,
            buffer,
            shell,
            kernel: length(self.kernel_diameters).map_or(StressKernel::Layer, StressKernel::Lucy),
            stress_time: self.stress_time,
            relaxation_time: self.relaxation_time,
            following_time: self.following_time,
            spin_time: self.spin_time,
            exchange_time: self.exchange_time,
            load_time: self.load_time,
            impedance: self.impedance,
            normal_motion: self.normal_motion.map(|motion| match motion {
                NormalMotionKind::Held => NormalMotion::Held,
                NormalMotionKind::Riding => NormalMotion::Riding,
            }),
            rest_strain: None,
            uncoupled: self.uncoupled,
        }
    }

    /// The scene's key for a setting of an overlap, and whether it is a length in diameters.
    pub fn key(setting: &str) -> (String, bool) {
        match setting {
            "height" | "cell" | "inner" | "buffer" | "shell" => {
                (format!("overlap.{setting}_diameters"), true)
            }
            "kernel.lucy" => ("overlap.kernel_diameters".into(), true),
            other => (format!("overlap.{other}"), false),
        }
    }
}

impl InclineScene {
    /// Mass that so many grains of the size law have on average, one of them (kg).
    pub fn expected_mass(&self) -> f64 {
        // ⟨(1 + x)³⟩ = 1 + 3⟨x²⟩: both laws are even about their mean.
        (1.0 + 3.0 * self.size_variance()) * self.mean_mass()
    }

    /// Mass of all free grains, of the continuum in their place, or of both (kg).
    pub fn total_mass(&self) -> f64 {
        self.free_grains() as f64 * self.expected_mass()
    }

    /// Depth of that mass at the density of `[rheology]` (m).
    pub fn continuum_depth(&self, rheology: &RheologyKeys) -> f64 {
        let [length, width] = self.floor_edges();
        let density = rheology.solid_fraction * rheology.grain_density;
        self.total_mass() / (density * length * width)
    }

    /// Law and edge, where the model has a continuum.
    pub fn continuum_keys(&self) -> Option<(&RheologyKeys, &OverlapKeys)> {
        match self.model {
            InclineModel::Dem => None,
            _ => Some((self.rheology.as_ref()?, self.overlap.as_ref()?)),
        }
    }

    /// What a continuum needs, and where its edge may lie.
    pub(super) fn check_model(&self, origin: &str) -> Result<(), SceneError> {
        if self.model == InclineModel::Dem {
            return Ok(());
        }
        let missing = |key: &str, wanted: &str| SceneError::MissingKey {
            file: origin.to_owned(),
            key: key.into(),
            wanted: format!("{wanted}, for model = \"{}\"", self.model.word()),
        };
        let out_of_range = |key: &str, value: String, range: String| {
            Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: key.into(),
                value,
                range,
            })
        };
        let Some(rheology) = &self.rheology else {
            return Err(missing(
                "rheology",
                "a table with file = \"rheology.toml\", or with mu_s, mu_2, i_0, diameter, solid_fraction, grain_density",
            ));
        };
        let Some(overlap) = &self.overlap else {
            return Err(missing("overlap", "a table with height_diameters"));
        };
        if rheology.law != FrictionLaw::MuI {
            return out_of_range(
                "rheology.law",
                rheology.law.word().into(),
                "mu-i: inclines are joined under this law alone".into(),
            );
        }
        if let Err(colluvium_continuum::Error::OutOfRange {
            key,
            value,
            allowed,
        }) = rheology.mu_i().validate()
        {
            return out_of_range(key, value.to_string(), allowed);
        }
        if self.model == InclineModel::Hybrid {
            let (d, height) = (self.grains.diameter, overlap.height_diameters);
            overlap.how_wide().check(d, height * d, origin)?;
        }
        // At the end of an average window both models have to have one.
        if self.model == InclineModel::Hybrid && overlap.from > self.time.relax {
            return out_of_range(
                "overlap.from",
                overlap.from.to_string(),
                format!(
                    "[0, {}], at most time.relax, when averages begin",
                    self.time.relax
                ),
            );
        }
        Ok(())
    }

    /// Variance of a diameter over its mean squared.
    fn size_variance(&self) -> f64 {
        let spread = self.grains.spread;
        match self.grains.sizes {
            super::SizeLaw::Uniform => spread * spread / 3.0,
            super::SizeLaw::Gaussian => spread * spread * variance_of_cut_normal(self.grains.cut),
        }
    }
}

/// Variance of the normal distribution cut at so many standard deviations: ∫x²e^{−x²/2}/∫e^{−x²/2}, by Simpson's rule.
fn variance_of_cut_normal(cut: f64) -> f64 {
    const INTERVALS: usize = 64;
    let mut sums = [0.0; 2];
    for k in 0..=INTERVALS {
        let x = cut * k as f64 / INTERVALS as f64;
        let weight = match k {
            0 | INTERVALS => 1.0,
            k if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let density = weight * (-0.5 * x * x).exp();
        sums[0] += density * x * x;
        sums[1] += density;
    }
    sums[0] / sums[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_of_a_cut_normal_law_has_its_limits() {
        // Uncut it is 1, and 1/3 of the cut squared where the density is flat.
        assert!((variance_of_cut_normal(8.0) - 1.0).abs() < 1e-6);
        assert!((variance_of_cut_normal(0.1) - 0.01 / 3.0).abs() < 1e-5);
    }
}
