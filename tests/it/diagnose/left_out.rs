//! Causes taken out of the list: they are never named, and what is said instead is counted.
//!
//! `CALIB_RECORDINGS=100 cargo test --test it -- diagnose::left_out --nocapture` prints every recording.

use crate::compensate::concealed::{from_environment, recorded};
use calib::table::Findings;
use calib::twin::conceal::case::Case;
use calib::twin::conceal::design::{Content, Design};
use serde_json::json;

/// Found: name, place, probability and loss without it each; verdict; rms (mm) at held-out rows before and after; squared residual per
/// degree of freedom.
pub struct Diagnosed {
    pub found: Vec<(String, String, f64, f64)>,
    pub verdict: String,
    pub before: f64,
    pub after: f64,
    chi_square: f64,
}

/// Stated probabilities in bins: how many names, the sum of what was stated of them, how many are right.
#[derive(Default)]
struct Bins([(usize, f64, usize); 3]);

impl Bins {
    fn add(&mut self, diagnosed: &Diagnosed, case: &Case) {
        let true_names = |name: &str, place: &str| {
            let true_places = case
                .want_all()
                .into_iter()
                .chain(case.accepted.iter().cloned());
            true_places
                .into_iter()
                .any(|(effect, there)| effect == name && there == place)
        };
        for (name, place, probability, _) in diagnosed
            .found
            .iter()
            .filter(|(name, ..)| name != "unknown")
        {
            let bin =
                &mut self.0[usize::from(*probability >= 0.5) + usize::from(*probability >= 0.9)];
            bin.0 += 1;
            bin.1 += probability;
            bin.2 += usize::from(true_names(name, place));
        }
    }

    fn print(&self, subject: &str) {
        for (bin, (count, stated, right)) in
            ["0 to 0.5", "0.5 to 0.9", "0.9 to 1"].iter().zip(&self.0)
        {
            let share = |sum: f64| sum / (*count).max(1) as f64;
            println!(
                "{subject}, {bin}: {count} names, stated {:.2}, right {:.2}",
                share(*stated),
                share(*right as f64)
            );
        }
    }
}

pub fn diagnosed(case: &Case, without: &[&str]) -> Diagnosed {
    let made = recorded(case).diagnose(json!({"without": without}));
    let (verdict, findings): (_, Findings) = (made.verdict(), made.get());
    let found = findings.0.iter().filter(|row| row.forms != "[]");
    Diagnosed {
        found: found
            .map(|row| {
                (
                    row.effect.clone(),
                    row.place.clone(),
                    row.probability.unwrap_or(0.0),
                    row.delta_bic.unwrap_or(0.0),
                )
            })
            .collect(),
        verdict: verdict.verdict,
        before: verdict.before_rms_mm.unwrap_or(f64::NAN),
        after: verdict.after_rms_mm.unwrap_or(f64::NAN),
        chi_square: verdict.chi_square,
    }
}

#[test]
fn what_is_left_out_is_never_named() {
    let (count, seed) = (
        from_environment("CALIB_RECORDINGS", 2) as usize,
        from_environment("CALIB_SEED", 31),
    );
    let design = Design {
        seed,
        cases: 6 * count,
        faulty: 0.0,
        ..Design::default()
    };
    let (
        mut tellable,
        mut wrong,
        mut sound,
        mut other,
        mut confident,
        mut listed,
        mut right,
        mut back,
    ) = (0, 0, 0, 0, 0, 0, 0, 0);
    let (mut of_whole, mut of_others) = (Bins::default(), Bins::default());
    for (number, content) in design.contents().into_iter().enumerate() {
        if !matches!(content, Content::Single(_)) || listed >= count {
            continue;
        }
        let case = Case::make(&design, number, content).unwrap();
        let one = &case.concealed[0];
        if one.strength < 50.0 || case.concealed.len() > 1 {
            continue;
        }
        let cause = one.cause.effect;
        let whole = diagnosed(&case, &[]);
        if !whole.found.iter().any(|(name, ..)| name == cause) {
            continue;
        }
        listed += 1;
        of_whole.add(&whole, &case);
        right += usize::from(
            whole
                .found
                .iter()
                .any(|(name, _, probability, _)| name == cause && *probability >= 0.5),
        );
        let left_out = diagnosed(&case, &[cause]);
        let named: Vec<_> = left_out
            .found
            .iter()
            .filter(|(name, _, probability, _)| name != "unknown" && *probability >= 0.5)
            .collect();
        let can_tell = left_out.after > 1.1 * whole.after;
        let floor = 3f64.sqrt() * case.noise_mm[1];
        println!(
            "{cause} at {}: L {:.0}, {} rows, held out {:.4} -> {:.4} (noise {floor:.4}), chi-square {:.2} -> {:.2}, {}{}: {:?}",
            one.cause.place,
            one.strength,
            case.fit,
            whole.after,
            left_out.after,
            whole.chi_square,
            left_out.chi_square,
            if can_tell { "TELL " } else { "" },
            left_out.verdict,
            left_out.found
        );
        if can_tell {
            tellable += 1;
            wrong += usize::from(!named.is_empty());
            sound += usize::from(left_out.verdict != "unexplained");
        } else {
            other += 1;
            of_others.add(&left_out, &case);
            confident += usize::from(
                named
                    .iter()
                    .any(|(_, _, probability, _)| *probability >= 0.9),
            );
        }
        back += usize::from(left_out.found.iter().any(|(name, ..)| name == cause));
    }
    println!(
        "{listed} recordings, in the list {right} named with 0.5 or more; left out: {tellable} can be told, {wrong} wrong names with 0.5 or more, {sound} explained or nothing missing; of {other} others {confident} wrong names with 0.9 or more; {back} come back"
    );
    of_whole.print("in the list");
    of_others.print("left out, not tellable");
    assert!(
        listed == count && back == 0,
        "{listed} recordings, {back} come back"
    );
}
