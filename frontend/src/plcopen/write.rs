//! Writes charts as projects: the programs of [`crate::st::write`], drawn in layers from the initial steps down.
//!
//! A transition to a step in the same or a higher row is drawn as a jump. Divergences and convergences are drawn where several transitions
//! or steps meet; competing transitions are ordered from left to right.

use grafsynth_ir::Gather;
use itertools::Itertools as _;
use std::collections::BTreeMap;
use std::fmt::Write;

use grafsynth_ir::Diagnostic;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::Net;

use super::sfc::RESTART;
use crate::st::write::items::{self, Program, Programs, Transition, Var};
use crate::st::write::text::duration;
use crate::xml::text;

/// Distances on the page.
const COLUMN: usize = 240;
const ROW: usize = 160;

/// The value of an attribute in quotes.
fn attribute(value: &str) -> String {
    format!("\"{}\"", crate::xml::attribute(value))
}

/// The project of a net, and warnings about what it cannot contain.
pub(super) fn net(net: &Net) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    let Programs { programs, lost, findings, tick_ns } = items::programs_of(net, "PLCopen XML")?;
    if !findings.is_empty() {
        return Err(findings);
    }
    let mut out = String::new();
    out.push_str("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n");
    out.push_str("<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\" xmlns:xhtml=\"http://www.w3.org/1999/xhtml\">\n");
    // The schema requires a date. It is constant, so that the same chart always gives the same bytes.
    out.push_str("  <fileHeader companyName=\"\" productName=\"grafsynth\" productVersion=\"1\" creationDateTime=\"1970-01-01T00:00:00\"/>\n");
    let name = programs.first().map_or("", |program| program.name.as_str());
    let _ = writeln!(out, "  <contentHeader name={}>", attribute(name));
    out.push_str("    <coordinateInfo><fbd><scaling x=\"1\" y=\"1\"/></fbd><ld><scaling x=\"1\" y=\"1\"/></ld><sfc><scaling x=\"1\" y=\"1\"/></sfc></coordinateInfo>\n");
    out.push_str("  </contentHeader>\n  <types>\n    <dataTypes/>\n    <pous>\n");
    for program in &programs {
        pou(&mut out, program);
    }
    out.push_str("    </pous>\n  </types>\n  <instances>\n    <configurations>\n");
    out.push_str("      <configuration name=\"config\">\n        <resource name=\"resource1\">\n");
    let interval = duration(tick_ns.unwrap_or(10_000_000));
    let _ = writeln!(
        out,
        "          <task name=\"scan\" priority=\"0\" interval={}>",
        attribute(&interval)
    );
    for (index, program) in programs.iter().enumerate() {
        let _ = writeln!(
            out,
            "            <pouInstance name=\"instance{}\" typeName={}/>",
            index + 1,
            attribute(&program.name)
        );
    }
    out.push_str("          </task>\n        </resource>\n      </configuration>\n    </configurations>\n  </instances>\n</project>\n");
    Ok((out, lost))
}

fn structured(lines: &[String]) -> String {
    format!("<ST><xhtml:p>{}</xhtml:p></ST>", text(&lines.join("\n")))
}

fn pou(out: &mut String, program: &Program) {
    let _ = writeln!(out, "      <pou name={} pouType=\"program\">", attribute(&program.name));
    out.push_str("        <interface>\n");
    for (section, vars) in &program.sections {
        let list = match *section {
            "VAR_INPUT" => "inputVars",
            "VAR_OUTPUT" => "outputVars",
            _ => "localVars",
        };
        if vars.is_empty() {
            continue;
        }
        let _ = writeln!(out, "          <{list}>");
        for var in vars {
            variable(out, var);
        }
        let _ = writeln!(out, "          </{list}>");
    }
    out.push_str("        </interface>\n");
    if !program.actions.is_empty() {
        out.push_str("        <actions>\n");
        for action in &program.actions {
            let _ = writeln!(
                out,
                "          <action name={}><body>{}</body>{}</action>",
                attribute(&action.name),
                structured(&action.body),
                documentation(&action.label)
            );
        }
        out.push_str("        </actions>\n");
    }
    out.push_str("        <body>\n          <SFC>\n");
    chart(out, program);
    out.push_str("          </SFC>\n        </body>\n");
    if !program.pragmas.is_empty() {
        let pragmas = program.pragmas.iter().map(|one| format!("{{grafsynth {one}}}")).join(" ");
        let _ = writeln!(
            out,
            "        <documentation><xhtml:p>{}</xhtml:p></documentation>",
            text(&pragmas)
        );
    }
    out.push_str("      </pou>\n");
}

