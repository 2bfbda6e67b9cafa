//! The worst-case cost of a reaction of emitted C on machines with known constants, the worst-case path, and why the C code has its style.

use super::document::{Block, Inline, Rich, Table};
use super::{Subject, counted};
pub use crate::built::Measured;
use grafsynth_backend_c::cost::{self, Bound, Machine, Way};
use grafsynth_backend_c::{Object, Package, Style};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::PropertyRole;
use std::collections::BTreeMap;

/// The maximum number of rows of a path; the rows with the lowest cost are left out.
const ROWS: usize = 12;

pub(super) fn write(subject: &Subject<'_>) -> Vec<Block> {
    let Some(package) = subject.built.packages.first() else { return Vec::new() };
    let mut blocks = vec![style(package)];
    let mut bounds: Vec<(&Machine, Bound)> = Vec::new();
    let mut table = Table::new([
        "Machine",
        "Reaction at most",
        "Time",
        "Measured",
        "Reset",
        "Stack",
        "Instance",
        "Inputs, outputs",
        "Ring",
        "Code, about",
    ]);
    let mut scans =
        Table::new(["Machine", "`NAME_scan` at most", "`NAME_scan_isr`", "Time", "Stack"]);
    for machine in cost::MACHINES.iter().filter(|machine| machine.is_bounded) {
        let bound = match cost::bound(package, machine) {
            Ok(bound) => bound,
            Err(error) => {
                blocks.extend(no_bound(subject, package, &error.what));
                return blocks;
            }
        };
        let measured = subject.built.measured.iter().find(|it| it.machine == machine.name);
        let yours = user_part(bound.user_calls, bound.user_code);
        let seen = measured.map_or_else(String::new, |it| it.step.to_string());
        let (most, in_time) = match bound.unbounded {
            Some(_) => ("no bound".to_owned(), String::new()),
            None => (format!("{} {}{yours}", bound.step, machine.unit), time(bound.step, machine)),
        };
        table.row([
            machine.about.to_owned(),
            most,
            in_time,
            seen,
            bound.init.to_string(),
            format!("{} B", bound.stack),
            format!("{} B", bound.instance),
            format!("{} B", bound.io),
            if bound.ring == 0 { String::new() } else { format!("{} B", bound.ring) },
            format!("{} B", bound.text),
        ]);
        if let Some(scan) = bound.scan.filter(|_| bound.unbounded.is_none()) {
            let isr = bound.scan_isr.map_or_else(String::new, |it| it.time.to_string());
            let yours = user_part(scan.user_calls, false);
            scans.row([
                machine.about.to_owned(),
                format!("{} {}{yours}", scan.time, machine.unit),
                isr,
                time(scan.time, machine),
                format!("{} B", scan.stack),
            ]);
        }
        bounds.push((machine, bound));
    }
    blocks.push(Block::Table(table));
    if !scans.is_empty() {
        let many = if bounds.iter().any(|(_, bound)| bound.ring > 0) {
            "as many reactions as the event ring has entries, each with at most one event"
        } else {
            "one reaction"
        };
        blocks.push(sentence(format!("A whole scan, with {many}:")));
        blocks.push(Block::Table(scans));
    }
    blocks.extend(ways(&bounds));
    if bounds.iter().any(|(_, bound)| bound.way == Way::Text) {
        blocks.extend(rounds(subject));
    }
    blocks.extend(measured(subject));
    blocks.extend(tasks(subject, &bounds));
    if let Some((machine, bound)) = bounds.first().filter(|(_, it)| it.unbounded.is_none()) {
        blocks.extend(path(subject, package, machine, bound));
    }
    blocks
}

fn sentence(text: impl Into<String>) -> Block {
    Block::Paragraph(Rich::plain(text))
}

/// The text about the parts that the cost of a reaction does not contain: `user_calls` calls of the user's functions, or other code of the user.
fn user_part(user_calls: u64, user_code: bool) -> String {
    match (user_calls, user_code) {
        (0, false) => String::new(),
        (0, true) => " + your code".to_owned(),
        (n, _) => format!(" + {n} of your functions"),
    }
}

/// Why a cost has no bound, and what is known instead.
fn no_bound(subject: &Subject<'_>, package: &Package, why: &str) -> Vec<Block> {
    let why = Inline::Message(why.to_owned());
    let mut blocks = vec![Block::Paragraph(Rich::say("No time bound: {}.", [why]))];
    if let Some(n) = package.instructions {
        blocks.push(sentence(format!(
            "A reaction runs at most {} of the program; the time that the engine needs for one instruction was not counted.",
            counted(n, "instruction", "instructions")
        )));
        blocks.extend(rounds(subject));
    }
    blocks
}

