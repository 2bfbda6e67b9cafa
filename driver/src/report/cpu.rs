//! The worst-case cost of a reaction of emitted C on machines with known constants, the worst-case path, and why the C code has its style.

use super::{Subject, counted, table::Table};
pub use crate::built::Measured;
use grafsynth_backend_c::cost::{self, Bound, Machine, Way};
use grafsynth_backend_c::{Object, Package, Style};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::PropertyRole;
use std::collections::BTreeMap;

/// The maximum number of rows of a path; the rows with the lowest cost are left out.
const ROWS: usize = 12;

pub(super) fn write(subject: &Subject<'_>) -> Option<String> {
    let package = subject.built.packages.first()?;
    let mut text = style(package);
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
                text += &no_bound(subject, package, &error.what);
                return Some(text);
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
    text += &table.text();
    if !scans.is_empty() {
        let many = if bounds.iter().any(|(_, bound)| bound.ring > 0) {
            "as many reactions as the event ring has entries, each with at most one event"
        } else {
            "one reaction"
        };
        text += &format!("\nA whole scan, with {many}:\n\n{}", scans.text());
    }
    text += &ways(&bounds);
    if bounds.iter().any(|(_, bound)| bound.way == Way::Text) {
        text += &rounds(subject);
    }
    text += &measured(subject);
    text += &tasks(subject, &bounds);
    if let Some((machine, bound)) = bounds.first().filter(|(_, it)| it.unbounded.is_none()) {
        text += &path(subject, package, machine, bound);
    }
    Some(text)
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
fn no_bound(subject: &Subject<'_>, package: &Package, why: &str) -> String {
    let mut text = format!("No time bound: {why}.\n");
    if let Some(n) = package.instructions {
        text += &format!(
            "\nA reaction runs at most {} of the program; the time that the engine needs for one instruction was not counted.\n",
            counted(n, "instruction", "instructions")
        );
        text += &rounds(subject);
    }
    text
}

/// The measurements on simulated machines.
fn measured(subject: &Subject<'_>) -> String {
    let mut text = String::new();
    for it in &subject.built.measured {
        if let Some(machine) = cost::machine(it.machine) {
            let stack = it.stack.map_or_else(String::new, |n| format!(", {n} B of stack"));
            text += &format!(
                "\nMeasured on {}: {} reactions on random inputs, at most {} {}; {} for the reset{stack}; {} B of code.\n",
                machine.about, it.reactions, it.step, machine.unit, it.init, it.text
            );
        }
    }
    text
}

/// How the bounds were found, or why one is missing.
fn ways(bounds: &[(&Machine, Bound)]) -> String {
    let mut text = String::new();
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
        text += &format!("\nComputed for {}: {how}.", machine.about);
        if let Some(why) = &bound.unbounded {
            text += &format!(" No bound: {why}.");
        }
        text += "\n";
    }
    text
}

/// The chosen style or, if there was a choice, a table of all candidates with their costs.
fn style(package: &Package) -> String {
    if package.tried.is_empty() {
        let why = if package.reason.is_empty() {
            String::new()
        } else {
            format!(", because a `switch` does not support {}", package.reason)
        };
        return format!("Style: {}{why}.\n\n", package.style);
    }
    let mut table =
        Table::new(["Style", "Reaction at most", "Code, about", "Instance", "Stack", "Chosen"]);
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
    format!("{}\n", table.text())
}

/// For each task: its cost, whether that was declared or comes from a cost model, and its worst-case cost on each machine.
fn tasks(subject: &Subject<'_>, bounds: &[(&Machine, Bound)]) -> String {
    let net = subject.net;
    if net.steps.values().all(|step| step.tasks.is_empty()) {
        return String::new();
    }
    let mut heads = vec!["Step".to_owned(), "Budget".to_owned(), "Task".to_owned()];
    heads.extend(["Cost".to_owned(), "From".to_owned()]);
    heads.extend(bounds.iter().map(|(machine, _)| format!("{} on {}", machine.unit, machine.name)));
    let mut table = Table::of(heads);
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
            table.add(&row);
        }
    }
    format!("\nTasks, with their worst-case cost:\n\n{}", table.text())
}

/// The number of rounds that the bounds count for the loop over micro-steps, and how this number was proved.
fn rounds(subject: &Subject<'_>) -> String {
    let Some(rounds) = &subject.rounds else { return String::new() };
    let net = subject.net;
    let micro_steps = |n: u32| counted(n, "micro-step", "micro-steps");
    match rounds.proved {
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
                "\nThe loop over micro-steps is counted {}, including the check that finds nothing: it is proved that no reaction needs more ({by}){while_it_holds}. \
                 The chart would allow {}.\n",
                counted(checks, "time", "times"),
                micro_steps(rounds.limit)
            )
        }
        None => {
            let why = rounds.open.as_ref().map_or_else(String::new, |why| format!(": {why}"));
            let each = if net.settings.policy.is_statechart() { " for each event" } else { "" };
            format!(
                "\nThe loop over micro-steps is counted up to the limit of the chart, {}{each}, because no smaller number is proved{why}.\n",
                micro_steps(rounds.limit)
            )
        }
    }
}

/// The time of a bound at the clock of the machine.
fn time(units: u64, machine: &Machine) -> String {
    let clocks = u128::from(units) * u128::from(machine.clocks_per_unit);
    let tenths = clocks * 10_000_000 / u128::from(machine.clock_hz.max(1));
    let mhz = machine.clock_hz / 1_000_000;
    format!("{}.{} us at {mhz} MHz", tenths / 10, tenths % 10)
}

/// The worst-case path, by the parts of the chart that its lines come from.
fn path(subject: &Subject<'_>, package: &Package, machine: &Machine, bound: &Bound) -> String {
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
    let mut table = Table::new(["Cost", "What", "Chart", "C"]);
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
    let mut text = format!(
        "\nThe worst-case reaction ({}) takes this path ({} {} in total; lines of `{}`):\n\n{}",
        machine.about,
        bound.step,
        machine.unit,
        file.map_or("", |file| file.name.as_str()),
        table.text()
    );
    if more > 0 {
        text += &format!("\n{} more with {rest} {} in total.\n", more, machine.unit);
    }
    text
}
