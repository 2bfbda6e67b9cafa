//! Writes expressions and statements of a chart as structured text.

use grafsynth_ir::Span;
use grafsynth_ir::chart::{Expr, Leaf, Path, Stmt, StmtKind};
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};

/// The description of something that cannot be expressed, with its span.
pub(crate) type Cannot = (String, Span);

/// How the names of a chart are written.
pub(crate) trait Names {
    /// A variable, output or input.
    fn signal(&self, path: &Path) -> Option<String>;
    /// A step.
    fn step(&self, name: &str) -> Option<String>;
    /// Whether the current transition leaves this step.
    fn leaves(&self, step: &str) -> bool;
}

/// Operator precedence, lowest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Or,
    And,
    Compare,
    Sum,
    Product,
    Unary,
    Primary,
}

/// A duration such as `T#1h2m`, as a sum of whole units.
pub(crate) fn duration(ns: u64) -> String {
    const UNITS: [(u64, &str); 7] = [
        (86_400_000_000_000, "d"),
        (3_600_000_000_000, "h"),
        (60_000_000_000, "m"),
        (1_000_000_000, "s"),
        (1_000_000, "ms"),
        (1_000, "us"),
        (1, "ns"),
    ];
    let mut out = String::from("T#");
    let mut rest = ns;
    for (unit, word) in UNITS {
        if rest >= unit {
            out.push_str(&format!("{}{word}", rest / unit));
            rest %= unit;
        }
    }
    if ns == 0 {
        out.push_str("0s");
    }
    out
}

/// An expression.
pub(crate) fn expr(names: &dyn Names, expr: &Expr) -> Result<String, Cannot> {
    written(names, expr).map(|(text, _)| text)
}

fn within(names: &dyn Names, inner: &Expr, least: Level) -> Result<String, Cannot> {
    let (text, level) = written(names, inner)?;
    Ok(if level < least { format!("({text})") } else { text })
}

fn chain(
    names: &dyn Names,
    all: &[Expr],
    word: &str,
    level: Level,
) -> Result<(String, Level), Cannot> {
    if all.is_empty() {
        let text = if level == Level::And { "TRUE" } else { "FALSE" };
        return Ok((text.to_owned(), Level::Primary));
    }
    if let [only] = all {
        return written(names, only);
    }
    let least = if level == Level::Or { Level::And } else { Level::Compare };
    let parts: Result<Vec<String>, Cannot> =
        all.iter().map(|one| within(names, one, least)).collect();
    Ok((parts?.join(word), level))
}

fn written(names: &dyn Names, expr: &Expr) -> Result<(String, Level), Cannot> {
    Ok(match &expr.kind {
        ExprKind::Bool(value) => {
            ((if *value { "TRUE" } else { "FALSE" }).to_owned(), Level::Primary)
        }
        ExprKind::Int(value) if *value < 0 => (value.to_string(), Level::Unary),
        ExprKind::Int(value) => (value.to_string(), Level::Primary),
        ExprKind::Leaf(leaf) => (leaf_text(names, leaf, expr.span)?, Level::Primary),
        ExprKind::Element(leaf, index) => {
            let array = leaf_text(names, leaf, expr.span)?;
            let index = written(names, index)?.0;
            (format!("{array}[{index}]"), Level::Primary)
        }
        ExprKind::Not(inner) => {
            (format!("NOT {}", within(names, inner, Level::Unary)?), Level::Unary)
        }
        ExprKind::And(all) => chain(names, all, " AND ", Level::And)?,
        ExprKind::Or(all) => chain(names, all, " OR ", Level::Or)?,
        ExprKind::Compare(op, a, b) => match time_comparison(names, *op, a, b)? {
            Some(found) => found,
            None => {
                let (a, b) = (within(names, a, Level::Sum)?, within(names, b, Level::Sum)?);
                (format!("{a} {} {b}", op.symbol()), Level::Compare)
            }
        },
        // `-a * b` is read as the negation of `a` alone, which is intended.
        ExprKind::Neg(inner) => {
            (format!("-{}", within(names, inner, Level::Primary)?), Level::Unary)
        }
        ExprKind::Arith(op, a, b) => {
            let (level, symbol) = match op {
                ArithOp::Add => (Level::Sum, "+"),
                ArithOp::Sub => (Level::Sum, "-"),
                ArithOp::Mul => (Level::Product, "*"),
                ArithOp::Div => (Level::Product, "/"),
                ArithOp::Mod => (Level::Product, "MOD"),
                ArithOp::BitAnd => return bitwise(names, a, "AND", b),
                ArithOp::BitOr => return bitwise(names, a, "OR", b),
                ArithOp::BitXor => return bitwise(names, a, "XOR", b),
                ArithOp::Shl | ArithOp::Shr => {
                    return shift(names, a, *op == ArithOp::Shl, b, expr.span);
                }
            };
            let right = if level == Level::Sum { Level::Product } else { Level::Unary };
            (format!("{} {symbol} {}", within(names, a, level)?, within(names, b, right)?), level)
        }
        ExprKind::Select(c, a, b) => {
            let (c, a, b) = (written(names, c)?.0, written(names, a)?.0, written(names, b)?.0);
            (format!("SEL({c}, {b}, {a})"), Level::Primary)
        }
    })
}

