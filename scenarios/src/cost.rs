//! What a run costs.

use serde::{Deserialize, Serialize};

/// Cost of a run; rates are per second of wall time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Wall time (s), all parts of a resumed run together.
    pub wall_s: f64,
    /// Threads.
    pub threads: usize,
    /// Steps times all grains, the fixed ones of a base included (as LAMMPS counts atoms), those of
    /// settling a bed included.
    pub grain_steps: u64,
    /// Grain-steps per second.
    pub grain_steps_per_s: f64,
    /// Cells times steps.
    pub cell_steps: u64,
    /// Cell-steps per second.
    pub cell_steps_per_s: f64,
    /// Largest resident memory of the process.
    pub peak_memory_bytes: u64,
}

impl Cost {
    /// Fills in the rates and the memory.
    pub fn measured(wall_s: f64, threads: usize, grain_steps: u64, cell_steps: u64) -> Cost {
        let rate = |steps: u64| {
            if wall_s > 0.0 {
                steps as f64 / wall_s
            } else {
                0.0
            }
        };
        Cost {
            wall_s,
            threads,
            grain_steps,
            grain_steps_per_s: rate(grain_steps),
            cell_steps,
            cell_steps_per_s: rate(cell_steps),
            peak_memory_bytes: peak_memory_bytes(),
        }
    }
}

/// Ticks of a second in which Linux tells the processor time of a process, on every machine that Rust's standard
/// library runs on.
const TICKS: f64 = 100.0;

/// Processor time of this process so far, all threads, user's and system's (s); 0 where the system does not say.
pub fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the program, in brackets, may hold blanks. Behind it the process' state is the first.
    let (_, rest) = stat.rsplit_once(')').unwrap_or_default();
    let ticks = rest.split_whitespace().skip(11).take(2);
    ticks.filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / TICKS
}

/// Largest resident memory so far; 0 where the system does not say.
pub fn peak_memory_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .and_then(|rest| {
            rest.trim()
                .trim_end_matches("kB")
                .trim()
                .parse::<u64>()
                .ok()
        })
        .map_or(0, |kib| kib * 1024)
}
