//! Tests of the reader and the printer of C, in one program.
