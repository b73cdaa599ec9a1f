//! `split`: which rows of the recording serve what. Every row belongs to exactly one named set.
//!
//! Rows of one pose, wherever they stand, go to one set, since a pose that was seen in training is no test: those whose joints are as near as
//! encoders repeat, and shots by name (`7_1`, `7_2`). Along a path neighbours know each other just as well, and stretches of it are dealt.
//! What the user states by label, name or number of rows is dealt as stated; a warning says where it tears a pose.

use crate::error::{Error, Place, Result, counted, listed};
use crate::estimate::Units;
use crate::remarks::{copied_rows, copies_remark};
use crate::table::{Recording, Split, SplitRow};
use crate::{Context, Stage, matches};
use calib_foundation::named;
use calib_numerics::robot::Measurements;
use calib_numerics::robot::pose_groups::near;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// How rows are dealt out to sets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "by", rename_all = "snake_case", deny_unknown_fields)]
pub enum SplitBy {
    /// Every n-th pose in the order of recording goes to `set` with all of its rows, the others to `rest`; along a path every n-th stretch.
    Every {
        /// One of how many poses, from 2.
        n: u64,
        /// Which one, from 0 to n - 1; the last if not given.
        #[serde(default)]
        offset: Option<u64>,
        /// The set of every n-th pose.
        #[serde(default = "validate")]
        set: String,
        /// The set of the other rows.
        #[serde(default = "fit")]
        rest: String,
        /// Poses are counted anew for every name in this column, so that each socket, plane, sphere or target gives its share.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        within: Option<NamedColumn>,
    },
    /// Rows with some of the names in a column go to `set`, the others to `rest`: a whole place, target or anchor is left out.
    Named {
        /// The column.
        column: NamedColumn,
        /// Names; a `*` stands for anything, as of all sockets of a plate: `[front/*]`.
        names: Vec<String>,
        /// The set of their rows.
        #[serde(default = "validate")]
        set: String,
        /// The set of the other rows.
        #[serde(default = "fit")]
        rest: String,
    },
    /// Stretches of the recording go to the sets in turn.
    Blocks {
        /// Number of stretches of about equal length.
        #[serde(default)]
        count: Option<u64>,
        /// Rows of a stretch, instead of their number.
        #[serde(default)]
        length: Option<u64>,
        /// Sets in the order in which stretches are dealt to them; a set may occur more than once: `[fit, fit, fit, validate]`.
        sets: Vec<String>,
    },
    /// A fraction of the rows, drawn by the pipeline's seed, goes to `set`, the others to `rest`.
    Random {
        /// Between 0 and 1; to the nearest pose, along a path to the nearest stretch.
        fraction: f64,
        /// The set of the drawn rows.
        #[serde(default = "validate")]
        set: String,
        /// The set of the other rows.
        #[serde(default = "fit")]
        rest: String,
    },
    /// The recording's own `usage` labels.
    Usage {
        /// Set of each label, `{training: fit, test: validate}`; without it the labels are the names of the sets.
        #[serde(default)]
        sets: Option<BTreeMap<String, String>>,
        /// Set of the rows without a label; without it such rows are an error.
        #[serde(default)]
        blank: Option<String>,
    },
    /// The first so many rows, the next so many, and so on, in the order of recording.
    Order {
        /// Sets with their numbers of rows; the last may leave its number out and takes what is left.
        sets: Vec<Stretch>,
    },
}

/// So many rows for one set.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stretch {
    /// Name of the set.
    pub set: String,
    /// Number of rows.
    #[serde(default)]
    pub rows: Option<u64>,
}

fn validate() -> String {
    "validate".into()
}

fn fit() -> String {
    "fit".into()
}

crate::stage! {
    SplitBy, "split", 5, "deals rows out to named sets: every n-th, by name, blocks, random, by usage, by order",
        SplitReads {
            recording: Recording,
        } -> SplitWrites {
            split: Split,
        }
}

