//! Every identifier of the emitted text, chosen once.
//!
//! Identifiers are made of the chart's names, never of positions, so that an unrelated edit leaves them alone. Names live in the space they are used in:
//! members of the input, output and instance structures, enumerators (which all carry the chart's prefix), and functions of the user's library (which
//! carry none, so that one library serves several charts).

use std::collections::BTreeSet;

use grafsynth_ir::IdMap;
use grafsynth_ir::net::{
    ControlledAction, EdgeOperand, Input, InputKind, MacroStep, Net, Output, Step, Timer,
    Transition, Var,
};

/// The identifiers of one chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Names {
    /// In front of types and functions.
    pub(crate) prefix: String,
    /// In front of macros and enumerators.
    pub(crate) upper: String,
    /// Members of the input structure; of extern conditions the user's functions.
    pub(crate) inputs: IdMap<Input, String>,
    /// Members of the output structure; of extern actions the user's functions.
    pub(crate) outputs: IdMap<Output, String>,
    /// Members of the instance.
    pub(crate) vars: IdMap<Var, String>,
    /// Without the prefix: `p1` of `TRUCK_p1` and `truck_active_p1`.
    pub(crate) steps: IdMap<Step, String>,
    /// Without the prefix, for `TRUCK_T_t1`.
    pub(crate) transitions: IdMap<Transition, String>,
    /// Without the prefix, for `truck_macro_m1`.
    pub(crate) macros: Vec<String>,
    /// Members of the instance: what an edge operand was.
    pub(crate) edges: IdMap<EdgeOperand, String>,
    /// Members of the instance.
    pub(crate) timers: IdMap<Timer, String>,
    /// For comments and members.
    pub(crate) actions: IdMap<ControlledAction, String>,
    /// All members of the instance so far, so that later ones differ.
    pub(crate) members: Space,
}

/// A set of identifiers that must differ.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Space(BTreeSet<String>);

impl Space {
    /// A space in which these are taken.
    pub(crate) fn with<'a>(taken: impl IntoIterator<Item = &'a str>) -> Self {
        Space(taken.into_iter().map(str::to_string).collect())
    }

    /// An identifier made of `wanted` that differs from all earlier ones and from the words of C and C++.
    pub(crate) fn claim(&mut self, wanted: &str) -> String {
        let base = identifier(wanted);
        let mut name = base.clone();
        let mut number = 1;
        while RESERVED.binary_search(&name.as_str()).is_ok() || self.0.contains(&name) {
            number += 1;
            name = if number == 2 && RESERVED.binary_search(&base.as_str()).is_ok() {
                format!("{base}_")
            } else {
                format!("{base}_{number}")
            };
        }
        self.0.insert(name.clone());
        name
    }
}

/// `text` with every character that C does not allow made an underscore, and a letter in front where it needs one. Names that begin with an
/// underscore belong to the compiler, so they get a letter too.
pub(crate) fn identifier(text: &str) -> String {
    let mut out: String =
        text.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    // Two underscores in a row belong to the implementation in C++.
    while out.contains("__") {
        out = out.replace("__", "_");
    }
    if !out.starts_with(|c: char| c.is_ascii_alphabetic()) {
        out.insert_str(0, if out.starts_with('_') { "x" } else { "x_" });
    }
    out
}

impl Names {
    /// The names of a net, with `prefix` in front of everything global.
    pub(crate) fn of(net: &Net, prefix: &str) -> Self {
        let prefix = Space::default().claim(prefix);
        let upper = prefix.to_ascii_uppercase();
        // Functions of the library share the global space with what the chart and the standard headers define.
        let own = ["main", "memset", "memcpy", prefix.as_str()];
        let mut global = Space::with(own);
        let mut in_members = Space::default();
        let mut out_members = Space::default();
        let mut members = Space::with(["state", "fault"]);
        let inputs = IdMap::build(&net.inputs, |_, input| match input.kind {
            InputKind::Extern => global.claim(&input.name.text),
            InputKind::Pin | InputKind::Event | InputKind::InternalEvent => {
                in_members.claim(&input.name.text)
            }
        });
        let outputs = IdMap::build(&net.outputs, |_, output| {
            if is_extern(output) {
                global.claim(&output.name.text)
            } else {
                out_members.claim(&output.name.text)
            }
        });
        let vars = IdMap::build(&net.vars, |_, var| members.claim(&var.name.text));
        // Enumerators share the space of the macros that the headers define.
        let mut enumerators = Space::with(ENUMERATORS.iter().copied());
        let steps =
            IdMap::build(&net.steps, |_, step| enumerators.claim_after_prefix(&step.name.text));
        let mut fired = Space::default();
        let transitions =
            IdMap::build(&net.transitions, |_, it| fired.claim_after_prefix(&it.name.text));
        let mut drawn = Space::default();
        let macros = net
            .macros
            .iter()
            .map(|it: &MacroStep| drawn.claim_after_prefix(&it.name.text))
            .collect();
        let timers = IdMap::build(&net.timers, |_, timer| {
            members.claim(&format!("timer_{}", timer.name.text))
        });
        let edges = IdMap::build(&net.edges, |_, edge| {
            members.claim(&format!("was_{}", edge_name(net, edge)))
        });
        let actions = IdMap::build(&net.actions, |_, action| identifier(&action.name.text));
        Names {
            prefix,
            upper,
            inputs,
            outputs,
            vars,
            steps,
            transitions,
            macros,
            edges,
            timers,
            actions,
            members,
        }
    }
}

