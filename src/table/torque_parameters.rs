//! The identified model of torques: one table from which it is made again, and its covariance.

use super::{TorqueCovariance, TorqueCovarianceRow, TorqueParameterRow, TorqueParameters};
use crate::dynamics::{
    COULOMB, INERTIAL_NAMES, INERTIAL_NUMBERS, JointRange, TorqueModel, TorqueTerm, unit_at,
};
use crate::effect::{DeclaredTorque, EffectDeclaration, Place};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a cause has besides its coefficients.
#[derive(Serialize, Deserialize)]
struct TermForm {
    with: [usize; 2],
    shape: Vec<f64>,
    /// The law of a user's own that it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    declared: Option<EffectDeclaration>,
}

/// Standard deviations from which on dry friction is sure.
const SURE: f64 = 3.0;
const LINKS: &str = "rigid_body";
const SEEN: &str = "recording";
/// Numbers of a joint's range, in the order of [`ends`].
const RANGE: [(&str, &str); 8] = [
    ("position_least", "rad"),
    ("position_greatest", "rad"),
    ("speed_greatest", "rad/s"),
    ("acceleration_greatest", "rad/s2"),
    ("load_greatest", "Nm"),
    ("misfit", "Nm"),
    ("u95_usual", "Nm"),
    ("sign_width", "rad/s"),
];
/// Unit of the position of a joint that slides.
const SLIDES: &str = "m";
/// Numbers of the recording as a whole: width of a sign, latency, cut-off, by how much friction turns before the velocity.
const WHOLE: [(&str, &str); 4] = [
    ("sign_width", "rad/s"),
    ("latency", "s"),
    ("cutoff", "Hz"),
    ("friction_lead", "s"),
];

/// Where it was recorded, C.
const TEMPERATURE: [&str; 2] = ["temperature_least", "temperature_greatest"];

fn ends(range: &JointRange) -> [f64; 8] {
    let [least, greatest] = range.position;
    [
        least,
        greatest,
        range.speed,
        range.acceleration,
        range.load,
        range.misfit,
        range.usual,
        range.sign_width,
    ]
}

fn fault(message: String) -> Error {
    Error::data("table torque_parameters", message)
}

impl TorqueParameters {
    /// The table of a model. Fails where a term has no cause.
    pub fn of(model: &TorqueModel) -> Result<Self> {
        let names = model.names()?;
        let width = names.len();
        let mut numbers = names.iter().enumerate().map(|(number, (name, unit))| {
            let sigma = model
                .covariance
                .get(number * (width + 1))
                .map(|variance| variance.max(0.0).sqrt());
            (name.clone(), (*unit).to_string(), sigma)
        });
        let row = |(name, unit, sigma): (String, String, Option<f64>),
                   effect: &str,
                   place: Place,
                   value| {
            TorqueParameterRow {
                quantity: name.rsplit('.').next().unwrap_or_default().to_string(),
                effect: effect.into(),
                place: place.to_string(),
                name,
                value,
                unit,
                sigma,
                ..TorqueParameterRow::default()
            }
        };
        let mut rows = Vec::with_capacity(width);
        let known = (0..model.inertials.len()).filter(|number| model.identified[*number]);
        for (number, named) in known.zip(numbers.by_ref()) {
            let link = number / INERTIAL_NUMBERS;
            let place = Place::Links(link, link);
            rows.push(TorqueParameterRow {
                quantity: INERTIAL_NAMES[number % INERTIAL_NUMBERS].into(),
                ..row(named, LINKS, place, model.inertials[number])
            });
        }
        for term in &model.terms {
            let form = serde_json::to_string(&TermForm {
                with: term.with,
                shape: term.shape.clone(),
                declared: term.declared.as_ref().map(|law| law.declaration().clone()),
            });
            let form = form.map_err(|error| Error::Bug(error.to_string()))?;
            for (value, named) in term.coefficients.iter().zip(numbers.by_ref()) {
                rows.push(TorqueParameterRow {
                    rms_nm: Some(term.rms),
                    form: Some(form.clone()),
                    ..row(named, &term.effect, term.place, *value)
                });
            }
        }
        for term in &model.terms {
            let shape = term.shape_numbers()?.into_iter().zip(numbers.by_ref());
            rows.extend(shape.map(|(value, named)| row(named, &term.effect, term.place, value)));
        }
        rows.extend(seen(model));
        // The last number of the covariance is the width of a sign.
        if let Some((name, _, sigma)) = numbers.next() {
            rows.iter_mut()
                .filter(|row| row.name == name)
                .for_each(|row| row.sigma = sigma);
        }
        Ok(Self(rows))
    }

    /// Dry friction of each joint (n, Nm); `None` where none was found, or less than is sure: what an arm has in the model without a name may
    /// as well be nothing, and says nothing of where a joint rests.
    pub fn dry_friction(&self, joints: usize) -> Vec<Option<f64>> {
        let at = |joint: usize| {
            let place = Place::Joint(joint).to_string();
            let here = |row: &&TorqueParameterRow| {
                row.effect == COULOMB && row.place == place && row.form.is_some()
            };
            let entry = self.0.iter().find(here)?;
            (entry.value > SURE * entry.sigma.unwrap_or(0.0)).then_some(entry.value)
        };
        (0..joints).map(at).collect()
    }

