//! Restarted GMRES with right preconditioning (Saad & Schultz, *SIAM J. Sci. Stat. Comput.* 7
//! (1986) 856), with sums in a fixed order.

/// Directions kept before a restart.
const DIRECTIONS: usize = 40;
/// Restarts before the iteration is given up.
const CYCLES: usize = 3;
/// Directions after which it is foreseen how many more a solution needs: by then the residual falls at its pace.
const FORESEEN_AFTER: usize = 8;
/// Weighted rows are asked for no smaller residual than this part of their right-hand side.
const LEAST_REDUCTION: f64 = 1e-9;

/// What a solution has to reach, and from where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Goal {
    /// Residual, with weights, relative to the right-hand side.
    pub tolerance: f64,
    /// Most directions of the Krylov space before the iteration is given up.
    pub directions: usize,
    /// Rows from this number on
    pub weighted_from: usize,
    /// count by so much in the residual.
    pub weight: f64,
    /// Whether to give up as soon as so many directions will not be enough at the pace of the residual so far.
    pub foresees: bool,
    /// Whether to start from the solution as it is given, not from zero.
    pub goes_on: bool,
}

impl Goal {
    /// As far as the iteration gets, from zero.
    pub(super) fn full(tolerance: f64) -> Self {
        Self {
            tolerance,
            directions: DIRECTIONS * CYCLES,
            weighted_from: usize::MAX,
            weight: 1.0,
            foresees: false,
            goes_on: false,
        }
    }

    /// Multiplies the weighted rows by a factor.
    fn scale(&self, r: &mut [f64], factor: f64) {
        let rows = r.iter_mut().skip(self.weighted_from);
        rows.for_each(|r| *r *= factor);
    }

    /// Whether `left` directions are too few if the first `used` of them have brought the residual down to such a part of
    /// what it was, and it has to fall to `aim` of it.
    fn foresees_failure(&self, used: usize, left: usize, reduction: f64, aim: f64) -> bool {
        self.foresees
            && used >= FORESEEN_AFTER
            && reduction.ln() * left as f64 > aim.ln() * used as f64
    }

    /// Size of the weighted residual at which the iteration ends: so much of the right-hand side without weights, but
    /// never less of the weighted rows than round-off leaves.
    fn target(&self, b: &[f64]) -> f64 {
        if self.weight == 1.0 {
            return self.tolerance * dot(b, b).sqrt();
        }
        let weighted = &b[self.weighted_from.min(b.len())..];
        let least = LEAST_REDUCTION * self.weight * dot(weighted, weighted).sqrt();
        (self.tolerance * dot(b, b).sqrt()).max(least)
    }
}

/// Work arrays of the iteration for one system size.
pub(super) struct Gmres {
    basis: Vec<Vec<f64>>,
    /// M⁻¹ times the basis: what the solution is made from.
    directions: Vec<Vec<f64>>,
    work: Vec<f64>,
    /// Upper triangle of the rotated Hessenberg matrix, by columns.
    triangle: Vec<Vec<f64>>,
    rotations: Vec<[f64; 2]>,
    reduced: Vec<f64>,
    iterations: usize,
}

/// Σ a b in eight strands, so that additions need not wait for each other.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut strands = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8
        .remainder()
        .iter()
        .zip(b8.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a8.zip(b8) {
        for (strand, (a, b)) in strands.iter_mut().zip(a.iter().zip(b)) {
            *strand += a * b;
        }
    }
    let [a, b, c, d, e, f, g, h] = strands;
    ((a + b) + (c + d)) + ((e + f) + (g + h)) + rest
}

impl Gmres {
    /// An iteration for systems of `size` unknowns.
    pub(super) fn new(size: usize) -> Self {
        Self {
            basis: vec![vec![0.0; size]],
            directions: Vec::new(),
            work: vec![0.0; size],
            triangle: vec![vec![0.0; DIRECTIONS + 1]; DIRECTIONS],
            rotations: vec![[1.0, 0.0]; DIRECTIONS],
            reduced: vec![0.0; DIRECTIONS + 1],
            iterations: 0,
        }
    }

