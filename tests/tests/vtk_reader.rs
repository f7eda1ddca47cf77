//! The series that runs leave, opened by VTK's own reader.
//!
//! Needs Python with VTK (PyPI `vtk`): that of `COLLUVIUM_VTK_PYTHON`, of the system, or one that the test
//! installs beside the build. Where none can be had, only our own reader looks at the files.

#![allow(clippy::unwrap_used)]

use colluvium::frames;
use colluvium::vtkhdf;
use colluvium_dem::{
    ContactLaw, Domain, Grain, Hooke, Setup, Simulation, Snapshot, TangentialSpring, Threads, Wall,
};
use nalgebra::Vector3;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// Prints, for every step of a series, time, points, cells and the sums of all arrays.
const READER: &str = r#"
import sys
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.util.numpy_support import vtk_to_numpy
reader = vtkHDFReader()
reader.SetFileName(sys.argv[1])
reader.UpdateInformation()
steps = reader.GetNumberOfSteps()
for step in range(steps):
    reader.SetStep(step)
    reader.Update()
    data = reader.GetOutput()
    points = vtk_to_numpy(data.GetPoints().GetData()).sum()
    print("step", reader.GetTimeValue(), data.GetNumberOfPoints(), data.GetNumberOfCells(), repr(float(points)))
    for of in (data.GetPointData(), data.GetCellData()):
        for k in range(of.GetNumberOfArrays()):
            array = of.GetArray(k)
            print(array.GetName(), array.GetNumberOfTuples(), repr(float(vtk_to_numpy(array).sum())))
"#;

fn has_vtk(python: &Path) -> bool {
    let asked = Command::new(python)
        .args(["-c", "import vtkmodules.vtkIOHDF"])
        .output();
    asked.is_ok_and(|out| out.status.success())
}

/// A Python with VTK.
fn python() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("COLLUVIUM_VTK_PYTHON") {
        let given = PathBuf::from(given);
        assert!(
            has_vtk(&given),
            "COLLUVIUM_VTK_PYTHON: {} has no vtk",
            given.display()
        );
        return Some(given);
    }
    let own = Path::new(env!("CARGO_TARGET_TMPDIR")).join("vtk");
    let installed = own.join("bin/python");
    let known = [PathBuf::from("python3"), installed.clone()];
    if let Some(python) = known.into_iter().find(|python| has_vtk(python)) {
        return Some(python);
    }
    let run = |program: &Path, arguments: &[&str]| {
        let done = Command::new(program).args(arguments).output();
        done.is_ok_and(|out| out.status.success())
    };
    let folder = own.to_str()?;
    let made = run(Path::new("python3"), &["-m", "venv", folder])
        && run(&installed, &["-m", "pip", "install", "--quiet", "vtk>=9.3"]);
    (made && has_vtk(&installed)).then_some(installed)
}

/// Grains that fall on a floor, some of them bonded.
fn rain() -> Simulation {
    let mut grains = Vec::new();
    for k in 0..60_u32 {
        let cell = Vector3::new(f64::from(k % 4), f64::from(k / 4 % 4), f64::from(k / 16));
        let mut grain = Grain::at_rest(1.02 * (cell + Vector3::repeat(0.5)), 0.5, 2000.0);
        grain.velocity = Vector3::new(0.0, 0.1 * f64::from(k % 3), -1.0);
        grains.push(grain);
    }
    let law = ContactLaw::linear(
        Hooke::matched(1e6, 0.6),
        TangentialSpring::matched(2.0 / 7.0, 0.6, 0.5),
        None,
    );
    let setup = Setup {
        domain: Domain {
            lower: Vector3::zeros(),
            upper: Vector3::new(4.08, 4.08, 20.0),
            periodic: [true, true, false],
        },
        gravity: Vector3::new(0.0, 0.0, -9.81),
        law: law.into(),
        grains,
        walls: vec![Wall::plane(Vector3::zeros(), Vector3::z())],
        bodies: Vec::new(),
        timestep: 1e-4,
        threads: Threads::Serial,
    };
    Simulation::new(setup).unwrap()
}

/// What the reader should print for a frame.
fn expected(frame: &vtkhdf::Frame) -> Vec<(String, f64, f64)> {
    let fields = frame.fields.iter().map(|field| {
        let (count, sum) = match &field.values {
            vtkhdf::Values::Scalars(values) => (values.len(), values.iter().sum()),
            vtkhdf::Values::Vectors(values) => (values.len(), values.iter().flatten().sum()),
            vtkhdf::Values::Counts(values) => (values.len(), values.iter().sum::<i64>() as f64),
        };
        (field.name.clone(), count as f64, sum)
    });
    fields.collect()
}

fn check(python: &Path, path: &Path, frames: &[vtkhdf::Frame]) {
    let out = Command::new(python)
        .arg("-c")
        .arg(READER)
        .arg(path)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&out.stdout);
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let steps: Vec<&str> = text.split("step ").skip(1).collect();
    assert_eq!(steps.len(), frames.len(), "{text}");
    for (step, frame) in steps.into_iter().zip(frames) {
        let mut lines = step.lines();
        let head: Vec<f64> = lines
            .next()
            .unwrap()
            .split(' ')
            .map(|x| x.parse().unwrap())
            .collect();
        let points_each = match frame.cells {
            vtkhdf::Cells::Points => 1,
            vtkhdf::Cells::Lines => 2,
            vtkhdf::Cells::Quadrilaterals => 4,
        };
        let cells = frame.points.len() / points_each;
        let sum: f64 = frame.points.iter().flatten().sum();
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (1.0 + b.abs());
        assert_eq!(
            head[..3],
            [frame.time, frame.points.len() as f64, cells as f64]
        );
        assert!(close(head[3], sum), "points: {} against {sum}", head[3]);
        let read: Vec<Vec<&str>> = lines.map(|line| line.split(' ').collect()).collect();
        let expected = expected(frame);
        assert_eq!(read.len(), expected.len(), "{text}");
        for (name, count, sum) in expected {
            let line = read.iter().find(|line| line[0] == name).unwrap();
            assert_eq!(line[1].parse::<f64>().unwrap(), count, "{name}");
            assert!(
                close(line[2].parse().unwrap(), sum),
                "{name}: {} against {sum}",
                line[2]
            );
        }
    }
}

