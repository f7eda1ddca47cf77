//! What a cliff's run has come to: its times, its pile and its boulders, beside what the paper says.

use super::STILL_LOOKS;
use super::debris::Pile;
use super::record::CliffRecord;
use super::watch::EDGE;
use crate::run::land::Land;
use crate::run::world::Ran;
use crate::run::world::boulders::size_index;
use crate::scene::CliffScene;
use crate::summary::{Quantity, Summary};
use crate::table::Table;

/// What §4.2 of the paper says of the Aswan cliff: the pile's height (m), its distance from the wall (m), the
/// run-out from there (m), the mean angle of repose (degrees), the share of bonds that survives, the size of the
/// largest boulders (m).
const ASWAN: [f64; 6] = [28.0, 15.0, 70.0, 22.0, 0.98, 10.0];
const ASWAN_SOURCE: &str = "Kappel et al. 2020, §4.2, from 270 000 parcels";
/// Height of that cliff (m).
const ASWAN_HEIGHT: f64 = 130.0;
/// Diameter of its smallest grains (m).
const ASWAN_GRAINS: f64 = 3.0e-3;

/// What §3.2 and 4.2 say of the cliffs of this height (m): no height, run-out or angle of a pile, and no survival of bonds.
const CLIFF_HEIGHT: f64 = 30.0;
const CLIFF_SOURCE: &str = "Kappel et al. 2020, §4.2, from 60 000 to 70 000 parcels";
/// Overhangs (degrees), and the smallest grains (m) of those of which such a cliff barely stands.
const CLIFF_GRAINS: [[f64; 2]; 3] = [[10.0, 6.0e-3], [20.0, 4.0e-3], [30.0, 2.0e-3]];
/// Free fall from its top, "about 10 min", and the longest collapse with the settling of the debris (s).
const CLIFF_FALL: f64 = 600.0;
const CLIFF_REST: f64 = 3600.0;

impl CliffScene {
    pub(super) fn put_times(&self, record: &CliffRecord, ran: &Ran, summary: &mut Summary) {
        let times = &record.times;
        let rests = record.heap.resting >= STILL_LOOKS;
        let failed = !times.failed.is_nan();
        let stood = !times.opened.is_nan();
        let since = |time: f64| time - if stood { times.opened } else { 0.0 };
        let mut put = |name: &str, value: f64, unit: &str, source: &str| {
            summary.put(name, Quantity::new(value, unit).from(source));
        };
        put(
            "time_of_failure",
            since(times.failed),
            "s",
            "after the crack opened, or after the support was taken away where it did not stand: what stood before the crack \
             has sunk by a hundredth of the face's height; null where it did not",
        );
        let end = if rests {
            since(ran.simulation.time())
        } else {
            f64::NAN
        };
        put(
            "sunk_standing",
            times.sunk_standing,
            "m",
            "on the mean, what stood before the crack while the cliff stood by itself",
        );
        put(
            "loosened_grains",
            times.loosened,
            "1",
            "in the crack, that lost their cohesion",
        );
        // That it barely stands is said of these grains only.
        let is_of_their_grains =
            self.grains_of_the_paper() == Some(self.material.smallest_diameter);
        let fall = (2.0 * (self.shape.height - self.shape.wall) / self.gravity).sqrt();
        let free = format!(
            "the same, of the largest kinetic energy; a free fall from the top takes {fall:.0} s"
        );
        for (name, value, unit, source, reference, said) in [
            (
                "stood",
                f64::from(u8::from(stood)),
                "1",
                "1 if it stood until the crack opened",
                1.0,
                "it barely stands",
            ),
            (
                "time_of_impact",
                since(times.peak[1]),
                "s",
                &free,
                CLIFF_FALL,
                "about 10 minutes of free fall",
            ),
            (
                "time_of_rest",
                end,
                "s",
                "the same, of rest; null where the run ended before",
                CLIFF_REST,
                "an hour at most",
            ),
        ] {
            let quantity = Quantity::new(value, unit);
            let quantity = if name == "stood" && !is_of_their_grains {
                quantity.from(source)
            } else {
                self.beside_cliffs(quantity, source, reference, said)
            };
            summary.put(name, quantity);
        }
        let grains = Quantity::new(self.material.smallest_diameter, "m");
        let source = "of the material; it is to stand barely";
        let grains = match self.grains_of_the_paper() {
            Some(smallest) => {
                let source =
                    format!("{source}: Kappel et al. 2020, §4.2, at this height and overhang");
                grains.against(smallest, &source)
            }
            None => grains.from(source),
        };
        summary.put("smallest_diameter", grains);
        let word = match (stood, failed) {
            (false, _) => format!(
                "The cliff does not stand by itself: it fails {:.0} s after its support is taken away, before the crack opens.",
                times.failed
            ),
            (true, true) => format!(
                "The cliff stands by itself and fails {:.0} s after the crack has opened.",
                since(times.failed)
            ),
            (true, false) => "The cliff stands, and the crack does not bring it down.".into(),
        };
        summary.remarks.push(word);
        if !rests {
            summary
                .remarks
                .push("Still moving at the end: a longer duration is needed.".into());
        }
    }

