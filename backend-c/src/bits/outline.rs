//! Splits a program into functions and decides where each temp is stored.

use grafsynth_ir::IdMap;
use grafsynth_ir::net::StepId;
use grafsynth_ir::program::{Expr, Leaf, Program, Stmt, Temp, TempId, expressions};
use std::collections::BTreeSet;

/// One piece of a function.
#[derive(Debug)]
pub(crate) enum Piece<'p> {
    /// A statement with everything inside it.
    Whole(&'p Stmt),
    /// A choice whose statement lists are too long for one function.
    If(&'p Expr, Vec<Piece<'p>>, Vec<Piece<'p>>),
    /// Like `If`, for a loop.
    Repeat(u32, &'p Expr, Vec<Piece<'p>>),
    /// A choice by a number: its text, and the cases; nothing happens for other values.
    Switch(String, Vec<Case<'p>>),
    /// A call of another function, by its index in the list of bodies.
    Function(usize),
}

/// One case of a choice by a number.
#[derive(Debug)]
pub(crate) struct Case<'p> {
    /// The steps that the case is for, each with its label.
    pub(crate) steps: Vec<(StepId, String)>,
    /// The pieces that run in this case.
    pub(crate) body: Vec<Piece<'p>>,
}

/// Where a temp is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Home {
    /// Not stored: it is never mentioned.
    Nowhere,
    /// Declared where it is set, once, in the block that contains all its readers.
    Here,
    /// A local of this function; 0 is the reaction itself, the bodies follow.
    Local(usize),
    /// In the structure that the functions share.
    Shared,
}

/// Splits statements into pieces so that no function is larger than `limit`; each new function is added to `bodies`.
pub(crate) fn cut<'p>(
    statements: &'p [Stmt],
    limit: usize,
    bodies: &mut Vec<Vec<Piece<'p>>>,
) -> Vec<Piece<'p>> {
    if statements.iter().map(weight).sum::<usize>() <= limit {
        return statements.iter().map(Piece::Whole).collect();
    }
    let mut pieces = Vec::new();
    let mut group: Vec<Piece<'p>> = Vec::new();
    let mut group_weight = 0;
    for statement in statements {
        let own = weight(statement);
        if group_weight > 0 && group_weight + own > limit {
            close(&mut group, &mut pieces, bodies);
            group_weight = 0;
        }
        if own > limit
            && let Stmt::If(condition, then, otherwise) = statement
        {
            close(&mut group, &mut pieces, bodies);
            let then = cut(then, limit, bodies);
            let otherwise = cut(otherwise, limit, bodies);
            pieces.push(Piece::If(condition, then, otherwise));
            group_weight = 0;
        } else if own > limit
            && let Stmt::Repeat { limit: rounds, condition, body } = statement
        {
            close(&mut group, &mut pieces, bodies);
            pieces.push(Piece::Repeat(*rounds, condition, cut(body, limit, bodies)));
            group_weight = 0;
        } else {
            group.push(Piece::Whole(statement));
            group_weight += own;
        }
    }
    close(&mut group, &mut pieces, bodies);
    pieces
}

fn close<'p>(
    group: &mut Vec<Piece<'p>>,
    pieces: &mut Vec<Piece<'p>>,
    bodies: &mut Vec<Vec<Piece<'p>>>,
) {
    if !group.is_empty() {
        bodies.push(std::mem::take(group));
        pieces.push(Piece::Function(bodies.len() - 1));
    }
}

/// The number of nodes of a statement, at least 1.
pub(crate) fn weight(statement: &Stmt) -> usize {
    1 + expressions(std::slice::from_ref(statement)).flat_map(Expr::subexpressions).count()
}

