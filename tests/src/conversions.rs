//! Charts in other languages, read back: a written chart behaves like the original, or is rejected.

use grafsynth_driver::convert::convert;
use grafsynth_driver::languages::Language;
use grafsynth_driver::read::{Design, NetDesign, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Valid};
use grafsynth_sim::{ColumnKind, Stimulus, Trace, Value, run};
use itertools::Itertools as _;
use std::collections::{BTreeMap, BTreeSet};

/// The result for one chart in one language.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Came {
    /// The language cannot express it, with the first reason.
    Refused(String),
    /// Written and read back with the same behaviour; contains the number of reported losses.
    Alike(usize),
    /// Written with a documented difference in behaviour: delays that end in the same row take effect one after the other.
    Said,
    /// The chart that was read back behaves differently, or cannot be read back; contains the evidence.
    Otherwise(String),
}

/// Reads the chart of a text.
///
/// # Errors
/// Returns the messages of its errors.
pub fn design_of(file: &str, text: &str) -> Result<Box<NetDesign>, String> {
    let mut sources = Sources::default();
    let main = sources.add(file, text);
    match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()) {
        (Some(Design::Net(design)), _) => Ok(design),
        (Some(Design::Logic(_)), _) => Err("it is logic".to_owned()),
        (None, found) => {
            let messages = found.iter().filter(|one| one.is_error());
            Err(messages.map(|one| one.message.as_str()).join("; "))
        }
    }
}

/// The languages of charts that are written and read back.
pub const FORMS: [&str; 6] = ["graf", "rules", "scxml", "st", "plcopen", "net"];

/// The row of a language.
///
/// # Panics
/// If no language has that name.
#[must_use]
pub fn language(name: &str) -> &'static Language {
    Language::named(name).unwrap_or_else(|| panic!("no language {name}"))
}

/// Converts a chart to another language and back, and from there to a third one and back.
#[must_use]
pub fn there_and_back(chart: &NetDesign, to: &str, seed: u64) -> Came {
    let (came, again) = one_way(chart, to, seed);
    if let Some(again) = again {
        let next = FORMS[(seed % FORMS.len() as u64) as usize];
        if let (Came::Otherwise(why), _) = one_way(&again, next, seed) {
            let text = convert(&Design::Net(again), language(to))
                .map_or_else(|_| String::new(), |it| it.text);
            return Came::Otherwise(format!("from there to {next}: {why}\n{text}"));
        }
    }
    came
}

/// A chart in another language, and the chart that is read back if it behaves alike.
fn one_way(chart: &NetDesign, to: &str, seed: u64) -> (Came, Option<Box<NetDesign>>) {
    match written(chart, to, seed) {
        Ok((n_lost, again)) => (Came::Alike(n_lost), Some(again)),
        Err(came) => (came, None),
    }
}

fn written(chart: &NetDesign, to: &str, seed: u64) -> Result<(usize, Box<NetDesign>), Came> {
    let converted = match convert(&Design::Net(Box::new(chart.clone())), language(to)) {
        Ok(converted) => converted,
        Err(found) => {
            let why = found.first().map_or_else(String::new, |one| one.message.clone());
            return Err(Came::Refused(why));
        }
    };
    let file = format!("a.{}", language(to).extension());
    let again = match design_of(&file, &converted.text) {
        Ok(again) => again,
        Err(why) => {
            return Err(Came::Otherwise(format!("not read back: {why}\n{}", converted.text)));
        }
    };
    // The new names of renamed objects.
    let mut names: BTreeMap<String, String> = BTreeMap::new();
    for one in &converted.lost {
        let message = one.message.strip_suffix(" in the document").unwrap_or(&one.message);
        if let Some((old, new)) = message.split_once(" is renamed to ") {
            let old = old.strip_prefix("the event ").unwrap_or(old);
            names.insert(old.trim_matches('`').to_owned(), new.trim_matches('`').to_owned());
        }
    }
    let is_said = converted.lost.iter().any(|one| one.message.ends_with("one after the other"));
    for round in 0..3 {
        let stimulus = Stimulus::random(&chart.net, 60, seed + round, 3);
        if let Err(why) = alike(&chart.net, &again.net, &stimulus, &names) {
            let why = format!("{why}\n{}", converted.text);
            return Err(if is_said { Came::Said } else { Came::Otherwise(why) });
        }
    }
    Ok((converted.lost.len(), again))
}

/// Compares the columns of both traces under the names in the second one.
fn alike(
    net: &Valid<Net>,
    other: &Valid<Net>,
    stimulus: &Stimulus,
    names: &BTreeMap<String, String>,
) -> Result<(), String> {
    let new = |name: &str| names.get(name).cloned().unwrap_or_else(|| name.to_owned());
    let csv = stimulus.to_csv(net);
    let (head, rows) = csv.split_once('\n').unwrap_or((&csv, ""));
    let head = head.split(',').map(new).join(",");
    let csv = format!("{head}\n{rows}");
    let (parsed, found) = Stimulus::parse_csv(other, FileId(0), &csv);
    let parsed = parsed.ok_or_else(|| format!("other inputs: {found:?}"))?;
    let (first, second) = (run(net, stimulus), run(other, &parsed));
    for (at, column) in first.layout.columns.iter().enumerate() {
        let name = new(&column.name);
        let is_own = |kind: ColumnKind| {
            matches!(
                kind,
                ColumnKind::Output(_)
                    | ColumnKind::Calls(_)
                    | ColumnKind::Var(_)
                    | ColumnKind::Element(..)
            )
        };
        let twin = second.layout.columns.iter().position(|other| match column.kind {
            ColumnKind::Steps => other.kind == ColumnKind::Steps,
            ColumnKind::Fault => other.kind == ColumnKind::Fault,
            _ => is_own(column.kind) && is_own(other.kind) && other.name == name,
        });
        let Some(twin) = twin else {
            if is_own(column.kind) || column.kind == ColumnKind::Steps {
                return Err(format!("no column {name}"));
            }
            continue;
        };
        for row in 0..first.rows.len() {
            let left = cell(&first, at, row, &new);
            let right = cell(&second, twin, row, &|name| name.to_owned());
            if left != right {
                return Err(format!("row {row}, {}: {left:?} and {right:?}", column.name));
            }
        }
    }
    Ok(())
}

/// A cell as text: the names of steps, or a value.
fn cell(
    trace: &Trace,
    column: usize,
    row: usize,
    new: &dyn Fn(&str) -> String,
) -> BTreeSet<String> {
    match trace.rows.get(row).map(|row| &row.values[column]) {
        Some(Value::Steps(steps)) => {
            let names: Vec<&str> = trace.layout.step_names().collect();
            steps.iter().map(|step| new(names[*step as usize])).collect()
        }
        Some(value) => [trace.layout.text(value)].into(),
        None => BTreeSet::new(),
    }
}
