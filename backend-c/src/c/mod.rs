//! C as a tree and as text.

pub(crate) mod print;
