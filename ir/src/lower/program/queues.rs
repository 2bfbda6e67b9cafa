//! The event queues of statecharts (§5).
//!
//! A queue is an array whose first element is taken next; its elements are event numbers, 0 after its end. If nothing is sent and every event of a row
//! fits, the external queue is not an array: the events of a row wait in their own bits and are taken in declaration order.

use super::{Builder, cell, codes, temp};
use crate::arena::IdMap;
use crate::diag::Diagnostic;
use crate::expr::{ArithOp, CompareOp, ExprKind, Type};
use crate::net::{InputId, InputKind, SendId};
use crate::program::{Cell, CellId, Expr, Leaf, Origin, Stmt, TempId, TempRole};
use crate::span::Span;

use super::lists::select;

/// Both queues of a net.
#[derive(Debug, Clone)]
pub(super) struct Queues {
    /// The events that some `on` refers to, in declaration order; the first has number 1.
    pub(super) events: Vec<InputId>,
    /// The queue of raised events, if any event is raised.
    pub(super) internal: Option<Queue>,
    /// The storage of the events of rows and of sends.
    pub(super) external: External,
    /// True if something is sent to the external queue.
    pub(super) sends: bool,
}

/// A queue in cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Queue {
    pub(super) items: CellId,
    pub(super) length: CellId,
    pub(super) bound: u32,
}

/// The storage of external events.
#[derive(Debug, Clone)]
pub(super) enum External {
    /// There are no external events.
    None,
    /// The events wait in the bits of the row, each with a temporary that is true while the event is still waiting.
    Row(Vec<(InputId, Option<TempId>)>),
    /// The events wait in a queue.
    Queue(Queue),
}

/// The maximum number of places in a queue.
const LONGEST: usize = 65_535;

/// The longest queue whose elements are moved individually.
const SHORT: u32 = 8;

fn arith(op: ArithOp, a: Expr, b: i64) -> Expr {
    Expr::new(ExprKind::Arith(op, Box::new(a), Box::new(Expr::int(b))), Span::default())
}

fn element(items: CellId, index: Expr) -> Expr {
    Expr::new(ExprKind::Element(Leaf::Cell(items), Box::new(index)), Span::default())
}

pub(super) fn is_empty(queue: Queue) -> Expr {
    Expr::compare(CompareOp::Eq, cell(queue.length), Expr::int(0))
}

impl Queues {
    /// The number of an event in the queues; `None` for an event that is never queued.
    pub(super) fn number(&self, event: InputId) -> Option<i64> {
        let at = self.events.binary_search(&event).ok()?;
        i64::try_from(at + 1).ok()
    }

    /// The type of an event number; 0 means none.
    pub(super) fn number_type(&self) -> Type {
        Type::Int { lo: 0, hi: i64::try_from(self.events.len()).unwrap_or(i64::MAX) }
    }

    /// The maximum number of events in the external queue when the evolution begins.
    pub(super) fn external_bound(&self) -> u32 {
        match &self.external {
            External::None => 0,
            External::Row(events) => u32::try_from(events.len()).unwrap_or(u32::MAX),
            External::Queue(queue) => queue.bound,
        }
    }
}

