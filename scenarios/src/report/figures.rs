//! Figures and notes that a run names in its summary.

use super::Record;
use super::page::figure;
use super::plot::{Mark, Plot};
use crate::summary::{Figure, Summary};
use base64::Engine;
use maud::{Markup, html};

const WIDTH: u32 = 560;
const HEIGHT: u32 = 400;

/// All figures of a run, pictures last.
pub fn figures(record: &Record) -> Markup {
    let all = &record.summary.figures;
    let (pictures, curves): (Vec<&Figure>, Vec<&Figure>) = all
        .iter()
        .partition(|f| matches!(f, Figure::Picture { .. }));
    html! {
        @if !curves.is_empty() {
            h2 { "In numbers" }
            div.figures { @for one in curves { (draw(record, one)) } }
        }
        @if !pictures.is_empty() {
            h2 { "In pictures" }
            div.figures { @for one in pictures { (draw(record, one)) } }
        }
    }
}

fn draw(record: &Record, of: &Figure) -> Markup {
    match of {
        Figure::Curves {
            table,
            x: [x, x_label],
            y_label,
            y,
            log,
            caption,
        } => {
            let Some(table) = record.table(table) else {
                return html! {};
            };
            let mut plot = Plot::new(x_label, y_label);
            for (k, [column, label]) in y.iter().enumerate() {
                let label = if y.len() > 1 { label } else { "" };
                plot = plot.with(label, Mark::Line, k, table.pairs(x, column));
            }
            (plot.x_log, plot.y_log) = (*log, *log);
            figure(&plot.svg(WIDTH, HEIGHT), caption)
        }
        Figure::Picture { file, caption } => {
            let Ok(bytes) = std::fs::read(record.path.join(file)) else {
                return html! {};
            };
            let data = base64::engine::general_purpose::STANDARD.encode(bytes);
            let kind = if file.ends_with(".gif") { "gif" } else { "png" };
            html! {
                figure {
                    img style="max-width:100%" alt=(caption) src=(format!("data:image/{kind};base64,{data}"));
                    figcaption { (caption) }
                }
            }
        }
    }
}

/// How the grains were put in place.
pub fn preparation(summary: &Summary) -> Markup {
    html! {
        @if !summary.preparation.is_empty() {
            h2 { "How the grains were put in place" }
            div.wide {
                table {
                    tr { th.text { "step" } th.text { "what it achieved, against what was asked for" } }
                    @for note in &summary.preparation {
                        tr {
                            td { (note.step) }
                            td.text.wrap { @for line in note.text.lines() { (line) br; } }
                        }
                    }
                }
            }
        }
    }
}
