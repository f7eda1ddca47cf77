//! Mass, centre and inertia tensor of solids and of what is put together from them.
//!
//! ```text
//! sphere    m = 4/3 π R³ ρ          I = 2/5 m R²
//! cuboid    m = 8 h_x h_y h_z ρ     I_xx = m/3 (h_y² + h_z²)
//! frustum   m = π H/3 (a² + ab + b²) ρ        radii a, b at the distance H
//!           z = H/4 (a² + 2ab + 3b²)/(a² + ab + b²)
//!           I_zz = π H/10 (a⁴ + a³b + a²b² + ab³ + b⁴) ρ
//!           I_xx = I_zz/2 + π H³ (a²/30 + ab/10 + b²/5) ρ - m z²
//! mesh      sums over tetrahedra from an inner point to the triangles:
//!           ∫ dV = d/6,  ∫ x dV = d/24 s,  ∫ x xᵀ dV = d/120 (a aᵀ + b bᵀ + c cᵀ + s sᵀ)
//!           with d = a · (b × c), s = a + b + c
//! ```
//! Parts that overlap count twice where they do; a part without density is a mere surface.

use super::{Body, Part, Solid};
use crate::setup::{SetupError, check};
use crate::walls::{Mesh, Pose};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// How a body resists forces and torques.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MassProperties {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass (m).
    pub centre: Vector3<f64>,
    /// Inertia tensor about the centre of mass (kg m²).
    pub inertia: Matrix3<f64>,
}

/// The inertia tensor of a mass at an arm.
fn at_arm(mass: f64, arm: &Vector3<f64>) -> Matrix3<f64> {
    mass * (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose())
}

fn diagonal(x: f64, y: f64, z: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(x, y, z))
}

impl MassProperties {
    /// The same seen from where a pose puts it.
    pub fn put(&self, pose: &Pose) -> MassProperties {
        let turn = pose.orientation.to_rotation_matrix();
        MassProperties {
            mass: self.mass,
            centre: pose.position + turn * self.centre,
            inertia: turn * self.inertia * turn.transpose(),
        }
    }

    /// The same spread of another mass (kg).
    pub fn scaled_to(&self, mass: f64) -> MassProperties {
        MassProperties {
            mass,
            centre: self.centre,
            inertia: self.inertia * (mass / self.mass),
        }
    }

    /// Of several things together.
    pub fn sum(of: &[MassProperties]) -> MassProperties {
        let mass: f64 = of.iter().map(|p| p.mass).sum();
        if mass == 0.0 {
            return MassProperties::default();
        }
        let moment: Vector3<f64> = of.iter().map(|p| p.mass * p.centre).sum();
        let centre = moment / mass;
        let shifted = of
            .iter()
            .map(|p| p.inertia + at_arm(p.mass, &(p.centre - centre)));
        MassProperties {
            mass,
            centre,
            inertia: shifted.sum(),
        }
    }

    /// Of a solid of a density (kg/m³), in its own axes; a mesh must be closed.
    pub fn of(solid: &Solid, density: f64) -> MassProperties {
        match solid {
            Solid::Sphere { radius } => {
                let mass = 4.0 / 3.0 * PI * radius.powi(3) * density;
                let i = 0.4 * mass * radius * radius;
                MassProperties {
                    mass,
                    centre: Vector3::zeros(),
                    inertia: diagonal(i, i, i),
                }
            }
            Solid::Cuboid { half_sides: h } => {
                let mass = 8.0 * h.x * h.y * h.z * density;
                let about = |a: f64, b: f64| mass / 3.0 * (a * a + b * b);
                MassProperties {
                    mass,
                    centre: Vector3::zeros(),
                    inertia: diagonal(about(h.y, h.z), about(h.z, h.x), about(h.x, h.y)),
                }
            }
            Solid::Frustum {
                radii: [a, b],
                height,
            } => frustum(*a, *b, *height, density),
            Solid::Mesh(mesh) => polyhedron(mesh, density),
        }
    }

    /// Rotation of the principal axes into the given ones, and the principal moments (kg m²).
    pub fn principal(&self) -> (UnitQuaternion<f64>, Vector3<f64>) {
        let i = &self.inertia;
        let skew = i.m12.abs().max(i.m13.abs()).max(i.m23.abs());
        if skew <= 1e-15 * i.trace() {
            return (UnitQuaternion::identity(), i.diagonal());
        }
        let eigen = i.symmetric_eigen();
        let mut axes = eigen.eigenvectors;
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        let turn = Rotation3::from_matrix_unchecked(axes);
        (
            UnitQuaternion::from_rotation_matrix(&turn),
            eigen.eigenvalues,
        )
    }

