//! Plots as SVG, to be set into a page whose style sheet gives them ink and paper.

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Colours that read on white and on near-black paper, and apart for the colour-blind
/// (after Okabe & Ito, with lightness in the middle).
const PALETTE: [RGBColor; 7] = [
    RGBColor(0x1f, 0x7a, 0xc4),
    RGBColor(0xd9, 0x5f, 0x1e),
    RGBColor(0x12, 0x96, 0x6f),
    RGBColor(0xb8, 0x56, 0x9a),
    RGBColor(0xc2, 0x8e, 0x0e),
    RGBColor(0x4b, 0xa5, 0xd8),
    RGBColor(0x80, 0x80, 0x80),
];
/// The style sheet replaces this colour by the page's ink.
const INK: RGBColor = RGBColor(0, 0, 0);
const FONT: &str = "sans-serif";

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line through all points.
    Line,
    /// A dashed line.
    Dashes,
    /// Dots.
    Dots,
    /// Large rings, to stand out among dots.
    Rings,
}

/// One curve.
#[derive(Clone, Debug)]
pub struct Series {
    /// Text in the legend.
    pub label: String,
    /// How it is drawn.
    pub mark: Mark,
    /// Index into the palette.
    pub colour: usize,
    /// Points.
    pub points: Vec<(f64, f64)>,
    /// Half lengths of vertical error bars; empty for none.
    pub errors: Vec<f64>,
}

/// The area between two curves.
#[derive(Clone, Debug)]
pub struct Band {
    /// Index into the palette.
    pub colour: usize,
    /// Points (x, low, high).
    pub points: Vec<(f64, f64, f64)>,
}

/// A plot with labelled axes.
#[derive(Clone, Debug, Default)]
pub struct Plot {
    /// Label of the horizontal axis, with unit.
    pub x_label: String,
    /// Label of the vertical axis, with unit.
    pub y_label: String,
    /// Logarithmic horizontal axis.
    pub x_log: bool,
    /// Logarithmic vertical axis.
    pub y_log: bool,
    /// The vertical axis starts at zero.
    pub from_zero: bool,
    /// Curves.
    pub series: Vec<Series>,
    /// Bands behind the curves.
    pub bands: Vec<Band>,
}

impl Plot {
    /// An empty plot.
    pub fn new(x_label: &str, y_label: &str) -> Plot {
        Plot {
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            ..Plot::default()
        }
    }

    /// With one more curve.
    pub fn with(mut self, label: &str, mark: Mark, colour: usize, points: Vec<(f64, f64)>) -> Plot {
        self.series.push(Series {
            label: label.to_owned(),
            mark,
            colour,
            points,
            errors: Vec::new(),
        });
        self
    }

    /// With error bars on the last curve.
    pub fn with_errors(mut self, errors: Vec<f64>) -> Plot {
        if let Some(series) = self.series.last_mut() {
            series.errors = errors;
        }
        self
    }

    fn usable(&self, x: f64, y: f64) -> bool {
        x.is_finite() && y.is_finite() && (!self.x_log || x > 0.0) && (!self.y_log || y > 0.0)
    }

    /// Ranges of both axes with a margin; none where there is nothing to draw.
    fn ranges(&self) -> Option<[(f64, f64); 2]> {
        let curves = self.series.iter().flat_map(|s| s.points.iter().copied());
        let edges = self
            .bands
            .iter()
            .flat_map(|band| band.points.iter().flat_map(|p| [(p.0, p.1), (p.0, p.2)]));
        let mut ranges = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        for (x, y) in curves.chain(edges).filter(|(x, y)| self.usable(*x, *y)) {
            for (range, value) in ranges.iter_mut().zip([x, y]) {
                *range = (range.0.min(value), range.1.max(value));
            }
        }
        if ranges[0].0 > ranges[0].1 {
            return None;
        }
        if self.from_zero && !self.y_log {
            ranges[1].0 = ranges[1].0.min(0.0);
        }
        Some([widen(ranges[0], self.x_log), widen(ranges[1], self.y_log)])
    }

