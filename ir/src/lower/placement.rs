//! Pass `placement`: the placement requests of the designer, and the pins of the board.
#![allow(clippy::wildcard_enum_match_arm, reason = "only signals and steps have a place")]

use super::codes;
use super::context::{Lowering, Outcome, ScopeId, Symbol, Work};
use super::names::{BOARD_SIGNAL, BOARD_SIGNALS};
use crate::chart;
use crate::diag::Diagnostic;
use crate::net::{Board, PlacedItem, Placement, StepId};
use crate::span::{Name, Span};
use std::collections::BTreeMap;

/// Lowers the placement requests and the boards. Runs after `expand`.
pub(super) fn placement(lowering: &mut Lowering<'_>) {
    let mut first_board: Option<Span> = None;
    for index in 0..lowering.work.len() {
        match lowering.work[index] {
            Work::Place { scope, source } => place(lowering, scope, source),
            Work::Board { scope, source } => {
                if let Some(first) = first_board {
                    lowering.report(
                        Diagnostic::error(codes::BOARD, "a second board")
                            .at(source.span, "")
                            .at(first, "the first one")
                            .help("keep one board; move the others to separate board files"),
                    );
                    continue;
                }
                first_board = Some(source.span);
                let board = board(lowering, scope, source);
                lowering.net.board = board;
            }
            _ => {}
        }
    }
}

fn place(lowering: &mut Lowering<'_>, scope: ScopeId, source: &chart::Place) {
    for path in &source.items {
        let items: Vec<PlacedItem> = match lowering.symbol(scope, path) {
            Ok(Symbol::Step(step)) => vec![PlacedItem::Step(step)],
            Ok(Symbol::Var(var)) => vec![PlacedItem::Var(var)],
            Ok(Symbol::Transition(transition)) => vec![PlacedItem::Transition(transition)],
            Ok(Symbol::Output(output)) => vec![PlacedItem::Output(output)],
            Ok(Symbol::MacroStep(instance)) => lowering.instances[instance]
                .steps
                .clone()
                .map(|step| PlacedItem::Step(StepId::from_index(step)))
                .collect(),
            Ok(other) => {
                lowering.wrong_kind(
                    path.span(),
                    path,
                    other,
                    "a step, transition, variable or output",
                );
                continue;
            }
            Err(_) => continue,
        };
        lowering.net.placements.extend(items.into_iter().map(|item| Placement {
            item,
            part: source.part.clone(),
            span: source.span,
        }));
    }
}

/// The board with the full names of its signals.
pub(super) fn board(lowering: &mut Lowering<'_>, scope: ScopeId, source: &chart::Board) -> Board {
    let mut by_signal: BTreeMap<&str, Span> = BTreeMap::new();
    let mut by_number: BTreeMap<u32, &Name> = BTreeMap::new();
    let mut pins = Vec::with_capacity(source.pins.len());
    for (name, number) in &source.pins {
        // Ground and unconnected pins may be listed several times.
        let is_repeatable = matches!(name.text.as_str(), "vcc" | "gnd" | "nc");
        if let Some(first) = by_signal.insert(&name.text, name.span)
            && !is_repeatable
        {
            lowering.report(Diagnostic::twice(
                codes::BOARD,
                format!("`{name}` has two pins"),
                [name.span, first],
                "remove one of them",
            ));
        }
        if let Some(first) = by_number.insert(*number, name) {
            let (other, first) = (first.text.clone(), first.span);
            lowering.report(Diagnostic::twice(
                codes::BOARD,
                format!("pin {number} is assigned to both `{other}` and `{name}`"),
                [name.span, first],
                "use another pin for one of them",
            ));
        }
        let full = if BOARD_SIGNALS.contains(&name.text.as_str()) {
            Ok(name.text.clone())
        } else {
            signal(lowering, scope, name)
        };
        if let Ok(full) = full {
            pins.push((Name::new(full, name.span), *number));
        }
    }
    Board { device: Some(source.device.clone()), pins }
}

fn signal(lowering: &mut Lowering<'_>, scope: ScopeId, name: &Name) -> Outcome<String> {
    // `n[2]` is a bit of a number or an element of an array: the name is resolved without the index.
    let (base, bit) = match name.text.find('[') {
        Some(at) => name.text.split_at(at),
        None => (name.text.as_str(), ""),
    };
    let names = base.split('.').map(|part| Name::new(part, name.span)).collect();
    let path = chart::Path { names };
    let net = &lowering.net;
    let found = match lowering.peek(scope, &path) {
        Some(super::names::Resolved::Symbol(symbol)) => match symbol {
            Symbol::Input(input) => Some(&net.inputs[input].name),
            Symbol::Output(output) => Some(&net.outputs[output].name),
            Symbol::Step(step) => Some(&net.steps[step].name),
            Symbol::Var(var) => Some(&net.vars[var].name),
            _ => None,
        },
        Some(super::names::Resolved::Attribute(..)) | None => None,
    };
    if let Some(found) = found {
        return Ok(format!("{found}{bit}"));
    }
    let symbol = lowering.wanting(BOARD_SIGNAL, |lowering| lowering.symbol(scope, &path))?;
    Err(lowering.wrong_kind(name.span, name, symbol, "an input, output, variable or step"))
}
