//! A part of the unknowns of a time step, solved by itself while the others keep their values.
//!
//! After an iteration of Newton's method on a whole flow most of what is left of the residual lies in few places: where
//! the surface has entered a cell, or along the edge of what is rigid. Newton's method on these places and their
//! surroundings alone costs a fraction of another iteration on everything (nonlinear elimination: Cai & Keyes, *SIAM J.
//! Sci. Comput.* 24 (2002) 183). Whether the whole has come to its end is decided by the residuals of the whole.

use super::{PrimalDual, Strategy};
use crate::discretisation::{Discretisation, Parts};
use crate::error::Error;
use crate::rheology::Rheology;
use crate::yield_step::{FlowState, Residuals, StepProblem, StepReport};

/// A velocity belongs to a part if its momentum is off by more than this over the largest miss,
const SHARE_OF_MOMENTUM: f64 = 0.03;
/// if the stress law is at one of its points,
const SHARE_OF_STRESS: f64 = 0.5;
/// and in any case by more than this over what is allowed,
const SHARE_ALLOWED: f64 = 0.5;
/// or if it lies no more points than this away from such a velocity: pressure passes a correction on.
const LAYERS: usize = 3;
/// Largest part that is worth while, over the whole.
const LARGEST_PART: f64 = 0.3;
/// Residuals at which the iteration on a part ends, over what is allowed of the whole,
const AIM: f64 = 0.3;
/// or over what they are before.
const GAIN: f64 = 3e-3;
/// Iterations on a part before it is tried from a larger ε, and those from there before it is given up.
const MOST_ITERATIONS: [usize; 2] = [12, 20];

/// How an attempt at a part ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// What is left lies in too many places.
    TooLarge,
    /// The part is solved.
    Solved,
    /// Newton's method did not come to its end.
    Failed,
}

/// Numbers of the unknowns and points of a part in the whole.
pub(super) struct Part {
    pub velocities: Vec<usize>,
    pub cells: Vec<usize>,
    pub points: Vec<usize>,
}

/// Stands for a cell that has not been looked at.
const UNSEEN: usize = usize::MAX;

impl Part {
    /// The marked velocities and those up to `layers` points away from them, with the cells beside them. None if these are
    /// more than `most` velocities, or none.
    pub(super) fn around<const D: usize, const C: usize, const V: usize>(
        discretisation: &Discretisation<D, C, V>,
        marked: &mut [bool],
        layers: usize,
        most: usize,
    ) -> Option<Self> {
        if !marked.contains(&true) {
            return None;
        }
        let mut reached = vec![false; marked.len()];
        for _ in 0..layers {
            reached.fill(false);
            for point in discretisation.points() {
                if point.velocities().iter().any(|&j| marked[j]) {
                    point.velocities().iter().for_each(|&j| reached[j] = true);
                }
            }
            for (marked, reached) in marked.iter_mut().zip(&reached) {
                *marked |= reached;
            }
            if marked.iter().filter(|marked| **marked).count() > most {
                return None;
            }
        }
        let velocities: Vec<usize> = (0..marked.len()).filter(|&j| marked[j]).collect();
        let cells = free_cells(discretisation, marked);
        let points = discretisation.points().iter().enumerate();
        let points = points
            .filter(|(_, point)| point.velocities().iter().any(|&j| marked[j]))
            .map(|(q, _)| q)
            .collect();
        Some(Self {
            velocities,
            cells,
            points,
        })
    }

    /// The operators of the part, and the load on its velocities.
    pub(super) fn restrict<R: Rheology, const D: usize, const C: usize, const V: usize>(
        &self,
        problem: &StepProblem<'_, R, D, C, V>,
        state: &FlowState<C>,
    ) -> (Discretisation<D, C, V>, Vec<f64>) {
        let whole = problem.discretisation;
        let mut velocities = vec![None; whole.velocities()];
        for (new, &j) in self.velocities.iter().enumerate() {
            velocities[j] = Some(new);
        }
        let mut cells = vec![None; whole.cells()];
        for (new, &cell) in self.cells.iter().enumerate() {
            cells[cell] = Some(new);
        }
        let mut load: Vec<f64> = self.velocities.iter().map(|&j| problem.load[j]).collect();
        let mut parts = Parts {
            points: self
                .points
                .iter()
                .map(|&q| whole.points()[q].restricted(&velocities, &cells, &state.u, &state.p))
                .collect(),
            mass: self.velocities.iter().map(|&j| whole.mass()[j]).collect(),
            components: self
                .velocities
                .iter()
                .map(|&j| whole.component_of(j))
                .collect(),
            boundary_load: vec![0.0; self.velocities.len()],
            cells: self.cells.len(),
            ..Parts::default()
        };
        for (&(cell, j, area), force) in whole.divergence().iter().zip(whole.gradient()) {
            match (cells[cell], velocities[j]) {
                (Some(cell), Some(j)) => {
                    parts.divergence.push((cell, j, area));
                    parts.gradient.push(*force);
                }
                (Some(cell), None) => parts.known_fluxes.push((cell, area * state.u[j])),
                (None, Some(j)) => load[j] += force * state.p[cell],
                (None, None) => {}
            }
        }
        for &(cell, flux) in whole.known_fluxes() {
            if let Some(cell) = cells[cell] {
                parts.known_fluxes.push((cell, flux));
            }
        }
        if let Some(places) = whole.places() {
            let (faces, centres) = places.split_at(whole.velocities());
            parts.places = self.velocities.iter().map(|&j| faces[j]).collect();
            let centres = self.cells.iter().map(|&cell| centres[cell]);
            parts.places.extend(centres);
        }
        let grid = whole.grid().clone();
        (Discretisation::of_parts(grid, parts), load)
    }

