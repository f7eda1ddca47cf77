//! Fields from the sums at points, and the balances they obey.

use super::sums_at_points::{PointSums, SYMMETRIC, sum};
use super::{Geometry, Smoothing};
use colluvium_dem::{BondSample, Partner, Snapshot};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Fields at one point, of one species or of all. Stresses are positive in tension, tensors have the direction of
/// the force (moment) as row. Densities that need matter are 0 where there is none within the kernel's reach.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointFields {
    /// ρ = Σ m W [kg/m³].
    pub density: f64,
    /// φ = Σ V W, smoothed by the kernel as the density is; see [`solid_fractions`](super::solid_fractions) for
    /// the exact one of cells.
    pub solid_fraction: f64,
    /// Σ W [1/m³].
    pub number_density: f64,
    /// j = Σ m v W [kg/(m² s)].
    pub momentum: Vector3<f64>,
    /// V = j/ρ [m/s].
    pub velocity: Vector3<f64>,
    /// σᵏ = −Σ m (v − V)(v − V) W (Pa).
    pub kinetic_stress: Matrix3<f64>,
    /// σᶜ = Σ f ⊗ a ∫W (Pa).
    pub contact_stress: Matrix3<f64>,
    /// t = Σ f W over contacts with walls and fixed grains [N/m³].
    pub wall_force: Vector3<f64>,
    /// Force of the other species [N/m³] (Tunuguntla et al. 2016); 0 for the sum of all.
    pub drag: Vector3<f64>,
    /// T = −trace(σᵏ)/(3ρ) [m²/s²].
    pub temperature: f64,
    /// s = Σ I ω W [kg/(m s)].
    pub spin_density: Vector3<f64>,
    /// ∑ I ω vᵀ W − s Vᵀ, negative: the kinetic part of the couple stress [N/m].
    pub kinetic_couple_stress: Matrix3<f64>,
    /// M = Σ (a × f) ⊗ a ∫(1 − s)W + m ⊗ a ∫W, m the moment at the contact point [N/m] (Goldhirsch 2010).
    pub couple_stress: Matrix3<f64>,
    /// Moments at contact points that no partner answers: walls, fixed grains [N/m²].
    pub moment: Vector3<f64>,
    /// Mean of n ⊗ n over contacts, trace 1.
    pub fabric: Matrix3<f64>,
    /// Mean number of contacts of a grain.
    pub coordination: f64,
}

impl PointFields {
    /// σᵏ + σᶜ (Pa).
    pub fn stress(&self) -> Matrix3<f64> {
        self.kinetic_stress + self.contact_stress
    }

    /// p = −trace(σ)/3 (Pa).
    pub fn pressure(&self) -> f64 {
        -self.stress().trace() / 3.0
    }

    fn of(sums: &[f64], scale: f64) -> Self {
        let at = |k: usize| scale * sums[k];
        let vector = |k: usize| Vector3::new(at(k), at(k + 1), at(k + 2));
        let matrix = |k: usize| Matrix3::from_fn(|row, column| at(k + 3 * row + column));
        let symmetric = |k: usize| {
            let mut m = Matrix3::zeros();
            for (part, (i, j)) in SYMMETRIC.into_iter().enumerate() {
                (m[(i, j)], m[(j, i)]) = (at(k + part), at(k + part));
            }
            m
        };
        let ratio = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
        let density = at(sum::MASS);
        let momentum = vector(sum::MOMENTUM);
        let velocity = momentum.map(|x| ratio(x, density));
        let spin_density = vector(sum::SPIN);
        let kinetic_stress = momentum * velocity.transpose() - symmetric(sum::FLUX);
        Self {
            density,
            solid_fraction: at(sum::VOLUME),
            number_density: at(sum::NUMBER),
            momentum,
            velocity,
            kinetic_stress,
            contact_stress: matrix(sum::CONTACT),
            wall_force: vector(sum::WALL),
            drag: vector(sum::DRAG),
            temperature: ratio(-kinetic_stress.trace() / 3.0, density),
            spin_density,
            kinetic_couple_stress: spin_density * velocity.transpose() - matrix(sum::SPIN_FLUX),
            couple_stress: matrix(sum::COUPLE),
            moment: vector(sum::MOMENT),
            fabric: symmetric(sum::FABRIC).map(|x| ratio(x, at(sum::CONTACTS))),
            coordination: ratio(at(sum::CONTACTS), at(sum::NUMBER)),
        }
    }

    /// Vectors and tensors as seen in axes turned by an angle about z.
    fn turned(&self, angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        let turn = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        let tensor = |m: &Matrix3<f64>| turn * m * turn.transpose();
        Self {
            momentum: turn * self.momentum,
            velocity: turn * self.velocity,
            kinetic_stress: tensor(&self.kinetic_stress),
            contact_stress: tensor(&self.contact_stress),
            wall_force: turn * self.wall_force,
            drag: turn * self.drag,
            spin_density: turn * self.spin_density,
            kinetic_couple_stress: tensor(&self.kinetic_couple_stress),
            couple_stress: tensor(&self.couple_stress),
            moment: turn * self.moment,
            fabric: tensor(&self.fabric),
            ..*self
        }
    }

