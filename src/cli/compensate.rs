//! `calib compensate`: joint or Cartesian targets in, commands out that bring the real arm there.

use super::companions::{Companions, data_list};
use super::feed_forward::{FeedForward, feed_forward};
use super::pipeline_arguments::{ModelArguments, must_be_positive};
use super::{note, put, readable, warn};
use crate::api::usual_options;
use crate::compensate::{CorrectionOptions, Corrector, Gate, GateLimits, Stated};
use crate::error::{Error, Fault, Result, counted};
use crate::identified::IdentifiedModel;
use crate::pipeline::Purpose;
use crate::program::{
    self, Frames, Language, Partial, Program, ProgramFile, ProgramLoad, ProgramRules, RobotTool,
    has_mark, with_mark,
};
use crate::raw;
use crate::targets::{Layout, Units, Unreached, parquet, text, whole};
use crate::units::{Quantity, Unit};
use clap::{Args, ValueEnum};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Correct targets: joint commands that bring the real arm to where the nominal robot would have put the tool.
///
/// The whole identified model is solved, with all accepted effects and the learned correction. A joint target stands for the point that the
/// nominal robot reaches with it; a Cartesian target is a point, or a pose, in the robot's base frame. Columns are known by name: q1_deg (or
/// _rad, _mm), the robot's joint names; x_mm, y_mm, z_mm, with qw, qx, qy, qz or a_deg, b_deg, c_deg (about z, y', x''); payload_kg, temp_c,
/// time_s, dir1 (+1: the joint comes from below), i1_a. Joints are replaced in place, all other columns stay byte for byte, and what is
/// known of each target is appended. A target that is not reached gets no joints: their cells are empty (null in Parquet), `remark` says why,
/// and the command ends with code 10 when all others are written; with --plain the messages alone say why.
///
/// Programs of controllers are corrected in place, only the numbers of targets change: KUKA KRL (.src, .dat: E6AXIS, AXIS, E6POS, POS), ABB RAPID
/// (.mod: jointtarget, robtarget), FANUC (.ls: positions of /POS) and Universal Robots (.script: poses and joints of motions). A Cartesian target is reached in the posture that it states, in the controller's counting: S and T of
/// KRL, confdata of RAPID with cfx; of what that leaves open, and where nothing is stated, the posture nearest to the target before (or
/// --start) is taken. One that cannot be reached in its posture is refused; where a correction takes a joint over a border, S, T and confdata
/// are written anew. It stands in the work object or $BASE that is in force on every way to it, and is reached with the tool in force: lines
/// are followed through branches, loops and calls, by the declarations of the file, of the file of the same name next to it (.src, .dat), of $config.dat
/// and the files of --with. The tool is taken as the robot file's where the program has one, and --tool says which it is where it has several.
/// What is not known so, is computed when the program runs, or moves (conveyors, tools that stand still) is refused (--assume-frames), and so
/// are programs whose external axes move, poses in a base that is not the robot file's (of ROS base_link against base; FANUC's world is at the height of
/// axis 2), and programs and tables without a payload where the model depends on load: of RAPID it is the mass of the motion's tool (tooldata, or
/// \TLoad), of KRL that of $LOAD in force; --payload overrules it. Routines of files that were not read are taken to set nothing.
/// The points of a KRL program in the .dat of its name are corrected with it, into a .dat beside --out.
/// A corrected program carries a comment, a table its columns, by which calib refuses to correct it once more; one written with --plain
/// carries nothing and is not recognised. A target that is not understood exactly, not reached, or that
/// may or may not be one, refuses the whole program with code 10. Left as they are, with a warning for each line: poses that the program
/// computes, Offs and RelTool of RAPID among them (the controller adds the offset to the corrected target, so that the shifted point
/// gets the correction of the unshifted one). Warnings also name the lines that move by a distance
/// (PTP_REL, LIN_REL) or move external axes.
///
/// With --torque the targets are a planned motion in even steps of time (time_s, q1_deg .., where given dq1_deg_s .. and ddq1_deg_s2 ..), and
/// the answer is the torque that each row needs by the model of `diagnose_torques` (tau1_nm .., and i1_a .. where motors are declared), to be
/// fed forward: masses, friction and all other causes, but for latency and contacts, which belong to the recording. Without dq and ddq
/// positions are differentiated as those of the recording were. u95_1_nm .. is how far each torque may be off (95 %), by the covariance of the
/// model and by laws that are used beyond what was recorded; `remark` names rows beyond the recorded positions, speeds, accelerations, loads
/// and temperatures (column temp_c, or --temperature). A row of which a joint's torque is less certain than --max-uncertainty gets no torques:
/// their cells are empty, and the command ends with code 10 when all others are written. calib refuses its own output.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct CompensateArguments {
    #[command(flatten)]
    model: ModelArguments,
    /// Targets: delimited text or Parquet; `-` or nothing: text on stdin
    #[arg(value_name = "TARGETS", default_value = "-")]
    targets: PathBuf,
    /// Writes to this file, .parquet or text [default: stdout]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// What is a target where a file has both: the joints, or the pose, near the joints
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = What::Joints)]
    target: What,
    /// Orientation of joint targets: free, for the least change of joints, or kept as the nominal robot has it
    #[arg(long, value_name = "HOW", value_enum, default_value_t = OrientationUse::Free)]
    orientation: OrientationUse,
    /// One step by the nominal Jacobian instead of solving (Wang et al. 2020, Fig. 2)
    #[arg(long)]
    one_step: bool,
    /// Replaces the joints and appends nothing
    #[arg(long)]
    plain: bool,
    /// Leaves targets of a program that state some of their numbers as they are (`LIN {X 10}`), with a warning for each, instead of refusing it
    #[arg(long)]
    leave_partial: bool,
    /// Payload where the targets do not say, of programs whatever they say, kg; needed where the model depends on load and was measured under
    /// one (0: none is carried)
    #[arg(long, value_name = "KG")]
    payload: Option<f64>,
    /// Largest displacement by which a target is corrected, mm: one that needs more is refused, as those that are not reached
    #[arg(long, value_name = "MM", default_value_t = 20.0)]
    max_correction: f64,
    /// Largest turn by which a target is corrected, deg
    #[arg(long, value_name = "DEG", default_value_t = 2.0)]
    max_turn: f64,
    /// Largest uncertainty (95 %) of a target's correction along its direction, mm; with --torque of a joint's torque, Nm [default: the size
    /// of the correction, or six times what is usual at the recorded poses where that is more; the correction of a torque is what it differs
    /// by from that of the arm as declared]
    #[arg(long, value_name = "MM")]
    max_uncertainty: Option<f64>,
    /// Takes frames of a program that are not applied (work object, $BASE, $TOOL, displacement) as those of the robot file, with a warning
    /// for each, instead of refusing the program
    #[arg(long)]
    assume_frames: bool,
    /// Which tool of a program is the robot file's: its name, its number in TOOL_DATA, or its frame X,Y,Z,A,B,C at the flange, mm and deg
    /// [default: the one that the program uses]
    #[arg(long, value_name = "TOOL", allow_hyphen_values = true)]
    tool: Option<String>,
    /// Further files of a program, which declare frames, tools and loads or move to its targets (may be repeated)
    #[arg(long, value_name = "FILE")]
    with: Vec<PathBuf>,
    /// Temperature where the targets do not say, C [default: that at the start of the recording]
    #[arg(long, value_name = "C", allow_hyphen_values = true)]
    temperature: Option<f64>,
    /// Time on the recording's clock, s, where it has one [default: later than all of it: steps have happened, the arm is warm,
    /// laws over time are what they were last, and targets say so]
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    time: Option<f64>,
    /// Side from which all joints come to rest, 1 or -1 [default: by the order of the targets]
    #[arg(long, value_name = "SIGN", allow_hyphen_values = true)]
    direction: Option<f64>,
    /// Where the first Cartesian target is searched from, deg (mm for a prismatic joint)
    #[arg(
        long,
        value_name = "Q1,..",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    start: Option<Vec<f64>>,
    /// Unit of angles whose column does not name one: deg, rad
    #[arg(long, value_name = "UNIT")]
    angle: Option<String>,
    /// Unit of lengths whose column does not name one: mm, m
    #[arg(long, value_name = "UNIT")]
    length: Option<String>,
    /// Torques that a planned motion needs, instead of corrected targets
    #[arg(long, conflicts_with_all = ["target", "orientation", "one_step", "plain", "leave_partial", "payload", "max_correction", "max_turn",
          "assume_frames", "tool", "with", "time", "direction", "start", "angle", "length"])]
    torque: bool,
    /// Seconds from when the arm began to move to the first row, for friction that falls as gears warm up [default: the arm is warm]
    #[arg(long, value_name = "S", requires = "torque")]
    since_start: Option<f64>,
    /// Leaves out the uncertainty of each target
    #[arg(long)]
    no_sigma: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum What {
    Joints,
    Pose,
}

