//! Bodies, a mounting, motors and drives that are not as declared.

use super::{
    ColumnTorque, FittedNumber, PLAIN, TorqueCause, TorqueForm, at_each_joint, at_each_link, plain,
    shape, size_of_two, span,
};
use crate::arm::{INERTIAL_NAMES, INERTIAL_NUMBERS, inertial_unit, unit_number};
use crate::effect::Place;
use crate::recording::largest;

/// A number times a factor.
fn scaled(number: &FittedNumber, by: f64) -> FittedNumber {
    FittedNumber {
        value: by * number.value,
        sigma: by * number.sigma,
    }
}

/// kg: less is nothing to have a centre.
const LIGHTEST: f64 = 0.1;
/// m by which a payload's centre is elsewhere, at most.
const PAYLOAD_FARTHEST: f64 = 0.5;
pub(crate) const CENTRE: [&str; 3] = ["centre_x", "centre_y", "centre_z"];
/// Entries of an inertia tensor.
const INERTIA: usize = INERTIAL_NUMBERS - 4;
/// Mass at the declared centre; mass and centre; all ten numbers.
const PAYLOADS: [usize; 3] = [1, 4, INERTIAL_NUMBERS];

/// A payload that is not the declared one. Shape: declared mass, kg.
pub(crate) static PAYLOAD: TorqueCause = TorqueCause {
    name: "payload_error",
    price: |_| 4.0,
    rich: |_| true,
    inertial: true,
    forms: |cause, scene| {
        let mass = scene.arm.payload.map_or(0.0, |payload| payload.mass);
        let form = |width| TorqueForm {
            place: Place::Tool,
            ..TorqueForm::at_joint(cause, 0, width).shaped(&[mass])
        };
        let declared = scene.declared.iter();
        declared.flat_map(|_| PAYLOADS.map(form)).collect()
    },
    is_possible: |form, values| {
        let whole = form.shape[0] + values[0];
        let is_near = |moment: &f64| moment.abs() < PAYLOAD_FARTHEST * whole.max(LIGHTEST);
        whole > -LIGHTEST && (form.width == INERTIAL_NUMBERS || values[1..].iter().all(is_near))
    },
    changes: Some(|form, declared| {
        let last = declared.tolerance.len() - 1;
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
        let mut all = vec![plain("mass", fitted[0], "kg")];
        let others = &fitted[1..];
        if form.width == INERTIAL_NUMBERS {
            let numbers = (1..).zip(others);
            all.extend(
                numbers.map(|(k, value)| plain(INERTIAL_NAMES[k], *value, inertial_unit(k))),
            );
        } else {
            // What a payload without its mass would be at: the moment that is found, of all the mass that is there.
            let whole = (form.shape[0] + fitted[0].value).abs().max(LIGHTEST);
            let centre = CENTRE.iter().zip(others);
            all.extend(centre.map(|(name, number)| plain(name, scaled(number, 1e3 / whole), "mm")));
        }
        all
    },
    statement: |form, fitted| {
        let mass = fitted[0].value;
        let more = if mass >= 0.0 { "more" } else { "less" };
        let centre = if form.width > 1 {
            ", its centre elsewhere"
        } else {
            ""
        };
        format!(
            "the payload is {:.2} kg {more} than declared{centre}",
            mass.abs()
        )
    },
    ..PLAIN
};

/// Shares of the declared mass: what errs by more is no error of a declaration.
const MASSES: std::ops::RangeInclusive<f64> = -0.7..=1.0;

/// A link that is heavier or lighter than declared, all its numbers in proportion.
pub(super) static LINK_MASS: TorqueCause = TorqueCause {
    name: "link_mass",
    inertial: true,
    forms: |cause, scene| at_each_link(cause, scene, 1),
    is_possible: |_, values| MASSES.contains(&values[0]),
    changes: Some(|form, declared| {
        let link = &declared.links[INERTIAL_NUMBERS * form.link()..];
        vec![(form.link(), std::array::from_fn(|number| link[number]))]
    }),
    parameters: |_, fitted| vec![plain("relative", fitted[0], "1")],
    statement: |form, fitted| {
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

/// A link whose centre of mass is elsewhere, by three coordinates.
pub(super) static LINK_CENTRE: TorqueCause = TorqueCause {
    name: "link_com",
    price: |_| 8.0,
    inertial: true,
    forms: |cause, scene| at_each_link(cause, scene, 3),
    is_possible: |_, values| values.iter().all(|shift| shift.abs() < FARTHEST),
    changes: Some(|form, declared| {
        let shifts = declared.centre_shift[form.link()].iter();
        shifts.map(|ten| (form.link(), *ten)).collect()
    }),
    parameters: |_, fitted| {
        let centre = CENTRE.iter().zip(fitted);
        let in_mm = centre.map(|(name, number)| plain(name, scaled(number, 1e3), "mm"));
        in_mm.collect()
    },
    statement: |form, fitted| {
        let [x, y, z] = [0, 1, 2].map(|axis| 1e3 * fitted[axis].value);
        format!(
            "the centre of mass of {} is ({x:.1}, {y:.1}, {z:.1}) mm from where it is declared",
            form.place
        )
    },
    ..PLAIN
};

/// A link whose inertia is not the declared one: six numbers about the joint's point.
pub(super) static LINK_INERTIA: TorqueCause = TorqueCause {
    name: "link_inertia",
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
        let numbers = INERTIAL_NAMES[4..].iter().zip(fitted);
        numbers
            .map(|(name, value)| plain(name, *value, "kg m2"))
            .collect()
    },
    statement: |form, fitted| {
        let values = fitted.iter().map(|number| number.value);
        let largest = values.max_by(|a, b| a.abs().total_cmp(&b.abs()));
        format!(
            "the inertia of {} is off, by up to {:.3} kg m2",
            form.place,
            largest.unwrap_or(0.0)
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
    statement: |_, fitted| {
        let azimuth = fitted[1].value.atan2(fitted[0].value).to_degrees();
        format!(
            "the base is tilted by {:.2} deg: gravity pulls towards {azimuth:.0} deg of the plane across the declared one",
            tilt(fitted).value.to_degrees()
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
    coefficients: &[("inertia", "kg m2")],
    price: |_| 2.0,
    rich: |_| true,
    inertial: true,
    positive: true,
    torque: ColumnTorque::Row(|column, row| column.scene.acceleration[column.form.joint()][row]),
    statement: |form, fitted| {
        format!(
            "the rotor of {} adds an inertia of {:.4} kg m2 at the joint",
            form.place, fitted[0].value
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
    statement: |form, fitted| {
        let (place, percent) = (form.place, 100.0 * fitted[0].value);
        match form.shape.first() {
            None => format!(
                "torques of {place} read {percent:+.1} % off: its torque constant is not the declared one"
            ),
            Some(half) => format!(
                "small torques of {place} read {percent:+.1} % off, half of that at {half:.3} Nm: its torque constant is not the declared one"
            ),
        }
    },
    ..PLAIN
};
