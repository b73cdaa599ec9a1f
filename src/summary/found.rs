//! A finding in a few words: what it is, its number, its size, and what it might be instead.

use super::estimate::{angle, estimate, length};
use crate::effect::{Clock, Form, Summary, cause, figure, names};
use serde::Deserialize;
use serde_json::Value;

/// From this probability on a name stands without its rivals.
const CERTAIN: f64 = 0.9;
/// Below this the likeliest rival stands in the same line, with both probabilities.
const CLEAR: f64 = 0.8;
/// Rivals less probable than this are left to the details, and so is the chance of this that no name is right.
const NOTABLE: f64 = 0.05;
const UNLISTED: f64 = 0.2;
/// Rivals that are named; of more the name is not determined.
const NAMED: usize = 2;

/// A finding of positions or torques, as [`crate::report`] makes it of the tables.
#[derive(Clone, Default, Deserialize)]
#[serde(default)]
pub(super) struct Found {
    pub(crate) rank: i64,
    pub(crate) effect: String,
    pub(crate) place: String,
    pub(crate) statement: String,
    /// Its forms, objects of one cause each, as a text; empty where it has none.
    forms: String,
    numbers: Vec<FoundNumber>,
    pub(crate) rivals: Vec<FoundRival>,
    /// Of its name, and of none of the names.
    probability: Option<f64>,
    none_probability: Option<f64>,
    /// None where it was not compared with others.
    delta_bic: Option<f64>,
    /// Its size, in the unit that all findings of a diagnosis share.
    effect_rms_mm: Option<f64>,
    effect_rms_rad: Option<f64>,
    effect_rms_mrad: Option<f64>,
    effect_rms_nm: Option<f64>,
}

#[derive(Clone, Deserialize)]
struct FoundNumber {
    name: String,
    value: f64,
    unit: String,
    sigma: Option<f64>,
}

#[derive(Clone, Deserialize)]
pub(super) struct FoundRival {
    pub(crate) effect: String,
    pub(crate) place: String,
    pub(crate) delta_bic: f64,
    probability: Option<f64>,
}

impl Found {
    /// Its size, and as it is printed.
    fn size(&self) -> Option<(f64, String)> {
        let by_length = self.effect_rms_mm.map(|mm| (mm, length(mm)));
        let by_angle = self.effect_rms_rad.map(|rad| (rad, angle(rad)));
        let torque = self.effect_rms_nm.filter(|nm| *nm > 0.0);
        let of_drives = self
            .effect_rms_mrad
            .map(|mrad| (mrad, format!("{mrad:.2} mrad")));
        by_length
            .or(of_drives)
            .or(by_angle)
            .or_else(|| torque.map(|nm| (nm, format!("{} {}", figure(nm, 1), self.drive()))))
    }
}

impl Found {
    /// The unit of what a joint is driven by: N where the numbers say that it slides.
    fn drive(&self) -> &'static str {
        let slides = |number: &FoundNumber| ["N", "N s/m", "N/m"].contains(&number.unit.as_str());
        match self.place.starts_with("joint") && self.numbers.iter().any(slides) {
            true => "N",
            false => "Nm",
        }
    }
}

/// A finding in a few words.
pub(super) struct ShortFinding {
    pub(crate) size: Option<(f64, String)>,
    /// What it is, e.g. `joint 3 yields under load`; the likeliest rival where that is more probable.
    pub(crate) what: String,
    /// The same by its own name.
    pub(crate) own: String,
    /// Its number with the standard deviation.
    pub(crate) number: Option<String>,
    /// Its likeliest rival with both probabilities, where its own does not decide: `, or link 3 bends under load (0.32 / 0.37)`.
    pub(crate) either: Option<String>,
    /// What it might be instead, where that matters.
    pub(crate) instead: Option<String>,
}

/// An effect, what it does at a place `{}`, and the number that is shown of it: `No`, the `Largest`, its `Size` without a sign, `Twice` that (of
/// half a gap the whole), the `Amplitude` of the largest sine and cosine with its order, or the one of a name.
const PHRASES: &str = include_str!("text/phrases.txt");

fn phrase(effect: &str) -> Option<(&'static str, &'static str)> {
    let mut lines = PHRASES.lines().filter_map(|line| line.split_once(": "));
    let (_, phrase) = lines.find(|(name, _)| *name == effect)?;
    phrase.split_once(": ")
}

/// What a cause does at a place, whatever its size; one that a user declares by its name.
pub(super) fn words(effect: &str, place: &str) -> String {
    match phrase(effect) {
        Some((words, _)) => words.replace("{}", place),
        None if effect == names::UNKNOWN => format!("an unnamed error of {place}"),
        None => format!("{} at {place}", effect.replace('_', " ")),
    }
}

