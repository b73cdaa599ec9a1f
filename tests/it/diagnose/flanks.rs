//! Two flanks of a gear's teeth that err differently: an error periodic in the joint angle whose sign follows the approach.

use super::{Named, simulated, wanted};
use crate::answer::has;

#[test]
fn flanks_that_err_differently_are_named_with_their_order_and_amplitude() {
    let answer = simulated(
        "{gear_flank: {joint: 2, order: 5, amplitude_arcsec: 35, phase_deg: 40}}",
        8,
        160,
    );
    assert_eq!(
        wanted(&answer["findings"]),
        Named::from([("gear_flank".into(), "joint 2".into())]),
        "{answer:#}"
    );
    let finding = &answer["findings"][0];
    let number = |k: usize, name: &str| finding["parameters"][k][name].as_f64().unwrap();
    // sin(5 q + 40 deg) = cos(40 deg) sin(5 q) + sin(40 deg) cos(5 q)
    let (sine, cosine) = 40f64.to_radians().sin_cos();
    for (k, truth) in [35.0 * sine, 35.0 * cosine].into_iter().enumerate() {
        assert!(
            (number(k, "value") - truth).abs() < 4.0 * number(k, "sigma"),
            "{finding:#}"
        );
        assert!(number(k, "sigma") < 4.0, "{finding:#}");
    }
    let statement = finding["statement"].as_str().unwrap();
    has(
        statement,
        "the two flanks of the teeth of joint 2 err differently: 5 times a turn by 3",
    );
}
