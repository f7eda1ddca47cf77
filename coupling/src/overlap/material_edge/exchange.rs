//! The steps: grains under what is held, and the exchange that follows so many of them.

use super::embedded::Embedded;
use super::rows::{Load, Row, bearers, slopes};
use super::{Continuum, MaterialEdge, OverlapError, Side};
use crate::overlap::angular::{AngularBook, Counterpart, Parts};
use crate::overlap::joint::{self, LEAST_BUFFER, inertia, over, towards};
use colluvium_continuum::units::Units;
use colluvium_dem::{GrainSample, Load as Laid, Simulation};
use nalgebra::Vector3;

/// Rows with less than this of a full row of shell hand on what presses on them: a force on few grains throws them out.
pub(super) const LEAST_ROW: f64 = 0.3;
/// Steepest slope of the edge that its area vector follows.
pub(super) const STEEPEST: f64 = 2.0;

/// Room for what is formed and forgotten in a step.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    near: Vec<(GrainSample, f64, Embedded)>,
    pub(super) shell: Vec<Load>,
    bearers: Vec<usize>,
    forces: Vec<[f64; 2]>,
}

/// A vector of the plane x–z in space.
fn in_slab([x, z]: [f64; 2]) -> Vector3<f64> {
    Vector3::new(x, 0.0, z)
}

impl MaterialEdge {
    /// Books the impulses of what was laid over the steps made since.
    pub(super) fn book_grains(&mut self, simulation: &Simulation) {
        let time = self.acting(simulation);
        for (sum, force) in self.given.relaxation.iter_mut().zip(&self.laid.relaxation) {
            for (sum, force) in sum.iter_mut().zip(force) {
                *sum += force * time;
            }
        }
        for (sum, moment) in self.given.spin.iter_mut().zip(&self.laid.spin) {
            *sum += moment * time;
        }
        for (work, power) in self.monitors.work.iter_mut().zip(self.laid.powers) {
            *work += power * time;
        }
        for axis in 0..2 {
            let relaxation: f64 = self.laid.relaxation.iter().map(|f| f[axis]).sum();
            self.given.traction[axis] += self.laid.traction[axis] * time;
            self.given.impedance[axis] += self.laid.impedance[axis] * time;
            self.account.relaxation[axis] += relaxation * time;
        }
    }

