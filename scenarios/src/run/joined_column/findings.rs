//! What a joined column has found, and its plan.

use super::super::overlap_state;
use super::JoinedColumn;
use crate::failure::Failure;
use crate::run::column_of_grains::{FLOOR, FRONT_SHARE, OF_SHARE, STILL_LOOKS};
use crate::run::heap::{edge, place_of_share};
use crate::run::land::Land;
use crate::run::world::Ran;
use crate::scene::{ColumnFloorKind, DENSE, GrainIntervals, overlap_words};
use crate::state_hash;
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_coupling::overlap::Reason;
use colluvium_coupling::overlap::material_edge::{GrainZone, MaterialEdge, Move, Travel};

/// Limits of the monitors: slip over √(g H), ratio of forces less 1, share of the relaxation.
const MOST_SLIP: f64 = 0.01;
const MOST_RATIO: f64 = 0.05;
const MOST_RELAXATION: f64 = 0.1;

impl JoinedColumn<'_> {
    /// Share of the column's grains, floor included, that are left as grains.
    pub(super) fn expected_share(&self) -> f64 {
        let scene = self.scene;
        let d = scene.grains.diameter;
        let floor = match scene.grains.floor {
            ColumnFloorKind::Rough => FLOOR[0] * scene.slab() / (d * d),
            ColumnFloorKind::Smooth => 0.0,
        };
        let per_area = DENSE * scene.slab() / scene.grain_volume();
        let all = per_area * scene.section(scene.height) + floor * scene.length();
        let left_out = scene.continua().into_iter().map(|[low, high]| {
            let ends = [scene.width(), scene.length()];
            let [column, ground] = ends.map(|end| high.unwrap_or(end) - low.unwrap_or(0.0));
            let lip = match high {
                None => scene.section(scene.height) - scene.height * scene.width(),
                Some(_) => 0.0,
            };
            per_area * (scene.height * column + lip) + floor * ground
        });
        (all - left_out.sum::<f64>()) / all
    }

    /// Where grains end and why, and what joins them.
    pub(super) fn zones_in_words(&self) -> Vec<(String, String)> {
        let scene = self.scene;
        let d = scene.grains.diameter;
        let why = match (&self.oracle, scene.zones.edge_scaled) {
            (Some((why, _)), _) => why.as_str(),
            (None, Some(_)) => "given",
            (None, None) => {
                "computed: what lies 0.8 heights behind the end of the foot hardly flows"
            }
        };
        let steps = format!(
            "{:.0} % of the grain-steps of a column of grains",
            100.0 * self.expected_share()
        );
        let zones = match &scene.zones.x {
            Some(intervals) => self.intervals_in_words(intervals, &steps),
            None => format!(
                "continuum from x = {:.4} m (zones.rest_scaled = {:.4}; what lies behind rests) to x = {:.4} m ({:.1} d; zones.edge_scaled = \
                 {:.4}: {why}), grains beyond; {steps}",
                scene.rest(),
                scene.rest() / scene.height,
                scene.edge(),
                scene.edge() / d,
                scene.edge() / scene.height,
            ),
        };
        let mut lines = vec![("zones".to_owned(), zones)];
        if let Ok(s) = scene.overlap_settings(&self.origin) {
            lines.push((
                "overlap".into(),
                format!(
                    "from each edge into the grains: {}, sideways pressure at rest forgotten in a strain of {}",
                    overlap_words(&s, d),
                    s.rest_strain
                ),
            ));
            if let Some(travel) = scene.travel(&s) {
                lines.push(("moves".into(), travel_in_words(&travel)));
            }
        }
        let law = match scene.grains.calibrated.word() {
            Some(word) => format!("the law calibrated for `{word}` (|τ|/p)"),
            None => "that of [rheology]".into(),
        };
        lines.push((
            "continuum".into(),
            format!(
                "{law}, cells of {:.2} d ({})",
                scene.spacing() / d,
                match scene.overlap.cell_diameters {
                    Some(_) => "overlap.cell_diameters",
                    None if scene.joined_cells() < scene.cells() =>
                        "computed: those of grid.cells would be finer than overlap.cell_diameters = 1.5",
                    None => "grid.cells",
                }
            ),
        ));
        lines.extend(scene.terrain_in_words());
        lines
    }

    /// Where grains lie beside continua.
    fn intervals_in_words(&self, intervals: &GrainIntervals, steps: &str) -> String {
        let scene = self.scene;
        let d = scene.grains.diameter;
        let mut names = self.names().into_iter();
        let over = match scene.terrain {
            Some(_) => ", over the terrain",
            None => "",
        };
        let mut named = |place: f64| {
            let name = names.next().unwrap_or_default().replace('_', " ");
            format!("the {name} at {place:.4} m ({:.1} d)", place / d)
        };
        let of = |ends: [Option<f64>; 2]| {
            let from = match ends[0] {
                Some(low) => named(low),
                None => format!(
                    "x = {:.4} m (zones.rest_scaled = {:.4}; what lies behind rests)",
                    scene.rest(),
                    scene.rest() / scene.height
                ),
            };
            match ends[1] {
                Some(high) => format!("continuum from {from} to {}", named(high)),
                None => format!("continuum from {from} on, with the column's front{over}"),
            }
        };
        let continua: Vec<String> = scene.continua().into_iter().map(of).collect();
        format!(
            "{}, grains elsewhere (zones.x = {intervals}); {steps}",
            continua.join(", ")
        )
    }

    /// Results of the run for the summary, and tables.
    pub(super) fn find(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let scene = self.scene;
        let mut live = self.recalled(&ran.simulation, &ran.state)?;
        let axis = scene.heap_axis();
        let places = axis.positions();
        let deposit = self.heights(&ran.simulation, &live, 1.0, |_| true);
        let front = edge(&places, &deposit, scene.threshold());
        if live
            .course
            .fronts
            .last()
            .is_none_or(|f| f[0] < ran.simulation.time())
        {
            self.see(&ran.simulation, &mut live, false);
        }
        let half = |upper: bool| {
            let across = |y: f64| (y.rem_euclid(scene.slab()) > 0.5 * scene.slab()) == upper;
            let heights = self.heights(&ran.simulation, &live, 0.5, across);
            [
                edge(&places, &heights, scene.threshold()),
                place_of_share(&places, &heights, FRONT_SHARE),
            ]
        };
        let [upper, lower] = [half(true), half(false)];
        let [error, error_of_share] = [0, 1].map(|k| 0.5 * (upper[k] - lower[k]).abs());
        let width = scene.width();
        let highest = deposit.iter().copied().fold(0.0, f64::max);
        let rests = live.course.resting >= STILL_LOOKS;
        let time = if rests {
            ran.simulation.time()
        } else {
            f64::NAN
        };
        let m = |value: f64| Quantity::new(value, "m");
        let one = |value: f64| Quantity::new(value, "1");
        for (name, quantity, source) in [
            (
                "x_front",
                m(front).with_error(error),
                "where the heap is front_height_scaled high; error from both halves of the slab",
            ),
            (
                "runout_scaled",
                one((front - width) / width).with_error(error / width),
                "(x_front − width)/width",
            ),
            (
                "x_of_share",
                m(place_of_share(&places, &deposit, FRONT_SHARE)).with_error(error_of_share),
                OF_SHARE,
            ),
            ("deposit_height", m(highest), "greatest height at the end"),
            (
                "wall_height",
                m(deposit[0]),
                "height beside the wall at the end",
            ),
            (
                "time_of_rest",
                Quantity::new(time, "s"),
                "kinetic energy of both sides together below 1e-4 m g d a grain of the whole column; null where the run ended before",
            ),
            (
                "solid_fraction",
                one(live.course.solid_fraction),
                "in the middle of the column before; that of the continuum",
            ),
        ] {
            summary.put(name, quantity.from(source));
        }
        if front >= places[places.len() - 2] {
            summary.remarks.push(
                "The heap reached the end of the floor: grid.length_scaled is too small for its run-out."
                    .into(),
            );
        }
        if !rests {
            summary
                .remarks
                .push("Still moving at the end: duration_scaled is too short.".into());
        }
        self.book(ran, &live.zone, summary);
        for (edge, name) in live.zone.edges().iter().zip(self.names()) {
            let prefix = match live.zone.edges().len() {
                1 => String::new(),
                _ => format!("{name}_"),
            };
            self.watch(edge, &prefix, summary);
        }
        state_of_overlaps(&live.zone, summary);
        summary.state_hash = state_hash::of_hashes(
            [ran.simulation.state_hash(), state_hash::of(&[&ran.state])]
                .iter()
                .map(String::as_str),
        );
        let land = scene.land(&self.origin)?;
        let own = live.course.tables(places.clone(), deposit.clone());
        let mut tables = Land::beside(land.as_ref(), &places, own);
        tables.extend(sides(self, ran, &live.zone, (places, deposit)));
        if scene.zones.moving {
            tables.extend(moves(&live.zone, summary));
        }
        summary.figures.insert(
            0,
            Figure::Curves {
                table: "sides".into(),
                x: ["x".into(), "x [m]".into()],
                y_label: "height h [m]".into(),
                y: [
                    ["h", "both"],
                    ["grains", "grains, overlap included"],
                    ["continuum", "continuum, overlap included"],
                    ["handshake", "handshake surface"],
                ]
                .map(|pair| pair.map(String::from))
                .to_vec(),
                log: false,
                caption: "The deposit: grains in front, continuum behind, and where totals change from one to the other."
                    .into(),
            },
        );
        Ok(tables)
    }

    /// Cost, mass and momentum.
    fn book(&self, ran: &mut Ran, zone: &GrainZone, summary: &mut Summary) {
        let steps = ran.simulation.steps_done();
        let [before, now] = [ran.packing.grains.len(), ran.simulation.grain_count()];
        let own = zone.grain_steps() as u64;
        let cell_steps: f64 = zone.edges().iter().map(|e| e.monitors().steps[1]).sum();
        let counted = summary.cost.grain_steps.min(steps * before as u64);
        summary.cost.grain_steps = summary.cost.grain_steps - counted + own;
        summary.cost.cell_steps = cell_steps as u64;
        if summary.cost.wall_s > 0.0 {
            summary.cost.grain_steps_per_s = summary.cost.grain_steps as f64 / summary.cost.wall_s;
            summary.cost.cell_steps_per_s = cell_steps / summary.cost.wall_s;
        }
        summary.model.grains = now as u64;
        let cells: usize = zone.continua().iter().map(|c| c.cells().count()).sum();
        summary.model.cells = cells as u64;
        summary.put(
            "grain_steps_share",
            Quantity::new(zone.grain_steps() / (steps * before as u64) as f64, "1")
                .from("grain-steps of the run over those of the whole column, floor included"),
        );
        let account = zone.account(&ran.simulation);
        let grains = account.grains_error(zone.grain_momentum(&mut ran.simulation));
        let exchange = account.exchange_error(zone.owed(&ran.simulation));
        let volume = zone.volume_error();
        let mass = zone.mass_error(&ran.simulation);
        summary.ledger.mass_relative = f64::max(volume.abs(), mass.abs());
        summary.put(
            "handshake_mass",
            Quantity::new(mass, "1").against(
                0.0,
                "mass of grains and continuum on their sides of the handshake surface over that at the start, less 1",
            ),
        );
        summary.ledger.momentum_relative = Some(grains.max(exchange));
        for (name, value, source) in [
            (
                "ledger_volume",
                volume,
                "volume of the continuum against its account, what its copy was given included, relative",
            ),
            (
                "ledger_grains",
                grains,
                "momentum of the grains against its account, relative to the largest entry",
            ),
            (
                "ledger_exchange",
                exchange,
                "what the relaxation gave to both sides, relative to the largest entry",
            ),
        ] {
            summary.put(name, Quantity::new(value, "1").against(0.0, source));
        }
        let walls = account.from_walls_and_surface(zone.continuum_momentum());
        for (name, impulse, source) in [
            ("weight", account.weight, "of the grains"),
            (
                "traction",
                account.traction,
                "of the continuum on the grains",
            ),
            ("impedance", account.impedance, "on the grains"),
            (
                "relaxation",
                account.relaxation,
                "on the grains; the continuum takes the opposite",
            ),
            (
                "following",
                account.following,
                "that the copy was given when it was made anew from the grains",
            ),
            (
                "untaken",
                account.untaken,
                "of the relaxation on cells that had no velocity of their own to take it",
            ),
            (
                "continuum_walls",
                walls,
                "that the continuum had from walls, floor or ground and the stress on its surface: what is left of its momentum",
            ),
        ] {
            for (axis, value) in [("x", impulse[0]), ("z", impulse[1])] {
                let name = format!("impulse_{name}_{axis}");
                summary.put(&name, Quantity::new(value, "N s").from(source));
            }
        }
    }

    /// What the monitors of an edge say, by names that begin so, and in words what they should not.
    fn watch(&self, edge: &MaterialEdge, prefix: &str, summary: &mut Summary) {
        let named = |name: &str| format!("{prefix}{name}");
        let monitors = edge.monitors();
        let unit = (self.scene.gravity * self.scene.height).sqrt();
        let slip = monitors.mean_slip() / unit;
        let ratio = monitors.force_ratio();
        let share = monitors.relaxation_share();
        for (name, value, right, source) in [
            (
                "slip",
                slip,
                0.0,
                "difference of mean velocities at the handshake surface over √(g height), by sizes of means over windows of time; to be below 1 %",
            ),
            (
                "slip_noise",
                monitors.slip_noise() / unit,
                0.0,
                "what the noise of the grains' velocities alone would make the slip",
            ),
            (
                "largest_slip",
                monitors.largest_slip() / unit,
                0.0,
                "the slip of the worst window",
            ),
            (
                "force_ratio",
                ratio,
                1.0,
                "of forces along x through the handshake surface, grains over continuum, means in time; to be within 5 %",
            ),
            (
                "overlap_packing",
                edge.packing_ratio(),
                1.0,
                "mass of the grains in full cells of the overlap over that of the continuum there",
            ),
            (
                "relaxation_share",
                share,
                0.0,
                "impulse of the relaxation over that of the traction, by sizes of means over windows of time; to be below 10 %",
            ),
            (
                "relaxation_noise",
                monitors.relaxation_noise(),
                0.0,
                "what the noise of the grains' velocities alone would make the relaxation_share",
            ),
            (
                "grains_escaped",
                monitors.escaped,
                0.0,
                "most grains beyond the edge by more than a diameter along its normal, at any exchange",
            ),
        ] {
            summary.put(
                &named(name),
                Quantity::new(value, "1").against(right, source),
            );
        }
        let [grains, continuum] = monitors.forces();
        for (name, value, source) in [
            (
                "force_of_grains",
                grains,
                "along x through the handshake surface, of contacts and velocity fluctuations, mean in time; over that of a run with model = \"dem\" it is what the joint does to them",
            ),
            (
                "force_of_continuum",
                continuum,
                "the same of the continuum's stress and what it remembers of rest",
            ),
        ] {
            summary.put(&named(name), Quantity::new(value, "N").from(source));
        }
        summary.put(
            &named("rest_ratio"),
            Quantity::new(edge.rest_ratio(), "1")
                .from("sideways over vertical stress of the grains that became continuum, which it remembers"),
        );
        for (name, value, source) in [
            ("continuum_steps", monitors.steps[0], "of the continuum"),
            (
                "newton_iterations",
                monitors.newton[0],
                "of the continuum's steps, failed attempts included",
            ),
            (
                "steps_cut",
                monitors.newton[1],
                "of the continuum, that were halved and tried again",
            ),
            (
                "labels_renewed",
                edge.renewed(),
                "of grains that had left their neighbours in the overlap",
            ),
        ] {
            summary.put(&named(name), Quantity::new(value, "1").from(source));
        }
        summary.put(
            &named("momentum_residual"),
            Quantity::new(monitors.residual, "1").from("of the continuum, largest of any step"),
        );
        let misses = [
            (slip > MOST_SLIP, "the slip", slip),
            (
                (ratio - 1.0).abs() > MOST_RATIO,
                "the ratio of forces",
                ratio,
            ),
            (share > MOST_RELAXATION, "the share of relaxation", share),
            (
                monitors.escaped > 0.0,
                "the number of grains beyond the edge",
                monitors.escaped,
            ),
        ];
        let on_forces = "Overlap: below yield a continuum's sideways stress is its law's own: what the joint does to its grains is force_of_grains \
                         over that of a run with model = \"dem\".";
        if misses[1].0 && !summary.remarks.iter().any(|remark| remark == on_forces) {
            summary.remarks.push(on_forces.into());
        }
        let of = match prefix.strip_suffix('_') {
            Some(edge) => format!(" of {}", edge.replace('_', " ")),
            None => String::new(),
        };
        for (_, what, value) in misses.into_iter().filter(|(misses, ..)| *misses) {
            summary.remarks.push(format!(
                "Overlap{of}: {what} is {value:.4}, outside its limit."
            ));
        }
    }
}

