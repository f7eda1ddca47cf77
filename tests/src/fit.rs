//! Least squares.

/// A straight line through points and how well it goes through them.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Value at x = 0.
    pub intercept: f64,
    /// Slope.
    pub slope: f64,
    /// Share of the variance that the line explains.
    pub r2: f64,
}

impl Line {
    /// Least squares through (x, y).
    pub fn through(points: &[(f64, f64)]) -> Line {
        let n = points.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
        let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
        let xx = mean(&|p| (p.0 - x).powi(2));
        let yy = mean(&|p| (p.1 - y).powi(2));
        let xy = mean(&|p| (p.0 - x) * (p.1 - y));
        let slope = xy / xx;
        Line {
            intercept: y - slope * x,
            slope,
            r2: xy * xy / (xx * yy),
        }
    }
}

/// Mean and its standard error.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (mean, (variance / n).sqrt())
}

/// Where a function of one variable is largest in a range, by golden sections.
pub fn largest(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    while high - low > 1e-6 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if f(a) > f(b) {
            high = b;
        } else {
            low = a;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_again() {
        let points: Vec<_> = (0..9).map(|k| (k as f64, 3.0 - 0.5 * k as f64)).collect();
        let line = Line::through(&points);
        assert!((line.intercept - 3.0).abs() < 1e-12 && (line.slope + 0.5).abs() < 1e-12);
        assert!((line.r2 - 1.0).abs() < 1e-12);
        assert!((largest(0.0, 3.0, |x| -(x - 1.2_f64).powi(2)) - 1.2).abs() < 1e-5);
        let (mean, error) = mean_and_error(&[1.0, 2.0, 3.0]);
        assert!((mean - 2.0).abs() < 1e-12 && (error - 1.0 / 3.0_f64.sqrt()).abs() < 1e-12);
    }
}
