//! What the name of a column says: words, a unit, the number of a joint, an axis of a point.

use crate::units::{Header, Unit};
use std::collections::BTreeMap;

/// A column's name taken apart.
#[derive(Debug, Clone)]
pub(super) struct Name {
    /// In small letters, without the unit.
    pub(crate) words: Vec<String>,
    /// Symbol of the unit that the name ends in.
    pub(crate) unit: Option<&'static str>,
    /// The unit as it stands there, where no bracket says that it is one: the `a` of `x_a`.
    ending: Option<String>,
}

impl Name {
    pub(crate) fn of(text: &str) -> Self {
        let lower = text.trim().to_lowercase();
        let Header { stem, unit, ending } = Header::of(&lower);
        let words = stem.split(|c: char| !c.is_alphanumeric());
        let words = words.filter(|word| !word.is_empty());
        Self {
            words: words.map(str::to_string).collect(),
            unit: unit.map(Unit::symbol),
            ending: ending.map(str::to_string),
        }
    }

    pub(crate) fn stem(&self) -> String {
        self.words.join("_")
    }

    pub(crate) fn unit_of(&self, allowed: &[&str]) -> Option<&'static str> {
        self.unit.filter(|unit| allowed.contains(unit))
    }

    /// Whether the name is one of these, or one of them begins or ends it as a word of its own; that it is a mean says nothing of what it is.
    pub(crate) fn is(&self, list: &str) -> bool {
        let words = match self.words.split_last() {
            Some((last, words)) if !words.is_empty() && lists(MEANS, last) => words,
            _ => &self.words,
        };
        // A letter alone says little beside other words: `x_t` is no time.
        let is_end =
            |word: Option<&String>| word.is_some_and(|word| word.len() > 1 && lists(list, word));
        lists(list, &self.stem()) || is_end(words.first()) || is_end(words.last())
    }

    /// What the joints are called here, `#` for the number, and which one this is: `q1`, `A1_deg`, `joint_3`, `wrist 4 act [deg]`.
    pub(crate) fn joint(&self) -> Option<(String, usize)> {
        let is_numbered = |word: &String| word.ends_with(|c: char| c.is_ascii_digit());
        let at = self.words.iter().rposition(is_numbered)?;
        let stem = self.words[at].trim_end_matches(|c: char| c.is_ascii_digit());
        let number: usize = self.words[at][stem.len()..].parse().ok()?;
        let before = self.words[..at].iter().map(String::as_str);
        // Yaskawa's URDFs say both: `joint_1_s`, `joint_2_l`.
        let letter = number.checked_sub(1).and_then(|k| NAMED_JOINTS[0].get(k));
        let after = self.words[at + 1..].iter().map(String::as_str);
        let after = after.filter(|word| Some(word) != letter);
        let place = format!("{stem}#");
        let all: Vec<&str> = before.chain([place.as_str()]).chain(after).collect();
        Some((all.join("_").replace("_#", "#"), number))
    }

    /// The axis (0 to 2) that this is the coordinate of, and what else the name says: `x_ist`, `Goal X`, `dx`, `Xsoll`.
    pub(crate) fn axis(&self) -> Option<(usize, Vec<String>)> {
        let mut words = self.words.iter().enumerate();
        let (at, (axis, more)) = words.find_map(|(at, word)| Some((at, axis(word)?)))?;
        let lengthless = self.unit.is_some() && self.unit_of(&LENGTHS).is_none();
        // No length, so that a single letter behind the name is a word: the point A of `x_a`.
        let ending = self
            .ending
            .as_ref()
            .filter(|ending| lengthless && ending.len() == 1);
        if lengthless && ending.is_none() {
            return None;
        }
        let mut others = self.words.clone();
        others.remove(at);
        others.extend((!more.is_empty()).then(|| more.to_string()));
        others.extend(ending.cloned());
        Some((axis, others))
    }
}

pub(super) const LENGTHS: [&str; 4] = ["mm", "m", "um", "in"];