    /// Checks that some distribution of mass has these numbers.
    pub fn validate(&self, key: &str) -> Result<(), SetupError> {
        check(&format!("{key}.mass"), self.mass, "> 0 kg", |m| m > 0.0)?;
        for c in self.centre.iter() {
            check(&format!("{key}.centre"), *c, "finite, m", |_| true)?;
        }
        for c in self.inertia.iter() {
            check(&format!("{key}.inertia"), *c, "finite, kg m²", |_| true)?;
        }
        let scale = self.inertia.abs().max();
        let skew = (self.inertia - self.inertia.transpose()).abs().max();
        let key = format!("{key}.inertia");
        let word = "0: an inertia tensor is symmetric";
        check(&format!("{key}, its skew part"), skew, word, |s| {
            s <= 1e-9 * scale
        })?;
        let (_, moments) = self.principal();
        check(
            &format!("{key}, its smallest principal moment"),
            moments.min(),
            "> 0 kg m²",
            |m| m > 0.0,
        )?;
        let excess = 2.0 * moments.max() - moments.sum();
        let word = "at most the sum of the other two";
        let key = format!("{key}, its largest principal moment");
        check(&key, moments.max(), word, |m| excess <= 1e-9 * m)
    }
}

fn frustum(a: f64, b: f64, height: f64, density: f64) -> MassProperties {
    let squares = a * a + a * b + b * b;
    let mass = PI * height / 3.0 * squares * density;
    let z = 0.25 * height * (a * a + 2.0 * a * b + 3.0 * b * b) / squares;
    let fourths = a.powi(4) + a.powi(3) * b + a * a * b * b + a * b.powi(3) + b.powi(4);
    let along = PI * height / 10.0 * fourths * density;
    let thirds = a * a / 30.0 + a * b / 10.0 + b * b / 5.0;
    let across = 0.5 * along + PI * height.powi(3) * thirds * density - mass * z * z;
    MassProperties {
        mass,
        centre: Vector3::new(0.0, 0.0, z),
        inertia: diagonal(across, across, along),
    }
}

fn polyhedron(mesh: &Mesh, density: f64) -> MassProperties {
    let [low, high] = mesh.bounds();
    let inner = 0.5 * (low + high);
    let (mut volume, mut first) = (0.0, Vector3::zeros());
    let mut second = Matrix3::zeros();
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.corners.map(|v| v - inner);
        let (d, s) = (a.dot(&b.cross(&c)), a + b + c);
        volume += d / 6.0;
        first += s * (d / 24.0);
        let squares = [a, b, c, s].map(|v| v * v.transpose());
        second += squares.iter().sum::<Matrix3<f64>>() * (d / 120.0);
    }
    // Triangles may run either way round, all of them.
    let density = density * volume.signum();
    let centre = first / volume;
    let second = (second - volume * centre * centre.transpose()) * density;
    MassProperties {
        mass: volume * density,
        centre: inner + centre,
        inertia: Matrix3::identity() * second.trace() - second,
    }
}

/// Whether a mesh bounds a volume: each edge is run through once in either direction.
fn encloses(mesh: &Mesh) -> bool {
    let corners = mesh.corners().iter();
    let edges = corners.flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut open = BTreeSet::new();
    for edge in edges {
        if !open.insert(edge) {
            return false;
        }
    }
    open.iter().all(|&[a, b]| open.contains(&[b, a]))
}

impl Part {
    /// Mass properties in the body's axes.
    pub fn mass_properties(&self) -> MassProperties {
        MassProperties::of(&self.solid, self.density).put(&self.pose)
    }
}

impl Body {
    /// Mass properties in the body's own axes: as given, or from its parts and their densities.
    ///
    /// # Errors
    /// If there is no mass, a mesh with a density is not closed, or no distribution of mass has such an
    /// inertia tensor.
    pub fn mass_properties(&self, key: &str) -> Result<MassProperties, SetupError> {
        let properties = match self.mass {
            Some(given) => given,
            None => {
                for (k, part) in self.parts.iter().enumerate() {
                    let Solid::Mesh(mesh) = &part.solid else {
                        continue;
                    };
                    let open = f64::from(u8::from(!encloses(mesh)));
                    let key = format!("{key}.parts[{k}].mesh: open or wrongly turned edges");
                    let word = "none, or no density, or a mass that is given";
                    check(&key, open, word, |o| o == 0.0 || part.density == 0.0)?;
                }
                let parts: Vec<_> = self.parts.iter().map(Part::mass_properties).collect();
                MassProperties::sum(&parts)
            }
        };
        properties.validate(key)?;
        Ok(properties)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn close(a: &MassProperties, b: &MassProperties, tolerance: f64) {
        let (mass, centre) = (a.mass / b.mass - 1.0, (a.centre - b.centre).norm());
        let inertia = (a.inertia - b.inertia).norm() / b.inertia.norm();
        assert!(mass.abs() < tolerance, "{mass:e}");
        assert!(centre < tolerance, "{centre:e}");
        assert!(inertia < tolerance, "{inertia:e}");
    }

    /// A closed prism over a regular polygon, or the stump of a pyramid.
    fn prism(corners: u32, radii: [f64; 2], height: f64) -> Solid {
        let mut vertices = vec![Vector3::zeros(), Vector3::new(0.0, 0.0, height)];
        let mut triangles = Vec::new();
        for k in 0..corners {
            let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(corners)).sin_cos();
            vertices.push(Vector3::new(radii[0] * c, radii[0] * s, 0.0));
            vertices.push(Vector3::new(radii[1] * c, radii[1] * s, height));
            let [a, b] = [k, (k + 1) % corners].map(|k| 2 + 2 * k);
            triangles.extend([
                [0, b, a],
                [1, a + 1, b + 1],
                [a, b, a + 1],
                [b, b + 1, a + 1],
            ]);
        }
        Solid::Mesh(Arc::new(Mesh::new(vertices, &triangles).unwrap()))
    }

