//! How two files belong together: by points' names, found by equal values whatever the header; else by time; else row by row.

use super::columns::{ExaminedFile, MOST_NAMED};
use super::names;
use super::sheet::number;
use crate::stage::ingest::{ClocksApart, clock_seconds, clocks_apart, last_number};
use crate::statistics;
use crate::yaml::quoted;
use std::collections::BTreeSet;

/// Names that fewer rows share than this are not the same names: a tracker may have lost many points, hardly most of them.
const LEAST_SHARED: f64 = 0.5;
/// Fewer shared names than this are asked about: a tracker loses a few points of a hundred, not more.
const PLENTY: f64 = 0.95;

/// Columns of both files that name points alike.
#[derive(Debug, Clone, PartialEq)]
struct Pair {
    columns: [usize; 2],
    /// The numbers in the names are equal, not the names.
    numbers: bool,
    /// Text, not running numbers.
    text: bool,
    /// Share of the names of the shorter file that stand in the other, in hundredths.
    shared: u32,
    named: usize,
}

/// Decides, and leaves every quantity in one of the files; the lines of the pipeline below `files`.
pub(super) fn join(found: &mut [ExaminedFile]) -> Vec<String> {
    if found.len() > 1 && found.iter().all(is_whole) {
        return one_after_the_other(found);
    }
    let [one, two] = found else {
        return found.first_mut().map(alone).unwrap_or_default();
    };
    // A file that was not understood says nothing; ids and points are written as lines to replace.
    let blind = [&*one, &*two]
        .iter()
        .any(|file| file.sheet.trouble.is_some());
    single(one, two);
    let pairs = pairs(one, two);
    let timing = timing(one, two);
    let sizes = [one.sheet.rows.len(), two.sheet.rows.len()];
    // Rows that are only counted: where files are of unequal length, numbers say no more than the order of rows.
    let running = pairs.first().is_some_and(|pair| {
        !pair.text && !pair.numbers && runs(one, pair.columns[0]) && runs(two, pair.columns[1])
    });
    let doubtful = running && sizes[0] != sizes[1];
    if let Some(best) = pairs
        .first()
        .filter(|_| !doubtful || timing.is_none())
        .cloned()
    {
        if one.has("time") {
            let why = "rows are joined by name; time is that of the first file";
            two.drop("time", why);
        }
        return by_id(one, two, &best, &pairs, running);
    }
    if let Some(timing) =
        timing.filter(|timing| timing.overlap || timing.apart.is_some() || sizes[0] != sizes[1])
    {
        label(one, two);
        return by_time(&timing, [one, two]);
    }
    if one.has("time") {
        two.drop("time", "time is that of the first file");
    }
    label(one, two);
    let [a, b] = sizes;
    let why = match (blind, a == b) {
        (true, _) => {
            "REPLACE: how rows belong together; {by: id} by the points' names, {by: time, tolerance_s: 0.5} or {by: order}"
                .to_string()
        }
        (_, true) => format!("CHECK: row by row, since neither names nor times were found in both; {a} rows each"),
        _ => format!("REPLACE: neither names nor times were found in both, and {a} and {b} rows cannot be joined by order"),
    };
    vec![format!("      join: {{by: order}}       # {why}")]
}

/// Whether a file is a recording of its own: it has joints and points.
pub(super) fn is_whole(file: &ExaminedFile) -> bool {
    file.has("q") && file.has("x")
}

/// Takes out all lists of points but the first, with the reflectors' names, where the files are one of joints and lists of points in one
/// layout, a reflector each; the first file has the joints then, the second the points of the first reflector. Nothing of other files.
pub(super) fn other_reflectors(found: &mut Vec<ExaminedFile>) -> Vec<(String, ExaminedFile)> {
    let is_list = |file: &ExaminedFile| file.has("x") && !file.has("q") && !file.has("target");
    let of_joints = |file: &ExaminedFile| file.has("q") && !file.has("x");
    let Some(joints) = found.iter().position(of_joints) else {
        return Vec::new();
    };
    let lead = found.remove(joints);
    let alike = |file: &ExaminedFile| is_list(file) && file.sheet.is_laid_out_as(&found[0].sheet);
    if found.len() < 2 || !found.iter().all(alike) {
        found.insert(joints, lead);
        return Vec::new();
    }
    let stem = |file: &ExaminedFile| file.path.file_stem().unwrap_or_default().to_os_string();
    let stems = found.iter().map(stem);
    let stems: Vec<String> = stems.map(|stem| stem.to_string_lossy().into()).collect();
    let names = reflectors(&stems).into_iter();
    let mut named: Vec<(String, ExaminedFile)> = names.zip(found.drain(..)).collect();
    let (name, mut first) = named.remove(0);
    first.state(
        "target",
        &quoted(&name),
        "which reflector it was, by the file's name",
    );
    found.extend([lead, first]);
    named
}