    /// The part of a state.
    pub(super) fn gather<const C: usize>(&self, whole: &FlowState<C>) -> FlowState<C> {
        FlowState {
            u: self.velocities.iter().map(|&j| whole.u[j]).collect(),
            p: self.cells.iter().map(|&cell| whole.p[cell]).collect(),
            s: self.points.iter().map(|&q| whole.s[q]).collect(),
        }
    }

    /// Puts the part of a state in its place.
    pub(super) fn scatter<const C: usize>(&self, part: &FlowState<C>, whole: &mut FlowState<C>) {
        for (u, &j) in part.u.iter().zip(&self.velocities) {
            whole.u[j] = *u;
        }
        for (p, &cell) in part.p.iter().zip(&self.cells) {
            whole.p[cell] = *p;
        }
        for (s, &q) in part.s.iter().zip(&self.points) {
            whole.s[q] = *s;
        }
    }
}

impl<const C: usize> PrimalDual<C> {
    /// Newton's method on the unknowns where most of the residuals is left, if these are few. The right-hand side holds the
    /// residual of momentum.
    pub(super) fn solve_part<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        u_old: &[f64],
        allowed: &Residuals,
        report: &mut StepReport,
    ) -> Result<Outcome, Error> {
        let discretisation = problem.discretisation;
        let found = report.residuals;
        let off = (SHARE_OF_MOMENTUM * found.momentum).max(SHARE_ALLOWED * allowed.momentum);
        let momentum = self.right_hand_side.iter().zip(discretisation.mass());
        let mut marked: Vec<bool> = momentum.map(|(r, m)| r.abs() > off * m).collect();
        let off = (SHARE_OF_STRESS * found.stress).max(SHARE_ALLOWED * allowed.stress);
        for (point, miss) in discretisation.points().iter().zip(&self.misses) {
            if *miss > off {
                point.velocities().iter().for_each(|&j| marked[j] = true);
            }
        }
        let most = (LARGEST_PART * u_old.len() as f64) as usize;
        let Some(part) = Part::around(discretisation, &mut marked, LAYERS, most) else {
            return Ok(Outcome::TooLarge);
        };
        let (restricted, load) = part.restrict(problem, &self.trial);
        let mut solver = PrimalDual::new(&restricted, self.options)?;
        let inner = StepProblem {
            discretisation: &restricted,
            rheology: problem.rheology,
            load: &load,
            dt: problem.dt,
        };
        let old: Vec<f64> = part.velocities.iter().map(|&j| u_old[j]).collect();
        let start = part.gather(&self.trial);
        let floors = [
            self.options.strain_rate_floor,
            self.options.first_strain_rate_floor,
        ];
        let aim = Residuals {
            momentum: (AIM * allowed.momentum).max(GAIN * found.momentum),
            stress: (AIM * allowed.stress).max(GAIN * found.stress),
            ..*allowed
        };
        let mut inner_report = StepReport::default();
        for (first_floor, max_iterations) in floors.into_iter().zip(MOST_ITERATIONS) {
            let strategy = Strategy {
                first_floor,
                factor: self.options.floor_factor,
                max_iterations,
                line_search: false,
                solves_parts: false,
            };
            let aim = Some(&aim);
            solver.attempt(&inner, &old, &start, &strategy, aim, &mut inner_report)?;
            if inner_report.converged {
                break;
            }
        }
        report.part_iterations += inner_report.iterations;
        if inner_report.converged {
            part.scatter(&solver.trial, &mut self.trial);
            Ok(Outcome::Solved)
        } else {
            Ok(Outcome::Failed)
        }
    }
}