/// Temperatures and energies of the overlaps: means over the edges, and sums.
fn state_of_overlaps(zone: &GrainZone, summary: &mut Summary) {
    let edges = zone.edges();
    let monitors = || edges.iter().map(|edge| edge.monitors());
    let temperatures = [0, 1, 2].map(|k| {
        let sum: f64 = monitors().map(|m| m.temperatures()[k]).sum();
        sum / edges.len().max(1) as f64
    });
    let work = [0, 1, 2].map(|k| monitors().map(|m| m.work[k]).sum());
    overlap_state::put(temperatures, work, summary);
}

/// Both sides by themselves, copies included, and the handshake surface.
fn sides(
    column: &JoinedColumn,
    ran: &Ran,
    zone: &GrainZone,
    (places, deposit): (Vec<f64>, Vec<f64>),
) -> Vec<Table> {
    let scene = column.scene;
    let solid = zone
        .edges()
        .first()
        .map(|e| e.spec().case.rheology.solid_fraction);
    let base = solid.unwrap_or(DENSE) * scene.slab();
    let free = ran.seen.grains.iter().filter(|g| !g.fixed);
    let volume = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    let grains = scene
        .heap_axis()
        .heights(free.map(|g| [g.position.x, volume(g.radius)]), base);
    let continuum = places.iter().map(|x| zone.continuum_height(*x)).collect();
    let handshake = places.iter().zip(&deposit);
    let handshake = handshake.map(|(x, h)| zone.grains_height(*x).min(*h));
    let handshake = handshake.collect();
    let cells = zone.fields().into_iter().flatten();
    let fields: Vec<_> = cells.map(|(cell, _)| cell).collect();
    let middle = |c: &colluvium_continuum::free_surface::CellFields, axis: usize| {
        0.5 * (c.lower[axis] + c.upper[axis])
    };
    vec![
        Table::new("sides")
            .with("x", "m", places)
            .with("h", "m", deposit)
            .with("grains", "m", grains)
            .with("continuum", "m", continuum)
            .with("handshake", "m", handshake),
        Table::new("continuum")
            .with("x", "m", fields.iter().map(|c| middle(c, 0)).collect())
            .with("z", "m", fields.iter().map(|c| middle(c, 1)).collect())
            .with("fraction", "1", fields.iter().map(|c| c.fraction).collect())
            .with("u", "m/s", fields.iter().map(|c| c.velocity[0]).collect())
            .with("w", "m/s", fields.iter().map(|c| c.velocity[1]).collect())
            .with("p", "Pa", fields.iter().map(|c| c.pressure).collect())
            .with("s", "Pa", fields.iter().map(|c| c.stress[0]).collect())
            .with("tau", "Pa", fields.iter().map(|c| c.stress[1]).collect()),
    ]
}

