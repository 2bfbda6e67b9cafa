//! Reports why a design does not fit, in the user's terms.

use super::attempt::Attempt;
use super::need::Need;
use crate::codes;
use crate::device::Device;
use crate::equations::{Equations, SignalIndex, Source, source_name};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{Logic, Node, NodeId};
use grafsynth_ir::net::Meta;
use grafsynth_logic::build::for_each_operand;
use std::collections::BTreeSet;

/// The maximum number of locations that a finding shows for one function.
const MOST_CAUSES: usize = 4;

/// The resources that a device lacks in each of its modes.
#[derive(Debug)]
pub(crate) struct Misfit {
    modes: Vec<Obstacles>,
    n_inputs: usize,
    n_functions: usize,
    /// The number of signals that need a pin, including the clock.
    n_signals: usize,
}

/// The resources that a device lacks in one mode.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Obstacles {
    pub(crate) mode: &'static str,
    /// Inputs without a pin, by name.
    pub(crate) inputs: Vec<String>,
    /// Functions without a macrocell: every macrocell that is wide enough is in use, or the device has no flip-flops.
    functions: Vec<String>,
    /// Combinational functions, if every macrocell is registered.
    combinational: Vec<String>,
    /// Functions that are wider than any macrocell.
    wide: Vec<TooWide>,
    /// Functions that fit in no logic block.
    pub(crate) homeless: Vec<UnplacedFunction>,
    has_no_flops: bool,
}

/// A function for which no logic block has enough macrocells, pins and inputs left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct UnplacedFunction {
    pub(crate) name: String,
    /// The number of signals that it reads.
    pub(crate) n_signals: usize,
    pub(crate) meta: Meta,
}

/// A function that is wider than any macrocell.
#[derive(Debug, Clone, PartialEq, Eq)]
struct TooWide {
    name: String,
    terms: usize,
    limit: usize,
    meta: Meta,
    /// The parts of the chart that its terms come from.
    causes: Vec<(String, Meta)>,
}

impl Obstacles {
    pub(crate) fn of(equations: &Equations, logic: &Logic, attempt: &Attempt) -> Self {
        let mode = attempt.view.mode.map_or("", |mode| mode.name);
        let mut found = Obstacles { mode, ..Obstacles::default() };
        for wish in &attempt.left {
            let signal = &equations.signals[wish.index];
            let name = match source_name(logic, signal.source) {
                "" => signal.name.clone(),
                name => name.to_owned(),
            };
            match wish.need {
                Need::Clock => found.has_no_flops = true,
                Need::Input => found.inputs.push(name),
                Need::Macrocell { terms, is_registered, .. } => {
                    let limit = attempt.view.widest(is_registered);
                    if limit == 0 && is_registered {
                        found.has_no_flops = true;
                        found.functions.push(name);
                    } else if limit == 0 {
                        found.combinational.push(name);
                    } else if terms > limit {
                        let causes = causes(equations, logic, wish.index);
                        let meta = signal.meta.clone();
                        found.wide.push(TooWide { name, terms, limit, meta, causes });
                    } else {
                        found.functions.push(name);
                    }
                }
            }
        }
        found
    }

    pub(crate) fn count(&self) -> usize {
        let functions =
            [&self.functions, &self.combinational].iter().map(|all| all.len()).sum::<usize>()
                + self.wide.len()
                + self.homeless.len();
        self.inputs.len() + functions + usize::from(self.has_no_flops)
    }

    fn parts(&self, misfit: &Misfit, device: &Device) -> Vec<String> {
        let mut parts = Vec::new();
        if self.has_no_flops {
            parts.push("the device has no flip-flops for the registers".to_owned());
        }
        if !self.functions.is_empty() {
            parts.push(format!(
                "{} of its {} registers and outputs {} none of the {} macrocells ({})",
                self.functions.len(),
                misfit.n_functions,
                finds(&self.functions),
                device.macrocells.len(),
                listed(&self.functions)
            ));
        }
        if !self.combinational.is_empty() {
            let is_one = self.combinational.len() == 1;
            parts.push(format!(
                "{} {} combinational, and all {} macrocells are registered",
                listed(&self.combinational),
                if is_one { "is" } else { "are" },
                device.macrocells.len()
            ));
        }
        if !self.inputs.is_empty() {
            parts.push(format!(
                "{} of its {} inputs {} no pin ({}): {} signals are too many for the pins",
                self.inputs.len(),
                misfit.n_inputs,
                finds(&self.inputs),
                listed(&self.inputs),
                misfit.n_signals
            ));
        }
        for wide in &self.wide {
            let TooWide { name, terms, limit, .. } = wide;
            parts.push(format!(
                "`{name}` needs {terms} product terms and the largest macrocell has {limit}"
            ));
        }
        if let (Some(first), Some(blocks)) = (self.homeless.first(), device.blocks) {
            parts.push(format!(
                "{} of its functions {} not fit in a logic block of {} macrocells that reads {} signals; the first is `{}`, which reads {}",
                self.homeless.len(),
                if self.homeless.len() == 1 { "does" } else { "do" },
                blocks.n_cells,
                blocks.fan_in,
                first.name,
                first.n_signals
            ));
        }
        parts
    }
}

fn finds(names: &[String]) -> &'static str {
    if names.len() == 1 { "gets" } else { "get" }
}

