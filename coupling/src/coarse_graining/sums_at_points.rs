//! Sums over grains and contacts of one or more instants, at the points of a mesh.

use super::smoothing::{AlongSegment, Smoothing};
use super::{AveragerError, Mesh, Shape};
use colluvium_dem::{BondSample, ContactSample, GrainSample, Partner, Snapshot};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Where each sum of a point starts.
pub(super) mod sum {
    /// Σ m W.
    pub const MASS: usize = 0;
    /// Σ V W, V the grain's volume.
    pub const VOLUME: usize = 1;
    /// Σ W.
    pub const NUMBER: usize = 2;
    /// Σ m v W, 3 parts.
    pub const MOMENTUM: usize = 3;
    /// Σ m v v W: xx, yy, zz, xy, xz, yz.
    pub const FLUX: usize = 6;
    /// Σ f ⊗ a ∫W, 9 parts, row = direction of the force.
    pub const CONTACT: usize = 12;
    /// Σ f W over contacts with walls and fixed grains, at the contact point.
    pub const WALL: usize = 21;
    /// Σ f W over contacts with grains of other species, at the contact point.
    pub const DRAG: usize = 24;
    /// Σ S W, S = I ω.
    pub const SPIN: usize = 27;
    /// Σ S ⊗ v W, 9 parts.
    pub const SPIN_FLUX: usize = 30;
    /// Σ (a × f) ⊗ a ∫(1 − s)W + m ⊗ a ∫W, 9 parts.
    pub const COUPLE: usize = 39;
    /// Σ m W at contact points, m the moment at the contact point: what does not cancel in pairs.
    pub const MOMENT: usize = 48;
    /// Σ W Σ n ⊗ n over grains and their contacts: xx, yy, zz, xy, xz, yz.
    pub const FABRIC: usize = 51;
    /// Σ C W, C the grain's number of contacts.
    pub const CONTACTS: usize = 57;
    /// How many there are.
    pub const COUNT: usize = 58;
}

/// Gives each grain its species, from 0 to one less than the number of species.
pub type SpeciesOf<'a> = &'a (dyn Fn(&GrainSample) -> usize + Sync);

/// Fields of one or more instants at the points of a mesh, as sums; see [`PointSums::fields`].
#[derive(Clone, Debug)]
pub struct PointSums {
    pub(super) kernel: Smoothing,
    pub(super) mesh: Mesh,
    pub(super) species: usize,
    pub(super) samples: u64,
    /// Area or length of what is averaged away in the last snapshot (m², m, or 1).
    pub(super) averaged_extent: f64,
    /// By point, then species, then kind.
    pub(super) sums: Vec<f64>,
}

impl PointSums {
    /// Empty sums. `width` (m) is the radius of the kernel's support, of Gauss' kernel its standard deviation.
    ///
    /// # Errors
    /// If the width is not positive or there is no species.
    pub fn new(
        shape: Shape,
        width: f64,
        mesh: Mesh,
        species: usize,
    ) -> Result<Self, AveragerError> {
        let kernel =
            Smoothing::new(shape, width, mesh.dimensions()).ok_or(AveragerError::OutOfRange {
                key: "width",
                value: width,
                allowed: "a positive length in m",
            })?;
        if species == 0 || species > 1000 {
            return Err(AveragerError::OutOfRange {
                key: "species",
                value: species as f64,
                allowed: "1 to 1000",
            });
        }
        let length = mesh.points().len() * species * sum::COUNT;
        Ok(Self {
            kernel,
            species,
            samples: 0,
            averaged_extent: 1.0,
            sums: vec![0.0; length],
            mesh,
        })
    }

    /// The mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The kernel.
    pub fn kernel(&self) -> &Smoothing {
        &self.kernel
    }

    /// Snapshots added.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Number of species.
    pub fn species(&self) -> usize {
        self.species
    }

    /// Adds the sums of others at the same points.
    ///
    /// # Panics
    /// If they are of other points or species.
    pub fn join(&mut self, other: &PointSums) {
        assert_eq!(self.sums.len(), other.sums.len(), "sums at other points");
        if other.samples > 0 {
            self.averaged_extent = other.averaged_extent;
        }
        self.samples += other.samples;
        for (sum, more) in self.sums.iter_mut().zip(&other.sums) {
            *sum += more;
        }
    }

    /// All numbers that change, for [`PointSums::set_numbers`].
    pub fn numbers(&self) -> Vec<f64> {
        let mut numbers = vec![self.samples as f64, self.averaged_extent];
        numbers.extend(&self.sums);
        numbers
    }

    /// Takes the numbers of sums at the same points.
    ///
    /// # Panics
    /// If there are not as many.
    pub fn set_numbers(&mut self, numbers: &[f64]) {
        self.samples = numbers[0] as u64;
        self.averaged_extent = numbers[1];
        self.sums.copy_from_slice(&numbers[2..]);
    }

