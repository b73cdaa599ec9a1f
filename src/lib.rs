//! `calib` makes industrial robots accurate and says why they were not: from measured points, from torques, or from commands and
//! positions it names the physics that a model leaves out, with its place, its size and what these data cannot tell apart from it.
//!
//! Most people use the command: the README and its three tutorials (`pipelines/tutorials`). This page is for those who call calib
//! from a program, and for those who change it: [the library](#as-a-library), [the map](#the-map) of the sources,
//! [a measurement from file to report](#a-measurement-from-file-to-report), [how to add things](#adding-things), [the words](#glossary).
//!
//! # As a library
//! The command line is one user of this crate; a program is another, by [`api`]; the Python package (`src/python`) is made of it too. Inside,
//! numbers are SI, arrays are row-major, joints count from 0.
//!
//! Identify an arm from arrays:
//! ```
#![doc = include_str!("../tests/it/library/identify.rs")]
//! ```
//! Diagnose what a model of it leaves out:
//! ```
#![doc = include_str!("../tests/it/library/diagnose.rs")]
//! ```
//! Read the tables of a run:
//! ```
#![doc = include_str!("../tests/it/library/tables.rs")]
//! ```
//!
//! # The map
//! Two towers that do not know each other, and one bridge. **Numerics** (`spatial -> robot -> effect -> observation -> estimate -> engine -> diagnose`)
//! has no files and no frames: the package `calib-numerics` in `src/numerics`, and above it `calib-diagnose`, `calib-dynamics`,
//! `calib-engine` and `calib-drives` in folders of that. The **twin** (`calib-twin`) does not depend on them. **Columns** (`raw`, `store`)
//! have no robots. [`table`] is the only bridge between a Parquet row and a Rust value; [`stage`] is the only place where both towers are used;
//! [`pipeline`] is the only caller of stages. Data goes one way: YAML -> draft -> `Plan` -> stage -> tables -> report. Nothing is updated in
//! place, no layer calls back up.
//!
//! Layers with a `Cargo.toml` in their folder are packages (`calib-raw`, `calib-store`, `calib-table`, `calib-report`, `calib-program`,
//! `calib-stage`, `calib-foundation` for what all may use, `calib-schemas` in `schemas`): they compile side by side, and the compiler keeps
//! their walls. All are handed on here; the rest is this package.
//!
//! | layer | what it holds | may use |
//! |---|---|---|
//! | [`error`], [`units`], [`figures`], [`statistics`] | errors by reader, units of stored columns, digits by standard deviations, quantiles; all may use them | - |
//! | [`description`] | the robot as plain data | - |
//! | `shell` | words for a shell, in scripts and in commands that are proposed | - |
//! | `text` | lines for a terminal as templates | - |
//! | [`raw`] | the files of others: regular ones alone, decoded without a panic; tables of any kind (text, workbook, Parquet, Feather, arrays, bags of ROS 2) as records of cells, numbers in cells | - |
//! | [`yaml`] | YAML as a tree with places, and trees as typed values with every fault | - |
//! | [`criteria`] | numbers by which something is decided: meaning, unit, source | - |
//! | [`spatial`] | pose, twist, exp, adjoint, left Jacobian | - |
//! | [`robot`] | import of robots, their screws, their gravity torques; rows as measured | description, spatial, yaml |
//! | [`effect`] | the library of physical effects, a row of the table of causes each, and their composition | criteria, robot, spatial |
//! | [`observation`] | the kinds of measurement: columns, residual, noise, derivatives, rank | effect, robot, spatial |
//! | [`estimate`] | least squares, observability, swarm, learned corrections | criteria, effect, observation, robot, spatial |
//! | [`compensate`] | commands that bring the real arm to a wanted point: the inverse of the identified model | effect, estimate, robot, spatial |
//! | [`program`] | programs of controllers (KRL, RAPID), read strictly: rewritten in the numbers of their targets, or as lists of joints | compensate, robot, spatial |
//! | [`targets`] | tables of targets (text, Parquet) with their joints replaced, planned motions with their torques | compensate, dynamics, raw, robot |
//! | [`engine`] | one evidence and one search for what a model lacks, whatever was recorded | criteria |
//! | [`diagnose`] | where recording and simulation differ, which cause explains it | criteria, effect, engine, estimate, observation, robot, spatial |
//! | [`dynamics`] | torques of the moving arm, and which physics a rigid one lacks | criteria, diagnose, effect, engine, estimate, spatial |
//! | [`drives`] | robots from MJCF, their drives rolled out along commands, and which physics that simulation lacks | dynamics, engine |
//! | [`twin`] | the truth maker: recordings by other kinematics than the estimator's | the robot's description only |
//! | [`store`] | schemas, checked frames, content-addressed objects, runs; knows no robot | raw |
//! | `diff` | two tables or two runs compared | raw, store, text |
//! | [`table`] | Rust values <-> checked columns; rows are made of the schema files | store, the numerics |
//! | [`report`] | tables -> HTML; computes nothing that is not a column | table |
//! | [`stage`] | one file per step of a pipeline | compensate, program, raw, report, table, numerics, twin, yaml |
//! | [`pipeline`] | the YAML, the plan, the run | raw, stage, store, yaml |
//! | [`identified`] | the identified model of a run, or of tables, as it is compensated and exported | compensate, pipeline, program, raw, stage, store, targets, table, numerics, yaml |
//! | `export` | the identified model for other programs, one file per format | compensate, criteria, drives, dynamics, effect, estimate, identified, raw, robot, spatial, table, text, yaml |
//! | `init` | what given files are, and the pipeline that reads them | drives, program, raw, robot, stage, yaml |
//! | [`excitation`] | which motion to record for torques, for a robot file; which commands to send to drives, for an MJCF | drives, identified, init, numerics, stage |
//! | [`fleet`] | many robots: roster, records, workers, cluster, causes, tables | criteria, effect, estimate, pipeline, raw, report, shell, stage, store, table, yaml |
//! | [`audit`] | runs shown, explained, compared, asked, traced, swept | diff, pipeline, raw, shell, stage, store |
//! | `proof` | sets of concealed recordings, their seal, diagnoses held against the truth | estimate, raw, robot, table, twin |
//! | [`poses`] | which poses to measure, for a robot file or for a finding of a run | audit, identified, numerics, pipeline, raw, store, table, text |
//! | [`summary`] | what runs, tables and diagnoses say, as text and as JSON | audit, diagnose, diff, effect, pipeline, report, shell, stage, store, table, text |
//! | [`api`] | calib from arrays: a robot and a recording, and what the stages make of them in memory | audit, compensate, identified, pipeline, poses, raw, stage, store, summary, table, numerics |
//! | [`cli`], `progress` | the only places that print, and the only ones that know a terminal | all |
//!
//! # A measurement, from file to report
//! 1. `cell7/tracker.csv`, line 17: `P0014; 1834,112; -402,871; 1290,455`. [`stage::ingest`] reads it by the columns that the YAML names
//!    (`raw` decodes the bytes), converts millimetres into metres, joins the line of the controller with the same name, and writes a row
//!    of the table `recording`; a line that cannot be used becomes a row of `rejected` with its reason.
//! 2. [`stage::split`] deals the row out to a set: `fit` or `validate`.
//! 3. [`table::Recording`] becomes [`robot::Measurements`], struct of arrays in SI. From here on there are no frames and no names of files.
//! 4. [`estimate::fit()`] predicts the point: [`robot::RobotModel`] is the nominal chain, and every [`effect::Effect`] of the
//!    [`effect::EffectStack`] adds a small motion at its place on the chain, with its derivatives by its parameters. Levenberg-Marquardt on
//!    QR factors moves the parameters; those that the data cannot determine are held and reported.
//! 5. [`diagnose::diagnose`] asks of what is left which cause explains it: all cells of the table of causes, with a name or without, are
//!    compared by their evidence after geometry has absorbed its part; those that win are fitted with the whole model, until none changes.
//! 6. The stage turns model and residual back into rows: `parameters`, `prediction` (measured minus predicted of our row, in mm),
//!    `findings`. [`store`] checks them against their schema, names them by the hash of their content, and commits.
//! 7. [`stage::Validate`] states the errors of each set after every step; [`report`] writes one page from the tables; [`cli`] prints.
//! 8. `calib lineage HEAD/validate/statistics` walks back, down to the bytes of the two files.
//!
//! # Invariants
//! 1. Below `cli` nothing prints, exits, reads the environment or the clock (clippy.toml).
//! 2. A stage never sees a path or the store.
//! 3. `estimate` never sees a frame, `store` never a robot.
//! 4. Randomness enters only as a seed.
//! 5. SI inside; a stored column's name ends in its unit, one unit per quantity (lengths mm, angles rad).
//! 6. A table once committed is never changed.
//! 7. No file uses, by whatever detour, a file that uses it, but for a room's own file and its members.
//!
//! # Adding things
//! | add | new | touch |
//! |---|---|---|
//! | effect | a row of [`effect::CAUSES`] in `src/numerics/effect/table.rs`; what no row follows yet is a variant of `Follows` in `law_row.rs`, whose `laws` propose it and whose `is` knows it again | its short sentence in `src/summary/text/phrases.txt`, the German of the long one in `src/report/language/de_stored.po`; then `CALIB_UPDATE=1 cargo test --test it forms pages language` |
//! | shape of a law | a variant of [`effect::Basis`] in `src/numerics/effect/basis.rs`: how many functions, their values, what they may be off beyond the data | the `Follows` that proposes it; `near` of `law_row.rs` where a shape number is searched |
//! | cause of torques | a `TorqueCause` in `src/numerics/dynamics/cause/<kind>.rs`: columns, sentence, what it follows | a line in `TORQUE_CAUSES` of `cause/mod.rs`; its short sentence and German as of an effect |
//! | cause of drives | a row of `causes!` in `src/numerics/drives/causes.rs`, its cells in `cells` there | a variant of `Key` in `key.rs`: what it changes of the roll-out; sentences as of an effect |
//! | effect of a user's own | a YAML file as in `pipelines/case/effects`, read by [`effect::EffectDeclaration`] | `effects: [FILE]` of a stage `diagnose`, or `diagnose_torques` |
//! | kind of measurement | `src/numerics/observation/<name>.rs`, which implements [`observation::MeasurementKind`] | its `mod`, and one line in [`observation::KINDS`] |
//! | circumstance of a row | - | one line in [`robot::CIRCUMSTANCES`]; one `in_laws` declared effects read by its name |
//! | kind of raw file | `src/raw/<name>.rs`, which hands out records, the header first | its `mod` and `pub use` in `src/raw/lib.rs`; in `src/stage/ingest/reading.rs` a variant of `FileKind`, how a file is known to be one (`of`, the first that fits), and a line in `records`; `init` follows |
//! | number that decides | a row of `src/numerics/criteria/<class>.rs` | the code that says `*NAME` |
//! | setting of a stage | a field of its settings with `#[serde(default)]` and a doc line, which is its help in editors and on the page of stages; what it may be in `faults` | its use in `run`; a new stage number in `stage!` where tables of old settings change; then `CALIB_UPDATE=1 cargo test --test it pages schemas` |
//! | stage | `src/stage/<name>.rs`, declared with its ports by `stage!` | one line in [`stage::STAGES`] |
//! | table | `schemas/<kind>.json`, of which its rows are made; `src/table/<kind>.rs` for what fills them | one line in `tables!` of `src/table/lib.rs` |
//! | export format | `src/export/<name>.rs`, which declares an `export::Format`; the file begins with `Export::head`, by which `check-export` knows it | its `mod` and one line in `FORMATS`, both in `src/export/mod.rs` |
//! | figure of a page | - | the template in `src/report`: it has the rows of tables with all their columns, and the filters `mm`, `count`, `fixed`, `significant` |
//! | sentence of a page | - | `_("...", name=...)` in its template, or `say!` in `src/report`; its German in `src/report/language/de.po`, of sentences in tables in `de_stored.po` |
//! | line of `calib show`, `explain`, `diagnose --details` | - | the template in `src/summary/text` |
//! | figure of `--json` | - | the columns that `table::picked` is asked for where the document is made |
//! | pipeline | `pipelines/<name>/pipeline.yaml` | - |
//!
//! An effect step by step, with a row of the table that a test compiles and fits: `src/numerics/effect/README.md`.
//!
//! Where a test goes: beside the code what needs one file alone; in `tests/it/<topic>.rs` what a user sees by the command or the library
//! (`forms` of causes of points, `torques`, `drives`, `ingest` of files, `pages` of what is generated, `cmd` of a verb's words).
//!
//! House rules: files are cohesive, 100 to 600 lines; rustfmt's defaults; names of types once. Verbs
//! are functions, nouns are data; models are immutable; `f64`, ordered maps. Doc lines say what, shapes, units, failure; comments say why.
//! Errors name the place and what is allowed, all faults at once. Joints count from 1 for people and from 0 in code. Tests are named as
//! facts, their numbers come from elsewhere; a bug fix starts with the failing test. Pages are generated where code knows better:
//! `CALIB_UPDATE=1 cargo test --test it pages`; golden answers of the command line: `TRYCMD=overwrite cargo test --test it cmd`.
//!
//! # Glossary
//! Terms are those of the field: the *International Vocabulary of Metrology* (VIM: repeatability, standard uncertainty, expanded uncertainty,
//! coverage factor), Craig and Lynch & Park (chains, screws, Jacobians), Rawlings et al., *Applied Regression Analysis* (confounding, collinearity,
//! leverage, lack of fit), ISO 9283 (pose accuracy; calib's figures are not its tests). What they leave open:
//!
//! | word | what it means here |
//! |---|---|
//! | cause | a physical reason of position error, in a list; an effect is the motion that it makes on the chain |
//! | form | a cause at a place with its shape numbers: a term, or a motion with physics of its own; a hypothesis is a form that a cause proposes |
//! | term | a form that is a law times a motion at a place |
//! | place | where on the chain (or in the measurement) a cause acts: joint 2, link 3, base, tool, recording |
//! | law | a function of what a row offers (angle, load, time ...): a basis of one variable, or a product of two |
//! | shape number | a parameter that enters a law nonlinearly (a threshold, a time, a width); coefficients enter linearly |
//! | cell | a place, a motion there and what it follows, whatever the curve: what a diagnosis compares, with the name of a cause or `unknown` |
//! | evidence | how probable the rows are with a cell over without it, its size and the scale of the noise integrated |
//! | finding | cells of one name and place that a diagnosis keeps, with their evidence |
//! | rival | another explanation of a finding that these data do not exclude |
//! | residual | measured minus predicted; whitened: in standard deviations |
//! | excess sigma | standard deviation of the residuals beyond the stated noise |
//! | repeatability | standard deviation of a joint that comes back to a pose |
//! | fold | a part of the rows to fit, whole poses, that is predicted by a fit to the others |
//! | held out | rows that no step is fitted to: they judge in the end and choose nothing |
//! | set-up error | what is wrong between files and robot file before any physics: a unit, sign, zero, order, frame, typed number |
//! | suspect | a row that no smooth model can follow; it is set aside and kept |
//! | contact constraint | a ball or tip in a socket, on a plane or a sphere, so that joints alone are recorded; it closes where model and place agree |
//! | volume term | the logarithm of how far joint noise spreads a point that is held at a place: without it least squares shrinks the arm |
//! | redundant | a parameter whose effect other free parameters have too; unseen: one that the data do not show |
//! | observable | what these data determine; unobservable: what they cannot, however good the fit |
//! | twin | the simulated robot whose truth is known; it shares no code with the estimator |
//! | compliance | turn of a joint per torque, rad/Nm |
//! | datum freedom | a motion of everything that no measurement shows; targets and anchors are what is measured from and to |
//! | step | a stage that predicts; the one that stands is used by report, compensation and export |

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub use calib_diagnose as diagnose;
pub use calib_drives as drives;
pub use calib_dynamics as dynamics;
pub use calib_engine as engine;
pub use calib_foundation::{description, error, figures, statistics, units};
pub use calib_numerics::{
    compensate, criteria, effect, estimate, observation, robot, spatial, yaml,
};
pub use calib_program::{self as program, targets};
pub use calib_raw as raw;
pub use calib_report as report;
pub use calib_stage as stage;
pub use calib_store as store;
pub use calib_table as table;
pub use calib_twin as twin;

pub(crate) mod diff;
pub(crate) mod shell;
pub(crate) mod text;

pub mod pipeline;

pub mod api;
pub mod audit;
pub mod excitation;
pub(crate) mod export;
pub mod fleet;
pub mod identified;
pub(crate) mod init;
pub mod poses;
pub(crate) mod proof;
pub mod summary;

#[expect(
    clippy::disallowed_methods,
    reason = "shows how long things take, on stderr"
)]
pub(crate) mod progress;

#[expect(
    clippy::disallowed_methods,
    reason = "reads the environment and the clock for all others, and prints"
)]
pub mod cli;
