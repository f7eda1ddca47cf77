//! The steps: grains under what is held, and the exchange that follows so many of them.

use super::embedded::Embedded;
use super::rows::{Row, bearers, slopes};
use super::side::in_slab;
use super::{Continuum, MaterialEdge, OverlapError, Side};
use crate::overlap::angular::{AngularBook, Counterpart, Parts};
use crate::overlap::cell_joint::Shell;
use crate::overlap::joint::{self, along_axes, inertia};
use crate::overlap::slips::{Met, compare};
use colluvium_continuum::units::Units;
use colluvium_dem::{GrainSample, Load, Simulation};
use nalgebra::{Vector1, Vector2, Vector3};

/// Rows with less than this of a full row of shell hand on what presses on them: a force on few grains throws them out.
pub(super) const LEAST_ROW: f64 = 0.3;
/// Steepest slope of the edge that its area vector follows.
pub(super) const STEEPEST: f64 = 2.0;

/// Room for what is formed and forgotten in a step.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    near: Vec<(GrainSample, f64, Embedded)>,
    pub(super) shell: Vec<Shell<2>>,
    bearers: Vec<usize>,
}

impl MaterialEdge {
    /// Books the impulses of what was laid over the steps made since.
    pub(super) fn book_grains(&mut self, simulation: &Simulation) {
        self.account.relaxation += self.joint.book(simulation);
    }

