//! Traces as text: CSV, JSON Lines and VCD, and CSV read back (semantics §11).
#![allow(
    clippy::wildcard_enum_match_arm,
    reason = "a column is text, a number or one of few special kinds"
)]

use grafsynth_ir::Gather;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::io;

use grafsynth_ir::{Diagnostic, FileId, Span};
use vcd::{IdCode, TimescaleUnit, VarType};

use crate::codes;
use crate::csv;
use crate::trace::{ColumnKind, Trace, TraceLayout, TraceRow, Value};

/// The number of errors after which reading stops: a file of another kind has one in every cell.
const MAX_ERRORS: usize = 100;

impl Trace {
    /// The trace as CSV. Equal traces give equal bytes.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let mut text = String::new();
        for (place, column) in self.layout.columns.iter().enumerate() {
            if place > 0 {
                text.push(',');
            }
            text.push_str(&column.name);
        }
        text.push('\n');
        for row in &self.rows {
            for (place, value) in row.values.iter().enumerate() {
                if place > 0 {
                    text.push(',');
                }
                self.layout.write_value(&mut text, value);
            }
            text.push('\n');
        }
        text
    }

    /// The trace as JSON Lines: one object per row with the same fields; `steps` is an array of names, calls with arguments are an array of arrays.
    #[must_use]
    pub fn to_jsonl(&self) -> String {
        let keys: Vec<String> =
            self.layout.columns.iter().map(|column| json_text(&column.name)).collect();
        let names: Vec<String> = self.layout.step_names().map(json_text).collect();
        let mut text = String::new();
        for row in &self.rows {
            text.push('{');
            for (place, (key, value)) in keys.iter().zip(&row.values).enumerate() {
                if place > 0 {
                    text.push(',');
                }
                text.push_str(key);
                text.push(':');
                write_json(&mut text, &names, value);
            }
            text.push_str("}\n");
        }
        text
    }

    /// The trace as a value change dump. It has one unit of time for each row (including rows with `dt` 0), one wire for each column, and one for each step in
    /// the scope `steps`. Integers are two's complement.
    #[must_use]
    pub fn to_vcd(&self) -> String {
        let mut bytes = Vec::new();
        // Writing to a vector cannot fail, and the writer accepts the content of all commands here.
        let _ = self.write_vcd(&mut bytes);
        String::from_utf8(bytes).unwrap_or_default()
    }

    fn write_vcd(&self, bytes: &mut Vec<u8>) -> io::Result<()> {
        let mut writer = vcd::Writer::new(bytes);
        writer.timescale(1, TimescaleUnit::US)?;
        writer.add_module(&vcd_name(&self.layout.name))?;
        let mut wires: Vec<Wire> = Vec::new();
        let n_steps = self.layout.step_names().len();
        for column in &self.layout.columns {
            let name = vcd_name(&column.name);
            wires.push(match column.kind {
                ColumnKind::Steps => {
                    writer.add_module("steps")?;
                    let names: Vec<String> = self.layout.step_names().map(vcd_name).collect();
                    let ids = names
                        .iter()
                        .map(|name| writer.add_wire(1, name))
                        .collect::<io::Result<Vec<IdCode>>>()?;
                    writer.upscope()?;
                    Wire::Steps(ids)
                }
                ColumnKind::Calls(_) => {
                    Wire::Text(writer.add_var(VarType::String, 1, &name, None)?)
                }
                _ => {
                    let (lo, hi) = column.ty.bounds();
                    // A range with negative values needs a sign bit.
                    let magnitude =
                        |value: i64| 64 - (if value < 0 { !value } else { value }).leading_zeros();
                    let width = magnitude(lo).max(magnitude(hi)) + u32::from(lo < 0);
                    let width = width.max(1);
                    Wire::Number(writer.add_wire(width, &name)?, width)
                }
            });
        }
        writer.upscope()?;
        writer.enddefinitions()?;
        let mut before: Option<&TraceRow> = None;
        for (time, row) in self.rows.iter().enumerate() {
            writer.timestamp(time as u64)?;
            for (place, (wire, value)) in wires.iter().zip(&row.values).enumerate() {
                let old = before.and_then(|row| row.values.get(place));
                if old != Some(value) {
                    self.write_change(&mut writer, wire, value, old, n_steps)?;
                }
            }
            before = Some(row);
        }
        writer.timestamp(self.rows.len() as u64)?;
        writer.flush()
    }

    fn write_change(
        &self,
        writer: &mut vcd::Writer<&mut Vec<u8>>,
        wire: &Wire,
        value: &Value,
        old: Option<&Value>,
        n_steps: usize,
    ) -> io::Result<()> {
        match (wire, value) {
            (Wire::Number(id, 1), Value::Number(number)) => writer.change_scalar(*id, *number != 0),
            (Wire::Number(id, width), Value::Number(number)) => writer.change_vector(
                *id,
                (0..*width).rev().map(|bit| vcd::Value::from(number >> bit & 1 == 1)),
            ),
            (Wire::Steps(ids), Value::Steps(active)) => {
                let was_active = |step: u32| match old {
                    Some(Value::Steps(steps)) => Some(steps.binary_search(&step).is_ok()),
                    Some(Value::Number(_) | Value::Calls(_)) | None => None,
                };
                for (step, id) in (0..n_steps as u32).zip(ids) {
                    let is_active = active.binary_search(&step).is_ok();
                    if was_active(step) != Some(is_active) {
                        writer.change_scalar(*id, is_active)?;
                    }
                }
                Ok(())
            }
            (
                Wire::Number(id, _) | Wire::Text(id),
                Value::Number(_) | Value::Steps(_) | Value::Calls(_),
            ) => {
                // VCD does not allow an empty string here.
                let text = self.layout.text(value);
                writer.change_string(*id, if text.is_empty() { "-" } else { &text })
            }
            (Wire::Steps(_), Value::Number(_) | Value::Calls(_)) => Ok(()),
        }
    }

    /// Reads a trace of the net of `layout`.
    ///
    /// # Errors
    /// A header that does not match the net, and every invalid cell (the first hundred).
    pub fn parse_csv(
        layout: &TraceLayout,
        file: FileId,
        text: &str,
    ) -> Result<Trace, Vec<Diagnostic>> {
        let mut lines = csv::lines(text);
        let Some((start, header)) = lines.next() else {
            let place = Span::new(file, text.len(), text.len());
            return Err(vec![
                Diagnostic::error(codes::TRACE_HEADER, "the trace is empty")
                    .at(place, "expected a header"),
            ]);
        };
        check_header(layout, file, start, header)?;
        let steps: BTreeMap<&str, u32> = layout.step_names().zip(0..).gather();
        let mut trace = Trace::new(layout.clone());
        let mut errors = Vec::new();
        for (start, line) in lines {
            let mut values = Vec::with_capacity(layout.columns.len());
            let mut n_cells = 0;
            for (place, cell) in csv::cells(file, start, line).enumerate() {
                n_cells = place + 1;
                let Some(column) = layout.columns.get(place) else { continue };
                match parse_value(column.kind, cell.text, &steps) {
                    Some(value) => values.push(value),
                    None => errors.push(
                        Diagnostic::error(
                            codes::TRACE_CELL,
                            format!("`{}` is not valid in column `{}`", cell.text, column.name),
                        )
                        .at(cell.span, expected(column.kind)),
                    ),
                }
            }
            if n_cells != layout.columns.len() {
                errors.push(
                    Diagnostic::error(
                        codes::CELL_COUNT,
                        format!(
                            "wrong number of cells in this row: expected {}, found {n_cells}",
                            layout.columns.len()
                        ),
                    )
                    .at(Span::new(file, start, start + line.len()), "")
                    .help("write one cell for each column of the header"),
                );
            }
            if errors.len() >= MAX_ERRORS {
                break;
            }
            trace.rows.push(TraceRow { values, open: Vec::new() });
        }
        if errors.is_empty() { Ok(trace) } else { Err(errors) }
    }
}

