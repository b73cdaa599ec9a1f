//! Findings in a sentence that a mechanic understands, and what the recording cannot show.

use super::finding::Number;
use super::words::{Clock, figure};
use crate::effect::{Course, Form, GearCyclic, Law, Placed, Side, Signature, Survey, Unknown, Warmth};

/// What a sentence is made of.
pub(crate) struct Told<'a> {
    pub effect: &'a str,
    pub place: &'a str,
    pub forms: &'a [Form],
    pub numbers: &'a [Number],
    /// Size of the whole effect at the measured points, m.
    pub rms: f64,
    pub clock: Clock,
}

/// The sentence of a finding from its forms and numbers.
pub(crate) fn sentence(told: &Told) -> String {
    let Told { effect, place, forms, numbers, rms, clock } = *told;
    let first = numbers.first();
    let value = |number: Option<&Number>| number.map_or_else(String::new, |n| format!("{:.3e} {}", n.value, n.unit));
    let arcsec =
        |number: Option<&Number>| number.map_or_else(String::new, |n| format!("{} {}", figure(n.value.abs(), 0), n.unit));
    let text = match effect {
        "joint_compliance" => format!("{place} winds up under its load by {}", value(first)),
        "joint_hardening" => {
            let shape = match forms.iter().find_map(|form| if let Form::JointHardening(h) = form { Some(h.law()) } else { None })
            {
                Some(Law::Saturating { at_nm }) => format!("it stiffens above about {} Nm", figure(at_nm, 0)),
                Some(Law::SoftZone { at_nm }) => format!("it is soft below about {} Nm", figure(at_nm, 0)),
                Some(Law::Knee { at_nm }) => format!("it has two stiffnesses, with the knee at {} Nm", figure(at_nm, 0)),
                Some(Law::Power { exponent, .. }) => format!("it goes with the load to the power of {}", figure(exponent, 1)),
                _ => "its shape is a free curve of the load".to_string(),
            };
            format!("{place} winds up under its load, but not in proportion: {shape}")
        }
        "link_compliance" => format!("{place} bends under what it carries by {}", value(first)),
        "base_compliance" => format!("the base tilts under the arm's weight by {}", value(first)),
        "gear_cyclic" => {
            format!("the transmission or encoder of {place} errs periodically with its angle: {}", orders(forms, numbers))
        }
        "gear_motor_cyclic" => {
            format!("{place} errs periodically with its motor's angle, amplitude {}", amplitude(numbers.get(0..2)))
        }
        "joint_table" => format!("{place} has a repeatable error of no simple form, kept as a table"),
        "backlash" => {
            let side = forms.iter().find_map(|form| if let Form::Backlash(b) = form { Some(b.side()) } else { None });
            let by = match side {
                Some(Side::Load { .. }) => "to the side that the load pushes it".to_string(),
                Some(Side::Mixed { threshold_nm, .. }) => {
                    let friction = figure(threshold_nm.abs(), 0);
                    format!("by the direction from which it came, above about {friction} Nm to the side that the load pushes it")
                }
                Some(Side::Approach) => "by the direction from which it came".to_string(),
                None => {
                    let size = figure(rms * 1e6, 0);
                    return format!("{place} has lost motion to the side that its load pushes it ({size} um rms at the tool).");
                }
            };
            format!("{place} has lost motion: half a gap of {} {by}", arcsec(first))
        }
        "thermal_growth" => {
            let by = forms.iter().find_map(|form| if let Form::ThermalGrowth(t) = form { Some(t.by()) } else { None });
            match (by, first) {
                (Some(Warmth::Temperature { .. }), Some(n)) => {
                    format!("{place} grows by {} um/m for each kelvin", figure(n.value * 1e6, 1))
                }
                (Some(Warmth::Time { constant_s, .. }), Some(n)) => {
                    format!(
                        "{place} grows as the robot warms up, {} um/m in the end with a time constant of {}",
                        figure(n.value * 1e6, 0),
                        clock.span(constant_s)
                    )
                }
                _ => format!("{place} grows with warmth"),
            }
        }
        "counterbalance" => format!("a balancer (spring or gas) acts on {place} and is missing from the torque model"),
        "cable_drag" => match forms.iter().find_map(|form| if let Form::Unknown(shape) = form { Some(shape) } else { None }) {
            Some(shape) => format!("something pulls on {place} as a hose package does: {}", goes_with(shape, clock)),
            None => format!("something pulls on {place} by its angle, e.g. a hose package, and is missing from the torque model"),
        },
        "link_mass" => format!("the mass or centre of {place} in the torque model is wrong"),
        "payload_error" => match first {
            Some(n) => {
                let how = if n.value < 0.0 { "lighter" } else { "heavier" };
                format!("the payload is {} % {how} than declared", figure(n.value.abs() * 100.0, 1))
            }
            None => "the payload is not what was declared".to_string(),
        },
        "axis_wobble" => format!("the axis of {place} tilts as the joint turns"),
        "zero_shift" => format!("the zero of {place} steps by {}{}", arcsec(first), when(forms, clock)),
        "tool_shift" => format!("the target on the tool has moved{}", when(forms, clock)),
        "base_shift" => format!("the base (or the tracker) has moved{}", when(forms, clock)),
        "tracker_drift" => {
            let course = forms.iter().find_map(|form| if let Form::TrackerDrift(d) = form { Some(d.course()) } else { None });
            let how = match course {
                Some(Course::Steady { power, .. }) if power < 0.7 => "slower and slower",
                Some(Course::Steady { power, .. }) if power > 1.4 => "faster and faster",
                Some(Course::Steady { .. }) => "steadily",
                Some(Course::Warming(_)) => "with the warm-up",
                _ => "slowly",
            };
            let over = if clock == Clock::Rows { " over the recording's rows" } else { "" };
            format!("the tracker's frame drifts {how}{over}")
        }
        "coupling_ratio" => {
            let share = match first {
                Some(n) if n.unit == PLAIN => format!("{} % of its angle", figure(n.value * 100.0, 2)),
                other => value(other),
            };
            format!("{place}: the second moves with the first by {share}")
        }
        "joint_log_lag" if forms.iter().any(|form| matches!(form, Form::JointLogLag(lag) if lag.is_time())) => {
            let ms = first.map_or(0.0, |n| n.value);
            let (how, when) = if ms < 0.0 { ("early", "before") } else { ("late", "after") };
            format!(
                "the tracker's clock is {} ms {how} against the controller's: points were measured that much {when} the joints beside them",
                figure(ms.abs(), 2)
            )
        }
        "viscous_windup" => format!("{place} trails behind in proportion to its speed, by {}", value_short(first)),
        "joint_log_lag" => match first {
            Some(n) if numbers.len() == 1 => format!(
                "joints were logged before the arm had settled: {} % of the last move was still to come",
                figure(n.value * 100.0, 2)
            ),
            Some(_) => {
                let shares = numbers.iter().filter(|n| n.name.contains("share"));
                let most = shares.max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
                format!(
                    "joints were logged before the arm had settled, each by a share of its own: up to {} % of the last move was \
                     still to come",
                    figure(most.map_or(0.0, |n| n.value * 100.0), 3)
                )
            }
            None => "joints and points do not belong to the same moment".to_string(),
        },
        _ => {
            let signature =
                forms.iter().find_map(|form| if let Form::Unknown(u) = form { Some(goes_with(u, clock)) } else { None });
            format!("{place} has an error that no entry of the library explains: {}", signature.unwrap_or_default())
        }
    };
    format!("{text} ({} um rms at the tool).", figure(rms * 1e6, 0))
}

