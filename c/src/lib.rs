//! C99 as a typed tree: a parser, a printer, and an analysis of reads, writes and calls.
//!
//! ```
//! use grafsynth_c::{Config, Input, SourceFile, parse, print};
//! use grafsynth_ir::FileId;
//!
//! let text = "typedef struct { unsigned n; } t;\nvoid step(t *self) { (*self).n += (1); }\n";
//! let files = [SourceFile { file: FileId(0), name: "a.c", text }];
//! let (unit, found) = parse(&Input { files: &files, verbatim: &[], readers: &[], config: &Config::avr() });
//! let unit = unit.ok_or(found)?;
//! assert!(print(&unit).ends_with("void step(t *self)\n{\n    self->n += 1;\n}\n"));
//! # Ok::<(), Vec<grafsynth_ir::Diagnostic>>(())
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`tree`] | the tree, its types, and the constructors that type it |
//! | [`mod@parse`] | text to tree, written from the grammar of C99: the lexer, the preprocessor, the parser |
//! | [`mod@print`] | tree to text; reading it gives the same tree |
//! | [`uses`] | the reads, writes and calls of each function and symbol |
//! | [`order`] | expressions whose result would depend on the order of evaluation |
//!
//! This crate knows nothing about charts or emitted files. It depends on `ir` for locations, diagnostics, and the ids of net objects in [`tree::Marks`].

pub mod codes;
mod config;
pub mod order;
pub mod parse;
pub mod print;
mod storage;
pub mod tree;
pub mod uses;
pub mod walk;

pub use config::Config;
pub use parse::{Input, SourceFile, parse};
pub use print::print;
pub use storage::storage;
