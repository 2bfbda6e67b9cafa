//! Traces as waveforms, for `--trace FILE.svg`.

use grafsynth_draw::waves::{Group, Signal, Waves};
use grafsynth_ir::expr::Type;
use grafsynth_sim::{ColumnKind, Trace, Value};

/// The waveforms of a trace: inputs, steps, outputs and variables.
pub(crate) fn of_trace(trace: &Trace) -> Waves {
    let layout = &trace.layout;
    let mut signals = Vec::new();
    let mut ticks: Vec<u64> = vec![0; trace.rows.len()];
    for (index, column) in layout.columns.iter().enumerate() {
        let values = || {
            trace.rows.iter().map(|row| {
                let is_open = row.open.get(index) == Some(&true);
                row.values.get(index).filter(|_| !is_open)
            })
        };
        let numbers = || {
            let number = |value: &Value| match value {
                Value::Number(number) => *number,
                Value::Steps(steps) => i64::try_from(steps.len()).unwrap_or(i64::MAX),
                Value::Calls(calls) => i64::try_from(calls.len()).unwrap_or(i64::MAX),
            };
            values().map(|value| value.map(number)).collect::<Vec<Option<i64>>>()
        };
        let group = match column.kind {
            ColumnKind::Scan => continue,
            ColumnKind::Dt => {
                let mut sum = 0_u64;
                for (tick, dt) in ticks.iter_mut().zip(numbers()) {
                    sum = sum.saturating_add(u64::try_from(dt.unwrap_or(0)).unwrap_or(0));
                    *tick = sum;
                }
                continue;
            }
            ColumnKind::Steps => {
                for (step, name) in (0_u32..).zip(layout.step_names()) {
                    let is_active = |value: Option<&Value>| match value {
                        Some(Value::Steps(active)) => Some(i64::from(active.contains(&step))),
                        _ => None,
                    };
                    let values = values().map(is_active).collect();
                    let name = name.to_owned();
                    signals.push(Signal { name, group: Group::Step, is_bool: true, values });
                }
                continue;
            }
            ColumnKind::Input(_) => Group::Input,
            ColumnKind::Output(_) | ColumnKind::Calls(_) => Group::Output,
            ColumnKind::Var(_) | ColumnKind::Element(..) => Group::Variable,
            ColumnKind::Fault => {
                let values = numbers();
                if values.iter().all(|value| *value == Some(0)) {
                    continue;
                }
                Group::Variable
            }
        };
        let is_bool = column.ty == Type::Bool;
        signals.push(Signal { name: column.name.clone(), group, is_bool, values: numbers() });
    }
    signals.sort_by_key(|signal| signal.group);
    Waves { ticks, signals, ..Waves::default() }
}
