//! The styles of the emitted code: one row for each, with everything that the rest of grafsynth knows about it.
//!
//! A new style is a module that makes a [`StyleOutput`] from a [`Request`], a variant of [`Style`], and a row of `ROWS`. The command line, the lists
//! of targets and styles, and the tests that run over all styles read the rows.

use crate::refusal::{Failure, Refusal};
use crate::style_output::StyleOutput;
use crate::{Options, bits, codes, engine, names, statechart, switch};
use grafsynth_ir::Valid;
use grafsynth_ir::diag::{Code, Diagnostic};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;

/// The style of the emitted code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Style {
    /// The best style for the chart: `Switch`, with tables if they pay off, otherwise `Bits`. For a statechart, `Switch` uses a variable for each region.
    #[default]
    Auto,
    /// A `switch` over a state variable for each sequential component, never tables.
    Switch,
    /// Like `Switch`, with tables for all components that only wait for inputs, however small.
    Tables,
    /// One bit for each step, the whole reaction as straight-line code.
    Bits,
    /// The chart as an image that a fixed engine interprets: tables if they can express it, otherwise like `Program`.
    Engine,
    /// A statechart as the tables `BSTATE` and `BTRANS` of a published engine, with guards and actions as functions, and a fixed engine.
    Btrans,
    /// Like `Engine`, but always the reaction program as byte code, so that every chart can be loaded later.
    Program,
}

/// The properties of a style.
pub(crate) struct Row {
    style: Style,
    /// The name on the command line.
    name: &'static str,
    /// The code, in one line.
    about: &'static str,
    /// The target that always uses this style, and its description in one line.
    target: Option<(&'static str, &'static str)>,
    /// The engine that interprets the style's tables, if there is one.
    pub(crate) engine: Option<&'static str>,
    /// Whether the instance and its code can be loaded as an image.
    has_image: bool,
    /// Makes the code.
    pub(crate) emit: fn(&Request<'_>) -> Result<Emitted, Vec<Diagnostic>>,
}

/// The input of a style.
pub(crate) struct Request<'n> {
    pub(crate) net: &'n Valid<Net>,
    pub(crate) facts: &'n Facts,
    pub(crate) names: &'n names::Names,
    pub(crate) options: &'n Options,
}

/// The result of a style.
pub(crate) struct Emitted {
    pub(crate) program: StyleOutput,
    /// What the requested style does not support; empty if it was used.
    pub(crate) reason: String,
}

const ROWS: [Row; 7] = [
    Row {
        style: Style::Auto,
        name: "auto",
        about: "the best of switch, tables and bits for the chart (with --for: the cheapest on that machine)",
        target: None,
        engine: None,
        has_image: false,
        emit: components,
    },
    Row {
        style: Style::Switch,
        name: "switch",
        about: "a switch over a state variable for each sequential component",
        target: Some(("c-switch", "the same, always a switch over sequential components")),
        engine: None,
        has_image: false,
        emit: components,
    },
    Row {
        style: Style::Tables,
        name: "tables",
        about: "constant tables for each component that only waits for inputs",
        target: Some(("c-tables", "the same, components as constant tables if possible")),
        engine: None,
        has_image: false,
        emit: components,
    },
    Row {
        style: Style::Bits,
        name: "bits",
        about: "one bit per step, straight-line code",
        target: Some(("c-bits", "the same, always one bit for each step")),
        engine: None,
        has_image: false,
        emit: straight_line,
    },
    Row {
        style: Style::Engine,
        name: "engine",
        about: "an image of the chart that a fixed engine interprets",
        target: Some((
            "c-engine",
            "the same, as tables for an engine that is the same for all charts",
        )),
        engine: Some("the table engine"),
        has_image: true,
        emit: tables_or_program,
    },
    Row {
        style: Style::Btrans,
        name: "btrans",
        about: "statecharts: tables of states and of transitions sorted by event, with a fixed engine",
        target: Some((
            "c-btrans",
            "the same, a statechart as a table of states and a table of transitions sorted by event",
        )),
        engine: Some("the engine of states and transitions"),
        has_image: false,
        emit: states_and_transitions,
    },
    Row {
        style: Style::Program,
        name: "program",
        about: "byte code that a fixed engine interprets, for every kind of chart",
        target: Some((
            "c-program",
            "the same, as byte code for an engine; supports every kind of chart",
        )),
        engine: Some("the program engine"),
        has_image: true,
        emit: byte_code,
    },
];

