//! C code as a tree, and the writer that prints it.

pub(crate) mod print;
