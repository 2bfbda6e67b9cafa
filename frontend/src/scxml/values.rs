//! Data: infers which data elements are numbers and which are Booleans, infers the ranges of the numbers, and converts expressions to chart
//! expressions.
//!
//! A data element with a range is a number. Any other has the kind of its initial value or, without one, of the values that are assigned to
//! it. As in ECMAScript, the two kinds are separate; in C89, a Boolean is 0 or 1 if a number is needed. The range of a number is given by
//! `grafsynth:range`; otherwise it contains all values that assignments can produce (a fixed point of intervals), at most -32768..32767.

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use grafsynth_ir::chart::{Expr, Leaf, Path, Stmt, StmtKind, statements};
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind, Type};
use grafsynth_ir::interval::{self, Leaves, TypeError, TypeErrorKind};
use grafsynth_ir::{Name, Span};

use super::expr::{Ast, AstKind, Language};
use super::names::Names;
use super::refuse;
use super::tree::{Act, ActKind, Datum, Machine, Role};
use crate::codes;
use crate::findings::Findings;

/// The default range of a number.
const DEFAULT: (i64, i64) = (-32_768, 32_767);
/// Number of rounds of the iteration, after which every bound that still changes becomes that of [`DEFAULT`].
const ROUNDS: usize = 12;

/// The kind of a value: number or Boolean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Bool,
    Int,
}

/// A constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Value {
    Bool(bool),
    Int(i64),
}

impl Value {
    fn kind(self) -> Kind {
        match self {
            Value::Bool(_) => Kind::Bool,
            Value::Int(_) => Kind::Int,
        }
    }

    pub(super) fn number(self) -> i64 {
        match self {
            Value::Bool(value) => i64::from(value),
            Value::Int(value) => value,
        }
    }

    pub(super) fn expr(self, span: Span) -> Expr {
        match self {
            Value::Bool(value) => Expr::new(ExprKind::Bool(value), span),
            Value::Int(value) => Expr::new(ExprKind::Int(value), span),
        }
    }
}

/// A data element or the variable of a loop.
#[derive(Debug, Clone)]
pub(super) struct Var {
    /// Its name in the chart.
    pub(super) name: String,
    pub(super) span: Span,
    pub(super) kind: Option<Kind>,
    /// One initial value, or one for each element.
    pub(super) init: Vec<Value>,
    pub(super) is_array: bool,
    /// Whether it is an array with an element that is assigned.
    pub(super) is_assigned: bool,
    pub(super) range: Option<(i64, i64)>,
    pub(super) role: Role,
    pub(super) label: String,
}

impl Var {
    pub(super) fn kind(&self) -> Kind {
        self.kind.unwrap_or(Kind::Int)
    }
}

impl Datum {
    /// Checks that the initial values are of one kind, and within the range.
    fn check(&self, init: &[Value], kind: Option<Kind>, found: &mut Findings) {
        if let Some(odd) = init.iter().find(|value| Some(value.kind()) != kind) {
            let odd = if odd.kind() == Kind::Bool { "a Boolean" } else { "a number" };
            let span = self.value.as_ref().map_or(self.id.span, |value| value.span);
            let message = format!(
                "`{}` mixes numbers and Booleans: one of its initial values is {odd}",
                self.id
            );
            let help = "write only numbers or only true and false, or use two arrays";
            found.report(|| kind_error(span, message).help(help));
        }
        let Some((lo, hi)) = self.range else { return };
        for value in init.iter().map(|value| value.number()).filter(|it| *it < lo || *it > hi) {
            found.report(|| {
                let message = format!(
                    "the initial value {value} of `{}` is outside its range {lo}..{hi}",
                    self.id
                );
                Diagnostic::error(codes::SCXML_RANGE, message)
                    .at(self.id.span, "")
                    .help(format!("write an initial value in this range, or a range that contains it, as in g:range=\"{}..{}\"", lo.min(value), hi.max(value)))
            });
        }
    }
}

/// All data of a document.
#[derive(Debug)]
pub(super) struct Data {
    pub(super) language: Language,
    /// The data in the order of declaration; loop variables come last.
    pub(super) vars: Vec<Var>,
    by_id: BTreeMap<String, usize>,
}

