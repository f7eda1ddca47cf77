//! How well grains and continuum agree, over the time since the monitors were started.

use super::averages::{Averages, Node};
use super::far_side::FarSide;
use super::settings::Resolved;
use super::shell::Given;
use super::strip::Strip;
use super::windows::{self, Of, Sums, Windows};
use colluvium_continuum::rheology::ShearLaw;
use serde::Serialize;

/// Sums over exchanges, and the window of slip and relaxation that is open.
#[derive(Clone, Debug)]
pub struct Monitors {
    sums: Exchanges,
    windows: Windows,
}

/// Sums over exchanges; plain numbers, so that they go into a checkpoint as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Exchanges {
    count: f64,
    shear: [f64; 2],
    pressure: [f64; 2],
    density: [f64; 2],
    temperature: [f64; 2],
    escaped: f64,
    windows: Sums,
}

/// Numbers of [`Exchanges`].
const NUMBERS: usize = 10 + windows::NUMBERS;

/// What the monitors say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Velocity of the continuum minus that of the grains in the layers beside the handshake surface m, over that of the grains, by sizes of
    /// means over a window in time ([`windows`](super::windows)); not a number where grains at rest are slipped past. To be below 1 %.
    pub slip: f64,
    /// What the noise of the grains' velocities alone would make it.
    pub slip_noise: f64,
    /// Shear stress of the grains over that of the continuum at m; none where the continuum has none there but for
    /// round-off, as beside grains that do not act on it. To be within 5 %.
    pub shear_ratio: Option<f64>,
    /// Pressure of the grains over that of the continuum at m, likewise. To be within 5 %.
    pub pressure_ratio: Option<f64>,
    /// Density of the grains between a and m (kg/m³).
    pub inner_density: f64,
    /// The same between m and b; the outermost layer is never full.
    pub buffer_density: f64,
    /// Granular temperature ⟨v′²⟩/3 between a and m (m²/s²).
    pub inner_temperature: f64,
    /// The same between m and b.
    pub buffer_temperature: f64,
    /// Most grains beyond the edge by more than a cell at any exchange.
    pub escaped: f64,
    /// Impulse of relaxation, layer by layer, over that of the shear traction on the edge, by sizes of means over such a window; not a
    /// number where there is no traction but a relaxation. To be below 10 %.
    pub relaxation_share: f64,
    /// What the noise of the grains' velocities alone would make it.
    pub relaxation_noise: f64,
}

/// Nothing over nothing is nothing, and something over nothing is no share.
fn ratio(a: f64, b: f64) -> f64 {
    match a == 0.0 {
        true => 0.0,
        false if b == 0.0 => f64::NAN,
        false => a / b,
    }
}

/// Share of the pressure below which a stress is round-off.
const NO_STRESS: f64 = 1e-12;

/// Grains over continuum.
fn ratio_of_stresses([grains, continuum]: [f64; 2], pressure: [f64; 2]) -> Option<f64> {
    let largest = pressure[0].abs().max(pressure[1].abs());
    (continuum.abs() > NO_STRESS * largest).then(|| grains / continuum)
}

impl Monitors {
    /// Nothing seen yet.
    pub(super) fn new(strip: &Strip, settings: &Resolved) -> Self {
        Self {
            sums: Exchanges::default(),
            windows: Windows::new(1, [strip.nodes(), 1], settings),
        }
    }

    /// Starts anew.
    pub(super) fn clear(&mut self) {
        self.sums = Exchanges::default();
        self.windows.clear();
    }

    /// Takes in one exchange after a time (s): sums of the grains, the continuum, impulses of relaxation and traction.
    pub(super) fn take<L: ShearLaw>(
        &mut self,
        averages: &Averages,
        continuum: &FarSide<L>,
        (strip, area): (&Strip, f64),
        given: &Given,
        escaped: usize,
        dt: f64,
    ) {
        let m = strip.inner;
        self.take_velocities(&averages.nodes, m, given, dt);
        let sums = &mut self.sums;
        sums.count += 1.0;
        let face = &averages.faces[m];
        let pairs = [
            (&mut sums.shear, face.shear, continuum.shear_stress(m)),
            (&mut sums.pressure, face.pressure, continuum.pressure(m)),
        ];
        for (sums, grains, continuum) in pairs {
            sums[0] += grains;
            sums[1] += continuum;
        }
        for (part, nodes) in [&averages.nodes[..m], &averages.nodes[m..]]
            .into_iter()
            .enumerate()
        {
            let mass: f64 = nodes.iter().map(|node| node.mass).sum();
            let fluctuation: f64 = nodes.iter().map(|node| node.fluctuation).sum();
            sums.density[part] += mass / (area * strip.cell * nodes.len() as f64);
            if mass > 0.0 {
                sums.temperature[part] += fluctuation / (3.0 * mass);
            }
        }
        sums.escaped = sums.escaped.max(escaped as f64);
    }

    /// Slip and relaxation of the layers, of which the handshake surface is the inner face of the one numbered `m`.
    fn take_velocities(&mut self, nodes: &[Node], m: usize, given: &Given, dt: f64) {
        let windows = &mut self.windows;
        for (k, node) in nodes.iter().enumerate() {
            if k + 1 == m || k == m {
                let slip = (node.continuum - node.momentum) * dt;
                windows.add(
                    Of::Slip,
                    k,
                    [slip, 0.0, 0.0],
                    [node.mass, node.variance].map(|x| x * dt),
                );
                windows.add(
                    Of::Flow,
                    k,
                    [node.momentum * dt, 0.0, 0.0],
                    [node.mass * dt, 0.0],
                );
            }
            // Layers that relax nothing have no noise of it, either.
            if k >= m && given.relaxation[k] != 0.0 {
                windows.relax(k, [given.relaxation[k], 0.0, 0.0], node.variance, dt);
            }
        }
        windows.add(Of::Traction, 0, [given.shear, 0.0, 0.0], [dt, 0.0]);
        windows.pass(dt, &mut self.sums.windows);
    }

