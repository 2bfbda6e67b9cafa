//! The standard function blocks: their state in the chart, and the effect of a call.
//!
//! A timer uses a free timer of the chart, which counts while its block runs. The block itself is evaluated when it is called, as on a
//! controller:
//!
//! ```text
//! t(IN := e, PT := 3 s)      t.IN := e;  t.Q := t.IN and t.ET >= 3 s      timer t.ET while t.IN
//! ```
//! The free timer starts in the scan in which `t.IN` becomes true. At the beginning of each later scan it includes the time of that scan
//! (semantics §7), so it equals a clock that is read at each call.

use grafsynth_ir::chart::{Declaration, DeclarationKind, Expr, Item, Leaf, Stmt, StmtKind};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{CompareOp, ExprKind};
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

use super::context::{Elaborator, FrameId, ObjectKind, Outcome};
use super::types::{Block, Ty};
use super::usage::upper;
use super::value::{Kind, Time, Value, leaf};
use crate::codes;
use crate::st::ast::{self, Arg};

/// Inputs and outputs of a standard function block. The name is in capitals.
pub(crate) fn standard_block(name: &str) -> Option<(Vec<&'static str>, Vec<&'static str>)> {
    let block = Block::named(name)?;
    let mut inputs = block.order();
    let outputs = inputs.split_off(block.inputs().len());
    Some((inputs, outputs))
}

impl Block {
    /// The block with this name, which is in capitals.
    pub(super) fn named(name: &str) -> Option<Block> {
        let (base, ty) = name.split_once('_').unwrap_or((name, "INT"));
        if matches!(base, "CTU" | "CTD" | "CTUD") {
            let (lo, hi) = super::types::integer(ty)?;
            let (lo, hi) = (lo.max(super::types::WIDEST.0), hi.min(super::types::WIDEST.1));
            return Some(match base {
                "CTU" => Block::Ctu(lo, hi),
                "CTD" => Block::Ctd(lo, hi),
                _ => Block::Ctud(lo, hi),
            });
        }
        Some(match name {
            "TON" | "TON_TIME" => Block::Ton,
            "TOF" | "TOF_TIME" => Block::Tof,
            "TP" | "TP_TIME" => Block::Tp,
            "R_TRIG" => Block::RTrig,
            "F_TRIG" => Block::FTrig,
            "SR" => Block::Sr,
            "RS" => Block::Rs,
            _ => return None,
        })
    }

    /// The type name of the block.
    pub(super) fn name(self) -> String {
        match self {
            Block::Ton => "TON",
            Block::Tof => "TOF",
            Block::Tp => "TP",
            Block::RTrig => "R_TRIG",
            Block::FTrig => "F_TRIG",
            Block::Ctu(..) => "CTU",
            Block::Ctd(..) => "CTD",
            Block::Ctud(..) => "CTUD",
            Block::Sr => "SR",
            Block::Rs => "RS",
        }
        .to_owned()
    }

    /// The first Boolean output.
    pub(super) fn output(self) -> String {
        self.order()[self.inputs().len()].to_owned()
    }

    /// The inputs in order, each with its alternative names.
    fn inputs(self) -> &'static [&'static [&'static str]] {
        match self {
            Block::Ton | Block::Tof | Block::Tp => &[&["IN"], &["PT"]],
            Block::RTrig | Block::FTrig => &[&["CLK"]],
            Block::Ctu(..) => &[&["CU"], &["R", "RESET"], &["PV"]],
            Block::Ctd(..) => &[&["CD"], &["LD", "LOAD"], &["PV"]],
            Block::Ctud(..) => &[&["CU"], &["CD"], &["R", "RESET"], &["LD", "LOAD"], &["PV"]],
            Block::Sr => &[&["S1", "SET1"], &["R", "RESET"]],
            Block::Rs => &[&["S", "SET"], &["R1", "RESET1"]],
        }
    }

