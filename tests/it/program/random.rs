//! Programs at random, and programs with one byte changed: every number of an accepted one is what a second reader says.

use super::reader::{self, Targets};
use super::{Program, TargetKind, moved};
use calib::program::{Language, Partial};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

const SEED: u64 = 20_261_122;
const PROGRAMS: usize = 150;
const CHANGES: usize = 12;

struct Writer {
    rng: ChaCha8Rng,
    rapid: bool,
    text: String,
    wanted: Targets,
}

impl Writer {
    fn pick<'a>(&mut self, choices: &[&'a str]) -> &'a str {
        choices[self.rng.random_range(0..choices.len())]
    }

    fn say(&mut self, text: &str) {
        for c in text.chars() {
            let other = if self.rng.random_bool(0.2) {
                c.to_ascii_lowercase()
            } else {
                c
            };
            self.text.push(other);
        }
    }

    /// Blanks, of RAPID line ends and comments too; at least one where words would run together.
    fn gap(&mut self, needed: bool) {
        let some: &[&str] = if self.rapid {
            &[" ", "  ", "\t", "\r\n ", "\n", " ! [1,2 ;\n"]
        } else {
            &[" ", "  ", "\t"]
        };
        let blank = self.pick(some);
        if needed || self.rng.random_bool(0.15) {
            self.text.push_str(blank);
        }
    }

    /// Writes a number in one of its forms and returns what it is.
    fn number(&mut self, least: f64, most: f64) -> f64 {
        let value = self.rng.random_range(least..most);
        let text = match self.rng.random_range(0..6) {
            0 => format!("{value:.0}"),
            1 => format!("{value:.3}"),
            2 => format!("{value:.2}E+00"),
            3 => format!("{value:e}").replace('e', "E"),
            4 if self.rapid => format!("{value:.0}."),
            _ => format!("{value:.6}"),
        };
        self.gap(false);
        let unsigned = text.trim_start_matches('-');
        if text.starts_with('-') {
            self.text.push('-');
            self.gap(false);
        } else if self.rng.random_bool(0.05) {
            self.text.push('+');
        }
        self.text.push_str(unsigned);
        let value: f64 = unsigned.parse().unwrap();
        self.gap(false);
        if text.starts_with('-') { -value } else { value }
    }

    fn aggregate(&mut self, prefix: Option<&str>, axes: bool) {
        self.text.push('{');
        self.gap(false);
        if let Some(prefix) = prefix {
            self.say(prefix);
            self.gap(false);
            self.text.push(':');
        }
        let names = if axes {
            ["A1", "A2", "A3", "A4", "A5", "A6"]
        } else {
            ["X", "Y", "Z", "A", "B", "C"]
        };
        let mut values = Vec::new();
        for (k, name) in names.into_iter().enumerate() {
            if k > 0 {
                self.text.push(',');
                self.gap(false);
            }
            self.say(name);
            self.gap(true);
            values.push(self.number(-180.0, 180.0));
        }
        if prefix.is_some_and(|prefix| prefix.starts_with("E6")) {
            let end = if axes {
                ",E1 0.0"
            } else {
                ",S 2,T 'B101010',E1 0"
            };
            self.text.push_str(end);
        }
        self.text.push('}');
        self.wanted.push((
            if axes {
                TargetKind::Joints
            } else {
                TargetKind::Frame
            },
            values,
        ));
    }

    fn krl(&mut self) {
        self.text
            .push_str("&ACCESS RVP\r\n&PARAM X = {\r\nDEF weld( )\r\n");
        for k in 0..self.rng.random_range(1..8) {
            let axes = self.rng.random_bool(0.5);
            let kind = if axes {
                self.pick(&["E6AXIS", "AXIS"])
            } else {
                self.pick(&["E6POS", "POS"])
            };
            match self.rng.random_range(0..5) {
                0 => {
                    self.say("DECL ");
                    self.say(kind);
                    self.text.push_str(&format!(" XP{k}="));
                    let prefix = Some(kind).filter(|_| self.rng.random_bool(0.5));
                    self.aggregate(prefix, axes);
                }
                1 => {
                    self.say("CIRC ");
                    self.aggregate(None, false);
                    self.text.push(',');
                    self.aggregate(Some("POS"), false);
                    self.text.push_str(",CA 30 C_DIS");
                }
                2 => {
                    self.say("SLIN ");
                    self.aggregate(Some("E6POS"), false);
                    self.text.push_str(" WITH $VEL={CP 2,ORI1 200}");
                }
                _ => {
                    self.say(if axes { "PTP " } else { "LIN " });
                    self.aggregate(None, axes);
                    self.gap(false);
                }
            }
            let end = self.pick(&[
                "\r\n",
                "\n",
                " ; {A1 3,A2 \"4\n",
                "\n;FOLD {X 1\n",
                "\nMsg(\"} {A1 5\")\n",
                "\n$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}\n",
            ]);
            self.text.push_str(end);
        }
        self.text
            .push_str("LIN_REL {X 5}\nDECL FRAME F={X 1,Y 2,Z 3,A 4,B 5,C 6}\nEND\n");
    }

    fn list(&mut self, values: &mut Vec<f64>, count: usize) {
        self.text.push('[');
        for k in 0..count {
            if k > 0 {
                self.text.push(',');
            }
            values.push(self.number(-1500.0, 1500.0));
        }
        self.text.push(']');
        self.gap(false);
    }

    fn literal(&mut self, pose: bool) {
        let mut values = Vec::new();
        self.text.push('[');
        self.gap(false);
        self.list(&mut values, if pose { 3 } else { 6 });
        self.text.push(',');
        if pose {
            let turn = self.pick(&["[1,0,0,0]", "[0.6000000, 0,-0.80,0]", "[ .5,0.5,-.5,5e-1]"]);
            self.text.push_str(turn);
            self.text.push_str(",[0,-1,0,1],");
            values.extend(match turn.as_bytes()[1] {
                b'1' => [1.0, 0.0, 0.0, 0.0],
                b'0' => [0.6, 0.0, -0.8, 0.0],
                _ => [0.5, 0.5, -0.5, 0.5],
            });
        }
        self.text.push_str("[9E9,9E+09,9e9,9E9,9E9,9E9]]");
        self.gap(false);
        self.wanted.push((
            if pose {
                TargetKind::Quaternion
            } else {
                TargetKind::Joints
            },
            values,
        ));
    }

    fn rapid(&mut self) {
        self.text.push_str("MODULE m\n");
        for k in 0..self.rng.random_range(1..4) {
            let pose = self.rng.random_bool(0.6);
            let storage = self.pick(&["CONST ", "PERS ", "LOCAL VAR "]);
            self.say(storage);
            self.say(if pose { "ROBTARGET" } else { "JOINTTARGET" });
            self.gap(true);
            let array = self.rng.random_bool(0.3);
            self.text
                .push_str(&format!("p{k}{}:=", if array { "{2}" } else { "" }));
            self.gap(false);
            if array {
                self.text.push('[');
            }
            self.literal(pose);
            if array {
                self.text.push(',');
                self.literal(pose);
                self.text.push(']');
            }
            let end = self.pick(&[";\n", ";", ";\r\n! [[1,2;\n"]);
            self.text.push_str(end);
        }
        self.text.push_str("PERS tooldata t:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nPROC main()\n");
        for _ in 0..self.rng.random_range(1..4) {
            let motion = self.pick(&["MOVEL", "MOVEJ", "MOVEC", "MOVEABSJ"]);
            self.say(motion);
            self.gap(true);
            self.literal(motion != "MOVEABSJ");
            if motion == "MOVEC" {
                self.text.push(',');
                self.literal(true);
            }
            let end = self.pick(&[
                ",v1000,z50,t\\WObj:=wobj0;\n",
                ",[100,500,5000,1000],fine,t;\n",
                " , v1, z1, t;\nTPWrite \"[[1,2;\";\n",
            ]);
            self.text.push_str(end);
        }
        self.text.push_str("ENDPROC\nENDMODULE\n");
    }
}