/// The VCD representation of a column.
enum Wire {
    Number(IdCode, u32),
    Steps(Vec<IdCode>),
    Text(IdCode),
}

/// The name of a column in VCD, which would read a bracket after a name as a range of bits.
fn vcd_name(name: &str) -> String {
    if name.is_empty() {
        return "_".to_owned();
    }
    name.chars()
        .map(|c| match c {
            '[' => '(',
            ']' => ')',
            c if c.is_whitespace() || c.is_control() => '_',
            c => c,
        })
        .collect()
}

fn json_text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn write_json(text: &mut String, names: &[String], value: &Value) {
    // Writing into a String cannot fail.
    match value {
        Value::Number(number) => {
            let _ = write!(text, "{number}");
        }
        Value::Steps(steps) => {
            let shown: Vec<&str> = steps
                .iter()
                .filter_map(|step| names.get(*step as usize))
                .map(String::as_str)
                .collect();
            let _ = write!(text, "[{}]", shown.join(","));
        }
        Value::Calls(calls) => {
            let shown: Vec<String> = calls
                .iter()
                .map(|call| {
                    let arguments: Vec<String> = call.iter().map(i64::to_string).collect();
                    format!("[{}]", arguments.join(","))
                })
                .collect();
            let _ = write!(text, "[{}]", shown.join(","));
        }
    }
}

