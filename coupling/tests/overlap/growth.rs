//! A box that grows in a bed at rest finds the bed as it was, and one that shrinks leaves it so.

use colluvium_continuum::free_surface::SurfaceOptions;
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::overlap::bowl::{Bowl, BowlSpec, Growth};
use colluvium_coupling::overlap::material_edge::Travel;
use colluvium_coupling::overlap::{DenseLimits, OverlapSettings, Reason, Scales};
use colluvium_dem::preparation::*;
use colluvium_dem::*;
use nalgebra::Vector3;
use std::ops::ControlFlow;
use std::sync::OnceLock;

pub(super) const SIZE: [f64; 3] = [26.0, 10.0, 10.0];
pub(super) const GRAINS: usize = 2600;
pub(super) const STIFFNESS: f64 = 2e4;
pub(super) const DENSITY: f64 = 6.0 / std::f64::consts::PI;

pub(super) fn domain() -> Domain {
    Domain {
        lower: Vector3::repeat(-1.0),
        upper: Vector3::new(SIZE[0] + 1.0, SIZE[1] + 1.0, 60.0),
        periodic: [false; 3],
    }
}

/// Springs of contacts with walls are not kept: these have none.
pub(super) fn laws() -> Laws {
    let law = |friction| {
        ContactLaw::linear(
            Hooke::matched(STIFFNESS, 0.5),
            TangentialSpring::matched(2.0 / 7.0, 0.5, friction),
            None,
        )
    };
    Laws {
        own: vec![law(0.5), law(0.0)],
        pairs: vec![(0, 1, law(0.0))],
    }
}

fn setup(grains: Vec<Grain>) -> Setup {
    let smooth = |point, normal| Wall::plane(point, normal).material(1);
    let far = Vector3::new(SIZE[0], SIZE[1], 0.0);
    Setup {
        domain: domain(),
        gravity: -Vector3::z(),
        law: laws(),
        grains,
        walls: vec![
            smooth(Vector3::zeros(), Vector3::z()),
            smooth(Vector3::zeros(), Vector3::x()),
            smooth(Vector3::zeros(), Vector3::y()),
            smooth(far, -Vector3::x()),
            smooth(far, -Vector3::y()),
        ],
        bodies: Vec::new(),
        timestep: 2e-3,
        threads: Threads::Serial,
    }
}

/// A bed that rests, with the springs that hold it.
pub(super) fn rested() -> Simulation {
    static BED: OnceLock<(Vec<Grain>, Record)> = OnceLock::new();
    let (grains, record) = BED.get_or_init(|| {
        let radius = RadiusLaw::Uniform {
            low: 0.45,
            high: 0.55,
        };
        let cloud = Insertion {
            region: Region::Block {
                lower: Vector3::zeros(),
                upper: Vector3::new(SIZE[0], SIZE[1], 3.0 * SIZE[2]),
            },
            domain: domain(),
            ingredients: vec![Ingredient::alone(radius, DENSITY)],
            amount: Amount::Grains(GRAINS),
            gap: 0.0,
            velocity: Vector3::zeros(),
            tries: TRIES,
            seed: 5,
        };
        let (grains, _) = insert_loose(&cloud, &[]).unwrap();
        let mut simulation = Simulation::new(setup(grains)).unwrap();
        calm(&mut simulation);
        (simulation.grain_list(), simulation.checkpoint())
    });
    Simulation::resume(setup(grains.clone()), record).unwrap()
}

fn calm(simulation: &mut Simulation) {
    let rest = Relaxation {
        rest: Rest {
            kinetic: 1e-9,
            unbalanced: 1e-3,
        },
        ..Relaxation::under(1.0)
    };
    relax(simulation, &rest, &mut |_: &RestMeasures| {
        ControlFlow::Continue(())
    })
    .unwrap();
}

/// No side moves by itself.
pub(super) const TRAVEL: Travel = Travel {
    width: 2.0,
    rest: 0.0,
    wake: 10.0,
    hold: 1.0,
    budget: f64::INFINITY,
    fewest: 20.0,
    dense: DenseLimits::NONE,
};