fn program(seed: u64, language: Language) -> Writer {
    let rapid = language == Language::Rapid;
    let mut writer = Writer {
        rng: ChaCha8Rng::seed_from_u64(seed),
        rapid,
        text: String::new(),
        wanted: Vec::new(),
    };
    if rapid {
        writer.rapid()
    } else {
        writer.krl()
    }
    writer
}

fn read(language: Language, text: &[u8]) -> Option<Targets> {
    if language == Language::Krl {
        reader::krl(text)
    } else {
        reader::rapid(text)
    }
}

fn found(program: &Program) -> Targets {
    program
        .literals()
        .iter()
        .map(|literal| (literal.kind, literal.values.clone()))
        .collect()
}

/// The bytes outside of the numbers of targets, and of the blank between a name and a number.
pub fn unchanged(text: &[u8], program: &Program) -> Vec<u8> {
    let mut spans: Vec<_> = program
        .literals()
        .iter()
        .flat_map(|literal| literal.spans.clone())
        .collect();
    spans.sort_by_key(|span| span.start);
    let mut out = Vec::new();
    let mut from = 0;
    for span in spans {
        let before = &text[from..span.start];
        out.extend_from_slice(before.strip_suffix(b" ").unwrap_or(before));
        from = span.end;
    }
    out.extend_from_slice(&text[from..]);
    out
}

