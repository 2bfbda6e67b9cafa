//! The correspondence between pins and flip-flops of a circuit and objects of the net.

use grafsynth_ir::Gather;
use itertools::Itertools as _;
use std::collections::BTreeMap;

use grafsynth_ir::logic::{FlopId, Logic, NodeId, PinInputId, PinOutputId, PinRole, shown_by};
use grafsynth_ir::net::{Driver, InputId, InputKind, Net, OutputId, StepId, VarId};
use grafsynth_ir::program::Origin;
use grafsynth_sim::{Effect, InputRow, Row};

/// A value of a row, which a circuit represents bit by bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum What {
    /// An output, or the number of calls of an extern action.
    Output(OutputId),
    /// The activity of a step.
    Step(StepId),
    /// An element of a variable.
    Var(VarId, u32),
    /// The fault flag.
    Fault,
}

/// The place in the circuit that represents a bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Shown {
    /// An output pin; a mealy pin is sampled before the clock edge.
    Pin { pin: PinOutputId, mealy: bool },
    /// A flip-flop, which may store the complement.
    Flop { flop: FlopId, inverted: bool },
    /// The bits of a step in [`Binding::active`]; the step is active if all of them are set.
    Active(StepId),
    /// A function of the flip-flops: a bit of a step that shares a code with others.
    Function { node: NodeId },
}

/// One bit to compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Compared {
    pub(crate) what: What,
    pub(crate) bit: u32,
    pub(crate) shown: Shown,
}

/// The complete correspondence.
#[derive(Debug, Clone, Default)]
pub(crate) struct Binding {
    pub(crate) inputs: Vec<(PinInputId, InputId, u32)>,
    pub(crate) ticks: Vec<PinInputId>,
    pub(crate) busy: Option<PinOutputId>,
    pub(crate) compared: Vec<Compared>,
    /// For a step that has more than one bit or shares its bits: the bits that are all set while the step is active.
    pub(crate) active: BTreeMap<StepId, Vec<Shown>>,
    /// The index of each variable's first element in [`Row::vars`].
    var_places: Vec<usize>,
}

impl Binding {
    /// Finds every pin by its role.
    ///
    /// # Errors
    /// Returns a message if an object of the net has no counterpart, or if a pin has no known meaning.
    pub(crate) fn of(net: &Net, logic: &Logic) -> Result<Binding, String> {
        let mut binding = Binding::default();
        let mut place = 0;
        for var in net.vars.values() {
            binding.var_places.push(place);
            place += var.len.unwrap_or(1) as usize;
        }
        for (pin, input) in logic.inputs.iter() {
            match input.role {
                PinRole::Input(id, bit)
                    if net.inputs.get(id).is_some_and(|input| bit < input.ty.bits()) =>
                {
                    binding.inputs.push((pin, id, bit));
                }
                PinRole::Tick => binding.ticks.push(pin),
                // This pin is kept at 0, because the power-up value is the reset value.
                PinRole::Reset => {}
                _ => {
                    return Err(format!("the meaning of input pin `{}` is unknown", input.name));
                }
            }
        }
        let mut n_bits = vec![0; net.outputs.len()];
        for (pin, output) in logic.outputs.iter() {
            let shown = Shown::Pin { pin, mealy: output.mealy };
            match output.role {
                PinRole::Output(id, bit) if net.outputs.get(id).is_some() => {
                    n_bits[id.index()] = n_bits[id.index()].max(bit + 1);
                    binding.compared.push(Compared { what: What::Output(id), bit, shown });
                }
                PinRole::Fault => {
                    binding.compared.push(Compared { what: What::Fault, bit: 0, shown })
                }
                PinRole::Busy => binding.busy = Some(pin),
                _ => {
                    return Err(format!("the meaning of output pin `{}` is unknown", output.name));
                }
            }
        }
        for (id, output) in net.outputs.iter() {
            let wanted = match &output.driver {
                // A column of calls; it has a strobe pin if the action is ever called.
                Driver::Extern { .. } => 0,
                _ => output.ty.bits(),
            };
            if n_bits[id.index()] < wanted {
                return Err(format!(
                    "output `{}` has {} of {wanted} pins",
                    output.name,
                    n_bits[id.index()]
                ));
            }
        }
        let held = logic.flops.iter().filter_map(|(flop, data)| {
            let holds = data.holds?;
            Some((holds, Shown::Flop { flop, inverted: holds.inverted }))
        });
        let decoded =
            logic.decoded.iter().map(|bit| (bit.holds, Shown::Function { node: bit.node }));
        let all: Vec<_> = held.chain(decoded).collect();
        let bits: BTreeMap<Origin, Shown> =
            all.iter().map(|(holds, shown)| (holds.origin, *shown)).gather();
        for (step, origins) in shown_by(net, |origin| bits.contains_key(&origin)).iter() {
            if origins.is_empty() || origins == &[Origin::Step(step)] {
                continue;
            }
            binding.active.insert(step, origins.iter().map(|origin| bits[origin]).collect());
            let shown = Shown::Active(step);
            binding.compared.push(Compared { what: What::Step(step), bit: 0, shown });
        }
        for (holds, shown) in all {
            let what = match holds.origin {
                Origin::Step(step) if net.steps.get(step).is_some() => What::Step(step),
                Origin::Var(var)
                    if net
                        .vars
                        .get(var)
                        .is_some_and(|var| holds.element < var.len.unwrap_or(1)) =>
                {
                    What::Var(var, holds.element)
                }
                _ => continue,
            };
            binding.compared.push(Compared { what, bit: holds.bit, shown });
        }
        Ok(binding)
    }

