//! The debris of a cliff as a continuum: from the grains it was to its rest.
//!
//! The ground is what is left of the cliff, cut along its crack, the wall below it and what lies before it: a plane or land.

use crate::failure::Failure;
use crate::run::land::Land;
use crate::run::steady_layer::failure;
use crate::run::surface_fields::SurfaceFields;
use crate::scene::CliffScene;
use crate::vtkhdf::{Cells, Frame};
use colluvium_continuum::column_collapse::{Collapse, CollapseCase, CollapseGround, Matter};
use colluvium_continuum::free_surface::{CellFields, History, SurfaceOptions, SurfaceState};
use colluvium_continuum::rheology::{AnyLaw, MuI};
use colluvium_continuum::terrain::Profile;
use colluvium_coupling::debris_ground::{DebrisGround, SurfaceLine};
use colluvium_coupling::handover::{Debris, Handed, Room};
use colluvium_dem::Grain;

/// Least width of a step in the ground over the cliff's height: ground has one height at each place.
const UPRIGHT: f64 = 1e-3;

/// Debris on the move.
pub struct Runout {
    collapse: Collapse<AnyLaw>,
    /// The law in it (SI).
    law: MuI,
    /// The ground in the coordinates of the grains.
    ground: Profile,
    /// The grid's x = 0 in the coordinates of the grains (m).
    low: f64,
    /// Time of the grains when it began (s).
    pub begun: f64,
    /// Width of the slab (m).
    width: f64,
    /// Time between two exchanges with grains beside it (s); 0 where it is alone.
    interval: f64,
    /// How grains were handed over, and when (s), instalment by instalment.
    pub instalments: Vec<(f64, Handed)>,
    /// Steps, Newton iterations, cut steps, cell-steps.
    pub steps: [u64; 4],
}

/// Numbers in front of the instalments: the law's diameter, density and solid fraction, the width, the time of the first, the time
/// between exchanges, and four counts of steps.
const HEAD: usize = 10;
/// Numbers of an instalment.
const ROW: usize = 14;
/// Longest step beside grains over the time between exchanges: one step goes from one to the next whatever its last bits.
const WHOLE: f64 = 1.01;

impl Runout {
    /// Ground and grid, with nothing on it yet, in a slab of a width (m), with so much time between exchanges (s; 0: alone).
    fn bare(
        scene: &CliffScene,
        origin: &str,
        law: MuI,
        [width, interval]: [f64; 2],
    ) -> Result<Self, Failure> {
        let d = law.diameter;
        let axis = scene.heap_axis(d);
        let (low, height) = (axis.start, scene.shape.height);
        let length = axis.spacing * axis.columns as f64;
        let land = scene.land(origin)?;
        let own = scene.left_standing(low + length, land.as_ref())?;
        let shifted = own.points().iter().map(|[x, z]| [x - low, *z]);
        let ground = CollapseGround {
            profile: Profile::new(shifted.collect()).map_err(failure)?,
            contact: scene.runout.contact(),
        };
        let case = CollapseCase {
            aspect: 1.0,
            height,
            gravity: scene.gravity,
            rheology: law.into(),
            cells: (length / (scene.runout.cell_diameters * d)).round() as usize,
            length_scaled: length / height,
            overhang_degrees: 0.0,
        };
        // Velocities that are changed from outside have no second order.
        let options = if interval > 0.0 {
            SurfaceOptions {
                largest_step: WHOLE * interval / case.units().time(),
                ..SurfaceOptions::default().of_first_order()
            }
        } else {
            SurfaceOptions::default()
        };
        let collapse = Collapse::bare(&case, &options, &ground, height).map_err(failure)?;
        Ok(Self {
            collapse,
            law,
            ground: own,
            low,
            begun: 0.0,
            width,
            interval,
            instalments: Vec::new(),
            steps: [0; 4],
        })
    }

