//! Where the quantities of a row live in its list of numbers and of texts: one after another, as the recording declares them.

use crate::observation::{DeclaredColumn, KINDS, MeasurementKind, Part};
use crate::table::recording_columns;
use std::ops::Range;

/// The layout of a row, of a robot with so many joints.
pub(super) struct Slots {
    columns: Vec<(&'static DeclaredColumn, Range<usize>)>,
    texts: Vec<&'static str>,
    /// Numbers in a row.
    pub count: usize,
    pub time: usize,
    pub q: Range<usize>,
    pub velocity: Range<usize>,
    /// The places of a measured point.
    pub point: Range<usize>,
    /// What each kind of measurement takes.
    pub kinds: Vec<KindSlots>,
}

/// Where a kind's numbers are.
pub(super) struct KindSlots {
    pub kind: &'static dyn MeasurementKind,
    pub values: Vec<usize>,
    pub sigma: Vec<usize>,
    /// Whether each reading needs its standard deviation.
    pub own_sigma: bool,
    /// Among the row's texts: what the target was brought to, of a kind that reads nothing.
    pub name: Option<usize>,
}

impl Slots {
    pub(super) fn new(joints: usize) -> Self {
        let mut count = 0;
        let place = |column: &'static DeclaredColumn| {
            let first = count;
            count += column.numbers(joints);
            (column, first..count)
        };
        let columns: Vec<(&'static DeclaredColumn, Range<usize>)> =
            recording_columns().map(place).collect();
        let texts =
            recording_columns().filter(|column| column.is_text() && column.setting != "point_id");
        let mut slots = Self {
            texts: texts.map(|column| column.setting).collect(),
            columns,
            count,
            time: 0,
            q: 0..0,
            velocity: 0..0,
            point: 0..0,
            kinds: Vec::new(),
        };
        (slots.time, slots.q, slots.velocity) =
            (slots.of("time").start, slots.of("q"), slots.of("velocity"));
        slots.point = slots.of("x").start..slots.of("z").end;
        let part = |kind: &dyn MeasurementKind, part: Part| -> Vec<usize> {
            kind.columns(part)
                .flat_map(|column| slots.of(column.setting).take(column.stored.len()))
                .collect()
        };
        let name = |kind: &dyn MeasurementKind| {
            let own = kind.telling().next().filter(|_| kind.is_brought())?;
            slots
                .texts
                .iter()
                .position(|setting| *setting == own.setting)
        };
        let kinds = KINDS.iter().map(|kind| KindSlots {
            kind: *kind,
            values: part(*kind, Part::Value),
            sigma: part(*kind, Part::Sigma),
            own_sigma: kind.about().own_sigma,
            name: name(*kind),
        });
        slots.kinds = kinds.collect();
        slots
    }
    /// The places of a setting's numbers.
    pub(super) fn of(&self, setting: &str) -> Range<usize> {
        let found = self
            .columns
            .iter()
            .find(|(column, _)| column.setting == setting);
        found.map_or(0..0, |(_, places)| places.clone())
    }
    /// All columns with numbers, and their places.
    pub(super) fn numbers(&self) -> impl Iterator<Item = &(&'static DeclaredColumn, Range<usize>)> {
        self.columns.iter().filter(|(_, places)| !places.is_empty())
    }
    /// Settings of the texts of a row beside its id.
    pub(super) fn texts(&self) -> &[&'static str] {
        &self.texts
    }
}
