//! Sorting by numbers.
//!
//! The compiler makes a sort routine anew for each type of entry and each key: 5 to 14 KB. Here one routine serves all lists whose order a few numbers give.

/// Sorts a list by `rank`, the lowest first. Ranks are compared number by number; entries of equal rank keep their order. A rank is asked for once per
/// entry. The complement of a number, `!n`, sorts the highest first.
pub fn sort_by_rank<T, const N: usize>(list: &mut [T], rank: impl Fn(&T) -> [u64; N]) {
    let ranks: Vec<u64> = list.iter().flat_map(rank).collect();
    let mut from = order(&ranks, N);
    // `from[at]` is where the entry for place `at` is now: each cycle of these moves is carried out by exchanges.
    for first in 0..list.len().min(from.len()) {
        let mut at = first;
        while from[at] != first {
            let next = std::mem::replace(&mut from[at], at);
            list.swap(at, next);
            at = next;
        }
        from[at] = at;
    }
}

/// The places of the entries in sorted order; each entry has `width` numbers in `ranks`.
fn order(ranks: &[u64], width: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..ranks.len() / width.max(1)).collect();
    let rank = |at: usize| &ranks[at * width..][..width];
    order.sort_unstable_by(|a, b| rank(*a).cmp(rank(*b)).then(a.cmp(b)));
    order
}

#[cfg(test)]
mod tests {
    use super::sort_by_rank;

    #[test]
    fn the_order_is_that_of_a_stable_sort() {
        let mut state = 1_u64;
        for n in 0..60 {
            let list: Vec<(u64, u64, usize)> = (0..n)
                .map(|at| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    (state >> 61, state >> 40 & 3, at)
                })
                .collect();
            let (mut ours, mut theirs) = (list.clone(), list);
            sort_by_rank(&mut ours, |(a, b, _)| [*a, !*b]);
            theirs.sort_by_key(|(a, b, _)| (*a, std::cmp::Reverse(*b)));
            assert_eq!(ours, theirs);
            sort_by_rank(&mut ours, |(_, b, _)| [*b]);
            theirs.sort_by_key(|(_, b, _)| *b);
            assert_eq!(ours, theirs);
        }
        sort_by_rank(&mut [3, 1, 2], |_| []);
    }
}
