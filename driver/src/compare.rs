//! Two charts, by what they have in common: proved for every stimulus, or compared on some.

use crate::codes;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_sim::{Difference, Stimulus};
use grafsynth_verify::pair::{Common, Incomparable, Omitted, Side, charts_on};
use itertools::Itertools as _;

/// What a comparison found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// The first difference.
    pub difference: Option<Difference>,
    /// How many computed columns both have.
    pub n_columns: usize,
    /// Outputs that only one of both has, each with the one that has it: they were not compared.
    pub apart: Apart,
    /// Rows that were compared beside that of the reset. Fewer than the stimulus has where a row is none that both designs allow.
    pub n_rows: usize,
}

/// Outputs that only one of two designs has.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Apart {
    /// Those of the first.
    pub first: Vec<String>,
    /// Those of the second.
    pub second: Vec<String>,
}

impl Apart {
    /// The outputs of each side that has some, as a phrase.
    pub fn parts(&self) -> impl Iterator<Item = String> {
        let sides = [(&self.first, "first"), (&self.second, "second")];
        let sides = sides.into_iter().filter(|(names, _)| !names.is_empty());
        sides.map(|(names, which)| format!("{} (only in the {which})", names.join(", ")))
    }
}

impl std::fmt::Display for Apart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.parts().join("; "))
    }
}

/// What two charts have in common.
///
/// # Errors
/// When they cannot be compared.
pub fn common(left: &Valid<Net>, right: &Valid<Net>) -> Result<Common, Vec<Diagnostic>> {
    Common::of(left, right).map_err(|why| vec![incomparable(&why)])
}

/// Two nets under a stimulus of the first: inputs by name, and every computed column that both have, `steps` if they have the same step names.
///
/// # Errors
/// When they cannot be compared.
pub fn nets(
    left: &Valid<Net>,
    right: &Valid<Net>,
    stimulus: &Stimulus,
) -> Result<Outcome, Vec<Diagnostic>> {
    let common = common(left, right)?;
    let found = charts_on(left, right, &common, stimulus);
    let only = |wanted: Side| {
        let columns = common.omitted.iter().filter_map(move |omitted| match omitted {
            Omitted::Column { name, side } if *side == wanted => Some(name.clone()),
            Omitted::Column { .. }
            | Omitted::Calls { .. }
            | Omitted::Steps
            | Omitted::Code { .. }
            | Omitted::Input { .. }
            | Omitted::Values { .. }
            | Omitted::Assumptions { .. } => None,
        });
        columns.collect()
    };
    let apart = Apart { first: only(Side::Left), second: only(Side::Right) };
    Ok(Outcome {
        difference: found.difference,
        n_columns: common.columns.len(),
        apart,
        n_rows: found.compared,
    })
}

/// Why two designs cannot be compared, as a finding.
#[must_use]
pub fn incomparable(why: &Incomparable) -> Diagnostic {
    let help = match why {
        Incomparable::NothingInCommon => "designs are compared by the columns that both have",
        Incomparable::Ticks { .. } => {
            "a row's `dt` counts ticks, so one row is two lengths of time: give both charts the same `tick`"
        }
        Incomparable::NoCommonValue { .. } => "let the ranges of the input overlap",
    };
    Diagnostic::error(codes::LOGIC_DOES_NOT_FIT, why.to_string()).help(help)
}

pub(crate) fn nothing_in_common() -> Vec<Diagnostic> {
    vec![incomparable(&Incomparable::NothingInCommon)]
}
