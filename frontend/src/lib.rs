//! Readers and writers of the chart languages. Each language has one folder with its reader and its writer.
//!
//! A reader turns text into a [chart](grafsynth_ir::chart) and continues after every error. A writer turns a chart or a net into text.
//! No reader or writer accesses a file, a clock or another language.

pub mod board;
pub mod c;
pub mod codes;
mod from_net;
pub mod graf;
pub mod kiss2;
pub mod plcopen;
pub mod props;
pub mod rules;
pub mod scxml;
pub mod st;
#[allow(dead_code, reason = "shared by the readers of the XML formats")]
pub(crate) mod xml;

#[cfg(test)]
mod pages_test;