    /// Means so far.
    pub fn report(&self) -> Report {
        let sums = &self.sums;
        let windows = self.windows.closed(&sums.windows);
        let mean = |sum: f64| ratio(sum, sums.count);
        let [slip, flow] = [Of::Slip, Of::Flow].map(|kind| windows.of(kind));
        let [relaxation, traction] = [Of::Relaxation, Of::Traction].map(|kind| windows.of(kind));
        Report {
            slip: ratio(slip.size, flow.size),
            slip_noise: ratio(slip.floor, flow.size),
            shear_ratio: ratio_of_stresses(sums.shear, sums.pressure),
            pressure_ratio: ratio_of_stresses(sums.pressure, sums.pressure),
            inner_density: mean(sums.density[0]),
            buffer_density: mean(sums.density[1]),
            inner_temperature: mean(sums.temperature[0]),
            buffer_temperature: mean(sums.temperature[1]),
            escaped: sums.escaped,
            relaxation_share: ratio(relaxation.size, traction.size),
            relaxation_noise: ratio(relaxation.floor, traction.size),
        }
    }

    /// All sums.
    pub fn numbers(&self) -> Vec<f64> {
        let m = &self.sums;
        [
            &[m.count, m.escaped][..],
            &m.shear,
            &m.pressure,
            &m.density,
            &m.temperature,
            &m.windows.numbers(),
            &self.windows.numbers(),
        ]
        .concat()
    }

    /// Takes up such numbers.
    pub(super) fn take_up(&mut self, numbers: &[f64]) -> Result<(), String> {
        let broken = || format!("{} numbers of monitors do not fit", numbers.len());
        let (n, window) = numbers.split_first_chunk::<NUMBERS>().ok_or_else(broken)?;
        let (&[count, escaped, a, b, c, d, e, f, g, h], windows) =
            n.split_first_chunk::<10>().ok_or_else(broken)?;
        self.sums = Exchanges {
            count,
            escaped,
            shear: [a, b],
            pressure: [c, d],
            density: [e, f],
            temperature: [g, h],
            windows: Sums::from_numbers(windows.try_into().map_err(|_| broken())?),
        };
        self.windows.take_up(window).ok_or_else(broken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::overlap::{OverlapSettings, Scales};

    #[test]
    fn a_share_of_nothing_is_not_small() {
        assert_eq!([ratio(0.0, 0.0), ratio(1.0, 4.0)], [0.0, 0.25]);
        assert!(ratio(1.0, 0.0).is_nan());
    }

    /// Six layers of a strip; m is the third's inner face.
    fn monitors() -> Monitors {
        let scales = Scales {
            diameter: 1.0,
            time: 1.0,
            density: 0.6,
            stiffness: 1e4,
        };
        let settings = OverlapSettings::default().resolve(&scales, true).unwrap();
        Monitors::new(&Strip::new(&settings, 1.0), &settings)
    }

    #[test]
    fn layers_that_slip_both_ways_slip() {
        let mut monitors = monitors();
        let mut given = Given::nothing(6);
        given.shear = 0.2;
        given.relaxation = vec![0.0, 0.0, 0.0, 0.01, 0.0, -0.01];
        for _ in 0..100 {
            let node = |slip: f64| Node {
                mass: 20.0,
                momentum: 40.0,
                continuum: 40.0 * (1.0 + slip),
                variance: 0.04,
                ..Node::default()
            };
            let nodes = [0.0, 0.0, 0.03, -0.03, 0.0, 0.0].map(node);
            monitors.take_velocities(&nodes, 3, &given, 0.2);
        }
        let report = monitors.report();
        assert!((report.slip - 0.03).abs() < 1e-12, "{report:?}");
        assert!((report.relaxation_share - 0.1).abs() < 1e-12, "{report:?}");
        // √(2/π) · 0.2/40 times what windows of four memories leave.
        let left = (0.5_f64 * (1.0 - 0.25 * (1.0 - f64::exp(-4.0)))).sqrt();
        let noise = (2.0 / std::f64::consts::PI).sqrt() * 0.005 * left;
        assert!((report.slip_noise / noise - 1.0).abs() < 1e-9, "{report:?}");
        // Two layers of 0.2 N each, over a traction of 1 N; the one between them relaxes nothing.
        let noise = 2.0 * 0.2 / 0.005 * noise;
        assert!(
            (report.relaxation_noise / noise - 1.0).abs() < 1e-9,
            "{report:?}"
        );
        let mut again = self::monitors();
        again.take_up(&monitors.numbers()).unwrap();
        assert_eq!(again.report(), report);
        assert!(again.take_up(&monitors.numbers()[1..]).is_err());
    }

    #[test]
    fn a_stress_of_round_off_has_no_ratio() {
        let with = |shear, pressure| {
            let mut monitors = monitors();
            (monitors.sums.shear, monitors.sums.pressure) = (shear, pressure);
            let report = monitors.report();
            (report.shear_ratio, report.pressure_ratio)
        };
        assert_eq!(with([30.0, 40.0], [50.0, 100.0]), (Some(0.75), Some(0.5)));
        assert_eq!(with([30.0, -2e-15], [50.0, 100.0]), (None, Some(0.5)));
        assert_eq!(with([30.0, 0.0], [50.0, 0.0]), (None, None));
        // Little is not nothing.
        assert_eq!(with([30.0, 1e-6], [50.0, 100.0]).0, Some(3e7));
        assert_eq!(with([0.0; 2], [0.0; 2]), (None, None));
    }
}
