//! How a flow with a moving surface is set up: material at rest on its grid, over ground, between side walls,
//! with open ends.

use super::{INACTIVE, SpaceFlow, Spent, SurfaceFlow, SurfaceOptions, SurfaceState};
use crate::discretisation::COMPONENTS;
use crate::error::{Error, require};
use crate::free_surface::ground::shores::Shores;
use crate::free_surface::ground::{Ground, Terrain};
use crate::free_surface::open_ends::{Inflow, OpenEnds, can_open};
use crate::free_surface::operators::{POINTS, points_of};
use crate::free_surface::sliding::SlidingPlaces;
use crate::free_surface::standing;
use crate::free_surface::topology::{NONE, Topology};
use crate::free_surface::transport::Transport;
use crate::grid::{Boundary, DIMENSIONS, Grid};
use crate::rheology::Rheology;
use crate::terrain::Relief;
use crate::wall_friction::SideWalls;
use crate::yield_step::FlowState;
use std::ops::Range;

/// Cells over ground that miss less of being full count as full.
const FULL_TO: f64 = 1e-11;
/// Round-off of fractions that somebody cut out of cells.
const ROUND_OFF: f64 = 1e-9;

/// Refuses fractions of another number of cells, or out of range.
pub(super) fn check_fractions(
    fractions: &[f64],
    cells: usize,
    [least, most]: [f64; 2],
) -> Result<(), Error> {
    if fractions.len() != cells {
        return Err(Error::ForeignState {
            found: fractions.len(),
            expected: cells,
        });
    }
    let allowed = format!("finite and {least} to {most}: the filled part of a cell");
    for fraction in fractions {
        let holds = (least..=most).contains(fraction);
        require(holds, "state.fractions", *fraction, allowed.as_str())?;
    }
    Ok(())
}

impl<R: Rheology> SurfaceFlow<R> {
    /// Material at rest that fills the given fraction of each cell of a plane grid, x fastest. What stands on the
    /// floor begins under its own weight: with friction above one a free face both stands and falls, as two solutions of
    /// the same equations, and without pressure to begin with it would fall.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn at_rest(
        grid: Grid,
        fractions: Vec<f64>,
        rheology: R,
        acceleration: [f64; DIMENSIONS],
        options: SurfaceOptions,
    ) -> Result<Self, Error> {
        Self::on_floor(grid, fractions, rheology, acceleration, options)
    }

    /// The same flow between side walls at a distance along y, in natural units: they rub on what
    /// moves with 2 c/W + (2 μ/W) p per volume.
    ///
    /// # Errors
    /// Walls out of range.
    pub fn between_side_walls(mut self, walls: SideWalls) -> Result<Self, Error> {
        walls.validate()?;
        self.side_walls = Some(walls);
        let points = 2 * self.topology.cells() * POINTS;
        let points = points.max(self.state.stress.len());
        self.state.stress.resize(points, [0.0; COMPONENTS]);
        self.saved.clone_from(&self.state);
        Ok(self)
    }
}

impl<R: Rheology> SpaceFlow<R> {
    /// Material at rest that fills the given fraction of each cell of a grid in space, x fastest and z
    /// slowest. What stands on the floor begins under its own weight.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn in_space(
        grid: Grid<3>,
        fractions: Vec<f64>,
        rheology: R,
        acceleration: [f64; 3],
        options: SurfaceOptions,
    ) -> Result<Self, Error> {
        Self::on_floor(grid, fractions, rheology, acceleration, options)
    }
}

impl<R: Rheology, const D: usize, const C: usize, const V: usize> SurfaceFlow<R, D, C, V> {
    /// The same flow with open ends along x: this flows in at the low one, and what comes to the high one flows
    /// out. Both stand for smooth walls of the grid, over a floor that does not cut its cells.
    ///
    /// # Errors
    /// An inflow that does not fit the grid, ends that are not smooth walls, or ground.
    pub fn with_open_ends(self, inflow: Inflow) -> Result<Self, Error> {
        let faces = self.grid.faces(0).iter().skip(1).product();
        inflow.validate(faces)?;
        self.opened(Some(inflow), &[0, 1])
    }

    /// The same flow, open at the high end of x only: what comes there flows out.
    ///
    /// # Errors
    /// An end that is not a smooth wall, or ground.
    pub fn with_open_outflow(self) -> Result<Self, Error> {
        self.opened(None, &[1])
    }

