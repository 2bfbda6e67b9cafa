//! Statement lists in the text form.

use super::lexer::Kind;
use super::parse::{Fail, Parser, Signal};
use crate::codes;
use crate::interval::DEPTH_LIMIT;
use crate::net::{Block, Stmt, StmtKind, Verbatim};

impl Parser<'_> {
    /// `{ .. }`
    pub(super) fn block(&mut self) -> Result<Block, Fail> {
        self.nested_block(0)
    }

    fn nested_block(&mut self, depth: usize) -> Result<Block, Fail> {
        if depth >= DEPTH_LIMIT {
            let message = format!("`if` is nested more than {DEPTH_LIMIT} levels deep");
            return self.fail(codes::NET_LIMIT, self.here(), message);
        }
        self.expect("{")?;
        let mut block = Block::new();
        loop {
            while self.token().kind == Kind::Newline || self.is(";") {
                self.bump();
            }
            if self.eat("}") {
                return Ok(block);
            }
            block.push(self.statement(depth)?);
            if !(self.token().kind == Kind::Newline || self.is(";") || self.is("}")) {
                return self.unexpected("`;`, a new line or `}`");
            }
        }
    }

    fn statement(&mut self, depth: usize) -> Result<Stmt, Fail> {
        let start = self.here();
        let kind = match (self.token().kind, self.text()) {
            (Kind::Word, "raise") => {
                self.bump();
                StmtKind::Raise(self.input_ref()?)
            }
            (Kind::Word, "send") => {
                self.bump();
                StmtKind::Send(self.slot_ref()?)
            }
            (Kind::Word, "cancel") => {
                self.bump();
                StmtKind::Cancel(self.slot_ref()?)
            }
            (Kind::Word, "call") => {
                self.bump();
                let output = self.output_ref()?;
                StmtKind::Call { output, arguments: self.arguments()? }
            }
            (Kind::Word, "code") => StmtKind::Code(self.verbatim()?),
            (Kind::Word, "if") => {
                self.bump();
                self.choice(depth)?
            }
            (Kind::Word | Kind::Quoted | Kind::Position, _) => self.assignment()?,
            _ => return self.unexpected("a statement"),
        };
        Ok(Stmt { kind, span: start.to(self.before()) })
    }

    fn choice(&mut self, depth: usize) -> Result<StmtKind, Fail> {
        let condition = self.expr()?;
        let then = self.nested_block(depth + 1)?;
        let otherwise = if self.eat("else") { self.nested_block(depth + 1)? } else { Block::new() };
        Ok(StmtKind::If { condition, then, otherwise })
    }

    fn assignment(&mut self) -> Result<StmtKind, Fail> {
        let target = self.token();
        self.not_reserved()?;
        self.bump();
        let var = if target.kind == Kind::Position {
            self.at_position(target)
        } else {
            match self.signal(target)? {
                Signal::Var(var) => var,
                Signal::Input(_) | Signal::Timer(_) => {
                    let name = target.text(self.source());
                    let message = format!("cannot assign to `{name}`: it is not a variable");
                    return self.fail(codes::NET_NAME, target.span(self.file()), message);
                }
            }
        };
        let index = if self.eat("[") {
            let index = self.expr()?;
            self.expect("]")?;
            Some(index)
        } else {
            None
        };
        self.expect(":=")?;
        Ok(StmtKind::Assign { var, index, value: self.expr()? })
    }

    /// `code "c" "text"`
    pub(super) fn verbatim(&mut self) -> Result<Verbatim, Fail> {
        self.bump();
        let language = self.string("the language in double quotes")?;
        let text = self.string("the text in double quotes")?;
        Ok(Verbatim { language, text })
    }
}