    /// Forms the loads of the next steps, along x, in the order of the grains' numbers, noting what they consist of.
    pub(super) fn lay(
        &mut self,
        simulation: &Simulation,
        loads: &mut Vec<Laid>,
        mut angular: Option<&mut AngularBook>,
    ) {
        self.laid_at = simulation.steps_done();
        self.laid.clear();
        if self.spec.settings.uncoupled {
            return;
        }
        let side = self.spec.side;
        let (shell, buffer) = (self.spec.settings.shell, self.spec.settings.buffer);
        let mut scratch = std::mem::take(&mut self.scratch);
        let reach = self.held.reach;
        scratch.near.clear();
        scratch.near.extend(
            simulation
                .held(|x| side.along(x.x) < reach)
                .map(|g| side.grain(g))
                .filter_map(|g| self.labels.of(&g).map(|label| (g, label)))
                .map(|(g, label)| (g, label, self.embedded(&g)))
                .filter(|(_, label, embedded)| *label < buffer || embedded.weight > 0.0),
        );
        // Rows may stand in another order after a restart, and sums over them end in other bits.
        scratch.near.sort_unstable_by_key(|(grain, ..)| grain.id);
        let rows = self.held.rows.len();
        let weight = |grain: &GrainSample, label: f64, embedded: &Embedded| {
            (1.0 - embedded.weight) * grain.mass * ((shell - label) / shell).clamp(0.0, 1.0)
        };
        scratch.shell.clear();
        scratch.shell.resize(rows, Load::default());
        for (grain, label, embedded) in &scratch.near {
            let q = weight(grain, *label, embedded);
            if q <= 0.0 {
                continue;
            }
            let hats = self.cells.hats(grain.position.x, grain.position.z);
            let beside = self.view.velocity_at(&hats);
            for (row, hat) in self.cells.rows(grain.position.z) {
                let [u, w] = beside.unwrap_or(self.held.rows[row].velocity);
                let load = &mut scratch.shell[row];
                load.weight += q * hat;
                load.slip[0] += q * hat * (grain.velocity.x - u);
                load.slip[1] += q * hat * (grain.velocity.z - w);
                load.momentum[0] += q * hat * grain.velocity.x;
                load.momentum[1] += q * hat * grain.velocity.z;
            }
        }
        let full = 0.5 * self.spec.density() * shell * self.cells.spacing * self.spec.slab;
        let least = LEAST_ROW * full;
        bearers(&scratch.shell, least, &mut scratch.bearers);
        let mut pressed = Counterpart::default();
        scratch.forces.clear();
        scratch.forces.resize(rows, [0.0; 2]);
        for (k, row) in self.held.rows.iter().enumerate() {
            let bearer = scratch.bearers[k];
            if bearer == usize::MAX {
                continue;
            }
            let load = &scratch.shell[bearer];
            let slip = load.slip.map(|p| over(p, load.weight));
            let impedance = row.impedance(self.spec.settings.impedance, slip);
            let force = [0, 1].map(|axis| row.traction[axis] + impedance[axis]);
            let at = [row.place, self.cells.height(k)];
            let [at, on_face] = [at, force].map(|v| in_slab(side.in_plane(v)));
            pressed.add(0, &at, &on_face);
            let velocity = load.momentum.map(|p| over(p, load.weight));
            for (axis, (traction, impedance)) in row.traction.iter().zip(impedance).enumerate() {
                self.laid.powers[0] += traction * velocity[axis];
                self.laid.powers[1] += impedance * velocity[axis];
                scratch.forces[bearer][axis] += traction + impedance;
                self.laid.traction[axis] += traction;
                self.laid.impedance[axis] += impedance;
            }
        }
        let gravity = side.turned(simulation.gravity());
        let stopping = self.embedded_time();
        let mut relaxation = 0.0;
        for (grain, label, embedded) in &scratch.near {
            let q = weight(grain, *label, embedded);
            let mut force = [0.0; 2];
            if q > 0.0 {
                for (row, hat) in self.cells.rows(grain.position.z) {
                    let all = scratch.shell[row].weight;
                    if all > least {
                        for (sum, part) in force.iter_mut().zip(scratch.forces[row]) {
                            *sum += q * hat / all * part;
                        }
                    }
                }
            }
            let traction = force;
            let carried = embedded.force(grain, &gravity, stopping);
            let relaxed = if *label < buffer { grain.mass } else { 0.0 };
            let turned = if *label < buffer { inertia(grain) } else { 0.0 };
            let mut moment = 0.0;
            relaxation += carried.y * grain.velocity.y;
            for (cell, hat) in self.cells.hats(grain.position.x, grain.position.z) {
                let turn = hat * turned * self.held.spins[cell];
                self.laid.spin[cell] += turn;
                moment += turn;
                let laid = &mut self.laid.relaxation[cell];
                for axis in 0..2 {
                    let relaxed = relaxed * self.held.accelerations[cell][axis];
                    let pull = hat * (relaxed + [carried.x, carried.z][axis]);
                    laid[axis] += pull;
                    force[axis] += pull;
                    relaxation += pull * [grain.velocity.x, grain.velocity.z][axis];
                }
            }
            relaxation += moment * grain.spin.y;
            if force != [0.0; 2] || carried.y != 0.0 || moment != 0.0 {
                let moment = side.turned_about(Vector3::y() * moment);
                let all = side.turned([force[0], carried.y, force[1]].into());
                loads.push(Laid {
                    grain: grain.id,
                    force: all,
                    moment,
                });
                if let Some(book) = &mut angular {
                    let traction = in_slab(side.in_plane(traction));
                    let parts = Parts {
                        traction,
                        relaxation: all - traction,
                        moment,
                    };
                    book.lay(grain.id, parts);
                }
            }
        }
        self.laid.powers[2] = relaxation;
        if let Some(book) = angular {
            let columns = self.cells.counts[0];
            for (cell, force) in self.laid.relaxation.iter().enumerate() {
                let at = [
                    self.cells.centre(cell % columns),
                    self.cells.height(cell / columns),
                ];
                let [at, on_cell] = [at, *force].map(|v| in_slab(side.in_plane(v)));
                pressed.add(1, &at, &on_cell);
            }
            book.answered_by(&pressed);
        }
        self.scratch = scratch;
    }

