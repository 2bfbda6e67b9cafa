//! Runs the emitted Verilog in Icarus Verilog: an independent simulator executes exactly the text that a user gets.
//!
//! The bench only drives pins and prints bits; this module converts them to rows, so the trace has the same form as from any other engine.

use crate::scratch::Scratch;
use crate::tools;
use crate::{Availability, Engine, EngineError, Job, Pace};
use grafsynth_backend_pld::{Dialect, Named, Object};
use grafsynth_driver::pipeline;
use grafsynth_ir::logic::{PinRole, shown_by};
use grafsynth_ir::net::{Driver, Net};
use grafsynth_ir::program::Origin;
use grafsynth_logic::chip::most_clocks;
use grafsynth_sim::{Clocked, Effect, InputRow, Row, Trace, TraceLayout};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::time::Duration;

/// Icarus Verilog on the emitted text.
#[derive(Debug, Clone, Copy)]
pub struct VerilogEngine;

/// The time limit of the simulator, longer than any test bench needs.
const LIMIT: Duration = Duration::from_secs(300);

impl Engine for VerilogEngine {
    fn name(&self) -> &'static str {
        "verilog"
    }

    fn about(&self) -> &'static str {
        "the Verilog text in Icarus Verilog"
    }

    fn pace(&self) -> Pace {
        Pace::Clocks
    }

    fn availability(&self) -> Availability {
        match (tools::find(&["iverilog"]), tools::find(&["vvp"])) {
            (Some(_), Some(_)) => Availability::Here,
            _ => Availability::Missing("iverilog".to_owned()),
        }
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        let clocked = Clocked::of(job.net, job.stimulus)
            .map_err(|finding| EngineError::Refused(vec![*finding]))?;
        let logic = pipeline::logic(job.net, job.facts).map_err(EngineError::Refused)?;
        let options = pipeline::emit_options(job.net, None, None);
        let emitted = grafsynth_backend_pld::emit(&logic, Dialect::Verilog, &options)
            .map_err(EngineError::Refused)?;
        let module = module_name(&emitted.text)
            .ok_or_else(|| EngineError::Failed("the emitted Verilog has no module".to_owned()))?;
        let rows: Vec<InputRow> = clocked.stimulus.rows().collect();
        let shown = shown(&emitted.names);
        // Row 0 has all inputs 0; for a range that does not start at 0 this is not the code with all bits 0.
        let zeros = stimulus_bits(
            job.net,
            &emitted.names,
            &[InputRow { dt: 0, ..InputRow::zero(job.net) }],
        );
        let wait = Wait::of(job.net, &emitted.names);
        let bench = bench(&module, &emitted.names, &shown, &zeros, rows.len(), wait.as_ref());
        let output =
            simulate(&emitted.text, &bench, &stimulus_bits(job.net, &emitted.names, &rows))?;
        trace(job.net, &shown, &rows, &output)
    }
}

fn module_name(text: &str) -> Option<String> {
    let at = text.lines().find_map(|line| line.trim_start().strip_prefix("module "))?;
    let end = at.find(['(', ';', '#', ' ']).unwrap_or(at.len());
    Some(at[..end].trim().to_owned())
}

/// The signals whose bits are printed, in this order.
fn shown(names: &[Named]) -> Vec<&Named> {
    names
        .iter()
        .filter(|named| matches!(named.object, Object::Flop(_) | Object::Output(_)))
        .collect()
}

/// The input bits of each row, most significant first in the order of the names.
fn stimulus_bits(net: &Net, names: &[Named], rows: &[InputRow]) -> String {
    let mut text = String::new();
    for row in rows {
        for named in names {
            let Object::Input(pin) = &named.object else { continue };
            let bit = match pin.role {
                PinRole::Input(id, bit) => {
                    let ty = net.inputs[id].ty;
                    ty.saturate(row.value(id)).abs_diff(ty.bounds().0).checked_shr(bit).unwrap_or(0)
                        & 1
                        == 1
                }
                PinRole::Tick => row.dt == 1,
                _ => false,
            };
            text.push(if bit { '1' } else { '0' });
        }
        // A circuit without inputs still needs a word for each row.
        text.push_str("0\n");
    }
    text
}

/// How the bench waits for the end of a reaction that may take several clocks.
struct Wait {
    /// The index of the `busy` pin among the printed signals.
    busy: usize,
    /// A mask with one bit for each input pin: whether the pin is high only in the first clock of a reaction.
    pulses: String,
    /// The maximum number of clocks of a reaction.
    most_clocks: u64,
}

/// Printed by the bench if a reaction does not end.
const STILL_BUSY: &str = "still busy";

