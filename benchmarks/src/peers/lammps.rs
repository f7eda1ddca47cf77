//! LAMMPS: its deck, and its log, which LIGGGHTS' is like.

use super::case::{Case, State, Wall};
use super::law::{Cohesion, Law, Rolling, moduli};
use super::start_files::types;
use super::trace::{Trace, finished};
use colluvium_dem::{Elasticity, Jkr, ShapeParameter};
use std::fmt::Write;

/// Appends the process' time on a processor (ns) to `cpu.txt`: once before and once after the clock.
pub const STAMP: &str = r#"shell "cat /proc/$PPID/schedstat >> cpu.txt""#;

/// The law LAMMPS solves.
pub fn law(case: &Case) -> String {
    let normal = match case.law {
        Law::Hooke { .. } if case.walls.is_empty() => {
            "the case's: spring reset under sliding, radii as arms, pull at release kept"
        }
        Law::Hooke { .. } => "granular: hooke, linear_history, mass_velocity",
        Law::HertzMindlin { .. } if matches!(case.cohesion, Cohesion::Dmt { .. }) => {
            "granular: dmt, mindlin, viscoelastic with the dashpot of a typical contact"
        }
        Law::HertzMindlin { .. } => {
            "granular: hertz, mindlin, coeff_restitution; limited spring reset less the dashpot's share"
        }
        Law::Viscoelastic { .. } => {
            "granular: hertz, mindlin, viscoelastic with the reduced mass of the mean grain"
        }
        Law::Jkr { .. } => {
            "granular: jkr, mindlin, mass_velocity, rolling sds, twisting sds; limits grow with the load"
        }
    };
    let turning = match case.rolling {
        Rolling::Free => "",
        Rolling::Epsd { .. } => ", rolling sds with the stiffness of a typical contact",
        Rolling::Shape { .. } => {
            ", rolling and twisting sds with the stiffness of a typical contact"
        }
    };
    let cohesion = match case.cohesion {
        Cohesion::ContactArea { .. } => "; without cohesion: it has none on the contact area",
        Cohesion::None | Cohesion::Dmt { .. } => "",
    };
    format!("{normal}{turning}{cohesion}")
}

/// Arguments of `pair granular` and `wall/gran granular`.
///
/// The tangential dashpot is the normal one times √(k_t/k_n) of the two tangent stiffnesses, 8 G* a and
/// 2 E* a: the same relation of damping to stiffness along both directions. `sds` takes one stiffness for
/// all contacts: that of [`Typical`].
fn granular(case: &Case) -> String {
    match case.law {
        Law::Hooke {
            stiffness,
            tangential,
            damping,
            friction,
        } => format!(
            "hooke {stiffness} {damping} tangential linear_history {tangential} 0 {friction} damping mass_velocity"
        ),
        Law::HertzMindlin {
            young,
            poisson,
            restitution,
            friction,
        } => {
            let [e, g] = moduli(young, poisson);
            let (normal, tangential, ratio) = (4.0 / 3.0 * e, 8.0 * g, (4.0 * g / e).sqrt());
            let shear = format!("tangential mindlin {tangential} {ratio} {friction}");
            let turning = turning(case, young, poisson);
            match case.cohesion {
                Cohesion::Dmt { work_of_adhesion } => {
                    // It takes no restitution beside cohesion: the dashpot of a typical contact, with a ratio
                    // of damping of -ln e/√(π² + ln² e), 5/6 of it for the tangent stiffness 2 E* a.
                    let Typical { mass, contact, .. } = Typical::of(case, e);
                    let log = restitution.ln();
                    let ratio = (5.0_f64 / 6.0).sqrt() * -log / log.hypot(std::f64::consts::PI);
                    let damping =
                        2.0 * ratio * (2.0 * e * contact * mass).sqrt() / (contact * mass);
                    // γ of LAMMPS is half the work of adhesion.
                    let surface_energy = 0.5 * work_of_adhesion;
                    format!(
                        "dmt {young} {damping} {poisson} {surface_energy} {shear}{turning} damping viscoelastic"
                    )
                }
                Cohesion::None | Cohesion::ContactArea { .. } => format!(
                    "hertz {normal} {restitution} {shear}{turning} damping coeff_restitution"
                ),
            }
        }
        Law::Viscoelastic {
            young,
            poisson,
            dissipation,
            friction,
        } => {
            let [e, g] = moduli(young, poisson);
            let typical = Typical::of(case, e);
            let damping = 4.0 / 3.0 * dissipation * e / typical.mass;
            format!(
                "hertz {} {damping} tangential mindlin {} 1 {friction} damping viscoelastic",
                4.0 / 3.0 * e,
                8.0 * g
            )
        }
        Law::Jkr {
            young,
            poisson,
            surface_energy,
            damping_rate,
            critical_rolling,
        } => {
            let [e, g] = moduli(young, poisson);
            let radius = Typical::of(case, e).radius;
            let jkr = Jkr {
                surface_energy,
                elasticity: Elasticity {
                    youngs_modulus: young,
                    poissons_ratio: poisson,
                },
                damping_rate,
                critical_rolling,
            };
            // Limits of sliding, rolling and twisting of a contact without load, over twice its pull-off force.
            let load = 2.0 * jkr.pull_off_force(radius);
            let slip = jkr.sliding_stiffness(radius) * jkr.critical_sliding(radius) / load;
            let rolling = jkr.rolling_stiffness(radius) / radius.powi(2);
            let twisting = jkr.twisting_stiffness(radius);
            format!(
                "jkr {young} {damping_rate} {poisson} {surface_energy} tangential mindlin {} 0 {slip} rolling sds {rolling} 0 {} twisting sds {twisting} 0 {} damping mass_velocity",
                8.0 * g,
                rolling * critical_rolling / load,
                twisting / (16.0 * std::f64::consts::PI) / load,
            )
        }
    }
}

