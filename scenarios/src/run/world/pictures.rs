//! Pictures of grains and bodies in the run directory, `view_*.png`: balls and triangles in a parallel
//! projection.

pub(crate) mod canvas;
pub(crate) mod cells;
mod grounds;

use super::recipe::Recipe;
use crate::body_facets;
use crate::failure::Failure;
use crate::run_directory::RunDirectory;
use crate::scene::world::Materials;
use crate::summary::Figure;
use crate::vtkhdf::Frame;
use canvas::{Ball, Plate};
use colluvium_dem::{Body, Simulation, Snapshot};
use grounds::Ground;
use nalgebra::Vector3;

/// Colours of kinds and clusters, apart for the colour-blind (after Okabe & Ito).
pub const PALETTE: [[u8; 3]; 8] = [
    [0x4b, 0xa5, 0xd8],
    [0xd9, 0x5f, 0x1e],
    [0x12, 0x96, 0x6f],
    [0xe3, 0xb5, 0x05],
    [0xb8, 0x56, 0x9a],
    [0x1f, 0x7a, 0xc4],
    [0x8c, 0x56, 0x4b],
    [0x60, 0x60, 0x80],
];
/// Colour of grains without a cluster, and of fixed ones.
pub const PLAIN: [u8; 3] = [0xb4, 0xb4, 0xb4];
/// Colour of bodies.
pub const BODY: [u8; 3] = [0xe8, 0xe6, 0xe0];
/// Colours of rising speed (after viridis).
const SPEEDS: [[f64; 3]; 5] = [
    [68.0, 1.0, 84.0],
    [59.0, 82.0, 139.0],
    [33.0, 145.0, 140.0],
    [94.0, 201.0, 98.0],
    [253.0, 231.0, 37.0],
];

/// Corners of what is round of a body.
const ROUND: usize = 48;

/// What colours mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Colouring {
    Kinds,
    Speeds,
    Clumps,
    Groups,
}

impl Colouring {
    fn word(self) -> &'static str {
        match self {
            Colouring::Kinds => "kinds",
            Colouring::Speeds => "speeds",
            Colouring::Clumps => "clumps",
            Colouring::Groups => "groups",
        }
    }
}

/// The pictures of a run.
#[derive(Debug)]
pub struct Pictures<'a> {
    view: [Vector3<f64>; 2],
    kinds: &'a [String],
    between: u64,
    bodies: &'a [(String, Body)],
    directory: &'a RunDirectory,
}

