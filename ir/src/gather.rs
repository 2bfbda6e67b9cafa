//! Building ordered sets and maps entry by entry.
//!
//! `collect` makes a `BTreeSet` or `BTreeMap` from a list that it first sorts, and the compiler makes the stable sort anew for each type of entry: 7 KB,
//! more than the tree itself. The project has some 150 such types. [`Gather::gather`] inserts the entries instead; the result is the same.

/// [`Gather::gather`] for all iterators.
pub trait Gather: Iterator {
    /// The entries in a set or map, as by `collect`: of equal keys, the last one's value stays.
    fn gather<C: Default + Extend<Self::Item>>(self) -> C
    where
        Self: Sized,
    {
        let mut all = C::default();
        all.extend(self);
        all
    }
}

impl<I: Iterator> Gather for I {}
