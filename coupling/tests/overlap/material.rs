//! A column that is continuum behind an edge that moves with the material, and grains in front of it.

use super::world::{DENSITY, STEP, STIFFNESS, law};
use colluvium_continuum::column_collapse::{CollapseCase, CollapseGround};
use colluvium_continuum::free_surface::SurfaceOptions;
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::overlap::material_edge::{
    GrainZone, MaterialEdge, MaterialEdgeSpec, Side, Travel,
};
use colluvium_coupling::overlap::{DenseLimits, OverlapSettings, Reason, Scales};
use colluvium_dem::preparation::*;
use colluvium_dem::*;
use nalgebra::Vector3;
use std::ops::ControlFlow;
use std::sync::OnceLock;

const LENGTH: f64 = 20.0;
pub const HEIGHT: f64 = 8.0;
pub const WIDTH: f64 = 5.0;
pub const EDGE: f64 = 6.0;

pub fn setup(grains: Vec<Grain>, gate: bool) -> Setup {
    setup_of(LENGTH, grains, gate)
}

/// Of a column of another length.
pub fn setup_of(length: f64, grains: Vec<Grain>, gate: bool) -> Setup {
    let mut walls = vec![
        Wall::plane(Vector3::zeros(), Vector3::x()),
        Wall::plane(Vector3::zeros(), Vector3::z()),
    ];
    if gate {
        walls.push(Wall::plane(length * Vector3::x(), -Vector3::x()));
    }
    Setup {
        domain: domain(length),
        gravity: -Vector3::z(),
        law: law().into(),
        grains,
        walls,
        bodies: Vec::new(),
        timestep: STEP,
        threads: Threads::Serial,
    }
}

fn domain(length: f64) -> Domain {
    Domain {
        lower: Vector3::new(0.0, 0.0, -1.0),
        upper: Vector3::new(3.0 * length, WIDTH, 4.0 * HEIGHT),
        periodic: [false, true, false],
    }
}

/// Grains at rest between the wall and a gate, cut level.
pub fn settled() -> &'static [Grain] {
    static COLUMN: OnceLock<Vec<Grain>> = OnceLock::new();
    COLUMN.get_or_init(|| settle(LENGTH))
}

/// The same in a column of another length.
pub fn settle(length: f64) -> Vec<Grain> {
    let radius = RadiusLaw::Uniform {
        low: 0.45,
        high: 0.55,
    };
    let cloud = Insertion {
        region: Region::Block {
            lower: Vector3::zeros(),
            upper: Vector3::new(length, WIDTH, 2.6 * HEIGHT),
        },
        domain: domain(length),
        ingredients: vec![Ingredient::alone(radius, DENSITY)],
        amount: Amount::Grains((48.0 * length) as usize),
        gap: 0.0,
        velocity: Vector3::zeros(),
        tries: TRIES,
        seed: 5,
    };
    let (grains, _) = insert_loose(&cloud, &[]).unwrap();
    let mut simulation = Simulation::new(setup_of(length, grains, true)).unwrap();
    let rest = Relaxation {
        rest: Rest {
            kinetic: 1e-7,
            unbalanced: 0.01,
        },
        ..Relaxation::under(1.0)
    };
    let mut go = |_: &RestMeasures| ControlFlow::Continue(());
    relax(&mut simulation, &rest, &mut go).unwrap();
    simulation.remove(|g| g.position.z > HEIGHT - 0.3);
    relax(&mut simulation, &rest, &mut go).unwrap();
    simulation.grain_list()
}

pub fn spec(
    solid_fraction: f64,
    uncoupled: bool,
    place: f64,
    travel: Option<Travel>,
) -> MaterialEdgeSpec {
    stiff_spec(solid_fraction, STIFFNESS, uncoupled, place, travel)
}