/// Words for rolling and twisting beside a Hertz contact.
fn turning(case: &Case, young: f64, poisson: f64) -> String {
    let [e, g] = moduli(young, poisson);
    let Typical {
        radius,
        mass,
        contact,
    } = Typical::of(case, e);
    let (normal, tangential) = (4.0 / 3.0 * e * contact, 8.0 * g * contact);
    match case.rolling {
        Rolling::Free => String::new(),
        Rolling::Epsd {
            friction,
            damping_ratio,
        } => {
            // M = R F, F = k ξ + γ dξ/dt, ξ = R θ; of two equal grains of radius 2R and mass 2m.
            let stiffness = 2.25 * normal * friction * friction;
            let damping = 2.0 * damping_ratio * (stiffness * 1.4 * 4.0 * mass).sqrt();
            format!(" rolling sds {stiffness} {damping} {friction}")
        }
        Rolling::Shape {
            beta,
            rolling_friction,
            twisting_friction,
        } => {
            let shape = ShapeParameter {
                beta,
                rolling_friction,
                twisting_friction,
            };
            let rolling = shape.rolling_stiffness(normal, radius) / radius.powi(2);
            let twisting = shape.twisting_stiffness(tangential, radius);
            format!(
                " rolling sds {rolling} 0 {} twisting sds {twisting} 0 {}",
                beta * rolling_friction,
                beta * radius * twisting_friction
            )
        }
    }
}

/// A contact of two mean grains of a case.
struct Typical {
    /// Reduced radius (m).
    radius: f64,
    /// Reduced mass (kg).
    mass: f64,
    /// Radius of the contact (m) under the weight of ten grains.
    contact: f64,
}

impl Typical {
    fn of(case: &Case, modulus: f64) -> Typical {
        let n = case.grains.len() as f64;
        let mean = case.grains.iter().map(|g| g.radius).sum::<f64>() / n;
        let density = case.grains[0].density;
        let mass = 4.0 / 3.0 * std::f64::consts::PI * mean.powi(3) * density;
        let gravity = case.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
        let radius = 0.5 * mean;
        Typical {
            radius,
            mass: 0.5 * mass,
            contact: (0.75 * 10.0 * mass * gravity * radius / modulus).cbrt(),
        }
    }
}

