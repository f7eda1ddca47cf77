//! Material over ground that cuts the cells of a grid in space: rest, Bagnold flow on inclines of any direction, blocks,
//! collapses.
use colluvium_continuum::free_surface::{Contact, SpaceFlow, SurfaceFlow, SurfaceOptions, Terrain};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::terrain::{GridLines, HeightRaster, Profile, Surface};
use colluvium_continuum::wall_friction::WallFriction;
use colluvium_continuum::yield_step::PrimalDualOptions;

const ROUGH: Boundary = Boundary::NoSlip { velocity: 0.0 };
const SMOOTH: Boundary = Boundary::FreeSlip;
const DIAMETER: f64 = 1.0 / 30.0;

/// μ_s 0.32, Δμ 0.28, I_0 0.4 in natural units.
fn grains() -> MuI {
    MuI::new(0.32, 0.60, 0.4, DIAMETER, 1.0, 1.0)
}

fn bounded(length: f64, cells: usize, low: Boundary, high: Boundary) -> Axis {
    Axis::Bounded {
        length,
        cells,
        low,
        high,
    }
}

fn friction(friction: f64) -> Contact {
    Contact::Coulomb(WallFriction {
        friction,
        cohesion: 0.0,
    })
}

/// Settings under which rest can be told from creep.
fn precise() -> SurfaceOptions {
    let options = SurfaceOptions {
        growth: 1e9,
        ..SurfaceOptions::default()
    };
    SurfaceOptions {
        solver: PrimalDualOptions {
            strain_rate_floor: 1e-7,
            momentum_tolerance: 1e-9,
            linear_tolerance: 1e-9,
            stress_tolerance: 1e-9,
            tolerance_in_motion: 1.0,
            ..options.solver
        },
        ..options
    }
}

/// A line of points (s, z) drawn out along the other horizontal axis; s is x, or y where the line is to run along it.
fn drawn_out(points: &[[f64; 2]], along_y: bool) -> Surface {
    let ends = [-2.0, 6.0];
    let at = |[s, z]: [f64; 2], other: f64| {
        if along_y {
            [other, s, z]
        } else {
            [s, other, z]
        }
    };
    let vertices = points.iter().flat_map(|&p| ends.map(|end| at(p, end)));
    let triangles = (0..points.len() - 1).flat_map(|n| {
        let [a, b, c, d] = [2 * n, 2 * n + 1, 2 * n + 2, 2 * n + 3];
        if along_y {
            [[a, d, c], [a, b, d]]
        } else {
            [[a, c, d], [a, d, b]]
        }
    });
    Surface::new(vertices.collect(), triangles.collect()).unwrap()
}

