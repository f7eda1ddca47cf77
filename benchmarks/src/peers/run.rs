//! Runs one code once: writes what it reads, starts it on its own cores, reads what it leaves.

use super::case::Case;
use super::find::{Code, Found, on_path};
use super::start_files::{Dialect, data_file, table};
use super::trace::{Trace, parse_lines};
use super::{esys, lammps, liggghts, yade};
use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The hidden argument under which this program is its own competitor.
pub const WORKER: &str = "worker";

/// How long a run that is asked to stop may take to do so.
const PATIENCE: Duration = Duration::from_secs(10);

/// Where a run happens.
#[derive(Clone, Debug)]
pub struct Place<'a> {
    /// Folder of its files.
    pub folder: &'a Path,
    /// Cores it is held on; as many as it uses.
    pub cores: &'a [usize],
    /// Seconds after which it is stopped.
    pub limit: u64,
}

/// The law a code solves, in words.
pub fn law(code: Code, case: &Case) -> String {
    match code {
        Code::Colluvium => super::ours::law_in_words(case),
        Code::Lammps => lammps::law(case),
        Code::Liggghts => liggghts::law(case),
        Code::Yade => yade::law(case),
        Code::Esys => esys::law(case),
    }
}

/// Why a code cannot run a case at all, if it cannot.
pub fn unfit(code: Code, case: &Case) -> Option<&'static str> {
    match code {
        Code::Yade => yade::unfit(case),
        Code::Esys => esys::unfit(case),
        Code::Colluvium | Code::Lammps | Code::Liggghts => None,
    }
}

/// Writes start state and deck of a case for a code.
///
/// # Errors
/// Which file could not be written.
pub fn prepare(code: Code, case: &Case, folder: &Path) -> Result<(), String> {
    let named = |path: &Path, e: std::io::Error| format!("{}: {e}", path.display());
    fs::create_dir_all(folder).map_err(|e| named(folder, e))?;
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).map_err(|e| named(&path, e))
    };
    match code {
        Code::Colluvium => Ok(()),
        Code::Lammps => {
            write("start.data", &data_file(case, Dialect::Lammps))?;
            write("in.deck", &lammps::deck(case))
        }
        Code::Liggghts => {
            write("start.data", &data_file(case, Dialect::Liggghts))?;
            write("in.deck", &liggghts::deck(case))
        }
        Code::Yade | Code::Esys => {
            let json = serde_json::to_string_pretty(case).map_err(|e| format!("case.json: {e}"))?;
            write("case.json", &json)?;
            write("start.csv", &table(case))?;
            let script = if code == Code::Yade {
                yade::SCRIPT
            } else {
                esys::SCRIPT
            };
            write("run.py", script)
        }
    }
}

/// Runs a prepared case once; `finer` divides our own step.
///
/// # Errors
/// What went wrong and where the output is.
pub fn run(found: &Found, case: &Case, place: &Place, finer: u64) -> Result<Trace, String> {
    let code = found.code;
    let threads = place.cores.len();
    let stamps = place.folder.join("cpu.txt");
    // A stamp file of an earlier run would be appended to.
    let _ = fs::remove_file(&stamps);
    let log = place.folder.join("out.txt");
    let mut command = command(found, case, place, finer)?;
    wait(&mut command, &log, place.limit).map_err(|e| format!("{e} (see {})", log.display()))?;
    let text = fs::read_to_string(&log).map_err(|e| format!("{}: {e}", log.display()))?;
    let trace = match code {
        Code::Lammps | Code::Liggghts => {
            let stamps = fs::read_to_string(&stamps).unwrap_or_default();
            lammps::parse_log(&text, &stamps, threads == 1)
        }
        _ => parse_lines(&text),
    };
    trace.map_err(|e| format!("{e} (see {})", log.display()))
}

fn command(found: &Found, case: &Case, place: &Place, finer: u64) -> Result<Command, String> {
    let threads = place.cores.len();
    let ranks = match found.code {
        Code::Lammps | Code::Liggghts => threads,
        // A master that waits, and a worker for each core.
        Code::Esys => threads + 1,
        _ => 1,
    };
    let cores: Vec<String> = place.cores.iter().map(usize::to_string).collect();
    let mut words: Vec<std::ffi::OsString> = Vec::new();
    if on_path("taskset").is_some() {
        words.extend(["taskset", "-c", &cores.join(",")].map(Into::into));
    }
    if ranks > 1 {
        let launcher = found
            .launcher
            .as_ref()
            .ok_or("no mpirun: openmpi-bin is missing")?;
        words.push(launcher.into());
        if found.code != Code::Lammps {
            words.extend(["--bind-to", "none", "--oversubscribe"].map(Into::into));
        }
        words.extend(["-np".into(), ranks.to_string().into()]);
    }
    words.push((&found.program).into());
    match found.code {
        Code::Colluvium => words.extend([
            WORKER.into(),
            case.name.into(),
            finer.to_string().into(),
            threads.to_string().into(),
        ]),
        Code::Lammps | Code::Liggghts => {
            words.extend(["-in", "in.deck", "-log", "none"].map(Into::into))
        }
        Code::Yade => words.extend([
            "-n".into(),
            "-x".into(),
            format!("-j{threads}").into(),
            "run.py".into(),
        ]),
        Code::Esys => words.push("run.py".into()),
    }
    let mut command = Command::new(&words[0]);
    command
        .args(&words[1..])
        .current_dir(place.folder)
        .env(
            "OMP_NUM_THREADS",
            if found.code == Code::Yade { threads } else { 1 }.to_string(),
        )
        .env("RAYON_NUM_THREADS", threads.to_string())
        .env("PEER_CORES", threads.to_string())
        // Open MPI refuses to start as root (as in a container) unless told twice.
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    if let Some(libraries) = &found.libraries {
        command.env("LD_LIBRARY_PATH", libraries);
    }
    Ok(command)
}

/// Ends a run. Asked first, and only then forced: mpirun takes its ranks with it only if it is asked.
fn stop(child: &mut Child) {
    // It may have ended in between, so none of this can fail in a way that matters.
    let _ = Command::new("kill").arg(child.id().to_string()).status();
    let asked = Instant::now();
    while asked.elapsed() < PATIENCE {
        if !matches!(child.try_wait(), Ok(None)) {
            return;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let _ = child.kill();
    let _ = child.wait();
}

/// Runs a command to its end, its output in a file; stops it after `limit` seconds.
fn wait(command: &mut Command, log: &Path, limit: u64) -> Result<(), String> {
    let file = File::create(log).map_err(|e| format!("{}: {e}", log.display()))?;
    let errors = file
        .try_clone()
        .map_err(|e| format!("{}: {e}", log.display()))?;
    let started = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(file)
        .stderr(errors)
        .spawn()
        .map_err(|e| format!("cannot start: {e}"))?;
    loop {
        match child.try_wait().map_err(|e| e.to_string())? {
            Some(status) if status.success() => return Ok(()),
            Some(status) => return Err(format!("ended with {status}")),
            None if started.elapsed() > Duration::from_secs(limit) => {
                stop(&mut child);
                return Err(format!("stopped after {limit} s"));
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_end_is_stopped_and_said_so() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("out.txt");
        let error = wait(Command::new("sleep").arg("100"), &log, 0).unwrap_err();
        assert!(error.contains("stopped after 0 s"), "{error}");
        let error = wait(&mut Command::new("/nonexistent/code"), &log, 1).unwrap_err();
        assert!(error.contains("cannot start"), "{error}");
    }
}
