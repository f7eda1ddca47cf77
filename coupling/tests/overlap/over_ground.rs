//! A continuum that has the column's front runs out over ground; its grains stand where that is level.

use super::interval::{
    LENGTH, above, apart, below, books_close, collapse_over, go_on_over, mirror_over, settled,
};
use super::material::{HEIGHT, Joined, TRAVEL, setup_of};
use colluvium_continuum::column_collapse::CollapseGround;
use colluvium_continuum::free_surface::Contact;
use colluvium_continuum::terrain::Profile;
use colluvium_coupling::overlap::material_edge::{GrainZone, MaterialEdgeSpec, Side, Travel};
use colluvium_dem::Simulation;

/// Grains reach up to here.
const END: f64 = 24.0;
/// Where the grid of the continuum ends.
const FAR: f64 = 60.0;

fn ground(points: &[[f64; 2]]) -> CollapseGround {
    CollapseGround {
        profile: Profile::new(points.to_vec()).unwrap(),
        contact: Contact::NoSlip,
    }
}

/// Level up to half a diameter before the column's foot, then a step down and a slope.
fn step_and_slope() -> CollapseGround {
    let [foot, far] = [LENGTH + 0.5, FAR + 5.0];
    ground(&[
        [0.0, 0.0],
        [foot, 0.0],
        [foot, -2.2],
        [LENGTH + 4.0, -2.2],
        [LENGTH + 12.0, -4.0],
        [far, -4.0],
    ])
}

/// Grains at the wall, and a continuum with a free face.
fn front(uncoupled: bool, travel: Option<Travel>) -> MaterialEdgeSpec {
    let mut spec = MaterialEdgeSpec {
        wall: -FAR,
        ..above(uncoupled, END, false, travel)
    };
    spec.case.cells = FAR as usize;
    spec.case.length_scaled = FAR / HEIGHT;
    spec
}

fn joined(specs: &[MaterialEdgeSpec], ground: Option<&CollapseGround>) -> Joined {
    let simulation = Simulation::new(setup_of(LENGTH, settled().to_vec(), true)).unwrap();
    Joined::cut_over(simulation, specs, ground)
}

/// A bed behind a bank of ground, beyond which that falls away, rests as one behind a wall of the grid does, and ground pushes as the
/// wall pushes.
#[test]
fn a_bed_behind_a_bank_stays_at_rest() {
    let bank = ground(&[
        [0.0, 0.0],
        [LENGTH, 0.0],
        [LENGTH, HEIGHT + 3.0],
        [LENGTH + 5.0, -6.0],
        [FAR + 5.0, -6.0],
    ]);
    let wall = above(false, END, true, None);
    let runs = [(front(false, None), Some(&bank)), (wall, None)];
    let found = runs.map(|(spec, ground)| {
        let mut joined = joined(&[spec], ground);
        assert_eq!(joined.zone.continua()[0].has_ground(), ground.is_some());
        joined.advance(15.0, 0.9);
        let before = joined.edge().handshake().to_vec();
        joined.advance(5.0, 1.0);
        let moved = before.iter().zip(joined.edge().handshake());
        let moved = moved.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        let speeds = joined.speeds();
        books_close(&mut joined);
        let account = joined.zone.account(&joined.simulation);
        let walls = account.from_walls_and_surface(joined.zone.continuum_momentum());
        let monitors = joined.edge().monitors();
        let [grains, continuum] = monitors.forces();
        println!(
            "ground {}: speeds {speeds:?}, moved {moved:.4}, escaped {}, forces {grains:.2} {continuum:.2}, walls {walls:.4?}",
            ground.is_some(),
            monitors.escaped
        );
        assert!(speeds[0] < 0.03 && speeds[1] < 1e-4, "{speeds:?}");
        assert!(moved < 0.03 && monitors.escaped == 0.0);
        [continuum, walls[0], walls[1]]
    });
    let [ground, wall] = found;
    for (own, other) in ground.iter().zip(wall) {
        assert!(
            (own - other).abs() < 2e-3 * wall[2].abs(),
            "{ground:?} {wall:?}"
        );
    }
    assert!((ground[0] / wall[0] - 1.0).abs() < 0.01);
}

/// Places and depths of the continuum's heap, and the handshake surface in the rows over the floor.
fn heap(joined: &Joined) -> (Vec<f64>, Vec<f64>) {
    let continuum = &joined.zone.continua()[0];
    let rows = joined.edge().handshake().iter();
    (continuum.heights().1, rows.take(8).copied().collect())
}

/// Ground that is level as far as anything comes is a level floor, and one with a step is not.
#[test]
fn level_ground_is_the_level_floor() {
    let hollow = ground(&[
        [0.0, 0.0],
        [FAR - 4.0, 0.0],
        [FAR - 2.0, -2.5],
        [FAR + 5.0, -2.5],
    ]);
    let grounds = [None, Some(hollow), Some(step_and_slope())];
    let runs = grounds.map(|ground| {
        let mut joined = joined(&[front(false, None)], ground.as_ref());
        joined.advance(12.0, 1.0);
        books_close(&mut joined);
        heap(&joined)
    });
    let [floor, level, step] = &runs;
    let off = |own: &(Vec<f64>, Vec<f64>)| {
        let miss: f64 = floor.0.iter().zip(&own.0).map(|(a, b)| (a - b).abs()).sum();
        [miss / floor.0.iter().sum::<f64>(), apart(&floor.1, &own.1)]
    };
    let ([level, step], edges) = ([off(level), off(step)], [level.1.len(), step.1.len()]);
    println!("heap and handshake off: level {level:?}, step {step:?}, rows {edges:?}");
    assert!(level[0] < 4e-3 && level[1] < 6e-3, "{level:?}");
    assert!(step[0] > 5.0 * level[0], "{step:?}");
}

