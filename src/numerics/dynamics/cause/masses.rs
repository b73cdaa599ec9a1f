//! Bodies, a mounting, motors and drives that are not as declared.

use super::InertialChanges;
use super::{
    ColumnTorque, FittedNumber, PLAIN, SEEN, TorqueCause, TorqueForm, at_each_joint, at_each_link,
    plain, scaled, shape, size_of_two, span,
};
use crate::arm::{
    DynamicArm, INERTIAL_NAMES, INERTIAL_NUMBERS, Inertial, inertial_unit, numbers, unit_number,
};
use crate::effect::Place;
use crate::recording::largest;
use crate::scene::DynamicScene;
use nalgebra::{Matrix3, Vector3};

/// kg: less is nothing to have a centre.
const LIGHTEST: f64 = 0.1;
/// m by which a payload's centre is elsewhere, at most.
const PAYLOAD_FARTHEST: f64 = 0.5;
pub(crate) const CENTRE: [&str; 3] = ["centre_x", "centre_y", "centre_z"];
/// Entries of an inertia tensor.
const INERTIA: usize = INERTIAL_NUMBERS - 4;
/// Mass at the declared centre; mass and centre; all ten numbers.
const PAYLOADS: [usize; 3] = [1, 4, INERTIAL_NUMBERS];

