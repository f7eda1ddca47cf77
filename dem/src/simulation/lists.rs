//! The lists of a simulation: how far they reach, when they are made anew, and how contacts are carried over.

use super::{Diverged, Simulation};
use crate::contact::composition::Visitor;
use crate::contact::{ContactLaw, Interaction, LawTable};
use crate::domain::Images;
use crate::forces;
use crate::neighbours::Neighbours;
use crate::population::GONE;
use crate::reach::Making;
use crate::setup::SetupError;
use crate::walls::Age;
use std::sync::Arc;

/// Skin of the Verlet list in smallest-grain diameters, chosen by measurement on the inclined flow.
pub(super) const SKIN: f64 = 0.3;

/// What the lists must carry for a law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// Numbers of history of a contact.
    pub history: usize,
    /// How many of them change sign with the order of a pair.
    pub flips: usize,
    /// Rows of a contact's slot.
    pub slot_rows: usize,
    /// Whether contacts hold across a gap.
    pub holds: bool,
}

pub(super) struct LayoutOf;

impl Visitor for LayoutOf {
    type Output = Layout;
    fn visit<I: Interaction>(self, _: &I) -> Layout {
        Layout {
            history: I::HISTORY,
            flips: I::FLIPS,
            slot_rows: forces::slot_rows::<I>(),
            holds: I::HOLDS,
        }
    }
}

/// Skin of the Verlet list for grains of this smallest radius (m).
pub(super) fn skin_of(smallest: f64) -> f64 {
    SKIN * 2.0 * if smallest.is_finite() { smallest } else { 1.0 }
}

/// Largest gap that a contact of grains up to this radius holds across (m).
pub(super) fn hold_of(law: &LawTable, largest: f64) -> f64 {
    let hold = |law: &ContactLaw| law.reach(largest);
    law.laws().iter().map(hold).fold(0.0, f64::max)
}

/// How long the Verlet list has lasted.
fn age_of(list: &Neighbours) -> Age<'_> {
    Age {
        rows: &list.rows,
        travel: &list.travel,
        time: list.age,
    }
}

impl Simulation {
    /// Renews the lists where grains may have outrun them.
    pub(super) fn keep_lists(&mut self) -> Result<(), Diverged> {
        self.check_width()?;
        if self.list.outdated(self.skin) {
            self.outlived(self.list.age)?;
            self.rebuild();
            return Ok(());
        }
        if self.wall_contacts.outdated(&self.walls, age_of(&self.list)) {
            self.outlived(self.wall_contacts.age(self.list.age))?;
            self.wall_contacts.take_down(|grain| grain);
            self.list_walls();
        }
        if self.reach.outdated(&self.list) {
            if self.reach.is_uneven() {
                self.deal_anew();
            } else {
                self.make_reach(false);
            }
        }
        Ok(())
    }

    /// Lists the grains near walls.
    pub(crate) fn list_walls(&mut self) {
        self.wall_contacts.list(
            &mut self.walls,
            &self.grains,
            &self.domain,
            self.skin + self.hold,
            age_of(&self.list),
        );
    }

    /// Checks that the box suits grains between two radii.
    pub(crate) fn check_box(&self, largest: f64, smallest: f64) -> Result<(), SetupError> {
        crate::setup::check_box(&self.domain, largest, skin_of(smallest))
    }

    /// Chooses how far lists reach for grains between two radii.
    pub(crate) fn size_lists(&mut self, smallest: f64, largest: f64) {
        self.set_skin(skin_of(smallest));
        self.hold = hold_of(&self.law, largest);
    }

    /// Takes other laws of the same parts.
    pub(crate) fn set_laws(&mut self, laws: LawTable) {
        let n = self.grains.len();
        let largest = self.grains.place[..n]
            .iter()
            .map(|x| x[3])
            .fold(0.0, f64::max);
        self.hold = hold_of(&laws, largest);
        self.law = Arc::new(laws);
    }

    pub(crate) fn set_skin(&mut self, skin: f64) {
        self.skin = skin;
        self.reach.set_diameter(skin / SKIN);
    }

    pub(crate) fn rebuild(&mut self) {
        self.rebuild_from(&|old| old);
    }

    /// Builds all lists anew; `remaining` says where a grain of the old lists is now, if it is.
    pub(crate) fn rebuild_from(&mut self, remaining: &dyn Fn(u32) -> u32) {
        self.fold_impulses();
        self.wrap_grains();
        let (cell, listed) = (self.cell(), self.skin + self.hold);
        self.list
            .build(&mut self.grains, &cell, listed, self.parallel);
        let (list, team) = (&self.list, self.team.share());
        let place = |old: u32| match remaining(old) {
            GONE => GONE,
            old => list.new_index(old),
        };
        self.touching.collect(
            &mut self.reach,
            &mut self.grains,
            self.layout,
            &team,
            &place,
        );
        self.wall_contacts.take_down(place);
        self.list_walls();
        self.settle_loads();
        self.clumps
            .settle(&self.grains, &self.list, &self.domain, true);
        self.renew_rows();
        self.make_reach(true);
        self.rebuilds += 1;
    }

    /// Makes room for what a step leaves for rows and fixed grains.
    pub(crate) fn renew_rows(&mut self) {
        self.fastest.clear();
        self.fastest.resize(self.list.rows.len(), 0.0);
        self.fixed.clear();
        let grains = &self.grains;
        let fixed = (0..grains.len()).filter(|&i| grains.is_fixed(i));
        self.fixed.extend(fixed.map(|i| i as u32));
        self.taken.clear();
        self.taken.resize(self.fixed.len(), [0.0; 4]);
    }

    /// Makes the list of pairs within reach anew: in new chunks, with the histories in `touching`, or
    /// in the same ones with the histories it has.
    pub(super) fn make_reach(&mut self, cut: bool) {
        let team = self.team.share();
        if cut {
            let grains = self.grains.len();
            let ghosts = self.reach.cut(&self.list, grains, self.parallel, &team);
            self.grains.lay_ghosts(ghosts);
        }
        for chunk in &self.reach.chunks {
            self.grains.copy_ghosts(&chunk.ghosts, chunk.first_ghost);
        }
        let making = Making {
            grains: &self.grains,
            list: &self.list,
            images: Images::of(&self.cell()),
            team: &team,
            lanes: self.width,
            width: self.layout.history,
            hold: self.hold,
        };
        if cut {
            self.reach.deal(&making, &self.touching);
            self.touching.close(&mut self.grains.spare);
        } else {
            self.reach.renew(&making);
        }
        self.current = false;
    }

    /// Deals the grains out to threads anew.
    pub(super) fn deal_anew(&mut self) {
        let (reach, grains, team) = (&mut self.reach, &mut self.grains, self.team.share());
        self.touching
            .collect(reach, grains, self.layout, &team, &|i| i);
        self.make_reach(true);
    }

    /// Takes up histories of touching contacts i < j, as a checkpoint has them.
    pub(crate) fn take_histories(&mut self, pairs: &[[u32; 2]], histories: &[f64]) {
        let (width, flips) = (self.layout.history, self.layout.flips);
        self.touching
            .open(width, self.grains.len(), &mut self.grains.spare);
        for &[i, j] in pairs {
            self.touching.count(i, j);
        }
        self.touching.lay();
        for (&[i, j], history) in pairs.iter().zip(histories.chunks_exact(width)) {
            self.touching.put(i, j, history, flips);
        }
        self.make_reach(true);
    }
}
