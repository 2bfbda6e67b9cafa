//! One file for each verb.

pub(crate) mod build;
pub(crate) mod check;
mod clashes;
pub(crate) mod compare;
mod compare_charts;
pub(crate) mod convert;
pub(crate) mod diff;
pub(crate) mod doctor;
pub(crate) mod explain;
pub(crate) mod fmt;
pub(crate) mod manual;
pub(crate) mod minimise;
pub(crate) mod new;
mod refit;
pub(crate) mod sim;
pub(crate) mod trace;
