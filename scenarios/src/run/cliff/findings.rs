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
            "stood",
            f64::from(u8::from(stood)),
            "1",
            "1 if it stood until the crack opened",
        );
        put(
            "time_of_failure",
            since(times.failed),
            "s",
            "after the crack opened, or after the support was taken away where it did not stand: what stood before the crack \
             has sunk by a hundredth of the face's height; null where it did not",
        );
        put(
            "time_of_impact",
            since(times.peak[1]),
            "s",
            "the same, of the largest kinetic energy; a free fall of 30 m takes 577 s (some 10 minutes in the paper)",
        );
        let end = if rests {
            since(ran.simulation.time())
        } else {
            f64::NAN
        };
        put(
            "time_of_rest",
            end,
            "s",
            "the same, of rest: up to 3600 s in the paper; null where the run ended before",
        );
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
            "of the sintered part before the crack, forward positive",
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

    /// Reference of the Aswan cliff, where the scene is one.
    fn reference(&self, k: usize, quantity: Quantity, source: &str) -> Quantity {
        if self.shape.height == ASWAN_HEIGHT {
            quantity.against(ASWAN[k], ASWAN_SOURCE)
        } else {
            quantity.from(source)
        }
    }
}