impl Builder<'_> {
    pub(super) fn queue_cells(&mut self) {
        let net = self.net;
        // An event that no `on` refers to is never queued.
        let mut listens = IdMap::filled(&net.inputs, false);
        net.transitions.values().flat_map(|one| &one.events).for_each(|event| {
            listens[*event] = true;
        });
        let events: Vec<InputId> = net.inputs.ids().filter(|event| listens[*event]).collect();
        let of_rows: Vec<InputId> =
            events.iter().copied().filter(|id| net.inputs[*id].kind == InputKind::Event).collect();
        let n_of_rows = u32::try_from(of_rows.len()).unwrap_or(u32::MAX);
        let bound = net.settings.queue.unwrap_or(n_of_rows);
        if (bound as usize) > LONGEST {
            let message = format!("each queue has {bound} entries; the maximum is {LONGEST}");
            let help = "declare the number of events that can really wait at the same time";
            let place = net.name.span;
            let finding =
                Diagnostic::error(codes::QUEUE_TOO_LONG, message).at(place, "").help(help);
            self.findings.push(finding);
            return;
        }
        let raises = events.iter().any(|event| self.needs.raised[*event]);
        let sends = net.sends.values().any(|slot| listens[slot.event]);
        let mut queues = Queues { events, internal: None, external: External::None, sends };
        let ty = queues.number_type();
        let mut queue = |name: &str, items: Origin, length: Origin| {
            let zeros = vec![0; bound as usize];
            let items = Cell::plain(name.to_owned(), ty, items);
            let items = self.cells.push(Cell { len: Some(bound), init: zeros, ..items });
            let counts = Type::Int { lo: 0, hi: i64::from(bound) };
            let length = self.new_cell(format!("{name}.length"), counts, length);
            Queue { items, length, bound }
        };
        if raises {
            queues.internal =
                Some(queue("internal", Origin::InternalQueue, Origin::InternalLength));
        }
        if sends || bound < n_of_rows {
            queues.external =
                External::Queue(queue("external", Origin::ExternalQueue, Origin::ExternalLength));
        } else if !of_rows.is_empty() {
            queues.external =
                External::Row(of_rows.into_iter().map(|event| (event, None)).collect());
        }
        self.queues = Some(queues);
    }

    /// `raise e`: outside statecharts the event is present in the next check; in a statechart it joins the internal queue.
    pub(super) fn raise(&mut self, event: InputId, out: &mut Vec<Stmt>) {
        if let Some(pending) = self.pending[event] {
            out.push(Stmt::Store(pending, None, Expr::bool(true)));
        }
        if let Some(queues) = &self.queues
            && let Some(queue) = queues.internal
            && let Some(number) = queues.number(event)
        {
            self.join(queue, number, out);
        }
    }

    /// `send e after d`: a delayed send restarts its slot; any other joins the external queue at once.
    pub(super) fn send(&mut self, slot: SendId, out: &mut Vec<Stmt>) {
        let data = &self.net.sends[slot];
        if let Some(left) = self.send[slot] {
            out.push(Stmt::Store(left, None, Expr::int(i64::from(data.delay))));
        } else {
            self.join_external(data.event, out);
        }
    }

    fn join_external(&mut self, event: InputId, out: &mut Vec<Stmt>) {
        if let Some(queues) = &self.queues
            && let External::Queue(queue) = queues.external
            && let Some(number) = queues.number(event)
        {
            self.join(queue, number, out);
        }
    }

    /// Adds an event; if the queue is full, the event is lost and the row reports a fault.
    fn join(&mut self, queue: Queue, number: i64, out: &mut Vec<Stmt>) {
        let has_room =
            Expr::compare(CompareOp::Lt, cell(queue.length), Expr::int(i64::from(queue.bound)));
        let room = vec![
            Stmt::Store(queue.items, Some(cell(queue.length)), Expr::int(number)),
            Stmt::Store(queue.length, None, arith(ArithOp::Add, cell(queue.length), 1)),
        ];
        let lost =
            self.now.fault.map(|fault| Stmt::Set(fault, Expr::bool(true))).into_iter().collect();
        out.push(Stmt::If(has_room, room, lost));
    }

    /// Takes the first event from a queue that is not empty.
    pub(super) fn take_first(&mut self, queue: Queue, current: TempId, out: &mut Vec<Stmt>) {
        out.push(Stmt::Set(current, element(queue.items, Expr::int(0))));
        let last = i64::from(queue.bound) - 1;
        if queue.bound <= SHORT {
            for at in 0..last {
                out.push(Stmt::Store(
                    queue.items,
                    Some(Expr::int(at)),
                    element(queue.items, Expr::int(at + 1)),
                ));
            }
            out.push(Stmt::Store(queue.items, Some(Expr::int(last)), Expr::int(0)));
            out.push(Stmt::Store(queue.length, None, arith(ArithOp::Sub, cell(queue.length), 1)));
            return;
        }
        let at = self.new_temp("at", Type::Int { lo: 0, hi: last }, TempRole::Helper);
        out.push(Stmt::Store(queue.length, None, arith(ArithOp::Sub, cell(queue.length), 1)));
        out.push(Stmt::Set(at, Expr::int(0)));
        let next = arith(ArithOp::Add, temp(at), 1);
        let body = vec![
            Stmt::Store(queue.items, Some(temp(at)), element(queue.items, next.clone())),
            Stmt::Set(at, next),
        ];
        let condition = Expr::compare(CompareOp::Lt, temp(at), cell(queue.length));
        out.push(Stmt::Repeat { limit: queue.bound - 1, condition, body });
        out.push(Stmt::Store(queue.items, Some(temp(at)), Expr::int(0)));
    }

    /// L3 of statecharts: due sends by their remaining ticks, then by slot; then the events of the row.
    pub(super) fn latch_queues(&mut self, out: &mut Vec<Stmt>) {
        self.latch_sends(out);
        let Some(mut queues) = self.queues.take() else { return };
        match &mut queues.external {
            External::None => {}
            External::Row(events) => {
                for (event, waits) in events {
                    let name = format!("{}.waits", self.net.inputs[*event].name);
                    let id = self.new_temp(name, Type::Bool, TempRole::Helper);
                    *waits = Some(id);
                    let row = if self.reset {
                        Expr::bool(false)
                    } else {
                        Expr::leaf(Leaf::Input(*event), Span::default())
                    };
                    out.push(Stmt::Set(id, row));
                }
            }
            External::Queue(queue) => {
                let queue = *queue;
                if !self.reset {
                    for event in queues.events.clone() {
                        if self.is_external(event)
                            && let Some(number) = queues.number(event)
                        {
                            let mut joins = Vec::new();
                            self.join(queue, number, &mut joins);
                            out.push(Stmt::If(
                                Expr::leaf(Leaf::Input(event), Span::default()),
                                joins,
                                Vec::new(),
                            ));
                        }
                    }
                }
            }
        }
        self.queues = Some(queues);
    }

    /// Reduces the slots by the ticks that have passed; those without remaining ticks are due.
    fn latch_sends(&mut self, out: &mut Vec<Stmt>) {
        if self.reset {
            return;
        }
        let dt = || Expr::leaf(Leaf::Dt, Span::default());
        let longest = self.net.sends.values().map(|slot| i64::from(slot.delay)).max().unwrap_or(0);
        let mut due = Vec::new();
        for (id, slot) in self.net.sends.iter() {
            let Some(left) = self.send[id] else { continue };
            let runs = Expr::compare(CompareOp::Gt, cell(left), Expr::int(0));
            let ends = Expr::compare(CompareOp::Le, cell(left), dt());
            let ty = Type::Int { lo: 0, hi: longest };
            // The ticks that a due slot had left; 0 if it is not due.
            let had = self.new_temp(format!("{}.due", slot.name), ty, TempRole::Helper);
            out.push(Stmt::Set(
                had,
                select(Expr::and([runs, ends.clone()]), cell(left), Expr::int(0)),
            ));
            let less = ExprKind::Arith(ArithOp::Sub, Box::new(cell(left)), Box::new(dt()));
            out.push(Stmt::Store(
                left,
                None,
                select(ends, Expr::int(0), Expr::new(less, Span::default())),
            ));
            due.push((had, slot.event));
        }
        if let [(had, event)] = due.as_slice() {
            let mut joins = Vec::new();
            self.join_external(*event, &mut joins);
            out.push(Stmt::If(
                Expr::compare(CompareOp::Gt, temp(*had), Expr::int(0)),
                joins,
                Vec::new(),
            ));
        } else if !due.is_empty() {
            self.join_in_order(&due, longest, out);
        }
    }

    /// Adds the due events to the queue in rounds: in each round, those of all slots with the fewest remaining ticks. If `dt` is at most 1, one round is
    /// enough.
    fn join_in_order(&mut self, due: &[(TempId, InputId)], longest: i64, out: &mut Vec<Stmt>) {
        let waits = |had: TempId| Expr::compare(CompareOp::Gt, temp(had), Expr::int(0));
        let least = self.new_temp("least", Type::Int { lo: 0, hi: longest }, TempRole::Helper);
        let mut body = vec![Stmt::Set(least, Expr::int(longest))];
        for (had, _) in due {
            let is_less = Expr::compare(CompareOp::Lt, temp(*had), temp(least));
            let value = select(Expr::and([waits(*had), is_less]), temp(*had), temp(least));
            body.push(Stmt::Set(least, value));
        }
        for (had, event) in due {
            let mut joins = vec![Stmt::Set(*had, Expr::int(0))];
            self.join_external(*event, &mut joins);
            let is_least = Expr::compare(CompareOp::Eq, temp(*had), temp(least));
            body.push(Stmt::If(Expr::and([waits(*had), is_least]), joins, Vec::new()));
        }
        let condition = Expr::or(due.iter().map(|(had, _)| waits(*had)));
        let limit = u32::try_from(due.len()).unwrap_or(u32::MAX);
        out.push(Stmt::Repeat { limit, condition, body });
    }

    /// Empties the queues.
    pub(super) fn drop_queues(&self) -> Vec<Stmt> {
        let mut out = Vec::new();
        let Some(queues) = &self.queues else { return out };
        if let Some(queue) = queues.internal {
            out.push(Stmt::Store(queue.length, None, Expr::int(0)));
        }
        match &queues.external {
            External::None => {}
            External::Row(events) => {
                out.extend(
                    events
                        .iter()
                        .filter_map(|(_, waits)| waits.map(|id| Stmt::Set(id, Expr::bool(false)))),
                );
            }
            External::Queue(queue) => out.push(Stmt::Store(queue.length, None, Expr::int(0))),
        }
        out
    }
}
