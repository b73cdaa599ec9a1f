//! What most controllers let one enter, as a list: zeros, ratios, couplings, the tool.

use super::{Export, Format};
use crate::error::Result;

pub(super) struct Controller;

impl Format for Controller {
    fn name(&self) -> &'static str {
        "controller"
    }

    fn help(&self) -> &'static str {
        "Joint zeros, ratios, couplings and tool, as a list"
    }

    fn text(&self, export: &Export) -> Result<String> {
        let mut text: String = export.remarks().iter().map(|line| format!("# {line}\n")).collect();
        text.push_str(
            "# true position = factor * commanded + zero (+ coupling * the other joint); sigma is one standard deviation\n",
        );
        text.push_str("quantity,where,value,unit,sigma,status\n");
        for row in &export.identified.parameters.0 {
            let quantity = match row.effect.as_str() {
                "joint_offset" => "zero",
                "reduction_ratio" => "factor - 1",
                "coupling_ratio" => "coupling",
                _ => continue,
            };
            // People enter degrees.
            let (scale, unit) = if row.unit == "rad" { (180.0 / std::f64::consts::PI, "deg") } else { (1.0, row.unit.as_str()) };
            let sigma = row.sigma.map(|sigma| format!("{:.3e}", sigma * scale)).unwrap_or_default();
            text.push_str(&format!("{quantity},{},{:.9},{unit},{sigma},{}\n", row.place, row.value * scale, row.status));
        }
        for (axis, (now, nominal)) in ["x", "y", "z"].iter().zip(export.corrected.tool.iter().zip(&export.identified.robot.tool))
        {
            text.push_str(&format!("tool {axis} (zero pose; base frame),tool,{:.6},mm,,was {:.6}\n", now * 1e3, nominal * 1e3));
        }
        Ok(text)
    }
}