/// A front over a step and its mirror image, whose continuum looks along x.
#[test]
fn a_mirrored_front_over_mirrored_ground_bears_mirrored_loads() {
    let own = front(false, None);
    let mut image = MaterialEdgeSpec {
        wall: LENGTH - FAR,
        back: 0.0,
        ..below(false, LENGTH - END, None)
    };
    image.case = own.case;
    let points = step_and_slope();
    let points = points.profile.points().iter().rev();
    let mirrored: Vec<[f64; 2]> = points.map(|[x, z]| [LENGTH - x, *z]).collect();
    let grounds = [step_and_slope(), ground(&mirrored)];
    mirror_over(
        (&[own], &[image]),
        [Some(&grounds[0]), Some(&grounds[1])],
        1e-10,
    );
}

/// The front runs over a step and a slope, edges hand over strips, and every book closes, that of angular momentum too; nothing of the
/// continuum is lost in the ground.
#[test]
fn a_front_over_ground_keeps_its_books() {
    let ground = step_and_slope();
    let joined = collapse_over(&[front(false, Some(TRAVEL))], Some(&ground));
    let continuum = &joined.zone.continua()[0];
    let cells = continuum.collapse().flow();
    let free = cells.free_parts().unwrap();
    let pairs = cells.state().fractions.iter().zip(free);
    assert!(pairs.clone().all(|(own, free)| *own <= free + 1e-9));
    // Something of it lies below the step by now.
    let lowest = continuum
        .collapse()
        .fields()
        .into_iter()
        .filter(|f| f.fraction > 0.5);
    let lowest = lowest.fold(0.0, |low: f64, f| low.min(f.lower[1]));
    println!(
        "lowest matter {lowest:.2}, stopped {:?}",
        joined.edge().stopped_moves()
    );
    assert!(lowest < -2.0, "{lowest}");
    // The edge has come so near to the front that grains roll off it, and that is said.
    assert!(joined.edge().monitors().escaped > 0.0);
    assert!(joined.edge().beyond_level_ground().is_some());
}

/// An edge that wants to come back and may not for its budget, until the flow has carried it to where it may not for the ground.
#[test]
fn an_edge_does_not_move_to_where_the_ground_is_not_level() {
    let poor = Travel {
        budget: 1.0,
        ..TRAVEL
    };
    let mut spec = MaterialEdgeSpec {
        place: -29.4,
        ..front(false, Some(poor))
    };
    spec.case.cells *= 2;
    let shore = |foot: f64| {
        let below = [[foot + 4.0, -3.0], [FAR + 5.0, -3.0]];
        ground(&[[0.0, 0.0], [foot, 0.0], below[0], below[1]])
    };
    let mut exchanges = 0.0;
    let [near, far] = [LENGTH, FAR - 5.0].map(|foot| {
        let mut joined = joined(&[spec], Some(&shore(foot)));
        joined.advance(10.0, 1.0);
        exchanges = joined.zone.exchanges() as f64;
        let edge = joined.edge();
        let found = (edge.refused_moves(), edge.stopped_moves());
        println!(
            "refused and stopped {found:?}, handshake {:.1?}",
            edge.handshake()
        );
        found
    });
    assert_eq!(far.1, None);
    assert!(
        near.1
            .is_some_and(|(times, first)| times >= 1.0 && first > 1.0)
    );
    // A move that goes on being refused for one reason is one, not one an exchange.
    for count in [near.0, far.0, near.1.map_or(0.0, |(times, _)| times)] {
        assert!(
            (1.0..0.1 * exchanges).contains(&count) || count == 0.0,
            "{near:?} {far:?}"
        );
    }
    assert!(near.0 >= 1.0 && far.0 >= 1.0, "{near:?} {far:?}");
}

#[test]
fn a_front_over_ground_goes_on_from_its_numbers() {
    let ground = step_and_slope();
    go_on_over(&[front(false, Some(TRAVEL))], Some(&ground));
}

/// Where the ground is not level below the column, or ends before the grid does, a cut says so.
#[test]
fn a_column_on_ground_that_is_not_level_is_refused() {
    let near = ground(&[[0.0, 0.0], [LENGTH - 1.0, 0.0], [FAR + 5.0, -3.0]]);
    let high = ground(&[[0.0, 1.0], [FAR + 5.0, 1.0]]);
    let short = ground(&[[0.0, 0.0], [FAR - 5.0, 0.0]]);
    let specs = [front(false, None)];
    for (ground, word) in [
        (&near, "level at z = 0"),
        (&high, "level at z = 0"),
        (&short, "ground at all x"),
    ] {
        let refused = GrainZone::check_ground(&specs, ground)
            .unwrap_err()
            .to_string();
        assert!(refused.contains(word), "{refused}");
        let mut simulation = Simulation::new(setup_of(LENGTH, settled().to_vec(), true)).unwrap();
        assert!(GrainZone::cut(&specs, Some(ground), &mut simulation).is_err());
    }
    assert!(GrainZone::check_ground(&specs, &step_and_slope()).is_ok());
    // What has no front stands on a level floor, whatever the ground beyond.
    let wall = [above(false, END, true, None)];
    assert!(GrainZone::check_ground(&wall, &near).is_ok());
    assert_eq!(wall[0].side, Side::Above);
}
