//! Independent pieces of work on several threads, with results that do not depend on how many there are.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Computes `work(0), work(1), ...` on at most `jobs` threads and returns the results in order.
///
/// Each piece must depend on its index alone; then the result is bit-identical for every `jobs`. A panic in a piece is passed on.
pub fn in_order<T: Send>(jobs: usize, count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let jobs = jobs.min(count);
    if jobs <= 1 {
        return (0..count).map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let slots: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(slot) = slots.get(index) else { break };
                    let result = work(index);
                    *slot.lock().expect("a slot is locked once") = Some(result);
                }
            });
        }
    });
    let filled = slots
        .into_iter()
        .map(|slot| slot.into_inner().expect("the threads have ended"));
    filled
        .map(|value| value.expect("every piece was computed"))
        .collect()
}
