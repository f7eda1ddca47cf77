//! The series that runs leave, opened by VTK's own reader.
//!
//! Needs Python with VTK (PyPI `vtk`): that of `COLLUVIUM_VTK_PYTHON`, of the system, or one that the test
//! installs beside the build. Where none can be had, only our own reader looks at the files.

#![allow(clippy::unwrap_used)]

use colluvium::frames;
use colluvium::run::cylinder;
use colluvium::vtkhdf;
use colluvium_continuum::cylinder_collapse::{CylinderCase, CylinderCollapse};
use colluvium_continuum::free_surface::{Contact, SurfaceOptions};
use colluvium_continuum::rheology::MuI;
use colluvium_dem::{
    Body, Clump, ContactLaw, Domain, Grain, Hooke, Part, Pose, Setup, Simulation, Snapshot,
    TangentialSpring, Threads, Wall,
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// Prints, for every step of a series, time, points, cells, their corners, and lengths, widths and sums of all arrays.
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
    surfaces = hasattr(data, "GetPolys")
    kinds = (data.GetVerts(), data.GetLines(), data.GetPolys()) if surfaces else (data.GetCells(),)
    corners = sum(of.GetNumberOfConnectivityIds() for of in kinds)
    print("step", reader.GetTimeValue(), data.GetNumberOfPoints(), data.GetNumberOfCells(), corners, repr(float(points)))
    for of in (data.GetPointData(), data.GetCellData()):
        for k in range(of.GetNumberOfArrays()):
            array = of.GetArray(k)
            numbers = vtk_to_numpy(array)
            print(array.GetName(), *(numbers.shape + (1,))[:2], repr(float(numbers.sum())))
"#;

/// Prints, for every step of a series, the volume of all cells as VTK computes it, and the mean of the field
/// `pressure` that VTK carries from cells to the points they share.
const MEASURER: &str = r#"
import sys
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
from vtkmodules.vtkFiltersCore import vtkCellDataToPointData
from vtkmodules.util.numpy_support import vtk_to_numpy
reader = vtkHDFReader()
reader.SetFileName(sys.argv[1])
reader.UpdateInformation()
for step in range(reader.GetNumberOfSteps()):
    reader.SetStep(step)
    reader.Update()
    sizes = vtkCellSizeFilter()
    sizes.SetInputData(reader.GetOutput())
    sizes.Update()
    points = vtkCellDataToPointData()
    points.SetInputData(reader.GetOutput())
    points.Update()
    volumes = vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray("Volume"))
    pressure = vtk_to_numpy(points.GetOutput().GetPointData().GetArray("pressure"))
    print(repr(float(volumes.min())), repr(float(volumes.sum())), repr(float(pressure.mean())))
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

/// Grains that fall on a floor.
fn rain() -> Simulation {
    Simulation::new(rain_setup()).unwrap()
}

fn rain_setup() -> Setup {
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
    Setup {
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
    }
}

