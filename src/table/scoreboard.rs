//! What diagnoses made of concealed recordings, effect by effect.

crate::table::rows! { "scoreboard",
    /// One concealed effect a row, or one recording that conceals nothing; key (`case`, `number`).
    pub struct Scoreboard of ScoreboardRow {
        case: String,
        /// Of the effect in its recording, from 0.
        number: i64,
        /// `null`, `single`, `pair`, `open`.
        content: String,
        robot: String,
        /// Points to fit.
        points: i64,
        /// Null where nothing is concealed, as are the next seven.
        effect: Option<String>,
        place: Option<String>,
        form: Option<String>,
        /// Squared displacement that geometry and the other effects leave, over the noise's variance.
        visibility: Option<f64>,
        /// `exact`, `in_set`, `wrong`, `silent`.
        outcome: Option<String>,
        /// The strongest finding but for faults of points is at its place.
        place_right: Option<bool>,
        /// Named rightly, or `unknown` at its place.
        name_or_unknown: Option<bool>,
        /// A name was given that is not there.
        wrong_name: Option<bool>,
        /// The strongest finding that is not there; null without any.
        said: Option<String>,
        /// Findings that are not there.
        strays: i64,
        verdict: String,
        heldout_before_mm: Option<f64>,
        heldout_after_mm: Option<f64>,
        /// What noise and the uncertainty of the parameters leave.
        heldout_bound_mm: Option<f64>,
    }
}