/// Cells beside marked velocities, whose pressure is free. Where the marked velocities nowhere lead out of a group of
/// cells, through a surface, the pressure has no level of its own there and the divergence of one cell follows from the
/// others': the first cell of such a group keeps its pressure.
fn free_cells<const D: usize, const C: usize, const V: usize>(
    discretisation: &Discretisation<D, C, V>,
    marked: &[bool],
) -> Vec<usize> {
    let mut beside = vec![[UNSEEN; 2]; marked.len()];
    let mut is_free = vec![false; discretisation.cells()];
    let mut faces = vec![Vec::new(); discretisation.cells()];
    // A velocity through which nothing leaves the cell does not make it free.
    let fluxes = discretisation.divergence().iter();
    for &(cell, j, _) in fluxes.filter(|&&(_, _, area)| area != 0.0) {
        if marked[j] {
            let side = usize::from(beside[j][0] != UNSEEN);
            beside[j][side] = cell;
            is_free[cell] = true;
            faces[cell].push(j);
        }
    }
    let mut seen = vec![false; is_free.len()];
    let mut stack = Vec::new();
    for first in 0..is_free.len() {
        if !is_free[first] || seen[first] {
            continue;
        }
        let mut leads_out = false;
        stack.push(first);
        seen[first] = true;
        while let Some(cell) = stack.pop() {
            for &j in &faces[cell] {
                for other in beside[j] {
                    if other == UNSEEN {
                        leads_out = true;
                    } else if !seen[other] {
                        seen[other] = true;
                        stack.push(other);
                    }
                }
            }
        }
        is_free[first] = leads_out;
    }
    (0..is_free.len()).filter(|&cell| is_free[cell]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::{Discretisation, ThresholdPressure};
    use crate::grid::{Axis, Boundary, Grid};
    use crate::rheology::MuI;
    use crate::yield_step::{divergence_residual, momentum_residual};

    const WALL: Boundary = Boundary::NoSlip { velocity: 0.0 };

    fn box_of_cells() -> Discretisation {
        let axis = |cells: usize, high| Axis::Bounded {
            length: cells as f64,
            cells,
            low: WALL,
            high,
        };
        let grid = Grid::new([axis(9, WALL), axis(6, Boundary::FreeSurface)]).unwrap();
        Discretisation::new(grid, ThresholdPressure::Corner)
    }

    /// Some numbers.
    fn filled(count: usize, seed: f64) -> Vec<f64> {
        (0..count)
            .map(|n| (seed * (n + 1) as f64).sin().abs() + 0.1)
            .collect()
    }

    fn around(discretisation: &Discretisation, velocity: usize, most: usize) -> Option<Part> {
        let mut marked = vec![false; discretisation.velocities()];
        marked[velocity] = true;
        Part::around(discretisation, &mut marked, 1, most)
    }

    /// What is off in a part by itself is what is off there in the whole.
    #[test]
    fn residuals_of_a_part_are_those_of_the_whole() {
        let whole = box_of_cells();
        let points = whole.points().len();
        let state = FlowState {
            u: filled(whole.velocities(), 1.7),
            p: filled(whole.cells(), 0.9),
            s: filled(points, 2.3).iter().map(|s| [*s, -0.5 * s]).collect(),
        };
        let u_old = filled(whole.velocities(), 0.3);
        let load = whole.load([0.3, -1.0]);
        let law = MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0);
        let problem = StepProblem {
            discretisation: &whole,
            rheology: &law,
            load: &load,
            dt: 0.1,
        };
        let part = around(&whole, 40, whole.velocities()).unwrap();
        assert!(part.velocities.len() > 4 && part.velocities.len() < whole.velocities() / 2);
        let (restricted, load) = part.restrict(&problem, &state);
        let inner = StepProblem {
            discretisation: &restricted,
            rheology: &law,
            load: &load,
            dt: 0.1,
        };
        let mut all = vec![0.0; whole.velocities()];
        let mut some = vec![0.0; part.velocities.len()];
        let old: Vec<f64> = part.velocities.iter().map(|&j| u_old[j]).collect();
        momentum_residual(&problem, &u_old, &state, &mut all);
        momentum_residual(&inner, &old, &part.gather(&state), &mut some);
        for (some, &j) in some.iter().zip(&part.velocities) {
            assert!((some - all[j]).abs() < 1e-13, "{some} {}", all[j]);
        }
        let mut all = vec![0.0; whole.cells()];
        let mut some = vec![0.0; part.cells.len()];
        divergence_residual(&whole, &state.u, &mut all);
        divergence_residual(&restricted, &part.gather(&state).u, &mut some);
        for (some, &cell) in some.iter().zip(&part.cells) {
            assert!((some - all[cell]).abs() < 1e-13);
        }
        for (point, &q) in restricted.points().iter().zip(&part.points) {
            let same = whole.points()[q].pressure(&state.p);
            assert!((point.pressure(&part.gather(&state).p) - same).abs() < 1e-14);
        }
    }

    /// A group of cells that nothing leads out of keeps the pressure of one of them; with a way out through the
    /// surface none does. What is too large is no part.
    #[test]
    fn closed_groups_keep_a_pressure() {
        let beside = |discretisation: &Discretisation, part: &Part| {
            let divergence = discretisation.divergence().iter();
            let mut cells: Vec<usize> = divergence
                .filter(|(_, j, _)| part.velocities.contains(j))
                .map(|(cell, _, _)| *cell)
                .collect();
            cells.sort_unstable();
            cells.dedup();
            cells.len()
        };
        let whole = box_of_cells();
        let part = around(&whole, 20, whole.velocities()).unwrap();
        assert_eq!(part.cells.len() + 1, beside(&whole, &part));
        let top = whole.velocities() - 3;
        let part = around(&whole, top, whole.velocities()).unwrap();
        assert_eq!(part.cells.len(), beside(&whole, &part));
        assert!(around(&whole, top, 3).is_none());
    }
}