pub(super) fn spec(simulation: &mut Simulation, travel: Travel, misplaced: f64) -> BowlSpec {
    let grains = simulation.grain_list();
    let middle = Region::Block {
        lower: Vector3::new(2.0, 2.0, 1.5),
        upper: Vector3::new(SIZE[0] - 2.0, SIZE[1] - 2.0, 7.5),
    };
    let solid = solid_fraction(&grains, &domain(), &middle);
    let scales = Scales {
        diameter: 1.0,
        time: 1.0,
        density: solid * DENSITY,
        stiffness: STIFFNESS,
    };
    let settings = OverlapSettings {
        cell: Some(2.0),
        inner: Some(2.0),
        buffer: Some(2.0),
        shell: Some(1.5),
        ..OverlapSettings::default()
    };
    BowlSpec {
        low: [0.0; 3],
        size: [SIZE[0], SIZE[1]],
        gravity: 1.0,
        law: MuI::new(0.36, 0.70, 0.3, 1.0, solid, DENSITY),
        options: SurfaceOptions::default(),
        edges: [[0.5 * SIZE[0] - 7.0, 0.5 * SIZE[0] + 7.0], [0.0, SIZE[1]]],
        bottom: 0.0,
        settings: settings.resolve(&scales, false).unwrap(),
        ball: None,
        growth: Some(Growth {
            travel,
            near: 3.0,
            misplaced,
        }),
    }
}

pub(super) struct Bed {
    pub simulation: Simulation,
    pub bowl: Bowl,
    /// Momentum that damping gave (negative: took).
    pub damped: Vector3<f64>,
}

impl Bed {
    pub(super) fn cut() -> Self {
        Self::with(TRAVEL)
    }

    pub(super) fn with(travel: Travel) -> Self {
        Self::of(travel, f64::INFINITY)
    }

    pub(super) fn of(travel: Travel, misplaced: f64) -> Self {
        let mut simulation = rested();
        let spec = spec(&mut simulation, travel, misplaced);
        let bowl = Bowl::cut(spec, &mut simulation).unwrap();
        Self {
            simulation,
            bowl,
            damped: Vector3::zeros(),
        }
    }

    /// Goes on for a time, keeping so much of the velocities at every exchange.
    pub(super) fn advance(&mut self, time: f64, keep: f64) {
        let each = self
            .bowl
            .spec()
            .settings
            .steps_of_loads(self.simulation.timestep());
        let all = (time / self.simulation.timestep()).round() as u64;
        for _ in 0..all / each {
            for _ in 0..each {
                self.bowl.see_step(&self.simulation);
                self.simulation.advance(1).unwrap();
            }
            self.bowl.go_on(&mut self.simulation).unwrap();
            if keep < 1.0 && self.bowl.at_exchange() {
                let before = self.bowl.grain_momentum(&mut self.simulation);
                self.simulation.damp(keep);
                self.damped += self.bowl.grain_momentum(&mut self.simulation) - before;
            }
        }
    }

    /// Errors of mass, volume and both books.
    pub(super) fn books(&mut self) -> [f64; 4] {
        let account = self.bowl.account(&self.simulation);
        let now = self.bowl.grain_momentum(&mut self.simulation) - self.damped;
        [
            self.bowl.mass_error(&self.simulation),
            self.bowl.volume_error(),
            account.grains_error(now),
            account.exchange_error(self.bowl.owed(&self.simulation)),
        ]
    }
}

/// Mean stresses σ_xx and σ_zz of grains' contacts, compression positive, between two places along x and well below the
/// surface.
pub(super) fn stresses(simulation: &mut Simulation, [low, high]: [f64; 2]) -> [f64; 2] {
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    let mut sums = [0.0; 2];
    for contact in &seen.contacts {
        let grain = &seen.grains[contact.grain];
        let branch = contact.arm - contact.partner_arm;
        let middle = grain.position + 0.5 * branch;
        if (low..high).contains(&middle.x) && (1.0..6.0).contains(&middle.z) {
            let of_wall = !matches!(contact.partner, Partner::Grain(_));
            if of_wall {
                continue;
            }
            for (sum, axis) in sums.iter_mut().zip([0, 2]) {
                *sum -= contact.force[axis] * branch[axis];
            }
        }
    }
    sums.map(|s| s / ((high - low) * SIZE[1] * 5.0))
}

/// Force that nothing balances over the weight, rms over the grains with these numbers.
pub(super) fn unbalanced(simulation: &mut Simulation, ids: &[u32]) -> f64 {
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    let weight = |g: &GrainSample| -g.mass * Vector3::z();
    let mut forces: Vec<Vector3<f64>> = seen.grains.iter().map(weight).collect();
    for contact in &seen.contacts {
        forces[contact.grain] += contact.force;
        if let Partner::Grain(other) = contact.partner {
            forces[other] -= contact.force;
        }
    }
    let pairs = seen.grains.iter().zip(&forces);
    let of = pairs.filter(|(g, _)| ids.binary_search(&g.id).is_ok());
    let squares: f64 = of.map(|(g, f)| (f / g.mass).norm_squared()).sum();
    (squares / ids.len() as f64).sqrt()
}

