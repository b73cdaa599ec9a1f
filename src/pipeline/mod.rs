//! The YAML, the plan, the run.
