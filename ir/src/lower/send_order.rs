//! Pass `send-order`: send slots in the order in which the text mentions them first, for in that order those join that are due with equal times left
//! (semantics §5).

use super::context::Lowering;
use crate::arena::Arena;
use crate::net::{SendId, SendSlot, StmtKind};
use crate::span::Span;
use crate::walk::{for_each_stmt, for_each_stmt_mut};

/// After all passes that make lists. Instances of one library chart mention their slots at one place: among these the order of the instances holds.
pub(super) fn send_order(lowering: &mut Lowering<'_>) {
    let net = &mut lowering.net;
    let mut first: Vec<Option<Span>> = vec![None; net.sends.len()];
    for_each_stmt(net, &mut |stmt| {
        if let StmtKind::Send(slot) | StmtKind::Cancel(slot) = stmt.kind {
            let first = &mut first[slot.index()];
            *first = Some(first.map_or(stmt.span, |known| known.min(stmt.span)));
        }
    });
    let mut order: Vec<SendId> = net.sends.ids().collect();
    order.sort_by_key(|slot| first[slot.index()]);
    if order.is_sorted() {
        return;
    }
    let mut sends: Arena<SendSlot> = Arena::default();
    let mut moved: Vec<Option<SendId>> = vec![None; order.len()];
    for slot in order {
        moved[slot.index()] = Some(sends.push(net.sends[slot].clone()));
    }
    net.sends = sends;
    for_each_stmt_mut(net, &mut |stmt| {
        if let StmtKind::Send(slot) | StmtKind::Cancel(slot) = &mut stmt.kind
            && let Some(now) = moved[slot.index()]
        {
            *slot = now;
        }
    });
}
