//! A column at rest stays at rest, and keeps its density in the overlap.

use super::world::{Bed, deep_bed, fastest, small_bed, steps};
use colluvium_coupling::overlap::{Averages, NormalMotion, Overlap, OverlapSettings};
use colluvium_dem::{Simulation, Snapshot};

/// What has become of a joined bed that was brought to rest and left alone.
struct Rest {
    /// Largest speed of a grain, and of the continuum.
    speeds: [f64; 2],
    /// Relative change of the grains' mass in the inner overlap.
    drift: f64,
    /// Pressure of the grains at the handshake surface over that before the cut.
    bears: f64,
}

fn inner_mass(averages: &Averages, inner: usize) -> f64 {
    averages.nodes[..inner].iter().map(|node| node.mass).sum()
}

fn rest(
    bed: &Bed,
    slope_degrees: f64,
    height: f64,
    [settle, watch]: [f64; 2],
    damping: f64,
    uncoupled: bool,
) -> [Rest; 2] {
    [NormalMotion::Held, NormalMotion::Riding].map(|normal_motion| {
        let mut simulation = Simulation::new(bed.tilted(slope_degrees)).unwrap();
        let settings = OverlapSettings {
            normal_motion: Some(normal_motion),
            uncoupled,
            ..Default::default()
        };
        let mut spec = bed.continuum_above(height, settings);
        spec.strain_rate_floor = 1e-7;
        let mut overlap = Overlap::replace(spec, &mut simulation).unwrap();
        let inner = overlap.strip().inner;
        let borne = |overlap: &Overlap<_>| overlap.averages().faces[inner].pressure;
        let whole = borne(&overlap);
        // The sway that the cut left behind dies out slowly by itself.
        let mut left = steps(settle);
        while left > 0 {
            let part = left.min(500);
            overlap.advance(&mut simulation, part).unwrap();
            simulation.damp(damping);
            left -= part;
        }
        let before = inner_mass(overlap.averages(), inner);
        overlap.advance(&mut simulation, steps(watch)).unwrap();
        let after = inner_mass(overlap.averages(), inner);
        let continuum = overlap.continuum().velocities().iter();
        let continuum = continuum.fold(0.0_f64, |m, u| m.max(u.abs()));
        let mut snapshot = Snapshot::default();
        let speeds = [
            fastest(&mut simulation, &mut snapshot),
            continuum.max(overlap.normal_velocity().abs()),
        ];
        let (drift, bears) = (after / before - 1.0, borne(&overlap) / whole);
        println!(
            "{slope_degrees} degrees, {normal_motion:?}: grains {:.1e}, continuum {:.1e}, drift {drift:.1e}, pressure at m {bears:.4} of that before",
            speeds[0], speeds[1]
        );
        Rest {
            speeds,
            drift,
            bears,
        }
    })
}

#[test]
fn a_level_column_rests() {
    for rest in rest(small_bed(), 0.0, 10.0, [30.0, 20.0], 0.2, false) {
        assert!((rest.bears - 1.0).abs() < 0.05, "{}", rest.bears);
        assert!(rest.speeds[0] < 1e-6, "{:e}", rest.speeds[0]);
        assert!(rest.speeds[1] < 1e-6, "{:e}", rest.speeds[1]);
        assert!(rest.drift.abs() < 1e-4, "{:e}", rest.drift);
    }
}

/// The control: with nothing exchanged the grains of a level bed rest as well, but bear what is left above them alone; on a
/// slope the continuum slides off.
#[test]
fn nothing_exchanged_bears_nothing_and_slides() {
    for rest in rest(small_bed(), 0.0, 10.0, [10.0, 5.0], 0.2, true) {
        assert!(rest.bears < 0.6, "{}", rest.bears);
    }
    for rest in rest(small_bed(), 15.0, 10.0, [3.0, 2.0], 1.0, true) {
        assert!(rest.speeds[1] > 0.5, "{:e}", rest.speeds[1]);
        assert!(rest.bears < 0.6, "{}", rest.bears);
    }
}

/// Below the yield stress the continuum creeps no more than its floor and the grains' last sway let it. The grains here
/// are packed 6 % denser than the continuum: a copy that weighed what the continuum weighs would creep at 8e-3 for
/// ever, by the stress that the grains' greater weight has in excess.
#[test]
#[ignore = "half a minute; run by tests/validate.sh"]
fn a_column_on_fifteen_degrees_rests() {
    for rest in rest(deep_bed(), 15.0, 16.0, [60.0, 60.0], 1.0, false) {
        assert!(rest.speeds[0] < 5e-3, "{:e}", rest.speeds[0]);
        assert!(rest.speeds[1] < 1e-4, "{:e}", rest.speeds[1]);
        assert!(rest.drift.abs() < 1e-4, "{:e}", rest.drift);
    }
}
