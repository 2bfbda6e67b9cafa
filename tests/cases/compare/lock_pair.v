// run: compare {} lock_wrong.v --trace {out}/lock.csv
// Two circuits that differ only after three particular clocks, which the proof finds.
module lock (
    input wire clk,
    input wire a,
    input wire b,
    input wire c,
    input wire d,
    input wire e,
    input wire f,
    input wire g,
    input wire h,
    output wire open
);
    reg zero = 1'b1;
    reg one = 1'b0;
    reg two = 1'b0;
    reg three = 1'b0;
    wire fire_zero_one = zero & a & c & d & f & h & ~b & ~e & ~g;
    wire fire_one_zero = one & ~(a & b & d & e & g & h & ~c & ~f);
    wire fire_one_two = one & a & b & d & e & g & h & ~c & ~f;
    wire fire_two_zero = two & ~(b & c & e & f & g & ~a & ~d & ~h);
    wire fire_two_three = two & b & c & e & f & g & ~a & ~d & ~h;
    wire fire_three_zero = three & a;

    always @(posedge clk) begin
        zero <= fire_one_zero | fire_two_zero | fire_three_zero | zero & ~fire_zero_one;
        one <= fire_zero_one | one & ~(fire_one_zero | fire_one_two);
        two <= fire_one_two | two & ~(fire_two_zero | fire_two_three);
        three <= fire_two_three | three & ~fire_three_zero;
    end

    assign open = three;
endmodule
