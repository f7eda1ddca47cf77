//! Grains between two continua: what one edge does, two do, each on its own side.

use super::material::{HEIGHT, Joined, TRAVEL, settle, settled_fraction, setup_of, spec};
use colluvium_continuum::column_collapse::CollapseGround;
use colluvium_coupling::overlap::material_edge::{
    GrainZone, MaterialEdgeSpec, Monitors, Side, Travel,
};
use colluvium_dem::{Grain, Simulation};
use std::sync::OnceLock;

pub const LENGTH: f64 = 34.0;
/// Grains stay between these.
const ENDS: [f64; 2] = [8.0, 26.0];
/// Where the grid of the continuum above ends; it goes as far below zero.
pub const END: f64 = 48.0;

/// Grains at rest between a wall and a gate.
pub fn settled() -> &'static [Grain] {
    static COLUMN: OnceLock<Vec<Grain>> = OnceLock::new();
    COLUMN.get_or_init(|| settle(LENGTH))
}

/// The same seen in a mirror that stands in its middle.
fn mirrored() -> Vec<Grain> {
    let mut grains = settled().to_vec();
    for grain in &mut grains {
        grain.position.x = LENGTH - grain.position.x;
        grain.velocity.x = -grain.velocity.x;
        (grain.spin.y, grain.spin.z) = (-grain.spin.y, -grain.spin.z);
    }
    grains
}

/// An edge below grains from `place` on.
pub fn below(uncoupled: bool, place: f64, travel: Option<Travel>) -> MaterialEdgeSpec {
    let mut spec = spec(settled_fraction(), uncoupled, place, travel);
    spec.case.aspect = HEIGHT / LENGTH;
    spec
}

/// An edge above grains up to `place`, with a continuum up to a gate, or one whose face is free.
pub fn above(uncoupled: bool, place: f64, gate: bool, travel: Option<Travel>) -> MaterialEdgeSpec {
    MaterialEdgeSpec {
        side: Side::Above,
        place: -place,
        wall: if gate { -LENGTH } else { -END },
        back: -LENGTH,
        ..below(uncoupled, place, travel)
    }
}

fn both(uncoupled: bool, gate: bool, travel: Option<Travel>) -> [MaterialEdgeSpec; 2] {
    [
        below(uncoupled, ENDS[0], travel),
        above(uncoupled, ENDS[1], gate, travel),
    ]
}

pub fn joined(grains: Vec<Grain>, gate: bool, specs: &[MaterialEdgeSpec]) -> Joined {
    joined_over(grains, gate, specs, None)
}

fn joined_over(
    grains: Vec<Grain>,
    gate: bool,
    specs: &[MaterialEdgeSpec],
    ground: Option<&CollapseGround>,
) -> Joined {
    let simulation = Simulation::new(setup_of(LENGTH, grains, gate)).unwrap();
    Joined::cut_over(simulation, specs, ground)
}

/// Mass, momentum and what both sides gave each other close over both edges.
pub fn books_close(joined: &mut Joined) {
    let zone = &joined.zone;
    let account = zone.account(&joined.simulation);
    let owed = zone.owed(&joined.simulation);
    let (mass, volume) = (zone.mass_error(&joined.simulation), zone.volume_error());
    let mut now = zone.grain_momentum(&mut joined.simulation);
    for (now, damped) in now.iter_mut().zip(joined.damped) {
        *now -= damped;
    }
    let (grains, exchange) = (account.grains_error(now), account.exchange_error(owed));
    println!("mass {mass:.1e}, volume {volume:.1e}, ledgers {grains:.1e} {exchange:.1e}");
    assert!(mass.abs() < 0.02 && volume.abs() < 1e-12);
    assert!(grains < 1e-11 && exchange < 1e-11);
    // Without what the continua press with it would not close.
    let mut blind = account;
    blind.traction.fill(0.0);
    assert!(blind.grains_error(now) > 1e-4);
}

/// Speeds of grains and continua, how far the handshake surfaces have moved, and grains beyond an edge.
pub fn calm(specs: &[MaterialEdgeSpec]) -> ([f64; 2], f64, f64, Joined) {
    let uncoupled = specs.iter().all(|spec| spec.settings.uncoupled);
    let mut joined = joined(settled().to_vec(), true, specs);
    joined.advance(15.0, 0.9);
    let places = |joined: &Joined| -> Vec<f64> {
        let edges = joined.zone.edges().iter();
        edges.flat_map(|edge| edge.handshake().to_vec()).collect()
    };
    let before = places(&joined);
    joined.advance(5.0, 1.0);
    let moved = places(&joined);
    let moved = moved.iter().zip(&before).map(|(a, b)| (a - b).abs());
    let moved = moved.fold(0.0, f64::max);
    let edges = joined.zone.edges().iter();
    let monitors: Vec<Monitors> = edges.map(|edge| edge.monitors()).collect();
    let escaped = monitors.iter().map(|m| m.escaped).sum();
    for (edge, m) in joined.zone.edges().iter().zip(&monitors) {
        println!(
            "uncoupled {uncoupled}: force ratio {:.3}, packing {:.3}, slip {:.1e}, escaped {}",
            m.force_ratio(),
            edge.packing_ratio(),
            m.mean_slip(),
            m.escaped
        );
    }
    let speeds = joined.speeds();
    println!(
        "speeds {:.1e} {:.1e}, moved {moved:.3}",
        speeds[0], speeds[1]
    );
    (speeds, moved, escaped, joined)
}

