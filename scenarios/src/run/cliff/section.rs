//! A cliff in section: x forward from the foot of its face, y along it, z up from the ground.
//!
//! ```text
//! face   x = (z - z_w) tan θ        crack   x = -(z - z_w) tan α        z_w top of the wall below
//! ```
//! What lies between crack and face stands on the foot like a triangle on its tip.

use crate::scene::CliffScene;
use colluvium_dem::{Region, Wall};
use nalgebra::Vector3;

/// All that is a half-space's far side (m).
const FAR: f64 = 1e6;

/// What lies behind a plane through a point, on the side its normal does not point to.
fn behind(point: Vector3<f64>, normal: Vector3<f64>) -> Region {
    Region::Slab {
        point: point - 0.5 * FAR * normal,
        normal,
        thickness: FAR,
    }
}

impl CliffScene {
    /// Foot of the face (m).
    pub fn foot(&self) -> Vector3<f64> {
        self.shape.wall * Vector3::z()
    }

    /// How far the top of the face leans out over the foot (m).
    pub fn lip(&self) -> f64 {
        self.face() * self.shape.overhang_degrees.to_radians().tan()
    }

    /// How far the head of the crack lies behind the foot (m).
    pub fn crack_head(&self) -> f64 {
        self.face() * self.crack.degrees.to_radians().tan()
    }

    /// Where the cliff's back is (m).
    pub fn back(&self) -> f64 {
        -(self.crack_head() + self.shape.behind)
    }

    /// Outward normal of the face.
    pub fn outward(&self) -> Vector3<f64> {
        let (s, c) = self.shape.overhang_degrees.to_radians().sin_cos();
        Vector3::new(c, 0.0, -s)
    }

    /// Normal of the crack, towards the face.
    fn crack_normal(&self) -> Vector3<f64> {
        let (s, c) = self.crack.degrees.to_radians().sin_cos();
        Vector3::new(c, 0.0, s)
    }

    /// What the cliff is before it falls.
    pub fn body(&self) -> Region {
        let endless = f64::INFINITY;
        Region::All(vec![
            Region::Block {
                lower: Vector3::new(self.back(), -endless, self.shape.wall),
                upper: Vector3::new(endless, endless, self.shape.height),
            },
            behind(self.foot(), self.outward()),
        ])
    }

    /// Whether a place belongs to what the crack parts from the rest.
    pub fn before_crack(&self, x: &Vector3<f64>) -> bool {
        (x - self.foot()).dot(&self.crack_normal()) > 0.0
    }

    /// The crack, if there is one, for parcels of this mean diameter (m).
    pub fn crack_region(&self, diameter: f64) -> Option<Region> {
        let depth = self.crack.depth_scaled * self.face();
        let endless = f64::INFINITY;
        (depth > 0.0).then(|| {
            Region::All(vec![
                Region::Slab {
                    point: self.foot(),
                    normal: self.crack_normal(),
                    thickness: self.crack.thickness_diameters * diameter,
                },
                Region::Block {
                    lower: Vector3::new(-endless, -endless, self.shape.height - depth),
                    upper: Vector3::repeat(endless),
                },
            ])
        })
    }

    /// The sintered top layer.
    pub fn sintered_layer(&self) -> Region {
        let endless = f64::INFINITY;
        Region::Block {
            lower: Vector3::new(-endless, -endless, self.shape.height - self.shape.sintered),
            upper: Vector3::repeat(endless),
        }
    }

    /// What the cliff stands on and falls on, of a material; `across` is the width of the slab (m).
    pub fn ground(&self, material: u16, across: f64) -> Vec<(String, Wall)> {
        let floor = Wall::plane(Vector3::zeros(), Vector3::z());
        let mut walls = vec![("ground".to_owned(), floor.material(material))];
        let wall = self.shape.wall;
        if wall > 0.0 {
            // From the foot back beyond the cliff, and wider than the slab: no grain meets its other sides.
            let half = Vector3::new(-0.5 * self.back() + wall, across, 0.5 * wall);
            let centre = Vector3::new(-half.x, 0.5 * across, half.z);
            let block = Wall::cuboid(centre, half).material(material);
            walls.push(("wall".to_owned(), block));
        }
        walls
    }

    /// What holds the face while the cliff settles.
    pub fn support(&self, material: u16) -> Wall {
        Wall::plane(self.foot(), -self.outward()).material(material)
    }

    /// Area of the cliff in section (m²), and of what lies before the crack.
    pub fn areas(&self) -> [f64; 2] {
        let face = self.face();
        let before = 0.5 * face * (self.lip() + self.crack_head());
        let whole = face * -self.back() + 0.5 * face * self.lip();
        [whole, before]
    }
}
