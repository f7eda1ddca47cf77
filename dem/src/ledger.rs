//! Where energy comes from and where it goes.
//!
//! Leap-frog changes the kinetic energy of a grain by exactly the force times the mean of its velocities
//! before and after the kick. Booked with that velocity, the work of all contacts, of gravity and of
//! moved grains and walls adds up to the kinetic energy *to round-off*, at any time step:
//!
//! ```text
//! K(now) = K(start) + Σ W_channel + W_gravity + W_drive + W_loads + W_bonds + W_fields + W_boundary
//! dissipated by a channel = -W_channel - (E_channel(now) - E_channel(start))
//! ```
//! E_channel is the energy that the law says its springs hold, so a channel that dissipates less than
//! nothing shows a law that creates energy, or a step too long for it. The normal channel also loses
//! what adhesive contacts lose when they are made and broken.

use crate::bonds::Bond;
use crate::contact::Stored;
use crate::grains::{SPHERE_INERTIA, vector};
use crate::simulation::Simulation;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Energy by the channels of a contact law (J).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Channels {
    /// Normal springs, dashpots, adhesion and cohesion.
    pub normal: f64,
    /// Tangential springs, dashpots and friction.
    pub tangential: f64,
    /// Rolling.
    pub rolling: f64,
    /// Twisting.
    pub twisting: f64,
}

impl Channels {
    /// Over all channels.
    pub fn sum(&self) -> f64 {
        self.normal + self.tangential + self.rolling + self.twisting
    }

    fn of(stored: &Stored) -> Channels {
        Channels {
            normal: stored.normal + stored.cohesion,
            tangential: stored.tangential,
            rolling: stored.rolling,
            twisting: stored.twisting,
        }
    }
}

/// Energy by way of bonds (J).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bonding {
    /// Work on grains since the ledger was opened.
    pub work: f64,
    /// Elastic energy when it was opened.
    pub stored_before: f64,
    /// Elastic energy now.
    pub stored: f64,
    /// Energy that broken and cut bonds had held, when it was opened.
    pub freed_before: f64,
    /// The same now.
    pub freed: f64,
}

impl Bonding {
    /// What breaking and cutting have cost since the ledger was opened (J).
    pub fn broken(&self) -> f64 {
        self.freed - self.freed_before
    }

    /// What grains have put into bonds that is neither stored nor broken (J): bonds have no dashpot,
    /// so this is the error of the step, and it falls with its square.
    pub fn lost(&self) -> f64 {
        -self.work - (self.stored - self.stored_before) - self.broken()
    }
}

/// Energy by way of fields of gravity that differ from place to place (J).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Falling {
    /// Work on grains since the ledger was opened.
    pub work: f64,
    /// Potential energy when it was opened.
    pub potential_before: f64,
    /// Potential energy now.
    pub potential: f64,
}

impl Falling {
    /// What has come out of nowhere (J): the error of the step and of the tree.
    pub fn gained(&self) -> f64 {
        self.work + (self.potential - self.potential_before)
    }
}

/// What has happened to the energy of the free grains and bodies since the ledger was opened (J).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergyLedger {
    /// Kinetic energy when it was opened.
    pub kinetic_before: f64,
    /// Kinetic energy now.
    pub kinetic: f64,
    /// Work of contacts on grains.
    pub work: Channels,
    /// Work of gravity.
    pub gravity: f64,
    /// Work put in by walls and grains that move as they are told.
    pub drive: f64,
    /// Work of steady loads.
    #[serde(default)]
    pub loads: f64,
    /// Work of bonds on grains.
    #[serde(default)]
    pub bonds: Bonding,
    /// Work of a periodic boundary that moves: by contacts and bonds across it, by grains that cross it
    /// and where its speed changes.
    #[serde(default)]
    pub boundary: f64,
    /// Work of fields of gravity.
    #[serde(default)]
    pub fields: Falling,
    /// Energy in contacts when it was opened.
    pub stored_before: Channels,
    /// Energy in contacts now.
    pub stored: Channels,
}

