//! What pictures are painted on: the nearest of balls, triangles and grounds at each pixel.

use super::grounds::Ground;

/// Pixels along the longer edge.
const SIZE: f64 = 720.0;
/// Margin around the grains, over the longer edge.
const MARGIN: f64 = 0.04;

/// What lies behind, and within a plane that is seen from its side.
const PAPER: [u8; 3] = [0xff, 0xff, 0xff];
const GROUND: [u8; 3] = [0xe4, 0xdf, 0xd4];

/// A ball to be drawn: place in the picture (m), depth (m), radius (m), colour.
pub struct Ball {
    pub at: [f64; 2],
    pub depth: f64,
    pub radius: f64,
    pub colour: [u8; 3],
}

/// A triangle to be drawn: its corners in the picture (m) and their depths (m), colour.
pub struct Plate {
    pub corners: [[f64; 3]; 3],
    pub colour: [u8; 3],
}

/// What a picture reaches over (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    low: [f64; 2],
    high: [f64; 2],
}

impl Extent {
    /// Around nothing.
    pub const NOTHING: Extent = Extent {
        low: [f64::INFINITY; 2],
        high: [f64::NEG_INFINITY; 2],
    };

    fn hold(&mut self, at: [f64; 2], radius: f64) {
        for (k, x) in at.into_iter().enumerate() {
            self.low[k] = self.low[k].min(x - radius);
            self.high[k] = self.high[k].max(x + radius);
        }
    }

    /// Reaches around balls and triangles, too.
    pub fn reach(&mut self, balls: &[Ball], plates: &[Plate]) {
        balls
            .iter()
            .for_each(|ball| self.hold(ball.at, ball.radius));
        for [x, y, _] in plates.iter().flat_map(|plate| plate.corners) {
            self.hold([x, y], 0.0);
        }
    }
}

/// Pixels and their depths, and where they are.
struct Canvas {
    pixels: Vec<u8>,
    nearest: Vec<f64>,
    /// Pixels along both edges.
    size: [usize; 2],
    /// Left edge and upper edge (m).
    corner: [f64; 2],
    /// Pixels per m.
    scale: f64,
}

/// Brightness of a surface whose normal, towards the picture, is this: light from the upper left.
fn brightness(right: f64, up: f64, front: f64) -> f64 {
    (0.45 + 0.55 * (0.4 * up - 0.3 * right + 0.87 * front)).clamp(0.2, 1.0)
}

impl Canvas {
    /// A canvas over an extent.
    fn over(Extent { low, high }: Extent) -> Canvas {
        let longer = (high[0] - low[0]).max(high[1] - low[1]);
        let margin = MARGIN * longer;
        let scale = SIZE / (longer + 2.0 * margin);
        let size: [usize; 2] = std::array::from_fn(|k| {
            ((high[k] - low[k] + 2.0 * margin) * scale).ceil().max(1.0) as usize
        });
        Canvas {
            pixels: Vec::with_capacity(3 * size[0] * size[1]),
            nearest: vec![f64::INFINITY; size[0] * size[1]],
            size,
            corner: [low[0] - margin, high[1] + margin],
            scale,
        }
    }

    /// The place (m) of a pixel's middle.
    fn place(&self, column: usize, row: usize) -> [f64; 2] {
        [
            self.corner[0] + (column as f64 + 0.5) / self.scale,
            self.corner[1] - (row as f64 + 0.5) / self.scale,
        ]
    }

    /// What lies behind everything.
    fn lay(&mut self, grounds: &[Ground]) {
        for row in 0..self.size[1] {
            for column in 0..self.size[0] {
                let x = self.place(column, row);
                self.pixels
                    .extend(if grounds.iter().any(|ground| ground.holds(x)) {
                        GROUND
                    } else {
                        PAPER
                    });
            }
        }
    }

    /// Draws what lies between two places: `surface` tells its depth (m) and brightness at a place, where
    /// it is there.
    fn draw(
        &mut self,
        [low, high]: [[f64; 2]; 2],
        colour: [u8; 3],
        surface: impl Fn([f64; 2]) -> Option<[f64; 2]>,
    ) {
        let within = |from: f64, to: f64, count: usize| {
            let first = from.floor().max(0.0) as usize;
            first..(to.ceil().max(-1.0) as usize + 1).min(count)
        };
        let column = |x: f64| (x - self.corner[0]) * self.scale - 0.5;
        let row = |y: f64| (self.corner[1] - y) * self.scale - 0.5;
        let columns = within(column(low[0]), column(high[0]), self.size[0]);
        for r in within(row(high[1]), row(low[1]), self.size[1]) {
            for c in columns.clone() {
                let k = r * self.size[0] + c;
                let Some([depth, light]) = surface(self.place(c, r)) else {
                    continue;
                };
                if depth >= self.nearest[k] {
                    continue;
                }
                self.nearest[k] = depth;
                for (channel, colour) in colour.into_iter().enumerate() {
                    self.pixels[3 * k + channel] = (f64::from(colour) * light) as u8;
                }
            }
        }
    }

