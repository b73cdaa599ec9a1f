//! The fleet's page at 5,000 robots: small, sorted in the browser, without a request.

use calib::report::PageLanguage;
use calib::report::fleet::html;
use calib::table::{FleetChanges, FleetRow, FleetTable};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;

fn row(number: usize) -> FleetRow {
    let after = 0.02 + (number * 7919 % 5000) as f64 * 1e-5;
    let some = |value: f64| Some(value);
    FleetRow {
        robot: if number == 7 {
            "<b>7</b>".into()
        } else {
            format!("robot {number}")
        },
        model: Some("sr210d".into()),
        plant: None,
        campaign: Some("2026-10-01".into()),
        status: if number % 50 == 3 {
            "rejected".into()
        } else {
            "done".into()
        },
        reason: (number % 50 == 3).then(|| "tracker.csv:4: not a number".into()),
        points: Some(30),
        held_out: Some(true),
        before_mean_mm: some(1.5),
        before_rms_mm: some(2.0),
        before_max_mm: some(5.0),
        after_mean_mm: some(after * 0.9),
        after_rms_mm: some(after),
        after_max_mm: some(after * 2.0),
        floor_mm: some(0.015),
        noise_basis: Some("instrument".into()),
        course: Some(format!("2.0000 0.3000 {after:.4}")),
        verdict: Some("explained".into()),
        findings: Some(1),
        causes: Some("gear_cyclic at joint 2".into()),
        changes: Some(0),
        flags: None,
    }
}

fn page() -> String {
    let table = FleetTable((0..5000).map(row).collect());
    let links: BTreeMap<String, String> = (0..5000)
        .map(|k| (format!("robot {k}"), format!("../line.{k}/report.html")))
        .collect();
    let changes = FleetChanges::default();
    html("line", &table, &changes, &links, PageLanguage::English)
        .unwrap()
        .html
}

#[test]
fn five_thousand_robots_make_a_page_of_a_few_megabytes() {
    let page = page();
    assert!(page.len() < 6_000_000, "{}", page.len());
    assert_eq!(page.matches("<tr>").count(), 5001);
    assert!(page.contains("&lt;b&gt;7&lt;&#x2f;b&gt;") && !page.contains("<b>7"));
    assert!(
        page.contains("href=\"..&#x2f;line.12&#x2f;report.html\"")
            || page.contains("href=\"../line.12/report.html\"")
    );
}

#[test]
fn robots_that_need_a_technician_come_first_with_the_reason() {
    let mut table = FleetTable((0..6).map(row).collect());
    table.0[2].verdict = Some("unexplained".into());
    table.0[4].flags = Some("zero of joint 2".into());
    table.0[5].after_rms_mm = Some(2.5);
    let (changes, links) = (FleetChanges::default(), BTreeMap::new());
    let page = html("line", &table, &changes, &links, PageLanguage::English).unwrap();
    let page = page.html;
    let at = |text: &str| {
        page.find(text)
            .unwrap_or_else(|| panic!("{text} is not there"))
    };
    let printed = [
        "<li>robot 3: was not calibrated: tracker.csv:4: not a number</li>",
        "<li>robot 5: the calibration did not make it more accurate</li>",
        "<li>robot 4: changed beyond its limits since the last calibration: zero of joint 2</li>",
        "<li>robot 2: its error is not explained: gear_cyclic at joint 2</li>",
    ];
    assert!(printed.windows(2).all(|pair| at(pair[0]) < at(pair[1])));
    let rows = [
        "robot 3", "robot 5", "robot 4", "robot 2", "robot 0", "robot 1",
    ]
    .map(|name| at(&format!("<td class=\"name\">{name}<")));
    assert!(rows.is_sorted(), "{rows:?}");
}

fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join("chromium"))
        .find(|file| file.is_file())
}

#[test]
fn a_browser_sorts_and_filters_the_page_without_a_request() {
    let Some(chromium) = chromium() else {
        crate::desk::skipped("no chromium on PATH");
        return;
    };
    // The page's own script, driven as a person would.
    let drive = "<script>document.querySelectorAll('th button')[4].click();\
        const s = document.getElementById('search'); s.value = 'rejected'; s.dispatchEvent(new Event('input'));</script></body>";
    let page = page().replace("</body>", drive);
    // Where a browser that is kept out of `/tmp` can read it.
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let file = folder.path().join("fleet.html");
    std::fs::write(&file, page).unwrap();
    let output = Command::new(chromium)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
        ])
        .args([
            "--disable-background-networking",
            "--proxy-server=127.0.0.1:9",
            "--enable-logging=stderr",
            "--dump-dom",
        ])
        .arg(format!(
            "--user-data-dir={}",
            folder.path().join("profile").display()
        ))
        .arg(format!("file://{}", file.display()))
        .output()
        .unwrap();
    let (dom, log) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    let console: Vec<&str> = log
        .lines()
        .filter(|line| line.contains(":CONSOLE"))
        .collect();
    assert_eq!(console, Vec::<&str>::new());
    assert!(dom.contains(">100 of 5000<"), "the filter counts");
    let best = dom.find("data-v=\"0.02\"").unwrap();
    let other = dom.find("data-v=\"0.0699").unwrap();
    assert!(
        dom.contains("aria-sort=\"ascending\"") && best < other,
        "sorted by the error after"
    );
}

#[test]
fn the_page_is_german_but_for_names_and_reasons() {
    let mut table = FleetTable((0..60).map(row).collect());
    table.0[1].flags = Some(
        "zero_shift joint 3 since 2026-04-01: +0.021 +- 0.002 deg zero_shift.j3.step (10.5 sigma)"
            .into(),
    );
    table.0[1].changes = Some(1);
    table.0[2].flags = Some(
        "backlash joint 2 since 2026-04-01: diagnosed, it was not before; not in the campaign before"
            .into(),
    );
    table.0[4].verdict = Some("unexplained".into());
    table.0[5].verdict = Some("wrong_setup".into());
    table.0[6].after_rms_mm = Some(9.0);
    let (changes, links) = (FleetChanges::default(), BTreeMap::new());
    let german = PageLanguage::German;
    let page = html("line", &table, &changes, &links, german).unwrap();
    assert_eq!(page.untranslated(german), Vec::<String>::new());
    for said in [
        "<html lang=\"de\">",
        "Flotte line",
        "Getriebe, periodisch (Gelenk 2)",
        "seit 2026-04-01: +0,021 \u{b1} 0,002 \u{b0} zero_shift.j3.step",
        "seine Einrichtung ist falsch",
        "2,000",
    ] {
        assert!(page.html.contains(said), "{said} is not in {}", page.html);
    }
}
