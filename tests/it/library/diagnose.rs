use calib::diagnose::{Diagnosis, Question, diagnose, wrong_setup};
use calib::robot::{Measurements, RobotModel};

/// What the rigid model of an arm leaves out: every fourth row is held out, and only judges in the end.
pub fn missing_physics(robot: &RobotModel, data: &Measurements) -> Diagnosis {
    let (validate, fit): (Vec<usize>, Vec<usize>) = (0..data.rows()).partition(|row| row % 4 == 3);
    let set: Vec<usize> = (0..data.rows())
        .map(|row| usize::from(row % 4 == 3))
        .collect();
    let question = Question {
        robot,
        data,
        fit: &fit,
        validate: &validate,
        set: &set,
        prior_weight: 1.0,
        open_world: 0.3,
        without: &[],
        own: &[],
        beside_simulation: false,
        known: &[],
        seed: 1,
    };
    // A wrong unit, sign or zero comes before physics.
    wrong_setup(&question)
        .unwrap_or_else(|| diagnose(&question, |progress| eprintln!("{progress}")))
}