impl EnergyLedger {
    /// What contacts have turned into heat, by channel (J).
    pub fn dissipated(&self) -> Channels {
        let lost = |work: f64, before: f64, now: f64| -work - (now - before);
        let (w, b, s) = (&self.work, &self.stored_before, &self.stored);
        Channels {
            normal: lost(w.normal, b.normal, s.normal),
            tangential: lost(w.tangential, b.tangential, s.tangential),
            rolling: lost(w.rolling, b.rolling, s.rolling),
            twisting: lost(w.twisting, b.twisting, s.twisting),
        }
    }

    /// What is not accounted for, relative to the largest entry: round-off.
    pub fn error(&self) -> f64 {
        let put_in = self.work.sum()
            + self.gravity
            + self.drive
            + self.loads
            + self.bonds.work
            + self.fields.work
            + self.boundary;
        let entries = [
            self.kinetic_before,
            self.kinetic,
            self.work.sum(),
            self.work.normal,
            self.work.tangential,
            self.gravity,
            self.drive,
            self.loads,
            self.bonds.work,
            self.fields.work,
            self.boundary,
        ];
        let scale = entries.iter().fold(0.0_f64, |a, e| a.max(e.abs()));
        if scale > 0.0 {
            (self.kinetic - self.kinetic_before - put_in).abs() / scale
        } else {
            0.0
        }
    }
}

impl EnergyLedger {
    /// All entries, for a checkpoint.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let (bonds, fields) = (&self.bonds, &self.fields);
        let channels = |c: &Channels| [c.normal, c.tangential, c.rolling, c.twisting];
        [
            [self.kinetic_before, self.kinetic, self.gravity, self.drive],
            [self.loads, bonds.work, bonds.stored_before, bonds.stored],
            [bonds.freed_before, bonds.freed, 0.0, 0.0],
            [
                fields.work,
                fields.potential_before,
                fields.potential,
                self.boundary,
            ],
            channels(&self.work),
            channels(&self.stored_before),
            channels(&self.stored),
        ]
        .concat()
    }

    /// The ledger of a checkpoint; none where it was not open.
    pub(crate) fn from_numbers(numbers: &[f64]) -> Result<Option<EnergyLedger>, String> {
        if numbers.is_empty() {
            return Ok(None);
        }
        let (&[first, second, third, fourth, work, stored_before, stored], []) =
            numbers.as_chunks::<4>()
        else {
            return Err("array `energy_ledger` must have 28 numbers".into());
        };
        let [kinetic_before, kinetic, gravity, drive] = first;
        let [loads, bond_work, before, now] = second;
        let [freed_before, freed, ..] = third;
        let [field_work, potential_before, potential, boundary] = fourth;
        let channels = |[normal, tangential, rolling, twisting]: [f64; 4]| Channels {
            normal,
            tangential,
            rolling,
            twisting,
        };
        Ok(Some(EnergyLedger {
            kinetic_before,
            kinetic,
            work: channels(work),
            gravity,
            drive,
            loads,
            bonds: Bonding {
                work: bond_work,
                stored_before: before,
                stored: now,
                freed_before,
                freed,
            },
            boundary,
            fields: Falling {
                work: field_work,
                potential_before,
                potential,
            },
            stored_before: channels(stored_before),
            stored: channels(stored),
        }))
    }
}

/// What one side of a contact moves with while it is kicked.
struct Moving {
    velocity: Vector3<f64>,
    /// R ω (m/s).
    turn: Vector3<f64>,
    spin: Vector3<f64>,
    fixed: bool,
}

impl Simulation {
    /// Books energies from now on; steps then cost several times as much. Giving velocities, fixing,
    /// inserting and removing grains opens the ledger anew.
    pub fn open_energy_ledger(&mut self) {
        let kinetic = self.energy().kinetic();
        let stored = self.stored_energy();
        let (bonded, freed) = (self.bond_energy(), self.bonds.count().energy_freed);
        let potential = self.fields.potential() + self.body_potential();
        self.ledger = Some(EnergyLedger {
            fields: Falling {
                work: 0.0,
                potential_before: potential,
                potential,
            },
            bonds: Bonding {
                work: 0.0,
                stored_before: bonded,
                stored: bonded,
                freed_before: freed,
                freed,
            },
            kinetic_before: kinetic,
            kinetic,
            stored_before: Channels::of(&stored),
            stored: Channels::of(&stored),
            ..EnergyLedger::default()
        });
        if self.steps_since_start > 0 {
            // The next kick begins half a step back: what it does before now is not this ledger's.
            self.book_energy(-0.5 * self.timestep);
        }
    }

