//! Small nets for the tests of this crate, in a notation of one line. `a* b c | a>b:x b>c:nx a,b>c` has the steps a (initial), b and c and three
//! transitions; the text after the colon is an input, with the prefix `n` for its negation (`t` for `true`).

use grafsynth_ir::expr::{Expr, Type};
use grafsynth_ir::net::{
    Enter, Input, InputKind, Leaf, Net, Part, PartId, Step, StepId, Transition, TransitionKind,
};
use grafsynth_ir::span::{Name, Span};
use grafsynth_ir::{Valid, validate};
use itertools::Itertools as _;

pub(crate) fn name(text: &str) -> Name {
    Name { text: text.into(), ..Name::default() }
}

pub(crate) fn step(text: &str) -> Step {
    Step::new(name(text), PartId::from_index(0))
}

pub(crate) fn find(net: &Net, text: &str) -> StepId {
    net.steps
        .iter()
        .find(|(_, step)| step.name.text == text)
        .map(|(id, _)| id)
        .expect("a step of the chart")
}

pub(crate) fn input(net: &mut Net, text: &str) -> grafsynth_ir::net::InputId {
    if let Some((id, _)) = net.inputs.iter().find(|(_, input)| input.name.text == text) {
        return id;
    }
    net.inputs.push(Input {
        name: name(text),
        ty: Type::Bool,
        kind: InputKind::Pin,
        synchronous: true,
        meta: Default::default(),
    })
}

pub(crate) fn chart(text: &str) -> Net {
    let mut net = Net { name: name("test"), ..Net::default() };
    net.parts.push(Part { name: name("test"), level: 1, ..Part::default() });
    let (steps, moves) = text.split_once('|').expect("steps | transitions");
    for word in steps.split_whitespace() {
        let mut new = step(word.trim_end_matches('*'));
        new.is_initial = word.ends_with('*');
        net.steps.push(new);
    }
    for (number, word) in moves.split_whitespace().enumerate() {
        let (arrow, guard) = word.split_once(':').unwrap_or((word, "t"));
        let (from, to) = arrow.split_once('>').expect("from>to");
        let list = |text: &str| -> Vec<StepId> {
            text.split(',').filter(|one| !one.is_empty()).map(|one| find(&net, one)).collect()
        };
        let (requires, enters) = (list(from), list(to));
        let guard = match guard {
            "t" => Expr::bool(true),
            negated if negated.len() > 1 && negated.starts_with('n') => {
                Expr::leaf(Leaf::Input(input(&mut net, &negated[1..])), Span::default()).not()
            }
            plain => Expr::leaf(Leaf::Input(input(&mut net, plain)), Span::default()),
        };
        net.transitions.push(Transition {
            name: name(&format!("t{number}")),
            part: PartId::from_index(0),
            kind: TransitionKind::Move,
            clears: requires.clone(),
            requires,
            enters: enters.into_iter().map(Enter::Step).collect(),
            events: Vec::new(),
            guard,
            priority: None,
            restart: false,
            actions: Vec::new(),
            deadline_ns: None,
            meta: Default::default(),
        });
    }
    net
}

pub(crate) fn valid(net: Net) -> Valid<Net> {
    validate(net).expect("a valid net")
}

pub(crate) fn names(net: &Net, steps: &[StepId]) -> String {
    steps.iter().map(|step| net.steps[*step].name.text.clone()).join(" ")
}
