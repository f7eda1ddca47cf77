//! Self-gravity by a tree of Barnes & Hut.
//!
//! Bodies are sorted along a Morton curve; ranges of it that share the leading digits of their codes are
//! the nodes of an octree, stored depth first. A node acts as a whole on a body at distance d from its
//! centre of mass where `b < θ d`, with b the distance of its farthest body from there:
//!
//! ```text
//! φ = -G ( M/r + (r·Q·r)/(2 r⁵) )         Q = Σ m (3 d d - d² 1)        r from the centre of mass
//! g = -G M r/r³ + G ( Q·r/r⁵ - 5/2 (r·Q·r) r/r⁷ )
//! ```
//! No node acts on a body inside it, as θ < 1; θ = 0 is the direct sum. The first term left out is the
//! octupole: the error of a node falls with θ³ of its share, and that of all of them, whose number grows,
//! was measured to fall with θ⁴: 1.6e-3, 5.9e-5, 3.5e-6 at θ = 0.8, 0.4, 0.2 (3 000 bodies; θ³ without
//! quadrupoles). Spheres that do not overlap attract like points: nothing is softened. Forces of a
//! tree do not cancel: their sum is taken off, shared out by mass.
//!
//! Source: Barnes & Hut 1986; Hernquist 1987 for the quadrupoles. Sorting is by code and number and each
//! body walks the tree alone, so the bits depend neither on threads nor on the order of grains.

use nalgebra::Vector3;
use rayon::prelude::*;

/// Centre (m) and mass (kg).
pub(crate) type Body = [f64; 4];

/// Acceleration (m/s²) and potential (m²/s²), both over G.
pub(crate) type Field = [f64; 4];

/// Bodies in a node that is not divided.
const LEAF: usize = 8;

/// Bits of a code along an axis.
const BITS: u32 = 21;

/// Bodies handled by one task.
const BODIES_A_TASK: usize = 256;

#[derive(Clone, Copy, Debug)]
struct Node {
    center: Vector3<f64>,
    mass: f64,
    /// xx, yy, zz, xy, xz, yz.
    quadrupole: [f64; 6],
    /// Square of the distance of the farthest body from the centre of mass (m²).
    reach2: f64,
    bodies: [u32; 2],
    /// Node after the last one inside this.
    after: u32,
    leaf: bool,
}

/// The tree and its buffers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    /// Code, number and row of each body, sorted.
    keys: Vec<(u64, u32, u32)>,
    bodies: Vec<Body>,
    nodes: Vec<Node>,
    fields: Vec<Field>,
    /// What was taken off all accelerations.
    drift: Vector3<f64>,
}

