//! The velocity moves on under gravity, pressure and stress.

use super::{INACTIVE, SurfaceFlow, SurfaceStep};
use crate::discretisation::Discretisation;
use crate::error::Error;
use crate::free_surface::faces::{Face, Faces};
use crate::free_surface::fraction::reconstruct;
use crate::free_surface::ground::DUST;
use crate::free_surface::ground::faces::faces_over;
use crate::free_surface::ground::shores::Motion;
use crate::free_surface::operators::{Material, Operators};
use crate::free_surface::sliding::some_wall_adheres;
use crate::free_surface::standing;
use crate::free_surface::transport::MASSLESS;
use crate::rheology::Rheology;
use crate::yield_step::{PrimalDual, Residuals, StepProblem, YieldSolver};

/// Free fall may shrink a cell at this rate: the round-off of a velocity over a cell.
const FREE_FALL: f64 = 1e-12;

impl<R: Rheology, const D: usize, const C: usize, const V: usize> SurfaceFlow<R, D, C, V> {
    /// Moves the velocity on by `dt` under gravity, pressure and stress.
    pub(super) fn accelerate(&mut self, dt: f64, record: &mut SurfaceStep) -> Result<bool, Error> {
        let clock = std::time::Instant::now();
        let fractions = &self.state.fractions;
        let (acceleration, thin_layer) = (self.acceleration, self.options.thin_layer);
        let mut faces = match &self.bed {
            None => {
                reconstruct(&self.topology, fractions, &mut self.planes);
                Faces::of(
                    &self.grid,
                    &self.topology,
                    fractions,
                    acceleration,
                    thin_layer,
                )
            }
            Some(ground) => {
                ground.fill(fractions, &mut self.filled);
                reconstruct(&self.topology, &self.filled, &mut self.planes);
                // Nor has the surface of matter a plane where there is only ground.
                for (plane, fraction) in self.planes.iter_mut().zip(fractions) {
                    if *fraction <= DUST {
                        *plane = None;
                    }
                }
                let falls = std::array::from_fn(|axis| {
                    -acceleration[axis] * self.grid.axes()[axis].spacing()
                });
                self.shores.find(
                    ground,
                    &self.topology,
                    fractions,
                    &self.planes,
                    &Motion {
                        velocity: &self.state.velocity,
                        falls,
                    },
                );
                faces_over(ground, &self.topology, fractions, acceleration, thin_layer)
            }
        };
        if let Some(ends) = &self.ends {
            ends.open(&mut faces);
        }
        let material = Material {
            grid: &self.grid,
            topology: &self.topology,
            fractions,
            planes: &self.planes,
            shores: &self.shores,
            faces: &faces,
            side_walls: self.side_walls,
            ends: self.ends.as_ref(),
            acceleration,
            outside: self.outside.as_ref(),
            sliding: &self.sliding,
            stands: self.stands(),
        };
        let Operators {
            discretisation,
            places,
        } = match &self.bed {
            None => material.operators(),
            Some(ground) => material.operators_over(ground),
        };
        record.crowded_points = discretisation.crowded_points();
        self.gather(&faces, &places);
        if self.falls_freely(&discretisation, dt) {
            self.spent.operators += clock.elapsed().as_secs_f64();
            record.active_cells = faces.active.len();
            record.residuals = Residuals::default();
            record.allowed = Residuals::default();
            self.state.history.forget_stress();
            self.scatter(&faces, &places, dt);
            return Ok(true);
        }
        let pattern = discretisation.pattern();
        self.spent.operators += clock.elapsed().as_secs_f64();
        let clock = std::time::Instant::now();
        if self
            .solver
            .as_ref()
            .is_none_or(|(known, _)| *known != pattern)
        {
            // The old factors make room first: in space they are most of the memory.
            self.solver = None;
            self.solver = Some((
                pattern,
                PrimalDual::new(&discretisation, self.options.solver)?,
            ));
        }
        self.spent.analysis += clock.elapsed().as_secs_f64();
        let clock = std::time::Instant::now();
        record.active_cells = faces.active.len();
        let mut load = discretisation.load(self.acceleration);
        if self.options.second_order {
            let history = &self.state.history;
            history.add_load(&discretisation, &places, dt, &mut load);
        }
        let problem = StepProblem {
            discretisation: &discretisation,
            rheology: &self.rheology,
            load: &load,
            dt,
        };
        let Some((_, solver)) = &mut self.solver else {
            return Ok(false);
        };
        let report = solver.step(&problem, &mut self.unknowns)?;
        self.spent.newton += clock.elapsed().as_secs_f64();
        self.spent.within_newton.add(&solver.take_times());
        record.newton_iterations += report.iterations;
        record.residuals = report.residuals;
        record.allowed = report.allowed;
        record.held_points = report.held_points;
        if report.converged {
            if let Some(outside) = &self.outside {
                let rates = outside.untaken(&faces, &self.topology);
                for (sum, rate) in self.untaken.iter_mut().zip(rates) {
                    *sum += rate * dt;
                }
            }
            if self.options.second_order {
                let (history, stress) = (&mut self.state.history, &self.state.stress);
                history.note(&discretisation, &places, &self.unknowns, stress, dt);
            }
            self.scatter(&faces, &places, dt);
        }
        Ok(report.converged)
    }

