//! Initial values of local arrays.

use super::ast::{Expr, Init};
use super::flow::Flow;
use super::lexer;
use super::number::{Num, Value};
use super::resolve::VarId;
use super::types::Type;
use super::value::Place;
use grafsynth_ir::Span;

impl<'s> Flow<'_, 's> {
    pub(super) fn init_list(&mut self, var: VarId, all: &'s [Init], span: Span) {
        let Some(ty) = self.program().vars[var].scalar() else { return };
        let length = self.program().vars[var].length();
        let mut values: Vec<Option<&'s Expr>> = Vec::new();
        match (length, &self.program().vars[var].ty) {
            (None, _) => {
                if let Some(Init::One(expr)) = all.first() {
                    values.push(Some(expr));
                }
            }
            (Some(length), Type::Array(_, _, rest)) => {
                flatten(all, rest, &mut values);
                if values.len() > length as usize {
                    let n = values.len();
                    let help = format!("remove values, or declare {n} elements");
                    self.error(span, || format!("{n} values for {length} elements"), &help);
                    return;
                }
                // Missing values are 0.
                values.resize(length as usize, None);
            }
            (Some(_), _) => {}
        }
        for (index, value) in values.into_iter().enumerate() {
            let value = match value {
                Some(expr) => self.eval(expr),
                None => Value::int(0, self.int_type(), span),
            };
            let index = length.map(|_| Num::constant(i64::try_from(index).unwrap_or(0), span));
            let place = Place { path: self.path(var, span), index, ty };
            self.store(&place, &value, span);
        }
    }

    pub(super) fn init_string(&mut self, var: VarId, text: Span) {
        let (file, source) = (self.program().file, self.program().text);
        let mut all = lexer::characters(file, source, text, self.findings);
        let Some(length) = self.program().vars[var].length() else { return };
        let Some(ty) = self.program().vars[var].scalar() else { return };
        all.resize(length as usize, 0);
        for (index, value) in all.into_iter().enumerate() {
            let index = Some(Num::constant(i64::try_from(index).unwrap_or(0), text));
            let place = Place { path: self.path(var, text), index, ty };
            self.store(&place, &Value::int(value, self.int_type(), text), text);
        }
    }
}

/// Collects the values of nested lists in the order of the elements; `None` for elements that a short row omits.
pub(super) fn flatten<'s>(all: &'s [Init], rest: &[u32], values: &mut Vec<Option<&'s Expr>>) {
    for one in all {
        match one {
            Init::One(expr) => values.push(Some(expr)),
            Init::List(inner, _) => {
                let row: usize = rest.iter().map(|one| *one as usize).product();
                let begin = values.len();
                flatten(inner, rest.get(1..).unwrap_or(&[]), values);
                if values.len() < begin + row {
                    values.resize(begin + row, None);
                }
            }
        }
    }
}
