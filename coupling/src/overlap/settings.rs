//! Widths, times and the impedance of an overlap, and what they are where nobody says.

use serde::{Deserialize, Serialize};

use super::OverlapError;

/// Shear strain in which sideways pressure at rest is forgotten.
const REST_STRAIN: f64 = 0.01;

/// How stresses of grains are smoothed along the normal, beyond the mean over a layer of one cell.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StressKernel {
    /// No more than that.
    #[default]
    Layer,
    /// Lucy's kernel of this half-width (m).
    Lucy(f64),
}

/// What the continuum does along the normal of the edge.
///
/// In a steady flow whose full version breathes (swings along the normal by the waves between base and surface),
/// a continuum that is held absorbs the swing with all that goes through the impedance; one that rides gives most
/// of it back, as the column it stands for would.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalMotion {
    /// It keeps its place: it stands on a rigid base, or what goes through the impedance is absorbed.
    Held,
    /// It rides on the grains as a rigid body of the mass beyond the edge, and the edge moves with it: what goes
    /// through the impedance is its momentum.
    Riding,
}

/// Settings of an overlap (SI); what is left out follows from [`Scales`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OverlapSettings {
    /// Height of the continuum's cells (m), about: the mass beyond the edge fills whole cells. d.
    pub cell: Option<f64>,
    /// Width of the inner overlap [a, m], where stresses of grains enter the continuum (m). 3 d.
    pub inner: Option<f64>,
    /// Width of the buffer [m, b], where mean velocities relax (m). 3 d.
    pub buffer: Option<f64>,
    /// Width of the shell that bears the continuum's traction (m), at most `buffer`, at a flat edge less a cell. 2 d.
    pub shell: Option<f64>,
    /// Smoothing of stresses at a flat edge; half-width at most `buffer` less `shell` and half a cell more.
    pub kernel: StressKernel,
    /// Time over which stresses of grains are averaged, exponentially (s). 0.5 √(d/g).
    pub stress_time: Option<f64>,
    /// Time in which mean velocities in the buffer relax to each other (s). √(d/g).
    pub relaxation_time: Option<f64>,
    /// Time in which the continuum's copy in the inner overlap follows the grains (s). √(d/g).
    pub following_time: Option<f64>,
    /// Time in which mean spins in the buffer relax to half the vorticity (s). √(d/g).
    pub spin_time: Option<f64>,
    /// Time step of the continuum (s), rounded to a whole number of `load_time`. 0.2 √(d/g).
    pub exchange_time: Option<f64>,
    /// Time for which forces on the grains are held (s), rounded to whole steps of theirs: what the impedance
    /// says is as old as that. 0.01 √(d/g), and at most 0.3 of [`Resolved::stopping_time`].
    pub load_time: Option<f64>,
    /// Acoustic impedance Z of the edge (Pa s/m): [`Scales::impedance`].
    pub impedance: Option<f64>,
    /// Motion of the continuum along the normal: riding where its far end is free, held where it is not.
    pub normal_motion: Option<NormalMotion>,
    /// Shear strain after which the continuum has forgotten how the grains pressed sideways at rest, γ_c (see
    /// `rest_stress.rs`); nothing is remembered at 0. 0.01. Boxes in beds alone remember.
    pub rest_strain: Option<f64>,
    /// Neither side acts on the other: grains end at a free surface, and the continuum slides on nothing. This is
    /// what a coupling has to do better than.
    pub uncoupled: bool,
}

/// What the defaults are formed from (SI).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Mean diameter of the grains d (m).
    pub diameter: f64,
    /// √(d/g), or without gravity d √(ρ_s/p) (s).
    pub time: f64,
    /// Bulk density ρ (kg/m³).
    pub density: f64,
    /// Normal stiffness k_n of the contact of two mean grains (N/m).
    pub stiffness: f64,
}

impl Scales {
    /// Impedance of a dense packing for compression along the normal, Z = ρ c with ρ c² = 0.33 k_n/d.
    ///
    /// The factor is that of frictional packings under a load of about 10⁻³ k_n/d, from arrival times of
    /// pulses; tests of the crate measure it again. It falls towards isostatic packings.
    pub fn impedance(&self) -> f64 {
        (0.33 * self.density * self.stiffness / self.diameter).sqrt()
    }
}

/// Settings with nothing left out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Resolved {
    /// See [`OverlapSettings`]; of the same names.
    pub cell: f64,
    /// Width of the inner overlap (m).
    pub inner: f64,
    /// Width of the buffer (m).
    pub buffer: f64,
    /// Width of the shell (m).
    pub shell: f64,
    /// Smoothing of stresses.
    pub kernel: StressKernel,
    /// Averaging time of stresses (s).
    pub stress_time: f64,
    /// Relaxation time of velocities (s).
    pub relaxation_time: f64,
    /// Following time (s).
    pub following_time: f64,
    /// Relaxation time of spins (s).
    pub spin_time: f64,
    /// Time step of the continuum (s).
    pub exchange_time: f64,
    /// Time for which forces on the grains are held (s).
    pub load_time: f64,
    /// Impedance (Pa s/m).
    pub impedance: f64,
    /// Motion along the normal.
    pub normal_motion: NormalMotion,
    /// Strain that wipes the stress at rest out.
    pub rest_strain: f64,
    /// Neither side acts on the other.
    pub uncoupled: bool,
}

