//! What a cliff leaves: its pile and its slope.

use colluvium_dem::GrainSample;
use std::f64::consts::PI;

/// The pile before the foot of a cliff: where it is highest, how high, and how far it runs out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pile {
    /// Where it is highest (m).
    pub top: f64,
    /// Height there (m).
    pub height: f64,
    /// Where it ends (m).
    pub end: f64,
    /// Its area in section (m²).
    pub area: f64,
    /// Its length from the foot of the cliff (m).
    pub length: f64,
    /// How much lower the ground is where it ends than where it is highest, and than at the foot of the cliff (m).
    pub descent: [f64; 2],
}

impl Pile {
    /// Of heights (m) over the ground at places (m), beyond the foot of the cliff; none where nothing lies there. `ground` is
    /// its own height (m).
    pub fn of(
        [places, heights]: [&[f64]; 2],
        foot: f64,
        threshold: f64,
        ground: impl Fn(f64) -> f64,
    ) -> Option<Pile> {
        let first = places.partition_point(|x| *x < foot);
        let last = (first..heights.len())
            .rev()
            .find(|&i| heights[i] >= threshold)?;
        let top =
            (first..=last).max_by(|&a, &b| heights[a].total_cmp(&heights[b]).then(b.cmp(&a)))?;
        let end = super::super::heap::edge(places, heights, threshold);
        let spacing = places.get(1).map_or(0.0, |next| next - places[0]);
        let area: f64 = heights[first..=last].iter().sum::<f64>() * spacing;
        Some(Pile {
            top: places[top],
            height: heights[top],
            end,
            area,
            length: end - foot,
            descent: [places[top], foot].map(|x| ground(x) - ground(end)),
        })
    }

    /// Mean angle of repose (degrees): fall of its surface over run-out, both from its top (Kappel et al. 2020, §4.2).
    pub fn repose_degrees(&self) -> f64 {
        let fall = self.height + self.descent[0];
        (fall / (self.end - self.top)).atan().to_degrees()
    }

    /// Slope of the wedge of its area A and its length L on ground that falls by D over it: `tan = (2 A/L + D)/L` (degrees).
    /// Other than the angle from the top it does not hang on where a pile of blocks is highest.
    pub fn wedge_degrees(&self) -> f64 {
        let fall = 2.0 * self.area / self.length + self.descent[1];
        (fall / self.length).atan().to_degrees()
    }
}

/// How far grains have turned as a whole, forward about the axis along the cliff (degrees): the rotation that
/// leaves the least squares between their places (x, z) before and now.
pub fn forward_turn(before: &[[f64; 2]], now: &[[f64; 2]], weights: &[f64]) -> f64 {
    let whole: f64 = weights.iter().sum();
    let centre = |of: &[[f64; 2]]| {
        let sum = of
            .iter()
            .zip(weights)
            .fold([0.0; 2], |s, (x, w)| [s[0] + w * x[0], s[1] + w * x[1]]);
        sum.map(|s| s / whole)
    };
    let (a, b) = (centre(before), centre(now));
    let (mut cross, mut dot) = (0.0, 0.0);
    for ((x, y), w) in before.iter().zip(now).zip(weights) {
        let (p, q) = ([x[0] - a[0], x[1] - a[1]], [y[0] - b[0], y[1] - b[1]]);
        cross += w * (p[0] * q[1] - p[1] * q[0]);
        dot += w * (p[0] * q[0] + p[1] * q[1]);
    }
    // Forward is from z towards x.
    -cross.atan2(dot).to_degrees()
}

/// Volume of grains that lie beyond a place along x (m³).
pub fn volume_beyond(grains: &[GrainSample], x: f64) -> f64 {
    let beyond = grains.iter().filter(|g| !g.fixed && g.position.x > x);
    beyond.map(|g| 4.0 / 3.0 * PI * g.radius.powi(3)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pile_has_its_top_its_end_and_its_slopes() {
        let places: Vec<f64> = (0..60).map(|k| f64::from(k) - 9.5).collect();
        // A cliff behind the foot, a pile that is highest at 5.5 m and falls by 0.4 a metre.
        let height = |x: f64| match x {
            x if x < 0.0 => 30.0,
            x if x < 5.5 => 10.0 + (x - 5.5),
            x => (10.0 - 0.4 * (x - 5.5)).max(0.0),
        };
        let heights: Vec<f64> = places.iter().map(|&x| height(x)).collect();
        let level = |_: f64| 0.0;
        let pile = Pile::of([&places, &heights], 0.0, 0.2, level).unwrap();
        assert_eq!((pile.top, pile.height), (5.5, 10.0));
        assert!((pile.end - 30.0).abs() < 1e-9, "{}", pile.end);
        assert!((pile.repose_degrees() - (10.0f64 / 24.5).atan().to_degrees()).abs() < 1e-9);
        let exact: f64 = heights
            .iter()
            .zip(&places)
            .filter(|(_, x)| **x > 0.0)
            .map(|(h, _)| h)
            .sum();
        let wedge = (2.0 * exact / 30.0f64.powi(2)).atan().to_degrees();
        assert!(
            (pile.wedge_degrees() - wedge).abs() < 0.1,
            "{}",
            pile.wedge_degrees()
        );
        assert_eq!(Pile::of([&places, &[0.0; 60]], 0.0, 0.2, level), None);
        // On ground that falls by 0.1 a metre its surface falls by so much more.
        let pile = Pile::of([&places, &heights], 0.0, 0.2, |x| -0.1 * x).unwrap();
        let slope = pile.repose_degrees().to_radians().tan();
        assert!((slope - (10.0 / 24.5 + 0.1)).abs() < 1e-9, "{slope}");
        let slope = pile.wedge_degrees().to_radians().tan();
        assert!(
            (slope - (2.0 * exact / 900.0 + 0.1)).abs() < 2e-3,
            "{slope}"
        );
    }

    #[test]
    fn turns_are_found_whatever_moves_along() {
        let before = [[0.0, 0.0], [1.0, 0.3], [0.2, 2.0], [-1.0, 1.0]];
        for degrees in [-170.0f64, -20.0, 0.0, 35.0, 90.0] {
            let (s, c) = degrees.to_radians().sin_cos();
            let turned = |[x, z]: [f64; 2]| [c * x + s * z + 7.0, c * z - s * x - 3.0];
            let now = before.map(turned);
            let found = forward_turn(&before, &now, &[1.0, 2.0, 0.5, 1.5]);
            assert!((found - degrees).abs() < 1e-9, "{degrees} {found}");
        }
    }
}