#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum OrientationUse {
    Free,
    Keep,
}

const EXAMPLES: &str = "Examples:
  calib compensate pipeline.yaml targets.csv > corrected.csv
  calib compensate latest targets.parquet --out corrected.parquet
  calib compensate pipeline.yaml poses.csv --target pose --payload 120 --out corrected.csv
  calib compensate pipeline.yaml weld.src --payload 80 --out weld_corrected.src
  calib compensate pipelines/dynamics/pipeline.yaml motion.csv --torque --out feed_forward.csv
  calib compensate parameters.parquet --robot robot.yaml --angle deg < program.csv";

impl CompensateArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        check(self)?;
        let identified = self.model.load(Purpose::Compensate, command_line)?;
        identified.spare(self.out.as_deref())?;
        if self.torque {
            let (motion, out) = (self.targets.as_path(), self.out.as_deref());
            let asked = FeedForward {
                motion,
                out,
                since_start: self.since_start,
                temperature: self.temperature,
                max_uncertainty: self.max_uncertainty,
                sigma: !self.no_sigma,
                force: self.model.force,
                quiet: self.model.quiet,
            };
            return feed_forward(&asked, &identified);
        }
        if identified.is_of_torques_alone() {
            let message = "torques were identified, no positions: there is nothing to correct targets with; --torque gives the torques of a motion";
            return Err(Error::spec(&identified.origin, message));
        }
        let arm = identified.arm();
        let coverage = identified.coverage();
        let uncertainty = identified.uncertainty(&arm);
        let known = uncertainty.as_ref().map(|known| known.own_base);
        let mut corrector = Corrector::new(&arm, coverage, uncertainty, manner(self, &identified)?);
        let threads = self.model.threads()?;
        let place = match self.targets.as_os_str() == "-" {
            true => "stdin".into(),
            false => self.targets.display().to_string(),
        };
        let unstated = || identified.needed_load(&arm);
        let load = self.payload.is_none().then(unstated).flatten();
        let unit = |symbol: &Option<String>| symbol.as_deref().and_then(Unit::parse);
        let layout = Layout {
            place: &place,
            robot: &identified.robot,
            units: Units {
                angle: unit(&self.angle),
                length: unit(&self.length),
            },
            plain: self.plain,
            cartesian: self.target == What::Pose,
            load,
            force: self.model.force,
        };
        let remarks = remarks(self, &identified);
        let unreached = threads
            .install(|| corrected(self, &layout, (&remarks, &identified), &mut corrector))?;
        if !self.model.quiet {
            let counting = identified.counting();
            let counting = counting.map_or_else(String::new, |line| format!("{line}\n"));
            let (origin, tally) = (&identified.origin, corrector.tally.summary());
            let base = identified.base_in_words(known.unwrap_or_default());
            note(format!("model: {origin}\n{counting}{base}\n{tally}"));
        }
        let column = match language(&self.targets).is_some() || self.plain {
            true => "",
            false => " (column `remark`)",
        };
        let warnings = corrector.tally.warnings();
        warn(warnings.map(|line| format!("{line}{column}")));
        Error::if_data(unreached.faults)
    }
}

