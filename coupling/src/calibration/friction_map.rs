//! A map from two parameters of the contact law to μ(I) and the angle of repose, by interpolation between campaigns.
//!
//! μ_s, μ_2 and I_0 of one campaign hang together: where the data see one end of the law only, they run away along a
//! line on which μ(I) hardly changes. So it is the curve that is interpolated, by its values f_1, f_2, f_3 at three
//! inertial numbers within the data. With A = (I_2 − I_1)/(I_3 − I_2) and r = (f_2 − f_1)/(f_3 − f_2),
//!
//! > I_0 = (A I_3 − r I_1)/(r − A),
//!
//! for A < r < A I_3/I_1, and μ_s and μ_2 follow. These bounds are linear in f: whatever lies between laws (weights
//! positive, sum 1) is a law again.
//!
//! Interpolation is bilinear in ln β and ln μ_R. Its error is found by leaving grid points out: each that has neighbours on
//! both sides along an axis is predicted by them, over twice the spacing, so that the error told is rather too large.

use super::mu_i::{MuIFit, mu_of_i};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// A number with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WithError {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// A curve μ(I) by its values at the map's three inertial numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// μ there.
    pub friction: [f64; 3],
    /// Covariance of these.
    pub covariance: [[f64; 3]; 3],
}

/// One campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapCell {
    /// β: size of the contact patch over the reduced radius.
    pub beta: f64,
    /// μ_R: rolling friction.
    pub mu_r: f64,
    /// |τ|/p.
    pub curve: Curve,
    /// |τ|/σ_zz, where a law fits it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve_zz: Option<Curve>,
    /// Angle of repose (degrees).
    pub repose: WithError,
    /// φ of the flows.
    pub solid_fraction: WithError,
    /// Inertial numbers that were measured.
    pub valid_i: [f64; 2],
}

/// Laws on a grid of β and μ_R.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionMap {
    inertial_numbers: [f64; 3],
    betas: Vec<f64>,
    mu_rs: Vec<f64>,
    /// By β, then μ_R.
    cells: Vec<MapCell>,
    /// The least that the interpolation's error is taken for.
    told: InterpolationError,
}

/// What a map says at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Interpolated {
    /// (μ_s, μ_2, I_0) of |τ|/p.
    pub law: [f64; 3],
    /// Their covariance: of the campaigns and of the interpolation.
    pub covariance: [[f64; 3]; 3],
    /// The same of |τ|/σ_zz, where all neighbours have one.
    pub law_zz: Option<([f64; 3], [[f64; 3]; 3])>,
    /// Angle of repose (degrees).
    pub repose: WithError,
    /// φ.
    pub solid_fraction: WithError,
    /// Inertial numbers that all neighbours measured.
    pub valid_i: [f64; 2],
}

/// An axis of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Axis {
    /// β.
    Beta,
    /// μ_R.
    RollingFriction,
}

/// Misses of the grid points that can be left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Missed {
    /// Along which it lies between its neighbours.
    pub along: Axis,
    /// β.
    pub beta: f64,
    /// μ_R.
    pub mu_r: f64,
    /// Interpolated less measured μ at the three inertial numbers.
    pub friction: [f64; 3],
    /// Of the angle of repose (degrees).
    pub repose: f64,
    /// Of φ.
    pub solid_fraction: f64,
}

/// Root-mean-squares of the misses: the interpolation's error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InterpolationError {
    /// Of μ at the three inertial numbers.
    pub friction: [f64; 3],
    /// Of the angle of repose (degrees).
    pub repose: f64,
    /// Of φ.
    pub solid_fraction: f64,
}

/// Of all that is missed; 0 of nothing.
fn root_mean_square(missed: &[Missed]) -> InterpolationError {
    let of = |part: &dyn Fn(&Missed) -> f64| {
        let squares: f64 = missed.iter().map(|m| part(m).powi(2)).sum();
        (squares / missed.len().max(1) as f64).sqrt()
    };
    InterpolationError {
        friction: std::array::from_fn(|k| of(&|m| m.friction[k])),
        repose: of(&|m| m.repose),
        solid_fraction: of(&|m| m.solid_fraction),
    }
}

