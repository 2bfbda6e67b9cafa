//! Fuse maps against files by others and against themselves.

mod bipolar;
mod golden;
mod random;
mod silicon;