impl Data {
    /// Declares all data and infers which are numbers and which are Booleans.
    pub(super) fn of(
        machine: &Machine,
        language: Language,
        names: &mut Names,
        found: &mut Findings,
    ) -> Data {
        let mut data = Data { language, vars: Vec::new(), by_id: BTreeMap::new() };
        for datum in &machine.data {
            let earlier = data.by_id.get(&datum.id.text).map(|index| data.vars[*index].span);
            let earlier = earlier.or_else(|| names.states.get(&datum.id.text).map(|one| one.span));
            if let Some(first) = earlier {
                found.report(|| super::names::twice(&datum.id, first));
                continue;
            }
            let init = data.initial(datum.value.as_ref(), names, found);
            let is_array = matches!(&datum.value, Some(Ast { kind: AstKind::Array(_), .. }));
            let mut kind = init.first().map(|value| value.kind());
            if datum.range.is_some() {
                kind = Some(Kind::Int);
            }
            datum.check(&init, kind, found);
            let name = names.fresh(&datum.id.text, "");
            data.add(
                datum.id.text.clone(),
                Var {
                    name,
                    span: datum.id.span,
                    kind,
                    init,
                    is_array,
                    is_assigned: false,
                    range: datum.range,
                    role: datum.role,
                    label: datum.label.clone(),
                },
            );
        }
        data.assigned_by_loops(machine, names);
        data.kinds(machine);
        for datum in &machine.data {
            let Some(var) = data.get(&datum.id.text) else { continue };
            if datum.value.is_none() && var.role == Role::Variable && var.span == datum.id.span {
                let zero = if var.kind() == Kind::Bool { "false" } else { "0" };
                found.report(|| {
                    Diagnostic::warning(
                        codes::SCXML_NO_VALUE,
                        format!("`{}` has no initial value; {zero} is used", datum.id),
                    )
                    .at(datum.id.span, "")
                    .help(format!("write expr=\"{zero}\""))
                });
            }
        }
        data
    }

    fn add(&mut self, id: String, var: Var) {
        self.by_id.insert(id, self.vars.len());
        self.vars.push(var);
    }

    pub(super) fn get(&self, id: &str) -> Option<&Var> {
        self.by_id.get(id).map(|index| &self.vars[*index])
    }

    pub(super) fn get_mut(&mut self, id: &str) -> Option<&mut Var> {
        let index = *self.by_id.get(id)?;
        self.vars.get_mut(index)
    }

    /// The initial value of a data element, which may read the initial values of preceding data.
    fn initial(&mut self, value: Option<&Ast>, names: &Names, found: &mut Findings) -> Vec<Value> {
        let Some(ast) = value else { return Vec::new() };
        let elements = match ast.elements() {
            Some([]) => {
                found.report(|| {
                    *refuse(
                        ast.span,
                        "an array without elements",
                        "list all elements; the length of an array is fixed",
                    )
                });
                return vec![Value::Int(0)];
            }
            Some(all) => all,
            None => std::slice::from_ref(ast),
        };
        let mut values = Vec::with_capacity(elements.len());
        for element in elements {
            match self.constant(element, names) {
                Ok(value) => values.push(value),
                Err(finding) => found.report(|| *finding),
            }
        }
        values
    }

    /// The value of a constant expression.
    pub(super) fn constant(&self, ast: &Ast, names: &Names) -> Result<Value, Box<Diagnostic>> {
        let expr = self.value(ast, names, false, &|data, id, index| {
            let var = data.get(id)?;
            let value = match index {
                None if !var.is_array => var.init.first().copied().unwrap_or(Value::Int(0)),
                Some(index) => *var.init.get(usize::try_from(index).ok()?)?,
                None => return None,
            };
            Some(value)
        })?;
        constant_of(&expr.0).ok_or_else(|| {
            Box::new(kind_error(ast.span, "not a constant expression".to_owned()).help(
                "write a number, true or false here, and assign the expression in an <onentry>",
            ))
        })
    }

