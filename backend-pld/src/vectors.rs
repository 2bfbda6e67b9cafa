//! Test vectors: rows of a trace as bits of a circuit's pins.
//!
//! A row is one reaction. If that takes several clocks (semantics.md §9), events and the tick are high in the first of them only, and outputs are
//! checked after `busy` has fallen.

use crate::codes;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{Logic, PinRole};
use grafsynth_ir::net::{Net, StepId};
use grafsynth_ir::program::Origin;
use grafsynth_logic::chip::{ChipSim, NoRow, most_clocks};

/// Test vectors as rows of bits; row 0 is the state after power-up.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Vectors {
    /// One for each reaction, and row 0.
    pub rows: Vec<VectorRow>,
    /// For each output of the circuit: whether it is checked before the clock instead of after.
    pub mealy: Vec<bool>,
    /// For each input of the circuit: whether it is an event or the tick, which last one clock.
    pub pulses: Vec<bool>,
    /// The index of the `busy` pin among the outputs, if a reaction may take several clocks.
    pub busy: Option<usize>,
    /// The maximum number of clocks of a reaction.
    pub most_clocks: u64,
}

/// One row.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct VectorRow {
    /// A value for each input of the circuit.
    pub inputs: Vec<bool>,
    /// The expected value of each output; `None` if it is not known.
    pub outputs: Vec<Option<bool>>,
    /// The expected value of each flip-flop after the clock; `None` if it is not known. May be empty.
    pub flops: Vec<Option<bool>>,
    /// The number of clocks that this circuit needs for the reaction: 0 in row 0, 1 in all others if there is no `busy` pin.
    pub clocks: u64,
}

/// True for an event or the tick, which is high for one clock.
fn is_pulse(net: &Net, role: PinRole) -> bool {
    match role {
        PinRole::Input(id, _) => net.inputs[id].kind.is_event(),
        PinRole::Tick => true,
        _ => false,
    }
}

fn never_ends(row: usize, why: NoRow) -> Diagnostic {
    let clocks = match why {
        NoRow::StillBusy { clocks } => clocks,
        NoRow::TooManyTicks { .. } => unreachable!("a row with more ticks is a finding before"),
    };
    let message = format!("the circuit is still busy with row {row} after {clocks} clocks");
    Diagnostic::error(codes::BAD_VECTORS, message)
        .help("this is a bug in grafsynth: please report it with the chart")
}

/// One row of a trace, with the numbers of the net.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TraceRow {
    /// Ticks: 0 or 1.
    pub dt: u64,
    /// Values by index of the net's input.
    pub inputs: Vec<i64>,
    /// Values by index of the net's output; `None` if the trace leaves a cell open.
    pub outputs: Vec<Option<i64>>,
    /// Whether each step is active, by index of the step; may be empty.
    pub steps: Vec<bool>,
    /// The fault flag.
    pub fault: bool,
}

impl VectorRow {
    /// The bits of a row of the trace, which takes this number of clocks.
    fn of(net: &Net, logic: &Logic, row: &TraceRow, clocks: u64) -> Self {
        let bit_of = |value: i64, lo: i64, bit: u32| {
            value.abs_diff(lo).checked_shr(bit).unwrap_or(0) & 1 == 1
        };
        let input = |role: PinRole| match role {
            PinRole::Input(id, bit) => {
                let ty = net.inputs[id].ty;
                let value = ty.saturate(row.inputs.get(id.index()).copied().unwrap_or(0));
                bit_of(value, ty.bounds().0, bit)
            }
            PinRole::Tick => row.dt == 1,
            _ => false,
        };
        let output = |role: PinRole| match role {
            PinRole::Output(id, bit) => {
                let lo = net.outputs[id].ty.bounds().0;
                row.outputs.get(id.index()).copied().flatten().map(|value| bit_of(value, lo, bit))
            }
            PinRole::Fault => Some(row.fault),
            // The `busy` pin is 0 in every row, because a row is checked after the reaction has ended.
            PinRole::Busy => Some(false),
            PinRole::Input(..) | PinRole::Tick | PinRole::Reset | PinRole::Unknown => None,
        };
        let flops = logic.flops.values().map(|flop| {
            let holds = flop.holds?;
            let is_active = |step: StepId| row.steps.get(step.index()).copied();
            let bit = if let Origin::Step(step) = holds.origin {
                is_active(step)
            } else if let Origin::Region(step) = holds.origin {
                // No row shows the value that the register of an inactive region keeps.
                let parent = net.steps.get(step)?.parent?;
                is_active(parent).filter(|is_active| *is_active).and(is_active(step))
            } else {
                None
            };
            bit.map(|bit| bit != holds.inverted)
        });
        VectorRow {
            clocks,
            inputs: logic.inputs.values().map(|pin| input(pin.role)).collect(),
            outputs: logic.outputs.values().map(|pin| output(pin.role)).collect(),
            flops: flops.collect(),
        }
    }
}

impl Vectors {
    /// The bits of a trace.
    ///
    /// # Errors
    /// If a row has more than one tick.
    pub fn of(net: &Net, logic: &Logic, rows: &[TraceRow]) -> Result<Self, Vec<Diagnostic>> {
        let mut findings = Vec::new();
        let mut made = Vec::with_capacity(rows.len());
        let busy = logic.outputs.iter().find(|(_, pin)| pin.role == PinRole::Busy);
        let mut chip = busy.map(|_| ChipSim::new(net, logic));
        for (index, row) in rows.iter().enumerate() {
            if row.dt > 1 {
                let message = format!(
                    "row {index} has dt {}, but a chip processes at most one tick per clock",
                    row.dt
                );
                findings.push(
                    Diagnostic::error(codes::BAD_VECTORS, message)
                        .help("use a stimulus with dt 0 or 1"),
                );
            }
            let clocks = match &mut chip {
                _ if index == 0 => 0,
                None => 1,
                Some(chip) => match chip.react(&row.inputs, row.dt.min(1)) {
                    Ok(clocks) => clocks,
                    Err(why) => {
                        findings.push(never_ends(index, why));
                        break;
                    }
                },
            };
            made.push(VectorRow::of(net, logic, row, clocks));
        }
        if findings.is_empty() {
            Ok(Vectors {
                rows: made,
                mealy: logic.outputs.values().map(|output| output.mealy).collect(),
                pulses: logic.inputs.values().map(|pin| is_pulse(net, pin.role)).collect(),
                busy: busy.map(|(pin, _)| pin.index()),
                most_clocks: most_clocks(net),
            })
        } else {
            Err(findings)
        }
    }

    /// Checks that the rows have as many bits as the circuit has pins.
    pub(crate) fn check(&self, logic: &Logic) -> Result<(), Vec<Diagnostic>> {
        let fits = self.mealy.len() == logic.outputs.len()
            && self.pulses.len() == logic.inputs.len()
            && self.rows.iter().all(|row| {
                row.inputs.len() == logic.inputs.len()
                    && row.outputs.len() == logic.outputs.len()
                    && (row.flops.is_empty() || row.flops.len() == logic.flops.len())
            });
        if fits {
            return Ok(());
        }
        let message = format!(
            "the test vectors do not match: expected {} inputs and {} outputs, as in `{}`",
            logic.inputs.len(),
            logic.outputs.len(),
            logic.name
        );
        Err(vec![
            Diagnostic::error(codes::BAD_VECTORS, message)
                .help("make the vectors from this circuit's trace"),
        ])
    }
}
