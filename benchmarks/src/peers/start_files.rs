//! The start state in the forms other codes read.

use super::case::Case;
use std::fmt::Write;

/// Which words a data file needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialect {
    /// LAMMPS as it is.
    Lammps,
    /// LIGGGHTS, a branch from before sections named their style.
    Liggghts,
}

/// Types of grain: 1 = free, 2 = frozen, where there are any.
pub fn types(case: &Case) -> usize {
    if case.grains.iter().any(|g| g.fixed) {
        2
    } else {
        1
    }
}

/// A `read_data` file.
pub fn data_file(case: &Case, dialect: Dialect) -> String {
    let mut text = format!("start of {}\n\n", case.name);
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "{} atoms\n{} atom types\n",
        case.grains.len(),
        types(case)
    );
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let _ = writeln!(
            text,
            "{} {} {axis}lo {axis}hi",
            case.lower[k], case.upper[k]
        );
    }
    text.push_str(match dialect {
        Dialect::Lammps => "\nAtoms # sphere\n\n",
        Dialect::Liggghts => "\nAtoms\n\n",
    });
    for (i, g) in case.grains.iter().enumerate() {
        let (kind, x) = (if g.fixed { 2 } else { 1 }, g.position);
        let (d, rho) = (2.0 * g.radius, g.density);
        let _ = writeln!(text, "{} {kind} {d} {rho} {} {} {}", i + 1, x.x, x.y, x.z);
    }
    text.push_str("\nVelocities\n\n");
    for (i, g) in case.grains.iter().enumerate() {
        let (v, w) = (g.velocity, g.spin);
        let line = (i + 1, v.x, v.y, v.z, w.x, w.y, w.z);
        let (n, vx, vy, vz, wx, wy, wz) = line;
        let _ = writeln!(text, "{n} {vx:e} {vy:e} {vz:e} {wx:e} {wy:e} {wz:e}");
    }
    text
}

/// A table without a header for the codes that are driven by a Python script: radius, density, frozen,
/// position, velocity, spin.
pub fn table(case: &Case) -> String {
    let mut text = String::new();
    for g in &case.grains {
        let _ = write!(text, "{},{},{}", g.radius, g.density, u8::from(g.fixed));
        for c in g.position.iter().chain(&g.velocity).chain(&g.spin) {
            let _ = write!(text, ",{c:e}");
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::case::case;

    #[test]
    fn every_digit_survives_the_data_file() {
        let case = case("settled").unwrap();
        for dialect in [Dialect::Lammps, Dialect::Liggghts] {
            let text = data_file(&case, dialect);
            let atoms: Vec<&str> = text
                .lines()
                .skip_while(|l| !l.starts_with("Atoms"))
                .skip(2)
                .take(case.grains.len())
                .collect();
            for (line, g) in atoms.iter().zip(&case.grains) {
                let x: Vec<f64> = line.split(' ').map(|w| w.parse().unwrap()).collect();
                assert_eq!(
                    x[2..],
                    [
                        2.0 * g.radius,
                        g.density,
                        g.position.x,
                        g.position.y,
                        g.position.z
                    ]
                );
            }
            assert!(text.contains("10000 atoms\n1 atom types"));
        }
    }

    #[test]
    fn frozen_grains_are_type_two() {
        let case = case("chute").unwrap();
        assert_eq!(types(&case), 2);
        let text = data_file(&case, Dialect::Liggghts);
        let frozen = text.lines().filter(|l| {
            let mut words = l.split(' ');
            words.nth(1) == Some("2") && words.count() == 5
        });
        assert_eq!(frozen.count(), 1024);
        assert_eq!(
            table(&case)
                .lines()
                .filter(|l| l.split(',').nth(2) == Some("1"))
                .count(),
            1024
        );
    }
}
