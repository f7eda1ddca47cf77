//! Walls along which material slides, in space: a slab on a floor and between side walls, and the collapse of a
//! column in a channel beside the plane solver.
use colluvium_continuum::Error;
use colluvium_continuum::channel_collapse::{ChannelCase, ChannelCollapse};
use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::free_surface::{Contact, SpaceFlow, SurfaceOptions};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::{Coulomb, MuI};
use colluvium_continuum::wall_friction::{SideWalls, WallFriction};

const SMOOTH: Boundary = Boundary::FreeSlip;

fn coulomb(friction: f64, cohesion: f64) -> Boundary {
    Boundary::CoulombWall {
        velocity: 0.0,
        friction: WallFriction { friction, cohesion },
    }
}

fn bounded(length: f64, cells: usize, low: Boundary, high: Boundary) -> Axis {
    Axis::Bounded {
        length,
        cells,
        low,
        high,
    }
}

fn periodic(length: f64) -> Axis {
    Axis::Periodic { length, cells: 3 }
}

fn precise() -> SurfaceOptions {
    let mut options = SurfaceOptions::default();
    options.solver.strain_rate_floor = 1e-7;
    options.solver.momentum_tolerance = 1e-9;
    options.solver.stress_tolerance = 1e-8;
    options.solver.tolerance_in_motion = 1.0;
    options.solver.linear_tolerance = 1e-9;
    options
}

/// A layer of depth one, its surface inside a cell, under gravity one; the material stays rigid.
fn slab(x: Axis, y: Axis, floor: Boundary, gravity: [f64; 3]) -> SpaceFlow<MuI> {
    let cells = 6;
    let h = 1.25 / cells as f64;
    let columns = x.cells() * y.cells();
    let layers = (0..cells).map(|k| (1.0 / h - k as f64).clamp(0.0, 1.0));
    SpaceFlow::in_space(
        Grid::with_moving_surface([x, y, bounded(1.25, cells, floor, SMOOTH)]).unwrap(),
        layers.flat_map(|f| vec![f; columns]).collect(),
        MuI::new(0.5, 0.7, 0.4, 0.04, 1.0, 1.0),
        gravity,
        precise(),
    )
    .unwrap()
}

/// A floor that moves along x shears what lies on it along x and not along y.
#[test]
fn a_moving_floor_shears_along_its_own_axis() {
    let floor = Boundary::NoSlip { velocity: 1.0 };
    let flow = slab(periodic(0.6), periodic(0.6), floor, [0.0, 0.0, -1.0]);
    let fields = flow.cell_fields();
    let rate = 1.0 / (1.5 * (fields[0].upper[2] - fields[0].lower[2]));
    assert!((fields[0].strain_rate / rate - 1.0).abs() < 1e-12);
}

/// Matter that bears a given stress and nothing more flows as a block between upright rough walls, which hold it where they
/// touch it: a = g − 2 c/W, however full its highest cells are.
#[test]
fn upright_rough_walls_hold_what_touches_them() {
    let (cohesion, pull, depth) = (0.05, 0.5, 0.5);
    let law = Coulomb {
        mu: 0.0,
        cohesion,
        viscosity: 0.0,
        density: 1.0,
    };
    let rough = Boundary::NoSlip { velocity: 0.0 };
    for fill in [0.3, 0.6, 0.9] {
        let h = depth / (2.0 + fill);
        let grid = Grid::with_moving_surface([
            periodic(0.6),
            bounded(1.0, 4, rough, rough),
            bounded(4.0 * h, 4, SMOOTH, SMOOTH),
        ]);
        let layers = [1.0, 1.0, fill, 0.0].into_iter();
        let mut flow = SpaceFlow::in_space(
            grid.unwrap(),
            layers.flat_map(|f| [f; 12]).collect(),
            law,
            [pull, 0.0, -1.0],
            precise(),
        )
        .unwrap();
        flow.accelerate_in_place(0.5).unwrap();
        let found = flow.momentum()[0] / (0.5 * flow.volume());
        let exact = pull - 2.0 * cohesion;
        assert!(
            (found / exact - 1.0).abs() < 1e-3,
            "{fill}: {found} {exact}"
        );
    }
}