/// The comment of a transition, with the settings that only grafsynth reads.
fn transition_label(transition: &Transition) -> String {
    let label = &transition.label;
    match (transition.restart, label.is_empty()) {
        (false, _) => label.clone(),
        (true, true) => RESTART.to_owned(),
        (true, false) => format!("{label} {RESTART}"),
    }
}

/// Writes a comment of the chart at the end of its element.
fn documentation(label: &str) -> String {
    if label.is_empty() {
        return String::new();
    }
    format!("<documentation><xhtml:p>{}</xhtml:p></documentation>", text(label))
}

fn variable(out: &mut String, var: &Var) {
    let base = match (var.ty, &var.block) {
        (_, Some(block)) => format!("<derived name={}/>", attribute(block)),
        (Type::Bool, None) => "<BOOL/>".to_owned(),
        (Type::Int { lo, hi }, None) => format!(
            "<subrangeSigned><range lower=\"{lo}\" upper=\"{hi}\"/><baseType><DINT/></baseType></subrangeSigned>"
        ),
    };
    let ty = match var.len {
        Some(len) => format!(
            "<array><dimension lower=\"0\" upper=\"{}\"/><baseType>{base}</baseType></array>",
            len.saturating_sub(1)
        ),
        None => base,
    };
    let simple = |value: &str| format!("<simpleValue value={}/>", attribute(value));
    let init = match (var.init.as_slice(), var.len) {
        ([], _) => String::new(),
        ([one], _) if var.block.is_some() => format!(
            "<initialValue><structValue><value member=\"PT\">{}</value></structValue></initialValue>",
            simple(one)
        ),
        ([one], None) => format!("<initialValue>{}</initialValue>", simple(one)),
        (values, len) => {
            let repeated = len.filter(|_| values.len() == 1);
            let values: String = values
                .iter()
                .map(|value| {
                    let count =
                        repeated.map_or(String::new(), |n| format!(" repetitionValue=\"{n}\""));
                    format!("<value{count}>{}</value>", simple(value))
                })
                .collect();
            format!("<initialValue><arrayValue>{values}</arrayValue></initialValue>")
        }
    };
    let address =
        var.address.as_ref().map_or(String::new(), |one| format!(" address={}", attribute(one)));
    let label = documentation(&var.label);
    let _ = writeln!(
        out,
        "            <variable name={}{address}><type>{ty}</type>{init}{label}</variable>",
        attribute(&var.name)
    );
}

/// The chart while it is written, with the positions and numbers of its elements.
struct Page<'p> {
    out: &'p mut String,
    program: &'p Program,
    steps: BTreeMap<&'p str, usize>,
    /// Row and column of each step.
    places: Vec<(usize, usize)>,
    next: usize,
}

impl Page<'_> {
    fn number(&mut self) -> usize {
        self.next += 1;
        self.next
    }

    /// Writes an element with its position, its attributes after the number, and its content.
    fn element(
        &mut self,
        kind: &str,
        id: usize,
        attributes: &str,
        (x, y): (usize, usize),
        content: &str,
    ) {
        let _ = writeln!(
            self.out,
            "            <{kind} localId=\"{id}\"{attributes}><position x=\"{x}\" y=\"{y}\"/>{content}</{kind}>"
        );
    }

    /// The row and column of the first step that a transition leaves.
    fn above(&self, transition: &items::Transition) -> (usize, usize) {
        let step = transition.from.first().and_then(|step| self.steps.get(step.as_str()));
        step.map_or((0, 0), |step| self.places[*step])
    }
}

