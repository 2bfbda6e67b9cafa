//! Writes charts as text.
//!
//! These parts read back as the same net: steps, transitions with priorities, Boolean actions and actions with lists in all qualifiers,
//! integers (as subranges, which do not wrap), arrays, settings (as pragmas). A continuous output becomes an action of its steps, which has
//! the same value in every row of a trace.

mod flat;
pub(crate) mod items;
mod lists;
pub(crate) mod text;

use std::fmt::Write;

use grafsynth_ir::Diagnostic;
use grafsynth_ir::net::Net;

use items::{Program, Programs};

/// The text of a net, and warnings about what the text cannot contain.
pub(super) fn net(net: &Net) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    let Programs { programs, lost, findings, tick_ns } =
        items::programs_of(net, "structured text")?;
    if !findings.is_empty() {
        return Err(findings);
    }
    let mut out = String::new();
    for program in &programs {
        write_program(&mut out, program);
    }
    let _ = writeln!(out, "CONFIGURATION config");
    let _ = writeln!(out, "    RESOURCE resource1 ON plc");
    let _ = writeln!(
        out,
        "        TASK scan(INTERVAL := {}, PRIORITY := 0);",
        text::duration(tick_ns.unwrap_or(10_000_000))
    );
    for (index, program) in programs.iter().enumerate() {
        let _ =
            writeln!(out, "        PROGRAM instance{} WITH scan : {};", index + 1, program.name);
    }
    let _ = writeln!(out, "    END_RESOURCE");
    let _ = writeln!(out, "END_CONFIGURATION");
    Ok((out, lost))
}

fn comment(label: &str) -> String {
    if label.is_empty() { String::new() } else { format!(" (* {label} *)") }
}

fn write_program(out: &mut String, program: &Program) {
    let _ = writeln!(out, "PROGRAM {}", program.name);
    for pragma in &program.pragmas {
        let _ = writeln!(out, "{{grafsynth {pragma}}}");
    }
    for (section, vars) in &program.sections {
        if vars.is_empty() {
            continue;
        }
        let _ = writeln!(out, "{section}");
        for var in vars {
            let address = var.address.as_ref().map_or(String::new(), |one| format!(" AT {one}"));
            let init = match var.init.as_slice() {
                [] => String::new(),
                [one] if var.block.is_some() => format!(" := (PT := {one})"),
                [one] if var.len.is_none() => format!(" := {one}"),
                [one] => format!(" := [{}({one})]", var.len.unwrap_or(1)),
                many => format!(" := [{}]", many.join(", ")),
            };
            let _ = writeln!(
                out,
                "    {}{address} : {}{init};{}",
                var.name,
                var.ty_text(),
                comment(&var.label)
            );
        }
        let _ = writeln!(out, "END_VAR");
    }
    for step in &program.steps {
        let word = if step.is_initial { "INITIAL_STEP" } else { "STEP" };
        let _ = write!(out, "\n{word} {}:{}", step.name, comment(&step.label));
        if step.uses.is_empty() {
            let _ = writeln!(out, " END_STEP");
            continue;
        }
        let _ = writeln!(out);
        for one in &step.uses {
            let duration = one.duration.as_ref().map_or(String::new(), |ns| format!(", {ns}"));
            let _ = writeln!(out, "    {}({}{duration});", one.action, one.qualifier);
        }
        let _ = writeln!(out, "END_STEP");
    }
    for transition in &program.transitions {
        let name = transition.name.as_ref().map_or(String::new(), |name| format!(" {name}"));
        let priority = transition.priority.map_or(String::new(), |n| format!(" (PRIORITY := {n})"));
        let _ = writeln!(
            out,
            "\nTRANSITION{name}{priority} FROM {} TO {}{}\n    := {};\nEND_TRANSITION{}",
            side(&transition.from),
            side(&transition.to),
            if transition.restart { " {grafsynth restart}" } else { "" },
            transition.condition,
            comment(&transition.label)
        );
    }
    for action in &program.actions {
        let _ = writeln!(out, "\nACTION {}:{}", action.name, comment(&action.label));
        for line in &action.body {
            let _ = writeln!(out, "    {line}");
        }
        let _ = writeln!(out, "END_ACTION");
    }
    let _ = writeln!(out, "END_PROGRAM\n");
}

fn side(steps: &[String]) -> String {
    match steps {
        [one] => one.clone(),
        many => format!("({})", many.join(", ")),
    }
}