/// A payload that is not the declared one. Shape: declared mass, kg; its centre and the tool from the last joint's point, m. In three columns
/// it is a point on the way to the tool, as of [`ADDED_MASS`], where no payload is declared.
pub(crate) static PAYLOAD: TorqueCause = TorqueCause {
    name: "payload_error",
    follows: |_| "own angle",
    price: |_| 4.0,
    rich: |form| form.width != POINT,
    inertial: true,
    forms: |cause, scene| {
        let arm = scene.arm;
        let mass = arm.payload.map_or(0.0, |payload| payload.mass);
        let point = arm.points[arm.joints() - 1];
        let centre = arm.payload.filter(|_| mass > 0.0);
        let centre = centre.map_or(arm.tool, |payload| payload.centre) - point;
        let tool = arm.tool - point;
        let shape = [&[mass][..], centre.as_slice(), tool.as_slice()].concat();
        let form = |width| TorqueForm {
            place: Place::Tool,
            ..TorqueForm::at_joint(cause, 0, width).shaped(&shape)
        };
        let point = (mass == 0.0 && tool.norm() > SHORTEST).then_some(POINT);
        let widths = || PAYLOADS.into_iter().chain(point);
        let declared = scene.declared.iter();
        declared.flat_map(|_| widths().map(form)).collect()
    },
    is_possible: |form, values| {
        if form.width == POINT {
            return is_on_way(part(form, 4).norm(), values);
        }
        let whole = form.shape[0] + values[0];
        // Where no payload is declared nothing can be taken off: no body has less than no inertia.
        if form.width == INERTIAL_NUMBERS && form.shape[0] == 0.0 {
            return whole > -LIGHTEST && values[4] + values[7] + values[9] >= 0.0;
        }
        // The same of mass and centre, about the last joint.
        let (arm, moments) = (part(form, 1), &values[1..]);
        if form.width == 4 && form.shape[0] == 0.0 {
            let shift = arm.dot(&Vector3::from_row_slice(moments));
            if values[0] * arm.norm_squared() + 2.0 * shift < 0.0 {
                return false;
            }
        }
        let is_near = |moment: &f64| moment.abs() < PAYLOAD_FARTHEST * whole.max(LIGHTEST);
        whole > -LIGHTEST && (form.width == INERTIAL_NUMBERS || values[1..].iter().all(is_near))
    },
    changes: Some(|form, declared| {
        let last = declared.tolerance.len() - 1;
        if form.width == POINT {
            return along(last, &part(form, 4)).to_vec();
        }
        let column = |number: usize| match number {
            _ if form.width == INERTIAL_NUMBERS => unit_number(number),
            0 => declared.payload,
            axis => declared.payload_shift[axis - 1],
        };
        (0..form.width)
            .map(|number| (last, column(number)))
            .collect()
    }),
    parameters: |form, fitted| {
        if form.width == POINT {
            return point_parameters(part(form, 4).norm(), fitted);
        }
        if let Some(moment) = unseen_mass(form, fitted) {
            return vec![plain("moment", moment, "kg m")];
        }
        let mut all = vec![plain("mass", fitted[0], "kg")];
        let others = &fitted[1..];
        // What a payload without its mass would be at: the moment that is found, of all the mass that is there.
        let whole = (form.shape[0] + fitted[0].value).abs().max(LIGHTEST);
        if form.width == INERTIAL_NUMBERS {
            for (numbers, loose) in [
                (1..4, whole * SHORT_ARM),
                (4..INERTIAL_NUMBERS, whole * SHORT_ARM * SHORT_ARM),
            ] {
                let unit = inertial_unit(numbers.start);
                let named = numbers.map(|number| (INERTIAL_NAMES[number], fitted[number]));
                let told = told(named, loose).into_iter();
                all.extend(told.map(|(name, value)| plain(name, value, unit)));
            }
        } else if !others.is_empty() {
            let centre = CENTRE.into_iter().zip(others);
            let in_mm = centre.map(|(name, number)| (name, scaled(number, 1e3 / whole)));
            let told = told(in_mm, 1e3 * SHORT_ARM).into_iter();
            all.extend(told.map(|(name, value)| plain(name, value, "mm")));
        }
        all
    },
    statement: |form, fitted, _| {
        let lever = part(form, 4).norm();
        if form.width == POINT {
            return point_statement("the last link carries", lever, fitted);
        }
        if let Some(moment) = unseen_mass(form, fitted) {
            let at_tool = match lever > SHORTEST {
                true => format!(
                    ": {} if at the tool",
                    grams(scaled(&moment, 1.0 / lever), "")
                ),
                false => String::new(),
            };
            return format!(
                "what the last link carries has a moment of {} more about its joint than declared{at_tool}; its mass is not seen",
                grams(moment, " m")
            );
        }
        let mass = fitted[0].value;
        let more = if mass >= 0.0 { "more" } else { "less" };
        let centre = match (form.width > 1, form.shape[0] > 0.0) {
            (true, _) => ", its centre elsewhere",
            (false, true) => "",
            (false, false) => ", as a point at the tool",
        };
        let size = FittedNumber {
            value: mass.abs(),
            ..fitted[0]
        };
        format!(
            "the payload is {} {more} than declared{centre}",
            grams(size, "")
        )
    },
    ..PLAIN
};

/// Columns of a point along a link.
const POINT: usize = 3;
/// m: what is carried stands out by as much at least.
const SHORT_ARM: f64 = 0.1;
/// Share of a place beyond which it is not told.
const PRECISE: f64 = 0.2;

/// Three shape numbers as a vector.
fn part(form: &TorqueForm, first: usize) -> Vector3<f64> {
    Vector3::from_row_slice(&form.shape[first..first + 3])
}

/// Numbers that are told: those that the data see and those that are known to within `loose`; the best known where there are none. What is
/// not seen is no number.
fn told<'n>(
    named: impl Iterator<Item = (&'n str, FittedNumber)>,
    loose: f64,
) -> Vec<(&'n str, FittedNumber)> {
    let (told, unseen): (Vec<_>, Vec<_>) =
        named.partition(|(_, number)| number.is_seen() || number.sigma < loose);
    if !told.is_empty() {
        return told;
    }
    let share = |number: &FittedNumber| number.sigma / number.value.abs().max(f64::MIN_POSITIVE);
    let best = unseen.into_iter();
    let best = best.min_by(|a, b| share(&a.1).total_cmp(&share(&b.1)));
    best.into_iter().collect()
}

