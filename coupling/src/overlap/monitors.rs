//! How well grains and continuum agree, over the time since the monitors were started.

use super::averages::Averages;
use super::far_side::FarSide;
use super::strip::Strip;
use colluvium_continuum::rheology::ShearLaw;
use serde::Serialize;

/// Sums over exchanges; plain numbers, so that they go into a checkpoint as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Monitors {
    /// Exchanges.
    pub count: f64,
    slip: f64,
    velocity: f64,
    shear: [f64; 2],
    pressure: [f64; 2],
    density: [f64; 2],
    temperature: [f64; 2],
    escaped: f64,
    relaxation: f64,
    interface: f64,
}

/// What the monitors say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Velocity of the continuum minus that of the grains at the handshake surface m, over that of the grains, by means with their
    /// signs; not a number where grains at rest are slipped past. To be below 1 %.
    pub slip: f64,
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
    /// Impulse of relaxation over that of the shear traction on the edge, by sums with their signs; not a number where there is no
    /// traction but a relaxation. To be below 10 %.
    pub relaxation_share: f64,
}

/// Share of the pressure below which a stress is round-off.
const NO_STRESS: f64 = 1e-12;

/// Grains over continuum.
fn ratio_of_stresses([grains, continuum]: [f64; 2], pressure: [f64; 2]) -> Option<f64> {
    let largest = pressure[0].abs().max(pressure[1].abs());
    (continuum.abs() > NO_STRESS * largest).then(|| grains / continuum)
}

impl Monitors {
    /// Takes in one exchange: sums of the grains, the continuum, impulses of relaxation and traction.
    pub fn take<L: ShearLaw>(
        &mut self,
        averages: &Averages,
        continuum: &FarSide<L>,
        (strip, area): (&Strip, f64),
        (relaxation, interface): (&[f64], f64),
        escaped: usize,
    ) {
        self.count += 1.0;
        let m = strip.inner;
        let beside = [&averages.nodes[m - 1], &averages.nodes[m]];
        self.slip += 0.5 * (beside[0].slip() + beside[1].slip());
        self.velocity += 0.5 * (beside[0].velocity() + beside[1].velocity());
        let face = &averages.faces[m];
        let pairs = [
            (&mut self.shear, face.shear, continuum.shear_stress(m)),
            (&mut self.pressure, face.pressure, continuum.pressure(m)),
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
            self.density[part] += mass / (area * strip.cell * nodes.len() as f64);
            if mass > 0.0 {
                self.temperature[part] += fluctuation / (3.0 * mass);
            }
        }
        self.escaped = self.escaped.max(escaped as f64);
        self.relaxation += relaxation.iter().sum::<f64>();
        self.interface += interface;
    }

    /// Means so far.
    pub fn report(&self) -> Report {
        // Nothing over nothing is nothing, and something over nothing is no share.
        let ratio = |a: f64, b: f64| match a == 0.0 {
            true => 0.0,
            false if b == 0.0 => f64::NAN,
            false => a / b,
        };
        let mean = |sum: f64| ratio(sum, self.count);
        Report {
            slip: ratio(self.slip, self.velocity),
            shear_ratio: ratio_of_stresses(self.shear, self.pressure),
            pressure_ratio: ratio_of_stresses(self.pressure, self.pressure),
            inner_density: mean(self.density[0]),
            buffer_density: mean(self.density[1]),
            inner_temperature: mean(self.temperature[0]),
            buffer_temperature: mean(self.temperature[1]),
            escaped: self.escaped,
            relaxation_share: ratio(self.relaxation.abs(), self.interface.abs()),
        }
    }

    /// All sums.
    pub fn numbers(&self) -> Vec<f64> {
        let m = self;
        [
            &[m.count, m.slip, m.velocity][..],
            &m.shear,
            &m.pressure,
            &m.density,
            &m.temperature,
            &[m.escaped, m.relaxation, m.interface],
        ]
        .concat()
    }

    /// From such numbers.
    pub fn from_numbers(n: &[f64]) -> Result<Self, String> {
        let &[
            count,
            slip,
            velocity,
            a,
            b,
            c,
            d,
            e,
            f,
            g,
            h,
            escaped,
            relaxation,
            interface,
        ] = n
        else {
            return Err(format!("{} numbers of monitors instead of 14", n.len()));
        };
        Ok(Self {
            count,
            slip,
            velocity,
            shear: [a, b],
            pressure: [c, d],
            density: [e, f],
            temperature: [g, h],
            escaped,
            relaxation,
            interface,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_nothing_is_not_small() {
        let share = |relaxation, interface| {
            let monitors = Monitors {
                relaxation,
                interface,
                ..Monitors::default()
            };
            monitors.report().relaxation_share
        };
        assert_eq!([share(0.0, 0.0), share(1.0, 4.0)], [0.0, 0.25]);
        assert!(share(1.0, 0.0).is_nan());
    }

    #[test]
    fn a_stress_of_round_off_has_no_ratio() {
        let with = |shear, pressure| {
            let monitors = Monitors {
                count: 1.0,
                shear,
                pressure,
                ..Monitors::default()
            };
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