    /// The value of an expression that reads no data element.
    ///
    /// # Errors
    /// If the expression reads a data element, or has no value.
    pub(super) fn fixed(&self, ast: &Ast, names: &Names) -> Result<Value, Box<Diagnostic>> {
        let (expr, _) = self.value(ast, names, false, &|_, _, _| None)?;
        constant_of(&expr).ok_or_else(|| {
            Box::new(
                Diagnostic::error(codes::SCXML_LOOP, "the elements of this loop are not constant")
                    .at(ast.span, "this changes while the chart runs")
                    .help("declare them as an array: <data id=\"list\">[1, 2, 3]</data>"),
            )
        })
    }

    /// Declares the variables of loops that are not declared otherwise.
    fn assigned_by_loops(&mut self, machine: &Machine, names: &mut Names) {
        let mut wanted: Vec<(&Name, Option<&Ast>)> = Vec::new();
        machine.each_act(&mut |act: &Act| match &act.kind {
            ActKind::Foreach { array, item, index, .. } => {
                wanted.push((item, Some(array)));
                wanted.extend(index.iter().map(|index| (index, None)));
            }
            ActKind::Assign { target, index: Some(_), .. } => {
                if let Some(var) = self.get_mut(target) {
                    var.is_assigned = true;
                }
            }
            _ => {}
        });
        for (name, _) in wanted {
            if self.by_id.contains_key(&name.text) {
                continue;
            }
            let chart_name = names.fresh(&name.text, "_item");
            self.add(
                name.text.clone(),
                Var {
                    name: chart_name,
                    span: name.span,
                    kind: None,
                    init: Vec::new(),
                    is_array: false,
                    is_assigned: false,
                    range: None,
                    role: Role::Variable,
                    label: String::new(),
                },
            );
        }
    }

    /// Infers unknown kinds from assignments.
    fn kinds(&mut self, machine: &Machine) {
        let mut assigned: Vec<(&str, &Ast)> = Vec::new();
        let mut looped: Vec<(&str, &Ast)> = Vec::new();
        machine.each_act(&mut |act: &Act| match &act.kind {
            ActKind::Assign { target, value, .. } => assigned.push((target, value)),
            ActKind::Foreach { array, item, .. } => looped.push((&item.text, array)),
            ActKind::Raise(_) | ActKind::Send { .. } | ActKind::Cancel(_) | ActKind::If { .. } => {}
        });
        // Each round infers at least one more data element of a chain; the rest are numbers.
        for _ in 0..ROUNDS {
            let mut has_changed = false;
            for (target, value) in &assigned {
                has_changed |= self.settle(target, self.kind_of(value));
            }
            for (item, array) in &looped {
                let kind = if let Some(all) = array.elements() {
                    all.first().and_then(|first| self.kind_of(first))
                } else if let AstKind::Name(name) = &array.kind {
                    self.get(name).and_then(|var| var.kind)
                } else {
                    None
                };
                has_changed |= self.settle(item, kind);
            }
            if !has_changed {
                break;
            }
        }
    }

    fn settle(&mut self, id: &str, kind: Option<Kind>) -> bool {
        match self.get_mut(id) {
            Some(var) if var.kind.is_none() && kind.is_some() => {
                var.kind = kind;
                true
            }
            Some(_) | None => false,
        }
    }

    fn kind_of(&self, ast: &Ast) -> Option<Kind> {
        match &ast.kind {
            AstKind::Int(_) | AstKind::Neg(_) | AstKind::Arith(..) | AstKind::Bitwise(..) => {
                Some(Kind::Int)
            }
            AstKind::Name(name) | AstKind::Element(name, _) => {
                self.get(name).and_then(|var| var.kind)
            }
            AstKind::Choice(_, then, otherwise) => {
                self.kind_of(then).or_else(|| self.kind_of(otherwise))
            }
            AstKind::Array(_) => None,
            // C has no Booleans: comparisons give the numbers 0 and 1.
            AstKind::Not(_) | AstKind::And(_) | AstKind::Or(_) | AstKind::Compare(..)
                if self.language == Language::C89 =>
            {
                Some(Kind::Int)
            }
            _ => Some(Kind::Bool),
        }
    }