/// Spreads the lowest 21 bits to every third one.
fn spread(x: u64) -> u64 {
    let mut x = x & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

impl Tree {
    /// Builds the tree over bodies with numbers.
    pub fn build(&mut self, of: impl Iterator<Item = (u32, Body)> + Clone) {
        let (mut low, mut high) = (
            Vector3::repeat(f64::INFINITY),
            Vector3::repeat(f64::NEG_INFINITY),
        );
        for (_, x) in of.clone() {
            let x = Vector3::new(x[0], x[1], x[2]);
            (low, high) = (low.inf(&x), high.sup(&x));
        }
        let scale = f64::from(1 << BITS) / (high - low).max().max(f64::MIN_POSITIVE);
        let digit = |x: f64, low: f64| (((x - low) * scale) as u64).min((1 << BITS) - 1);
        self.keys.clear();
        self.keys
            .extend(of.clone().zip(0..).map(|((number, x), row)| {
                let [a, b, c] = [0, 1, 2].map(|k| spread(digit(x[k], low[k])));
                (a << 2 | b << 1 | c, number, row)
            }));
        self.bodies.clear();
        self.bodies.extend(of.map(|(_, x)| x));
        self.keys.sort_unstable();
        self.fields.clear();
        // Bodies in order, by way of the fields' room.
        let ordered = self.keys.iter().map(|&(.., row)| self.bodies[row as usize]);
        self.fields.extend(ordered);
        std::mem::swap(&mut self.bodies, &mut self.fields);
        self.nodes.clear();
        if !self.bodies.is_empty() {
            self.divide([0, self.bodies.len()], BITS);
        }
    }

    /// Adds the node of a range whose codes agree above `level` digits, and all inside it.
    fn divide(&mut self, [from, to]: [usize; 2], mut level: u32) {
        let at = self.nodes.len();
        let mut node = Node::of(&self.bodies[from..to], from);
        let digit = |key: &(u64, u32, u32), level: u32| key.0 >> (3 * (level - 1)) & 7;
        // Digits in which all agree make no node of their own.
        while level > 0 && digit(&self.keys[from], level) == digit(&self.keys[to - 1], level) {
            level -= 1;
        }
        node.leaf = to - from <= LEAF || level == 0;
        let leaf = node.leaf;
        self.nodes.push(node);
        let mut start = from;
        while !leaf && start < to {
            let own = digit(&self.keys[start], level);
            let end = start + self.keys[start..to].partition_point(|key| digit(key, level) == own);
            self.divide([start, end], level - 1);
            start = end;
        }
        self.nodes[at].after = self.nodes.len() as u32;
    }

    /// Fields on all bodies, for an opening angle θ.
    pub fn evaluate(&mut self, opening: f64, parallel: bool) {
        let mut fields = std::mem::take(&mut self.fields);
        fields.resize(self.bodies.len(), [0.0; 4]);
        let tree = &*self;
        let evaluate = |first: usize, fields: &mut [Field]| {
            for (k, field) in fields.iter_mut().enumerate() {
                *field = tree.field(first + k, opening);
            }
        };
        if parallel {
            fields
                .par_chunks_mut(BODIES_A_TASK)
                .enumerate()
                .for_each(|(task, fields)| evaluate(task * BODIES_A_TASK, fields));
        } else {
            evaluate(0, &mut fields);
        }
        self.fields = fields;
        self.balance();
    }

    /// Takes off the acceleration that the forces of the tree, which do not quite cancel, would give
    /// all bodies together: momentum is then kept to round-off.
    fn balance(&mut self) {
        let (mut force, mut mass) = (Vector3::zeros(), 0.0);
        for (body, field) in self.bodies.iter().zip(&self.fields) {
            force += body[3] * Vector3::new(field[0], field[1], field[2]);
            mass += body[3];
        }
        self.drift = if mass > 0.0 { force / mass } else { force };
        for field in &mut self.fields {
            for (field, drift) in field.iter_mut().zip(self.drift.iter()) {
                *field -= drift;
            }
        }
    }

    /// Row and field of each body.
    pub fn fields(&self) -> impl Iterator<Item = (usize, &Field)> {
        let rows = self.keys.iter().map(|&(.., row)| row as usize);
        rows.zip(&self.fields)
    }

    /// Field on one body, by its place in the order.
    fn field(&self, body: usize, opening: f64) -> Field {
        let at = &self.bodies[body];
        let x = Vector3::new(at[0], at[1], at[2]);
        let opening2 = opening * opening;
        let mut field = [0.0; 4];
        let mut next = 0;
        while let Some(node) = self.nodes.get(next) {
            let r = x - node.center;
            let r2 = r.norm_squared();
            if node.reach2 < opening2 * r2 {
                node.attract(&r, r2, &mut field);
                next = node.after as usize;
            } else if node.leaf {
                let [from, to] = node.bodies.map(|b| b as usize);
                for (k, other) in (from..to).zip(&self.bodies[from..to]) {
                    if k != body {
                        attract(at, other, &mut field);
                    }
                }
                next = node.after as usize;
            } else {
                next += 1;
            }
        }
        field
    }

    /// Root mean square and largest error of the accelerations against the direct sum, both over the
    /// root mean square acceleration; and what did not cancel. Of at most so many bodies, evenly picked.
    pub fn error(&self, most: usize) -> TreeError {
        let (mut square, mut largest, mut size) = (0.0, 0.0_f64, 0.0);
        let (mut mass, mut sizes) = (0.0, 0.0);
        let every = self.bodies.len().div_ceil(most.max(1)).max(1);
        for (body, field) in self.bodies.iter().zip(&self.fields) {
            mass += body[3];
            sizes += body[3] * Vector3::new(field[0], field[1], field[2]).norm();
        }
        let mut looked_at = 0.0;
        let all = self.bodies.iter().zip(&self.fields).enumerate();
        for (k, (body, field)) in all.step_by(every) {
            looked_at += 1.0;
            let mut exact = [0.0; 4];
            for (l, other) in self.bodies.iter().enumerate() {
                if l != k {
                    attract(body, other, &mut exact);
                }
            }
            let [exact, found] = [&exact, field].map(|f| Vector3::new(f[0], f[1], f[2]));
            let off = (found - exact).norm_squared();
            square += off;
            largest = largest.max(off);
            size += exact.norm_squared();
        }
        let over = |value: f64, scale: f64| if scale > 0.0 { value / scale } else { 0.0 };
        TreeError {
            rms: over(square, size).sqrt(),
            largest: over(largest * looked_at, size).sqrt(),
            net_force: over(mass * self.drift.norm(), sizes),
        }
    }
}

/// How far a tree is from the direct sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeError {
    /// Root mean square error of accelerations over their root mean square.
    pub rms: f64,
    /// The largest error of any, over the same.
    pub largest: f64,
    /// Sum of all forces, which should cancel and is taken off them, over the sum of their sizes.
    pub net_force: f64,
}

