//! Parts of space, for rules that hold only there.

use crate::setup::{SetupError, check};
use crate::walls::Mesh;
use nalgebra::Vector3;
use std::fmt;
use std::sync::Arc;

/// A part of space (m).
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// All of it.
    Everywhere,
    /// A block with edges along the axes.
    Block {
        /// Lower corner (m); may be infinite.
        lower: Vector3<f64>,
        /// Upper corner (m); may be infinite.
        upper: Vector3<f64>,
    },
    /// A ball.
    Ball {
        /// Centre (m).
        center: Vector3<f64>,
        /// Radius (m).
        radius: f64,
    },
    /// What lies between two parallel planes: a layer, or a crack.
    Slab {
        /// A point half way between the planes (m).
        point: Vector3<f64>,
        /// Normal of the planes, of any length.
        normal: Vector3<f64>,
        /// Distance of the planes (m).
        thickness: f64,
    },
    /// A cylinder without ends.
    Cylinder {
        /// A point of the axis (m).
        point: Vector3<f64>,
        /// Direction of the axis, of any length.
        axis: Vector3<f64>,
        /// Radius (m).
        radius: f64,
    },
    /// A truncated cone, solid.
    Frustum {
        /// Centre of its first end (m).
        point: Vector3<f64>,
        /// Unit vector from there to the other end.
        axis: Vector3<f64>,
        /// Distance of the ends (m).
        length: f64,
        /// Radii at both ends (m).
        radii: [f64; 2],
    },
    /// What a closed surface of triangles encloses.
    Mesh(Arc<Mesh>),
    /// Where all of these are.
    All(Vec<Region>),
    /// Where any of these is.
    Any(Vec<Region>),
    /// Where this is not.
    Outside(Box<Region>),
}

impl Region {
    /// Whether a point lies in it; the boundary belongs to it.
    pub fn contains(&self, x: &Vector3<f64>) -> bool {
        match self {
            Region::Everywhere => true,
            Region::Block { lower, upper } => (0..3).all(|k| lower[k] <= x[k] && x[k] <= upper[k]),
            Region::Ball { center, radius } => (x - center).norm_squared() <= radius * radius,
            Region::Slab {
                point,
                normal,
                thickness,
            } => (x - point).dot(normal).abs() <= 0.5 * thickness * normal.norm(),
            Region::Cylinder {
                point,
                axis,
                radius,
            } => (x - point).cross(axis).norm() <= radius * axis.norm(),
            Region::Frustum { .. } | Region::Mesh(_) => self.depth(x) >= 0.0,
            Region::All(parts) => parts.iter().all(|part| part.contains(x)),
            Region::Any(parts) => parts.iter().any(|part| part.contains(x)),
            Region::Outside(part) => !part.contains(x),
        }
    }

    /// How deep a point lies inside (m): a ball of this radius about it fits in. Negative outside, where
    /// it is no farther from the region than that says.
    ///
    /// Exact for one shape; a lower bound where shapes are combined.
    pub fn depth(&self, x: &Vector3<f64>) -> f64 {
        match self {
            Region::Everywhere => f64::INFINITY,
            Region::Block { lower, upper } => (0..3)
                .map(|k| (x[k] - lower[k]).min(upper[k] - x[k]))
                .fold(f64::INFINITY, f64::min),
            Region::Ball { center, radius } => radius - (x - center).norm(),
            Region::Slab {
                point,
                normal,
                thickness,
            } => 0.5 * thickness - (x - point).dot(normal).abs() / normal.norm(),
            Region::Cylinder {
                point,
                axis,
                radius,
            } => radius - (x - point).cross(axis).norm() / axis.norm(),
            Region::Frustum {
                point,
                axis,
                length,
                radii: [low, high],
            } => {
                let along = (x - point).dot(axis);
                let across = (x - point).cross(axis).norm();
                let slope = (high - low) / length;
                let side = (low + slope * along - across) / slope.hypot(1.0);
                side.min(along).min(length - along)
            }
            Region::Mesh(mesh) => mesh.depth(x),
            Region::All(parts) => {
                let depths = parts.iter().map(|part| part.depth(x));
                depths.fold(f64::INFINITY, f64::min)
            }
            Region::Any(parts) => {
                let depths = parts.iter().map(|part| part.depth(x));
                depths.fold(f64::NEG_INFINITY, f64::max)
            }
            Region::Outside(part) => -part.depth(x),
        }
    }

