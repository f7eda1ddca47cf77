//! Grains that are taken away, fixed, scaled and put elsewhere.

use super::{Workshop, refused};
use crate::failure::Failure;
use crate::run::world::fragments;
use colluvium_dem::{Grain, Region};
use nalgebra::{UnitQuaternion, Vector3};

impl Workshop<'_> {
    /// Keeps grains in a region: whole ones, or those whose centres lie in it.
    pub fn trim(&mut self, region: &Region, whole: bool) -> Result<(), Failure> {
        let gone = if whole {
            self.packing.trim_whole(region)
        } else {
            self.packing.trim(region)
        };
        let gone = gone.map_err(refused)?;
        let left = self.packing.grains.len();
        self.note(
            "trim",
            format!("{gone} grains taken away, {left} left, in {region}"),
        );
        self.check_left()
    }

    /// Keeps grains of which a rule says so; what it says in words is noted.
    pub fn keep_where(
        &mut self,
        words: &str,
        rule: impl Fn(&Grain) -> bool,
    ) -> Result<(), Failure> {
        let stays = self.packing.grains.iter().map(rule).collect();
        let gone = self.packing.keep_those(stays);
        let left = self.packing.grains.len();
        self.note(
            "trim",
            format!("{gone} grains taken away, {left} left, in {words}"),
        );
        self.check_left()
    }

    fn check_left(&self) -> Result<(), Failure> {
        if self.packing.grains.is_empty() {
            return Err(Failure::Run("preparation: no grains are left".into()));
        }
        Ok(())
    }

    /// Fixes grains in a region.
    pub fn glue(&mut self, region: &Region) -> Result<(), Failure> {
        let count = self.packing.glue(region).map_err(refused)?;
        self.note("glue", format!("{count} grains fixed in {region}"));
        Ok(())
    }

    /// Multiplies all lengths.
    pub fn scale(&mut self, factor: f64) -> Result<(), Failure> {
        self.packing.scale(factor).map_err(refused)?;
        self.note("scale", format!("all lengths times {factor}"));
        Ok(())
    }

    /// Turns the packing about the origin and moves it.
    pub fn place(&mut self, turn: UnitQuaternion<f64>, by: Vector3<f64>) -> Result<(), Failure> {
        self.packing
            .place(Vector3::zeros(), turn, by)
            .map_err(refused)
    }

    /// Opens all axes of the box.
    pub fn open(&mut self) {
        self.packing.domain.periodic = [false; 3];
    }

    /// Takes away what does not hang together, by contacts, with the heaviest piece; says how many grains.
    pub fn keep_heaviest(&mut self) -> usize {
        let grains = &self.packing.grains;
        let masses: Vec<f64> = grains.iter().map(Grain::mass).collect();
        let mut stays = vec![false; grains.len()];
        let pieces = fragments::joined(&masses, &self.packing.contacts);
        let heaviest = pieces.first().map_or(&[][..], |piece| &piece.grains);
        heaviest.iter().for_each(|&grain| stays[grain] = true);
        let gone = self.packing.keep_those(stays);
        self.note(
            "trim",
            format!("{gone} grains taken away that did not hang on"),
        );
        gone
    }
}
