//! Checkpoints of an overlap: named arrays, bit-exact.

use super::shell::{Given, PULL};
use super::{FaceStress, Ledger, Overlap, OverlapError, Work};
use colluvium_continuum::rheology::ShearLaw;
use colluvium_continuum::yield_step::FlowState;
use colluvium_dem::Record;

/// Numbers of the array `state`; the last is the height of a cell, the fourth the mass beyond the edge.
const STATE: usize = 12;

/// Height of a cell and number of those beyond the edge, and the mass there.
pub(super) fn cells(record: &Record) -> Result<((f64, usize), f64), String> {
    let state = record.numbers("state")?;
    let &[beyond] = record.counts("cells")? else {
        return Err("array `cells` must have 1 number".into());
    };
    match (state.len() == STATE, state.get(3), state.last()) {
        (true, Some(&mass), Some(&cell)) if mass > 0.0 && cell > 0.0 && cell.is_finite() => {
            // More than any grid has: its own check says so.
            Ok(((cell, beyond.min(1 << 40) as usize), mass))
        }
        _ => Err(format!(
            "array `state` must have {STATE} numbers, lengths and masses positive"
        )),
    }
}

impl<L: ShearLaw + Copy> Overlap<L> {
    /// The whole state but for the grains', at any step, also between two exchanges.
    pub fn checkpoint(&self) -> Record {
        let mut record = Record::default();
        let mut numbers = |name: &str, values: Vec<f64>| {
            record.numbers.insert(name.into(), values);
        };
        let faces = self
            .averages
            .faces
            .iter()
            .flat_map(|f| [f.shear, f.pressure]);
        numbers("faces", faces.collect());
        let (flow, time) = self.continuum.state();
        numbers("continuum/u", flow.u.clone());
        numbers("continuum/p", flow.p.clone());
        numbers("continuum/s", flow.s.iter().flatten().copied().collect());
        numbers("held/accelerations", self.held.accelerations.clone());
        numbers("held/spins", self.held.spins.clone());
        numbers("given", self.given.numbers());
        numbers("laid", self.shell.laid.numbers());
        let work = self.shell.work;
        numbers(
            "state",
            vec![
                time,
                self.edge.position,
                self.normal_velocity,
                self.mass_beyond,
                self.held.shear,
                self.held.pressure,
                work.traction,
                work.impedance,
                work.relaxation,
                self.shell.acted,
                self.grain_mass,
                self.strip.cell,
            ],
        );
        numbers("pulls", self.shell.pulls());
        numbers("monitors", self.monitors.numbers());
        numbers("ledger", self.ledger.numbers().to_vec());
        record.counts.insert("made".into(), vec![self.made]);
        let beyond = self.continuum.cells() - self.strip.nodes();
        record.counts.insert("cells".into(), vec![beyond as u64]);
        record
    }

    pub(super) fn take_up(&mut self, record: &Record) -> Result<(), OverlapError> {
        self.read(record).map_err(OverlapError::Record)
    }

    fn read(&mut self, record: &Record) -> Result<(), String> {
        let nodes = self.strip.nodes();
        let sized = |name: &str, len: usize| {
            let values = record.numbers(name)?;
            if values.len() == len && values.iter().all(|x| x.is_finite()) {
                Ok(values)
            } else {
                let found = values.len();
                Err(format!(
                    "array `{name}` has {found} numbers, expected {len} finite ones"
                ))
            }
        };
        let faces = sized("faces", 2 * (nodes + 1))?.as_chunks::<2>().0;
        for (face, &[shear, pressure]) in self.averages.faces.iter_mut().zip(faces) {
            *face = FaceStress { shear, pressure };
        }
        self.averages.started = true;
        let state = sized("state", STATE)?;
        let finite = |name: &str| sized(name, record.numbers(name)?.len());
        let flow = FlowState {
            u: finite("continuum/u")?.to_vec(),
            p: finite("continuum/p")?.to_vec(),
            s: finite("continuum/s")?.as_chunks::<2>().0.to_vec(),
        };
        self.continuum.take_up(flow, state[0])?;
        self.held
            .accelerations
            .copy_from_slice(sized("held/accelerations", nodes)?);
        self.held.spins.copy_from_slice(sized("held/spins", nodes)?);
        let given = |name: &str| {
            let numbers = sized(name, 2 * nodes + 3)?;
            Given::from_numbers(numbers, nodes)
        };
        (self.given, self.shell.laid) = (given("given")?, given("laid")?);
        self.edge.position = state[1];
        self.normal_velocity = state[2];
        self.mass_beyond = state[3];
        (self.held.shear, self.held.pressure) = (state[4], state[5]);
        self.shell.work = Work {
            traction: state[6],
            impedance: state[7],
            relaxation: state[8],
        };
        self.shell.acted = state[9];
        self.grain_mass = state[10];
        let pulls = finite("pulls")?;
        if !pulls.len().is_multiple_of(PULL) {
            return Err(format!(
                "array `pulls` has {} numbers, not {PULL} a grain",
                pulls.len()
            ));
        }
        self.shell.take_up(pulls);
        self.monitors.take_up(finite("monitors")?)?;
        self.ledger = Ledger::from_numbers(record.numbers("ledger")?)?;
        match record.counts("made")? {
            &[made] if made < self.steps => self.made = made,
            _ => return Err("array `made` is not a step within an exchange".into()),
        }
        Ok(())
    }
}
