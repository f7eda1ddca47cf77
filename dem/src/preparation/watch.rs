//! Who watches a preparation, and how one that was stopped goes on.
//!
//! A preparation shows itself at every look: its measures of rest, and all that it needs to go on from there with
//! the same bits, the simulation and the counts of the loops that it is in ([`Midway`]).

use super::rest::RestMeasures;
use crate::record::Record;
use crate::setup::SetupError;
use crate::simulation::Simulation;
use std::ops::ControlFlow;

/// A preparation under way, from where it goes on.
#[derive(Clone, Debug, Default)]
pub struct Midway {
    /// Its simulation ([`Simulation::checkpoint`]).
    pub record: Record,
    /// Counts of its loops, the outermost first.
    pub loops: Vec<u64>,
}

/// A preparation at a look.
pub struct Look<'a> {
    /// How close to rest it is.
    pub measures: &'a RestMeasures,
    /// Its state; none where a preparation begins again if it is stopped.
    pub state: Option<LookState<'a>>,
}

/// The state of a preparation at a look.
pub struct LookState<'a> {
    simulation: &'a mut Simulation,
    trail: &'a Trail,
    own: &'a [u64],
}

impl LookState<'_> {
    /// What goes on from here.
    pub fn midway(&mut self) -> Midway {
        Midway {
            record: self.simulation.checkpoint(),
            loops: [&self.trail.around, self.own].concat(),
        }
    }
}

impl<'a> Look<'a> {
    /// A look at a preparation that cannot be gone on with.
    pub(super) fn passing(measures: &'a RestMeasures) -> Look<'a> {
        Look {
            measures,
            state: None,
        }
    }
}

/// Whoever watches a preparation. Closures that take measures of rest do.
pub trait Watch {
    /// Sees how it stands; may stop it.
    fn look(&mut self, look: &mut Look) -> ControlFlow<()>;

    /// From where it goes on, none where it begins. A simulation that it is given is that of then already.
    fn goes_on(&self) -> Option<&Midway> {
        None
    }
}

impl<F: FnMut(&RestMeasures) -> ControlFlow<()>> Watch for F {
    fn look(&mut self, look: &mut Look) -> ControlFlow<()> {
        self(look.measures)
    }
}

/// The loops that a preparation is in.
pub(super) struct Trail {
    /// Counts of those around the one that is looked from.
    around: Vec<u64>,
    /// Counts that a preparation goes on from, of loops that are not entered again yet.
    ahead: Vec<u64>,
}

impl Trail {
    /// Where a preparation begins, or goes on.
    pub fn of(watch: &dyn Watch) -> Trail {
        let loops = watch.goes_on().map(|midway| midway.loops.clone());
        let mut ahead = loops.unwrap_or_default();
        ahead.reverse();
        Trail {
            around: Vec::new(),
            ahead,
        }
    }

    /// Counts of a loop that goes on; none where it begins.
    ///
    /// # Errors
    /// If there are fewer.
    pub fn next<const N: usize>(&mut self) -> Result<Option<[u64; N]>, SetupError> {
        if self.ahead.is_empty() {
            return Ok(None);
        }
        let mut counts = [0; N];
        for count in &mut counts {
            *count = self.ahead.pop().ok_or_else(|| {
                SetupError::Record("the loops of the preparation are cut short".into())
            })?;
        }
        Ok(Some(counts))
    }

    /// The same of the innermost loop.
    ///
    /// # Errors
    /// If there are more, too.
    pub fn last<const N: usize>(&mut self) -> Result<Option<[u64; N]>, SetupError> {
        let counts = self.next()?;
        if self.ahead.is_empty() {
            return Ok(counts);
        }
        Err(out_of_place())
    }

    /// Enters what a loop of these counts does.
    pub fn enter(&mut self, counts: &[u64]) {
        self.around.extend(counts);
    }

    /// Leaves what was entered with so many counts.
    pub fn leave(&mut self, counts: usize) {
        self.around
            .truncate(self.around.len().saturating_sub(counts));
    }

    /// Shows a preparation from within a loop of these counts.
    ///
    /// # Errors
    /// [`SetupError::Interrupted`] if it is stopped.
    pub fn show(
        &self,
        watch: &mut dyn Watch,
        simulation: &mut Simulation,
        (measures, own): (&RestMeasures, &[u64]),
    ) -> Result<(), SetupError> {
        let mut look = Look {
            measures,
            state: Some(LookState {
                simulation,
                trail: self,
                own,
            }),
        };
        stopped(watch.look(&mut look))
    }
}

/// The error of counts that no preparation comes to.
pub(super) fn out_of_place() -> SetupError {
    SetupError::Record("the loops of the preparation are those of another one".into())
}

/// The error of a preparation that was stopped.
pub(super) fn stopped(flow: ControlFlow<()>) -> Result<(), SetupError> {
    match flow {
        ControlFlow::Break(()) => Err(SetupError::Interrupted),
        ControlFlow::Continue(()) => Ok(()),
    }
}
