//! A self-checking test bench in Verilog.
//!
//! Each row is one call of a task: it applies the inputs, samples `mealy` outputs, clocks, and compares all outputs and the known flip-flops. The bench
//! prints one line for each difference and ends with `PASS` or `FAIL`; with `+trace` on the simulator's command line it also prints every row's bits:
//! `row OUTPUTS FLIPFLOPS`, first output and first flip-flop leftmost. If a reaction may take several clocks, the task clears events and tick
//! after the first clock and clocks until `busy` is 0, or for the maximum number of clocks; in the latter case the comparison fails.

use crate::netlist::Netlist;
use crate::vectors::Vectors;
use grafsynth_ir::logic::Logic;
use std::fmt::Write;

pub(crate) fn write(logic: &Logic, netlist: &Netlist, vectors: &Vectors) -> String {
    let title = &netlist.title;
    let inputs: Vec<&str> = netlist.inputs.values().map(String::as_str).collect();
    let outputs: Vec<&str> = netlist.outputs.values().map(String::as_str).collect();
    let flops: Vec<String> = netlist.flops.values().map(|name| format!("dut.{name}")).collect();
    // A vector has at least one bit, even without inputs.
    let (n_in, n_out, n_flop) = (inputs.len().max(1), outputs.len().max(1), flops.len().max(1));
    let mut text = String::new();
    let mut line = |line: String| {
        text.push_str(&line);
        text.push('\n');
    };
    line(format!(
        "// Test bench of {title}: {} rows; row 0 is the state after power-up.",
        vectors.rows.len()
    ));
    line("`timescale 1ns / 1ps".to_owned());
    line(format!("module {title}_tb;"));
    line("    reg tb_clock = 1'b0;".to_owned());
    line(format!("    reg [0:{}] tb_in = 0;", n_in - 1));
    line(format!("    wire [0:{}] tb_out;", n_out - 1));
    line(format!("    wire [0:{}] tb_flops;", n_flop - 1));
    line(format!("    reg [0:{}] tb_seen;", n_out - 1));
    line("    integer tb_row = 0;".to_owned());
    line("    integer tb_errors = 0;".to_owned());
    if vectors.busy.is_some() {
        line("    integer tb_clocks = 0;".to_owned());
    }
    line("    reg tb_trace;".to_owned());
    let mut ports: Vec<String> = Vec::new();
    ports.extend(netlist.clock.iter().map(|name| format!(".{name}(tb_clock)")));
    ports.extend(netlist.reset.iter().map(|reset| format!(".{}(1'b0)", reset.name)));
    ports.extend(inputs.iter().enumerate().map(|(index, name)| format!(".{name}(tb_in[{index}])")));
    ports.extend(
        outputs.iter().enumerate().map(|(index, name)| format!(".{name}(tb_out[{index}])")),
    );
    line(format!("    {title} dut (\n        {}\n    );", ports.join(",\n        ")));
    if outputs.is_empty() {
        line("    assign tb_out = 1'b0;".to_owned());
    }
    if flops.is_empty() {
        line("    assign tb_flops = 1'b0;".to_owned());
    } else {
        line(format!("    assign tb_flops = {{{}}};", flops.join(", ")));
    }
    let mealy: String = bits(logic.outputs.values().map(|output| output.mealy), n_out);
    line(String::new());
    line("    task row;".to_owned());
    line(format!("        input [0:{}] in;", n_in - 1));
    line(format!("        input [0:{}] want;", n_out - 1));
    line(format!("        input [0:{}] known;", n_out - 1));
    line(format!("        input [0:{}] held;", n_flop - 1));
    line(format!("        input [0:{}] known_held;", n_flop - 1));
    line("        begin".to_owned());
    line("            tb_in = in;".to_owned());
    line("            #5 tb_seen = tb_out;".to_owned());
    if netlist.clock.is_some() {
        line("            if (tb_row > 0) tb_clock = 1'b1;".to_owned());
    }
    if let Some(busy) = vectors.busy {
        let pulses = bits(vectors.pulses.iter().copied(), n_in);
        let most = vectors.most_clocks.min(u64::from(u32::MAX >> 1));
        line("            #1 tb_clocks = 1;".to_owned());
        line(format!("            if (tb_out[{busy}] === 1'b1) tb_in = in & ~{n_in}'b{pulses};"));
        line(format!("            while (tb_out[{busy}] === 1'b1 && tb_clocks < {most}) begin"));
        line("                #4 tb_clock = 1'b0;".to_owned());
        line("                #5 tb_clock = 1'b1;".to_owned());
        line("                #1 tb_clocks = tb_clocks + 1;".to_owned());
        line("            end".to_owned());
    }
    line(format!(
        "            #1 tb_seen = (tb_seen & {n_out}'b{mealy}) | (tb_out & ~{n_out}'b{mealy});"
    ));
    line("            if (((tb_seen ^ want) & known) !== 0 || ((tb_flops ^ held) & known_held) !== 0) begin".to_owned());
    line("                tb_errors = tb_errors + 1;".to_owned());
    line("                $display(\"row %0d: in %b gives out %b state %b, expected out %b state %b\",".to_owned());
    let shown = if vectors.busy.is_some() { "in" } else { "tb_in" };
    line(format!("                         tb_row, {shown}, tb_seen, tb_flops, want, held);"));
    line("            end".to_owned());
    line("            if (tb_trace) $display(\"row %b %b\", tb_seen, tb_flops);".to_owned());
    line("            #4 tb_clock = 1'b0;".to_owned());
    line("            tb_row = tb_row + 1;".to_owned());
    line("        end".to_owned());
    line("    endtask".to_owned());
    line(String::new());
    line("    initial begin".to_owned());
    line("        tb_trace = $test$plusargs(\"trace\");".to_owned());
    for row in &vectors.rows {
        let held = |index: usize| row.flops.get(index).copied().flatten();
        let mut call = String::from("        row(");
        let fields = [
            (n_in, bits(row.inputs.iter().copied(), n_in)),
            (n_out, bits(row.outputs.iter().map(|value| value.unwrap_or(false)), n_out)),
            (n_out, bits(row.outputs.iter().map(Option::is_some), n_out)),
            (n_flop, bits((0..flops.len()).map(|index| held(index).unwrap_or(false)), n_flop)),
            (n_flop, bits((0..flops.len()).map(|index| held(index).is_some()), n_flop)),
        ];
        for (index, (width, digits)) in fields.iter().enumerate() {
            let comma = if index == 0 { "" } else { ", " };
            // Writing to a string cannot fail.
            let _ = write!(call, "{comma}{width}'b{digits}");
        }
        call.push_str(");");
        line(call);
    }
    line("        if (tb_errors == 0) $display(\"PASS %0d rows\", tb_row);".to_owned());
    line("        else $display(\"FAIL %0d of %0d rows\", tb_errors, tb_row);".to_owned());
    line("        $finish;".to_owned());
    line("    end".to_owned());
    line("endmodule".to_owned());
    text
}

/// Binary digits, at least `width` of them.
fn bits(values: impl Iterator<Item = bool>, width: usize) -> String {
    let mut digits: String = values.map(|value| if value { '1' } else { '0' }).collect();
    while digits.len() < width {
        digits.push('0');
    }
    digits
}
