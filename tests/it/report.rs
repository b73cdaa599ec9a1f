//! `validate` and `report`: statistics against hand-made numbers, and a document that is whole, safe and the same every time.

mod browser;
mod language;
mod literals;
mod tables;

use calib::stage::{
    Context, Labelled, OpenedInput, Report, ReportReads, Services, Sink, Stage, Validate,
    ValidateReads,
};
use calib::table::*;
use tables::{point, tables};

thread_local! {
    /// What stages of this test warned of.
    static WARNED: std::cell::RefCell<Vec<String>> = const { std::cell::RefCell::new(Vec::new()) };
}

struct Silent;
impl Services for Silent {
    fn open(&self, _: &calib::stage::RawFile) -> calib::error::Result<OpenedInput> {
        Err(calib::error::Error::Bug("no files here".into()))
    }
    fn sink(&self, _: &'static str) -> calib::error::Result<Box<dyn Sink>> {
        Err(calib::error::Error::Bug("no sinks here".into()))
    }
    fn begin(&self, _: &str, _: Option<u64>, _: &str) {}
    fn advance(&self, _: u64, _: &str) {}
    fn note(&self, _: String) {}
    fn warn(&self, text: String) {
        WARNED.with_borrow_mut(|all| all.push(text));
    }
}

fn context() -> Context<'static> {
    Context {
        id: "report",
        seed: 7,
        jobs: 1,
        services: &Silent,
    }
}

fn validate(tables: Vec<Prediction>) -> Statistics {
    let prediction = tables
        .into_iter()
        .map(|table| Labelled {
            stage: "identify".into(),
            table,
        })
        .collect();
    Validate::default()
        .run(
            ValidateReads {
                prediction,
                observability: Vec::new(),
            },
            &context(),
        )
        .expect("statistics")
        .statistics
}

fn near(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 1e-12,
        "{found} is not {expected}"
    );
}