    /// Whether ground, grid and law fit together.
    pub fn check(scene: &CliffScene, origin: &str, law: MuI) -> Result<(), Failure> {
        Self::bare(scene, origin, law, [1.0, 0.0]).map(drop)
    }

    /// Of grains, in a slab of a width (m), at a time (s), with so much time between exchanges (s; 0: alone).
    pub fn begin(
        scene: &CliffScene,
        origin: &str,
        law: MuI,
        [width, interval]: [f64; 2],
        grains: &[Grain],
        time: f64,
    ) -> Result<Self, Failure> {
        let mut runout = Self::bare(scene, origin, law, [width, interval])?;
        let reach = scene.runout.reach_diameters * law.diameter;
        let (matter, handed) = runout
            .debris(grains, reach)
            .hand_over(&runout.room())
            .map_err(|why| Failure::Run(why.to_string()))?;
        runout.collapse.fill(matter).map_err(failure)?;
        runout.instalments.push((time, handed));
        runout.begun = time;
        Ok(runout)
    }

    fn debris<'a>(&self, grains: &'a [Grain], reach: f64) -> Debris<'a> {
        let law = self.law;
        Debris {
            grains,
            solid_fraction: law.solid_fraction,
            grain_density: law.grain_density,
            width: self.width,
            reach,
        }
    }

    /// Takes the next instalment at a time (s).
    pub fn join(&mut self, scene: &CliffScene, grains: &[Grain], time: f64) -> Result<(), Failure> {
        let reach = scene.runout.reach_diameters * self.law.diameter;
        let state = self.collapse.flow().state();
        let unit = self.collapse.units().velocity;
        let present = Matter {
            fractions: state.fractions.clone(),
            velocity: [0, 1].map(|c| state.velocity[c].iter().map(|u| u * unit).collect()),
        };
        let (matter, handed) = self
            .debris(grains, reach)
            .join(&self.room(), &present)
            .map_err(|why| Failure::Run(why.to_string()))?;
        self.collapse.fill(matter).map_err(failure)?;
        self.instalments.push((time, handed));
        Ok(())
    }

    /// Goes on without grains beside it.
    pub fn alone(&self, scene: &CliffScene, origin: &str) -> Result<Self, Failure> {
        let law = self.law;
        let mut runout = Self::bare(scene, origin, law, [self.width, 0.0])?;
        let state = SurfaceState {
            history: History::default(),
            ..self.collapse.flow().state().clone()
        };
        runout.collapse.set_state(state).map_err(failure)?;
        runout.begun = self.begun;
        runout.instalments.clone_from(&self.instalments);
        runout.steps = self.steps;
        Ok(runout)
    }

    /// Its surface, that rises from one before in so much time (s); at rest without one.
    pub fn surface(&self, before: Option<(&SurfaceLine, f64)>) -> SurfaceLine {
        SurfaceLine::of(&self.collapse, self.low, before)
    }

    /// Does something with cells, the part of each that is filled, and the mass of a whole one (kg).
    pub fn with_cells<T>(&self, act: impl FnOnce((&Room<'_>, &[f64], f64)) -> T) -> T {
        let fractions = &self.collapse.flow().state().fractions;
        act((&self.room(), fractions.as_slice(), self.cell_mass()))
    }

    /// Takes what grains have pushed since the last exchange.
    pub fn take(&mut self, ground: &mut DebrisGround) -> Result<(), Failure> {
        let mut state = self.collapse.flow().state().clone();
        let unit = self.collapse.units().velocity;
        let SurfaceState {
            fractions,
            velocity: [u, w],
            ..
        } = &mut state;
        for u in u.iter_mut().chain(w.iter_mut()) {
            *u *= unit;
        }
        ground.deliver((&self.room(), fractions, self.cell_mass()), [u, w]);
        for u in u.iter_mut().chain(w.iter_mut()) {
            *u /= unit;
        }
        self.collapse.set_state(state).map_err(failure)
    }

    /// Mass of a whole cell (kg).
    fn cell_mass(&self) -> f64 {
        let law = self.law;
        law.grain_density * law.solid_fraction * self.collapse.spacing().powi(2) * self.width
    }

    /// Edge of a cell (m).
    pub fn spacing(&self) -> f64 {
        self.collapse.spacing()
    }

    /// Volume that was handed over (m³).
    fn volume(&self) -> f64 {
        self.instalments.iter().map(|(_, h)| h.volume[1]).sum()
    }

    fn room(&self) -> Room<'_> {
        Room::of(&self.collapse, self.low, &self.ground)
    }

    /// Goes on to a time of the grains (s).
    pub fn go_on(&mut self, time: f64) -> Result<(), Failure> {
        let until = time - self.begun;
        while self.collapse.time() < until * (1.0 - 1e-12) {
            let step = self.collapse.step(until).map_err(failure)?;
            for (sum, more) in self.steps.iter_mut().zip([
                1,
                step.newton_iterations as u64,
                step.cuts as u64,
                step.active_cells as u64,
            ]) {
                *sum += more;
            }
        }
        Ok(())
    }

    /// Matter as parcels: place along x (m) and the volume of grains in it (m³).
    pub fn parcels(&self) -> Vec<[f64; 2]> {
        let (x, h) = self.collapse.profile();
        let base = self.collapse.spacing() * self.width * self.law.solid_fraction;
        x.iter()
            .zip(h)
            .map(|(x, h)| [x + self.low, h * base])
            .collect()
    }

    /// Mean diameter of the grains that it was (m).
    pub fn diameter(&self) -> f64 {
        self.law.diameter
    }

    /// Mass (kg).
    pub fn mass(&self) -> f64 {
        let law = self.law;
        law.grain_density * law.solid_fraction * self.volume()
    }

    /// Kinetic energy (J).
    pub fn kinetic(&self) -> f64 {
        let state = self.collapse.flow().state();
        let cell_mass = self.cell_mass();
        let [u, w] = &state.velocity;
        let speed = self.collapse.units().velocity;
        speed * speed * self.room().kinetic(&state.fractions, [u, w], cell_mass)
    }

    /// Volume gained since the hand-over, relative.
    pub fn volume_drift(&self) -> f64 {
        let state = self.collapse.flow().state();
        let area = state.fractions.iter().sum::<f64>() * self.collapse.spacing().powi(2);
        area * self.width / self.volume() - 1.0
    }

    /// Cells of the grid.
    pub fn cells(&self) -> u64 {
        self.collapse.flow().state().fractions.len() as u64
    }

    /// Cells with matter as quadrilaterals in the plane y = 0, in the coordinates of the grains, at a time (s).
    pub fn frame(&self, time: f64) -> Frame {
        let mut cells = self.collapse.fields();
        for cell in &mut cells {
            cell.lower[0] += self.low;
            cell.upper[0] += self.low;
        }
        let law = self.law;
        frame(&cells, law.diameter * law.grain_density.sqrt(), time)
    }

    /// Appends all that it goes on from.
    pub fn write(&self, memory: &mut Vec<f64>) {
        let law = self.law;
        let state = self.collapse.flow().state();
        memory.extend([
            law.diameter,
            law.grain_density,
            law.solid_fraction,
            self.width,
            self.begun,
            self.interval,
        ]);
        memory.extend(self.steps.map(|n| n as f64));
        memory.push(self.instalments.len() as f64);
        for (time, h) in &self.instalments {
            memory.extend([*time, h.grains as f64, h.mass]);
            memory.extend(h.volume);
            memory.extend(h.momentum.as_flattened());
            memory.extend(h.kinetic);
            memory.extend(h.moved);
        }
        let rows: [&[f64]; 10] = [
            &state.fractions,
            &state.velocity[0],
            &state.velocity[1],
            &state.pressure,
            state.stress.as_flattened(),
            &state.history.lead[0],
            &state.history.lead[1],
            &state.history.pressure,
            state.history.friction_change.as_flattened(),
            &[
                state.time,
                state.velocity_time,
                state.next_step,
                state.steps as f64,
                state.history.push,
            ],
        ];
        for row in rows {
            memory.push(row.len() as f64);
            memory.extend(row);
        }
    }

    /// Reads it back; none if the numbers are not those of such a scene.
    pub fn read(scene: &CliffScene, origin: &str, memory: &[f64]) -> Option<Self> {
        let (head, rest) = memory.split_first_chunk::<HEAD>()?;
        let (count, rest) = rest.split_first()?;
        let (rows, mut rest) = rest.split_at_checked(ROW * *count as usize)?;
        let mut take = || {
            let (length, after) = rest.split_first()?;
            let (row, after) = after.split_at_checked(*length as usize)?;
            rest = after;
            Some(row.to_vec())
        };
        let (fractions, u, w, pressure, stress) = (take()?, take()?, take()?, take()?, take()?);
        let (lead, threshold, changes, times) = ([take()?, take()?], take()?, take()?, take()?);
        let &[time, velocity_time, next_step, steps, push] = times.as_slice() else {
            return None;
        };
        let [diameter, grain_density, solid, width, begun, interval, ..] = *head;
        let law = scene.runout.law(diameter, grain_density, solid);
        let mut runout = Self::bare(scene, origin, law, [width, interval]).ok()?;
        for h in rows.as_chunks::<ROW>().0 {
            let handed = Handed {
                grains: h[1] as usize,
                mass: h[2],
                volume: [h[3], h[4]],
                momentum: [[h[5], h[6]], [h[7], h[8]]],
                kinetic: [h[9], h[10], h[11]],
                moved: [h[12], h[13]],
            };
            runout.instalments.push((h[0], handed));
        }
        runout
            .collapse
            .set_state(SurfaceState {
                fractions,
                velocity: [u, w],
                pressure,
                stress: stress.as_chunks::<2>().0.to_vec(),
                history: History {
                    lead,
                    pressure: threshold,
                    friction_change: changes.as_chunks::<2>().0.to_vec(),
                    push,
                },
                time,
                velocity_time,
                next_step,
                steps: steps as usize,
                ..SurfaceState::default()
            })
            .ok()?;
        runout.begun = begun;
        runout.steps = std::array::from_fn(|k| head[6 + k] as u64);
        Some(runout)
    }
}