/// The unit of a plain number.
const PLAIN: &str = "1";

fn value_short(number: Option<&Number>) -> String {
    number.map_or_else(String::new, |n| format!("{} {}", figure(n.value, 2), n.unit))
}

/// What something unknown depends on, in the recording's own time.
fn goes_with(unknown: &Unknown, clock: Clock) -> String {
    match (unknown.signature(), clock) {
        (Signature::Sway { period_s, .. }, _) => format!("{} with a period of {}", unknown.signature(), clock.span(period_s)),
        (Signature::Time { .. }, Clock::Rows) => "function of the row".into(),
        (Signature::Creep { .. }, Clock::Rows) => {
            unknown.signature().to_string().replace("with time", "over the recording's rows")
        }
        (signature, _) => signature.to_string(),
    }
}

fn when(forms: &[Form], clock: Clock) -> String {
    let time = forms.iter().find_map(|form| match form {
        Form::ZeroShift(shift) => Some(shift.time_s()),
        Form::FrameShift(shift) => Some(shift.time_s()),
        _ => None,
    });
    time.map_or_else(String::new, |time| clock.since(time))
}

fn amplitude(pair: Option<&[Number]>) -> String {
    match pair {
        Some([a, b]) => format!("{} {}", figure(a.value.hypot(b.value), 0), a.unit),
        _ => String::new(),
    }
}

fn orders(forms: &[Form], numbers: &[Number]) -> String {
    let gears = forms.iter().filter_map(|form| if let Form::GearCyclic(gear) = form { Some(gear) } else { None });
    let one = |gear: &GearCyclic| {
        let tag = format!("{}.", gear.variant());
        let own: Vec<Number> = numbers.iter().filter(|n| n.name.contains(&tag)).cloned().collect();
        let overtone = own.get(2..4).map(|pair| format!(" and {} times by {}", 2 * gear.order(), amplitude(Some(pair))));
        format!("{} times a turn by {}{}", gear.order(), amplitude(own.get(0..2)), overtone.unwrap_or_default())
    };
    let mut said: Vec<String> = gears.map(one).collect();
    for form in forms {
        if let Form::JointTable(table) = form {
            let span = table.range()[1] - table.range()[0];
            let curve: Vec<&Number> = numbers.iter().filter(|n| n.name.contains("cos")).collect();
            let wave = |n: &&&Number| n.name.rsplit("cos").next().and_then(|k| k.parse::<f64>().ok()).map(|k| (k, n.value.abs()));
            let mut waves: Vec<(f64, f64)> = curve.iter().filter_map(|n| wave(&n)).collect();
            waves.sort_by(|a, b| b.1.total_cmp(&a.1));
            // A cosine of k half periods over the range makes k pi / range periods a turn.
            let orders = waves.iter().take(4).map(|(k, _)| format!("{:.0}", k * std::f64::consts::PI / span));
            said.push(format!("a curve, strongest about {} times a turn", orders.collect::<Vec<_>>().join(", ")));
        }
    }
    said.join(", ")
}

