//! The ground under a column of grains that runs out over terrain.
//!
//! The column stands where it is level; beyond, the layer of fixed grains of its floor follows the ground, with a smooth
//! wall below. Where the ground stands upright there are no fixed grains: the face of a step is smooth.

use super::collapse_ground;
use super::column_of_grains::FLOOR;
use super::land::Land;
use crate::failure::Failure;
use crate::scene::world::Place;
use crate::scene::{CollapseScene, ColumnFloorKind, ContactKind};
use colluvium_continuum::column_collapse::CollapseGround;
use colluvium_dem::Wall;

impl CollapseScene {
    /// The terrain under a column of grains, from its wall on; none where the floor is level.
    pub(super) fn land(&self, origin: &str) -> Result<Option<Land>, Failure> {
        let (Some(keys), Some(ground)) = (&self.terrain, collapse_ground::ground(self, origin)?)
        else {
            return Ok(None);
        };
        let at = Place {
            origin,
            section: "terrain",
        };
        let (own, like) = match self.grains.floor {
            ColumnFloorKind::Rough => (
                ContactKind::NoSlip,
                "\"no-slip\" where grains.floor = \"rough\"",
            ),
            ColumnFloorKind::Smooth => (
                ContactKind::FreeSlip,
                "\"free-slip\" where grains.floor = \"smooth\"",
            ),
        };
        if keys.contact != own {
            let value = toml::Value::try_from(keys.contact)
                .map_or_else(|_| String::new(), |v| v.to_string());
            return Err(at.refuse("contact", value, like).into());
        }
        let key = keys.source().file().map_or("profile", |(key, _)| key);
        let end = (
            self.length(),
            "the end of the floor, grid.length_scaled heights",
        );
        let land = Land::new(&ground.profile, end, self.height, (at, key))?;
        let lip = self.lip();
        if land.level_up_to(self.spacing()) < lip {
            let value = format!("level up to x = {} m", land.level_up_to(self.spacing()));
            let range = format!("level under the column, up to {lip:.6} m at least");
            return Err(at.refuse(key, value, range).into());
        }
        Ok(Some(land))
    }

    /// The same ground for a continuum, beside grains or with their front.
    pub(super) fn land_of_continuum(
        &self,
        origin: &str,
    ) -> Result<Option<CollapseGround>, Failure> {
        let land = self.land(origin)?;
        let keys = self.terrain.as_ref();
        Ok(land.zip(keys).map(|(land, keys)| CollapseGround {
            profile: land.line().clone(),
            contact: collapse_ground::contact(keys.contact, keys.friction),
        }))
    }

    /// Where the terrain comes from and what it is, in the words of a plan.
    pub(super) fn terrain_in_words(&self) -> Option<(String, String)> {
        let keys = self.terrain.as_ref()?;
        let from = match keys.source().file() {
            None => "the line of terrain.profile",
            Some((_, file)) => file,
        };
        let land = self.land("").ok().flatten();
        let shape = land.map_or(String::new(), |land| {
            let [low, high] = Land::span(Some(&land));
            let level = match land.level_up_to(self.spacing()) {
                end if end < self.length() => format!("level up to x = {end:.4} m"),
                _ => "level".to_owned(),
            };
            format!(", {level}, from z = {low:.4} to {high:.4} m")
        });
        let line = format!("{from}, for grains and continuum{shape}");
        Some(("terrain".into(), line))
    }

    /// What is below the grains, as a smooth wall.
    pub(super) fn floor(&self, land: Option<&Land>) -> Result<Wall, Failure> {
        let below = match self.grains.floor {
            ColumnFloorKind::Rough => FLOOR[1] * self.grains.diameter,
            ColumnFloorKind::Smooth => 0.0,
        };
        match land {
            None => Ok(Wall::plane(
                -below * nalgebra::Vector3::z(),
                nalgebra::Vector3::z(),
            )),
            Some(land) => land.wall(&[[-self.height, -below]], below, self.slab()),
        }
    }
}