impl<'a> Pictures<'a> {
    /// Pictures of a recipe's run.
    pub fn new(
        recipe: &dyn Recipe,
        materials: &'a Materials,
        bodies: &'a [(String, Body)],
        directory: &'a RunDirectory,
    ) -> Pictures<'a> {
        Pictures {
            view: recipe.view(),
            kinds: &materials.names,
            between: recipe.keys().output.pictures,
            bodies,
            directory,
        }
    }

    /// The first step after `done` at which a picture is taken.
    pub fn next(&self, done: u64, steps: u64) -> u64 {
        let parts = self.between + 1;
        let step = |k: u64| (u128::from(k) * u128::from(steps) / u128::from(parts)) as u64;
        (1..=self.between)
            .map(step)
            .find(|&s| s > done)
            .unwrap_or(u64::MAX)
    }

    /// Whether a picture is due at this step.
    pub fn is_due(&self, step: u64, steps: u64) -> bool {
        step == 0 || (step < steps && self.next(step - 1, steps) == step)
    }

    /// Takes a picture where one is due at this step; `continuum` are cells that stand behind the grains.
    pub fn take(
        &self,
        simulation: &mut Simulation,
        continuum: Option<&Frame>,
        step: u64,
        steps: u64,
    ) -> Result<(), Failure> {
        if step == 0 {
            let first = if self.kinds.len() > 1 {
                Colouring::Kinds
            } else {
                Colouring::Speeds
            };
            self.draw(simulation, first, &[], continuum)?;
            return self.draw_clumps(simulation);
        }
        if self.is_due(step, steps) {
            self.draw(simulation, Colouring::Speeds, &[], continuum)?;
        }
        Ok(())
    }

    /// Takes the pictures of the end; `groups` say what hangs together.
    pub fn last(
        &self,
        simulation: &mut Simulation,
        step: u64,
        groups: Option<&[Option<usize>]>,
        continuum: Option<&Frame>,
    ) -> Result<(), Failure> {
        if step > 0 {
            self.draw(simulation, Colouring::Speeds, &[], continuum)?;
            self.draw_clumps(simulation)?;
        }
        match groups {
            Some(groups) => self.draw(simulation, Colouring::Groups, groups, None),
            None => Ok(()),
        }
    }

    fn draw_clumps(&self, simulation: &mut Simulation) -> Result<(), Failure> {
        if simulation.clump_count() == 0 {
            return Ok(());
        }
        self.draw(simulation, Colouring::Clumps, &[], None)
    }

    fn draw(
        &self,
        simulation: &mut Simulation,
        colouring: Colouring,
        groups: &[Option<usize>],
        continuum: Option<&Frame>,
    ) -> Result<(), Failure> {
        let [away, up] = self.view;
        let right = away.cross(&up);
        let grains = simulation.grain_list();
        if grains.is_empty() && self.bodies.is_empty() {
            return Ok(());
        }
        let moving = grains.iter().filter(|g| !g.fixed);
        let cells = continuum.map_or(Ok(&[][..]), |frame| frame.vectors("velocity"));
        let no_picture =
            |why: String| Failure::Run(format!("cannot make a picture of the continuum: {why}"));
        let cells = cells.map_err(no_picture)?.iter().map(cells::speed);
        let fastest = fastest(moving.map(|g| g.velocity.norm()).chain(cells));
        let clumps = match colouring {
            Colouring::Clumps => clumps_by_number(simulation),
            _ => Vec::new(),
        };
        let colour = |k: usize, grain: &colluvium_dem::Grain| match colouring {
            _ if grain.fixed => PLAIN,
            Colouring::Clumps => clumps.get(k).copied().flatten().map_or(PLAIN, palette),
            Colouring::Kinds => PALETTE[usize::from(grain.material) % PALETTE.len()],
            Colouring::Speeds => {
                speed_colour(grain.velocity.norm() / fastest.max(f64::MIN_POSITIVE))
            }
            Colouring::Groups => match groups.get(k).copied().flatten() {
                Some(rank) => PALETTE[rank % PALETTE.len()],
                None => PLAIN,
            },
        };
        let balls: Vec<Ball> = grains
            .iter()
            .enumerate()
            .map(|(k, grain)| Ball {
                at: [grain.position.dot(&right), grain.position.dot(&up)],
                depth: grain.position.dot(&away),
                radius: grain.radius,
                colour: colour(k, grain),
            })
            .collect();
        let grounds = self.grounds(simulation, &balls, [right, up]);
        let mut plates = self.plates(simulation, [right, up, away]);
        if let Some(frame) = continuum {
            let axes = |p: [f64; 3]| [right, up, away].map(|axis| axis.dot(&Vector3::from(p)));
            let farthest = balls.iter().map(|ball| ball.depth + ball.radius);
            let cells = cells::plates(frame, axes, fastest).map_err(no_picture)?;
            plates.extend(cells::behind(cells, farthest.fold(0.0, f64::max)));
        }
        let (pixels, size) = canvas::paint(&balls, &plates, &grounds);
        let text = match colouring {
            Colouring::Kinds => self
                .kinds
                .iter()
                .enumerate()
                .map(|(k, name)| format!("{name}: {}", NAMES[k % NAMES.len()]))
                .collect::<Vec<_>>()
                .join(", "),
            Colouring::Speeds => format!("speed from 0 (violet) to {fastest:.3e} m/s (yellow)"),
            Colouring::Clumps => "clumps, single grains grey".to_owned(),
            Colouring::Groups => "what hangs together, single grains grey".to_owned(),
        };
        let caption = format!("t = {:.4e} s; {text}", simulation.time());
        let name = format!(
            "view_{:012}_{}.png",
            simulation.steps_done(),
            colouring.word()
        );
        let bytes = encode(&pixels, size, &caption)
            .map_err(|error| Failure::Run(format!("cannot make the picture {name}: {error}")))?;
        self.directory.write(&name, &bytes)
    }

    /// Surfaces of the bodies, in the picture's axes.
    fn plates(&self, simulation: &mut Simulation, axes: [Vector3<f64>; 3]) -> Vec<Plate> {
        let plate = |facet: body_facets::Facet| Plate {
            corners: facet.map(|v| axes.map(|axis| v.dot(&axis))),
            colour: BODY,
        };
        let bodies = self.bodies.iter().enumerate();
        bodies
            .flat_map(|(k, (_, body))| body_facets::of(body, &simulation.body(k).pose, ROUND))
            .map(plate)
            .collect()
    }

    /// Walls that are seen from their side, where grains are.
    fn grounds(
        &self,
        simulation: &Simulation,
        balls: &[Ball],
        [right, up]: [Vector3<f64>; 2],
    ) -> Vec<Ground> {
        let ends = balls
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], ball| {
                [low.min(ball.at[0]), high.max(ball.at[0])]
            });
        let axes = [right, up, self.view[0]];
        (0..simulation.wall_count())
            .filter_map(|k| {
                let pose = simulation.wall_pose(k);
                Ground::of(&simulation.wall(k).shape, &pose, axes, ends)
            })
            .collect()
    }

    /// All pictures that were taken, as figures of the report.
    pub fn figures(&self) -> Vec<Figure> {
        let entries = std::fs::read_dir(self.directory.path())
            .into_iter()
            .flatten();
        let mut files: Vec<String> = entries
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .filter(|name| name.starts_with("view_") && name.ends_with(".png"))
            .collect();
        files.sort();
        let figure = |file: String| {
            let bytes = std::fs::read(self.directory.file(&file)).unwrap_or_default();
            Figure::Picture {
                caption: caption(&bytes).unwrap_or_default(),
                file,
            }
        };
        files.into_iter().map(figure).collect()
    }
}

