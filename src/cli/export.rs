//! `calib export`: the identified model for other programs, and what they cannot carry.

mod table;
mod urdf;

use super::emit;
use super::model_arguments::ModelArguments;
use crate::compensate::{LeftOut, distance, left_out, rigid};
use crate::error::{Error, Result};
use crate::identified::Identified;
use crate::pipeline::Purpose;
use crate::robot::description::{JointKind, RobotDescription};
use crate::robot::{Measurements, RobotModel};
use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use serde_json::json;
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

/// Export the identified model: corrected geometry as URDF, DH or modified DH table, the whole model as JSON, or numbers for the controller.
///
/// Formats carry rigid geometry; what they cannot carry (ratios, compliance, cyclic errors, a learned correction) is listed with what it does to
/// the point, in the file and on stderr. `calib compensate` uses all of it.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct ExportArguments {
    #[command(flatten)]
    model: ModelArguments,
    /// What to write
    #[arg(long, short, value_enum)]
    format: Format,
    /// Writes to this file [default: stdout]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Unified robot description: joints at the corrected axes
    Urdf,
    /// calib's robot file with a Denavit-Hartenberg table
    Dh,
    /// The same with Craig's modified table
    Mdh,
    /// Everything: description, parameters with sigma, what is left out
    Json,
    /// Joint zeros, ratios, couplings and tool, as a list
    Controller,
}

const EXAMPLES: &str = "Examples:
  calib export pipeline.yaml --format urdf --out corrected.urdf
  calib export latest --format mdh --step geometry
  calib export parameters.parquet --robot robot.yaml --format controller";

/// What is exported, and how well it stands for the model.
struct Export {
    identified: Identified,
    corrected: RobotDescription,
    left_out: Vec<LeftOut>,
    /// Rms and maximum distance of the corrected description from the model, m, and over how many poses.
    residual: (f64, f64),
    poses: usize,
    /// Whether these are the recorded ones.
    recorded: bool,
}

pub(super) fn main(arguments: &ExportArguments, command_line: &[OsString]) -> Result<()> {
    let identified = arguments.model.load(Purpose::Export, command_line)?;
    let recorded = identified.data.as_ref().is_some_and(|data| data.rows() > 0);
    let data = identified.data.clone().filter(|data| data.rows() > 0).unwrap_or_else(|| spread(&identified.model.robot));
    let corrected = rigid(&identified.model);
    let export = Export {
        left_out: left_out(&identified.model, &data),
        residual: distance(&identified.model, &corrected, &data),
        corrected,
        poses: data.rows(),
        recorded,
        identified,
    };
    let text = match arguments.format {
        Format::Urdf => urdf::text(&export),
        Format::Dh => table::text(&export, false)?,
        Format::Mdh => table::text(&export, true)?,
        Format::Json => export.document()?,
        Format::Controller => export.controller(),
    };
    match &arguments.out {
        Some(path) => std::fs::write(path, text)
            .map_err(|error| Error::store(path.display().to_string(), format!("cannot be written: {error}")))?,
        None => emit(&text)?,
    }
    if !arguments.model.quiet {
        let said: String = export.remarks().iter().map(|line| format!("{line}\n")).collect();
        let _ = std::io::stderr().write_all(said.as_bytes());
    }
    Ok(())
}

/// Poses within the limits, for models whose recording is not at hand: a low-discrepancy sequence.
fn spread(robot: &RobotModel) -> Measurements {
    const ROWS: usize = 500;
    let n = robot.joints();
    // Fractional parts of multiples of the powers of the generalised golden ratio.
    let golden = (0..60).fold(1.5f64, |x, _| (1.0 + x).powf(1.0 / (n as f64 + 1.0)));
    let limits = |j: usize| robot.description().joints[j].limits.unwrap_or([-1.0, 1.0]);
    let q = (0..ROWS).flat_map(|row| (0..n).map(move |j| (row, j))).map(|(row, j)| {
        let share = (0.5 + (row as f64 + 1.0) * golden.powi(-(j as i32) - 1)).fract();
        let [lower, upper] = limits(j);
        lower + share * (upper - lower)
    });
    Measurements {
        joints: n,
        q: q.collect(),
        position: vec![Vector3::zeros(); ROWS],
        sigma: vec![Vector3::zeros(); ROWS],
        payload: vec![robot.description().payload_mass; ROWS],
        ..Measurements::default()
    }
}

