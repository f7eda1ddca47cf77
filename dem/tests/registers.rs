//! The same bits for registers of any width.

use colluvium_dem::{
    ContactLaw, Domain, Elasticity, Epsd, Grain, Hooke, Laws, Rolling, Setup, Simulation,
    TangentialSpring, Threads, Wall, Width,
};
use nalgebra::Vector3;

/// Grains of three sizes and two materials that rain into a periodic box with a floor.
fn rain(law: Laws) -> Simulation {
    let mut grains = Vec::new();
    for k in 0..343_u32 {
        let cell = Vector3::new(f64::from(k % 7), f64::from(k / 7 % 7), f64::from(k / 49));
        let shift = Vector3::new(k % 5, k % 3, k % 4).map(|s| 0.01 * f64::from(s));
        let radius = [0.4, 0.45, 0.5][k as usize % 3];
        let mut grain = Grain::at_rest(cell + shift + Vector3::repeat(0.5), radius, 2500.0);
        grain.velocity = Vector3::new(f64::from(k % 3) - 1.0, 0.0, -2.0);
        grain.spin = Vector3::new(0.0, f64::from(k % 4), 1.0);
        grain.material = (k as usize % law.own.len()) as u16;
        grains.push(grain);
    }
    let setup = Setup {
        domain: Domain {
            lower: Vector3::zeros(),
            upper: Vector3::new(7.0, 7.0, 20.0),
            periodic: [true, true, false],
        },
        gravity: Vector3::new(1.0, 0.0, -9.81),
        law,
        grains,
        walls: vec![Wall::plane(Vector3::zeros(), Vector3::z())],
        bodies: Vec::new(),
        timestep: 1e-4,
        threads: Threads::Serial,
    };
    Simulation::new(setup).unwrap()
}

#[test]
fn registers_of_every_width_give_the_same_bits() {
    let elasticity = Elasticity {
        youngs_modulus: 5e6,
        poissons_ratio: 0.3,
    };
    let rolls = Rolling::Epsd(Epsd {
        rolling_friction: 0.1,
        damping_ratio: 0.3,
    });
    let mindlin = ContactLaw {
        rolling: rolls,
        ..ContactLaw::hertz_mindlin(elasticity, 0.6, 0.5)
    };
    let hooke = ContactLaw::linear(
        Hooke::matched(1e6, 0.7),
        TangentialSpring::matched(2.0 / 7.0, 0.7, 0.4),
        None,
    );
    let slick = ContactLaw::hertz_mindlin(elasticity, 0.8, 0.2);
    let pair = Laws {
        own: vec![mindlin, slick],
        pairs: Vec::new(),
    };
    for law in [pair, Laws::from(hooke)] {
        let hashes: Vec<String> = Width::present()
            .map(|width| {
                let mut rain = rain(law.clone());
                assert!(rain.set_width(width));
                rain.advance(4000).unwrap();
                assert!(rain.energy().kinetic() > 0.0);
                rain.state_hash()
            })
            .collect();
        assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");
    }
}
