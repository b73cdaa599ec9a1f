//! Formulas that none beats in both price and error (Pareto), and the one that is proposed.

use crate::criteria::closed_form::{BETTER, LIKE, SHOWN};
/// What a formula costs and how well it carries over to poses that it has not seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Priced {
    pub(crate) price: usize,
    /// Rms of folds, m.
    pub(crate) error: f64,
}

/// Positions of the formulas worth showing, cheapest first, of those that are better than none at all; and which of them is proposed:
/// the cheapest that is as good as the best, where that does what the free curve does.
pub(super) fn front(
    all: &[Priced],
    [without, curve]: [f64; 2],
) -> Option<(Vec<usize>, Option<usize>)> {
    let mut order: Vec<usize> = (0..all.len())
        .filter(|k| all[*k].error.is_finite())
        .collect();
    order.sort_by(|a, b| {
        all[*a]
            .price
            .cmp(&all[*b].price)
            .then(all[*a].error.total_cmp(&all[*b].error))
            .then(a.cmp(b))
    });
    let mut falls: Vec<(usize, f64)> = Vec::new();
    let mut best = without;
    for k in order {
        if all[k].error < best * (1.0 - *BETTER) {
            falls.push((k, best / all[k].error));
            best = all[k].error;
        }
    }
    let last = falls.last()?.0;
    while falls.len() > *SHOWN {
        // What gains least over the next cheaper one goes; the best stays.
        let (least, _) = falls[..falls.len() - 1]
            .iter()
            .enumerate()
            .min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
        falls.remove(least);
    }
    let shown: Vec<usize> = falls.into_iter().map(|(k, _)| k).collect();
    let as_good = |k: &usize| all[*k].error <= all[last].error * (1.0 + *BETTER);
    let chosen = shown
        .iter()
        .position(as_good)
        .filter(|_| all[last].error <= *LIKE * curve);
    Some((shown, chosen))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(all: &[(usize, f64)], curve: f64) -> Option<(Vec<usize>, Option<usize>)> {
        front(
            &all.iter()
                .map(|(price, error)| Priced {
                    price: *price,
                    error: *error,
                })
                .collect::<Vec<_>>(),
            [10.0, curve],
        )
    }

    #[test]
    fn the_front_holds_what_nothing_beats_in_both() {
        // The third is dearer than the second and worse; the fourth hardly better than the second.
        assert_eq!(
            of(&[(2, 9.0), (4, 5.0), (6, 6.0), (8, 4.99), (9, 3.0)], 3.1),
            Some((vec![0, 1, 4], Some(2)))
        );
        // Five that fall: the two that gain least over their neighbours go, never the best.
        assert_eq!(
            of(&[(1, 9.0), (2, 8.9), (3, 4.0), (4, 3.9), (5, 3.8)], 3.8),
            Some((vec![0, 2, 4], Some(2)))
        );
        // The curve does better than any of them.
        assert_eq!(of(&[(2, 9.0), (4, 5.0)], 3.0), Some((vec![0, 1], None)));
        assert_eq!(of(&[(3, 10.0), (5, f64::NAN)], 3.0), None);
        assert_eq!(of(&[], 3.0), None);
    }
}