/// What is wrong with a map, or with a place on it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// The place lies outside.
    #[error("{key} = {value} is outside the map; allowed: [{low}, {high}]")]
    Outside {
        /// `beta` or `mu_r`.
        key: &'static str,
        /// The value.
        value: f64,
        /// Lowest on the map.
        low: f64,
        /// Highest.
        high: f64,
    },
    /// The cells are no grid.
    #[error(
        "the cells are no grid: {betas} values of beta and {mu_rs} of mu_r, at least two each, need {needed} cells; there are {found}"
    )]
    NoGrid {
        /// Different β.
        betas: usize,
        /// Different μ_R.
        mu_rs: usize,
        /// Cells of the full grid.
        needed: usize,
        /// Cells there are.
        found: usize,
    },
    /// A number that cannot be.
    #[error(
        "{key} = {value} of the cell at beta = {beta}, mu_r = {mu_r} is not allowed; allowed: {allowed}"
    )]
    BadCell {
        /// β.
        beta: f64,
        /// μ_R.
        mu_r: f64,
        /// Which number.
        key: &'static str,
        /// The value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The three inertial numbers do not rise.
    #[error("inertial_numbers = {0:?} are not allowed; allowed: three positive numbers that rise")]
    InertialNumbers([f64; 3]),
}

/// (μ_s, μ_2, I_0) of the law through three values; `None` where no law goes through them.
pub fn law_through(i: [f64; 3], f: [f64; 3]) -> Option<[f64; 3]> {
    let a = (i[1] - i[0]) / (i[2] - i[1]);
    let (low, high) = (f[1] - f[0], f[2] - f[1]);
    // r between its bounds, without a quotient by what may be zero.
    if !(high > 0.0 && low > a * high && low < a * high * i[2] / i[0]) {
        return None;
    }
    let r = low / high;
    let i_0 = (a * i[2] - r * i[0]) / (r - a);
    let share = |x: f64| x / (x + i_0);
    let span = (f[2] - f[0]) / (share(i[2]) - share(i[0]));
    let mu_s = f[0] - span * share(i[0]);
    (mu_s >= 0.0 && i_0 > 0.0).then_some([mu_s, mu_s + span, i_0])
}

impl Curve {
    /// Of a fit.
    pub fn of(fit: &MuIFit, i: [f64; 3]) -> Curve {
        let span = fit.mu_2 - fit.mu_s;
        let gradient = Matrix3::from_fn(|row, k| {
            let s = i[row] / (i[row] + fit.i_0);
            [
                1.0 - s,
                s,
                -span * i[row] / ((i[row] + fit.i_0) * (i[row] + fit.i_0)),
            ][k]
        });
        let c = Matrix3::from_fn(|r, k| fit.covariance[r][k]);
        let covariance = gradient * c * gradient.transpose();
        Curve {
            friction: i.map(|i| mu_of_i(fit.mu_s, fit.mu_2, fit.i_0, i)),
            covariance: rows(&covariance),
        }
    }

    /// The law and its covariance.
    fn law(&self, i: [f64; 3]) -> Option<([f64; 3], [[f64; 3]; 3])> {
        let law = law_through(i, self.friction)?;
        // ∂f/∂law is known in closed form; its inverse turns the covariance back.
        let [mu_s, mu_2, i_0] = law;
        let gradient = Matrix3::from_fn(|row, k| {
            let s = i[row] / (i[row] + i_0);
            let sum = i[row] + i_0;
            [1.0 - s, s, -(mu_2 - mu_s) * i[row] / (sum * sum)][k]
        });
        let back = gradient.try_inverse()?;
        let c = Matrix3::from_fn(|r, k| self.covariance[r][k]);
        Some((law, rows(&(back * c * back.transpose()))))
    }
}

fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|r| std::array::from_fn(|k| m[(r, k)]))
}