/// The plane z = height + slope·(x, y).
fn plane(height: f64, slope: [f64; 2]) -> Surface {
    let corners = [[-2.0, -2.0], [6.0, -2.0], [6.0, 6.0], [-2.0, 6.0]];
    let vertices = corners.map(|[x, y]| [x, y, height + slope[0] * x + slope[1] * y]);
    Surface::new(vertices.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

/// Heights between 0.1 and 0.1 + range at points 0.13 apart, drawn from a fixed sequence.
fn scattered(range: f64) -> Surface {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let heights = (0..20 * 20).map(|_| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        0.1 + range * (state >> 11) as f64 / (1_u64 << 53) as f64
    });
    HeightRaster {
        origin: [-0.5; 2],
        spacing: [0.13; 2],
        points: [20; 2],
        heights: heights.collect(),
    }
    .surface()
    .unwrap()
}

/// Part of each cell of a grid from (0, 0, 0) on that lies between a ground and a surface above it.
fn between(ground: &Surface, surface: &Surface, cells: [usize; 3], h: f64) -> Vec<f64> {
    let lines = GridLines {
        origin: [0.0; 3],
        spacing: [h; 3],
        cells,
    };
    let [ground, surface] = [ground, surface].map(|s| s.cut(&lines, false).unwrap());
    (0..cells.iter().product())
        .map(|n| {
            let index = [
                n % cells[0],
                n / cells[0] % cells[1],
                n / (cells[0] * cells[1]),
            ];
            (ground.volume_fraction(index) - surface.volume_fraction(index)).max(0.0)
        })
        .collect()
}

fn over(
    ground: &Surface,
    surface: &Surface,
    axes: [Axis; 3],
    rise: [usize; 3],
    contact: Contact,
    (law, gravity): (MuI, [f64; 3]),
) -> SpaceFlow<MuI> {
    let grid = Grid::with_moving_surface(axes).unwrap();
    let cells = grid.cell_counts();
    let h = grid.axes()[2].spacing();
    SpaceFlow::over_ground(
        grid,
        &Terrain {
            shape: ground.clone(),
            origin: [0.0; 3],
            contact,
            rise,
        },
        between(ground, surface, cells, h),
        law,
        gravity,
        precise(),
    )
    .unwrap()
}

/// A box of 1 x 1 x 1.
fn box_of(cells: usize) -> [Axis; 3] {
    let side = bounded(1.0, cells, SMOOTH, SMOOTH);
    [side, side, bounded(1.0, cells, ROUGH, SMOOTH)]
}

/// Level surfaces over an incline that leans to both axes, a step and scattered heights: nothing moves and the pressure
/// is ρ g times the depth to round-off, with friction and without, whether material stands still at the ground or slides.
#[test]
fn level_surfaces_rest_over_any_ground() {
    let without = MuI::new(0.0, 0.0, 0.4, DIAMETER, 1.0, 1.0);
    let level = 0.7131;
    let step = [[-2.0, 0.27], [0.437, 0.27], [0.437, 0.11], [6.0, 0.33]];
    for (name, ground) in [
        ("incline", plane(0.13, [0.31, 0.17])),
        ("step", drawn_out(&step, false)),
        ("step along y", drawn_out(&step, true)),
        ("scattered", scattered(0.4)),
    ] {
        for (law, contact) in [
            (grains(), Contact::NoSlip),
            (grains(), friction(0.2)),
            (without, Contact::FreeSlip),
        ] {
            let cells = 8;
            let down = (law, [0.0, 0.0, -1.0]);
            let surface = plane(level, [0.0; 2]);
            let mut flow = over(&ground, &surface, box_of(cells), [0; 3], contact, down);
            let before = flow.volume();
            for _ in 0..3 {
                flow.step(f64::INFINITY).unwrap();
            }
            let speed = flow.max_speed();
            let mut worst = 0.0_f64;
            for (cell, p) in flow.state().pressure.iter().enumerate() {
                let z = ((cell / (cells * cells)) as f64 + 0.5) / cells as f64;
                if *p > 0.0 {
                    worst = worst.max((p - (level - z)).abs());
                }
            }
            let drift = (flow.volume() / before - 1.0).abs();
            eprintln!(
                "{name} {contact:?}: speed {speed:e}, pressure off by {worst:e}, volume {drift:e}"
            );
            assert!(
                speed < 1e-6 * DIAMETER.sqrt(),
                "{name} {contact:?} {speed:e}"
            );
            assert!(worst < 1e-12, "{name} {contact:?} {worst:e}");
            assert!(drift < 1e-13, "{name} {contact:?} {drift:e}");
        }
    }
}

/// A layer of even thickness on an incline of any direction rests below the angle of repose and does not above it.
#[test]
fn layers_rest_below_repose_and_flow_above() {
    for (slope, rests) in [
        ([0.2, 0.0], true),
        ([0.14, 0.14], true),
        ([0.32, 0.32], false),
    ] {
        let (ground, surface) = (plane(0.0731, slope), plane(0.2731, slope));
        let down = (grains(), [0.0, 0.0, -1.0]);
        let mut flow = over(&ground, &surface, box_of(12), [0; 3], Contact::NoSlip, down);
        for _ in 0..8 {
            flow.step(f64::INFINITY).unwrap();
        }
        let speed = flow.max_speed();
        eprintln!("{slope:?} {speed:e}");
        if rests {
            assert!(speed < 1e-6 * DIAMETER.sqrt(), "{slope:?} {speed:e}");
        } else {
            assert!(speed > 1e-2, "{slope:?} {speed:e}");
        }
    }
}

/// Level ground, a hill of slopes 1/2, and hills with a step and a slope of 2.4.
fn lands() -> [Vec<[f64; 2]>; 3] {
    let of = |inner: &[[f64; 2]]| {
        let ends = [[-2.0, 0.23], [6.0, 0.23]];
        let line = ends[..1].iter().chain(inner).chain(&ends[1..]);
        line.copied().collect()
    };
    let hill = [[0.3, 0.23], [0.5, 0.33], [0.7, 0.23]];
    let hills = [
        [0.1, 0.23],
        [0.3, 0.43],
        [0.437, 0.43],
        [0.437, 0.17],
        [0.7, 0.31],
        [0.8, 0.23],
    ];
    [of(&[]), of(&hill), of(&hills)]
}

/// A flow in a plane and one in space over ground that is the same all along one axis, periodic along the other.
struct Pair {
    exact: SurfaceFlow<MuI>,
    flow: SpaceFlow<MuI>,
    along_y: bool,
    cells: usize,
}

impl Pair {
    fn new(
        cells: usize,
        land: &[[f64; 2]],
        other: &[[f64; 2]],
        along_y: bool,
        contact: Contact,
    ) -> Self {
        let h = 1.0 / cells as f64;
        let along = Axis::Periodic { length: 1.0, cells };
        let up = bounded(1.0, cells, ROUGH, SMOOTH);
        let gravity = [0.5, -0.86];
        let level = 0.7131;
        let surface = Profile::new(vec![[-2.0, level], [6.0, level]]).unwrap();
        let ground = Profile::new(land.to_vec()).unwrap();
        let fractions = (0..cells * cells).map(|cell| {
            let low = [(cell % cells) as f64 * h, (cell / cells) as f64 * h];
            let high = low.map(|x| x + h);
            (surface.area_in(low, high) - ground.area_in(low, high)) / (h * h)
        });
        let exact = SurfaceFlow::over_ground(
            Grid::with_moving_surface([along, up]).unwrap(),
            &Terrain {
                shape: ground.clone(),
                origin: [0.0; 2],
                contact,
                rise: [0; 2],
            },
            fractions.collect(),
            grains(),
            gravity,
            precise(),
        )
        .unwrap();
        let side = bounded(2.0 * h, 2, SMOOTH, SMOOTH);
        let (axes, down) = if along_y {
            ([side, along, up], [0.0, gravity[0], gravity[1]])
        } else {
            ([along, side, up], [gravity[0], 0.0, gravity[1]])
        };
        let flow = over(
            &drawn_out(other, along_y),
            &plane(level, [0.0; 2]),
            axes,
            [0; 3],
            contact,
            (grains(), down),
        );
        Self {
            exact,
            flow,
            along_y,
            cells,
        }
    }

    /// Relative L2 difference of the velocities.
    fn difference(&self) -> f64 {
        let cells = self.cells;
        let [mut miss, mut size] = [0.0; 2];
        for c in 0..2 {
            let component = [usize::from(self.along_y), 2][c];
            let u = &self.flow.state().velocity[component];
            for (n, v) in self.exact.state().velocity[c].iter().enumerate() {
                let [i, k] = [n % cells, n / cells];
                for j in 0..2 {
                    let at = if self.along_y {
                        j + 2 * i
                    } else {
                        i + cells * j
                    };
                    miss += (u[at + 2 * cells * k] - v).powi(2);
                    size += v * v;
                }
            }
        }
        f64::sqrt(miss / size)
    }
}

/// Ground that is the same all along y, or all along x, under gravity that leans along the other axis, gives the plane
/// flow: to round-off where it is level, wherever it cuts the cells. Where it slopes the cells that share a pressure are
/// not each free of divergence, and what of it is taken for strain is not the same with two axes and with three. Plane
/// flow over other ground is another one.
#[test]
fn ground_that_varies_along_one_axis_gives_the_plane_flow() {
    let [level, hill, hills] = lands();
    let cells = 20;
    for (land, contact, most) in [
        (&level, Contact::NoSlip, 1e-9),
        (&level, friction(0.2), 1e-9),
        (&level, Contact::FreeSlip, 1e-9),
        (&hill, Contact::NoSlip, 1e-3),
        (&hill, friction(0.2), 5e-3),
        (&hill, Contact::FreeSlip, 5e-3),
        (&hills, Contact::NoSlip, 2e-2),
    ] {
        for along_y in [false, true] {
            let mut pair = Pair::new(cells, land, land, along_y, contact);
            pair.exact.accelerate_in_place(0.1).unwrap();
            pair.flow.accelerate_in_place(0.1).unwrap();
            let miss = pair.difference();
            eprintln!("{contact:?} along y {along_y}: {miss:e}");
            assert!(miss < most, "{contact:?} {along_y} {miss:e}");
        }
    }
    let mut moving = Pair::new(cells, &hill, &hill, true, Contact::NoSlip);
    let mut other = Pair::new(cells, &hill, &level, false, Contact::NoSlip);
    for pair in [&mut moving, &mut other] {
        for _ in 0..6 {
            pair.exact.step(0.02).unwrap();
            pair.flow.step(0.02).unwrap();
        }
    }
    let [moving, other] = [moving, other].map(|pair| pair.difference());
    eprintln!("moving {moving:e}, over other ground {other:e}");
    assert!(moving < 5e-3 && other > 0.1, "{moving:e} {other:e}");
}

/// Level ground at a height.
fn flat(height: f64) -> Terrain<Surface, 3> {
    Terrain {
        shape: plane(height, [0.0; 2]),
        origin: [0.0; 3],
        contact: Contact::NoSlip,
        rise: [0; 3],
    }
}

/// Level ground on a face of cells, two above the floor: the flow on a floor there. Ground at the floor is the floor, to
/// the last bit; ground inside the cells is another flow.
#[test]
fn ground_on_faces_of_cells_is_a_floor() {
    let cells = 8;
    let h = 1.0 / cells as f64;
    let along = Axis::Periodic { length: 1.0, cells };
    let down = [0.3, 0.2, -0.9];
    let mut options = precise();
    options.solver.momentum_tolerance = 1e-13;
    options.solver.stress_tolerance = 1e-12;
    options.solver.tolerance_in_motion = 1.0;
    let flow = |rows: usize, foot: f64, level: f64| {
        let axes = [along, along, bounded(rows as f64 * h, rows, ROUGH, SMOOTH)];
        let grid = Grid::with_moving_surface(axes).unwrap();
        let ground = plane(foot, [0.0; 2]);
        let fractions = between(&ground, &plane(level, [0.0; 2]), grid.cell_counts(), h);
        let terrain = flat(foot);
        SpaceFlow::over_ground(grid, &terrain, fractions, grains(), down, options).unwrap()
    };
    let floor = || {
        let filled = |k: usize| (0.6131 / h - k as f64).clamp(0.0, 1.0);
        let fractions = (0..cells).flat_map(|k| vec![filled(k); cells * cells]);
        let axes = [along, along, bounded(1.0, cells, ROUGH, SMOOTH)];
        let grid = Grid::with_moving_surface(axes).unwrap();
        SpaceFlow::in_space(grid, fractions.collect(), grains(), down, options).unwrap()
    };
    let mut exact = floor();
    let (grid, filled) = (exact.grid().clone(), exact.state().fractions.clone());
    let mut same =
        SpaceFlow::over_ground(grid, &flat(0.0), filled, grains(), down, options).unwrap();
    let mut on_faces = flow(cells + 2, 2.0 * h, 0.6131 + 2.0 * h);
    let mut inside = flow(cells + 2, 2.3 * h, 0.6131 + 2.0 * h);
    for flow in [&mut exact, &mut same, &mut on_faces, &mut inside] {
        for _ in 0..5 {
            flow.step(0.02).unwrap();
        }
    }
    assert_eq!(exact.state(), same.state());
    let layer = 2 * cells * cells;
    let miss = |flow: &SpaceFlow<MuI>| {
        let mut worst = 0.0_f64;
        for c in 0..2 {
            let u = &flow.state().velocity[c][layer..];
            for (a, b) in exact.state().velocity[c].iter().zip(u) {
                worst = worst.max((a - b).abs());
            }
        }
        worst / exact.max_speed()
    };
    let [on_faces, inside] = [miss(&on_faces), miss(&inside)];
    eprintln!("on faces {on_faces:e}, inside {inside:e}");
    assert!(on_faces < 1e-12 && inside > 1e-2, "{on_faces:e} {inside:e}");
}

/// A layer one thick, `cells` cells, on an incline that rises so many cells along x and y over its periods, under
/// gravity turned by `tilt` against the grid in the direction of the incline.
struct Incline {
    flow: SpaceFlow<MuI>,
    counts: [usize; 3],
    h: f64,
    slope: [f64; 2],
    foot: f64,
}

impl Incline {
    fn new(
        cells: usize,
        rise: [usize; 2],
        run: usize,
        tilt: f64,
        law: MuI,
        contact: Contact,
    ) -> Self {
        let h = 1.0 / cells as f64;
        let slope = rise.map(|rise| rise as f64 / run as f64);
        let steepness = slope[0].hypot(slope[1]);
        let thickness = steepness.hypot(1.0);
        let periods = cells / 8;
        let up = rise.map(|rise| rise * periods);
        let columns = [0, 1].map(|axis| if up[axis] == 0 { 3 } else { run * periods });
        let rows = up[0] + up[1] + (1.35 * thickness / h).ceil() as usize + 6;
        // Ground and surface lie somewhere in their cells.
        let foot = 2.0 * h + 0.0137;
        let along = columns.map(|cells| Axis::Periodic {
            length: h * cells as f64,
            cells,
        });
        let height = bounded(h * rows as f64, rows, ROUGH, SMOOTH);
        let direction = slope.map(|s| s / steepness);
        let flow = over(
            &plane(foot, slope),
            &plane(foot + thickness, slope),
            [along[0], along[1], height],
            [up[0], up[1], 0],
            contact,
            (
                law,
                [
                    -tilt.sin() * direction[0],
                    -tilt.sin() * direction[1],
                    -tilt.cos(),
                ],
            ),
        );
        Self {
            flow,
            counts: [columns[0], columns[1], rows],
            h,
            slope,
            foot,
        }
    }

    fn steepness(&self) -> f64 {
        self.slope[0].hypot(self.slope[1])
    }

    /// Relative L2 error of the horizontal velocity in cells clear of ground and surface, if the velocity
    /// down the slope is a function of the distance from the ground.
    fn error(&self, down: impl Fn(f64) -> f64) -> f64 {
        let cosine = 1.0 / self.steepness().hypot(1.0);
        let (free, state) = (self.flow.free_parts().unwrap(), self.flow.state());
        let clear = |cell: usize| free[cell] == 1.0 && state.fractions[cell] > 0.999;
        let [nx, ny, _] = self.counts;
        let [mut miss, mut size] = [0.0; 2];
        for axis in 0..2 {
            let direction = self.slope[axis] / self.steepness();
            for (face, u) in state.velocity[axis].iter().enumerate() {
                let index = [face % nx, face / nx % ny, face / (nx * ny)];
                if index[axis] == 0 || !clear(face) || !clear(face - [1, nx][axis]) {
                    continue;
                }
                let mut at = index.map(|n| (n as f64 + 0.5) * self.h);
                at[axis] -= 0.5 * self.h;
                let above = at[2] - self.foot - self.slope[0] * at[0] - self.slope[1] * at[1];
                let exact = -down(above * cosine) * cosine * direction;
                miss += (u - exact) * (u - exact);
                size += exact * exact;
            }
        }
        f64::sqrt(miss / size)
    }
}

/// Error of steady Bagnold flow down an incline.
fn bagnold(cells: usize, rise: [usize; 2], run: usize, tilt: f64, contact: Contact) -> f64 {
    let law = MuI::new(0.38, 0.64, 0.3, 0.04, 1.0, 1.0);
    let mut incline = Incline::new(cells, rise, run, tilt, law, contact);
    if let Err(error) = incline.flow.accelerate_in_place(1e8) {
        eprintln!("{error}");
        return f64::INFINITY;
    }
    let angle = incline.steepness().atan() + tilt;
    let number = 0.3 * (angle.tan() - 0.38) / (0.64 - angle.tan());
    let scale = (2.0 / 3.0) * (number / 0.04) * angle.cos().sqrt();
    incline.error(|height| scale * (1.0 - (1.0 - height.clamp(0.0, 1.0)).powf(1.5)))
}

/// Bagnold flow down cut inclines, along an axis as in the plane and down the diagonal. A base with less friction than the
/// slope asks for lets the layer go: no such flow is near.
#[test]
fn bagnold_flow_on_cut_inclines() {
    for (rise, run, tilt, most, order) in
        [([0, 7], 16, 0.0, 6e-3, 1.5), ([1, 1], 4, 0.0785, 1e-2, 0.6)]
    {
        let errors = [8, 16].map(|cells| bagnold(cells, rise, run, tilt, Contact::NoSlip));
        let observed = (errors[0] / errors[1]).log2();
        eprintln!("{rise:?}/{run}: {errors:?}, order {observed}");
        assert!(
            errors[1] < most && observed > order,
            "{rise:?}: {errors:?}, {observed}"
        );
    }
    let weak = bagnold(8, [1, 1], 4, 0.0785, friction(0.2));
    assert!(weak > 1.0, "{weak}");
}

/// The same on more slopes and a finer grid.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn bagnold_flow_by_grid() {
    for (rise, run, tilt, most, order) in [
        ([7, 0], 16, 0.0, 2.2e-3, 1.4),
        ([0, 1], 8, 0.3, 5e-4, 1.0),
        ([1, 1], 4, 0.0785, 2e-3, 1.4),
        ([4, 2], 8, -0.04, 2e-3, 1.5),
    ] {
        let errors = [8, 16, 32].map(|cells| bagnold(cells, rise, run, tilt, Contact::NoSlip));
        let observed = (errors[0] / errors[2]).log2() / 2.0;
        eprintln!("{rise:?}/{run}: {errors:?}, order {observed}");
        assert!(
            errors[2] < most && observed > order,
            "{rise:?}: {errors:?}, {observed}"
        );
    }
}

