//! An open boundary: grains that leave a region are taken out.

use crate::grains::vector;
use crate::record::Record;
use crate::region::Region;
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use nalgebra::Vector3;

/// Where grains may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlet {
    /// Grains whose centre leaves it are taken out.
    pub keep: Region,
    /// Steps between two looks.
    pub every: u64,
}

/// What has gone through an outlet since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outflow {
    /// Number of grains.
    pub grains: u64,
    /// Their mass (kg).
    pub mass: f64,
    /// Momentum of the free ones when they went, half a step back as the integrator holds it (N s).
    pub momentum: Vector3<f64>,
}

/// The outlet and what went through it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drain {
    outlet: Option<Outlet>,
    outflow: Outflow,
}

impl Drain {
    /// Writes what has gone into a checkpoint.
    pub fn record(&self, record: &mut Record) {
        let Outflow {
            grains,
            mass,
            momentum,
        } = &self.outflow;
        record.counts.insert("outflow/grains".into(), vec![*grains]);
        let numbers = vec![*mass, momentum.x, momentum.y, momentum.z];
        record
            .numbers
            .insert("outflow/mass_momentum".into(), numbers);
    }

    /// Reads it back.
    pub fn read(&mut self, record: &Record) -> Result<(), String> {
        let &[grains] = record.counts("outflow/grains")? else {
            return Err("array `outflow/grains` must have 1 count".into());
        };
        let &[mass, x, y, z] = record.numbers("outflow/mass_momentum")? else {
            return Err("array `outflow/mass_momentum` must have 4 numbers".into());
        };
        self.outflow = Outflow {
            grains,
            mass,
            momentum: Vector3::new(x, y, z),
        };
        Ok(())
    }
}

impl Simulation {
    /// Opens the boundary of a region, or closes it. A resumed simulation has to be told again; what
    /// went before is remembered.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn set_outlet(&mut self, outlet: Option<Outlet>) -> Result<(), SetupError> {
        if let Some(outlet) = &outlet {
            outlet.keep.validate("outlet.keep")?;
            check("outlet.every", outlet.every as f64, "at least 1", |n| {
                n > 0.0
            })?;
        }
        self.drain.outlet = outlet;
        Ok(())
    }

    /// What has gone through outlets since the start.
    pub fn outflow(&self) -> Outflow {
        self.drain.outflow
    }

    /// Takes out what has left.
    pub(crate) fn let_out(&mut self) {
        let Some(outlet) = self.drain.outlet.take() else {
            return;
        };
        let cell = self.cell();
        let left = |x: &[f64; 4]| !outlet.keep.contains(&cell.wrap(vector(x)).0);
        let n = self.grains.len();
        if self.steps.is_multiple_of(outlet.every) && self.grains.place[..n].iter().any(left) {
            let mut goes: Vec<bool> = self.grains.place[..n].iter().map(left).collect();
            self.whole_clumps(&mut goes);
            for i in (0..n).filter(|&i| goes[i]) {
                let out = self.held_momentum(i);
                let outflow = &mut self.drain.outflow;
                outflow.grains += 1;
                outflow.mass += self.grains.mass[i];
                outflow.momentum += out;
            }
            self.drain.outflow.momentum += self.momentum_of_marked_clumps(&goes);
            self.remove(|grain| !outlet.keep.contains(&grain.position));
        }
        self.drain.outlet = Some(outlet);
    }
}