/// What the reader should print for a frame: names, lengths, widths and sums.
fn expected(frame: &vtkhdf::Frame) -> Vec<(String, usize, usize, f64)> {
    let fields = frame.fields.iter().map(|field| {
        let (count, width, sum) = match &field.values {
            vtkhdf::Values::Scalars(values) => (values.len(), 1, values.iter().sum()),
            vtkhdf::Values::Vectors(values) => (values.len(), 3, values.iter().flatten().sum()),
            vtkhdf::Values::Quaternions(values) => (values.len(), 4, values.iter().flatten().sum()),
            vtkhdf::Values::Counts(values) => (values.len(), 1, values.iter().sum::<i64>() as f64),
        };
        (field.name.clone(), count, width, sum)
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
        let cells = frame.points.len() / frame.cells.points_each();
        let corners = frame.points.len();
        let mut points = frame.points.clone();
        if frame.cells == vtkhdf::Cells::Hexahedra {
            // They share their corners.
            points.sort_by(|a, b| a.partial_cmp(b).unwrap());
            points.dedup();
        }
        let sum: f64 = points.iter().flatten().sum();
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (1.0 + b.abs());
        assert_eq!(
            head[..4],
            [
                frame.time,
                points.len() as f64,
                cells as f64,
                corners as f64
            ]
        );
        assert!(close(head[4], sum), "points: {} against {sum}", head[4]);
        let read: Vec<Vec<&str>> = lines.map(|line| line.split(' ').collect()).collect();
        let expected = expected(frame);
        assert_eq!(read.len(), expected.len(), "{text}");
        for (name, count, width, sum) in expected {
            let line = read.iter().find(|line| line[0] == name).unwrap();
            assert_eq!(line[1..3], [count.to_string(), width.to_string()], "{name}");
            assert!(
                close(line[3].parse().unwrap(), sum),
                "{name}: {} against {sum}",
                line[3]
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

/// Rain in clumps of two and three, with two bodies that turn among them.
fn hail() -> Simulation {
    let mut setup = rain_setup();
    let cuboid = Part::cuboid(Vector3::new(0.5, 0.3, 0.2), 1500.0);
    let ball = Part::sphere(0.3, 900.0).at(Vector3::new(0.0, 0.0, 0.4));
    for (k, parts) in [vec![cuboid], vec![ball]].into_iter().enumerate() {
        let mut body = Body::new(parts);
        body.pose = Pose::at(Vector3::new(1.0 + 2.0 * k as f64, 2.0, 6.0));
        body.spin = Vector3::new(3.0, 2.0, -1.0);
        setup.bodies.push(body);
    }
    let mut hail = Simulation::new(setup).unwrap();
    let clump = |grains: &[u32]| Clump {
        grains: grains.to_vec(),
        mass: None,
    };
    let clumps = [&[7, 6][..], &[20, 21, 25], &[40, 41]].map(clump);
    hail.clump(&clumps).unwrap();
    hail
}

fn quaternions(frame: &vtkhdf::Frame) -> Vec<UnitQuaternion<f64>> {
    let field = frame.fields.iter().find(|f| f.name == "orientation");
    let vtkhdf::Values::Quaternions(values) = &field.unwrap().values else {
        panic!("no quaternions")
    };
    let unit =
        |q: &[f64; 4]| UnitQuaternion::new_unchecked(Quaternion::new(q[0], q[1], q[2], q[3]));
    values.iter().map(unit).collect()
}

/// Places, orientations and velocities in the files are those of rigid bodies: what is on the surface of a body,
/// and the grains of a clump, are carried by them.
#[test]
fn vtk_reads_bodies_and_clumps_through_time() {
    let _alone = ONE_AT_A_TIME.lock();
    let folder = tempfile::tempdir().unwrap();
    let mut hail = hail();
    let total = 240;
    let frames = frames::Frames::new(folder.path(), total, 3).with_rigid(true, true);
    let mut snapshot = Snapshot::default();
    let mut written = [Vec::new(), Vec::new(), Vec::new()];
    loop {
        frames.take(&mut hail, &mut snapshot).unwrap();
        hail.snapshot(&mut snapshot);
        written[0].push(frames::rigid::bodies(&hail, &snapshot));
        written[1].push(frames::rigid::clumps(&mut hail));
        written[2].push(frames::grains(&snapshot, &hail.clusters()));
        let Some(next) = frames.next(hail.steps_done()) else {
            break;
        };
        hail.advance(next - hail.steps_done()).unwrap();
    }
    frames.join(total).unwrap();
    let python = python();
    for (name, frames) in frames::RIGID.into_iter().chain(["grains"]).zip(&written) {
        let path = folder.path().join(format!("{name}.vtkhdf"));
        let read = vtkhdf::read_series(&path).unwrap();
        assert_eq!(read.len(), 4);
        for (read, written) in read.iter().zip(frames) {
            assert_eq!((&read.points, read.cells), (&written.points, written.cells));
        }
        match &python {
            Some(python) => check(python, &path, frames),
            None => eprintln!("{name}: no Python with VTK here, and none could be installed"),
        }
    }
    let [bodies, clumps, grains] = &written;
    let v = |x: &[f64; 3]| Vector3::from(*x);
    // The surface as it was at the start, carried by centre and orientation.
    let (first, last) = (&bodies[0], &bodies[3]);
    let (from, to) = (quaternions(first), quaternions(last));
    let centres = [first, last].map(|frame| frame.vectors("centre").unwrap());
    assert!((v(&centres[1][0]) - v(&centres[0][0])).norm() > 1e-3);
    assert!(from[0].angle_to(&to[0]) > 0.05);
    for (k, point) in last.points.iter().enumerate() {
        let cell = k / 3;
        let arm = from[cell].inverse() * (v(&first.points[k]) - v(&centres[0][cell]));
        let carried = v(&centres[1][cell]) + to[cell] * arm;
        assert!((carried - v(point)).norm() < 1e-12, "corner {k}");
    }
    let numbers = last.counts("body").unwrap();
    assert_eq!((numbers[0], numbers[numbers.len() - 1]), (0, 1));
    // Grains by their clumps, from the first frame to the last.
    let number = grains[3].counts("clump").unwrap();
    let members = number.iter().filter(|&&clump| clump >= 0).count();
    assert_eq!(members, 7);
    let cluster = grains[3].counts("cluster").unwrap();
    assert_eq!((cluster[6], cluster[7], cluster[25]), (6, 6, 20));
    let known = clumps[3].counts("clump").unwrap();
    assert_eq!(known, [7, 20, 40]);
    assert_eq!(clumps[3].counts("grains").unwrap(), [2, 3, 2]);
    let turns = [0, 3].map(|at: usize| quaternions(&clumps[at]));
    let (velocity, spin) = (
        clumps[3].vectors("velocity").unwrap(),
        clumps[3].vectors("spin").unwrap(),
    );
    let own = grains[3].vectors("velocity").unwrap();
    for (k, clump) in number.iter().enumerate().filter(|(_, clump)| **clump >= 0) {
        let at = known.iter().position(|number| number == clump).unwrap();
        let arm = |frame: usize| v(&grains[frame].points[k]) - v(&clumps[frame].points[at]);
        let carried = turns[1][at] * (turns[0][at].inverse() * arm(0));
        assert!((carried - arm(3)).norm() < 1e-12, "grain {k}");
        let moved = v(&velocity[at]) + v(&spin[at]).cross(&arm(3));
        assert!((moved - v(&own[k])).norm() < 1e-12, "grain {k}");
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

/// The cylinder in space that the scene writes: hexahedra that share their corners, as many as hold material at
/// each instant. VTK finds their volume, and carries fields over to the corners.
#[test]
fn vtk_reads_hexahedra_through_time() {
    let _alone = ONE_AT_A_TIME.lock();
    let folder = tempfile::tempdir().unwrap();
    let case = CylinderCase {
        aspect: 1.0,
        height: 0.1,
        gravity: 9.81,
        rheology: MuI::new(0.382, 0.643, 0.279, 0.002, 0.6, 2500.0),
        cells: 9,
        length_scaled: 2.9,
        whole: false,
        floor: Contact::NoSlip,
    };
    let mut collapse = CylinderCollapse::new(&case, &SurfaceOptions::default()).unwrap();
    let frames: Vec<vtkhdf::Frame> = (0..3)
        .map(|nth| {
            for _ in 0..4 * nth {
                collapse.step(1.0).unwrap();
            }
            cylinder::frame(&collapse)
        })
        .collect();
    assert_ne!(frames[0].points.len(), frames[2].points.len());
    let path = folder.path().join("fields.vtkhdf");
    vtkhdf::write(&path, frames.iter().cloned().map(Ok)).unwrap();
    assert_eq!(vtkhdf::read_series(&path).unwrap(), sorted(&frames));
    let Some(python) = python() else {
        eprintln!("no Python with VTK here, and none could be installed");
        return;
    };
    check(&python, &path, &frames);
    let out = Command::new(python)
        .args(["-c", MEASURER])
        .arg(&path)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&out.stdout);
    assert_eq!(
        text.lines().count(),
        3,
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let volume = f64::powi(0.1 * 2.9 / 9.0, 3);
    for (line, frame) in text.lines().zip(&frames) {
        let found: Vec<f64> = line.split(' ').map(|x| x.parse().unwrap()).collect();
        let whole = (frame.points.len() / 8) as f64 * volume;
        assert!((found[0] / volume - 1.0).abs() < 1e-9, "{line}");
        assert!((found[1] / whole - 1.0).abs() < 1e-9, "{line} {whole}");
        // The mean over corners weighs cells by how many others share theirs; it lies between the extremes.
        let pressure = frame.scalars("pressure").unwrap();
        let most = pressure.iter().fold(0.0_f64, |most, p| most.max(*p));
        assert!((0.0..=most).contains(&found[2]), "{line}");
    }
    // At the end of the fall the base carries what stands on it.
    let last = frames[2].scalars("pressure").unwrap();
    let most = last.iter().fold(0.0_f64, |most, p| most.max(*p));
    assert!(
        most > 100.0 && most < 2.0 * 1500.0 * 9.81 * 0.1,
        "{most} Pa"
    );
}

/// Frames with their fields in the order in which files list them.
fn sorted(frames: &[vtkhdf::Frame]) -> Vec<vtkhdf::Frame> {
    let mut sorted = frames.to_vec();
    for frame in &mut sorted {
        frame.fields.sort_by(|a, b| a.name.cmp(&b.name));
    }
    sorted
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
