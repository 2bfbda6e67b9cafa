//! Engines that run a design: in process, compiled C, Verilog simulators
