//! Meshes against the analytic walls they stand for.

use super::scene::*;
use colluvium_dem::walls::{Mesh, Rotation, Sine};
use colluvium_dem::*;
use nalgebra::{Rotation3, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

type Triangles = (Vec<Vector3<f64>>, Vec<[u32; 3]>);

fn mesh((vertices, triangles): Triangles) -> Wall {
    Wall::mesh(Arc::new(Mesh::new(vertices, &triangles).unwrap()))
}

/// A square of side 2 about the origin in the plane z = 0, cut into triangles of all sizes.
fn tessellated(cells: u32) -> Triangles {
    let at = |k: u32| -1.0 + 2.0 * f64::from(k) / f64::from(cells);
    let inner = |k: u32| k > 0 && k < cells;
    let mut vertices = Vec::new();
    for i in 0..=cells {
        for j in 0..=cells {
            let shift = |s: f64| 0.3 / f64::from(cells) * (f64::from(7 * i + 13 * j) * s).sin();
            let x = at(i) + if inner(i) { shift(1.3) } else { 0.0 };
            let y = at(j) + if inner(j) { shift(2.1) } else { 0.0 };
            vertices.push(Vector3::new(x, y, 0.0));
        }
    }
    let mut triangles = Vec::new();
    for i in 0..cells {
        for j in 0..cells {
            let [a, b] = [i * (cells + 1) + j, (i + 1) * (cells + 1) + j];
            if (i + j) % 3 == 0 {
                triangles.extend([[a, b, a + 1], [b, b + 1, a + 1]]);
            } else {
                triangles.extend([[a, b, b + 1], [a + 1, a, b + 1]]);
            }
        }
    }
    (vertices, triangles)
}

/// A ball thrown along a floor: it bounces, slides and rolls over many edges and corners.
fn thrown(walls: Vec<Wall>, speed: f64, steps: u64) -> Vec<GrainSample> {
    let velocity = [0.8 * speed, 0.6 * speed, -0.3];
    let mut grain = ball([-0.7, -0.531, RADIUS + 0.02], velocity);
    grain.spin = Vector3::new(3.0, 2.0, 5.0);
    let mut setup = setup(rough(2e5, 0.3), vec![grain], walls, 5e-5);
    setup.gravity = Vector3::new(0.0, 0.0, -9.81);
    let mut s = Simulation::new(setup).unwrap();
    (0..steps / 100)
        .map(|_| {
            s.advance(100).unwrap();
            only(&mut s)
        })
        .collect()
}

/// Largest difference of position, velocity and spin · R of two runs.
fn difference(a: &[GrainSample], b: &[GrainSample]) -> f64 {
    let pairs = a.iter().zip(b);
    let apart = pairs.map(|(a, b)| {
        let turn = (a.spin - b.spin).norm() * RADIUS;
        let velocity = (a.velocity - b.velocity).norm();
        (a.position - b.position).norm().max(velocity).max(turn)
    });
    apart.fold(0.0, f64::max)
}

#[test]
fn a_tessellated_floor_is_a_plane_and_a_sum_over_its_triangles_is_not() {
    let plane = thrown(
        vec![Wall::plane(Vector3::zeros(), Vector3::z())],
        1.0,
        24_000,
    );
    let end = plane.last().unwrap();
    assert!(
        end.position.x > 0.0,
        "it crosses the floor: {}",
        end.position
    );
    for cells in [1, 7, 40] {
        let on_mesh = thrown(vec![mesh(tessellated(cells))], 1.0, 24_000);
        let error = difference(&plane, &on_mesh);
        assert!(error < 1e-12, "{cells} cells: {error:e}");
    }
    // Each triangle a wall of its own: what every triangle pushes adds up along edges.
    let (vertices, triangles) = tessellated(7);
    let naive = triangles.iter().map(|t| {
        let corners = t.map(|v| vertices[v as usize]);
        mesh((corners.to_vec(), vec![[0, 1, 2]]))
    });
    let error = difference(&plane, &thrown(naive.collect(), 1.0, 24_000));
    assert!(error > 1e-3, "the naive sum differs by {error:e} only");
}

#[test]
fn doubled_vertices_cracks_and_branches_make_no_difference() {
    let plane = thrown(
        vec![Wall::plane(Vector3::zeros(), Vector3::z())],
        1.0,
        16_000,
    );
    let (vertices, triangles) = tessellated(7);
    // A soup of triangles with their own vertices, some repeated, and a fin under every edge.
    let mut soup: Triangles = (Vec::new(), Vec::new());
    let mut add = |corners: [Vector3<f64>; 3]| {
        let first = soup.0.len() as u32;
        soup.0.extend(corners);
        soup.1.push([first, first + 1, first + 2]);
    };
    for (k, t) in triangles.iter().enumerate() {
        let [a, b, c] = t.map(|v| vertices[v as usize]);
        add([a, b, c]);
        if k % 5 == 0 {
            add([c, b, a]);
        }
        add([a, b, 0.5 * (a + b) - Vector3::z() * 0.3]);
    }
    let wall = mesh(soup);
    let Shape::Mesh(made) = &wall.shape else {
        unreachable!()
    };
    assert!(made.report().branching_edges > 10 && made.report().welded_vertices > 100);
    let error = difference(&plane, &thrown(vec![wall], 1.0, 16_000));
    assert!(error < 1e-12, "{error:e}");
}

#[test]
fn a_ball_falls_off_a_mesh_as_off_a_rectangle() {
    let half = [Vector3::x(), Vector3::y()];
    let plate = thrown(vec![Wall::rectangle(Vector3::zeros(), half)], 2.0, 60_000);
    assert!(plate.last().unwrap().position.z < -1.0, "it fell");
    let error = difference(&plate, &thrown(vec![mesh(tessellated(7))], 2.0, 60_000));
    assert!(error < 1e-11, "{error:e}");
}

/// The box |x|, |y|, |z| ≤ h, each face cut like a floor.
fn tessellated_box(half: f64, cells: u32) -> Triangles {
    let (flat, pattern) = tessellated(cells);
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let z = Vector3::z();
    let turns = [
        Rotation3::identity(),
        Rotation3::from_axis_angle(&Vector3::x_axis(), TAU / 2.0),
        Rotation3::from_axis_angle(&Vector3::x_axis(), TAU / 4.0),
        Rotation3::from_axis_angle(&Vector3::x_axis(), -TAU / 4.0),
        Rotation3::from_axis_angle(&Vector3::y_axis(), TAU / 4.0),
        Rotation3::from_axis_angle(&Vector3::y_axis(), -TAU / 4.0),
    ];
    for turn in turns {
        let first = vertices.len() as u32;
        vertices.extend(flat.iter().map(|v| turn * (v - z) * half));
        triangles.extend(pattern.iter().map(|t| t.map(|v| v + first)));
    }
    (vertices, triangles)
}

#[test]
fn a_box_of_triangles_is_a_box_of_planes() {
    let half = 0.5;
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let planes = axes
        .iter()
        .flat_map(|n| [Wall::plane(-n * half, *n), Wall::plane(n * half, -n)]);
    let run = |walls: Vec<Wall>| {
        let mut grain = ball([0.1, 0.15, -0.2], [2.0, 1.3, 0.4]);
        grain.spin = Vector3::new(1.0, -4.0, 3.0);
        let mut setup = setup(rough(2e5, 0.4), vec![grain], walls, 5e-5);
        // Down into a corner, where it touches three faces.
        setup.gravity = Vector3::new(4.0, 5.0, -7.0);
        let mut s = Simulation::new(setup).unwrap();
        let path: Vec<GrainSample> = (0..200)
            .map(|_| {
                s.advance(300).unwrap();
                only(&mut s)
            })
            .collect();
        let mut snapshot = Snapshot::default();
        s.snapshot(&mut snapshot);
        (path, snapshot.contacts.len())
    };
    let (analytic, touches) = run(planes.collect());
    assert_eq!(touches, 3);
    let (on_mesh, touches) = run(vec![mesh(tessellated_box(half, 5))]);
    assert_eq!(touches, 3);
    let error = difference(&analytic, &on_mesh);
    assert!(error < 1e-10, "{error:e}");
}

/// A sphere of octahedral triangles, each edge halved `levels` times.
fn ball_of_triangles(radius: f64, levels: u32) -> Triangles {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let mut vertices = vec![x, y, z, -x, -y, -z];
    let mut triangles = Vec::new();
    for [a, b, c] in [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]] {
        triangles.extend([[a, b, c], [b, a, 5]]);
    }
    for _ in 0..levels {
        let mut middles = BTreeMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                    let sum: Vector3<f64> = vertices[i as usize] + vertices[j as usize];
                    vertices.push(sum.normalize());
                    vertices.len() as u32 - 1
                })
            };
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (vertices.iter().map(|v| v * radius).collect(), triangles)
}