#[test]
fn statistics_of_four_points_are_those_of_pencil_and_paper() {
    // Errors 1, 2, 3, 6: mean 3, sum of squared deviations 14, sum of squares 50.
    let rows = [
        [1.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [0.0, 0.0, 3.0],
        [6.0, 0.0, 0.0],
    ];
    let rows = rows
        .into_iter()
        .zip(0..)
        .map(|(residual, k)| point(k, "geometry", "validate", true, residual))
        .collect();
    let statistics = validate(vec![Prediction(rows)]);
    let [row] = statistics.0.as_slice() else {
        panic!("one row expected: {statistics:?}")
    };
    assert_eq!(
        (
            row.order,
            row.step.as_str(),
            row.set.as_str(),
            row.held_out,
            row.points
        ),
        (0, "geometry", "validate", true, 4)
    );
    near(row.mean_mm, 3.0);
    near(row.std_mm, (14.0f64 / 3.0).sqrt());
    near(row.rms_mm, 12.5f64.sqrt());
    near(row.median_mm, 2.5);
    near(row.p95_mm, 3.0 + 3.0 * 0.85);
    near(row.max_mm, 6.0);
    near(row.rms_x_mm, (37.0f64 / 4.0).sqrt());
    near(row.rms_y_mm, 1.0);
    near(row.rms_z_mm, 1.5);
    near(row.noise_rms_mm, 0.00125f64.sqrt());
}

#[test]
fn a_set_of_which_part_was_fitted_makes_two_rows_and_two_tables_of_one_stage_two_steps() {
    let nominal = (0..4)
        .map(|k| point(k, "nominal", "all", true, [1.0, 0.0, 0.0]))
        .collect();
    let geometry = (0..4)
        .map(|k| {
            point(
                k,
                "geometry",
                "all",
                k == 3,
                [0.1 * (k + 1) as f64, 0.0, 0.0],
            )
        })
        .collect();
    let statistics = validate(vec![Prediction(nominal), Prediction(geometry)]);
    let found: Vec<_> = statistics
        .0
        .iter()
        .map(|r| (r.order, r.step.as_str(), r.held_out, r.points))
        .collect();
    assert_eq!(
        found,
        [
            (0, "nominal", true, 4),
            (1, "geometry", false, 3),
            (1, "geometry", true, 1)
        ]
    );
    near(statistics.0[1].mean_mm, 0.2);
    near(statistics.0[2].mean_mm, 0.4);
    near(statistics.0[2].std_mm, 0.0);
    let frame = statistics.to_frame().expect("the schema allows both rows");
    assert_eq!(
        Statistics::from_frame(&frame).expect("read back"),
        statistics
    );
}

#[test]
fn nothing_to_validate_is_an_error_of_the_pipeline() {
    let error = Validate::default()
        .run(
            ValidateReads {
                prediction: Vec::new(),
                observability: Vec::new(),
            },
            &context(),
        )
        .err()
        .expect("refused");
    assert_eq!(error.exit_code(), 2);
}

fn html(settings: Report, reads: ReportReads) -> String {
    let document = settings.run(reads, &context()).expect("a report").document;
    assert_eq!(document.0.len(), 3);
    assert_eq!(document.0[0].name, "report.html");
    assert_eq!(document.0[0].media_type, "text/html");
    document.0[0].content.clone()
}

/// Every inline picture, parsed as XML.
fn pictures(html: &str) -> usize {
    let mut count = 0;
    for part in html.split("<svg ").skip(1) {
        let body = part.split("</svg>").next().expect("split gives one part");
        let text = format!("<svg {body}</svg>");
        let svg = roxmltree::Document::parse(&text)
            .unwrap_or_else(|e| panic!("picture {count}: {e}\n{text}"));
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        assert!(
            svg.root_element()
                .children()
                .any(|child| child.has_tag_name("title"))
        );
        count += 1;
    }
    count
}

#[test]
fn a_report_stands_alone_and_its_pictures_are_sound() {
    let page = html(Report::default(), tables("Heavy 6R, cell 4"));
    for foreign in [
        "http://", "https://", "src=", "href=", "<script ", "@import", "url(",
    ] {
        assert!(
            !page.contains(foreign),
            "the report refers to something outside itself: {foreign}"
        );
    }
    for command in page
        .split("<code>calib ")
        .skip(1)
        .filter_map(|tail| tail.split([' ', '<']).next())
    {
        assert!(
            ["run", "check", "schema"].contains(&command),
            "the report names `calib {command}`, which does not exist"
        );
    }
    // The arm, two held-out sets with two pictures each, four views, one spectrum, one convergence, two trainings.
    assert_eq!(pictures(&page), 13);
    assert_eq!(page.matches("<script>").count(), 1);
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("report.html");
    std::fs::write(&path, &page).expect("a copy to look at");
}

#[test]
fn the_first_sentence_states_the_held_out_means_of_the_statistics() {
    let reads = tables("Heavy 6R, cell 4");
    let mean = |order: i64, set: &str| {
        let row = reads
            .statistics
            .0
            .iter()
            .find(|r| r.order == order && r.set == set && r.held_out)
            .expect("a row");
        format!("{:.3}", row.mean_mm)
    };
    let expected = |set: &str| {
        format!(
            "The mean position error fell from {} mm to {} mm on",
            mean(0, set),
            mean(3, set)
        )
    };
    let (largest, wished) = (expected("check"), expected("unloaded_check"));
    assert!(
        html(Report::default(), tables("Heavy 6R, cell 4")).contains(&largest),
        "{largest}"
    );
    let settings = Report {
        set: Some("unloaded_check".into()),
        ..Report::default()
    };
    assert!(
        html(settings, tables("Heavy 6R, cell 4")).contains(&wished),
        "{wished}"
    );
}

#[test]
fn a_wished_set_that_is_not_held_out_is_refused_with_the_allowed_ones() {
    let settings = Report {
        set: Some("learn".into()),
        ..Report::default()
    };
    let error = settings
        .run(tables("Heavy 6R, cell 4"), &context())
        .err()
        .expect("refused");
    assert_eq!(error.exit_code(), 2);
    let text = error.to_string();
    assert!(
        text.starts_with("report.with.set: `learn`") && text.ends_with("check, unloaded_check"),
        "{text}"
    );
}

#[test]
fn hostile_names_are_shown_and_not_run() {
    const HOSTILE: &str = "<script>alert(1)</script>\u{1}&\"'";
    let mut reads = tables(HOSTILE);
    for table in &mut reads.prediction {
        for row in &mut table.table.0 {
            row.set = HOSTILE.into();
            row.step = format!("{}{HOSTILE}", row.step);
        }
    }
    reads.statistics = validate(
        reads
            .prediction
            .iter()
            .map(|labelled| labelled.table.clone())
            .collect(),
    );
    reads.parameters.0[0].name = HOSTILE.into();
    reads.parameters.0[0].status = "\" onmouseover=\"alert(1)".into();
    reads.parameters.0[0].remark = Some(HOSTILE.into());
    reads.fit[0].table.0[7].step = HOSTILE.into();
    reads.training[0].table.0[0].phase = HOSTILE.into();
    reads.observability[0].table.0[9].step = HOSTILE.into();
    reads.rejected[0].table.0[0].text = HOSTILE.into();
    reads.intake[0].table.0[0].file = HOSTILE.into();
    reads.split.0[0].set = HOSTILE.into();
    let page = html(
        Report {
            title: Some(HOSTILE.into()),
            ..Report::default()
        },
        reads,
    );
    assert_eq!(
        page.matches("<script").count(),
        1,
        "markup from a name came through"
    );
    assert!(
        !page.contains("\" onmouseover=\""),
        "an attribute from a name came through"
    );
    assert!(page.contains("&lt;script&gt;alert(1)"));
    assert!(pictures(&page) > 10);
}

#[test]
fn reference_figures_stand_beside_ours_only_where_there_are_any() {
    assert!(
        !html(Report::default(), tables("Heavy 6R, cell 4"))
            .contains("Compared with reference figures")
    );
    let mut reads = tables("Heavy 6R, cell 4");
    let row = reads
        .statistics
        .0
        .iter_mut()
        .find(|row| row.step == "network" && row.set == "check")
        .expect("a row");
    row.reference = Some("Table 9 <paper>".into());
    row.reference_mean_mm = Some(0.6522);
    row.reference_max_mm = Some(0.9834);
    let ours = format!("{:.3}", row.mean_mm);
    let page = html(Report::default(), reads);
    let table = page
        .split("Compared with reference figures")
        .nth(1)
        .and_then(|tail| tail.split("</table>").next())
        .expect("a table");
    assert!(
        table.contains("Table 9 &lt;paper&gt;") && table.contains("held out"),
        "{table}"
    );
    assert!(
        table.contains(&format!("<b>{ours}</b></td><td>0.652</td>")),
        "{table}"
    );
    assert!(table.contains("<td>0.983</td>"), "{table}");
}

#[test]
fn rivals_of_a_correction_stand_with_their_errors_and_why_they_were_not_kept() {
    let page = html(Report::default(), tables("Heavy 6R, cell 4"));
    let section = page
        .split("id=\"corrections\"")
        .nth(1)
        .and_then(|tail| tail.split("</section>").next())
        .expect("a section");
    assert!(
        section.contains("the mean error falls from 0.810 to 0.550 mm on rows that it did not see"),
        "{section}"
    );
    assert!(section.contains(
        "kept</span> network, started by BSO</th><td>0.550</td><td>0.605</td><td>1.650</td><td>+0.260 \u{b1} 0.021</td>"
    ));
    assert!(
        section.contains("0.070 mm behind mlp_bso &lt;b&gt;</td>"),
        "{section}"
    );
    assert!(
        section.contains("network, started at random</th><td></td><td></td><td></td><td></td>"),
        "{section}"
    );
    let mut reads = tables("Heavy 6R, cell 4");
    let rows = &mut reads.corrections[0].table.0;
    (rows[0].chosen, rows[2].chosen) = (true, false);
    rows[0].reason = "nothing that was tried helps clearly".into();
    assert!(
        html(Report::default(), reads)
            .contains("no correction was kept: nothing that was tried helps clearly.")
    );
    let mut reads = tables("Heavy 6R, cell 4");
    reads.corrections = Vec::new();
    assert!(!html(Report::default(), reads).contains("id=\"corrections\""));
}

#[test]
fn the_range_of_a_joint_that_slides_is_in_millimetres() {
    assert!(
        html(Report::default(), tables("Heavy 6R, cell 4"))
            .contains("Valid for joint 2 from -45.8 to 63.0 deg.")
    );
    let mut reads = tables("Heavy 6R, cell 4");
    let row = &mut reads.findings[0].table.0[0];
    (row.valid_from_rad, row.valid_to_rad) = (None, None);
    (row.valid_from_mm, row.valid_to_mm) = (Some(12.0), Some(1987.5));
    assert_eq!(row.valid_range(), Some((2, [12.0, 1987.5], "mm")));
    assert!(html(Report::default(), reads).contains("Valid for joint 2 from 12.0 to 1987.5 mm."));
}

#[test]
fn the_same_tables_give_the_same_bytes() {
    let make = || html(Report::default(), tables("Heavy 6R, cell 4"));
    assert_eq!(make(), make());
}

#[test]
fn what_was_rejected_is_counted_whole_and_listed_to_the_fiftieth() {
    let page = html(Report::default(), tables("Heavy 6R, cell 4"));
    assert!(page.contains("rows that were read and not used: 61"));
    assert_eq!(page.matches("2026-11-02T09:14").count(), 50);
    let mut reads = tables("Heavy 6R, cell 4");
    reads.intake[0].table.0[0].accepted = 499;
    assert!(html(Report::default(), reads).contains("does not add up"));
}

#[test]
fn empty_tables_make_a_report_that_says_so() {
    let mut reads = tables("");
    reads.prediction = Vec::new();
    reads.statistics = Statistics::default();
    reads.parameters = Parameters::default();
    reads.robot = Robot::default();
    reads.recording = Recording {
        joints: 3,
        prismatic: vec![false; 3],
        ..Recording::default()
    };
    reads.split = Split::default();
    (reads.intake, reads.rejected, reads.fit) = (Vec::new(), Vec::new(), Vec::new());
    (reads.observability, reads.training, reads.corrections) = (Vec::new(), Vec::new(), Vec::new());
    let page = html(Report::default(), reads);
    assert_eq!(pictures(&page), 0);
    for sentence in [
        "No point was held out",
        "identified no parameters",
        "No row was rejected",
        "No file was read",
    ] {
        assert!(page.contains(sentence), "{sentence}");
    }
}

#[test]
fn one_point_without_error_still_draws() {
    let mut reads = tables("Heavy 6R, cell 4");
    let one = Prediction(vec![point(0, "nominal", "check", true, [0.0; 3])]);
    reads.statistics = validate(vec![one.clone()]);
    reads.prediction = vec![Labelled {
        stage: "identify".into(),
        table: one,
    }];
    reads.fit[0].table.0.truncate(1);
    reads.fit[0].table.0[0].rms_mm = 0.0;
    let page = html(Report::default(), reads);
    assert!(pictures(&page) >= 6);
    assert!(page.contains("The mean position error is 0.000 mm on one point of the set"));
}

#[test]
fn the_certificate_is_green_only_where_the_error_is_explained_and_within_the_limits() {
    let card = |printed: &str, mean_mm: Option<f64>| {
        let mut reads = tables("Heavy 6R, cell 4");
        reads.verdict[0].table.0[0].verdict = printed.into();
        let limits = calib::stage::Accepted {
            mean_mm,
            ..Default::default()
        };
        let identity = [("robot serial".to_string(), "4711".to_string())].into();
        let page = html(
            Report {
                limits,
                identity,
                ..Report::default()
            },
            reads,
        );
        let card = page
            .split("id=\"verdict\"")
            .next()
            .and_then(|head| head.rsplit("<section class=\"verdict ").next())
            .expect("a card");
        assert!(
            page.contains("<dt>serial number of the robot</dt><dd translate=\"no\">4711</dd>")
                && page.matches("signature</span>").count() == 1
        );
        assert!(page.contains("expanded uncertainty of the corrected robot"));
        // What is not explained is not called accepted.
        assert_eq!(
            page.contains("Accepted: within"),
            ["explained", "nothing_missing"].contains(&printed) && mean_mm == Some(100.0)
        );
        card.trim_end_matches(['"', ' ']).to_string()
    };
    assert_eq!(card("explained", Some(100.0)), "better");
    assert_eq!(card("nothing_missing", Some(100.0)), "better");
    assert_eq!(card("unexplained", Some(100.0)), "open");
    assert_eq!(card("not_asked", Some(100.0)), "open");
    assert_eq!(card("explained", Some(1e-6)), "worse");
    assert_eq!(card("unexplained", Some(1e-6)), "worse");
    assert_eq!(card("explained", None), "unknown");
    assert_eq!(card("unexplained", None), "open");
}

#[test]
fn the_table_of_causes_shows_what_was_found_and_what_is_left() {
    let grid = CauseGrid::of(&tables::cells(), &tables::findings());
    assert_eq!(
        grid.columns,
        ["own angle", "load"],
        "columns in which something is"
    );
    assert_eq!(grid.others, ["other angle", "time", "temperature"]);
    let places: Vec<&str> = grid.rows.iter().map(|row| row.place.as_str()).collect();
    assert_eq!(
        places,
        ["base", "joint 2"],
        "a coupling belongs to the joint that is moved, a run of links has a row where something was found alone"
    );
    let [base, joint] = &grid.rows[..] else {
        panic!("two rows")
    };
    assert!(
        base.found.iter().chain(&base.left).all(Option::is_none),
        "the base was asked neither by angle nor by load"
    );
    let found = joint.found[0].as_ref().expect("asked");
    assert_eq!(
        (found.mm, &found.effects[..]),
        (Some(0.28), &["gear_cyclic".to_string()][..])
    );
    assert_eq!(
        joint.left[0].as_ref().expect("asked").mm,
        None,
        "nothing is left by the angle"
    );
    assert_eq!(joint.left[1].as_ref().expect("asked").mm, Some(0.012));
    assert_eq!(
        grid.text(),
        "found        own angle\njoint 2         280 um\n"
    );
}

fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let tail = text.split_once(from).map_or("", |(_, tail)| tail);
    tail.split(to).next().unwrap_or_default()
}