impl Space {
    /// As [`Space::claim`] for what follows a prefix, where reserved words can stand.
    fn claim_after_prefix(&mut self, wanted: &str) -> String {
        let mut base: String =
            wanted.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        while base.contains("__") {
            base = base.replace("__", "_");
        }
        let base = base.trim_matches('_');
        let base = if base.is_empty() { "x" } else { base };
        let mut name = base.to_string();
        let mut number = 1;
        while !self.0.insert(name.clone()) {
            number += 1;
            name = format!("{base}_{number}");
        }
        name
    }
}

/// True for an output that is a function of the user's library.
pub(crate) fn is_extern(output: &Output) -> bool {
    matches!(output.driver, grafsynth_ir::net::Driver::Extern { .. })
}

/// A word for what an edge looks at: the names in it, joined.
fn edge_name(net: &Net, edge: &EdgeOperand) -> String {
    use grafsynth_ir::net::Leaf;
    let mut words: Vec<&str> = Vec::new();
    edge.expr.for_each_leaf(&mut |leaf| {
        if words.len() < 3 {
            words.push(match *leaf {
                Leaf::Input(input) => &net.inputs[input].name.text,
                Leaf::Var(var) => &net.vars[var].name.text,
                Leaf::Active(step)
                | Leaf::Elapsed(step)
                | Leaf::LastElapsed(step)
                | Leaf::TasksDone(step) => &net.steps[step].name.text,
                Leaf::Timer(timer) => &net.timers[timer].name.text,
                Leaf::Controlled(action) => &net.actions[action].name.text,
                Leaf::Rise(_) | Leaf::Fall(_) | Leaf::Fireable(_) => "edge",
            });
        }
    });
    words.join("_")
}

/// What the headers define after the prefix in capitals.
const ENUMERATORS: &[&str] = &[
    "ACTIVE",
    "BAD_STATE",
    "COMPLETE",
    "ENTER_CRITICAL",
    "EXIT_CRITICAL",
    "H",
    "INACTIVE",
    "NONE",
    "PORT_H",
    "RING_SIZE",
    "ROM",
    "USER_H",
];

/// Words that are no identifiers in C99, C11 or C++, and names that `stdbool.h`, `stdint.h` or a compiler may define as macros or that we use ourselves;
/// sorted by byte.
const RESERVED: &[&str] = &[
    "EOF",
    "FALSE",
    "INFINITY",
    "NAN",
    "NULL",
    "TRUE",
    "alignas",
    "alignof",
    "and",
    "and_eq",
    "asm",
    "auto",
    "bitand",
    "bitor",
    "bool",
    "break",
    "case",
    "catch",
    "char",
    "char16_t",
    "char32_t",
    "char8_t",
    "class",
    "co_await",
    "co_return",
    "co_yield",
    "compl",
    "complex",
    "concept",
    "const",
    "const_cast",
    "consteval",
    "constexpr",
    "constinit",
    "continue",
    "decltype",
    "default",
    "delete",
    "do",
    "double",
    "dt",
    "dynamic_cast",
    "else",
    "enum",
    "errno",
    "explicit",
    "export",
    "extern",
    "false",
    "float",
    "for",
    "friend",
    "goto",
    "i386",
    "if",
    "imaginary",
    "in",
    "inline",
    "int",
    "linux",
    "long",
    "main",
    "mutable",
    "namespace",
    "new",
    "noexcept",
    "noreturn",
    "not",
    "not_eq",
    "nullptr",
    "operator",
    "or",
    "or_eq",
    "out",
    "private",
    "protected",
    "public",
    "register",
    "reinterpret_cast",
    "requires",
    "restrict",
    "return",
    "scan",
    "self",
    "short",
    "signed",
    "sizeof",
    "static",
    "static_assert",
    "static_cast",
    "struct",
    "switch",
    "template",
    "this",
    "thread_local",
    "throw",
    "true",
    "try",
    "typedef",
    "typeid",
    "typename",
    "typeof",
    "union",
    "unix",
    "unsigned",
    "using",
    "virtual",
    "void",
    "volatile",
    "wchar_t",
    "while",
    "xor",
    "xor_eq",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reserved_words_are_sorted() {
        assert!(RESERVED.is_sorted());
        assert!(ENUMERATORS.is_sorted());
    }

    #[test]
    fn identifiers_are_legal_and_differ() {
        let mut space = Space::default();
        assert_eq!(space.claim("int"), "int_");
        assert_eq!(space.claim("m1.e"), "m1_e");
        assert_eq!(space.claim("m1_e"), "m1_e_2");
        assert_eq!(space.claim("__x"), "x_x");
        assert_eq!(space.claim("2nd"), "x_2nd");
        assert_eq!(space.claim("größe"), "gr_e");
        assert_eq!(space.claim_after_prefix("int"), "int");
    }
}
