//! Which columns are the measured point: of a target, its difference, a nominal point and a measured one only the last is.

use super::names;
use super::names::Name;
use std::collections::BTreeMap;

/// Columns of x, y and z under one name, and what the name says of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Family {
    pub(crate) columns: [usize; 3],
    pub(crate) words: Vec<String>,
    pub(crate) role: PointRole,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PointRole {
    Measured,
    /// The name does not say.
    Plain,
    Wanted,
    Difference,
    Sigma,
}

/// A way to the measured point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PointColumns {
    pub(crate) columns: [usize; 3],
    /// Columns of the difference, and whether they are taken off.
    pub(crate) difference: Option<([usize; 3], bool)>,
}

/// Ways to the measured point, best first; what to ask where it is not plain; what else is known of points.
#[derive(Debug, Clone, Default)]
pub(super) struct Points {
    pub(crate) ways: Vec<PointColumns>,
    pub(crate) question: Option<String>,
    /// Whether the name of the best one says that it was measured.
    pub(crate) said: bool,
    /// Points of several targets side by side, by the targets' names; none where the names do not say so.
    pub(crate) targets: Vec<(String, [usize; 3])>,
    pub(crate) wanted: Option<[usize; 3]>,
    pub(crate) sigma: Option<[usize; 3]>,
}

/// All coordinates that come in threes.
pub(super) fn families(names: &[Name]) -> Vec<Family> {
    let mut groups: BTreeMap<Vec<String>, [Vec<usize>; 3]> = BTreeMap::new();
    for (column, name) in names.iter().enumerate() {
        let Some((axis, mut rest)) = name.axis() else {
            continue;
        };
        rest.sort();
        groups.entry(rest).or_default()[axis].push(column);
    }
    let mut found = Vec::new();
    for (words, [x, y, z]) in groups {
        // Names that stand twice make two points.
        for ((x, y), z) in x.iter().zip(&y).zip(&z) {
            found.push(Family {
                columns: [*x, *y, *z],
                role: role(&words),
                words: words.clone(),
            });
        }
    }
    found.sort_by_key(|family| family.columns[0]);
    found
}

fn role(rest: &[String]) -> PointRole {
    let has = |list| rest.iter().any(|word| names::lists(list, word));
    match (
        has(names::SIGMA),
        has(names::DIFFERENCE),
        has(names::MEASURED),
        has(names::WANTED),
    ) {
        (true, ..) => PointRole::Sigma,
        (_, true, ..) => PointRole::Difference,
        (_, _, true, false) => PointRole::Measured,
        (_, _, false, true) => PointRole::Wanted,
        _ => PointRole::Plain,
    }
}

/// The measured point among them.
pub(super) fn points(names: &[Name]) -> Points {
    let mut families = families(names);
    let of = |families: &[Family], role: PointRole| -> Vec<Family> {
        families
            .iter()
            .filter(|family| family.role == role)
            .cloned()
            .collect()
    };
    // `x_t` beside `x_dif` is the target; alone it may be the tracker's.
    let others = families
        .iter()
        .any(|family| family.role == PointRole::Difference || family.words.is_empty());
    for family in &mut families {
        if family.role == PointRole::Plain && family.words == ["t"] && others {
            family.role = PointRole::Wanted;
        }
    }
    let [measured, plain, wanted, differences, sigma] = [
        PointRole::Measured,
        PointRole::Plain,
        PointRole::Wanted,
        PointRole::Difference,
        PointRole::Sigma,
    ]
    .map(|role| of(&families, role));
    let direct = |family: &Family| PointColumns {
        columns: family.columns,
        difference: None,
    };
    let by = |target: &Family, difference: &Family| {
        let minus = difference
            .words
            .iter()
            .any(|word| names::lists(names::TARGET_LESS_MEASURED, word));
        PointColumns {
            columns: target.columns,
            difference: Some((difference.columns, minus)),
        }
    };
    let sides = "minus: target less measured point; plus: measured point less target";
    let mut found = Points {
        wanted: wanted.first().map(|family| family.columns),
        sigma: sigma.first().map(|family| family.columns),
        said: !measured.is_empty(),
        ..Points::default()
    };
    let candidates = if measured.is_empty() {
        &plain
    } else {
        &measured
    };
    found.ways = candidates.iter().map(direct).collect();
    if candidates.len() > 1 {
        found.targets = targets(candidates);
        found.question = Some("several points fit; which one was measured?".into());
    } else if measured.is_empty() && !plain.is_empty() {
        if let (Some(difference), true) = (differences.first(), wanted.is_empty()) {
            found.ways.push(by(&plain[0], difference));
            found.question = Some(format!(
                "is this the measured point, or the target of the differences next to it ({sides})?"
            ));
        } else if !plain[0].words.is_empty() && wanted.is_empty() {
            found.question = Some("is this the measured point, or the target?".into());
        }
    } else if candidates.is_empty()
        && let (Some(target), Some(difference)) = (wanted.first(), differences.first())
    {
        found.ways = vec![by(target, difference)];
        found.question = Some(format!(
            "the measured point by its target and the difference ({sides})"
        ));
        found.ways.extend(
            differences
                .iter()
                .skip(1)
                .map(|difference| by(target, difference)),
        );
    }
    found
}

/// Several points whose names differ in a number, or in a letter behind a word, alone: `X1` and `X2`, `SMR1_x` and `SMR2_x`.
fn targets(candidates: &[Family]) -> Vec<(String, [usize; 3])> {
    let mut named = Vec::new();
    let mut stems = Vec::new();
    for family in candidates {
        // In the order of the name: the words of a family are sorted, and numbers come first.
        let mut words: Vec<&str> = family.words.iter().map(String::as_str).collect();
        words.sort_by_key(|word| word.bytes().all(|byte| byte.is_ascii_digit()));
        let name = words.concat();
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let letter = name
            .strip_suffix(|c: char| c.is_ascii_alphabetic())
            .filter(|stem| stem.len() > 1);
        let stem = if stem.len() < name.len() {
            Some(stem)
        } else {
            letter
        };
        let Some(stem) = stem.map(String::from) else {
            return Vec::new();
        };
        named.push((
            if stem.is_empty() {
                format!("target_{name}")
            } else {
                name
            },
            family.columns,
        ));
        stems.push(stem);
    }
    let is_one = |(k, (name, _)): (usize, &(String, [usize; 3]))| {
        named[..k].iter().all(|(other, _)| other != name)
    };
    let alike =
        stems.windows(2).all(|pair| pair[0] == pair[1]) && named.iter().enumerate().all(is_one);
    if alike { named } else { Vec::new() }
}
