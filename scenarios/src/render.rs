//! Series of a run as pictures and as an animation (`colluvium render`).
//!
//! Grains are balls coloured by their speed, by what they hang together with or by their clump; bodies are their
//! surfaces; fields of a continuum are its cells coloured by speed, behind the grains where it goes on beside them. All pictures of a run have one frame and one scale of colours.

use crate::failure::Failure;
use crate::frames::{CONTINUUM, FIELDS, RIGID, SERIES};
use crate::report;
use crate::run::world::pictures::canvas::{Ball, Extent, Plate, paint_over};
use crate::run::world::pictures::cells::{self, speed};
use crate::run::world::pictures::{BODY, PLAIN, encode, fastest, palette, speed_colour};
use crate::run_directory::{ANIMATION, SUMMARY, summary_text, write_in_place};
use crate::summary::{Figure, Summary};
use crate::vtkhdf::{self, Cells, Frame};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Folder of the pictures in a run directory.
pub const FOLDER: &str = "animation";
/// Instants from which on a run of grains draws its own animation.
pub const FEWEST: usize = 10;
/// How coarsely the colours of an animation are searched: 1 finest, 30 fastest.
const PALETTE_SEARCH: i32 = 20;
/// Pictures of a second, for the animations that runs draw.
const PER_SECOND: u16 = 10;

/// The axis that is looked along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From the side: y to the left, z up.
    X,
    /// From the front: x to the right, z up.
    Y,
    /// From above: x to the right, y up.
    Z,
}

impl View {
    /// To the right, up, and depth.
    fn axes(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self {
            View::X => [-y, z, x],
            View::Y => [x, z, y],
            View::Z => [x, y, -z],
        }
    }
}

/// What colours mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// Speed.
    Speed,
    /// What hangs together, by bonds or as clumps.
    Cluster,
    /// Clumps.
    Clump,
}

/// How a run is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Direction.
    pub view: View,
    /// Colours.
    pub colour: Colour,
    /// Pictures of a second.
    pub per_second: u16,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            view: View::Y,
            colour: Colour::Speed,
            per_second: PER_SECOND,
        }
    }
}

/// An instant as it is painted.
struct Instant {
    time: f64,
    balls: Vec<Ball>,
    plates: Vec<Plate>,
}

/// Draws the run in a directory; its report shows the animation from then on. Gives the animation's file.
///
/// # Errors
/// Directories without a run or without series, files that cannot be read or written.
pub fn render(directory: &Path, request: &Request) -> Result<PathBuf, Failure> {
    let mut summary = report::read_summary(directory)?;
    let figure = draw(directory, request)?;
    place(&mut summary, figure);
    let write = |name: &str, bytes: &[u8]| {
        let path = directory.join(name);
        write_in_place(&path, bytes)
            .map_err(|error| Failure::Run(format!("cannot write {}: {error}", path.display())))
    };
    write(SUMMARY, summary_text(&summary)?.as_bytes())?;
    report::write_for(&[directory.to_owned()], None)?;
    Ok(directory.join(ANIMATION))
}

/// Draws the run that is about to end, if it has taken enough instants.
///
/// # Errors
/// Files that cannot be read or written.
pub fn render_own(directory: &Path, frames: usize, summary: &mut Summary) -> Result<(), Failure> {
    if frames >= FEWEST {
        place(summary, draw(directory, &Request::default())?);
    }
    Ok(())
}

/// Puts the animation before all other pictures.
fn place(summary: &mut Summary, figure: Figure) {
    let is_animation = |f: &Figure| matches!(f, Figure::Picture { file, .. } if file == ANIMATION);
    summary.figures.retain(|f| !is_animation(f));
    summary.figures.insert(0, figure);
}

