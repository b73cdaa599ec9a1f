//! Who runs calib, where and when: the only file that reads the environment and the clock.

use crate::error::{Error, Result};
use crate::pipeline::{Host, Surroundings, Tool};
use crate::store::Store;
use crate::summary::LABEL;
use anstyle::{AnsiColor, Style};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

/// Who runs calib, where and when.
pub fn surroundings(command_line: &[OsString]) -> Surroundings {
    Surroundings {
        tool: Tool {
            name: env!("CARGO_PKG_NAME").into(),
            version: env!("CARGO_PKG_VERSION").into(),
            target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            revision: option_env!("CALIB_REVISION").map(Into::into),
            rustc: option_env!("CALIB_RUSTC").map(Into::into),
        },
        host: Host {
            name: host_name(),
            os: std::env::consts::OS.into(),
            architecture: std::env::consts::ARCH.into(),
            cores: cores(),
        },
        user: user(),
        environment: environment(),
        command_line: command_line
            .iter()
            .map(|part| part.to_string_lossy().into_owned())
            .collect(),
        now: SystemTime::now,
        peak_memory,
        run_id: ulid::Ulid::generate().to_string(),
    }
}

pub(super) fn now() -> SystemTime {
    SystemTime::now()
}

/// The most memory that this process had in use so far, bytes; the kernel tells it on Linux alone.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<u64>().ok()? * 1024)
}

/// Whether a person wants colours on a terminal: https://no-color.org.
pub(super) fn colours() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Columns of the terminal, where stdout is one.
pub(super) fn columns() -> Option<usize> {
    let out = std::io::stdout();
    let size = std::io::IsTerminal::is_terminal(&out)
        .then(|| terminal_size::terminal_size_of(&out))
        .flatten();
    size.map(|(width, _)| usize::from(width.0))
}

/// The program to start calib with. In the process of an interpreter that is the script that it runs.
pub(super) fn program() -> std::io::Result<PathBuf> {
    let program = std::env::current_exe()?;
    let is_python = program
        .file_name()
        .is_some_and(|name| name.to_string_lossy().starts_with("python"));
    match std::env::args_os().nth(1).filter(|_| is_python) {
        Some(script) => std::path::absolute(script),
        None => Ok(program),
    }
}

/// How many cores there are.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Nobody where `CALIB_NO_USER` is set.
fn user() -> Option<String> {
    let named = || {
        std::env::var("USER")
            .or_else(|_| std::env::var("USERNAME"))
            .ok()
    };
    if std::env::var_os("CALIB_NO_USER").is_some() {
        None
    } else {
        named()
    }
}

/// What may change speed, never results; nothing else of the environment is kept.
fn environment() -> BTreeMap<String, String> {
    let known = [
        "RAYON_NUM_THREADS",
        "SLURM_JOB_ID",
        "SLURM_ARRAY_TASK_ID",
        "TZ",
        "LANG",
    ];
    known
        .iter()
        .filter_map(|name| Some((name.to_string(), std::env::var(name).ok()?)))
        .collect()
}

fn host_name() -> String {
    let from_kernel = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let name = from_kernel.or_else(|| {
        std::env::var("HOSTNAME")
            .or_else(|_| std::env::var("COMPUTERNAME"))
            .ok()
    });
    name.map_or_else(|| "unknown".into(), |name| name.trim().to_string())
}

/// Where tables go when `--store` does not say.
pub(super) fn default_store() -> PathBuf {
    PathBuf::from(".calib")
}

/// The URL of a store that is no folder.
pub(super) fn bucket(store: &Path) -> Option<&str> {
    store.to_str().filter(|text| text.starts_with("s3://"))
}

/// Opens what `--store` names: a folder, or a bucket with what was fetched from it below the user's cache.
pub fn open_store(given: Option<&Path>) -> Result<Store> {
    let Some(url) = given.and_then(bucket) else {
        return Store::open(given.map_or_else(default_store, Path::to_path_buf));
    };
    let settings = std::env::vars_os()
        .filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)));
    let settings = settings
        .filter(|(name, _)| name.starts_with("AWS_"))
        .collect();
    Store::open_s3(url, &settings, &cache())
}

/// `CALIB_CACHE`, or where the user's caches are.
fn cache() -> PathBuf {
    let variable = |name: &str| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    let usual =
        || variable("XDG_CACHE_HOME").or_else(|| variable("HOME").map(|home| home.join(".cache")));
    variable("CALIB_CACHE")
        .or_else(|| usual().map(|folder| folder.join("calib")))
        .unwrap_or_else(|| PathBuf::from(".calib-cache"))
}

/// The last panic of any thread: what it said, and where.
static LAST: Mutex<String> = Mutex::new(String::new());