/// The first names of a list, and the number of the others.
fn listed(names: &[String]) -> String {
    const SHOWN: usize = 6;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect();
    match names.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

impl Misfit {
    /// The obstacles of each mode, the mode with the fewest first; modes with the same obstacles appear once.
    pub(crate) fn new(equations: &Equations, mut modes: Vec<Obstacles>) -> Self {
        modes.sort_by_key(Obstacles::count);
        let is_input = |source: Source| matches!(source, Source::Input(_));
        let n_inputs = equations.signals.iter().filter(|signal| is_input(signal.source)).count();
        let n_signals = equations.signals.iter().filter(|signal| signal.shared.is_none()).count();
        let n_functions = equations.equations.len();
        let mut misfit = Misfit { modes, n_inputs, n_functions, n_signals };
        let mut said: Vec<Vec<String>> = Vec::new();
        let mut kept = Vec::new();
        for mode in std::mem::take(&mut misfit.modes) {
            let parts = mode.parts(&misfit, equations.device);
            if !said.contains(&parts) {
                said.push(parts);
                kept.push(mode);
            }
        }
        misfit.modes = kept;
        misfit
    }

    /// True if a function has no macrocell because it is wide, or because wider functions use the macrocells that could hold it.
    pub(crate) fn is_about_width(&self) -> bool {
        let lacks = |mode: &Obstacles| {
            mode.inputs.is_empty()
                && mode.combinational.is_empty()
                && !(mode.functions.is_empty() && mode.wide.is_empty())
        };
        self.modes.iter().any(lacks)
    }

    pub(crate) fn parts(&self, device: &Device) -> Vec<String> {
        match &self.modes[..] {
            [only] => only.parts(self, device),
            modes => modes
                .iter()
                .map(|mode| {
                    format!("in its {} mode, {}", mode.mode, mode.parts(self, device).join(", "))
                })
                .collect(),
        }
    }

    pub(crate) fn diagnostic(&self, logic: &Logic, device: &Device) -> Diagnostic {
        let message = format!(
            "`{}` does not fit one {}: {}",
            logic.name,
            device.name,
            self.parts(device).join("; ")
        );
        let mut finding =
            Diagnostic::error(codes::DOES_NOT_FIT, message).at(logic.name.span, "this chart");
        for wide in self.modes.iter().take(1).flat_map(|mode| &mode.wide) {
            let label = format!("`{}` needs {} product terms", wide.name, wide.terms);
            finding = finding.at(wide.meta.span, label);
            let n_causes = wide.causes.len();
            for (at, (cause, meta)) in wide.causes.iter().take(MOST_CAUSES).enumerate() {
                let more = match n_causes.saturating_sub(MOST_CAUSES) {
                    more if more > 0 && at + 1 == MOST_CAUSES => format!(" (and {more} more)"),
                    _ => String::new(),
                };
                let label = format!("`{cause}` adds terms to `{}`{more}", wide.name);
                finding = finding.at(meta.span, label);
            }
        }
        for homeless in self.modes.iter().take(1).flat_map(|mode| &mode.homeless) {
            finding = finding.at(homeless.meta.span, "does not fit");
        }
        finding.help("use a larger device, split the chart, or build for `palasm` or `cupl`, which leave pins unassigned")
    }
}

/// The finding for a circuit that is too large for a device, whatever its sums are.
pub(crate) fn by_count(logic: &Logic, device: &Device, lack: &str) -> Diagnostic {
    let message = format!("`{}` does not fit one {}: {lack}", logic.name, device.name);
    Diagnostic::error(codes::DOES_NOT_FIT, message)
        .at(logic.name.span, "this chart")
        .help("use a larger device, split the chart, or build for `palasm` or `cupl`, which leave pins unassigned")
}

/// The components of a signal's function: the named functions just below it (the firing of transitions), or else the flip-flops that it reads.
fn causes(equations: &Equations, logic: &Logic, index: SignalIndex) -> Vec<(String, Meta)> {
    let root = match equations.signals[index].source {
        Source::Flop(id) => logic.flops[id].next,
        Source::Output(id) => logic.outputs[id].value,
        Source::Clock | Source::Input(_) | Source::Buried(_) => return Vec::new(),
    };
    let mut causes: Vec<(String, Meta)> = Vec::new();
    let mut flops: Vec<(String, Meta)> = Vec::new();
    let (mut open, mut seen): (Vec<NodeId>, BTreeSet<NodeId>) = (vec![root], BTreeSet::new());
    while let Some(node) = open.pop() {
        if !seen.insert(node) {
            continue;
        }
        let wire = logic.wires.iter().find(|wire| wire.node == node && node != root);
        if let Some(wire) = wire.filter(|wire| wire.meta.span != Default::default()) {
            let name = wire.name.strip_prefix("fire_").unwrap_or(&wire.name);
            causes.push((name.to_owned(), wire.meta.clone()));
            continue;
        }
        if let Node::Flop(flop) = &logic.nodes[node] {
            let flop = &logic.flops[*flop];
            flops.push((flop.name.clone(), flop.meta.clone()));
        }
        for_each_operand(&logic.nodes[node], |operand| open.push(operand));
    }
    let mut causes = if causes.is_empty() { flops } else { causes };
    causes.retain(|(_, meta)| meta.span != Default::default());
    causes.sort_by_key(|(_, meta)| (meta.span.file, meta.span.start, meta.span.end));
    causes.dedup_by_key(|(_, meta)| meta.span);
    causes
}