impl Bed {
    /// Where the side at high x lies (d).
    pub(super) fn face(&self) -> f64 {
        let mut sides = self.bowl.zone().sides.iter();
        let side = sides.find(|side| side.number() == RIGHT).unwrap();
        2.0 * side.face as f64
    }

    /// Numbers of the stored grains between two places along x.
    pub(super) fn stored(&self, [low, high]: [f64; 2]) -> Vec<u32> {
        let store = self.bowl.stored();
        let rows = store.grains.iter().zip(&store.ids);
        let of = rows.filter(|(g, _)| (low..high).contains(&g.position.x));
        of.map(|(_, id)| *id).collect()
    }

    pub(super) fn grow(&mut self) {
        let books = self.books();
        assert!(
            self.bowl
                .move_side(RIGHT, true, &mut self.simulation)
                .unwrap()
        );
        let after = self.books();
        println!(
            "{:.3?}\n  books {books:?}\n  then  {after:?}",
            self.bowl.moves().last()
        );
        // A move changes no mass, and leaves every book as it was.
        assert!((after[0] - books[0]).abs() < 1e-12, "{books:?} {after:?}");
        assert!(after[1].abs() < 1e-12 && after[2] < 1e-12 && after[3] < 1e-12);
    }
}

/// The sides at low and at high x.
const LEFT: usize = 0;
pub(super) const RIGHT: usize = 1;

/// Grains that are put back stand in balance as they did in the bed that they were taken from; without the histories
/// of their contacts, or elsewhere, they do not.
#[test]
fn grains_that_are_put_back_are_in_balance() {
    let run = |histories: bool, shift: f64| {
        let mut bed = Bed::cut();
        let face = bed.face();
        // Of what is put back those that bear no traction.
        let ids = bed.stored([face - 1.5, face]);
        assert!(ids.len() > 50);
        let store = bed.bowl.stored_mut();
        if !histories {
            store.histories.fill(0.0);
        }
        for grain in &mut store.grains {
            grain.position.x += shift;
        }
        bed.grow();
        unbalanced(&mut bed.simulation, &ids)
    };
    let mut whole = rested();
    let face = Bed::cut().face();
    let ids = Bed::cut().stored([face - 1.5, face]);
    let before = unbalanced(&mut whole, &ids);
    let [with, without, moved] = [run(true, 0.0), run(false, 0.0), run(true, 0.2)];
    println!(
        "unbalanced: before {before:.1e}, with {with:.1e}, without histories {without:.1e}, elsewhere {moved:.1e}"
    );
    assert!(with < 0.2, "{with}");
    assert!(without > 1.0 && moved > 2.0, "{without} {moved}");
}

/// A side that comes in keeps its own strip, and what the shell of another had been before it bore tractions.
#[test]
fn a_side_that_comes_in_leaves_the_store_of_the_others() {
    let run = |shrink: bool| {
        let mut bed = Bed::cut();
        let face = bed.face();
        let ids = bed.stored([face - 1.5, face]);
        bed.advance(3.0, 1.0);
        if shrink {
            let made = bed.bowl.move_side(LEFT, false, &mut bed.simulation);
            assert!(made.unwrap());
            let books = bed.books();
            assert!(books[1].abs() < 1e-12 && books[2] < 1e-12 && books[3] < 1e-12);
        }
        let lay = |bed: &Bed| {
            let store = bed.bowl.stored();
            let rows = store.ids.iter().zip(&store.grains);
            let of = rows.filter(|(id, _)| ids.binary_search(id).is_ok());
            of.map(|(_, g)| g.position).collect::<Vec<_>>()
        };
        let stored = lay(&bed);
        bed.grow();
        (stored, unbalanced(&mut bed.simulation, &ids))
    };
    let [(left, alone), (kept, after)] = [run(false), run(true)];
    println!("unbalanced: alone {alone:.3e}, after another side came in {after:.3e}");
    assert_eq!(left, kept);
    assert!(after < 1.05 * alone, "{after} {alone}");
}

