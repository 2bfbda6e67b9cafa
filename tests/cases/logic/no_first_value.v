// run: check {}
// Registers without a first value hold anything after power-up; they are taken as 0, and that is said.
module no_first_value(input clk, input a, output reg q);
  reg p;
  always @(posedge clk) begin q <= p ^ a; p <= q; end
endmodule