    /// The continuum has no spin: it takes the opposite of the couples that turned the grains of a cell as forces on the four
    /// cells around it, of its moment and of no sum. At the ends of the grid there is nothing to take them.
    pub(super) fn answer_couples(&mut self) {
        let [columns, rows] = self.cells.counts;
        let arm = 4.0 * self.cells.spacing;
        for (cell, given) in self.given.spin.iter().enumerate() {
            let (i, k) = (cell % columns, cell / columns);
            let is_inside = i > 0 && i + 1 < columns && k > self.cells.below && k + 1 < rows;
            if *given == 0.0 || !is_inside {
                continue;
            }
            let force = -given / arm;
            self.owed[cell + columns][0] += force;
            self.owed[cell - columns][0] -= force;
            self.owed[cell + 1][1] -= force;
            self.owed[cell - 1][1] += force;
        }
    }

    /// Averages of the grains to the continuum, and its copy of them, before its step.
    pub(super) fn take_up(
        &mut self,
        continuum: &mut Continuum,
        simulation: &mut Simulation,
    ) -> Result<(), OverlapError> {
        let dt = self.exchange_time();
        self.look(simulation);
        self.sum_up(-(-dt / self.spec.settings.stress_time).exp_m1());
        for (owed, given) in self.owed.iter_mut().zip(&self.given.relaxation) {
            for (owed, given) in owed.iter_mut().zip(given) {
                *owed -= given;
            }
        }
        self.answer_couples();
        self.watch_impulses();
        for axis in 0..2 {
            self.account.traction[axis] += self.given.traction[axis];
            self.account.impedance[axis] += self.given.impedance[axis];
        }
        self.given.clear();
        if !self.spec.settings.uncoupled {
            self.copy_the_grains(continuum, dt)?;
        }
        Ok(())
    }

    /// What the continuum does to the grains until the next exchange, after its step.
    pub(super) fn see_the_step(&mut self) {
        self.view.shear(&self.cells, self.exchange_time());
        self.agree();
        self.watch();
    }

    /// Sums of the grains over the cells, stresses taken into their averages with this weight.
    pub(super) fn sum_up(&mut self, weight: f64) {
        self.see_grains();
        self.sums
            .press(&self.cells, &self.sighting.snapshot, weight);
    }

    /// Masses, labels and velocities of the grains over the cells.
    pub(super) fn see_grains(&mut self) {
        let (labels, inner) = (&self.labels, self.spec.zones()[1]);
        self.sums
            .cover(&self.cells, &self.sighting.snapshot, inner, |g| {
                labels.of(g)
            });
    }

    /// Mass of a cell full of continuum (kg).
    pub(super) fn full(&self) -> f64 {
        self.spec.density() * self.cells.volume()
    }

    /// Puts together what acts on the continuum, of these units, for a time (s).
    pub(super) fn press_on_continuum(&mut self, units: &Units, dt: f64) {
        let (stress, force) = (
            1.0 / units.stress(),
            1.0 / (units.stress() * units.length * self.spec.slab),
        );
        let zones = self.spec.zones();
        let full = self.full();
        for cell in 0..self.cells.count() {
            let cover = &self.sums.cover[cell];
            let [xx, zz, xz] = self.sums.stress[cell];
            let xx = self.view.rest.of_continuum(cell, xx, zz);
            let part = cover.mass / full;
            let outside = &mut self.outside;
            outside.pressure[cell] = (-0.5 * (xx + zz) * stress).max(0.0);
            outside.stress[cell] = [0.5 * (xx - zz) * stress, xz * stress];
            outside.cover[cell] = joint::cover(part);
            outside.share[cell] = joint::share(part, cover.label(), zones);
            self.outside.force[cell] = self.owed[cell].map(|owed| owed / dt * force);
        }
    }

    /// Puts what another edge of the same continuum does to it, which sees it in a mirror, together with its own: a cell bears the
    /// grains of the edge that has more of them there.
    pub(super) fn press_with(&mut self, other: &Self) {
        let columns = self.cells.counts[0];
        for cell in 0..self.cells.count() {
            let turned = cell - cell % columns + columns - 1 - cell % columns;
            let (own, more) = (&mut self.outside, &other.outside);
            if other.sums.cover[turned].mass > self.sums.cover[cell].mass {
                own.pressure[cell] = more.pressure[turned];
                own.cover[cell] = more.cover[turned];
                own.share[cell] = more.share[turned];
                own.stress[cell] = Side::Above.stress(more.stress[turned]);
            }
            let force = Side::Above.in_plane(more.force[turned]);
            for (sum, force) in own.force[cell].iter_mut().zip(force) {
                *sum += force;
            }
        }
    }

    /// Books that the continuum has taken this part of what it owed.
    pub(super) fn answer(&mut self, part: f64) {
        for owed in &mut self.owed {
            for (axis, owed) in owed.iter_mut().enumerate() {
                let answer = *owed * part;
                *owed -= answer;
                self.account.answer[axis] += answer;
            }
        }
    }

