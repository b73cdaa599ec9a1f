//! The text of the pipeline that `init` writes.

use super::InitRequest;
use super::arm::StartingArm;
use super::columns::{Choice, ExaminedFile, MOST_NAMED, Mapping};
use crate::error::{listed, one_line};
use crate::raw;
use crate::stage::ingest::instruments;
use crate::yaml::quoted;
use std::path::Path;

/// How the pipeline's folder names a file.
pub(super) fn from_folder(folder: &Path, file: &Path) -> String {
    let whole = |path: &Path| path.canonicalize().ok();
    let inside = whole(folder)
        .zip(whole(file))
        .and_then(|(folder, file)| Some(file.strip_prefix(folder).ok()?.to_path_buf()));
    let path = inside
        .or_else(|| whole(file))
        .unwrap_or_else(|| file.to_path_buf());
    quoted(&path.display().to_string())
}

/// The name of a pipeline: that of its folder.
pub(super) fn name_of(folder: &Path) -> String {
    // A folder that is still to be made has its name already.
    let folder = folder
        .canonicalize()
        .unwrap_or_else(|_| folder.to_path_buf());
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let allowed = |c: &char| c.is_ascii_alphanumeric() || "_-".contains(*c);
    let name: String = name.chars().filter(allowed).collect();
    if name.is_empty() { "cell".into() } else { name }
}

/// Name, and the stage that reads the robot.
fn head(request: &InitRequest, arm: &StartingArm) -> String {
    let name = name_of(request.folder);
    let mut out = format!(
        "# A calibration, step by step. `calib check` reports every fault with its line, `calib run` computes what is not yet done.\ncalib: 1\nname: {name}\nseed: 1                 # everything random derives from it\n\nstages:\n"
    );
    let urdf = request.urdf.map_or_else(String::new, |path| {
        format!(", urdf: {}", from_folder(request.folder, path))
    });
    let settings = arm.settings(&urdf);
    out.push_str(&format!("  - uses: robot\n    with: {settings}\n\n"));
    out + "  # Which column holds what, in which unit. Nothing is guessed when this runs: only what is written here counts.\n"
}

/// The pipeline of an arm that moves while its torques are recorded.
pub(super) fn of_torques(
    request: &InitRequest,
    found: &[ExaminedFile],
    arm: &StartingArm,
) -> String {
    let mut out = head(request, arm) + "  - uses: ingest_torques\n    with:\n      files:\n";
    out.push_str(&files(request, found, arm, [false; 2]));
    out + OF_TORQUES
}

pub(super) fn text(
    request: &InitRequest,
    found: &[ExaminedFile],
    (joined, arm): (&[String], &StartingArm),
) -> String {
    let mut out = head(request, arm) + "  - uses: ingest\n    with:\n      files:\n";
    if found.is_empty() {
        out.push_str(&counted(EMPTY, counting(found, arm).as_deref()));
    }
    out.push_str(&files(request, found, arm, missing(found)));
    joined
        .iter()
        .for_each(|line| out.push_str(&format!("{line}\n")));
    out.push_str(&instrument());
    let by_usage = found.iter().any(|file| file.has("usage"));
    out.push_str(if by_usage { BY_USAGE } else { EVERY });
    out + STAGES
}

/// The settings of all files; `missing`: whether none has the joints, the point.
fn files(
    request: &InitRequest,
    found: &[ExaminedFile],
    arm: &StartingArm,
    missing: [bool; 2],
) -> String {
    let counting = counting(found, arm);
    let mut out = String::new();
    for (k, file) in found.iter().enumerate() {
        out.push_str(&format!(
            "        - file: {}\n",
            from_folder(request.folder, &file.path)
        ));
        // Joints come first, in the controller's file; the tracker's is the last.
        let lacks = Lacks {
            joints: missing[0] && k == 0,
            point: missing[1] && k + 1 == found.len(),
            count: arm.joints,
        };
        out.push_str(&counted(&file_text(file, &lacks), counting.as_deref()));
    }
    out
}

/// Lines, that of joints with how the arm's controller counts them.
fn counted(lines: &str, counting: Option<&str>) -> String {
    let one = |line: &str| {
        let setting = line.trim_start().trim_start_matches("# ");
        match counting.filter(|_| setting.starts_with("q: {")) {
            None => format!("{line}\n"),
            Some(counting) => {
                // The map ends at the last brace before a comment: names of columns may hold both.
                let end = line.find("}   #").unwrap_or(line.len() - 1);
                format!("{}, {counting}{}\n", &line[..end], &line[end..])
            }
        }
    };
    lines.lines().map(one).collect()
}

/// What else is to be said of joints, as settings of `q`.
fn counting(found: &[ExaminedFile], arm: &StartingArm) -> Option<String> {
    let settings = [linear(found, &arm.sliding), arm.counting.clone()];
    let settings: Vec<String> = settings.into_iter().flatten().collect();
    (!settings.is_empty()).then(|| settings.join(", "))
}