    /// The plot as an SVG element.
    pub fn svg(&self, width: u32, height: u32) -> String {
        let mut text = String::new();
        let Some([x, y]) = self.ranges() else {
            return text;
        };
        let drawn = {
            let root = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
            let (xr, yr) = (x.0..x.1, y.0..y.1);
            match (self.x_log, self.y_log) {
                (false, false) => self.draw(&root, Even::from(xr), Even::from(yr)),
                (true, false) => self.draw(&root, Decades(xr), Even::from(yr)),
                (false, true) => self.draw(&root, Even::from(xr), Decades(yr)),
                (true, true) => self.draw(&root, Decades(xr), Decades(yr)),
            }
        };
        if drawn.is_err() {
            return String::new();
        }
        // The page scales the picture; a fixed size would overflow narrow windows.
        text.replacen(
            &format!("width=\"{width}\" height=\"{height}\""),
            &format!("role=\"img\" style=\"max-width:{width}px\""),
            1,
        )
    }

    fn draw<'a, X, Y>(
        &self,
        root: &DrawingArea<SVGBackend<'a>, plotters::coord::Shift>,
        x: X,
        y: Y,
    ) -> Result<(), DrawingAreaErrorKind<std::io::Error>>
    where
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut chart = ChartBuilder::on(root)
            .margin(12)
            .x_label_area_size(50)
            .y_label_area_size(72)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(INK.mix(0.12))
            .axis_style(INK.mix(0.6))
            .x_desc(self.x_label.as_str())
            .y_desc(self.y_label.as_str())
            .x_labels(7)
            .y_labels(7)
            .label_style((FONT, 15).into_font().color(&INK))
            .axis_desc_style((FONT, 16).into_font().color(&INK))
            .x_label_formatter(&|v| tick(*v))
            .y_label_formatter(&|v| tick(*v))
            .draw()?;
        for band in &self.bands {
            let usable: Vec<_> = band
                .points
                .iter()
                .filter(|p| self.usable(p.0, p.1) && self.usable(p.0, p.2))
                .collect();
            let mut outline: Vec<(f64, f64)> = usable.iter().map(|p| (p.0, p.1)).collect();
            outline.extend(usable.iter().rev().map(|p| (p.0, p.2)));
            chart.draw_series(std::iter::once(Polygon::new(
                outline,
                PALETTE[band.colour % PALETTE.len()].mix(0.18).filled(),
            )))?;
        }
        for series in &self.series {
            let colour = PALETTE[series.colour % PALETTE.len()];
            let points: Vec<(f64, f64)> = series
                .points
                .iter()
                .copied()
                .filter(|p| self.usable(p.0, p.1))
                .collect();
            let stroke = colour.stroke_width(2);
            let entry = match series.mark {
                Mark::Line => chart.draw_series(LineSeries::new(points, stroke))?,
                Mark::Dashes => chart.draw_series(DashedLineSeries::new(points, 7, 5, stroke))?,
                Mark::Rings => chart.draw_series(
                    points
                        .into_iter()
                        .map(|p| Circle::new(p, 7, INK.stroke_width(2))),
                )?,
                Mark::Dots => {
                    for ((x, y), error) in series.points.iter().zip(&series.errors) {
                        let bar = vec![(*x, y - error), (*x, y + error)];
                        if bar.iter().all(|p| self.usable(p.0, p.1)) {
                            let thin = colour.mix(0.55).stroke_width(1);
                            chart.draw_series(std::iter::once(PathElement::new(bar, thin)))?;
                        }
                    }
                    chart.draw_series(
                        points
                            .into_iter()
                            .map(|p| Circle::new(p, 3, colour.filled())),
                    )?
                }
            };
            if !series.label.is_empty() {
                let mark = series.mark;
                entry
                    .label(series.label.as_str())
                    .legend(move |(x, y)| legend(mark, x, y, colour));
            }
        }
        if self.series.iter().any(|s| !s.label.is_empty()) {
            chart
                .configure_series_labels()
                .position(self.free_corner())
                .margin(10)
                .background_style(WHITE.mix(0.8))
                .label_font(
                    (FONT, 15)
                        .into_font()
                        .color(&INK)
                        .pos(Pos::new(HPos::Left, VPos::Center)),
                )
                .draw()?;
        }
        root.present()
    }

    /// The corner with the fewest points, for the legend.
    fn free_corner(&self) -> SeriesLabelPosition {
        let Some([x, y]) = self.ranges() else {
            return SeriesLabelPosition::UpperRight;
        };
        let place = |v: f64, r: (f64, f64), log: bool| {
            if log {
                (v / r.0).ln() / (r.1 / r.0).ln()
            } else {
                (v - r.0) / (r.1 - r.0)
            }
        };
        let mut counts = [0usize; 4];
        for series in &self.series {
            let share = 10_000 / series.points.len().max(1);
            for (px, py) in series.points.iter().filter(|p| self.usable(p.0, p.1)) {
                let (u, v) = (place(*px, x, self.x_log), place(*py, y, self.y_log));
                let right = usize::from(u > 0.5);
                let upper = usize::from(v > 0.5);
                counts[2 * upper + right] += share;
            }
        }
        let corners = [
            (counts[3], SeriesLabelPosition::UpperRight),
            (counts[2], SeriesLabelPosition::UpperLeft),
            (counts[1], SeriesLabelPosition::LowerRight),
            (counts[0], SeriesLabelPosition::LowerLeft),
        ];
        let fewest = corners.iter().map(|c| c.0).min().unwrap_or(0);
        corners
            .into_iter()
            .find(|c| c.0 == fewest)
            .map_or(SeriesLabelPosition::UpperRight, |c| c.1)
    }
}

