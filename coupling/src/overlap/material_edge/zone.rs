//! Grains with continuum on one side of them or on both: the edges of one zone, which go in step.
//!
//! An interval of grains has an edge at each end that is not a wall of the column, one or two. Each has a continuum of its own,
//! which the others meet through the grains alone, and its own overlap, labels, strips and account. What concerns all
//! grains at once is done here: they are cut off, weighed and loaded once, totals count them where they lie in front of the handshake
//! surfaces of all edges, and of two edges that want to move the lower one goes first. A grain that two edges act on bears
//! the sum.

use super::{Account, MaterialEdge, MaterialEdgeSpec, OverlapError, Side, account};
use crate::overlap::angular::AngularBook;
use crate::overlap::sighting::free_mass;
use colluvium_dem::{GrainSample, Load, Simulation};

/// Diameters of grains between two overlaps that moves leave.
const BETWEEN: f64 = 4.0;
/// Numbers in front of those of the edges, with the lengths of which they end: how many there are, and steps of grains.
const HEAD: usize = 2 + account::NUMBERS;

/// Grains and what they are joined to. They are the caller's: every call needs the same simulation.
pub struct GrainZone {
    edges: Vec<MaterialEdge>,
    /// Mass of the free grains (kg).
    grain_mass: f64,
    /// What no edge books by itself: masses at the start, the grains' momentum then, and their weight.
    own: Account,
    grain_steps: f64,
    angular: Option<AngularBook>,
    loads: Vec<Load>,
}

impl GrainZone {
    /// Cuts a column of grains at its edges: what lies behind them becomes continuum.
    ///
    /// # Errors
    /// Settings out of range, edges that leave no grains between their overlaps or do not lie on both sides of them, no grains on a side,
    /// or a continuum that cannot stand.
    pub fn cut(
        specs: &[MaterialEdgeSpec],
        simulation: &mut Simulation,
    ) -> Result<Self, OverlapError> {
        check(specs)?;
        let total = free_mass(simulation);
        // Stresses as they are while all grains are still there.
        let edges = specs
            .iter()
            .map(|spec| MaterialEdge::mark(*spec, simulation));
        let mut zone = Self::of(edges.collect::<Result<_, _>>()?);
        zone.own.mass = total;
        for edge in &mut zone.edges {
            edge.cut_off(simulation);
        }
        zone.weigh(simulation);
        zone.own.grains_before = zone.grain_momentum(simulation);
        for edge in &mut zone.edges {
            edge.meet(simulation)?;
        }
        zone.lay(simulation)?;
        Ok(zone)
    }

