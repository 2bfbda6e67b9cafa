// run: compare {} letter_case_same.v
// A file is equal to itself; `y` of another text refers to `Y` if no other signal matches.
module letter_case_same(input a, input A, output y, output Y);
  assign y = A & ~a;
  assign Y = ~a;
endmodule
