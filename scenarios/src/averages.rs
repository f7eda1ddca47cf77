//! Coarse-grained fields over a choice of places: of files afterwards, or of a run while it goes on.

use crate::table::Table;
use crate::vtkhdf::{Cells as FrameCells, Field, Frame, Values};
use colluvium_coupling::coarse_graining::{
    AveragerError, Cells, Geometry, Mesh, PointFields, PointSums, Shape, solid_fractions,
};
use colluvium_dem::{Domain, GrainSample, Snapshot};
use nalgebra::{Matrix3, Vector3};

/// The geometry by its name on the command line.
#[derive(Clone, Debug, PartialEq)]
pub enum Where {
    /// Given points (m).
    Points(Vec<[f64; 3]>),
    /// Along z.
    Line,
    /// In x and z.
    Plane,
    /// In space.
    Grid,
    /// Around an axis parallel to z (m), averaged over so many angles.
    Cylinder([f64; 2], usize),
}

/// What is to be averaged, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Shape of the kernel.
    pub shape: Shape,
    /// Radius of its support, of Gauss' kernel the standard deviation (m); none: one mean diameter, half of it.
    pub width: Option<f64>,
    /// The geometry.
    pub place: Where,
    /// Edge of a cell (m); none: half a mean diameter.
    pub cell: Option<f64>,
    /// Radii at which species part (m): rising.
    pub species: Vec<f64>,
}

/// Averages of what has been added.
#[derive(Clone, Debug)]
pub struct Averages {
    sums: PointSums,
    species: Vec<f64>,
    /// Exact solid fractions of the cells, summed over the instants.
    fractions: Option<Vec<f64>>,
}

impl Averages {
    /// None yet, over a box, with the mean diameter of these grains where a length is left out.
    ///
    /// # Errors
    /// Which length cannot be.
    pub fn begin(choice: &Choice, space: &Domain, grains: &[GrainSample]) -> Result<Self, String> {
        let bad = |error: AveragerError| error.to_string();
        let free: Vec<&GrainSample> = grains.iter().filter(|g| !g.fixed).collect();
        if free.is_empty() {
            return Err("no grain is free: all are fixed".into());
        }
        let diameter = 2.0 * free.iter().map(|g| g.radius).sum::<f64>() / free.len() as f64;
        let width = choice.width.unwrap_or(match choice.shape {
            Shape::Gauss => 0.5 * diameter,
            _ => diameter,
        });
        let cell = choice.cell.unwrap_or(0.5 * diameter);
        if !(cell > 0.0 && cell.is_finite()) {
            return Err(format!("cell {cell}: must be a positive length in m"));
        }
        let mesh = mesh(&choice.place, cell, space, width).map_err(bad)?;
        let fractions = match choice.place {
            Where::Points(_) | Where::Cylinder(..) => None,
            _ => Some(vec![0.0; mesh.points().len()]),
        };
        let sums = PointSums::new(choice.shape, width, mesh, choice.species.len() + 1);
        Ok(Self {
            sums: sums.map_err(bad)?,
            species: choice.species.clone(),
            fractions,
        })
    }

    /// Adds an instant.
    ///
    /// # Errors
    /// If the kernel does not fit into the box.
    pub fn add(&mut self, snapshot: &Snapshot) -> Result<(), AveragerError> {
        let radii = &self.species;
        let species_of = |g: &GrainSample| radii.partition_point(|r| *r <= g.radius);
        self.sums.add(snapshot, Some(&species_of))?;
        if let Some(fractions) = &mut self.fractions {
            let now = solid_fractions(self.sums.mesh(), snapshot)?;
            for (sum, phi) in fractions.iter_mut().zip(now) {
                *sum += phi;
            }
        }
        Ok(())
    }

    /// Sums over places.
    pub fn sums(&self) -> &PointSums {
        &self.sums
    }

    /// Adds what others, over the same places, have been given.
    pub fn join(&mut self, other: &Averages) {
        self.sums.join(&other.sums);
        if let (Some(own), Some(others)) = (&mut self.fractions, &other.fractions) {
            for (sum, phi) in own.iter_mut().zip(others) {
                *sum += phi;
            }
        }
    }

    /// The numbers behind the averages, for a checkpoint.
    pub fn save(&self) -> Vec<f64> {
        let mut numbers = self.sums.numbers();
        numbers.extend(self.fractions.iter().flatten());
        numbers
    }

    /// Takes numbers back.
    ///
    /// # Errors
    /// If they are not those of such averages.
    pub fn restore(&mut self, numbers: &[f64]) -> Result<(), String> {
        let fractions = self.fractions.as_ref().map_or(0, Vec::len);
        let wanted = self.sums.numbers().len() + fractions;
        if numbers.len() != wanted {
            return Err(format!("averages of {wanted} numbers are wanted"));
        }
        let (sums, exact) = numbers.split_at(wanted - fractions);
        self.sums.set_numbers(sums);
        if let Some(own) = &mut self.fractions {
            own.copy_from_slice(exact);
        }
        Ok(())
    }

