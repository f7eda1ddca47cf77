//! Sums of one instant over the grains and contacts, layer by layer.

use super::{Kernel, Layering, layering::sphere_volume_below};
use colluvium_dem::{BondSample, Partner, Snapshot};
use nalgebra::Vector3;

/// Where each sum starts among the per-layer arrays; array f of layer k sits at `f · count + k`.
pub(super) mod field {
    /// Σ m W (kg).
    pub const MASS: usize = 0;
    /// Σ volume inside the layer (m³).
    pub const VOLUME: usize = 1;
    /// Σ m ζ W, ζ = zᵢ − centre of the layer [kg m].
    pub const MASS_ZETA: usize = 2;
    /// Σ m ζ² W [kg m²].
    pub const MASS_ZETA_2: usize = 3;
    /// Σ m v W [kg m/s], 3 parts.
    pub const MOMENTUM: usize = 4;
    /// Σ m v ζ W [kg m²/s], 3 parts.
    pub const MOMENTUM_ZETA: usize = 7;
    /// Σ m v v W [kg m²/s²]: xx, yy, zz, xy, xz, yz.
    pub const FLUX: usize = 10;
    /// Σ f ⊗ a ∫W [N m], 9 parts, row = direction of the force.
    pub const CONTACT: usize = 16;
    /// Σ m × (mean over the layer of the share above z, minus what lies in the layers above) (kg).
    pub const MASS_ABOVE: usize = 25;
    /// The same of the wall force [N], 3 parts.
    pub const WALL_ABOVE: usize = 26;
    /// Σ f W over wall contacts [N], 3 parts.
    pub const WALL: usize = 29;
    /// Σ m t W [kg s], t since the first sample.
    pub const MASS_TIME: usize = 32;
    /// Σ m t² W [kg s²].
    pub const MASS_TIME_2: usize = 33;
    /// Σ m v t W [kg m], 3 parts.
    pub const MOMENTUM_TIME: usize = 34;
    /// How many arrays there are.
    pub const COUNT: usize = 37;
    /// After the arrays: mass of all free grains (kg).
    pub const TOTAL_MASS: usize = 0;
    /// After the arrays: mass above the uppermost layer (kg).
    pub const MASS_OVER_TOP: usize = 1;
    /// After the arrays: mass below the lowest layer (kg).
    pub const MASS_UNDER_BOTTOM: usize = 2;
    /// How many numbers follow the arrays.
    pub const TAIL: usize = 3;
}

/// Length of the array of sums for a number of layers.
pub(super) fn length(layers: usize) -> usize {
    field::COUNT * layers + field::TAIL
}

/// Shares of a point at height z: calls `put(layer, share, part_above)`, where `part_above` is the mean over
/// the layer of the share above a height, less the share in the layers above.
fn spread<K: Kernel>(kernel: &K, layers: &Layering, z: f64, mut put: impl FnMut(usize, f64, f64)) {
    let reach = kernel.reach();
    for k in layers.touched(z - reach, z + reach) {
        let (a, b) = (layers.face(k) - z, layers.face(k + 1) - z);
        let below_top = kernel.cumulative(b);
        let share = below_top - kernel.cumulative(a);
        let mean_below = (kernel.double_cumulative(b) - kernel.double_cumulative(a)) / (b - a);
        put(k, share, below_top - mean_below);
    }
}

