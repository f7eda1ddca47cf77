//! A continuum that ends at grains on one side or on both.
//!
//! Its grid has one axis, that of one of its edges, the *keeper*: in the keeper's account stands what concerns the continuum as a
//! whole, its weight and the steps that it makes. An edge at its other end sees it in a mirror, and what that one does to it is
//! turned back where it is put together with what the keeper does. A cell bears the grains of that edge which has more of them there;
//! forces of both are added.

use super::account::Account;
use super::cells::Cells;
use super::copy::ROUNDED;
use super::side::{Side, mirror_rows};
use super::{MaterialEdge, MaterialEdgeSpec, NEARLY, OverlapError, floor, layout, start};
use colluvium_continuum::column_collapse::{Collapse, CollapseGround};
use colluvium_continuum::free_surface::SurfaceState;
use colluvium_dem::GrainSample;
use nalgebra::Vector2;
use std::ops::Range;

/// What lies behind an edge, or between two. All along its keeper's axis.
pub struct Continuum {
    pub(super) spec: MaterialEdgeSpec,
    pub(super) cells: Cells,
    pub(super) collapse: Collapse,
    /// Mass of it, copies included, and of what rests behind it (kg).
    pub(super) mass: f64,
    pub(super) rest_mass: f64,
    /// Which edges of its zone are its own, and which of those is the keeper.
    pub(super) edges: Range<usize>,
    pub(super) keeper: usize,
    /// From which place on the ground below it is level (m); all of it without ground.
    pub(super) level: f64,
}