    /// Forms the loads of the next steps, along x, in the order of the grains' numbers, noting what they consist of.
    pub(super) fn lay(
        &mut self,
        simulation: &Simulation,
        loads: &mut Vec<Load>,
        mut angular: Option<&mut AngularBook>,
    ) {
        self.joint.lay_anew(simulation);
        if self.spec.settings.uncoupled {
            return;
        }
        let side = self.spec.side;
        let in_space = |v: Vector2<f64>| side.turned(in_slab(v));
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
        let weight = |grain: &GrainSample, label: f64, embedded: &Embedded| {
            (1.0 - embedded.weight) * grain.mass * ((shell - label) / shell).clamp(0.0, 1.0)
        };
        scratch.shell.clear();
        scratch.shell.resize(self.held.rows.len(), Shell::NONE);
        for (grain, label, embedded) in &scratch.near {
            let q = weight(grain, *label, embedded);
            if q <= 0.0 {
                continue;
            }
            let hats = self.cells.hats(grain.position.x, grain.position.z);
            let beside = self.view.velocity_at(&hats);
            for (row, hat) in self.cells.rows(grain.position.z) {
                let u = beside.unwrap_or(self.held.rows[row].velocity);
                scratch.shell[row].add(q * hat, along_axes(&grain.velocity), u);
            }
        }
        let full = 0.5 * self.spec.density() * shell * self.cells.spacing * self.spec.slab;
        let least = LEAST_ROW * full;
        bearers(&scratch.shell, least, &mut scratch.bearers);
        let mut pressed = Counterpart::default();
        for (k, row) in self.held.rows.iter().enumerate() {
            let bearer = scratch.bearers[k];
            if bearer == usize::MAX {
                continue;
            }
            let load = &mut scratch.shell[bearer];
            let impedance = row.impedance(self.spec.settings.impedance, load.slip());
            let at = Vector2::new(row.place, self.cells.height(k));
            let [at, on_face] = [at, row.traction + impedance].map(in_space);
            pressed.add(0, &at, &on_face);
            let velocity = load.velocity();
            load.force += row.traction + impedance;
            let laid = &mut self.joint.laid;
            laid.traction += row.traction;
            laid.impedance += impedance;
            for (axis, velocity) in velocity.iter().enumerate() {
                laid.powers[0] += row.traction[axis] * velocity;
                laid.powers[1] += impedance[axis] * velocity;
            }
        }
        let gravity = side.turned(simulation.gravity());
        let stopping = self.embedded_time();
        let mut relaxation = 0.0;
        for (grain, label, embedded) in &scratch.near {
            let q = weight(grain, *label, embedded);
            let mut force = Vector2::zeros();
            if q > 0.0 {
                for (row, hat) in self.cells.rows(grain.position.z) {
                    let shell = &scratch.shell[row];
                    if shell.weight > least {
                        force += q * hat / shell.weight * shell.force;
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
                let turn = hat * turned * self.joint.spins[cell][0];
                self.joint.laid.spin[cell][0] += turn;
                moment += turn;
                let relaxed = relaxed * self.joint.accelerations[cell];
                let pull = hat * (relaxed + along_axes(&carried));
                self.joint.laid.relaxation[cell] += pull;
                force += pull;
                relaxation += pull[0] * grain.velocity.x;
                relaxation += pull[1] * grain.velocity.z;
            }
            relaxation += moment * grain.spin.y;
            if force != Vector2::zeros() || carried.y != 0.0 || moment != 0.0 {
                let moment = side.turned_about(Vector3::y() * moment);
                let all = side.turned([force[0], carried.y, force[1]].into());
                loads.push(Load {
                    grain: grain.id,
                    force: all,
                    moment,
                });
                if let Some(book) = &mut angular {
                    let traction = in_space(traction);
                    let parts = Parts {
                        traction,
                        relaxation: all - traction,
                        moment,
                    };
                    book.lay(grain.id, parts);
                }
            }
        }
        self.joint.laid.powers[2] = relaxation;
        if let Some(book) = angular {
            let columns = self.cells.counts[0];
            for (cell, force) in self.joint.laid.relaxation.iter().enumerate() {
                let (i, k) = (cell % columns, cell / columns);
                let at = Vector2::new(self.cells.centre(i), self.cells.height(k));
                let [at, on_cell] = [at, *force].map(in_space);
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
        for (cell, given) in self.joint.given.spin.iter().enumerate() {
            let (i, k) = (cell % columns, cell / columns);
            let is_inside = i > 0 && i + 1 < columns && k > self.cells.below && k + 1 < rows;
            if given[0] == 0.0 || !is_inside {
                continue;
            }
            let force = -given[0] / arm;
            self.joint.owed[cell + columns][0] += force;
            self.joint.owed[cell - columns][0] -= force;
            self.joint.owed[cell + 1][1] -= force;
            self.joint.owed[cell - 1][1] += force;
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
        self.joint.owe();
        self.answer_couples();
        self.watch_impulses();
        self.account.traction += self.joint.given.traction;
        self.account.impedance += self.joint.given.impedance;
        self.joint.given.clear();
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
            self.outside.force[cell] = self.joint.owed[cell].map(|owed| owed / dt * force).into();
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

    /// Looks at its continuum along its own axis.
    pub(super) fn look_at(&mut self, continuum: &Continuum) {
        let as_seen = continuum.spec.side.seen_along(self.spec.side);
        self.view.look(&continuum.collapse, &self.cells, as_seen);
    }

    /// Grains with their labels (m).
    pub(super) fn labelled(&self) -> impl Iterator<Item = (&GrainSample, f64)> {
        let grains = self.sighting.snapshot.grains.iter();
        grains.filter_map(|grain| Some((grain, self.labels.of(grain)?)))
    }

    /// Those of the overlap that lie in the continuum.
    pub(super) fn met(&self) -> impl Iterator<Item = Met<'_, 2, 4>> {
        let [handshake, inner] = self.spec.zones();
        let overlap = self.labelled().filter(move |(_, label)| *label < inner);
        overlap.filter_map(move |(grain, label)| {
            let hats = self.cells.hats(grain.position.x, grain.position.z);
            Some(Met {
                grain,
                is_buffer: label < handshake,
                hats,
                velocity: self.view.velocity_at(&hats)?,
            })
        })
    }

    /// Takes the continuum's traction, forms the accelerations that bring mean velocities together, and mean spins to the rotation rate of the
    /// material, and finds the edge and the handshake surface.
    pub(super) fn agree(&mut self) {
        let mut slips = std::mem::take(&mut self.joint.slips);
        compare(self.met(), &mut slips);
        self.joint.slips = slips;
        let (full, view) = (self.full(), &self.view);
        self.joint.relax(
            &self.spec.settings,
            full,
            |cell| view.is_full(cell),
            |cell| Vector1::new(view.rotation(&self.cells, cell)),
        );
        self.find_edge();
        self.held.handshake = self.surface_of(self.spec.settings.buffer);
    }

    fn find_edge(&mut self) {
        let d = self.spec.case.rheology.diameter;
        let buffer = self.spec.settings.buffer;
        let near = self.labelled().filter(|(_, label)| *label < buffer);
        let farthest = near.fold(self.spec.wall, |most: f64, (g, _)| most.max(g.position.x));
        self.held.reach = farthest + d;
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
            let area = Vector2::new(-h * slab * fraction, h * slab * fraction * slope);
            (row.area, row.velocity) = (area, velocity);
            row.traction = Vector2::new(xx * area[0] + xz * area[1], xz * area[0] + zz * area[1]);
        }
    }

    /// Where the surface of a label is, row by row (m): [`Labels::surface`](super::labels::Labels::surface).
    pub(super) fn surface_of(&self, label: f64) -> Vec<f64> {
        let grains = &self.sighting.snapshot.grains;
        self.labels.surface(&self.cells, grains, label, &self.spec)
    }
}