    /// The mean of fields at several points; velocity and temperature by mass, fabric by contacts.
    fn mean(list: &[Self]) -> Self {
        let n = list.len() as f64;
        let mut m = Self::default();
        let (mut flux, mut spin_flux, mut contacts) = (Matrix3::zeros(), Matrix3::zeros(), 0.0);
        for f in list {
            m.density += f.density / n;
            m.solid_fraction += f.solid_fraction / n;
            m.number_density += f.number_density / n;
            m.momentum += f.momentum / n;
            m.contact_stress += f.contact_stress / n;
            m.wall_force += f.wall_force / n;
            m.drag += f.drag / n;
            m.spin_density += f.spin_density / n;
            m.couple_stress += f.couple_stress / n;
            m.moment += f.moment / n;
            flux += (f.momentum * f.velocity.transpose() - f.kinetic_stress) / n;
            spin_flux += (f.spin_density * f.velocity.transpose() - f.kinetic_couple_stress) / n;
            let own = f.coordination * f.number_density;
            contacts += own / n;
            m.fabric += own * f.fabric / n;
        }
        if m.density > 0.0 {
            m.velocity = m.momentum / m.density;
        }
        m.kinetic_stress = m.momentum * m.velocity.transpose() - flux;
        m.kinetic_couple_stress = m.spin_density * m.velocity.transpose() - spin_flux;
        if m.density > 0.0 {
            m.temperature = -m.kinetic_stress.trace() / (3.0 * m.density);
        }
        if contacts > 0.0 {
            m.fabric /= contacts;
            m.coordination = contacts / m.number_density;
        }
        m
    }
}

impl PointSums {
    /// Means over the samples, point by point: of one species, or of all together. A cylinder has one entry for
    /// each (radius, z), averaged over the angles, with the parts (radial, azimuthal, axial).
    pub fn fields(&self, species: Option<usize>) -> Vec<PointFields> {
        let stride = self.species * sum::COUNT;
        let scale = 1.0 / (self.samples.max(1) as f64 * self.averaged_extent);
        let at = |point: usize| {
            let own = &self.sums[point * stride..][..stride];
            let Some(species) = species else {
                let mut all = [0.0; sum::COUNT];
                for part in own.chunks_exact(sum::COUNT) {
                    for (a, b) in all.iter_mut().zip(part) {
                        *a += b;
                    }
                }
                // What the species do to each other is stress of the whole.
                all[sum::DRAG..sum::DRAG + 3].fill(0.0);
                return PointFields::of(&all, scale);
            };
            let own = own.chunks_exact(sum::COUNT).nth(species);
            own.map_or_else(PointFields::default, |own| PointFields::of(own, scale))
        };
        if !matches!(self.mesh.geometry(), Geometry::Cylinder { .. }) {
            return (0..self.mesh.points().len()).map(at).collect();
        }
        let [radii, angles, heights] = self.mesh.cells().count;
        let mut means = Vec::with_capacity(radii * heights);
        for k in 0..heights {
            for i in 0..radii {
                let around: Vec<PointFields> = (0..angles)
                    .map(|j| at((k * angles + j) * radii + i).turned(self.mesh.angle(j)))
                    .collect();
                means.push(PointFields::mean(&around));
            }
        }
        means
    }

    /// Where the entries of [`PointSums::fields`] lie (m); of a cylinder, (radius, 0, z).
    pub fn places(&self) -> Vec<[f64; 3]> {
        let Geometry::Cylinder { .. } = self.mesh.geometry() else {
            return self.mesh.points().iter().map(|p| (*p).into()).collect();
        };
        let cells = self.mesh.cells();
        let at = |axis: usize, n: usize| cells.lower[axis] + cells.size[axis] * (n as f64 + 0.5);
        (0..cells.count[2])
            .flat_map(|k| (0..cells.count[0]).map(move |i| (i, k)))
            .map(|(i, k)| [at(0, i), 0.0, at(2, k)])
            .collect()
    }
}

/// Every term of the balances of mass, momentum and spin at a point, from forces and velocities of one instant and
/// with exact derivatives of the kernel:
///
/// ∂ₜρ + ∇·j = 0, ∂ₜj + ∇·(ρVV − σ) = t + ρg, ∂ₜs + ∇·(sV − M − Mᵏ) = ε:σ + m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balance {
    /// ∂ₜρ = −Σ m v·∇W.
    pub density_rate: f64,
    /// ∇·j.
    pub outflow: f64,
    /// ∂ₜj = Σ F W − Σ m v (v·∇W), F all forces on a grain.
    pub momentum_rate: Vector3<f64>,
    /// ∇·(ρVV − σ).
    pub momentum_outflow: Vector3<f64>,
    /// t + ρg.
    pub supply: Vector3<f64>,
    /// ∂ₜs = Σ τ W − Σ S (v·∇W), τ all torques on a grain.
    pub spin_rate: Vector3<f64>,
    /// ∇·(sV − M − Mᵏ), Mᵏ the kinetic part.
    pub spin_outflow: Vector3<f64>,
    /// ε:σ + m, the torque of the stress that is not symmetric and what moments no partner answers.
    pub spin_supply: Vector3<f64>,
}

