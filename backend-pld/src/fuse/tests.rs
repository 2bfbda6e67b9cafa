//! Fuse maps compared with files from other tools and with each other.

mod bipolar;
mod golden;
mod random;
mod silicon;