    /// Whether the friction of matter at rest holds free upright faces.
    fn stands(&self) -> bool {
        let [one, two] = [1.0, 2.0].map(|p| self.rheology.threshold(0.0, p).stress);
        if two - one < 1.0 {
            return false;
        }
        let (fractions, ground) = (&self.state.fractions, self.bed.as_ref());
        let free = standing::free_axes(&self.grid, &self.topology, fractions, ground);
        two - one >= standing::friction(free)
    }

    /// Without pressure and stress, and if gravity alone lets no cell shrink, free fall is the exact
    /// solution: makes it, to the last bit, and says so.
    fn falls_freely(&mut self, discretisation: &Discretisation<D, C, V>, dt: f64) -> bool {
        let unknowns = &mut self.unknowns;
        let is_loose = self.bed.is_none()
            && self.outside.is_none()
            && self.ends.is_none()
            && unknowns.p.iter().all(|p| *p <= f64::MIN_POSITIVE)
            && unknowns.s.iter().all(|s| *s == [0.0; C])
            && self.rheology.threshold(1.0, 0.0).stress == 0.0
            && !some_wall_adheres(&self.grid)
            && self
                .side_walls
                .is_none_or(|walls| walls.friction.cohesion == 0.0);
        if !is_loose {
            return false;
        }
        self.divergence.clear();
        self.divergence.resize(discretisation.cells(), 0.0);
        let pushes = self.acceleration.map(|a| a * dt);
        for &(cell, j, area) in discretisation.divergence() {
            let push = pushes[discretisation.component_of(j)];
            self.divergence[cell] += area * (unknowns.u[j] + push);
        }
        let volume = self.grid.cell_volume();
        if self.divergence.iter().any(|d| *d < -FREE_FALL * volume) {
            return false;
        }
        for (j, u) in unknowns.u.iter_mut().enumerate() {
            *u += pushes[discretisation.component_of(j)];
        }
        unknowns.p.fill(0.0);
        true
    }

    /// Velocity, pressure and stress of the unknowns from those of the grid.
    fn gather(&mut self, faces: &Faces<D>, places: &[usize]) {
        let count = faces.own.len();
        self.unknowns.u.clear();
        self.unknowns.u.resize(count, 0.0);
        self.momentum.clear();
        self.momentum.resize(count, 0.0);
        for c in 0..D {
            for (face, role) in faces.role[c].iter().enumerate() {
                if let Some(j) = role.unknown() {
                    let mass = self.topology.face_mean(c, face, &self.state.fractions);
                    self.momentum[j] += mass * faces.share(c, face);
                    self.unknowns.u[j] += mass * self.state.velocity[c][face];
                }
            }
        }
        for (u, mass) in self.unknowns.u.iter_mut().zip(&self.momentum) {
            *u /= mass;
        }
        self.unknowns.p.clear();
        self.unknowns
            .p
            .extend(faces.active.iter().map(|&cell| self.state.pressure[cell]));
        // A cell that was not active before has no pressure yet, which is not to say that it has
        // let go.
        for (p, &cell) in self.unknowns.p.iter_mut().zip(&faces.active) {
            if self.state.pressure[cell] < 0.0 {
                *p = f64::MIN_POSITIVE;
            }
        }
        self.unknowns.s.clear();
        self.unknowns
            .s
            .extend(places.iter().map(|&place| self.state.stress[place]));
    }

    fn scatter(&mut self, faces: &Faces<D>, places: &[usize], dt: f64) {
        for c in 0..D {
            let push = self.acceleration[c] * dt;
            for (face, role) in faces.role[c].iter().enumerate() {
                let mass = self.topology.face_mean(c, face, &self.state.fractions);
                if *role == Face::Loose {
                    let u = &mut self.state.velocity[c][face];
                    *u = if mass > MASSLESS { *u + push } else { 0.0 };
                }
            }
        }
        self.state.history.drop_lead(faces);
        faces.spread(&self.unknowns.u, &mut self.state.velocity);
        if let Some(ends) = &self.ends {
            ends.impose(&mut self.state.velocity[0]);
        }
        self.state.pressure.fill(INACTIVE);
        for (&cell, p) in faces.active.iter().zip(&self.unknowns.p) {
            self.state.pressure[cell] = *p;
        }

        self.state.stress.fill([0.0; C]);
        for (&place, s) in places.iter().zip(&self.unknowns.s) {
            self.state.stress[place] = *s;
        }
    }
}