fn check_header(
    layout: &TraceLayout,
    file: FileId,
    start: usize,
    header: &str,
) -> Result<(), Vec<Diagnostic>> {
    let mut n_cells = 0;
    for (place, cell) in csv::cells(file, start, header).enumerate() {
        n_cells = place + 1;
        let message = match layout.columns.get(place) {
            Some(column) if column.name == cell.text => continue,
            Some(column) => format!(
                "column {} is `{}`, but the chart has `{}` there",
                place + 1,
                cell.text,
                column.name
            ),
            None => format!("the chart has no column {} (`{}`)", place + 1, cell.text),
        };
        return Err(vec![
            Diagnostic::error(codes::TRACE_HEADER, message)
                .at(cell.span, "")
                .help("use a trace of this version of the chart"),
        ]);
    }
    if n_cells < layout.columns.len() {
        return Err(vec![
            Diagnostic::error(
                codes::TRACE_HEADER,
                format!("the trace has {n_cells} columns, the chart {}", layout.columns.len()),
            )
            .at(Span::new(file, start, start + header.len()), "")
            .help("use a trace of this version of the chart"),
        ]);
    }
    Ok(())
}

fn parse_value(kind: ColumnKind, text: &str, steps: &BTreeMap<&str, u32>) -> Option<Value> {
    match kind {
        ColumnKind::Steps => {
            let found: Option<Vec<u32>> =
                text.split_whitespace().map(|name| steps.get(name).copied()).collect();
            found.map(Value::Steps)
        }
        ColumnKind::Calls(_) if text.is_empty() => Some(Value::Calls(Vec::new())),
        ColumnKind::Calls(_) => {
            let call = |text: &str| {
                text.split(':').map(|argument| argument.parse().ok()).collect::<Option<Vec<i64>>>()
            };
            text.split(';').map(call).collect::<Option<Vec<Vec<i64>>>>().map(Value::Calls)
        }
        _ => text.parse().ok().map(Value::Number),
    }
}

fn expected(kind: ColumnKind) -> &'static str {
    match kind {
        ColumnKind::Steps => "expected step names separated by one space",
        ColumnKind::Calls(_) => "expected calls such as `3:1;0:2`",
        _ => "expected a number",
    }
}
