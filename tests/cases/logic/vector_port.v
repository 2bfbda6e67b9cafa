// run: check {}
// A port with several bits and the use of one of them: no further findings.
module vector_port(input clk, input [1:0] a, output reg y);
  initial y = 1'b0;
  always @(posedge clk) y <= a[0];
endmodule
