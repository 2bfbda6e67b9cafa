//! Proves that the emergency dominates. In every state of a circuit, reachable or not, and under every input, assumed or not, each output pin has its
//! safe value if the condition is true.
//!
//! Nothing is assumed, not even that the flip-flops contain a valid code; the equality proof with the net, in contrast, covers only reachable states.
//! The condition is taken from the net and evaluated over the flip-flops that store its operands. A comparison with a number whose code is invalid
//! has no defined value; if the rest of the condition decides without it, the condition still counts as true. Calls in lists are made during an emergency too,
//! so they are not checked (semantics §3.8).

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use grafsynth_ir::expr::{ArithOp, CompareOp, Expr as GenericExpr, ExprKind, Type};
use grafsynth_ir::logic::{FlopBit, Logic, PinRole, shown_by};
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::net::{Expr, Leaf, Net, StepId};
use grafsynth_ir::program::Origin;
use grafsynth_ir::walk::called_in_lists;
use grafsynth_ir::{Valid, counted};

use super::aig::{Aig, Lit};
use super::import;
use super::number::Number;
use crate::limits::Limits;

/// The result for an emergency in a circuit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Dominance {
    /// In every state and under every input, the condition forces all output pins to their safe values.
    Proved {
        /// The number of output pins that the emergency forces.
        pins: usize,
        /// The number of flip-flops; all their values are covered.
        flops: usize,
    },
    /// In some state, an output pin does not have its safe value although the condition is true.
    Refuted {
        /// A pin that does not have its safe value.
        pin: String,
        /// The names of the inputs and flip-flops that are 1 in this counterexample.
        set: Vec<String>,
    },
    /// Open, with the reason.
    Open(String),
}

impl std::fmt::Display for Dominance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Dominance::Proved { pins, flops } => write!(
                f,
                "emergency proved to dominate: {} safe in every state of {}, under every input",
                counted(*pins, "pin", "pins"),
                counted(*flops, "flip-flop", "flip-flops")
            ),
            Dominance::Refuted { pin, set } => write!(
                f,
                "emergency does not dominate: pin `{pin}` is not safe when these are 1: {}",
                if set.is_empty() { "none".to_owned() } else { set.join(" ") }
            ),
            Dominance::Open(why) => write!(f, "emergency not proved to dominate: {why}"),
        }
    }
}

/// The proof, for a circuit whose pins and flip-flops have roles; `None` for a net without an emergency.
#[must_use]
pub fn dominates(net: &Valid<Net>, logic: &Logic, limits: &Limits) -> Option<Dominance> {
    let emergency = net.emergency.as_ref()?;
    Some(match prove(net, &emergency.condition, logic, limits) {
        Ok(settled) => settled,
        Err(why) => Dominance::Open(why),
    })
}

/// A circuit over free flip-flops and inputs.
struct Circuit<'n> {
    net: &'n Net,
    aig: Aig,
    inputs: BTreeMap<(usize, u32), Lit>,
    bits: BTreeMap<(Origin, u32, u32), Lit>,
    active: BTreeMap<StepId, Vec<Origin>>,
    /// The largest value of each counter.
    caps: BTreeMap<Origin, i64>,
    /// True if a tick passes with the next clock.
    tick: Lit,
    /// True if times are read as after Latch, as mealy outputs do (semantics §3.9, L2).
    is_latched: bool,
}

