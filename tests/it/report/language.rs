//! The report in German: no sentence without its German, names as they are, decimal commas.

use super::{WARNED, html, literals::sentences, tables::tables};
use crate::answer::root;
use crate::compensate::calib;
use calib::report::PageLanguage;
use calib::stage::Report;
use std::collections::{BTreeMap, BTreeSet};

/// Messages of the page, and sentences that tables hold in English.
const MESSAGES: &str = include_str!("../../../src/report/language/de.po");
const STORED: &str = include_str!("../../../src/report/language/de_stored.po");

/// Sources whose sentences stand in tables that the page shows.
const SOURCES: [&str; 24] = [
    "fleet/cause_answers",
    "numerics/drives/causes",
    "numerics/effect/words",
    "numerics/dynamics/cause/",
    "numerics/dynamics/even",
    "numerics/dynamics/findings",
    "numerics/dynamics/outcome",
    "numerics/dynamics/spectrum",
    "numerics/dynamics/used",
    "table/drives",
    "numerics/compensate/remark",
    "numerics/diagnose/setup/",
    "numerics/diagnose/unasked",
    "numerics/diagnose/verdict/",
    "numerics/diagnose/words/",
    "numerics/estimate/observe",
    "stage/advice",
    "stage/learn/told",
    "stage/rounded",
    "stage/weightless",
    "table/observability",
    "table/parameters",
    "table/standing",
    "table/suspects",
];
/// A file of them that writes no sentence.
const WORDLESS: &str = "numerics/diagnose/words/mod";
/// Errors, notes of the terminal, names of numbers and markup among the sentences of these sources.
const NOT_SHOWN: [&str; 11] = [
    "not computed yet",
    "share of dry friction",
    "share of viscous friction",
    "share per torque",
    "cross-validated error on its own training rows",
    "cannot be computed",
    "shows at best as an angle, without a stiffness",
    "wind-up under the arm's own weight",
    "bending and counterbalances cannot be computed, and what they do may be attributed to another cause (gear, hose). Fill in `links` of the robot file",
    "is no parameter of this robot",
    "numbers and names serialise",
];
/// Units at the beginning of a part, the longer first.
const UNITS: [&str; 6] = ["Nm s/rad", "Nm/rad", "Nm", "kg m2", "rad/s", "rad"];
/// Words that make a part of a literal a sentence.
const WORDS: usize = 3;

/// What is said in one piece between the holes of a literal.
fn parts(literal: &str) -> Vec<String> {
    let plain = [
        ("u{201c}", "\u{201c}"),
        ("u{201d}", "\u{201d}"),
        ("u{b1}", "\u{b1}"),
        ("u{d7}", "\u{d7}"),
        ("u{2192}", "\u{2192}"),
    ];
    let text = plain
        .iter()
        .fold(literal.to_string(), |text, (code, letter)| {
            text.replace(code, letter)
        });
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for letter in text.chars() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ if depth > 0 => continue,
            other => parts.last_mut().expect("one").push(other),
        }
        if letter == '{' && depth == 1 {
            parts.push(String::new());
        }
    }
    let trimmed = parts.iter().map(|part| {
        part.trim_matches([' ', ',', '.', ';', ':', '(', ')', '`'])
            .to_string()
    });
    trimmed
        .filter(|part| part.split(' ').filter(|word| word.len() > 1).count() >= WORDS)
        .collect()
}

/// English and German of a table.
fn entries(table: &str) -> BTreeMap<&str, &str> {
    let lines: Vec<&str> = table
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .collect();
    let text = |line: &'_ str, key: &str| {
        let text = line
            .strip_prefix(key)
            .and_then(|text| text.strip_suffix('"'));
        text.map_or_else(|| panic!("{line}"), str::len)
    };
    let mut all = BTreeMap::new();
    for pair in lines.chunks(2).skip(1) {
        let [id, german] = pair else {
            panic!("no German of {pair:?}")
        };
        let [id, german] = [(*id, "msgid \""), (*german, "msgstr \"")]
            .map(|(line, key)| &line[key.len()..key.len() + text(line, key)]);
        assert!(all.insert(id, german).is_none(), "`{id}` stands twice");
    }
    all
}

