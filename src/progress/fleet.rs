//! The progress of a fleet: a bar for every worker and one for all on a terminal, a line now and then elsewhere.

use super::{PAUSE, Verbosity};
use crate::error::{counted, visible};
use crate::fleet::{Ending, RobotRecord, Watcher};
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Watches a fleet.
pub struct FleetProgress {
    verbosity: Verbosity,
    total: usize,
    begun: Instant,
    bars: Option<Bars>,
    state: Mutex<State>,
}

struct Bars {
    all: MultiProgress,
    workers: Vec<ProgressBar>,
    total: ProgressBar,
}

struct State {
    names: Vec<String>,
    over: usize,
    fresh: usize,
    bad: usize,
    printed: Instant,
}

impl FleetProgress {
    /// One bar for `total` robots and a line for each worker.
    pub(crate) fn new(verbosity: Verbosity, workers: usize, total: usize) -> Self {
        let terminal = verbosity == Verbosity::Normal && std::io::stderr().is_terminal();
        let bars = terminal.then(|| {
            let all = MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(8));
            let spinner = ProgressStyle::with_template("  {prefix} {spinner} {msg} ({elapsed})");
            let spinner = spinner.unwrap_or_else(|_| ProgressStyle::default_spinner());
            let workers = (0..workers).map(|worker| {
                let bar = all.add(ProgressBar::new_spinner().with_style(spinner.clone()));
                bar.set_prefix(format!("worker {worker}"));
                bar.enable_steady_tick(Duration::from_millis(150));
                bar
            });
            let workers = workers.collect();
            let style = ProgressStyle::with_template(if total == 1 {
                "{wide_bar} {human_pos}/{human_len} robot, {msg}"
            } else {
                "{wide_bar} {human_pos}/{human_len} robots, {msg}"
            });
            let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
            let total = all.add(ProgressBar::new(total as u64).with_style(style));
            Bars {
                all,
                workers,
                total,
            }
        });
        let now = Instant::now();
        let state = State {
            names: vec![String::new(); workers],
            over: 0,
            fresh: 0,
            bad: 0,
            printed: now,
        };
        Self {
            verbosity,
            total,
            begun: now,
            bars,
            state: Mutex::new(state),
        }
    }

    /// Takes the bars away.
    pub(crate) fn finish(&self) {
        if let Some(bars) = &self.bars {
            bars.workers.iter().for_each(ProgressBar::finish_and_clear);
            bars.total.finish_and_clear();
        }
    }

    /// A line for the person.
    pub(crate) fn say(&self, line: &str) {
        if self.verbosity == Verbosity::Normal {
            self.print(line);
        }
    }

    /// How many of the robots are recorded, where others compute them.
    pub(crate) fn count(&self, over: usize, bad: usize) {
        let mut state = self.state();
        state.fresh += over.saturating_sub(state.over);
        (state.over, state.bad) = (over, bad);
        self.show(state);
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
    fn print(&self, line: &str) {
        // A reader that has gone away is no fault.
        let write = || drop(writeln!(std::io::stderr(), "{line}"));
        match &self.bars {
            Some(bars) => bars.all.suspend(write),
            None => write(),
        }
    }

    fn show(&self, mut state: MutexGuard<'_, State>) {
        let minutes = self.begun.elapsed().as_secs_f64() / 60.0;
        let rate = state.fresh as f64 / minutes.max(1e-9);
        let left = self.total.saturating_sub(state.over) as f64 / rate.max(1e-9);
        let bad = if state.bad > 0 {
            format!("; {} not done", state.bad)
        } else {
            String::new()
        };
        let pace = match (state.fresh, state.over) {
            (0, over) if over == self.total => "all recorded before".to_string(),
            (0, _) => "no new one yet".into(),
            (_, over) if over == self.total => format!("{rate:.0} a minute"),
            _ => format!("{rate:.0} a minute, about {} left", duration(left * 60.0)),
        };
        if let Some(bars) = &self.bars {
            bars.total.set_position(state.over as u64);
            bars.total.set_message(format!("{pace}{bad}"));
        } else if state.printed.elapsed() >= PAUSE || state.over == self.total {
            state.printed = Instant::now();
            let line = format!(
                "{}/{}, {pace}{bad}",
                state.over,
                counted(self.total, "robot")
            );
            drop(state);
            self.say(&line);
        }
    }
}

/// `45 s`, `12 min`, `3.4 h`.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

impl Watcher for FleetProgress {
    fn begins(&self, worker: usize, robot: &str) {
        let robot = visible(robot);
        if let Some(bar) = self.bars.as_ref().and_then(|bars| bars.workers.get(worker)) {
            bar.reset_elapsed();
            bar.set_message(robot.clone());
        }
        if let Some(name) = self.state().names.get_mut(worker) {
            *name = robot;
        }
    }
    fn stage(&self, worker: usize, stage: &str) {
        if let Some(bar) = self.bars.as_ref().and_then(|bars| bars.workers.get(worker)) {
            let name = self.state().names.get(worker).cloned().unwrap_or_default();
            bar.set_message(format!("{name}: {stage}"));
        }
    }
    fn ends(&self, _worker: usize, record: &RobotRecord, fresh: bool) {
        let mut state = self.state();
        state.over += 1;
        state.fresh += usize::from(fresh);
        if record.ending != Ending::Done {
            state.bad += 1;
        }
        self.show(state);
        if record.ending != Ending::Done && fresh {
            let reason = record
                .reason
                .as_deref()
                .and_then(|reason| reason.lines().next())
                .unwrap_or_default();
            self.say(&format!(
                "{}: {}: {}",
                visible(&record.robot),
                record.ending.name(),
                visible(reason)
            ));
        }
    }
}
