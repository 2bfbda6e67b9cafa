//! Golden cases and differential runs over all engines