    fn opened(mut self, inflow: Option<Inflow>, sides: &[usize]) -> Result<Self, Error> {
        let axis = &self.grid.axes()[0];
        let can_open = |&side: &usize| can_open(axis.boundary_at(side * axis.cells()).as_ref());
        require(
            self.is_closed() && sides.iter().all(can_open),
            if inflow.is_some() {
                "inflow"
            } else {
                "outflow"
            },
            axis.spacing() * axis.cells() as f64,
            "a grid of this length with smooth walls at the ends of x to be opened and a level floor",
        )?;
        let ends = OpenEnds {
            inflow,
            columns: axis.cells(),
        };
        ends.impose(&mut self.state.velocity[0]);
        self.saved.clone_from(&self.state);
        self.ends = Some(ends);
        Ok(self)
    }

    /// Material at rest over ground, in natural units. Fractions are of whole cells, and at most what the
    /// ground leaves free of each. Ground that nowhere reaches into the grid, with what holds on the grid's floor, is
    /// that floor.
    ///
    /// # Errors
    /// Settings out of range, ground that does not span the grid, or walls of the grid that are not at rest or against
    /// which material slides with friction: over ground they are rough or smooth.
    pub fn over_ground<S: Relief<D>>(
        grid: Grid<D>,
        terrain: &Terrain<S, D>,
        fractions: Vec<f64>,
        rheology: R,
        acceleration: [f64; D],
        options: SurfaceOptions,
    ) -> Result<Self, Error> {
        let floor = grid.axes()[D - 1].boundary_at(0);
        let topology = Topology::rising(&grid, terrain.rise);
        let ground = Ground::new(&grid, &topology, terrain)?;
        if ground.lies_below() && floor == Some(terrain.contact.on_wall()) {
            return Self::on_floor(grid, fractions, rheology, acceleration, options);
        }
        for axis in grid.axes() {
            for face in [0, axis.cells()] {
                let is_plain = matches!(
                    axis.boundary_at(face),
                    None | Some(Boundary::FreeSlip | Boundary::NoSlip { velocity: 0.0 })
                );
                require(
                    is_plain,
                    "grid.boundary",
                    face as f64,
                    "smooth walls or rough ones at rest over ground",
                )?;
            }
        }
        let mut flow = Self::filling(grid, fractions, rheology, acceleration, options)?;
        let full = flow.state.fractions.iter_mut().zip(&ground.free);
        for (fraction, free) in full {
            *fraction = fraction.min(*free);
            // Full but for the round-off of the two ways to the same number.
            if free - *fraction < FULL_TO {
                *fraction = *free;
            }
        }
        let cells = topology.cells();
        let places = flow.sliding.of_layer(cells, 0, cells);
        flow.state.stress.resize(places, [0.0; C]);
        flow.topology = topology;
        // What lies on ground reaches the lower edge of the grid nowhere: nothing is asked whether it hangs.
        flow.set_weight_for_pressure();
        flow.stand_upright(Some(&ground));
        flow.saved.clone_from(&flow.state);
        flow.bed = Some(ground);
        Ok(flow)
    }

    fn on_floor(
        grid: Grid<D>,
        fractions: Vec<f64>,
        rheology: R,
        acceleration: [f64; D],
        options: SurfaceOptions,
    ) -> Result<Self, Error> {
        let mut flow = Self::filling(grid, fractions, rheology, acceleration, options)?;
        flow.set_weight_for_pressure();
        flow.take_weight_from_what_hangs();
        flow.stand_upright(None);
        flow.saved.clone_from(&flow.state);
        Ok(flow)
    }