/// The deck; it reads `start.data` in the folder it runs in.
pub fn deck(case: &Case) -> String {
    let mut d = format!("# {}: {}\n", case.name, case.title);
    // Writing to a String cannot fail.
    let _ = writeln!(
        d,
        "units {}",
        if case.walls.is_empty() { "lj" } else { "si" }
    );
    d.push_str("atom_style sphere\n");
    let _ = writeln!(d, "boundary {}", boundary(case));
    // Grains in motion have their neighbours' velocities at hand; pairs across ranks are done by both.
    d.push_str("newton off\ncomm_modify vel yes\nprocessors * * 1\nread_data start.data\n");
    match case.law {
        Law::Hooke {
            stiffness,
            tangential,
            damping,
            friction,
        } if case.walls.is_empty() => {
            let _ = writeln!(
                d,
                "pair_style gran/hooke/history {stiffness} {tangential} {damping} 0 {friction} 0\npair_coeff * *"
            );
        }
        _ => {
            let model = granular(case);
            let _ = writeln!(d, "pair_style granular\npair_coeff * * {model}");
            for (k, wall) in case.walls.iter().enumerate() {
                let [low, high] = sides(wall);
                let axis = ["x", "y", "z"][wall.axis];
                let _ = writeln!(
                    d,
                    "fix wall{k} all wall/gran granular {model} {axis}plane {low} {high}"
                );
            }
        }
    }
    motion(&mut d, case);
    let [x, y, z] = case.gravity;
    let g = x.hypot(y).hypot(z);
    let _ = writeln!(d, "fix pull all gravity {g} vector {x} {y} {z}");
    let _ = writeln!(d, "thermo_modify norm no lost error format float %.12g");
    schedule(&mut d, case);
    d
}

/// Boundary words: periodic or fixed.
pub fn boundary(case: &Case) -> String {
    case.periodic.map(|p| if p { "p" } else { "f" }).join(" ")
}

/// A wall as the pair (low, high) of a `plane` keyword.
fn sides(wall: &Wall) -> [String; 2] {
    let position = wall.position.to_string();
    if wall.grains_above {
        [position, "NULL".into()]
    } else {
        ["NULL".into(), position]
    }
}

/// Groups, integrator, lists and what is printed: the same words in LAMMPS and LIGGGHTS.
pub fn motion(d: &mut String, case: &Case) {
    let _ = writeln!(d, "neighbor {} bin", case.skin);
    d.push_str("neigh_modify every 1 delay 0 check yes\n");
    let _ = writeln!(d, "timestep {}", case.timestep);
    d.push_str("group free type 1\n");
    if types(case) == 2 {
        d.push_str("group frozen type 2\nneigh_modify exclude group frozen frozen\nfix hold frozen freeze\n");
    }
    d.push_str("fix move free nve/sphere\ncompute centre free com\n");
    d.push_str("thermo_style custom step ke c_centre[3]\n");
    let _ = writeln!(d, "thermo {}", case.every);
}

/// Warm-up, then the clock. The second run goes on without a new set-up, so both are one trajectory.
pub fn schedule(d: &mut String, case: &Case) {
    let (warm_up, steps) = (case.warm_up, case.steps);
    let _ = writeln!(d, "run {warm_up}\n{STAMP}\nrun {steps} pre no\n{STAMP}");
}

/// Reads a log: states from the tables, the last loop time, CPU time from the stamps.
///
/// # Errors
/// The code's own error line, or what is missing.
pub fn parse_log(log: &str, stamps: &str, one_core: bool) -> Result<Trace, String> {
    if let Some(error) = log.lines().find(|l| l.starts_with("ERROR")) {
        return Err(error.trim().into());
    }
    let mut trace = Trace::default();
    let mut in_table = false;
    for line in log.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        if line.starts_with("LAMMPS") || line.starts_with("LIGGGHTS") {
            trace.version = version(line);
        } else if words.first() == Some(&"Step") {
            in_table = true;
        } else if let [
            "Loop",
            "time",
            "of",
            wall,
            "on",
            _,
            "procs",
            "for",
            steps,
            ..,
        ] = words[..]
        {
            in_table = false;
            let number = |w: &str| w.parse::<f64>().map_err(|_| format!("unreadable: {line}"));
            (trace.wall, trace.steps) = (number(wall)?, number(steps)? as u64);
        } else if in_table && words.len() == 3 {
            let numbers: Vec<f64> = words.iter().filter_map(|w| w.parse().ok()).collect();
            if let [step, kinetic, height] = numbers[..] {
                let step = step as u64;
                // A run begins with the state its predecessor ended with.
                if trace.state(step).is_none() {
                    trace.states.push(State {
                        step,
                        kinetic,
                        height,
                    });
                }
            }
        }
    }
    // The stamps are of the first rank's main thread: the whole code only where there is one.
    if one_core {
        trace.cpu = cpu_between(stamps);
    }
    finished(trace)
}

/// `LAMMPS (date)`, or the words LIGGGHTS has before the date of its making.
fn version(line: &str) -> String {
    match line.split_once("(Version ") {
        Some((_, rest)) => rest.split(',').next().unwrap_or(rest).into(),
        None => line.trim().into(),
    }
}

