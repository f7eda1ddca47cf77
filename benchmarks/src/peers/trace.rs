//! What one run of one code leaves: states, loop time, version.

use super::case::State;
use serde::Serialize;

/// What was read from one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Trace {
    /// What the code calls itself.
    pub version: String,
    /// States in order of steps.
    pub states: Vec<State>,
    /// Steps on the clock.
    pub steps: u64,
    /// Wall time of these steps (s).
    pub wall: f64,
    /// CPU time of these steps, all threads (s); none where it could not be told from start-up.
    pub cpu: Option<f64>,
}

impl Trace {
    /// The state after a step.
    pub fn state(&self, step: u64) -> Option<&State> {
        self.states.iter().find(|s| s.step == step)
    }
}

/// Reads the lines that our own runs and the Python-driven codes print:
/// `version …`, `state <step> <kinetic> <height>`, `loop <steps> <wall> <cpu or ->`.
///
/// # Errors
/// Says which line is missing or malformed.
pub fn parse_lines(output: &str) -> Result<Trace, String> {
    let mut trace = Trace::default();
    for line in output.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |k: usize| -> Result<f64, String> {
            let word = words.get(k).ok_or(format!("too short a line: {line}"))?;
            word.parse()
                .map_err(|_| format!("{word} is not a number: {line}"))
        };
        match words.first() {
            Some(&"version") => trace.version = words[1..].join(" "),
            Some(&"state") => trace.states.push(State {
                step: number(1)? as u64,
                kinetic: number(2)?,
                height: number(3)?,
            }),
            Some(&"loop") => {
                trace.steps = number(1)? as u64;
                trace.wall = number(2)?;
                trace.cpu = number(3).ok();
            }
            _ => {}
        }
    }
    finished(trace)
}

/// A trace that has its loop time and states, or what it lacks.
pub fn finished(trace: Trace) -> Result<Trace, String> {
    if trace.steps == 0 || trace.wall <= 0.0 {
        return Err("no loop time in the output".into());
    }
    if trace.states.is_empty() {
        return Err("no kinetic energy in the output".into());
    }
    Ok(trace)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_among_others() {
        let text = "hello\nversion X 1.2\nstate 200 4866.27 16.9\nloop 800 2.5 2.4\nbye\n";
        let trace = parse_lines(text).unwrap();
        assert_eq!(trace.version, "X 1.2");
        assert_eq!((trace.steps, trace.wall, trace.cpu), (800, 2.5, Some(2.4)));
        assert_eq!(trace.state(200).unwrap().kinetic, 4866.27);
        assert!(trace.state(100).is_none());
        assert_eq!(
            parse_lines("state 1 1 1\nloop 8 2.5 -\n").unwrap().cpu,
            None
        );
    }

    #[test]
    fn what_is_missing_is_said() {
        assert!(
            parse_lines("state 1 2 3\n")
                .unwrap_err()
                .contains("loop time")
        );
        assert!(
            parse_lines("loop 8 2.5 -\n")
                .unwrap_err()
                .contains("kinetic")
        );
        assert!(parse_lines("state 1 two 3\n").unwrap_err().contains("two"));
    }
}
