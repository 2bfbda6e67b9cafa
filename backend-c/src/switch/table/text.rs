//! The text of the tables: row types, rows, the words of inputs and outputs, and the loop over each bank.

use super::{Bank, Tables, Term, len, mask};
use crate::Object;
use crate::c::print::{Arm, Kind, Node};
use crate::io::Structure;
use crate::switch::emit::Emit;
use crate::times::count_type;
use grafsynth_ir::net::{StepId, TransitionId};

impl Tables {
    /// The definitions of the row types and the tables.
    pub(crate) fn definitions(&self, emit: &Emit<'_>) -> Vec<Node> {
        let mut nodes = Vec::new();
        for bank in &self.banks {
            bank.definitions(self, emit, &mut nodes);
        }
        nodes
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
    fn definitions(&self, tables: &Tables, emit: &Emit<'_>, nodes: &mut Vec<Node>) {
        let (prefix, upper, suffix) = (&emit.names.prefix, &emit.names.upper, &self.suffix);
        let plan = emit.plan;
        let single = self.single(tables, plan);
        let has_inputs = !self.inputs.is_empty();
        let word = word_type(self.inputs.len());
        let next = self.state_type(plan);
        let lamps = (!self.outputs.is_empty()).then(|| word_type(self.outputs.len()));
        let mut row = Vec::new();
        if has_inputs || single {
            row.push(Node::line(format!("{word} care;")).note("the inputs that it tests"));
            row.push(Node::line(format!("{word} want;")).note("the values they must have"));
        }
        let row_count = self
            .steps(plan)
            .map(|step| tables.waiting.get(&step).map_or(0, |it| it.rows.len()))
            .sum::<usize>();
        let first = count_type(len(row_count));
        if single {
            row.extend(
                lamps.map(|ty| Node::line(format!("{ty} lamps;")).note("the outputs of the step")),
            );
        }
        row.push(Node::line(format!("{next} next;")).note("the step that follows"));
        let traces = emit.options.trace.is_some();
        if traces {
            row.push(Node::line("uint16_t fired;").note("the transition, for the trace"));
        }
        let fired = |id: Option<TransitionId>| match id {
            _ if !traces => String::new(),
            Some(id) => format!(", {}", id.index()),
            None => ", 0".to_string(),
        };
        nodes.push(
            Kind::Braces("typedef struct".to_string(), row, format!(" {prefix}_row{suffix}_t;"))
                .into_note(if single {
                    "a step that waits for inputs"
                } else {
                    "a transition that waits for inputs"
                }),
        );
        if !single {
            let mut body = vec![
                Node::line(format!("{first} first;"))
                    .note("its first row; its rows end before the first row of the next step"),
            ];
            body.extend(lamps.map(|ty| Node::line(format!("{ty} lamps;")).note("its outputs")));
            nodes.push(
                Kind::Braces(
                    "typedef struct".to_string(),
                    body,
                    format!(" {prefix}_stand{suffix}_t;"),
                )
                .into_note("a step"),
            );
        }
        let mut rows = Vec::new();
        let mut stands = Vec::new();
        let mut done = 0usize;
        for machine in &self.machines {
            let machine = &plan.machines[*machine];
            let mut values: Vec<Option<StepId>> = Vec::new();
            if machine.has_none {
                values.push(None);
            }
            values.extend(machine.steps.iter().copied().map(Some));
            for step in values {
                let mine: &[(Term, StepId, TransitionId)] =
                    step.and_then(|step| tables.waiting.get(&step)).map_or(&[], |it| &it.rows);
                let drives =
                    step.and_then(|step| tables.drives.get(&step)).map_or(&[][..], Vec::as_slice);
                let lit = drives
                    .iter()
                    .filter_map(|it| self.outputs.iter().position(|o| o == it))
                    .fold(0u64, |m, b| m | 1 << b);
                let lamp_mask = lamps.map(|_| mask(lit, self.outputs.len()));
                let own_code = step.map_or_else(|| "0".to_string(), |step| emit.step_code(step));
                if single {
                    let (care, want, target) = match mine.first() {
                        Some((term, target, _)) => {
                            let (care, want) = self.term(term);
                            (care, want, emit.step_code(*target))
                        }
                        // An empty mask never equals a non-zero value: such a row never moves.
                        None => (
                            mask(0, self.inputs.len()),
                            mask(1, self.inputs.len()),
                            own_code.clone(),
                        ),
                    };
                    let lamp = lamp_mask.map(|it| format!("{it}, ")).unwrap_or_default();
                    let fired = fired(mine.first().map(|(_, _, id)| *id));
                    let mut node =
                        Node::line(format!("{{ {care}, {want}, {lamp}{target}{fired} }},"));
                    node.note = step.map_or_else(
                        || "none".to_string(),
                        |step| emit.net.steps[step].name.text.clone(),
                    );
                    node.objects = step.map(Object::Step).into_iter().collect();
                    node.objects.extend(mine.iter().map(|(_, _, id)| Object::Transition(*id)));
                    rows.push(node);
                } else {
                    let lamp = lamp_mask.map(|it| format!(", {it}")).unwrap_or_default();
                    let mut node = Node::line(format!("{{ {done}{lamp} }},"));
                    node.note = step.map_or_else(
                        || "none".to_string(),
                        |step| emit.net.steps[step].name.text.clone(),
                    );
                    node.objects = step.map(Object::Step).into_iter().collect();
                    stands.push(node);
                    for (term, target, id) in mine {
                        let (care, want) = self.term(term);
                        let words =
                            if has_inputs { format!("{care}, {want}, ") } else { String::new() };
                        rows.push(
                            Node::line(format!(
                                "{{ {words}{}{} }},",
                                emit.step_code(*target),
                                fired(Some(*id))
                            ))
                            .note(emit.net.transitions[*id].name.text.clone())
                            .about(Object::Transition(*id)),
                        );
                    }
                    done += mine.len();
                }
            }
        }
        if !single {
            let lamp = if lamps.is_some() { ", 0" } else { "" };
            stands.push(Node::line(format!("{{ {done}{lamp} }}")));
        }
        if let Some(last) = rows.last_mut()
            && let Kind::Line(text) = &mut last.kind
        {
            text.truncate(text.trim_end_matches(',').len());
        }
        nodes.push(Node::blank());
        let count = rows.len();
        nodes.push(
            Kind::Braces(
                format!(
                    "static {upper}_ROM {prefix}_row{suffix}_t {prefix}_rows{suffix}[{count}] ="
                ),
                rows,
                ";".to_string(),
            )
            .into(),
        );
        if !single {
            let count = stands.len();
            nodes.push(
                Kind::Braces(
                    format!("static {upper}_ROM {prefix}_stand{suffix}_t {prefix}_stands{suffix}[{count}] ="),
                    stands,
                    ";".to_string(),
                )
                .into(),
            );
        }
        if self.machines.len() > 1 {
            let ty = count_type(len(self.values(plan)));
            let mut at = 0usize;
            let mut offsets = Vec::new();
            for (position, machine) in self.machines.iter().enumerate() {
                let comma = if position + 1 == self.machines.len() { "" } else { "," };
                offsets.push(Node::line(format!("{at}{comma}")));
                at += plan.machines[*machine].values();
            }
            nodes.push(Node::comment("The first step of each sequence."));
            nodes.push(
                Kind::Braces(
                    format!(
                        "static {upper}_ROM {ty} {prefix}_begin{suffix}[{}] =",
                        self.machines.len()
                    ),
                    offsets,
                    ";".to_string(),
                )
                .into(),
            );
        }
        nodes.push(Node::blank());
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

    fn moves(&self, tables: &Tables, emit: &Emit<'_>) -> Vec<Node> {
        let (prefix, upper, suffix) = (&emit.names.prefix, &emit.names.upper, &self.suffix);
        let plan = emit.plan;
        let several = self.machines.len() > 1;
        let single = self.single(tables, plan);
        let state = format!("self->{}[{}]", self.member, if several { "i" } else { "0" });
        let begin = if several { format!("{prefix}_begin{suffix}[i] + ") } else { String::new() };
        let word = if self.inputs.is_empty() { "0".to_string() } else { format!("word{suffix}") };
        let lamps = word_type(self.outputs.len());
        let collect = |row: &str| {
            let var = if self.lamps_are_outputs(emit.names) {
                emit.names.io.lit(0)
            } else {
                format!("lamps{suffix}")
            };
            let text = format!("{var} = ({lamps})({var} | {row}->lamps);");
            (!self.outputs.is_empty()).then(|| Node::line(text))
        };
        let mut body = Vec::new();
        if single {
            body.push(Node::line(format!(
                "{upper}_ROM {prefix}_row{suffix}_t *row = &{prefix}_rows{suffix}[{begin}{state}];"
            )));
            let mut moved = traced(emit);
            moved.push(Node::line(format!("{state} = row->next;")));
            if !self.outputs.is_empty() {
                moved.push(Node::line(format!("row = &{prefix}_rows{suffix}[{begin}row->next];")));
            }
            body.push(Node::when(&format!("({word} & row->care) == row->want"), moved));
            body.extend(collect("row"));
        } else {
            let rows = self
                .steps(plan)
                .map(|step| tables.waiting.get(&step).map_or(0, |it| it.rows.len()))
                .sum::<usize>();
            let counter = count_type(len(rows));
            body.push(Node::line(format!(
                "{upper}_ROM {prefix}_stand{suffix}_t *stand = &{prefix}_stands{suffix}[{begin}{state}];"
            )));
            let mut moved = traced(emit);
            moved.push(Node::line(format!("{state} = row->next;")));
            if !self.outputs.is_empty() {
                moved.push(Node::line(format!(
                    "stand = &{prefix}_stands{suffix}[{begin}row->next];"
                )));
            }
            moved.push(Node::line("break;"));
            let inner = vec![
                Node::line(format!(
                    "{upper}_ROM {prefix}_row{suffix}_t *row = &{prefix}_rows{suffix}[at];"
                )),
                if self.inputs.is_empty() {
                    Node::line("{")
                } else {
                    Node::when(&format!("({word} & row->care) == row->want"), moved.clone())
                },
            ];
            let inner = if self.inputs.is_empty() {
                let mut plain = vec![inner[0].clone()];
                plain.extend(moved);
                plain
            } else {
                inner
            };
            body.push(Node::line(format!("const {counter} end = stand[1].first;")));
            // `stand` is the entry of a step, and `end` is the first row of the next one: as many rounds as that step has rows.
            let most = self
                .steps(plan)
                .map(|step| tables.waiting.get(&step).map_or(0, |it| it.rows.len()))
                .max();
            let head = format!("for ({counter} at = stand->first; at != end; ++at)");
            let arm = Arm::new(head, inner).at_most(most.unwrap_or(0) as u64);
            body.push(Kind::Block(vec![arm]).into());
            body.extend(collect("stand"));
        }
        let comment = Node::comment(if several {
            "Sequences that only wait for inputs: one row for each step."
        } else {
            "A sequence that only waits for inputs: one row for each step."
        });
        if several {
            let counter = count_type(len(self.machines.len()));
            let head = format!("for ({counter} i = 0; i < {}U; ++i)", self.machines.len());
            vec![comment, Node::block(head, body)]
        } else {
            let mut nodes = vec![comment, Node::line("{")];
            nodes.push(Kind::Nested(body).into());
            nodes.push(Node::line("}"));
            nodes
        }
    }
}

/// The statement that records the transition of a row in the trace, if there is a trace.
fn traced(emit: &Emit<'_>) -> Vec<Node> {
    let call = format!("{}_fired(self, row->fired);", emit.names.prefix);
    emit.options.trace.map(|_| Node::line(call)).into_iter().collect()
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
