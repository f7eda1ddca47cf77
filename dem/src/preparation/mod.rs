//! Grains in place before a run begins.
//!
//! Sizes are drawn ([`SizeLaw`]), grains inserted ([`insert_loose`]), poured ([`pour`]), brought to rest
//! ([`relax`], [`settle_in_stages`]), pulled together ([`compact`]), jammed ([`jam`]) or grown ([`grow`]);
//! what comes out is kept as a [`Packing`]. Each way says in a report what it achieved against what was
//! asked for.

mod aggregates;
mod clump_pouring;
mod compaction;
mod coordination;
mod incline_bed;
mod ingredients;
mod insertion;
mod jamming;
mod packing;
mod pouring;
mod relaxation;
mod rest;
mod scattering;
mod sheared_cell;
mod shearing;
mod size_report;
mod sizes;
mod solid_fraction;
mod stages;
mod stiffness;
mod watch;

pub use aggregates::{Aggregate, AggregateReport, Growth, grow};
pub use clump_pouring::{ClumpPouring, pour_clumps};
pub use compaction::{CentralCompaction, CompactionReport, compact};
pub use coordination::{Coordination, HELD_BY_FRICTION, HELD_FRICTIONLESS};
pub use incline_bed::{Bed, BedReport, InclineBed, settle_incline_bed, settle_incline_bed_from};
pub use ingredients::{Amount, Ingredient};
pub use insertion::{Insertion, InsertionReport, TRIES, insert_loose};
pub use jamming::{Jamming, JammingReport, jam};
pub use packing::{Packing, PackingReport};
pub use pouring::{FILL, Pouring, PouringReport, pour};
pub use relaxation::{Relaxation, relax};
pub use rest::{Rest, RestMeasures};
pub use scattering::{ClumpShape, Scattered, Scattering, scatter};
pub use sheared_cell::{ImageContact, ShearedCell};
pub use shearing::{Shearing, ShearingReport, shear, steady_shear};
pub use size_report::{Compared, SizeReport};
pub use sizes::{RadiusLaw, SizeLaw, Weight};
pub use solid_fraction::solid_fraction;
pub use stages::{StageReport, Stages, settle_in_stages};
pub use watch::{Look, LookState, Midway, Watch};