/// With contacts of another stiffness.
pub fn stiff_spec(
    solid_fraction: f64,
    stiffness: f64,
    uncoupled: bool,
    place: f64,
    travel: Option<Travel>,
) -> MaterialEdgeSpec {
    let scales = Scales {
        diameter: 1.0,
        time: 1.0,
        density: solid_fraction * DENSITY,
        stiffness,
    };
    let settings = OverlapSettings {
        uncoupled,
        ..OverlapSettings::default()
    };
    let cells = 48;
    MaterialEdgeSpec {
        case: CollapseCase {
            aspect: HEIGHT / LENGTH,
            height: HEIGHT,
            gravity: 1.0,
            rheology: MuI::new(0.36, 0.70, 0.3, 1.0, solid_fraction, DENSITY),
            cells,
            length_scaled: cells as f64 / HEIGHT,
            overhang_degrees: 0.0,
        },
        options: SurfaceOptions::default(),
        side: Side::Below,
        place,
        wall: 0.0,
        back: 0.0,
        slab: WIDTH,
        settings: settings.resolve(&scales, false).unwrap(),
        travel,
    }
}

/// Solid fraction in its middle.
pub fn settled_fraction() -> f64 {
    let middle = Region::Block {
        lower: Vector3::new(2.0, 0.0, 1.0),
        upper: Vector3::new(LENGTH - 2.0, WIDTH, HEIGHT - 1.5),
    };
    solid_fraction(settled(), &domain(LENGTH), &middle)
}

pub struct Joined {
    pub simulation: Simulation,
    pub zone: GrainZone,
    /// Momentum of the grains that damping gave (negative: took), along x and z.
    pub damped: [f64; 2],
}

impl Joined {
    fn new(gate: bool, uncoupled: bool) -> Self {
        Self::with_edge(gate, uncoupled, EDGE, None)
    }

    pub fn with_edge(gate: bool, uncoupled: bool, place: f64, travel: Option<Travel>) -> Self {
        let simulation = Simulation::new(setup(settled().to_vec(), gate)).unwrap();
        Self::cut(
            simulation,
            &[spec(settled_fraction(), uncoupled, place, travel)],
        )
    }

    pub fn cut(simulation: Simulation, specs: &[MaterialEdgeSpec]) -> Self {
        Self::cut_over(simulation, specs, None)
    }

    pub fn cut_over(
        mut simulation: Simulation,
        specs: &[MaterialEdgeSpec],
        ground: Option<&CollapseGround>,
    ) -> Self {
        let zone = GrainZone::cut(specs, ground, &mut simulation).unwrap();
        Self {
            simulation,
            zone,
            damped: [0.0; 2],
        }
    }

    pub fn edge(&self) -> &MaterialEdge {
        &self.zone.edges()[0]
    }

    pub fn advance(&mut self, time: f64, keep: f64) {
        let step = self.simulation.timestep();
        let each = self.edge().spec().settings.steps_of_loads(step);
        let all = (time / step).round() as u64;
        for _ in 0..all / each {
            for _ in 0..each {
                self.zone.see_step(&self.simulation);
                self.simulation.advance(1).unwrap();
            }
            let moves = self.edge().moves().len();
            self.zone.go_on(&mut self.simulation).unwrap();
            if self.edge().moves().len() > moves {
                println!("{:.3?}", self.edge().moves().last());
            }
            if keep < 1.0 && self.zone.at_exchange() {
                let before = self.zone.grain_momentum(&mut self.simulation);
                self.simulation.damp(keep);
                let after = self.zone.grain_momentum(&mut self.simulation);
                for axis in 0..2 {
                    self.damped[axis] += after[axis] - before[axis];
                }
            }
        }
    }

    /// Rms velocities of the grains and of the continuum.
    pub fn speeds(&mut self) -> [f64; 2] {
        let grains = self.simulation.held(|_| true);
        let [twice, mass] = grains.fold([0.0; 2], |[e, m], g| {
            [e + g.mass * g.velocity.norm_squared(), m + g.mass]
        });
        let continuum = 2.0 * self.zone.continuum_kinetic() / self.zone.continuum_mass();
        [twice / mass, continuum].map(f64::sqrt)
    }

