//! Parts with round edges: a core and the ball that rolls over it.
//!
//! The core is the shape shrunk by the rounding r: a cuboid of half sides h - r; a frustum whose ends move
//! in by r and whose side moves in by r at right angles to itself. A sphere is its own surface; a mesh is
//! its own core.

use super::{Part, Solid};
use crate::setup::{SetupError, check};
use crate::walls::{Cuboid, Ends, Frustum, Shape, Side, SphereShell};
use nalgebra::Vector3;

/// The core of a part in the part's own axes.
pub(super) struct Core {
    pub shape: Shape,
    /// Where the shape's origin lies (m).
    pub origin: Vector3<f64>,
    /// How far the surface lies beyond it (m).
    pub rounding: f64,
}

/// First end, radii and height of the core of a frustum.
fn shrink([a, b]: [f64; 2], height: f64, rounding: f64) -> (f64, [f64; 2], f64) {
    let slope = (b - a) / height;
    let inward = rounding * 1.0_f64.hypot(slope);
    let radius = |z: f64| a + slope * z - inward;
    let (mut low, mut high) = (rounding, height - rounding);
    // Where a tip is rounded, the core ends in a tip.
    if radius(low) < 0.0 {
        low = (inward - a) / slope;
    }
    if radius(high) < 0.0 {
        high = (inward - a) / slope;
    }
    let radii = [radius(low).max(0.0), radius(high).max(0.0)];
    (low, radii, high - low)
}

/// The core of a part.
pub(super) fn core(part: &Part) -> Core {
    let origin = Vector3::zeros();
    let rounding = part.rounding;
    match &part.solid {
        &Solid::Sphere { radius } => Core {
            shape: Shape::SphereShell(SphereShell {
                radius,
                side: Side::Outside,
            }),
            origin,
            rounding: 0.0,
        },
        Solid::Cuboid { half_sides } => Core {
            shape: Shape::Cuboid(Cuboid {
                half_sides: half_sides.add_scalar(-rounding),
            }),
            origin,
            rounding,
        },
        &Solid::Frustum { radii, height } => {
            let (low, radii, height) = shrink(radii, height, rounding);
            Core {
                shape: Shape::Frustum(Frustum {
                    axis: Vector3::z(),
                    height,
                    radii,
                    ends: Ends::Capped,
                }),
                origin: Vector3::z() * low,
                rounding,
            }
        }
        Solid::Mesh(mesh) => Core {
            shape: Shape::Mesh(mesh.clone()),
            origin,
            rounding,
        },
    }
}

/// Checks the measures of a part and that its rounding leaves a core.
pub(super) fn validate(part: &Part, key: &str) -> Result<(), SetupError> {
    let length =
        |name: &str, value: f64| check(&format!("{key}.{name}"), value, "> 0 m", |v| v > 0.0);
    let rounding = |ok: bool| {
        let key = format!("{key}.rounding");
        let word = "> 0 m and small enough to leave a core of the shape";
        check(&key, part.rounding, word, |r| r > 0.0 && ok)
    };
    match &part.solid {
        Solid::Sphere { radius } => length("radius", *radius),
        Solid::Cuboid { half_sides } => {
            for (k, side) in half_sides.iter().enumerate() {
                length(&format!("half_sides[{k}]"), *side)?;
            }
            rounding(part.rounding < half_sides.min())
        }
        &Solid::Frustum { radii, height } => {
            length("height", height)?;
            for (end, radius) in radii.into_iter().enumerate() {
                check(&format!("{key}.radii[{end}]"), radius, "≥ 0 m", |v| {
                    v >= 0.0
                })?;
            }
            length("radii, the larger", radii[0].max(radii[1]))?;
            rounding(part.rounding < 0.5 * height)?;
            let (_, core, rest) = shrink(radii, height, part.rounding);
            rounding(rest > 0.0 && core[0].max(core[1]) > 0.0)
        }
        Solid::Mesh(_) => rounding(true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance of a point from the rounded surface.
    fn distance(part: &Part, point: [f64; 3]) -> f64 {
        let core = core(part);
        let foot = core.shape.foot(&(Vector3::from(point) - core.origin));
        foot.distance - core.rounding
    }

    #[test]
    fn outer_measures_stay() {
        let cuboid = Part::cuboid(Vector3::new(0.3, 0.2, 0.1), 1.0).rounded(0.02);
        let frustum = Part::frustum([0.4, 0.1], 0.4, 1.0).rounded(0.03);
        let s = 0.5_f64.sqrt();
        for (part, point, exact) in [
            (&cuboid, [0.5, 0.1, 0.0], 0.2),
            (&cuboid, [0.0, 0.0, -0.11], 0.01),
            // Round corner: from its centre at (0.28, 0.18, 0).
            (&cuboid, [0.31, 0.22, 0.0], 0.03),
            (&frustum, [0.0, 0.1, -0.2], 0.2),
            (&frustum, [0.05, 0.0, 0.7], 0.3),
        ] {
            let found = distance(part, point);
            assert!((found - exact).abs() < 1e-15, "{point:?}: {found}");
        }
        // The side falls by 0.3 over 0.4: its normal is (0.8, 0.6).
        let middle = Vector3::new(0.25, 0.0, 0.2) + Vector3::new(0.8, 0.0, 0.6) * 0.05;
        let turned = [middle.x * s, middle.x * s, middle.z];
        assert!((distance(&frustum, turned) - 0.05).abs() < 1e-15);
    }

    #[test]
    fn a_rounded_tip_lies_in_the_cone() {
        let cone = Part::frustum([0.3, 0.0], 0.4, 1.0).rounded(0.02);
        validate(&cone, "p").unwrap();
        // The ball of radius r at the tip touches the side: r/sin(half angle) below the sharp tip.
        let tip = distance(&cone, [0.0, 0.0, 0.4]);
        assert!((tip - (0.02 / 0.6 - 0.02)).abs() < 1e-15, "{tip}");
    }

    #[test]
    fn a_rounding_without_a_core_is_refused() {
        let cuboid = Part::cuboid(Vector3::new(0.3, 0.2, 0.1), 1.0);
        for rounding in [0.0, 0.1, f64::NAN] {
            let part = cuboid.clone().rounded(rounding);
            let error = validate(&part, "p").unwrap_err().to_string();
            assert!(error.contains("p.rounding"), "{error}");
        }
        assert!(validate(&cuboid.rounded(0.099), "p").is_ok());
        let needle = Part::frustum([0.01, 0.0], 1.0, 1.0).rounded(0.02);
        assert!(validate(&needle, "p").is_err());
    }
}
