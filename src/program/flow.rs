//! The order in which the lines of a program may run: which line may follow which, and what is known at each of them.
//!
//! Branches, loops, jumps and calls within a file are followed on every way; where two ways meet, what they know is joined. A routine that
//! sets nothing hands on what its caller knows.

use std::collections::{BTreeMap, BTreeSet};

/// What a line (or a statement) is for the order of execution; names in capitals.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum FlowStep {
    Plain,
    If,
    ElseIf,
    Else,
    EndIf,
    /// A loop whose body may be left out.
    While,
    /// A loop whose body runs at least once.
    Loop,
    /// The loop goes on or ends here.
    EndLoop,
    /// It goes on: only an exit leaves it.
    EndForever,
    Exit,
    Switch,
    Case,
    Default,
    EndSwitch,
    Goto(String),
    Label(String),
    Routine(String),
    EndRoutine,
    Return,
}

/// A line: its step, the routines that it calls, whether it sets something.
#[derive(Debug, Clone)]
pub(super) struct FlowLine {
    pub step: FlowStep,
    pub calls: Vec<String>,
    pub sets: bool,
}

/// Which lines may follow each.
#[derive(Debug)]
pub(super) struct Flow {
    next: Vec<Vec<usize>>,
    entries: Vec<usize>,
}

/// What two ways know, joined.
pub(super) trait JoinedState: Clone + PartialEq {
    fn joined(&self, other: &Self) -> Self;
}

struct Block {
    head: usize,
    begun: FlowStep,
    /// Lines from which its end is reached.
    ends: Vec<usize>,
    /// Whether one of its ways is taken in any case.
    whole: bool,
}

#[derive(Default)]
struct Builder {
    next: Vec<Vec<usize>>,
    /// Lines that the next one follows.
    open: Vec<usize>,
    blocks: Vec<Block>,
    jumps: Vec<(usize, String)>,
    labels: BTreeMap<String, usize>,
    returns: Vec<usize>,
    /// First and last line by name.
    routines: BTreeMap<String, (usize, usize)>,
    inside: Option<(String, usize)>,
}

impl Flow {
    /// The order of the lines of a file; fails at a line whose block does not fit.
    pub fn of(lines: &[FlowLine]) -> Result<Self, usize> {
        let mut builder = Builder {
            next: vec![Vec::new(); lines.len()],
            ..Builder::default()
        };
        for (at, line) in lines.iter().enumerate() {
            builder.line(at, &line.step).ok_or(at)?;
        }
        if let Some(block) = builder.blocks.last() {
            return Err(block.head);
        }
        // The last routine of a piece of a program.
        if let (Some((name, first)), Some(last)) =
            (builder.inside.take(), lines.len().checked_sub(1))
        {
            builder.routines.insert(name, (first, last));
        }
        for (at, label) in std::mem::take(&mut builder.jumps) {
            let to = *builder.labels.get(&label).ok_or(at)?;
            builder.next[at].push(to);
        }
        Ok(builder.with_calls(lines))
    }

    /// What is known before each line runs, none where it is never reached; `step` takes it through a line.
    pub fn states<S: JoinedState>(
        &self,
        start: &S,
        step: impl Fn(usize, &mut S),
    ) -> Vec<Option<S>> {
        let mut states: Vec<Option<S>> = vec![None; self.next.len()];
        let mut waiting: BTreeSet<usize> = BTreeSet::new();
        for entry in &self.entries {
            states[*entry] = Some(start.clone());
            waiting.insert(*entry);
        }
        while let Some(at) = waiting.pop_first() {
            let Some(mut state) = states[at].clone() else {
                continue;
            };
            step(at, &mut state);
            for next in &self.next[at] {
                let known = states[*next].as_ref();
                let joined = known.map_or_else(|| state.clone(), |known| known.joined(&state));
                if states[*next].as_ref() != Some(&joined) {
                    states[*next] = Some(joined);
                    waiting.insert(*next);
                }
            }
        }
        states
    }
}

impl Builder {
    fn link(&mut self, from: &[usize], to: usize) {
        for line in from {
            self.next[*line].push(to);
        }
    }

