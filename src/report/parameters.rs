//! The identified parameters in people's units, and what the data could not tell.

use super::language::{Locale, say};
use super::number::{UnitFormat, exact, readings};
use crate::table::{ParameterRow, Parameters};
use serde_json::{Value, json};

pub(super) fn section(locale: &Locale, parameters: &Parameters, counting: Option<&str>) -> Value {
    let registered = parameters.effects();
    let place = |row: &ParameterRow| {
        registered
            .iter()
            .position(|effect| *effect == row.effect)
            .unwrap_or(registered.len())
    };
    let mut sorted: Vec<&ParameterRow> = parameters.0.iter().collect();
    sorted.sort_by_cached_key(|row| (place(row), row.effect.clone(), along_the_chain(&row.name)));
    let groups = sorted.chunk_by(|a, b| a.effect == b.effect);
    let groups = groups.map(|rows| {
        json!({
            "effect": rows[0].effect,
            "rows": rows.iter().map(|parameter| row(locale, parameter, rows)).collect::<Vec<_>>(),
        })
    });
    let remarked = sorted.iter().filter(|p| p.remark.is_some());
    let counting = counting.map(|difference| {
        say!(locale, "Zeros, ratios and couplings of joints stand in the robot file's counting; the controller counts otherwise ({difference}), and “calib export --format controller” writes them as it does.", difference)
    });
    json!({
        "groups": groups.collect::<Vec<_>>(),
        // In which counting the joints' parameters stand, where the controller has another one.
        "counting": counting,
        // What was not estimated, and what has a remark.
        "remarks": remarked
            .map(|p| json!({
                "name": p.name,
                "place": p.place,
                "status": known(p),
                "remark": p.remark.clone().unwrap_or_default(),
            }))
            .collect::<Vec<_>>(),
    })
}

/// How much the data tell of a parameter that was estimated, else what the step did with it.
fn known(p: &ParameterRow) -> &str {
    match &p.determined {
        Some(known) if p.status == "free" => known,
        _ => &p.status,
    }
}

/// Order of a name by its numbers (`j2` before `j10`), shifts before turns (`z` before `rx`).
fn along_the_chain(name: &str) -> Vec<(bool, String, u64)> {
    let mut parts = Vec::new();
    let mut remainder = name;
    while !remainder.is_empty() {
        let digits = remainder
            .find(|c: char| c.is_ascii_digit())
            .unwrap_or(remainder.len());
        let (text, after) = remainder.split_at(digits);
        let end = after
            .find(|c: char| !c.is_ascii_digit())
            .unwrap_or(after.len());
        let (number, next) = after.split_at(end);
        let turn = [".rx", ".ry", ".rz"]
            .iter()
            .any(|turn| text.ends_with(turn));
        parts.push((turn, text.to_owned(), number.parse().unwrap_or(0)));
        remainder = next;
    }
    parts
}

/// A parameter among those of its effect, with which it shares its decimals; one of a unit that calib does not know as it is stored.
fn row(locale: &Locale, p: &ParameterRow, group: &[&ParameterRow]) -> Value {
    let alike = || group.iter().filter(|other| other.unit == p.unit);
    let decimals = |unit: &UnitFormat| {
        let needed = alike().map(|other| unit.decimals_for(other.sigma));
        needed.max().unwrap_or_default()
    };
    let units = readings(&p.unit);
    let coarse = |value: f64| match &units {
        Some((unit, _)) => locale.decimal(unit.show(value, decimals(unit))),
        None => locale.significant(value, 6),
    };
    let change = match &units {
        Some((_, unit)) => locale.decimal(unit.show_signed(p.change, decimals(unit))),
        None => locale.significant(p.change, 4),
    };
    let sigma = |sigma: f64| match &units {
        Some((_, unit)) => locale.decimal(unit.show(sigma, decimals(unit))),
        None => locale.significant(sigma, 2),
    };
    let [unit, fine_unit] = match &units {
        Some((coarse, fine)) => [coarse, fine].map(|unit| locale.stored(unit.symbol)),
        None => [p.unit.clone(), p.unit.clone()],
    };
    let stored = exact(p.value, 7);
    json!({
        "name": p.name,
        "place": p.place,
        "nominal": coarse(p.nominal),
        "value": coarse(p.value),
        // Unit of nominal and value.
        "unit": unit,
        "change": change,
        "sigma": p.sigma.map(sigma).unwrap_or_default(),
        // Unit of change and sigma.
        "fine_unit": fine_unit,
        "status": known(p),
        "step": p.step,
        "stored": if p.unit == "1" { stored } else { format!("{stored} {}", p.unit) },
    })
}

#[cfg(test)]
mod tests {
    use super::along_the_chain;

    #[test]
    fn names_are_in_the_order_of_the_chain() {
        let mut names = [
            "j.l10.x", "j.l2.rx", "j.l2.z", "j.j12_j3", "j.j12", "j.j2", "b.rx", "b.z",
        ];
        names.sort_by_cached_key(|name| along_the_chain(name));
        assert_eq!(
            names,
            [
                "b.z", "j.j2", "j.j12", "j.j12_j3", "j.l2.z", "j.l2.rx", "j.l10.x", "b.rx"
            ]
        );
    }
}