/// Decides where each temp is stored.
pub(crate) fn homes(
    program: &Program,
    main: &[Piece<'_>],
    bodies: &[Vec<Piece<'_>>],
) -> IdMap<Temp, Home> {
    let mut walk =
        Walk { uses: IdMap::filled(&program.temps, Uses::default()), blocks: 0, function: 0 };
    walk.pieces(main, &[]);
    for (index, body) in bodies.iter().enumerate() {
        walk.function = index + 1;
        walk.pieces(body, &[]);
    }
    IdMap::build(&program.temps, |id, _| {
        let uses = &walk.uses[id];
        match (uses.functions.len(), uses.functions.first()) {
            (0, _) | (_, None) => Home::Nowhere,
            (1, Some(_)) if uses.sets == 1 && !uses.escapes => Home::Here,
            (1, Some(function)) => Home::Local(*function),
            (_, Some(_)) => Home::Shared,
        }
    })
}

/// How a temp is used.
#[derive(Debug, Clone, Default)]
struct Uses {
    functions: BTreeSet<usize>,
    sets: usize,
    /// The block of the assignment: the numbers of all enclosing blocks.
    block: Vec<usize>,
    /// True if some use is outside the block of the assignment, or before it.
    escapes: bool,
}

struct Walk {
    uses: IdMap<Temp, Uses>,
    blocks: usize,
    function: usize,
}

impl Walk {
    fn pieces(&mut self, pieces: &[Piece<'_>], block: &[usize]) {
        for piece in pieces {
            match piece {
                Piece::Whole(statement) => self.statement(statement, block),
                Piece::If(condition, then, otherwise) => {
                    self.read(condition, block);
                    let inner = self.enter(block);
                    self.pieces(then, &inner);
                    let inner = self.enter(block);
                    self.pieces(otherwise, &inner);
                }
                Piece::Repeat(_, condition, body) => {
                    self.read(condition, block);
                    let inner = self.enter(block);
                    self.pieces(body, &inner);
                    self.read(condition, block);
                }
                Piece::Switch(_, cases) => {
                    for case in cases {
                        let inner = self.enter(block);
                        self.pieces(&case.body, &inner);
                    }
                }
                Piece::Function(_) => {}
            }
        }
    }

    fn enter(&mut self, block: &[usize]) -> Vec<usize> {
        self.blocks += 1;
        block.iter().copied().chain([self.blocks]).collect()
    }

    fn statement(&mut self, statement: &Stmt, block: &[usize]) {
        match statement {
            Stmt::Set(temp, value) => {
                self.read(value, block);
                self.set(*temp, block);
            }
            Stmt::Store(_, index, value) => {
                index.iter().for_each(|index| self.read(index, block));
                self.read(value, block);
            }
            Stmt::Output(_, value) | Stmt::Fault(value) => self.read(value, block),
            Stmt::Call(_, arguments) => {
                arguments.iter().for_each(|argument| self.read(argument, block))
            }
            Stmt::If(condition, then, otherwise) => {
                self.read(condition, block);
                for list in [then, otherwise] {
                    let inner = self.enter(block);
                    list.iter().for_each(|it| self.statement(it, &inner));
                }
            }
            Stmt::Repeat { condition, body, .. } => {
                self.read(condition, block);
                let inner = self.enter(block);
                body.iter().for_each(|it| self.statement(it, &inner));
                self.read(condition, block);
            }
            Stmt::Code(_) | Stmt::Mark(_) => {}
        }
    }

    fn set(&mut self, temp: TempId, block: &[usize]) {
        let uses = &mut self.uses[temp];
        uses.functions.insert(self.function);
        uses.sets += 1;
        uses.block = block.to_vec();
    }

    fn read(&mut self, expr: &Expr, block: &[usize]) {
        let function = self.function;
        let uses = &mut self.uses;
        for leaf in expr.leaves() {
            if let Leaf::Temp(temp) = leaf {
                let uses = &mut uses[*temp];
                uses.functions.insert(function);
                // It is read before it is set (it would keep its value in a later round of a loop), or outside of its block.
                uses.escapes |= uses.sets == 0 || !block.starts_with(&uses.block);
            }
        }
    }
}
