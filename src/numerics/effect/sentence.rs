//! What a mechanic is told of a finding: words with holes.

use super::summary::{root_of_squares, rounded};
use super::{
    Basis, Cause, Clock, ParameterEstimate, Summary, Term, Variable, figure, law_shapes, names,
    unknown,
};

/// The words in the holes of a sentence; `None` for one that is not closed.
pub(super) fn holes(sentence: &str) -> Vec<Option<&str>> {
    let parts = sentence.split('{').skip(1);
    parts
        .map(|part| part.split_once('}').map(|(word, _)| word))
        .collect()
}

/// The sentence with what is known of each word.
pub(super) fn filled(sentence: &str, known: &dyn Fn(&str) -> String) -> String {
    let mut parts = sentence.split('{');
    let mut out = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (word, tail) = part.split_once('}').unwrap_or(("", part));
        out.push_str(&known(word));
        out.push_str(tail);
    }
    out
}

/// What a cause says of a finding: its own sentence, in which `{each}` are all of its laws, or what its first law says.
pub(super) fn of(cause: &Cause, summary: &Summary) -> String {
    let terms: Vec<(&Term, Vec<&ParameterEstimate>)> = summary.estimates(cause.name).collect();
    let says = |term: &Term| cause.law(term).map_or("", |law| law.says);
    let first = terms.first().map(|(term, _)| *term);
    let text = match first.map_or("", says) {
        "" => cause.sentence,
        _ if cause.sentence.contains("{each}") => cause.sentence,
        law => law,
    };
    if text.is_empty() {
        return format!("{} at {}", cause.name, summary.place);
    }
    let all: Vec<&ParameterEstimate> = summary.parameters.iter().collect();
    let each = || {
        let one = |(term, numbers): &(&Term, Vec<&ParameterEstimate>)| {
            filled(says(term), &|word| hole(word, Some(term), numbers, summary))
        };
        terms.iter().map(one).collect::<Vec<String>>().join(", ")
    };
    filled(text, &|word| {
        if word == "each" {
            each()
        } else {
            hole(word, first, &all, summary)
        }
    })
}

/// What a word of a cause's sentence means; `1e6:2` is the first number times 1e6 with two decimals.
pub(super) fn hole(
    word: &str,
    term: Option<&Term>,
    numbers: &[&ParameterEstimate],
    summary: &Summary,
) -> String {
    let (first, clock) = (numbers.first(), summary.clock);
    let known = |text: Option<String>| text.unwrap_or_default();
    let order = || law_shapes::order(term?.basis());
    let span = || law_shapes::time_constant(term?).map(|time| clock.span(time));
    let variable = term.map(|term| term.law().first.variable);
    match word {
        "place" => summary.place.to_string(),
        "value" => summary.value(),
        "size" => summary.size(),
        "unit" => known(first.map(|number| number.unit.to_string())),
        "length" => {
            let (size, sigma) = root_of_squares(numbers);
            known(first.map(|number| format!("{} {}", rounded(size, sigma, 3), number.unit)))
        }
        "order" => known(order().map(|order| match order.fract().abs() < 1e-9 {
            true => format!("{order:.0}"),
            false => figure(order, 2),
        })),
        "twice" => known(order().map(|order| format!("{}", 2.0 * order))),
        "amplitude" => amplitude(numbers),
        "overtone" => amplitude(numbers.get(2..).unwrap_or_default()),
        "when" => known(match term.map(Term::basis) {
            Some(Basis::After { at }) => Some(clock.since(at)),
            _ => None,
        }),
        "span" => known(span()),
        "lagging" => known(span().map(|span| format!(", lagging by {span}"))),
        "travel" => known(match variable {
            Some(Variable::Slip { travel, .. }) => Some(figure(travel.to_degrees(), 1)),
            _ => None,
        }),
        "friction" => known(match variable {
            Some(Variable::Push { friction_nm, .. }) => Some(figure(friction_nm.abs(), 0)),
            _ => None,
        }),
        "pace" => match (variable, term.map(Term::basis)) {
            (_, Some(Basis::Power { exponent, .. })) if exponent < 0.7 => {
                "slower and slower".into()
            }
            (_, Some(Basis::Power { exponent, .. })) if exponent > 1.4 => {
                "faster and faster".into()
            }
            (_, Some(Basis::Power { .. })) => "steadily".into(),
            (Some(Variable::Work { .. }), _) => {
                format!(
                    "at its hardest work, decaying with a time constant of {}",
                    known(span())
                )
            }
            (Some(Variable::Lagging { .. }), _) => {
                format!("per kelvin, lagging by {}", known(span()))
            }
            (_, Some(Basis::Settling { .. })) => {
                format!("in the end with a time constant of {}", known(span()))
            }
            _ => "for each kelvin".into(),
        },
        "sides" => match summary
            .terms(names::UNKNOWN)
            .any(|term| term.law().times.is_some())
        {
            true => ", and another one to each side of approach".into(),
            false => String::new(),
        },
        "law" => known(unknown::described(summary)),
        "rows" if clock == Clock::Rows => " over the recording's rows".into(),
        number => {
            let scaled = || {
                let (scale, decimals) = number.split_once(':')?;
                let (first, scale) = (first?, scale.parse::<f64>().ok()?);
                let sigma = first.sigma.map(|sigma| sigma * scale.abs());
                Some(rounded(first.value * scale, sigma, decimals.parse().ok()?))
            };
            known(scaled())
        }
    }
}

/// The amplitude of a sine and a cosine, the first two of some numbers.
fn amplitude(numbers: &[&ParameterEstimate]) -> String {
    match numbers {
        [a, b, ..] => {
            let (size, sigma) = root_of_squares(&[a, b]);
            format!("{} {}", rounded(size, sigma, 0), a.unit)
        }
        _ => String::new(),
    }
}
