//! What is true of a recording, number by number.

/// A true number under its canonical name.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueValue {
    pub name: String,
    pub effect: &'static str,
    pub place: String,
    pub unit: &'static str,
    pub value: f64,
}

/// A number of the effect `effect` at `place`, named `effect.tag.number`.
pub(crate) fn true_value(
    effect: &'static str,
    tag: &str,
    place: String,
    number: &str,
    unit: &'static str,
    value: f64,
) -> TrueValue {
    let dot = if number.is_empty() { "" } else { "." };
    TrueValue {
        name: format!("{effect}.{tag}{dot}{number}"),
        effect,
        place,
        unit,
        value,
    }
}

/// Numbers of the effect `effect` at `place`: name, unit and value of each.
pub(crate) fn true_values<N: AsRef<str>>(
    effect: &'static str,
    tag: &str,
    place: &str,
    numbers: impl IntoIterator<Item = (N, &'static str, f64)>,
) -> Vec<TrueValue> {
    let value = |(number, unit, value): (N, _, _)| {
        true_value(effect, tag, place.into(), number.as_ref(), unit, value)
    };
    numbers.into_iter().map(value).collect()
}
