//! Golden and differential runs over all engines, one program: it is linked once, and its tests share the processors to the end.
//!
//! Each module is one idea and says it in its first line; `cargo test -p grafsynth-tests styles::` runs one of them. What several need stands in the
//! library of this package.

mod arbiter;
mod busy;
mod c_random;
mod c_sources;
mod controllers;
mod drawn_again;
mod emergency;
mod engines;
mod facts;
mod frame;
mod hostile;
mod iec;
mod iec_round_trip;
mod interrupts;
mod jedec;
mod kiss2;
mod misra;
mod mutations;
mod open_cells;
mod packages;
mod program_vs_sim;
mod regions;
mod safe_state;
mod scxml;
mod simulator_laws;
mod strict;
mod structured_text;
mod styles;
mod table_engine;
mod templates;
mod trace_ring;
mod verilog_tools;
mod worst_case;