    /// What the debris is like: heights (m) over the ground at places (m), of parcels of a mean diameter (m), on a plane or on
    /// land.
    pub(super) fn put_pile(
        &self,
        heap: [&[f64]; 2],
        d: f64,
        land: Option<&Land>,
        summary: &mut Summary,
    ) {
        let ground = |x: f64| Land::height(land, x);
        let pile = Pile::of(heap, 0.0, EDGE * d, ground);
        let of = |f: &dyn Fn(&Pile) -> f64| pile.as_ref().map_or(f64::NAN, f);
        let m = |value: f64| Quantity::new(value, "m");
        let degrees = |value: f64| Quantity::new(value, "degrees");
        let end = m(of(&|p| p.end)).from("where the debris is a quarter of a mean parcel high");
        summary.put("x_front", end);
        let height = m(of(&|p| p.height));
        let source = "greatest height of the pile beyond the foot";
        summary.put("pile_height", self.reference(0, height, source));
        let top = m(of(&|p| p.top));
        let source = "where the pile is highest, from the foot";
        summary.put("pile_top", self.reference(1, top, source));
        let runout = m(of(&|p| p.end - p.top));
        let source = "of the debris from the pile's top";
        summary.put("runout", self.reference(2, runout, source));
        let repose = degrees(of(&Pile::repose_degrees));
        let source = "atan(fall of the pile's surface over run-out, from its top); 20 to 30 on 67P (Vincent et al. 2016)";
        summary.put("repose", self.reference(3, repose, source));
        let wedge = degrees(of(&Pile::wedge_degrees));
        let source = "of the wedge from the foot with the debris' area and length: atan((2 A/L + D)/L), D fall of the ground";
        summary.put("debris_slope", wedge.from(source));
        let reach = |p: &Pile| {
            let fall = self.shape.height - ground(p.end);
            (fall / (p.end + self.crack_head())).atan().to_degrees()
        };
        let source = "from the head of the crack down to where the debris ends (Fahrböschung)";
        summary.put("reach_angle", degrees(of(&reach)).from(source));
    }

    /// How broken it is: the share of the debris (of what stood before the crack), of contacts that hold, and how far it has
    /// turned forward (degrees).
    pub(super) fn put_broken(
        &self,
        share: f64,
        [held, turned]: [f64; 2],
        record: &CliffRecord,
        summary: &mut Summary,
    ) {
        let mut put = |name: &str, value: f64, unit: &str, source: &str| {
            summary.put(name, Quantity::new(value, unit).from(source));
        };
        put(
            "debris_share",
            share,
            "1",
            "beyond the foot, at the cliff's solid fraction, over what stood before the crack",
        );
        put(
            "held_contact_share",
            held,
            "1",
            "of the contacts before the crack at the start",
        );
        put(
            "forward_turn",
            turned,
            "degrees",
            "of the sintered part before the crack, forward positive; a crack steeper than the overhang tips a face forward, one \
             less steep backward (Kappel et al. 2020, §4.2)",
        );
        put(
            "solid_fraction",
            record.heap.solid_fraction,
            "1",
            "of the cliff before",
        );
    }

    /// Sizes of boulders, and the share of bonds that survive; not a number where there were none.
    pub(super) fn put_boulders(&self, survive: f64, sizes: &Table, summary: &mut Summary) {
        let diameters = sizes.column("diameter");
        let count = Quantity::new(diameters.len() as f64, "1");
        summary.put(
            "boulders",
            count.from("of two grains and more, joined by bonds"),
        );
        let largest = diameters.first().copied().unwrap_or(f64::NAN);
        let source = "diameter of the ball that its grains fill at the cliff's solid fraction";
        let largest = self.reference(5, Quantity::new(largest, "m"), source);
        summary.put("largest_boulder", largest);
        let [index, error] = size_index(diameters);
        let index = Quantity::new(index, "1").with_error(error);
        summary.put(
            "boulder_size_index",
            index.against(
                3.6,
                "observed at Aswan (Pajola et al. 2017); null for fewer than ten boulders",
            ),
        );
        let source = "of the bonds that the crack left";
        if survive.is_finite() {
            let survive = Quantity::new(survive, "1");
            summary.put("bond_survival", self.reference(4, survive, source));
        }
    }

    /// What the paper says of its cliffs of 30 m, where the scene is one.
    fn beside_cliffs(
        &self,
        quantity: Quantity,
        source: &str,
        reference: f64,
        said: &str,
    ) -> Quantity {
        if self.shape.height == CLIFF_HEIGHT {
            quantity.against(reference, &format!("{source}; {CLIFF_SOURCE}: {said}"))
        } else {
            quantity.from(source)
        }
    }

    /// Smallest grains (m) of those of which the paper's cliff of this height and overhang barely stands.
    fn grains_of_the_paper(&self) -> Option<f64> {
        if self.shape.height == ASWAN_HEIGHT {
            return Some(ASWAN_GRAINS);
        }
        let is_one = self.shape.height == CLIFF_HEIGHT;
        let overhang = self.shape.overhang_degrees;
        let found = CLIFF_GRAINS
            .iter()
            .find(|[degrees, _]| *degrees == overhang);
        found.filter(|_| is_one).map(|[_, smallest]| *smallest)
    }

    /// Reference of the Aswan cliff, where the scene is one.
    fn reference(&self, k: usize, quantity: Quantity, source: &str) -> Quantity {
        if self.shape.height == ASWAN_HEIGHT {
            quantity.against(ASWAN[k], ASWAN_SOURCE)
        } else {
            quantity.from(source)
        }
    }
}
