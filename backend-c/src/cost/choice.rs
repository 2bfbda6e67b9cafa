//! Chooses the best style for a machine: each style that supports the chart is emitted and bounded.

use super::{Bound, Machine, bound};
use crate::{Options, Package, Style, emit};
use grafsynth_ir::Valid;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;

/// The optimisation goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Goal {
    /// Optimise for worst-case time. Among the styles within a tenth of the fastest, the one with the smallest code is chosen.
    #[default]
    Speed,
    /// Optimise for code size.
    Size,
}

/// A style that was tried.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Candidate {
    /// The style, as named by `--style`.
    pub style: Style,
    /// Its bound, or the reason why there is none.
    pub bound: Result<Bound, String>,
    /// True if this style was chosen.
    pub is_taken: bool,
}

/// For charts with more steps than this, the style with one bit per step is not tried: each reaction reads every bit, so that style cannot
/// be the best.
const STEPS_OF_BITS: usize = 500;

/// Emits the style that suits the machine best; [`Package::tried`] gives the reason.
pub(crate) fn emit_best(
    net: &Valid<Net>,
    facts: &Facts,
    options: &Options,
    machine: &'static Machine,
) -> Result<Package, Vec<Diagnostic>> {
    let with = |style| Options { style, machine: None, ..options.clone() };
    let mut packages: Vec<Option<Package>> = Vec::new();
    let mut tried: Vec<Candidate> = Vec::new();
    for style in [Style::Switch, Style::Tables, Style::Bits] {
        if style == Style::Bits && net.steps.len() > STEPS_OF_BITS {
            continue;
        }
        let (package, bound) = match emit(net, facts, &with(style)) {
            Err(found) => {
                let why = found.first().map_or_else(String::new, |it| it.message.clone());
                (None, Err(why))
            }
            Ok(package) => {
                let is_same = |other: &Package| other.files == package.files;
                if packages.iter().flatten().any(is_same) {
                    continue;
                }
                let bound = bound(&package, machine).map_err(|error| error.to_string());
                (Some(package), bound)
            }
        };
        packages.push(package);
        tried.push(Candidate { style, bound, is_taken: false });
    }
    let best = best(&tried, options.goal);
    let taken = best.and_then(|at| packages.get_mut(at).and_then(Option::take).map(|it| (at, it)));
    match taken {
        Some((at, mut package)) => {
            if let Some(candidate) = tried.get_mut(at) {
                candidate.is_taken = true;
            }
            package.tried = tried;
            Ok(package)
        }
        // No style could be bounded: use the style chosen without a machine, with its diagnostics.
        None => emit(net, facts, &with(Style::Auto)),
    }
}

fn best(tried: &[Candidate], goal: Goal) -> Option<usize> {
    let bounds = || {
        tried.iter().enumerate().filter_map(|(at, it)| it.bound.as_ref().ok().map(|it| (at, it)))
    };
    let fastest = bounds().map(|(_, bound)| bound.step).min()?;
    bounds()
        .filter(|(_, bound)| goal == Goal::Size || bound.step <= fastest + fastest / 10)
        .min_by_key(|(_, bound)| (bound.text, bound.step))
        .map(|(at, _)| at)
}
