//! Pass `declarations`: initial and safe values, and the conditions of timers.

use super::codes;
use super::context::{Lowering, Outcome, Role, ScopeId, Symbol, Value, Work};
use super::place::Place;
use crate::chart::{DeclarationKind, Expr as Syntax};
use crate::diag::{Code, Diagnostic, Notation};
use crate::expr::Type;
use crate::span::Name;

/// Lowers initial values, safe values and the conditions of timers. Runs after `roles`, because the condition of a timer may read a stored output.
pub(super) fn declarations(lowering: &mut Lowering<'_>) {
    for index in 0..lowering.work.len() {
        let Work::Declaration { scope, source, symbol } = lowering.work[index] else { continue };
        match (&source.kind, symbol) {
            (DeclarationKind::Var { ty, init, .. }, Symbol::Var(var)) => {
                let n_elements = lowering.net.vars[var].init.len();
                if let Some(values) =
                    initial_values(lowering, scope, &source.name, *ty, init, n_elements)
                {
                    lowering.net.vars[var].init = values;
                }
            }
            (DeclarationKind::Output { ty, init, safe, .. }, Symbol::Output(output)) => {
                if let Some(safe) = safe
                    && let Ok(value) = fixed_value(lowering, scope, &source.name, *ty, safe, &SAFE)
                {
                    lowering.net.outputs[output].safe = Some(value);
                }
                let Some(init) = init else { continue };
                let values = initial_values(
                    lowering,
                    scope,
                    &source.name,
                    *ty,
                    std::slice::from_ref(init),
                    1,
                );
                match lowering.roles[output.index()] {
                    Role::Stored(var) => {
                        if let Some(values) = values {
                            lowering.net.vars[var].init = values;
                        }
                    }
                    Role::Continuous | Role::Mealy | Role::Controlled(_) => {
                        let name = &source.name;
                        let message = format!("the initial value of output `{name}` has no effect");
                        let finding = Diagnostic::warning(codes::NO_EFFECT, message)
                            .plural(format!("`{name}`"), "the initial values of", "have no effect")
                            .at(init.span, "only an output that a list assigns has one")
                            .help("remove it, or assign the output in a list")
                            .help_in(
                                Notation::Scxml,
                                "remove `expr`, or assign it in an <onentry>",
                            );
                        lowering.report(finding);
                    }
                    Role::Extern | Role::Broken => {}
                }
            }
            (DeclarationKind::Timer { condition }, Symbol::Timer(timer)) => {
                let place = Place::level(scope, "the condition of a timer");
                if let Ok(condition) = lowering.condition(condition, &place) {
                    lowering.net.timers[timer].condition = condition;
                }
            }
            _ => {}
        }
    }
}

/// Values at reset, one for each element; `None` if an error was reported.
fn initial_values(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    name: &Name,
    ty: Type,
    init: &[Syntax],
    n_elements: usize,
) -> Option<Vec<i64>> {
    let values: Vec<Outcome<i64>> =
        init.iter().map(|value| fixed_value(lowering, scope, name, ty, value, &INITIAL)).collect();
    let values: Vec<i64> = values.into_iter().collect::<Outcome<_>>().ok()?;
    match values.as_slice() {
        [] => Some(vec![ty.saturate(0); n_elements]),
        [one] => Some(vec![*one; n_elements]),
        _ if values.len() == n_elements => Some(values),
        _ => {
            let span = init.iter().map(|value| value.span).reduce(crate::span::Span::to)?;
            lowering.report(
                Diagnostic::error(
                    codes::INITIAL_VALUE,
                    format!(
                        "`{name}` has {n_elements} elements but {} initial values",
                        values.len()
                    ),
                )
                .at(span, "")
                .help("give one value for all, or one for each element"),
            );
            None
        }
    }
}

/// The code of findings about a constant value, and the word for this value in messages.
struct Called {
    code: Code,
    what: &'static str,
}

const INITIAL: Called = Called { code: codes::INITIAL_VALUE, what: "initial" };
const SAFE: Called = Called { code: codes::SAFE_VALUE, what: "safe" };

fn fixed_value(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    name: &Name,
    ty: Type,
    syntax: &Syntax,
    called: &Called,
) -> Outcome<i64> {
    let what = called.what;
    let mistake = match (lowering.constant_value(scope, syntax)?, ty) {
        (Value::Bool(value), Type::Bool) => return Ok(i64::from(value)),
        (Value::Int(value @ (0 | 1)), Type::Bool) => return Ok(value),
        (Value::Int(value), Type::Int { lo, hi }) if (lo..=hi).contains(&value) => {
            return Ok(value);
        }
        (Value::Int(value), Type::Int { lo, hi }) => {
            format!("the {what} value {value} of `{name}` is outside {lo}..{hi}")
        }
        (Value::Int(_) | Value::Duration(_), Type::Bool) => {
            format!("the {what} value of `{name}` must be `true` or `false`")
        }
        (Value::Bool(_) | Value::Duration(_), Type::Int { lo, hi }) => {
            format!("the {what} value of `{name}` must be a number in {lo}..{hi}")
        }
    };
    Err(lowering.report(
        Diagnostic::error(called.code, mistake)
            .at(syntax.span, "")
            .at(name.span, "declared here")
            .help("write such a value, or change the type in the declaration"),
    ))
}