impl Node {
    fn of(bodies: &[Body], from: usize) -> Node {
        let place = |b: &Body| Vector3::new(b[0], b[1], b[2]);
        let mass: f64 = bodies.iter().map(|b| b[3]).sum();
        let weighed: Vector3<f64> = bodies.iter().map(|b| b[3] * place(b)).sum();
        let center = weighed / mass;
        let mut quadrupole = [0.0; 6];
        let mut reach2 = 0.0_f64;
        for body in bodies {
            let d = place(body) - center;
            let d2 = d.norm_squared();
            reach2 = reach2.max(d2);
            let m = body[3];
            let own = [d.x, d.y, d.z].map(|c| 3.0 * c * c - d2);
            let mixed = [d.x * d.y, d.x * d.z, d.y * d.z].map(|c| 3.0 * c);
            for (sum, part) in quadrupole.iter_mut().zip(own.into_iter().chain(mixed)) {
                *sum += m * part;
            }
        }
        Node {
            center,
            mass,
            quadrupole,
            reach2,
            bodies: [from as u32, (from + bodies.len()) as u32],
            after: 0,
            leaf: false,
        }
    }

    #[inline(always)]
    fn attract(&self, r: &Vector3<f64>, r2: f64, field: &mut Field) {
        let [xx, yy, zz, xy, xz, yz] = self.quadrupole;
        let inverse2 = 1.0 / r2;
        let inverse = inverse2.sqrt();
        let inverse3 = inverse * inverse2;
        let inverse5 = inverse3 * inverse2;
        let q = [
            xx * r.x + xy * r.y + xz * r.z,
            xy * r.x + yy * r.y + yz * r.z,
            xz * r.x + yz * r.y + zz * r.z,
        ];
        let along = q[0] * r.x + q[1] * r.y + q[2] * r.z;
        let radial = self.mass * inverse3 + 2.5 * along * inverse5 * inverse2;
        for k in 0..3 {
            field[k] += q[k] * inverse5 - radial * r[k];
        }
        field[3] -= self.mass * inverse + 0.5 * along * inverse5;
    }
}