    /// The ledger, if it is open.
    ///
    /// Energies are those of this instant: the half kick that brings velocities here is booked too, in
    /// the copy that is handed out.
    pub fn energy_ledger(&mut self) -> Option<EnergyLedger> {
        let before = self.ledger?;
        let stored = self.stored_energy();
        if self.steps_since_start > 0 {
            self.book_energy(0.5 * self.timestep);
        }
        let mut ledger = self.ledger.replace(before)?;
        ledger.kinetic = self.energy().kinetic();
        ledger.stored = Channels::of(&stored);
        ledger.fields.potential = self.fields.potential() + self.body_potential();
        ledger.bonds.stored = self.bond_energy();
        ledger.bonds.freed = self.bonds.count().energy_freed;
        Some(ledger)
    }

    fn stored_energy(&mut self) -> Stored {
        let energy = self.energy();
        Stored {
            normal: energy.normal,
            cohesion: energy.cohesion,
            tangential: energy.tangential,
            rolling: energy.rolling,
            twisting: energy.twisting,
        }
    }

    /// The mean of a grain's velocities before and after a kick of this length.
    fn moving(&self, i: usize, kick: f64) -> Moving {
        let (v, s) = (&self.grains.motion[i], &self.grains.turn[i]);
        let mut velocity = vector(v);
        let mut turn = vector(s);
        let fixed = self.grains.is_fixed(i);
        if self.clumps.carry(i) {
            let [mean, spin] = self.member_kicked(i, 0.5 * kick);
            (velocity, turn) = (mean, spin * self.grains.place[i][3]);
        } else if !fixed {
            let [force, torque, moment] = self.totals[i];
            velocity += 0.5 * kick * (vector(&force) * v[3] + self.gravity);
            turn += 0.5 * kick / SPHERE_INERTIA * v[3] * (vector(&torque) + vector(&moment) * s[3]);
        }
        Moving {
            velocity,
            turn,
            spin: turn * s[3],
            fixed,
        }
    }

