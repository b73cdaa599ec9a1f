//! Findings as curves: the residual without an effect, with it, and the effect itself, over the quantity that reveals it.

crate::table::rows! { "curves",
    /// Points of curves; key (`rank`, `sequence`).
    pub struct Curves of CurveRow {
        /// The finding, from 1.
        rank: i64,
        /// Row of the recording.
        sequence: i64,
        /// What is on the abscissa, e.g. `joint 3`, `torque of joint 2`, `time`, `place in the recording`.
        over: String,
        /// Unit of `x`; `row` (from 1) where the recording has no clock.
        x_unit: String,
        x: f64,
        /// Unit of the figures below: `rad` about the joint, or `mm` along the effect's own displacement.
        unit: String,
        /// Residual of the corrected model with this finding taken out.
        without: f64,
        /// Residual of the corrected model.
        with: f64,
        /// What the finding explains: `without` minus `with`.
        fitted: f64,
        /// One standard deviation of `fitted` from that of the finding's numbers, their correlation left out.
        band: Option<f64>,
        held_out: bool,
    }
}