/// Largest relative change of energy between the bounces of a ball in open space, and their number.
fn energy_kept(wall: Wall, start: [f64; 3], timestep: f64) -> (f64, u32) {
    let grain = ball(start, [2.0, 1.26, 1.42]);
    let mut s = Simulation::new(setup(smooth(), vec![grain], vec![wall], timestep)).unwrap();
    let energy = s.energy().total();
    let (mut worst, mut bounces, mut touched) = (0.0_f64, 0, false);
    let mut snapshot = Snapshot::default();
    for _ in 0..100_000 {
        s.advance(100).unwrap();
        s.snapshot(&mut snapshot);
        let touches = !snapshot.contacts.is_empty();
        if touched && !touches {
            bounces += 1;
            worst = worst.max((s.energy().total() / energy - 1.0).abs());
        }
        touched = touches;
    }
    (worst, bounces)
}

#[test]
fn elastic_bounces_in_a_bent_mesh_keep_energy() {
    // Faces meet at 39° to 5°: valleys of one contact and of several.
    for levels in [1, 2, 3, 4] {
        // A fifth of the others' step: the error is the step's own and falls with its square.
        let wall = mesh(ball_of_triangles(0.8, levels));
        let (lost, bounces) = energy_kept(wall, [0.3, 0.1, -0.2], 4e-7);
        assert!(bounces > 5, "{levels}: {bounces}");
        println!("{levels}: {lost:e} in {bounces} bounces");
        assert!(lost < 1e-8, "{levels}: {lost:e} in {bounces} bounces");
    }
}