/// A level bed with grains in its middle rests as one with grains at its end does, and its books close. With nothing exchanged
/// grains fall into both continua.
#[test]
fn an_interval_of_grains_in_a_level_bed_stays_at_rest() {
    rests(&both(false, true, None), &both(true, true, None), 0.01);
}

/// Joined by these edges it rests, with surfaces that move by less than a part of a diameter, and by these it does not.
pub fn rests(specs: &[MaterialEdgeSpec], controls: &[MaterialEdgeSpec], most: f64) {
    let (speeds, moved, escaped, mut rests) = calm(specs);
    assert!(speeds[0] < 0.03 && speeds[1] < 1e-4, "{speeds:?}");
    assert!(moved < most && escaped == 0.0);
    books_close(&mut rests);
    // Both ends push about as hard: 122 and 109 N of an interval of grains, where they were not packed the same either.
    let [low, high] = [0, 1].map(|k| rests.zone.edges()[k].monitors().forces()[1]);
    assert!(low > 0.0 && (high / low - 1.0).abs() < 0.2, "{low} {high}");
    let (_, _, escaped, control) = calm(controls);
    let fallen = control.zone.edges().iter();
    assert!(fallen.map(|e| e.monitors().escaped).all(|n| n > 0.0) && escaped > 0.0);
    let slips = |joined: &Joined| {
        let edges = joined.zone.edges().iter();
        edges
            .map(|e| e.monitors().mean_slip())
            .collect::<Vec<f64>>()
    };
    assert!(slips(&rests).iter().all(|slip| *slip < 0.02));
    assert!(slips(&control).iter().all(|slip| *slip > 0.1));
}

/// Largest difference of two rows over the largest of either.
pub fn apart(one: &[f64], other: &[f64]) -> f64 {
    assert_eq!(one.len(), other.len());
    let most = one
        .iter()
        .chain(other)
        .fold(0.0, |m: f64, x| m.max(x.abs()));
    let pairs = one.iter().zip(other);
    pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / most
}

/// A scene and its mirror image: the edge below one is the edge above the other, on its own or with one at the other end.
#[test]
fn mirrored_grains_bear_mirrored_loads() {
    let [from, to] = ENDS;
    let turned = |x: f64| LENGTH - x;
    let pairs = [
        (
            vec![below(false, from, None)],
            vec![above(false, turned(from), true, None)],
        ),
        (
            both(false, true, None).to_vec(),
            vec![
                below(false, turned(to), None),
                above(false, turned(from), true, None),
            ],
        ),
    ];
    for (specs, images) in pairs {
        mirror(&specs, &images, 1e-6);
    }
}

/// Edges and their images bear mirrored loads but for a part, after some time and after twice that.
pub fn mirror(specs: &[MaterialEdgeSpec], images: &[MaterialEdgeSpec], most: f64) {
    mirror_over((specs, images), [None; 2], most);
}

/// The same over ground and its image.
pub fn mirror_over(
    (specs, images): (&[MaterialEdgeSpec], &[MaterialEdgeSpec]),
    grounds: [Option<&CollapseGround>; 2],
    most: f64,
) {
    let mut own = joined_over(settled().to_vec(), true, specs, grounds[0]);
    let mut image = joined_over(mirrored(), true, images, grounds[1]);
    for _ in 0..2 {
        own.advance(0.5, 1.0);
        image.advance(0.5, 1.0);
        let (one, other) = (
            own.zone.account(&own.simulation),
            image.zone.account(&image.simulation),
        );
        let rows = |a: &colluvium_coupling::overlap::material_edge::Account, s: f64| {
            [a.traction, a.impedance, a.relaxation, a.answer]
                .iter()
                .flat_map(|v| [s * v[0], v[1]])
                .collect::<Vec<f64>>()
        };
        let loads = apart(&rows(&one, 1.0), &rows(&other, -1.0));
        let edges = own.zone.edges().iter();
        let images = image.zone.edges().iter().rev();
        for (edge, image) in edges.zip(images) {
            let (a, b) = (edge.monitors().numbers(), image.monitors().numbers());
            let surface: Vec<f64> = image.handshake().iter().map(|x| x + LENGTH).collect();
            let surface = apart(
                &surface,
                &match edge.spec().side {
                    Side::Below => edge.handshake().to_vec(),
                    Side::Above => edge.handshake().iter().map(|x| x + 2.0 * LENGTH).collect(),
                },
            );
            println!(
                "{:?}: loads {loads:.1e}, surface {surface:.1e}, forces {:?} {:?}",
                edge.spec().side,
                edge.monitors().forces(),
                image.monitors().forces()
            );
            assert!(a[3] != 0.0 && b[3] != 0.0);
            let forces = apart(&edge.monitors().forces(), &image.monitors().forces());
            assert!(forces < most && surface < most, "{forces} {surface}");
        }
        assert!(loads < most, "{loads}");
        // Not turned they would be as far apart as they are large.
        assert!(apart(&rows(&one, 1.0), &rows(&other, 1.0)) > 1e-3);
    }
}