/// What begins with one of these marks and ends with a quote.
fn quoted<'a>(text: &'a str, mark: &str) -> Vec<&'a str> {
    let after = text.split(mark).skip(1);
    after
        .filter_map(|text| text.split_once('"').map(|(id, _)| id))
        .collect()
}

fn holes(text: &str) -> BTreeSet<&str> {
    let parts = text.split('{').skip(1);
    parts
        .filter_map(|part| Some(part.split_once('}')?.0))
        .collect()
}

#[test]
fn every_message_of_templates_and_sources_has_its_german_and_none_is_left_over() {
    let mut asked: BTreeSet<String> = BTreeSet::new();
    for template in TEMPLATES {
        asked.extend(quoted(template, "_(\"").into_iter().map(str::to_owned));
    }
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/report");
    for path in crate::source::files(&root) {
        let text = std::fs::read_to_string(&path).expect("a source");
        let code = text.split("#[cfg(test)]").next().expect("one part");
        let code: String = code.lines().filter(|line| !line.contains("///")).collect();
        for call in code
            .split("say!(")
            .skip(1)
            .filter(|call| !call.starts_with('@'))
        {
            let literal = call.split_once('"').map(|(_, text)| text);
            asked.extend(literal.and_then(|text| Some(text.split_once('"')?.0.to_owned())));
        }
    }
    let german = entries(MESSAGES);
    let known: BTreeSet<String> = german.keys().map(|id| id.to_string()).collect();
    let missing: Vec<&String> = asked.difference(&known).collect();
    let unused: Vec<&String> = known.difference(&asked).collect();
    assert!(asked.len() > 300, "only {}", asked.len());
    assert!(
        missing.is_empty() && unused.is_empty(),
        "src/report/language/de.po lacks {missing:#?}, and nobody says {unused:#?}"
    );
    for (id, german) in &german {
        assert_eq!(holes(id), holes(german), "`{id}`");
    }
}

/// The templates of pages that have languages.
const TEMPLATES: [&str; 8] = [
    include_str!("../../../src/report/report.html"),
    include_str!("../../../src/report/head.html"),
    include_str!("../../../src/report/torques.html"),
    include_str!("../../../src/report/achieved.html"),
    include_str!("../../../src/report/drives.html"),
    include_str!("../../../src/report/diagnosed.html"),
    include_str!("../../../src/report/fleet.html"),
    include_str!("../../../src/report/fleet_causes.html"),
];

#[test]
fn a_template_says_nothing_but_messages() {
    for template in TEMPLATES {
        let mut text = template.to_string();
        for [open, close] in [["{#", "#}"], ["{{", "}}"], ["{%", "%}"], ["<", ">"]] {
            while let Some(from) = text.find(open) {
                let to = from + text[from..].find(close).expect("closed") + close.len();
                text.replace_range(from..to, "\n");
            }
        }
        let words: Vec<&str> = text.split_whitespace().collect();
        let letters = |word: &&&str| word.chars().any(char::is_alphabetic);
        let words = words
            .iter()
            .filter(letters)
            .filter(|word| **word != "calib");
        assert_eq!(words.collect::<Vec<_>>(), Vec::<&&str>::new());
    }
}

#[test]
fn no_stored_sentence_of_the_sources_lacks_its_german() {
    let known = STORED.to_lowercase();
    let shown = |file: &str| {
        SOURCES.iter().any(|source| file.starts_with(source)) && !file.starts_with(WORDLESS)
    };
    let all: Vec<(String, String)> = sentences()
        .into_iter()
        .filter(|(file, _)| shown(file))
        .collect();
    assert!(all.len() > 100, "only {}", all.len());
    let missing: Vec<String> = all
        .iter()
        .flat_map(|(file, literal)| {
            parts(literal)
                .into_iter()
                .map(move |part| (file, part.trim_start_matches("in `ingest`: ").to_string()))
        })
        // Of a joint that slides the unit is another one.
        .map(|(file, part)| {
            let unit = UNITS.iter().find_map(|unit| part.strip_prefix(unit));
            let rest = unit.filter(|rest| !rest.starts_with(char::is_alphanumeric));
            let rest = rest.map(|rest| rest.trim_start_matches([' ', ';', ':', ',']).to_string());
            (file, rest.unwrap_or(part))
        })
        // What is written into a pipeline or a robot file is YAML in every language.
        .filter(|(_, part)| part.matches('`').count().is_multiple_of(2))
        .filter(|(_, part)| {
            !NOT_SHOWN.contains(&part.as_str())
                && !part.contains("an earlier calib wrote")
                && !part.contains("no form of an effect")
        })
        .filter(|(_, part)| !known.contains(&part.to_lowercase()))
        .map(|(file, part)| format!("{file}: {part}"))
        .collect();
    assert!(
        missing.is_empty(),
        "src/report/language/de_stored.po lacks\n{}",
        missing.join("\n")
    );
}

