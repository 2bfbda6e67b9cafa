// run: compare {} gated_clock_chart.graf
// A register whose clock is a signal of the circuit, or a second one, is not a synchronous circuit: it was read as if the clock came from outside, and called equal.
module gated_clock (
    input wire clk,
    input wire a,
    output wire Q
);
    reg on = 1'b0;
    wire enable = a & ~on;

    always @(posedge enable) begin
        on <= a;
    end

    assign Q = on;
endmodule