impl Stage for SplitBy {
    fn faults(&self, at: &mut Place) {
        for name in self.names() {
            at.must(!name.trim().is_empty(), "a set without a name");
        }
        match self {
            Self::Every { n, offset, .. } => {
                at.at("n").must(*n >= 2, "allowed: 2 and above");
                let possible = offset.is_none_or(|offset| offset < *n);
                at.at("offset")
                    .must(possible, format!("allowed: 0 to {}", n.saturating_sub(1)));
            }
            Self::Named { names, .. } => {
                at.at("names")
                    .must(!names.is_empty(), "name at least one, e.g. [front/*]");
            }
            Self::Blocks {
                count,
                length,
                sets,
            } => {
                at.must(
                    count.is_some() != length.is_some(),
                    "say `count` or `length`, one of them",
                );
                let key = if count.is_some() { "count" } else { "length" };
                at.at(key).must(
                    *count != Some(0) && *length != Some(0),
                    "allowed: 1 and above",
                );
                at.at("sets")
                    .must(!sets.is_empty(), "name at least one set");
            }
            Self::Random { fraction, .. } => {
                at.at("fraction").must(
                    *fraction > 0.0 && *fraction < 1.0,
                    "allowed: above 0 and below 1",
                );
            }
            Self::Usage { sets, .. } => {
                let none = sets.as_ref().is_some_and(BTreeMap::is_empty);
                at.at("sets")
                    .must(!none, "map at least one label, or leave it out");
            }
            Self::Order { sets } => {
                at.at("sets")
                    .must(!sets.is_empty(), "name at least one set");
                for (index, stretch) in sets.iter().enumerate() {
                    let possible = match stretch.rows {
                        Some(rows) => rows > 0,
                        None => index + 1 == sets.len(),
                    };
                    at.at(format!("sets[{index}].rows")).must(
                        possible,
                        "allowed: 1 and above; only the last may leave it out",
                    );
                }
            }
        }
        if let Self::Every { set, rest, .. }
        | Self::Named { set, rest, .. }
        | Self::Random { set, rest, .. } = self
        {
            at.at("rest")
                .must(set != rest, format!("both sets are called `{set}`"));
        }
    }

    fn sets_dealt(&self) -> Option<Vec<String>> {
        if let Self::Usage { sets, blank } = self {
            let sets: BTreeSet<&String> = sets.as_ref()?.values().chain(blank).collect();
            return Some(sets.into_iter().cloned().collect());
        }
        Some(self.names().into_iter().map(Into::into).collect())
    }

    fn run(&self, reads: SplitReads, context: &Context) -> Result<SplitWrites> {
        Error::if_spec(self.check())?;
        let recording = &reads.recording;
        let mut sets = self.deal(recording, context.seed)?;
        let copies = copied_rows(recording);
        for (row, copy) in &copies {
            sets[*copy] = sets[*row].clone();
        }
        context.warn_each(copies_remark(&copies, recording));
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for set in &sets {
            *counts.entry(set).or_default() += 1;
        }
        let names = self.names();
        if let Some(name) = names.iter().find(|name| !counts.contains_key(**name)) {
            return Err(self.empty(name, recording.rows()));
        }
        let all: Vec<String> = counts
            .iter()
            .map(|(set, rows)| format!("{set} {rows}"))
            .collect();
        context.note(format!("rows: {}", all.join(", ")));
        match self.keeps_poses() {
            true => self
                .units(recording)
                .words()
                .into_iter()
                .for_each(|line| context.note(line)),
            false => context.warn_each(torn(recording, &sets)),
        }
        let row = |(row, set): (usize, String)| SplitRow {
            sequence: recording.sequence[row],
            point_id: recording.point_id[row].clone(),
            set,
        };
        Ok(SplitWrites {
            split: Split(sets.into_iter().enumerate().map(row).collect()),
        })
    }
}

impl SplitBy {
    /// Sets that must not stay empty.
    fn names(&self) -> BTreeSet<&str> {
        match self {
            Self::Every { set, rest, .. }
            | Self::Random { set, rest, .. }
            | Self::Named { set, rest, .. } => [set.as_str(), rest].into(),
            Self::Blocks { sets, .. } => sets.iter().map(String::as_str).collect(),
            Self::Usage { .. } => BTreeSet::new(),
            Self::Order { sets } => sets.iter().map(|stretch| stretch.set.as_str()).collect(),
        }
    }