/// Place, motion and variables of a finding without a name, by its forms; words for its place alone where these are of a cause whose name it does
/// not bear.
fn unnamed(found: &Found, rows: bool) -> String {
    let forms: Vec<Form> = serde_json::from_str(&found.forms).unwrap_or_default();
    let is_nameless = forms.iter().all(|form| form.cause().is_nameless());
    let first = forms.first().filter(|_| is_nameless);
    let described = first.zip(cause(names::UNKNOWN)).map(|(first, unknown)| {
        unknown.sentence(&Summary {
            place: first.place(),
            forms: &forms,
            parameters: &[],
            clock: match rows {
                true => Clock::Rows,
                false => Clock::Seconds { first: 0.0 },
            },
        })
    });
    described.unwrap_or_else(|| words(&found.effect, &found.place))
}

impl ShortFinding {
    /// Its size for the order of findings; 0 where it has none.
    pub(super) fn magnitude(&self) -> f64 {
        self.size.as_ref().map_or(0.0, |(size, _)| *size)
    }

    /// The same of a finding as its tables have it; `rows` says that time counts rows.
    pub fn of(found: &Found, rows: bool) -> Self {
        // A cause of the list which fits best, but not well enough to bear its name.
        let forms: Value = serde_json::from_str(&found.forms).unwrap_or_default();
        let nearest = (found.effect == names::UNKNOWN)
            .then(|| nearest(found, &forms))
            .flatten();
        let effect = nearest.unwrap_or(&found.effect);
        let usual = if effect == names::UNKNOWN {
            "No"
        } else {
            "Largest"
        };
        let shown = phrase(effect).map_or(usual, |(_, shown)| shown);
        let number = number(shown, &found.numbers);
        // A mass that is not seen has no number, its moment has.
        let number = number.or_else(|| match shown {
            "mass" => self::number("moment", &found.numbers),
            _ => None,
        });
        let size = found.size();
        let of_rows = number.is_none() && size.is_none();
        let mut what = if of_rows {
            found.statement.trim_end_matches('.').to_string()
        } else if effect == names::UNKNOWN {
            unnamed(found, rows)
        } else {
            words(effect, &found.place)
        };
        if let Some(at) = changed_at(&forms).filter(|_| !of_rows) {
            what += &if rows {
                format!(" at row {:.0}", at.floor() + 2.0)
            } else {
                format!(" at {} s", figure(at, 0))
            };
        }
        if nearest.is_some() {
            what += ", roughly";
        }
        let own = what.clone();
        let either = either(found).map(|(rival, own, share)| match share > own {
            true => format!(
                ", or {} ({share:.2} / {own:.2})",
                std::mem::replace(&mut what, rival)
            ),
            false => format!(", or {rival} ({own:.2} / {share:.2})"),
        });
        Self {
            size,
            what,
            own,
            number,
            either,
            instead: instead(found, nearest),
        }
    }
}

/// The cause by whose form something unknown is modelled, where that is its closest rival.
fn nearest<'a>(found: &'a Found, forms: &Value) -> Option<&'a str> {
    let is_here =
        |rival: &&FoundRival| rival.place == found.place && rival.effect != names::UNKNOWN;
    let modelled = |effect: &str| {
        let all = forms.as_array();
        all.is_some_and(|all| all.iter().any(|form| form.get(effect).is_some()))
    };
    found
        .rivals
        .iter()
        .filter(is_here)
        .find(|rival| modelled(&rival.effect))
        .map(|rival| rival.effect.as_str())
}

/// When a form steps, on the clock of the recording.
fn changed_at(forms: &Value) -> Option<f64> {
    match forms {
        Value::Object(all) => {
            let sigma = all
                .get("after")
                .and_then(|after| after.get("at"))
                .and_then(Value::as_f64);
            sigma.or_else(|| all.values().find_map(changed_at))
        }
        Value::Array(all) => all.iter().find_map(changed_at),
        _ => None,
    }
}

/// The likeliest rival of a finding that is not clear, in words, with the probabilities of the finding's name and of that.
fn either(found: &Found) -> Option<(String, f64, f64)> {
    let compared = found.delta_bic.is_some();
    let own = found.probability.filter(|own| compared && *own < CLEAR)?;
    let rivals = found.rivals.iter();
    let (share, rival) = rivals
        .filter_map(|rival| Some((rival.probability?, rival)))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(share, _)| *share >= NOTABLE)?;
    Some((words(&rival.effect, &rival.place), own, share))
}