#[test]
fn what_nobody_stated_is_a_line_to_fill_in_and_the_date_is_that_of_the_recording() {
    let blank = |page: &str| page.matches("<dd class=\"blank\"></dd>").count();
    let nothing = html(Report::default(), tables("Heavy 6R, cell 4"));
    assert_eq!(blank(&nothing), 8);
    let mut reads = tables("Heavy 6R, cell 4");
    // 20 November 2026, 08:12:09 UTC and on.
    let time = (0..reads.recording.rows()).map(|row| 1_795_162_329.0 + row as f64);
    reads.recording.time = Some(time.collect());
    let identity = [
        ("operator", "A. Meier"),
        ("Tracker", "AT960 <b>"),
        ("tracker_serial", "123"),
        ("cell", "7"),
    ];
    let identity = identity.map(|(name, value)| (name.to_string(), value.to_string()));
    let stated = Report {
        identity: identity.into(),
        ..Report::default()
    };
    let page = html(stated, reads);
    assert_eq!(blank(&page), 4);
    for line in [
        "date of the measurement</dt><dd translate=\"no\">2026-11-20</dd>",
        "instrument</dt><dd translate=\"no\">AT960 &lt;b&gt;</dd>",
        "serial number of the instrument</dt><dd translate=\"no\">123</dd>",
        "<dt>cell</dt><dd translate=\"no\">7</dd>",
    ] {
        assert!(page.contains(line), "{line}");
    }
}