/// The unit of joints that slide, as a setting of `q`: by the first one's name, else by its size.
fn linear(found: &[ExaminedFile], sliding: &[bool]) -> Option<String> {
    let joint = sliding.iter().position(|sliding| *sliding)?;
    let unit = found.iter().find_map(|file| {
        let column = *file.get("q")?.choices.first()?.columns.get(joint)?;
        Some(file.length_unit(&[column]).0)
    });
    Some(format!("linear_unit: {}", unit.unwrap_or("mm")))
}

/// Files of further reflectors, each beside the file of joints.
pub(super) fn later(
    folder: &Path,
    found: &[ExaminedFile],
    more: &[(String, ExaminedFile)],
) -> Vec<String> {
    let [joints, _] = found else {
        return Vec::new();
    };
    let line = |(target, file): &(String, ExaminedFile)| {
        let files = [joints, file]
            .map(|file| from_folder(folder, &file.path))
            .join(", ");
        format!("        - {{files: [{files}], target: {}}}", quoted(target))
    };
    const HEAD: &str =
        "      later:                  # CHECK: the other reflectors, measured in the same poses";
    let head = more.first().map(|_| HEAD.to_string());
    head.into_iter().chain(more.iter().map(line)).collect()
}

/// A line to fill in: nobody but the person knows what measured.
fn instrument() -> String {
    format!(
        "      # instrument: REPLACE     # what measured the points: {}\n      #                         # or {{constant_um: 10, \
         per_metre_um: 2.5, coverage: 2}}; without it, or sigma_x or u95 above, noise is not known\n",
        instruments().join(", ")
    )
}

/// Whether no file has columns of joints, or of the measured point.
pub(super) fn missing(found: &[ExaminedFile]) -> [bool; 2] {
    ["q", "x"].map(|quantity| !found.iter().any(|file| file.has(quantity)))
}

/// What the user must name in a file.
struct Lacks {
    joints: bool,
    point: bool,
    count: usize,
}

/// The settings of one file under `files`.
fn file_text(file: &ExaminedFile, lacks: &Lacks) -> String {
    let sheet = &file.sheet;
    let mut out = String::new();
    let mut put = |line: &str| out.push_str(&format!("          {line}\n"));
    if let Some(trouble) = &sheet.trouble {
        put(&format!(
            "# REPLACE what follows by the columns of the file: {}",
            one_line(trouble)
        ));
    }
    if let Some(name) = &sheet.of_book {
        put(&format!("sheet: {}", quoted(name)));
    }
    if let Some(topic) = &sheet.topic {
        put(&format!("topic: {}", quoted(topic)));
    }
    sheet
        .notes
        .iter()
        .for_each(|note| put(&format!("# {}", one_line(note))));
    match sheet.delimiter {
        ',' => {}
        ' ' => put("delimiter: whitespace"),
        '\t' => put("delimiter: tab"),
        other => put(&format!("delimiter: {}", quoted(&other.to_string()))),
    }
    if sheet.comma {
        put("decimal: comma");
    }
    if !sheet.header {
        put("header: false");
    }
    if sheet.skip > 0 {
        let (skip, below) = (sheet.skip, if sheet.header { "header" } else { "data" });
        put(&format!(
            "skip: {skip}                 # lines above the {below}"
        ));
    }
    if sheet.unit_row {
        put("skip_below_header: 1    # a row of units");
    }
    if let Some(mark) = sheet.comment {
        put(&format!("comment: {}", quoted(mark)));
    }
    if sheet.header_in_comment {
        put("header_in_comment: true");
    }
    for mapping in &file.mappings {
        let first = mapping.choices.first();
        if let Some(line) = first.and_then(|choice| choice.targets.as_ref()) {
            let check = one_line(mapping.check.as_deref().unwrap_or("is it so?"));
            put(&format!("{line}   # CHECK: {check}"));
        }
    }
    put("columns:");
    for quantity in ORDER.split(' ') {
        if let Some(mapping) = file.get(quantity) {
            out.push_str(&mapped(mapping));
        }
    }
    let mut put = |line: &str| out.push_str(&format!("            {line}\n"));
    lacking(file, lacks, &mut put);
    file.remarks
        .iter()
        .for_each(|remark| put(&format!("# {}", one_line(remark))));
    if sheet.header && sheet.trouble.is_none() {
        let names = sheet.names.iter().enumerate();
        let unused: Vec<(usize, &String)> = names
            .filter(|(column, _)| !file.is_taken(*column))
            .collect();
        for (column, name) in unused.iter().take(MOST_NAMED) {
            match name.as_str() {
                "" => put(&format!("# not used: column {}", column + 1)),
                name if file.has("x") && is_of_space(name) => put(&format!(
                    "# u95: {{column: {}, unit: mm, coverage_factor: 3.5}}   # CHECK: of the point in space; of each coordinate without coverage_factor",
                    quoted(name)
                )),
                name => put(&format!("# not used: {}", quoted(name))),
            }
        }
        if unused.len() > MOST_NAMED {
            put(&format!("# not used: {} more", unused.len() - MOST_NAMED));
        }
    } else {
        (0..sheet.names.len().min(MOST_NAMED))
            .for_each(|column| put(&format!("# seen: {}", one_line(&sheet.seen(column)))));
    }
    out
}

