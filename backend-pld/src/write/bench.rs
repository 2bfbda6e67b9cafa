//! A self-checking test bench in Verilog.
//!
//! Each row is one call of a task: it applies the inputs, samples `mealy` outputs, clocks, and compares all outputs and the known flip-flops. The bench
//! prints one line for each difference and ends with `PASS` or `FAIL`; with `+trace` on the simulator's command line it also prints every row's bits:
//! `row OUTPUTS FLIPFLOPS`, first output and first flip-flop leftmost. If a reaction may take several clocks, the task clears events and tick
//! after the first clock and clocks until `busy` is 0, or for the maximum number of clocks; in the latter case the comparison fails.

use crate::netlist::Netlist;
use crate::vectors::Vectors;
use grafsynth_ir::logic::Logic;
use itertools::Itertools as _;

pub(crate) fn write(logic: &Logic, netlist: &Netlist, vectors: &Vectors) -> String {
    let title = &netlist.title;
    let (n_in, n_out, n_flop) = widths(netlist);
    let mut text = format!(
        "// Test bench of {title}: {} rows; row 0 is the state after power-up.\n`timescale 1ns / 1ps\nmodule {title}_tb;\n",
        vectors.rows.len()
    );
    text += &declarations(netlist, vectors);
    text += &task(logic, netlist, vectors);
    text += "
    initial begin
        tb_trace = $test$plusargs(\"trace\");
";
    for row in &vectors.rows {
        let held = |index: usize| row.flops.get(index).copied().flatten();
        let n_held = netlist.flops.len();
        let fields = [
            (n_in, bits(row.inputs.iter().copied(), n_in)),
            (n_out, bits(row.outputs.iter().map(|value| value.unwrap_or(false)), n_out)),
            (n_out, bits(row.outputs.iter().map(Option::is_some), n_out)),
            (n_flop, bits((0..n_held).map(|index| held(index).unwrap_or(false)), n_flop)),
            (n_flop, bits((0..n_held).map(|index| held(index).is_some()), n_flop)),
        ];
        let fields = fields.iter().map(|(width, digits)| format!("{width}'b{digits}")).join(", ");
        text += &format!("        row({fields});\n");
    }
    text += "        if (tb_errors == 0) $display(\"PASS %0d rows\", tb_row);
        else $display(\"FAIL %0d of %0d rows\", tb_errors, tb_row);
        $finish;
    end
endmodule
";
    text
}

/// The widths of the vectors of inputs, outputs and flip-flops: a vector has at least one bit, even without inputs.
fn widths(netlist: &Netlist) -> (usize, usize, usize) {
    let Netlist { inputs, outputs, flops, .. } = netlist;
    (inputs.len().max(1), outputs.len().max(1), flops.len().max(1))
}

/// The variables of the bench, and the circuit with its connections.
fn declarations(netlist: &Netlist, vectors: &Vectors) -> String {
    let title = &netlist.title;
    let (n_in, n_out, n_flop) = widths(netlist);
    let clocks = if vectors.busy.is_some() { "    integer tb_clocks = 0;\n" } else { "" };
    let clock = netlist.clock.iter().map(|name| format!(".{name}(tb_clock)"));
    let reset = netlist.reset.iter().map(|reset| format!(".{}(1'b0)", reset.name));
    let inputs = netlist.inputs.values().enumerate();
    let inputs = inputs.map(|(index, name)| format!(".{name}(tb_in[{index}])"));
    let outputs = netlist.outputs.values().enumerate();
    let outputs = outputs.map(|(index, name)| format!(".{name}(tb_out[{index}])"));
    let ports = clock.chain(reset).chain(inputs).chain(outputs).join(",\n        ");
    let no_outputs = if netlist.outputs.is_empty() { "    assign tb_out = 1'b0;\n" } else { "" };
    let flops = netlist.flops.values().map(|name| format!("dut.{name}")).join(", ");
    let flops = if flops.is_empty() { "1'b0".to_owned() } else { format!("{{{flops}}}") };
    format!(
        "    reg tb_clock = 1'b0;
    reg [0:{}] tb_in = 0;
    wire [0:{}] tb_out;
    wire [0:{}] tb_flops;
    reg [0:{}] tb_seen;
    integer tb_row = 0;
    integer tb_errors = 0;
{clocks}    reg tb_trace;
    {title} dut (
        {ports}
    );
{no_outputs}    assign tb_flops = {flops};
",
        n_in - 1,
        n_out - 1,
        n_flop - 1,
        n_out - 1
    )
}

/// The task that runs a row.
fn task(logic: &Logic, netlist: &Netlist, vectors: &Vectors) -> String {
    let (n_in, n_out, n_flop) = widths(netlist);
    let (in_, out, flop) = (n_in - 1, n_out - 1, n_flop - 1);
    let mealy: String = bits(logic.outputs.values().map(|output| output.mealy), n_out);
    let mut text = format!(
        "
    task row;
        input [0:{in_}] in;
        input [0:{out}] want;
        input [0:{out}] known;
        input [0:{flop}] held;
        input [0:{flop}] known_held;
        begin
            tb_in = in;
            #5 tb_seen = tb_out;
"
    );
    if netlist.clock.is_some() {
        text += "            if (tb_row > 0) tb_clock = 1'b1;\n";
    }
    if let Some(busy) = vectors.busy {
        let pulses = bits(vectors.pulses.iter().copied(), n_in);
        let most = vectors.most_clocks.min(u64::from(u32::MAX >> 1));
        text += &format!(
            "            #1 tb_clocks = 1;
            if (tb_out[{busy}] === 1'b1) tb_in = in & ~{n_in}'b{pulses};
            while (tb_out[{busy}] === 1'b1 && tb_clocks < {most}) begin
                #4 tb_clock = 1'b0;
                #5 tb_clock = 1'b1;
                #1 tb_clocks = tb_clocks + 1;
            end
"
        );
    }
    let shown = if vectors.busy.is_some() { "in" } else { "tb_in" };
    text += &format!(
        "            #1 tb_seen = (tb_seen & {n_out}'b{mealy}) | (tb_out & ~{n_out}'b{mealy});
            if (((tb_seen ^ want) & known) !== 0 || ((tb_flops ^ held) & known_held) !== 0) begin
                tb_errors = tb_errors + 1;
                $display(\"row %0d: in %b gives out %b state %b, expected out %b state %b\",
                         tb_row, {shown}, tb_seen, tb_flops, want, held);
            end
            if (tb_trace) $display(\"row %b %b\", tb_seen, tb_flops);
            #4 tb_clock = 1'b0;
            tb_row = tb_row + 1;
        end
    endtask
"
    );
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