impl Continuum {
    /// Of grains that lie where it will be, seen along its keeper's axis.
    pub(super) fn of_grains<'a>(
        specs: &[MaterialEdgeSpec],
        (edges, ground): (Range<usize>, Option<&CollapseGround>),
        grains: impl Iterator<Item = &'a GrainSample>,
        timestep: f64,
    ) -> Result<Self, OverlapError> {
        let spec = specs[layout::keeper(specs, &edges)];
        let [_, inner] = spec.zones();
        // With grains on both sides of it, those on the far side are not its own.
        let begins = match edges.len() > 1 {
            true => spec.back,
            false => f64::NEG_INFINITY,
        };
        let (mut behind, mut before) = (0.0, 0.0);
        for grain in grains {
            if grain.position.x < spec.wall {
                behind += grain.mass;
            } else if grain.position.x - spec.place < inner && grain.position.x >= begins {
                before += grain.mass;
            }
        }
        Self::standing(specs, (edges, ground), [before, behind], timestep)
    }

    /// Of a mass, and another that rests behind it (kg), before anything moves. Over ground if it has the front.
    pub(super) fn standing(
        specs: &[MaterialEdgeSpec],
        (edges, ground): (Range<usize>, Option<&CollapseGround>),
        [mass, rest_mass]: [f64; 2],
        timestep: f64,
    ) -> Result<Self, OverlapError> {
        let keeper = layout::keeper(specs, &edges);
        let spec = specs[keeper];
        let steps = spec.settings.steps_of_loads(timestep);
        let load_time = steps as f64 * timestep;
        let loads = spec.settings.loads_of_exchange(timestep);
        let column = spec.column(mass);
        let exchange = loads as f64 * load_time / (column.height / column.gravity).sqrt();
        // The copy is made anew at every exchange.
        let mut options = spec.options.of_first_order();
        if exchange < NEARLY * options.largest_step {
            options.largest_step = options.largest_step.max(ROUNDED * exchange);
        }
        let ground = ground.filter(|_| floor::has_front(&specs[edges.clone()]));
        let collapse = start::column(&spec, &column, &options, ground)?;
        let axes = collapse.flow().grid().axes();
        let below = -collapse.origin()[1] / collapse.spacing();
        let cells = Cells {
            counts: [axes[0].cells(), axes[1].cells()],
            low: spec.wall,
            below: below.round().max(0.0) as usize,
            spacing: spec.spacing(),
            slab: spec.slab,
        };
        Ok(Self {
            spec,
            cells,
            collapse,
            mass,
            rest_mass,
            keeper: keeper - edges.start,
            level: ground.map_or(f64::NEG_INFINITY, |ground| floor::level_from(ground, &spec)),
            edges,
        })
    }

    /// Where the column of the continuum has come to.
    pub fn collapse(&self) -> &Collapse {
        &self.collapse
    }

    /// Its grid.
    pub fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Whether it runs over ground of its own.
    pub fn has_ground(&self) -> bool {
        !self.collapse.ground_outline().is_empty()
    }

    /// What its keeper was made from.
    pub fn spec(&self) -> &MaterialEdgeSpec {
        &self.spec
    }

    /// Its keeper among its edges, and the other one.
    pub(super) fn parted<'e>(
        &self,
        edges: &'e [MaterialEdge],
    ) -> Option<(&'e MaterialEdge, Option<&'e MaterialEdge>)> {
        let keeper = edges.get(self.keeper)?;
        Some((keeper, edges.get(1 - self.keeper)))
    }

    /// Its grid along the axis of an edge.
    pub(super) fn cells_along(&self, side: Side) -> Cells {
        match self.spec.side.seen_along(side) {
            Side::Below => self.cells,
            Side::Above => Cells {
                low: -self.cells.face(self.cells.counts[0]),
                ..self.cells
            },
        }
    }

    /// Turns fractions and velocities of a state onto the axis of an edge; and back.
    pub(super) fn turn(&self, side: Side, state: &mut SurfaceState) {
        if self.spec.side == side {
            return;
        }
        let columns = self.cells.counts[0];
        mirror_rows(&mut state.fractions, columns);
        mirror_rows(&mut state.velocity[0], columns + 1);
        mirror_rows(&mut state.velocity[1], columns);
        for u in &mut state.velocity[0] {
            *u = -*u;
        }
    }

    /// Momentum along x and z, copies included (N s).
    pub(super) fn momentum(&self) -> [f64; 2] {
        let unit = self.impulse_unit();
        self.spec
            .side
            .in_plane(self.collapse.flow().momentum().map(|p| p * unit))
    }

    /// ρ U L² W (N s).
    fn impulse_unit(&self) -> f64 {
        let u = self.collapse.units();
        u.density * u.velocity * u.length * u.length * self.spec.slab
    }

    /// What follows the steps of the grains for which loads are held: books what they gave, and exchanges where it is time
    /// to. Says whether it was.
    ///
    /// # Errors
    /// If the continuum's step fails.
    pub(super) fn go_on(
        &mut self,
        edges: &mut [MaterialEdge],
        simulation: &mut colluvium_dem::Simulation,
    ) -> Result<bool, OverlapError> {
        let mut is_time = false;
        for edge in edges.iter_mut() {
            edge.book_grains(simulation);
            edge.joint.made += 1;
            is_time = edge.joint.made >= edge.joint.loads_of_exchange;
        }
        if !is_time {
            return Ok(false);
        }
        let exchange = edges.first().map_or(0, |edge| edge.joint.exchanges + 1);
        for edge in edges.iter_mut() {
            edge.take_up(self, simulation)?;
        }
        self.step(edges, exchange)?;
        for edge in edges {
            edge.see_the_step();
            edge.joint.made = 0;
            edge.joint.exchanges = exchange;
            edge.renew_labels();
        }
        Ok(true)
    }

    /// Steps up to the end of an exchange, the first being 1, under what its edges do to it.
    pub(super) fn step(
        &mut self,
        edges: &mut [MaterialEdge],
        exchange: u64,
    ) -> Result<(), OverlapError> {
        let (keeper, mut other) = match (edges, self.keeper) {
            ([keeper], _) => (keeper, None),
            ([keeper, other], 0) | ([other, keeper], _) => (keeper, Some(other)),
            _ => return Ok(()),
        };
        let units = self.collapse.units();
        let unit = units.time();
        let dt = keeper.exchange_time();
        let until = exchange as f64 * dt;
        let coupled = !self.spec.settings.uncoupled;
        if coupled {
            keeper.press_on_continuum(units, dt);
            if let Some(other) = &mut other {
                other.press_on_continuum(units, dt);
                keeper.press_with(other);
            }
            let flow = self.collapse.flow_mut();
            flow.set_outside(keeper.outside.clone())?;
        }
        let before = self.collapse.flow().state().velocity_time;
        while self.collapse.time() < until * (1.0 - 1e-12) {
            let step = self.collapse.step(until)?;
            keeper.joint.monitors.take_step(&step);
        }
        // Velocities have moved on by this, half a step ahead of the fractions.
        let pushed = (self.collapse.flow().state().velocity_time - before) * unit;
        let unit = self.impulse_unit();
        let untaken = self.collapse.flow_mut().take_untaken();
        let account: &mut Account = &mut keeper.account;
        account.untaken += Vector2::from(untaken) * unit;
        let mass = self.collapse.flow().volume() * unit / self.collapse.units().velocity;
        account.continuum_weight[1] -= mass * self.spec.case.gravity * pushed;
        for edge in std::iter::once(keeper).chain(other) {
            if coupled {
                edge.joint.answer(pushed / dt, &mut edge.account.answer);
            }
            edge.look_at(self);
        }
        Ok(())
    }

    /// A step that is taken back but for its stress and pressure, for grains to meet at once.
    pub(super) fn prime(&mut self, edges: &mut [MaterialEdge]) -> Result<(), OverlapError> {
        for edge in edges.iter_mut() {
            edge.look_at(self);
        }
        let before = self.collapse.flow().state().clone();
        let books: Vec<_> = edges
            .iter()
            .map(|e| (e.account, e.joint.monitors))
            .collect();
        self.step(edges, 1)?;
        self.collapse.set_state(before)?;
        for (edge, book) in edges.iter_mut().zip(books) {
            (edge.account, edge.joint.monitors) = book;
        }
        Ok(())
    }
}
