//! Where grains are needed: what a side of the box moves for.
//!
//! A side goes *outwards* where, after an exchange, asked in this order,
//!
//! - the ball has come nearer to the inner end of its overlap than asked for;
//! - the grains of its inner overlap, their rms speed with its fluctuations, are faster than v_wake;
//! - those grains are packed too loosely, or fluctuations make too much of the pressure, or a tenth of the continuum in the strip
//!   beyond is sheared faster than its law was calibrated for ([`DenseLimits`]);
//! - what is stored in that strip has been sheared by more than γ_max in the mean since it was put by, so that the law's steady
//!   friction no longer is that of material as it was put by.
//!
//! It goes *inwards* where the grains that would be continuum or overlap have been slower than v_rest < v_wake for a time while
//! others beyond are faster, nothing asks for a move outwards, and the ball is far. Each move outwards of a side doubles the time
//! that its next one inwards waits for. A move that the budget does not allow is counted once until it is no longer wanted.
//!
//! [`DenseLimits`]: crate::overlap::DenseLimits

use super::gradients::shear_rate;
use super::journey::Growth;
use super::store::shear_of;
use super::zone::{Side, Zone};
use super::{Bowl, OverlapError};
use crate::overlap::dense_limits::{LEAST_PRESSURE, Reason};
use colluvium_dem::{GrainSample, Simulation};

/// What the grains beside a side do.
#[derive(Clone, Copy, Debug, Default)]
struct Beside {
    /// Rms speed in the inner overlap (m/s).
    inner: f64,
    /// Of what would be continuum or overlap after a move inwards, and of the grains beyond (m/s).
    outer: f64,
    front: f64,
    /// How many those beyond are.
    count: f64,
}

impl Bowl {
    /// Moves a side if there is reason.
    pub(super) fn consider(
        &mut self,
        growth: &Growth,
        side: Side,
        simulation: &mut Simulation,
    ) -> Result<(), OverlapError> {
        let travel = &growth.travel;
        let number = side.number();
        let ball = self.ball_way(&side);
        let beside = self.speeds_beside(&side);
        let near = ball.filter(|way| *way < growth.near);
        let needs = near.map(|way| (Reason::Ball, way));
        let needs =
            needs.or_else(|| (beside.inner > travel.wake).then_some((Reason::Speed, beside.inner)));
        let dense = &travel.dense;
        let needs = needs.or_else(|| dense.of_grains(|| self.dilution_beside(&side)));
        if let Some(reason) = needs.or_else(|| self.needs_beyond(growth, &side)) {
            self.journey.resting[number] = 0.0;
            let refused = !self.shift(growth, side, true, reason, simulation)?;
            let before = &mut self.journey.refusing[number];
            self.journey.refused += f64::from(u8::from(refused && *before == 0.0));
            *before = f64::from(u8::from(refused));
            return Ok(());
        }
        self.journey.refusing[number] = 0.0;
        let rests = beside.outer < travel.rest
            && beside.front > travel.rest
            && beside.count >= travel.fewest;
        let resting = &mut self.journey.resting[number];
        *resting = if rests { *resting + 1.0 } else { 0.0 };
        let hold = travel.hold * 2.0_f64.powf(self.journey.returns[number]);
        if self.journey.resting[number] * self.exchange_time() <= hold {
            return Ok(());
        }
        // A box that let the ball come near at once would go to and fro.
        let stride = self.stride() as f64 * self.layout.cells.spacing[side.axis];
        if ball.is_none_or(|way| way - stride > 1.5 * growth.near) {
            self.journey.resting[number] = 0.0;
            let reason = (Reason::Rest, beside.outer);
            self.shift(growth, side, false, reason, simulation)?;
        }
        Ok(())
    }

    /// Distance between the ball and the inner end of a side's overlap (m).
    fn ball_way(&self, side: &Side) -> Option<f64> {
        let layout = &self.layout;
        let number = self.spec.ball?;
        let grains = &self.sighting.snapshot.grains;
        let ball = &grains[grains.binary_search_by_key(&number, |g| g.id).ok()?];
        let depth = layout.zone.depth(&layout.cells, side, &ball.position) - layout.widths[1];
        Some(depth * layout.cells.spacing[side.axis] - ball.radius)
    }

    fn speeds_beside(&self, side: &Side) -> Beside {
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        let [handshake, inner] = self.layout.widths;
        let outer = inner + self.stride() as f64;
        let (mut squares, mut masses, mut count) = ([0.0; 3], [0.0; 3], 0.0);
        let belongs = self.spec.belongs();
        let mut add = |zone: usize, grain: &GrainSample| {
            squares[zone] += grain.mass * grain.velocity.norm_squared();
            masses[zone] += grain.mass;
        };
        for grain in self.sighting.snapshot.grains.iter().filter(|g| belongs(g)) {
            let depth = zone.depth(cells, side, &grain.position);
            if (handshake..inner).contains(&depth) {
                add(0, grain);
            }
            add(if depth < outer { 1 } else { 2 }, grain);
            count += f64::from(u8::from(depth >= outer));
        }
        let speed =
            |zone: usize| f64::sqrt(squares[zone] / f64::max(masses[zone], f64::MIN_POSITIVE));
        Beside {
            inner: speed(0),
            outer: speed(1),
            front: speed(2),
            count,
        }
    }

    /// What in the continuum beyond a side, a strip wide, asks for grains.
    fn needs_beyond(&self, growth: &Growth, side: &Side) -> Option<(Reason, f64)> {
        let dense = &growth.travel.dense;
        let fast = dense.of_continuum(|| self.inertial_beyond(side));
        if fast.is_some() {
            return fast;
        }
        if growth.misplaced.is_finite() {
            let shear = self.shear_beyond(side);
            if shear > growth.misplaced {
                return Some((Reason::Misplaced, shear));
            }
        }
        None
    }

    /// The box that a side would make by a move outwards.
    fn larger(&self, side: &Side) -> Zone {
        let layout = &self.layout;
        layout.zone.moved(&layout.cells, side, self.stride())
    }

    /// I of the cells of the strip beyond a side. Those at the surface have no pressure to speak of and do not count.
    fn inertial_beyond(&self, side: &Side) -> Vec<f64> {
        let (cells, law, view) = (&self.layout.cells, &self.spec.law, &self.view);
        let (zone, larger) = (&self.layout.zone, self.larger(side));
        let beneath = |cell: usize| cells.above(cell).is_some_and(|above| view.is_full(above));
        (0..cells.count())
            .filter(|&cell| {
                let index = cells.index(cell);
                let is_strip = zone.label_of_cell(index) < 0.0 && larger.label_of_cell(index) > 0.0;
                is_strip && view.is_full(cell) && beneath(cell)
            })
            .map(|cell| {
                let pressure = -view.stress[cell].trace() / 3.0;
                let rate = shear_rate(&self.gradients[cell]);
                let least = LEAST_PRESSURE * self.full() * self.spec.gravity / cells.face_area(2);
                rate * law.diameter * (law.grain_density / pressure.max(least)).sqrt()
            })
            .collect()
    }

    /// Mean shear of what is stored in the strip beyond a side since it was put by.
    fn shear_beyond(&self, side: &Side) -> f64 {
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        let larger = self.larger(side);
        let (mut sum, mut count) = (0.0, 0.0);
        for (grain, stretch) in self.journey.store.rows() {
            let at = &grain.position;
            if zone.label(cells, at) < 0.0 && larger.label(cells, at) >= 0.0 {
                sum += shear_of(&stretch);
                count += 1.0;
            }
        }
        sum / f64::max(count, 1.0)
    }
}
