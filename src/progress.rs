//! Progress on stderr: bars on a terminal, plain lines elsewhere. The only file that knows a terminal.

mod fleet;

pub use fleet::FleetProgress;

use crate::error::counted;
use crate::pipeline::{Observer, StageReport, StageStatus};
use crate::summary::folded;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::collections::BTreeSet;
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How much is shown while a run works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verbosity {
    /// Besides, what stages note while they work, rows of tables, and what was warned of when a cached stage ran.
    Detailed,
    /// A line a stage, bars on a terminal, warnings once.
    Normal,
    /// Warnings only.
    Quiet,
    /// Nothing: who runs it says what came of it.
    Silent,
}

/// Time between two plain lines about the same work; a log file has no use for more.
const PAUSE: Duration = Duration::from_secs(5);

/// Watches a run.
pub(crate) struct Progress {
    verbosity: Verbosity,
    /// Width of the stages' ids.
    width: usize,
    /// Width of the terminal, if it is one.
    columns: Option<usize>,
    state: Mutex<State>,
}

struct State {
    /// On a terminal only.
    bar: Option<ProgressBar>,
    what: String,
    unit: String,
    total: Option<u64>,
    begun: Instant,
    printed: Instant,
    /// When the stage is expected to end, from its time in the run before.
    over: Option<Instant>,
    /// What was warned of: several stages say the same of one recording.
    warned: BTreeSet<String>,
}

