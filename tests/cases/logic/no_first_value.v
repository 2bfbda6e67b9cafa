// run: check {}
// Registers without an initial value are undefined after power-up; they are read as 0, and a finding reports this.
module no_first_value(input clk, input a, output reg q);
  reg p;
  always @(posedge clk) begin q <= p ^ a; p <= q; end
endmodule