/// Adds the field of one body at another.
#[inline(always)]
fn attract(at: &Body, other: &Body, field: &mut Field) {
    let d = [0, 1, 2].map(|k| at[k] - other[k]);
    let r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    // Two centres in one place pull in no direction.
    if r2 == 0.0 {
        return;
    }
    let inverse = 1.0 / r2.sqrt();
    let pull = other[3] * inverse / r2;
    for k in 0..3 {
        field[k] -= pull * d[k];
    }
    field[3] -= other[3] * inverse;
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A lumpy cloud: masses over three decades, denser towards its middle.
    fn cloud(n: usize) -> Vec<(u32, Body)> {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut body = |number| {
            let x: [f64; 3] = [0; 3].map(|_| random.random_range(-1.0_f64..1.0).powi(3));
            let mass = 10_f64.powf(random.random_range(-3.0..0.0));
            (number, [x[0], x[1], 0.4 * x[2], mass])
        };
        (0..n as u32).map(&mut body).collect()
    }

    fn grown(bodies: &[(u32, Body)], opening: f64, parallel: bool) -> Tree {
        let mut tree = Tree::default();
        tree.build(bodies.iter().copied());
        tree.evaluate(opening, parallel);
        tree
    }

    #[test]
    fn the_error_falls_with_the_fourth_power_of_the_opening_angle() {
        let bodies = cloud(3000);
        assert!(grown(&bodies, 0.0, false).error(usize::MAX).rms < 1e-15);
        let errors: Vec<TreeError> = [0.8, 0.4, 0.2]
            .map(|opening| grown(&bodies, opening, false).error(usize::MAX))
            .to_vec();
        for pair in errors.windows(2) {
            let order = (pair[0].rms / pair[1].rms).log2();
            assert!(order > 3.7, "order {order}: {errors:?}");
        }
        assert!(
            errors[1].rms < 5e-4 && errors[1].largest < 1e-2,
            "{errors:?}"
        );
        assert!(errors[1].net_force < 2e-4, "{errors:?}");
        let tree = grown(&bodies, 0.8, false);
        let of = |b: &Body, f: &Field| b[3] * Vector3::new(f[0], f[1], f[2]);
        let forces = tree.bodies.iter().zip(&tree.fields).map(|(b, f)| of(b, f));
        let (net, size) = forces.fold((Vector3::zeros(), 0.0), |(net, size), f| {
            (net + f, size + f.norm())
        });
        assert!(net.norm() < 1e-14 * size, "momentum is kept: {net}");
        // Without quadrupoles a power is missing: they are right and needed.
        let order = |opening: f64| {
            let rms = |opening: f64| {
                let mut tree = Tree::default();
                tree.build(bodies.iter().copied());
                tree.nodes.iter_mut().for_each(|n| n.quadrupole = [0.0; 6]);
                tree.evaluate(opening, false);
                tree.error(usize::MAX).rms
            };
            (rms(opening) / rms(0.5 * opening)).log2()
        };
        assert!(order(0.4) < 3.2, "{}", order(0.4));
    }

    #[test]
    fn the_potential_belongs_to_the_field() {
        let bodies = cloud(600);
        let tree = grown(&bodies, 0.0, false);
        let approximate = grown(&bodies, 0.4, false);
        for ((row, exact), (_, found)) in tree.fields().zip(approximate.fields()) {
            assert!((exact[3] - found[3]).abs() < 2e-3 * exact[3].abs(), "{row}");
        }
        // The slope of the potential of a node is its field.
        let node = Node::of(&bodies.iter().map(|b| b.1).collect::<Vec<_>>(), 0);
        let field = |r: Vector3<f64>| {
            let mut field = [0.0; 4];
            node.attract(&r, r.norm_squared(), &mut field);
            field
        };
        let (r, e) = (Vector3::new(2.0, -1.5, 1.0), 1e-5);
        for k in 0..3 {
            let d = e * Vector3::ith(k, 1.0);
            let slope = -(field(r + d)[3] - field(r - d)[3]) / (2.0 * e);
            assert!((field(r)[k] - slope).abs() < 1e-6 * slope.abs());
        }
    }

    #[test]
    fn neither_threads_nor_the_order_of_bodies_change_a_bit() {
        let bodies = cloud(2000);
        let sorted = |bodies: &[(u32, Body)], parallel: bool| {
            let tree = grown(bodies, 0.5, parallel);
            let mut fields: Vec<_> = tree
                .fields()
                .map(|(row, f)| (bodies[row].0, f.map(f64::to_bits)))
                .collect();
            fields.sort_unstable();
            fields
        };
        let mut turned = bodies.clone();
        turned.reverse();
        assert_eq!(sorted(&bodies, false), sorted(&turned, true));
    }

    #[test]
    fn bodies_in_one_place_do_not_break_the_tree() {
        let bodies: Vec<(u32, Body)> = (0..40).map(|k| (k, [1.0, 2.0, 3.0, 1.0])).collect();
        let tree = grown(&bodies, 0.5, false);
        assert!(tree.fields().all(|(_, f)| f.iter().all(|x| *x == 0.0)));
        assert_eq!(grown(&[], 0.5, false).fields().count(), 0);
    }
}
