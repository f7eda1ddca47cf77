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
//! A fine mesh may offer far more than a step has room for. Offers are looked at in rounds, the nearest first: each
//! leaves out what touches of earlier rounds hide, so that hidden offers take no one's room and the outcome is that
//! of looking at all of them at once.
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

/// Offers looked at in a round.
const ROUND: usize = 2 * TOUCHES;

/// Offers of triangles, the nearest first.
pub(crate) struct Offers {
    feet: [Offer; ROUND],
    len: usize,
    /// Whether some were left for another round.
    left: bool,
    /// The last offer of the rounds before, if there were any, and what they found.
    seen: Option<(f64, u32)>,
    touches: [Offer; TOUCHES],
    found: usize,
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
    fn none() -> Offers {
        Offers {
            feet: [NOTHING; ROUND],
            len: 0,
            left: false,
            seen: None,
            touches: [NOTHING; TOUCHES],
            found: 0,
        }
    }

    /// Takes an offer in, in order of distance and then of number: the order of asking must not matter.
    pub fn take(&mut self, foot: Foot, number: u32, radius: f64) {
        let before = |(f, n): &Offer| (f.distance, *n) <= (foot.distance, number);
        let again = |seen: (f64, u32)| (foot.distance, number) <= seen || self.hides(&foot, radius);
        if self.seen.is_some_and(again) {
            return;
        }
        let at = self.feet[..self.len].partition_point(before);
        self.left |= self.len == ROUND;
        if at == ROUND {
            return;
        }
        let end = (self.len + 1).min(ROUND);
        self.feet.copy_within(at..end - 1, at + 1);
        self.feet[at] = (foot, number);
        self.len = end;
    }

    /// Whether a touch hides an offer that is farther.
    fn hides(&self, foot: &Foot, radius: f64) -> bool {
        self.touches[..self.found].iter().any(|(nearer, _)| {
            let rise = nearer.distance - foot.distance * foot.normal.dot(&nearer.normal);
            rise <= ROUND_OFF * radius
        })
    }

    /// Adds the offers of a round that no nearer one hides to the touches; whether there may be more.
    fn look(&mut self, radius: f64) -> bool {
        for k in 0..self.len {
            let offer = self.feet[k];
            if self.found < TOUCHES && !self.hides(&offer.0, radius) {
                self.touches[self.found] = offer;
                self.found += 1;
            }
            self.seen = Some((offer.0.distance, offer.1));
        }
        self.len = 0;
        std::mem::take(&mut self.left) && self.found < TOUCHES
    }

    /// The contacts of a sphere of this radius with all that `ask` offers; it is asked once a round.
    pub fn contacts(radius: f64, mut ask: impl FnMut(&mut Offers)) -> MeshContacts {
        let mut offers = Offers::none();
        loop {
            ask(&mut offers);
            if !offers.look(radius) {
                return offers.group(radius);
            }
        }
    }

    /// Puts touches of one surface together.
    fn group(&self, radius: f64) -> MeshContacts {
        let mut contacts = MeshContacts {
            feet: [NOTHING; CONTACTS],
            len: 0,
        };
        let (touches, len) = (&self.touches, self.found);
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
        let contacts = Offers::contacts(radius, |offers| {
            for (triangle, number) in mesh.triangles().iter().zip(0..) {
                let foot = triangle.foot(&centre);
                if foot.distance < radius {
                    offers.take(foot, number, radius);
                }
            }
        });
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

    /// A floor and a wall at x = 0, in squares of a side, two triangles each.
    fn right_angle(side: f64, count: u32) -> Mesh {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for wall in [false, true] {
            let first = vertices.len() as u32;
            for (i, j) in (0..=count).flat_map(|i| (0..=count).map(move |j| (i, j))) {
                let [across, along] = [i, j].map(|k| side * f64::from(k));
                let along = along - 0.5 * side * f64::from(count);
                vertices.push(if wall {
                    Vector3::new(0.0, along, across)
                } else {
                    Vector3::new(across, along, 0.0)
                });
            }
            for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
                let at = |i: u32, j: u32| first + i * (count + 1) + j;
                triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        Mesh::new(vertices, &triangles).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn a_fine_mesh_on_the_deeper_wall_of_a_corner_takes_no_room_from_the_other() {
        let centre = Vector3::new(0.0995, 0.0003, 0.099);
        for (side, count) in [(0.2, 1), (0.005, 40), (0.0025, 80)] {
            let mesh = right_angle(side, count);
            let reached = mesh.triangles().iter().map(|t| t.foot(&centre).distance);
            let reached = reached.filter(|d| *d < 0.1).count();
            assert!((reached > ROUND) == (count > 1), "{reached}");
            let push = push(&mesh, centre);
            let both = Vector3::new(0.0005, 0.0, 0.001);
            assert!((push - both).norm() < 1e-15, "{count}: {push}");
        }
    }

    #[test]
    fn the_order_of_offers_does_not_matter() {
        let fine = (right_angle(0.005, 40), Vector3::new(0.0995, 0.0003, 0.099));
        let bent = (bent(0.2), Vector3::new(-0.001, 0.001, 0.09));
        for (mesh, centre) in [fine, bent] {
            let feet = mesh.triangles().iter().map(|t| t.foot(&centre));
            let feet: Vec<Offer> = feet.zip(0..).filter(|(f, _)| f.distance < 0.1).collect();
            let contacts = |stride: usize| {
                let contacts = Offers::contacts(0.1, |offers| {
                    for k in 0..feet.len() {
                        let (foot, number) = feet[k * stride % feet.len()];
                        offers.take(foot, number, 0.1);
                    }
                });
                contacts.feet().to_vec()
            };
            let coprime = (3..).find(|s| gcd(*s, feet.len()) == 1).unwrap_or(1);
            for stride in [feet.len() - 1, coprime] {
                assert_eq!(contacts(1), contacts(stride), "{stride}");
            }
        }
    }

    fn gcd(a: usize, b: usize) -> usize {
        if b == 0 { a } else { gcd(b, a % b) }
    }
}