/// A child process inherits the locks of HDF5 files that are open in its parent: one test at a time.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

#[test]
fn vtk_reads_grains_and_contacts_through_time() {
    let _alone = ONE_AT_A_TIME.lock();
    let folder = tempfile::tempdir().unwrap();
    let mut rain = rain();
    let mut snapshot = Snapshot::default();
    let mut series = [Vec::new(), Vec::new()];
    for _ in 0..4 {
        rain.snapshot(&mut snapshot);
        series[0].push(frames::grains(&snapshot, &rain.clusters()));
        series[1].push(frames::contacts(&snapshot));
        rain.advance(700).unwrap();
    }
    assert!(
        series[1][0].points.len() < series[1][3].points.len(),
        "contacts come about"
    );
    let python = python();
    for (name, frames) in frames::SERIES.into_iter().zip(&series) {
        let path = folder.path().join(format!("{name}.vtkhdf"));
        vtkhdf::write(&path, frames.iter().cloned().map(Ok)).unwrap();
        match &python {
            Some(python) => check(python, &path, frames),
            None => eprintln!("{name}: no Python with VTK here, and none could be installed"),
        }
    }
}

/// Cells of a continuum: quadrilaterals whose number changes from step to step.
#[test]
fn vtk_reads_quadrilaterals_through_time() {
    let _alone = ONE_AT_A_TIME.lock();
    let folder = tempfile::tempdir().unwrap();
    let frame = |time: f64, cells: u32| {
        let corners = |k: u32| {
            let x = f64::from(k) + time;
            [
                [x, 0.0, 0.0],
                [x + 1.0, 0.0, 0.0],
                [x + 1.0, 0.0, 0.5],
                [x, 0.0, 0.5],
            ]
        };
        let numbers = || (0..cells).map(f64::from);
        let field = |name: &str, values| vtkhdf::Field {
            name: name.into(),
            unit: "1".into(),
            values,
        };
        vtkhdf::Frame {
            time,
            cells: vtkhdf::Cells::Quadrilaterals,
            points: (0..cells).flat_map(corners).collect(),
            fields: vec![
                field(
                    "pressure",
                    vtkhdf::Values::Scalars(numbers().map(|k| k * k).collect()),
                ),
                field(
                    "velocity",
                    vtkhdf::Values::Vectors(numbers().map(|k| [k, 0.5, -time]).collect()),
                ),
                field(
                    "flows",
                    vtkhdf::Values::Counts((0..i64::from(cells)).collect()),
                ),
            ],
        }
    };
    let frames = [frame(0.0, 3), frame(0.25, 5), frame(0.5, 2)];
    let path = folder.path().join("fields.vtkhdf");
    vtkhdf::write(&path, frames.iter().cloned().map(Ok)).unwrap();
    let read = vtkhdf::read_series(&path).unwrap();
    assert_eq!(read.len(), 3);
    assert!(
        read.iter()
            .zip(&frames)
            .all(|(a, b)| a.points == b.points && a.cells == b.cells)
    );
    match python() {
        Some(python) => check(&python, &path, &frames),
        None => eprintln!("no Python with VTK here, and none could be installed"),
    }
}

#[test]
fn frames_of_a_run_are_joined_and_single_ones_go() {
    let _alone = ONE_AT_A_TIME.lock();
    let folder = tempfile::tempdir().unwrap();
    let frames = frames::Frames::new(folder.path(), 100, 4);
    let mut rain = rain();
    let mut snapshot = Snapshot::default();
    frames.take(&mut rain, &mut snapshot).unwrap();
    while let Some(next) = frames.next(rain.steps_done()) {
        rain.advance(next - rain.steps_done()).unwrap();
        frames.take(&mut rain, &mut snapshot).unwrap();
    }
    let single = folder.path().join(frames::FOLDER);
    assert_eq!(std::fs::read_dir(&single).unwrap().count(), 10);
    // A frame that was lost is said by name, and what there is stays.
    let third = single.join("grains_000000000050.vtkhdf");
    let kept = std::fs::read(&third).unwrap();
    std::fs::write(&third, &kept[..kept.len() / 2]).unwrap();
    let error = frames.join(rain.steps_done()).unwrap_err().to_string();
    assert!(error.contains("grains_000000000050"), "{error}");
    assert_eq!(std::fs::read_dir(&single).unwrap().count(), 10);
    std::fs::write(&third, kept).unwrap();
    frames.join(rain.steps_done()).unwrap();
    assert_eq!(std::fs::read_dir(&single).unwrap().count(), 10);
    frames::remove(folder.path()).unwrap();
    assert!(!single.exists());
    assert!(folder.path().join("contacts.vtkhdf").exists());
}