    /// Directions that the last solution took.
    pub(super) fn iterations(&self) -> usize {
        self.iterations
    }

    /// Solves A x = b; returns whether the tolerance was met.
    pub(super) fn solve(
        &mut self,
        mut multiply: impl FnMut(&[f64], &mut [f64]),
        mut precondition: impl FnMut(&mut [f64]),
        b: &[f64],
        x: &mut [f64],
        goal: Goal,
    ) -> bool {
        let target = goal.target(b);
        self.iterations = 0;
        let mut is_zero = !goal.goes_on;
        if is_zero {
            x.fill(0.0);
        }
        loop {
            if is_zero {
                self.basis[0].copy_from_slice(b);
            } else {
                multiply(x, &mut self.work);
                for ((v, b), w) in self.basis[0].iter_mut().zip(b).zip(&self.work) {
                    *v = b - w;
                }
            }
            goal.scale(&mut self.basis[0], goal.weight);
            let size = dot(&self.basis[0], &self.basis[0]).sqrt();
            // Written so that a NaN counts as failure.
            if size <= target {
                return true;
            }
            let left = goal.directions - self.iterations;
            if !size.is_finite() || left == 0 {
                return false;
            }
            self.basis[0].iter_mut().for_each(|v| *v /= size);
            self.reduced.fill(0.0);
            self.reduced[0] = size;
            let aim = 0.5 * target;
            let (mut used, mut is_given_up) = (0, false);
            while used < left.min(DIRECTIONS) && self.reduced[used].abs() > aim && !is_given_up {
                self.extend(used, &mut multiply, &mut precondition, goal);
                used += 1;
                let reduction = self.reduced[used].abs() / size;
                is_given_up = goal.foresees_failure(used, left, reduction, aim / size);
            }
            if used == 0 {
                return false;
            }
            self.iterations += used;
            self.add_combination(used, x);
            if is_given_up {
                return false;
            }
            is_zero = false;
        }
    }

    /// Adds one direction A M⁻¹ v, made orthogonal to the others, and rotates its column.
    fn extend(
        &mut self,
        k: usize,
        multiply: &mut impl FnMut(&[f64], &mut [f64]),
        precondition: &mut impl FnMut(&mut [f64]),
        goal: Goal,
    ) {
        // Few iterations need many directions.
        if self.basis.len() == k + 1 {
            self.basis.push(vec![0.0; self.work.len()]);
        }
        if self.directions.len() == k {
            self.directions.push(vec![0.0; self.work.len()]);
        }
        let direction = &mut self.directions[k];
        direction.copy_from_slice(&self.basis[k]);
        goal.scale(direction, 1.0 / goal.weight);
        precondition(direction);
        let (known, next) = self.basis.split_at_mut(k + 1);
        let next = &mut next[0];
        multiply(direction, next);
        goal.scale(next, goal.weight);
        let column = &mut self.triangle[k];
        for (h, v) in column.iter_mut().zip(known.iter()) {
            *h = dot(next, v);
            for (n, v) in next.iter_mut().zip(v) {
                *n -= *h * v;
            }
        }
        let size = dot(next, next).sqrt();
        if size > 0.0 {
            next.iter_mut().for_each(|n| *n /= size);
        }
        for (j, [c, s]) in self.rotations[..k].iter().enumerate() {
            let (upper, lower) = (column[j], column[j + 1]);
            column[j] = c * upper + s * lower;
            column[j + 1] = c * lower - s * upper;
        }
        let radius = column[k].hypot(size);
        let [c, s] = if radius > 0.0 {
            [column[k] / radius, size / radius]
        } else {
            [1.0, 0.0]
        };
        self.rotations[k] = [c, s];
        column[k] = radius;
        self.reduced[k + 1] = -s * self.reduced[k];
        self.reduced[k] *= c;
    }