impl Wait {
    fn of(net: &Net, names: &[Named]) -> Option<Self> {
        let is_busy = |named: &&Named| matches!(&named.object, Object::Output(pin) if pin.role == PinRole::Busy);
        let busy = shown(names).iter().position(is_busy)?;
        let mut pulses = String::new();
        for named in names {
            if let Object::Input(pin) = &named.object {
                let is_pulse = match pin.role {
                    PinRole::Input(id, _) => net.inputs[id].kind.is_event(),
                    PinRole::Tick => true,
                    _ => false,
                };
                pulses.push(if is_pulse { '1' } else { '0' });
            }
        }
        pulses.push('0');
        Some(Wait { busy, pulses, most_clocks: most_clocks(net).min(1 << 30) })
    }

    fn text(&self) -> String {
        let Wait { busy, pulses, most_clocks } = self;
        let width = pulses.len();
        format!(
            "      #1 clocks = 1;\n      if (out_{busy} === 1'b1) in_bits = in_bits & ~{width}'b{pulses};\n      while (out_{busy} === 1'b1 && clocks < {most_clocks}) begin\n        #4 clock_pin = 1'b0;\n        #5 clock_pin = 1'b1;\n        #1 clocks = clocks + 1;\n      end\n      if (out_{busy} === 1'b1) begin\n        $display(\"{STILL_BUSY}\");\n        $finish;\n      end\n"
        )
    }
}

fn bench(
    module: &str,
    names: &[Named],
    shown: &[&Named],
    zeros: &str,
    n_rows: usize,
    wait: Option<&Wait>,
) -> String {
    let inputs: Vec<&str> = names
        .iter()
        .filter(|named| matches!(named.object, Object::Input(_)))
        .map(|named| named.name.as_str())
        .collect();
    let width = inputs.len() + 1;
    let (last, clock) =
        (n_rows.max(1) - 1, names.iter().find(|named| matches!(named.object, Object::Clock)));
    let mut text = format!(
        "`timescale 1ns/1ns\nmodule grafsynth_bench;\n  reg [{}:0] rows [0:{last}];\n  reg [{}:0] in_bits;\n  reg clock_pin;\n  integer at;\n",
        width - 1,
        width - 1
    );
    let mut ports = Vec::new();
    if let Some(clock) = clock {
        ports.push(format!(".{}(clock_pin)", clock.name));
    }
    for named in names {
        if matches!(named.object, Object::Reset) {
            ports.push(format!(".{}(1'b0)", named.name));
        }
    }
    for (at, name) in inputs.iter().enumerate() {
        ports.push(format!(".{name}(in_bits[{}])", width - 1 - at));
    }
    let mut outputs = Vec::new();
    for (at, named) in shown.iter().enumerate() {
        if let Object::Output(pin) = &named.object {
            let _ = writeln!(text, "  wire out_{at};");
            ports.push(format!(".{}(out_{at})", named.name));
            if pin.mealy {
                let _ = writeln!(text, "  reg before_{at};");
                outputs.push(format!("before_{at}"));
            } else {
                outputs.push(format!("out_{at}"));
            }
        } else {
            outputs.push(format!("dut.{}", named.name));
        }
    }
    let sample: String = shown
        .iter()
        .enumerate()
        .filter(|(_, named)| matches!(&named.object, Object::Output(pin) if pin.mealy))
        .map(|(at, _)| format!("before_{at} = out_{at}; "))
        .collect();
    outputs.push("1'b0".to_owned());
    if wait.is_some() {
        text.push_str("  integer clocks;\n");
    }
    let wait = wait.map_or_else(String::new, Wait::text);
    let zeros = zeros.trim_end();
    let _ = write!(
        text,
        "  {module} dut ({});\n  initial begin\n    $readmemb(\"rows.txt\", rows);\n    clock_pin = 1'b0;\n    in_bits = {width}'b{zeros};\n    #4 {sample}#1 $display(\"%b\", {{{}}});\n    for (at = 0; at < {n_rows}; at = at + 1) begin\n      in_bits = rows[at];\n      #4 {sample}#1 clock_pin = 1'b1;\n{wait}      #4 $display(\"%b\", {{{}}});\n      #1 clock_pin = 1'b0;\n    end\n    $finish;\n  end\nendmodule\n",
        ports.join(", "),
        outputs.join(", "),
        outputs.join(", ")
    );
    text
}