    /// Looks at its continuum along its own axis.
    pub(super) fn look_at(&mut self, continuum: &Continuum) {
        let as_seen = continuum.spec.side.seen_along(self.spec.side);
        self.view.look(&continuum.collapse, &self.cells, as_seen);
    }

    /// Slips between both sides, with the same hats at the grains' own places.
    fn slips(&mut self) {
        let [handshake, inner] = self.spec.zones();
        for cover in &mut self.sums.cover {
            (cover.buffer, cover.buffer_slip) = (0.0, [0.0; 2]);
            (cover.turning, cover.spin) = (0.0, 0.0);
            (cover.inner, cover.inner_slip) = (0.0, [0.0; 2]);
        }
        for grain in &self.sighting.snapshot.grains {
            let Some(label) = self.labels.of(grain).filter(|label| *label < inner) else {
                continue;
            };
            let hats = self.cells.hats(grain.position.x, grain.position.z);
            let Some(u) = self.view.velocity_at(&hats) else {
                continue;
            };
            let slip = [u[0] - grain.velocity.x, u[1] - grain.velocity.z];
            for (cell, hat) in hats {
                let cover = &mut self.sums.cover[cell];
                let mass = grain.mass * hat;
                let (sum, slips) = match label < handshake {
                    true => (&mut cover.buffer, &mut cover.buffer_slip),
                    false => (&mut cover.inner, &mut cover.inner_slip),
                };
                *sum += mass;
                for (sum, slip) in slips.iter_mut().zip(slip) {
                    *sum += mass * slip;
                }
                if label < handshake {
                    let turning = inertia(grain) * hat;
                    cover.turning += turning;
                    cover.spin += turning * grain.spin.y;
                }
            }
        }
    }

    /// Takes the continuum's traction, forms the accelerations that bring mean velocities together, and mean spins to the rotation rate of the
    /// material, and finds the edge and the handshake surface.
    pub(super) fn agree(&mut self) {
        self.slips();
        let dt = self.exchange_time();
        let rate = towards(dt, self.spec.settings.relaxation_time);
        let turn = towards(dt, self.spec.settings.spin_time);
        let full = self.full();
        for cell in 0..self.cells.count() {
            let cover = &self.sums.cover[cell];
            let holds = self.view.is_full(cell) && cover.buffer > LEAST_BUFFER * full;
            self.held.accelerations[cell] = match holds {
                true => cover.buffer_slip.map(|slip| rate * slip / cover.buffer),
                false => [0.0; 2],
            };
            self.held.spins[cell] = match holds {
                true => {
                    turn * (self.view.rotation(&self.cells, cell) - over(cover.spin, cover.turning))
                }
                false => 0.0,
            };
        }
        self.find_edge();
        self.held.handshake = self.surface_of(self.spec.settings.buffer);
    }

    fn find_edge(&mut self) {
        let d = self.spec.case.rheology.diameter;
        let buffer = self.spec.settings.buffer;
        let snapshot = &self.sighting.snapshot;
        let near = snapshot
            .grains
            .iter()
            .filter(|g| self.labels.of(g).is_some_and(|label| label < buffer));
        self.held.reach = near.fold(self.spec.wall, |most: f64, g| most.max(g.position.x)) + d;
        let places = self.surface_of(0.5 * self.spec.settings.shell);
        let slopes = slopes(&places, &self.cells);
        let (h, slab) = (self.cells.spacing, self.spec.slab);
        for (k, row) in self.held.rows.iter_mut().enumerate() {
            let place = places[k] - 0.5 * self.spec.settings.shell;
            *row = Row {
                place,
                ..Row::default()
            };
            let Some((fraction, [xx, zz, xz], velocity)) = self.view.across(&self.cells, place, k)
            else {
                continue;
            };
            let slope = slopes[k].clamp(-STEEPEST, STEEPEST);
            let area = [-h * slab * fraction, h * slab * fraction * slope];
            row.area = area;
            row.velocity = velocity;
            row.traction = [xx * area[0] + xz * area[1], xz * area[0] + zz * area[1]];
        }
    }

    /// Where the surface of a label is, row by row (m): [`Labels::surface`](super::labels::Labels::surface).
    pub(super) fn surface_of(&self, label: f64) -> Vec<f64> {
        let grains = &self.sighting.snapshot.grains;
        self.labels.surface(&self.cells, grains, label, &self.spec)
    }
}
