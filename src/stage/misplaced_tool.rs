//! A measured point that sits elsewhere than the robot file's tool: base and tool are estimated, so nothing else would say so.

use crate::effect::{ToolOffset, figure};
use crate::estimate::{Fitted, Model, ParameterStatus};

/// Farther off (m) no holder is, whose reflector a robot file states at all.
const FAR: f64 = 20e-3;
/// Standard deviations by which the point must be away.
const CLEARLY: f64 = 5.0;

/// What is said of the tool that has no name; none where the point is where the robot file has it.
pub(super) fn misplaced_tool(model: &Model, fitted: &Fitted) -> Option<String> {
    let estimate = |axis: &str| {
        let name = format!("{}{axis}", ToolOffset::prefix(""));
        let k = model
            .stack
            .specs()
            .iter()
            .position(|spec| spec.name == name)?;
        match fitted.statuses[k] {
            ParameterStatus::Free(sigma) => Some((model.x[k], sigma)),
            _ => None,
        }
    };
    let axes = ["x", "y", "z"].map(|axis| (axis, estimate(axis)));
    let known = || {
        axes.iter()
            .filter_map(|(axis, estimate)| Some((axis, (*estimate)?)))
    };
    let off = known()
        .map(|(_, (value, _))| value * value)
        .sum::<f64>()
        .sqrt();
    let sigma = known()
        .map(|(_, (_, sigma))| sigma * sigma)
        .sum::<f64>()
        .sqrt();
    let each: Vec<String> = known()
        .map(|(axis, (value, _))| format!("{axis} {:+.0}", 1e3 * value))
        .collect();
    (off > FAR && off > CLEARLY * sigma).then(|| {
        format!(
            "the measured point is {} mm from the `tool` of the robot file ({} mm, zero pose): is it that of this recording, with its signs \
             and in the frame that the file asks for?",
            figure(1e3 * off, 0),
            each.join(", ")
        )
    })
}
