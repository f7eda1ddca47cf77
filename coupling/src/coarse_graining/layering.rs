//! Equal layers along z, and how much of a sphere lies in each.

use serde::{Deserialize, Serialize};

/// Equal layers stacked along z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layering {
    /// Lower face of the lowest layer (m).
    pub lower: f64,
    /// Thickness of a layer (m), positive.
    pub thickness: f64,
    /// Number of layers.
    pub count: usize,
}

impl Layering {
    /// Height of face k (m); layer k lies between faces k and k + 1.
    pub fn face(&self, k: usize) -> f64 {
        self.lower + self.thickness * k as f64
    }

    /// Height of the middle of layer k (m).
    pub fn centre(&self, k: usize) -> f64 {
        self.lower + self.thickness * (k as f64 + 0.5)
    }

    /// The layers that an interval touches, both ends included, cut to the stack.
    pub fn touched(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        let first = self.count_faces_at_or_below(low).saturating_sub(1);
        first..self.count_faces_at_or_below(high).min(self.count)
    }

    /// How many faces lie at z or below it; the layer that holds z is one less.
    fn count_faces_at_or_below(&self, z: f64) -> usize {
        let guess = (z - self.lower) / self.thickness;
        if guess.is_nan() || guess < -1.0 {
            return 0;
        }
        if guess > self.count as f64 + 1.0 {
            return self.count + 1;
        }
        // Round-off may put the quotient on the other side of the face it compares with.
        let mut faces = (guess.floor() + 1.0).max(0.0) as usize;
        while faces > 0 && self.face(faces - 1) > z {
            faces -= 1;
        }
        while faces <= self.count && self.face(faces) <= z {
            faces += 1;
        }
        faces
    }
}

/// Volume of the part of a sphere below height x above its centre (m³):
/// V = π (x + R)² (2R − x)/3 for |x| ≤ R, the spherical cap.
pub fn sphere_volume_below(x: f64, radius: f64) -> f64 {
    let x = x.clamp(-radius, radius);
    std::f64::consts::PI / 3.0 * (x + radius) * (x + radius) * (2.0 * radius - x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_is_the_sum_of_its_slices() {
        let full = 4.0 / 3.0 * std::f64::consts::PI * 0.3f64.powi(3);
        assert!((sphere_volume_below(1.0, 0.3) - full).abs() < 1e-15);
        assert_eq!(sphere_volume_below(-0.3, 0.3), 0.0);
        // Midpoint sum of discs below x = 0.1.
        let n = 200_000;
        let dx = 0.4 / f64::from(n);
        let sum: f64 = (0..n)
            .map(|i| -0.3 + dx * (f64::from(i) + 0.5))
            .map(|x| std::f64::consts::PI * (0.09 - x * x) * dx)
            .sum();
        assert!((sphere_volume_below(0.1, 0.3) - sum).abs() < 1e-11);
    }

    #[test]
    fn every_height_belongs_to_one_layer_also_on_a_face() {
        let layers = Layering {
            lower: -0.7,
            thickness: 0.1,
            count: 30,
        };
        for k in 0..layers.count {
            let on_face = layers.face(k);
            assert_eq!(layers.touched(on_face, on_face), k..k + 1);
            let centre = layers.centre(k);
            assert_eq!(layers.touched(centre, centre), k..k + 1);
        }
        assert!(layers.touched(-5.0, -4.0).is_empty());
        assert!(layers.touched(9.0, 9.5).is_empty());
        assert!(layers.touched(f64::NAN, f64::NAN).is_empty());
        assert_eq!(layers.touched(-9.0, 9.0), 0..30);
    }
}
