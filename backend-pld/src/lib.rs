//! Converts logic to equations and Verilog, and back.
//!
//! ```text
//! Logic ── equations::Equations (names, polarity, products, pins) ──► PALASM  CUPL  GALasm
//!   │  └── netlist::Netlist (names, what becomes a wire) ───────────► Verilog  BLIF
//!   └────────────── read ◄───────────────────────────────────────────┘ (all five)
//! ```
//! All decisions are made before a writer runs; a writer only prints. The result of a reader has names but no roles: [`rebind`] restores those of the
//! emitted circuit, so that it can be proved equal to the net.
//!
//! ```
//! use grafsynth_backend_pld::{Dialect, EmitOptions, emit, read, rebind};
//! # use grafsynth_logic::build::Builder;
//! # let mut builder = Builder::default();
//! # let (q, value) = builder.flop_named("q", true);
//! # let enable = builder.input_named("enable");
//! # builder.logic.flops[q].next = builder.xor(value, enable);
//! # let logic = builder.finish();
//! let emitted = emit(&logic, Dialect::Palasm, &EmitOptions::default()).unwrap();
//! let (back, findings) = read(Dialect::Palasm, Default::default(), &emitted.text);
//! let mut back = back.unwrap();
//! assert!(findings.is_empty() && rebind(&mut back, &emitted).is_empty());
//! assert!(back.flops.values().next().unwrap().init, "powers up as wanted");
//! ```

pub mod codes;
pub mod device;
pub mod equations;
pub mod jedec;
pub mod netlist;
pub mod pla;
pub mod placement;
pub mod read;
pub mod reset;
pub mod synchronise;
pub mod vectors;

mod fit;
pub mod fuse;
pub mod ice40;
mod rebind;
#[cfg(test)]
mod tests;
mod write;

use equations::Equations;
pub use fit::{MovedBecause, MovedPin, RELIES, Refusal};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::span::{FileId, Span};
use grafsynth_logic::minimise::Budget;
pub use rebind::rebind;
use std::collections::BTreeMap;
use std::rc::Rc;
pub use vectors::Vectors;

/// The languages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Dialect {
    /// PALASM 2 and 4, `.pds`.
    Palasm,
    /// CUPL, `.pld`.
    Cupl,
    /// `GALasm` and galette, `.pld`.
    Galasm,
    /// Verilog-2001.
    Verilog,
    /// The Berkeley Logic Interchange Format.
    Blif,
}

impl Dialect {
    /// All languages.
    pub const ALL: [Dialect; 5] =
        [Dialect::Palasm, Dialect::Cupl, Dialect::Galasm, Dialect::Verilog, Dialect::Blif];

    /// Its name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Dialect::Palasm => "palasm",
            Dialect::Cupl => "cupl",
            Dialect::Galasm => "galasm",
            Dialect::Verilog => "verilog",
            Dialect::Blif => "blif",
        }
    }

    /// How a register is written in equations of the language.
    pub(crate) fn register(self, name: &str) -> String {
        match self {
            Dialect::Palasm => format!("`{name} := ..`"),
            Dialect::Cupl => format!("`{name}.D = ..`"),
            Dialect::Galasm => format!("`{name}.R = ..`"),
            Dialect::Verilog => format!("`{name} <= ..` in `always @(posedge ..)`"),
            Dialect::Blif => format!("`.latch` with the output `{name}`"),
        }
    }

    /// True for equations: sums of products, with pins. The other languages describe netlists.
    #[must_use]
    pub fn is_flat(self) -> bool {
        match self {
            Dialect::Palasm | Dialect::Cupl | Dialect::Galasm => true,
            Dialect::Verilog | Dialect::Blif => false,
        }
    }

    /// The usual file extension, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Dialect::Palasm => "pds",
            Dialect::Cupl | Dialect::Galasm => "pld",
            Dialect::Verilog => "v",
            Dialect::Blif => "blif",
        }
    }
}

/// The options of the writers.
#[derive(Debug, Clone, Default)]
pub struct EmitOptions {
    /// The device's name, such as `gal22v10`; `None` uses the default and states that in the text.
    pub device: Option<String>,
    /// Pin numbers by the source's names; the clock is `clock` or `clk`. Signals without a number get one if the design fits the device.
    pub pins: Vec<(String, u32)>,
    /// The location of the device's name, if a board names it: findings show it.
    pub device_span: Option<Span>,
    /// The locations of the names in [`pins`](EmitOptions::pins) that a board gives: findings show them.
    pub pin_spans: BTreeMap<String, Span>,
    /// Pins of an earlier build by the names in its text: signals keep their pins if that is still possible.
    pub keep: Vec<(String, u32)>,
    /// Test vectors: the SIMULATION section of PALASM, the test bench of Verilog.
    pub vectors: Option<Vectors>,
    /// Verilog: a reset input in addition to the initial values.
    pub reset: Option<Reset>,
    /// Equations: an input with this name that sets every register to its initial value at the next clock.
    pub reset_wire: Option<String>,
    /// Use the don't-cares of the circuit ([`Logic::never`], [`Logic::unreachable`], [`Logic::open`]): if the chart's assumptions are violated, the text
    /// then behaves differently.
    pub dont_cares: bool,
    /// The effort limit of the minimiser for one function.
    pub budget: Budget,
    /// Lines for the header of the text, such as the transitions of the chart.
    pub notes: Vec<String>,
}

/// A reset input, active high.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reset {
    /// Its name, converted to an identifier of the language.
    pub name: String,
    /// How it acts.
    pub style: ResetStyle,
}

/// How a reset acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ResetStyle {
    /// At the next clock edge.
    Synchronous,
    /// At once, without a clock.
    Asynchronous,
}