/// Processor time between the first and the last stamp (s); each is `<ns on a processor> <waiting> <slices>`.
fn cpu_between(stamps: &str) -> Option<f64> {
    let times: Vec<f64> = stamps
        .lines()
        .filter_map(|l| l.split(' ').next()?.parse().ok())
        .collect();
    let (first, last) = (times.first()?, times.last()?);
    (last > first).then(|| (last - first) * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::case::case;

    const LOG: &str = "\
LAMMPS (1 Jan 2030 - Update 9)
Reading data file ...
  3 atoms
   Step         KinEng       c_centre[3]
         0   10             2.5
       200   8.125          2.25
Loop time of 1.25 on 1 procs for 200 steps with 3 atoms

Performance: 1.0
WARNING: something of three
   Step         KinEng       c_centre[3]
       200   8.125          2.25
       400   8e-07          2.125
Loop time of 5.5 on 1 procs for 200 steps with 3 atoms
Total wall time: 0:00:07
";

    #[test]
    fn a_log_gives_states_and_the_second_loop() {
        let trace = parse_log(LOG, "1000000000 5 6\n6250000000 7 8\n", true).unwrap();
        assert_eq!(trace.version, "LAMMPS (1 Jan 2030 - Update 9)");
        assert_eq!((trace.steps, trace.wall, trace.cpu), (200, 5.5, Some(5.25)));
        assert_eq!(trace.states.len(), 3);
        let last = trace.state(400).unwrap();
        assert_eq!((last.kinetic, last.height), (8e-7, 2.125));
        assert_eq!(parse_log(LOG, "1 2 3\n5 6 7\n", false).unwrap().cpu, None);
    }

    #[test]
    fn versions_are_short() {
        let line = "LIGGGHTS (Version LIGGGHTS-PUBLIC 1.2, made in 2030, by nobody)";
        assert_eq!(version(line), "LIGGGHTS-PUBLIC 1.2");
    }

    #[test]
    fn the_code_s_own_error_is_handed_on() {
        let log = "LAMMPS (1)\nERROR: Unknown fix style (src/modify.cpp:1)\n";
        assert!(
            parse_log(log, "", true)
                .unwrap_err()
                .contains("Unknown fix style")
        );
        assert!(
            parse_log("LAMMPS (1)\n", "", true)
                .unwrap_err()
                .contains("loop time")
        );
    }

    #[test]
    fn the_deck_says_what_the_case_says() {
        let chute = deck(&case("chute").unwrap());
        let pair = chute.lines().find(|l| l.starts_with("pair_style")).unwrap();
        let numbers: Vec<f64> = pair.split(' ').filter_map(|w| w.parse().ok()).collect();
        assert_eq!(numbers, [2e5, 4e5 / 7.0, 50.0, 0.0, 0.5, 0.0]);
        assert!(
            chute.contains("boundary p p f\n") && chute.contains("exclude group frozen frozen")
        );
        assert!(chute.contains("run 200\n") && chute.contains("run 800 pre no\n"));
        let settled = deck(&case("settled").unwrap());
        assert_eq!(settled.matches("wall/gran granular").count(), 5);
        assert!(settled.contains("xplane NULL 0.1\n") && settled.contains("zplane 0 NULL\n"));
        assert!(!settled.contains("frozen"));
    }

    #[test]
    fn every_law_has_its_words() {
        let pair = |name: &str| {
            let deck = deck(&case(name).unwrap());
            let pair = deck.lines().find(|l| l.starts_with("pair_coeff")).unwrap();
            assert_eq!(deck.matches("wall/gran granular").count(), 5, "{name}");
            pair.trim_start_matches("pair_coeff * * ").to_owned()
        };
        assert!(pair("settled-hooke").starts_with("hooke 1500 500 tangential linear_history"));
        assert!(pair("settled-viscoelastic").ends_with("damping viscoelastic"));
        assert!(pair("settled-epsd").contains(" rolling sds "));
        assert!(!pair("settled-epsd").contains("twisting"));
        assert!(pair("settled-shape").contains(" twisting sds "));
        assert!(
            pair("settled-dmt").starts_with("dmt 10000000 ")
                && pair("settled-dmt").contains(" 0.3 0.5 tangential")
        );
        assert!(pair("settled-jkr").starts_with("jkr 10000000 500 0.3 0.5 "));
        assert!(law(&case("settled-cohesion").unwrap()).contains("without cohesion"));
    }
}
