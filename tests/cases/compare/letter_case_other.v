module letter_case_other(input a, input A, output y, output Y);
  assign y = A;
  assign Y = a;
endmodule