/// A trough about the y axis, with facets of equal width that touch the cylinder from outside.
fn trough(radius: f64, facets: u32) -> Triangles {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let corner = radius / (0.5 * TAU / f64::from(facets)).cos();
    for k in 0..facets {
        let angle = TAU * (f64::from(k) + 0.5) / f64::from(facets);
        let (s, c) = angle.sin_cos();
        for y in [-1.0, 1.0] {
            vertices.push(Vector3::new(corner * s, y, -corner * c));
        }
        let next = (k + 1) % facets;
        triangles.extend([
            [2 * k, 2 * k + 1, 2 * next],
            [2 * next, 2 * k + 1, 2 * next + 1],
        ]);
    }
    (vertices, triangles)
}

#[test]
fn a_finely_cut_cylinder_is_a_cylinder_but_for_its_sagitta() {
    let run = |wall: Wall| {
        let hollow = 1.0 - RADIUS;
        let angle: f64 = 0.4;
        let grain = ball(
            [-hollow * angle.sin(), 0.013, -hollow * angle.cos()],
            [0.0; 3],
        );
        let mut setup = setup(rough(2e6, 1.0), vec![grain], vec![wall], 2e-5);
        setup.gravity = Vector3::new(0.0, 0.0, -9.81);
        let mut s = Simulation::new(setup).unwrap();
        let path = (0..250).map(|_| {
            s.advance(400).unwrap();
            only(&mut s)
        });
        path.collect::<Vec<_>>()
    };
    let exact = run(Wall::cylinder(
        Vector3::zeros(),
        Vector3::y(),
        1.0,
        Side::Inside,
    ));
    let error = |facets: u32| {
        let path = run(mesh(trough(1.0, facets)));
        let pairs = exact.iter().zip(&path);
        let apart = pairs.map(|(a, b)| (a.position - b.position).norm());
        apart.fold(0.0, f64::max)
    };
    // Over two seconds and 0.8 m there and back; the sagitta is R (1 - cos(π/N)) = 5e-6 m at N = 1000.
    let (coarse, fine) = (error(250), error(1000));
    println!("250 facets: {coarse:e} m, 1000 facets: {fine:e} m");
    assert!(fine < 1e-3, "{fine:e}");
    assert!(fine < 0.25 * coarse, "{coarse:e} {fine:e}");
}

