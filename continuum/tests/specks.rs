//! Heaps on slopes come to rest, and so do their last specks.
use colluvium_continuum::column_collapse::{Collapse, CollapseCase, CollapseGround};
use colluvium_continuum::free_surface::{Contact, SurfaceFlow, SurfaceOptions, Terrain};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::terrain::Profile;

/// Length of the grid, in heights of the column.
const LENGTH: f64 = 5.0;
/// Where heaps run far.
const LONG: f64 = 6.0;

/// A column of aspect ratio 1.42 on level ground up to `edge`, with a slope beyond; √(H/g) is the unit of time.
fn column(grains: [f64; 2], cells: usize, edge: f64, slope: f64, points: &[f64]) -> Collapse {
    column_on(LENGTH, grains, cells, edge, slope, points)
}

fn column_on(
    length: f64,
    [mu_s, mu_2]: [f64; 2],
    cells: usize,
    edge: f64,
    slope: f64,
    points: &[f64],
) -> Collapse {
    let at = |x: f64| [x, 1.0 - slope * (x - edge)];
    let mut line = vec![[0.0, 1.0], [edge, 1.0]];
    line.extend(points.iter().map(|&x| at(x)));
    let case = CollapseCase {
        aspect: 1.42,
        height: 1.0,
        gravity: 1.0,
        rheology: MuI::new(mu_s, mu_2, 0.4, 1.0 / 30.0, 1.0, 1.0),
        cells,
        length_scaled: length,
        overhang_degrees: 0.0,
    };
    let options = SurfaceOptions {
        courant: 0.9,
        ..SurfaceOptions::default()
    };
    let ground = CollapseGround {
        profile: Profile::new(line).unwrap(),
        contact: Contact::NoSlip,
    };
    Collapse::over_ground(&case, &options, &ground, None).unwrap()
}

/// When it comes to rest, if it does by a time; volume to round-off.
fn rest(mut collapse: Collapse, until: f64) -> Option<f64> {
    let time = collapse.units().time();
    while collapse.time() < until * time * (1.0 - 1e-9) {
        let step = collapse.step(until * time).unwrap();
        if collapse.is_at_rest(&step) {
            assert!(collapse.volume_drift().abs() < 1e-13);
            return Some(collapse.time() / time);
        }
    }
    None
}

const GRAINS: [f64; 2] = [0.32, 0.60];
/// Specks that are left behind by the heap rest a little later than it does.
const UNTIL: f64 = 9.0;
/// Heaps brake the longer the nearer the slope is to their friction.
const LATE: f64 = 40.0;
/// Where slopes begin, which shifts them by parts of a cell.
const EDGES: [f64; 4] = [1.2, 1.213, 1.23, 1.247];

/// Lines on which specks slid on for ever, and one on which they did not.
#[test]
fn specks_on_slopes_come_to_rest() {
    let many: &[f64] = &[2.0, 2.7, 3.5, 4.2, 5.0];
    for (cells, edge, slope, points) in [
        (64, 1.2, 0.2, &[6.0][..]),
        (64, 1.2, 0.2, many),
        (64, 1.21, 0.2, &[5.01]),
        (64, 1.24, 0.2, &[5.04]),
        (48, 1.2, 0.2, &[5.0]),
        (48, 1.2, 0.1, &[6.0]),
    ] {
        let found = rest(column(GRAINS, cells, edge, slope, points), UNTIL);
        println!("{cells} cells, slope {slope} from {edge}: rest at {found:?}");
        assert!(found.is_some(), "{cells} {edge} {slope}");
    }
    // Less friction than the slope holds nothing.
    let slides = rest(column([0.15, 0.30], 48, 1.2, 0.2, &[6.0]), UNTIL);
    assert_eq!(slides, None);
}

/// Columns that rest on a slope, of 12: four places of the edge, three grids.
fn resting(slope: f64) -> usize {
    let mut resting = 0;
    for cells in [48, 64, 96] {
        for edge in EDGES {
            let found = rest(column_on(LONG, GRAINS, cells, edge, slope, &[9.0]), LATE);
            println!("{cells} cells, slope {slope} from {edge}: rest at {found:?}");
            resting += usize::from(found.is_some());
        }
    }
    println!("{resting} of 12 rest at {slope}");
    resting
}

