//! Golden cases and differential runs over all engines

pub mod random_net;
