//! Which contacts a sphere has with a mesh.
//!
//! Every triangle within reach offers its nearest point. An edge or a corner offers the same point once for
//! each of its triangles, and most faces only offer the end of their own that is next to a nearer one. So:
//!
//! 1. From the nearest on, an offer is *hidden* if it does not rise above the tangent plane of one already
//!    taken, (p_k − p_j) · n_j ≤ 0. What remains are separate touches: faces that the sphere meets squarely,
//!    edges and corners that point at it. This is the rule that a face hides its edges and an edge its corners
//!    (Hu et al. 2013, doi 10.1002/nme.4487, eliminate contacts by type instead), told by geometry alone: cracks,
//!    T-junctions, doubled vertices and edges of three faces make no difference.
//! 2. Touches whose normals differ by less than the crease angle belong to one gently bent surface and make
//!    one contact ([`super::way_out`]); others are contacts of their own, as in the corner of a box.
//!
//! A touch that appears or vanishes does so where its share is zero, as long as overlaps are below 13 % of the
//! radius (1 − cos of the crease angle): the force is continuous.

use super::super::shape::Foot;
use super::way_out::way_out;
use nalgebra::Vector3;

/// Touches at most; farther ones are left out.
const TOUCHES: usize = 16;

/// Contacts of a sphere with a mesh at most.
pub(crate) const CONTACTS: usize = 8;

/// Cosine of the crease angle, 30°.
const CREASE: f64 = 0.866_025_403_784_438_6;

/// A point that rises above a tangent plane by less than this times the radius does not rise.
const ROUND_OFF: f64 = 1e-9;

/// A foot, and the number of whose it is.
pub(crate) type Offer = (Foot, u32);

/// Offers of triangles, the nearest first.
pub(crate) struct Offers {
    feet: [Offer; 2 * TOUCHES],
    len: usize,
}

/// Contacts with a mesh, the nearest first.
pub(crate) struct MeshContacts {
    feet: [Offer; CONTACTS],
    len: usize,
}

const NOTHING: Offer = (
    Foot {
        distance: f64::INFINITY,
        normal: Vector3::new(0.0, 0.0, 0.0),
    },
    0,
);

impl Offers {
    pub fn none() -> Offers {
        Offers {
            feet: [NOTHING; 2 * TOUCHES],
            len: 0,
        }
    }

    /// Takes an offer in, in order of distance and then of number: the order of asking must not matter.
    pub fn take(&mut self, foot: Foot, number: u32) {
        let before = |(f, n): &Offer| (f.distance, *n) <= (foot.distance, number);
        let at = self.feet[..self.len].partition_point(before);
        if at == self.feet.len() {
            return;
        }
        let end = (self.len + 1).min(self.feet.len());
        self.feet.copy_within(at..end - 1, at + 1);
        self.feet[at] = (foot, number);
        self.len = end;
    }

    /// The offers that no nearer one hides.
    fn touches(&self, radius: f64) -> ([Offer; TOUCHES], usize) {
        let (mut touches, mut len) = ([NOTHING; TOUCHES], 0);
        for offer in &self.feet[..self.len] {
            let foot = &offer.0;
            let hidden = touches[..len].iter().any(|(nearer, _): &Offer| {
                let rise = nearer.distance - foot.distance * foot.normal.dot(&nearer.normal);
                rise <= ROUND_OFF * radius
            });
            if !hidden && len < TOUCHES {
                touches[len] = *offer;
                len += 1;
            }
        }
        (touches, len)
    }

    /// The contacts of a sphere of this radius with all that was offered.
    pub fn contacts(&self, radius: f64) -> MeshContacts {
        let mut contacts = MeshContacts {
            feet: [NOTHING; CONTACTS],
            len: 0,
        };
        let (touches, len) = self.touches(radius);
        let mut taken = [false; TOUCHES];
        for lead in 0..len {
            if taken[lead] || contacts.len == CONTACTS {
                continue;
            }
            let (lead_foot, number) = touches[lead];
            let (mut group, mut count) = ([lead_foot; TOUCHES], 0);
            for k in lead..len {
                let bent = touches[k].0.normal.dot(&lead_foot.normal);
                if !taken[k] && bent >= CREASE {
                    taken[k] = true;
                    group[count] = touches[k].0;
                    count += 1;
                }
            }
            contacts.feet[contacts.len] = (way_out(&group[..count], radius), number);
            contacts.len += 1;
        }
        contacts
    }
}

