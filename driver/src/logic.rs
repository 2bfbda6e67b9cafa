//! Imported logic as a design, and the names of its columns; [`crate::judge`] compares it with a chart or with other logic.
//!
//! A circuit has no steps and no declared variables, so it gets an [`interface`]: a net with its inputs, its outputs and, as variables, its flip-flops, which
//! is used to read stimuli and to write traces. The interface itself has no behaviour; only the circuit does.

use grafsynth_backend_pld::codes::{TAKEN_AS, UNSUPPORTED};
use grafsynth_backend_pld::fuse::{FuseMap, Role};
use grafsynth_backend_pld::placement::Placement;
use grafsynth_backend_pld::read::Text;
use grafsynth_ir::Gather;
use grafsynth_ir::diag::Severity;
use grafsynth_ir::expr::Type;
use grafsynth_ir::logic::{FlopBit, Logic, PinRole};
use grafsynth_ir::net::{Driver, Input, InputKind, Net, Output, Part, Var, VarOrigin};
use grafsynth_ir::program::Origin;
use grafsynth_ir::span::{Name, Span};
use grafsynth_ir::{Diagnostic, Valid, validate};
use std::collections::BTreeSet;

/// Logic without a chart: the meaning of names is unknown.
#[derive(Debug, Clone)]
pub struct LogicDesign {
    /// The circuit, with the roles of [`LogicDesign::interface`]; `None` if it is not driven by a single clock.
    pub logic: Option<Logic>,
    /// Why there is no circuit (errors), or how the text was simplified (warnings).
    pub beyond: Vec<Diagnostic>,
    /// Its macrocells as written, or why the text does not define fuses.
    pub placement: Result<Placement, Vec<Diagnostic>>,
    /// The columns of stimuli and traces.
    pub interface: Valid<Net>,
    /// The fuses that it was read from; it is then simulated fuse by fuse.
    pub fuses: Option<Fuses>,
}

/// An imported fuse map.
#[derive(Debug, Clone)]
pub struct Fuses {
    /// The fuse map.
    pub map: FuseMap,
    /// Inputs, outputs and flip-flops, with the roles of [`LogicDesign::interface`].
    pub parts: Logic,
    /// The pin of each part.
    pub roles: Vec<Role>,
    /// The number of test vectors in the file.
    pub n_vectors: usize,
    /// The number of test vectors that the fuses fail.
    pub n_failed: usize,
}

impl LogicDesign {
    /// A design from a text that was read without errors.
    ///
    /// # Errors
    /// Its pins cannot be columns.
    pub fn of_text(text: Text) -> Result<Self, Vec<Diagnostic>> {
        Self::new(text.logic, text.beyond, text.placement)
    }

    /// A design of a circuit, a placement, or both.
    ///
    /// # Errors
    /// Its pins cannot be columns.
    pub fn new(
        mut logic: Option<Logic>,
        beyond: Vec<Diagnostic>,
        placement: Result<Placement, Vec<Diagnostic>>,
    ) -> Result<Self, Vec<Diagnostic>> {
        let mut none = Logic::default();
        let interface = validate(interface(logic.as_mut().unwrap_or(&mut none)))?;
        Ok(LogicDesign { logic, beyond, placement, interface, fuses: None })
    }

    /// The circuit.
    ///
    /// # Errors
    /// The reasons why there is no circuit.
    pub fn circuit(&self) -> Result<&Logic, Vec<Diagnostic>> {
        self.logic.as_ref().ok_or_else(|| {
            if self.beyond.is_empty() {
                let message = "this text is not a circuit with one clock";
                return vec![Diagnostic::error(UNSUPPORTED, message)];
            }
            self.beyond.clone()
        })
    }

    /// The findings about a design that is read but perhaps not run. If it can still be programmed as written, parts that do not fit a circuit with one clock
    /// are not errors.
    #[must_use]
    pub fn remarks(&self) -> Vec<Diagnostic> {
        let soften = |finding: &Diagnostic| {
            let mut finding = finding.clone();
            if self.placement.is_ok() && finding.severity == Severity::Error {
                finding.severity = Severity::Warning;
                finding.code = TAKEN_AS;
                let how = if self.fuses.is_some() {
                    "the design is simulated fuse by fuse but not proved"
                } else {
                    "the design can be burned as written but not simulated"
                };
                finding.message = format!("{}; {how}", finding.message);
                if let Some(plural) = &mut finding.plural {
                    plural.after = format!("{}; {how}", plural.after);
                }
            }
            finding
        };
        self.beyond.iter().map(soften).collect()
    }
}

/// Characters that a column name cannot have.
fn is_odd(c: char) -> bool {
    c.is_whitespace() || c.is_control() || ",;\"'`#()[]{}".contains(c)
}

/// A net with the columns of a circuit: its inputs, its outputs, and as variables the flip-flops without an output of the same name. The circuit's pins
/// and flip-flops get the roles of that net.
#[must_use]
pub fn interface(logic: &mut Logic) -> Net {
    let mut taken: BTreeSet<String> =
        ["dt", "scan", "steps", "fault"].iter().map(|name| (*name).to_owned()).gather();
    let mut name = |wanted: &str, span: Span| {
        let plain: String = wanted.chars().map(|c| if is_odd(c) { '_' } else { c }).collect();
        let plain = if plain.is_empty() { "_".to_owned() } else { plain };
        let mut own = plain.clone();
        let mut count = 1;
        while !taken.insert(own.clone()) {
            count += 1;
            own = format!("{plain}_{count}");
        }
        Name::new(own, span)
    };
    let mut net = Net { name: logic.name.clone(), ..Net::default() };
    let title = if logic.name.text.is_empty() { "logic" } else { logic.name.text.as_str() };
    net.name.text = title.chars().map(|c| if is_odd(c) { '_' } else { c }).collect();
    net.parts.push(Part { name: net.name.clone(), level: 1, ..Part::default() });
    for id in logic.inputs.ids() {
        let input = &mut logic.inputs[id];
        let column = net.inputs.push(Input {
            name: name(&input.name, input.meta.span),
            ty: Type::Bool,
            kind: InputKind::Pin,
            synchronous: false,
            meta: input.meta.clone(),
        });
        input.role = PinRole::Input(column, 0);
    }
    for id in logic.outputs.ids() {
        let output = &mut logic.outputs[id];
        let column = net.outputs.push(Output {
            safe: None,
            name: name(&output.name, output.meta.span),
            ty: Type::Bool,
            driver: Driver::Continuous(Vec::new()),
            registered: false,
            meta: output.meta.clone(),
        });
        output.role = PinRole::Output(column, 0);
    }
    let shown: BTreeSet<String> = logic.outputs.values().map(|output| output.name.clone()).gather();
    for id in logic.flops.ids() {
        let flop = &mut logic.flops[id];
        flop.holds = None;
        if shown.contains(&flop.name) {
            continue;
        }
        let column = net.vars.push(Var {
            name: name(&flop.name, flop.meta.span),
            ty: Type::Bool,
            len: None,
            init: vec![i64::from(flop.init)],
            origin: VarOrigin::Declared,
            meta: flop.meta.clone(),
        });
        flop.holds =
            Some(FlopBit { origin: Origin::Var(column), element: 0, bit: 0, inverted: false });
    }
    net
}
