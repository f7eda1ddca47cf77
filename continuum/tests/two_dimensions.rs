//! Flows that fill two dimensions: the grid has no preferred axis, and matter in a tilted box rests
//! or flows as it should.
use colluvium_continuum::discretisation::ThresholdPressure;
use colluvium_continuum::flow::{Flow, YieldMethod};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;

const WALL: Boundary = Boundary::NoSlip { velocity: 0.0 };

fn material() -> MuI {
    MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0)
}

fn bounded(cells: usize, length: f64, low: Boundary, high: Boundary) -> Axis {
    Axis::Bounded {
        length,
        cells,
        low,
        high,
    }
}

fn flow(axes: [Axis; 2], acceleration: [f64; 2], pressure: impl Fn(f64) -> f64) -> Flow<MuI> {
    Flow::at_rest(
        Grid::new(axes).unwrap(),
        ThresholdPressure::Corner,
        material(),
        acceleration,
        YieldMethod::default(),
        pressure,
    )
    .unwrap()
}

/// The vertical chute, once across z and once across x.
#[test]
fn axes_are_interchangeable() {
    let wall = Boundary::LoadedWall {
        velocity: 0.0,
        pressure: 1.0,
    };
    let across = bounded(20, 1.0, Boundary::FreeSlip, wall);
    let along = Axis::Periodic {
        length: 0.15,
        cells: 3,
    };
    let mut lying = flow([along, across], [0.5, 0.0], |_| 1.0);
    let mut standing = flow([across, along], [0.0, 0.5], |_| 1.0);
    lying.step(1e8).unwrap();
    standing.step(1e8).unwrap();
    let sorted = |flow: &Flow<MuI>, component: usize| {
        let mut u = flow.state().u[flow.discretisation().grid().component(component)].to_vec();
        u.sort_by(f64::total_cmp);
        u
    };
    assert!(lying.max_speed() > 2.0);
    for (a, b) in sorted(&lying, 0).iter().zip(&sorted(&standing, 1)) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

/// Matter in a rough box, tilted against gravity, with a free surface.
fn tilted_box(tangent: f64) -> Flow<MuI> {
    let slope = tangent.atan();
    flow(
        [
            bounded(24, 2.0, WALL, WALL),
            bounded(12, 1.0, WALL, Boundary::FreeSurface),
        ],
        [slope.sin(), -slope.cos()],
        |z| slope.cos() * (1.0 - z),
    )
}

#[test]
fn tilted_box_rests_below_the_static_angle_and_flows_above() {
    for dt in [0.05, 1e3] {
        for tangent in [0.1, 0.25, 0.31] {
            let mut resting = tilted_box(tangent);
            assert_eq!(resting.step(dt).unwrap().dt, dt);
            assert!(resting.max_speed() < 5e-6, "{:e}", resting.max_speed());
        }
        let mut flowing = tilted_box(0.5);
        assert_eq!(flowing.step(dt).unwrap().dt, dt);
        assert!(flowing.max_speed() > 5e-3, "{:e}", flowing.max_speed());
    }
}

/// A heavy lid drags material round in a rough box, mobile beside the lid and rigid below: no step
/// needs to be cut and no volume is lost.
#[test]
fn lid_stirs_a_box_without_loss_of_volume() {
    let lid = Boundary::LoadedWall {
        velocity: 0.5,
        pressure: 1.0,
    };
    for dt in [0.01, 0.1, 1.0, 1e8] {
        let mut box_flow = flow(
            [bounded(16, 1.0, WALL, WALL), bounded(16, 1.0, WALL, lid)],
            [0.0, -0.1],
            |z| 1.0 + 0.1 * (1.0 - z),
        );
        let record = box_flow.step(dt).unwrap();
        assert_eq!(record.dt, dt);
        assert!(record.residuals.divergence < 1e-9 && record.residuals.momentum < 1e-9);
        assert!(box_flow.max_speed() > 0.01 && box_flow.max_speed() < 1.0);
        let [yielded, _] = box_flow.yielded_and_ill_posed();
        assert!(yielded > 0.0 && yielded < 1.0);
    }
}
