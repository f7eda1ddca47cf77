//! Grains and the continua that they are joined to: the edges of one zone, which go in step.
//!
//! Grains lie in intervals of x, each of which ends at an edge or at a wall of the column; between two of them, or beyond the last, lies a
//! continuum ([`layout`]). Every edge has its own overlap, labels, strips and account; a continuum with grains on both sides of it has two
//! ([`Continuum`]), and continua meet each other through grains alone. What concerns all
//! grains at once is done here: they are cut off, weighed and loaded once, totals count them where they lie in front of the handshake
//! surfaces of all their edges, and of edges that want to move the lower one goes first. A grain that two edges act on bears
//! the sum.

use super::{
    Account, Continuum, MaterialEdge, MaterialEdgeSpec, OverlapError, Side, floor, layout, start,
};
use crate::overlap::angular::AngularBook;
use crate::overlap::joint::along_axes;
use crate::overlap::sighting::{Sighting, free_mass};
use colluvium_continuum::column_collapse::CollapseGround;
use colluvium_dem::{Load, Simulation};
use nalgebra::Vector2;

/// Diameters of grains between two overlaps that moves leave.
const BETWEEN: f64 = 4.0;
/// Grains and what they are joined to. They are the caller's: every call needs the same simulation.
pub struct GrainZone {
    pub(super) edges: Vec<MaterialEdge>,
    pub(super) continua: Vec<Continuum>,
    /// Mass of the free grains (kg).
    grain_mass: f64,
    /// What no edge books by itself: masses at the start, the grains' momentum then, and their weight.
    pub(super) own: Account,
    pub(super) grain_steps: f64,
    angular: Option<AngularBook>,
    loads: Vec<Load>,
}

impl GrainZone {
    /// Whether a continuum that has the front can stand and run out over ground.
    ///
    /// # Errors
    /// Ground that is not level below column and overlap, or does not fit its grid.
    pub fn check_ground(
        specs: &[MaterialEdgeSpec],
        ground: &CollapseGround,
    ) -> Result<(), OverlapError> {
        let continua = layout::continua(specs).into_iter();
        for own in continua.filter(|own| floor::has_front(&specs[own.clone()])) {
            let spec = &specs[own.start];
            let width = spec.place + spec.zones()[1] - spec.back;
            let height = spec.case.height;
            let area = width * height + 0.5 * spec.lean() * height * height;
            let mass = spec.density() * spec.slab * area;
            start::column(spec, &spec.column(mass), &spec.options, Some(ground))?;
        }
        Ok(())
    }

    /// Cuts a column of grains at its edges, along x: what lies behind them becomes continuum, which runs over the ground
    /// if it has the front.
    ///
    /// # Errors
    /// Settings out of range, edges that leave no grains between their overlaps or no continuum between them, no grains on a side,
    /// ground that is not level below an overlap, or a continuum that cannot stand.
    pub fn cut(
        specs: &[MaterialEdgeSpec],
        ground: Option<&CollapseGround>,
        simulation: &mut Simulation,
    ) -> Result<Self, OverlapError> {
        layout::check(specs)?;
        let total = free_mass(simulation);
        let mut zone = Self::of(Vec::new(), Vec::new());
        let ours = layout::grains(specs);
        for own in layout::continua(specs) {
            let keeper = layout::keeper(specs, &own);
            let mut seen = Sighting::default();
            seen.look_along(specs[keeper].side, simulation);
            let free = seen.snapshot.grains.iter().filter(|g| !g.fixed);
            let place = (own.clone(), ground);
            let continuum = Continuum::of_grains(specs, place, free, simulation.timestep())?;
            for k in own {
                let mut seen = Sighting::default();
                seen.look_along(specs[k].side, simulation);
                let edge = MaterialEdge::mark(specs[k], ours[k], &continuum, seen, simulation);
                zone.edges.push(edge);
            }
            zone.continua.push(continuum);
        }
        zone.own.mass = total;
        for edge in &mut zone.edges {
            edge.cut_off(simulation);
        }
        zone.weigh(simulation);
        zone.own.grains_before = zone.grain_momentum(simulation).into();
        for edge in &mut zone.edges {
            edge.look(simulation);
        }
        for continuum in &mut zone.continua {
            let edges = &mut zone.edges[continuum.edges.clone()];
            if let Some(keeper) = edges.get_mut(continuum.keeper) {
                let momentum = keeper.spec.side.in_plane(continuum.momentum());
                keeper.account.continuum_before = momentum.into();
            }
            continuum.prime(edges)?;
            for edge in edges {
                edge.agree();
                // What it was primed with is not its state.
                edge.look_at(continuum);
            }
        }
        zone.lay(simulation)?;
        Ok(zone)
    }