    /// The names in the order of a positional call: inputs, then outputs.
    pub(super) fn order(self) -> Vec<&'static str> {
        let inputs = self.inputs().iter().map(|names| names[0]);
        let outputs: &[&str] = match self {
            Block::Ton | Block::Tof | Block::Tp => &["Q", "ET"],
            Block::RTrig | Block::FTrig => &["Q"],
            Block::Ctu(..) | Block::Ctd(..) => &["Q", "CV"],
            Block::Ctud(..) => &["QU", "QD", "CV"],
            Block::Sr | Block::Rs => &["Q1"],
        };
        inputs.chain(outputs.iter().copied()).collect()
    }

    /// The main name of an input for any of its names.
    pub(super) fn canonical(self, name: &str) -> Option<&'static str> {
        self.inputs().iter().find(|names| names.contains(&name)).map(|names| names[0])
    }

    fn input_type(self, name: &str) -> Ty {
        match (self, name) {
            (Block::Ctu(lo, hi) | Block::Ctd(lo, hi) | Block::Ctud(lo, hi), "PV") => {
                Ty::Int { lo, hi, wraps: false }
            }
            (_, "PT") => Ty::Time,
            (_, _) => Ty::Bool,
        }
    }

    /// The state of the block: name, type, and whether it is an output.
    fn state(self) -> Vec<(&'static str, Ty)> {
        let count = |lo, hi| Ty::Int { lo, hi, wraps: false };
        match self {
            Block::Ton | Block::Tp => vec![("IN", Ty::Bool), ("Q", Ty::Bool)],
            Block::Tof => vec![("RUN", Ty::Bool), ("Q", Ty::Bool)],
            Block::RTrig | Block::FTrig => vec![("M", Ty::Bool), ("Q", Ty::Bool)],
            Block::Ctu(lo, hi) => vec![("CU_M", Ty::Bool), ("Q", Ty::Bool), ("CV", count(lo, hi))],
            Block::Ctd(lo, hi) => vec![("CD_M", Ty::Bool), ("Q", Ty::Bool), ("CV", count(lo, hi))],
            Block::Ctud(lo, hi) => vec![
                ("CU_M", Ty::Bool),
                ("CD_M", Ty::Bool),
                ("QU", Ty::Bool),
                ("QD", Ty::Bool),
                ("CV", count(lo, hi)),
            ],
            Block::Sr | Block::Rs => vec![("Q1", Ty::Bool)],
        }
    }

    /// The state variable that must be true for the timer of the block to count.
    fn running(self) -> Option<&'static str> {
        match self {
            Block::Ton => Some("IN"),
            Block::Tof => Some("RUN"),
            Block::Tp => Some("Q"),
            Block::RTrig
            | Block::FTrig
            | Block::Ctu(..)
            | Block::Ctd(..)
            | Block::Ctud(..)
            | Block::Sr
            | Block::Rs => None,
        }
    }
}

fn assign(place: &Name, value: Expr, span: Span) -> Stmt {
    let kind = StmtKind::Assign { target: place.clone().into(), index: None, value };
    Stmt { kind, span }
}

fn choose(condition: Expr, then: Vec<Stmt>, otherwise: Vec<Stmt>, span: Span) -> Stmt {
    Stmt { kind: StmtKind::If { condition, then, otherwise }, span }
}

fn at_least(a: Expr, b: Expr) -> Expr {
    Expr::compare(CompareOp::Ge, a, b)
}