    /// Mean of the continuum's pressure over the weight above, behind the edge and in the overlap, in cells at least
    /// a quarter of the height below the surface.
    fn pressures(&self) -> [f64; 2] {
        let density = self.edge().spec().density();
        let top = self.zone.continua()[0].heights().1[2];
        let [_, inner] = self.edge().spec().zones();
        let mut sums = [[0.0; 2]; 2];
        for f in self.zone.continua()[0].collapse().fields() {
            let [x, z] = [0, 1].map(|a| 0.5 * (f.lower[a] + f.upper[a]));
            if z > 0.75 * top || x > EDGE + inner || f.pressure <= 0.0 {
                continue;
            }
            let zone = usize::from(x > EDGE);
            sums[zone][0] += f.pressure;
            sums[zone][1] += density * (top - z);
        }
        sums.map(|[p, weight]| p / weight)
    }
}

/// What a column behind its gate does when it is left alone.
struct Calm {
    /// Rms velocities of the grains and of the continuum, over √(g d).
    speeds: [f64; 2],
    /// The continuum's pressure over the weight above, behind the edge and in the overlap.
    pressures: [f64; 2],
    /// Most that the handshake surface has moved in a row (d).
    moved: f64,
    escaped: f64,
}

fn rest(uncoupled: bool, time: f64) -> Calm {
    let mut joined = Joined::new(true, uncoupled);
    joined.advance(15.0, 0.9);
    let before = joined.edge().handshake().to_vec();
    joined.advance(time, 1.0);
    let monitors = joined.edge().monitors();
    let escaped = monitors.escaped;
    let pairs = joined.edge().handshake().iter().zip(&before);
    let moved = pairs.map(|(x, before)| (x - before).abs());
    let moved = moved.fold(0.0, f64::max);
    let fastest = joined.simulation.held(|_| true);
    let fastest = fastest.max_by(|a, b| a.velocity.norm().total_cmp(&b.velocity.norm()));
    println!(
        "force ratio {:.3}, packing {:.3}, slip {:.1e}, fastest {:?}",
        monitors.force_ratio(),
        joined.edge().packing_ratio(),
        monitors.mean_slip(),
        fastest.map(|g| (g.position, g.velocity))
    );
    let rest = Calm {
        speeds: joined.speeds(),
        pressures: joined.pressures(),
        moved,
        escaped,
    };
    let ([grains, continuum], pressures) = (rest.speeds, rest.pressures);
    println!(
        "uncoupled {uncoupled}: grains {grains:.1e}, continuum {continuum:.1e}, pressure over weight {pressures:.3?}, moved {moved:.3}, \
         escaped {escaped}"
    );
    rest
}

/// A column behind a gate: both sides rest, and the pressure of the continuum is the weight above. What moves still is a
/// single grain of the shell that hangs by one or two contacts and rattles under its share of the traction. With nothing
/// exchanged grains and continuum fall into each other.
#[test]
fn a_column_behind_a_gate_stays_at_rest_and_bears_its_weight() {
    let joined = rest(false, 5.0);
    assert!(joined.speeds[0] < 0.03 && joined.speeds[1] < 1e-4);
    assert!(joined.pressures.iter().all(|p| (p - 1.0).abs() < 0.05));
    assert!(joined.moved < 0.01 && joined.escaped == 0.0);
    let control = rest(true, 5.0);
    assert!(control.escaped > 0.0 && control.pressures[1] < 0.8);
}

/// What the monitors say of energy is what the grains book of their loads, and of temperature that what moves is warm.
#[test]
fn the_joint_knows_what_it_does_to_the_energy_of_grains() {
    let mut joined = Joined::new(false, false);
    joined.simulation.open_energy_ledger();
    joined.advance(5.0, 1.0);
    let booked = joined.simulation.energy_ledger().unwrap();
    let monitors = joined.edge().monitors();
    let sizes: f64 = monitors.work.iter().map(|w| w.abs()).sum();
    let miss = monitors.work.iter().sum::<f64>() - booked.loads;
    println!(
        "work {:.4?}, of all loads {:.4}; off by {:.1e} of the sizes; temperatures {:?}",
        monitors.work,
        booked.loads,
        miss / sizes,
        monitors.temperatures()
    );
    assert!(booked.error() < 1e-10);
    assert!(miss.abs() < 0.05 * sizes, "{miss} {sizes}");
    assert!(monitors.work[1] < 0.0, "an impedance absorbs");
    assert!(monitors.temperatures().iter().all(|t| *t > 0.0));
}

