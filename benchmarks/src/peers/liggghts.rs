//! LIGGGHTS' deck. Its log is read as LAMMPS'.

use super::case::Case;
use super::lammps::{boundary, motion, schedule};
use super::law::{Cohesion, Law, Rolling};
use super::start_files::types;
use std::fmt::Write;

/// The law LIGGGHTS solves, or the nearest it has.
pub fn law(case: &Case) -> String {
    let normal = match case.law {
        Law::Hooke { .. } => {
            "hooke/stiffness, history, no tangential damping; arms to the contact point"
        }
        Law::HertzMindlin { .. } => "hertz, history; tangential dashpot beyond friction's limit",
        Law::Viscoelastic { .. } => "nearest it has: hertz, history, dashpots of restitution 0.5",
        Law::Jkr { .. } => "nearest it has: hertz, history, epsd, sjkr; no twisting",
    };
    let turning = match case.rolling {
        Rolling::Free => "",
        Rolling::Epsd { .. } => ", epsd",
        Rolling::Shape { .. } => ", epsd as the nearest it has; no twisting",
    };
    let cohesion = match case.cohesion {
        Cohesion::None => "",
        Cohesion::ContactArea { .. } => ", sjkr",
        Cohesion::Dmt { .. } => ", sjkr as the nearest it has",
    };
    format!("{normal}{turning}{cohesion}")
}

/// Rolling resistance of the model: μ_r and η_r of its `epsd`.
fn epsd(case: &Case) -> Option<[f64; 2]> {
    match (case.law, case.rolling) {
        (
            _,
            Rolling::Epsd {
                friction,
                damping_ratio,
            },
        ) => Some([friction, damping_ratio]),
        (
            _,
            Rolling::Shape {
                beta,
                rolling_friction,
                ..
            },
        ) => Some([beta * rolling_friction, 0.0]),
        (Law::Jkr { .. }, Rolling::Free) => Some([0.02, 0.0]),
        (_, Rolling::Free) => None,
    }
}

/// Cohesion energy density (J/m³) of its `sjkr`.
fn sjkr(case: &Case) -> Option<f64> {
    // The pull of some five weights of a grain, as the other laws'.
    const LIKE_THE_OTHERS: f64 = 4e4;
    match (case.law, case.cohesion) {
        (_, Cohesion::ContactArea { density }) => Some(density),
        (_, Cohesion::Dmt { .. }) | (Law::Jkr { .. }, Cohesion::None) => Some(LIKE_THE_OTHERS),
        (_, Cohesion::None) => None,
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
    let (mut lines, mut model) = match case.law {
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
            "hooke/stiffness tangential history".to_owned(),
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
            "hertz tangential history".to_owned(),
        ),
        Law::Viscoelastic { young, poisson, .. } | Law::Jkr { young, poisson, .. } => (
            [
                property("youngsModulus", false, young),
                property("poissonsRatio", false, poisson),
                property("coefficientRestitution", true, 0.5),
                property("coefficientFriction", true, 0.5),
            ]
            .concat(),
            "hertz tangential history".to_owned(),
        ),
    };
    // The models of a style are named in this order.
    if let Some(density) = sjkr(case) {
        lines.push_str(&property("cohesionEnergyDensity", true, density));
        model.push_str(" cohesion sjkr");
    }
    if let Some([friction, damping]) = epsd(case) {
        lines.push_str(&property("coefficientRollingFriction", true, friction));
        lines.push_str(&property("coefficientRollingViscousDamping", true, damping));
        model.push_str(" rolling_friction epsd");
    }
    d.push_str(&lines);
    // Walls do not take the word; the coefficient of zero says the same.
    let off = match case.law {
        Law::Hooke { .. } if case.walls.is_empty() => " tangential_damping off",
        _ => "",
    };
    let _ = writeln!(d, "pair_style gran model {model}{off}\npair_coeff * *");
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
        let cohesive = deck(&case("settled-cohesion").unwrap());
        assert!(cohesive.contains("cohesionEnergyDensity peratomtypepair 1 40000\n"));
        let model = "hertz tangential history cohesion sjkr rolling_friction epsd";
        assert_eq!(cohesive.matches(model).count(), 6);
        assert_eq!(
            deck(&case("settled-jkr").unwrap()).matches(model).count(),
            6
        );
        assert!(law(&case("settled-jkr").unwrap()).contains("nearest"));
    }
}