fn legend<'a>(
    mark: Mark,
    x: i32,
    y: i32,
    colour: RGBColor,
) -> DynElement<'static, SVGBackend<'a>, (i32, i32)> {
    let stroke = colour.stroke_width(2);
    match mark {
        Mark::Line => PathElement::new(vec![(x, y), (x + 20, y)], stroke).into_dyn(),
        Mark::Dashes => {
            let ends = [(x, y), (x + 20, y)].into_iter();
            plotters::element::DashedPathElement::new(ends, 7, 5, stroke).into_dyn()
        }
        Mark::Dots => Circle::new((x + 10, y), 3, colour.filled()).into_dyn(),
        Mark::Rings => Circle::new((x + 10, y), 6, INK.stroke_width(2)).into_dyn(),
    }
}

fn widen(range: (f64, f64), log: bool) -> (f64, f64) {
    let (low, high) = range;
    if log {
        let factor = (high / low).powf(0.06).max(1.3);
        return (low / factor, high * factor);
    }
    let margin = if high > low {
        0.05 * (high - low)
    } else {
        low.abs().max(1e-3)
    };
    let low = if low == 0.0 { 0.0 } else { low - margin };
    (low, high + margin)
}

/// A number on an axis, without needless digits.
fn tick(value: f64) -> String {
    let size = value.abs();
    if size < 1e-12 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&size) {
        return format!("{value:.1e}").replace(".0e", "e");
    }
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A linear axis.
struct Even(RangedCoordf64);

impl From<std::ops::Range<f64>> for Even {
    fn from(range: std::ops::Range<f64>) -> Even {
        Even(range.into())
    }
}

impl Ranged for Even {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;
    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.0.map(value, limit)
    }
    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        self.0.key_points(hint)
    }
    fn range(&self) -> std::ops::Range<f64> {
        self.0.range()
    }
}

/// A logarithmic axis with ticks at 1, 2 and 5 of each decade, or at whole decades if many.
struct Decades(std::ops::Range<f64>);

impl Ranged for Decades {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;
    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (value / self.0.start).ln() / (self.0.end / self.0.start).ln();
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }
    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        let first = self.0.start.log10().floor() as i32;
        let last = self.0.end.log10().ceil() as i32;
        let steps: &[f64] = if last - first > 3 {
            &[1.0]
        } else {
            &[1.0, 2.0, 5.0]
        };
        (first..=last)
            .flat_map(|n| steps.iter().map(move |s| s * 10f64.powi(n)))
            .filter(|v| self.0.contains(v))
            .collect()
    }
    fn range(&self) -> std::ops::Range<f64> {
        self.0.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_lines_bands_and_points_on_both_kinds_of_axes() {
        let points: Vec<(f64, f64)> = (1..50).map(|n| (n as f64, (n * n) as f64)).collect();
        for log in [false, true] {
            let mut plot = Plot::new("time t [s]", "u [m/s]")
                .with("a", Mark::Line, 0, points.clone())
                .with("b", Mark::Dots, 1, points.clone())
                .with_errors(vec![0.5; 49]);
            plot.bands.push(Band {
                colour: 0,
                points: points.iter().map(|p| (p.0, 0.9 * p.1, 1.1 * p.1)).collect(),
            });
            (plot.x_log, plot.y_log) = (log, log);
            let svg = plot.svg(600, 400);
            assert!(svg.starts_with("<svg") && svg.contains("polygon") && svg.contains("circle"));
            assert!(svg.contains("time t [s]"));
        }
    }

    #[test]
    fn nothing_to_draw_gives_nothing() {
        assert!(Plot::new("x", "y").svg(300, 200).is_empty());
    }
}