impl Export {
    /// What the reader of an export must know, a sentence a line.
    fn remarks(&self) -> Vec<String> {
        let which = if self.recorded { "recorded poses" } else { "poses spread over the joint limits" };
        let mut lines = vec![
            format!("corrected geometry of {}, {}", one_line(&self.corrected.name), self.identified.origin),
            format!(
                "rigid geometry alone stands {:.4} mm rms, {:.4} mm at most from the identified model over {} {which}",
                self.residual.0 * 1e3,
                self.residual.1 * 1e3,
                self.poses
            ),
        ];
        for LeftOut { effect, place, rms, most } in &self.left_out {
            lines.push(format!("not carried: {effect} at {place}, {:.4} mm rms, {:.4} mm at most", rms * 1e3, most * 1e3));
        }
        if self.identified.correction.is_some() {
            lines.push("not carried: the learned correction".into());
        }
        lines
    }

    fn document(&self) -> Result<String> {
        let finite = |value: f64| if value.is_finite() { json!(value) } else { json!(null) };
        let joints = self.corrected.joints.iter().map(|joint| {
            json!({
                "name": joint.name,
                "kind": if joint.kind == JointKind::Revolute { "revolute" } else { "prismatic" },
                "axis": joint.axis, "point_m": joint.point, "limits": joint.limits,
                "reduction_ratio": joint.reduction_ratio, "motor_constant_nm_a": joint.motor_constant,
                "mass_kg": joint.mass, "centre_m": joint.centre,
            })
        });
        let parameters = self.identified.parameters.0.iter().map(|row| {
            json!({
                "name": row.name, "effect": row.effect, "where": row.place, "unit": row.unit, "nominal": finite(row.nominal),
                "value": finite(row.value), "sigma": row.sigma, "status": row.status,
                "form": row.form.as_deref().and_then(|form| serde_json::from_str::<serde_json::Value>(form).ok()),
            })
        });
        let base = self.identified.model.base();
        let document = json!({
            "calib_model": 1,
            "name": self.corrected.name,
            "origin": self.identified.origin,
            "conventions": "SI; screws at the zero pose in the base frame: T(q) = exp(S1 q1) .. exp(Sn qn) tool",
            "base_in_tracker": { "point_m": <[f64; 3]>::from(base.translation), "rotation_vector_rad": <[f64; 3]>::from(base.rotation_vector()) },
            "joints": joints.collect::<Vec<_>>(),
            "tool": { "point_m": self.corrected.tool, "rotation": self.corrected.tool_rotation },
            "parameters": parameters.collect::<Vec<_>>(),
            "rigid_residual_mm": { "rms": self.residual.0 * 1e3, "max": self.residual.1 * 1e3, "poses": self.poses },
            "not_in_geometry": self.left_out.iter().map(|out| json!({
                "effect": out.effect, "where": out.place.to_string(), "rms_mm": out.rms * 1e3, "max_mm": out.most * 1e3 })).collect::<Vec<_>>(),
            "learned_correction": self.identified.correction.is_some(),
        });
        serde_json::to_string_pretty(&document).map(|text| text + "\n").map_err(|error| Error::Bug(error.to_string()))
    }

    /// What most controllers let one enter: zeros, ratios, couplings, the tool.
    fn controller(&self) -> String {
        let mut text: String = self.remarks().iter().map(|line| format!("# {line}\n")).collect();
        text.push_str(
            "# true position = factor * commanded + zero (+ coupling * the other joint); sigma is one standard deviation\n",
        );
        text.push_str("quantity,where,value,unit,sigma,status\n");
        for row in &self.identified.parameters.0 {
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
        for (axis, (now, nominal)) in ["x", "y", "z"].iter().zip(self.corrected.tool.iter().zip(&self.identified.robot.tool)) {
            text.push_str(&format!("tool {axis} (zero pose; base frame),tool,{:.6},mm,,was {:.6}\n", now * 1e3, nominal * 1e3));
        }
        text
    }
}

/// A name from a file without line breaks and control characters.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