/// Whether a column has the uncertainty of a point in space with 95 %, as `Uxyz (95%)` and `U95`: the root of the sum of the squares of two sigma of
/// three coordinates, 3.5 times that of one.
fn is_of_space(name: &str) -> bool {
    let letters: String = name
        .chars()
        .filter(char::is_ascii_alphanumeric)
        .map(|letter| letter.to_ascii_lowercase())
        .collect();
    letters.starts_with('u') && letters.contains("95")
}

const ORDER: &str = "point_id time trajectory q usage target torque current simulated direction velocity x payload temperature";

/// A mapping with what else may stand for it.
fn mapped(mapping: &Mapping) -> String {
    let mut out = String::new();
    for (k, Choice { lines, .. }) in mapping.choices.iter().enumerate() {
        let (comment, why) = match k {
            0 => ("", mapping.check.as_deref()),
            _ => ("# ", Some("or this")),
        };
        let mut why = why.map(|why| format!("   # CHECK: {}", one_line(why)));
        for line in lines {
            let mark = why.take().unwrap_or_default();
            out.push_str(&format!("            {comment}{line}{mark}\n"));
        }
    }
    out
}

/// Lines to replace where no file has the joints, or the point.
fn lacking(file: &ExaminedFile, lacks: &Lacks, put: &mut impl FnMut(&str)) {
    let header = file.sheet.header;
    if lacks.joints && header {
        put(
            "q: {column: \"A{j}\", unit: deg}   # REPLACE: no columns of joints were recognised; {j} is the joint's number",
        );
    } else if lacks.joints {
        let list = listed((1..=lacks.count).map(|number| number.to_string()));
        put(&format!(
            "q: {{columns: [{list}], unit: deg}}   # REPLACE: the numbers of the joints' columns, and the unit"
        ));
    }
    if lacks.point {
        let first = if lacks.joints { lacks.count } else { 0 };
        for (axis, number) in ["x", "y", "z"].into_iter().zip(first + 1..) {
            let column = match header {
                true => axis.to_string(),
                false => number.to_string(),
            };
            put(&format!(
                "{axis}: {{column: {column}, unit: mm}}   # REPLACE: the measured point was not recognised"
            ));
        }
    }
    if !lacks.joints && !lacks.point && file.mappings.is_empty() {
        let column = if header { "name" } else { "1" };
        put(&format!(
            "point_id: {{column: {column}}}   # REPLACE: no column was recognised"
        ));
    }
}

const OF_TORQUES: &str = include_str!("of_torques.yaml");
const EMPTY: &str = include_str!("no_recording.yaml");
const EVERY: &str = include_str!("every.yaml");
const BY_USAGE: &str = include_str!("by_usage.yaml");
const STAGES: &str = include_str!("stages.yaml");

/// What `calib init` writes behind lines to look at, the label of such lines, and what is to be done there.
const MARKS: [(&str, &str, &str); 2] = [
    (
        "REPLACE",
        "replace",
        "put your value there and delete the mark",
    ),
    (
        "CHECK",
        "check",
        "check that it is right and delete the mark",
    ),
];

/// Lines that are left as `calib init` marked them.
pub(crate) struct MarkedLines {
    pub(crate) label: &'static str,
    pub(crate) what: &'static str,
    /// File, number of the line and its text.
    pub(crate) lines: Vec<(String, usize, String)>,
}

/// The lines of files that `calib init` marked, those to fill in before those to look at. A line that is a comment all over sets nothing.
pub(crate) fn marked(paths: &[&Path]) -> Vec<MarkedLines> {
    let of_mark = |(mark, label, what)| {
        let has_mark = |line: &str| {
            line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
                .any(|word| word == mark)
        };
        let counts = |line: &str| !line.trim_start().starts_with('#') && has_mark(line);
        let mut lines = Vec::new();
        for path in paths {
            let text = raw::text(path).unwrap_or_default();
            let numbered = (1..).zip(text.lines()).filter(|(_, line)| counts(line));
            lines.extend(numbered.map(|(number, line)| {
                (path.display().to_string(), number, line.trim().to_string())
            }));
        }
        MarkedLines { label, what, lines }
    };
    MARKS
        .into_iter()
        .map(of_mark)
        .filter(|marked| !marked.lines.is_empty())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::is_of_space;

    #[test]
    fn an_uncertainty_of_a_point_in_space_is_known_by_its_name() {
        let names = ["Uxyz (95%)", "U95", "u_95 [mm]", "Usage", "q95", "unit"];
        assert_eq!(
            names.map(is_of_space),
            [true, true, true, false, false, false]
        );
    }
}