    pub(super) fn of(edges: Vec<MaterialEdge>, continua: Vec<Continuum>) -> Self {
        Self {
            edges,
            continua,
            grain_mass: 0.0,
            own: Account::default(),
            grain_steps: 0.0,
            angular: None,
            loads: Vec::new(),
        }
    }

    /// What follows the steps of the grains for which loads are held: books what they gave, exchanges where it is
    /// time to, and lays the next loads.
    ///
    /// # Errors
    /// If a continuum's step fails or the grains refuse a load.
    pub fn go_on(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        self.book_grains(simulation);
        let mut exchanged = false;
        for continuum in &mut self.continua {
            let own = continuum.edges.clone();
            exchanged = continuum.go_on(&mut self.edges[own], simulation)?;
        }
        if exchanged {
            self.travel(simulation)?;
        }
        self.lay(simulation)
    }

    fn book_grains(&mut self, simulation: &Simulation) {
        let Some(edge) = self.edges.first() else {
            return;
        };
        self.grain_steps += simulation.grain_count() as f64 * edge.joint.steps_of_loads as f64;
        self.own.weight += self.weight(edge.joint.acting(simulation), simulation);
    }

    /// Impulse of the grains' weight in a time (N s).
    fn weight(&self, time: f64, simulation: &Simulation) -> Vector2<f64> {
        along_axes(&simulation.gravity()) * self.grain_mass * time
    }

    pub(super) fn weigh(&mut self, simulation: &Simulation) {
        self.grain_mass = free_mass(simulation);
    }

    /// Moves of the edges, one after the other.
    fn travel(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        let angular = self.angular.is_some();
        let before = angular.then(|| simulation.leapfrog_angular_momentum());
        for n in 0..self.continua.len() {
            for k in self.continua[n].edges.clone() {
                let room = self.room(k);
                let continuum = &mut self.continua[n];
                if !self.edges[k].travel(room, continuum, simulation)? {
                    continue;
                }
                self.weigh(simulation);
                for other in (0..self.edges.len()).filter(|other| *other != k) {
                    let edge = &mut self.edges[other];
                    let known = edge.seen();
                    edge.see_newcomers(&known, simulation);
                    if self.continua[n].edges.contains(&other) {
                        edge.look_at(&self.continua[n]);
                    }
                }
            }
        }
        if let Some((book, before)) = self.angular.as_mut().zip(before) {
            book.hand(&(simulation.leapfrog_angular_momentum() - before));
        }
        Ok(())
    }

    /// How much of the grains that belong to no overlap may become continuum at an edge (m).
    fn room(&self, edge: usize) -> f64 {
        let (below, above) = match self.edges[edge].spec.side {
            Side::Below => (Some(edge), Some(edge + 1)),
            Side::Above => (edge.checked_sub(1), Some(edge)),
        };
        let pair = [below, above].map(|k| k.and_then(|k| self.edges.get(k)));
        let [Some(below), Some(above)] = pair else {
            return f64::INFINITY;
        };
        let taken = |edge: &MaterialEdge| edge.spec.zones()[1];
        let rows = below.held.rows.iter().zip(&above.held.rows);
        let apart = rows.map(|(low, high)| above.spec.side.along(high.place) - low.place);
        let spare = BETWEEN * below.spec.case.rheology.diameter;
        apart.fold(f64::INFINITY, f64::min) - taken(below) - taken(above) - spare
    }