pub const TRAVEL: Travel = Travel {
    width: 3.0,
    rest: 0.05,
    wake: 0.06,
    hold: 0.4,
    budget: f64::INFINITY,
    fewest: 20.0,
    dense: DenseLimits::NONE,
};

/// A column without a gate, its edge close behind the front: grains are put back where the continuum begins to move, and
/// become continuum where they have come to rest. Whole strips change hands, and every book closes.
#[test]
fn an_edge_goes_with_the_flow_and_keeps_its_books() {
    let mut joined = Joined::with_edge(false, false, 11.0, Some(TRAVEL));
    let before = joined.simulation.grain_count() as f64;
    joined.advance(34.0, 1.0);
    let (zone, edge) = (&joined.zone, joined.edge());
    let [inwards, outwards] = [1.0, -1.0].map(|sign| {
        let of = edge.moves().iter().filter(|m| m.mass * sign > 0.0);
        of.count()
    });
    assert!(inwards > 0 && outwards > 0);
    let last = edge.moves().last().unwrap();
    assert_eq!(last.grains, joined.simulation.grain_count() as f64);
    assert_eq!(last.edge, edge.travelled());
    assert!((edge.travelled() - 3.0 * (outwards as f64 - inwards as f64)).abs() < 1e-9);
    let most = edge.moves().iter().map(|m| m.grains).fold(0.0, f64::max);
    assert!(most > before);
    let account = zone.account(&joined.simulation);
    let owed = zone.owed(&joined.simulation);
    let (mass, volume) = (zone.mass_error(&joined.simulation), zone.volume_error());
    let now = joined.zone.grain_momentum(&mut joined.simulation);
    let (grains, exchange) = (account.grains_error(now), account.exchange_error(owed));
    println!("mass {mass:.2e}, volume {volume:.1e}, ledgers {grains:.1e} {exchange:.1e}");
    // A few hundred grains, whose strips and the continuum in their place differ by some grains.
    assert!(mass.abs() < 0.04 && volume.abs() < 1e-12);
    assert!(grains < 1e-12 && exchange < 1e-12);
    // Without what the moves handed over, the grains' account would not close.
    let mut blind = account;
    blind.handed.fill(0.0);
    assert!(blind.grains_error(now) > 1e-9);
}

/// An edge that nothing wakes comes back for what its continuum cannot be, and stays where limits are met: those of what is
/// sheared fast, of grains that are loose, and of grains that are warm.
#[test]
fn an_edge_comes_back_for_what_no_dense_continuum_is() {
    let moves = |dense: DenseLimits| {
        let travel = Travel {
            rest: 1e-6,
            wake: 1e3,
            dense,
            ..TRAVEL
        };
        let mut joined = Joined::with_edge(false, false, 11.0, Some(travel));
        joined.advance(4.0, 1.0);
        let moves = joined.edge().moves().iter();
        let found: Vec<_> = moves.map(|m| (m.reason, m.value)).collect();
        println!("{dense:?}: {found:?}");
        found
    };
    let none = DenseLimits::NONE;
    assert!(moves(none).is_empty());
    let fastest = |fastest| moves(DenseLimits { fastest, ..none });
    let loosest = |loosest| moves(DenseLimits { loosest, ..none });
    let warmest = |warmest| moves(DenseLimits { warmest, ..none });
    for (found, met, reason) in [
        (fastest(1e-3), fastest(10.0), Reason::Inertial),
        (loosest(0.99), loosest(0.5), Reason::Loose),
        (warmest(1e-3), warmest(1.0), Reason::Warm),
    ] {
        assert!(met.is_empty(), "{met:?}");
        assert!(!found.is_empty() && found.iter().all(|(why, _)| *why == reason));
    }
}

