//! Readers and writers of the chart languages: one folder for each, reader and writer side by side.
//!
//! A reader turns text into a [chart](grafsynth_ir::chart) and goes on behind every error; a writer turns a chart or a net into text. None of them
//! sees a file, a clock or another language.

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
#[allow(dead_code, reason = "what the readers of XML formats share; they follow")]
pub(crate) mod xml;

#[cfg(test)]
mod pages_test;
