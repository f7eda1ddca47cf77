//! Fields over the cells of a flow with a moving surface, for pictures.

use crate::vtkhdf::{Field, Values};
use colluvium_continuum::discretisation::COMPONENTS;
use colluvium_continuum::free_surface::CellFields;
use colluvium_continuum::rheology::strain_rate_norm;

/// A field of that name and unit.
pub(super) fn field(name: &str, unit: &str, values: Values) -> Field {
    Field {
        name: name.into(),
        unit: unit.into(),
        values,
    }
}

/// Fields of cells with material, then as many zeros as there are other cells in the picture.
pub(super) struct SurfaceFields<'a, const D: usize, const C: usize> {
    /// The cells, SI units.
    pub cells: &'a [CellFields<D, C>],
    /// d √ρ_s of the grains (kg^½ m^−½): I = γ̇ d √(ρ_s/p), whatever the law.
    pub inertia: f64,
    /// Other cells after those with material.
    pub others: usize,
}

impl<const D: usize, const C: usize> SurfaceFields<'_, D, C> {
    fn padded<T: Clone>(&self, nothing: T, of: &dyn Fn(&CellFields<D, C>) -> T) -> Vec<T> {
        let others = std::iter::repeat_n(nothing, self.others);
        self.cells.iter().map(of).chain(others).collect()
    }

    pub fn scalars(&self, name: &str, unit: &str, of: &dyn Fn(&CellFields<D, C>) -> f64) -> Field {
        field(name, unit, Values::Scalars(self.padded(0.0, of)))
    }

    fn flags(&self, name: &str, of: &dyn Fn(&CellFields<D, C>) -> bool) -> Field {
        let values = self.padded(0, &|c| i64::from(of(c)));
        field(name, "1", Values::Counts(values))
    }

    /// All fields: fraction, velocity and pressure, the stresses that the caller names, what follows from them.
    pub fn all(&self, velocity: fn([f64; D]) -> [f64; 3], stresses: Vec<Field>) -> Vec<Field> {
        let under_pressure = |p: f64, value: f64| if p > 0.0 { value } else { 0.0 };
        let velocities = self.padded([0.0; 3], &|c| velocity(c.velocity));
        let mut fields = vec![
            self.scalars("fraction", "1", &|c| c.fraction),
            field("velocity", "m/s", Values::Vectors(velocities)),
            self.scalars("pressure", "Pa", &|c| c.pressure),
        ];
        fields.extend(stresses);
        fields.extend([
            self.scalars("strain_rate", "1/s", &|c| c.strain_rate),
            self.scalars("inertial_number", "1", &|c| {
                under_pressure(c.pressure, c.strain_rate * self.inertia / c.pressure.sqrt())
            }),
            self.scalars("friction", "1", &|c| {
                under_pressure(c.pressure, strain_rate_norm(c.stress) / c.pressure)
            }),
            self.flags("flows", &|c| c.flows),
            self.flags("well_posed", &|c| c.well_posed),
        ]);
        fields
    }
}

impl SurfaceFields<'_, 2, COMPONENTS> {
    /// Corners of the cells with material in the plane y = 0, cell by cell.
    pub fn quadrilaterals(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.cells.iter().flat_map(|c| {
            let ([x0, z0], [x1, z1]) = (c.lower, c.upper);
            [[x0, z0], [x1, z0], [x1, z1], [x0, z1]].map(|[x, z]| [x, 0.0, z])
        })
    }

    /// All fields of a plane flow.
    pub fn of_plane(&self) -> Vec<Field> {
        let stresses = vec![
            self.scalars("deviatoric_stress_xx", "Pa", &|c| c.stress[0]),
            self.scalars("shear_stress_xz", "Pa", &|c| c.stress[1]),
        ];
        self.all(|[u, w]| [u, 0.0, w], stresses)
    }
}