/// What else it might be, where its name is not certain.
fn instead(found: &Found, nearest: Option<&str>) -> Option<String> {
    let (name, none) = (found.probability, found.none_probability);
    let name = name.filter(|_| found.delta_bic.is_some());
    let certain = nearest.is_some() || name.is_none_or(|probability| probability > CERTAIN);
    let notable = |rival: &FoundRival| {
        let probability = rival.probability.filter(|value| *value >= NOTABLE)?;
        Some((probability, words(&rival.effect, &rival.place)))
    };
    let mut rivals: Vec<(f64, String)> = found.rivals.iter().filter_map(notable).collect();
    rivals.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    let others = rivals.len();
    if let Some(none) = none.filter(|none| *none >= UNLISTED && found.effect != names::UNKNOWN) {
        rivals.push((none, "another cause".into()));
    }
    if certain || rivals.is_empty() {
        return None;
    }
    if others > NAMED {
        return Some(format!(
            "not determined: {others} other causes fit as well (--details)"
        ));
    }
    let others: Vec<String> = rivals
        .iter()
        .map(|(share, words)| format!("{words} ({:.0} %)", 100.0 * share))
        .collect();
    Some(format!("or: {}", others.join(", ")))
}

/// The number that is shown of all, as [`PHRASES`] states.
fn number(shown: &str, all: &[FoundNumber]) -> Option<String> {
    let written = |one: &FoundNumber| {
        let per = if one.name.ends_with("per_kelvin") {
            "/K"
        } else {
            ""
        };
        estimate(one.value, one.sigma, &one.unit) + per
    };
    let largest = all
        .iter()
        .max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
    let times = |factor: f64| {
        let one = largest?;
        let sigma = one.sigma.map(|sigma| factor * sigma);
        Some(estimate(factor * one.value.abs(), sigma, &one.unit))
    };
    match shown {
        "No" => None,
        "Largest" => largest.map(written),
        "Size" => times(1.0),
        // Of torques and drives the whole of it is a number.
        "Twice" => match all.iter().find(|one| one.name == "play") {
            Some(whole) => Some(written(whole)),
            None => times(2.0),
        },
        "Amplitude" => amplitude(all),
        name => {
            let is_called = |one: &&FoundNumber| {
                one.name.rsplit(['.', '_']).next() == Some(name) || one.name == name
            };
            let alone = || all.first().filter(|_| all.len() == 1);
            let one = all.iter().find(is_called).or_else(alone)?;
            let is_more =
                ["mass", "moment", "relative", "offset"].contains(&name) && one.value > 0.0;
            Some(format!(
                "{}{}",
                if is_more { "+" } else { "" },
                written(one)
            ))
        }
    }
}