    /// A block that holds it (m); infinite where it does not end, or may not.
    pub fn bounds(&self) -> [Vector3<f64>; 2] {
        let everything = [f64::NEG_INFINITY, f64::INFINITY].map(Vector3::repeat);
        match self {
            Region::Everywhere | Region::Outside(_) => everything,
            Region::Block { lower, upper } => [*lower, *upper],
            Region::Ball { center, radius } => {
                let half = Vector3::repeat(*radius);
                [center - half, center + half]
            }
            Region::Slab {
                point,
                normal,
                thickness,
            } => {
                // Along an axis of its normal it ends; otherwise it does not.
                let mut bounds = everything;
                for k in (0..3).filter(|&k| normal[k].abs() == normal.norm()) {
                    bounds[0][k] = point[k] - 0.5 * thickness;
                    bounds[1][k] = point[k] + 0.5 * thickness;
                }
                bounds
            }
            Region::Cylinder {
                point,
                axis,
                radius,
            } => {
                let mut bounds = everything;
                if let Some(along) = (0..3).find(|&k| axis[k].abs() == axis.norm()) {
                    for k in (0..3).filter(|&k| k != along) {
                        bounds[0][k] = point[k] - radius;
                        bounds[1][k] = point[k] + radius;
                    }
                }
                bounds
            }
            Region::Frustum {
                point,
                axis,
                length,
                radii,
            } => {
                // A disk across a unit vector a reaches R √(1 - a_k²) along axis k.
                let ends = [(*point, radii[0]), (point + axis * *length, radii[1])];
                let reach = |r: f64| axis.map(|a| r * (1.0 - a * a).max(0.0).sqrt());
                let [a, b] = ends.map(|(x, r)| [x - reach(r), x + reach(r)]);
                [a[0].inf(&b[0]), a[1].sup(&b[1])]
            }
            Region::Mesh(mesh) => mesh.bounds(),
            Region::All(parts) => parts.iter().fold(everything, |[low, high], part| {
                let [l, h] = part.bounds();
                [low.sup(&l), high.inf(&h)]
            }),
            Region::Any(parts) => {
                let nothing = [f64::INFINITY, f64::NEG_INFINITY].map(Vector3::repeat);
                parts.iter().fold(nothing, |[low, high], part| {
                    let [l, h] = part.bounds();
                    [low.inf(&l), high.sup(&h)]
                })
            }
        }
    }

