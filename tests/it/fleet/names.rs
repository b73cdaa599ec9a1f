//! Names of robots are data: never a path, never a command, never markup.

use super::{copy, file, fleet, output, recordings, run};
use crate::answer::{has, read};
use std::path::Path;

const NAMES: [&str; 10] = [
    "it's \"quoted\"",
    "two\nlines",
    "$(touch pwned)",
    "`touch pwned`; touch pwned",
    "..x",
    "-rf",
    " blank ",
    "<img src=x onerror=alert(1)>",
    "${case}",
    "\u{202e}r\u{eb}v\u{1b}[31m",
];

fn every_file(folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        found.push(entry.file_name().to_string_lossy().into_owned());
        if entry.path().is_dir() {
            every_file(&entry.path(), found);
        }
    }
}

#[test]
fn names_never_become_paths_commands_or_markup() {
    let folder = tempfile::tempdir().unwrap();
    let (cases, store, robots) = (
        folder.path().join("cases"),
        folder.path().join("store"),
        folder.path().join("robots"),
    );
    recordings(&cases, 1);
    for name in NAMES {
        copy(&cases.join("recordings/c0001"), &robots.join(name));
    }
    let file = file(folder.path(), "line", "robots:\n  - folders: robots/*\n");
    // Rendered before any is done, so that all are in it.
    let (result, printed) = output(fleet("render", &file, &store).args([
        "--engine",
        "slurm",
        "--robots-per-task",
        "3",
    ]));
    assert!(result.status.success(), "{printed}");
    let script = String::from_utf8(result.stdout).unwrap();
    has(&script, "#SBATCH --array=0-3\n");
    for part in ["pwned", "-rf", "blank", "onerror", "quoted"] {
        assert!(!script.contains(part), "{part}: {script}");
    }
    let answer = run(&file, &store, 0);
    let mut names: Vec<&str> = answer["robots"]
        .as_array()
        .unwrap()
        .iter()
        .map(|robot| robot["robot"].as_str().unwrap())
        .collect();
    names.sort_unstable();
    let mut wanted = NAMES.to_vec();
    wanted.sort_unstable();
    assert_eq!(names, wanted);
    let mut files = Vec::new();
    every_file(&store, &mut files);
    assert!(
        files.iter().all(|name| name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "._-".contains(c))),
        "{files:?}"
    );
    let page = read(answer["page"].as_str().unwrap());
    assert!(
        !page.contains("<img") && page.contains("&lt;img src=x"),
        "the name is markup"
    );
    assert!(!page.contains('\u{1b}') && !page.contains('\u{202e}'));
    let (result, _) = output(fleet("status", &file, &store).args(["--robot", NAMES[9]]));
    assert!(!String::from_utf8(result.stdout).unwrap().contains('\u{1b}'));
    assert!(!Path::new("pwned").exists() && !folder.path().join("pwned").exists());

    let (result, printed) = output(fleet("render", &file, &store).args(["--engine", "slurm"]));
    assert_eq!(result.status.code(), Some(2));
    has(&printed, "every robot is recorded");
}

#[test]
fn what_would_need_quoting_in_a_job_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    recordings(&folder.path().join("cases"), 1);
    let file = file(
        folder.path(),
        "line",
        "robots:\n  - folders: cases/recordings/*\n",
    );
    let store = folder.path().join("a store");
    let (result, printed) = output(fleet("render", &file, &store).args([
        "--engine",
        "slurm",
        "--partition",
        "main\n#SBATCH x",
    ]));
    assert_eq!(result.status.code(), Some(2));
    has(&printed, ["--partition: ", "--store: "]);
    let (result, printed) =
        output(fleet("render", &file, &store).args(["--engine", "k8s", "--image", "calib:0.1"]));
    assert!(result.status.success(), "{printed}");
    let text = String::from_utf8(result.stdout).unwrap();
    has(&text, ["completionMode: Indexed", "completions: 1\n"]);
}
