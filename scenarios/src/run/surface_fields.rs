//! Fields over the cells of a flow with a moving surface, for pictures.

use crate::scene::RheologyKeys;
use crate::vtkhdf::{Cells, Field, Frame, Values};
use colluvium_continuum::discretisation::COMPONENTS;
use colluvium_continuum::free_surface::{CellFields, SpaceFields, flowing_shares};
use colluvium_continuum::rheology::{MuI, strain_rate_norm};
use colluvium_continuum::strain::{SPACE_COMPONENTS, deviator};

/// A field of that name and unit.
pub(super) fn field(name: &str, unit: &str, values: Values) -> Field {
    Field {
        name: name.into(),
        unit: unit.into(),
        values,
    }
}

/// Shares of the volume of cells (SI units): that flows, that flows where the equations of motion are ill posed, and that
/// flows with an inertial number I = γ̇ d √(ρ_s/p) above those at which the law was measured; this last is NaN where
/// the law has no such window. Below the window every flow passes on its way to rest: that is not counted.
pub(super) fn shares<const D: usize, const C: usize>(
    cells: &[CellFields<D, C>],
    law: &RheologyKeys,
) -> [f64; 3] {
    let [flows, ill_posed] = flowing_shares(cells);
    let whole: f64 = cells.iter().map(|c| c.fraction).sum();
    let Some([_, largest]) = law.valid_inertial_numbers() else {
        return [flows, ill_posed, f64::NAN];
    };
    let inertia = law.diameter * law.grain_density.sqrt();
    let beyond = |c: &&CellFields<D, C>| {
        c.flows && c.pressure > 0.0 && c.strain_rate * inertia > largest * c.pressure.sqrt()
    };
    let beyond: f64 = cells.iter().filter(beyond).map(|c| c.fraction).sum();
    [
        flows,
        ill_posed,
        if whole > 0.0 { beyond / whole } else { 0.0 },
    ]
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

impl<'a, const D: usize, const C: usize> SurfaceFields<'a, D, C> {
    /// Fields of material alone.
    pub fn of_material(cells: &'a [CellFields<D, C>], inertia: f64) -> Self {
        Self {
            cells,
            inertia,
            others: 0,
        }
    }

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

/// Cells of a flow in space as hexahedra, with the fields over them, then those of the ground if there is any. The
/// deviatoric stress, positive in tension, has τ_zz = −τ_xx − τ_yy.
pub(super) fn space_frame(
    cells: &[SpaceFields],
    ground: &[[[f64; 3]; 8]],
    law: &MuI,
    time: f64,
) -> Frame {
    let fields = SurfaceFields {
        cells,
        inertia: law.diameter * law.grain_density.sqrt(),
        others: ground.len(),
    };
    fields.of_space(ground, time)
}

impl SurfaceFields<'_, 3, SPACE_COMPONENTS> {
    /// The cells as hexahedra with all fields of a flow in space, and blocks of ground behind them.
    pub fn of_space(&self, ground: &[[[f64; 3]; 8]], time: f64) -> Frame {
        let (fields, cells) = (self, self.cells);
        let stresses = vec![
            fields.scalars("deviatoric_stress_xx", "Pa", &|c| deviator(c.stress)[0]),
            fields.scalars("deviatoric_stress_yy", "Pa", &|c| deviator(c.stress)[1]),
            fields.scalars("shear_stress_xy", "Pa", &|c| c.stress[2]),
            fields.scalars("shear_stress_xz", "Pa", &|c| c.stress[3]),
            fields.scalars("shear_stress_yz", "Pa", &|c| c.stress[4]),
        ];
        let points = cells.iter().flat_map(corners);
        let mut frame = Frame {
            time,
            cells: Cells::Hexahedra,
            points: points.chain(ground.iter().flatten().copied()).collect(),
            fields: fields.all(|velocity| velocity, stresses),
        };
        if !ground.is_empty() {
            let [material, others] =
                [(0, cells.len()), (1, ground.len())].map(|(n, count)| vec![n; count]);
            let values = Values::Counts([material, others].concat());
            frame.fields.push(field("ground", "1", values));
        }
        frame
    }
}

/// Corners of a cell: round its base, then round its top.
fn corners(cell: &SpaceFields) -> [[f64; 3]; 8] {
    let ([x0, y0, z0], [x1, y1, z1]) = (cell.lower, cell.upper);
    let round = |z: f64| [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]];
    let ([a, b, c, d], [e, f, g, h]) = (round(z0), round(z1));
    [a, b, c, d, e, f, g, h]
}