#[test]
fn a_mesh_goes_on_across_a_periodic_boundary() {
    let run = |wall: Wall| {
        let mut grain = ball([0.3, 0.1, RADIUS + 0.02], [3.0, -1.7, -0.3]);
        grain.spin = Vector3::new(1.0, 2.0, 3.0);
        let mut setup = setup(rough(2e5, 0.3), vec![grain], vec![wall], 5e-5);
        setup.domain = Domain {
            lower: Vector3::repeat(-1.0),
            upper: Vector3::repeat(1.0),
            periodic: [true, true, false],
        };
        setup.gravity = Vector3::new(0.0, 0.0, -9.81);
        let mut s = Simulation::new(setup).unwrap();
        let path = (0..400).map(|_| {
            s.advance(100).unwrap();
            only(&mut s)
        });
        path.collect::<Vec<_>>()
    };
    let plane = run(Wall::plane(Vector3::zeros(), Vector3::z()));
    let on_mesh = run(mesh(tessellated(5)));
    let heights = plane.iter().zip(&on_mesh);
    let apart = heights.map(|(a, b)| {
        let velocity = (a.velocity - b.velocity).norm();
        velocity.max((a.position.z - b.position.z).abs())
    });
    let error = apart.fold(0.0, f64::max);
    assert!(error < 1e-11, "{error:e}");
}

/// Grains in a box of triangles that is shaken or turned.
fn tumbled(motion: Motion, law: ContactLaw, threads: Threads) -> Setup {
    let grains = (0..150)
        .map(|k| {
            let shift = 0.004 * f64::from((k * 11) % 7);
            let cell = [k % 6, k / 6 % 6, k / 36].map(|c| -0.58 + 0.22 * f64::from(c));
            let place = [cell[0] + shift, cell[1] - shift, cell[2]];
            ball(place, [0.3, 0.1, -0.2])
        })
        .collect();
    let walls = vec![mesh(tessellated_box(0.75, 6)).moving(motion)];
    let mut setup = setup(law, grains, walls, 1e-4);
    setup.gravity = Vector3::new(0.0, 0.0, -9.81);
    setup.threads = threads;
    setup
}

#[test]
fn meshes_in_motion_keep_accounts_and_bits() {
    let turning = Motion::Rotation(Rotation {
        point: Vector3::zeros(),
        axis: Vector3::new(0.0, 0.6, 0.8),
        rate: 4.0,
    });
    let shaking = Motion::Sine(Sine {
        amplitude: Vector3::new(0.02, 0.0, 0.01),
        frequency: Vector3::new(8.0, 0.0, 12.0),
        phase: Vector3::new(0.5, 0.0, 0.0),
    });
    let elasticity = Elasticity {
        youngs_modulus: 1e6,
        poissons_ratio: 0.3,
    };
    let sticky = ContactLaw::adhesive(Jkr {
        surface_energy: 2.0,
        elasticity,
        damping_rate: 1.0,
        critical_rolling: 2e-4,
    });
    for (motion, law) in [
        (turning, rough(2e5, 0.5)),
        (shaking, ContactLaw::hertz_mindlin(elasticity, 0.6, 0.5)),
        (Motion::Fixed, sticky),
    ] {
        let mut s = Simulation::new(tumbled(motion.clone(), law, Threads::Serial)).unwrap();
        s.open_energy_ledger();
        s.advance(3_000).unwrap();
        assert!(s.momentum_error() < 1e-12, "{motion:?}");
        let ledger = s.energy_ledger().unwrap();
        assert!(ledger.error() < 1e-11, "{motion:?}: {:e}", ledger.error());
        let lost = ledger.dissipated();
        assert!(lost.normal > 0.0 && lost.tangential > 0.0, "{lost:?}");
        assert_eq!(ledger.drive != 0.0, motion != Motion::Fixed);

        let run = |threads: usize, legs: u64| {
            let kind = [Threads::Serial, Threads::Rayon][usize::from(threads > 1)];
            let setup = tumbled(motion.clone(), law, kind);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| {
                let mut s = Simulation::new(setup.clone()).unwrap();
                for leg in 0..legs {
                    s.advance(2_400 / legs).unwrap();
                    if leg + 1 < legs {
                        let record = s.checkpoint();
                        s = Simulation::resume(setup.clone(), &record).unwrap();
                    }
                }
                (s.state_hash(), s.wall_taken(0))
            })
        };
        let reference = run(1, 1);
        assert_eq!(reference, run(2, 1), "{motion:?}: two threads");
        assert_eq!(reference, run(1, 8), "{motion:?}: seven restarts");
    }
}
