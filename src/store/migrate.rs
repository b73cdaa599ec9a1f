//! Old tables read as new ones: one pure function a table and major version, from its columns to those of the next. Files stay as they
//! are, and a minor version needs none: what it added is null.

use arrow::array::ArrayRef;
use std::collections::BTreeMap;

/// The columns of a table, by name.
pub(super) type Columns = BTreeMap<String, ArrayRef>;

/// The step from a major version to the next.
pub(super) struct Migration {
    pub kind: &'static str,
    pub from: u32,
    /// The columns of version `from` + 1, or what is wrong with those of `from`.
    pub step: fn(Columns) -> Result<Columns, String>,
}

/// All steps; no table has had a second major version yet.
pub(super) const MIGRATIONS: &[Migration] = &[];

/// True where there is a step from every version to the next.
pub(super) fn reaches(migrations: &[Migration], kind: &str, from: u32, to: u32) -> bool {
    from < to && (from..to).all(|version| step(migrations, kind, version).is_some())
}

/// Columns of version `from` as those of version `to`.
pub(super) fn climb(migrations: &[Migration], kind: &str, from: u32, to: u32, columns: Columns) -> Result<Columns, String> {
    (from..to).try_fold(columns, |columns, version| {
        let migration =
            step(migrations, kind, version).ok_or_else(|| format!("no step from {kind} {version} to {}", version + 1))?;
        (migration.step)(columns).map_err(|why| format!("{kind} {version} as {kind} {}: {why}", version + 1))
    })
}

fn step<'m>(migrations: &'m [Migration], kind: &str, from: u32) -> Option<&'m Migration> {
    migrations.iter().find(|migration| migration.kind == kind && migration.from == from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow::array::{AsArray, Float64Array};
    use arrow::datatypes::Float64Type;
    use std::sync::Arc;

    /// Version 2 is in mm where 1 was in m, version 3 calls it by its unit.
    const STEPS: &[Migration] = &[
        Migration {
            kind: "gauge",
            from: 1,
            step: |mut columns| {
                let metres = columns.remove("x").ok_or("no column x")?;
                let mm = metres.as_primitive::<Float64Type>().unary::<_, Float64Type>(|x| x * 1000.0);
                columns.insert("x".into(), Arc::new(mm));
                Ok(columns)
            },
        },
        Migration {
            kind: "gauge",
            from: 2,
            step: |mut columns| {
                let x = columns.remove("x").ok_or("no column x")?;
                columns.insert("x_mm".into(), x);
                Ok(columns)
            },
        },
    ];

    #[test]
    fn an_old_table_climbs_version_by_version() {
        let columns = || Columns::from([("x".to_string(), Arc::new(Float64Array::from(vec![1.5])) as ArrayRef)]);
        let new = climb(STEPS, "gauge", 1, 3, columns()).unwrap();
        assert_eq!(new["x_mm"].as_primitive::<Float64Type>().value(0), 1500.0);
        assert!(reaches(STEPS, "gauge", 1, 3) && reaches(STEPS, "gauge", 2, 3));
        assert!(!reaches(STEPS, "gauge", 1, 4) && !reaches(STEPS, "gauge", 3, 2) && !reaches(STEPS, "other", 1, 2));
        assert_eq!(climb(STEPS, "gauge", 1, 2, Columns::new()).unwrap_err(), "gauge 1 as gauge 2: no column x");
    }
}
