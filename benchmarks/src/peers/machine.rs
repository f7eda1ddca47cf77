//! The machine a comparison ran on, as far as Linux tells.

use serde::Serialize;
use std::fs::read_to_string;

/// Processor, cores, load.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Model of the processor.
    pub processor: String,
    /// Cores this process may use.
    pub cores: Vec<usize>,
}

impl Machine {
    /// This machine.
    pub fn here() -> Machine {
        let info = read_to_string("/proc/cpuinfo").unwrap_or_default();
        let processor = value(&info, "model name").unwrap_or("unknown processor");
        let status = read_to_string("/proc/self/status").unwrap_or_default();
        let cores = value(&status, "Cpus_allowed_list")
            .map(list)
            .unwrap_or_default();
        let count = std::thread::available_parallelism().map_or(1, usize::from);
        Machine {
            processor: processor.into(),
            cores: if cores.is_empty() {
                (0..count).collect()
            } else {
                cores
            },
        }
    }

    /// The cores that a run on `threads` cores is held on: the last ones, since the first serves most
    /// interrupts.
    pub fn cores_for(&self, threads: usize) -> &[usize] {
        &self.cores[self.cores.len().saturating_sub(threads)..]
    }
}

/// Processes that want a processor, averaged over the last minute; this includes our own.
pub fn load() -> Option<f64> {
    let text = read_to_string("/proc/loadavg").ok()?;
    text.split(' ').next()?.parse().ok()
}

/// Time all threads of this process have spent on processors (s), where Linux tells.
pub fn processor_time() -> Option<f64> {
    let mut sum = 0.0;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        sum += text.split(' ').next()?.parse::<f64>().ok()?;
    }
    Some(sum * 1e-9)
}

/// Resident memory of this process (bytes), now (`VmRSS`) or at most ever (`VmHWM`), where Linux tells.
pub fn memory(key: &str) -> Option<f64> {
    let status = read_to_string("/proc/self/status").ok()?;
    let kilobytes = value(&status, key)?.split(' ').next()?.parse::<f64>();
    Some(kilobytes.ok()? * 1024.0)
}

/// From now on the most memory ever is that from now on.
///
/// # Errors
/// Where this is not Linux.
pub fn begin_peak_of_memory() -> std::io::Result<()> {
    std::fs::write("/proc/self/clear_refs", "5")
}

/// The value of `key : value`.
fn value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let line = text.lines().find(|l| l.starts_with(key))?;
    Some(line.split_once(':')?.1.trim())
}

/// `0-2,5` as numbers.
fn list(text: &str) -> Vec<usize> {
    let part = |p: &str| -> Option<std::ops::RangeInclusive<usize>> {
        let (first, last) = p.split_once('-').unwrap_or((p, p));
        Some(first.parse().ok()?..=last.parse().ok()?)
    };
    text.split(',').filter_map(part).flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn core_lists_are_read() {
        assert_eq!(list("0-2,5"), [0, 1, 2, 5]);
        assert_eq!(
            value("a\t: 1\nmodel name\t: X 2\n", "model name"),
            Some("X 2")
        );
        let machine = Machine {
            processor: String::new(),
            cores: vec![0, 1, 4],
        };
        assert_eq!(machine.cores_for(2), [1, 4]);
        assert_eq!(machine.cores_for(9), [0, 1, 4]);
    }
}