/// Runs a verb; its panic becomes a bug, reported on stderr.
pub(super) fn guarded(verb: impl FnOnce() -> u8) -> u8 {
    std::panic::set_hook(Box::new(keep));
    caught(verb).unwrap_or_else(|bug| super::complain(&bug))
}

/// What a verb gives, or the bug that its panic is.
fn caught(verb: impl FnOnce() -> u8) -> Result<u8> {
    catch_unwind(AssertUnwindSafe(verb))
        .map_err(|_| Error::Bug(LAST.lock().unwrap_or_else(PoisonError::into_inner).clone()))
}

fn keep(panic: &PanicHookInfo) {
    let message = panic.payload_as_str().unwrap_or("stopped without a word");
    let place = panic.location().map_or_else(String::new, |place| {
        format!(", at {}:{}", place.file(), place.line())
    });
    *LAST.lock().unwrap_or_else(PoisonError::into_inner) =
        format!("{}{place}", message.replace('\n', " "));
}

/// Labels of lines that say what is to be seen to, and all others. Colour is laid over finished lines, so that the text is the same where there
/// is none, and no meaning hangs on it.
const ALARMS: [&str; 4] = ["warning", "doubt", "rejected", "withdrawn"];
const LABELS: [&str; 14] = [
    "robot",
    "before",
    "after",
    "carried",
    "found",
    "verdict",
    "next",
    "report",
    "limits",
    "not seen",
    "set aside",
    "done",
    "error",
    "more",
];

/// What a verdict begins with, and its colour.
const VERDICTS: [(&str, AnsiColor); 7] = [
    ("explained", AnsiColor::Green),
    ("nothing missing", AnsiColor::Green),
    ("unexplained", AnsiColor::Yellow),
    ("identified", AnsiColor::Yellow),
    ("not asked", AnsiColor::Yellow),
    ("wrong set-up", AnsiColor::Red),
    ("not accepted", AnsiColor::Red),
];

/// The same lines with bold labels; of the others nothing changes.
pub(crate) fn painted(text: &str) -> String {
    text.lines().map(|line| line_of(line) + "\n").collect()
}

fn line_of(line: &str) -> String {
    let Some((label, tail)) = line.split_at_checked(LABEL) else {
        return line.into();
    };
    let word = label.trim();
    let rank = word
        .strip_suffix('.')
        .is_some_and(|digits| digits.parse::<u32>().is_ok());
    let bold = match () {
        () if ALARMS.contains(&word) => {
            Style::new().bold().fg_color(Some(AnsiColor::Yellow.into()))
        }
        () if rank || LABELS.contains(&word) => Style::new().bold(),
        () => return line.into(),
    };
    let judges = ["verdict", "limits"].contains(&word);
    let verdict = VERDICTS
        .iter()
        .find(|(begins, _)| judges && tail.starts_with(begins));
    let ending = match verdict {
        Some((word, colour)) => {
            let colour = Style::new().bold().fg_color(Some((*colour).into()));
            format!("{colour}{word}{colour:#}{}", &tail[word.len()..])
        }
        None => tail.into(),
    };
    format!("{bold}{label}{bold:#}{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A verb with an index that is out of bounds, in a thread of its own.
    fn faulty(rows: &[u8]) -> u8 {
        let found = std::thread::scope(|scope| scope.spawn(|| rows[rows.len()]).join());
        found.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }

    #[test]
    fn a_panic_of_a_verb_is_a_bug_with_its_place_and_exit_code_70() {
        let hook = std::panic::take_hook();
        let code = guarded(|| faulty(&[1, 2, 3]));
        let bug = caught(|| faulty(&[1, 2, 3]));
        let sound = guarded(|| 10);
        std::panic::set_hook(hook);
        assert_eq!((code, sound), (70, 10));
        let message = super::super::message(&bug.unwrap_err());
        assert!(
            message.starts_with(
                "error: index out of bounds: the len is 3 but the index is 3, at src/cli/surroundings.rs:"
            ),
            "{message}"
        );
        assert!(
            message.ends_with("(this is a bug in calib)") && message.lines().count() == 1,
            "{message}"
        );
    }

    use super::painted;

    #[test]
    fn a_verdict_has_its_colour_and_text_stays_as_it_is() {
        let screen = painted("verdict   explained: all of it\n          calib poses --run HEAD\n");
        assert_eq!(
            screen,
            "\u{1b}[1mverdict   \u{1b}[0m\u{1b}[1m\u{1b}[32mexplained\u{1b}[0m: all of it\n          calib poses --run HEAD\n"
        );
        assert!(
            painted("warning   late\n").starts_with("\u{1b}[1m\u{1b}[33mwarning   \u{1b}[0mlate")
        );
        for plain in [
            "short\n",
            "  step       set             points\n",
            "          calib poses\n",
        ] {
            assert_eq!(painted(plain), plain);
        }
    }
}