impl Elaborator<'_> {
    /// Declares the state of an instance. `omitted` are inputs that a call omits or that are read elsewhere.
    pub(super) fn declare_block(
        &mut self,
        object: usize,
        block: Block,
        name: &Name,
        omitted: &dyn Fn(&str) -> bool,
        init: &[(Name, ast::Init)],
        outer: FrameId,
    ) {
        let frame = self.objects[object].frame;
        let full = |part: &str| Name::new(format!("{name}.{part}"), name.span);
        for (part, ty) in block.state() {
            self.declare_var(frame, part, full(part), &ty, Vec::new(), Meta::default());
        }
        if let Some(running) = block.running() {
            let condition = leaf(full(running).into(), name.span);
            self.items.push(Item::Declaration(Declaration {
                name: full("ET"),
                kind: DeclarationKind::Timer { condition },
                meta: Meta { span: name.span, ..Meta::default() },
            }));
        }
        for names in block.inputs() {
            let part = names[0];
            let ty = block.input_type(part);
            let given = init.iter().find(|(field, _)| names.contains(&upper(&field.text).as_str()));
            if ty == Ty::Time {
                if let Some((_, ast::Init::Value(value))) = given
                    && let Ok(value) = self.value(outer, value)
                    && let Kind::Time(Time::Constant(ns)) = value.kind
                {
                    self.objects[object].preset = Some(ns);
                }
                continue;
            }
            let needed = names.iter().any(|name| omitted(name));
            if self.frames[frame].names.contains_key(part) || !needed {
                continue;
            }
            let values = match given {
                Some((_, init)) => self.initial(outer, &ty, init).unwrap_or_default(),
                None => Vec::new(),
            };
            self.declare_var(frame, part, full(part), &ty, values, Meta::default());
        }
    }

    /// ET of a timer; `None` for other fields.
    pub(super) fn block_field(
        &mut self,
        object: usize,
        field: &str,
        span: Span,
    ) -> Option<Outcome<Value>> {
        let ObjectKind::Standard(block) = self.objects[object].kind else { return None };
        if !matches!(field, "ET" | "PT") || block.running().is_none() {
            return None;
        }
        let prefix = self.objects[object].prefix.clone();
        let limit = self.objects[object].preset;
        if field == "PT" {
            return Some(Ok(Value::time(limit.unwrap_or(0), span)));
        }
        if block != Block::Ton {
            return Some(Err(self.refused(
                "ET of TOF and TP",
                span,
                "read ET of a TON, or a step's time",
            )));
        }
        let Some(limit) = limit else {
            return Some(Err(self.report(
                Diagnostic::error(codes::ST_TIMER, format!("ET of `{prefix}` is read before its PT is known"))
                    .at(span, "")
                    .help("give PT in the declaration, as in `t : TON := (PT := T#3s);`, or call the block before"),
            )));
        };
        let name = |part: &str| Name::new(format!("{prefix}.{part}"), span);
        let running = Box::new(leaf(name("IN").into(), span));
        let expr = leaf(name("ET").into(), span);
        Some(Ok(Value { expr, kind: Kind::Time(Time::Elapsed { running, limit }) }))
    }

    /// Expands one call of an instance.
    pub(super) fn call_block(
        &mut self,
        frame: FrameId,
        object: usize,
        block: Block,
        arguments: &[Arg],
        span: Span,
        out: &mut Vec<Stmt>,
    ) -> Outcome<()> {
        let prefix = self.objects[object].prefix.clone();
        let name = |part: &str| Name::new(format!("{prefix}.{part}"), span);
        let read = |part: &str| leaf(name(part).into(), span);
        if block.running().is_some() {
            self.objects[object].n_calls += 1;
            if self.objects[object].n_calls == 2 {
                self.report(
                    Diagnostic::warning(
                        codes::ST_TIMER,
                        format!("`{prefix}` is called in several places"),
                    )
                    .at(span, "called again here")
                    .help("a timer that stops and restarts within one scan keeps running; call each timer once"),
                );
            }
        }
        let mut list = Vec::new();
        let mut bools: Vec<(&'static str, Expr)> = Vec::new();
        let mut preset = None;
        // A variable PT: each of its values with the condition that it has this value.
        let mut presets: Vec<(i64, Expr)> = Vec::new();
        let mut limit = Expr::int(0);
        for names in block.inputs() {
            let part = names[0];
            let ty = block.input_type(part);
            let given = arguments.iter().find(|one| {
                !one.is_output
                    && one
                        .name
                        .as_ref()
                        .is_some_and(|name| names.contains(&upper(&name.text).as_str()))
            });
            let value = match given {
                Some(argument) => {
                    let value = self.value(frame, &argument.value)?;
                    Some(self.fit(value, &ty, part)?)
                }
                None => None,
            };
            if ty == Ty::Time {
                let ns = match value {
                    Some(Value { kind: Kind::Time(Time::Constant(ns)), .. }) => ns,
                    Some(value @ Value { kind: Kind::Time(Time::Varying(Some(_))), .. }) => {
                        presets = self.each_value(&value, value.expr.span)?;
                        continue;
                    }
                    Some(_) => {
                        let at = given.map_or(span, |argument| argument.value.span);
                        return Err(self.report(
                            Diagnostic::error(
                                codes::ST_TIMER,
                                format!("PT of `{prefix}` can have any value"),
                            )
                            .at(at, "computed at run time")
                            .help("give a constant, or a TIME variable to which only constants are assigned"),
                        ));
                    }
                    None => self.objects[object].preset.unwrap_or(0),
                };
                self.objects[object].preset = Some(ns);
                preset = Some(u64::try_from(ns).unwrap_or(0));
                continue;
            }
            let is_stored = self.frames[self.objects[object].frame].names.contains_key(part)
                && !(part == "IN" && matches!(block, Block::Ton | Block::Tp));
            let expr = match value {
                Some(value) => {
                    // Values that read the state of the block must be evaluated before the state changes.
                    let own = mentions(&value.expr, &format!("{prefix}."));
                    if is_stored || own && block.running().is_none() {
                        if !is_stored {
                            let frame = self.objects[object].frame;
                            self.declare_var(
                                frame,
                                part,
                                name(part),
                                &ty,
                                Vec::new(),
                                Meta::default(),
                            );
                        }
                        list.push(assign(&name(part), value.expr, span));
                        read(part)
                    } else {
                        value.expr
                    }
                }
                None if is_stored || part == "IN" && block != Block::Tof => read(part),
                None if ty == Ty::Bool => Expr::new(ExprKind::Bool(false), span),
                None => Expr::new(ExprKind::Int(0), span),
            };
            if part == "PV" { limit = expr } else { bools.push((part, expr)) }
        }
        let input = |part: &str| {
            bools
                .iter()
                .find(|(name, _)| *name == part)
                .map_or_else(|| Expr::bool(false), |(_, expr)| expr.clone())
        };
        let reached = || {
            let after = |ns: u64| at_least(read("ET"), Expr::leaf(Leaf::Duration(ns), span));
            if presets.is_empty() {
                return after(preset.unwrap_or(0));
            }
            let one = |(ns, is_this): &(i64, Expr)| {
                Expr::and([is_this.clone(), after(u64::try_from(*ns).unwrap_or(0))])
            };
            Expr::or(presets.iter().map(one))
        };
        let set = |part: &str, value: Expr| assign(&name(part), value, span);
        match block {
            Block::Ton => {
                let value = input("IN");
                if value != read("IN") {
                    list.push(set("IN", value));
                }
                list.push(set("Q", Expr::and([read("IN"), reached()])));
            }
            Block::Tof => {
                let held = Expr::and([read("Q"), reached().not()]);
                list.push(set("Q", Expr::or([input("IN"), held])));
                list.push(set("RUN", Expr::and([read("Q"), input("IN").not()])));
            }
            Block::Tp => {
                // If a pulse ends and IN has an edge in the same call, the edge is lost.
                let begins = Expr::and([input("IN"), read("IN").not()]);
                let start = choose(begins, vec![set("Q", Expr::bool(true))], Vec::new(), span);
                let end = choose(reached(), vec![set("Q", Expr::bool(false))], Vec::new(), span);
                list.push(choose(read("Q"), vec![end], vec![start], span));
                list.push(set("IN", input("IN")));
            }
            Block::RTrig => {
                list.push(set("Q", Expr::and([input("CLK"), read("M").not()])));
                list.push(set("M", input("CLK")));
            }
            Block::FTrig => {
                list.push(set("Q", Expr::and([input("CLK").not(), read("M").not()])));
                list.push(set("M", input("CLK").not()));
            }
            Block::Ctu(_, hi) => {
                let counts = Expr::and([
                    input("CU"),
                    read("CU_M").not(),
                    Expr::compare(CompareOp::Lt, read("CV"), Expr::int(hi)),
                ]);
                let up = choose(counts, vec![step_by(&name("CV"), 1, span)], Vec::new(), span);
                let reset = vec![set("CV", Expr::int(0))];
                list.push(choose(input("R"), reset, vec![up], span));
                list.push(set("CU_M", input("CU")));
                list.push(set("Q", at_least(read("CV"), limit)));
            }
            Block::Ctd(lo, _) => {
                let counts = Expr::and([
                    input("CD"),
                    read("CD_M").not(),
                    Expr::compare(CompareOp::Gt, read("CV"), Expr::int(lo)),
                ]);
                let down = choose(counts, vec![step_by(&name("CV"), -1, span)], Vec::new(), span);
                let load = vec![set("CV", limit)];
                list.push(choose(input("LD"), load, vec![down], span));
                list.push(set("CD_M", input("CD")));
                list.push(set("Q", Expr::compare(CompareOp::Le, read("CV"), Expr::int(0))));
            }
            Block::Ctud(lo, hi) => {
                let up_edge = || Expr::and([input("CU"), read("CU_M").not()]);
                let down_edge = || Expr::and([input("CD"), read("CD_M").not()]);
                let up = Expr::and([
                    up_edge(),
                    down_edge().not(),
                    Expr::compare(CompareOp::Lt, read("CV"), Expr::int(hi)),
                ]);
                let down = Expr::and([
                    down_edge(),
                    up_edge().not(),
                    Expr::compare(CompareOp::Gt, read("CV"), Expr::int(lo)),
                ]);
                let down = choose(down, vec![step_by(&name("CV"), -1, span)], Vec::new(), span);
                let count = choose(up, vec![step_by(&name("CV"), 1, span)], vec![down], span);
                let load = choose(input("LD"), vec![set("CV", limit.clone())], vec![count], span);
                let reset = vec![set("CV", Expr::int(0))];
                list.push(choose(input("R"), reset, vec![load], span));
                list.push(set("CU_M", input("CU")));
                list.push(set("CD_M", input("CD")));
                list.push(set("QU", at_least(read("CV"), limit)));
                list.push(set("QD", Expr::compare(CompareOp::Le, read("CV"), Expr::int(0))));
            }
            Block::Sr => {
                let held = Expr::and([input("R").not(), read("Q1")]);
                list.push(set("Q1", Expr::or([input("S1"), held])));
            }
            Block::Rs => {
                let on = Expr::or([input("S"), read("Q1")]);
                list.push(set("Q1", Expr::and([input("R1").not(), on])));
            }
        }
        self.spend(span, list.len() * 4)?;
        out.extend(list);
        Ok(())
    }
}

/// `x := x + 1`
fn step_by(name: &Name, by: i64, span: Span) -> Stmt {
    let value = Expr::new(
        ExprKind::Arith(
            if by < 0 {
                grafsynth_ir::expr::ArithOp::Sub
            } else {
                grafsynth_ir::expr::ArithOp::Add
            },
            Box::new(leaf(name.clone().into(), span)),
            Box::new(Expr::new(ExprKind::Int(by.abs()), span)),
        ),
        span,
    );
    assign(name, value, span)
}

/// Whether an expression reads a name that begins with `prefix`.
pub(super) fn mentions(expr: &Expr, prefix: &str) -> bool {
    let mut found = false;
    expr.for_each_leaf(&mut |leaf| {
        if let Leaf::Name(path) = leaf {
            found |= path.names.last().is_some_and(|name| name.text.starts_with(prefix));
        }
    });
    found
}
