//! Free tops and pendulums against their exact solutions.

use super::scene::*;
use colluvium_dem::*;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};

/// Arithmetic–geometric mean.
fn agm(mut a: f64, mut b: f64) -> f64 {
    while (a - b).abs() > 1e-15 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// Jacobi's sn, cn, dn of an argument and a parameter m = k², by descending Landen transformations
/// (Abramowitz & Stegun 16.4).
fn jacobi(u: f64, m: f64) -> [f64; 3] {
    let (mut a, mut c) = (vec![1.0], vec![m.sqrt()]);
    let mut b = (1.0 - m).sqrt();
    while c[c.len() - 1] > 1e-16 {
        let last = a[a.len() - 1];
        a.push(0.5 * (last + b));
        c.push(0.5 * (last - b));
        b = (last * b).sqrt();
    }
    let n = a.len() - 1;
    let mut phi = 2.0_f64.powi(n as i32) * a[n] * u;
    for k in (1..=n).rev() {
        phi = 0.5 * (phi + (c[k] / a[k] * phi.sin()).asin());
    }
    let (sn, cn) = phi.sin_cos();
    [sn, cn, (1.0 - m * sn * sn).sqrt()]
}

fn free(spin: Vector3<f64>, timestep: f64) -> Simulation {
    let body = cuboid().moving(Vector3::new(0.3, -0.2, 0.1), spin);
    Simulation::new(setup(smooth(1e5), vec![body], vec![], timestep)).unwrap()
}

/// Angular velocity in the body's own axes.
fn own_spin(s: &mut Simulation) -> Vector3<f64> {
    let b = s.body(0);
    b.pose.inward(&b.spin)
}

#[test]
fn a_free_top_follows_jacobi_s_elliptic_functions() {
    let [hx, hy, hz] = HALF;
    let mass = 8.0 * hx * hy * hz * DENSITY;
    // I_x < I_y < I_z, as the x edge is the longest.
    let [a, b, c] = [(hy, hz), (hz, hx), (hx, hy)].map(|(p, q)| mass / 3.0 * (p * p + q * q));
    let spin = Vector3::<f64>::new(1.0, 0.0, 2.0);
    let energy = 0.5 * (a * spin.x.powi(2) + c * spin.z.powi(2));
    let square = (a * spin.x).powi(2) + (c * spin.z).powi(2);
    assert!(square > 2.0 * energy * b, "it circles about z");
    let rate = ((c - b) * (square - 2.0 * energy * a) / (a * b * c)).sqrt();
    let m = (b - a) * (2.0 * energy * c - square) / ((c - b) * (square - 2.0 * energy * a));
    let middle = ((2.0 * energy * c - square) / (b * (c - b))).sqrt();
    let exact = |t: f64| {
        let [sn, cn, dn] = jacobi(rate * t, m);
        Vector3::new(spin.x * cn, middle * sn, spin.z * dn)
    };
    let mut s = free(spin, 1e-3);
    let mut worst: f64 = 0.0;
    for _ in 0..200 {
        s.advance(500).unwrap();
        worst = worst.max((own_spin(&mut s) - exact(s.time())).norm());
    }
    println!("100 s at 1 ms: {worst:e} rad/s of 2.2");
    assert!(worst < 1e-10, "{worst:e}");
    // The motion comes back after the period 4 K(m)/rate, K = π/(2 agm(1, √(1 - m))).
    let period = TAU / agm(1.0, (1.0 - m).sqrt()) / rate;
    let steps: u32 = 4000;
    let mut s = free(spin, period / f64::from(steps));
    s.advance(u64::from(4 * steps)).unwrap();
    let error = (own_spin(&mut s) - spin).norm();
    println!("after four periods of {period} s: {error:e}");
    assert!(error < 1e-11, "{error:e}");
}

/// Largest relative change of energy, and of angular momentum, over some steps of a free top.
fn drift(spin: [f64; 3], timestep: f64, steps: u64) -> [f64; 2] {
    let mut s = free(spin.into(), timestep);
    let (energy, before) = (kinetic(&mut s), s.body(0).angular_momentum);
    let (mut worst, mut turned) = (0.0_f64, 0.0_f64);
    for _ in 0..100 {
        s.advance(steps / 100).unwrap();
        worst = worst.max((kinetic(&mut s) / energy - 1.0).abs());
        turned = turned.max((s.body(0).angular_momentum - before).norm() / before.norm());
    }
    [worst, turned]
}

#[test]
fn a_million_steps_keep_energy_and_angular_momentum() {
    for (spin, timestep) in [
        ([1.0, 1.5, 2.0], 1e-2),
        ([1e-5, 3.0, 1e-5], 1e-2),
        ([30.0, 2.0, 1.0], 1e-2),
    ] {
        let [energy, momentum] = drift(spin, timestep, 1_000_000);
        println!("{spin:?} rad/s at {timestep} s: energy {energy:e}, momentum {momentum:e}");
        assert_eq!(momentum, 0.0);
        assert!(energy < 3e-12, "{spin:?}: {energy:e}");
    }
}

/// A rod hung at its end, let go at an angle from below (rad).
fn pendulum(angle: f64, timestep: f64) -> Simulation {
    let half = 0.5;
    let rod = Part::cuboid(Vector3::new(0.02, 0.03, half), 1000.0);
    // The hinge is no principal direction of the rod: it lies askew in its own axes.
    let askew = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.4);
    let swing = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -angle);
    let body = Body::new(vec![rod])
        .at(swing * -Vector3::z() * half)
        .turned(swing * askew)
        .freedom(Freedom::Hinged(Hinge {
            point: Vector3::zeros(),
            axis: Vector3::y(),
        }));
    let mut setup = setup(smooth(1e5), vec![body], vec![], timestep);
    setup.gravity = -Vector3::z() * 9.81;
    Simulation::new(setup).unwrap()
}