    /// The model, without its covariance. Fails where rows that every model has are missing or not understood.
    pub fn to_model(&self) -> Result<TorqueModel> {
        let joints = (1..)
            .take_while(|joint| {
                self.value(&format!("{SEEN}.j{joint}.{}", RANGE[0].0))
                    .is_ok()
            })
            .count();
        if joints == 0 {
            return Err(fault(
                "has no row recording.j1.position_least: it is no model of torques".into(),
            ));
        }
        let mut model = TorqueModel {
            inertials: vec![0.0; INERTIAL_NUMBERS * joints],
            identified: vec![false; INERTIAL_NUMBERS * joints],
            terms: Vec::new(),
            covariance: Vec::new(),
            sign_width: self.value(&format!("{SEEN}.{}", WHOLE[0].0))?,
            latency: self.value(&format!("{SEEN}.{}", WHOLE[1].0))?,
            cutoff: self.value(&format!("{SEEN}.{}", WHOLE[2].0))?,
            // Tables of before it was written say nothing of it.
            friction_lead: self.value(&format!("{SEEN}.{}", WHOLE[3].0)).unwrap_or(0.0),
            range: (1..=joints)
                .map(|joint| self.range(joint))
                .collect::<Result<_>>()?,
            temperature: self.temperature(),
        };
        for row in self.0.iter().filter(|row| row.effect == LINKS) {
            let link = match row.place.parse() {
                Ok(Place::Links(link, _)) if link < joints => link,
                _ => {
                    return Err(fault(format!(
                        "{}: `{}` is no link of {joints}",
                        row.name, row.place
                    )));
                }
            };
            let number = INERTIAL_NAMES.iter().position(|name| *name == row.quantity);
            let number = number.ok_or_else(|| {
                fault(format!(
                    "{}: `{}` is no inertial number",
                    row.name, row.quantity
                ))
            })?;
            model.inertials[INERTIAL_NUMBERS * link + number] = row.value;
            model.identified[INERTIAL_NUMBERS * link + number] = true;
        }
        let mut terms: BTreeMap<&str, Vec<&TorqueParameterRow>> = BTreeMap::new();
        // Shape numbers are in the form of each coefficient.
        for row in self
            .0
            .iter()
            .filter(|row| row.effect != LINKS && row.effect != SEEN && row.form.is_some())
        {
            let prefix = row
                .name
                .strip_suffix(row.quantity.as_str())
                .unwrap_or(&row.name);
            terms.entry(prefix).or_default().push(row);
        }
        model.terms = terms
            .values()
            .map(|rows| term(rows))
            .collect::<Result<_>>()?;
        Ok(model)
    }

    fn value(&self, name: &str) -> Result<f64> {
        let row = self.0.iter().find(|row| row.name == name);
        row.map(|row| row.value)
            .ok_or_else(|| fault(format!("has no row {name}")))
    }

    fn range(&self, joint: usize) -> Result<JointRange> {
        let of_quantity = |quantity: &str| self.value(&format!("{SEEN}.j{joint}.{quantity}"));
        let position_name = format!("{SEEN}.j{joint}.{}", RANGE[0].0);
        let [least, greatest, speed, acceleration] =
            [RANGE[0].0, RANGE[1].0, RANGE[2].0, RANGE[3].0].map(of_quantity);
        // Tables of before these were written say nothing of them.
        let [load, misfit, usual] = [
            (RANGE[4].0, f64::INFINITY),
            (RANGE[5].0, 0.0),
            (RANGE[6].0, 0.0),
        ]
        .map(|(quantity, unknown)| of_quantity(quantity).unwrap_or(unknown));
        let sign_width =
            of_quantity(RANGE[7].0).or_else(|_| self.value(&format!("{SEEN}.{}", WHOLE[0].0)))?;
        let position = [least?, greatest?];
        Ok(JointRange {
            position,
            speed: speed?,
            acceleration: acceleration?,
            load,
            misfit,
            usual,
            sign_width,
            slides: self
                .0
                .iter()
                .any(|row| row.name == position_name && row.unit == SLIDES),
        })
    }

    fn temperature(&self) -> Option<[f64; 2]> {
        let [least, greatest] =
            TEMPERATURE.map(|quantity| self.value(&format!("{SEEN}.{quantity}")).ok());
        Some([least?, greatest?])
    }
}

