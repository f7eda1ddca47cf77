//! The motion pass: each grain gathers its slots, is kicked and drifts.
//!
//! ```text
//! v(n+1/2) = v(n-1/2) + dt (F(n)/m + g)        x(n+1) = x(n) + dt v(n+1/2)
//! ω(n+1/2) = ω(n-1/2) + dt T(n)/I              I = 2/5 m R²
//! ```
//! Leap-frog. The moment of the tangential force is stored as `n × F_t`-type vectors T without the
//! radius, which cancels: `d(Rω)/dt = 5/(2m) (T + M/R)`.

use crate::grains::{Grains, SPHERE_INERTIA};
use crate::lanes::{Lanes4, Portable, has_avx2};
use crate::neighbours::Row;
use crate::planes::PlaneContacts;
use crate::reach::Reach;

/// What the pass reads beside the grains themselves.
#[derive(Clone, Copy)]
pub(crate) struct Pull<'a> {
    pub reach: &'a Reach,
    pub planes: &'a PlaneContacts,
    pub slot_rows: usize,
    /// Gravity (m/s²) and a zero.
    pub gravity: [f64; 4],
    /// Time over which forces act (s): half a step at the start of a run, else a step.
    pub kick: f64,
    /// Time over which grains move (s).
    pub drift: f64,
}

/// What the pass leaves for each row of grains.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RowResult {
    /// Largest speed against the row's drift (m/s).
    pub fluctuation: f64,
    /// Momentum that fixed grains of the row have taken from free ones (N s).
    pub impulse: [f64; 3],
}

/// Grains that one task works on at least.
const GRAINS_A_TASK: usize = 512;

/// Moves all grains by one step.
pub(crate) fn advance(
    grains: &mut Grains,
    rows: &[Row],
    pull: &Pull,
    results: &mut [RowResult],
    parallel: bool,
) {
    let n = grains.len();
    let task = Task {
        from: 0,
        place: &mut grains.place[..n],
        motion: &mut grains.motion[..n],
        turn: &mut grains.turn[..n],
        rows,
        results,
    };
    task.run(pull, parallel, has_avx2());
}

/// Force and both moments on a grain at this instant, gathered in the pass's own order.
pub(crate) fn gather(pull: &Pull, grain: usize) -> [[f64; 4]; 3] {
    let [f, t, m] = gather_lanes::<Portable>(pull, grain);
    let mut out = [[0.0; 4]; 3];
    f.store(&mut out[0]);
    t.store(&mut out[1]);
    m.store(&mut out[2]);
    out
}

struct Task<'a> {
    /// Number of the first grain of the slices.
    from: usize,
    place: &'a mut [[f64; 4]],
    motion: &'a mut [[f64; 4]],
    turn: &'a mut [[f64; 4]],
    rows: &'a [Row],
    results: &'a mut [RowResult],
}

impl Task<'_> {
    fn run(self, pull: &Pull, parallel: bool, wide: bool) {
        if parallel && self.place.len() >= 2 * GRAINS_A_TASK && self.rows.len() > 1 {
            let half = self.from + self.place.len() / 2;
            let row = self
                .rows
                .partition_point(|r| (r.end as usize) <= half)
                .clamp(1, self.rows.len() - 1);
            let at = self.rows[row].start as usize - self.from;
            let (p0, p1) = self.place.split_at_mut(at);
            let (m0, m1) = self.motion.split_at_mut(at);
            let (t0, t1) = self.turn.split_at_mut(at);
            let (r0, r1) = self.rows.split_at(row);
            let (q0, q1) = self.results.split_at_mut(row);
            let left = Task {
                from: self.from,
                place: p0,
                motion: m0,
                turn: t0,
                rows: r0,
                results: q0,
            };
            let right = Task {
                from: self.from + at,
                place: p1,
                motion: m1,
                turn: t1,
                rows: r1,
                results: q1,
            };
            rayon::join(
                || left.run(pull, parallel, wide),
                || right.run(pull, parallel, wide),
            );
            return;
        }
        #[cfg(target_arch = "x86_64")]
        if wide {
            // SAFETY: `wide` is only set when the processor has AVX2.
            unsafe { rows_avx2(self, pull) };
            return;
        }
        let _ = wide;
        rows_in::<Portable>(self, pull);
    }
}

/// The pass compiled for AVX2.
///
/// # Safety
/// The processor must have AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn rows_avx2(task: Task, pull: &Pull) {
    rows_in::<crate::lanes::avx2::Avx2>(task, pull);
}

#[inline(always)]
fn gather_lanes<L: Lanes4>(pull: &Pull, grain: usize) -> [L; 3] {
    let (reach, rows) = (pull.reach, pull.slot_rows);
    let (mut force, mut torque, mut moment) = (L::splat(0.0), L::splat(0.0), L::splat(0.0));
    let own = reach.first_own[grain] as usize..reach.first_own[grain + 1] as usize;
    for slot in reach.slots[own.start * rows..own.end * rows].chunks_exact(rows) {
        force = force + L::load(&slot[0]);
        torque = torque + L::load(&slot[1]);
        if rows == 3 {
            moment = moment + L::load(&slot[2]);
        }
    }
    let other = reach.first_other[grain] as usize..reach.first_other[grain + 1] as usize;
    for &k in &reach.other[other] {
        let slot = &reach.slots[k as usize * rows..][..rows];
        force = force - L::load(&slot[0]);
        torque = torque + L::load(&slot[1]);
        if rows == 3 {
            moment = moment - L::load(&slot[2]);
        }
    }
    for contact in pull.planes.of(grain) {
        force = force + L::load(&contact.slot[0]);
        torque = torque + L::load(&contact.slot[1]);
        moment = moment + L::load(&contact.slot[2]);
    }
    [force, torque, moment]
}

#[inline(always)]
fn rows_in<L: Lanes4>(task: Task, pull: &Pull) {
    let zero = L::splat(0.0);
    let kick = L::splat(pull.kick);
    let drift = L::load(&[pull.drift, pull.drift, pull.drift, 0.0]);
    let gravity = L::load(&pull.gravity);
    let spin_up = L::splat(1.0 / SPHERE_INERTIA);
    for (row, result) in task.rows.iter().zip(task.results) {
        let mut fastest = 0.0_f64;
        for g in row.start as usize..row.end as usize {
            let k = g - task.from;
            let [force, torque, moment] = gather_lanes::<L>(pull, g);
            let velocity = L::load(&task.motion[k]);
            let turn = L::load(&task.turn[k]);
            let inverse_mass = velocity.splat_last();
            let fall = L::select(zero.less(inverse_mass), gravity, zero);
            let moved = velocity + kick * (force * inverse_mass + fall);
            moved.store(&mut task.motion[k]);
            let turned = kick * spin_up * inverse_mass * (torque + moment * turn.splat_last());
            (turn + turned).store(&mut task.turn[k]);
            (L::load(&task.place[k]) + drift * moved).store(&mut task.place[k]);

            let v = &task.motion[k];
            let mut speed2 = 0.0;
            for (v, w) in v.iter().zip(&row.drift) {
                speed2 += (v - w) * (v - w);
            }
            if speed2 > fastest || speed2.is_nan() {
                fastest = speed2;
            }
            if v[3] == 0.0 {
                let mut taken = [0.0; 4];
                (kick * force).store(&mut taken);
                for (sum, taken) in result.impulse.iter_mut().zip(taken) {
                    *sum += taken;
                }
            }
        }
        result.fluctuation = fastest.sqrt();
    }
}
