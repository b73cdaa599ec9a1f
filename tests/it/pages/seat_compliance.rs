use calib::effect::{At, Cause, Follows, LawRow};

/// The seat of the tool yields in proportion to the payload.
pub static SEAT_COMPLIANCE: Cause = Cause {
    name: "seat_compliance",
    place: "tool",
    formula: "the target moves by c times the payload over the largest payload",
    size: "10 to 200 um",
    confounded: "payload_error, joint_compliance of the last joints",
    needs: "rows with and without the payload",
    sentence: "the seat of the tool yields by {length} under the largest payload",
    laws: &[LawRow {
        at: At::Tool,
        follows: Follows::Payload,
        ..LawRow::PLAIN
    }],
    ..Cause::PLAIN
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;
    use calib::effect::{
        Clock, Effect, EffectContext, EffectStack, Form, Load, ParameterEstimate, Summary, Survey,
        arm_effect,
    };
    use calib::estimate::{Model, fit};
    use calib::robot::{Measurements, PointReadings, RobotModel};
    use calib::spatial::{Pose, Twist};
    use nalgebra::Vector3;

    /// Yield along the axes of the tool, m.
    const TRUE: [f64; 3] = [40e-6, 0.0, -120e-6];

    #[test]
    fn the_cause_of_the_walk_is_proposed_fitted_and_put_into_words() {
        let robot = RobotModel::new(fixture::spherical());
        let rows: Vec<usize> = (0..60).collect();
        let mut data = Measurements {
            joints: robot.joints(),
            q: fixture::poses(robot.description(), rows.len()),
            points: PointReadings::new(vec![Vector3::zeros(); rows.len()], 1e-5),
            payload: rows
                .iter()
                .map(|row| [0.0, 100.0, 210.0][row % 3])
                .collect(),
            ..Measurements::default()
        };
        let (torque, compliance) = (
            vec![0.0; rows.len() * robot.joints()],
            vec![0.0; robot.joints()],
        );
        let form: Form = {
            let survey = Survey::new(&robot, &data, &rows, &torque, &compliance);
            let [hypothesis] = SEAT_COMPLIANCE.propose(&survey).try_into().expect("one");
            hypothesis.form
        };
        let base = Pose::exp(&Twist::new(3.0, -1.5, 0.4, 0.0, 0.1, 2.0));
        let setting = EffectContext {
            base,
            load: Load::GravityTorque,
        };
        let effects: Vec<Box<dyn Effect>> = vec![
            arm_effect("base_frame", &setting).expect("a cause"),
            Box::new(form.clone()),
        ];
        let start = Model::nominal(robot.clone(), EffectStack::new(&robot, base, effects));
        let mut truth = start.clone();
        let first = truth.x.len() - 3;
        truth.x[first..].copy_from_slice(&TRUE);
        data.points.position = truth.predict(&data);
        let candidates: Vec<usize> = (0..start.x.len()).collect();
        let (fitted, _) = fit(&start, &data, &rows, &candidates);
        for (found, truth) in fitted.x[first..].iter().zip(TRUE) {
            assert!((found - truth).abs() < 1e-9, "{found} for {truth}");
        }
        let number = |(k, value): (usize, &f64)| ParameterEstimate {
            name: fitted.stack.specs()[first + k].name.clone(),
            form: 0,
            value: 1e3 * value,
            unit: "mm",
            sigma: None,
        };
        let parameters: Vec<ParameterEstimate> =
            fitted.x[first..].iter().enumerate().map(number).collect();
        let forms = [form];
        let summary = Summary {
            place: forms[0].place(),
            forms: &forms,
            parameters: &parameters,
            clock: Clock::Rows,
        };
        assert_eq!(
            SEAT_COMPLIANCE.sentence(&summary),
            "the seat of the tool yields by 0.126 mm under the largest payload"
        );
    }
}