/// A layer that does not yield inside slides on a slope as a block.
#[test]
fn layers_slide_as_blocks() {
    let dt = 0.01;
    for (rise, run, holds) in [([1, 0], 4, 0.3), ([1, 1], 4, 0.4)] {
        // It would yield itself on the steeper one.
        let stiff = MuI::new(0.6, 0.8, 0.4, DIAMETER, 1.0, 1.0);
        for (contact, base, exactness) in [
            (Contact::FreeSlip, 0.0, 1e-10),
            (friction(0.1), 0.1, 5e-3),
            (friction(0.2), 0.2, 4e-2),
        ] {
            let mut incline = Incline::new(16, rise, run, 0.0, grains(), contact);
            incline.flow.accelerate_in_place(dt).unwrap();
            let angle = incline.steepness().atan();
            let speed = dt * (angle.sin() - base * angle.cos());
            let error = incline.error(|_| speed);
            eprintln!("{rise:?} {contact:?} {error:e}");
            assert!(error < exactness, "{contact:?} {error:e}");
        }
        let mut held = Incline::new(16, rise, run, 0.0, stiff, friction(holds));
        held.flow.accelerate_in_place(dt).unwrap();
        let speed = held.flow.max_speed();
        eprintln!("{rise:?} held {speed:e}");
        assert!(speed < 5e-7, "{speed:e}");
    }
}
