module nested_if_flat(input clk, input a, input b, input c, output reg q, output y, output z);
  reg p;
  initial begin q = 0; p = 0; end
  always @(posedge clk) begin
    q <= b ? (c ? 1'b0 : a) : a;
    p <= b ? (c ? a : (a ? (q ? c : 1'b1) : a)) : p;
  end
  assign y = (a | b) & (c ^ p);
  assign z = a | (b & c) | (~p & (a ^ b));
endmodule