/// The axis that a word names, and what it says besides: `x`, `dx`, `xist`, `x2`.
fn axis(word: &str) -> Option<(usize, &str)> {
    let known = |more: &str| {
        let groups = [MEASURED, WANTED, DIFFERENCE, SIGMA, "pos p coord tcp t"];
        more.is_empty()
            || more.bytes().all(|byte| byte.is_ascii_digit())
            || groups.iter().any(|list| lists(list, more))
    };
    let mut axes = ['x', 'y', 'z'].into_iter().enumerate();
    axes.find_map(|(axis, letter)| {
        let more = [word.strip_prefix(letter), word.strip_suffix(letter)];
        let more = more.into_iter().flatten().find(|more| known(more))?;
        Some((axis, more))
    })
}

/// Whether a word says that a numbered column is no joint position.
fn is_other(word: &str) -> bool {
    let others = [NO_JOINTS, TORQUES, CURRENTS, VELOCITIES];
    others.iter().any(|list| lists(list, word))
}

/// Rows of columns that may be the joints, best first: those of usual names, else those of an arm's `count` that `angle` takes for angles.
pub(super) fn joints(
    names: &[Name],
    count: usize,
    angle: impl Fn(usize) -> bool,
) -> Vec<Vec<usize>> {
    let found = NAMED_JOINTS
        .iter()
        .filter_map(|listed| named(names, listed));
    let mut found: Vec<Vec<usize>> = found.collect();
    // The letters of a Yaskawa with seven axes hold those of one with six.
    found.sort_by_key(|columns| std::cmp::Reverse(columns.len()));
    found.truncate(1);
    let parts = names.iter().map(Name::joint).enumerate();
    let runs = numbered(parts.filter_map(|(column, part)| Some((column, part?))));
    let mut usual: Vec<(usize, usize, Vec<usize>)> = Vec::new();
    for (key, columns) in runs.iter().filter(|(_, columns)| columns.len() > 1) {
        if let Some(rank) = usual_name(key) {
            usual.push((rank, columns[0], columns.clone()));
        }
    }
    // The longest first; of equal ones those with the plainest name.
    usual.sort_by_key(|(rank, first, columns)| (std::cmp::Reverse(columns.len()), *rank, *first));
    found.extend(usual.into_iter().map(|(_, _, columns)| columns));
    if found.is_empty() {
        let foreign = runs.into_iter().filter(|(key, columns)| {
            let other = key.split(['_', '#']).any(is_other);
            columns.len() == count && !other && columns.iter().all(|column| angle(*column))
        });
        found.extend(foreign.map(|(_, columns)| columns));
    }
    // One joint has no number.
    if found.is_empty() && count == 1 {
        let alone = |column: &usize| lists(ONE_JOINT, &names[*column].stem()) && angle(*column);
        found.extend((0..names.len()).filter(alone).map(|column| vec![column]));
        found.truncate(1);
    }
    // Or those of motors on a bus, whose numbers begin anywhere: `pos (5)`.
    if found.is_empty() {
        let is_joint = |key: &str| {
            key.strip_suffix('#')
                .is_some_and(|key| lists(ONE_JOINT, key))
        };
        let number = |column: usize| {
            let (key, number) = names[column].joint()?;
            (is_joint(&key) && angle(column)).then_some((number, column))
        };
        let mut all: Vec<(usize, usize)> = (0..names.len()).filter_map(number).collect();
        all.sort_unstable();
        let is_whole = all.windows(2).all(|pair| pair[0].0 < pair[1].0);
        let columns = all.into_iter().map(|(_, column)| column);
        match (count, is_whole) {
            (1, _) => found.extend(columns.map(|column| vec![column])),
            (_, true) if columns.len() == count => found.push(columns.collect()),
            _ => {}
        }
    }
    let longest = found.first().map_or(0, Vec::len);
    found.retain(|columns| columns.len() == longest);
    found
}