/// What an edge remembers comes back from its numbers, strips and moves included; a budget keeps it where it is.
#[test]
fn a_journey_goes_on_from_its_numbers_and_within_its_budget() {
    let mut joined = Joined::with_edge(false, false, 11.0, Some(TRAVEL));
    joined.advance(9.0, 1.0);
    let mut memory = Vec::new();
    joined.zone.write(&mut memory);
    let record = joined.simulation.checkpoint();
    let spec = *joined.edge().spec();
    let resumed = Simulation::resume(setup(settled().to_vec(), false), &record).unwrap();
    let zone = GrainZone::read(&[spec], None, &memory, &resumed).unwrap();
    let mut other = Joined {
        simulation: resumed,
        zone,
        damped: [0.0; 2],
    };
    joined.advance(9.0, 1.0);
    other.advance(9.0, 1.0);
    assert_eq!(joined.edge().moves(), other.edge().moves());
    assert!(!joined.edge().moves().is_empty());
    assert_eq!(
        joined.simulation.state_hash(),
        other.simulation.state_hash()
    );
    let [mut ours, mut theirs] = [Vec::new(), Vec::new()];
    joined.zone.write(&mut ours);
    other.zone.write(&mut theirs);
    assert_eq!(ours, theirs);

    // A budget is of free grains: those of the floor do not count.
    let free = |of: &Joined| of.simulation.held(|_| true).filter(|g| !g.fixed).count() as f64;
    let most = free(&joined);
    println!(
        "{} grains, {most} of them free",
        joined.simulation.grain_count()
    );
    let small = Travel {
        budget: most - 1.0,
        ..TRAVEL
    };
    let mut kept = Joined::with_edge(false, false, 11.0, Some(small));
    kept.advance(13.0, 1.0);
    assert!(kept.edge().refused_moves() > 0.0);
    assert!(kept.edge().refused_moves() < 0.1 * kept.zone.exchanges() as f64);
    assert!(free(&kept) < most);
}

/// Mean spin about y and granular part of it (rms about the mean), of grains that were so far from the edge at the start,
/// averaged over a time.
fn spins(
    until: f64,
    from: f64,
    mut advance: impl FnMut(f64),
    look: impl Fn() -> Vec<GrainSample>,
) -> [[f64; 2]; 4] {
    const ENDS: [f64; 4] = [2.0, 3.0, 6.0, 9.0];
    let labels: Vec<f64> = settled().iter().map(|g| g.position.x - EDGE).collect();
    let mut sums = [[0.0; 3]; 4];
    let each = 0.1;
    for k in 0..(until / each) as usize {
        advance(each);
        if (k as f64) * each < from {
            continue;
        }
        for grain in look() {
            let label = labels[grain.id as usize];
            let zone = ENDS
                .iter()
                .position(|end| label < *end)
                .filter(|_| label >= 0.0);
            if let Some(zone) = zone {
                let sum = &mut sums[zone];
                sum[0] += 1.0;
                sum[1] += grain.spin.y;
                sum[2] += grain.spin.norm_squared();
            }
        }
    }
    sums.map(|[n, spin, square]| [spin / n, (square / n).sqrt()])
}

/// The shell has no grains behind it. The inner overlap and what lies beyond do not know of it.
#[test]
fn spins_near_the_edge_beside_grains_alone() {
    let (until, from) = (7.0, 2.0);
    let alone = std::cell::RefCell::new(Simulation::new(setup(settled().to_vec(), false)).unwrap());
    let full = spins(
        until,
        from,
        |time| {
            alone
                .borrow_mut()
                .advance((time / STEP).round() as u64)
                .unwrap()
        },
        || alone.borrow().held(|_| true).collect(),
    );
    let joined = std::cell::RefCell::new(Joined::new(false, false));
    let beside = spins(
        until,
        from,
        |time| joined.borrow_mut().advance(time, 1.0),
        || joined.borrow().simulation.held(|_| true).collect(),
    );
    for (zone, name) in ["shell", "buffer", "inner", "beyond"]
        .into_iter()
        .enumerate()
    {
        let ([a, b], [c, d]) = (full[zone], beside[zone]);
        println!("{name}: grains alone {a:+.4} ({b:.4}), joined {c:+.4} ({d:.4})");
    }
    let ratio = |zone: usize| beside[zone][1] / full[zone][1] - 1.0;
    assert!(ratio(0) > 1.0, "{}", ratio(0));
    assert!(
        ratio(2).abs() < 0.15 && ratio(3).abs() < 0.15,
        "{} {}",
        ratio(2),
        ratio(3)
    );
}