/// Rising, each once.
fn axis(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// Cells and weights between which a place lies, along one axis.
fn between(axis: &[f64], value: f64) -> [(usize, f64); 2] {
    let right = axis
        .partition_point(|x| *x < value)
        .clamp(1, axis.len() - 1);
    let (a, b) = (axis[right - 1].ln(), axis[right].ln());
    let share = ((value.ln() - a) / (b - a)).clamp(0.0, 1.0);
    [(right - 1, 1.0 - share), (right, share)]
}

impl FrictionMap {
    /// A map from the cells of a full grid, in any order.
    ///
    /// # Errors
    /// If the cells are no grid, a number cannot be, or no law goes through the values of a cell.
    pub fn new(inertial_numbers: [f64; 3], cells: Vec<MapCell>) -> Result<Self, MapError> {
        let [a, b, c] = inertial_numbers;
        if !(a > 0.0 && b > a && c > b && c.is_finite()) {
            return Err(MapError::InertialNumbers(inertial_numbers));
        }
        for cell in &cells {
            let check = |key, value: f64, ok: bool, allowed| {
                if ok && value.is_finite() {
                    Ok(())
                } else {
                    Err(MapError::BadCell {
                        beta: cell.beta,
                        mu_r: cell.mu_r,
                        key,
                        value,
                        allowed,
                    })
                }
            };
            check("beta", cell.beta, cell.beta > 0.0, "positive")?;
            check("mu_r", cell.mu_r, cell.mu_r > 0.0, "positive")?;
            let law = law_through(inertial_numbers, cell.curve.friction).is_some();
            let allowed = "three values that rise ever more slowly, as a law of mu(I) does";
            check("friction", cell.curve.friction[1], law, allowed)?;
            let variances = (0..3).map(|k| cell.curve.covariance[k][k]);
            for variance in variances.chain([cell.repose.error, cell.solid_fraction.error]) {
                check("error", variance, variance >= 0.0, "at least 0")?;
            }
            let angle = cell.repose.value;
            check("repose", angle, angle > 0.0 && angle < 90.0, "(0, 90)")?;
            let phi = cell.solid_fraction.value;
            check("solid_fraction", phi, phi > 0.0 && phi < 1.0, "(0, 1)")?;
            let [low, high] = cell.valid_i;
            check(
                "valid_i",
                low,
                low >= 0.0 && low < high,
                "[low, high] that rise",
            )?;
        }
        let betas = axis(cells.iter().map(|c| c.beta));
        let mu_rs = axis(cells.iter().map(|c| c.mu_r));
        let needed = betas.len() * mu_rs.len();
        let mut ordered = Vec::with_capacity(needed);
        for beta in &betas {
            for mu_r in &mu_rs {
                let here = |c: &&MapCell| c.beta == *beta && c.mu_r == *mu_r;
                ordered.extend(cells.iter().find(here).cloned());
            }
        }
        let full = ordered.len() == needed && cells.len() == needed;
        if !full || betas.len() < 2 || mu_rs.len() < 2 {
            return Err(MapError::NoGrid {
                betas: betas.len(),
                mu_rs: mu_rs.len(),
                needed,
                found: cells.len(),
            });
        }
        Ok(Self {
            inertial_numbers,
            betas,
            mu_rs,
            cells: ordered,
            told: InterpolationError::default(),
        })
    }

    /// The map with an error of its interpolation that is known otherwise, from campaigns off the grid: a grid of two by two
    /// cannot tell its own. The larger of both counts.
    #[must_use]
    pub fn with_error(mut self, told: InterpolationError) -> Self {
        self.told = told;
        self
    }

    /// The cells, by rising β, then μ_R.
    pub fn cells(&self) -> &[MapCell] {
        &self.cells
    }

    /// The inertial numbers at which curves are given.
    pub fn inertial_numbers(&self) -> [f64; 3] {
        self.inertial_numbers
    }

    fn cell(&self, beta: usize, mu_r: usize) -> &MapCell {
        &self.cells[beta * self.mu_rs.len() + mu_r]
    }

    /// Law and angle of repose at a place on the map.
    ///
    /// # Errors
    /// If it lies outside: nothing is extrapolated.
    pub fn at(&self, beta: f64, mu_r: f64) -> Result<Interpolated, MapError> {
        for (key, value, axis) in [("beta", beta, &self.betas), ("mu_r", mu_r, &self.mu_rs)] {
            let (low, high) = (axis[0], axis[axis.len() - 1]);
            if !(value >= low && value <= high) {
                return Err(MapError::Outside {
                    key,
                    value,
                    low,
                    high,
                });
            }
        }
        let mut mixed = Mixture::default();
        for (b, share) in between(&self.betas, beta) {
            for (m, other) in between(&self.mu_rs, mu_r) {
                if share * other > 0.0 {
                    mixed.add(self.cell(b, m), share * other);
                }
            }
        }
        // A grid point needs no interpolation.
        let error = if mixed.cells > 1 {
            self.error()
        } else {
            InterpolationError::default()
        };
        let place = MapError::BadCell {
            beta,
            mu_r,
            key: "friction",
            value: mixed.curve.friction[1],
            allowed: "three values through which a law goes",
        };
        mixed.finish(self.inertial_numbers, &error).ok_or(place)
    }

    /// Every grid point that has neighbours on both sides along an axis, beside what they make of it: once for each such
    /// axis.
    pub fn missed(&self) -> Vec<Missed> {
        let mut all = Vec::new();
        for b in 0..self.betas.len() {
            for m in 0..self.mu_rs.len() {
                let here = self.cell(b, m);
                let mut compare = |along: Axis, low: &MapCell, high: &MapCell, share: f64| {
                    let mut mixed = Mixture::default();
                    mixed.add(low, 1.0 - share);
                    mixed.add(high, share);
                    let of = |k: usize| mixed.curve.friction[k] - here.curve.friction[k];
                    all.push(Missed {
                        along,
                        beta: here.beta,
                        mu_r: here.mu_r,
                        friction: std::array::from_fn(of),
                        repose: mixed.repose.value - here.repose.value,
                        solid_fraction: mixed.solid_fraction.value - here.solid_fraction.value,
                    });
                };
                let share = |axis: &[f64], k: usize| {
                    (axis[k] / axis[k - 1]).ln() / (axis[k + 1] / axis[k - 1]).ln()
                };
                if b > 0 && b + 1 < self.betas.len() {
                    let (low, high) = (self.cell(b - 1, m), self.cell(b + 1, m));
                    compare(Axis::Beta, low, high, share(&self.betas, b));
                }
                if m > 0 && m + 1 < self.mu_rs.len() {
                    let (low, high) = (self.cell(b, m - 1), self.cell(b, m + 1));
                    compare(Axis::RollingFriction, low, high, share(&self.mu_rs, m));
                }
            }
        }
        all
    }

    /// Root-mean-squares of [`FrictionMap::missed`], or what was told where that is larger; 0 on a grid of two by two of
    /// which nothing was told.
    pub fn error(&self) -> InterpolationError {
        let InterpolationError {
            friction,
            repose,
            solid_fraction,
        } = root_mean_square(&self.missed());
        let told = &self.told;
        InterpolationError {
            friction: std::array::from_fn(|k| friction[k].max(told.friction[k])),
            repose: repose.max(told.repose),
            solid_fraction: solid_fraction.max(told.solid_fraction),
        }
    }

    /// Root-mean-squares of what is missed along one axis; `None` with two values on it.
    pub fn error_along(&self, axis: Axis) -> Option<InterpolationError> {
        let missed: Vec<Missed> = self
            .missed()
            .into_iter()
            .filter(|m| m.along == axis)
            .collect();
        (!missed.is_empty()).then(|| root_mean_square(&missed))
    }
}

/// A weighted sum of cells.
struct Mixture {
    cells: usize,
    curve: Curve,
    curve_zz: Option<Curve>,
    repose: WithError,
    solid_fraction: WithError,
    valid_i: [f64; 2],
}

impl Default for Mixture {
    fn default() -> Self {
        let nothing = Curve {
            friction: [0.0; 3],
            covariance: [[0.0; 3]; 3],
        };
        let zero = WithError {
            value: 0.0,
            error: 0.0,
        };
        Self {
            cells: 0,
            curve: nothing,
            curve_zz: Some(nothing),
            repose: zero,
            solid_fraction: zero,
            valid_i: [0.0, f64::INFINITY],
        }
    }
}

fn add_curve(sum: &mut Curve, curve: &Curve, weight: f64) {
    for k in 0..3 {
        sum.friction[k] += weight * curve.friction[k];
        for l in 0..3 {
            sum.covariance[k][l] += weight * weight * curve.covariance[k][l];
        }
    }
}

fn add_number(sum: &mut WithError, number: &WithError, weight: f64) {
    sum.value += weight * number.value;
    sum.error = sum.error.hypot(weight * number.error);
}

impl Mixture {
    fn add(&mut self, cell: &MapCell, weight: f64) {
        self.cells += 1;
        add_curve(&mut self.curve, &cell.curve, weight);
        match (&mut self.curve_zz, &cell.curve_zz) {
            (Some(sum), Some(curve)) => add_curve(sum, curve, weight),
            _ => self.curve_zz = None,
        }
        add_number(&mut self.repose, &cell.repose, weight);
        add_number(&mut self.solid_fraction, &cell.solid_fraction, weight);
        self.valid_i[0] = self.valid_i[0].max(cell.valid_i[0]);
        self.valid_i[1] = self.valid_i[1].min(cell.valid_i[1]);
    }

    fn finish(mut self, i: [f64; 3], error: &InterpolationError) -> Option<Interpolated> {
        for k in 0..3 {
            let square = error.friction[k] * error.friction[k];
            self.curve.covariance[k][k] += square;
            if let Some(curve) = &mut self.curve_zz {
                curve.covariance[k][k] += square;
            }
        }
        let (law, covariance) = self.curve.law(i)?;
        Some(Interpolated {
            law,
            covariance,
            law_zz: self.curve_zz.and_then(|c| c.law(i)),
            repose: WithError {
                error: self.repose.error.hypot(error.repose),
                ..self.repose
            },
            solid_fraction: WithError {
                error: self.solid_fraction.error.hypot(error.solid_fraction),
                ..self.solid_fraction
            },
            valid_i: self.valid_i,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const I: [f64; 3] = [0.1, 0.3, 0.7];

    fn cell(beta: f64, mu_r: f64, law: [f64; 3], repose: f64) -> MapCell {
        let friction = I.map(|i| mu_of_i(law[0], law[1], law[2], i));
        let covariance = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]];
        MapCell {
            beta,
            mu_r,
            curve: Curve {
                friction,
                covariance,
            },
            curve_zz: None,
            repose: WithError {
                value: repose,
                error: 0.3,
            },
            solid_fraction: WithError {
                value: 0.5,
                error: 0.002,
            },
            valid_i: [0.05 + 0.1 * mu_r, 0.8],
        }
    }

    /// μ linear in ln β and ln μ_R at every I; I_0 shared.
    fn plane() -> FrictionMap {
        let mut cells = Vec::new();
        for beta in [1.0, 0.1, 0.3] {
            for mu_r in [2.0, 0.5, 1.0] {
                let (x, y) = (f64::ln(beta), f64::ln(mu_r));
                let law = [0.6 + 0.07 * x + 0.02 * y, 0.9 + 0.05 * x + 0.03 * y, 0.5];
                cells.push(cell(beta, mu_r, law, 38.0 + 5.0 * x + 2.0 * y));
            }
        }
        FrictionMap::new(I, cells).unwrap()
    }

    #[test]
    fn a_law_goes_through_its_own_values_and_nothing_else_does() {
        for law in [[0.5, 0.9, 0.6], [0.77, 0.92, 0.076], [0.36, 1.4, 3.0]] {
            let f = I.map(|i| mu_of_i(law[0], law[1], law[2], i));
            let back = law_through(I, f).unwrap();
            for k in 0..3 {
                assert!((back[k] / law[k] - 1.0).abs() < 1e-10, "{back:?} {law:?}");
            }
        }
        // Straight, bent upwards, falling, with a step that no I_0 > 0 makes.
        for f in [
            [0.5, 0.6, 0.8],
            [0.5, 0.55, 0.8],
            [0.6, 0.5, 0.4],
            [0.5, 0.9, 0.9001],
        ] {
            assert_eq!(law_through(I, f), None, "{f:?}");
        }
    }

    #[test]
    fn what_is_linear_in_the_logarithms_is_found_exactly() {
        let map = plane();
        let (beta, mu_r) = (0.2, 1.3);
        let found = map.at(beta, mu_r).unwrap();
        let (x, y) = (f64::ln(beta), f64::ln(mu_r));
        let truth = [0.6 + 0.07 * x + 0.02 * y, 0.9 + 0.05 * x + 0.03 * y, 0.5];
        for (found, truth) in found.law.iter().zip(truth) {
            assert!((found / truth - 1.0).abs() < 1e-9, "{found}");
        }
        assert!((found.repose.value - (38.0 + 5.0 * x + 2.0 * y)).abs() < 1e-9);
        assert!(map.error().friction.iter().all(|e| *e < 1e-12));
        // Of the neighbours at μ_R = 2 and 1 the narrower range.
        assert_eq!(found.valid_i, [0.25, 0.8]);
        assert_eq!(map.missed().len(), 6);
    }

    #[test]
    fn errors_are_those_of_the_linearised_curve_and_grow_with_what_is_left_out() {
        let map = plane();
        let found = map.at(0.3, 1.0).unwrap();
        // On a grid point: the curve's covariance through ∂law/∂f, by differences of the closed form.
        let f = map.cell(1, 1).curve.friction;
        for k in 0..3 {
            let by = |j: usize| {
                let mut other = f;
                other[j] += 1e-7;
                (law_through(I, other).unwrap()[k] - found.law[k]) / 1e-7 * 1e-3
            };
            let error = (0..3).map(|j| by(j).powi(2)).sum::<f64>().sqrt();
            assert!((found.covariance[k][k].sqrt() / error - 1.0).abs() < 1e-4);
        }
        let mut cells = map.cells().to_vec();
        let middle = cells
            .iter_mut()
            .find(|c| c.beta == 0.3 && c.mu_r == 1.0)
            .unwrap();
        middle.curve.friction = middle.curve.friction.map(|f| f + 0.03);
        let bent = FrictionMap::new(I, cells).unwrap();
        let error = bent.error();
        // Missed by 0.03 along both axes, and as a neighbour by two edges never: 2 of 6.
        assert!(
            (error.friction[0] - 0.03 * (2.0f64 / 6.0).sqrt()).abs() < 1e-12,
            "{error:?}"
        );
        let told = InterpolationError {
            friction: [0.05, 0.0, 0.0],
            ..InterpolationError::default()
        };
        let warned = bent.clone().with_error(told).error();
        assert_eq!(
            warned.friction,
            [0.05, error.friction[1], error.friction[2]]
        );
        let (before, after) = (map.at(0.2, 0.8).unwrap(), bent.at(0.2, 0.8).unwrap());
        assert!(after.covariance[0][0] > 4.0 * before.covariance[0][0]);
    }

    #[test]
    fn what_lies_outside_or_is_no_grid_is_refused() {
        let map = plane();
        let why = map.at(0.05, 1.0).unwrap_err().to_string();
        assert!(
            why.contains("beta = 0.05") && why.contains("[0.1, 1]"),
            "{why}"
        );
        assert!(map.at(0.3, 2.1).is_err() && map.at(f64::NAN, 1.0).is_err());
        let cells = map.cells();
        assert!(FrictionMap::new(I, cells[1..].to_vec()).is_err());
        assert!(FrictionMap::new(I, [cells, &cells[..1]].concat()).is_err());
        assert!(FrictionMap::new([0.1, 0.1, 0.2], cells.to_vec()).is_err());
        let mut falling = cells.to_vec();
        falling[0].curve.friction = [0.6, 0.5, 0.4];
        let why = FrictionMap::new(I, falling).unwrap_err().to_string();
        assert!(why.contains("friction"), "{why}");
    }
}