    /// Adds a snapshot; free grains only, fixed ones are wall. A grain whose species is out of range counts with
    /// the last one. Blocks of points are shared over the threads of the rayon pool; the bits do not depend on it.
    ///
    /// # Errors
    /// If the kernel reaches further than one length of a periodic axis of the box.
    pub fn add(
        &mut self,
        snapshot: &Snapshot,
        species_of: Option<SpeciesOf>,
    ) -> Result<(), AveragerError> {
        let scene = Scene::of(&self.kernel, &self.mesh, snapshot, self.species, species_of)?;
        self.averaged_extent = scene.averaged_extent;
        self.samples += 1;
        let points = self.mesh.points_per_block();
        let stride = self.species * sum::COUNT;
        let species = self.species;
        self.sums
            .par_chunks_mut(points * stride)
            .enumerate()
            .for_each(|(block, sums)| scene.add_block(block * points, species, sums));
        Ok(())
    }
}

/// One grain or one arm of a contact, ready to be spread.
struct Source {
    position: Vector3<f64>,
    /// To the contact point; zero for a grain.
    arm: Vector3<f64>,
    species: usize,
    kind: Kind,
}

enum Kind {
    Grain {
        grain: usize,
        fabric: [f64; 6],
        contacts: f64,
    },
    Arm {
        force: Vector3<f64>,
        torque: Vector3<f64>,
        wall: bool,
        other_species: bool,
    },
}

/// A snapshot with what all points share.
struct Scene<'a> {
    kernel: &'a Smoothing,
    mesh: &'a Mesh,
    snapshot: &'a Snapshot,
    sources: Vec<Source>,
    active: [bool; 3],
    averaged_extent: f64,
}

impl<'a> Scene<'a> {
    fn of(
        kernel: &'a Smoothing,
        mesh: &'a Mesh,
        snapshot: &'a Snapshot,
        species: usize,
        species_of: Option<SpeciesOf>,
    ) -> Result<Self, AveragerError> {
        let (active, lengths) = (mesh.active(), snapshot.domain.lengths());
        let mut averaged_extent = 1.0;
        for axis in 0..3 {
            if active[axis] {
                if snapshot.domain.periodic[axis] && kernel.reach() > lengths[axis] {
                    return Err(AveragerError::OutOfRange {
                        key: "width",
                        value: kernel.width(),
                        allowed: "such that the kernel reaches no further than a periodic box is long",
                    });
                }
            } else {
                averaged_extent *= lengths[axis];
            }
        }
        let number = |g: &GrainSample| species_of.map_or(0, |of| of(g).min(species - 1));
        let grains = &snapshot.grains;
        let mut fabric = vec![[0.0; 6]; grains.len()];
        let mut contacts = vec![0.0; grains.len()];
        let mut count = |grain: usize, arm: &Vector3<f64>| {
            let square = arm.norm_squared();
            if square > 0.0 {
                for (part, (i, j)) in SYMMETRIC.into_iter().enumerate() {
                    fabric[grain][part] += arm[i] * arm[j] / square;
                }
            }
            contacts[grain] += 1.0;
        };
        let mut arms = Vec::new();
        let bonds = snapshot.bonds.iter().map(BondSample::as_contact);
        for (index, contact) in snapshot.contacts.iter().copied().chain(bonds).enumerate() {
            if index < snapshot.contacts.len() {
                count(contact.grain, &contact.arm);
                if let Partner::Grain(j) = contact.partner {
                    count(j, &contact.partner_arm);
                }
            }
            arms.extend(sides(snapshot, &contact, &number).into_iter().flatten());
        }
        let free = grains.iter().enumerate().filter(|(_, g)| !g.fixed);
        let mut sources: Vec<Source> = free
            .map(|(index, g)| Source {
                position: g.position,
                arm: Vector3::zeros(),
                species: number(g),
                kind: Kind::Grain {
                    grain: index,
                    fabric: fabric[index],
                    contacts: contacts[index],
                },
            })
            .collect();
        sources.extend(arms);
        Ok(Self {
            kernel,
            mesh,
            snapshot,
            sources,
            active,
            averaged_extent,
        })
    }