/// The measurements on simulated machines.
fn measured(subject: &Subject<'_>) -> Vec<Block> {
    let mut blocks = Vec::new();
    for it in &subject.built.measured {
        if let Some(machine) = cost::machine(it.machine) {
            let stack = it.stack.map_or_else(String::new, |n| format!(", {n} B of stack"));
            blocks.push(sentence(format!(
                "Measured on {}: {} reactions on random inputs, at most {} {}; {} for the reset{stack}; {} B of code.",
                machine.about, it.reactions, it.step, machine.unit, it.init, it.text
            )));
        }
    }
    blocks
}

/// How the bounds were found, or why one is missing.
fn ways(bounds: &[(&Machine, Bound)]) -> Vec<Block> {
    let mut blocks = Vec::new();
    for (machine, bound) in bounds {
        let how = match bound.way {
            Way::Each(1) => "every reaction from the only reachable instance".to_owned(),
            Way::Each(n) => format!("every reaction from each of the {n} reachable instances"),
            Way::Joined => "all instances together: the possible values of each member, and the worst case of each event".to_owned(),
            Way::Text => {
                let why = bound.open.as_ref().map_or_else(String::new, |why| format!(", because {why}"));
                format!("the C code alone, with the most expensive branch of each `if` and `switch`{why}")
            }
        };
        let how = Inline::Message(how);
        let mut text = Rich::say("Computed for {}: {}.", [machine.about.into(), how]);
        if let Some(why) = &bound.unbounded {
            let why = Inline::Message(why.to_string());
            text = text.and(Rich::say(" No bound: {}.", [why]));
        }
        blocks.push(Block::Paragraph(text));
    }
    blocks
}

/// The chosen style or, if there was a choice, a table of all candidates with their costs.
fn style(package: &Package) -> Block {
    if package.tried.is_empty() {
        let style = package.style.to_string().into();
        return Block::Paragraph(if package.reason.is_empty() {
            Rich::say("Style: {}.", [style])
        } else {
            let reason = Inline::Message(package.reason.to_string());
            Rich::say("Style: {}, because a `switch` does not support {}.", [style, reason])
        });
    }
    let mut table =
        Table::new(["Style", "Reaction at most", "Code, about", "Instance", "Stack", "Chosen"])
            .with_bars(1);
    for candidate in &package.tried {
        let name = if candidate.style == Style::Switch && package.style == "statechart" {
            "switch (statechart)".to_owned()
        } else {
            candidate.style.name().to_owned()
        };
        let taken = if candidate.is_taken { "yes" } else { "" }.to_owned();
        match &candidate.bound {
            Ok(bound) => table.row([
                name,
                bound.step.to_string(),
                format!("{} B", bound.text),
                format!("{} B", bound.instance),
                format!("{} B", bound.stack),
                taken,
            ]),
            Err(why) => {
                table.row([name, why.clone(), String::new(), String::new(), String::new(), taken]);
            }
        }
    }
    Block::Table(table)
}

/// For each task: its cost, whether that was declared or comes from a cost model, and its worst-case cost on each machine.
fn tasks(subject: &Subject<'_>, bounds: &[(&Machine, Bound)]) -> Vec<Block> {
    let net = subject.net;
    if net.steps.values().all(|step| step.tasks.is_empty()) {
        return Vec::new();
    }
    let mut heads = vec!["Step".to_owned(), "Budget".to_owned(), "Task".to_owned()];
    heads.extend(["Cost".to_owned(), "From".to_owned()]);
    heads.extend(bounds.iter().map(|(machine, _)| format!("{} on {}", machine.unit, machine.name)));
    let mut table = Table::of(heads.into_iter().map(Rich::plain).collect());
    for (id, step) in net.steps.iter() {
        for (at, task) in step.tasks.iter().enumerate() {
            let from =
                match subject.counted.filter(|it| it.costs.known.contains_key(&task.meta.span)) {
                    Some(counted) => format!("the model of {}", counted.machine.name),
                    None => "declared".to_owned(),
                };
            let budget =
                if step.budget == u32::MAX { "none".to_owned() } else { step.budget.to_string() };
            let mut row = vec![step.name.text.clone(), budget, task.name.text.clone()];
            row.extend([task.cost.to_string(), from]);
            let calls = if cost::is_counted(net, &task.body) { "" } else { " + yours" };
            row.extend(bounds.iter().map(|(_, bound)| {
                let of_task = |it: &&cost::TaskBound| it.step == id && it.task == at;
                bound
                    .tasks
                    .iter()
                    .find(of_task)
                    .map_or_else(|| "not known".to_owned(), |it| format!("{}{calls}", it.time))
            }));
            table.add(row.into_iter().map(Rich::plain).collect());
        }
    }
    vec![sentence("Tasks, with their worst-case cost:"), Block::Table(table)]
}

