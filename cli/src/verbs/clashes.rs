//! Designs of one build that would get in each other's way: files of one name, and identifiers that C and HDL could not tell apart.

use grafsynth_driver::stem::FileStem;
use grafsynth_ir::names::{C, Namer};
use grafsynth_ir::net::Net;
use std::collections::BTreeMap;

/// What the designs so far are called, each with its input.
#[derive(Debug, Default)]
pub(super) struct Named {
    stems: BTreeMap<String, String>,
    prefixes: BTreeMap<String, String>,
}

impl Named {
    /// Adds a design that was read from `input`.
    ///
    /// # Errors
    /// Another design has the same name of files, or the same identifier: says which.
    pub(super) fn add(&mut self, input: &str, stem: &FileStem, net: &Net) -> Result<(), String> {
        if let Some(other) = self.stems.insert(stem.key(), input.to_owned()) {
            return Err(format!(
                "{other} and {input} would both be written to {stem}.*: rename one of them, or build them into two folders"
            ));
        }
        // Macros are in capitals, so capitals and small letters are one name here.
        let prefix = Namer::new(&C).name(&net.name.text);
        if let Some(other) = self.prefixes.insert(prefix.to_lowercase(), input.to_owned()) {
            return Err(format!(
                "{other} and {input} would both define the identifier `{prefix}`: give one of their charts another name, or build them one by one"
            ));
        }
        Ok(())
    }
}
