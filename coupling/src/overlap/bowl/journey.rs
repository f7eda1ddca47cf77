//! What a box that grows is asked for, and what it remembers.

use super::room::Overlaps;
use super::store::{STRETCHES, Store};
use super::zone::SIDES;
use crate::overlap::dense_limits::Reason;
use crate::overlap::material_edge::Travel;
use colluvium_dem::Patch;

/// When a box grows and shrinks (SI).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Thresholds, the time at rest, limits of dense flow, and the budget (of free grains, the ball among them); a strip is as wide as the buffer, whatever its width says.
    pub travel: Travel,
    /// Distance between the ball and the inner end of the overlap below which a side moves outwards (m).
    pub near: f64,
    /// Shear of what is stored above which it is misplaced: a side moves outwards before it, and sheared packings take its
    /// place; infinite: nothing is.
    pub misplaced: f64,
}

/// A move of a side of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// When (s).
    pub time: f64,
    /// Which side: low and high along x, low and high along y, the bottom.
    pub side: usize,
    /// Where it lies after the move, along its axis (m).
    pub place: f64,
    /// Why.
    pub reason: Reason,
    /// The distance (m), speed (m/s), inertial number, shear or share that was the reason.
    pub value: f64,
    /// Mass that became grains; negative: that became continuum (kg).
    pub mass: f64,
    /// Grains after it, the ball included.
    pub grains: f64,
    /// Grains that were moved to make room.
    pub displaced: f64,
    /// Grains of sheared packings that came in the place of stored ones.
    pub replaced: f64,
    /// Mass that the continuum's surface gave for it beyond what lay in the place of the grains (kg).
    pub remainder: f64,
}

/// Numbers of a move.
const NUMBERS: usize = 10;

impl Move {
    fn numbers(&self) -> [f64; NUMBERS] {
        [
            self.time,
            self.side as f64,
            self.place,
            self.reason.number() as f64,
            self.value,
            self.mass,
            self.grains,
            self.displaced,
            self.replaced,
            self.remainder,
        ]
    }

    fn of(
        &[
            time,
            side,
            place,
            reason,
            value,
            mass,
            grains,
            displaced,
            replaced,
            remainder,
        ]: &[f64; NUMBERS],
    ) -> Option<Self> {
        Some(Self {
            time,
            side: side as usize,
            place,
            reason: *Reason::ALL.get(reason as usize)?,
            value,
            mass,
            grains,
            displaced,
            replaced,
            remainder,
        })
    }
}

/// What a box that grows remembers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Journey {
    /// Grains outside the box and those of its shell.
    pub store: Store,
    pub moves: Vec<Move>,
    /// Exchanges for which each side has rested, and how often it has moved outwards.
    pub resting: [f64; SIDES],
    pub returns: [f64; SIDES],
    /// 1 where a side's move outwards is being refused, else 0.
    pub refusing: [f64; SIDES],
    /// Moves outwards that the budget or the walls did not allow.
    pub refused: f64,
    /// Overlaps of contacts when the bed was cut.
    pub overlaps: Overlaps,
    /// Farthest that grains had moved through a face of the box before it moved (m).
    pub farthest: f64,
}

impl Journey {
    /// All of it as rows of numbers.
    pub fn write(&self, put: &mut impl FnMut(&[f64])) {
        put(&self.store.patch.numbers());
        put(self.store.stretch.as_flattened());
        put(self
            .moves
            .iter()
            .flat_map(Move::numbers)
            .collect::<Vec<_>>()
            .as_slice());
        put(&self.resting);
        put(&self.returns);
        put(&self.refusing);
        let Overlaps { usual, deepest } = self.overlaps;
        put(&[self.refused, usual, deepest, self.farthest]);
    }

    /// From such rows.
    pub fn read<'a>(take: &mut impl FnMut() -> Option<&'a [f64]>) -> Option<Self> {
        let patch = Patch::of(take()?)?;
        let stretch = take()?.as_chunks::<STRETCHES>().0.to_vec();
        let fits = stretch.len() == patch.ids.len();
        let store = fits.then_some(Store { patch, stretch })?;
        let moves = take()?.as_chunks::<NUMBERS>().0.iter().map(Move::of);
        let moves = moves.collect::<Option<_>>()?;
        let mut of_sides = || take()?.try_into().ok();
        let [resting, returns, refusing] = [of_sides()?, of_sides()?, of_sides()?];
        let &[refused, usual, deepest, farthest] = take()? else {
            return None;
        };
        Some(Self {
            store,
            moves,
            resting,
            returns,
            refusing,
            refused,
            overlaps: Overlaps { usual, deepest },
            farthest,
        })
    }
}