/// Writes the pictures and the animation.
fn draw(directory: &Path, request: &Request) -> Result<Figure, Failure> {
    let (path, frames) = series(directory)?;
    let refuse = |why: String| Failure::Input(format!("{}: {why}", path.display()));
    let mut top = 0.0_f64;
    for frame in &frames {
        let speeds = moving_speeds(frame).map_err(refuse)?;
        top = top.max(fastest(speeds.into_iter()));
    }
    let mut extent = Extent::NOTHING;
    let mut instants = Vec::with_capacity(frames.len());
    let bodies = beside(directory, RIGID[0], &path, frames.len())?;
    let continuum = beside(directory, CONTINUUM, &path, frames.len())?;
    for frame in &continuum {
        let speeds = moving_speeds(frame).map_err(refuse)?;
        top = top.max(fastest(speeds.into_iter()));
    }
    for (k, frame) in frames.iter().enumerate() {
        let mut instant = instant(frame, request, top).map_err(refuse)?;
        if let Some(bodies) = bodies.get(k) {
            instant.plates.extend(surfaces(bodies, request.view));
        }
        if let Some(cells) = continuum.get(k) {
            let behind = self::instant(cells, request, top).map_err(refuse)?;
            let farthest = instant.balls.iter().map(|ball| ball.depth + ball.radius);
            let farthest = farthest.fold(0.0, f64::max);
            instant
                .plates
                .extend(cells::behind(behind.plates, farthest));
        }
        extent.reach(&instant.balls, &instant.plates);
        instants.push(instant);
    }
    if instants
        .iter()
        .all(|i| i.balls.is_empty() && i.plates.is_empty())
    {
        return Err(refuse("nothing is in it".into()));
    }
    let failed = |what: &Path, error: String| {
        Failure::Run(format!("cannot write {}: {error}", what.display()))
    };
    let folder = directory.join(FOLDER);
    clear(&folder).map_err(|error| failed(&folder, error.to_string()))?;
    let animation = directory.join(ANIMATION);
    let colours = match request.colour {
        Colour::Speed => format!("speed from 0 (violet) to {top:.3e} m/s (yellow)"),
        Colour::Cluster => "what hangs together".to_owned(),
        Colour::Clump => "clumps, single grains grey".to_owned(),
    };
    let last = instants.last().map_or(0.0, |i| i.time);
    let count = instants.len();
    let mut film = Film::new(request.per_second);
    for (k, instant) in instants.iter().enumerate() {
        let (pixels, size) = paint_over(extent, &instant.balls, &instant.plates, &[]);
        let caption = format!("t = {:.4e} s; {colours}", instant.time);
        let file = folder.join(format!("frame_{k:04}.png"));
        encode(&pixels, size, &caption)
            .map_err(|error| error.to_string())
            .and_then(|png| write_in_place(&file, &png).map_err(|error| error.to_string()))
            .map_err(|error| failed(&file, error))?;
        film.add(&pixels, size, k + 1 == count)
            .map_err(|error| failed(&animation, error.to_string()))?;
    }
    film.bytes()
        .and_then(|bytes| Ok(write_in_place(&animation, &bytes)?))
        .map_err(|error| failed(&animation, error.to_string()))?;
    Ok(Figure::Picture {
        file: ANIMATION.into(),
        caption: format!("{count} instants up to t = {last:.4e} s; {colours}"),
    })
}

/// An animation in the making.
struct Film {
    encoder: Option<gif::Encoder<Vec<u8>>>,
    /// Time of a picture (1/100 s).
    delay: u16,
}

impl Film {
    /// How long the last picture stays (1/100 s).
    const END: u16 = 100;

    fn new(per_second: u16) -> Film {
        Film {
            encoder: None,
            delay: 100 / per_second,
        }
    }

    fn add(
        &mut self,
        pixels: &[u8],
        [width, height]: [usize; 2],
        last: bool,
    ) -> Result<(), gif::EncodingError> {
        // A canvas has at most some 720 pixels along each edge.
        let (width, height) = (width as u16, height as u16);
        let mut encoder = match self.encoder.take() {
            Some(encoder) => encoder,
            None => {
                let mut begun = gif::Encoder::new(Vec::new(), width, height, &[])?;
                begun.set_repeat(gif::Repeat::Infinite)?;
                begun
            }
        };
        let mut frame = gif::Frame::from_rgb_speed(width, height, pixels, PALETTE_SEARCH);
        frame.delay = self.delay + if last { Self::END } else { 0 };
        encoder.write_frame(&frame)?;
        self.encoder = Some(encoder);
        Ok(())
    }

    fn bytes(self) -> Result<Vec<u8>, gif::EncodingError> {
        self.encoder
            .map_or(Ok(Vec::new()), gif::Encoder::into_inner)
    }
}