/// Clump of each grain, in the order of the grains' numbers.
fn clumps_by_number(simulation: &mut Simulation) -> Vec<Option<u32>> {
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    seen.grains.sort_by_key(|grain| grain.id);
    seen.grains.iter().map(|grain| grain.clump).collect()
}

/// A colour for a number of a clump or a cluster. These are numbers of first grains, often all multiples of one
/// number, and are strewn over the palette (by the golden ratio, after Knuth).
pub fn palette(number: u32) -> [u8; 3] {
    let strewn = number.wrapping_mul(0x9e37_79b9);
    PALETTE[(strewn >> 29) as usize % PALETTE.len()]
}

/// What the palette's colours are called.
const NAMES: [&str; 8] = [
    "light blue",
    "orange",
    "green",
    "yellow",
    "pink",
    "blue",
    "brown",
    "slate",
];

/// A speed that all but one grain in fifty stay below (m/s).
pub fn fastest(speeds: impl Iterator<Item = f64>) -> f64 {
    let mut speeds: Vec<f64> = speeds.collect();
    speeds.sort_by(f64::total_cmp);
    let at = (speeds.len() * 49 / 50).min(speeds.len().saturating_sub(1));
    speeds.get(at).copied().unwrap_or(0.0)
}

/// Colour of a share of the fastest speed.
pub fn speed_colour(share: f64) -> [u8; 3] {
    let at = share.clamp(0.0, 1.0) * (SPEEDS.len() - 1) as f64;
    let low = (at as usize).min(SPEEDS.len() - 2);
    let part = at - low as f64;
    std::array::from_fn(|c| (SPEEDS[low][c] + part * (SPEEDS[low + 1][c] - SPEEDS[low][c])) as u8)
}

/// Keyword of the caption in a file.
const CAPTION: &str = "Description";

/// A PNG with a caption in it.
pub fn encode(
    pixels: &[u8],
    [width, height]: [usize; 2],
    caption: &str,
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.add_text_chunk(CAPTION.into(), caption.into())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// The caption that a picture carries.
fn caption(bytes: &[u8]) -> Option<String> {
    let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    let reader = decoder.read_info().ok()?;
    let texts = &reader.info().uncompressed_latin1_text;
    let found = texts.iter().find(|text| text.keyword == CAPTION)?;
    Some(found.text.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn captions_stay_with_their_pictures() {
        let bytes = encode(&[0; 12], [2, 2], "t = 1 s").unwrap();
        assert_eq!(caption(&bytes).unwrap(), "t = 1 s");
    }
}