fn simulate(text: &str, bench: &str, rows: &str) -> Result<Vec<u8>, EngineError> {
    let failed = |error: std::io::Error| {
        EngineError::Failed(format!("cannot write a temporary file: {error}"))
    };
    let folder = Scratch::new().map_err(failed)?;
    write(folder.path(), "design.v", text).map_err(failed)?;
    write(folder.path(), "bench.v", bench).map_err(failed)?;
    write(folder.path(), "rows.txt", rows).map_err(failed)?;
    let (Some(iverilog), Some(vvp)) = (tools::find(&["iverilog"]), tools::find(&["vvp"])) else {
        return Err(EngineError::Failed("iverilog is not installed".to_owned()));
    };
    let arguments = ["-g2001", "-Wall", "-Wno-timescale", "-o", "bench.vvp", "design.v", "bench.v"];
    let compiled = tools::run(&iverilog, &arguments, folder.path(), b"", LIMIT)
        .map_err(EngineError::Failed)?;
    // The bench reads a table that may be longer than the rows; any other warning is about our text.
    if !compiled.is_success || compiled.stderr.contains("warning") {
        return Err(EngineError::Failed(format!("iverilog: {}", compiled.stderr.trim())));
    }
    let run = tools::run(&vvp, &["-n", "bench.vvp"], folder.path(), b"", LIMIT)
        .map_err(EngineError::Failed)?;
    if !run.is_success {
        return Err(EngineError::Failed(format!("vvp: {} {}", run.ending, run.stderr.trim())));
    }
    Ok(run.stdout)
}

#[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
fn write(folder: &std::path::Path, name: &str, text: &str) -> std::io::Result<()> {
    fs::write(folder.join(name), text)
}

fn trace(
    net: &Net,
    shown: &[&Named],
    rows: &[InputRow],
    output: &[u8],
) -> Result<Trace, EngineError> {
    let mut trace = Trace::new(TraceLayout::of(net));
    let mut lines = output
        .split(|byte| *byte == b'\n')
        .filter(|line| line.first().is_some_and(|c| b"01xz".contains(c)));
    let first = InputRow { dt: 0, ..InputRow::zero(net) };
    for (at, input) in std::iter::once(&first).chain(rows).enumerate() {
        let Some(line) = lines.next() else {
            // A reaction that does not end is a difference: the trace has no more rows.
            if output.split(|byte| *byte == b'\n').any(|line| line == STILL_BUSY.as_bytes()) {
                return Ok(trace);
            }
            let why = format!("vvp printed {at} of {} rows", rows.len() + 1);
            return Err(EngineError::Failed(why));
        };
        let row = row(net, shown, input, line)
            .map_err(|why| EngineError::Failed(format!("row {at}: {why}")))?;
        let cells = trace.layout.row(&row);
        trace.push(cells);
    }
    Ok(trace)
}

fn row(net: &Net, shown: &[&Named], input: &InputRow, bits: &[u8]) -> Result<Row, String> {
    let mut row = Row::zero(net);
    row.dt = input.dt;
    row.inputs.clone_from(&input.values);
    let mut outputs: BTreeMap<usize, u64> = BTreeMap::new();
    let mut vars: BTreeMap<(usize, u32), u64> = BTreeMap::new();
    let mut states: BTreeMap<Origin, bool> = BTreeMap::new();
    for (named, bit) in shown.iter().zip(bits) {
        let is_one = match bit {
            b'0' => false,
            b'1' => true,
            _ => return Err(format!("{} is {}", named.name, char::from(*bit))),
        };
        match &named.object {
            Object::Output(pin) => match pin.role {
                PinRole::Output(id, bit) => {
                    *outputs.entry(id.index()).or_default() |= u64::from(is_one) << bit.min(63)
                }
                PinRole::Fault => row.fault |= is_one,
                _ => {}
            },
            Object::Flop(flop) => {
                let Some(holds) = flop.holds else { continue };
                let is_one = is_one != holds.inverted;
                if let Origin::Step(_) | Origin::Region(_) = holds.origin {
                    states.insert(holds.origin, is_one);
                } else if let Origin::Var(var) = holds.origin {
                    *vars.entry((var.index(), holds.element)).or_default() |=
                        u64::from(is_one) << holds.bit.min(63);
                }
            }
            Object::Clock | Object::Reset | Object::Input(_) | Object::Buried => {}
        }
    }
    for (step, bits) in shown_by(net, |origin| states.contains_key(&origin)).iter() {
        if !bits.is_empty() && bits.iter().all(|bit| states.get(bit) == Some(&true)) {
            row.steps.push(step);
        }
    }
    let mut place = 0;
    for (id, var) in net.vars.iter() {
        for element in 0..var.len.unwrap_or(1) {
            let code = vars.get(&(id.index(), element)).copied().unwrap_or(0);
            row.vars[place] = var.ty.bounds().0.saturating_add_unsigned(code);
            if let Some((output, _)) = net
                .outputs
                .iter()
                .find(|(_, output)| matches!(output.driver, Driver::Stored(driver) if driver == id))
            {
                row.outputs[output.index()] = row.vars[place];
            }
            place += 1;
        }
    }
    for (id, output) in net.outputs.iter() {
        let code = outputs.get(&id.index()).copied().unwrap_or(0);
        row.outputs[id.index()] = output.ty.bounds().0.saturating_add_unsigned(code);
        if output.is_extern() {
            row.effects.extend((0..code).map(|_| Effect::Call(id, Vec::new())));
        }
    }
    Ok(row)
}