    /// The pin values of an input row.
    pub(crate) fn pin_bits<'a>(
        &'a self,
        net: &'a Net,
        row: &'a InputRow,
    ) -> impl Iterator<Item = (PinInputId, bool)> + 'a {
        let inputs = self.inputs.iter().map(|(pin, input, bit)| {
            let ty = net.inputs[*input].ty;
            let value = match net.inputs[*input].kind {
                InputKind::InternalEvent => 0,
                InputKind::Pin | InputKind::Extern | InputKind::Event => row.value(*input),
            };
            let code = ty.saturate(value).abs_diff(ty.bounds().0);
            (*pin, code >> bit & 1 == 1)
        });
        inputs.chain(self.ticks.iter().map(|pin| (*pin, row.dt > 0)))
    }

    /// The net's value of the compared bit in this row; `None` if the net leaves the cell open.
    pub(crate) fn wanted(&self, net: &Net, row: &Row, compared: &Compared) -> Option<bool> {
        if row.open.row {
            return None;
        }
        let is_fixed =
            matches!(compared.what, What::Output(output) if row.open.fixed.contains(&output));
        if row.open.next && !is_fixed {
            return None;
        }
        let code = match compared.what {
            What::Output(output) => {
                if row.open.outputs.contains(&output) {
                    return None;
                }
                self.output(net, row, output)
            }
            What::Step(step) => u64::from(row.steps.binary_search(&step).is_ok()),
            What::Var(var, element) => {
                let value = row.vars[self.var_places[var.index()] + element as usize];
                value.abs_diff(net.vars[var].ty.bounds().0)
            }
            What::Fault => u64::from(row.fault),
        };
        Some(code >> compared.bit.min(63) & 1 == 1)
    }

    fn output(&self, net: &Net, row: &Row, output: OutputId) -> u64 {
        match &net.outputs[output].driver {
            Driver::Extern { .. } => {
                let calls = row
                    .effects
                    .iter()
                    .filter(|effect| matches!(effect, Effect::Call(own, _) if *own == output));
                calls.count() as u64
            }
            _ => row.outputs[output.index()].abs_diff(net.outputs[output].ty.bounds().0),
        }
    }

    /// The header of the column that contains the bit.
    pub(crate) fn column(&self, net: &Net, logic: &Logic, compared: &Compared) -> String {
        match compared.what {
            What::Output(output) => net.outputs[output].name.text.clone(),
            What::Step(_) => "steps".to_owned(),
            What::Var(var, element) => match net.vars[var].len {
                Some(_) => format!("{}[{element}]", net.vars[var].name),
                None => net.vars[var].name.text.clone(),
            },
            What::Fault => match compared.shown {
                Shown::Pin { .. } | Shown::Function { .. } => "fault".to_owned(),
                Shown::Flop { flop, .. } => logic.flops[flop].name.clone(),
                Shown::Active(step) => net.steps[step].name.text.clone(),
            },
        }
    }

    /// The cell texts of net and circuit for a report; `circuit` returns the bit at a place.
    pub(crate) fn texts(
        &self,
        net: &Net,
        row: &Row,
        differs: &Compared,
        circuit: &mut impl FnMut(&Compared) -> bool,
    ) -> (String, String) {
        let code = |what: What, circuit: &mut dyn FnMut(&Compared) -> bool| {
            let bits = self.compared.iter().filter(|one| one.what == what);
            bits.fold(0_u64, |code, one| code | u64::from(circuit(one)) << one.bit.min(63))
        };
        match differs.what {
            What::Step(_) => {
                let name = |step: StepId| net.steps[step].name.text.clone();
                let visible = |step: &StepId| !net.steps[*step].hidden;
                let mine =
                    row.steps.iter().copied().filter(|step| visible(step)).map(name).join(" ");
                let mut theirs: Vec<StepId> = self
                    .compared
                    .iter()
                    .filter_map(|one| match one.what {
                        What::Step(step) => circuit(one).then_some(step),
                        What::Output(_) | What::Var(..) | What::Fault => None,
                    })
                    .filter(visible)
                    .collect();
                theirs.sort_unstable();
                theirs.dedup();
                let theirs = theirs.into_iter().map(name).join(" ");
                (mine, theirs)
            }
            What::Output(output) => {
                let lo = match net.outputs[output].driver {
                    Driver::Extern { .. } => 0,
                    _ => net.outputs[output].ty.bounds().0,
                };
                let mine = lo.saturating_add_unsigned(self.output(net, row, output));
                let theirs = lo.saturating_add_unsigned(code(differs.what, circuit));
                (mine.to_string(), theirs.to_string())
            }
            What::Var(var, element) => {
                let mine = row.vars[self.var_places[var.index()] + element as usize];
                let theirs = net.vars[var]
                    .ty
                    .bounds()
                    .0
                    .saturating_add_unsigned(code(differs.what, circuit));
                (mine.to_string(), theirs.to_string())
            }
            What::Fault => {
                (u8::from(row.fault).to_string(), u8::from(circuit(differs)).to_string())
            }
        }
    }
}
