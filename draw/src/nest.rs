//! The drawing of a statechart: each state is laid out in layers, from inside out, and the parts of transitions are joined to lines.

use crate::container::{Inside, Piece, lay_out};
use crate::picture::{Mark, Pen, Picture, Shape};
use crate::routes::plans;
use crate::states::Tree;
use std::collections::BTreeMap;

/// Draws a statechart without its heading.
pub(crate) fn draw(tree: &Tree) -> Picture {
    let (order, plans) = plans(tree);
    let mut insides: BTreeMap<usize, Inside> = BTreeMap::new();
    for container in order.into_iter().rev() {
        let inside = lay_out(tree, container, &plans[container], &mut insides);
        insides.insert(container, inside);
    }
    let mut whole = insides.remove(&0).unwrap_or_default();
    let mut picture = std::mem::take(&mut whole.picture);
    for Piece { edge, from, to } in joined(whole.pieces) {
        let element = tree.edges[edge].element.clone();
        let shape = Shape::Line { from, to, pen: Pen::Line };
        picture.marks.push(Mark { element, ..shape.into() });
    }
    for (edge, (x, y), way) in whole.arrows {
        let element = tree.edges[edge].element.clone();
        picture.marks.push(Mark { element, ..Shape::Arrow { x, y, way }.into() });
    }
    (picture.width, picture.height) = (whole.width, whole.height);
    picture
}

/// The lines of links; pieces of a transition that continue each other become one line.
fn joined(mut pieces: Vec<Piece>) -> Vec<Piece> {
    pieces.retain(|piece| piece.from != piece.to);
    // Vertical pieces of a column are then neighbours, and so are horizontal ones of a row.
    pieces.sort_by_key(|piece| {
        let is_vertical = piece.from.0 == piece.to.0;
        let line = if is_vertical { piece.from.0 } else { piece.from.1 };
        (piece.edge, is_vertical, line, piece.from)
    });
    let mut lines: Vec<Piece> = Vec::new();
    for piece in pieces {
        let Piece { edge, from, to } = piece;
        match lines.last_mut() {
            Some(before)
                if before.edge == edge
                    && (before.from.0 == to.0
                        && before.to.0 == from.0
                        && from.1 <= before.to.1
                        || before.from.1 == to.1
                            && before.to.1 == from.1
                            && from.0 <= before.to.0) =>
            {
                before.to = to.max(before.to);
            }
            _ => lines.push(piece),
        }
    }
    lines
}