/// The series of a run that is drawn: grains, or fields where there are no grains.
fn series(directory: &Path) -> Result<(PathBuf, Vec<Frame>), Failure> {
    for name in [SERIES[0], FIELDS] {
        let path = directory.join(format!("{name}.vtkhdf"));
        if path.exists() {
            let frames =
                vtkhdf::read_series(&path).map_err(|error| Failure::Input(error.to_string()))?;
            return Ok((path, frames));
        }
    }
    Err(Failure::Input(format!(
        "{}: holds neither grains.vtkhdf nor fields.vtkhdf; allowed: a run of grains with frames (output.frames > 0), or of a \
         continuum with a free surface",
        directory.display()
    )))
}

/// A series beside the grains of a run with so many instants; none where there is none.
fn beside(
    directory: &Path,
    series: &str,
    grains: &Path,
    instants: usize,
) -> Result<Vec<Frame>, Failure> {
    let path = directory.join(format!("{series}.vtkhdf"));
    if !path.exists() || grains.file_stem().is_none_or(|name| name != SERIES[0]) {
        return Ok(Vec::new());
    }
    let frames = vtkhdf::read_series(&path).map_err(|error| Failure::Input(error.to_string()))?;
    if frames.len() != instants {
        let (own, count) = (path.display(), frames.len());
        let why = format!(
            "{own}: {count} instants, but {} has {instants}",
            grains.display()
        );
        return Err(Failure::Input(why));
    }
    Ok(frames)
}

/// Triangles of bodies as they are painted.
fn surfaces(bodies: &Frame, view: View) -> Vec<Plate> {
    let corners: Vec<[f64; 3]> = bodies.points.iter().map(|&p| view.axes(p)).collect();
    let plate = |&corners: &[[f64; 3]; 3]| Plate {
        corners,
        colour: BODY,
    };
    corners.as_chunks::<3>().0.iter().map(plate).collect()
}

/// Speeds of what may move (m/s).
fn moving_speeds(frame: &Frame) -> Result<Vec<f64>, String> {
    let fixed: Cow<[i64]> = match frame.cells {
        Cells::Points => frame.counts("fixed")?.into(),
        _ => vec![0; frame.vectors("velocity")?.len()].into(),
    };
    let speeds = frame.vectors("velocity")?.iter().map(speed);
    Ok(speeds
        .zip(fixed.iter())
        .filter_map(|(speed, fixed)| (*fixed == 0).then_some(speed))
        .collect())
}

fn instant(frame: &Frame, request: &Request, top: f64) -> Result<Instant, String> {
    let fast = |v: &[f64; 3]| speed_colour(speed(v) / top.max(f64::MIN_POSITIVE));
    let velocity = frame.vectors("velocity")?;
    let (mut balls, mut plates) = (Vec::new(), Vec::new());
    match frame.cells {
        Cells::Points => {
            let (radius, fixed) = (frame.scalars("radius")?, frame.counts("fixed")?);
            let group = match request.colour {
                Colour::Speed => &[],
                Colour::Cluster => frame.counts("cluster")?,
                Colour::Clump => frame.counts("clump")?,
            };
            let colour = |k: usize| match group.get(k) {
                _ if fixed[k] != 0 => PLAIN,
                None => fast(&velocity[k]),
                Some(&number) => u32::try_from(number).map_or(PLAIN, palette),
            };
            let places = frame.points.iter().map(|&p| request.view.axes(p));
            balls.extend(places.enumerate().map(|(k, [right, up, depth])| Ball {
                at: [right, up],
                depth,
                radius: radius[k],
                colour: colour(k),
            }));
        }
        _ => plates = cells::plates(frame, |p| request.view.axes(p), top)?,
    }
    Ok(Instant {
        time: frame.time,
        balls,
        plates,
    })
}

/// An empty folder.
fn clear(folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let own = |name: &str| name.starts_with("frame_") && name.ends_with(".png");
        if entry.file_name().to_str().is_some_and(own) {
            std::fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// Removes the pictures of an earlier run; files of other names stay.
///
/// # Errors
/// Files that cannot be removed.
pub fn remove(directory: &Path) -> std::io::Result<()> {
    let folder = directory.join(FOLDER);
    if !folder.is_dir() {
        return Ok(());
    }
    clear(&folder)?;
    match std::fs::remove_dir(&folder) {
        Err(error) if error.kind() != std::io::ErrorKind::DirectoryNotEmpty => Err(error),
        _ => Ok(()),
    }
}