    /// x += M⁻¹ V y with y from the triangular system.
    fn add_combination(&mut self, used: usize, x: &mut [f64]) {
        for k in (0..used).rev() {
            let later: f64 = (k + 1..used)
                .map(|j| self.triangle[j][k] * self.reduced[j])
                .sum();
            self.reduced[k] = (self.reduced[k] - later) / self.triangle[k][k];
        }
        for (v, y) in self.directions[..used].iter().zip(&self.reduced) {
            for (x, v) in x.iter_mut().zip(v) {
                *x += y * v;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsymmetric_system_needs_no_more_steps_than_unknowns() {
        let a = [[4.0, 1.0, 0.0], [-1.0, 3.0, 0.5], [0.0, 2.0, 5.0]];
        let multiply = |x: &[f64], y: &mut [f64]| {
            for (y, row) in y.iter_mut().zip(&a) {
                *y = dot(row, x);
            }
        };
        let mut x = [0.0; 3];
        let mut calls = 0;
        let solved = Gmres::new(3).solve(
            multiply,
            |x: &mut [f64]| {
                calls += 1;
                x[0] /= 4.0;
            },
            &[6.0, 6.5, 19.0],
            &mut x,
            Goal::full(1e-10),
        );
        assert!(solved && calls <= 4);
        for (x, expected) in x.iter().zip([1.0, 2.0, 3.0]) {
            assert!((x - expected).abs() < 1e-9);
        }
    }

    /// An iteration that foresees that it will not come to its end in time gives up early and keeps what it has; one that
    /// does not foresee it goes on, and one that has enough directions gets there.
    #[test]
    fn failure_is_foreseen() {
        // The residual of a shift falls slowly, and evenly.
        let size = 60;
        let multiply = |x: &[f64], y: &mut [f64]| {
            for n in 0..size {
                y[n] = x[n] + 0.8 * x[(n + 1) % size];
            }
        };
        let mut b = vec![0.0; size];
        b[0] = 1.0;
        let solve = |goal: Goal| {
            let mut x = vec![0.0; size];
            let mut gmres = Gmres::new(size);
            let solved = gmres.solve(multiply, |_| {}, &b, &mut x, goal);
            let mut y = vec![0.0; size];
            multiply(&x, &mut y);
            let left: f64 = y.iter().zip(&b).map(|(y, b)| (y - b).powi(2)).sum();
            (solved, gmres.iterations(), left.sqrt())
        };
        let short = Goal {
            directions: 20,
            foresees: true,
            ..Goal::full(1e-3)
        };
        let (solved, directions, left) = solve(short);
        assert!(!solved && directions == FORESEEN_AFTER, "{directions}");
        assert!(left < 0.3, "{left}");
        let (solved, directions, _) = solve(Goal {
            foresees: false,
            ..short
        });
        assert!(!solved && directions == 20, "{directions}");
        let (solved, directions, left) = solve(Goal {
            directions: 40,
            ..short
        });
        assert!(solved && directions > 20, "{directions}");
        assert!(left <= 1e-3, "{left}");
    }

    /// Weighted rows are met more closely than the others, at the same sum of both.
    #[test]
    fn weighted_rows_are_met_more_closely() {
        let a = [
            [4.0, 1.0, 0.3, 1.0],
            [-1.0, 3.0, 0.5, 0.2],
            [0.0, 2.0, 5.0, 0.7],
            [1.0, 0.4, 0.1, 2.0],
        ];
        let b = [6.0, 6.5, 19.0, 3.0];
        let left = |goal: Goal| {
            let multiply = |x: &[f64], y: &mut [f64]| {
                for (y, row) in y.iter_mut().zip(&a) {
                    *y = dot(row, x);
                }
            };
            let mut x = [0.0; 4];
            assert!(Gmres::new(4).solve(multiply, |_| {}, &b, &mut x, goal));
            let mut y = [0.0; 4];
            multiply(&x, &mut y);
            std::array::from_fn::<f64, 4, _>(|n| (y[n] - b[n]).abs())
        };
        let plain = Goal::full(0.1);
        let weighted = Goal {
            weighted_from: 3,
            weight: 1e4,
            ..plain
        };
        let (plain, weighted) = (left(plain), left(weighted));
        assert!(
            weighted[3] < 1e-3 && plain[3] > 1e-2,
            "{plain:?} {weighted:?}"
        );
    }
}