fn prove(
    net: &Valid<Net>,
    condition: &Expr,
    logic: &Logic,
    limits: &Limits,
) -> Result<Dominance, String> {
    let mut aig = Aig::new();
    let mut names: BTreeMap<Lit, &str> = BTreeMap::new();
    let mut pins = Vec::new();
    let mut inputs = BTreeMap::new();
    let mut tick = Lit::FALSE;
    for pin in logic.inputs.values() {
        let lit = aig.variable();
        names.insert(lit, &pin.name);
        if let PinRole::Input(input, bit) = pin.role {
            inputs.insert((input.index(), bit), lit);
        }
        if pin.role == PinRole::Tick {
            tick = aig.or(tick, lit);
        }
        pins.push(lit);
    }
    let flops: Vec<Lit> = logic.flops.values().map(|_| aig.variable()).collect();
    names.extend(flops.iter().copied().zip(logic.flops.values().map(|flop| flop.name.as_str())));
    let nodes = import(&mut aig, logic, &flops, &pins);
    let mut bits = BTreeMap::new();
    let mut hold = |holds: &FlopBit, lit: Lit| {
        bits.insert((holds.origin, holds.element, holds.bit), lit.negate_if(holds.inverted));
    };
    for (flop, lit) in logic.flops.values().zip(&flops) {
        flop.holds.iter().for_each(|holds| hold(holds, *lit));
    }
    for decoded in &logic.decoded {
        hold(&decoded.holds, nodes[decoded.node.index()]);
    }
    let shown = shown_by(net, |origin| bits.contains_key(&(origin, 0, 0)));
    let active = shown.iter().map(|(step, origins)| (step, origins.clone())).gather();
    let caps = caps(net)?;
    let mut circuit = Circuit { net, aig, inputs, bits, active, caps, tick, is_latched: false };
    let holds = circuit.holds(condition, false)?;
    let is_mealy = logic.outputs.values().any(|output| output.mealy);
    let holds_before = if is_mealy { circuit.holds(condition, true)? } else { holds };
    let mut aig = circuit.aig;
    let called = called_in_lists(net);
    let mut forced = 0;
    for pin in logic.outputs.values() {
        let PinRole::Output(id, bit) = pin.role else { continue };
        let output = &net.outputs[id];
        let is_call = output.is_extern();
        // What a part of a split shows to other parts is no output of the plant.
        if if is_call { called.contains_key(&id) } else { !output.is_forced() } {
            continue;
        }
        if pin.registered.is_some() {
            return Err(format!("a flip-flop drives pin `{}`", pin.name));
        }
        let safe = if is_call {
            false
        } else {
            output.safe_value().abs_diff(output.ty.bounds().0) >> bit.min(63) & 1 == 1
        };
        forced += 1;
        let value = nodes[pin.value.index()];
        let holds = if pin.mealy { holds_before } else { holds };
        let wrong = aig.and(holds, value.negate_if(safe));
        if wrong == Lit::FALSE {
            continue;
        }
        match aig.settle(&[wrong], &[], &|_| 0, limits) {
            Some(None) => {}
            Some(Some(set)) => {
                let set = set.iter().filter_map(|lit| names.get(lit)).map(ToString::to_string);
                return Ok(Dominance::Refuted { pin: pin.name.clone(), set: set.collect() });
            }
            None => return Err(format!("the solver reached its limit at pin `{}`", pin.name)),
        }
    }
    Ok(Dominance::Proved { pins: forced, flops: logic.flops.len() })
}

/// The largest value of each counter in the net.
fn caps(net: &Valid<Net>) -> Result<BTreeMap<Origin, i64>, String> {
    let program = program(net, &ProgramOptions::default())
        .map_err(|_| "the ranges of the counters of the circuit are not known".to_owned())?;
    Ok(program.cells.values().map(|cell| (cell.origin, cell.ty.bounds().1)).gather())
}

/// A Boolean whose value is undefined if it depends on an invalid code.
#[derive(Debug, Clone, Copy)]
struct Flag {
    /// The Boolean is certainly true.
    must: Lit,
    /// The Boolean is not certainly false; `must` implies this.
    may: Lit,
}

impl Flag {
    /// A Boolean that does not depend on an invalid code.
    fn known(lit: Lit) -> Flag {
        Flag { must: lit, may: lit }
    }
}

/// The value of an expression.
enum Value {
    Flag(Flag),
    /// A number, and the condition that every code from which the number was read is valid.
    Number(Number, Lit),
}

impl Value {
    fn known(number: Number) -> Value {
        Value::Number(number, Lit::TRUE)
    }

    fn flag(self) -> Flag {
        let Value::Flag(flag) = self else { unreachable!("validation ensures a Boolean here") };
        flag
    }

    fn number(self) -> (Number, Lit) {
        let Value::Number(number, fits) = self else {
            unreachable!("validation ensures a number here")
        };
        (number, fits)
    }
}