impl Progress {
    /// Progress on stderr; `width` is that of the longest stage id.
    pub(crate) fn new(verbosity: Verbosity, width: usize) -> Self {
        let terminal = matches!(verbosity, Verbosity::Detailed | Verbosity::Normal)
            && std::io::stderr().is_terminal();
        let bar = terminal
            .then(|| ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10)));
        let now = Instant::now();
        let state = State {
            bar,
            what: String::new(),
            unit: String::new(),
            total: None,
            begun: now,
            printed: now,
            over: None,
            warned: BTreeSet::new(),
        };
        let columns = std::io::stderr()
            .is_terminal()
            .then(terminal_size::terminal_size)
            .flatten()
            .map(|(width, _)| usize::from(width.0));
        Self {
            verbosity,
            width,
            columns,
            state: Mutex::new(state),
        }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.state().bar {
            bar.finish_and_clear();
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
    fn line(&self, id: &str, text: &str) {
        if matches!(self.verbosity, Verbosity::Detailed | Verbosity::Normal) {
            self.print(id, text);
        }
    }
    fn detail(&self, id: &str, text: &str) {
        if self.verbosity == Verbosity::Detailed {
            self.print(id, text);
        }
    }
    fn print(&self, id: &str, text: &str) {
        if self.verbosity == Verbosity::Silent {
            return;
        }
        // A reader that has gone away is no fault.
        let text = format!("{id:width$}  {text}", width = self.width);
        let text = self
            .columns
            .map_or_else(|| text.clone() + "\n", |columns| folded(&text, columns));
        let write = || drop(std::io::stderr().write_all(text.as_bytes()));
        match &self.state().bar {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }
}

/// Work that is shorter than this has no time that is left.
const LONG: Duration = Duration::from_secs(5);

/// The time until then, in words; nothing where the run before says nothing, or was shorter.
fn left(over: Option<Instant>) -> String {
    let left = over.map(|over| over.saturating_duration_since(Instant::now()).as_secs());
    match left {
        Some(seconds) if seconds > 0 => format!(", about {seconds} s left by the run before"),
        _ => String::new(),
    }
}

fn spinner(over: Option<Instant>) -> ProgressStyle {
    let left = move |_: &ProgressState, out: &mut dyn std::fmt::Write| {
        // A line that cannot be written is no fault.
        let _ = out.write_str(&left(over));
    };
    ProgressStyle::with_template("{prefix}  {spinner} {msg} ({elapsed}{left})")
        .unwrap_or_else(|_| ProgressStyle::default_spinner())
        .with_key("left", left)
}
fn bar_of(unit: &str) -> ProgressStyle {
    // Braces in a template are its own.
    let unit = unit.replace(['{', '}'], "");
    let template = format!(
        "{{prefix}}  {{wide_bar}} {{human_pos}}/{{human_len}} {unit}, {{per_sec}}, {{eta}} left  {{msg}}"
    );
    ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

impl Observer for Progress {
    fn stage_begins(&self, id: &str, _uses: &str, reason: &str) {
        self.detail(id, &format!("runs ({reason})"));
        let mut state = self.state();
        state.over = None;
        if let Some(bar) = &state.bar {
            bar.reset();
            bar.set_style(spinner(None));
            bar.set_prefix(format!("{id:width$}", width = self.width));
            bar.set_message("");
            bar.enable_steady_tick(Duration::from_millis(120));
        }
    }

    fn expects(&self, _id: &str, seconds: f64) {
        let lasts = Duration::try_from_secs_f64(seconds).unwrap_or_default();
        if lasts < LONG {
            return;
        }
        let mut state = self.state();
        state.over = Instant::now().checked_add(lasts);
        if let Some(bar) = &state.bar {
            bar.set_style(spinner(state.over));
        }
    }

    fn waits(&self, id: &str, line: &str) {
        self.line(id, line);
    }

    fn stage_ends(&self, report: &StageReport) {
        if let Some(bar) = &self.state().bar {
            bar.disable_steady_tick();
            bar.finish_and_clear();
        }
        let rows: Vec<String> = report
            .outputs
            .iter()
            .map(|output| format!("{} {}", output.port, output.table.rows))
            .collect();
        let rows = if self.verbosity == Verbosity::Detailed {
            format!(" (rows: {})", rows.join(", "))
        } else {
            String::new()
        };
        if report.status != StageStatus::Cached {
            return self.line(
                &report.id,
                &format!(
                    "done in {:.1} s{rows}",
                    report.wall_seconds.unwrap_or_default()
                ),
            );
        }
        // What the stage warned of was said when it ran, and still holds.
        let warnings = report.warnings.len();
        match (self.verbosity, warnings) {
            (_, 0) => self.line(&report.id, &format!("cached{rows}")),
            (Verbosity::Detailed, _) => {
                let warnings: String = report
                    .warnings
                    .iter()
                    .map(|line| format!("; warning: {line}"))
                    .collect();
                self.print(&report.id, &format!("cached{rows}{warnings}"));
            }
            _ => self.print(
                &report.id,
                &format!(
                    "cached; {} as said when it ran: calib show HEAD/{}",
                    counted(warnings, "warning"),
                    report.id
                ),
            ),
        }
    }

    fn begin(&self, id: &str, what: &str, total: Option<u64>, unit: &str) {
        let mut state = self.state();
        (state.what, state.unit, state.total) = (what.into(), unit.into(), total);
        (state.begun, state.printed) = (Instant::now(), Instant::now());
        if let Some(bar) = &state.bar {
            bar.reset();
            bar.set_prefix(format!("{id:width$}", width = self.width));
            match total {
                Some(total) => {
                    bar.set_length(total);
                    bar.set_style(bar_of(unit));
                }
                None => bar.set_style(spinner(state.over)),
            }
            bar.set_message(what.to_string());
        }
    }

    fn advance(&self, id: &str, done: u64, message: &str) {
        let mut state = self.state();
        let text = if message.is_empty() {
            state.what.clone()
        } else {
            format!("{}: {message}", state.what)
        };
        if let Some(bar) = &state.bar {
            bar.set_position(done);
            bar.set_message(match state.total {
                Some(_) => text,
                None => format!("{text}, {done} {}", state.unit),
            });
            return;
        }
        if state.printed.elapsed() < PAUSE {
            return;
        }
        state.printed = Instant::now();
        let line = match state.total {
            Some(total) if total > 0 && done > 0 => {
                let spent = state.begun.elapsed().as_secs_f64();
                let left = spent / done as f64 * total.saturating_sub(done) as f64;
                format!(
                    "  {text}, {done}/{total} {}, about {left:.0} s left",
                    state.unit
                )
            }
            _ => {
                let spent = state.begun.elapsed().as_secs();
                let left = left(state.over);
                format!("  {text}, {done} {}, {spent} s so far{left}", state.unit)
            }
        };
        drop(state);
        self.line(id, &line);
    }

    fn note(&self, id: &str, line: &str) {
        if self.verbosity == Verbosity::Detailed {
            self.print(id, &format!("  {line}"));
            self.state().printed = Instant::now();
        }
    }
    fn warn(&self, id: &str, line: &str) {
        let first = self.state().warned.insert(line.into());
        if first || self.verbosity == Verbosity::Detailed {
            self.print(id, &format!("warning: {line}"));
        }
    }
}
