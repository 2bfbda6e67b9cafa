//! Output in languages defined by the user: a stable JSON of a net ([`json`]), and templates that are rendered over it ([`render`]).
//!
//! The JSON contains the net (steps, transitions, conditions as trees) and, ready to be printed statement by statement, the program of one reaction
//! (`grafsynth_ir::lower::program`): a template that prints it computes exactly the reaction of the chart. `docs/net-json.md` and `docs/templates.md` describe
//! both for users.
//!
//! ```
//! use grafsynth_backend_template::{Template, json, render};
//! # let mut net = grafsynth_ir::net::Net::default();
//! # net.name = grafsynth_ir::span::Name::new("empty", Default::default());
//! # net.parts.push(grafsynth_ir::net::Part { name: net.name.clone(), level: 1, ..Default::default() });
//! let net = grafsynth_ir::validate(net).expect("a chart without steps is valid");
//! let template = Template { file: Default::default(), path: "hello.txt.j2", text: "{{ name }} has {{ steps|length }} steps\n" };
//! assert_eq!(render(&json(&net).expect("it has a program"), &template).expect("it has no error"), "empty has 0 steps\n");
//! ```
//!
//! The back ends of grafsynth itself are functions and use no template engine. Templates are untrusted text: their work is bounded
//! ([`FUEL`], [`MOST_TEXT`]), and errors in them are diagnostics.

pub mod codes;
mod json;
mod template;

pub use json::{FORMAT, VERSION, json, text};
pub use template::{FUEL, MOST_TEXT, Template, render};