/// Mean period of a pendulum over some swings, from interpolated passages of the lowest point.
fn period(angle: f64, timestep: f64, swings: usize) -> f64 {
    let mut s = pendulum(angle, timestep);
    let mut passages = Vec::new();
    let place = |s: &mut Simulation| s.body(0).centre.x;
    let mut before = place(&mut s);
    while passages.len() < 2 * swings + 1 {
        s.advance(1).unwrap();
        let now = place(&mut s);
        if before * now < 0.0 {
            passages.push(s.time() - timestep * now / (now - before));
        }
        before = now;
    }
    (passages[2 * swings] - passages[0]) / swings as f64
}

#[test]
fn a_physical_pendulum_has_its_period_at_any_amplitude_to_second_order() {
    let (half, width) = (0.5, 0.02_f64.powi(2) + 0.03_f64.powi(2));
    let askew: f64 = 0.4;
    // I/M about the hinge: of the cuboid about an axis across it, and the way of its centre.
    let across = |w: f64| (w * w + half * half) / 3.0;
    let about = across(0.02) * askew.cos().powi(2) + across(0.03) * askew.sin().powi(2);
    assert!(about < (width + half * half) / 3.0);
    let rate = (9.81 * half / (about + half * half)).sqrt();
    for angle in [0.1, 1.0, 2.8_f64] {
        let exact = TAU / rate / agm(1.0, (0.5 * angle).cos());
        let [coarse, fine] = [0.01, 0.005].map(|dt| period(angle, dt, 5) / exact - 1.0);
        let order = (coarse / fine).abs().log2();
        println!("{angle} rad: {coarse:e} at 10 ms, {fine:e} at 5 ms, order {order:.2}");
        assert!(fine.abs() < 3e-4, "{angle}: {fine:e}");
        assert!((order - 2.0).abs() < 0.3, "{angle}: {coarse:e} {fine:e}");
    }
}

#[test]
fn a_pendulum_keeps_energy_and_its_ledger() {
    let mut s = pendulum(2.0, 2e-3);
    s.open_energy_ledger();
    let potential = |s: &mut Simulation| s.body(0).mass * 9.81 * s.body(0).centre.z;
    let start = potential(&mut s);
    let scale = s.body(0).mass * 9.81;
    let mut worst: f64 = 0.0;
    for _ in 0..1000 {
        s.advance(100).unwrap();
        let energy = kinetic(&mut s) + potential(&mut s) - start;
        worst = worst.max(energy.abs() / scale);
    }
    assert!(worst < 1e-5, "{worst:e}");
    let ledger = s.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
    assert!(s.momentum_error() < 1e-12);
}

#[test]
fn a_driven_hinge_turns_as_it_is_told_and_gives_work() {
    // A paddle that turns half round in a second and throws a ball.
    let turning = Motion::Rotation(walls::Rotation {
        point: Vector3::zeros(),
        axis: Vector3::y(),
        rate: -PI,
    });
    let paddle = Part::cuboid(Vector3::new(0.3, 0.1, 0.02), 0.0).at(Vector3::x() * 0.3);
    let body = Body::new(vec![paddle]).freedom(Freedom::Driven(turning));
    let mut setup = setup(rough(1e5, 1.0, 0.0), vec![body], vec![], 2e-5);
    let mut grain = Grain::at_rest(Vector3::new(0.4, 0.0, 0.25), 0.05, 1000.0);
    grain.velocity = -Vector3::z();
    setup.grains.push(grain);
    let mut s = Simulation::new(setup).unwrap();
    s.open_energy_ledger();
    s.advance(15_000).unwrap();
    let b = s.body(0);
    assert!((b.pose.orientation.angle() - PI * s.time()).abs() < 1e-12);
    let ledger = s.energy_ledger().unwrap();
    assert!(ledger.drive > 1.0, "{}", ledger.drive);
    assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
    // Elastic: all work is in the grain.
    let gained = ledger.kinetic - ledger.kinetic_before;
    assert!((ledger.drive / gained - 1.0).abs() < 1e-5);
    assert!(s.momentum_error() < 1e-12);
}
