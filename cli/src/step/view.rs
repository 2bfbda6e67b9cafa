//! What a session shows after each reaction, as lines of text.

use grafsynth_ir::net::{Net, StepId, TransitionId};
use grafsynth_ir::text::print_condition;
use grafsynth_ir::{diag, names};
use grafsynth_sim::{
    ColumnKind, Counter, Effect, Frame, Reason, Running, Stepper, Wait, WaitState,
};

/// The number of transitions that are listed; the others are counted.
const WAITS: usize = 60;

/// The lines about the last reaction and the next one. `key` gives the key of an input, if keys are used.
pub(super) fn lines(
    stepper: &Stepper<'_>,
    dt: u32,
    key: &dyn Fn(usize) -> Option<char>,
) -> Vec<String> {
    let simulator = stepper.simulator();
    let net = simulator.net();
    let mut lines = vec![headline(stepper, net)];
    let mut add = |title: &str, text: String| {
        if !text.is_empty() {
            lines.push(format!("  {title:<9} {text}"));
        }
    };
    add("steps", values(stepper, |kind| kind == ColumnKind::Steps));
    add("inputs", inputs(stepper, net, key));
    add("outputs", values(stepper, |kind| matches!(kind, ColumnKind::Output(_))));
    let is_variable = |kind| matches!(kind, ColumnKind::Var(_) | ColumnKind::Element(..));
    add("variables", values(stepper, is_variable));
    add("calls", calls(stepper, net));
    add("fault", if simulator.row().fault { "1".to_owned() } else { String::new() });
    add("fired", transitions(net, simulator.fired()));
    for (at, timer) in stepper.turns().running(simulator).iter().enumerate() {
        add(if at == 0 { "timers" } else { "" }, running(net, timer));
    }
    let waits = stepper.waits(dt);
    for (at, wait) in waits.iter().take(WAITS).enumerate() {
        add(if at == 0 { "next" } else { "" }, waiting(net, wait));
    }
    if waits.len() > WAITS {
        add("", format!("and {} more transitions", waits.len() - WAITS));
    }
    if let Some(broken) = stepper.broken() {
        add(
            "note",
            format!(
                "reaction {broken} violates an assumption of the chart: from this reaction on, the chart specifies no values"
            ),
        );
    }
    lines.iter().map(|line| clean(line)).collect()
}

/// A line without characters that would change the terminal.
pub(super) fn clean(line: &str) -> String {
    line.chars().map(|c| if names::is_unseen(c) { '?' } else { c }).collect()
}

fn headline(stepper: &Stepper<'_>, net: &Net) -> String {
    let time = time(net, i64::try_from(stepper.ticks()).unwrap_or(i64::MAX));
    match stepper.len() {
        0 => format!("{}: start", net.name),
        n => format!("{}: reaction {n}, time {time}", net.name),
    }
}

/// The cells of some columns: the active steps, or values as `NAME=VALUE`. `*` marks those that the last reaction changed, and `?` those that the chart leaves
/// open.
fn values(stepper: &Stepper<'_>, is_shown: fn(ColumnKind) -> bool) -> String {
    let row = stepper.row();
    let mut all = Vec::new();
    for (at, column) in stepper.layout().columns.iter().enumerate() {
        let Some(value) = row.values.get(at).filter(|_| is_shown(column.kind)) else { continue };
        let before = stepper.row_before().and_then(|before| before.values.get(at));
        let is_new = before.is_some_and(|before| before != value);
        let is_open = row.open.get(at).copied().unwrap_or(false);
        let name = if column.kind == ColumnKind::Steps { "" } else { column.name.as_str() };
        let sign = if name.is_empty() { "" } else { "=" };
        let (new, open) = (if is_new { "*" } else { "" }, if is_open { "?" } else { "" });
        all.push(format!("{name}{sign}{}{new}{open}", stepper.layout().text(value)));
    }
    all.join(" ")
}

/// The inputs of the next reaction, each after its key.
fn inputs(stepper: &Stepper<'_>, net: &Net, key: &dyn Fn(usize) -> Option<char>) -> String {
    let shown = stepper.layout().columns.iter().filter_map(|column| match column.kind {
        ColumnKind::Input(input) => Some(input),
        _ => None,
    });
    let text = |(at, input)| {
        let key = key(at).map_or(String::new(), |key| format!("[{key}] "));
        format!("{key}{}={}", net.inputs[input].name, stepper.input(input))
    };
    let all: Vec<String> = shown.enumerate().map(text).collect();
    all.join(if key(0).is_some() { "  " } else { " " })
}

