//! Recordings of the twin whose physics is concealed, diagnosed through the real command and marked.
//!
//! `CALIB_RECORDINGS=100 CALIB_SEED=7 cargo test --test it -- torques::concealed --nocapture` prints every recording.

use super::{document, from_environment, json, mark, write};
use calib::twin::torque::{TorqueCase, TorqueDesign};

/// Half of the effects in forms that are not the estimator's, a fifth of the recordings without any.
#[test]
fn concealed_torques_are_found_and_nulls_stay_empty() {
    let (count, seed) = (from_environment("CALIB_RECORDINGS", 3), from_environment("CALIB_SEED", 11));
    let folder = tempfile::tempdir().expect("a folder");
    let design = TorqueDesign { seed, nulls: 0.2, other_forms: 0.5, most: 1, seconds: 48.0, rate: 100.0 };
    let (mut wanted, mut missed, mut misplaced, mut beside, mut exact, mut nulls, mut false_nulls) = (0, 0, 0, 0, 0, 0, 0);
    for number in 0..count as usize {
        let case = TorqueCase::draw(&design, number);
        let path = folder.path().join(&case.name);
        write(&path, &case.recording());
        write(&path, &case.truth());
        let want = json(path.join("want.json"));
        let marks = mark(&want, &document(&path, &folder.path().join("store")));
        println!("{}: of {} missed {:?}, beside {:?}", case.name, marks.wanted, marks.missed, marks.beside);
        if want["effects"].as_array().is_some_and(Vec::is_empty) {
            nulls += 1;
            false_nulls += usize::from(!marks.beside.is_empty());
        }
        exact += usize::from(marks.missed.is_empty() && marks.beside.is_empty());
        wanted += marks.wanted;
        missed += marks.missed.len();
        misplaced += marks.misplaced;
        beside += marks.beside.len();
        std::fs::remove_dir_all(&path).expect("our own folder");
    }
    println!(
        "{count} recordings, {exact} exact; of {wanted} plain effects {missed} missed, {misplaced} of them at no accepted place; {beside} \
         named beside; {false_nulls} of {nulls} nulls with a name"
    );
    assert!(10 * missed <= wanted, "{missed} of {wanted} plain effects are missed");
    assert!(5 * beside <= wanted.max(5), "{beside} names beside {wanted} effects");
}
