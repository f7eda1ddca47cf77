//! A contact law in words.

use super::Lines;
use colluvium_dem::contact::mindlin::SpringMemory;
use colluvium_dem::{
    Cohesion, ContactLaw, Damping, Lever, Normal, Rolling, SpringStiffness, Tangential,
};

/// Says each part of a law on a line of its own.
pub fn say(lines: &mut Lines, law: &ContactLaw) {
    lines.say("normal", &normal(&law.normal));
    lines.say("tangential", &tangential(law));
    lines.say("rolling", &rolling(&law.rolling));
    lines.say("cohesion", &cohesion(law));
}

fn dashpot(damping: &Damping) -> String {
    match damping {
        Damping::Restitution(1.0) => "no dashpot".into(),
        Damping::Restitution(e) => format!("dashpot matched to a restitution of {e}"),
        Damping::MassProportional(0.0) => "no dashpot".into(),
        Damping::MassProportional(rate) => {
            format!("dashpot of {rate} 1/s times the reduced mass")
        }
    }
}

fn normal(normal: &Normal) -> String {
    match normal {
        Normal::Hooke(hooke) => format!(
            "hooke: linear spring of {:.4e} N/m, {}",
            hooke.stiffness,
            dashpot(&hooke.damping)
        ),
        Normal::Hertz(hertz) => format!(
            "hertz: elastic spheres, E* = {:.4e} Pa, dashpot matched to a restitution of {} at any speed",
            hertz.effective_modulus, hertz.restitution
        ),
        Normal::Viscoelastic(v) => format!(
            "viscoelastic: elastic spheres of viscous material, E* = {:.4e} Pa, A = {:.4e} s; the restitution falls with the speed",
            v.effective_modulus, v.dissipation
        ),
        Normal::Jkr(jkr) => format!(
            "jkr: adhesive elastic spheres, E = {:.4e} Pa, γ = {:.4e} J/m², Γ = {:.4e} 1/s; contacts hold across a gap",
            jkr.elasticity.youngs_modulus, jkr.surface_energy, jkr.damping_rate
        ),
    }
}

fn tangential(law: &ContactLaw) -> String {
    let arm = match law.lever {
        Lever::ContactPoint => "",
        Lever::Radius => "; arms of the undeformed radii",
    };
    match &law.tangential {
        Tangential::None => "none: grains slip freely".into(),
        Tangential::Linear(spring) => {
            let stiffness = match spring.stiffness {
                SpringStiffness::Ratio(ratio) => format!("{ratio:.4} k_n"),
                SpringStiffness::Absolute(stiffness) => format!("{stiffness:.4e} N/m"),
            };
            format!(
                "linear: spring of {stiffness} with history, {}, Coulomb cap μ = {}{arm}",
                dashpot(&spring.damping),
                spring.friction
            )
        }
        Tangential::Mindlin(mindlin) => format!(
            "mindlin: G* = {:.4e} Pa, with history, a stiffening spring keeps its {}, Coulomb cap μ = {}{arm}",
            mindlin.effective_shear,
            match mindlin.memory {
                SpringMemory::Energy => "force (no cycle creates energy)",
                SpringMemory::Displacement => "displacement (as other codes do)",
            },
            mindlin.friction
        ),
        Tangential::Jkr => "jkr: elastic-plastic sliding of the adhesive contact".into(),
    }
}

fn rolling(rolling: &Rolling) -> String {
    match rolling {
        Rolling::None => "none: grains roll and twist freely".into(),
        Rolling::Epsd(epsd) => format!(
            "epsd: elastic-plastic rolling, μ_r = {}, {} of critical damping; no twisting resistance",
            epsd.rolling_friction, epsd.damping_ratio
        ),
        Rolling::Shape(shape) => format!(
            "shape: rolling and twisting springs, β = {} stands for angular grains, μ_R = {}, μ_T = {}",
            shape.beta, shape.rolling_friction, shape.twisting_friction
        ),
        Rolling::Jkr => "jkr: elastic-plastic rolling and twisting of the adhesive contact".into(),
    }
}

fn cohesion(law: &ContactLaw) -> String {
    let rough = |radius: Option<f64>| {
        radius.map_or_else(String::new, |r| format!(", asperities of {r:.3e} m"))
    };
    match law.cohesion {
        Cohesion::None if matches!(law.normal, Normal::Jkr(_)) => "in the normal law".into(),
        Cohesion::None => "none".into(),
        Cohesion::Dmt {
            work_of_adhesion,
            asperity_radius,
        } => format!(
            "dmt: w = {work_of_adhesion:.4e} J/m²{}",
            rough(asperity_radius)
        ),
        Cohesion::Scheeres {
            cleanliness,
            asperity_radius,
        } => format!(
            "scheeres: cleanliness {cleanliness:.4}{}",
            rough(asperity_radius)
        ),
        Cohesion::Constant { strength, patch } => {
            format!("constant: {strength:.4e} Pa on the patch of β = {patch}")
        }
    }
}