impl Circuit<'_> {
    /// A literal that is true only if the condition is certainly true.
    fn holds(&mut self, condition: &Expr, is_latched: bool) -> Result<Lit, String> {
        self.is_latched = is_latched;
        Ok(self.flag(condition)?.must)
    }

    fn flag(&mut self, expr: &Expr) -> Result<Flag, String> {
        Ok(self.value(expr)?.flag())
    }

    fn flags(&mut self, all: &[Expr]) -> Result<(Vec<Lit>, Vec<Lit>), String> {
        let all = all.iter().map(|one| self.flag(one)).collect::<Result<Vec<_>, _>>()?;
        Ok(all.iter().map(|one| (one.must, one.may)).unzip())
    }

    fn number(&mut self, expr: &Expr) -> Result<(Number, Lit), String> {
        Ok(self.value(expr)?.number())
    }

    fn value(&mut self, expr: &Expr) -> Result<Value, String> {
        Ok(match &expr.kind {
            ExprKind::Bool(value) => Value::Flag(Flag::known(Lit::constant(*value))),
            ExprKind::Int(value) => Value::known(Number::constant(*value)),
            ExprKind::Leaf(leaf) => self.leaf(leaf)?,
            ExprKind::Element(leaf, index) => self.element(leaf, index)?,
            ExprKind::Not(a) => {
                let Flag { must, may } = self.flag(a)?;
                Value::Flag(Flag { must: !may, may: !must })
            }
            ExprKind::And(all) => {
                let (must, may) = self.flags(all)?;
                Value::Flag(Flag { must: self.aig.and_all(must), may: self.aig.and_all(may) })
            }
            ExprKind::Or(all) => {
                let (must, may) = self.flags(all)?;
                Value::Flag(Flag { must: self.aig.or_all(must), may: self.aig.or_all(may) })
            }
            ExprKind::Compare(op, a, b) => {
                let (a, b) = (self.value(a)?, self.value(b)?);
                let ((a, a_fits), (b, b_fits)) = (self.as_number(a), self.as_number(b));
                let holds = Number::compare(&mut self.aig, *op, &a, &b);
                let fits = self.aig.and(a_fits, b_fits);
                Value::Flag(self.known_where(fits, holds))
            }
            ExprKind::Neg(a) => {
                let (a, fits) = self.number(a)?;
                Value::Number(a.negate(&mut self.aig), fits)
            }
            ExprKind::Arith(op, a, b) => {
                let ((a, a_fits), (b, b_fits)) = (self.number(a)?, self.number(b)?);
                let fits = self.aig.and(a_fits, b_fits);
                Value::Number(Number::arith(&mut self.aig, *op, &a, &b), fits)
            }
            ExprKind::Select(c, a, b) => {
                let c = self.flag(c)?;
                let (a, b) = (self.value(a)?, self.value(b)?);
                self.select(c, a, b)
            }
        })
    }

    /// A Boolean that is defined if `fits` is true.
    fn known_where(&mut self, fits: Lit, holds: Lit) -> Flag {
        Flag { must: self.aig.and(fits, holds), may: self.aig.or(!fits, holds) }
    }

    /// Converts a Boolean to the number 0 or 1 for a comparison.
    fn as_number(&mut self, value: Value) -> (Number, Lit) {
        match value {
            Value::Number(number, fits) => (number, fits),
            Value::Flag(Flag { must, may }) => {
                (Number::from_code(&mut self.aig, &[must], 0), self.aig.or(must, !may))
            }
        }
    }

    /// One of the two values; undefined if the selector is undefined and the values may differ.
    fn select(&mut self, c: Flag, a: Value, b: Value) -> Value {
        let known = self.aig.or(c.must, !c.may);
        match (a, b) {
            (Value::Flag(a), Value::Flag(b)) => {
                let must = self.aig.ite(c.must, a.must, b.must);
                let may = self.aig.ite(c.must, a.may, b.may);
                let (must, may) = (self.aig.and(known, must), self.aig.or(!known, may));
                Value::Flag(Flag { must, may })
            }
            (Value::Number(a, a_fits), Value::Number(b, b_fits)) => {
                let fits = self.aig.ite(c.must, a_fits, b_fits);
                let number = Number::select(&mut self.aig, c.must, &a, &b);
                Value::Number(number, self.aig.and(known, fits))
            }
            (Value::Flag(_), Value::Number(..)) | (Value::Number(..), Value::Flag(_)) => {
                unreachable!("validation ensures that both sides of a choice have one type")
            }
        }
    }

    /// The stored code of a piece of state; a single possible value needs no flip-flop.
    fn code(&self, origin: Origin, element: u32, n_bits: u32) -> Result<Vec<Lit>, String> {
        let lit = |bit| self.bits.get(&(origin, element, bit)).copied();
        (0..n_bits)
            .map(|bit| {
                lit(bit).ok_or_else(|| {
                    "no flip-flop stores a value that the emergency reads".to_owned()
                })
            })
            .collect()
    }

    /// A time. Its cap is above all constants that it is compared with, so a tick beyond it makes no difference. A code above the cap is invalid; its
    /// value after a tick is undefined.
    fn time(&mut self, origin: Origin, runs: Lit) -> Result<Value, String> {
        let now = self.counter(origin)?;
        if !self.is_latched {
            return Ok(Value::known(now));
        }
        let one = Number::constant(1);
        let later = Number::arith(&mut self.aig, ArithOp::Add, &now, &one);
        let grows = self.aig.and(self.tick, runs);
        let mut lost = Lit::FALSE;
        if let Some(cap) = self.caps.get(&origin).copied() {
            let (op, cap) = (CompareOp::Gt, Number::constant(cap));
            let beyond = Number::compare(&mut self.aig, op, &now, &cap);
            lost = self.aig.and(grows, beyond);
        }
        Ok(Value::Number(Number::select(&mut self.aig, grows, &later, &now), !lost))
    }

    /// The number in a counter, with as many bits as the circuit has for it.
    fn counter(&mut self, origin: Origin) -> Result<Number, String> {
        let n_bits = (0..64).take_while(|bit| self.bits.contains_key(&(origin, 0, *bit))).count();
        if n_bits == 0 {
            return Err("no flip-flop stores a time that the emergency reads".to_owned());
        }
        let code = self.code(origin, 0, u32::try_from(n_bits).unwrap_or(0))?;
        Ok(Number::from_code(&mut self.aig, &code, 0))
    }

    fn is_active(&mut self, step: StepId) -> Result<Lit, String> {
        let origins = self.active.get(&step).cloned().unwrap_or_default();
        if origins.is_empty() {
            return Err(format!("no flip-flop shows step `{}`", self.net.steps[step].name));
        }
        let lits: Vec<Lit> =
            origins.iter().filter_map(|origin| self.bits.get(&(*origin, 0, 0)).copied()).collect();
        Ok(self.aig.and_all(lits))
    }

    fn of_type(&mut self, ty: Type, code: &[Lit]) -> Value {
        if ty.is_bool() {
            Value::Flag(Flag::known(code.first().copied().unwrap_or(Lit::FALSE)))
        } else {
            let (lo, hi) = ty.bounds();
            let number = Number::from_code(&mut self.aig, code, lo);
            let op = CompareOp::Le;
            let fits = Number::compare(&mut self.aig, op, &number, &Number::constant(hi));
            Value::Number(number, fits)
        }
    }

    fn leaf(&mut self, leaf: &Leaf) -> Result<Value, String> {
        let net = self.net;
        Ok(match *leaf {
            Leaf::Input(id) => {
                let input = &net.inputs[id];
                let pins = (0..input.ty.bits()).map(|bit| {
                    self.inputs.get(&(id.index(), bit)).copied().ok_or_else(|| {
                        format!("no pin carries input `{}`, which the emergency reads", input.name)
                    })
                });
                let code = pins.collect::<Result<Vec<_>, _>>()?;
                self.of_type(input.ty, &code)
            }
            Leaf::Var(var) => {
                let ty = net.vars[var].ty;
                let code = self.code(Origin::Var(var), 0, ty.bits())?;
                self.of_type(ty, &code)
            }
            Leaf::Active(step) => Value::Flag(Flag::known(self.is_active(step)?)),
            Leaf::TasksDone(step) => {
                let active = self.is_active(step)?;
                let n_tasks = net.steps[step].tasks.len();
                if n_tasks == 0 {
                    return Ok(Value::Flag(Flag::known(active)));
                }
                let index = self.counter(Origin::TaskIndex(step))?;
                let last = Number::constant(i64::try_from(n_tasks).unwrap_or(i64::MAX));
                let op = CompareOp::Eq;
                let done = Number::compare(&mut self.aig, op, &index, &last);
                Value::Flag(Flag::known(self.aig.and(active, done)))
            }
            Leaf::Elapsed(step) => {
                let runs = self.is_active(step)?;
                self.time(Origin::Elapsed(step), runs)?
            }
            Leaf::LastElapsed(step) => {
                let runs = self.is_active(step)?;
                self.time(Origin::LastElapsed(step), runs)?
            }
            Leaf::Timer(timer) => {
                let runs = self.code(Origin::TimerCondition(timer), 0, 1)?;
                self.time(Origin::Timer(timer), runs.first().copied().unwrap_or(Lit::FALSE))?
            }
            Leaf::Controlled(action) => {
                let code = self.code(Origin::ActionQ(action), 0, 1)?;
                self.of_type(Type::Bool, &code)
            }
            Leaf::Rise(_) | Leaf::Fall(_) | Leaf::Fireable(_) => {
                unreachable!("validation excludes edges and receptivities from an emergency")
            }
        })
    }

    fn element(&mut self, leaf: &Leaf, index: &GenericExpr<Leaf>) -> Result<Value, String> {
        let Leaf::Var(var) = *leaf else {
            unreachable!("only variables have elements");
        };
        let data = &self.net.vars[var];
        let (ty, len) = (data.ty, data.len.unwrap_or(1));
        let (index, fits) = self.number(index)?;
        let mut found = None;
        for element in 0..len {
            let code = self.code(Origin::Var(var), element, ty.bits())?;
            let here = self.of_type(ty, &code);
            let number = Number::constant(i64::from(element));
            let is_here = Number::compare(&mut self.aig, CompareOp::Eq, &index, &number);
            let is_here = self.known_where(fits, is_here);
            found = Some(match found {
                None => here,
                Some(other) => self.select(is_here, here, other),
            });
        }
        found.ok_or_else(|| "the emergency reads an array without elements".to_owned())
    }
}
