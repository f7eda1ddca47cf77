//! Progress bars with the time left; silent when stderr is not a terminal.

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::time::Duration;

const TICKS: u64 = 1000;

/// A bar that runs from 0 to 1.
#[derive(Clone, Debug)]
pub struct Bar(ProgressBar);

impl Bar {
    /// A bar on its own.
    pub fn new(label: &str) -> Bar {
        Bar::styled(ProgressBar::new(TICKS), label)
    }

    /// A bar that is not shown.
    pub fn hidden() -> Bar {
        Bar(ProgressBar::hidden())
    }

    fn styled(bar: ProgressBar, label: &str) -> Bar {
        let style = ProgressStyle::with_template(
            "{prefix:<24} {bar:32.cyan/black} {percent:>3} %  {elapsed_precise}  {eta_precise} left  {msg}",
        );
        if let Ok(style) = style {
            bar.set_style(style.progress_chars("━━─"));
        }
        bar.set_prefix(label.to_owned());
        bar.enable_steady_tick(Duration::from_millis(500));
        Bar(bar)
    }

    /// Moves the bar to a fraction between 0 and 1.
    pub fn set(&self, fraction: f64) {
        self.0
            .set_position((fraction.clamp(0.0, 1.0) * TICKS as f64) as u64);
    }

    /// Shows a short text behind the bar.
    pub fn say(&self, text: &str) {
        self.0.set_message(text.to_owned());
    }

    /// Takes the bar away.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }

    /// Leaves the bar full, with a last text.
    pub fn finish(&self, text: &str) {
        self.0.set_position(TICKS);
        self.0.finish_with_message(text.to_owned());
    }
}

/// Bars one below the other.
#[derive(Debug, Default)]
pub struct Bars(MultiProgress);

impl Bars {
    /// Adds a bar at the bottom.
    pub fn add(&self, label: &str) -> Bar {
        Bar::styled(self.0.add(ProgressBar::new(TICKS)), label)
    }
}