/// Adds one instant to the sums; `first_time` is that of the first sample (s).
pub(super) fn add<K: Kernel>(
    kernel: &K,
    layers: &Layering,
    snapshot: &Snapshot,
    first_time: f64,
    sums: &mut [f64],
) {
    let n = layers.count;
    let time = snapshot.time - first_time;
    for grain in snapshot.grains.iter().filter(|g| !g.fixed) {
        let (z, m, v) = (grain.position.z, grain.mass, grain.velocity);
        spread(kernel, layers, z, |k, share, above| {
            let zeta = z - layers.centre(k);
            let ms = m * share;
            sums[field::MASS * n + k] += ms;
            sums[field::MASS_ZETA * n + k] += ms * zeta;
            sums[field::MASS_ZETA_2 * n + k] += ms * zeta * zeta;
            sums[field::MASS_ABOVE * n + k] += m * above;
            sums[field::MASS_TIME * n + k] += ms * time;
            sums[field::MASS_TIME_2 * n + k] += ms * time * time;
            for axis in 0..3 {
                sums[(field::MOMENTUM_TIME + axis) * n + k] += ms * v[axis] * time;
                sums[(field::MOMENTUM + axis) * n + k] += ms * v[axis];
                sums[(field::MOMENTUM_ZETA + axis) * n + k] += ms * v[axis] * zeta;
            }
            let flux = [
                v.x * v.x,
                v.y * v.y,
                v.z * v.z,
                v.x * v.y,
                v.x * v.z,
                v.y * v.z,
            ];
            for (part, value) in flux.iter().enumerate() {
                sums[(field::FLUX + part) * n + k] += ms * value;
            }
        });
        for k in layers.touched(z - grain.radius, z + grain.radius) {
            let (a, b) = (layers.face(k) - z, layers.face(k + 1) - z);
            sums[field::VOLUME * n + k] +=
                sphere_volume_below(b, grain.radius) - sphere_volume_below(a, grain.radius);
        }
        let tail = &mut sums[field::COUNT * n..];
        tail[field::TOTAL_MASS] += m;
        tail[field::MASS_OVER_TOP] += m * (1.0 - kernel.cumulative(layers.face(n) - z));
        tail[field::MASS_UNDER_BOTTOM] += m * kernel.cumulative(layers.face(0) - z);
    }
    let bonds = snapshot.bonds.iter().map(BondSample::as_contact);
    for contact in snapshot.contacts.iter().copied().chain(bonds) {
        let grain = &snapshot.grains[contact.grain];
        let (other_free, other_z) = match contact.partner {
            Partner::Grain(j) => (!snapshot.grains[j].fixed, snapshot.grains[j].position.z),
            Partner::Wall(_) | Partner::Body(_) => (false, 0.0),
        };
        if !grain.fixed {
            add_arm(
                kernel,
                layers,
                grain.position.z,
                &contact.force,
                &contact.arm,
                sums,
            );
        }
        if other_free {
            let force = -contact.force;
            add_arm(kernel, layers, other_z, &force, &contact.partner_arm, sums);
        }
        let wall = match (grain.fixed, other_free) {
            (false, false) => Some((grain.position.z + contact.arm.z, contact.force)),
            (true, true) => Some((other_z + contact.partner_arm.z, -contact.force)),
            _ => None,
        };
        if let Some((z, force)) = wall {
            spread(kernel, layers, z, |k, share, above| {
                for axis in 0..3 {
                    sums[(field::WALL + axis) * n + k] += share * force[axis];
                    sums[(field::WALL_ABOVE + axis) * n + k] += above * force[axis];
                }
            });
        }
    }
}

/// Adds f ⊗ a ∫₀¹ W(z − z₀ − s a_z) ds of one arm.
fn add_arm<K: Kernel>(
    kernel: &K,
    layers: &Layering,
    z: f64,
    force: &Vector3<f64>,
    arm: &Vector3<f64>,
    sums: &mut [f64],
) {
    let n = layers.count;
    let reach = kernel.reach();
    let end = z + arm.z;
    // The quotient below loses digits as a_z → 0; the point rule is then exact to (a_z/Δz)².
    let level = arm.z.abs() < 1e-5 * layers.thickness;
    for k in layers.touched(z.min(end) - reach, z.max(end) + reach) {
        let (a, b) = (layers.face(k), layers.face(k + 1));
        let climb = kernel.double_cumulative(b - z)
            - kernel.double_cumulative(b - end)
            - kernel.double_cumulative(a - z)
            + kernel.double_cumulative(a - end);
        let share = if level {
            let middle = 0.5 * (z + end);
            kernel.cumulative(b - middle) - kernel.cumulative(a - middle)
        } else {
            climb / arm.z
        };
        for row in 0..3 {
            let at = field::CONTACT + 3 * row;
            sums[at * n + k] += force[row] * arm.x * share;
            sums[(at + 1) * n + k] += force[row] * arm.y * share;
            // Column z needs no quotient: this keeps the balance along z exact for any arm.
            sums[(at + 2) * n + k] += force[row] * climb;
        }
    }
}

/// Momentum above each layer's heights, averaged over the layer [kg m/s]: `into[axis · count + k]`.
pub(super) fn momentum_above<K: Kernel>(
    kernel: &K,
    layers: &Layering,
    snapshot: &Snapshot,
    into: &mut [f64],
) {
    let n = layers.count;
    into.fill(0.0);
    let mut over_top = Vector3::zeros();
    for grain in snapshot.grains.iter().filter(|g| !g.fixed) {
        let momentum = grain.mass * grain.velocity;
        let z = grain.position.z;
        spread(kernel, layers, z, |k, share, above| {
            for axis in 0..3 {
                into[axis * n + k] += momentum[axis] * above;
                // What lies in this layer lies above all lower ones: see the running sum below.
                if k > 0 {
                    into[(3 + axis) * n + k - 1] += momentum[axis] * share;
                }
            }
        });
        over_top += momentum * (1.0 - kernel.cumulative(layers.face(n) - z));
    }
    for axis in 0..3 {
        let mut higher = over_top[axis];
        for k in (0..n).rev() {
            higher += into[(3 + axis) * n + k];
            into[axis * n + k] += higher;
        }
    }
}