    fn ball(&mut self, ball: &Ball) {
        let corner = |sign: f64| ball.at.map(|x| x + sign * ball.radius);
        self.draw([corner(-1.0), corner(1.0)], ball.colour, |x| {
            let off = [0, 1].map(|k| (x[k] - ball.at[k]) / ball.radius);
            let rest = 1.0 - off[0] * off[0] - off[1] * off[1];
            let front = rest.max(0.0).sqrt();
            let depth = ball.depth - ball.radius * front;
            (rest >= 0.0).then(|| [depth, brightness(off[0], off[1], front)])
        });
    }

    fn plate(&mut self, plate: &Plate) {
        let [a, b, c] = plate.corners;
        let edge = |p: [f64; 3], q: [f64; 3], x: [f64; 2]| {
            (q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0])
        };
        let twice = edge(a, b, [c[0], c[1]]);
        if twice == 0.0 {
            return;
        }
        // Slopes of the depth along the picture give the normal.
        let slope = |k: usize| {
            let other = 1 - k;
            let sign = if k == 0 { 1.0 } else { -1.0 };
            sign * ((b[2] - a[2]) * (c[other] - a[other]) - (c[2] - a[2]) * (b[other] - a[other]))
                / twice
        };
        let (right, up) = (slope(0), slope(1));
        let length = (1.0 + right * right + up * up).sqrt();
        let light = brightness(right / length, up / length, 1.0 / length);
        let bound = |pick: fn(f64, f64) -> f64| [0, 1].map(|k| pick(a[k], pick(b[k], c[k])));
        let bounds = [bound(f64::min), bound(f64::max)];
        self.draw(bounds, plate.colour, |x| {
            let share = [edge(b, c, x), edge(c, a, x), edge(a, b, x)].map(|e| e / twice);
            let depth = share[0] * a[2] + share[1] * b[2] + share[2] * c[2];
            share.iter().all(|s| *s >= 0.0).then_some([depth, light])
        });
    }
}

/// Pixels as rows of RGB from the top, and their numbers along both edges; around everything.
pub fn paint(balls: &[Ball], plates: &[Plate], grounds: &[Ground]) -> (Vec<u8>, [usize; 2]) {
    let mut extent = Extent::NOTHING;
    extent.reach(balls, plates);
    paint_over(extent, balls, plates, grounds)
}

/// The same over a given extent.
pub fn paint_over(
    extent: Extent,
    balls: &[Ball],
    plates: &[Plate],
    grounds: &[Ground],
) -> (Vec<u8>, [usize; 2]) {
    let mut canvas = Canvas::over(extent);
    canvas.lay(grounds);
    balls.iter().for_each(|ball| canvas.ball(ball));
    plates.iter().for_each(|plate| canvas.plate(plate));
    (canvas.pixels, canvas.size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_surface_hides_the_farther() {
        let ball = |depth: f64, colour: [u8; 3], x: f64| Ball {
            at: [x, 0.0],
            depth,
            radius: 1.0,
            colour,
        };
        let (red, blue) = ([200, 0, 0], [0, 0, 200]);
        let ground = [Ground::Behind([[0.0, 0.0], [0.0, 1.0]])];
        for order in [[0, 1], [1, 0]] {
            let balls = [ball(0.0, red, 0.0), ball(5.0, blue, 0.0)];
            let mut balls = Vec::from(balls);
            if order[0] == 1 {
                balls.swap(0, 1);
            }
            let (pixels, [w, h]) = paint(&balls, &[], &ground);
            let middle = 3 * (h / 2 * w + w / 2);
            assert!(pixels[middle] > 100 && pixels[middle + 2] == 0);
            // Corners: paper above the plane, ground below it.
            assert_eq!(pixels[..3], PAPER);
            assert_eq!(pixels[pixels.len() - 3..], GROUND);
        }
        // A plate that leans: nearer than the ball on the left, farther on the right.
        let plate = Plate {
            corners: [[-1.0, -1.0, -4.0], [1.0, -1.0, 4.0], [0.0, 1.0, 0.0]],
            colour: blue,
        };
        let (pixels, [w, h]) = paint(&[ball(0.0, red, 0.0)], &[plate], &ground);
        let at = |share: f64| 3 * (h / 2 * w + (share * w as f64) as usize);
        assert!(pixels[at(0.3) + 2] > 50 && pixels[at(0.3)] == 0);
        assert!(pixels[at(0.7)] > 100 && pixels[at(0.7) + 2] == 0);
    }
}