/// Names of reflectors by their files: what is left of the names without what all of them have in front and behind.
fn reflectors(stems: &[String]) -> Vec<String> {
    let all: Vec<Vec<char>> = stems.iter().map(|stem| stem.chars().collect()).collect();
    let shortest = all.iter().map(Vec::len).min().unwrap_or_default();
    let alike = |same: &dyn Fn(&[char], usize) -> char| {
        (0..shortest)
            .take_while(|k| all.iter().all(|stem| same(stem, *k) == same(&all[0], *k)))
            .count()
    };
    let front = alike(&|stem, k| stem[k]);
    let back = alike(&|stem, k| stem[stem.len() - 1 - k]).min(shortest - front);
    let trimmed = |stem: &Vec<char>| {
        let name: String = stem[front..stem.len() - back].iter().collect();
        name.trim_matches(['_', '-', ' ', '.']).to_string()
    };
    let names: Vec<String> = all.iter().map(trimmed).collect();
    match names.iter().any(String::is_empty) {
        true => stems.to_vec(),
        false => names,
    }
}

/// Several recordings, e.g. a grid and a check set: rows of the first are fitted to, those of the others judge, unless the files say so
/// themselves. Points keep their names where no two files have the same.
fn one_after_the_other(found: &mut [ExaminedFile]) -> Vec<String> {
    let ids = found.iter().map(|file| file.ids().first().copied());
    let ids: Vec<Option<usize>> = ids.collect();
    let mut names = BTreeSet::new();
    let apart = found.iter().zip(&ids).all(|(file, id)| {
        let mut cells = id.iter().flat_map(|id| cells(file, *id));
        id.is_some() && cells.all(|name| names.insert(name.to_string()))
    });
    let silent = found.iter().all(|file| !file.has("usage"));
    for ((k, file), id) in found.iter_mut().enumerate().zip(ids) {
        if let Some(id) = id.filter(|_| apart) {
            file.map("point_id", &[id], None, None);
        }
        if silent {
            let set = if k == 0 { "fit" } else { "validate" };
            file.state("usage", set, "every row of this file");
        }
    }
    vec!["      join: {by: append}      # CHECK: separate recordings, one after the other".into()]
}

/// Names and repeats of a file that stands alone.
fn alone(found: &mut ExaminedFile) -> Vec<String> {
    let ids = found.ids();
    let Some(first) = ids.first().copied() else {
        return Vec::new();
    };
    found.map("point_id", &ids, None, None);
    let (rows, distinct) = (found.sheet.rows.len(), found.distinct(first));
    let line = format!(
        "      duplicates: keep       # CHECK: {distinct} names for {rows} rows; each row counts as a measurement"
    );
    (distinct < rows).then_some(line).into_iter().collect()
}

/// Every quantity once: joints and what belongs to them from the first file that has them, the point from the file without joints.
fn single(one: &mut ExaminedFile, two: &mut ExaminedFile) {
    const ONCE: &str = "q current direction velocity payload temperature usage target";
    for quantity in ONCE.split(' ').filter(|quantity| one.has(quantity)) {
        two.drop(quantity, "in both files; this one or that of the first?");
    }
    if one.has("x") && two.has("x") {
        let first = two.has("q") && !one.has("q");
        let (from, other) = if first { (two, &*one) } else { (one, &*two) };
        let why = format!(
            "the measured point, or the controller's? that of {} is used",
            other.name
        );
        from.drop("x", &why);
    }
}

/// Pairs of columns with equal values, best first; where there are none, of columns in whose names the numbers are equal.
fn pairs(one: &ExaminedFile, two: &ExaminedFile) -> Vec<Pair> {
    let whole = pairs_by(one, two, false);
    if whole.is_empty() {
        pairs_by(one, two, true)
    } else {
        whole
    }
}