    fn filling(
        grid: Grid<D>,
        fractions: Vec<f64>,
        rheology: R,
        acceleration: [f64; D],
        options: SurfaceOptions,
    ) -> Result<Self, Error> {
        options.validate()?;
        for axis in grid.axes() {
            for face in [0, axis.cells()] {
                match axis.boundary_at(face) {
                    Some(Boundary::CoulombWall { friction, .. }) => friction.validate()?,
                    wall => require(
                        wall.is_none_or(|wall| wall.outer_pressure().is_none()),
                        "grid.boundary",
                        face as f64,
                        "walls that stay where they are: the surface moves within the grid",
                    )?,
                }
            }
        }
        let topology = Topology::new(&grid);
        check_fractions(&fractions, topology.cells(), [-ROUND_OFF, 1.0 + ROUND_OFF])?;
        let sliding = SlidingPlaces::new(&grid);
        let state = SurfaceState {
            velocity: std::array::from_fn(|c| vec![0.0; topology.faces(c)]),
            pressure: vec![INACTIVE; topology.cells()],
            stress: vec![[0.0; C]; sliding.end],
            fractions,
            ..SurfaceState::default()
        };
        Ok(Self {
            saved: state.clone(),
            state,
            planes: Vec::new(),
            shores: Shores::default(),
            transport: Transport::default(),
            carrier: std::array::from_fn(|_| Vec::new()),
            own_leads: Vec::new(),
            side_walls: None,
            sliding,
            bed: None,
            ends: None,
            outside: None,
            untaken: [0.0; D],
            filled: Vec::new(),
            solver: None,
            unknowns: FlowState {
                u: Vec::new(),
                p: Vec::new(),
                s: Vec::new(),
            },
            momentum: Vec::new(),
            divergence: Vec::new(),
            spent: Spent::default(),
            grid,
            topology,
            rheology,
            acceleration,
            options,
        })
    }

    /// Starts with the pressure of the weight of what lies above, which is exact under level surfaces.
    fn set_weight_for_pressure(&mut self) {
        let axis = D - 1;
        let per_cell = -self.acceleration[axis] * self.grid.axes()[axis].spacing();
        if per_cell <= 0.0 {
            return;
        }
        let fractions = &self.state.fractions;
        for cell in (0..self.topology.cells()).rev() {
            let above = self.topology.cell_neighbours[cell][axis][1];
            if fractions[cell] > 0.0 {
                let load = match above {
                    NONE => 0.0,
                    above if fractions[above] > 0.0 => {
                        self.state.pressure[above] + 0.5 * per_cell * fractions[above].max(0.0)
                    }
                    _ => 0.0,
                };
                self.state.pressure[cell] = load + 0.5 * per_cell * fractions[cell];
            }
        }
    }

    /// Where friction lets columns bear their weight with nothing on their upright faces, they begin so ([`standing`]).
    /// Where walls or other
    /// matter lean on them the first step finds what holds there.
    fn stand_upright(&mut self, ground: Option<&Ground<D>>) {
        let fractions = &self.state.fractions;
        let free = standing::free_axes(&self.grid, &self.topology, fractions, ground);
        if free == [false; D] {
            return;
        }
        let floor = self.options.solver.strain_rate_floor;
        let (share, stress) = standing::stress::<D, C>(free);
        let points = points_of(D);
        for (cell, weight) in self.state.pressure.iter_mut().enumerate() {
            let p = share * *weight;
            let bears = || self.rheology.threshold(floor, p).stress > standing::friction(free) * p;
            if p > 0.0 && bears() {
                *weight = p;
                self.state.stress[cell * points..][..points].fill(stress.map(|s| s * p));
            }
        }
    }

    /// Whether it is closed all around, over a level floor.
    pub(in crate::free_surface) fn is_closed(&self) -> bool {
        self.bed.is_none() && self.ends.is_none() && self.topology.outlet.is_empty()
    }

    /// Opens the floor under these columns.
    pub(in crate::free_surface) fn open_floor(&mut self, columns: Range<usize>) {
        self.topology.outlet = columns;
        self.take_weight_from_what_hangs();
        let points = points_of(D);
        for (cell, pressure) in self.state.pressure.iter().enumerate() {
            if *pressure < 0.0 {
                self.state.stress[cell * points..][..points].fill([0.0; C]);
            }
        }
        self.saved.clone_from(&self.state);
    }

    /// Takes the pressure from cells that do not stand on others down to the floor.
    fn take_weight_from_what_hangs(&mut self) {
        let axis = D - 1;
        let mut stands = vec![false; self.topology.cells()];
        for cell in 0..stands.len() {
            let below = self.topology.cell_neighbours[cell][axis][0];
            let carried = match below {
                NONE => !self.topology.opens(cell, axis, 0),
                below => stands[below],
            };
            stands[cell] = self.state.fractions[cell] > 0.0 && carried;
            if !stands[cell] {
                self.state.pressure[cell] = INACTIVE;
            }
        }
    }
}