    /// Converts a Boolean expression.
    ///
    /// # Errors
    /// If a part of the expression has no value here.
    pub(super) fn condition(&self, ast: &Ast, names: &Names) -> Result<Expr, Box<Diagnostic>> {
        self.truth(ast, names, &|_, _, _| None)
    }

    /// Converts an expression of this kind.
    ///
    /// # Errors
    /// If a part of the expression has no value here, or a value of the other kind.
    pub(super) fn of_kind(
        &self,
        ast: &Ast,
        kind: Kind,
        what: &str,
        names: &Names,
    ) -> Result<Expr, Box<Diagnostic>> {
        let (expr, is) = self.value(ast, names, false, &|_, _, _| None)?;
        self.converted(expr, is, kind, || match kind {
            Kind::Bool => format!("{what} must be a Boolean, found a number"),
            Kind::Int => format!("{what} must be a number, found a Boolean"),
        })
    }

    fn converted(
        &self,
        expr: Expr,
        is: Kind,
        wanted: Kind,
        message: impl FnOnce() -> String,
    ) -> Result<Expr, Box<Diagnostic>> {
        let span = expr.span;
        match (is, wanted) {
            (Kind::Bool, Kind::Bool) | (Kind::Int, Kind::Int) => Ok(expr),
            (Kind::Int, Kind::Bool) if self.language == Language::C89 => {
                Ok(Expr::compare(CompareOp::Ne, expr, Expr::new(ExprKind::Int(0), span)))
            }
            (Kind::Bool, Kind::Int) if self.language == Language::C89 => {
                let one = Box::new(Expr::new(ExprKind::Int(1), span));
                let zero = Box::new(Expr::new(ExprKind::Int(0), span));
                Ok(Expr::new(ExprKind::Select(Box::new(expr), one, zero), span))
            }
            (Kind::Int, Kind::Bool) => Err(Box::new(
                kind_error(span, message()).help("compare it with something, as in `n != 0`"),
            )),
            (Kind::Bool, Kind::Int) => {
                Err(Box::new(kind_error(span, message()).help("convert it: `c ? 1 : 0`")))
            }
        }
    }

    /// Converts an expression used as a condition: in both languages, a number is true unless it is 0.
    fn truth(&self, ast: &Ast, names: &Names, known: Known<'_>) -> Result<Expr, Box<Diagnostic>> {
        let (expr, kind) = self.value(ast, names, true, known)?;
        Ok(truth_of(expr, kind))
    }

    fn number(&self, ast: &Ast, names: &Names, known: Known<'_>) -> Result<Expr, Box<Diagnostic>> {
        let (expr, kind) = self.value(ast, names, false, known)?;
        self.converted(expr, kind, Kind::Int, || "expected a number, found a Boolean".to_owned())
    }

