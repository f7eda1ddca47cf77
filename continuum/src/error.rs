//! Errors of the crate: values that name the key, the value and the allowed range.

use thiserror::Error;

/// What can go wrong in a continuum computation.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter lies outside the range in which the model means something.
    #[error("`{key}` = {value} is out of range: allowed {allowed}")]
    OutOfRange {
        /// Dotted path of the parameter, as in a scene file.
        key: &'static str,
        /// The value that was given.
        value: f64,
        /// The allowed range, in words and numbers.
        allowed: String,
    },
    /// No boundary of the grid sets the pressure, which is then known up to a constant only.
    #[error(
        "no boundary of the grid sets the pressure: one side must be a free surface or a loaded wall"
    )]
    UndeterminedPressure,
    /// A time step did not converge, not even after it had been cut many times.
    #[error(
        "no convergence at t = {time} (natural units): time step cut down to {dt}, \
         residuals: momentum {momentum:e}, divergence {divergence:e}, stress {stress:e} \
         at strain-rate floor {strain_rate_floor:e}"
    )]
    NotConverged {
        /// Time at the start of the step, in natural units of the flow.
        time: f64,
        /// The smallest time step that was tried, in natural units.
        dt: f64,
        /// Largest momentum residual of the last attempt.
        momentum: f64,
        /// Largest divergence of the last attempt.
        divergence: f64,
        /// Largest stress residual of the last attempt.
        stress: f64,
        /// Strain-rate floor that the last attempt had come down to.
        strain_rate_floor: f64,
    },
    /// The steady state was not reached within the allowed number of steps.
    #[error(
        "no steady state within {steps} steps (t = {time}, natural units): \
         acceleration still {acceleration:e}, asked for {tolerance:e}"
    )]
    NotSteady {
        /// Steps made.
        steps: usize,
        /// Time reached, natural units.
        time: f64,
        /// Largest acceleration in the last step, natural units.
        acceleration: f64,
        /// The tolerance that was asked for, natural units.
        tolerance: f64,
    },
    /// A saved state has other sizes than the grid it is to go on with.
    #[error("the state belongs to another grid: {found} cells instead of {expected}")]
    ForeignState {
        /// Cells of the state.
        found: usize,
        /// Cells of the grid.
        expected: usize,
    },
    /// The sparse linear system could not be factorised.
    #[error("sparse factorisation failed: {0}")]
    LinearSolver(String),
    /// A linear system has no solution.
    #[error("singular linear system: {0}")]
    Singular(String),
    /// The caller asked to stop.
    #[error("stopped on request after {steps} steps")]
    Stopped {
        /// Steps made before the stop.
        steps: usize,
    },
}

/// Whether a linear system was solved: that it has no solution is no error of the step, but of memory or patterns is.
pub(crate) fn is_solved(outcome: Result<(), Error>) -> Result<bool, Error> {
    match outcome {
        Ok(()) => Ok(true),
        Err(Error::Singular(_)) => Ok(false),
        Err(error) => Err(error),
    }
}

/// Checks that a value is finite and satisfies a condition, naming the key if it does not.
pub(crate) fn require(
    holds: bool,
    key: &'static str,
    value: f64,
    allowed: impl Into<String>,
) -> Result<(), Error> {
    if holds && value.is_finite() {
        Ok(())
    } else {
        Err(Error::OutOfRange {
            key,
            value,
            allowed: allowed.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_singular_systems_are_no_errors() {
        assert_eq!(is_solved(Ok(())), Ok(true));
        assert_eq!(is_solved(Err(Error::Singular("pivot".into()))), Ok(false));
        let memory = Error::LinearSolver("out of memory".into());
        assert_eq!(is_solved(Err(memory.clone())), Err(memory));
    }
}