/// Columns whose headers are numbered from 0 or 1.
pub(super) fn numbered(
    parts: impl Iterator<Item = (usize, (String, usize))>,
) -> Vec<(String, Vec<usize>)> {
    let mut found: BTreeMap<String, BTreeMap<usize, usize>> = BTreeMap::new();
    for (column, (key, number)) in parts {
        let columns = found.entry(key).or_default();
        columns.entry(number).or_insert(column);
    }
    let run = |columns: BTreeMap<usize, usize>| {
        let first = usize::from(!columns.contains_key(&0));
        let run = (first..).map_while(|number| columns.get(&number).copied());
        run.collect()
    };
    let runs = found.into_iter();
    runs.map(|(key, columns)| (key, run(columns))).collect()
}

/// Columns of joints that have names instead of numbers, in the order of the arm.
fn named(names: &[Name], listed: &[&str]) -> Option<Vec<usize>> {
    let letters = listed.iter().all(|name| name.len() == 1);
    let column = |wanted: &&str| {
        names.iter().position(|name| match letters {
            true => name.stem() == *wanted,
            false => name.stem().contains(wanted) && !name.words.iter().any(|word| is_other(word)),
        })
    };
    listed.iter().map(column).collect()
}

/// How plain a usual name of joints is: 0 for the name and number alone, 1 with `ist` or the like, 2 with `soll` or the like.
fn usual_name(key: &str) -> Option<usize> {
    const OTHERS: &str = "pos position positions angle angles ang winkel value deg rad data";
    let pieces = key.split(['_', '#']);
    let pieces = pieces.filter(|word| !word.is_empty() && !lists(OTHERS, word));
    let (measured, pieces): (Vec<&str>, Vec<&str>) = pieces.partition(|word| lists(MEASURED, word));
    let (wanted, pieces): (Vec<&str>, Vec<&str>) =
        pieces.into_iter().partition(|word| lists(WANTED, word));
    let is_usual = lists(JOINTS, &pieces.join("_")) && key.contains('#');
    is_usual.then_some(match (measured.is_empty(), wanted.is_empty()) {
        (_, false) => 2,
        (false, true) => 1,
        _ => 0,
    })
}

/// The names of all joints in one: the 1 that becomes a 2 in the next name, and so on, is the joint's number.
pub(super) fn pattern(names: &[&str]) -> Option<String> {
    let first = names.first()?;
    let ones = first.match_indices('1');
    let mut patterns = ones.map(|(at, _)| format!("{}{{j}}{}", &first[..at], &first[at + 1..]));
    patterns.find(|pattern| {
        let mut named = (1..).zip(names);
        named.all(|(number, name): (usize, _)| pattern.replace("{j}", &number.to_string()) == *name)
    })
}

pub(super) fn lists(list: &str, word: &str) -> bool {
    list.split(' ').any(|listed| listed == word)
}

/// What the joints' columns are usually called; the number of the joint follows.
pub(super) const JOINTS: &str = "q a rax j joint axis theta achse gelenk axe asse eje jnt joint_angle joint_state joint_states \
    observation_state qpos observation_qpos articulación";

/// What the only joint of an arm is called.
const ONE_JOINT: &str =
    "q pos position angle joint theta winkel actual_q joint_position actual_position";

pub(super) const NAMED_JOINTS: [&[&str]; 3] = [
    &["s", "l", "u", "r", "b", "t"],
    &["s", "l", "e", "u", "r", "b", "t"],
    &[
        "shoulder_pan",
        "shoulder_lift",
        "elbow",
        "wrist_1",
        "wrist_2",
        "wrist_3",
    ],
];

/// What joint torques, motor currents and joint velocities are called, apart from the number or name of a joint.
pub(super) const TORQUES: &str = "tau torque torques trq f effort efforts moment moments drehmoment drehmomente couple coppia momento \
    momente";
pub(super) const CURRENTS: &str =
    "i iq cur curr current currents strom courant corriente corrente amps";