/// The amplitude of the largest sine and cosine, and how many periods a turn has.
fn amplitude(all: &[FoundNumber]) -> Option<String> {
    let pairs = all.iter().filter_map(|sine| {
        let start = sine.name.strip_suffix("sin")?;
        let cosine = all
            .iter()
            .find(|one| one.name.strip_suffix("cos") == Some(start))?;
        let size = sine.value.hypot(cosine.value);
        let sigma = sine
            .sigma
            .zip(cosine.sigma)
            .map(|(a, b)| (sine.value * a).hypot(cosine.value * b) / size);
        Some((size, sigma, sine))
    });
    let (size, sigma, sine) = pairs.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let digits = |text: &str| {
        text.chars()
            .take_while(char::is_ascii_digit)
            .collect::<String>()
    };
    let order = sine
        .name
        .split_once("order")
        .map(|(_, tail)| digits(tail))
        .filter(|order| !order.is_empty());
    let order = order.map_or_else(String::new, |order| format!(", {order} per turn"));
    Some(estimate(size, sigma.filter(|sigma| sigma.is_finite()), &sine.unit) + &order)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{Basis, CAUSES, Law, Motion, Term, Unknown, Variable};
    use serde_json::json;

    fn rival(effect: &str, probability: f64) -> FoundRival {
        FoundRival {
            effect: effect.into(),
            place: "joint 3".into(),
            delta_bic: 0.0,
            probability: Some(probability),
        }
    }

    fn number(name: &str, value: f64, unit: &str, sigma: f64) -> FoundNumber {
        FoundNumber {
            name: name.into(),
            value,
            unit: unit.into(),
            sigma: Some(sigma),
        }
    }

    fn found(effect: &str, numbers: Vec<FoundNumber>) -> Found {
        Found {
            effect: effect.into(),
            place: "joint 3".into(),
            numbers,
            probability: Some(0.95),
            none_probability: Some(0.0),
            delta_bic: Some(30.0),
            effect_rms_mm: Some(3.546),
            ..Found::default()
        }
    }

    fn lines_of(found: Found) -> [String; 3] {
        let short = ShortFinding::of(&found, false);
        [
            short.what,
            short.number.unwrap_or_default(),
            short.instead.unwrap_or_default(),
        ]
    }

    #[test]
    fn a_finding_is_what_it_does_with_its_number_and_standard_deviation() {
        let compliance = || {
            found(
                "joint_compliance",
                vec![number("j3", 4.17e-7, "rad/Nm", 2e-9)],
            )
        };
        assert_eq!(
            lines_of(compliance()),
            ["joint 3 yields under load", "(4.17 +- 0.02)e-7 rad/Nm", ""]
        );
        let wave = vec![
            number("j3.order2.cos", 3.0, "arcsec", 0.3),
            number("j3.order2.sin", 4.0, "arcsec", 0.3),
            number("j3.order5.cos", 1.0, "arcsec", 0.3),
            number("j3.order5.sin", 0.0, "arcsec", 0.3),
        ];
        let wave = lines_of(found("gear_cyclic", wave));
        assert_eq!(
            wave,
            [
                "joint 3 errs with its angle",
                "5.0 +- 0.3 arcsec, 2 per turn",
                ""
            ]
        );
        let law = json!({ "of": "time", "basis": { "after": { "at": 447.2 } } });
        let step = Found {
            forms: json!([{ "zero_shift": { "law": law } }]).to_string(),
            ..found("zero_shift", vec![number("j3.step", -14.8, "arcsec", 0.4)])
        };
        assert_eq!(
            lines_of(step),
            ["zero of joint 3 steps at 447 s", "14.8 +- 0.4 arcsec", ""]
        );
        let mass = lines_of(found(
            "payload_error",
            vec![number("tool.mass", 0.031, "1", 0.004)],
        ));
        assert_eq!(mass, ["payload differs", "+3.1 +- 0.4 %", ""]);
        let shown = lines_of(found(
            "worn_tooth",
            vec![number("j3.depth", 12.0, "arcsec", 1.0)],
        ));
        assert_eq!(shown, ["worn tooth at joint 3", "12.0 +- 1.0 arcsec", ""]);
    }

    #[test]
    fn rivals_are_named_only_where_the_name_is_not_certain() {
        let backlash = || rival("backlash", 0.3);
        let doubtful = |probability, rivals, none| {
            lines_of(Found {
                probability: Some(probability),
                none_probability: Some(none),
                rivals,
                ..found("gear_cyclic", Vec::new())
            })[2]
                .clone()
        };
        assert_eq!(
            doubtful(0.5, vec![backlash()], 0.2),
            "or: joint 3 has backlash (30 %), another cause (20 %)"
        );
        assert_eq!(doubtful(0.89, Vec::new(), 0.11), "");
        assert_eq!(doubtful(0.95, vec![backlash()], 0.1), "");
        let twelve = (0..12).map(|_| rival("backlash", 0.07)).collect();
        assert_eq!(
            doubtful(0.07, twelve, 0.07),
            "not determined: 12 other causes fit as well (--details)"
        );
    }

    #[test]
    fn what_is_in_no_list_is_called_as_the_nearest_that_models_it_roughly() {
        let rivals = || vec![rival("joint_compliance", 0.02)];
        let numbers = || vec![number("j3", 4.17e-7, "rad/Nm", 2e-9)];
        let near = Found {
            forms: json!([{ "joint_compliance": {} }]).to_string(),
            rivals: rivals(),
            ..found("unknown", numbers())
        };
        assert_eq!(
            lines_of(near),
            [
                "joint 3 yields under load, roughly",
                "(4.17 +- 0.02)e-7 rad/Nm",
                ""
            ]
        );
        let far = Found {
            forms: json!([{ "unknown": {} }]).to_string(),
            rivals: rivals(),
            ..found("unknown", numbers())
        };
        let joint = Motion::Joint { joint: 2 };
        let law = Law::new(Variable::Angle { joint: 4 }, Basis::PROPORTIONAL);
        let form = Form::from(Term::new(&Unknown, joint, law));
        let stated = Found {
            forms: serde_json::to_string(&[form]).expect("JSON"),
            ..far.clone()
        };
        assert_eq!(lines_of(far), ["an unnamed error of joint 3", "", ""]);
        let stated = lines_of(stated);
        assert_eq!(
            stated,
            ["joint 3 errs with the angle of joint 5, unnamed", "", ""]
        );
    }

    #[test]
    fn every_cause_that_is_found_has_its_phrase() {
        let base = [
            "anchor",
            "base_frame",
            "tool_offset",
            "joint_offset",
            "link_geometry",
            "reduction_ratio",
        ];
        let of_rows = ["outlier", "mislabelled_point", "unknown"];
        let without = CAUSES
            .iter()
            .map(|cause| cause.name())
            .filter(|name| phrase(name).is_none());
        let missing: Vec<&str> = without
            .filter(|name| !base.contains(name) && !of_rows.contains(name))
            .collect();
        assert!(missing.is_empty(), "{missing:?}");
        for line in PHRASES.lines() {
            let (name, _) = line.split_once(": ").expect("name and phrase");
            let (words, _) = phrase(name).expect("words and number");
            assert!(words.replace("{}", "joint 3").len() <= 35, "{words}");
        }
    }
}