/// The moment about the last joint's point, kg m, of a payload whose mass the data do not see beside it.
fn unseen_mass(form: &TorqueForm, fitted: &[FittedNumber]) -> Option<FittedNumber> {
    if form.width == 1 {
        return None;
    }
    let (mass, moments) = (fitted[0], &fitted[1..4]);
    let from_mass = match form.width == INERTIAL_NUMBERS {
        true => Vector3::zeros(),
        false => mass.value * part(form, 1),
    };
    let moment = Vector3::from_fn(|axis, _| from_mass[axis] + moments[axis].value);
    let variance = moments.iter().map(|moment| moment.sigma.powi(2));
    let moment = FittedNumber {
        value: moment.norm(),
        sigma: variance.sum::<f64>().sqrt(),
    };
    let lever = part(form, 4).norm().max(SHORT_ARM);
    let is_small = mass.sigma > 0.0 && mass.sigma * lever < SEEN * moment.value;
    let is_unseen = !mass.is_seen() && !is_small && moment.is_seen();
    is_unseen.then_some(moment)
}

/// `1.20 kg`, or `105 +- 1 g` below a kilogram; the rest of the unit follows.
fn grams(number: FittedNumber, rest: &str) -> String {
    match number.value.abs() < 1.0 {
        true if number.sigma > 0.0 => {
            let (value, sigma) = (1e3 * number.value, 1e3 * number.sigma);
            let decimals = usize::from(sigma < 1.0);
            format!("{value:.decimals$} +- {sigma:.decimals$} g{rest}")
        }
        true => format!("{:.0} g{rest}", 1e3 * number.value),
        false => format!("{} kg{rest}", number.rounded()),
    }
}

/// Whether mass, moment and inertia along a way are those of a point on it.
fn is_on_way(length: f64, values: &[f64]) -> bool {
    let [mass, moment, inertia] = [values[0], values[1], values[2]];
    let is_there = |distance: f64| (-OVERHANG..1.0 + OVERHANG).contains(&(distance / length));
    let by_mass = mass == 0.0 || is_there(moment / mass);
    by_mass && (moment == 0.0 || inertia == 0.0 || is_there(inertia / moment))
}

/// What is seen of a point on a way: mass and place, or its moment with the mass and place that inertia says.
fn seen_point(length: f64, fitted: &[FittedNumber]) -> [Option<FittedNumber>; 3] {
    let [mass, moment, inertia] = [fitted[0], fitted[1], fitted[2]];
    let ratio = |a: FittedNumber, b: FittedNumber| FittedNumber {
        value: a.value / b.value,
        sigma: (a.value / b.value).abs() * (a.sigma / a.value).hypot(b.sigma / b.value),
    };
    if mass.is_seen() && (mass.sigma < PRECISE * mass.value.abs() || !moment.is_seen()) {
        let place = moment.is_seen().then(|| ratio(moment, mass));
        return [Some(mass), None, place];
    }
    let place = (moment.is_seen() && inertia.is_seen()).then(|| ratio(inertia, moment));
    let place = place.filter(|place| place.sigma < PRECISE * length);
    let point = place.map(|place| ratio(moment, place));
    [point, Some(moment), place]
}

fn point_parameters(length: f64, fitted: &[FittedNumber]) -> Vec<super::TorqueParameter> {
    let [mass, moment, place] = seen_point(length, fitted);
    let mass = mass.map(|mass| plain("mass", mass, "kg"));
    let moment = moment.map(|moment| plain("moment", moment, "kg m"));
    let place = place.map(|place| plain("distance", scaled(&place, 1e3), "mm"));
    [mass, moment, place].into_iter().flatten().collect()
}