    /// Converts an expression of either kind. With `as_truth`, only its truth value matters. `known` gives values to names before the chart
    /// runs.
    fn value(
        &self,
        ast: &Ast,
        names: &Names,
        as_truth: bool,
        known: Known<'_>,
    ) -> Result<(Expr, Kind), Box<Diagnostic>> {
        let span = ast.span;
        let made = |kind, is| Ok((Expr::new(kind, span), is));
        let number = |ast| self.number(ast, names, known).map(Box::new);
        let truth = |ast| self.truth(ast, names, known).map(Box::new);
        match &ast.kind {
            AstKind::Bool(value) => made(ExprKind::Bool(*value), Kind::Bool),
            AstKind::Int(value) => made(ExprKind::Int(*value), Kind::Int),
            AstKind::Name(name) => self.named(name, span, names, known),
            AstKind::Element(name, index) => self.element((name, span), index, names, known),
            AstKind::In(id, place) => {
                let state =
                    names.states.get(id).ok_or_else(|| Box::new(names.unknown(id, *place)))?;
                if state.is_history {
                    // A history is never active (W3C test assertion 580).
                    return made(ExprKind::Bool(false), Kind::Bool);
                }
                let mut path = names.path_of(state, *place);
                path.names.push(Name::new("active", *place));
                made(ExprKind::Leaf(Leaf::Name(path)), Kind::Bool)
            }
            AstKind::Array(_) => {
                Err(refuse(span, "an array as a value", "use one of its elements"))
            }
            AstKind::Not(inner) => made(ExprKind::Not(truth(inner)?), Kind::Bool),
            AstKind::And(all) | AstKind::Or(all) => {
                let operand = |one| self.operand(one, names, as_truth, known);
                let operands = all.iter().map(operand).collect::<Result<_, _>>()?;
                let is_and = matches!(ast.kind, AstKind::And(_));
                let join = if is_and { ExprKind::And } else { ExprKind::Or };
                made(join(operands), Kind::Bool)
            }
            AstKind::Neg(inner) => made(ExprKind::Neg(number(inner)?), Kind::Int),
            AstKind::Arith(op, a, b) => {
                let (a, b) = (number(a)?, number(b)?);
                if matches!(op, ArithOp::Div | ArithOp::Mod)
                    && matches!(grafsynth_ir::simplify::simplify(&b).kind, ExprKind::Int(0))
                {
                    let message = "the divisor is 0".to_owned();
                    return Err(mismatch(b.span, message, "write another divisor"));
                }
                made(ExprKind::Arith(*op, a, b), Kind::Int)
            }
            AstKind::Bitwise(op, a, b) => {
                let (a, b) = (*number(a)?, *number(b)?);
                Ok((self.bitwise(*op, a, b, span), Kind::Int))
            }
            AstKind::Compare(op, a, b) => {
                let (a, a_kind) = self.value(a, names, false, known)?;
                let (b, b_kind) = self.value(b, names, false, known)?;
                let equality = matches!(op, CompareOp::Eq | CompareOp::Ne);
                let message = "a number cannot be compared with a Boolean";
                let are_alike = a_kind == b_kind && (equality || a_kind == Kind::Int);
                let (a, b) = match (a, b) {
                    both if are_alike => both,
                    (a, b) => self.numbers((a, a_kind), (b, b_kind), message)?,
                };
                made(ExprKind::Compare(*op, Box::new(a), Box::new(b)), Kind::Bool)
            }
            AstKind::Choice(condition, a, b) => {
                let condition = truth(condition)?;
                let (a, a_kind) = self.value(a, names, as_truth, known)?;
                let (b, b_kind) = self.value(b, names, as_truth, known)?;
                if a_kind == b_kind {
                    return made(ExprKind::Select(condition, Box::new(a), Box::new(b)), a_kind);
                }
                let message = "one branch is a number, the other a Boolean";
                let (a, b) = self.numbers((a, a_kind), (b, b_kind), message)?;
                made(ExprKind::Select(condition, Box::new(a), Box::new(b)), Kind::Int)
            }
        }
    }

    /// A data element.
    fn named(
        &self,
        name: &str,
        span: Span,
        names: &Names,
        known: Known<'_>,
    ) -> Result<(Expr, Kind), Box<Diagnostic>> {
        if let Some(value) = known(self, name, None) {
            return Ok((value.expr(span), value.kind()));
        }
        let var = self.get(name).ok_or_else(|| self.unknown(name, span, names))?;
        if var.is_array {
            let message = format!("the array `{name}` cannot be used as a value");
            return Err(mismatch(span, message, format!("use one of its elements: `{name}[0]`")));
        }
        let path = Path::from(Name::new(var.name.as_str(), span));
        Ok((Expr::new(ExprKind::Leaf(Leaf::Name(path)), span), var.kind()))
    }

    /// An element of an array; its value, if index and value are constant.
    fn element(
        &self,
        (name, span): (&str, Span),
        index: &Ast,
        names: &Names,
        known: Known<'_>,
    ) -> Result<(Expr, Kind), Box<Diagnostic>> {
        let var = self.get(name).ok_or_else(|| self.unknown(name, span, names))?;
        if !var.is_array {
            let message = format!("`{name}` is not an array");
            return Err(mismatch(span, message, format!("write `{name}` without an index")));
        }
        let index = self.number(index, names, known)?;
        if let ExprKind::Int(at) = grafsynth_ir::simplify::simplify(&index).kind {
            if let Some(value) = known(self, name, Some(at)) {
                return Ok((value.expr(span), value.kind()));
            }
            let Some(value) = usize::try_from(at).ok().and_then(|at| var.init.get(at)) else {
                let last = var.init.len().saturating_sub(1);
                let message =
                    format!("index {at} is out of range: `{name}` has the elements 0..{last}");
                let help = "write an index in this range, or add elements to the array";
                return Err(mismatch(index.span, message, help));
            };
            if !var.is_assigned {
                return Ok((value.expr(span), value.kind()));
            }
        }
        let path = Path::from(Name::new(var.name.as_str(), span));
        let element = ExprKind::Element(Leaf::Name(path), Box::new(index));
        Ok((Expr::new(element, span), var.kind()))
    }