/// The number of rounds that the bounds count for the loop over micro-steps, and how this number was proved.
fn rounds(subject: &Subject<'_>) -> Option<Block> {
    let rounds = subject.rounds.as_ref()?;
    let net = subject.net;
    let micro_steps = |n: u32| counted(n, "micro-step", "micro-steps");
    let text = match rounds.proved {
        Some((checks, by)) => {
            let by = match by {
                Proof::Explicit => "all states were enumerated",
                Proof::Symbolic => "from a decision diagram of all states",
                Proof::Structural => "from the structure",
                Proof::Induction => "by induction",
                Proof::Directed => "by property-directed reachability",
            };
            let assumed = net.settings.events_exclusive
                || net.properties.iter().any(|it| it.role == PropertyRole::Assume);
            let while_it_holds =
                if assumed { ", as long as the assumptions of the chart hold" } else { "" };
            format!(
                "The loop over micro-steps is counted {}, including the check that finds nothing: it is proved that no reaction needs more ({by}){while_it_holds}. \
                 The chart would allow {}.",
                counted(checks, "time", "times"),
                micro_steps(rounds.limit)
            )
        }
        None => {
            let why = rounds.open.as_ref().map_or_else(String::new, |why| format!(": {why}"));
            let each = if net.settings.policy.is_statechart() { " for each event" } else { "" };
            format!(
                "The loop over micro-steps is counted up to the limit of the chart, {}{each}, because no smaller number is proved{why}.",
                micro_steps(rounds.limit)
            )
        }
    };
    Some(Block::Paragraph(Rich::message(text)))
}

/// The time of a bound at the clock of the machine.
fn time(units: u64, machine: &Machine) -> String {
    let clocks = u128::from(units) * u128::from(machine.clocks_per_unit);
    let tenths = clocks * 10_000_000 / u128::from(machine.clock_hz.max(1));
    let mhz = machine.clock_hz / 1_000_000;
    format!("{}.{} us at {mhz} MHz", tenths / 10, tenths % 10)
}

/// The worst-case path, by the parts of the chart that its lines come from.
fn path(subject: &Subject<'_>, package: &Package, machine: &Machine, bound: &Bound) -> Vec<Block> {
    let net = subject.net;
    let mut groups: BTreeMap<Vec<Object>, (u64, Vec<u32>)> = BTreeMap::new();
    for place in &bound.path {
        let group = groups.entry(place.objects.clone()).or_default();
        group.0 = group.0.saturating_add(place.time);
        if place.line > 0 {
            group.1.push(place.line);
        }
    }
    let mut rows: Vec<(Vec<Object>, u64, Vec<u32>)> =
        groups.into_iter().map(|(objects, (time, lines))| (objects, time, lines)).collect();
    rows.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.2.cmp(&b.2)));
    let file = package.files.iter().find(|file| {
        file.name.ends_with(".c") && !file.keep_existing && !file.name.ends_with("_tables.c")
    });
    let mut table = Table::new(["Cost", "What", "Chart", "C"]).with_bars(0);
    let more = rows.len().saturating_sub(ROWS);
    let rest: u64 = rows.iter().skip(ROWS).map(|(_, time, _)| *time).sum();
    for (objects, time, lines) in rows.into_iter().take(ROWS) {
        let what = if objects.is_empty() {
            "frame of the reaction".to_owned()
        } else {
            let mut names: Vec<&str> = objects.iter().map(|it| it.name(net)).collect();
            names.dedup();
            names.truncate(4);
            names.join(", ")
        };
        let at = objects.first().map_or_else(String::new, |it| {
            subject
                .sources
                .start(it.span(net))
                .map_or_else(String::new, |at| format!("line {}", at.line))
        });
        let range =
            lines.iter().min().zip(lines.iter().max()).map_or_else(String::new, |(a, b)| {
                if a == b { format!("line {a}") } else { format!("lines {a} to {b}") }
            });
        table.row([time.to_string(), what, at, range]);
    }
    let file = file.map_or(String::new(), |file| file.name.clone());
    let total = format!("{} {} in total", bound.step, machine.unit);
    let words = "The worst-case reaction ({}) takes this path ({}; lines of {}):";
    let about = Rich::say(words, [machine.about.into(), total.into(), Inline::Code(file)]);
    let mut blocks = vec![Block::Paragraph(about), Block::Table(table)];
    if more > 0 {
        blocks.push(sentence(format!("{more} more with {rest} {} in total.", machine.unit)));
    }
    blocks
}
