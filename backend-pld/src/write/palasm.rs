//! PALASM 2 and 4: pin statements, equations, simulation.

use super::{Signs, SourceText};
use crate::device::{Clock, FlipFlop};
use crate::equations::{Equations, Signal, Source, remark};
use crate::vectors::{VectorRow, Vectors};

const SIGNS: Signs = Signs { not: "/", and: " * ", or: "+", yes: "VCC", no: "GND" };

pub(crate) fn write(equations: &Equations, vectors: Option<&Vectors>) -> SourceText {
    let mut source = SourceText::default();
    for line in &equations.head {
        source.line(&format!("; {line}"));
    }
    source.line("");
    source.line(&format!("TITLE     {}", equations.title));
    source.line("PATTERN   1");
    source.line("REVISION  1");
    source.line("AUTHOR    grafsynth");
    source.line("COMPANY   -");
    source.line("DATE      -");
    source.line("");
    source.line(&format!("CHIP  {}  {}", equations.title, equations.device.palasm));
    source.line("");
    let mut is_registered = vec![false; equations.signals.len()];
    for equation in &equations.equations {
        is_registered[equation.signal] = equation.is_registered;
    }
    let mut order: Vec<usize> = (0..equations.signals.len()).collect();
    // A shared pin is declared once, by its flip-flop.
    order.retain(|&index| equations.signals[index].shared.is_none());
    order.sort_by_key(|&index| {
        (equations.signals[index].pin.is_none(), equations.signals[index].pin, index)
    });
    for index in order {
        let signal = &equations.signals[index];
        let pin = signal.pin.map_or_else(|| "?".to_owned(), |pin| pin.to_string());
        let name =
            if signal.is_pin_inverted { format!("/{}", signal.name) } else { signal.name.clone() };
        let kind = if is_registered[index] { "REGISTERED" } else { "COMBINATORIAL" };
        let remark = remark(&signal.meta);
        let remark = if remark.is_empty() { remark } else { format!(" ; {remark}") };
        let is_node = match signal.source {
            Source::Buried(_) => true,
            Source::Flop(_) => equations.device.blocks.is_some(),
            Source::Clock | Source::Input(_) | Source::Output(_) => false,
        };
        let is_node = is_node && signal.pin.is_none();
        let statement = if is_node { "NODE" } else { "PIN" };
        source.line_of(
            &format!("{statement} {pin:<3} {name:<15} {kind:<13}{remark}"),
            &signal.name,
            &signal.meta,
        );
    }
    source.line("");
    source.line("EQUATIONS");
    source.line("");
    for equation in &equations.equations {
        let name = &equations.signals[equation.signal].name;
        let not = if equation.is_complemented { "/" } else { "" };
        let sign = if equation.is_registered { ":=" } else { "=" };
        // A T flip-flop is a D flip-flop whose sum is inverted by its own value.
        let end = match (&equation.inverter, equation.is_registered, equation.flip_flop) {
            (_, true, FlipFlop::T) => format!(" :+: {name}"),
            (Some(product), _, _) => format!(" :+: {}", SIGNS.product(equations, product)),
            (None, _, FlipFlop::D | FlipFlop::T) => String::new(),
        };
        SIGNS.print(&mut source, equations, equation, &format!("{not}{name} {sign}"), &end);
        if let (true, Clock::Term, Some(clock)) =
            (equation.is_registered, equations.device.clock, equations.clock())
        {
            source.line(&format!("{name}.CLKF = {}", clock.name));
        }
    }
    if let Some(vectors) = vectors {
        source.line("");
        simulation(&mut source, equations, vectors);
    }
    source
}