    /// Checks its numbers; `key` names it in errors.
    pub fn validate(&self, key: &str) -> Result<(), SetupError> {
        let finite = |name: &str, v: &Vector3<f64>| {
            let key = format!("{key}.{name}");
            v.iter()
                .try_for_each(|c| check(&key, *c, "finite", |_| true))
        };
        let direction = |name: &str, v: &Vector3<f64>| {
            finite(name, v)?;
            check(&format!("{key}.{name}"), v.norm(), "longer than 0", |l| {
                l > 0.0
            })
        };
        let length = |name: &str, l: f64| check(&format!("{key}.{name}"), l, "> 0 m", |l| l > 0.0);
        match self {
            Region::Everywhere => Ok(()),
            Region::Block { lower, upper } => (0..3).try_for_each(|k| {
                // Infinite bounds leave a side open.
                if lower[k] < upper[k] {
                    return Ok(());
                }
                Err(SetupError::OutOfRange {
                    key: format!("{key}.upper[{k}]"),
                    value: upper[k],
                    allowed: "above the lower bound",
                })
            }),
            Region::Ball { center, radius } => {
                finite("center", center)?;
                length("radius", *radius)
            }
            Region::Slab {
                point,
                normal,
                thickness,
            } => {
                finite("point", point)?;
                direction("normal", normal)?;
                length("thickness", *thickness)
            }
            Region::Cylinder {
                point,
                axis,
                radius,
            } => {
                finite("point", point)?;
                direction("axis", axis)?;
                length("radius", *radius)
            }
            Region::Frustum {
                point,
                axis,
                length: l,
                radii,
            } => {
                finite("point", point)?;
                check(&format!("{key}.axis"), axis.norm(), "a unit vector", |n| {
                    (n - 1.0).abs() < 1e-9
                })?;
                length("length", *l)?;
                for (end, r) in radii.iter().enumerate() {
                    let key = format!("{key}.radii[{end}]");
                    check(&key, *r, "≥ 0 m", |r| r >= 0.0)?;
                }
                length("radii, the larger", radii[0].max(radii[1]))
            }
            Region::Mesh(mesh) => {
                let report = mesh.report();
                let ends = report.open_edges + report.branching_edges;
                let key = format!("{key}.mesh: edges that have not two triangles");
                check(
                    &key,
                    ends as f64,
                    "0: only a closed mesh encloses something",
                    |n| n == 0.0,
                )
            }
            Region::All(parts) | Region::Any(parts) => parts
                .iter()
                .enumerate()
                .try_for_each(|(k, part)| part.validate(&format!("{key}[{k}]"))),
            Region::Outside(part) => part.validate(key),
        }
    }
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let point = |v: &Vector3<f64>| format!("({:.4e}, {:.4e}, {:.4e}) m", v.x, v.y, v.z);
        let list = |f: &mut fmt::Formatter, parts: &[Region], word: &str| {
            parts.iter().enumerate().try_for_each(|(k, part)| {
                let word = if k == 0 { "" } else { word };
                write!(f, "{word}{part}")
            })
        };
        match self {
            Region::Everywhere => write!(f, "the whole box"),
            Region::Block { lower, upper } => {
                write!(f, "the block from {} to {}", point(lower), point(upper))
            }
            Region::Ball { center, radius } => {
                write!(
                    f,
                    "the ball of radius {radius:.4e} m about {}",
                    point(center)
                )
            }
            Region::Slab {
                point: at,
                normal,
                thickness,
            } => write!(
                f,
                "the slab of thickness {thickness:.4e} m about {} across ({:.3}, {:.3}, {:.3})",
                point(at),
                normal.x,
                normal.y,
                normal.z
            ),
            Region::Cylinder {
                point: at,
                axis,
                radius,
            } => write!(
                f,
                "the cylinder of radius {radius:.4e} m through {} along ({:.3}, {:.3}, {:.3})",
                point(at),
                axis.x,
                axis.y,
                axis.z
            ),
            Region::Frustum {
                point: at,
                length,
                radii,
                ..
            } => write!(
                f,
                "the truncated cone of radii {:.4e} and {:.4e} m, {length:.4e} m long, from {}",
                radii[0],
                radii[1],
                point(at)
            ),
            Region::Mesh(mesh) => {
                let [low, high] = mesh.bounds();
                let count = mesh.triangles().len();
                let (low, high) = (point(&low), point(&high));
                write!(f, "the mesh of {count} triangles from {low} to {high}")
            }
            Region::All(parts) => list(f, parts, " in "),
            Region::Any(parts) => list(f, parts, " or "),
            Region::Outside(part) => write!(f, "outside {part}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_hold_what_lies_in_them_and_nothing_else() {
        let open = f64::INFINITY;
        let top = Region::Block {
            lower: Vector3::new(-open, -open, 2.0),
            upper: Vector3::repeat(open),
        };
        let crack = Region::Slab {
            point: Vector3::new(0.0, 0.0, 2.5),
            normal: Vector3::new(0.0, 3.0, 4.0),
            thickness: 0.2,
        };
        let pipe = Region::Cylinder {
            point: Vector3::zeros(),
            axis: Vector3::new(0.0, 0.0, 7.0),
            radius: 1.0,
        };
        let ball = Region::Ball {
            center: Vector3::new(0.0, 0.0, 3.0),
            radius: 0.5,
        };
        // Slope 3:4 of the side, from radius 1 to 4 over 4.
        let cone = Region::Frustum {
            point: Vector3::zeros(),
            axis: Vector3::z(),
            length: 4.0,
            radii: [1.0, 4.0],
        };
        assert_eq!(
            cone.bounds(),
            [Vector3::new(-4.0, -4.0, 0.0), Vector3::new(4.0, 4.0, 4.0)]
        );
        let middle = cone.depth(&Vector3::new(0.0, 0.0, 2.0));
        assert!((middle - 2.0).abs() < 1e-15, "{middle}");
        for (region, inside, outside) in [
            (&cone, [1.7, 1.7, 2.0], [1.8, 1.8, 2.0]),
            (&cone, [0.0, 3.9, 4.0], [0.0, 3.9, 4.1]),
            (&top, [9.0, -9.0, 2.0], [0.0, 0.0, 1.99]),
            (&crack, [5.0, 0.0, 2.62], [5.0, 0.0, 2.63]),
            (&pipe, [0.6, 0.7, -50.0], [0.8, 0.7, 0.0]),
            (&ball, [0.0, 0.0, 3.5], [0.3, 0.3, 3.3]),
        ] {
            region.validate("region").unwrap();
            assert!(region.contains(&inside.into()), "{region:?}");
            assert!(!region.contains(&outside.into()), "{region:?}");
            assert!(region.depth(&inside.into()) >= -1e-15 && region.depth(&outside.into()) < 0.0);
            let not = Region::Outside(Box::new(region.clone()));
            assert!(!not.contains(&inside.into()) && not.contains(&outside.into()));
        }
        let both = Region::All(vec![top.clone(), pipe.clone()]);
        let either = Region::Any(vec![top, pipe]);
        let below = Vector3::new(0.0, 0.0, 1.0);
        assert!(!both.contains(&below) && either.contains(&below));
    }

    #[test]
    fn a_ball_as_large_as_the_depth_fits_in() {
        let block = |low: f64, high: f64| Region::Block {
            lower: Vector3::repeat(low),
            upper: Vector3::repeat(high),
        };
        let ball = Region::Ball {
            center: Vector3::new(1.0, 1.0, 2.0),
            radius: 0.9,
        };
        let pipe = Region::Cylinder {
            point: Vector3::repeat(1.0),
            axis: Vector3::new(0.0, 2.0, 0.0),
            radius: 0.7,
        };
        let all = Region::All(vec![
            block(0.0, 2.0),
            Region::Any(vec![ball, pipe]),
            Region::Outside(Box::new(block(0.9, 1.1))),
        ]);
        let [low, high] = all.bounds();
        // The ball ends along x, the pipe along z; along y only the block does.
        assert!((low - Vector3::new(0.1, 0.0, 0.3)).norm() < 1e-12, "{low}");
        assert!(
            (high - Vector3::new(1.9, 2.0, 2.0)).norm() < 1e-12,
            "{high}"
        );
        let (mut inside, mut outside) = (0, 0);
        let n = 30;
        for k in 0..n * n * n {
            let cell = Vector3::new(k % n, k / n % n, k / (n * n)).map(|c| c as f64 + 0.43);
            let x = cell * (2.2 / n as f64) - Vector3::repeat(0.1);
            let depth = all.depth(&x);
            assert_eq!(depth >= 0.0, all.contains(&x));
            // Points of the sphere of that radius are on the same side.
            for axis in 0..14 {
                let ways = Vector3::new(axis % 3, axis / 3 % 3, axis / 9);
                let way = ways.map(|c| f64::from(c) - 1.0);
                if way.norm() == 0.0 {
                    continue;
                }
                for turned in [way, -way] {
                    let y = x + turned.normalize() * (0.999 * depth.abs());
                    assert_eq!(all.contains(&y), depth >= 0.0, "{x:?} {depth}");
                }
            }
            *if depth >= 0.0 {
                &mut inside
            } else {
                &mut outside
            } += 1;
        }
        assert!(inside > 1000 && outside > 1000);
    }

    #[test]
    fn a_bad_region_is_named() {
        let flat = Region::Any(vec![Region::Slab {
            point: Vector3::zeros(),
            normal: Vector3::zeros(),
            thickness: 1.0,
        }]);
        let error = flat.validate("bonds.within").unwrap_err().to_string();
        assert!(error.contains("bonds.within[0].normal = 0"), "{error}");
        let turned = Region::Block {
            lower: Vector3::zeros(),
            upper: Vector3::new(1.0, -1.0, 1.0),
        };
        assert!(turned.validate("x").is_err());
    }
}