    /// An operand of `&&` or `||` as a Boolean.
    fn operand(
        &self,
        ast: &Ast,
        names: &Names,
        as_truth: bool,
        known: Known<'_>,
    ) -> Result<Expr, Box<Diagnostic>> {
        let (expr, kind) = self.value(ast, names, as_truth, known)?;
        if kind == Kind::Int && !as_truth && self.language == Language::Ecmascript {
            let message = "`&&` and `||` of numbers give a number in ECMAScript".to_owned();
            let help = "compare the number with something, as in `n != 0`";
            return Err(mismatch(ast.span, message, help));
        }
        Ok(truth_of(expr, kind))
    }

    /// Two expressions of different kinds as numbers.
    fn numbers(
        &self,
        (a, a_kind): (Expr, Kind),
        (b, b_kind): (Expr, Kind),
        message: &str,
    ) -> Result<(Expr, Expr), Box<Diagnostic>> {
        let number = |expr, kind| self.converted(expr, kind, Kind::Int, || message.to_owned());
        Ok((number(a, a_kind)?, number(b, b_kind)?))
    }

    pub(super) fn unknown(&self, name: &str, span: Span, names: &Names) -> Box<Diagnostic> {
        let finding =
            Diagnostic::error(codes::SCXML_LOCATION, format!("unknown data element `{name}`"))
                .at(span, "");
        Box::new(match nearest(name, self.by_id.keys().take(10_000).map(String::as_str)) {
            Some(near) => finding.help(format!("did you mean `{near}`?")).fix(span, near),
            None if names.states.contains_key(name) => {
                finding.help(format!("`{name}` is a state: test it with In('{name}')"))
            }
            None => finding.help(format!("declare it: <data id=\"{name}\" expr=\"0\"/>")),
        })
    }

    /// The types of all data, given all statements of the chart. `copies` maps the copy of each array to the array.
    pub(super) fn types<'s>(
        &self,
        blocks: impl IntoIterator<Item = &'s [Stmt]>,
        copies: &[(String, String, Span)],
    ) -> Vec<Type> {
        let mut assigned: Vec<(usize, &Expr)> = Vec::new();
        let mut by_name: BTreeMap<&str, usize> =
            self.vars.iter().enumerate().map(|(index, var)| (var.name.as_str(), index)).gather();
        for (array, copy, _) in copies {
            if let Some(index) = by_name.get(array.as_str()).copied() {
                by_name.insert(copy, index);
            }
        }
        for block in blocks {
            collect(block, &by_name, &mut assigned);
        }
        let mut ranges: Vec<(i64, i64)> = self
            .vars
            .iter()
            .map(|var| {
                let values = var.init.iter().map(|value| value.number());
                let (lo, hi) = (values.clone().min().unwrap_or(0), values.max().unwrap_or(0));
                match (var.range, var.role) {
                    (Some(range), _) => range,
                    // An external value may be any number.
                    (None, Role::Input) => DEFAULT,
                    (None, Role::Variable | Role::Output) => (lo, hi),
                }
            })
            .collect();
        // Bounds first follow the assignments. Bounds that still change after several rounds go to their extremes; if even that does not converge (chains
        // longer than the number of rounds), the range becomes the default range.
        for round in 0..3 * ROUNDS {
            let mut is_settled = true;
            for (index, value) in &assigned {
                let var = &self.vars[*index];
                if var.range.is_some() || var.kind() == Kind::Bool {
                    continue;
                }
                let (least, most) = ranges[*index];
                let mut leaves = Ranges { data: self, by_name: &by_name, ranges: &ranges };
                let Ok(Type::Int { lo, hi }) = interval::check(value, &mut leaves) else {
                    continue;
                };
                // The initial value may be outside the inferred range.
                let mut lo = lo.max(DEFAULT.0).min(least);
                let mut hi = hi.min(DEFAULT.1).max(most);
                if (lo, hi) == (least, most) {
                    continue;
                }
                is_settled = false;
                if round >= ROUNDS && lo < least || round >= 2 * ROUNDS {
                    lo = lo.min(DEFAULT.0);
                }
                if round >= ROUNDS && hi > most || round >= 2 * ROUNDS {
                    hi = hi.max(DEFAULT.1);
                }
                ranges[*index] = (lo, hi);
            }
            if is_settled {
                break;
            }
            if round + 1 == 3 * ROUNDS {
                for (index, _) in &assigned {
                    if self.vars[*index].range.is_none() {
                        let (lo, hi) = ranges[*index];
                        ranges[*index] = (lo.min(DEFAULT.0), hi.max(DEFAULT.1));
                    }
                }
            }
        }
        let types = self.vars.iter().zip(ranges).map(|(var, (lo, hi))| match var.kind() {
            Kind::Bool => Type::Bool,
            Kind::Int => Type::Int { lo, hi },
        });
        types.collect()
    }
}

