//! Keys of the flows between plates and between walls that have exact solutions.

use super::bagnold::{BagnoldGrid, RheologyKeys, SolverKeys, check_grid, check_law};
use super::{FrictionLaw, SceneError};
use colluvium_continuum::Error;
use colluvium_continuum::plane_shear::PlaneShearCase;
use colluvium_continuum::rheology::{AnyLaw, Rheology, ShearLaw};
use colluvium_continuum::vertical_chute::VerticalChuteCase;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Material sheared between two rough plates under a load, without gravity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneShearScene {
    /// Distance between the plates (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub gap: f64,
    /// Velocity of the upper plate (m/s); the lower one rests.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub wall_velocity: f64,
    /// Normal stress on the upper plate (Pa).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e12))]
    pub load: f64,
    /// Size of the run: cells across the gap grow with it.
    #[schemars(extend("minimum" = 0.1, "maximum" = 64.0))]
    pub scale: f64,
    /// The material.
    pub rheology: RheologyKeys,
    /// The grid.
    pub grid: BagnoldGrid,
    /// The solver.
    pub solver: SolverKeys,
}

/// One half of a vertical chute, from its plane of symmetry to a rough wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VerticalChuteScene {
    /// Half width of the chute (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub half_width: f64,
    /// Normal stress on the wall (Pa).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e12))]
    pub load: f64,
    /// Gravity, along the chute (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Size of the run: cells across the half width grow with it.
    #[schemars(extend("minimum" = 0.1, "maximum" = 64.0))]
    pub scale: f64,
    /// The material.
    pub rheology: RheologyKeys,
    /// The grid.
    pub grid: BagnoldGrid,
    /// The solver.
    pub solver: SolverKeys,
}

/// A flow between plates or walls.
#[derive(Clone, Debug, PartialEq)]
pub enum ShearedScene {
    /// Between two plates.
    PlaneShear(Box<PlaneShearScene>),
    /// In a vertical chute.
    VerticalChute(Box<VerticalChuteScene>),
}

/// The flow's case, with its law.
pub enum ShearedCase {
    /// Between two plates.
    PlaneShear(PlaneShearCase<AnyLaw>),
    /// In a vertical chute.
    VerticalChute(VerticalChuteCase<AnyLaw>),
}

/// What is known of a flow before it is computed.
#[derive(Clone, Copy, Debug)]
pub struct ExactFlow {
    /// Largest velocity (m/s): of the moving plate, or in the middle of the chute.
    pub velocity: f64,
    /// Shear stress on the wall (Pa), without its sign.
    pub wall_stress: f64,
    /// Inertial number at the wall.
    pub wall_inertial_number: f64,
    /// Whether short waves do not grow at the wall.
    pub well_posed: bool,
    /// Half width of the rigid plug (m); 0 between plates.
    pub plug: f64,
    /// Whether friction grows with the strain rate at the wall.
    pub is_rising: bool,
}