/// Every number of what is written for an accepted program, against the second reader's of the program.
fn check(language: Language, text: &[u8], program: &Program) {
    let shown = String::from_utf8_lossy(text);
    let wanted =
        read(language, text).unwrap_or_else(|| panic!("accepted, and not to be read:\n{shown}"));
    assert_eq!(found(program), wanted, "{shown}");
    assert_eq!(moved(program, 0.0), text, "{shown}");
    // A quaternion is one no longer when every part of it is moved far.
    let by = 1e-5;
    let out = moved(program, by);
    let written = read(language, &out).unwrap();
    assert_eq!(written.len(), wanted.len());
    for ((kind, values), (_, given)) in written.iter().zip(&wanted) {
        for (k, (value, given)) in values.iter().zip(given).enumerate() {
            let half = match kind {
                TargetKind::Quaternion if k > 2 => 5e-10,
                TargetKind::Frame | TargetKind::Quaternion if k < 3 => 5e-6,
                _ => 5e-7,
            };
            let slack = half + 1e-15 * given.abs();
            assert!(
                (value - given - by).abs() <= slack * 1.000_001,
                "{value} of {given}:\n{shown}"
            );
        }
    }
    let again = Program::parse(&out, language, Partial::Refused).unwrap();
    assert_eq!(unchanged(&out, &again), unchanged(text, program), "{shown}");
}

#[test]
fn every_number_of_a_random_program_is_read_and_written_as_it_stands() {
    for language in [Language::Krl, Language::Rapid] {
        for k in 0..PROGRAMS as u64 {
            let writer = program(SEED + k, language);
            let text = writer.text.as_bytes();
            let program = Program::parse(text, language, Partial::Refused)
                .unwrap_or_else(|refusal| panic!("{}\n{:#?}", writer.text, refusal.faults));
            assert_eq!(found(&program), writer.wanted, "{}", writer.text);
            check(language, text, &program);
        }
    }
}

#[test]
fn a_program_with_a_byte_changed_is_refused_or_read_as_it_stands() {
    const BYTES: &[u8] = b" ,.;:{}[]()-+eE0123456789AXYZxq_\"'\\!\n\r\t&#$%<=\xA0\xC3\x00";
    for language in [Language::Krl, Language::Rapid] {
        let mut accepted = 0;
        for k in 0..PROGRAMS as u64 {
            let mut writer = program(SEED + k, language);
            let bytes = writer.text.clone().into_bytes();
            for _ in 0..CHANGES {
                let mut changed = bytes.clone();
                for _ in 0..writer.rng.random_range(1..3) {
                    let at = writer.rng.random_range(0..changed.len());
                    let byte = BYTES[writer.rng.random_range(0..BYTES.len())];
                    match writer.rng.random_range(0..4) {
                        0 => drop(changed.remove(at)),
                        1 => changed[at] = byte,
                        2 => changed.insert(at, byte),
                        _ => {
                            let next = (at + 1) % changed.len();
                            changed.swap(at, next);
                        }
                    }
                }
                if let Ok(program) = Program::parse(&changed, language, Partial::Refused) {
                    accepted += 1;
                    check(language, &changed, &program);
                }
            }
        }
        let share = accepted as f64 / (PROGRAMS * CHANGES) as f64;
        println!(
            "{language:?}: {accepted} of {} changed programs accepted",
            PROGRAMS * CHANGES
        );
        assert!((0.1..0.9).contains(&share), "{share}");
    }
}
