//! Parsers and writers of the chart languages. Each language has one folder.
//!
//! A parser turns text into a [design](grafsynth_ir::chart) and continues after every error. A writer turns a design or a net into text. No
//! parser or writer accesses a file or a clock.

pub mod board;
pub mod c;
pub mod codes;
mod findings;
mod from_net;
pub mod graf;
pub mod kiss2;
mod number;
pub mod plant;
pub mod plcopen;
pub mod props;
pub mod rules;
pub mod scxml;
pub mod st;
#[allow(dead_code, reason = "shared by the readers of the XML formats")]
pub(crate) mod xml;

#[cfg(test)]
mod pages_test;