pub(super) const VELOCITIES: &str = "dq qd qdot v vel vels velocity velocities speed speeds geschwindigkeit vitesse velocidad velocità rate";
/// Which of several movements a row belongs to.
pub(super) const TRAJECTORIES: &str =
    "traj trajectory trajectory_id episode episode_index run segment";

/// What else a numbered column that is no joint position is called.
pub(super) const NO_JOINTS: &str = "dir temp motor load err error sigma std acc accel e ddq qdd force forces ft wrench strain gauge \
    sensor channel ch ai di do io input output volt voltage power pressure tcp pose cartesian marker dist \
    distance";

/// What the parts of a quaternion are called before `w`, `x`, `y`, `z`.
pub(super) const QUATERNIONS: [&str; 6] =
    ["q", "q_", "quat_", "quaternion_", "rot_", "orientation_"];

/// What stands next to the name of an axis where several points are in one table.
pub(super) const MEASURED: &str = "ist actual act meas measured measurement mess gemessen real tracker laser lt mes mesure mesuré \
    mesurée medido medida misurato";
pub(super) const WANTED: &str = "soll nom nominal cmd command commanded target wanted ref reference programmed goal desired setpoint \
    planned plan cad theo theoretical théorique teórico teorico consigne robot controller steuerung sim \
    simulated model";
pub(super) const DIFFERENCE: &str = "dif diff difference differenz d delta dev deviation abw abweichung err error fehler écart ecart desv \
    desviación erreur";
/// Differences that are usually target less measured point; others are measured point less target.
pub(super) const TARGET_LESS_MEASURED: &str = "dif diff difference differenz";
pub(super) const SIGMA: &str =
    "std stdev stddev sigma sd u unc uncertainty unsicherheit rms σ s u95";
/// What columns of uncertainties with 95 % coverage are called.
pub(super) const U95: &str = "u95";

pub(super) const IDS: &str = "point point_id pointid point_name pointname id name pose pose_id nr no number nummer num punkt \
    punktname punktnummer punkt_nr messpunkt bezeichnung index label target measurement pt pts p nom \
    nombre nome punto point_no row sample messung repere repère n";
pub(super) const PAYLOADS: &str = "payload payload_mass load mass weight last traglast nutzlast zuladung gewicht masse lastmasse charge \
    charge_utile poids carga carga_util carga_útil peso masa carico load_mass tool_load";
pub(super) const TEMPERATURES: &str = "temp temperature temperatures temperatur temperaturen température temperatura temps_c raumtemperatur";
const MEANS: &str = "mean avg average mittel mittelwert moyenne media";
pub(super) const TIMES: &str = "time t timestamp stamp zeit zeitstempel messzeit uhrzeit temps horodatage heure tiempo hora tempo \
    clock";
pub(super) const USAGES: &str = "use usage set verwendung split";
/// Which of several reflectors was measured.
pub(super) const REFLECTORS: &str = "target smr reflector reflektor retro prism";

#[cfg(test)]
mod tests {
    use super::*;

    fn names(texts: &[&str]) -> Vec<Name> {
        texts.iter().map(|text| Name::of(text)).collect()
    }

    #[test]
    fn the_mean_of_temperatures_is_a_temperature() {
        assert!(Name::of("joint_temperatures_mean").is(TEMPERATURES));
        assert!(Name::of("Motortemperaturen Mittelwert [C]").is("motortemperaturen"));
        assert!(!Name::of("mean").is(TEMPERATURES));
    }

    #[test]
    fn units_stand_at_the_end_of_a_name_in_many_forms() {
        for (text, stem, unit) in [
            ("Achse1 [\u{b0}]", "achse1", Some("deg")),
            ("X_ist [mm]", "x_ist", Some("mm")),
            ("q1_deg", "q1", Some("deg")),
            ("Temp (\u{b0}C)", "temp", Some("C")),
            ("load kg", "load", Some("kg")),
            ("X/mm", "x", Some("mm")),
            ("X in mm", "x", Some("mm")),
            ("Y [\u{b5}m]", "y", Some("um")),
            ("m", "m", None),
            ("remark", "remark", None),
        ] {
            let name = Name::of(text);
            assert_eq!((name.stem().as_str(), name.unit), (stem, unit), "{text}");
        }
    }

