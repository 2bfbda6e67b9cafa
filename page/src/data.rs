//! Everything that a page knows about its chart, as JSON.

use crate::contents::Contents;
use crate::html::base64;
use crate::key;
use crate::plant::plant_json;
use crate::program::ProgramWriter;
use crate::reference::Reference;
use crate::waits::{DEEPEST, Waits};
use grafsynth_ir::Gather;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::Type;
use grafsynth_ir::lower::program::{Additions, ProgramOptions, program_with};
use grafsynth_ir::net::{
    Driver, Evolution, Expr, InputId, InputKind, Net, PropertyLeaf, PropertyRole, StepKind,
    TransitionKind,
};
use grafsynth_ir::program::{Origin, Program, ResetEffect};
use grafsynth_ir::text::print_expr;
use grafsynth_ir::{FileId, Valid};
use grafsynth_sim::{ColumnKind, InputRow, MAX_DT, TraceLayout};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The version of the data; `engine.js` accepts only its own.
const VERSION: u32 = 2;

/// The data of a net.
///
/// # Errors
/// If the net has no bounded program.
pub(crate) fn data(
    net: &Valid<Net>,
    reference: &Reference,
    contents: &Contents<'_>,
) -> Result<Value, Vec<Diagnostic>> {
    let additions = Additions { marks: true, ..Additions::default() };
    let program = program_with(net, &ProgramOptions::default(), additions)?;
    let writer = ProgramWriter::new(net, &program);
    let waits = Waits::new(net, &program, &writer);
    let settings = &net.settings;
    let emergency = net.emergency.as_ref().and_then(|it| waits.expr(&it.condition, DEEPEST));
    Ok(json!({
        "version": VERSION,
        "name": net.name.text,
        "tick": settings.tick_ns,
        "language": contents.language.tag(),
        "policy": settings.policy.word(),
        // The maximum number of micro-steps of a reaction; null for a single one.
        "stable": match settings.evolution {
            Evolution::Single => None,
            Evolution::Stable { limit } => Some(limit),
        },
        "maxDt": MAX_DT,
        "program": program_json(&program, &writer),
        "inputs": net.inputs.values().map(|input| json!({
            "name": input.name.text,
            "label": input.meta.label,
            "kind": match input.kind {
                InputKind::Pin => "pin",
                InputKind::Extern => "condition",
                InputKind::Event => "event",
                InputKind::InternalEvent => "internal",
            },
            "type": ty(input.ty),
        })).collect::<Vec<_>>(),
        "outputs": net.outputs.values().map(|output| json!({
            "name": output.name.text,
            "label": output.meta.label,
            "type": ty(output.ty),
            "calls": matches!(output.driver, Driver::Extern { .. }),
        })).collect::<Vec<_>>(),
        "columns": columns(net, &waits),
        "steps": steps(net, &waits),
        "transitions": net.transitions.values().map(|transition| json!({
            "name": transition.name.text,
            "label": transition.meta.label,
            "key": key(transition.meta.span),
            "requires": transition.requires.iter().map(|step| step.index()).collect::<Vec<_>>(),
            "waits": waits.factors(transition),
            "moves": transition.kind == TransitionKind::Move,
        })).collect::<Vec<_>>(),
        "macros": net.macros.iter().map(|it| json!({
            "key": key(it.meta.span),
            "steps": it.steps.iter().map(|step| step.index()).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "timers": waits.timers(),
        "assumptions": assumptions(net, &waits, &writer),
        "emergency": emergency.map(|condition| writer.expr(&condition)),
        "exclusive": settings.events_exclusive,
        "queues": queues(net, &waits),
        "plant": contents.plant.map(plant_json),
        "sources": sources(net, contents),
        "reference": {
            "rows": rows(net, &reference.rows),
            // Pairs: a reaction, from 0, that does not continue from the one before it, and the state from which it continues.
            "from": jumps(&reference.from),
            // The low 24 bits as 4 digits of base64 for each reaction; `-` if the chart leaves a cell open.
            "hashes": hashes(&reference.hashes),
        },
    }))
}

/// The inputs of the reactions in few bytes, with a comma between two: `DT:` if it is not that of the reaction before, which begins with 1; the Booleans,
/// four in each hexadecimal digit, the first in its lowest bit; and `.N` for each number.
fn rows(net: &Net, rows: &[InputRow]) -> String {
    let given: Vec<InputId> =
        net.inputs.ids().filter(|id| net.inputs[*id].kind != InputKind::InternalEvent).collect();
    let (bits, numbers): (Vec<InputId>, Vec<InputId>) =
        given.into_iter().partition(|id| net.inputs[*id].ty == Type::Bool);
    let mut out = String::new();
    let mut dt = 1;
    for (at, row) in rows.iter().enumerate() {
        if at > 0 {
            out.push(',');
        }
        // Writing into a String cannot fail.
        if row.dt != dt {
            dt = row.dt;
            let _ = write!(out, "{dt}:");
        }
        for four in bits.chunks(4) {
            let digit = four.iter().rev().fold(0, |digit, id| digit * 2 + row.value(*id));
            let _ = write!(out, "{digit:x}");
        }
        for id in &numbers {
            let _ = write!(out, ".{}", row.value(*id));
        }
    }
    out
}

fn hashes(hashes: &[Option<u32>]) -> String {
    let text = |hash: &Option<u32>| match hash.map(u32::to_be_bytes) {
        Some([_, low @ ..]) => base64(&low),
        None => "-".to_owned(),
    };
    hashes.iter().map(text).collect()
}

fn jumps(from: &[usize]) -> Vec<[usize; 2]> {
    from.iter().enumerate().filter(|(at, from)| at != *from).map(|(at, from)| [at, *from]).collect()
}

/// The assumptions about the inputs: the condition that is never true, as text and as an expression.
fn assumptions(net: &Net, waits: &Waits<'_>, writer: &ProgramWriter<'_>) -> Vec<Value> {
    let mut all = Vec::new();
    for property in net.properties.iter().filter(|it| it.role == PropertyRole::Assume) {
        let leaf = &mut |leaf: &PropertyLeaf, span| {
            leaf.net().map(|leaf| Expr::leaf(*leaf, span)).ok_or(())
        };
        let array = &mut |leaf: &PropertyLeaf, _| leaf.net().copied().ok_or(());
        let Ok(never) = property.never.try_map(leaf, array) else { continue };
        if let Some(value) = waits.expr(&never, DEEPEST) {
            all.push(json!({ "never": print_expr(net, &never), "value": writer.expr(&value) }));
        }
    }
    all
}

/// The events that wait for the next check or reaction: the names of the event numbers, the cells of the queues, the bits of raised events, and the delayed
/// sends with the cells of their remaining ticks.
fn queues(net: &Net, waits: &Waits<'_>) -> Value {
    let name = |event: InputId| net.inputs[event].name.text.as_str();
    let listened: BTreeSet<InputId> =
        net.transitions.values().flat_map(|one| one.events.iter().copied()).gather();
    let queue = |items, length| Some([waits.cell(items)?, waits.cell(length)?]);
    let pending = net.inputs.ids().filter_map(|event| {
        waits.cell(Origin::Pending(event)).map(|cell| json!([name(event), cell]))
    });
    let sends = net.sends.iter().filter_map(|(id, slot)| {
        waits.cell(Origin::SendTimer(id)).map(|cell| json!([name(slot.event), cell]))
    });
    json!({
        "names": listened.into_iter().map(name).collect::<Vec<_>>(),
        "queues": [
            queue(Origin::InternalQueue, Origin::InternalLength),
            queue(Origin::ExternalQueue, Origin::ExternalLength),
        ],
        "pending": pending.collect::<Vec<_>>(),
        "sends": sends.collect::<Vec<_>>(),
    })
}

/// The texts that contain steps or transitions, by the number of the file in the keys of elements.
fn sources(net: &Net, contents: &Contents<'_>) -> Vec<Value> {
    let steps = net.steps.values().map(|step| step.meta.span.file);
    let transitions = net.transitions.values().map(|transition| transition.meta.span.file);
    let used: BTreeSet<FileId> = steps.chain(transitions).gather();
    let shown = contents.sources.iter().filter(|source| used.contains(&source.file));
    shown
        .map(|source| json!({ "file": source.file.0, "name": source.name, "text": source.text }))
        .collect()
}

/// The bounds of a type; null for a Boolean.
fn ty(ty: Type) -> Option<[i64; 2]> {
    match ty {
        Type::Bool => None,
        Type::Int { lo, hi } => Some([lo, hi]),
    }
}

fn program_json(program: &Program, writer: &ProgramWriter<'_>) -> Value {
    let effect = |effect: &ResetEffect| match effect {
        ResetEffect::Call(output, arguments) => json!([output.index(), arguments]),
        ResetEffect::Code(text) => json!([text.language]),
    };
    json!({
        // Bounds, whether the cell is an array, and the values after reset.
        "cells": program.cells.values().map(|cell| {
            let (lo, hi) = cell.ty.bounds();
            json!([lo, hi, i32::from(cell.len.is_some()), cell.init])
        }).collect::<Vec<_>>(),
        "temps": program.temps.len(),
        "body": writer.list(&program.body),
        "outputs": program.reset_outputs,
        "effects": program.reset_effects.iter().map(effect).collect::<Vec<_>>(),
        "fault": i32::from(program.reset_fault),
    })
}

/// The columns of a trace: name, kind, and what the kind refers to.
fn columns(net: &Net, waits: &Waits<'_>) -> Vec<Value> {
    let columns = TraceLayout::of(net).columns;
    let var = |var| waits.cell(Origin::Var(var));
    let one = |kind: ColumnKind, name: &str| match kind {
        ColumnKind::Scan => json!([name, "scan"]),
        ColumnKind::Dt => json!([name, "dt"]),
        ColumnKind::Input(input) => json!([name, "input", input.index()]),
        ColumnKind::Steps => json!([name, "steps"]),
        ColumnKind::Output(output) if net.outputs[output].is_extern() => {
            json!([name, "count", output.index()])
        }
        ColumnKind::Output(output) => json!([name, "output", output.index()]),
        ColumnKind::Calls(output) => json!([name, "calls", output.index()]),
        ColumnKind::Var(id) => json!([name, "var", var(id), 0]),
        ColumnKind::Element(id, element) => json!([name, "var", var(id), element]),
        ColumnKind::Fault => json!([name, "fault"]),
    };
    columns.iter().map(|column| one(column.kind, &column.name)).collect()
}

fn steps(net: &Net, waits: &Waits<'_>) -> Vec<Value> {
    let all = net.steps.iter().map(|(id, step)| {
        json!({
            "name": step.name.text,
            "label": step.meta.label,
            "key": key(step.meta.span),
            "cell": waits.cell(Origin::Step(id)),
            "time": waits.cell(Origin::Elapsed(id)),
            "initial": step.is_initial,
            "parent": step.parent.map(grafsynth_ir::Id::index),
            "kind": match step.kind {
                StepKind::Leaf => "step",
                StepKind::Enclosing => "enclosing",
                StepKind::Composite => "state",
                StepKind::Parallel => "parallel",
                StepKind::Final => "final",
            },
            "hidden": step.hidden,
            // Whether the column `steps` of a trace lists it.
            "listed": !step.hidden && matches!(step.kind, StepKind::Leaf | StepKind::Enclosing | StepKind::Final),
        })
    });
    all.collect()
}