fn check(arguments: &CompensateArguments) -> Result<()> {
    let units = [
        ("--angle", &arguments.angle, Quantity::Angle),
        ("--length", &arguments.length, Quantity::Length),
    ];
    let units = units.into_iter().filter_map(|(option, given, quantity)| {
        let given = given.as_deref()?;
        let known = Unit::parse(given).is_some_and(|unit| unit.quantity() == quantity);
        let allowed = || Unit::symbols(quantity).join(", ");
        (!known).then(|| {
            Fault::new(
                option,
                format!("unknown unit `{given}`; allowed: {}", allowed()),
            )
        })
    });
    let stated = [
        ("--payload", Stated::Payload, arguments.payload),
        ("--temperature", Stated::Temperature, arguments.temperature),
    ]
    .map(|(option, what, value)| Some(Fault::new(option, value.and_then(|v| what.fault(v))?)));
    let [payload, temperature] = stated;
    let since = arguments.since_start;
    let since = since.filter(|since| !(since.is_finite() && *since >= 0.0));
    let since = since.map(|since| {
        Fault::new(
            "--since-start",
            format!("expected 0 or more, s, found {since}"),
        )
    });
    let limits = [
        ("--max-correction", Some(arguments.max_correction)),
        ("--max-turn", Some(arguments.max_turn)),
        ("--max-uncertainty", arguments.max_uncertainty),
    ];
    let direction = arguments.direction.filter(|sense| sense.abs() != 1.0);
    let direction = direction
        .map(|sense| Fault::new("--direction", format!("expected 1 or -1, found {sense}")));
    let tool = arguments.tool.as_deref();
    let tool = tool.and_then(|tool| RobotTool::parse(tool).err());
    // What is wrong is known before a pipeline is run for them.
    let targets = &arguments.targets;
    let unread = match targets.as_os_str() == "-" {
        true => None,
        false => raw::open(targets).err(),
    };
    let unread = unread.map(|error| {
        Fault::new(
            targets.display().to_string(),
            format!("cannot be read: {error}"),
        )
    });
    let out = arguments.out.as_deref();
    Error::if_spec(
        units
            .chain(payload)
            .chain(since)
            .chain(must_be_positive(limits))
            .chain(temperature)
            .chain(direction)
            .chain(tool.map(|message| Fault::new("--tool", message)))
            .chain(unread)
            .chain(out.and_then(|out| misplaced(out, &arguments.targets)))
            .collect(),
    )
}