impl Style {
    /// All styles.
    pub const ALL: [Style; ROWS.len()] = {
        let mut all = [Style::Auto; ROWS.len()];
        let mut at = 0;
        while at < ROWS.len() {
            all[at] = ROWS[at].style;
            at += 1;
        }
        all
    };

    pub(crate) fn row(self) -> &'static Row {
        static TABLE: &[Row] = &ROWS;
        TABLE.iter().find(|row| row.style == self).unwrap_or(&TABLE[0])
    }

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// A description of the code, in one line.
    #[must_use]
    pub fn about(self) -> &'static str {
        self.row().about
    }

    /// The name and the description of the target that always uses this style, if there is one.
    #[must_use]
    pub fn target(self) -> Option<(&'static str, &'static str)> {
        self.row().target
    }

    /// Whether the chart can be written as an image that an engine loads.
    #[must_use]
    pub fn has_image(self) -> bool {
        self.row().has_image
    }

    /// The style with that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|style| style.name() == name)
    }
}

/// The error that a style reports for a construct that it does not support.
fn refused(code: Code, message: String, refusal: &Refusal, help: &str) -> Vec<Diagnostic> {
    vec![Diagnostic::error(code, message).at(refusal.span, "used here").help(help)]
}

fn used(program: StyleOutput) -> Result<Emitted, Vec<Diagnostic>> {
    Ok(Emitted { program, reason: String::new() })
}

fn straight_line(it: &Request<'_>) -> Result<Emitted, Vec<Diagnostic>> {
    used(bits::program(it.net, it.facts, it.names, it.options)?)
}

/// A variable for each component. If the style was not requested by name and does not support the chart, the result is straight-line code.
fn components(it: &Request<'_>) -> Result<Emitted, Vec<Diagnostic>> {
    let program = if it.net.settings.policy.is_statechart() {
        statechart::program(it.net, it.facts, it.names, it.options)
    } else {
        switch::program(it.net, it.facts, it.names, it.options)
    };
    match program {
        Ok(program) => used(program),
        Err(Failure::Errors(errors)) => Err(errors),
        Err(Failure::Refused(refusal)) if it.options.style == Style::Auto => {
            Ok(Emitted { reason: refusal.what, ..straight_line(it)? })
        }
        Err(Failure::Refused(refusal)) => {
            let style = it.options.style.name();
            let message = format!("the style `{style}` does not support {}", refusal.what);
            let help = "build it as `c` without `--style`, which chooses a style that supports the chart, or as `c-bits`";
            Err(refused(codes::STYLE_REFUSED, message, &refusal, help))
        }
    }
}

fn states_and_transitions(it: &Request<'_>) -> Result<Emitted, Vec<Diagnostic>> {
    match engine::btrans::program(it.net, it.names, it.options) {
        Ok(program) => used(program),
        Err(refusal) => {
            let message =
                format!("the tables of states and transitions do not support {}", refusal.what);
            Err(refused(codes::BTRANS_REFUSED, message, &refusal, "build it as `c` or `c-engine`"))
        }
    }
}

fn tables_or_program(it: &Request<'_>) -> Result<Emitted, Vec<Diagnostic>> {
    match engine::program(it.net, it.names, it.options) {
        Ok(program) => used(program),
        Err(refusal) => Ok(Emitted { reason: refusal.what, ..byte_code(it)? }),
    }
}

fn byte_code(it: &Request<'_>) -> Result<Emitted, Vec<Diagnostic>> {
    match engine::program::program(it.net, it.facts, it.names, it.options) {
        Ok(program) => Ok(Emitted { program, reason: "requested".to_owned() }),
        Err(Failure::Errors(errors)) => Err(errors),
        Err(Failure::Refused(refusal)) => {
            let message = format!("no engine supports {}", refusal.what);
            let help = "build it as `c`, which is compiled instead of interpreted";
            Err(refused(codes::ENGINE_REFUSED, message, &refusal, help))
        }
    }
}