fn point_statement(what: &str, length: f64, fitted: &[FittedNumber]) -> String {
    let at = |place: Option<FittedNumber>| {
        place.map_or_else(String::new, |place| {
            format!(", {:.0} mm from its joint", 1e3 * place.value)
        })
    };
    match seen_point(length, fitted) {
        [Some(mass), None, place] => format!("{what} {}{}", grams(mass, ""), at(place)),
        [mass, Some(moment), place] => {
            let size = grams(moment, " m");
            let point = match mass {
                Some(mass) => format!("{}{}", grams(mass, ""), at(place)),
                None => {
                    let end = grams(scaled(&moment, 1.0 / length), "");
                    format!(
                        "{end} if at the end of the link, {:.0} mm out",
                        1e3 * length
                    )
                }
            };
            format!("{what} something with a moment of {size} about its joint: {point}")
        }
        _ => format!("{what} something"),
    }
}

/// A point mass on a link, its place along the link free. Coefficients: mass, mass times distance from the joint's point, mass times its
/// square. Shape: from the joint's point to the next one, to the tool of the last link, m.
pub(crate) static ADDED_MASS: TorqueCause = TorqueCause {
    name: "added_mass",
    follows: |_| "own angle",
    coefficients: &[("mass", "kg"), ("moment", "kg m"), ("inertia", "kg m2")],
    price: |_| 10.0,
    inertial: true,
    is_possible: |form, values| is_on_way(part(form, 0).norm(), values),
    ..PLAIN
};

/// Points on the links before the last, where masses are declared; what the last one carries is payload.
fn points_on_links(cause: &'static TorqueCause, scene: &DynamicScene) -> Vec<TorqueForm> {
    let last = scene.joints() - 1;
    let all = scene.declared.iter();
    let all = all.flat_map(|_| masses_on_links(cause, scene.arm));
    all.map(|(form, _)| form)
        .filter(|form| form.link() < last)
        .collect()
}

/// Share of a link's length by which what is on it may stand over.
const OVERHANG: f64 = 0.2;
/// m: shorter links have no place along them.
const SHORTEST: f64 = 1e-3;

/// A mass on each link that has a length, with the changes of its numbers.
pub(crate) fn masses_on_links(
    cause: &'static TorqueCause,
    arm: &DynamicArm,
) -> Vec<(TorqueForm, InertialChanges)> {
    let ends = arm.points.iter().skip(1).chain([&arm.tool]);
    let spans = arm.points.iter().zip(ends).map(|(from, to)| to - from);
    let links = spans.enumerate().filter(|(_, span)| span.norm() > SHORTEST);
    let of_link = |(link, span): (usize, Vector3<f64>)| {
        let form = TorqueForm {
            place: Place::Links(link, link),
            ..TorqueForm::at_joint(cause, link, POINT).shaped(span.as_slice())
        };
        (form, along(link, &span).to_vec())
    };
    links.map(of_link).collect()
}

/// Changes of a link's numbers by a point on a way from its joint's point: mass, moment and inertia.
fn along(link: usize, way: &Vector3<f64>) -> [(usize, [f64; INERTIAL_NUMBERS]); POINT] {
    let point = Inertial {
        mass: 1.0,
        centre: way.normalize().into(),
        inertia: Matrix3::zeros(),
    };
    let at_one = numbers(&point, &Vector3::zeros());
    let part = |kept: std::ops::Range<usize>| {
        let of = |k: usize| if kept.contains(&k) { at_one[k] } else { 0.0 };
        (link, std::array::from_fn(of))
    };
    [part(0..1), part(1..4), part(4..INERTIAL_NUMBERS)]
}

/// Shares of the declared mass: what errs by more is no error of a declaration.
const MASSES: std::ops::RangeInclusive<f64> = -0.7..=1.0;