/// Why the targets cannot be written to this file.
fn misplaced(out: &Path, targets: &Path) -> Option<Fault> {
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
    let message = if raw::same_file(out, targets) {
        "is the targets file itself: name another file".into()
    } else if out.is_dir() {
        format!("{} is a folder: name a file", out.display())
    } else if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        format!(
            "{}: there is no folder {}; make it, or name a file in another one",
            out.display(),
            folder.display()
        )
    } else if language(targets).is_none() && is_parquet(out) != is_parquet(targets) {
        "must have the format of the targets (text or Parquet): give it the same file ending".into()
    } else {
        return None;
    };
    Some(Fault::new("--out", message))
}

fn manner(
    arguments: &CompensateArguments,
    identified: &IdentifiedModel,
) -> Result<CorrectionOptions> {
    let robot = &identified.model.robot;
    let joints = robot.joints();
    let start = arguments.start.as_ref();
    if let Some(start) = start.filter(|start| start.len() != joints) {
        let found = counted(start.len(), "position");
        let message = format!("has {found}, the robot {}", counted(joints, "joint"));
        return Err(Error::spec("--start", message));
    }
    let si = |(joint, value): (usize, &f64)| {
        let unit = match robot.is_revolute(joint) {
            true => Unit::Degree,
            false => Unit::Millimetre,
        };
        unit.to_si(*value)
    };
    let usual = usual_options(identified);
    if arguments.time.is_some() && !usual.clock {
        return Err(Error::spec(
            "--time",
            "the recording of the model has no clock: its steps and drifts are known by row only",
        ));
    }
    Ok(CorrectionOptions {
        cartesian: arguments.target == What::Pose,
        oriented: arguments.orientation == OrientationUse::Keep,
        one_step: arguments.one_step,
        payload: arguments.payload.unwrap_or(0.0),
        temperature: arguments.temperature,
        time: arguments.time,
        direction: arguments.direction,
        start: start.map(|start| start.iter().enumerate().map(si).collect()),
        uncertainty: !arguments.no_sigma,
        gate: gate(arguments, identified),
        ..usual
    })
}