    /// Lays the loads of the next steps.
    fn lay(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        if let Some(book) = &mut self.angular {
            book.begin();
        }
        self.loads.clear();
        for edge in &mut self.edges {
            edge.lay(simulation, &mut self.loads, self.angular.as_mut());
        }
        if self.edges.iter().all(|edge| edge.spec.settings.uncoupled) {
            return Ok(());
        }
        if self.edges.len() > 1 {
            self.loads.sort_by_key(|load| load.grain);
            self.loads.dedup_by(|next, load| {
                let same = next.grain == load.grain;
                if same {
                    load.force += next.force;
                    load.moment += next.moment;
                }
                same
            });
        }
        Ok(simulation.set_loads(&self.loads)?)
    }

    /// Its edges, the lower one first.
    pub fn edges(&self) -> &[MaterialEdge] {
        &self.edges
    }

    /// Its continua, along x.
    pub fn continua(&self) -> &[Continuum] {
        &self.continua
    }

    /// Accounts since the start along x and z, with what the grains have been given since the last exchange.
    pub fn account(&self, simulation: &Simulation) -> Account {
        let mut all = self.own;
        for edge in &self.edges {
            all.add(&edge.account(simulation), edge.spec.side);
        }
        if let Some(edge) = self.edges.first() {
            all.weight += self.weight(edge.joint.acting(simulation), simulation);
        }
        all
    }

    /// Momentum that the continua have still to take from the relaxation, along x and z (N s).
    pub fn owed(&self, simulation: &Simulation) -> [f64; 2] {
        let edges = self.edges.iter();
        sum(edges.map(|edge| edge.spec.side.in_plane(edge.owed(simulation))))
    }

    /// Momentum of the grains along x and z, with what walls have taken (N s).
    pub fn grain_momentum(&self, simulation: &mut Simulation) -> [f64; 2] {
        let momentum = simulation.leapfrog_momentum() + simulation.wall_impulse();
        [momentum.x, momentum.z]
    }

    /// Momentum of the continua along x and z, copies included (N s).
    pub fn continuum_momentum(&self) -> [f64; 2] {
        sum(self.continua.iter().map(Continuum::momentum))
    }

    /// Mass of grains and continua at the start, each counted on its side, and of what rests behind (kg).
    pub fn whole_mass(&self) -> f64 {
        self.own.mass
    }

    /// Grains times their steps.
    pub fn grain_steps(&self) -> f64 {
        self.grain_steps
    }

    /// Time between two exchanges (s).
    pub fn exchange_time(&self) -> f64 {
        self.edges
            .first()
            .map_or(f64::INFINITY, MaterialEdge::exchange_time)
    }

    /// Exchanges made.
    pub fn exchanges(&self) -> u64 {
        self.edges.first().map_or(0, MaterialEdge::exchanges)
    }

    /// Whether an exchange has just been made.
    pub fn at_exchange(&self) -> bool {
        self.edges.iter().all(MaterialEdge::at_exchange)
    }

    /// Books angular momentum about the slab's axis y from now on, for which [`see_step`](Self::see_step) has to be called before every step
    /// of the grains; what is written does not hold the account.
    ///
    /// # Errors
    /// If the grains refuse the loads, which are laid anew.
    pub fn open_angular_book(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        self.book_grains(simulation);
        for edge in &mut self.edges {
            edge.book_grains(simulation);
        }
        self.angular = Some(AngularBook::open(simulation));
        self.lay(simulation)
    }

    /// Books the step that comes next.
    pub fn see_step(&mut self, simulation: &Simulation) {
        if let Some(book) = &mut self.angular {
            book.see(simulation);
        }
    }

    /// The account of angular momentum, if it is open.
    pub fn angular_book(&self) -> Option<&AngularBook> {
        self.angular.as_ref()
    }
}

/// Sum of vectors in the plane.
fn sum(all: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    all.fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]])
}
