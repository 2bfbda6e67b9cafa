//! The command line of grafsynth.

fn main() {}
