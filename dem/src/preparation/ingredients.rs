//! What grains are drawn from: sizes, densities and shares of a mixture.

use super::sizes::SizeLaw;
use crate::grains::Grain;
use crate::setup::{SetupError, check};
use nalgebra::Vector3;
use rand::Rng;
use serde::{Deserialize, Serialize};

/// One of the materials that are mixed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ingredient {
    /// Law of its sizes.
    pub sizes: SizeLaw,
    /// Density of its grains (kg/m³).
    pub density: f64,
    /// Number of its material in the law table.
    pub material: u16,
    /// Its part of the volume of all grains, in any unit.
    pub parts_by_volume: f64,
}

/// How much is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Amount {
    /// So many grains.
    Grains(usize),
    /// Volume of the grains over that of the region that they are put into.
    SolidFraction(f64),
    /// Mass of all grains (kg).
    Mass(f64),
}

/// More grains than their numbers can count are a slip of a unit.
const MOST: usize = 100_000_000;

impl Ingredient {
    /// One material alone.
    pub fn alone(sizes: impl Into<SizeLaw>, density: f64) -> Ingredient {
        Ingredient {
            sizes: sizes.into(),
            density,
            material: 0,
            parts_by_volume: 1.0,
        }
    }

    pub(super) fn validate(&self, key: &str) -> Result<(), SetupError> {
        self.sizes.validate()?;
        check(&format!("{key}.density"), self.density, "> 0 kg/m³", |v| {
            v > 0.0
        })?;
        let parts = format!("{key}.parts_by_volume");
        check(&parts, self.parts_by_volume, "> 0", |v| v > 0.0)
    }

    /// Radii of its grains among others (m).
    pub(super) fn radii(&self, grains: &[Grain]) -> Vec<f64> {
        let own = grains.iter().filter(|g| g.material == self.material);
        own.map(|g| g.radius).collect()
    }
}

/// Draws grains, all at the origin: the next one is always of the ingredient that is farthest behind
/// its part, so that the parts are met to one grain.
pub(super) fn draw(
    ingredients: &[Ingredient],
    amount: Amount,
    volume: f64,
    random: &mut impl Rng,
) -> Result<Vec<Grain>, SetupError> {
    amount.validate()?;
    let mut materials: Vec<u16> = ingredients.iter().map(|i| i.material).collect();
    materials.sort_unstable();
    materials.dedup();
    let count = ingredients.len() as f64;
    check(
        "ingredients",
        count,
        "some, each of a material of its own",
        |v| v > 0.0 && materials.len() == ingredients.len(),
    )?;
    let mut drawn = vec![0.0; ingredients.len()];
    let mut grains: Vec<Grain> = Vec::new();
    let mut sum = 0.0;
    loop {
        let behind = |k: &usize| drawn[*k] / ingredients[*k].parts_by_volume;
        let next = (0..drawn.len()).min_by(|a, b| behind(a).total_cmp(&behind(b)));
        let Some(k) = next else {
            return Ok(grains);
        };
        let Ingredient {
            sizes,
            density,
            material,
            ..
        } = &ingredients[k];
        let grain = Grain {
            material: *material,
            ..Grain::at_rest(Vector3::zeros(), sizes.draw(random), *density)
        };
        let (more, enough) = match amount {
            Amount::Grains(count) => (1.0, count as f64),
            Amount::SolidFraction(share) => (grain.volume(), share * volume),
            Amount::Mass(mass) => (grain.mass(), mass),
        };
        // Half a grain too much or too little is as close as it gets.
        if sum + 0.5 * more > enough {
            return Ok(grains);
        }
        if grains.len() == MOST {
            let allowed = "an amount of at most 10⁸ grains";
            return check("amount: grains", grains.len() as f64, allowed, |_| false)
                .map(|()| grains);
        }
        sum += more;
        drawn[k] += grain.volume();
        grains.push(grain);
    }
}

impl Amount {
    pub(super) fn validate(&self) -> Result<(), SetupError> {
        match *self {
            Amount::Grains(count) => check("amount.grains", count as f64, "> 0", |v| v > 0.0),
            Amount::SolidFraction(share) => {
                check("amount.solid_fraction", share, "in (0, 0.75)", |v| {
                    v > 0.0 && v < 0.75
                })
            }
            Amount::Mass(mass) => check("amount.mass", mass, "> 0 kg", |v| v > 0.0),
        }
    }
}