/// A link that is heavier or lighter than declared: all its numbers in proportion, or in three columns by what is bolted on at a point of it, as
/// of [`ADDED_MASS`].
pub(super) static LINK_MASS: TorqueCause = TorqueCause {
    name: "link_mass",
    follows: |_| "own angle",
    inertial: true,
    forms: |cause, scene| {
        let mut forms = at_each_link(cause, scene, 1);
        forms.extend(points_on_links(cause, scene));
        forms
    },
    is_possible: |form, values| match form.width {
        POINT => is_on_way(part(form, 0).norm(), values),
        _ => MASSES.contains(&values[0]),
    },
    changes: Some(|form, declared| {
        if form.width == POINT {
            return along(form.link(), &part(form, 0)).to_vec();
        }
        let link = &declared.links[INERTIAL_NUMBERS * form.link()..];
        vec![(form.link(), std::array::from_fn(|number| link[number]))]
    }),
    parameters: |form, fitted| match form.width {
        POINT => point_parameters(part(form, 0).norm(), fitted),
        _ => vec![plain("relative", fitted[0], "1")],
    },
    statement: |form, fitted, _| {
        if form.width == POINT {
            let what = format!("{} carries", form.place);
            return point_statement(&what, part(form, 0).norm(), fitted);
        }
        format!(
            "{} weighs {:+.1} % against what is declared",
            form.place,
            100.0 * fitted[0].value
        )
    },
    ..PLAIN
};

/// m: farther off is no error of a declaration.
const FARTHEST: f64 = 0.2;

/// m: as far as declared centres are off without being a finding, as a rule.
const LOOSE: f64 = 0.01;

/// Coordinates, mm, by which a centre is seen to be elsewhere.
fn shifts_in_mm(fitted: &[FittedNumber]) -> Vec<(&'static str, FittedNumber)> {
    let centre = CENTRE.into_iter().zip(fitted);
    let in_mm = centre.map(|(name, number)| (name, scaled(number, 1e3)));
    told(in_mm, 1e3 * LOOSE)
}

/// Numbers about the joint's point by which an inertia is seen to be off, kg m2.
fn seen_inertias(fitted: &[FittedNumber]) -> Vec<(&'static str, FittedNumber)> {
    let names = INERTIAL_NAMES[4..].iter().copied();
    told(names.zip(fitted.iter().copied()), 0.0)
}

/// A link whose centre of mass is elsewhere, by three coordinates.
pub(super) static LINK_CENTRE: TorqueCause = TorqueCause {
    name: "link_com",
    follows: |_| "own angle",
    price: |_| 8.0,
    inertial: true,
    forms: |cause, scene| at_each_link(cause, scene, 3),
    is_possible: |_, values| values.iter().all(|shift| shift.abs() < FARTHEST),
    changes: Some(|form, declared| {
        let shifts = declared.centre_shift[form.link()].iter();
        shifts.map(|ten| (form.link(), *ten)).collect()
    }),
    parameters: |_, fitted| {
        let told = shifts_in_mm(fitted).into_iter();
        told.map(|(name, value)| plain(name, value, "mm")).collect()
    },
    statement: |form, fitted, _| {
        let told = shifts_in_mm(fitted);
        if told.len() == CENTRE.len() {
            let [x, y, z] = [0, 1, 2].map(|axis| told[axis].1.value);
            return format!(
                "the centre of mass of {} is ({x:.1}, {y:.1}, {z:.1}) mm from where it is declared",
                form.place
            );
        }
        let parts = told.iter().map(|(name, value)| {
            let axis = name.rsplit('_').next().unwrap_or_default();
            format!("{} mm along {axis}", value.rounded())
        });
        format!(
            "the centre of mass of {} is {} from where it is declared; how far it is off elsewhere is not seen",
            form.place,
            parts.collect::<Vec<_>>().join(" and ")
        )
    },
    ..PLAIN
};

