//! Detects designs of one build that conflict: files with the same name, or identifiers that C or HDL could not tell apart.

use grafsynth_driver::stem::FileStem;
use grafsynth_ir::names::{C, Namer};
use grafsynth_ir::net::Net;
use std::collections::BTreeMap;

/// The names of the designs so far, each with its input.
#[derive(Debug, Default)]
pub(super) struct Named {
    stems: BTreeMap<String, (FileStem, String)>,
    /// True if C is written.
    is_c: bool,
    prefixes: BTreeMap<String, String>,
}

impl Named {
    /// An empty list of designs. `is_c` is true if C is a target, because C has additional files.
    pub(super) fn new(is_c: bool) -> Self {
        Named { is_c, ..Named::default() }
    }

    /// Adds a design that was read from `input`.
    ///
    /// # Errors
    /// Another design has the same file names or the same identifier; the message names it.
    pub(super) fn add(&mut self, input: &str, stem: &FileStem, net: &Net) -> Result<(), String> {
        let met = self.stems.values().find(|(other, _)| self.is_c && other.meets_in_c(stem));
        if let Some((other, own)) = met {
            let long = if other.as_str().len() > stem.as_str().len() { other } else { stem };
            return Err(format!(
                "{own} and {input} would both write a file {long}.*: rename one of them, or build them into two folders"
            ));
        }
        if let Some((_, other)) = self.stems.insert(stem.key(), (stem.clone(), input.to_owned())) {
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
