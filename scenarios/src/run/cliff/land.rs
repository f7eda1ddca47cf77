//! The ground that a cliff stands and falls on: one line, for grains and for their continuum.

use crate::failure::Failure;
use crate::run::collapse_ground;
use crate::run::land::Land;
use crate::scene::{CliffScene, world::Place};
use colluvium_dem::Wall;

impl CliffScene {
    /// Up to where debris is looked for (m).
    pub fn far_end(&self) -> f64 {
        self.lip() + self.shape.room_scaled * self.shape.height
    }

    /// The ground before the cliff, from the foot of its face on to beyond [`Self::far_end`]; none where it is a plane.
    pub fn land(&self, origin: &str) -> Result<Option<Land>, Failure> {
        let Some(keys) = &self.terrain else {
            return Ok(None);
        };
        let given = collapse_ground::profile(keys.source())
            .map_err(|error| Failure::Input(format!("{origin}: {error}")))?;
        let at = Place {
            origin,
            section: "terrain",
        };
        let key = keys.source().file().map_or("profile", |(key, _)| key);
        let end = (
            self.far_end(),
            "shape.room_scaled heights beyond the lip, from the foot of the face",
        );
        let land = Land::new(&given, end, self.shape.height, (at, key))?;
        self.lies_below_the_face(&land, at, key)?;
        Ok(Some(land))
    }

    /// Refuses ground that would cut into the part that leans out.
    fn lies_below_the_face(&self, land: &Land, at: Place<'_>, key: &str) -> Result<(), Failure> {
        let lip = self.lip();
        let slope = self.face() / lip;
        let places = land.line().points().iter().map(|p| p[0]).chain([lip]);
        for x in places.filter(|x| *x > 0.0 && *x <= lip) {
            let (z, face) = (Land::height(Some(land), x), self.shape.wall + slope * x);
            if z > face {
                let range = format!("below the face, which is {face:.6} m high there");
                return Err(at.refuse(key, format!("{z} m at x = {x} m"), range).into());
            }
        }
        Ok(())
    }

    /// What the cliff stands on and falls on, of a material; `across` is the width of the slab (m).
    pub(super) fn ground_on(
        &self,
        land: Option<&Land>,
        material: u16,
        across: f64,
    ) -> Result<Vec<(String, Wall)>, Failure> {
        let Some(land) = land else {
            return Ok(self.ground(material, across));
        };
        let wall = self.shape.wall;
        let mut behind = vec![[self.back() - self.shape.height, wall]];
        if wall > 0.0 {
            behind.push([0.0, wall]);
        }
        let ground = land.wall(&behind, 0.0, across)?.material(material);
        Ok(vec![("ground".to_owned(), ground)])
    }
}
