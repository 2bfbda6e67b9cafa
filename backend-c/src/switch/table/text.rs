//! The text of the tables: row types, rows, the words of inputs and outputs, and the loop over each bank.

use super::{Bank, Tables, Term, len, mask};
use crate::Object;
use crate::c::print::{Arm, Kind, Node};
use crate::io::Structure;
use crate::switch::emit::Emit;
use crate::switch::plan::Plan;
use crate::times::count_type;
use grafsynth_ir::net::{StepId, TransitionId};
use itertools::Itertools as _;

impl Tables {
    /// The definitions of the row types and the tables.
    pub(crate) fn definitions(&self, emit: &Emit<'_>) -> Vec<Node> {
        self.banks.iter().flat_map(|bank| bank.definitions(self, emit)).collect()
    }

    /// Packs the inputs.
    pub(crate) fn words(&self, emit: &Emit<'_>) -> Vec<Node> {
        let mut nodes = Vec::new();
        for bank in &self.banks {
            if bank.words_are_inputs(emit.names) {
                let (ty, wide) = (word_type(bank.inputs.len()), wide_type(bank.inputs.len()));
                let bytes: Vec<String> = (0..emit.names.io.input_words())
                    .map(|byte| match byte {
                        0 => format!("in->bits[{byte}]"),
                        _ => format!("(({wide})in->bits[{byte}] << {})", 8 * byte),
                    })
                    .collect();
                let value = match bytes.as_slice() {
                    [only] => only.clone(),
                    _ => format!("({ty})({})", bytes.join(" | ")),
                };
                nodes.push(
                    Node::line(format!("const {ty} word{} = {value};", bank.suffix))
                        .note("the inputs, one bit each"),
                );
            } else if !bank.inputs.is_empty() {
                let ty = word_type(bank.inputs.len());
                nodes.push(
                    Node::line(format!("{ty} word{} = 0;", bank.suffix))
                        .note("the inputs, one bit each"),
                );
                for (bit, input) in bank.inputs.iter().enumerate() {
                    let name = &emit.names.inputs[*input];
                    let read = emit.names.io.read(
                        Structure::Behind("in"),
                        name,
                        *input,
                        emit.net.inputs[*input].ty,
                    );
                    let shifted = match bit {
                        // Operands of `|` must not be truth values (MISRA-C:2012, rule 10.1).
                        0 => format!("({ty}){}", read.text),
                        _ => format!("(({}){} << {bit})", wide_type(bank.inputs.len()), read.text),
                    };
                    nodes.push(
                        Node::line(format!("word{0} = ({ty})(word{0} | {shifted});", bank.suffix))
                            .about(Object::Input(*input)),
                    );
                }
            }
            if !bank.outputs.is_empty() && !bank.lamps_are_outputs(emit.names) {
                let ty = word_type(bank.outputs.len());
                nodes.push(
                    Node::line(format!("{ty} lamps{} = 0;", bank.suffix))
                        .note("the outputs, one bit each"),
                );
            }
        }
        nodes
    }

    /// The loops over the tables that move the variables.
    pub(crate) fn moves(&self, emit: &Emit<'_>) -> Vec<Node> {
        self.banks.iter().flat_map(|bank| bank.moves(self, emit)).collect()
    }

    /// Sets the variables to the initial steps.
    pub(crate) fn init(&self, emit: &Emit<'_>) -> Vec<Node> {
        let mut nodes = Vec::new();
        for bank in &self.banks {
            let codes: Vec<u32> = bank
                .machines
                .iter()
                .map(|machine| {
                    let steps = &emit.plan.machines[*machine].steps;
                    let initial = steps.iter().find(|step| emit.net.steps[**step].is_initial);
                    initial.map_or(0, |step| emit.plan.place[*step].1)
                })
                .collect();
            let first = codes.first().copied().unwrap_or(0);
            let rest: Vec<(usize, u32)> = codes
                .iter()
                .copied()
                .enumerate()
                .filter(|(_, code)| *code != first || codes.len() == 1)
                .collect();
            if codes.len() > 1 {
                let ty = count_type(len(codes.len()));
                nodes.push(Node::block(
                    format!("for ({ty} i = 0; i < {}U; ++i)", codes.len()),
                    vec![Node::line(format!("self->{}[i] = {first};", bank.member))],
                ));
            }
            for (position, code) in rest {
                nodes.push(Node::line(format!("self->{}[{position}] = {code};", bank.member)));
            }
        }
        nodes
    }
}

