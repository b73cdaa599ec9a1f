//! States of rows that were asked for, kept: they follow from the rows alone.

use std::collections::HashMap;
use std::sync::{Arc, PoisonError, RwLock};

/// Numbers that are kept: before more, all are forgotten.
const KEPT: usize = 1 << 22;

/// Which state: its kind, a joint, the bits of its constant.
pub(super) type Key = (u8, usize, u64);

/// States of a recording, one of each row. A copy begins with none, since its rows may be changed.
#[derive(Default)]
pub struct Memories {
    known: RwLock<HashMap<Key, Arc<[f64]>>>,
}

impl Clone for Memories {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl std::fmt::Debug for Memories {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Memories")
    }
}

impl Memories {
    /// A state at a row, computed for every row where it was not asked for before.
    pub(super) fn of(&self, key: Key, row: usize, along: impl FnOnce() -> Arc<[f64]>) -> f64 {
        let known = self
            .known
            .read()
            .unwrap_or_else(PoisonError::into_inner)
            .get(&key)
            .map(|states| states[row]);
        known.unwrap_or_else(|| {
            let states = along();
            let value = states[row];
            let mut known = self.known.write().unwrap_or_else(PoisonError::into_inner);
            if known.len() * states.len() > KEPT {
                known.clear();
            }
            known.insert(key, states);
            value
        })
    }
}
