//! The reference reaction, stimuli, traces and their comparison