impl Bank {
    /// The row types and the tables of the bank.
    fn definitions(&self, tables: &Tables, emit: &Emit<'_>) -> Vec<Node> {
        let (prefix, upper, suffix) = (&emit.names.prefix, &emit.names.upper, &self.suffix);
        let plan = emit.plan;
        let single = self.single(tables, plan);
        let mut nodes = self.types(tables, emit);
        let mut rows = Vec::new();
        let mut stands = Vec::new();
        for machine in self.machines.iter().map(|it| &plan.machines[*it]) {
            let none = machine.has_none.then_some(None);
            for step in none.into_iter().chain(machine.steps.iter().copied().map(Some)) {
                let mine = step.map_or(&[][..], |step| tables.rows(step));
                let lamps = self.lamps(tables, step);
                if single {
                    let (care, want, next) = match mine.first() {
                        Some((term, next, _)) => {
                            let (care, want) = self.term(term);
                            (care, want, emit.step_code(*next))
                        }
                        // An empty mask never equals a non-zero value: such a row never moves.
                        None => {
                            let n_inputs = self.inputs.len();
                            let own = step.map_or("0".to_string(), |step| emit.step_code(step));
                            (mask(0, n_inputs), mask(1, n_inputs), own)
                        }
                    };
                    let fired = fired(emit, mine.first().map(|(_, _, id)| *id));
                    let words = [care, want].into_iter().chain(lamps).chain([next]).chain(fired);
                    let transitions = mine.iter().map(|(_, _, id)| Object::Transition(*id));
                    rows.push(entry(emit, step, words).about_all(transitions));
                    continue;
                }
                let first = rows.len().to_string();
                stands.push(entry(emit, step, [first].into_iter().chain(lamps)));
                for (term, next, id) in mine {
                    let (care, want) = self.term(term);
                    let words = [care, want].into_iter().filter(|_| !self.inputs.is_empty());
                    let next = [emit.step_code(*next)].into_iter().chain(fired(emit, Some(*id)));
                    rows.push(
                        Node::line(element(words.chain(next)))
                            .note(emit.net.transitions[*id].name.text.clone())
                            .about(Object::Transition(*id)),
                    );
                }
            }
        }
        nodes.push(Node::blank());
        let table = |ty: &str, name: &str, rows: Vec<Node>| {
            Node::table(upper, ty, &format!("{prefix}_{name}{suffix}"), rows)
        };
        let n_rows = rows.len();
        nodes.push(table(&format!("{prefix}_row{suffix}_t"), "rows", rows));
        if !single {
            // The last entry is the end of the last step.
            let dark = (!self.outputs.is_empty()).then(|| "0".to_string());
            stands.push(Node::line(element([n_rows.to_string()].into_iter().chain(dark))));
            nodes.push(table(&format!("{prefix}_stand{suffix}_t"), "stands", stands));
        }
        if self.machines.len() > 1 {
            let offsets = self.machines.iter().scan(0, |at, machine| {
                let begin = Node::line(at.to_string());
                *at += plan.machines[*machine].values();
                Some(begin)
            });
            nodes.push(Node::comment("The first step of each sequence."));
            nodes.push(table(count_type(len(self.values(plan))), "begin", offsets.collect()));
        }
        nodes.push(Node::blank());
        nodes
    }

    /// The types of the rows and, if steps have several rows, of the steps.
    fn types(&self, tables: &Tables, emit: &Emit<'_>) -> Vec<Node> {
        let (prefix, suffix) = (&emit.names.prefix, &self.suffix);
        let single = self.single(tables, emit.plan);
        let word = word_type(self.inputs.len());
        let member =
            |ty: &str, name: &str, note: &str| Node::line(format!("{ty} {name};")).note(note);
        let lamps = |note: &str| {
            let ty = word_type(self.outputs.len());
            (!self.outputs.is_empty()).then(|| member(ty, "lamps", note))
        };
        let mut row = Vec::new();
        if !self.inputs.is_empty() || single {
            row.push(member(word, "care", "the inputs that it tests"));
            row.push(member(word, "want", "the values they must have"));
        }
        row.extend(lamps("the outputs of the step").filter(|_| single));
        row.push(member(self.state_type(emit.plan), "next", "the step that follows"));
        if emit.options.trace.is_some() {
            row.push(member("uint16_t", "fired", "the transition, for the trace"));
        }
        let what = if single { "step" } else { "transition" };
        let mut nodes = vec![
            Node::typedef("struct", row, format!("{prefix}_row{suffix}_t"))
                .note(format!("a {what} that waits for inputs")),
        ];
        if !single {
            let first = count_type(len(self.n_rows(tables, emit.plan)));
            let note = "its first row; its rows end before the first row of the next step";
            let stand = [member(first, "first", note)].into_iter().chain(lamps("its outputs"));
            nodes.push(
                Node::typedef("struct", stand.collect(), format!("{prefix}_stand{suffix}_t"))
                    .note("a step"),
            );
        }
        nodes
    }

    /// The number of rows of its steps.
    fn n_rows(&self, tables: &Tables, plan: &Plan) -> usize {
        self.steps(plan).map(|step| tables.rows(step).len()).sum()
    }

    /// The mask of the outputs that a step drives, if the bank has outputs.
    fn lamps(&self, tables: &Tables, step: Option<StepId>) -> Option<String> {
        let drives = step.and_then(|step| tables.drives.get(&step));
        let lit = (drives.into_iter().flatten())
            .filter_map(|it| self.outputs.iter().position(|output| output == it))
            .fold(0u64, |lit, bit| lit | 1 << bit);
        (!self.outputs.is_empty()).then(|| mask(lit, self.outputs.len()))
    }