    #[test]
    fn a_cuboid_of_triangles_is_a_cuboid() {
        let solid = prism(4, [2.0_f64.sqrt(); 2], 3.0);
        let half_sides = Vector3::new(1.0, 1.0, 1.5);
        let exact = MassProperties::of(&Solid::Cuboid { half_sides }, 700.0);
        let exact = exact.put(&Pose::at(Vector3::z() * 1.5));
        close(&MassProperties::of(&solid, 700.0), &exact, 1e-14);
    }

    #[test]
    fn a_finely_cut_frustum_tends_to_the_closed_form() {
        let exact = MassProperties::of(
            &Solid::Frustum {
                radii: [0.4, 0.9],
                height: 1.3,
            },
            2.0,
        );
        let cut = |n: u32| MassProperties::of(&prism(n, [0.4, 0.9], 1.3), 2.0);
        let error = |n: u32| (cut(n).inertia - exact.inertia).norm();
        let (coarse, fine) = (error(64), error(1024));
        // The polygon's area falls short by (2π/n)²/6.
        assert!(
            (coarse / fine / 256.0 - 1.0).abs() < 0.02,
            "{coarse:e} {fine:e}"
        );
        assert!((cut(1024).centre - exact.centre).norm() < 1e-12);
    }

    #[test]
    fn a_cone_and_a_cylinder_are_frustums() {
        let (m, r, h) = (PI * 0.3 * 0.3 * 0.8 * 5.0, 0.3, 0.8);
        let rod = Solid::Frustum {
            radii: [r, r],
            height: h,
        };
        let across = m * (3.0 * r * r + h * h) / 12.0;
        let exact = MassProperties {
            mass: m,
            centre: Vector3::z() * 0.4,
            inertia: diagonal(across, across, 0.5 * m * r * r),
        };
        close(&MassProperties::of(&rod, 5.0), &exact, 1e-14);
        let cone = Solid::Frustum {
            radii: [r, 0.0],
            height: h,
        };
        let m = m / 3.0;
        let across = 3.0 / 20.0 * m * (r * r + h * h / 4.0);
        let exact = MassProperties {
            mass: m,
            centre: Vector3::z() * 0.2,
            inertia: diagonal(across, across, 0.3 * m * r * r),
        };
        close(&MassProperties::of(&cone, 5.0), &exact, 1e-14);
    }

    #[test]
    fn a_cuboid_of_turned_cuboids_is_a_cuboid() {
        // Eight pieces, each turned into itself in another way.
        let piece = Solid::Cuboid {
            half_sides: Vector3::new(0.1, 0.2, 0.3),
        };
        let flip = |k: usize| {
            let axis = [Vector3::x(), Vector3::y(), Vector3::z()][k % 3];
            UnitQuaternion::from_scaled_axis(axis * PI)
        };
        let parts: Vec<_> = (0..8)
            .map(|k| {
                let sign = |bit: usize| f64::from((k >> bit & 1) as u8) * 2.0 - 1.0;
                let position = Vector3::new(0.1 * sign(0), 0.2 * sign(1), 0.3 * sign(2));
                let pose = Pose {
                    position,
                    orientation: flip(k),
                };
                MassProperties::of(&piece, 900.0).put(&pose)
            })
            .collect();
        let half_sides = Vector3::new(0.2, 0.4, 0.6);
        let whole = MassProperties::of(&Solid::Cuboid { half_sides }, 900.0);
        close(&MassProperties::sum(&parts), &whole, 1e-14);
    }

    #[test]
    fn principal_axes_give_the_tensor_back() {
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.8, 1.1);
        let half_sides = Vector3::new(0.1, 0.2, 0.3);
        let pose = Pose {
            position: Vector3::new(1.0, 2.0, -1.0),
            orientation: turn,
        };
        let put = MassProperties::of(&Solid::Cuboid { half_sides }, 900.0).put(&pose);
        let (axes, moments) = put.principal();
        let turn = axes.to_rotation_matrix();
        let back = turn * Matrix3::from_diagonal(&moments) * turn.transpose();
        assert!((back - put.inertia).norm() < 1e-14 * put.inertia.norm());
        assert!((turn.matrix().determinant() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn impossible_tensors_are_refused() {
        let with = |x: f64, y: f64, z: f64| MassProperties {
            mass: 1.0,
            centre: Vector3::zeros(),
            inertia: diagonal(x, y, z),
        };
        assert!(with(1.0, 1.0, 2.0).validate("b").is_ok());
        for (x, y, z, words) in [
            (1.0, 1.0, 2.1, "sum of the other two"),
            (1.0, 1.0, 0.0, "smallest principal moment"),
            (f64::NAN, 1.0, 1.0, "finite"),
        ] {
            let error = with(x, y, z).validate("b").unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