/// How many of 12 rest: 8 did at 0.25 while all of what followed an unknown over ground weighed on it, and 10 at 0.1.
#[test]
#[ignore = "a minute"]
fn columns_on_many_slopes_come_to_rest() {
    for (slope, least) in [(0.1, 12), (0.15, 12), (0.2, 12), (0.25, 11), (0.28, 4)] {
        let found = resting(slope);
        assert!(found >= least, "{found} of 12 at {slope}");
    }
}

/// A film of so many cells, measured upwards, on a slope of `rise` in 8 that closes on itself, under gravity that meets it at
/// an angle of tangent `steepness`: its mean acceleration down the slope from rest, over g.
fn acceleration_of_film(cells: f64, rise: usize, steepness: f64) -> f64 {
    const PUSH: f64 = 0.01;
    let (h, slope) = (0.0625, rise as f64 / 8.0);
    let (columns, up) = (16, 2 * rise);
    let rows = up + cells.ceil() as usize + 8;
    let inclined = |z: f64| Profile::new(vec![[-1.0, z - slope], [9.0, z + 9.0 * slope]]).unwrap();
    let foot = 2.3 * h;
    let (ground, surface) = (inclined(foot), inclined(foot + cells * h));
    let fractions = (0..columns * rows)
        .map(|cell| {
            let low = [(cell % columns) as f64 * h, (cell / columns) as f64 * h];
            let high = low.map(|x| x + h);
            (surface.area_in(low, high) - ground.area_in(low, high)) / (h * h)
        })
        .collect();
    let axes = [
        Axis::Periodic {
            length: h * columns as f64,
            cells: columns,
        },
        Axis::Bounded {
            length: h * rows as f64,
            cells: rows,
            low: Boundary::NoSlip { velocity: 0.0 },
            high: Boundary::FreeSlip,
        },
    ];
    let mut options = SurfaceOptions::default();
    options.solver.strain_rate_floor = 1e-7;
    options.solver.momentum_tolerance = 1e-9;
    let tilt = steepness.atan() - slope.atan();
    let mut film: SurfaceFlow<MuI> = SurfaceFlow::over_ground(
        Grid::with_moving_surface(axes).unwrap(),
        &Terrain {
            shape: ground,
            origin: [0.0; 2],
            contact: Contact::NoSlip,
            rise: [up, 0],
        },
        fractions,
        MuI::new(GRAINS[0], GRAINS[1], 0.4, 1.0 / 30.0, 1.0, 1.0),
        [-tilt.sin(), -tilt.cos()],
        options,
    )
    .unwrap();
    film.accelerate_in_place(PUSH).unwrap();
    -film.momentum()[0] / (film.volume() * slope.atan().cos() * PUSH)
}

/// Films one to three cells thick yield where the slope is as steep as their friction: at rest on less, moving on more. They
/// yielded at 0.27 to 0.315 under 0.32 while all of what followed an unknown over ground weighed on it.
#[test]
fn films_of_a_few_cells_yield_at_their_friction() {
    for rise in [1, 2, 3] {
        for cells in [1.2, 1.4, 1.6, 2.0, 2.5, 3.0] {
            let [less, more, most] =
                [0.314, 0.33, 0.4].map(|tan| acceleration_of_film(cells, rise, tan));
            let exact = (0.4 - GRAINS[0]) / f64::hypot(1.0, 0.4);
            println!(
                "{cells} cells on {rise}/8: {less:.1e}, {more:.1e}, {:.3} of g (sin − μ cos)",
                most / exact
            );
            assert!(less < 1e-4 && more > 3e-4, "{rise} {cells} {less} {more}");
            // Less than all of it: what is next to the ground lags behind.
            assert!(
                (0.7..1.0).contains(&(most / exact)),
                "{rise} {cells} {most}"
            );
        }
    }
}