/// A text with its origins.
#[derive(Debug, Clone)]
pub struct Emitted {
    /// The language.
    pub dialect: Dialect,
    /// The text.
    pub text: String,
    /// A self-checking test bench in the same language, if requested.
    pub bench: Option<String>,
    /// The name given to each pin and flip-flop.
    pub names: Vec<Named>,
    /// The origin of each line.
    pub map: Vec<MapLine>,
    /// The equations that were printed; `None` for a netlist.
    pub equations: Option<Rc<Equations>>,
}

/// A name in the text and the object that it represents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// The name as printed.
    pub name: String,
    /// The pin number, if it has one.
    pub pin: Option<u32>,
    /// The object.
    pub object: Object,
    /// True if the pin of this flip-flop shows its complement: the power-up value requires it, or the output at the pin is the complement
    /// of the flip-flop.
    pub is_complement: bool,
}

/// The object that a name represents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Object {
    /// The clock.
    Clock,
    /// The reset that the text has in addition to the circuit.
    Reset,
    /// An input bit.
    Input(grafsynth_ir::logic::PinInput),
    /// A flip-flop; its `next` is not meaningful here.
    Flop(grafsynth_ir::logic::Flop),
    /// An output bit; its `value` is not meaningful here.
    Output(grafsynth_ir::logic::PinOutput),
    /// A part of a function that is too wide for one sum: a signal of the text only.
    Buried,
}

/// A line of the text with its origin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapLine {
    /// The line, from 1.
    pub line: u32,
    /// The source's name.
    pub name: String,
    /// Where it was declared.
    pub span: Span,
    /// Its requirement tags.
    pub req: Vec<String>,
}

/// Writes a circuit in one of the languages.
///
/// # Errors
/// If the language or the device does not support something, with the signal and the numbers.
pub fn emit(
    logic: &Logic,
    dialect: Dialect,
    options: &EmitOptions,
) -> Result<Emitted, Vec<Diagnostic>> {
    emit_from(None, logic, dialect, options)
}

/// Like [`emit`], with the equations of this circuit in this language if they were made before with these options, so that nothing is minimised again.
///
/// # Errors
/// Like [`emit`].
pub fn emit_from(
    known: Option<Rc<Equations>>,
    logic: &Logic,
    dialect: Dialect,
    options: &EmitOptions,
) -> Result<Emitted, Vec<Diagnostic>> {
    if let Some(vectors) = &options.vectors {
        vectors.check(logic)?;
    }
    if !dialect.is_flat() {
        return Ok(emit_netlist(logic, dialect, options));
    }
    if logic.outputs.is_empty() && logic.flops.is_empty() {
        return Err(vec![no_equation(logic, dialect)]);
    }
    let equations = match known.filter(|known| known.is_enough_for(dialect)) {
        Some(known) => known,
        None => Rc::new(Equations::new(logic, dialect, options)?),
    };
    let source = match dialect {
        Dialect::Palasm => write::palasm::write(&equations, options.vectors.as_ref()),
        Dialect::Cupl => write::cupl::write(&equations),
        Dialect::Galasm | Dialect::Verilog | Dialect::Blif => write::galasm::write(&equations),
    };
    Ok(Emitted {
        dialect,
        text: source.text,
        bench: None,
        names: equations.named(logic),
        map: source.map,
        equations: Some(equations),
    })
}

fn emit_netlist(logic: &Logic, dialect: Dialect, options: &EmitOptions) -> Emitted {
    let netlist = netlist::Netlist::new(logic, dialect, options);
    let source = if dialect == Dialect::Verilog {
        write::verilog::write(logic, &netlist)
    } else {
        write::blif::write(logic, &netlist)
    };
    let vectors = options.vectors.as_ref().filter(|_| dialect == Dialect::Verilog);
    Emitted {
        dialect,
        text: source.text,
        bench: vectors.map(|vectors| write::bench::write(logic, &netlist, vectors)),
        names: netlist.named(logic),
        map: source.map,
        equations: None,
    }
}

fn no_equation(logic: &Logic, dialect: Dialect) -> Diagnostic {
    let message = format!(
        "`{}` has no output and no flip-flop, so there is no equation to write in {}",
        logic.name.text,
        dialect.name()
    );
    let finding = Diagnostic::error(codes::NO_EQUATION, message)
        .help("add an output to the design, or convert it to `.v` or `.blif`, which need none");
    let span = logic.name.span;
    if span == Default::default() { finding } else { finding.at(span, "no output") }
}

/// The resources that the device of these options lacks for a circuit, whatever its sums are: found by counting, which is fast. `None` if counting
/// finds nothing.
#[must_use]
pub fn too_small(logic: &Logic, options: &EmitOptions) -> Option<String> {
    let device = match options.device.as_deref() {
        Some(name) => device::Device::find(name)?,
        None => device::Device::default_device(),
    };
    fit::lacks(logic, device, options)
}

/// Reads a circuit. Pins and flip-flops have no roles; power-up values follow from the device's rules if the language does not state them.
///
/// All findings of the text are reported at once; if one of them is an error, there is no circuit.
#[must_use]
pub fn read(dialect: Dialect, file: FileId, text: &str) -> (Option<Logic>, Vec<Diagnostic>) {
    let mut said = read::read(dialect, file, text);
    said.findings.append(&mut said.beyond);
    (said.logic, said.findings)
}

/// Reads the full contents of a text: the circuit, and the macrocells of a device as written.
#[must_use]
pub fn read_text(dialect: Dialect, file: FileId, text: &str) -> read::Text {
    read::read(dialect, file, text)
}
