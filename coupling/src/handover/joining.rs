//! Debris that joins matter which is there already: the next instalment.
//!
//! Its volume fills what ground and matter leave free of the cells, by the same smoothed solid fraction, so no cell holds more
//! than it has room for; what finds none within the reach goes to where a reach twice as long finds it, which is over the
//! surface. Both parts of a face become one by their momentum,
//!
//! ```text
//! u = (m u + m' u')/(m + m'),    m' u' of the instalment made exact as at a first hand-over.
//! ```

use super::{Debris, Handed, HandoverError, Room};
use colluvium_continuum::column_collapse::Matter;

impl Debris<'_> {
    /// Puts the debris into a room in which matter lies.
    ///
    /// # Errors
    /// If there is none, or no room for it in the whole grid.
    pub fn join(
        &self,
        room: &Room<'_>,
        present: &Matter,
    ) -> Result<(Matter, Handed), HandoverError> {
        if self.grains.is_empty() {
            return Err(HandoverError::Nothing);
        }
        let longest = room.spacing * room.counts.iter().sum::<usize>() as f64;
        let (mut taken, mut left, mut reach) = (present.fractions.clone(), self.area(), self.reach);
        let mut added = vec![0.0; taken.len()];
        while left > 0.0 {
            if reach > 2.0 * longest {
                let needed = self.area();
                let found = needed - left;
                return Err(HandoverError::NoRoom { needed, found });
            }
            let (more, rest) = self.fill(room, &taken, left, reach);
            for ((sum, taken), more) in added.iter_mut().zip(&mut taken).zip(more) {
                *sum += more;
                *taken += more;
            }
            left = rest;
            reach *= 2.0;
        }
        let mut velocity = [0, 1].map(|c| self.means(room, c, &added));
        let handed = self.settle(room, &added, &mut velocity);
        let velocity = [0, 1].map(|c| {
            let faces = velocity[c].iter().zip(&present.velocity[c]).enumerate();
            faces
                .map(|(face, (new, old))| {
                    let of = |fractions: &[f64]| room.carried(c, face, fractions);
                    let [own, more] = [of(&present.fractions), of(&added)];
                    if more > 0.0 {
                        (own * old + more * new) / (own + more)
                    } else {
                        *old
                    }
                })
                .collect()
        });
        let matter = Matter {
            fractions: taken,
            velocity,
        };
        Ok((matter, handed))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)] // a test may panic
    use super::super::tests::{debris, lattice, level, room};
    use super::*;

    fn momentum(room: &Room<'_>, matter: &Matter, unit: f64) -> [f64; 2] {
        [0, 1].map(|c| {
            let faces = matter.velocity[c].iter().enumerate();
            let sum = faces.map(|(face, u)| u * room.carried(c, face, &matter.fractions));
            unit * sum.sum::<f64>()
        })
    }

    /// Two layers of a block one after the other: volume and momentum exact, no cell too full, and the outline that of the block.
    #[test]
    fn two_instalments_are_the_block() {
        let ground = level();
        let room = room(&ground);
        let lower = lattice(12, 4, |_, _| [0.3, -0.2]);
        let mut upper = lattice(12, 4, |x, _| [-0.1 * x, 0.05]);
        for grain in &mut upper {
            // Half a grain into what lies there: that much has to find room above.
            grain.position.z += 3.5;
        }
        let unit = 2.0 * std::f64::consts::PI / 6.0 * 0.64 * 4.0;
        let (first, one) = debris(&lower).hand_over(&room).unwrap();
        let (both, two) = debris(&upper).join(&room, &first).unwrap();
        let area = 0.64 * both.fractions.iter().sum::<f64>();
        assert!((area / 96.0 - 1.0).abs() < 1e-12, "{area}");
        for (full, free) in both.fractions.iter().zip(&room.free) {
            assert!(*full <= free + 1e-12, "{full} {free}");
        }
        let sums = momentum(&room, &both, unit);
        for c in 0..2 {
            let grains = one.momentum[0][c] + two.momentum[0][c];
            let size = one.momentum[0][c].abs() + two.momentum[0][c].abs();
            assert!((sums[c] - grains).abs() < 1e-12 * size, "{sums:?} {grains}");
            // Control: without the momentum of the instalment it is missed.
            let old = Matter {
                velocity: first.velocity.clone(),
                ..both.clone()
            };
            assert!((momentum(&room, &old, unit)[c] - grains).abs() > 0.05 * size);
        }
        let high: f64 = (0..20).map(|k| both.fractions[12 + 30 * k]).sum::<f64>() * 0.8;
        assert!((high - 8.0).abs() < 0.4, "{high}");
    }

    /// What joins in the middle of full matter comes to lie on top of it.
    #[test]
    fn what_finds_no_room_goes_to_the_surface() {
        let ground = level();
        let room = room(&ground);
        let (first, _) = debris(&lattice(20, 9, |_, _| [0.0, 0.0]))
            .hand_over(&room)
            .unwrap();
        let mut inside = lattice(3, 2, |_, _| [0.0, 0.0]);
        for grain in &mut inside {
            grain.position.x += 8.0;
            grain.position.z += 3.0;
        }
        let (both, handed) = debris(&inside).join(&room, &first).unwrap();
        assert!((handed.volume[1] / handed.volume[0] - 1.0).abs() < 1e-12);
        let mut above = 0.0;
        for (at, (new, old)) in both.fractions.iter().zip(&first.fractions).enumerate() {
            assert!(*new <= room.free[at] + 1e-12);
            above += if -0.8 + 0.8 * (at / 30) as f64 > 7.0 {
                new - old
            } else {
                0.0
            };
        }
        assert!(above * 0.64 > 0.8 * 6.0, "{above}");
        let tight = Room {
            counts: [30, 2],
            free: room.free[..60].to_vec(),
            ..room
        };
        let full = Matter {
            fractions: tight.free.iter().map(|f| 0.99 * f).collect(),
            velocity: [vec![0.0; 62], vec![0.0; 90]],
        };
        let refused = debris(&inside).join(&tight, &full);
        assert!(matches!(refused, Err(HandoverError::NoRoom { .. })));
    }
}
