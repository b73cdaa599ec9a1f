//! What optimisers made of functions with known minima.

crate::table::rows! { "searches",
    /// One optimiser on one function over many seeds a row; key (`step`, `function`, `dimensions`, `method`).
    pub struct Searches of SearchesRow {
        step: String,
        /// `michalewicz`, `rastrigin`, `rosenbrock` or `ackley`.
        function: String,
        dimensions: i64,
        /// `bas`, `bso`, `pso`, `ga` or `abc`.
        method: String,
        /// How near to the minimum counts as found.
        tolerance: f64,
        /// Searches, one a seed; those that found the minimum; those that missed it and found nothing better in their second half.
        searches: i64,
        found: i64,
        stuck: i64,
        /// Evaluations to the target, of the searches that found it.
        evaluations_median: Option<f64>,
        evaluations_p90: Option<f64>,
        /// Best value above the minimum at the end, of all searches.
        error_median: Option<f64>,
        error_p90: Option<f64>,
        /// Where a published time stands, and that time, s.
        reference: Option<String>,
        reference_s: Option<f64>,
    }
}

crate::table::rows! { "search_course",
    /// One generation of one search a row; key (`step`, `function`, `dimensions`, `method`, `seed`, `generation`).
    pub struct SearchCourse of SearchCourseRow {
        step: String,
        function: String,
        dimensions: i64,
        method: String,
        /// Number of the search, from 0.
        seed: i64,
        generation: i64,
        /// Best value so far.
        best: f64,
        /// Mean value of this generation; null where one is not finite.
        mean: Option<f64>,
        /// Evaluations so far.
        evaluations: i64,
    }
}
