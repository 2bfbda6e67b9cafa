//! Names that fit a language.

use std::collections::{BTreeMap, BTreeSet};

/// What a language asks of a name.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rules {
    /// The longest name, in characters.
    pub(crate) max: usize,
    /// Names that differ in letter case only are one.
    pub(crate) fold_case: bool,
    /// Whether `_` may occur.
    pub(crate) underscore: bool,
    /// Words with a meaning of their own, in lower case.
    pub(crate) reserved: &'static [&'static str],
}

pub(crate) const PALASM: Rules = Rules {
    max: 14,
    fold_case: true,
    underscore: true,
    reserved: &[
        "author", "begin", "check", "chip", "clockf", "combinatorial", "comb", "company", "conditions", "date", "default_branch", "default_output",
        "device", "do", "else", "end", "equations", "for", "global", "gnd", "group", "hold_state", "if", "latched", "mealy_machine", "minimize_off",
        "minimize_on", "moore_machine", "nc", "next_state", "node", "or", "output_enable", "output_hold", "pattern", "pin", "power_up", "preload",
        "prldf", "prload", "reg", "registered", "revision", "setf", "signature", "simulation", "start_up", "state", "string", "test", "then", "title",
        "to", "trace_off", "trace_on", "vcc", "vector", "while",
    ],
};

pub(crate) const CUPL: Rules = Rules {
    max: 31,
    fold_case: true,
    underscore: true,
    reserved: &[
        "append", "assembly", "assy", "company", "condition", "d", "date", "default", "designer", "device", "else", "field", "flip", "fuse", "format",
        "function", "group", "if", "in", "inc", "jump", "loc", "location", "macro", "max", "min", "name", "next", "node", "o", "oe", "out", "partno",
        "pin", "pinnnode", "pinnode", "pld", "present", "proset", "purge", "rev", "revision", "sequence", "sequenced", "sequencejk", "sequencers",
        "sequencet", "table", "undef", "property", "h", "b", "x", "repeat", "until", "macrocell",
    ],
};

pub(crate) const GALASM: Rules =
    Rules { max: 8, fold_case: true, underscore: false, reserved: &["ar", "sp", "nc", "vcc", "gnd", "description"] };

pub(crate) const VERILOG: Rules = Rules {
    max: 200,
    fold_case: true,
    underscore: true,
    reserved: &[
        "always", "and", "assign", "automatic", "begin", "bit", "buf", "bufif0", "bufif1", "byte", "case", "casex", "casez", "cell", "class", "cmos",
        "config", "const", "continue", "deassign", "default", "defparam", "design", "disable", "do", "edge", "else", "end", "endcase", "endconfig",
        "endfunction", "endgenerate", "endmodule", "endprimitive", "endspecify", "endtable", "endtask", "enum", "event", "export", "final", "for",
        "force", "forever", "fork", "function", "generate", "genvar", "highz0", "highz1", "if", "ifnone", "import", "incdir", "include", "initial",
        "inout", "input", "inside", "instance", "int", "integer", "interface", "join", "large", "liblist", "library", "localparam", "logic", "longint",
        "macromodule", "medium", "modport", "module", "nand", "negedge", "new", "nmos", "nor", "noshowcancelled", "not", "notif0", "notif1", "null", "or",
        "output", "package", "parameter", "pmos", "posedge", "primitive", "priority", "program", "property", "pull0", "pull1", "pulldown", "pullup",
        "pulsestyle_ondetect", "pulsestyle_onevent", "rand", "rcmos", "real", "realtime", "ref", "reg", "release", "repeat", "return", "rnmos", "rpmos",
        "rtran", "rtranif0", "rtranif1", "scalared", "sequence", "shortint", "shortreal", "showcancelled", "signed", "small", "specify", "specparam",
        "static", "string", "strong0", "strong1", "struct", "super", "supply0", "supply1", "table", "task", "this", "time", "tran", "tranif0", "tranif1",
        "tri", "tri0", "tri1", "triand", "trior", "trireg", "type", "typedef", "union", "unique", "unsigned", "use", "uwire", "var", "vectored", "virtual",
        "void", "wait", "wand", "weak0", "weak1", "while", "wire", "with", "wor", "xnor", "xor",
    ],
};

pub(crate) const BLIF: Rules = Rules { max: 200, fold_case: true, underscore: true, reserved: &[] };

/// Hands out names of one language, each once.
#[derive(Debug)]
pub(crate) struct Names {
    rules: Rules,
    taken: BTreeSet<String>,
    /// The last number tried for a name that was wanted again.
    numbers: BTreeMap<String, usize>,
}

impl Names {
    pub(crate) fn new(rules: Rules) -> Self {
        Names { rules, taken: BTreeSet::new(), numbers: BTreeMap::new() }
    }

    /// A name as near to `wanted` as the language allows, different from all before. Only the names asked for before matter, never positions.
    pub(crate) fn take(&mut self, wanted: &str) -> String {
        let mut clean: String = wanted
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
            .filter(|c| self.rules.underscore || *c != '_')
            .collect();
        if !clean.starts_with(|c: char| c.is_ascii_alphabetic()) {
            clean.insert(0, 'n');
        }
        clean.truncate(self.rules.max);
        if self.is_free(&clean) {
            return self.note(clean);
        }
        let key = self.key(&clean);
        let mut number = self.numbers.get(&key).copied().unwrap_or(1);
        loop {
            number += 1;
            let suffix = if self.rules.underscore { format!("_{number}") } else { number.to_string() };
            let mut candidate = clean.clone();
            candidate.truncate(self.rules.max.saturating_sub(suffix.len()));
            candidate.push_str(&suffix);
            if self.is_free(&candidate) {
                self.numbers.insert(key, number);
                return self.note(candidate);
            }
        }
    }

    /// As [`Names::take`], but asks for `other` where `wanted` is already gone.
    pub(crate) fn take_or(&mut self, wanted: &str, other: &str) -> String {
        let has_gone = self.taken.contains(&self.key(wanted));
        self.take(if has_gone { other } else { wanted })
    }

    fn key(&self, name: &str) -> String {
        if self.rules.fold_case { name.to_ascii_lowercase() } else { name.to_owned() }
    }

    fn is_free(&self, name: &str) -> bool {
        !self.rules.reserved.contains(&name.to_ascii_lowercase().as_str()) && !self.taken.contains(&self.key(name))
    }

    fn note(&mut self, name: String) -> String {
        self.taken.insert(self.key(&name));
        name
    }
}