fn places(program: &Program, steps: &BTreeMap<&str, usize>) -> Vec<(usize, usize)> {
    let mut rows: Vec<Option<usize>> = vec![None; program.steps.len()];
    let mut present: Vec<usize> =
        (0..program.steps.len()).filter(|index| program.steps[*index].is_initial).collect();
    let mut row = 0;
    let mut leaving: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, transition) in program.transitions.iter().enumerate() {
        for step in &transition.from {
            if let Some(step) = steps.get(step.as_str()) {
                leaving.entry(*step).or_default().push(index);
            }
        }
    }
    for step in &present {
        rows[*step] = Some(0);
    }
    loop {
        while !present.is_empty() {
            row += 1;
            let mut below = Vec::new();
            for step in &present {
                for transition in leaving.get(step).into_iter().flatten() {
                    for target in &program.transitions[*transition].to {
                        if let Some(&target) = steps.get(target.as_str())
                            && rows[target].is_none()
                        {
                            rows[target] = Some(row);
                            below.push(target);
                        }
                    }
                }
            }
            present = below;
        }
        // Unreachable steps are drawn at the bottom.
        match rows.iter().position(Option::is_none) {
            Some(step) => {
                rows[step] = Some(row);
                present.push(step);
            }
            None => break,
        }
    }
    let mut used: BTreeMap<usize, usize> = BTreeMap::new();
    rows.into_iter()
        .map(|row| {
            let row = row.unwrap_or(0);
            let column = used.entry(row).or_insert(0);
            *column += 1;
            (row, *column - 1)
        })
        .collect()
}

/// The outgoing end of a wire.
const OUT: &str = "<connectionPointOut/>";

fn point(id: usize) -> String {
    format!("<connectionPointIn><connection refLocalId=\"{id}\"/></connectionPointIn>")
}

fn chart(out: &mut String, program: &Program) {
    let steps: BTreeMap<&str, usize> =
        program.steps.iter().enumerate().map(|(index, step)| (step.name.as_str(), index)).gather();
    let places = places(program, &steps);
    let n_steps = program.steps.len();
    let mut page = Page { out, program, steps, places, next: n_steps + program.transitions.len() };
    let transition_id = |index: usize| n_steps + index + 1;
    let ports = divergences(&mut page);
    // The elements that lead to each step, and the element before the step itself.
    let mut arriving: Vec<Vec<usize>> = vec![Vec::new(); n_steps];
    let mut jumps = Vec::new();
    for (index, transition) in program.transitions.iter().enumerate() {
        let (row, column) = page.above(transition);
        let mut port = transition_id(index);
        if transition.to.len() > 1 {
            port = page.number();
            let outs = "<connectionPointOut formalParameter=\"\"/>".repeat(transition.to.len());
            let content = format!("{}{outs}", point(transition_id(index)));
            let at = (column * COLUMN, row * ROW + 130);
            page.element("simultaneousDivergence", port, "", at, &content);
        }
        for target in &transition.to {
            let Some(&step) = page.steps.get(target.as_str()) else { continue };
            if page.places[step].0 > row {
                arriving[step].push(port);
            } else {
                jumps.push((port, target.clone(), column, row));
            }
        }
    }
    for (index, step) in program.steps.iter().enumerate() {
        let (row, column) = page.places[index];
        let before = match arriving[index].as_slice() {
            [] => String::new(),
            [one] => point(*one),
            many => {
                let id = page.number();
                let ins: String = many.iter().map(|one| point(*one)).collect();
                let at = (column * COLUMN, row * ROW - 20);
                page.element("selectionConvergence", id, "", at, &format!("{ins}{OUT}"));
                point(id)
            }
        };
        let initial = if step.is_initial { " initialStep=\"true\"" } else { "" };
        let size = format!(" height=\"30\" width=\"100\" name={}{initial}", attribute(&step.name));
        let content = format!(
            "{before}<connectionPointOut formalParameter=\"\"/><connectionPointOutAction formalParameter=\"\"/>{}",
            documentation(&step.label)
        );
        page.element("step", index + 1, &size, (column * COLUMN, row * ROW), &content);
        if !step.uses.is_empty() {
            let (id, at) = (page.number(), (column * COLUMN + 110, row * ROW));
            let size = format!(" height=\"{}\" width=\"120\"", 30 * step.uses.len());
            page.element("actionBlock", id, &size, at, &actions(index + 1, step));
        }
    }
    for (index, transition) in program.transitions.iter().enumerate() {
        let (row, column) = page.above(transition);
        let (port, place) = ports.get(index).copied().unwrap_or((0, 0));
        let priority = transition.priority.map_or(String::new(), |n| format!(" priority=\"{n}\""));
        let name = transition.name.as_deref().unwrap_or("");
        let condition = structured(std::slice::from_ref(&transition.condition));
        let content = format!(
            "{}{OUT}<condition><inline name={}>{condition}</inline></condition>{}",
            point(port),
            attribute(name),
            documentation(&transition_label(transition))
        );
        let size = format!(" height=\"2\" width=\"20\"{priority}");
        let at = (column * COLUMN + place * 40, row * ROW + 100);
        page.element("transition", transition_id(index), &size, at, &content);
    }
    for (port, target, column, row) in jumps {
        let id = page.number();
        let size = format!(" height=\"13\" width=\"12\" targetName={}", attribute(&target));
        page.element("jumpStep", id, &size, (column * COLUMN, row * ROW + 140), &point(port));
    }
}

