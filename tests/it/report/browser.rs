//! The report in a browser, where there is one: what it refuses or complains of stands on the console.

use super::{html, tables::tables};
use calib::stage::Report;
use std::path::{Path, PathBuf};
use std::process::Command;

fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join("chromium")).find(|file| file.is_file())
}

/// The page as the browser understood it, and its console, one message a line.
fn open(chromium: &Path, name: &str, page: &str) -> (String, Vec<String>) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("browser-{name}"));
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join("report.html");
    std::fs::write(&file, page).expect("a page");
    let output = Command::new(chromium)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
        ])
        // Nothing listens there: the browser's own requests for updates end here too.
        .args(["--proxy-server=127.0.0.1:9", "--enable-logging=stderr", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("file://{}", file.display()))
        .output()
        .expect("chromium runs");
    let log = String::from_utf8_lossy(&output.stderr);
    let console = log.lines().filter(|line| line.contains(":CONSOLE")).map(str::to_owned).collect();
    (String::from_utf8_lossy(&output.stdout).into_owned(), console)
}

#[test]
fn a_browser_shows_the_report_without_complaint_and_without_a_request() {
    let Some(chromium) = chromium() else {
        println!("skipped: no chromium on PATH");
        return;
    };
    let page = html(Report::default(), tables("Heavy 6R, cell 4"));
    let (dom, console) = open(&chromium, "whole", &page);
    assert_eq!(dom.matches("<svg ").count(), page.matches("<svg ").count());
    assert_eq!(console, Vec::<String>::new());

    // The page's own policy forbids every request, so that one would show on the console.
    let asking = page.replace("</main>", "<img src=\"http://127.0.0.1:9/a.png\"></main>");
    let (_, console) = open(&chromium, "asking", &asking);
    assert!(console.iter().any(|line| line.contains("Content Security Policy")), "{console:?}");
}