    fn term(&self, term: &Term) -> (String, String) {
        let mut care = 0u64;
        let mut want = 0u64;
        for (input, value) in term {
            if let Some(bit) = self.inputs.iter().position(|it| it == input) {
                care |= 1 << bit;
                want |= u64::from(*value) << bit;
            }
        }
        (mask(care, self.inputs.len()), mask(want, self.inputs.len()))
    }

    /// The loop that moves the variables of the bank, or the block if there is only one.
    fn moves(&self, tables: &Tables, emit: &Emit<'_>) -> Vec<Node> {
        let (prefix, upper, suffix) = (&emit.names.prefix, &emit.names.upper, &self.suffix);
        let several = self.machines.len() > 1;
        let state = format!("self->{}[{}]", self.member, if several { "i" } else { "0" });
        let begin = if several { format!("{prefix}_begin{suffix}[i] + ") } else { String::new() };
        let word = if self.inputs.is_empty() { "0".to_string() } else { format!("word{suffix}") };
        let is_met = format!("({word} & row->care) == row->want");
        let pointer = |name: &str, index: &str| {
            let entry = format!("{prefix}_{name}{suffix}");
            Node::line(format!("{upper}_ROM {entry}_t *{name} = &{entry}s[{index}];"))
        };
        // The statements of a move: `entry` points to what contains the outputs of the step.
        let moved = |entry: &str| {
            let trace = emit.options.trace.map(|_| format!("{prefix}_fired(self, row->fired);"));
            let next = format!("{entry} = &{prefix}_{entry}s{suffix}[{begin}row->next];");
            (trace.into_iter().chain([format!("{state} = row->next;")]))
                .chain((!self.outputs.is_empty()).then_some(next))
                .map(Node::line)
                .collect::<Vec<Node>>()
        };
        let collect = |entry: &str| {
            let var = if self.lamps_are_outputs(emit.names) {
                emit.names.io.lit(0)
            } else {
                format!("lamps{suffix}")
            };
            let ty = word_type(self.outputs.len());
            let text = format!("{var} = ({ty})({var} | {entry}->lamps);");
            (!self.outputs.is_empty()).then(|| Node::line(text))
        };
        let own = format!("{begin}{state}");
        let mut body = Vec::new();
        if self.single(tables, emit.plan) {
            body.extend([pointer("row", &own), Node::when(&is_met, moved("row"))]);
            body.extend(collect("row"));
        } else {
            let counter = count_type(len(self.n_rows(tables, emit.plan)));
            let mut moved = moved("stand");
            moved.push(Node::line("break;"));
            let mut inner = vec![pointer("row", "at")];
            if self.inputs.is_empty() {
                inner.extend(moved);
            } else {
                inner.push(Node::when(&is_met, moved));
            }
            body.push(pointer("stand", &own));
            body.push(Node::line(format!("const {counter} end = stand[1].first;")));
            // `stand` is the entry of a step, and `end` is the first row of the next one: as many rounds as that step has rows.
            let most = self.steps(emit.plan).map(|step| tables.rows(step).len()).max();
            let head = format!("for ({counter} at = stand->first; at != end; ++at)");
            let arm = Arm::new(head, inner).at_most(most.unwrap_or(0) as u64);
            body.push(Kind::Block(vec![arm]).into());
            body.extend(collect("stand"));
        }
        if several {
            let counter = count_type(len(self.machines.len()));
            let head = format!("for ({counter} i = 0; i < {}U; ++i)", self.machines.len());
            let title = "Sequences that only wait for inputs: one row for each step.";
            vec![Node::comment(title), Node::block(head, body)]
        } else {
            let title = "A sequence that only waits for inputs: one row for each step.";
            let body: Node = Kind::Nested(body).into();
            vec![Node::comment(title), Node::line("{"), body, Node::line("}")]
        }
    }
}

/// The text of an element of a table.
fn element(words: impl IntoIterator<Item = String>) -> String {
    format!("{{ {} }}", words.into_iter().join(", "))
}

/// The element of a step, or of the state in which none is active.
fn entry(emit: &Emit<'_>, step: Option<StepId>, words: impl IntoIterator<Item = String>) -> Node {
    let name = step.map_or("none", |step| &emit.net.steps[step].name.text);
    Node::line(element(words)).note(name).about_all(step.map(Object::Step))
}

/// The transition of a row, if there is a trace.
fn fired(emit: &Emit<'_>, transition: Option<TransitionId>) -> Option<String> {
    emit.options.trace.map(|_| transition.map_or(0, TransitionId::index).to_string())
}

/// The type of a word with this many bits.
fn word_type(bits: usize) -> &'static str {
    match bits {
        0..=8 => "uint8_t",
        9..=16 => "uint16_t",
        17..=32 => "uint32_t",
        _ => "uint64_t",
    }
}

/// The type in which bits of such a word are shifted.
fn wide_type(bits: usize) -> &'static str {
    match bits {
        0..=16 => "unsigned",
        17..=32 => "uint32_t",
        _ => "uint64_t",
    }
}
