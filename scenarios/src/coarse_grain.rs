//! Fields from grains that lie in files: `colluvium coarse-grain`.

use crate::failure::Failure;
use crate::grain_files::{self, Unsaid};
use crate::run_directory::write_in_place;
use crate::table::Table;
use crate::vtkhdf::{self, Cells as FrameCells, Field, Frame, Values};
use colluvium_coupling::coarse_graining::{
    AveragerError, Cells, Geometry, Mesh, PointFields, PointSums, Shape, solid_fractions,
};
use colluvium_dem::{ContactSample, Domain, GrainSample, Snapshot};
use nalgebra::{Matrix3, Vector3};
use std::path::{Path, PathBuf};

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
#[derive(Clone, Debug)]
pub struct Request {
    /// Files with grains.
    pub files: Vec<PathBuf>,
    /// What they leave unsaid.
    pub unsaid: Unsaid,
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
    /// Directory of the tables.
    pub out: PathBuf,
}

/// Fields of all instants together; gives what was done in words.
///
/// # Errors
/// Bad input, before anything is written.
pub fn coarse_grain(request: &Request) -> Result<String, Failure> {
    let bad = |error: AveragerError| Failure::Input(error.to_string());
    if request.species.windows(2).any(|w| w[1] <= w[0]) {
        return Err(Failure::Input(format!(
            "--species-radii {:?}: must rise",
            request.species
        )));
    }
    let mut work: Option<Work> = None;
    let mut instants = 0;
    let mut forces = Forces::default();
    for file in &request.files {
        instants += grain_files::read(file, &request.unsaid, &mut |snapshot| {
            forces.see(snapshot);
            if work.is_none() {
                work = Some(Work::begin(request, snapshot)?);
            }
            match &mut work {
                Some(work) => work.add(snapshot).map_err(bad),
                None => Ok(()),
            }
        })?;
    }
    let Some(work) = work else {
        return Err(Failure::Input("no grains were given".into()));
    };
    std::fs::create_dir_all(&request.out)
        .map_err(|e| Failure::Input(format!("cannot make {}: {e}", request.out.display())))?;
    work.write(&request.out)?;
    Ok(format!(
        "{instants} instants, {} places, kernel {:?} of {} m: {}{}",
        work.sums.places().len(),
        request.shape,
        work.sums.kernel().width(),
        request.out.display(),
        forces.doubt()
    ))
}

/// What the forces of contacts look like.
#[derive(Default)]
struct Forces {
    central: usize,
    all: usize,
}

impl Forces {
    fn see(&mut self, snapshot: &Snapshot) {
        // Forces from text have some ten digits.
        let central = |c: &&ContactSample| {
            let across = c.force.cross(&c.arm).norm();
            across <= 1e-6 * c.force.norm() * c.arm.norm()
        };
        self.all += snapshot.contacts.len();
        self.central += snapshot.contacts.iter().filter(central).count();
    }

    fn doubt(&self) -> &'static str {
        if self.all > 0 && self.central == self.all {
            "\nwarning: all forces lie along the lines of centres, as without friction; LAMMPS' pair/local gives tangential \
             forces as p1,p2,p3, to be added by --contact-columns id1,id2,fx+p1,fy+p2,fz+p3 with its own names"
        } else {
            ""
        }
    }
}

struct Work {
    sums: PointSums,
    species: Vec<f64>,
    /// Exact solid fractions of the cells, summed over the instants.
    fractions: Option<Vec<f64>>,
}

impl Work {
    fn begin(request: &Request, snapshot: &Snapshot) -> Result<Self, Failure> {
        let bad = |error: AveragerError| Failure::Input(error.to_string());
        let free: Vec<&GrainSample> = snapshot.grains.iter().filter(|g| !g.fixed).collect();
        if free.is_empty() {
            return Err(Failure::Input("no grain is free: all are fixed".into()));
        }
        let diameter = 2.0 * free.iter().map(|g| g.radius).sum::<f64>() / free.len() as f64;
        let width = request.width.unwrap_or(match request.shape {
            Shape::Gauss => 0.5 * diameter,
            _ => diameter,
        });
        let cell = request.cell.unwrap_or(0.5 * diameter);
        if !(cell > 0.0 && cell.is_finite()) {
            return Err(Failure::Input(format!(
                "--cell {cell}: must be a positive length in m"
            )));
        }
        let mesh = mesh(&request.place, cell, &snapshot.domain, width).map_err(bad)?;
        let fractions = match request.place {
            Where::Points(_) | Where::Cylinder(..) => None,
            _ => Some(vec![0.0; mesh.points().len()]),
        };
        let sums = PointSums::new(request.shape, width, mesh, request.species.len() + 1);
        Ok(Self {
            sums: sums.map_err(bad)?,
            species: request.species.clone(),
            fractions,
        })
    }

    fn add(&mut self, snapshot: &Snapshot) -> Result<(), AveragerError> {
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

    fn write(&self, out: &Path) -> Result<(), Failure> {
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
        for table in &tables {
            let path = out.join(format!("{}.csv", table.name));
            write_in_place(&path, table.to_csv().as_bytes())
                .map_err(|e| Failure::Run(format!("cannot write {}: {e}", path.display())))?;
        }
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
        let frame = Frame {
            time: 0.0,
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
        };
        vtkhdf::write(&out.join("fields.vtkhdf"), [Ok(frame)])
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