/// All constructors begin with the weight of what stands on the floor, and refuse what cannot be matter within a grid.
#[test]
fn matter_begins_under_its_weight_and_within_range() {
    let floor = Boundary::NoSlip { velocity: 0.0 };
    let flow = slab(periodic(0.6), periodic(0.6), floor, [0.0, 0.0, -1.0]);
    let h = 1.25 / 6.0;
    assert!((flow.state().pressure[0] - (1.0 - 0.5 * h)).abs() < 1e-12);

    let make = |fractions: Vec<f64>, top: Boundary| {
        let z = bounded(1.0, 3, floor, top);
        let grid = Grid::with_moving_surface([periodic(1.0), Axis::Flat, z]).unwrap();
        let law = MuI::new(0.5, 0.7, 0.4, 0.04, 1.0, 1.0);
        SpaceFlow::in_space(grid, fractions, law, [0.0, 0.0, -1.0], precise())
    };
    let loaded = Boundary::LoadedWall {
        velocity: 0.0,
        pressure: 1.0,
    };
    for top in [Boundary::FreeSurface, loaded] {
        let refused = make(vec![0.5; 9], top).err();
        assert!(matches!(
            refused,
            Some(Error::OutOfRange {
                key: "grid.boundary",
                ..
            })
        ));
    }
    assert!(matches!(
        make(vec![0.5; 8], SMOOTH).err(),
        Some(Error::ForeignState { .. })
    ));
    for value in [-0.1, 1.1, f64::NAN] {
        let refused = make([vec![value], vec![0.5; 8]].concat(), SMOOTH).err();
        assert!(matches!(
            refused,
            Some(Error::OutOfRange {
                key: "state.fractions",
                ..
            })
        ));
    }
    // What transport leaves behind is no reason to stop.
    let mut flow = make(vec![0.5; 9], SMOOTH).unwrap();
    let mut state = flow.state().clone();
    state.fractions[8] = -1e-18;
    flow.set_state(state.clone()).unwrap();
    flow.step(0.01).unwrap();
    state.fractions[8] = f64::NAN;
    assert!(flow.set_state(state).is_err());
}

/// A tolerance of nothing, or none, is refused where a flow is set up.
#[test]
fn tolerances_are_positive() {
    let spoil: [fn(&mut SurfaceOptions, f64); 4] = [
        |o, value| o.solver.momentum_tolerance = value,
        |o, value| o.solver.divergence_tolerance = value,
        |o, value| o.solver.stress_tolerance = value,
        |o, value| o.solver.tolerance_in_motion = value,
    ];
    for spoil in spoil {
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut options = SurfaceOptions::default();
            spoil(&mut options, value);
            assert!(options.validate().is_err(), "{value}");
        }
    }
}

/// Gravity on a slope that falls along a direction between x and y.
fn down(slope: f64, angle: f64) -> [f64; 3] {
    let along = slope.sin();
    [along * angle.cos(), along * angle.sin(), -slope.cos()]
}

/// Largest and smallest velocity of a component on faces of active cells.
fn extremes(flow: &SpaceFlow<MuI>, component: usize) -> [f64; 2] {
    let u = &flow.state().velocity[component];
    let moving = u.iter().filter(|u| u.abs() > 0.0);
    moving.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], u| {
        [low.min(*u), high.max(*u)]
    })
}

