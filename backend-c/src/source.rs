//! `NAME.c`: the helpers that a chart calls, its functions, `NAME_init`, `NAME_step`, and the callbacks around it.

use crate::c::print::{Arm, Kind, Marks, Node, Writer};
use crate::cexpr::WIDE_FUNCTIONS;
use crate::gate;
use crate::header::{Layout, shown};
use crate::safe;
use crate::style_output::mentions;
use crate::{File, FileKind, Object};
use itertools::Itertools as _;

impl Layout<'_> {
    pub(crate) fn source(&self) -> (File, Marks) {
        let (prefix, upper, stem) = (&self.names.prefix, &self.names.upper, &self.names.stem);
        let i = self.interface;
        let mut nodes = vec![
            self.banner("the chart. Do not edit: it is regenerated from the chart."),
            Node::directive(format!("#include \"{stem}.h\"")),
            Node::directive(format!("#include \"{stem}_port.h\"")),
        ];
        if self.has_library {
            nodes.push(Node::directive(format!("#include \"{stem}_user.h\"")));
        }
        nodes.push(Node::blank());
        nodes.extend(self.program.tables.iter().cloned());
        if !self.program.tables.is_empty() {
            nodes.push(Node::blank());
        }
        self.helpers(&mut nodes);
        nodes.extend(self.program.functions.iter().cloned());
        let mut step = self.program.step.clone();
        if self.options.callbacks {
            self.notify(&mut nodes, &mut step);
        }
        let init = self.with_unused(self.program.init.clone(), false, false);
        nodes.push(Node::function(
            format!("void {prefix}_init({})", i.parameters(false, false)),
            init,
        ));
        nodes.push(Node::blank());
        if i.safe_state {
            step.insert(0, safe::guard(self.net, self.names));
        }
        let step = self.with_unused(step, true, true);
        if i.gate {
            nodes.extend(gate::functions(i, &gate::same(self.net, i), step));
        } else {
            let head = format!("void {prefix}_step({})", i.parameters(true, true));
            nodes.push(Node::function(head, step));
        }
        let _ = upper;
        let (text, map, marks) = Writer::write_marked(&nodes);
        (
            File {
                name: format!("{stem}.c"),
                text,
                keep_existing: false,
                map,
                kind: FileKind::Source,
            },
            marks,
        )
    }

    fn with_unused(&self, body: Vec<Node>, with_in: bool, with_dt: bool) -> Vec<Node> {
        let i = self.interface;
        let mut names = Vec::new();
        if i.has_instance {
            names.push("self");
        }
        if with_in && i.has_in {
            names.push("in");
        }
        if with_dt && i.ticks.is_some() {
            names.push("dt");
        }
        if i.has_out {
            names.push("out");
        }
        crate::style_output::with_unused(&names, body)
    }

    fn helpers(&self, nodes: &mut Vec<Node>) {
        let prefix = &self.names.prefix;
        for (slot, width, ty) in [(0, 16, "int"), (1, 32, "int32_t"), (2, 64, "int64_t")] {
            if self.program.helpers.clamp[slot] && self.calls(&format!("{prefix}_clamp{width}")) {
                nodes.push(Node::comment("The value, or the nearest bound."));
                nodes.push(Node::function(
                    format!("static {ty} {prefix}_clamp{width}({ty} value, {ty} lo, {ty} hi)"),
                    vec![Node::line("return (value < lo) ? lo : ((value > hi) ? hi : value);")],
                ));
                nodes.push(Node::blank());
            }
        }
        self.wide_functions(nodes);
        let later = self.program.helpers.later && self.calls(&format!("{prefix}_later"));
        if let (true, Some(ticks)) = (later, self.interface.ticks) {
            let ty = ticks.name();
            nodes.push(Node::comment("A timer dt ticks later; it stops at its maximum."));
            nodes.push(Node::function(
                format!("static {ty} {prefix}_later({ty} time, {ty} dt, {ty} cap)"),
                vec![Node::line(format!(
                    "return (dt < ({ty})(cap - time)) ? ({ty})(time + dt) : cap;"
                ))],
            ));
            nodes.push(Node::blank());
        }
    }

    /// Writes the functions for products and quotients of 64 bits. sdcc for the 8051 adds, shifts and compares such numbers, but its library lacks these
    /// operations.
    fn wide_functions(&self, nodes: &mut Vec<Node>) {
        let prefix = &self.names.prefix;
        let [product, quotient, rest] = WIDE_FUNCTIONS.map(|word| format!("{prefix}_{word}"));
        if self.calls(&quotient) || self.calls(&rest) {
            nodes.push(Node::directive("#if defined(__SDCC_mcs51)"));
            nodes.extend(self.long_division());
            nodes.push(Node::directive("#endif"));
            nodes.push(Node::blank());
        }
        let product_body = vec![
            Node::line("uint64_t x = (uint64_t)a;"),
            Node::line("uint64_t y = (uint64_t)b;"),
            Node::line("uint64_t sum = 0U;"),
            // y loses one bit in each round.
            Kind::Block(vec![
                Arm::new(
                    "while (y != 0U)",
                    vec![
                        Node::when("(y & 1U) != 0U", vec![Node::line("sum += x;")]),
                        Node::line("x += x;"),
                        Node::line("y >>= 1;"),
                    ],
                )
                .at_most(64),
            ])
            .into(),
            Node::line("return (int64_t)sum;"),
        ];
        let divided = |answer: &str, negative: &str| {
            [
                "uint64_t rest;".to_string(),
                format!("const uint64_t quotient = {prefix}_long_division(a, b, &rest);"),
                "(void)quotient;".to_string(),
                format!("return ({negative}) ? (int64_t)(0U - {answer}) : (int64_t){answer};"),
            ]
            .map(Node::line)
            .to_vec()
        };
        for (name, sign, body) in [
            (product, "*", product_body),
            (quotient, "/", divided("quotient", "(a < 0) != (b < 0)")),
            (rest, "%", divided("rest", "a < 0")),
        ] {
            if self.calls(&name) {
                let mut lines = vec![Node::directive("#if defined(__SDCC_mcs51)")];
                lines.extend(body);
                lines.push(Node::directive("#else"));
                lines.push(Node::line(format!("return a {sign} b;")));
                lines.push(Node::directive("#endif"));
                nodes.push(Node::function(
                    format!("static int64_t {name}(int64_t a, int64_t b)"),
                    lines,
                ));
                nodes.push(Node::blank());
            }
        }
    }

    /// The function from which quotient and remainder of 64 bits are made.
    fn long_division(&self) -> [Node; 2] {
        let take = vec![Node::line("r -= d;"), Node::line("n |= 1U;")];
        let round = vec![
            Node::line("const uint8_t top = (uint8_t)(n >> 63);"),
            Node::line("n += n;"),
            Node::line("r += r;"),
            Node::line("r |= top;"),
            Node::when("r >= d", take),
        ];
        let body = vec![
            Node::line("uint64_t n = (a < 0) ? 0U - (uint64_t)a : (uint64_t)a;"),
            Node::line("const uint64_t d = (b < 0) ? 0U - (uint64_t)b : (uint64_t)b;"),
            Node::line("uint64_t r = 0U;"),
            Node::block("for (uint8_t i = 0U; i < 64U; ++i)", round),
            Node::line("*rest = r;"),
            Node::line("return n;"),
        ];
        let prefix = &self.names.prefix;
        let title = "The quotient of two magnitudes, bit by bit; the remainder is stored through the pointer.";
        let head =
            format!("static uint64_t {prefix}_long_division(int64_t a, int64_t b, uint64_t *rest)");
        [Node::comment(title), Node::function(head, body)]
    }

    /// Whether the emitted text calls a helper.
    fn calls(&self, helper: &str) -> bool {
        let program = &self.program;
        [&program.functions, &program.step, &program.init]
            .into_iter()
            .any(|nodes| mentions(nodes, helper))
    }

    /// Writes the calls of callbacks: the changes of a reaction are reported at its end.
    fn notify(&self, nodes: &mut Vec<Node>, step: &mut Vec<Node>) {
        if !self.interface.has_instance {
            return;
        }
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let mut body = Vec::new();
        let before = |text: &str| text.replace("self->", "before->");
        for (id, it) in self.net.steps.iter() {
            if !shown(it.kind, it.hidden) {
                continue;
            }
            let now = &self.program.active[id];
            let was = before(now);
            let name = format!("{upper}_STEP_{}", self.names.steps[id]);
            body.push(
                Node::when(
                    &format!("({now}) != ({was})"),
                    vec![Node::line(format!("{prefix}_activated({name}, {now});"))],
                )
                .about(Object::Step(id)),
            );
        }
        for (id, it) in self.net.transitions.iter() {
            if it.requires.is_empty() {
                continue;
            }
            let join = |negate: bool| {
                it.requires
                    .iter()
                    .map(|step| {
                        let now = &self.program.active[*step];
                        format!("({})", if negate { before(now) } else { now.clone() })
                    })
                    .join(" && ")
            };
            let condition = format!("{} && !({})", join(false), join(true));
            let name = format!("{upper}_T_{}", self.names.transitions[id]);
            body.push(
                Node::when(&condition, vec![Node::line(format!("{prefix}_enabled({name});"))])
                    .about(Object::Transition(id)),
            );
        }
        nodes.push(Node::comment("Reports the changes of a reaction to the library."));
        nodes.push(Node::function(
            format!(
                "static void {prefix}_notify(const {prefix}_t *self, const {prefix}_t *before)"
            ),
            crate::style_output::with_unused(&["self", "before"], body),
        ));
        nodes.push(Node::blank());
        // sdcc cannot initialise a structure with another one.
        step.insert(0, Node::line(format!("{prefix}_t before;")));
        step.insert(1, Node::line("before = *self;"));
        step.push(Node::line(format!("{prefix}_notify(self, &before);")));
    }
}