    /// Adds all sources to the points from `first` on.
    fn add_block(&self, first: usize, species: usize, sums: &mut [f64]) {
        let stride = species * sum::COUNT;
        let points = &self.mesh.points()[first..first + sums.len() / stride];
        let mut low = points[0];
        let mut high = points[0];
        for p in points {
            (low, high) = (low.inf(p), high.sup(p));
        }
        let reach = Vector3::repeat(self.kernel.reach());
        let lengths = self.snapshot.domain.lengths();
        let row = self.mesh.cells().count[0];
        let images = |axis: usize| -> &[f64] {
            if self.active[axis] && self.snapshot.domain.periodic[axis] {
                &[0.0, -1.0, 1.0]
            } else {
                &[0.0]
            }
        };
        for source in &self.sources {
            let end = source.position + source.arm;
            let (near, far) = (
                source.position.inf(&end) - reach,
                source.position.sup(&end) + reach,
            );
            for x in images(0) {
                for y in images(1) {
                    for z in images(2) {
                        let shift = Vector3::new(*x, *y, *z).component_mul(&lengths);
                        let (near, far) = (near + shift, far + shift);
                        let apart = (0..3)
                            .any(|k| self.active[k] && (near[k] > high[k] || far[k] < low[k]));
                        if apart {
                            continue;
                        }
                        let [[i0, i1], [j0, j1]] = self.mesh.touched(&near, &far);
                        for j in j0..j1 {
                            for i in i0..i1 {
                                let at = j * row + i;
                                if at < points.len() {
                                    let into = &mut sums
                                        [at * stride + source.species * sum::COUNT..][..sum::COUNT];
                                    self.add(source, &(points[at] - shift), into);
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    fn flatten(&self, v: &Vector3<f64>) -> [f64; 3] {
        std::array::from_fn(|k| if self.active[k] { v[k] } else { 0.0 })
    }

    /// Adds one source to the sums of one point.
    fn add(&self, source: &Source, point: &Vector3<f64>, into: &mut [f64]) {
        let apart = self.flatten(&(point - source.position));
        let squared = |d: &[f64; 3]| d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        match &source.kind {
            Kind::Grain {
                grain,
                fabric,
                contacts,
            } => {
                let w = self.kernel.value(squared(&apart));
                if w > 0.0 {
                    add_grain(&self.snapshot.grains[*grain], w, into);
                    for (part, value) in fabric.iter().enumerate() {
                        into[sum::FABRIC + part] += w * value;
                    }
                    into[sum::CONTACTS] += w * contacts;
                }
            }
            Kind::Arm {
                force,
                torque,
                wall,
                other_species,
            } => {
                let arm = self.flatten(&source.arm);
                let share = self.kernel.along(apart, arm);
                let moment = torque - source.arm.cross(force);
                if share != AlongSegment::default() {
                    let lever = source.arm.cross(force);
                    for row in 0..3 {
                        for column in 0..3 {
                            let a = source.arm[column];
                            into[sum::CONTACT + 3 * row + column] += force[row] * a * share.whole;
                            into[sum::COUPLE + 3 * row + column] +=
                                a * (lever[row] * share.near_start + moment[row] * share.whole);
                        }
                    }
                }
                let from_contact: [f64; 3] = std::array::from_fn(|k| apart[k] - arm[k]);
                let w = self.kernel.value(squared(&from_contact));
                for axis in 0..3 {
                    into[sum::MOMENT + axis] += w * moment[axis];
                    if *wall {
                        into[sum::WALL + axis] += w * force[axis];
                    } else if *other_species {
                        into[sum::DRAG + axis] += w * force[axis];
                    }
                }
            }
        }
    }
}

/// Places of the six parts of a symmetric tensor.
pub(super) const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

fn add_grain(grain: &GrainSample, w: f64, into: &mut [f64]) {
    let (m, v, radius) = (grain.mass, grain.velocity, grain.radius);
    let spin = 0.4 * m * radius * radius * grain.spin;
    into[sum::MASS] += w * m;
    into[sum::VOLUME] += w * 4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius;
    into[sum::NUMBER] += w;
    for axis in 0..3 {
        into[sum::MOMENTUM + axis] += w * m * v[axis];
        into[sum::SPIN + axis] += w * spin[axis];
        for other in 0..3 {
            into[sum::SPIN_FLUX + 3 * axis + other] += w * spin[axis] * v[other];
        }
    }
    for (part, (i, j)) in SYMMETRIC.into_iter().enumerate() {
        into[sum::FLUX + part] += w * m * v[i] * v[j];
    }
}

/// The arms of a contact that end in free grains.
fn sides(
    snapshot: &Snapshot,
    contact: &ContactSample,
    species: &dyn Fn(&GrainSample) -> usize,
) -> [Option<Source>; 2] {
    let own = &snapshot.grains[contact.grain];
    let other = match contact.partner {
        Partner::Grain(j) => Some(&snapshot.grains[j]),
        Partner::Wall(_) | Partner::Body(_) => None,
    };
    let side = |grain: &GrainSample,
                beyond: Option<&GrainSample>,
                arm: Vector3<f64>,
                force: Vector3<f64>,
                torque: Vector3<f64>| {
        let wall = beyond.is_none_or(|g| g.fixed);
        (!grain.fixed).then(|| Source {
            position: grain.position,
            arm,
            species: species(grain),
            kind: Kind::Arm {
                force,
                torque,
                wall,
                other_species: beyond.is_some_and(|g| species(g) != species(grain)),
            },
        })
    };
    [
        side(own, other, contact.arm, contact.force, contact.torque),
        other.and_then(|g| {
            side(
                g,
                Some(own),
                contact.partner_arm,
                -contact.force,
                contact.partner_torque,
            )
        }),
    ]
}