/// Prints the simulation section. The first row is the state after power-up; each further row sets the changed inputs, clocks, and checks every pin. A row of several
/// clocks clears its events after the first clock, and `busy` is checked between clocks.
fn simulation(source: &mut SourceText, equations: &Equations, vectors: &Vectors) {
    let literal = |index: usize, value: bool| literal(&equations.signals[index], value);
    let inputs: Vec<(usize, usize)> = (equations.signals.iter().enumerate())
        .filter_map(|(index, signal)| match signal.source {
            Source::Input(id) => Some((index, id.index())),
            Source::Clock | Source::Flop(_) | Source::Output(_) | Source::Buried(_) => None,
        })
        .collect();
    source.line("SIMULATION");
    source.line("");
    let is_shown = |source: Source| !matches!(source, Source::Buried(_));
    let is_own = |signal: &&crate::equations::Signal| signal.shared.is_none();
    let shown = equations.signals.iter().filter(|signal| is_shown(signal.source)).filter(is_own);
    let all: Vec<&str> = shown.map(|signal| signal.name.as_str()).collect();
    wrapped(source, "TRACE_ON", &all);
    let mut before: Option<Vec<bool>> = None;
    for row in &vectors.rows {
        let changed: Vec<String> = inputs
            .iter()
            .filter(|(_, input)| {
                before.as_ref().is_none_or(|before| before[*input] != row.inputs[*input])
            })
            .map(|&(index, input)| literal(index, row.inputs[input]))
            .collect();
        if !changed.is_empty() {
            wrapped(source, "SETF", &changed);
        }
        let check = |mealy: bool| checked(equations, vectors, row, mealy);
        // A mealy output is valid before the clock.
        wrapped(source, "CHECK", &check(true));
        let mut now = row.inputs.clone();
        if let (Some(_), Some(clock)) = (&before, equations.clock()) {
            source.line(&format!("CLOCKF {}", clock.name));
            if row.clocks > 1 {
                let over: Vec<String> = inputs
                    .iter()
                    .filter(|&&(_, input)| vectors.pulses[input] && row.inputs[input])
                    .map(|&(index, _)| literal(index, false))
                    .collect();
                wrapped(source, "SETF", &over);
                now.iter_mut().zip(&vectors.pulses).for_each(|(value, pulse)| *value &= !pulse);
            }
            for _ in 1..row.clocks {
                let still = equations.signals.iter().position(|signal| {
                    matches!(signal.source, Source::Output(id) if vectors.busy == Some(id.index()))
                });
                let still: Vec<String> =
                    still.map(|index| literal(index, true)).into_iter().collect();
                wrapped(source, "CHECK", &still);
                source.line(&format!("CLOCKF {}", clock.name));
            }
        }
        wrapped(source, "CHECK", &check(false));
        before = Some(now);
    }
    source.line("TRACE_OFF");
}

fn literal(signal: &Signal, value: bool) -> String {
    if value { signal.name.clone() } else { format!("/{}", signal.name) }
}

/// The known values of a row: of `mealy` outputs, or of all other outputs and of flip-flops that share no pin with them.
fn checked(equations: &Equations, vectors: &Vectors, row: &VectorRow, mealy: bool) -> Vec<String> {
    let value_of = |(index, signal): (usize, &Signal)| match signal.source {
        Source::Output(id) if vectors.mealy[id.index()] == mealy => row.outputs[id.index()],
        Source::Flop(id) if !mealy => {
            let is_shared = equations.signals.iter().any(|it| it.shared == Some(index));
            row.flops.get(id.index()).copied().flatten().filter(|_| !is_shared)
        }
        Source::Output(_)
        | Source::Flop(_)
        | Source::Clock
        | Source::Input(_)
        | Source::Buried(_) => None,
    };
    let signals = equations.signals.iter().enumerate();
    signals.filter_map(|it| value_of(it).map(|value| literal(it.1, value))).collect()
}

/// Writes a statement with a list of names, unless the list is empty.
fn wrapped<S: AsRef<str>>(source: &mut SourceText, verb: &str, names: &[S]) {
    if names.is_empty() {
        return;
    }
    let mut line = verb.to_owned();
    for name in names {
        if line.len() + name.as_ref().len() > 74 {
            source.line(&line);
            " ".repeat(verb.len()).clone_into(&mut line);
        }
        line.push(' ');
        line.push_str(name.as_ref());
    }
    source.line(&line);
}
