//! The robots of a fleet, and what changed on them since an earlier campaign.

crate::table::rows! { "fleet",
    /// One robot a row; key `robot`. Errors are of held-out points where there are any.
    pub struct FleetTable of FleetRow {
        robot: String,
        model: Option<String>,
        plant: Option<String>,
        campaign: Option<String>,
        /// `done`, `rejected` (its data), `failed` (the machine, or calib), `missing` (not computed yet).
        status: String,
        /// Why it is not done.
        reason: Option<String>,
        points: Option<i64>,
        /// Whether the errors are of points that no model has seen.
        held_out: Option<bool>,
        /// Of the first step.
        before_mean_mm: Option<f64>,
        before_rms_mm: Option<f64>,
        before_max_mm: Option<f64>,
        /// Of the last step.
        after_mean_mm: Option<f64>,
        after_rms_mm: Option<f64>,
        after_max_mm: Option<f64>,
        /// Rms length of the noise alone.
        floor_mm: Option<f64>,
        /// What that rests on: `repeats`, `instrument` or `inferred`.
        noise_basis: Option<String>,
        /// Rms error after every step, mm, separated by blanks.
        course: Option<String>,
        verdict: Option<String>,
        findings: Option<i64>,
        /// `effect at place`, strongest first, separated by `; `.
        causes: Option<String>,
        /// Parameters beyond their control limits.
        changes: Option<i64>,
        /// Why a person should look at this robot.
        flags: Option<String>,
    }
}

crate::table::rows! { "fleet_changes",
    /// Parameters since the campaign before, one (robot, parameter) a row.
    pub struct FleetChanges of FleetChangeRow {
        robot: String,
        parameter: String,
        effect: String,
        place: String,
        unit: String,
        previous: f64,
        /// What the new recording says has been added since.
        change: f64,
        sigma: f64,
        /// Two-sided chance of so large a change where nothing changed.
        p_value: f64,
        /// Changes beyond this are none of chance, by the fleet's alpha shared by all its robots and parameters.
        limit: f64,
        /// Order in which it explains the recording, from 1; null for those that explain nothing more.
        rank: Option<i64>,
        flagged: bool,
    }
}