impl Balance {
    /// Terms at a point (m); the images next to the box count where an axis is periodic. No other forces than contacts,
    /// bonds and gravity are known here. `kernel` is one in three dimensions.
    pub fn at(kernel: &Smoothing, snapshot: &Snapshot, point: Vector3<f64>) -> Self {
        let n = snapshot.grains.len();
        let (mut force, mut torque) = (vec![Vector3::zeros(); n], vec![Vector3::zeros(); n]);
        let bonds = snapshot.bonds.iter().map(BondSample::as_contact);
        for c in snapshot.contacts.iter().copied().chain(bonds) {
            force[c.grain] += c.force;
            torque[c.grain] += c.torque;
            if let Partner::Grain(j) = c.partner {
                force[j] -= c.force;
                torque[j] += c.partner_torque;
            }
        }
        let mut balance = Self::default();
        let lengths = snapshot.domain.lengths();
        let images = |axis: usize| {
            let periodic = snapshot.domain.periodic[axis];
            (if periodic { -1..=1 } else { 0..=0 }).map(move |n| f64::from(n) * lengths[axis])
        };
        for x in images(0) {
            for y in images(1) {
                for z in images(2) {
                    let seen = point + Vector3::new(x, y, z);
                    balance.add_image(kernel, snapshot, seen, [&force, &torque]);
                }
            }
        }
        balance
    }

    /// Adds what an image of the point sees; `acting` are forces and torques on the grains.
    fn add_image(
        &mut self,
        kernel: &Smoothing,
        snapshot: &Snapshot,
        point: Vector3<f64>,
        acting: [&[Vector3<f64>]; 2],
    ) {
        let b = self;
        let w_of = |apart: &Vector3<f64>| kernel.value(apart.norm_squared());
        let apart_from = |i: usize| point - snapshot.grains[i].position;
        let bonds = snapshot.bonds.iter().map(BondSample::as_contact);
        for c in snapshot.contacts.iter().copied().chain(bonds) {
            let (own, other) = (c.grain, c.partner);
            let fixed = |p: Partner| match p {
                Partner::Grain(j) => snapshot.grains[j].fixed,
                Partner::Wall(_) | Partner::Body(_) => true,
            };
            let mut side = |i: usize, beyond: Partner, f: Vector3<f64>, arm, turn| {
                if snapshot.grains[i].fixed {
                    return;
                }
                let arm: Vector3<f64> = arm;
                let apart = apart_from(i);
                let lever = arm.cross(&f);
                let moment: Vector3<f64> = turn - lever;
                let (start, end) = (w_of(&apart), w_of(&(apart - arm)));
                let whole = kernel.along(apart.into(), arm.into()).whole;
                // a·∇∫W ds = W(start) − W(end), and a·∇∫(1 − s)W ds = W(start) − ∫W ds.
                b.momentum_outflow -= f * (start - end);
                b.spin_outflow -= lever * (start - whole) + moment * (start - end);
                b.spin_supply += lever * whole + moment * end;
                if fixed(beyond) {
                    b.supply += f * end;
                }
            };
            side(own, other, c.force, c.arm, c.torque);
            if let Partner::Grain(j) = other {
                side(
                    j,
                    Partner::Grain(own),
                    -c.force,
                    c.partner_arm,
                    c.partner_torque,
                );
            }
        }
        for (i, grain) in snapshot.grains.iter().enumerate().filter(|(_, g)| !g.fixed) {
            let apart = apart_from(i);
            let w = w_of(&apart);
            let slope = kernel.slope_over_distance(apart.norm_squared());
            let advection = slope * apart.dot(&grain.velocity);
            let spin = 0.4 * grain.mass * grain.radius * grain.radius * grain.spin;
            let weight = grain.mass * snapshot.gravity;
            let carried = grain.mass * advection * grain.velocity;
            b.density_rate -= grain.mass * advection;
            b.outflow += grain.mass * advection;
            b.momentum_rate += w * (acting[0][i] + weight) - carried;
            b.momentum_outflow += carried;
            b.supply += w * weight;
            b.spin_rate += w * acting[1][i] - advection * spin;
            b.spin_outflow += advection * spin;
        }
    }

    /// What the balances of mass, momentum and spin miss, each with the sum of the sizes of its terms.
    pub fn residuals(&self) -> [[f64; 2]; 3] {
        let vector = |rate: Vector3<f64>, outflow: Vector3<f64>, supply: Vector3<f64>| {
            let size = rate.norm() + outflow.norm() + supply.norm();
            [(rate + outflow - supply).norm(), size]
        };
        [
            [
                (self.density_rate + self.outflow).abs(),
                self.density_rate.abs() + self.outflow.abs(),
            ],
            vector(self.momentum_rate, self.momentum_outflow, self.supply),
            vector(self.spin_rate, self.spin_outflow, self.spin_supply),
        ]
    }
}