fn gate(arguments: &CompensateArguments, identified: &IdentifiedModel) -> Gate {
    let limits = GateLimits {
        correction: arguments.max_correction * 1e-3,
        turn: arguments.max_turn.to_radians(),
        uncertainty: arguments.max_uncertainty.map(|mm| mm * 1e-3),
        ..GateLimits::default()
    };
    let insisted = arguments.model.force;
    let refusals = identified.refusals.iter().filter(|_| insisted);
    Gate {
        limits,
        insisted,
        model: refusals.cloned().collect(),
    }
}

fn is_parquet(path: &Path) -> bool {
    raw::ending(path) == "parquet"
}

fn language(targets: &Path) -> Option<Language> {
    Language::of_ending(&raw::ending(targets))
}

/// What the head of a corrected program says of its model.
fn remarks(arguments: &CompensateArguments, identified: &IdentifiedModel) -> Vec<&'static str> {
    let insisted = arguments
        .model
        .force
        .then_some("limits overridden by --force");
    let unexplained = identified.unexplained.is_some();
    let unexplained = unexplained.then_some("verdict of the model: unexplained");
    insisted.into_iter().chain(unexplained).collect()
}

/// A controller's program, whole, and the data list of its name, whose points it moves to.
fn rewritten(
    arguments: &CompensateArguments,
    language: Language,
    layout: &Layout,
    (remarks, identified): (&[&str], &IdentifiedModel),
    corrector: &mut Corrector,
) -> Result<()> {
    let rules = ProgramRules {
        partial: match arguments.leave_partial {
            true => Partial::Left,
            false => Partial::Refused,
        },
        frames: match arguments.assume_frames {
            true => Frames::Assumed,
            false => Frames::Refused,
        },
        load: match (arguments.payload, layout.load) {
            (Some(payload), _) => ProgramLoad::Stated(payload),
            (None, Some(most)) => ProgramLoad::Needed(most),
            (None, None) => ProgramLoad::Optional,
        },
        tool: arguments
            .tool
            .as_deref()
            .and_then(|tool| RobotTool::parse(tool).ok()),
        base: identified.base_differs(language),
    };
    let list = match language {
        Language::Krl => data_list(&arguments.targets),
        _ => None,
    };
    let list = list.filter(|path| holds_targets(path, &arguments.targets));
    let mut files = vec![arguments.targets.clone()];
    if let (Some(list), false) = (&list, holds_targets(&arguments.targets, &arguments.targets)) {
        let message = format!(
            "has no targets: those that it moves to stand in {}, which is corrected by itself",
            list.display()
        );
        return Err(Error::data(layout.place, message));
    }
    files.extend(list);
    let outs = outs(arguments, &files)?;
    let mut texts = Vec::new();
    for (k, file) in files.iter().enumerate() {
        let place = match k {
            0 => layout.place.to_string(),
            _ => file.display().to_string(),
        };
        let text = readable(file, raw::bytes(file))?;
        let companions = Companions::of(file, language, &arguments.with)?;
        let source = ProgramFile {
            place: &place,
            text: &text,
            language,
            companions: &companions.files(),
        };
        if has_mark(&text, language) && !arguments.model.force {
            let message = "was compensated by calib already: a second correction would move the robot twice as far. Take the program of before, or insist with --force";
            return Err(Error::data(&place, message));
        }
        if !arguments.model.quiet {
            note(companions.summary_line().unwrap_or_default());
        }
        let mut rewritten = program::corrected(&source, rules.clone(), layout.robot, corrector)?;
        rewritten.bytes = with_mark(&rewritten.bytes, &text, language, remarks);
        let warnings = rewritten.warnings.iter();
        warn(warnings.map(|note| format!("{}: {}", source.at(note), note.message)));
        texts.push(rewritten.bytes);
    }
    for (k, text) in texts.into_iter().enumerate() {
        let out = outs.get(k).map(PathBuf::as_path);
        put(out, text)?;
        if let (1, Some(out), false) = (k, out, arguments.model.quiet) {
            let (list, out) = (files[k].display(), out.display());
            note(format!(
                "{list}, to whose points the program moves, is corrected too: {out}\n"
            ));
        }
    }
    Ok(())
}

