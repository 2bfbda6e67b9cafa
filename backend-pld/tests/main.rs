//! Tests that need more than the text of one module: files by others.

mod galasm_files;