/// A link whose inertia is not the declared one: six numbers about the joint's point.
pub(super) static LINK_INERTIA: TorqueCause = TorqueCause {
    name: "link_inertia",
    follows: |_| "acceleration",
    price: |_| 8.0,
    inertial: true,
    forms: |cause, scene| at_each_link(cause, scene, INERTIA),
    changes: Some(|form, _| {
        let numbers = 4..INERTIAL_NUMBERS;
        numbers
            .map(|number| (form.link(), unit_number(number)))
            .collect()
    }),
    parameters: |_, fitted| {
        let told = seen_inertias(fitted).into_iter();
        told.map(|(name, value)| plain(name, value, "kg m2"))
            .collect()
    },
    statement: |form, fitted, _| {
        let told = seen_inertias(fitted);
        let values = told.iter().map(|(_, number)| number);
        let largest = values.max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
        format!(
            "the inertia of {} is off, by up to {} kg m2",
            form.place,
            largest.map_or_else(String::new, FittedNumber::rounded)
        )
    },
    ..PLAIN
};

/// rad, with its standard deviation.
fn tilt(fitted: &[FittedNumber]) -> FittedNumber {
    let side = size_of_two(fitted);
    FittedNumber {
        value: side.value.min(1.0).asin(),
        ..side
    }
}

/// A base that does not stand as declared: gravity from the side, along two directions across the declared one, over its length. Mounts that are
/// turned by more than some degrees are refused before.
pub(super) static GRAVITY_DIRECTION: TorqueCause = TorqueCause {
    name: "gravity_direction",
    follows: |_| "own angle",
    coefficients: &[("side_x", "1"), ("side_y", "1")],
    price: |_| 4.0,
    rich: |_| true,
    inertial: true,
    of_rigid: true,
    forms: |cause, scene| {
        let form = |_| TorqueForm {
            place: Place::Base,
            ..TorqueForm::at_joint(cause, 0, 2)
        };
        let declared = scene.declared.iter().map(form);
        match scene.arm.gravity.norm() > 0.0 {
            true => declared.collect(),
            false => Vec::new(),
        }
    },
    torque: ColumnTorque::Row(|column, row| {
        column.scene.sideways[column.column][column.joint][row]
    }),
    parameters: |_, fitted| {
        let azimuth = fitted[1].value.atan2(fitted[0].value).to_degrees();
        let degrees = 1f64.to_degrees();
        vec![
            plain("tilt", scaled(&tilt(fitted), degrees), "deg"),
            shape("azimuth", azimuth, "deg"),
        ]
    },
    statement: |_, fitted, _| {
        let azimuth = fitted[1].value.atan2(fitted[0].value).to_degrees();
        format!(
            "the base is tilted by {} deg: gravity pulls towards {azimuth:.0} deg of the plane across the declared one",
            scaled(&tilt(fitted), 1f64.to_degrees()).rounded()
        )
    },
    ..PLAIN
};

/// Its name.
pub(crate) const ROTOR: &str = "rotor_inertia";
/// Its name.
pub(crate) const TORQUE_CONSTANT: &str = "torque_constant";

/// Inertia of a motor and its gear, as the joint feels it.
pub(super) static ROTOR_INERTIA: TorqueCause = TorqueCause {
    name: ROTOR,
    follows: |_| "acceleration",
    coefficients: &[("inertia", "kg m2")],
    price: |_| 2.0,
    rich: |_| true,
    inertial: true,
    positive: true,
    torque: ColumnTorque::Row(|column, row| column.scene.acceleration[column.form.joint()][row]),
    statement: |form, fitted, unit| {
        format!(
            "the rotor of {} adds an inertia of {:.4} {} at the joint",
            form.place,
            fitted[0].value,
            unit("kg m2")
        )
    },
    ..PLAIN
};

/// Shares of the largest torque.
const HALVES: [f64; 2] = [0.25, 1.0];
const HALF_SPAN: [f64; 2] = [0.1, 4.0];
/// Share of the declared one: more is no error of a drive.
const LARGEST: f64 = 0.6;