#[test]
fn every_finding_of_the_library_has_its_german() {
    // As it is now: another test may have written it anew.
    let all = std::fs::read_to_string(root("tests/it/forms/sentences.txt")).unwrap();
    let missing: Vec<String> = all
        .lines()
        .filter_map(|line| Some(line.split_once(": ")?.1.replace('#', "7")))
        .map(|sentence| format!("{sentence} (31 um rms at the tool)"))
        .filter(|sentence| PageLanguage::German.stored(sentence).is_none())
        .collect();
    assert!(
        missing.is_empty(),
        "src/report/language/de_stored.po lacks\n{}",
        missing.join("\n")
    );
}

/// Statements that are made of several sentences, as they were written on pages.
const STATEMENTS: [&str; 12] = [
    "the findings explain the error; the residual agrees with the noise that 24 repeats show, 31 um",
    "the findings do not explain everything: 80 um remain of held-out points, 32 um of fitted ones, against the noise that 24 repeats show, 31 um",
    "nothing found; 32 um scatter at random, and no instrument is stated that explains any of it: state `instrument` in `ingest`, and measure ten poses twice",
    "the findings do not explain everything: 42 um remain; 47 um scatter at random, of which the instrument explains 19: measure ten poses twice",
    "the findings reproduce the error, but a part of it has no name: 15 um remain, against the noise that the instrument states, 14 um; the robot file gives no \
     link masses, yet gravity loads joints in these poses (10 rows of 80 carry a payload)",
    "something unknown acts at joint 2: gear_cyclic fits best (the transmission or encoder of joint 2 errs periodically with its angle: 3 times a turn by 15 \
     arcsec), but its size depends on the load of joint 2 and the time (31 um rms at the tool)",
    "what acts at link 2-3 is in no list (probability 0.97); the nearest of the list explains 83 % of it: link 2-3 bends under what it carries by \
     1.2e-7 rad/Nm (31 um rms at the tool)",
    "the set-up is wrong: joints 1, 4, 6 turn the other way than the robot file says; with this error the nominal robot is 783 mm off the points \
     (median, base and tool fitted), without it 1.2 mm. Remedy: in `ingest`: `columns: {q: {.., sign: [-1, 1, 1, -1, 1, -1]}}`, or turn the axes round in the \
     robot file. These data are explained equally well if the points are a mirror image: an axis of the tracker's frame has the wrong sign, or two are \
     exchanged; remedy then: in `ingest`: exchange the columns of `x` and `y`; since the base is fitted, this corrects both cases",
    "single wrong points: rows 4, 17 and 3 more",
    "gear_cyclic at joint 4 or counterbalance at joint 4: log motor currents at rest, or measure with two payloads over the joint's full range (for a balancer \
     also disconnected)",
    "4.311 mm from where its joints put it, and no mistake of the recording explains where it is",
    "4.6 times its tolerance; moves with base_frame.z (correlation +0.95); moving joint 4 would determine it",
];