/// Joints move the point by less than this (m/rad): no effect of theirs can be seen.
const STILL: f64 = 1e-3;

/// What these data cannot show, whatever the truth; `reach` is the largest motion of the point by each joint, m/rad.
pub(crate) fn not_observable(survey: &Survey, reach: &[f64]) -> Vec<String> {
    let mut out = Vec::new();
    for (joint, reach) in reach.iter().enumerate() {
        let name = joint + 1;
        if *reach < STILL {
            out.push(format!("joint {name}: the measured point lies on its axis; put a second target off the axis"));
        } else if survey.travel(joint) < 0.02 {
            out.push(format!("joint {name}: it hardly moves; vary it over its range"));
        } else if !survey.both_directions(joint) {
            out.push(format!(
                "joint {name}, backlash: it was approached from one side only; approach half of the poses from the other"
            ));
        }
    }
    if !survey.payload_changes() {
        let payload =
            if survey.heavy_payload() > 0.0 { "every row carries the same payload" } else { "no row carries a payload" };
        out.push(format!("payload_error: {payload}; measure with two payloads in alternating blocks"));
    }
    out.extend(masses(survey));
    let clock = Clock::of(survey.data);
    if clock == Clock::Rows {
        out.push("time: none was recorded; the order of the rows stands for it".into());
    }
    if survey.data.temperature.is_none() {
        let by = if clock == Clock::Rows { "the order of the rows" } else { "time" };
        out.push(format!("temperature: none was recorded; growth is told from drift by {by} alone"));
    }
    if survey.data.current.is_none() {
        out.push("counterbalance: without motor currents a balancer is the same as gear_cyclic of order 1".into());
    }
    if survey.data.direction.is_none() {
        out.push("direction of approach: taken from the order of the rows".into());
    }
    out.push("tracker_scale: link lengths absorb it; measure a scale bar".into());
    out
}

/// Links whose weight the robot file does not give.
fn masses(survey: &Survey) -> Option<String> {
    let all = &survey.robot.description().joints;
    let bare = (1..).zip(all).filter(|(_, joint)| joint.mass.is_none() || joint.centre.is_none());
    let bare: Vec<String> = bare.map(|(number, _): (usize, _)| number.to_string()).collect();
    match bare.len() {
        0 => None,
        none if none == all.len() => Some("gravity effects: the robot file gives no link masses".into()),
        some => {
            let (own, all) = (all.len() - some, all.len());
            let bare = bare.join(", ");
            Some(format!(
                "gravity effects: the robot file gives mass and centre of {own} of {all} links; {bare} counted as weightless"
            ))
        }
    }
}

/// Where nothing else is needed.
const POSES: &str = "more poses, chosen to tell them apart (`calib poses --run`)";

/// What would tell findings from their rivals, a sentence each.
pub(crate) fn next(findings: &[super::Finding]) -> Vec<String> {
    let mut out = Vec::new();
    for finding in findings {
        for rival in finding.rivals.iter().take(2) {
            let how = other_means(finding.effect, rival.effect).unwrap_or(POSES);
            out.push(format!("{} at {} or {} at {}: {how}", finding.effect, finding.place, rival.effect, rival.place));
        }
    }
    out
}

/// What is not a pose and may tell two effects apart.
pub(crate) fn other_means(a: &str, b: &str) -> Option<&'static str> {
    let pair = |x: &str, y: &str| (a == x && b == y) || (a == y && b == x);
    let either = |x: &str| a == x || b == x;
    let means = if pair("joint_compliance", "joint_hardening") {
        "measure with a third payload between none and full, and with joints near their largest load"
    } else if either("counterbalance") || either("link_mass") || either("payload_error") || either("cable_drag") {
        "log motor currents at rest, or measure with two payloads over the joint's full range (for a balancer also disconnected)"
    } else if either("base_shift") || either("zero_shift") || either("tool_shift") {
        "return to a few anchor poses with different first joints every half hour"
    } else if either("thermal_growth") || either("tracker_drift") {
        "log the arm's temperature from a cold start and watch a fixed target on the floor"
    } else if either("backlash") {
        "repeat poses from both sides under loads of both signs"
    } else if either("axis_wobble") {
        "measure a second target off the first"
    } else {
        return None;
    };
    Some(means)
}