fn pairs_by(one: &ExaminedFile, two: &ExaminedFile, numbers: bool) -> Vec<Pair> {
    let [left, right] = [one, two].map(|file| {
        let columns = (0..file.stated.len()).filter(|column| may_name(file, *column));
        let named = columns.filter_map(|column| match numbers {
            true => Some((column, numbers_of(file, column)?)),
            false => Some((column, cells(file, column))),
        });
        named.take(MOST_NAMED).collect::<Vec<_>>()
    });
    let mut pairs = Vec::new();
    for (a, names) in &left {
        for (b, others) in &right {
            let shared = names.intersection(others).count() as f64
                / names.len().min(others.len()).max(1) as f64;
            if shared >= LEAST_SHARED {
                let text = names.iter().any(|name| number(name).is_none());
                let listed = |file: &ExaminedFile, column: usize| {
                    usize::from(names::lists(names::IDS, &file.stated[column].stem()))
                };
                let named = listed(one, *a) + listed(two, *b);
                pairs.push(Pair {
                    columns: [*a, *b],
                    numbers,
                    text,
                    shared: (100.0 * shared) as u32,
                    named,
                });
            }
        }
    }
    pairs.sort_by_key(|pair| std::cmp::Reverse((pair.text, pair.shared, pair.named)));
    pairs
}

/// The numbers in the names of a column; none where a name has none, or two have the same.
fn numbers_of(file: &ExaminedFile, column: usize) -> Option<BTreeSet<&str>> {
    let texts = file.sheet.texts(column);
    let numbers: BTreeSet<&str> = texts.map(last_number).collect::<Option<_>>()?;
    (numbers.len() == file.distinct(column)).then_some(numbers)
}

fn cells(file: &ExaminedFile, column: usize) -> BTreeSet<&str> {
    file.sheet.texts(column).collect()
}

/// Whether a column can name points: most cells differ, and none has decimals unless the header says that these are names.
fn may_name(file: &ExaminedFile, column: usize) -> bool {
    let distinct = file.distinct(column);
    let rows = file.sheet.rows.len();
    let whole = file.sheet.texts(column).all(|cell| {
        number(cell).is_none_or(|value| value.fract() == 0.0 && !cell.contains(['.', ',']))
    });
    let listed = names::lists(names::IDS, &file.stated[column].stem());
    !file.is_taken(column) && distinct >= 2 && 2 * distinct >= rows && (whole || listed)
}

/// Whether the cells are numbers that go up by one.
fn runs(file: &ExaminedFile, column: usize) -> bool {
    let numbers: Vec<f64> = file.sheet.numbers(column).collect();
    numbers.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}

fn by_id(
    one: &mut ExaminedFile,
    two: &mut ExaminedFile,
    best: &Pair,
    pairs: &[Pair],
    running: bool,
) -> Vec<String> {
    let alike =
        |pair: &&Pair| (pair.text, pair.shared, pair.named) == (best.text, best.shared, best.named);
    let columns = |file: usize| {
        let fixed = 1 - file;
        let fit = |pair: &&Pair| alike(pair) && pair.columns[fixed] == best.columns[fixed];
        let fit = pairs.iter().filter(fit);
        fit.map(|pair| pair.columns[file]).collect::<Vec<usize>>()
    };
    one.map("point_id", &columns(0), None, None);
    two.map("point_id", &columns(1), None, None);
    if best.numbers {
        [one, two]
            .into_iter()
            .for_each(|file| file.add("point_id", "match: number"));
        let shared = best.shared;
        let line = format!(
            "      join: {{by: id}}          # CHECK: by the numbers in the names, of which {shared} % stand in both files"
        );
        return vec![line];
    }
    let files = [&*one, &*two];
    let [a, b] = files.map(|file| file.sheet.rows.len());
    let repeated =
        |(file, column): (&ExaminedFile, usize)| file.distinct(column) < file.sheet.rows.len();
    let repeated = files.into_iter().zip(best.columns).any(repeated);
    let question = if running && a == b {
        "CHECK: running numbers, which join row by row".into()
    } else if running {
        format!("CHECK: running numbers, but {a} and {b} rows: is the row that lacks one the last?")
    } else if f64::from(best.shared) < 100.0 * PLENTY {
        format!("CHECK: {} % of the names stand in both files", best.shared)
    } else if repeated {
        "CHECK: names stand more than once in a file; such rows are not used".into()
    } else {
        "by the point's name".into()
    };
    vec![format!("      join: {{by: id}}          # {question}")]
}