    /// The fault of a set without rows, at the setting that decides how many it gets.
    fn empty(&self, name: &str, rows: usize) -> Error {
        let (setting, advice) = match self {
            Self::Every { offset: None, .. } => ("n", "say a smaller `n`"),
            Self::Every { .. } => ("offset", "say another `offset`, or a smaller `n`"),
            Self::Named { .. } => ("names", "say other `names`"),
            Self::Random { set, .. } if name == set => ("fraction", "say a larger `fraction`"),
            Self::Random { .. } => ("fraction", "say a smaller `fraction`"),
            Self::Blocks { count: Some(_), .. } => {
                ("count", "say a larger `count`, or fewer `sets`")
            }
            Self::Blocks { .. } => ("length", "say a smaller `length`, or fewer `sets`"),
            Self::Order { .. } | Self::Usage { .. } => ("sets", "give it rows, or leave it out"),
        };
        let rows = counted(rows, "row");
        let message = format!("set `{name}` gets none of the {rows}; {advice}");
        Error::data(format!("with.{setting}"), message)
    }

    /// Whether poses are kept together whatever the settings say.
    fn keeps_poses(&self) -> bool {
        matches!(
            self,
            Self::Every { .. } | Self::Random { .. } | Self::Blocks { .. }
        )
    }

    /// What is dealt: poses, whatever the arm carries in them, and stretches of a path.
    fn units(&self, recording: &Recording) -> Units {
        let data = recording.measurements();
        let rows: Vec<usize> = (0..recording.rows()).collect();
        let any = |_, _| true;
        let stretches = match self {
            Self::Every { n, .. } => AT_LEAST * *n as f64,
            Self::Random { fraction, .. } => AT_LEAST / fraction,
            _ => return shots_together(Units::poses(&data, &rows, any), recording, &data),
        };
        let stretches = stretches.ceil().clamp(1.0, rows.len().max(1) as f64) as usize;
        let units = shots_together(Units::of(&data, &rows, stretches, any), recording, &data);
        match units.all.len() {
            // One pose has no other to be held out: what fits it says why that is no geometry, and how the point creeps.
            1 => Units {
                all: rows.into_iter().map(|row| vec![row]).collect(),
                ..Units::default()
            },
            _ => units,
        }
    }

