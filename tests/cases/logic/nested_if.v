// run: compare {} nested_if_flat.v
// A branch of an inner `if` that does not assign a signal keeps the value assigned before the outer one. `&&` and `||` bind less tightly than `&`, `^` and `|`.
module nested_if(input clk, input a, input b, input c, output reg q, output y, output z);
  reg p;
  initial begin q = 0; p = 0; end
  always @(posedge clk) begin
    q <= a;
    if (b) begin
      p <= a;
      if (c) q <= 1'b0;
      else if (a) begin p <= 1'b1; if (q) p <= c; end
    end
  end
  assign y = a | b && c ^ p;
  assign z = a || b & c || !p && a ^ b;
endmodule
