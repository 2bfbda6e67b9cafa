//! One file for each verb.

pub(crate) mod build;
mod build_outputs;
mod build_results;
pub(crate) mod check;
mod clashes;
pub(crate) mod compare;
mod compare_c;
mod compare_charts;
mod compare_engines;
mod compare_logic;
mod compared;
pub(crate) mod convert;
pub(crate) mod diff;
pub(crate) mod doctor;
pub(crate) mod draw;
mod draw_overlays;
pub(crate) mod explain;
pub(crate) mod fmt;
pub(crate) mod manual;
pub(crate) mod minimise;
pub(crate) mod new;
pub(crate) mod page;
mod products;
mod refit;
pub(crate) mod sim;
pub(crate) mod split;
pub(crate) mod trace;