#[test]
fn the_certificate_lists_held_out_points_and_all_are_in_a_file_for_spreadsheets() {
    let reads = || {
        let mut reads = tables("Heavy 6R, cell 4");
        for table in &mut reads.prediction {
            for row in &mut table.table.0 {
                row.point_id = format!("=1+{}", row.sequence);
            }
        }
        reads
    };
    let page = html(Report::default(), reads());
    let listed = between(&page, "id=\"held-out\"", "</section>");
    let written = Report::default().run(reads(), &context());
    let written = written.expect("a report").document;
    let (name, text) = (&written.0[2].name, &written.0[2].content);
    assert_eq!(
        (name.as_str(), &*written.0[2].media_type),
        ("points.csv", "text/csv")
    );
    let lines = text.lines().count() - 1;
    let rows = reads().statistics.0;
    let after = rows
        .iter()
        .filter(|row| row.held_out && row.step == "network");
    assert_eq!(after.map(|row| row.points).max(), Some(lines as i64));
    assert!(
        lines > 60 && listed.contains(&format!("all {lines} are in points.csv")),
        "{lines}"
    );
    assert_eq!(listed.matches("<tr><th").count(), 50 + 10 + 2);
    assert!(
        text.lines().skip(1).all(|line| line.starts_with("'=1+")),
        "{text}"
    );
}

#[test]
fn a_short_report_has_the_certificate_the_causes_and_the_arm_alone() {
    let settings = Report {
        pages: calib::stage::ReportPages::Short,
        ..Report::default()
    };
    let page = html(settings, tables("Heavy 6R, cell 4"));
    for kept in ["verdict", "arm-and-errors", "findings", "reproduce"] {
        assert!(page.contains(&format!("id=\"{kept}\"")), "{kept}");
    }
    for gone in [
        "held-out",
        "errors",
        "workspace",
        "parameters",
        "convergence",
        "data",
    ] {
        assert!(!page.contains(&format!("id=\"{gone}\"")), "{gone}");
    }
    assert_eq!(pictures(&page), 1);
}