impl ShearedScene {
    /// The scene's name.
    pub fn name(&self) -> &'static str {
        match self {
            ShearedScene::PlaneShear(_) => "plane-shear",
            ShearedScene::VerticalChute(_) => "vertical-chute",
        }
    }

    /// The JSON Schema of the scene of this name.
    pub fn schema(name: &str) -> serde_json::Value {
        match name {
            "plane-shear" => schemars::schema_for!(PlaneShearScene),
            _ => schemars::schema_for!(VerticalChuteScene),
        }
        .to_value()
    }

    /// Reads the keys of the scene of this name.
    ///
    /// # Errors
    /// Keys that the scene does not have.
    pub fn read(name: &str, table: toml::Table) -> Result<ShearedScene, toml::de::Error> {
        Ok(match name {
            "plane-shear" => ShearedScene::PlaneShear(table.try_into()?),
            _ => ShearedScene::VerticalChute(table.try_into()?),
        })
    }

    /// Every key as it was read.
    ///
    /// # Errors
    /// None for keys that were read.
    pub fn to_table(&self) -> Result<toml::Table, toml::ser::Error> {
        match self {
            ShearedScene::PlaneShear(keys) => toml::Table::try_from(keys),
            ShearedScene::VerticalChute(keys) => toml::Table::try_from(keys),
        }
    }

    /// The material.
    pub fn rheology(&self) -> &RheologyKeys {
        match self {
            ShearedScene::PlaneShear(keys) => &keys.rheology,
            ShearedScene::VerticalChute(keys) => &keys.rheology,
        }
    }

    /// The solver.
    pub fn solver(&self) -> &SolverKeys {
        match self {
            ShearedScene::PlaneShear(keys) => &keys.solver,
            ShearedScene::VerticalChute(keys) => &keys.solver,
        }
    }

    /// The grid.
    pub fn grid(&self) -> &BagnoldGrid {
        match self {
            ShearedScene::PlaneShear(keys) => &keys.grid,
            ShearedScene::VerticalChute(keys) => &keys.grid,
        }
    }

    /// Size of the run.
    fn scale(&self) -> f64 {
        match self {
            ShearedScene::PlaneShear(keys) => keys.scale,
            ShearedScene::VerticalChute(keys) => keys.scale,
        }
    }

    /// Distance across the layer (m).
    pub fn breadth(&self) -> f64 {
        match self {
            ShearedScene::PlaneShear(keys) => keys.gap,
            ShearedScene::VerticalChute(keys) => keys.half_width,
        }
    }

    /// Normal stress on the wall (Pa).
    pub fn load(&self) -> f64 {
        match self {
            ShearedScene::PlaneShear(keys) => keys.load,
            ShearedScene::VerticalChute(keys) => keys.load,
        }
    }

    /// Cells across the layer at this scale.
    pub fn cells(&self) -> usize {
        self.grid().cells_at(self.scale())
    }

    /// Natural time, breadth √(ρ/load) (s).
    pub fn natural_time(&self) -> f64 {
        let rheology = self.rheology();
        let density = rheology.solid_fraction * rheology.grain_density;
        self.breadth() * (density / self.load()).sqrt()
    }

    /// The case under a law.
    pub fn case(&self, rheology: AnyLaw) -> ShearedCase {
        let (cells, columns) = (self.cells(), self.grid().columns());
        match self {
            ShearedScene::PlaneShear(keys) => ShearedCase::PlaneShear(PlaneShearCase {
                gap: keys.gap,
                wall_velocity: keys.wall_velocity,
                load: keys.load,
                rheology,
                cells,
                columns,
            }),
            ShearedScene::VerticalChute(keys) => ShearedCase::VerticalChute(VerticalChuteCase {
                half_width: keys.half_width,
                load: keys.load,
                gravity: keys.gravity,
                rheology,
                cells,
                columns,
            }),
        }
    }

    /// The flow's exact solution.
    ///
    /// # Errors
    /// Numbers with which there is no steady flow.
    pub fn exact(&self) -> Result<ExactFlow, Error> {
        let keys = self.rheology();
        let law = keys.any_law()?;
        let (rate, load, velocity, wall_stress, plug) = match self.case(law.clone()) {
            ShearedCase::PlaneShear(case) => {
                case.validate()?;
                let rate = case.wall_velocity / case.gap;
                let stress = case.exact_shear_stress();
                (rate, case.load, case.wall_velocity, stress, 0.0)
            }
            ShearedCase::VerticalChute(case) => {
                case.validate()?;
                let stress = case.exact_shear_stress(case.half_width);
                let rate = law.rate_under(stress, case.load);
                let plug = case.plug_half_width();
                (rate, case.load, case.exact_velocity(0.0), stress, plug)
            }
        };
        Ok(ExactFlow {
            velocity,
            wall_stress,
            wall_inertial_number: rate * keys.diameter * (keys.grain_density / load).sqrt(),
            well_posed: law.is_well_posed(rate, load),
            plug,
            is_rising: law.threshold(1.01 * rate, load).stress
                > (1.0 + 1e-9) * law.threshold(rate, load).stress,
        })
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        check_grid(self.grid(), self.scale(), origin)?;
        check_law(self.rheology(), origin)?;
        let exact = self.exact().map_err(|error| match error {
            Error::OutOfRange {
                key,
                value,
                allowed,
            } => SceneError::OutOfRange {
                file: origin.to_owned(),
                key: key.into(),
                value: value.to_string(),
                range: allowed,
            },
            other => SceneError::Unreadable {
                file: origin.to_owned(),
                message: other.to_string(),
            },
        })?;
        match self {
            ShearedScene::PlaneShear(_) if !exact.is_rising => Err(self.undetermined(origin)),
            _ => Ok(()),
        }
    }

    /// Between plates stress is the same everywhere, so only a friction that grows with the strain rate tells how the rate is
    /// shared out.
    fn undetermined(&self, origin: &str) -> SceneError {
        let r = self.rheology();
        let (key, value) = match r.law {
            FrictionLaw::Coulomb => ("rheology.viscosity", r.viscosity),
            FrictionLaw::Table => ("rheology.table", None),
            FrictionLaw::MuI | FrictionLaw::BarkerGray => ("rheology.mu_2", r.mu_2),
        };
        let value = match (value, &r.table) {
            (None, Some(table)) => format!("{table:?}"),
            (value, _) => value.map_or(String::new(), |value| value.to_string()),
        };
        SceneError::OutOfRange {
            file: origin.to_owned(),
            key: key.into(),
            value,
            range: "what makes friction grow with the strain rate there: else the velocity between plates is not determined"
                .into(),
        }
    }
}