/// A bit operator. Systems differ in the precedences of AND, OR and XOR, so operands that contain one are in parentheses.
fn bitwise(names: &dyn Names, a: &Expr, word: &str, b: &Expr) -> Result<(String, Level), Cannot> {
    if word == "XOR" && b.kind == ExprKind::Int(-1) {
        // NOT inverts only the bits of a type, and the number may have no such type.
        return Ok((format!("-1 - {}", within(names, a, Level::Product)?), Level::Sum));
    }
    let (a, b) = (within(names, a, Level::Sum)?, within(names, b, Level::Sum)?);
    Ok((format!("{a} {word} {b}"), Level::Or))
}

/// A shift by a constant. SHL loses the bits beyond its type and SHR inserts zeros, so a shift is written as a product, or as the quotient of a number whose low
/// bits are cleared; that quotient is exact, so the shift rounds down.
fn shift(
    names: &dyn Names,
    a: &Expr,
    is_left: bool,
    by: &Expr,
    span: Span,
) -> Result<(String, Level), Cannot> {
    let ExprKind::Int(by @ 0..=62) = by.kind else {
        return Err(("shifts by a variable amount".to_owned(), span));
    };
    let factor = 1_i64 << by;
    let text = if is_left {
        format!("{} * {factor}", within(names, a, Level::Product)?)
    } else {
        format!("({} AND -{factor}) / {factor}", within(names, a, Level::Sum)?)
    };
    Ok((text, Level::Product))
}

/// The step whose time a path refers to, and whether that time is kept when the step is left.
fn step_time(expr: &Expr) -> Option<(&str, bool)> {
    let ExprKind::Leaf(Leaf::Name(path)) = &expr.kind else { return None };
    match path.names.as_slice() {
        [step, part] if part.text == "t" => Some((step.text.as_str(), false)),
        [step, part] if part.text == "T" => Some((step.text.as_str(), true)),
        _ => None,
    }
}

fn time_comparison(
    names: &dyn Names,
    op: CompareOp,
    a: &Expr,
    b: &Expr,
) -> Result<Option<(String, Level)>, Cannot> {
    let Some((step, stays)) = step_time(a) else { return Ok(None) };
    let ExprKind::Leaf(Leaf::Duration(ns)) = b.kind else { return Ok(None) };
    let Some(name) = names.step(step) else { return Ok(None) };
    let compared = format!("{name}.T {} {}", op.symbol(), duration(ns));
    if stays || names.leaves(step) {
        return Ok(Some((compared, Level::Compare)));
    }
    // This kind of time is 0 while the step is inactive.
    let holds_at_zero = op.apply(0, i64::try_from(ns).unwrap_or(i64::MAX));
    Ok(Some(if holds_at_zero {
        (format!("NOT {name}.X OR {compared}"), Level::Or)
    } else {
        (format!("{name}.X AND {compared}"), Level::And)
    }))
}

fn leaf_text(names: &dyn Names, leaf: &Leaf, span: Span) -> Result<String, Cannot> {
    match leaf {
        Leaf::Name(path) => {
            if let [step, part] = path.names.as_slice()
                && part.text == "active"
                && let Some(name) = names.step(&step.text)
            {
                return Ok(format!("{name}.X"));
            }
            names.signal(path).ok_or_else(|| (format!("{path}"), span))
        }
        Leaf::Duration(ns) => Ok(duration(*ns)),
        Leaf::Rise(_) | Leaf::Fall(_) => Err(("edges in conditions".to_owned(), span)),
        Leaf::Otherwise => Err(("`otherwise`".to_owned(), span)),
        Leaf::Delay(..) => Err(("delayed conditions".to_owned(), span)),
    }
}

/// Writes statements, one per line.
pub(crate) fn block(
    names: &dyn Names,
    list: &[Stmt],
    indent: usize,
    out: &mut Vec<String>,
) -> Result<(), Cannot> {
    let pad = "    ".repeat(indent);
    if list.is_empty() {
        out.push(format!("{pad};"));
    }
    for stmt in list {
        match &stmt.kind {
            StmtKind::Assign { target, index, value } => {
                let target = names
                    .signal(target)
                    .ok_or_else(|| (format!("the assignment to `{target}`"), stmt.span))?;
                let index = match index {
                    Some(index) => format!("[{}]", expr(names, index)?),
                    None => String::new(),
                };
                out.push(format!("{pad}{target}{index} := {};", expr(names, value)?));
            }
            StmtKind::If { condition, then, otherwise } => {
                out.push(format!("{pad}IF {} THEN", expr(names, condition)?));
                block(names, then, indent + 1, out)?;
                let mut rest = otherwise;
                while let [Stmt { kind: StmtKind::If { condition, then, otherwise }, .. }] =
                    rest.as_slice()
                {
                    out.push(format!("{pad}ELSIF {} THEN", expr(names, condition)?));
                    block(names, then, indent + 1, out)?;
                    rest = otherwise;
                }
                if !rest.is_empty() {
                    out.push(format!("{pad}ELSE"));
                    block(names, rest, indent + 1, out)?;
                }
                out.push(format!("{pad}END_IF;"));
            }
            StmtKind::Raise(_) => {
                return Err(("statements that raise events".to_owned(), stmt.span));
            }
            StmtKind::Send { .. } => {
                return Err(("statements that send events".to_owned(), stmt.span));
            }
            StmtKind::Cancel(_) => {
                return Err(("statements that cancel events".to_owned(), stmt.span));
            }
            StmtKind::Call { .. } => {
                return Err(("calls of extern actions".to_owned(), stmt.span));
            }
            StmtKind::Code(_) => return Err(("text of other languages".to_owned(), stmt.span)),
        }
    }
    Ok(())
}
