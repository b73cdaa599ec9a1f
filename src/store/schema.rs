//! The table-schema dialect of `schemas/*.json`: columns with type, unit, meaning, key, range and diff tolerance.
