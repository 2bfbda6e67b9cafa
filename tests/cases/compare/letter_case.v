// run: compare {} letter_case_other.v
// Verilog distinguishes `y` from `Y`: the two files differ in `Y`.
module letter_case(input a, input A, output y, output Y);
  assign y = A;
  assign Y = ~a;
endmodule