/// When an edge moves.
fn travel_in_words(travel: &Travel) -> String {
    let limit = |value: f64, is_one: bool, key: &str| match is_one {
        true => format!("{value} (zones.{key})"),
        false => format!("none (zones.{key} left out)"),
    };
    let dense = &travel.dense;
    format!(
        "by {:.4} m outwards where grains beside an edge have been slower than {:.3e} m/s (zones.rest_speed_scaled) for {:.3e} s \
         (zones.hold_scaled); back, within {}, where the continuum behind it is faster than {:.3e} m/s (zones.wake_speed_scaled) or sheared \
         faster than I = {}, or grains beside it are packed to less than {} of their solid fraction at the start, or fluctuations make more \
         than {} of the pressure there",
        travel.width,
        travel.rest,
        travel.hold,
        match travel.budget.is_finite() {
            true => format!("{} grains (zones.budget)", travel.budget),
            false => "any number of grains (zones.budget left out)".into(),
        },
        travel.wake,
        limit(dense.fastest, dense.fastest.is_finite(), "fastest_inertial"),
        limit(dense.loosest, dense.loosest > 0.0, "loosest_scaled"),
        limit(dense.warmest, dense.warmest.is_finite(), "warmest_share"),
    )
}

/// Moves of the edge with their reasons, in a table and in words.
fn moves(zone: &GrainZone, summary: &mut Summary) -> Option<Table> {
    let edges = zone.edges();
    let of_edge = |(number, edge): (usize, &'_ MaterialEdge)| -> Vec<(usize, f64, Move)> {
        let spec = edge.spec();
        let moves = edge.moves().iter();
        moves
            .map(|m| (number, spec.side.along(spec.place + m.edge), *m))
            .collect()
    };
    let mut all: Vec<_> = edges.iter().enumerate().flat_map(of_edge).collect();
    // In one exchange the lower edge moves first.
    all.sort_by(|a, b| a.2.time.total_cmp(&b.2.time));
    let because = |reason: Reason| {
        let of = all.iter().filter(|(.., m)| m.reason == reason);
        format!("{} by {}", of.count(), reason.word())
    };
    let sum = |sign: f64| {
        let of = all.iter().map(|(.., m)| m.mass * sign);
        of.filter(|m| *m > 0.0).sum::<f64>()
    };
    let reasons = [
        Reason::Speed,
        Reason::Loose,
        Reason::Warm,
        Reason::Inertial,
        Reason::Rest,
    ]
    .map(because);
    let subject = if edges.len() > 1 { "edges" } else { "edge" };
    summary.remarks.push(format!(
        "The {subject} moved {} times ({}): {:.3} kg became continuum and {:.3} kg grains again; {} moves inwards were refused by \
         zones.budget, and {} grains were laid on top because their place was taken.",
        all.len(),
        reasons.join(", "),
        sum(-1.0),
        sum(1.0),
        edges.iter().map(MaterialEdge::refused_moves).sum::<f64>(),
        edges.iter().map(MaterialEdge::displaced).sum::<f64>()
    ));
    for edge in edges {
        if let Some((times, first)) = edge.stopped_moves() {
            summary.remarks.push(format!(
                "{times} moves inwards of the edge that is now at {:.4} m, the first at t = {first:.4} s, were not made: the ground there is not level.",
                edge.spec().side.along(edge.spec().place + edge.travelled())
            ));
        }
    }
    let column = |f: fn(&Move) -> f64| all.iter().map(|(.., m)| f(m)).collect::<Vec<f64>>();
    let places = all.iter().map(|(_, place, _)| *place).collect();
    let sides = all.iter().map(|(side, ..)| *side as f64).collect();
    let table = Table::new("moves")
        .with("t", "s", column(|m| m.time))
        .with("side", "1", sides)
        .with("edge", "m", places)
        .with("reason", "1", column(|m| m.reason.number() as f64))
        .with("value", "m/s or 1", column(|m| m.value))
        .with("mass", "kg", column(|m| m.mass))
        .with("grains", "1", column(|m| m.grains));
    (!all.is_empty()).then_some(table)
}