fn calls(stepper: &Stepper<'_>, net: &Net) -> String {
    let text = |effect: &Effect| match effect {
        Effect::Call(output, arguments) => {
            let arguments: Vec<String> = arguments.iter().map(i64::to_string).collect();
            Some(format!("{}({})", net.outputs[*output].name, arguments.join(", ")))
        }
        Effect::Condition(_) => None,
        Effect::Code(code) => Some(format!("code in {} (not run)", code.language)),
    };
    let all: Vec<String> = stepper.simulator().effects().iter().filter_map(text).collect();
    all.join(" ")
}

fn transitions(net: &Net, all: &[TransitionId]) -> String {
    let names: Vec<&str> = all.iter().map(|it| net.transitions[*it].name.text.as_str()).collect();
    names.join(", ")
}

fn steps(net: &Net, all: &[StepId]) -> String {
    let names: Vec<&str> = all.iter().map(|it| net.steps[*it].name.text.as_str()).collect();
    if names.is_empty() { "no step".to_owned() } else { names.join(", ") }
}

/// `p2.t = 1.8 s, next threshold in 1.2 s`
fn running(net: &Net, timer: &Running) -> String {
    let name = match timer.counter {
        Counter::Elapsed(step) => format!("{}.t", net.steps[step].name),
        Counter::LastElapsed(step) => format!("{}.T", net.steps[step].name),
        Counter::Timer(timer) => net.timers[timer].name.to_string(),
        Counter::Action(action) => net.actions[action].name.to_string(),
        Counter::Send(send) => net.sends[send].name.to_string(),
    };
    let left = timer.left.iter().filter(|left| **left > 0).min();
    let (sign, left) = match left {
        Some(left) => (" =", format!("next threshold in {}", time(net, *left))),
        // It stays one above its largest threshold.
        None => (" >=", "past its thresholds".to_owned()),
    };
    format!("{name}{sign} {}, {left}", time(net, timer.ticks))
}

/// `t2 from p2 waits for 3 s in p2 (1.2 s left) and b`
fn waiting(net: &Net, wait: &Wait) -> String {
    let transition = &net.transitions[wait.transition];
    let from = match transition.requires.as_slice() {
        [] => String::new(),
        requires => format!(" from {}", steps(net, requires)),
    };
    let reasons: Vec<String> = wait.reasons.iter().map(|reason| because(net, reason)).collect();
    let state = match wait.state {
        WaitState::Fires => "fires next".to_owned(),
        WaitState::Fireable => {
            "could fire, but another transition or a forcing order has priority".to_owned()
        }
        WaitState::Enabled | WaitState::Near => format!("waits for {}", reasons.join(" and ")),
    };
    format!("{}{from} {state}", transition.name)
}

fn because(net: &Net, reason: &Reason) -> String {
    match reason {
        Reason::Step(step) => format!("step {}", net.steps[*step].name),
        Reason::Event(events) => {
            let names: Vec<&str> =
                events.iter().map(|event| net.inputs[*event].name.text.as_str()).collect();
            format!("event {}", names.join(" or "))
        }
        Reason::Time { step, limit, left } => {
            let (limit, left) = (time(net, *limit), time(net, *left));
            format!("{limit} in {} ({left} left)", net.steps[*step].name)
        }
        Reason::Condition(expr) => print_condition(net, expr),
    }
}

/// One micro-step of the last reaction.
pub(super) fn micro_step(net: &Net, number: usize, of: usize, frame: &Frame) -> Vec<String> {
    vec![
        format!("{}: micro-step {number} of {of}", net.name),
        format!("  steps     {}", clean(&steps(net, &frame.before))),
        format!("  fires     {}", clean(&transitions(net, &frame.fired))),
    ]
}

/// A number of ticks as a time: `300 ms`, `1.2 s`.
pub(super) fn time(net: &Net, ticks: i64) -> String {
    const SECOND: u64 = 1_000_000_000;
    let ns = net.settings.tick_ns.saturating_mul(ticks.unsigned_abs());
    if ns < SECOND || ns.is_multiple_of(SECOND) {
        return diag::duration(ns);
    }
    let fraction = format!("{:09}", ns % SECOND);
    format!("{}.{} s", ns / SECOND, fraction.trim_end_matches('0'))
}