/// g (sin θ − μ cos θ), whichever way the slope falls; nothing moves where the floor holds.
#[test]
fn slab_slides_on_a_floor_with_weight_less_friction() {
    for (tangent, friction, angle) in [
        (0.30_f64, 0.2, 0.0_f64),
        (0.30, 0.2, 0.25 * std::f64::consts::PI),
        (0.40, 0.3, 0.3),
        (0.25, 0.0, 1.0),
        (0.30, 0.35, 0.7),
    ] {
        let slope = tangent.atan();
        let mut flow = slab(
            periodic(0.75),
            periodic(0.75),
            coulomb(friction, 0.0),
            down(slope, angle),
        );
        for _ in 0..3 {
            flow.accelerate_in_place(0.5).unwrap();
        }
        let expected = 1.5 * (slope.sin() - friction * slope.cos()).max(0.0);
        let mut worst = 0.0_f64;
        for (component, part) in [angle.cos(), angle.sin()].into_iter().enumerate() {
            let [low, high] = extremes(&flow, component);
            if low.is_finite() {
                worst = worst
                    .max((low - expected * part).abs())
                    .max((high - expected * part).abs());
            }
        }
        println!(
            "tan {tangent}, friction {friction}, angle {angle}: speed off by {worst:.1e} of {expected:.4}"
        );
        assert!(worst < 5e-6, "{tangent} {friction} {angle}: {worst:e}");
    }
}

/// Side walls that hold with an adhesion c take 2 c/W off the acceleration, floor and walls together to round-off of the
/// solver: a floor and a wall that meet at an edge bear their own loads. Smooth walls take off nothing.
#[test]
fn side_walls_take_their_part_of_the_weight() {
    let (slope, width) = (0.4_f64.atan(), 0.8);
    for (wall, floor, off) in [
        (coulomb(0.0, 0.03), coulomb(0.1, 0.0), 0.075),
        (coulomb(0.0, 0.03), SMOOTH, 0.075),
        (SMOOTH, coulomb(0.1, 0.0), 0.0),
    ] {
        let y = bounded(width, 4, wall, wall);
        let mut flow = slab(periodic(0.75), y, floor, down(slope, 0.0));
        for _ in 0..2 {
            flow.accelerate_in_place(0.5).unwrap();
        }
        let friction = if floor == SMOOTH { 0.0 } else { 0.1 };
        let expected = slope.sin() - friction * slope.cos() - off;
        let [low, high] = extremes(&flow, 0);
        println!("off {off}: {low:.7} to {high:.7}, expected {expected:.7}");
        assert!((low - expected).abs() < 1e-5 && (high - expected).abs() < 1e-5);
    }
}

fn column(cells: usize) -> CollapseCase {
    CollapseCase {
        aspect: 1.0,
        height: 1.0,
        gravity: 1.0,
        rheology: MuI::new(0.381863, 0.643468, 0.279, 1.0 / 87.0, 1.0, 1.0),
        cells,
        length_scaled: 3.0,
        overhang_degrees: 0.0,
    }
}

const RUBBING: WallFriction = WallFriction {
    friction: 0.1835,
    cohesion: 0.0,
};

fn channel(width: f64, across: usize, whole: bool, walls: Contact) -> ChannelCase {
    ChannelCase {
        column: column(24),
        width,
        cells_across: across,
        whole,
        walls,
        floor: Contact::NoSlip,
    }
}

/// Runs to rest or to `end`.
fn run(case: &ChannelCase, options: &SurfaceOptions, end: f64) -> ChannelCollapse {
    let mut collapse = ChannelCollapse::new(case, options).unwrap();
    while collapse.time() < end - 1e-9 {
        let step = collapse.step(end).unwrap();
        assert!(collapse.volume_drift().abs() < 1e-12);
        if collapse.is_at_rest(&step) {
            break;
        }
    }
    collapse
}

fn run_plane(cells: usize, walls: Option<SideWalls>, end: f64) -> Collapse {
    let options = SurfaceOptions::default();
    let mut collapse = match walls {
        None => Collapse::new(&column(cells), &options),
        Some(walls) => Collapse::between_side_walls(&column(cells), &options, walls),
    }
    .unwrap();
    while collapse.time() < end - 1e-9 {
        let step = collapse.step(end).unwrap();
        if collapse.is_at_rest(&step) {
            break;
        }
    }
    collapse
}

/// Run-out, and the mean distance of the heap from x = 0, which the last thin cells at the front do not decide.
fn reach((x, h): (Vec<f64>, Vec<f64>), front: f64) -> [f64; 2] {
    let moment: f64 = x.iter().zip(&h).map(|(x, h)| x * h).sum();
    [front - 1.0, moment / h.iter().sum::<f64>()]
}