impl MeshContacts {
    pub fn feet(&self) -> &[Offer] {
        &self.feet[..self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::super::Mesh;
    use super::*;

    /// Two rectangles of unit width that meet along y at x = 0, the right one climbing at an angle (rad).
    fn bent(angle: f64) -> Mesh {
        let (s, c) = angle.sin_cos();
        let at = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
        let corner = |y: f64| [at(-1.0, y, 0.0), at(0.0, y, 0.0), at(c, y, s)];
        let vertices = [corner(-1.0), corner(1.0)].concat();
        let triangles = [[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4]];
        Mesh::new(vertices, &triangles).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Sum of overlap times normal over all contacts of a sphere of radius 0.1: the elastic force over its
    /// stiffness.
    fn push(mesh: &Mesh, centre: Vector3<f64>) -> Vector3<f64> {
        let radius = 0.1;
        let mut offers = Offers::none();
        for (triangle, number) in mesh.triangles().iter().zip(0..) {
            let foot = triangle.foot(&centre);
            if foot.distance < radius {
                offers.take(foot, number);
            }
        }
        let contacts = offers.contacts(radius);
        let pushes = contacts.feet().iter();
        pushes.map(|(f, _)| f.normal * (radius - f.distance)).sum()
    }

    #[test]
    fn the_push_is_continuous_over_flat_bent_and_sharp_edges() {
        for degrees in [
            -90.0, -45.0, -5.0, 0.0, 0.1, 2.0, 10.0, 29.0, 31.0, 45.0, 90.0,
        ] {
            let angle = f64::to_radians(degrees);
            let mesh = bent(angle);
            // Along the left face at a height, then up along the right one, a tenth of the radius deep.
            let height = 0.09;
            let turn = -height * (0.5 * angle.max(0.0)).tan();
            let step = 1e-5;
            let mut before: Option<Vector3<f64>> = None;
            for k in -15_000..15_000 {
                let way = f64::from(k) * step - turn;
                let (s, c) = if way > 0.0 {
                    angle.max(0.0).sin_cos()
                } else {
                    (0.0, 1.0)
                };
                let centre = Vector3::new(turn + way * c, 0.3 * way, height + way * s);
                let force = push(&mesh, centre);
                if let Some(before) = before {
                    let jump = (force - before).norm();
                    assert!(jump < 4.0 * step, "{degrees}° at {way}: {jump:e}");
                }
                before = Some(force);
            }
        }
    }

    #[test]
    fn faces_in_one_plane_push_once_and_walls_of_a_corner_each() {
        let flat = push(&bent(0.0), Vector3::new(0.0, 0.0, 0.09));
        assert!((flat - Vector3::z() * 0.01).norm() < 1e-16, "{flat}");
        let corner = push(
            &bent(std::f64::consts::FRAC_PI_2),
            Vector3::new(-0.09, 0.0, 0.08),
        );
        let both = Vector3::new(-0.01, 0.0, 0.02);
        assert!((corner - both).norm() < 1e-15, "{corner}");
    }

    #[test]
    fn the_order_of_offers_does_not_matter() {
        let mesh = bent(0.2);
        let centre = Vector3::new(-0.001, 0.001, 0.09);
        let feet: Vec<Offer> = mesh
            .triangles()
            .iter()
            .map(|t| t.foot(&centre))
            .zip(0..)
            .collect();
        let contacts = |order: &[usize]| {
            let mut offers = Offers::none();
            for &k in order {
                offers.take(feet[k].0, feet[k].1);
            }
            offers.contacts(0.1).feet().to_vec()
        };
        assert_eq!(contacts(&[0, 1, 2, 3]), contacts(&[3, 1, 0, 2]));
    }
}
