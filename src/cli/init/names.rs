//! What the name of a column says: words, a unit, the number of a joint, an axis of the point.

/// Units by how people write them in a header.
const UNITS: [(&str, &str); 22] = [
    ("mm", "mm"),
    ("m", "m"),
    ("um", "um"),
    ("\u{b5}m", "um"),
    ("\u{3bc}m", "um"),
    ("in", "in"),
    ("inch", "in"),
    ("deg", "deg"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("grad", "deg"),
    ("\u{b0}", "deg"),
    ("rad", "rad"),
    ("kg", "kg"),
    ("c", "C"),
    ("\u{b0}c", "C"),
    ("degc", "C"),
    ("s", "s"),
    ("sec", "s"),
    ("ms", "ms"),
    ("a", "A"),
    ("nm", "Nm"),
];

/// What the joints' columns are usually called; the number of the joint follows.
const JOINTS: [&str; 13] =
    ["q", "a", "j", "joint", "axis", "theta", "achse", "gelenk", "axe", "asse", "eje", "jnt", "joint_angle"];

/// What stands beside an axis' name where there are commanded and measured points.
const MEASURED: [&str; 9] = ["ist", "actual", "act", "meas", "measured", "mess", "gemessen", "real", "tracker"];
const WANTED: [&str; 9] = ["soll", "nom", "nominal", "cmd", "command", "target", "wanted", "ref", "programmed"];

/// A column's name taken apart.
#[derive(Debug, Clone)]
pub(super) struct Name {
    /// In small letters, without the unit.
    pub words: Vec<String>,
    /// Symbol of the unit that the name ends in.
    pub unit: Option<&'static str>,
}

impl Name {
    pub fn of(text: &str) -> Self {
        let lower = text.trim().to_lowercase();
        let (stem, unit) = without_unit(&lower);
        let words = stem.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).map(str::to_string).collect();
        Self { words, unit }
    }

    pub fn stem(&self) -> String {
        self.words.join("_")
    }

    /// The unit, if it is one of these.
    pub fn unit_of(&self, allowed: &[&str]) -> Option<&'static str> {
        self.unit.filter(|unit| allowed.contains(unit))
    }

    /// What the joints are called here, and which one this is (from 1): `q1`, `A1_deg`, `joint_3`, `Achse 4 [deg]`.
    pub fn joint(&self) -> Option<(String, usize)> {
        let stem = self.stem();
        let name = stem.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = stem[name.len()..].parse().ok()?;
        Some((name.trim_end_matches('_').to_string(), number))
    }

    /// The axis (0 to 2) that this is the coordinate of, and what else the name says.
    pub fn axis(&self) -> Option<(usize, Vec<String>)> {
        let at = self.words.iter().position(|word| ["x", "y", "z"].contains(&word.as_str()))?;
        let axis = ["x", "y", "z"].iter().position(|axis| self.words[at] == *axis)?;
        let rest = self.words.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, word)| word.clone()).collect();
        Some((axis, rest))
    }
}

fn without_unit(lower: &str) -> (&str, Option<&'static str>) {
    let symbol = |text: &str| UNITS.iter().find(|(written, _)| *written == text.trim()).map(|(_, unit)| *unit);
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((stem, inside)) = lower.strip_suffix(close).and_then(|text| text.rsplit_once(open))
            && !stem.trim().is_empty()
            && let Some(unit) = symbol(inside)
        {
            return (stem.trim(), Some(unit));
        }
    }
    for separator in ["_", " ", "/", "."] {
        if let Some((stem, ending)) = lower.rsplit_once(separator)
            && !stem.trim().is_empty()
            && let Some(unit) = symbol(ending)
        {
            return (stem.trim().trim_end_matches(" in"), Some(unit));
        }
    }
    (lower, None)
}

/// Columns of joints 1, 2, ... under one name: a usual one first, else the longest row of four or more that `angle` takes for angles.
pub(super) fn joints(names: &[Name], angle: impl Fn(usize) -> bool) -> Vec<usize> {
    let parts: Vec<Option<(String, usize)>> = names.iter().map(Name::joint).collect();
    let run = |prefix: &str| -> Vec<usize> {
        let column = |n: usize| parts.iter().position(|part| part.as_ref().is_some_and(|(name, k)| name == prefix && *k == n));
        (1..).map_while(column).collect()
    };
    let usual = JOINTS.iter().map(|prefix| run(prefix)).find(|columns| columns.len() > 1);
    usual.unwrap_or_else(|| {
        let runs = parts.iter().flatten().map(|(prefix, _)| run(prefix));
        let likely = runs.filter(|columns| columns.len() >= 4 && columns.iter().all(|column| angle(*column)));
        likely.fold(Vec::new(), |best, columns| if columns.len() > best.len() { columns } else { best })
    })
}

/// Columns of x, y, z under one name; the measured ones where there are several.
pub(super) fn point(names: &[Name]) -> Option<[usize; 3]> {
    let parts: Vec<Option<(usize, Vec<String>)>> = names.iter().map(Name::axis).collect();
    let score = |rest: &[String]| {
        let has = |words: &[&str]| rest.iter().any(|word| words.contains(&word.as_str()));
        i32::from(has(&MEASURED)) - 2 * i32::from(has(&WANTED))
    };
    let mut best: Option<(i32, [usize; 3])> = None;
    for (_, rest) in parts.iter().flatten() {
        let column =
            |axis: usize| parts.iter().position(|part| part.as_ref().is_some_and(|(a, other)| *a == axis && other == rest));
        if let (Some(x), Some(y), Some(z)) = (column(0), column(1), column(2))
            && best.is_none_or(|(least, _)| score(rest) > least)
        {
            best = Some((score(rest), [x, y, z]));
        }
    }
    best.map(|(_, columns)| columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(texts: &[&str]) -> Vec<Name> {
        texts.iter().map(|text| Name::of(text)).collect()
    }

    #[test]
    fn units_stand_at_the_end_of_a_name_in_many_forms() {
        for (text, stem, unit) in [
            ("Achse1 [\u{b0}]", "achse1", Some("deg")),
            ("X_ist [mm]", "x_ist", Some("mm")),
            ("q1_deg", "q1", Some("deg")),
            ("Temp (\u{b0}C)", "temp", Some("C")),
            ("load kg", "load", Some("kg")),
            ("X/mm", "x", Some("mm")),
            ("X in mm", "x", Some("mm")),
            ("m", "m", None),
            ("remark", "remark", None),
        ] {
            let name = Name::of(text);
            assert_eq!((name.stem().as_str(), name.unit), (stem, unit), "{text}");
        }
    }

    #[test]
    fn joints_and_the_measured_point_are_found_under_names_that_nobody_foresaw() {
        let all =
            names(&["Nr", "wrist_1", "R1", "R2", "R3", "R4", "R5", "X_soll", "Y_soll", "Z_soll", "X_ist", "Y_ist", "Z_ist"]);
        assert_eq!(joints(&all, |_| true), [2, 3, 4, 5, 6]);
        assert_eq!(joints(&all, |column| column != 4), Vec::<usize>::new());
        assert_eq!(point(&all), Some([10, 11, 12]));
        assert_eq!(joints(&names(&["i1", "i2", "Achse 1", "Achse 2"]), |_| false), [2, 3]);
        assert_eq!(point(&names(&["x", "y"])), None);
    }
}