/// A column that loses its gate through the continuum in front of the grains: edges hand strips over on both sides, and every book closes,
/// that of angular momentum about the slab's axis too.
#[test]
fn both_edges_keep_their_books_while_a_column_collapses() {
    collapse(&both(false, false, Some(TRAVEL)));
}

/// Such a column with edges that move.
pub fn collapse(specs: &[MaterialEdgeSpec]) {
    collapse_over(specs, None);
}

/// The same over ground.
pub fn collapse_over(specs: &[MaterialEdgeSpec], ground: Option<&CollapseGround>) -> Joined {
    let mut joined = joined_over(settled().to_vec(), false, specs, ground);
    joined
        .zone
        .open_angular_book(&mut joined.simulation)
        .unwrap();
    joined.advance(14.0, 1.0);
    for edge in joined.zone.edges() {
        println!("{:?}: {:.2?}", edge.spec().side, edge.moves());
    }
    books_close(&mut joined);
    let book = joined.zone.angular_book().unwrap();
    let error = book.error(&joined.simulation, 1);
    println!("angular momentum {error:.1e}");
    assert!(error < 1e-11, "{error:e}");
    let moves = joined.zone.edges().iter().map(|edge| edge.moves().len());
    assert!(moves.sum::<usize>() > 0);
    joined
}

/// All of a zone comes back from its numbers in the middle of an exchange.
#[test]
fn a_zone_goes_on_from_its_numbers() {
    go_on(&both(false, false, Some(TRAVEL)));
}

/// Stops and goes on with the same bits.
pub fn go_on(specs: &[MaterialEdgeSpec]) {
    go_on_over(specs, None);
}

/// The same over ground.
pub fn go_on_over(specs: &[MaterialEdgeSpec], ground: Option<&CollapseGround>) {
    let mut own = joined_over(settled().to_vec(), false, specs, ground);
    own.advance(5.0, 1.0);
    let mut memory = Vec::new();
    own.zone.write(&mut memory);
    let record = own.simulation.checkpoint();
    let resumed = Simulation::resume(setup_of(LENGTH, settled().to_vec(), false), &record).unwrap();
    let zone = GrainZone::read(specs, ground, &memory, &resumed).unwrap();
    let fewer = &specs[..specs.len() - 1];
    assert!(GrainZone::read(fewer, ground, &memory, &resumed).is_err());
    if ground.is_some() {
        assert!(GrainZone::read(specs, None, &memory, &resumed).is_err());
    }
    let mut other = Joined {
        simulation: resumed,
        zone,
        damped: [0.0; 2],
    };
    own.advance(5.0, 1.0);
    other.advance(5.0, 1.0);
    assert_eq!(own.simulation.state_hash(), other.simulation.state_hash());
    let [mut ours, mut theirs] = [Vec::new(), Vec::new()];
    own.zone.write(&mut ours);
    other.zone.write(&mut theirs);
    assert_eq!(ours, theirs);
}

/// What is no zone is refused by name.
#[test]
fn edges_that_enclose_no_grains_are_refused() {
    let [low, high] = both(false, true, None);
    let near = MaterialEdgeSpec {
        place: -ENDS[0] - 11.0,
        ..high
    };
    for (specs, word) in [
        (vec![high, low], "the lower one first"),
        (vec![low, low], "in turn"),
        (vec![low, near], "widths of both overlaps"),
        (vec![], "at least one"),
    ] {
        let mut simulation = Simulation::new(setup_of(LENGTH, settled().to_vec(), true)).unwrap();
        let refused = GrainZone::cut(&specs, None, &mut simulation).err().unwrap();
        assert!(refused.to_string().contains(word), "{refused}");
    }
}
