// run: convert {} {out}/nothing.pds
// A circuit without outputs has no equation to write.
module nothing(input wire a);
endmodule
