//! Runs by the names that people give them. `HEAD` is the last complete run: the tables of every stage, for the sake of the run itself.

use super::manifest::Manifest;
use crate::error::{Error, Result, counted, nearest};
use crate::store::Store;

/// The run that a person means: an id, the beginning or end of one, a tag, `HEAD` for the last complete one, `HEAD~2` for the complete
/// one two before it.
pub fn find_run(store: &Store, text: &str) -> Result<String> {
    let runs = store.runs()?;
    let nothing = |message: String| Err(Error::spec(format!("run {text}"), message));
    let Some(newest) = runs.last() else {
        return nothing(format!("the store {} has no runs", store.name()));
    };
    if let Some(back) = text.strip_prefix("HEAD") {
        let back = match back.strip_prefix('~') {
            Some("") => Some(1),
            Some(count) => count.parse::<usize>().ok(),
            None => back.is_empty().then_some(0),
        };
        let Some(back) = back else {
            return nothing("expected HEAD or HEAD~N".into());
        };
        return match complete(store, &runs, back)? {
            Ok(run) => Ok(run),
            Err(0) => nothing(format!(
                "the store has no complete run of `calib run`; the last run of all is {newest}, `calib log` shows it"
            )),
            Err(count) => nothing(format!(
                "the store has {} of `calib run`",
                counted(count, "complete run")
            )),
        };
    }
    if let Some(run) = store.tags()?.remove(text) {
        return Ok(run);
    }
    let wanted = text.to_uppercase();
    let found: Vec<&String> = runs
        .iter()
        .filter(|id| id.starts_with(&wanted) || id.ends_with(&wanted))
        .collect();
    match found.as_slice() {
        [run] if !text.is_empty() => Ok((*run).clone()),
        [] => {
            let tags = store.tags()?;
            let hint = nearest(text, tags.keys().map(String::as_str))
                .map(|near| format!("; did you mean the tag `{near}`?"));
            nothing(format!(
                "no such run or tag{} `calib log` lists them",
                hint.unwrap_or_else(|| ";".into())
            ))
        }
        several => nothing(format!(
            "the ids of {} runs begin or end like this; give more of the id",
            several.len()
        )),
    }
}

/// The complete run `back` before the last, or how many complete runs there are. A damaged manifest on the way is refused: nobody knows
/// whether its run counts.
fn complete(store: &Store, runs: &[String], back: usize) -> Result<Result<String, usize>> {
    let mut count = 0;
    for run in runs.iter().rev().filter(|run| store.has_manifest(run)) {
        let manifest = Manifest::of(store, run).map_err(|error| {
            Error::store(
                format!("run {run}"),
                format!(
                    "cannot be read, so that HEAD is not known; name a run by its id ({error})"
                ),
            )
        })?;
        if manifest.is_complete() {
            if count == back {
                return Ok(Ok(run.clone()));
            }
            count += 1;
        }
    }
    Ok(Err(count))
}
