// run: check
// Registers that are assigned one after the other, as in a program.
module shift(input clk, input d, output reg a, output reg b);
  initial begin a = 0; b = 0; end
  always @(posedge clk) begin
    a = d;
    b = a;
  end
endmodule