/// A memory whose box has no grains beyond its overlap is refused in words.
#[test]
fn a_memory_with_too_narrow_a_box_is_refused() {
    let bed = Bed::cut();
    let mut memory = Vec::new();
    bed.bowl.write(&mut memory);
    let corners = bed.bowl.zone().corners();
    let place = memory.windows(5).position(|w| w == corners).unwrap();
    for width in [1.0, 3.0, 4.0] {
        memory[place + 3] = corners[0] + width;
        let error = Bowl::read(*bed.bowl.spec(), &memory, &bed.simulation);
        let error = error.err().unwrap().to_string();
        assert!(
            error.contains("cells along x beyond its overlap"),
            "{error}"
        );
    }
    memory[place + 3] = corners[0] + 5.0;
    assert!(Bowl::read(*bed.bowl.spec(), &memory, &bed.simulation).is_ok());
}

/// Rms speed of the grains.
pub(super) fn speed(simulation: &Simulation) -> f64 {
    let sums = simulation.held(|_| true).fold([0.0; 2], |[e, m], g| {
        [e + g.mass * g.velocity.norm_squared(), m + g.mass]
    });
    (sums[0] / sums[1]).sqrt()
}

/// A bed at rest that has been cut for a while grows by a patch: it is no more disturbed than by the cut itself, and so is the
/// patch; the mean stress and the height of its grains are those of the bed. It gives the patch back, and is as it was.
#[test]
fn a_bed_at_rest_grows_and_shrinks_at_rest() {
    let mut whole = rested();
    let mut bed = Bed::cut();
    let cut = (0..10).map(|_| {
        bed.advance(0.2, 1.0);
        speed(&bed.simulation)
    });
    let cut = cut.fold(0.0, f64::max);
    bed.advance(8.0, 0.9);
    let face = bed.face();
    let range = [face - 2.0, face];
    let before = stresses(&mut whole, range);
    let count = bed.simulation.grain_count();
    let ids = bed.stored([face - 1.5, face + 2.0]);
    let height = |simulation: &Simulation| {
        let of = simulation
            .held(|_| true)
            .filter(|g| ids.binary_search(&g.id).is_ok());
        of.map(|g| g.position.z).sum::<f64>() / ids.len() as f64
    };
    bed.grow();
    let grown = (0..10).map(|_| {
        bed.advance(0.2, 1.0);
        speed(&bed.simulation)
    });
    let grown = grown.fold(0.0, f64::max);
    bed.advance(8.0, 0.9);
    bed.advance(2.0, 1.0);
    let after = stresses(&mut bed.simulation, range);
    let heights = [height(&whole), height(&bed.simulation)];
    let now = speed(&bed.simulation);
    let books = bed.books();
    println!(
        "largest speeds after the cut {cut:.1e}, after the growth {grown:.1e}, at rest {now:.1e}; stress {after:.3?} of {before:.3?}; heights \
         {heights:.3?}; books {books:?}"
    );
    assert!(grown < 1.5 * cut && now < 0.05, "{grown} {cut} {now}");
    assert!(
        (after[1] / before[1] - 1.0).abs() < 0.15,
        "{after:?} {before:?}"
    );
    assert!((heights[1] - heights[0]).abs() < 0.1, "{heights:?}");
    assert!(
        books[0].abs() < 5e-3 && books[1].abs() < 1e-12 && books[2] < 1e-12 && books[3] < 1e-12
    );
    assert!(
        bed.bowl
            .move_side(RIGHT, false, &mut bed.simulation)
            .unwrap()
    );
    assert_eq!(bed.face(), face);
    let left = bed.simulation.grain_count();
    bed.advance(6.0, 0.9);
    bed.advance(2.0, 1.0);
    let (now, books) = (speed(&bed.simulation), bed.books());
    println!("given back: {left} grains of {count}, speed {now:.1e}, books {books:?}");
    assert!(left.abs_diff(count) < 20 && now < 0.05);
    assert!(books[0].abs() < 5e-3 && books[2] < 1e-12 && books[3] < 1e-12);
}

