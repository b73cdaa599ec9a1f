//! The report in a browser, where there is one: what it refuses or complains of stands on the console.

use super::{
    html,
    tables::{tables, tables_of},
};
use crate::desk::skipped;
use calib::stage::{Report, ReportPages};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join("chromium"))
        .find(|file| file.is_file())
}

/// A browser that asks nobody: nothing listens at its proxy, so its own requests for updates end there too.
fn browser(chromium: &Path, folder: &Path, arguments: &[&str], page: &Path) -> Output {
    Command::new(chromium)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
        ])
        .args(["--proxy-server=127.0.0.1:9", "--enable-logging=stderr"])
        .arg(format!(
            "--user-data-dir={}",
            folder.join("profile").display()
        ))
        .args(arguments)
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("chromium runs")
}

/// A folder of a test with the page in it, where a browser that is kept out of `/tmp` can read it.
fn folder(page: &str) -> TempDir {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder");
    std::fs::write(folder.path().join("report.html"), page).expect("a page");
    folder
}

/// The page as the browser understood it after so many milliseconds, and its console, one message a line.
fn open(chromium: &Path, page: &str, milliseconds: u32) -> (String, Vec<String>) {
    let folder = folder(page);
    let time = format!("--virtual-time-budget={milliseconds}");
    let output = browser(
        chromium,
        folder.path(),
        &[&time, "--dump-dom"],
        &folder.path().join("report.html"),
    );
    let log = String::from_utf8_lossy(&output.stderr);
    let console = log
        .lines()
        .filter(|line| line.contains(":CONSOLE"))
        .map(str::to_owned)
        .collect();
    (
        String::from_utf8_lossy(&output.stdout).into_owned(),
        console,
    )
}

#[test]
fn a_browser_shows_the_report_without_complaint_and_without_a_request() {
    let Some(chromium) = chromium() else {
        return skipped("no chromium on PATH");
    };
    let page = html(Report::default(), tables("Heavy 6R, cell 4"));
    let (dom, console) = open(&chromium, &page, 4_000);
    assert_eq!(dom.matches("<svg ").count(), page.matches("<svg ").count());
    assert_eq!(console, Vec::<String>::new());

    // The page's own policy forbids every request, so that one would show on the console.
    let asking = page.replace("</main>", "<img src=\"http://127.0.0.1:9/a.png\"></main>");
    // On a busy machine the browser may be done before it has written that.
    let refused = |milliseconds| {
        open(&chromium, &asking, milliseconds)
            .1
            .iter()
            .any(|line| line.contains("Content Security Policy"))
    };
    assert!(
        [4_000, 16_000, 64_000].into_iter().any(refused),
        "a request is not refused"
    );
}

/// What `frame.html` saw of the report at some widths. On a busy machine the browser may be done before its frames are: then it gets longer.
fn seen(chromium: &Path, folder: &Path, widths: &[u32], scheme: &[&str]) -> Vec<serde_json::Value> {
    let frames = include_str!("frame.html").replace("WIDTHS", &format!("{widths:?}"));
    std::fs::write(folder.join("frame.html"), frames).expect("a page");
    let views = |budget: u32| -> Vec<serde_json::Value> {
        let budget = format!("--virtual-time-budget={budget}");
        let arguments = [
            &[
                "--allow-file-access-from-files",
                budget.as_str(),
                "--dump-dom",
            ],
            scheme,
        ]
        .concat();
        let output = browser(chromium, folder, &arguments, &folder.join("frame.html"));
        let dom = String::from_utf8_lossy(&output.stdout).into_owned();
        let texts = dom
            .split("<pre class=\"seen\">")
            .skip(1)
            .filter_map(|tail| tail.split("</pre>").next());
        texts
            .map(|text| {
                serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
            })
            .collect()
    };
    [4_000, 16_000, 64_000, 256_000]
        .into_iter()
        .map(views)
        .find(|views| views.len() == widths.len())
        .unwrap_or_default()
}

#[test]
fn the_report_fits_a_desk_and_a_telephone_and_is_legible_by_day_and_night() {
    let Some(chromium) = chromium() else {
        return skipped("no chromium on PATH");
    };
    let page = html(
        Report::default(),
        tables("Heavy 6R, cell 4 with a name that is longer than a telephone is wide"),
    );
    let folder = folder(&page);
    for (dark, scheme) in [
        (false, &[][..]),
        (true, &["--blink-settings=preferredColorScheme=0"][..]),
    ] {
        let seen = seen(&chromium, folder.path(), &[1280, 390], scheme);
        assert_eq!(seen.len(), 2, "{seen:?}");
        for view in seen {
            assert_eq!(view["dark"], dark, "{view}");
            assert_eq!(view["pictures"], page.matches("<svg ").count(), "{view}");
            assert_eq!(
                (&view["hidden"], &view["requests"]),
                (&0.into(), &0.into()),
                "{view}"
            );
            assert!(
                view["overflow"].as_i64().is_some_and(|beyond| beyond <= 0),
                "scrolls sideways: {view}"
            );
            // WCAG 2 AA.
            assert!(
                view["contrast"]
                    .as_f64()
                    .is_some_and(|contrast| contrast >= 4.5),
                "too faint: {view}"
            );
        }
    }
}

#[test]
fn nothing_of_the_report_is_cut_off_on_paper() {
    let Some(chromium) = chromium() else {
        return skipped("no chromium on PATH");
    };
    let page = html(Report::default(), tables("Heavy 6R, cell 4"));
    let folder = folder(&page.replace("@media print", "@media all"));
    // A4 without its margins of 14 mm, at 96 dots an inch.
    let seen = seen(&chromium, folder.path(), &[688], &[]);
    assert_eq!(seen.len(), 1, "{seen:?}");
    assert!(
        seen[0]["overflow"]
            .as_i64()
            .is_some_and(|beyond| beyond <= 0),
        "wider than the paper: {}",
        seen[0]
    );
}