    /// The set of each row.
    fn deal(&self, recording: &Recording, seed: u64) -> Result<Vec<String>> {
        let rows = recording.rows();
        match self {
            Self::Every {
                n,
                offset,
                set,
                rest,
                within,
            } => {
                let offset = offset.unwrap_or(n - 1);
                let names = within.map(|column| column.of(recording, "within"));
                let names = names.transpose()?;
                let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
                let mut dealt = vec![rest.clone(); rows];
                for unit in self.units(recording).all {
                    let name = names.as_ref().map_or("", |names| names[unit[0]]);
                    let count = counts.entry(name).or_default();
                    if *count % n == offset {
                        unit.iter().for_each(|row| dealt[*row].clone_from(set));
                    }
                    *count += 1;
                }
                Ok(dealt)
            }
            Self::Named {
                column,
                names: wanted,
                set,
                rest,
            } => {
                let names = column.of(recording, "column")?;
                let is_unknown =
                    |pattern: &String| !names.iter().any(|name| matches(pattern, name));
                if let Some(k) = wanted.iter().position(is_unknown) {
                    let named = names.iter().copied().filter(|name| !name.is_empty());
                    let there: Vec<&str> = named.collect::<BTreeSet<_>>().into_iter().collect();
                    let message =
                        format!("no row has such a name; there are: {}", there.join(", "));
                    return Err(Error::data(format!("with.names[{k}]"), message));
                }
                let is_wanted = |name: &&str| wanted.iter().any(|pattern| matches(pattern, name));
                let set = |name: &&str| if is_wanted(name) { set } else { rest }.clone();
                Ok(names.iter().map(set).collect())
            }
            Self::Blocks {
                count,
                length,
                sets,
            } => {
                let mut dealt = vec![String::new(); rows];
                for pose in self.units(recording).all {
                    // A pose belongs to the block in which it begins.
                    let block = match (count, length) {
                        (Some(count), _) => {
                            (pose[0] as u128 * u128::from(*count) / rows.max(1) as u128) as usize
                        }
                        (None, length) => pose[0] / length.unwrap_or(1).max(1) as usize,
                    };
                    let set = &sets[block % sets.len()];
                    pose.iter().for_each(|row| dealt[*row].clone_from(set));
                }
                Ok(dealt)
            }
            Self::Random {
                fraction,
                set,
                rest,
            } => {
                let mut units = self.units(recording).all;
                units.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
                let wanted = (fraction * rows as f64).round() as usize;
                let (mut dealt, mut drawn) = (vec![rest.clone(); rows], 0);
                for unit in units {
                    // Half of a unit beyond the wanted number is nearer to it than half of one below.
                    if drawn + unit.len().div_ceil(2) > wanted {
                        continue;
                    }
                    drawn += unit.len();
                    unit.iter().for_each(|row| dealt[*row].clone_from(set));
                }
                Ok(dealt)
            }
            Self::Usage { sets, blank } => by_usage(recording, sets.as_ref(), blank.as_deref()),
            Self::Order { sets } => by_order(rows, sets),
        }
    }
}

fn by_usage(
    recording: &Recording,
    sets: Option<&BTreeMap<String, String>>,
    blank: Option<&str>,
) -> Result<Vec<String>> {
    let labels: BTreeSet<&String> = recording.usage.iter().flatten().collect();
    let found = listed(labels);
    let set = |(usage, row): (&Option<String>, usize)| {
        let point = || recording.point_id.get(row).map_or("", String::as_str);
        match (usage, sets) {
            (Some(label), None) => Ok(label.clone()),
            (Some(label), Some(sets)) => sets.get(label).cloned().ok_or_else(|| {
                let mapped: Vec<&str> = sets.keys().map(String::as_str).collect();
                Error::data(
                    "with.sets",
                    format!("label `{label}` (point `{}`) has no set; mapped: {}; found: {found}", point(), mapped.join(", ")),
                )
            }),
            (None, _) => blank.map(ToString::to_string).ok_or_else(|| {
                let message = format!(
                    "point `{}` has no usage label; found: {found}; allowed: map `usage` in ingest, or say `blank`",
                    point()
                );
                Error::data("with.blank", message)
            }),
        }
    };
    recording.usage.iter().zip(0..).map(set).collect()
}

fn by_order(rows: usize, sets: &[Stretch]) -> Result<Vec<String>> {
    let mut dealt = Vec::with_capacity(rows);
    for (k, stretch) in sets.iter().enumerate() {
        let left = rows - dealt.len();
        let wanted = stretch.rows.map_or(left as u64, |rows| rows);
        if wanted > left as u64 {
            let (set, wanted) = (&stretch.set, counted(wanted, "row"));
            let message = format!("set `{set}` takes {wanted}, but only {left} of {rows} remain");
            return Err(Error::data(format!("with.sets[{k}].rows"), message));
        }
        dealt.resize(dealt.len() + wanted as usize, stretch.set.clone());
    }
    if dealt.len() < rows {
        let message = format!(
            "the sets take {} of {}; let the last one leave `rows` out, or name one more",
            dealt.len(),
            counted(rows, "row")
        );
        return Err(Error::data("with.sets", message));
    }
    Ok(dealt)
}

/// Stretches of a path that are held out.
const AT_LEAST: f64 = 3.0;
/// Shots that names put together are one pose where joints are closer (0.3 deg in rad; m).
const BY_NAME: f64 = 5.2e-3;
/// Digits of the number of a shot.
const SHOT_DIGITS: usize = 2;