    fn of(edges: Vec<MaterialEdge>) -> Self {
        Self {
            edges,
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
    /// If the continuum's step fails or the grains refuse a load.
    pub fn go_on(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        self.book_grains(simulation);
        let mut exchanged = false;
        for edge in &mut self.edges {
            exchanged = edge.go_on(simulation)?;
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
        self.grain_steps += simulation.grain_count() as f64 * edge.steps_of_loads as f64;
        let weight = self.weight(edge.acting(simulation), simulation);
        for (sum, weight) in self.own.weight.iter_mut().zip(weight) {
            *sum += weight;
        }
    }

    /// Impulse of the grains' weight in a time (N s).
    fn weight(&self, time: f64, simulation: &Simulation) -> [f64; 2] {
        let gravity = simulation.gravity();
        [gravity.x, gravity.z].map(|g| self.grain_mass * g * time)
    }

    fn weigh(&mut self, simulation: &Simulation) {
        self.grain_mass = free_mass(simulation);
    }

    /// Moves of the edges, one after the other.
    fn travel(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        let angular = self.angular.is_some();
        let before = angular.then(|| simulation.leapfrog_angular_momentum());
        for k in 0..self.edges.len() {
            let room = self.room();
            if !self.edges[k].travel(room, simulation)? {
                continue;
            }
            self.weigh(simulation);
            for other in (0..self.edges.len()).filter(|other| *other != k) {
                let known = self.edges[other].seen();
                self.edges[other].see_newcomers(&known, simulation);
            }
        }
        if let Some((book, before)) = self.angular.as_mut().zip(before) {
            book.hand(&(simulation.leapfrog_angular_momentum() - before));
        }
        Ok(())
    }

    /// How much of the grains that belong to no overlap may become continuum (m).
    fn room(&self) -> f64 {
        let [below, above] = &self.edges[..] else {
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

    /// Whether totals count a grain: it lies in front of all handshake surfaces.
    pub fn counts(&self, grain: &GrainSample) -> bool {
        self.edges.iter().all(|edge| edge.counts(grain))
    }

    /// Accounts since the start along x and z, with what the grains have been given since the last exchange.
    pub fn account(&self, simulation: &Simulation) -> Account {
        let mut all = self.own;
        for edge in &self.edges {
            all.add(&edge.account(simulation), edge.spec.side);
        }
        if let Some(edge) = self.edges.first() {
            let weight = self.weight(edge.acting(simulation), simulation);
            for (sum, weight) in all.weight.iter_mut().zip(weight) {
                *sum += weight;
            }
        }
        all
    }

    /// Momentum that the continua have still to take from the relaxation, along x and z (N s).
    pub fn owed(&self, simulation: &Simulation) -> [f64; 2] {
        self.sum(|edge| edge.spec.side.in_plane(edge.owed(simulation)))
    }

    /// Momentum of the grains along x and z, with what walls have taken (N s).
    pub fn grain_momentum(&self, simulation: &mut Simulation) -> [f64; 2] {
        let momentum = simulation.leapfrog_momentum() + simulation.wall_impulse();
        [momentum.x, momentum.z]
    }

    /// Momentum of the continua along x and z, copies included (N s).
    pub fn continuum_momentum(&self) -> [f64; 2] {
        self.sum(|edge| edge.spec.side.in_plane(edge.continuum_momentum()))
    }

    fn sum(&self, of: impl Fn(&MaterialEdge) -> [f64; 2]) -> [f64; 2] {
        let all = self.edges.iter().map(of);
        all.fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]])
    }

    /// Kinetic energy of the continua behind the handshake surfaces (J).
    pub fn continuum_kinetic(&self) -> f64 {
        self.edges.iter().map(MaterialEdge::continuum_kinetic).sum()
    }

    /// Mass of the continua, copies included (kg).
    pub fn continuum_mass(&self) -> f64 {
        self.edges.iter().map(MaterialEdge::continuum_mass).sum()
    }

    /// Mass of grains and continua at the start, each counted on its side, and of what rests behind (kg).
    pub fn whole_mass(&self) -> f64 {
        self.own.mass
    }

    /// Largest error of a continuum's volume, relative.
    pub fn volume_error(&self) -> f64 {
        let errors = self.edges.iter().map(MaterialEdge::volume_error);
        errors.fold(0.0, |most: f64, error| match error.abs() > most.abs() {
            true => error,
            false => most,
        })
    }

    /// Mass of grains and of continua that totals count, over that of all grains at the start, less 1: what the
    /// handshake surfaces gained or lost by differences of both sides' motion.
    pub fn mass_error(&self, simulation: &Simulation) -> f64 {
        let mut masses: Vec<(u32, f64)> = simulation
            .held(|_| true)
            .filter(|g| self.counts(g))
            .map(|g| (g.id, g.mass))
            .collect();
        masses.sort_unstable_by_key(|m| m.0);
        let grains: f64 = masses.iter().map(|m| m.1).sum();
        let continuum = self.edges.iter().map(|edge| {
            let solid: f64 = edge.parcels().iter().map(|[_, volume]| volume).sum();
            solid * edge.spec.case.rheology.grain_density
        });
        (grains + continuum.sum::<f64>()) / self.own.mass - 1.0
    }

    /// The continua behind the handshake surfaces, and what rests behind them, as parcels: places along x (m) and volumes of
    /// grains in them (m³).
    pub fn parcels(&self) -> Vec<[f64; 2]> {
        let of = |edge: &MaterialEdge| {
            let side = edge.spec.side;
            let parcels = edge.parcels().into_iter();
            parcels.map(move |[x, volume]| [side.along(x), volume])
        };
        self.edges.iter().flat_map(of).collect()
    }

    /// Height of a continuum, copy included, at a place along x (m); beyond the ends of its grid that at its ends.
    pub fn continuum_height(&self, x: f64) -> f64 {
        let of = |edge: &MaterialEdge| {
            let cell = (edge.spec.side.along(x) - edge.cells.low) / edge.cells.spacing;
            let (_, heights) = edge.collapse.profile();
            match cell >= 0.0 {
                true => heights.get(cell as usize).copied().unwrap_or(0.0),
                false => heights.first().copied().unwrap_or(0.0),
            }
        };
        self.edges.iter().map(of).fold(0.0, f64::max)
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

    fn head(&self) -> [f64; HEAD] {
        let own = self.own.numbers();
        std::array::from_fn(|k| match k.checked_sub(2) {
            None => [self.edges.len() as f64, self.grain_steps][k],
            Some(k) => own[k],
        })
    }

    /// Appends all there is; to be called after every exchange.
    pub fn write(&self, memory: &mut Vec<f64>) {
        memory.extend(self.head());
        for edge in &self.edges {
            let length = memory.len();
            memory.push(0.0);
            edge.write(memory);
            memory[length] = (memory.len() - length - 1) as f64;
        }
    }

    /// Writes what has changed since an exchange over what [`write`](Self::write) wrote after it.
    pub fn write_over(&self, memory: &mut [f64]) {
        memory[..HEAD].copy_from_slice(&self.head());
        let mut from = HEAD;
        for edge in &self.edges {
            edge.write_over(&mut memory[from + 1..]);
            from += 1 + memory[from] as usize;
        }
    }

    /// Goes on from what was written of a zone with the same specification; the simulation is the one that was
    /// joined, resumed itself.
    ///
    /// # Errors
    /// If the numbers do not belong to this specification.
    pub fn read(
        specs: &[MaterialEdgeSpec],
        memory: &[f64],
        simulation: &Simulation,
    ) -> Result<Self, OverlapError> {
        let damaged = || OverlapError::Record("the joined column's memory misses a part".into());
        let (head, mut rest) = memory.split_first_chunk::<HEAD>().ok_or_else(damaged)?;
        if head[0] != specs.len() as f64 {
            return Err(damaged());
        }
        let mut edges = Vec::with_capacity(specs.len());
        for spec in specs {
            let (length, after) = rest.split_first().ok_or_else(damaged)?;
            let (own, after) = after
                .split_at_checked(*length as usize)
                .ok_or_else(damaged)?;
            edges.push(MaterialEdge::read(*spec, own, simulation)?);
            rest = after;
        }
        let mut zone = Self::of(edges);
        zone.grain_steps = head[1];
        zone.own = Account::of(&std::array::from_fn(|k| head[2 + k]));
        zone.weigh(simulation);
        Ok(zone)
    }
}

/// Whether edges can be those of one zone.
fn check(specs: &[MaterialEdgeSpec]) -> Result<(), OverlapError> {
    let refuse = |key, value, allowed| {
        Err(OverlapError::OutOfRange {
            key,
            value,
            allowed,
        })
    };
    match specs {
        [_] => Ok(()),
        [below, above] if below.side == Side::Below && above.side == Side::Above => {
            let apart = above.side.along(above.place) - below.place;
            if below.settings.exchange_time != above.settings.exchange_time
                || below.settings.load_time != above.settings.load_time
            {
                let time = above.settings.exchange_time;
                return refuse(
                    "exchange_time",
                    time,
                    "that of the other edge, as load_time",
                );
            }
            match apart > below.zones()[1] + above.zones()[1] {
                true => Ok(()),
                false => refuse("zone", apart, "more than the widths of both overlaps"),
            }
        }
        [_, _] => refuse(
            "edges",
            2.0,
            "one below the grains and one above: continuum between grains is not joined",
        ),
        _ => refuse("edges", specs.len() as f64, "one or two"),
    }
}
