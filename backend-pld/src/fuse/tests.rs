//! Fuse maps against files by others and against themselves.

mod golden;
mod random;
mod silicon;