impl Resolved {
    /// Time in which the impedance stops the shell (s), 3 ρ b/(4 Z): its force Z A v̄ goes to grains in proportion to
    /// q, and v̄ is their mean by q, so that the mass it meets is (Σ q)²/Σ (q²/m) = 3 ρ A b/4.
    pub fn stopping_time(&self, density: f64) -> f64 {
        0.75 * density * self.shell / self.impedance
    }

    /// Steps of the grains for which loads are held, for a time step (s).
    pub fn steps_of_loads(&self, timestep: f64) -> u64 {
        (self.load_time / timestep).round().max(1.0) as u64
    }

    /// Loads until an exchange, for a time step (s).
    pub(super) fn loads_of_exchange(&self, timestep: f64) -> u64 {
        let load_time = self.steps_of_loads(timestep) as f64 * timestep;
        (self.exchange_time / load_time).round().max(1.0) as u64
    }

    /// Whether what acts on the shell of a flat edge stays out of the stresses that the continuum is given there: they are means over
    /// a cell about faces, of which the last lies a cell within m, widened by the kernel; the shell begins `buffer` − `shell`
    /// beyond m.
    pub(super) fn check_layers(&self) -> Result<(), OverlapError> {
        let room = self.buffer - self.shell;
        let slack = 1e-9 * self.cell;
        check(
            "shell",
            self.shell,
            room >= self.cell - slack,
            "at most the buffer's width less a cell",
        )?;
        match self.kernel {
            StressKernel::Layer => Ok(()),
            StressKernel::Lucy(half_width) => check(
                "kernel.lucy",
                half_width,
                half_width <= room + 0.5 * self.cell + slack,
                "at most the buffer's width less the shell's and half a cell more, for no force on the shell to reach the stresses",
            ),
        }
    }
}

impl OverlapSettings {
    /// Fills in what is left out, for a continuum whose far end is free or not, and checks the rest.
    ///
    /// # Errors
    /// The first number out of range, by name.
    pub fn resolve(&self, scales: &Scales, free: bool) -> Result<Resolved, OverlapError> {
        for (key, value) in [
            ("diameter", scales.diameter),
            ("time", scales.time),
            ("density", scales.density),
            ("stiffness", scales.stiffness),
        ] {
            check(key, value, value > 0.0, "positive")?;
        }
        let (d, t) = (scales.diameter, scales.time);
        let mut resolved = Resolved {
            cell: self.cell.unwrap_or(d),
            inner: self.inner.unwrap_or(3.0 * d),
            buffer: self.buffer.unwrap_or(3.0 * d),
            shell: self.shell.unwrap_or(2.0 * d),
            kernel: self.kernel,
            stress_time: self.stress_time.unwrap_or(0.5 * t),
            relaxation_time: self.relaxation_time.unwrap_or(t),
            following_time: self.following_time.unwrap_or(t),
            spin_time: self.spin_time.unwrap_or(t),
            exchange_time: self.exchange_time.unwrap_or(0.2 * t),
            load_time: 0.0,
            impedance: match self.impedance {
                _ if self.uncoupled => 0.0,
                given => given.unwrap_or(scales.impedance()),
            },
            normal_motion: self.normal_motion.unwrap_or(if free {
                NormalMotion::Riding
            } else {
                NormalMotion::Held
            }),
            rest_strain: self.rest_strain.unwrap_or(REST_STRAIN),
            uncoupled: self.uncoupled,
        };
        let r = &resolved;
        for (key, value) in [
            ("cell", r.cell),
            ("inner", r.inner),
            ("buffer", r.buffer),
            ("shell", r.shell),
            ("stress_time", r.stress_time),
            ("relaxation_time", r.relaxation_time),
            ("following_time", r.following_time),
            ("spin_time", r.spin_time),
            ("exchange_time", r.exchange_time),
        ] {
            check(key, value, value > 0.0, "positive")?;
        }
        check(
            "rest_strain",
            r.rest_strain,
            r.rest_strain >= 0.0,
            "at least 0",
        )?;
        check(
            "impedance",
            r.impedance,
            r.impedance >= 0.0,
            "at least 0 Pa s/m",
        )?;
        check(
            "shell",
            r.shell,
            r.shell <= r.buffer,
            "at most the buffer's width",
        )?;
        check(
            "cell",
            r.cell,
            r.cell <= r.inner && r.cell <= r.buffer,
            "at most the widths of inner overlap and buffer",
        )?;
        if let StressKernel::Lucy(half_width) = r.kernel {
            check(
                "kernel.lucy",
                half_width,
                half_width > 0.0 && half_width <= r.inner,
                "positive and at most the inner overlap's width",
            )?;
        }
        let stopping = resolved.stopping_time(scales.density);
        let held = (0.01 * t).min(0.3 * stopping).min(resolved.exchange_time);
        resolved.load_time = self.load_time.unwrap_or(held);
        let load_time = resolved.load_time;
        check("load_time", load_time, load_time > 0.0, "positive")?;
        check(
            "load_time",
            load_time,
            load_time <= resolved.exchange_time,
            "at most the time step of the continuum",
        )?;
        // From twice of it on the shell is thrown back by more than it came with.
        check(
            "load_time",
            load_time,
            load_time <= stopping,
            "at most the time in which the impedance stops the shell, 3 ρ b/(4 Z)",
        )?;
        Ok(resolved)
    }
}

pub(super) fn check(
    key: &'static str,
    value: f64,
    holds: bool,
    allowed: &'static str,
) -> Result<(), OverlapError> {
    if holds && value.is_finite() {
        Ok(())
    } else {
        Err(OverlapError::OutOfRange {
            key,
            value,
            allowed,
        })
    }
}