/// Values of names before the chart runs: of a data element, or of an array element.
type Known<'k> = &'k dyn Fn(&Data, &str, Option<i64>) -> Option<Value>;

fn constant_of(expr: &Expr) -> Option<Value> {
    match grafsynth_ir::simplify::simplify(expr).kind {
        ExprKind::Bool(value) => Some(Value::Bool(value)),
        ExprKind::Int(value) => Some(Value::Int(value)),
        _ => None,
    }
}

fn collect<'s>(
    block: &'s [Stmt],
    by_name: &BTreeMap<&str, usize>,
    out: &mut Vec<(usize, &'s Expr)>,
) {
    for stmt in statements(block) {
        if let StmtKind::Assign { target, value, .. } = &stmt.kind {
            let name = target.names.first().map_or("", |name| name.text.as_str());
            if let Some(index) = by_name.get(name) {
                out.push((*index, value));
            }
        }
    }
}

/// The leaves of expressions with the ranges inferred so far.
struct Ranges<'r> {
    data: &'r Data,
    by_name: &'r BTreeMap<&'r str, usize>,
    ranges: &'r [(i64, i64)],
}

impl Ranges<'_> {
    fn of(&self, leaf: &Leaf, span: Span) -> Result<Type, TypeError> {
        let Leaf::Name(path) = leaf else {
            return Err(TypeError { span, kind: TypeErrorKind::Dangling });
        };
        match path.names.as_slice() {
            [only] => match self.by_name.get(only.text.as_str()) {
                Some(index) => Ok(match self.data.vars[*index].kind() {
                    Kind::Bool => Type::Bool,
                    Kind::Int => {
                        let (lo, hi) = self.ranges[*index];
                        Type::Int { lo, hi }
                    }
                }),
                None => Err(TypeError { span, kind: TypeErrorKind::Dangling }),
            },
            // The activity of a state.
            _ => Ok(Type::Bool),
        }
    }
}

impl Leaves<Leaf> for Ranges<'_> {
    fn leaf(&mut self, leaf: &Leaf, span: Span) -> Result<Type, TypeError> {
        self.of(leaf, span)
    }

    fn array(&mut self, leaf: &Leaf, span: Span) -> Result<(Type, Option<u32>), TypeError> {
        self.of(leaf, span).map(|ty| (ty, None))
    }
}

/// Whether a value is true: a number, if it is not 0.
fn truth_of(expr: Expr, kind: Kind) -> Expr {
    let span = expr.span;
    match kind {
        Kind::Bool => expr,
        Kind::Int => Expr::compare(CompareOp::Ne, expr, Expr::new(ExprKind::Int(0), span)),
    }
}

fn mismatch(span: Span, message: String, help: impl Into<String>) -> Box<Diagnostic> {
    Box::new(kind_error(span, message).help(help))
}

fn kind_error(span: Span, message: String) -> Diagnostic {
    Diagnostic::error(codes::SCXML_KIND, message).at(span, "")
}