/// Writes divergences below steps and convergences above transitions. Returns, for each transition, the element that it is wired to and its
/// index among the transitions of its step.
fn divergences(page: &mut Page<'_>) -> Vec<(usize, usize)> {
    let program = page.program;
    let mut leaving: Vec<Vec<usize>> = vec![Vec::new(); program.steps.len()];
    for (index, transition) in program.transitions.iter().enumerate() {
        for step in &transition.from {
            if let Some(&step) = page.steps.get(step.as_str()) {
                leaving[step].push(index);
            }
        }
    }
    let mut port_of: Vec<usize> = Vec::new();
    for (step, transitions) in leaving.iter().enumerate() {
        if transitions.len() < 2 {
            port_of.push(step + 1);
            continue;
        }
        let id = page.number();
        let (row, column) = page.places[step];
        let outs = "<connectionPointOut formalParameter=\"\"/>".repeat(transitions.len());
        let at = (column * COLUMN, row * ROW + 60);
        page.element("selectionDivergence", id, "", at, &format!("{}{outs}", point(step + 1)));
        port_of.push(id);
    }
    let mut ports = Vec::new();
    for (index, transition) in program.transitions.iter().enumerate() {
        let sources: Vec<usize> = transition
            .from
            .iter()
            .filter_map(|step| page.steps.get(step.as_str()).copied())
            .collect();
        let first = sources.first().copied().unwrap_or(0);
        // The index among all transitions that share a step with this one, from left to right.
        let place = program.transitions[..index]
            .iter()
            .filter(|other| other.from.iter().any(|step| transition.from.contains(step)))
            .count();
        if sources.len() < 2 {
            ports.push((port_of.get(first).copied().unwrap_or(0), place));
            continue;
        }
        let id = page.number();
        let (row, column) = page.places.get(first).copied().unwrap_or((0, 0));
        let ins: String = sources.iter().map(|step| point(port_of[*step])).collect();
        let at = (column * COLUMN + place * 40, row * ROW + 80);
        page.element("simultaneousConvergence", id, "", at, &format!("{ins}{OUT}"));
        ports.push((id, place));
    }
    ports
}

/// The content of the action block of a step.
fn actions(step: usize, drawn: &items::Step) -> String {
    let mut out = format!("{}\n", point(step));
    for (index, one) in drawn.uses.iter().enumerate() {
        let duration = one
            .duration
            .as_ref()
            .map_or(String::new(), |time| format!(" duration={}", attribute(time)));
        let _ = writeln!(
            out,
            "              <action localId=\"0\" qualifier={}{duration}><relPosition x=\"0\" y=\"{}\"/><reference name={}/></action>",
            attribute(&one.qualifier),
            index * 30,
            attribute(&one.action)
        );
    }
    out.push_str("            ");
    out
}