    /// Books a kick from the velocities half a step back (one of negative length takes it off again);
    /// forces of the present positions are in the slots.
    pub(crate) fn book_energy(&mut self, kick: f64) {
        let Some(mut ledger) = self.ledger else {
            return;
        };
        let rows = self.slot_rows();
        let moving: Vec<Moving> = (0..self.grains.len())
            .map(|i| self.moving(i, kick.abs()))
            .collect();
        for (i, grain) in moving.iter().enumerate() {
            if self.moves_alone(i) {
                let m = self.grains.mass[i];
                ledger.gravity += kick * m * grain.velocity.dot(&self.gravity);
            }
        }
        ledger.gravity += self.gravity_on_clumps(kick);
        let cell = self.cell();
        for (chunk, k) in self.reach.pairs() {
            let [i, j] = chunk.pair(k);
            let slot = &chunk.slots[k * rows..][..rows];
            if slot.iter().flatten().all(|x| *x == 0.0) {
                continue;
            }
            let (a, b) = (&self.grains.place[i], &self.grains.place[j]);
            let (branch, image) = cell.nearest(vector(a) - vector(b));
            let normal = branch.normalize();
            ledger.boundary += kick * vector(&slot[0]).dot(&image);
            let (a, b) = (&moving[i], &moving[j]);
            let u = a.velocity - b.velocity - image;
            let (turns, spin) = (a.turn + b.turn, a.spin - b.spin);
            book(&mut ledger.work, slot, &normal, kick, [u, turns, spin]);
            // Work on a fixed grain is not work on a free one: somebody moved it.
            for (side, sign) in [(a, 1.0), (b, -1.0)] {
                if side.fixed {
                    let power = sign * vector(&slot[0]).dot(&side.velocity)
                        + vector(&slot[1]).dot(&side.turn)
                        + slot
                            .get(2)
                            .map_or(0.0, |m| sign * vector(m).dot(&side.spin));
                    ledger.drive -= kick * power;
                }
            }
        }
        for (grain, pull) in moving.iter().zip(&self.fields.pulls) {
            if !grain.fixed {
                ledger.fields.work += kick * vector(pull).dot(&grain.velocity);
            }
        }
        for Bond { rows, pull, .. } in self.bonds.whole() {
            let sides = rows.map(|row| &moving[row as usize]);
            let [a, b] = rows.map(|row| vector(&self.grains.place[row as usize]));
            let passed_on = kick * pull.force.dot(&cell.nearest(a - b).1);
            ledger.boundary += passed_on;
            ledger.bonds.work -= passed_on;
            for ((side, sign), moment) in sides.into_iter().zip([1.0, -1.0]).zip(&pull.moments) {
                let power = sign * pull.force.dot(&side.velocity) + moment.dot(&side.spin);
                ledger.bonds.work += kick * power;
                if side.fixed {
                    ledger.drive -= kick * power;
                }
            }
        }
        for (at, load) in self.loads.given() {
            let grain = &moving[at];
            if !grain.fixed {
                let power = load.force.dot(&grain.velocity) + load.moment.dot(&grain.spin);
                ledger.loads += kick * power;
            }
        }
        self.book_walls(&mut ledger, &moving, kick);
        self.book_bodies(&mut ledger, kick);
        self.ledger = Some(ledger);
    }

    /// Books the work of contacts with walls and bodies; what those that move as they are told give is
    /// drive. Their velocity, too, is the mean of those before and after the kick.
    fn book_walls(&self, ledger: &mut EnergyLedger, moving: &[Moving], kick: f64) {
        for contact in self.wall_contacts.touching() {
            let i = contact.grain as usize;
            let (grain, wall) = (&moving[i], &self.walls[contact.wall as usize]);
            let (normal, slot) = (Vector3::from(contact.normal), &contact.slot);
            let (mut velocity, mut spin) = (Vector3::zeros(), Vector3::zeros());
            if wall.moves() {
                let x = &self.grains.place[i];
                let arm = wall.seen(&vector(x), &self.domain) - normal * (x[3] - contact.overlap);
                let offset = wall.carrier.map_or(Vector3::zeros(), |c| c.offset);
                let twist = self.mean_twist(wall, kick.abs());
                spin = twist.spin;
                velocity = twist.at(&(offset + arm));
                if !wall.yields() {
                    let power = vector(&slot[0]).dot(&velocity) + vector(&slot[2]).dot(&spin);
                    ledger.drive += kick * power;
                }
            }
            let against = [grain.velocity - velocity, grain.turn, grain.spin - spin];
            book(&mut ledger.work, slot, &normal, kick, against);
            if grain.fixed {
                let power = [&grain.velocity, &grain.turn, &grain.spin]
                    .into_iter()
                    .zip(slot);
                let power = power.map(|(v, force)| vector(force).dot(v));
                ledger.drive -= kick * power.sum::<f64>();
            }
        }
    }
}

/// Work of one contact on both sides: relative velocity, sum of R ω, difference of ω.
fn book(
    work: &mut Channels,
    slot: &[[f64; 4]],
    normal: &Vector3<f64>,
    kick: f64,
    [velocity, turns, spin]: [Vector3<f64>; 3],
) {
    let force = vector(&slot[0]);
    let pressing = force.dot(normal) * velocity.dot(normal);
    work.normal += kick * pressing;
    work.tangential += kick * (force.dot(&velocity) - pressing + vector(&slot[1]).dot(&turns));
    if let Some(moment) = slot.get(2) {
        let moment = vector(moment);
        let twist = moment.dot(normal) * spin.dot(normal);
        work.twisting += kick * twist;
        work.rolling += kick * (moment.dot(&spin) - twist);
    }
}