/// What a box remembers comes back from its numbers after it has grown; a budget keeps it where it is.
#[test]
fn a_box_that_has_grown_goes_on_from_its_numbers_and_within_its_budget() {
    let mut bed = Bed::cut();
    bed.advance(1.0, 1.0);
    bed.grow();
    let mut memory = Vec::new();
    bed.bowl.write(&mut memory);
    let record = bed.simulation.checkpoint();
    let resumed = Simulation::resume(setup(rested().grain_list()), &record).unwrap();
    let bowl = Bowl::read(*bed.bowl.spec(), &memory, &resumed).unwrap();
    let mut other = Bed {
        simulation: resumed,
        bowl,
        damped: Vector3::zeros(),
    };
    for bed in [&mut bed, &mut other] {
        bed.advance(1.0, 1.0);
        bed.grow();
        bed.advance(0.5, 1.0);
    }
    assert_eq!(bed.bowl.moves(), other.bowl.moves());
    assert_eq!(bed.bowl.moves().len(), 2);
    assert_eq!(bed.simulation.state_hash(), other.simulation.state_hash());
    let [mut ours, mut theirs] = [Vec::new(), Vec::new()];
    bed.bowl.write(&mut ours);
    other.bowl.write(&mut theirs);
    assert_eq!(ours, theirs);

    let most = Bed::cut().simulation.grain_count() as f64 + 1.0;
    let mut kept = Bed::with(Travel {
        budget: most,
        ..TRAVEL
    });
    let made = kept.bowl.move_side(RIGHT, true, &mut kept.simulation);
    assert!(!made.unwrap());
    assert_eq!(
        (kept.bowl.refused_moves(), kept.bowl.moves().len()),
        (1.0, 0)
    );
    assert!(kept.simulation.grain_count() as f64 <= most);
    // Grains beside both sides are fast for many exchanges: each wants to go out once.
    kept = Bed::with(Travel {
        budget: most,
        wake: 1e-9,
        rest: 0.0,
        ..TRAVEL
    });
    kept.advance(4.0, 1.0);
    assert_eq!(kept.bowl.refused_moves(), 2.0);
}

/// A budget is of grains that move: with those on the floor of the middle held in place, a side goes out within a budget that all
/// grains together exceed, and not within one that those which move exceed.
#[test]
fn a_budget_of_a_box_is_of_free_grains() {
    let with = |budget: f64| {
        let mut bed = Bed::with(Travel { budget, ..TRAVEL });
        let middle = |g: &GrainSample| (g.position.x - 0.5 * SIZE[0]).abs() < 2.0;
        let floor = |g: &GrainSample| g.position.z < 1.0 && middle(g);
        bed.simulation.fix(floor).unwrap();
        let made = bed
            .bowl
            .move_side(RIGHT, true, &mut bed.simulation)
            .unwrap();
        let free = bed.simulation.held(|_| true).filter(|g| !g.fixed).count() as f64;
        (made, free, bed.simulation.grain_count() as f64)
    };
    let (made, free, all) = with(f64::INFINITY);
    let held = all - free;
    println!("{free} free grains and {held} that are held");
    assert!(made && held >= 20.0);
    // What has no room is left out when grains come back: a few.
    assert!(with(free + 0.5 * held).0);
    assert!(!with(free - 0.5 * held).0);
}

/// Grains are thrown up in the middle of a bed at rest: both sides, where nothing moves, come nearer; then those beside a
/// side are thrown, and it goes out again.
#[test]
fn sides_move_by_what_the_grains_beside_them_do() {
    let mut bed = Bed::with(Travel {
        rest: 0.1,
        wake: 0.3,
        hold: 0.3,
        ..TRAVEL
    });
    let reasons = |bed: &Bed| -> Vec<(usize, Reason)> {
        bed.bowl
            .moves()
            .iter()
            .map(|m| (m.side, m.reason))
            .collect()
    };
    bed.advance(6.0, 0.8);
    let calm = reasons(&bed);
    let throw = |bed: &mut Bed, range: std::ops::Range<f64>| {
        let before = bed.bowl.grain_momentum(&mut bed.simulation);
        bed.simulation.give_velocity(|g| {
            match range.contains(&g.position.x) && g.position.z > 6.0 {
                true => 2.0 * Vector3::z(),
                false => g.velocity,
            }
        });
        bed.damped += bed.bowl.grain_momentum(&mut bed.simulation) - before;
    };
    throw(&mut bed, 12.2..13.8);
    bed.advance(1.5, 1.0);
    let rested = reasons(&bed);
    let face = bed.face();
    throw(&mut bed, face - 4.0..face);
    bed.advance(0.6, 1.0);
    let woken = reasons(&bed);
    println!("{calm:?}\n{rested:?}\n{woken:?}\n{:?}", bed.books());
    assert!(calm.is_empty());
    assert!(rested.contains(&(RIGHT, Reason::Rest)) && rested.contains(&(0, Reason::Rest)));
    assert!(woken[rested.len()..].contains(&(RIGHT, Reason::Speed)));
    let books = bed.books();
    assert!(
        books[0].abs() < 0.02 && books[1].abs() < 1e-12 && books[2] < 1e-12 && books[3] < 1e-12
    );
}