#[test]
fn the_report_prints() {
    let Some(chromium) = chromium() else {
        return skipped("no chromium on PATH");
    };
    let folder = folder(&html(Report::default(), tables("Heavy 6R, cell 4")));
    let folder = folder.path();
    let file = folder.join("report.pdf");
    browser(
        &chromium,
        folder,
        &[&format!("--print-to-pdf={}", file.display())],
        &folder.join("report.html"),
    );
    let printed = std::fs::read(&file).expect("a PDF");
    let pages = printed
        .windows(12)
        .filter(|bytes| bytes == b"/Type /Page\n")
        .count();
    assert!(
        printed.starts_with(b"%PDF") && (4..20).contains(&pages),
        "{pages} pages"
    );
    assert!(printed.len() < 2_000_000, "{} bytes", printed.len());
}

#[test]
fn the_short_report_prints_on_at_most_four_pages() {
    let Some(chromium) = chromium() else {
        return skipped("no chromium on PATH");
    };
    let settings = Report {
        pages: ReportPages::Short,
        ..Report::default()
    };
    let folder = folder(&html(settings, tables("Heavy 6R, cell 4")));
    let file = folder.path().join("report.pdf");
    browser(
        &chromium,
        folder.path(),
        &[&format!("--print-to-pdf={}", file.display())],
        &folder.path().join("report.html"),
    );
    let printed = std::fs::read(&file).expect("a PDF");
    let pages = printed
        .windows(12)
        .filter(|bytes| bytes == b"/Type /Page\n");
    let pages = pages.count();
    assert!((1..=4).contains(&pages), "{pages} pages");
}

/// Says in the page how long it took from the request until all of it was read, its scripts had run and it was laid out, ms.
const OPENED: &str = r#"<pre id="opened"></pre><script>addEventListener("load", () => {
  document.body.getBoundingClientRect();
  document.getElementById("opened").textContent = Math.round(performance.now());
})</script></main>"#;

#[test]
fn a_report_of_five_thousand_points_is_light_and_opens_at_once() {
    let page = html(Report::default(), tables_of("Heavy 6R, cell 4", 5_000));
    assert!(page.len() < 2_500_000, "{} bytes", page.len());
    let Some(chromium) = chromium() else {
        return skipped("no chromium on PATH");
    };
    let folder = folder(&page.replace("</main>", OPENED));
    // By the clock on the wall, so that a machine which does other things gets three chances.
    let opened = || -> Option<u32> {
        let arguments = ["--dump-dom"];
        let file = folder.path().join("report.html");
        let output = browser(&chromium, folder.path(), &arguments, &file);
        let dom = String::from_utf8_lossy(&output.stdout).into_owned();
        let text = dom.split("<pre id=\"opened\">").nth(1)?.split('<').next()?;
        text.parse().ok()
    };
    let best = (0..3).filter_map(|_| opened()).min();
    assert!(best.is_some_and(|ms| ms < 2_000), "{best:?} ms");
}

/// What somebody does with the picture of the arm: turns it, looks at the errors after, and clicks on a point.
const HAND: &str = r##"<pre id="done"></pre><script>{
  const svg = document.querySelector("#arm svg"), output = document.querySelector("#arm output");
  const buttons = document.querySelectorAll("#arm button"), seen = () => [svg.querySelector(".arm").getAttribute("d"), output.textContent];
  const point = (kind, x, y) => svg.dispatchEvent(new PointerEvent(kind, { clientX: x, clientY: y, bubbles: true }));
  const frame = svg.getBoundingClientRect(), steps = [seen()], lines = [svg.querySelectorAll(".vector").length];
  point("pointerdown", 100, 100); point("pointermove", 180, 120); point("pointerup", 180, 120); steps.push(seen());
  buttons[1].click(); lines.push(svg.querySelector(".vector").getAttribute("d").length);
  point("pointerdown", frame.left + 9, frame.top + 9); point("pointerup", frame.left + 9, frame.top + 9); steps.push(seen());
  document.getElementById("done").textContent = JSON.stringify({ steps, lines, pressed: buttons[1].getAttribute("aria-pressed") });
}</script></main>"##;

#[test]
fn the_picture_of_the_arm_turns_and_a_click_shows_the_pose_of_a_point() {
    let Some(chromium) = chromium() else {
        return skipped("no chromium on PATH");
    };
    let page = html(Report::default(), tables("Heavy 6R, cell 4"));
    let (dom, console) = open(&chromium, &page.replace("</main>", HAND), 4_000);
    assert_eq!(console, Vec::<String>::new());
    let done = dom
        .split("<pre id=\"done\">")
        .nth(1)
        .and_then(|tail| tail.split("</pre>").next());
    let done: serde_json::Value = serde_json::from_str(done.expect("done")).expect("what was seen");
    let step = |k: usize, of: usize| {
        done["steps"][k][of]
            .as_str()
            .unwrap_or_default()
            .to_string()
    };
    assert_ne!(step(0, 0), step(1, 0), "it does not turn: {done}");
    assert_eq!(step(0, 1), step(1, 1), "turning chooses no point");
    assert_ne!(
        step(1, 1),
        step(2, 1),
        "a click chooses another point: {done}"
    );
    assert!(
        step(2, 1).contains(" mm \u{2192} ") && step(2, 1).contains("J3 "),
        "{done}"
    );
    assert_eq!(done["pressed"], "true");
}