fn of_plane(collapse: &Collapse) -> [f64; 2] {
    reach(collapse.profile(), collapse.front(0.01).position)
}

fn of_channel(collapse: &ChannelCollapse) -> [f64; 2] {
    reach(collapse.profile(), collapse.front(0.01).position)
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    let miss: f64 = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum();
    miss / b.iter().sum::<f64>()
}

/// Between smooth walls every strip of the channel is the plane flow, but for planes in cells that are found in
/// another way (columns of seven cells, not three).
#[test]
fn channel_with_smooth_walls_is_the_plane_flow() {
    let plane = run_plane(24, None, 1.2);
    let case = channel(0.5, 2, false, Contact::FreeSlip);
    let collapse = run(&case, &SurfaceOptions::default(), 1.2);
    let strips = collapse.strips();
    for strip in &strips {
        let miss = difference(strip, &plane.profile().1);
        println!("strip off the plane flow by {miss:.1e}");
        assert!(miss < 4e-3 && difference(strip, &strips[0]) < 1e-6);
    }
}

/// Walls that rub hold the column back, as the plane model with the same friction spread over the width
/// does but for 0.39 of what they hold back of the run-out, 0.4 of a cell, by small time steps of first or second order;
/// smooth ones do not. The whole channel is its own mirror image.
#[test]
fn rubbing_walls_hold_the_column_back() {
    let width = 0.25;
    let walls = SideWalls {
        width,
        friction: RUBBING,
    };
    let end = 8.0;
    let options = SurfaceOptions::default();
    let free = of_plane(&run_plane(24, None, end));
    let spread = of_plane(&run_plane(24, Some(walls), end));
    let space = |walls| of_channel(&run(&channel(width, 1, false, walls), &options, end));
    let resolved = space(Contact::Coulomb(RUBBING));
    let smooth = space(Contact::FreeSlip);
    println!("run-out, centre: plane {free:.3?}, smooth walls {smooth:.3?}");
    println!("friction spread {spread:.3?}, walls in space {resolved:.3?}");
    for n in 0..2 {
        let held = free[n] - spread[n];
        assert!(held > 0.05 && (smooth[n] - free[n]).abs() < 0.2 * held);
        assert!((resolved[n] - spread[n]).abs() < 0.42 * held);
    }

    let mut options = SurfaceOptions::default();
    options.solver.linear_tolerance = 1e-9;
    let case = channel(0.5, 4, true, Contact::Coulomb(RUBBING));
    let whole = run(&case, &options, 1.0);
    println!("asymmetry {:.1e}", whole.asymmetry());
    assert!(whole.asymmetry() < 1e-9);
}

/// With one cell across half of a channel its flow is that of the plane model: run-outs 1 to 2.5 % longer, centres at
/// .661, .740, .809, .858 H for .662, .739, .809, .857 in channels .125, .25, .5 and 1 H wide (.918 without
/// walls). With four the run-out is another 2 % longer, and the front in the middle ahead of that at the wall.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn channels_by_width_and_cells() {
    let (end, options) = (8.0, SurfaceOptions::default());
    let free = of_plane(&run_plane(24, None, end));
    println!("no walls: run-out, centre {free:.3?}");
    for width in [0.125, 0.25, 0.5, 1.0] {
        let walls = SideWalls {
            width,
            friction: RUBBING,
        };
        let spread = of_plane(&run_plane(24, Some(walls), end));
        println!("width {width}: friction spread {spread:.3?}");
        for across in [1, 2, 4] {
            if width < 0.2 && across > 2 {
                continue;
            }
            let case = channel(width, across, false, Contact::Coulomb(RUBBING));
            let collapse = run(&case, &options, end);
            let found = of_channel(&collapse);
            let [at_wall, inside] = collapse.fronts_at_wall_and_inside(0.05);
            println!(
                "  {across} cells across half of it: {found:.3?}, front .05 high at the wall {at_wall:.3}, in the middle {inside:.3}"
            );
            // Fronts come in cells.
            assert!(found[0] <= free[0] && found[1] < free[1]);
            assert!((found[1] - spread[1]).abs() < 0.5 * (free[1] - spread[1]));
        }
    }
}