#[test]
fn what_is_made_of_several_sentences_is_translated_as_a_whole() {
    for statement in STATEMENTS {
        let german = PageLanguage::German
            .stored(statement)
            .unwrap_or_else(|| panic!("no German of: {statement}"));
        assert!(
            !["error", " the ", " joint ", " rows", "mm from"]
                .iter()
                .any(|word| german.contains(word)),
            "{german}"
        );
    }
    let printed = PageLanguage::German
        .stored("the zero of joint 2 steps by 15.5 arcsec from row 40 (31 um rms at the tool)");
    assert_eq!(
        printed.as_deref(),
        Some(
            "der Nullpunkt von Gelenk 2 springt um 15,5 \u{2033} ab Zeile 40 (RMS am Werkzeug: 31 \u{b5}m)"
        )
    );
}

/// What the stage says before a text that stayed English.
const UNTRANSLATED: &str = "the page says this in English, as `de` lacks it: ";

/// What the tables of these tests say and no stage does.
const MADE_UP: [&str; 11] = [
    "temperature: none was recorded",
    "tracker scale: <measure> a scale bar",
    "joint 2 turns unevenly, twice a turn by 25 arcsec <b>",
    "the measured point lies on the axis of joint 6",
    "does the same as link_geometry.l2.z with joint_offset.j2",
    "directions of the parameters that the data see",
    "directions that this kind of robot can show",
    "largest over smallest seen singular value",
    "root of the product of the singular values over the root of the rows",
    "converged: gradient",
    "column `x`: `--` is no number; a decimal number in mm is expected",
];

#[test]
fn the_page_is_german_throughout_but_for_names() {
    let english = html(Report::default(), tables("Joint & mean"));
    let german = html(
        Report {
            language: PageLanguage::German,
            ..Report::default()
        },
        tables("Joint & mean"),
    );
    let missing: Vec<String> = WARNED.with_borrow_mut(std::mem::take);
    let missing = missing
        .iter()
        .filter_map(|text| text.strip_prefix(UNTRANSLATED));
    let missing: Vec<&str> = missing.filter(|text| !MADE_UP.contains(text)).collect();
    assert_eq!(missing, Vec::<&str>::new());
    assert!(
        german.contains("<html lang=\"de\">") && german.contains("<h2>Kalibrierschein</h2>"),
        "{german}"
    );
    // Names of robot and steps, what is written to be copied, and pictures are as they were.
    assert!(german.contains("Joint &amp; mean"));
    for kept in [
        "<span translate=\"no\">geometry</span>",
        "class=\"stored\"",
        "<svg ",
        "<code>",
    ] {
        assert_eq!(
            german.matches(kept).count(),
            english.matches(kept).count(),
            "{kept}"
        );
    }
    let stored = |page: &str| {
        let cells = page.split("class=\"stored\"").skip(1);
        cells
            .map(|tail| tail.split('<').next().map(str::to_owned))
            .collect::<Vec<_>>()
    };
    assert_eq!(stored(&german), stored(&english));
}

#[test]
fn a_run_writes_its_report_in_the_language_that_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipeline = concat!(env!("CARGO_MANIFEST_DIR"), "/pipelines/case/pipeline.yaml");
    let run = |arguments: &[&str]| {
        let output = calib(
            folder.path(),
            &[&["run", pipeline, "--quiet"], arguments].concat(),
            "",
        );
        assert_eq!(
            output.status.code(),
            Some(0),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        assert!(!String::from_utf8_lossy(&output.stderr).contains(UNTRANSLATED));
        std::fs::read_to_string(folder.path().join(".calib/documents/case/report.html"))
            .expect("a report")
    };
    let [english, german, again] = [
        run(&[]),
        run(&["--language", "de"]),
        run(&["--set", "report.language=de"]),
    ];
    assert!(
        english.contains("<html lang=\"en\">")
            && german.contains("<html lang=\"de\">")
            && again == german
    );
    let refused = calib(folder.path(), &["run", pipeline, "--language", "latin"], "");
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn every_hole_of_a_stored_sentence_is_filled() {
    for (english, german) in entries(STORED) {
        let count = |text: &str, holes: &[&str]| {
            let counts = holes.iter().map(|hole| text.matches(hole).count());
            counts.sum::<usize>()
        };
        assert_eq!(
            count(english, &["{}", "{#}", "{=}"]),
            count(german, &["{}", "{1}", "{2}", "{3}", "{4}", "{5}"]),
            "`{english}`"
        );
    }
}