/// How and in which motion a model was seen.
fn seen(model: &TorqueModel) -> Vec<TorqueParameterRow> {
    let row = |name: String, place: Place, (quantity, unit): (&str, &str), value: f64| {
        TorqueParameterRow {
            name,
            effect: SEEN.into(),
            place: place.to_string(),
            quantity: quantity.into(),
            value,
            unit: unit.into(),
            ..TorqueParameterRow::default()
        }
    };
    let whole = WHOLE.iter().zip([
        model.sign_width,
        model.latency,
        model.cutoff,
        model.friction_lead,
    ]);
    let whole = whole.map(|(named, value)| {
        row(
            format!("{SEEN}.{}", named.0),
            Place::Recording,
            *named,
            value,
        )
    });
    let ranges = model.range.iter().enumerate().flat_map(|(joint, range)| {
        let of_named = move |(&(name, unit), value): (&(&'static str, &'static str), f64)| {
            row(
                format!("{SEEN}.j{}.{name}", joint + 1),
                Place::Joint(joint),
                (name, unit_at(range.slides, unit)),
                value,
            )
        };
        RANGE
            .iter()
            .zip(ends(range))
            .map(of_named)
            .collect::<Vec<_>>()
    });
    let temperature = TEMPERATURE
        .iter()
        .zip(model.temperature.into_iter().flatten());
    let temperature = temperature.map(|(quantity, value)| {
        row(
            format!("{SEEN}.{quantity}"),
            Place::Recording,
            (quantity, "C"),
            value,
        )
    });
    whole.chain(ranges).chain(temperature).collect()
}

/// A cause from its rows.
fn term(rows: &[&TorqueParameterRow]) -> Result<TorqueTerm> {
    let first = rows[0];
    let place = first
        .place
        .parse()
        .map_err(|()| fault(format!("{}: `{}` is no place", first.name, first.place)))?;
    let form = first.form.as_deref().unwrap_or_default();
    let form: TermForm = serde_json::from_str(form)
        .map_err(|error| fault(format!("{}: form `{form}`: {error}", first.name)))?;
    let declared = form.declared.as_ref().map(DeclaredTorque::of).transpose();
    let declared = declared.map_err(|faults| {
        let messages: Vec<String> = faults.into_iter().map(|fault| fault.message).collect();
        fault(format!("{}: {}", first.name, messages.join("; ")))
    })?;
    let mut term = TorqueTerm {
        declared,
        effect: first.effect.clone(),
        place,
        with: form.with,
        shape: form.shape,
        coefficients: vec![0.0; rows.len()],
        rms: first.rms_nm.unwrap_or(0.0),
    };
    let names = term.names()?;
    for (value, (quantity, _)) in term.coefficients.iter_mut().zip(&names) {
        let row = rows.iter().find(|row| row.quantity == *quantity);
        *value = row
            .ok_or_else(|| fault(format!("{}: has no {quantity}", first.name)))?
            .value;
    }
    Ok(term)
}

impl TorqueCovariance {
    /// The covariance of a model. Fails where a term has no cause.
    pub fn of(model: &TorqueModel) -> Result<Self> {
        let names = model.names()?;
        let width = names.len();
        let mut rows = Vec::with_capacity(width * (width + 1) / 2);
        for a in 0..width {
            for b in a..width {
                let covariance = model.covariance[a * width + b];
                let scale = (model.covariance[a * (width + 1)] * model.covariance[b * (width + 1)])
                    .max(0.0)
                    .sqrt();
                let correlation = if a == b {
                    1.0
                } else if scale > 0.0 {
                    covariance / scale
                } else {
                    0.0
                };
                let [first, second] = if names[a].0 <= names[b].0 {
                    [a, b]
                } else {
                    [b, a]
                }
                .map(|place| names[place].0.clone());
                rows.push(TorqueCovarianceRow {
                    parameter: first,
                    other: second,
                    covariance,
                    correlation,
                });
            }
        }
        Ok(Self(rows))
    }

    /// Covariance of a model's numbers in the order of its names, row-major. Fails where a pair is missing or a term has no cause.
    pub fn of_model(&self, model: &TorqueModel) -> Result<Vec<f64>> {
        let names = model.names()?;
        let width = names.len();
        let places: BTreeMap<&str, usize> = names
            .iter()
            .enumerate()
            .map(|(place, (name, _))| (name.as_str(), place))
            .collect();
        let mut all = vec![f64::NAN; width * width];
        for row in &self.0 {
            if let (Some(a), Some(b)) = (
                places.get(row.parameter.as_str()),
                places.get(row.other.as_str()),
            ) {
                (all[a * width + b], all[b * width + a]) = (row.covariance, row.covariance);
            }
        }
        match all.iter().position(|value| value.is_nan()) {
            None => Ok(all),
            Some(entry) => {
                let [one, other] = [entry / width, entry % width].map(|place| &names[place].0);
                Err(Error::data(
                    "table torque_covariance",
                    format!("has no covariance of {one} and {other}"),
                ))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_that_may_as_well_be_nothing_is_none() {
        let row = |joint: usize, value: f64, sigma: Option<f64>| TorqueParameterRow {
            name: format!("coulomb_friction.j{joint}.coulomb"),
            effect: COULOMB.into(),
            place: format!("joint {joint}"),
            quantity: "coulomb".into(),
            value,
            unit: "Nm".into(),
            sigma,
            rms_nm: Some(1.0),
            form: Some("{}".into()),
            ..TorqueParameterRow::default()
        };
        let all = TorqueParameters(vec![
            row(1, 6.0, Some(0.1)),
            row(2, 0.2, Some(0.1)),
            row(4, 2.0, None),
        ]);
        assert_eq!(all.dry_friction(4), [Some(6.0), None, None, Some(2.0)]);
    }
}