    /// Adds a line; none where it fits no block.
    fn line(&mut self, at: usize, step: &FlowStep) -> Option<()> {
        match step {
            FlowStep::Else | FlowStep::ElseIf | FlowStep::Case | FlowStep::Default => {
                return self.other_way(at, step);
            }
            FlowStep::Routine(name) => {
                let sound = self.blocks.is_empty() && self.inside.is_none();
                self.inside = Some((name.clone(), at));
                self.open = vec![at];
                return sound.then_some(());
            }
            FlowStep::EndRoutine => {
                let mut from = std::mem::take(&mut self.open);
                from.append(&mut self.returns);
                self.link(&from, at);
                let (name, first) = self.inside.take()?;
                self.routines.insert(name, (first, at));
                return self.blocks.is_empty().then_some(());
            }
            FlowStep::EndIf | FlowStep::EndSwitch => {
                let block = self.blocks.pop()?;
                let fits = matches!(
                    (step, &block.begun),
                    (FlowStep::EndIf, FlowStep::If) | (FlowStep::EndSwitch, FlowStep::Switch)
                );
                self.open.extend(block.ends);
                self.open.extend((!block.whole).then_some(block.head));
                let from = std::mem::take(&mut self.open);
                self.link(&from, at);
                self.open = vec![at];
                return fits.then_some(());
            }
            _ => {}
        }
        let from = std::mem::replace(&mut self.open, vec![at]);
        self.link(&from, at);
        match step {
            FlowStep::If | FlowStep::While | FlowStep::Loop | FlowStep::Switch => {
                self.blocks.push(Block {
                    head: at,
                    begun: step.clone(),
                    ends: Vec::new(),
                    whole: false,
                });
                if *step == FlowStep::Switch {
                    self.open.clear();
                }
            }
            FlowStep::EndLoop | FlowStep::EndForever => {
                let block = self.blocks.pop()?;
                self.next[at].push(block.head);
                if *step == FlowStep::EndForever {
                    self.open.clear();
                }
                self.open
                    .extend((block.begun == FlowStep::While).then_some(block.head));
                self.open.extend(block.ends);
                return matches!(block.begun, FlowStep::While | FlowStep::Loop).then_some(());
            }
            FlowStep::Exit => {
                let of_loop =
                    |block: &&mut Block| matches!(block.begun, FlowStep::While | FlowStep::Loop);
                self.blocks.iter_mut().rev().find(of_loop)?.ends.push(at);
                self.open.clear();
            }
            FlowStep::Goto(label) => {
                self.jumps.push((at, label.clone()));
                self.open.clear();
            }
            FlowStep::Label(label) => drop(self.labels.insert(label.clone(), at)),
            FlowStep::Return => {
                self.returns.push(at);
                self.open.clear();
            }
            _ => {}
        }
        Some(())
    }

    /// `ELSE`, `CASE` and the like: the way before ends, and another one begins at the head of the block.
    fn other_way(&mut self, at: usize, step: &FlowStep) -> Option<()> {
        let block = self.blocks.last_mut()?;
        let fits = matches!(
            (step, &block.begun),
            (FlowStep::Else | FlowStep::ElseIf, FlowStep::If)
                | (FlowStep::Case | FlowStep::Default, FlowStep::Switch)
        );
        block.ends.append(&mut self.open);
        block.whole |= matches!(step, FlowStep::Else | FlowStep::Default);
        self.next[block.head].push(at);
        if *step == FlowStep::ElseIf {
            block.head = at;
        }
        self.open = vec![at];
        fits.then_some(())
    }

    fn with_calls(mut self, lines: &[FlowLine]) -> Flow {
        let mut setters: BTreeSet<&String> = BTreeSet::new();
        loop {
            let sets =
                |line: &FlowLine| line.sets || line.calls.iter().any(|name| setters.contains(name));
            let routines = self.routines.iter();
            let found =
                routines.filter(|(_, (first, last))| lines[*first..=*last].iter().any(sets));
            let found: BTreeSet<&String> = found.map(|(name, _)| name).collect();
            if found.len() == setters.len() {
                break;
            }
            setters = found;
        }
        let mut called: BTreeSet<&String> = BTreeSet::new();
        for (at, line) in lines.iter().enumerate() {
            for name in &line.calls {
                let Some((first, last)) = self.routines.get(name) else {
                    continue;
                };
                called.insert(name);
                if setters.contains(name) {
                    let after = std::mem::take(&mut self.next[at]);
                    self.next[*last].extend(after);
                }
                self.next[at].push(*first);
            }
        }
        // The first routine is the program's own, others may be called from elsewhere where nothing here does.
        let earliest = self.routines.values().map(|(first, _)| *first).min();
        let is_entry =
            |name: &&String, first: usize| !called.contains(name) || Some(first) == earliest;
        let routines = self.routines.iter();
        let entries = routines.filter(|(name, (first, _))| is_entry(name, *first));
        let mut entries: Vec<usize> = entries.map(|(_, (first, _))| *first).collect();
        if !lines.is_empty() && !matches!(lines[0].step, FlowStep::Routine(_)) {
            entries.push(0);
        }
        Flow {
            next: self.next,
            entries,
        }
    }
}