/// What the monitors say of energy is what the grains book of their loads.
#[test]
fn the_joint_knows_what_it_does_to_the_energy_of_grains() {
    let mut bed = Bed::cut();
    bed.simulation
        .give_velocity(|g| 0.2 * (0.7 * g.position.x).sin() * Vector3::new(1.0, 0.0, -0.5));
    bed.simulation.open_energy_ledger();
    bed.advance(1.0, 1.0);
    let booked = bed.simulation.energy_ledger().unwrap();
    let monitors = bed.bowl.monitors();
    let sizes: f64 = monitors.work.iter().map(|w| w.abs()).sum();
    let miss = monitors.work.iter().sum::<f64>() - booked.loads;
    println!(
        "work {:.4?}, of all loads {:.4}; off by {:.1e} of the sizes; temperatures {:?}",
        monitors.work,
        booked.loads,
        miss / sizes,
        monitors.temperatures()
    );
    // Powers are those of the instants when loads are laid: measured 4 %.
    assert!(miss.abs() < 0.08 * sizes, "{miss} {sizes}");
    assert!(monitors.work[1] < 0.0, "an impedance absorbs");
    assert!(monitors.temperatures().iter().all(|t| *t > 0.0));
}

/// A box that watches how dilute the grains of its inner overlaps are goes outwards where they are loose or warm, and stays
/// where they rest, or move as one as fast as the warm ones do.
#[test]
fn loose_and_warm_grains_move_the_box() {
    #[derive(Clone, Copy, PartialEq)]
    enum Case {
        Rest,
        Loose,
        Warm,
        AsOne,
    }
    const SPEED: f64 = 0.5;
    let run = |case: Case| {
        let mut whole = rested();
        let mut spec = spec(&mut whole, TRAVEL, f64::INFINITY);
        if let Some(growth) = &mut spec.growth {
            growth.travel.dense = DenseLimits {
                loosest: 0.9,
                warmest: 0.001,
                ..DenseLimits::NONE
            };
        }
        // Before what is warm has cooled, and before waves come from the walls.
        spec.settings.exchange_time = spec.settings.load_time;
        let mut grains = whole.grain_list();
        if case == Case::Loose {
            let mut number = 0;
            // Every fourth of those inside the inner overlap at high x and before it.
            grains.retain(|g| {
                number += usize::from((13.0..20.0).contains(&g.position.x));
                !(13.0..20.0).contains(&g.position.x) || number % 4 != 0
            });
        }
        for (number, grain) in grains.iter_mut().enumerate() {
            let sign = |bit: usize| if (number >> bit) & 1 == 0 { 1.0 } else { -1.0 };
            let each = SPEED / 3.0_f64.sqrt();
            grain.velocity = match case {
                Case::Warm => each * Vector3::new(sign(0), sign(1), sign(2)),
                Case::AsOne => SPEED * Vector3::x(),
                _ => Vector3::zeros(),
            };
        }
        let mut simulation = match case {
            Case::Rest => whole,
            _ => Simulation::new(setup(grains)).unwrap(),
        };
        let mut bowl = Bowl::cut(spec, &mut simulation).unwrap();
        let each = bowl.spec().settings.steps_of_loads(simulation.timestep());
        let mut exchanges = 0;
        while bowl.moves().is_empty() && exchanges < 2 {
            for _ in 0..each {
                bowl.see_step(&simulation);
                simulation.advance(1).unwrap();
            }
            bowl.go_on(&mut simulation).unwrap();
            exchanges += usize::from(bowl.at_exchange());
        }
        let found = bowl.moves().first().map(|m| (m.reason, m.value, m.side));
        println!("{found:?}");
        found
    };
    assert_eq!(run(Case::Rest), None);
    assert_eq!(run(Case::AsOne), None);
    let (reason, packing, side) = run(Case::Loose).unwrap();
    assert_eq!((reason, side), (Reason::Loose, RIGHT));
    assert!((0.65..0.88).contains(&packing), "{packing}");
    let (reason, share, _) = run(Case::Warm).unwrap();
    assert_eq!(reason, Reason::Warm);
    // ρ v²/3 = 0.05 at the start under a mean pressure of some 3.
    assert!((0.001..0.05).contains(&share), "{share}");
}