/// The pose in the name of a shot: `7` of `7_2`, `P12` of `P12-3`.
fn pose_named(name: &str) -> Option<&str> {
    let (pose, shot) = name.rsplit_once(['_', '-', '.', '/', ' ', '#'])?;
    let is_number =
        (1..=SHOT_DIGITS).contains(&shot.len()) && shot.bytes().all(|byte| byte.is_ascii_digit());
    (is_number && !pose.is_empty()).then_some(pose)
}

/// Units with those made one that names call shots of a pose, where joints do not speak against it.
fn shots_together(units: Units, recording: &Recording, data: &Measurements) -> Units {
    if units.stretches > 0 {
        return units;
    }
    let mut first: BTreeMap<&str, usize> = BTreeMap::new();
    let mut all: Vec<Vec<usize>> = Vec::new();
    for unit in units.all {
        let name = pose_named(&recording.point_id[unit[0]]);
        let earlier = name.and_then(|name| first.get(name).copied());
        match earlier.filter(|k| near(data.q(all[*k][0]), data.q(unit[0]), BY_NAME)) {
            Some(k) => all[k].extend(unit),
            None => {
                first.extend(name.map(|name| (name, all.len())));
                all.push(unit);
            }
        }
    }
    all.iter_mut().for_each(|unit| unit.sort_unstable());
    Units { all, ..units }
}

/// What is said where a stated split has rows of a pose, loaded alike, in several sets; none where it has not.
fn torn(recording: &Recording, sets: &[String]) -> Option<String> {
    let data = recording.measurements();
    let rows: Vec<usize> = (0..recording.rows()).collect();
    let loaded_alike = |a: usize, b: usize| data.payload[a] == data.payload[b];
    let poses = Units::poses(&data, &rows, loaded_alike);
    let poses = shots_together(poses, recording, &data).all;
    let mut pairs: Vec<[usize; 2]> = poses
        .iter()
        .filter_map(|pose| {
            let other = pose.iter().find(|row| sets[**row] != sets[pose[0]])?;
            Some([pose[0], *other])
        })
        .collect();
    let count = pairs.len();
    pairs.truncate(TORN_NAMED);
    let id = |row: usize| &recording.point_id[row];
    let named = pairs.iter().map(|[one, other]| {
        let [a, b] = [one, other].map(|row| &sets[*row]);
        format!("{} in `{a}`, {} in `{b}`", id(*one), id(*other))
    });
    (count > 0).then(|| {
        let more = if count > TORN_NAMED { "; ..." } else { "" };
        format!(
            "{count} of {} are in several sets ({}{more}): errors of a set that is held out say there how well a pose repeats, not how well new poses are \
             met; deal whole poses, as `by: every` does",
            counted(poses.len(), "pose"),
            named.collect::<Vec<_>>().join("; ")
        )
    })
}

/// Poses that are named of many.
const TORN_NAMED: usize = 3;

named! {
    /// A column of names.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    pub enum NamedColumn {
        /// What sockets the target lay in.
        Socket "socket",
        /// Planes that it touched.
        Plane "plane",
        /// Spheres that it touched.
        Sphere "sphere",
        /// Ends of distances.
        Anchor "anchor",
        /// Targets on the tool.
        Target "target",
    }
}

impl NamedColumn {
    /// The names of the rows; blank where a row has none. Fails where the recording has no such column.
    pub(super) fn of<'a>(self, recording: &'a Recording, place: &str) -> Result<Vec<&'a str>> {
        let column = match self {
            Self::Target => recording.target.as_ref(),
            _ => recording.names.get(self.name()),
        };
        let column = column.ok_or_else(|| {
            let target = recording.target.as_ref().map(|_| "target");
            let there = listed(recording.names.keys().copied().chain(target));
            let name = self.name();
            let message = format!("the recording has no names of `{name}`; it has: {there}");
            Error::data(format!("with.{place}"), message)
        })?;
        let names = column.iter().map(|name| name.as_deref());
        Ok(names.map(Option::unwrap_or_default).collect())
    }
}