    #[test]
    fn joints_are_found_under_names_that_nobody_foresaw() {
        let all = names(&[
            "Nr", "wrist_1", "R1", "R2", "R3", "R4", "R5", "X_soll", "Y_soll", "Z_soll", "X_ist",
        ]);
        assert_eq!(joints(&all, 5, |_| true), [[2, 3, 4, 5, 6]]);
        assert!(joints(&all, 5, |column| column != 4).is_empty());
        assert_eq!(
            joints(&names(&["i1", "i2", "Achse 1", "Achse 2"]), 6, |_| false),
            [[2, 3]]
        );
        assert_eq!(
            joints(&names(&["T", "S", "L", "U", "R", "B"]), 6, |_| false),
            [[1, 2, 3, 4, 5, 0]]
        );
        assert_eq!(
            joints(&names(&["q1_cmd", "q2_cmd", "q1_act", "q2_act"]), 6, |_| {
                true
            }),
            [[2, 3], [0, 1]]
        );
        let yaskawa = [
            "joint_1_s",
            "joint_2_l",
            "joint_3_u",
            "joint_4_r",
            "joint_5_b",
            "joint_6_t",
        ];
        assert_eq!(joints(&names(&yaskawa), 6, |_| true), [[0, 1, 2, 3, 4, 5]]);
        for pattern in [
            "J#",
            "A#",
            "Axis_#",
            "q_#",
            "panda_joint#",
            "iiwa_joint_#",
            "lbr_A#",
            "robot1/joint_#",
            "joint_#_position",
        ] {
            let all: Vec<String> = (1..=6)
                .map(|n| pattern.replace('#', &n.to_string()))
                .collect();
            let all: Vec<&str> = all.iter().map(String::as_str).collect();
            assert_eq!(
                joints(&names(&all), 6, |_| true),
                [[0, 1, 2, 3, 4, 5]],
                "{pattern}"
            );
        }
        assert_eq!(
            joints(&names(&["dq1", "dq2", "q0", "q1"]), 6, |_| true),
            [[2, 3]]
        );
        let bus = ["pos (5)", "target pos (5)", "current (5)", "pos (3)"];
        assert_eq!(joints(&names(&bus[..3]), 1, |_| true), [[0]]);
        assert_eq!(joints(&names(&bus), 1, |_| true), [[3], [0]]);
        assert_eq!(joints(&names(&bus), 2, |_| true), [[3, 0]]);
        let robot = [
            "ur_shoulder_pan_joint",
            "ur_shoulder_lift_joint",
            "ur_elbow_joint",
        ];
        let wrist = ["ur_wrist_1_joint", "ur_wrist_2_joint", "ur_wrist_3_joint"];
        assert_eq!(
            joints(&names(&[robot, wrist].concat()), 6, |_| true),
            [[0, 1, 2, 3, 4, 5]]
        );
    }

    #[test]
    fn an_axis_is_told_from_words_that_end_in_its_letter() {
        for (text, expected) in [
            ("X", Some((0, vec![]))),
            ("Goal y", Some((1, vec!["goal"]))),
            ("z_dif", Some((2, vec!["dif"]))),
            ("dX [mm]", Some((0, vec!["d"]))),
            ("Zsoll", Some((2, vec!["soll"]))),
            ("x_A", Some((0, vec!["a"]))),
            ("x_m", Some((0, vec![]))),
            ("index", None),
            ("max", None),
            ("measurement_rx", None),
            ("Rz", None),
        ] {
            let expected =
                expected.map(|(axis, words)| (axis, words.into_iter().map(String::from).collect()));
            assert_eq!(Name::of(text).axis(), expected, "{text}");
        }
    }
}
