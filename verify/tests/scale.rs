//! Charts that are too large to enumerate. The default size is small enough for every test run; set the variable `VERIFY_CELLS` at build time for larger
//! ones.

use grafsynth_ir::expr::{Expr, Type};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::net::{
    Driver, Emission, Enter, Input, InputId, InputKind, Leaf, Net, Output, Part, PartId, Step,
    StepId, Transition, TransitionKind,
};
use grafsynth_ir::span::{Name, Span};
use grafsynth_ir::{Valid, validate};
use grafsynth_logic::{EncodeOptions, encode};
use grafsynth_verify::equiv::by_induction;
use grafsynth_verify::{Limits, Method, Verdict, structural_facts};

fn name(text: String) -> Name {
    Name::new(text, Span::default())
}

/// Cells of a fork into two branches, an inner choice and a join, in sequence in a ring.
fn cells(n: usize) -> Valid<Net> {
    let mut net = Net { name: name("cells".to_owned()), ..Net::default() };
    let part = net.parts.push(Part { name: name("cells".to_owned()), level: 1, ..Part::default() });
    let inputs: Vec<InputId> = (0..32)
        .map(|at| {
            let (ty, kind) = (Type::Bool, InputKind::Pin);
            net.inputs.push(Input {
                name: name(format!("i{at}")),
                ty,
                kind,
                synchronous: true,
                meta: Default::default(),
            })
        })
        .collect();
    let step = |net: &mut Net, text: String, is_initial: bool, part: PartId| {
        net.steps.push(Step { is_initial, ..Step::new(name(text), part) })
    };
    let all: Vec<[StepId; 8]> = (0..n)
        .map(|cell| {
            std::array::from_fn(|at| {
                step(&mut net, format!("c{cell}_{at}"), cell == 0 && at == 0, part)
            })
        })
        .collect();
    let mut count = 0;
    for cell in 0..n {
        let [s, a, b, c, d, e, f, g] = all[cell];
        let next = all[(cell + 1) % n][0];
        let input = |at: usize| Expr::leaf(Leaf::Input(inputs[at % 32]), Span::default());
        let x = input(cell * 7);
        for (requires, enters, guard) in [
            (vec![s], vec![a, d], x.clone()),
            (vec![a], vec![b], input(cell * 3)),
            (vec![a], vec![c], input(cell * 3).not()),
            (vec![b], vec![g], x.clone()),
            (vec![c], vec![g], x.clone().not()),
            (vec![d], vec![e], input(cell * 5 + 1)),
            (vec![e], vec![f], input(cell * 5 + 2)),
            (vec![g, f], vec![next], x.clone()),
        ] {
            net.transitions.push(Transition {
                name: name(format!("t{count}")),
                part,
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
            count += 1;
        }
    }
    for at in 0..16 {
        let emissions = (0..n)
            .filter(|cell| cell % 16 == at)
            .map(|cell| Emission { step: all[cell][1], condition: None, span: Span::default() })
            .collect();
        net.outputs.push(Output {
            safe: None,
            name: name(format!("o{at}")),
            ty: Type::Bool,
            driver: Driver::Continuous(emissions),
            registered: false,
            meta: Default::default(),
        });
    }
    validate(net).expect("a valid net")
}

#[test]
fn a_large_chart_is_covered_and_its_circuit_proved() {
    let n_cells = std::option_env!("VERIFY_CELLS").and_then(|n| n.parse().ok()).unwrap_or(60);
    let net = cells(n_cells);
    let facts = structural_facts(&net);
    assert_eq!(facts.components.len(), n_cells + 1);
    assert!(facts.component_of.as_ref().is_some_and(|map| map.values().all(Option::is_some)));
    let program = program(&net, &ProgramOptions::default()).expect("a program");
    let logic =
        encode(&net, &program, &Facts::default(), &EncodeOptions::default()).expect("logic");
    let verdict = by_induction(&net, &facts, &logic, &Limits::default());
    let Verdict::Proved(certificate) = verdict else { panic!("{verdict:?}") };
    assert!(matches!(certificate.method, Method::Symbolic { .. }));
    assert_eq!(certificate.compared, net.steps.len() + net.outputs.len());
}
