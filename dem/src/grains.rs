//! State of the grains, one row of four numbers for each thing a contact reads.

use nalgebra::Vector3;

/// A grain as a scene describes it (SI).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Centre (m).
    pub position: Vector3<f64>,
    /// Velocity (m/s).
    pub velocity: Vector3<f64>,
    /// Angular velocity (rad/s).
    pub spin: Vector3<f64>,
    /// Radius (m).
    pub radius: f64,
    /// Density of the grain's material (kg/m³).
    pub density: f64,
    /// Keeps its velocity whatever touches it: part of a rough base.
    pub fixed: bool,
    /// Number of its material in the law table.
    pub material: u16,
}

impl Grain {
    /// A grain at rest.
    pub fn at_rest(position: Vector3<f64>, radius: f64, density: f64) -> Self {
        Grain {
            position,
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
            radius,
            density,
            fixed: false,
            material: 0,
        }
    }

    /// Mass of the sphere (kg).
    pub fn mass(&self) -> f64 {
        self.volume() * self.density
    }

    /// Volume of the sphere (m³).
    pub fn volume(&self) -> f64 {
        4.0 / 3.0 * std::f64::consts::PI * self.radius.powi(3)
    }
}

/// Moment of inertia of a sphere is this times m R².
pub(crate) const SPHERE_INERTIA: f64 = 0.4;

/// Structure of rows. One dummy grain without size or mass follows the last one: it pads batches. Copies of
/// grains may follow it (`reach.rs`).
///
/// The fourth number of a row is what a contact needs as a *sum* over its two grains, so that one
/// addition combines both sides before rows become lanes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Grains {
    /// Centre, radius.
    pub place: Vec<[f64; 4]>,
    /// Velocity half a step back, inverse mass (0 = fixed).
    pub motion: Vec<[f64; 4]>,
    /// Radius times angular velocity half a step back, inverse radius.
    pub turn: Vec<[f64; 4]>,
    /// Mass (kg), also of fixed grains.
    pub mass: Vec<f64>,
    /// Number given at the start.
    pub id: Vec<u32>,
    /// Number of the material.
    pub material: Vec<u16>,
    /// As many rows again: where a sort writes, and room for others between steps.
    pub spare: Vec<[f64; 4]>,
}

impl Grains {
    pub fn new(grains: &[Grain]) -> Self {
        let mut state = Grains::default();
        state.extend(grains, 0);
        state.pad();
        state
    }

    fn extend(&mut self, grains: &[Grain], first_id: u32) {
        for (id, g) in (first_id..).zip(grains) {
            let (x, v, s) = (g.position, g.velocity, g.spin * g.radius);
            let inverse_mass = if g.fixed { 0.0 } else { 1.0 / g.mass() };
            self.place.push([x.x, x.y, x.z, g.radius]);
            self.motion.push([v.x, v.y, v.z, inverse_mass]);
            self.turn.push([s.x, s.y, s.z, 1.0 / g.radius]);
            self.mass.push(g.mass());
            self.id.push(id);
            self.material.push(g.material);
        }
    }

    /// Puts grains behind the last one.
    pub fn append(&mut self, grains: &[Grain], first_id: u32) {
        self.unpad();
        self.extend(grains, first_id);
        self.pad();
    }

    /// Takes out the grains that go; the others close up.
    pub fn keep(&mut self, goes: &[bool]) {
        self.unpad();
        thin(&mut self.place, goes);
        thin(&mut self.motion, goes);
        thin(&mut self.turn, goes);
        thin(&mut self.mass, goes);
        thin(&mut self.id, goes);
        thin(&mut self.material, goes);
        self.pad();
    }

    /// Makes room behind the dummy for copies of so many grains.
    pub fn lay_ghosts(&mut self, ghosts: usize) {
        let rows = self.len() + 1 + ghosts;
        for copies in [&mut self.place, &mut self.motion, &mut self.turn] {
            lay(copies, rows, [0.0; 4]);
        }
        lay(&mut self.material, rows, 0);
    }

    /// Copies grains to rows behind the dummy.
    pub fn copy_ghosts(&mut self, grains: &[u32], first: usize) {
        for rows in [&mut self.place, &mut self.motion, &mut self.turn] {
            for (ghost, &grain) in grains.iter().enumerate() {
                rows[first + ghost] = rows[grain as usize];
            }
        }
        for (ghost, &grain) in grains.iter().enumerate() {
            self.material[first + ghost] = self.material[grain as usize];
        }
    }

    /// Takes the dummy away, and what is behind it.
    fn unpad(&mut self) {
        let n = self.len();
        self.place.truncate(n);
        self.motion.truncate(n);
        self.turn.truncate(n);
        self.material.truncate(n);
    }

    /// Puts the dummy behind the last grain and makes room for a step.
    pub fn pad(&mut self) {
        self.place.push([0.0; 4]);
        self.motion.push([0.0; 4]);
        self.turn.push([0.0; 4]);
        self.material.push(0);
        let rows = self.place.len();
        self.spare.resize(rows, [0.0; 4]);
    }

    /// Number of real grains.
    pub fn len(&self) -> usize {
        self.id.len()
    }

    pub fn is_fixed(&self, i: usize) -> bool {
        self.motion[i][3] == 0.0
    }

    /// Reorders all rows so that new grain `k` is old grain `order(k)`.
    pub fn reorder(&mut self, order: &[u32]) {
        for rows in [&mut self.place, &mut self.motion, &mut self.turn] {
            let spare = &mut self.spare;
            spare.clear();
            spare.reserve_exact(order.len() + 1);
            spare.extend(order.iter().map(|&o| rows[o as usize]));
            spare.push([0.0; 4]);
            std::mem::swap(rows, spare);
        }
        for (room, &o) in self.spare.iter_mut().zip(order) {
            *room = [
                self.mass[o as usize],
                f64::from(self.id[o as usize]),
                f64::from(self.material[o as usize]),
                0.0,
            ];
        }
        let ordered = self.mass.iter_mut().zip(&mut self.id);
        let ordered = ordered.zip(&mut self.material);
        for (((mass, id), material), room) in ordered.zip(&self.spare) {
            (*mass, *id, *material) = (room[0], room[1] as u32, room[2] as u16);
        }
    }
}

/// Makes it so many; a little more room than that, since the next time there may be more.
fn lay<T: Copy>(values: &mut Vec<T>, count: usize, value: T) {
    if values.capacity() < count {
        let more = count + count / 64 - values.len();
        values.reserve_exact(more);
    }
    values.resize(count, value);
}

fn thin<T>(values: &mut Vec<T>, goes: &[bool]) {
    let mut goes = goes.iter();
    values.retain(|_| !goes.next().copied().unwrap_or(false));
}

/// The first three numbers of a row.
pub(crate) fn vector(row: &[f64; 4]) -> Vector3<f64> {
    Vector3::new(row[0], row[1], row[2])
}