    /// The fields of all grains, and of each species where there are several.
    pub fn tables(&self) -> Vec<Table> {
        let all = self.sums.fields(None);
        let samples = self.sums.samples().max(1) as f64;
        let exact = self.fractions.as_ref();
        let exact: Option<Vec<f64>> = exact.map(|f| f.iter().map(|x| x / samples).collect());
        let mut tables = vec![self.table("fields", &all, exact.as_deref())];
        if self.sums.species() > 1 {
            for k in 0..self.sums.species() {
                let name = format!("fields_species_{k}");
                tables.push(self.table(&name, &self.sums.fields(Some(k)), None));
            }
        }
        tables
    }

    /// The fields of all grains for ParaView.
    pub fn frame(&self, time: f64) -> Frame {
        let all = self.sums.fields(None);
        let scalars = |name: &str, unit: &str, f: &dyn Fn(&PointFields) -> f64| Field {
            name: name.into(),
            unit: unit.into(),
            values: Values::Scalars(all.iter().map(f).collect()),
        };
        let vectors = |name: &str, unit: &str, f: &dyn Fn(&PointFields) -> Vector3<f64>| Field {
            name: name.into(),
            unit: unit.into(),
            values: Values::Vectors(all.iter().map(|x| f(x).into()).collect()),
        };
        Frame {
            time,
            cells: FrameCells::Points,
            points: self.sums.places(),
            fields: vec![
                scalars("density", "kg/m³", &|f| f.density),
                scalars("solid_fraction", "1", &|f| f.solid_fraction),
                scalars("pressure", "Pa", &|f| f.pressure()),
                scalars("temperature", "m²/s²", &|f| f.temperature),
                scalars("coordination", "1", &|f| f.coordination),
                vectors("velocity", "m/s", &|f| f.velocity),
                vectors("wall_force", "N/m³", &|f| f.wall_force),
                vectors("spin_density", "kg/(m s)", &|f| f.spin_density),
            ],
        }
    }

    fn table(&self, name: &str, fields: &[PointFields], exact: Option<&[f64]>) -> Table {
        let places = self.sums.places();
        let place = |axis: usize| places.iter().map(|p| p[axis]).collect();
        let of = |f: &dyn Fn(&PointFields) -> f64| fields.iter().map(f).collect();
        let mut table = Table::new(name)
            .with("x", "m", place(0))
            .with("y", "m", place(1))
            .with("z", "m", place(2))
            .with("density", "kg/m³", of(&|f| f.density))
            .with("solid_fraction", "1", of(&|f| f.solid_fraction));
        if let Some(exact) = exact {
            table = table.with("solid_fraction_exact", "1", exact.to_vec());
        }
        table = table
            .with("pressure", "Pa", of(&|f| f.pressure()))
            .with("temperature", "m²/s²", of(&|f| f.temperature))
            .with("coordination", "1", of(&|f| f.coordination));
        type OfVector = fn(&PointFields) -> Vector3<f64>;
        let vectors: [(&str, &str, OfVector); 5] = [
            ("u", "m/s", |f| f.velocity),
            ("j", "kg/(m² s)", |f| f.momentum),
            ("t", "N/m³", |f| f.wall_force),
            ("drag", "N/m³", |f| f.drag),
            ("spin", "kg/(m s)", |f| f.spin_density),
        ];
        for (name, unit, vector) in vectors {
            for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
                table = table.with(&format!("{name}_{letter}"), unit, of(&|f| vector(f)[axis]));
            }
        }
        type OfTensor = fn(&PointFields) -> Matrix3<f64>;
        let tensors: [(&str, &str, OfTensor); 4] = [
            ("sc", "Pa", |f| f.contact_stress),
            ("sk", "Pa", |f| f.kinetic_stress),
            ("m", "N/m", |f| f.couple_stress),
            ("fabric", "1", |f| f.fabric),
        ];
        for (name, unit, tensor) in tensors {
            for (row, a) in ["x", "y", "z"].into_iter().enumerate() {
                for (column, b) in ["x", "y", "z"].into_iter().enumerate() {
                    let key = format!("{name}_{a}{b}");
                    table = table.with(&key, unit, of(&|f| tensor(f)[(row, column)]));
                }
            }
        }
        table
    }
}

/// The mesh over the box; beyond it by the kernel's reach where the box has an end.
fn mesh(place: &Where, cell: f64, domain: &Domain, width: f64) -> Result<Mesh, AveragerError> {
    let margin = |axis: usize| if domain.periodic[axis] { 0.0 } else { width };
    let lower: [f64; 3] = std::array::from_fn(|k| domain.lower[k] - margin(k));
    let upper: [f64; 3] = std::array::from_fn(|k| domain.upper[k] + margin(k));
    let cells = Cells::filling(lower, upper, cell);
    match place {
        Where::Points(points) => Mesh::new(Geometry::Points(points.clone()), cells),
        Where::Line => Mesh::new(Geometry::LineZ, cells),
        Where::Plane => Mesh::new(Geometry::PlaneXZ, cells),
        Where::Grid => Mesh::new(Geometry::Grid, cells),
        Where::Cylinder(axis, angles) => {
            // To the farthest corner.
            let far = |k: usize| (upper[k] - axis[k]).abs().max((axis[k] - lower[k]).abs());
            let radius = far(0).hypot(far(1));
            let mut around = cells;
            around.lower[0] = 0.0;
            around.count[0] = (radius / cell).ceil().max(1.0) as usize;
            around.size[0] = cell;
            let geometry = Geometry::Cylinder {
                axis: *axis,
                angles: *angles,
            };
            Mesh::new(geometry, around)
        }
    }
}
