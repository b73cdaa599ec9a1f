//! The identified model: every parameter by name, with what became of it.

crate::table::rows! { "parameters",
    /// Parameters, one a row; key `name`. Values are in the row's own `unit`.
    pub struct Parameters of ParameterRow {
        /// E.g. `reduction_ratio.j2`, `link_geometry.l3.x`.
        name: String,
        /// Canonical effect name, e.g. `reduction_ratio`.
        effect: String,
        /// E.g. `joint 2`, `link 3`, `base`, `tool`.
        place: String,
        unit: String,
        nominal: f64,
        value: f64,
        /// One standard deviation; null where it was not estimated.
        sigma: Option<f64>,
        /// `free` (estimated), `earlier` (estimated by an earlier step), `held` (by the user), `redundant` (other free parameters do
        /// the same), `unseen` (the data do not see it).
        status: String,
        /// The step that set the value.
        step: String,
        /// Why it was not estimated, or what it is confounded with.
        remark: Option<String>,
    }
}
