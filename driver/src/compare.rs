//! Compares the common columns of two charts under a stimulus.

use crate::codes;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_sim::{Difference, Stimulus};
use grafsynth_verify::pair::{Common, Incomparable, Omitted, Side, charts_on};

/// The result of a comparison.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// The first difference.
    pub difference: Option<Difference>,
    /// The number of computed columns that both have.
    pub n_columns: usize,
    /// Outputs that only one design has, which were not compared.
    pub apart: Apart,
    /// The number of compared rows, without the reset row; if one design is logic, the number of rows of the stimulus. For two charts, it is less than the
    /// number of rows of the stimulus if the comparison ends at a difference or at a row that is not legal in both designs.
    pub n_rows: usize,
}

/// Outputs that only one of two designs has.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Apart {
    /// Outputs that only the first design has.
    pub first: Vec<String>,
    /// Outputs that only the second design has.
    pub second: Vec<String>,
}

impl Apart {
    /// For each side with such outputs, a phrase that lists them; `first` and `second` name the designs.
    pub fn parts<'a>(
        &'a self,
        first: &'a str,
        second: &'a str,
    ) -> impl Iterator<Item = String> + 'a {
        let sides = [(&self.first, first), (&self.second, second)];
        let sides = sides.into_iter().filter(|(names, _)| !names.is_empty());
        sides.map(|(names, which)| format!("{} (only in the {which})", names.join(", ")))
    }
}

/// The common part of two charts.
///
/// # Errors
/// They cannot be compared.
pub fn common(left: &Valid<Net>, right: &Valid<Net>) -> Result<Common, Vec<Diagnostic>> {
    Common::of(left, right).map_err(|why| vec![incomparable(&why)])
}

/// Compares two nets under a stimulus of the first, whose inputs are matched by name. All computed columns that both have are compared, and `steps` if both
/// have the same step names.
///
/// # Errors
/// They cannot be compared.
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
            _ => None,
        });
        columns.collect()
    };
    let apart = Apart { first: only(Side::Left), second: only(Side::Right) };
    Ok(Outcome {
        difference: found.apart.map(|apart| apart.difference),
        n_columns: common.columns.len(),
        apart,
        n_rows: found.compared,
    })
}

/// Why two designs cannot be compared, as a finding.
#[must_use]
pub fn incomparable(why: &Incomparable) -> Diagnostic {
    let help = match why {
        Incomparable::NothingInCommon => {
            "give at least one output the same name in both designs; for logic, `--rename OTHER=NAME` compares its `OTHER` as `NAME`"
        }
        Incomparable::Ticks { .. } => {
            "`dt` counts ticks, so a row has a different duration in each chart: give both charts the same `tick`"
        }
        Incomparable::NoCommonValue { .. } => "make the ranges of the input overlap",
    };
    Diagnostic::error(codes::LOGIC_DOES_NOT_FIT, why.to_string()).help(help)
}

pub(crate) fn nothing_in_common() -> Vec<Diagnostic> {
    vec![incomparable(&Incomparable::NothingInCommon)]
}
