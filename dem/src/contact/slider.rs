//! Spring, dashpot and slider in parallel and in series: the element behind sliding, rolling and
//! twisting resistance.
//!
//! ```text
//! trial  f = k s + c u            s = displacement of the spring, u = its rate
//! f      = trial · min(1, limit/|trial|)
//! s      = s     · min(1, limit/|k s|)
//! ```
//! Spring and dashpot are limited *together*, and the spring by itself, so that
//! * the force never exceeds the limit and never points against the motion that the slider yields to;
//! * what the element takes, f·u, is never less than what its spring stores: with |k s| ≤ limit,
//!   a trial beyond the limit lies nearer to u than s does. No cycle creates energy.
//!
//! (A spring set back by the dashpot's share instead can flip sign at once and push the wrong way;
//! an unlimited dashpot can exceed friction many times over at the first touch.)

use crate::lanes::{Lane, Vec3};

/// Force or moment, and the displacement left in the spring, of a slider in space.
#[inline(always)]
pub fn slide<L: Lane>(
    displacement: Vec3<L>,
    rate: Vec3<L>,
    stiffness: L,
    damping: L,
    limit: L,
) -> (Vec3<L>, Vec3<L>) {
    let elastic = displacement.scale(stiffness);
    let trial = elastic + rate.scale(damping);
    let cap = share(limit, trial.norm());
    let keep = share(limit, elastic.norm());
    (trial.scale(cap), displacement.scale(keep))
}

/// The same along one axis.
#[inline(always)]
pub fn slide_scalar<L: Lane>(
    displacement: L,
    rate: L,
    stiffness: L,
    damping: L,
    limit: L,
) -> (L, L) {
    let elastic = displacement * stiffness;
    let trial = elastic + rate * damping;
    let cap = share(limit, trial.abs());
    let keep = share(limit, elastic.abs());
    (trial * cap, displacement * keep)
}

/// `min(1, limit/size)`, 1 at rest.
#[inline(always)]
fn share<L: Lane>(limit: L, size: L) -> L {
    // The quotient is 0/0 only where nothing slips, and is not selected there.
    L::select(limit.less(size), limit / size, L::splat(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sticks_below_the_limit_and_slips_at_it() {
        let (f, s) = slide_scalar(0.1, 0.5, 10.0, 1.0, 2.0);
        assert_eq!((f, s), (1.5, 0.1));
        let (f, s) = slide_scalar(0.4, 0.5, 10.0, 1.0, 2.0);
        assert!((f - 2.0).abs() < 1e-15 && (s - 0.2).abs() < 1e-15);
        let (f, s) = slide_scalar(0.0, 0.0, 10.0, 1.0, 0.0);
        assert_eq!((f, s), (0.0, 0.0));
    }

    /// Largest excess of the energy stored over the work put in, along random paths under a
    /// changing limit; and the work.
    fn excess(damping: f64) -> (f64, f64) {
        let mut seed = 17_u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let (k, dt) = (40.0, 1e-4);
        let mut s = Vec3::zero();
        let (mut work, mut u) = (0.0, Vec3([1.0, 0.0, 0.0]));
        let mut worst = f64::NEG_INFINITY;
        for step in 0..200_000 {
            if step % 500 == 0 {
                u = Vec3([8.0 * random(), 8.0 * random(), 8.0 * random()]);
            }
            let limit = 3.0 * (1.0 + (step as f64 * 0.003).sin());
            s = s + u.scale(dt);
            let (f, left) = slide(s, u, k, damping, limit);
            assert!(f.norm() <= limit * (1.0 + 1e-12));
            s = left;
            work += f.dot(u) * dt;
            worst = worst.max(0.5 * k * s.dot(s) - work);
        }
        (worst, work)
    }

    #[test]
    fn no_path_takes_out_more_than_was_put_in() {
        let (worst, work) = excess(0.7);
        assert!(work > 1.0);
        assert!(worst < 1e-9, "stored exceeds work by {worst:e}");
    }

    #[test]
    fn a_dashpot_of_the_wrong_sign_is_caught() {
        let (worst, _) = excess(-0.7);
        assert!(worst > 1e-2, "{worst:e}");
    }
}