/// Where files are not joined by id, the names of one of them may stand.
fn label(one: &mut ExaminedFile, two: &mut ExaminedFile) {
    for file in [two, one] {
        let is_whole = |id: &usize| file.distinct(*id) == file.sheet.rows.len();
        if let Some(first) = file.ids().first().copied().filter(is_whole) {
            return file.map("point_id", &[first], None, None);
        }
    }
}

struct Timing {
    /// Half of the rows of the file with fewer have one of the other nearer than this, s.
    near: f64,
    /// Usual time between rows of the file with fewer, s.
    step: f64,
    overlap: bool,
    /// What pairs rows of clocks that do not overlap.
    apart: Option<ClocksApart>,
    /// First time of the second file less that of the first, s.
    firsts: f64,
    rows: [usize; 2],
}

fn timing(one: &ExaminedFile, two: &ExaminedFile) -> Option<Timing> {
    let times = |file: &ExaminedFile| -> Option<Vec<f64>> {
        let column = *file.get("time")?.choices.first()?.columns.first()?;
        let mut times: Vec<f64> = match file.sheet.is_numeric(column) {
            true => {
                let times = file.sheet.numbers(column).map(|time| time * file.second);
                times.collect()
            }
            false => clock_seconds(file.sheet.texts(column)),
        };
        times.sort_by(f64::total_cmp);
        (times.len() > 1).then_some(times)
    };
    let (first, second) = (times(one)?, times(two)?);
    let (few, many) = match first.len() <= second.len() {
        true => (&first, &second),
        false => (&second, &first),
    };
    let nearest = |time: &f64| {
        let at = many.partition_point(|other| other < time);
        let around = &many[at.saturating_sub(1)..many.len().min(at + 1)];
        let apart = around.iter().map(|other| (other - time).abs());
        apart.fold(f64::INFINITY, f64::min)
    };
    let median = |mut values: Vec<f64>| statistics::nearest(&mut values, 0.5);
    let near = median(few.iter().map(nearest).collect())?;
    let step = median(few.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
    Some(Timing {
        near,
        step,
        overlap: near <= 0.5 * step,
        apart: clocks_apart(&first, &second, 0.1 * step).filter(|_| near > 0.5 * step),
        firsts: second[0] - first[0],
        rows: [first.len(), second.len()],
    })
}

fn by_time(timing: &Timing, files: [&ExaminedFile; 2]) -> Vec<String> {
    // Three times the usual distance, rounded up, but never as far as the next row.
    let wide = if timing.overlap {
        (3.0 * timing.near).max(1e-3)
    } else {
        0.1 * timing.step
    };
    let tolerance = rounded_up(wide.min(0.5 * timing.step).max(1e-4)).min(0.5 * timing.step);
    let line = if timing.overlap {
        format!(
            "      join: {{by: time, tolerance_s: {tolerance}}}       # CHECK: half of the rows have their partner within {:.3} s",
            timing.near
        )
    } else {
        let (offset, why) = match &timing.apart {
            Some(found) => (found.offset, found.in_words()),
            None => (
                timing.firsts,
                "the clocks do not overlap; this offset puts the first rows together".into(),
            ),
        };
        format!(
            "      join: {{by: time, tolerance_s: {tolerance}, offset_s: {offset:.3}}}       # CHECK: {why}"
        )
    };
    let mut lines = vec![line];
    let [a, b] = timing.rows;
    let (many, few) = (a.max(b), a.min(b));
    let name = &files[usize::from(a <= b)].name;
    // Beyond a half, by default, a file is refused; here up to half of the other file's rows may lack their partner.
    if 5 * few < 3 * many {
        let fraction = ((1.0 - 0.5 * few as f64 / many as f64) * 1e4).ceil() / 1e4;
        lines.push(format!(
            "      max_rejected_fraction: {fraction}   # CHECK: {name} has {many} rows for the {few} of the other file"
        ));
    }
    lines
}

/// Up to the next 1, 2 or 5 times a power of ten.
fn rounded_up(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let digit = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|digit| digit * power >= value * (1.0 - 1e-9))
        .unwrap_or(10.0);
    // Without the digits of the power's own rounding.
    format!("{:.6}", digit * power).parse().unwrap_or(value)
}