/// Cells as quadrilaterals in the plane y = 0 at a time (s); `inertia` is d √ρ_s.
fn frame(cells: &[CellFields], inertia: f64, time: f64) -> Frame {
    let fields = SurfaceFields {
        cells,
        inertia,
        others: 0,
    };
    Frame {
        time,
        cells: Cells::Quadrilaterals,
        points: fields.quadrilaterals().collect(),
        fields: fields.of_plane(),
    }
}

/// A continuum that has not begun: no cells.
pub fn nothing_yet(time: f64) -> Frame {
    frame(&[], 1.0, time)
}

impl CliffScene {
    /// The ground of the run-out, from the back of the cliff to an end (m): what stands behind the crack, the wall below
    /// it, and the plane or the land before it.
    fn left_standing(&self, end: f64, land: Option<&Land>) -> Result<Profile, Failure> {
        let least = UPRIGHT * self.shape.height;
        let mut points = vec![
            [self.back() - least, self.shape.height],
            [-self.crack_head().max(least), self.shape.height],
            [0.0, self.shape.wall],
        ];
        match land {
            None => {
                if self.shape.wall > 0.0 {
                    points.push([least, 0.0]);
                }
                points.push([end + least, 0.0]);
            }
            Some(land) => {
                if self.shape.wall > 0.0 {
                    points.push([least, Land::height(Some(land), least)]);
                }
                let mut last = least;
                for [x, z] in land.line().points().iter().filter(|p| p[0] > least) {
                    last = x.max(last + least);
                    points.push([last, *z]);
                }
            }
        }
        Profile::new(points).map_err(failure)
    }
}
