//! Independent pieces of work on several threads, with results that do not depend on how many there are.

use std::iter::from_fn;
use std::panic::resume_unwind;
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
    let some = || {
        let open = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|piece| *piece < count);
        from_fn(open)
            .map(|piece| (piece, work(piece)))
            .collect::<Vec<_>>()
    };
    let mut done: Vec<(usize, T)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..jobs).map(|_| scope.spawn(some)).collect();
        let ended = threads.into_iter().map(|thread| thread.join());
        let parts: Vec<Vec<(usize, T)>> = ended
            .map(|part| part.unwrap_or_else(|panic| resume_unwind(panic)))
            .collect();
        parts.into_iter().flatten().collect()
    });
    done.sort_unstable_by_key(|(piece, _)| *piece);
    done.into_iter().map(|(_, result)| result).collect()
}
