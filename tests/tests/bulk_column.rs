//! Janssen's law: walls with friction carry grains in a tall container.
//!
//! The floor sinks slowly under the column from the start, so that grains slide down along the walls
//! and friction points up everywhere. Without that the law has no claim: a column that merely settles
//! keeps the friction of its filling, up in one place and down in another.

use colluvium_dem::Snapshot;
use colluvium_tests::silo::{Column, Janssen, Loads};

const WALL_FRICTION: f64 = 0.4;

fn column(grains: usize, seed: u64) -> Column {
    Column {
        edge: 6.0,
        grains,
        wall_friction: WALL_FRICTION,
        sinking: 0.05,
        seed,
    }
}

/// Loads averaged over a time after settling.
fn loads(column: &Column, settle: f64, average: f64) -> Loads {
    let mut simulation = column.fill().unwrap();
    let step = simulation.timestep();
    simulation.advance((settle / step) as u64).unwrap();
    let mut snapshot = Snapshot::default();
    let mut loads = Loads::default();
    for _ in 0..(average / 0.2) as u64 {
        simulation.advance((0.2 / step) as u64).unwrap();
        simulation.snapshot(&mut snapshot);
        loads.look(&snapshot);
    }
    loads
}

/// Weight, bottom load, Janssen's fit; the column must be in balance.
fn measure(column: &Column, settle: f64, average: f64) -> (f64, f64, Janssen) {
    let loads = loads(column, settle, average);
    let [weight, bottom, walls] = loads.total();
    let law = Janssen::of(column, &loads);
    println!(
        "{} grains: weight {weight:.1}, bottom {bottom:.1} (law {:.1}), balance {:+.4}, K μ {:.3}, \
         mobilised {:.3}, profile off by {:.3}",
        column.grains,
        law.bottom,
        (bottom + walls) / weight - 1.0,
        law.wall_ratio,
        law.mobilised,
        law.deviation
    );
    assert!(((bottom + walls) / weight - 1.0).abs() < 0.01);
    (weight, bottom, law)
}

/// Friction points up all along the walls, and K is that of grains. Round grains roll down a wall as
/// well as they slide: the walls' shear stays below μ times their pressure.
fn check(law: &Janssen) {
    assert!((0.4..1.0).contains(&(law.mobilised / WALL_FRICTION)));
    assert!((0.5..1.4).contains(&(law.wall_ratio / law.mobilised)));
}

#[test]
fn walls_carry_a_column_as_janssen_says() {
    let (_, low, _) = measure(&column(400, 1), 30.0, 20.0);
    let (weight, high, law) = measure(&column(800, 1), 40.0, 20.0);
    check(&law);
    // One column: stresses along it wander by a tenth about the law, as single columns do.
    assert!((high / law.bottom - 1.0).abs() < 0.2);
    assert!(law.deviation < 0.07);
    // Twice the grains, and the floor hardly feels it.
    assert!(high < 1.35 * low && high < 0.35 * weight);
}

#[test]
fn smooth_walls_carry_nothing() {
    let smooth = Column {
        wall_friction: 0.0,
        sinking: 0.0,
        ..column(400, 1)
    };
    let [weight, bottom, walls] = loads(&smooth, 30.0, 2.0).total();
    println!("smooth walls: bottom {bottom:.3} of {weight:.3}, walls {walls:.1e}");
    assert!((bottom / weight - 1.0).abs() < 0.005);
    assert_eq!(walls, 0.0);
}

#[test]
#[ignore = "long: 2 min, five columns"]
fn columns_saturate_as_janssen_says_whatever_their_seed() {
    let mut bottoms = Vec::new();
    for (grains, seed) in [(800, 2), (800, 3), (1200, 4), (1600, 5)] {
        let (_, bottom, law) = measure(&column(grains, seed), 30.0 + grains as f64 / 40.0, 60.0);
        check(&law);
        assert!((bottom / law.bottom - 1.0).abs() < 0.15);
        assert!(law.deviation < 0.07);
        bottoms.push(bottom);
    }
    assert!(bottoms[3] < 1.12 * bottoms[0]);
    // The history matters: the same grains over a floor that rests.
    let rest = Column {
        sinking: 0.0,
        ..column(800, 2)
    };
    let [_, bottom, _] = loads(&rest, 50.0, 2.0).total();
    println!("800 grains, floor at rest: bottom {bottom:.1}");
    assert!(bottom > 1.5 * bottoms[0]);
}