/// Whether a file of a program of KUKA's has targets of its own; one that cannot be read as a program may have some.
fn holds_targets(file: &Path, program: &Path) -> bool {
    let Ok(text) = raw::bytes(file) else {
        return true;
    };
    let companions = Companions::of(program, Language::Krl, &[]);
    let companions = companions
        .as_ref()
        .map(Companions::files)
        .unwrap_or_default();
    let read = Program::parse_with(&text, Language::Krl, Partial::Left, &companions);
    read.map_or(true, |program| !program.literals().is_empty())
}

/// Where a program and its data list are written: the list beside the program, under its name. Fails where there is no such place.
fn outs(arguments: &CompensateArguments, files: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let Some(list) = files.get(1) else {
        return Ok(arguments.out.iter().cloned().collect());
    };
    let Some(out) = &arguments.out else {
        let message = format!(
            "moves to points of {}, which must be corrected with it, and standard output takes one file: name --out FILE, {} is written beside it",
            list.display(),
            list.file_name().unwrap_or_default().to_string_lossy()
        );
        return Err(Error::spec(
            arguments.targets.display().to_string(),
            message,
        ));
    };
    let ending = list.extension().unwrap_or_default();
    let beside = out.with_extension(ending);
    if raw::same_file(&beside, list) || beside == *out {
        let message = format!(
            "{} would be written over {}: name a file in another folder, e.g. corrected/{}",
            beside.display(),
            list.display(),
            out.file_name().unwrap_or_default().to_string_lossy()
        );
        return Err(Error::spec("--out", message));
    }
    Ok(vec![out.clone(), beside])
}

/// Reads, corrects and writes.
fn corrected(
    arguments: &CompensateArguments,
    layout: &Layout,
    about: (&[&str], &IdentifiedModel),
    corrector: &mut Corrector,
) -> Result<Unreached> {
    let targets = &arguments.targets;
    if let Some(language) = language(targets) {
        rewritten(arguments, language, layout, about, corrector)?;
        return Ok(Unreached::default());
    }
    match &arguments.out {
        Some(out) => whole(out, |file| {
            convert(targets, file, is_parquet(out), layout, corrector)
        }),
        None => convert(
            targets,
            std::io::stdout(),
            is_parquet(targets),
            layout,
            corrector,
        ),
    }
}

fn convert(
    targets: &Path,
    output: impl Write + Send,
    columnar: bool,
    layout: &Layout,
    corrector: &mut Corrector,
) -> Result<Unreached> {
    let mut output = BufWriter::new(output);
    let opened = || readable(targets, raw::open(targets));
    if columnar {
        return parquet::stream(opened()?, &mut output, layout, corrector);
    }
    let mut lines: Box<dyn BufRead> = match targets.as_os_str() == "-" {
        true => Box::new(BufReader::new(std::io::stdin())),
        false => Box::new(BufReader::new(opened()?)),
    };
    text::stream(&mut lines, &mut output, layout, corrector)
}
