//! LIGGGHTS' deck. Its log is read as LAMMPS'.

use super::case::{Case, Law};
use super::lammps::{boundary, motion, schedule};
use super::start_files::types;
use std::fmt::Write;

/// The law LIGGGHTS solves.
pub fn law(case: &Case) -> &'static str {
    match case.law {
        Law::Hooke { .. } => {
            "hooke/stiffness, history, no tangential damping; arms to the contact point"
        }
        Law::HertzMindlin { .. } => "hertz, history; tangential dashpot beyond friction's limit",
    }
}

/// The deck; it reads `start.data` in the folder it runs in.
pub fn deck(case: &Case) -> String {
    let types = types(case);
    let mut d = format!("# {}: {}\n", case.name, case.title);
    d.push_str("units si\natom_style granular\natom_modify map array\n");
    let _ = writeln!(d, "boundary {}", boundary(case));
    d.push_str("newton off\ncommunicate single vel yes\nprocessors * * 1\nread_data start.data\n");
    let mut count = 0;
    let mut property = |name: &str, pairs: bool, value: f64| {
        count += 1;
        let (kind, repeat) = if pairs {
            (format!("peratomtypepair {types}"), types * types)
        } else {
            ("peratomtype".into(), types)
        };
        let values = vec![value.to_string(); repeat].join(" ");
        format!("fix property{count} all property/global {name} {kind} {values}\n")
    };
    let (lines, model) = match case.law {
        Law::Hooke {
            stiffness,
            tangential,
            damping,
            friction,
        } => (
            [
                // Moduli are asked for by every model and not used by this one.
                property("youngsModulus", false, 1e7),
                property("poissonsRatio", false, 0.3),
                property("kn", true, stiffness),
                property("kt", true, tangential),
                property("gamman", true, damping),
                property("gammat", true, 0.0),
                property("coefficientFriction", true, friction),
            ]
            .concat(),
            "hooke/stiffness tangential history tangential_damping off",
        ),
        Law::HertzMindlin {
            young,
            poisson,
            restitution,
            friction,
        } => (
            [
                property("youngsModulus", false, young),
                property("poissonsRatio", false, poisson),
                property("coefficientRestitution", true, restitution),
                property("coefficientFriction", true, friction),
            ]
            .concat(),
            "hertz tangential history",
        ),
    };
    d.push_str(&lines);
    let _ = writeln!(d, "pair_style gran model {model}\npair_coeff * *");
    for (k, wall) in case.walls.iter().enumerate() {
        let (axis, at) = (["x", "y", "z"][wall.axis], wall.position);
        let _ = writeln!(
            d,
            "fix wall{k} all wall/gran model {model} primitive type 1 {axis}plane {at}"
        );
    }
    motion(&mut d, case);
    let [x, y, z] = case.gravity;
    let g = x.hypot(y).hypot(z);
    let _ = writeln!(d, "fix pull all gravity {g} vector {x} {y} {z}");
    let _ = writeln!(d, "thermo_modify norm no lost error format float %.12g");
    schedule(&mut d, case);
    d
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::case::case;

    #[test]
    fn properties_are_given_for_every_pair_of_types() {
        let chute = deck(&case("chute").unwrap());
        assert!(chute.contains("gamman peratomtypepair 2 50 50 50 50\n"));
        assert!(chute.contains("gammat peratomtypepair 2 0 0 0 0\n"));
        let settled = deck(&case("settled").unwrap());
        assert!(settled.contains("coefficientRestitution peratomtypepair 1 0.5\n"));
        assert_eq!(settled.matches("primitive type 1").count(), 5);
    }
}
