//! Logic to equations and Verilog, and back