/// A current that makes another torque than declared. With a shape (Nm, and the largest torque of the joint) the difference falls with
/// torque, to half at so many Nm: iron saturates, and a table of a drive is right at its rated current.
pub(super) static WRONG_CONSTANT: TorqueCause = TorqueCause {
    name: TORQUE_CONSTANT,
    follows: |_| "load",
    coefficients: &[("relative", "1")],
    price: |form| if form.shape.is_empty() { 4.0 } else { 10.0 },
    inertial: true,
    of_rigid: true,
    rich: |form| form.shape.is_empty(),
    forms: |cause, scene| {
        // Where masses are identified it is confounded with them.
        if scene.declared.is_none() {
            return Vec::new();
        }
        let mut forms = at_each_joint(cause, scene, 1, &[&[]]);
        for joint in 0..scene.joints() {
            let largest = largest(&scene.rigid[joint]).max(1e-9);
            forms.extend(HALVES.map(|half| {
                TorqueForm::at_joint(cause, joint, 1).shaped(&[half * largest, largest])
            }));
        }
        forms
    },
    spans: |form| {
        let span = |largest: &f64| span("half_at", "Nm", HALF_SPAN.map(|share| share * largest));
        form.shape.get(1).map(span).into_iter().collect()
    },
    is_possible: |_, values| values[0].abs() < LARGEST,
    torque: ColumnTorque::Row(|column, row| {
        let (joint, scene) = (column.form.joint(), column.scene);
        match column.form.shape.first() {
            None => scene.rigid[joint][row],
            // A drive makes the torque of friction too, which so depends on load.
            Some(half) => {
                let torque = scene.rigid[joint][row] + scene.friction[joint][row];
                torque / (1.0 + torque.abs() / half)
            }
        }
    }),
    statement: |form, fitted, unit| {
        let place = form.place;
        let percent = scaled(&fitted[0], 100.0);
        let sign = if percent.value < 0.0 { "" } else { "+" };
        let percent = format!("{sign}{}", percent.rounded());
        match form.shape.first() {
            None => format!(
                "torques of {place} read {percent} % off: its torque constant is not the declared one"
            ),
            Some(half) => format!(
                "small torques of {place} read {percent} % off, half of that at {half:.3} {}: its torque constant is not the declared one",
                unit("Nm")
            ),
        }
    },
    ..PLAIN
};

#[cfg(test)]
mod tests {
    use super::*;

    fn number(value: f64, sigma: f64) -> FittedNumber {
        FittedNumber { value, sigma }
    }

    #[test]
    fn a_centre_is_told_along_the_axes_that_the_torques_see_and_nowhere_else() {
        let form = TorqueForm::at_joint(&LINK_CENTRE, 1, 3);
        let fitted = [number(0.021, 0.001), number(0.4, 3.0), number(0.001, 0.002)];
        let told = (LINK_CENTRE.parameters)(&form, &fitted);
        let names: Vec<&str> = told.iter().map(|one| one.name.as_str()).collect();
        assert_eq!(names, ["centre_x", "centre_z"]);
        let said = (LINK_CENTRE.statement)(&form, &fitted, |unit| unit);
        assert!(
            said.contains("21.0 mm along x and 1 mm along z") && said.ends_with("is not seen"),
            "{said}"
        );
    }

    #[test]
    fn of_numbers_that_are_not_seen_the_best_known_is_told() {
        let named = [("a", number(1.0, 5.0)), ("b", number(2.0, 3.0))];
        let told = told(named.into_iter(), 0.1);
        assert_eq!(told, [("b", number(2.0, 3.0))]);
    }

    #[test]
    fn an_inertia_is_told_by_the_numbers_that_are_seen() {
        let form = TorqueForm::at_joint(&LINK_INERTIA, 1, 6);
        let mut fitted = [number(7.0, 40.0); 6];
        fitted[3] = number(0.3, 0.02);
        let told = (LINK_INERTIA.parameters)(&form, &fitted);
        assert_eq!((told.len(), told[0].name.as_str()), (1, "inertia_yy"));
        assert!(
            (LINK_INERTIA.statement)(&form, &fitted, |unit| unit).contains("by up to 0.30 kg m2")
        );
    }
}
