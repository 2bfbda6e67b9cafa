//! The reader of the emitted C: tokens to the tree of [`super::tree`].
//!
//! It supports only what the emitted text uses; anything else is [`NotUnderstood`], and a test over random charts would find it.

use super::NotUnderstood;
use super::machine::Machine;
use super::memory::size;
use super::tokens::{Token, Word};
use super::tree::{Expr, Function, Global, Kind, Member, Stmt, Type, Unit};
use std::rc::Rc;

/// The maximum nesting depth of statements and brackets.
const DEPTH: usize = 256;

/// Parses the tokens of all files.
pub(super) fn parse(words: &[Token], machine: &Machine) -> Result<Unit, NotUnderstood> {
    let int_bits = machine.int_bits;
    let mut parser = Parser { words, at: 0, unit: Unit::default(), machine, int_bits, depth: 0 };
    for (name, bits, signed) in [
        ("uint8_t", 8, false),
        ("int8_t", 8, true),
        ("uint16_t", 16, false),
        ("int16_t", 16, true),
        ("uint32_t", 32, false),
        ("int32_t", 32, true),
        ("uint64_t", 64, false),
        ("int64_t", 64, true),
    ] {
        parser.unit.types.insert(Rc::from(name), Type::number(bits, signed));
    }
    while parser.at < words.len() {
        parser.outside()?;
    }
    Ok(parser.unit)
}

struct Parser<'a> {
    words: &'a [Token],
    at: usize,
    unit: Unit,
    machine: &'a Machine,
    int_bits: u8,
    depth: usize,
}

/// The binary operators by precedence, the lowest first.
const BINARY: [&[&str]; 10] = [
    &["||"],
    &["&&"],
    &["|"],
    &["^"],
    &["&"],
    &["==", "!="],
    &["<", "<=", ">", ">="],
    &["<<", ">>"],
    &["+", "-"],
    &["*", "/", "%"],
];

impl Parser<'_> {
    fn line(&self) -> u32 {
        self.words.get(self.at).or(self.words.last()).map_or(0, |it| it.line)
    }

    fn wrong<T>(&self, what: &str) -> Result<T, NotUnderstood> {
        let found = match self.words.get(self.at).map(|it| &it.word) {
            Some(Word::Name(name)) => format!("`{name}`"),
            Some(Word::Number(value, _)) => format!("`{value}`"),
            Some(Word::Sign(sign)) => format!("`{sign}`"),
            Some(Word::Text) => "a text".to_owned(),
            Some(Word::UserCode) => "user code".to_owned(),
            None => "the end".to_owned(),
        };
        Err(NotUnderstood::new(self.line(), format!("expected {what}, found {found}")))
    }

    fn is(&self, sign: &str) -> bool {
        matches!(self.words.get(self.at), Some(Token { word: Word::Sign(it), .. }) if *it == sign)
    }

    fn is_ahead(&self, by: usize, sign: &str) -> bool {
        matches!(self.words.get(self.at + by), Some(Token { word: Word::Sign(it), .. }) if *it == sign)
    }

    fn eat(&mut self, sign: &str) -> bool {
        let found = self.is(sign);
        self.at += usize::from(found);
        found
    }

    fn need(&mut self, sign: &str) -> Result<(), NotUnderstood> {
        if self.eat(sign) { Ok(()) } else { self.wrong(&format!("`{sign}`")) }
    }

    fn word(&self) -> Option<&str> {
        match self.words.get(self.at) {
            Some(Token { word: Word::Name(name), .. }) => Some(name),
            _ => None,
        }
    }

    fn eat_word(&mut self, word: &str) -> bool {
        let found = self.word() == Some(word);
        self.at += usize::from(found);
        found
    }

    fn name(&mut self) -> Result<Rc<str>, NotUnderstood> {
        match self.words.get(self.at) {
            Some(Token { word: Word::Name(name), .. }) => {
                self.at += 1;
                Ok(name.clone())
            }
            _ => self.wrong("a name"),
        }
    }

    fn deeper(&mut self) -> Result<(), NotUnderstood> {
        self.depth += 1;
        if self.depth > DEPTH { self.wrong("less nesting") } else { Ok(()) }
    }

    // --- declarations ----------------------------------------------------------------------------------------------------------------------

    fn outside(&mut self) -> Result<(), NotUnderstood> {
        if self.eat(";") {
            return Ok(());
        }
        if self.word() == Some("extern")
            && self.words.get(self.at + 1).is_some_and(|it| it.word == Word::Text)
        {
            // `extern "C" {` follows `__cplusplus`, which is never defined.
            return self.wrong("C");
        }
        if self.eat_word("typedef") {
            let (ty, _) = self.specifiers()?;
            let name = self.name()?;
            self.need(";")?;
            self.unit.types.insert(name, ty);
            return Ok(());
        }
        let is_static = self.word() == Some("static");
        let is_inline = is_static
            && matches!(self.words.get(self.at + 1), Some(Token { word: Word::Name(it), .. }) if &**it == "inline");
        let (ty, rom) = self.specifiers()?;
        if self.eat(";") {
            return Ok(());
        }
        let (ty, rom, name) = self.declarator(ty, rom)?;
        if self.is("(") {
            return self.function(ty, name, (is_static, is_inline));
        }
        let from = self.at;
        if self.eat("=") {
            self.initialiser()?;
        }
        let numbers = match &ty {
            Type::Array(element, n) if matches!(**element, Type::Number { .. }) => {
                self.numbers(from, *n)
            }
            _ => None,
        };
        self.need(";")?;
        self.unit.globals.insert(name, Global { ty, rom, numbers });
        Ok(())
    }

    /// Reads qualifiers and a type; the flag is true if `__flash` or `__code` is among the qualifiers.
    fn specifiers(&mut self) -> Result<(Type, bool), NotUnderstood> {
        let mut rom = false;
        let mut found: Option<Type> = None;
        while let Some(word) = self.word() {
            match word {
                "static" | "inline" | "const" | "volatile" | "extern" => self.at += 1,
                "__flash" | "__code" => {
                    rom = true;
                    self.at += 1;
                }
                "struct" | "enum" | "void" | "bool" | "int" | "unsigned" | "signed" | "char"
                | "long" | "short"
                    if found.is_none() =>
                {
                    found = Some(self.base()?);
                }
                other if found.is_none() => match self.unit.types.get(other) {
                    Some(ty) => {
                        found = Some(ty.clone());
                        self.at += 1;
                    }
                    None => break,
                },
                _ => break,
            }
        }
        match found {
            Some(ty) => Ok((ty, rom)),
            None => self.wrong("a type"),
        }
    }

    fn base(&mut self) -> Result<Type, NotUnderstood> {
        let word = self.name()?;
        Ok(match &*word {
            "void" => Type::Void,
            "bool" => Type::BOOL,
            "char" => Type::number(8, false),
            "struct" => return self.structure(),
            "enum" => return self.enumeration(),
            _ => {
                // `unsigned`, `long`, `int` and the like, in any order.
                let mut signed = &*word != "unsigned";
                let mut longs = u8::from(&*word == "long");
                let mut short = &*word == "short";
                let mut char_ = false;
                while let Some(next) = self.word() {
                    match next {
                        "unsigned" => signed = false,
                        "signed" | "int" => {}
                        "long" => longs += 1,
                        "short" => short = true,
                        "char" => char_ = true,
                        _ => break,
                    }
                    self.at += 1;
                }
                let bits = match longs {
                    0 if char_ => 8,
                    0 if short => 16,
                    0 => self.int_bits,
                    1 => 32,
                    _ => 64,
                };
                Type::number(bits, signed)
            }
        })
    }

    fn structure(&mut self) -> Result<Type, NotUnderstood> {
        let tag = if self.is("{") { None } else { Some(self.name()?) };
        if !self.eat("{") {
            let tag = tag.unwrap_or_else(|| Rc::from(""));
            return match self.unit.types.get(&*format!("struct {tag}")) {
                Some(ty) => Ok(ty.clone()),
                None => self.wrong("a structure"),
            };
        }
        let mut members = Vec::new();
        while !self.eat("}") {
            let (ty, rom) = self.specifiers()?;
            loop {
                let (ty, _, name) = self.declarator(ty.clone(), rom)?;
                let bits = if self.eat(":") {
                    let width = self.constant()?;
                    Some(u8::try_from(width).unwrap_or(u8::MAX))
                } else {
                    None
                };
                members.push(Member { name, ty, bits });
                if !self.eat(",") {
                    break;
                }
            }
            self.need(";")?;
        }
        self.unit.structs.push(members);
        let ty = Type::Struct(self.unit.structs.len() - 1);
        if let Some(tag) = tag {
            self.unit.types.insert(Rc::from(format!("struct {tag}")), ty.clone());
        }
        Ok(ty)
    }

    fn enumeration(&mut self) -> Result<Type, NotUnderstood> {
        if !self.is("{") {
            self.name()?;
        }
        if self.eat("{") {
            let mut next = 0;
            while !self.eat("}") {
                let name = self.name()?;
                if self.eat("=") {
                    next = self.constant()?;
                }
                self.unit.constants.insert(name, next);
                next += 1;
                self.eat(",");
            }
        }
        Ok(Type::number(self.int_bits, true))
    }

    fn constant(&mut self) -> Result<i128, NotUnderstood> {
        let expr = self.choice()?;
        match self.unit.value(&expr) {
            Some(value) => Ok(value),
            None => self.wrong("a constant"),
        }
    }

    /// Stars, a name, array lengths. `rom`: the type before the stars is in ROM. The result includes whether the declared object itself is in ROM.
    fn declarator(&mut self, ty: Type, rom: bool) -> Result<(Type, bool, Rc<str>), NotUnderstood> {
        let (ty, rom) = self.stars(ty, rom);
        let name = self.name()?;
        let ty = self.lengths(ty)?;
        Ok((ty, rom, name))
    }

    fn stars(&mut self, mut ty: Type, mut rom: bool) -> (Type, bool) {
        loop {
            if self.eat("*") {
                ty = Type::Pointer(Rc::new(ty), rom);
                rom = false;
            } else if !(self.eat_word("const") || self.eat_word("volatile")) {
                return (ty, rom);
            }
        }
    }

    fn lengths(&mut self, ty: Type) -> Result<Type, NotUnderstood> {
        let mut lengths = Vec::new();
        while self.eat("[") {
            lengths.push(if self.is("]") { 0 } else { self.constant()? });
            self.need("]")?;
        }
        Ok(lengths
            .into_iter()
            .rev()
            .fold(ty, |ty, n| Type::Array(Rc::new(ty), u64::try_from(n).unwrap_or(0))))
    }

    /// Reads an initial value. A list in braces is skipped, because only its length matters.
    fn initialiser(&mut self) -> Result<Expr, NotUnderstood> {
        if !self.is("{") {
            return self.assignment();
        }
        let (mut level, mut n) = (0_usize, 1_u64);
        loop {
            match self.words.get(self.at).map(|it| &it.word) {
                Some(Word::Sign("{")) => level += 1,
                Some(Word::Sign("}")) => {
                    level -= 1;
                    if level == 0 {
                        self.at += 1;
                        return Ok(Expr::List(n));
                    }
                }
                Some(Word::Sign(",")) => n += 1,
                Some(
                    Word::Name(_) | Word::Number(..) | Word::Sign(_) | Word::Text | Word::UserCode,
                ) => {}
                None => return self.wrong("`}`"),
            }
            self.at += 1;
        }
    }

    /// The numbers of a brace list that was just read, one for each element of the table; `None` if one of them is not a constant.
    fn numbers(&self, from: usize, places: u64) -> Option<Rc<[i64]>> {
        let mut all = Vec::new();
        let mut is_open = false;
        for token in self.words.get(from..self.at)? {
            match &token.word {
                Word::Sign("=" | "{" | "}") => {}
                Word::Sign(",") => is_open = false,
                Word::Number(..) | Word::Name(_) if is_open => return None,
                Word::Number(value, _) => {
                    all.push(i64::try_from(*value).ok()?);
                    is_open = true;
                }
                Word::Name(name) => {
                    all.push(i64::try_from(*self.unit.constants.get(name)?).ok()?);
                    is_open = true;
                }
                Word::Sign(_) | Word::Text | Word::UserCode => return None,
            }
        }
        // Elements that are not listed are 0.
        all.resize(all.len().max(usize::try_from(places).ok()?), 0);
        Some(all.into())
    }

    fn function(
        &mut self,
        returns: Type,
        name: Rc<str>,
        (is_static, is_inline): (bool, bool),
    ) -> Result<(), NotUnderstood> {
        self.need("(")?;
        let mut parameters = Vec::new();
        if self.word() == Some("void") && self.is_ahead(1, ")") {
            self.at += 1;
        }
        while !self.eat(")") {
            let (ty, rom) = self.specifiers()?;
            let (ty, rom) = self.stars(ty, rom);
            // A declaration may leave the name out.
            let name = if self.word().is_some() { self.name()? } else { Rc::from("") };
            let ty = match self.lengths(ty)? {
                Type::Array(element, _) => Type::Pointer(element, rom),
                other
                @ (Type::Void | Type::Number { .. } | Type::Pointer(..) | Type::Struct(_)) => other,
            };
            parameters.push((name, ty));
            self.eat(",");
        }
        if self.eat(";") {
            self.unit.declared.insert(name, returns);
            return Ok(());
        }
        let body = self.block()?;
        self.unit.declared.insert(name.clone(), returns);
        self.unit.functions.push(Function { name, parameters, body, is_static, is_inline });
        Ok(())
    }

    // --- statements ------------------------------------------------------------------------------------------------------------------------

    fn block(&mut self) -> Result<Vec<Stmt>, NotUnderstood> {
        self.deeper()?;
        self.need("{")?;
        let mut all = Vec::new();
        while !self.eat("}") {
            if !self.eat(";") {
                self.statement(&mut all)?;
            }
        }
        self.depth -= 1;
        Ok(all)
    }

    fn stmt(&mut self, line: u32, kind: Kind) -> Stmt {
        self.unit.n_stmts += 1;
        Stmt { id: self.unit.n_stmts - 1, line, kind }
    }

    fn body(&mut self) -> Result<Vec<Stmt>, NotUnderstood> {
        if self.is("{") {
            return self.block();
        }
        self.deeper()?;
        let mut all = Vec::new();
        if !self.eat(";") {
            self.statement(&mut all)?;
        }
        self.depth -= 1;
        Ok(all)
    }

    fn statement(&mut self, all: &mut Vec<Stmt>) -> Result<(), NotUnderstood> {
        let line = self.line();
        if self.is("{") {
            let body = self.block()?;
            let stmt = self.stmt(line, Kind::Block(body));
            all.push(stmt);
            return Ok(());
        }
        if matches!(self.words.get(self.at), Some(Token { word: Word::UserCode, .. })) {
            self.at += 1;
            let stmt = self.stmt(line, Kind::UserCode);
            all.push(stmt);
            return Ok(());
        }
        let kind = match self.word() {
            Some("if") => {
                self.at += 1;
                self.if_()?
            }
            Some("switch") => {
                self.at += 1;
                self.switch()?
            }
            Some("while") => {
                self.at += 1;
                self.need("(")?;
                let condition = self.expr()?;
                self.need(")")?;
                let body = self.body()?;
                Kind::Loop { init: None, condition: Some(condition), step: None, body }
            }
            Some("for") => {
                self.at += 1;
                self.for_(line)?
            }
            Some("return") => {
                self.at += 1;
                let value = if self.is(";") { None } else { Some(self.expr()?) };
                self.need(";")?;
                Kind::Return(value)
            }
            Some("break") => {
                self.at += 1;
                self.need(";")?;
                Kind::Break
            }
            Some("continue") => {
                self.at += 1;
                self.need(";")?;
                Kind::Continue
            }
            Some("__asm__") => {
                // A compiler barrier, or an instruction of the port: no cost here.
                while !self.is(";") {
                    if self.at >= self.words.len() {
                        return self.wrong("`;`");
                    }
                    self.at += 1;
                }
                self.at += 1;
                Kind::Expr(Expr::Nothing)
            }
            _ if self.is_type() => return self.locals(line, all),
            _ => {
                let expr = self.expr()?;
                self.need(";")?;
                Kind::Expr(expr)
            }
        };
        let stmt = self.stmt(line, kind);
        all.push(stmt);
        Ok(())
    }

    fn is_type(&self) -> bool {
        self.word().is_some_and(|word| {
            matches!(
                word,
                "const"
                    | "static"
                    | "volatile"
                    | "struct"
                    | "enum"
                    | "void"
                    | "bool"
                    | "int"
                    | "unsigned"
                    | "signed"
                    | "char"
                    | "long"
                    | "short"
                    | "__flash"
                    | "__code"
            ) || self.unit.types.contains_key(word)
        })
    }

    fn locals(&mut self, line: u32, all: &mut Vec<Stmt>) -> Result<(), NotUnderstood> {
        let (base, base_rom) = self.specifiers()?;
        loop {
            let (ty, rom, name) = self.declarator(base.clone(), base_rom)?;
            let init = if self.eat("=") { Some(self.initialiser()?) } else { None };
            let stmt = self.stmt(line, Kind::Local { name, ty, rom, init });
            all.push(stmt);
            if !self.eat(",") {
                break;
            }
        }
        self.need(";")
    }

    fn if_(&mut self) -> Result<Kind, NotUnderstood> {
        let mut arms = Vec::new();
        loop {
            self.need("(")?;
            let condition = self.expr()?;
            self.need(")")?;
            arms.push((condition, self.body()?));
            if !self.eat_word("else") {
                return Ok(Kind::If(arms, Vec::new()));
            }
            if !self.eat_word("if") {
                return Ok(Kind::If(arms, self.body()?));
            }
        }
    }

    fn switch(&mut self) -> Result<Kind, NotUnderstood> {
        self.need("(")?;
        let subject = self.expr()?;
        self.need(")")?;
        self.need("{")?;
        self.deeper()?;
        let mut sections: Vec<(Vec<Option<Expr>>, Vec<Stmt>)> = Vec::new();
        while !self.eat("}") {
            let label = match self.word() {
                Some("case") => {
                    self.at += 1;
                    Some(Some(self.choice()?))
                }
                Some("default") => {
                    self.at += 1;
                    Some(None)
                }
                _ => None,
            };
            match label {
                Some(label) => {
                    self.need(":")?;
                    match sections.last_mut() {
                        Some((labels, body)) if body.is_empty() => labels.push(label),
                        _ => sections.push((vec![label], Vec::new())),
                    }
                }
                None => {
                    let mut body = Vec::new();
                    if !self.eat(";") {
                        self.statement(&mut body)?;
                    }
                    match sections.last_mut() {
                        Some((_, all)) => all.append(&mut body),
                        None => return self.wrong("`case`"),
                    }
                }
            }
        }
        self.depth -= 1;
        Ok(Kind::Switch(subject, sections))
    }

    fn for_(&mut self, line: u32) -> Result<Kind, NotUnderstood> {
        self.need("(")?;
        let init = if self.eat(";") {
            None
        } else {
            let mut first = Vec::new();
            self.statement(&mut first)?;
            match first.pop() {
                Some(only) if first.is_empty() => Some(Box::new(Stmt { line, ..only })),
                _ => return self.wrong("one variable"),
            }
        };
        let condition = if self.is(";") { None } else { Some(self.expr()?) };
        self.need(";")?;
        let step = if self.is(")") { None } else { Some(self.expr()?) };
        self.need(")")?;
        let body = self.body()?;
        Ok(Kind::Loop { init, condition, step, body })
    }

    // --- expressions -----------------------------------------------------------------------------------------------------------------------

    fn expr(&mut self) -> Result<Expr, NotUnderstood> {
        self.assignment()
    }

    fn assignment(&mut self) -> Result<Expr, NotUnderstood> {
        let left = self.choice()?;
        let found = [
            ("=", None),
            ("+=", Some("+")),
            ("-=", Some("-")),
            ("*=", Some("*")),
            ("/=", Some("/")),
            ("%=", Some("%")),
            ("&=", Some("&")),
            ("|=", Some("|")),
            ("^=", Some("^")),
            ("<<=", Some("<<")),
            (">>=", Some(">>")),
        ]
        .into_iter()
        .find(|(sign, _)| self.is(sign));
        let Some((_, operator)) = found else { return Ok(left) };
        self.at += 1;
        let right = self.assignment()?;
        Ok(Expr::Assign(operator, Box::new(left), Box::new(right)))
    }

    fn choice(&mut self) -> Result<Expr, NotUnderstood> {
        self.deeper()?;
        let condition = self.binary(0)?;
        let expr = if self.eat("?") {
            let yes = self.assignment()?;
            self.need(":")?;
            let no = self.choice()?;
            Expr::Choice(Box::new(condition), Box::new(yes), Box::new(no))
        } else {
            condition
        };
        self.depth -= 1;
        Ok(expr)
    }

    fn binary(&mut self, level: usize) -> Result<Expr, NotUnderstood> {
        let Some(signs) = BINARY.get(level) else { return self.unary() };
        let mut left = self.binary(level + 1)?;
        while let Some(sign) = signs.iter().find(|sign| self.is(sign)) {
            self.at += 1;
            let right = self.binary(level + 1)?;
            left = Expr::Binary(sign, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<Expr, NotUnderstood> {
        self.deeper()?;
        let expr = self.unary_inner()?;
        self.depth -= 1;
        Ok(expr)
    }

    fn unary_inner(&mut self) -> Result<Expr, NotUnderstood> {
        if let Some(sign) = ["!", "~", "-", "+", "*", "&"].into_iter().find(|sign| self.is(sign)) {
            self.at += 1;
            return Ok(Expr::Unary(sign, Box::new(self.unary()?)));
        }
        if self.eat("++") {
            return Ok(Expr::Count(Box::new(self.unary()?)));
        }
        if self.eat_word("sizeof") {
            if self.is("(") && self.type_follows(1) {
                self.at += 1;
                let ty = self.type_name()?;
                self.need(")")?;
                // A constant, which may be the length of an array.
                let bytes = size(&self.unit, self.machine, &ty);
                return Ok(Expr::Number(i128::from(bytes), self.int_bits));
            }
            return Ok(Expr::Size(Box::new(self.unary()?)));
        }
        if self.is("(") && self.type_follows(1) {
            self.at += 1;
            let ty = self.type_name()?;
            self.need(")")?;
            return Ok(Expr::Cast(ty, Box::new(self.unary()?)));
        }
        self.postfix()
    }

    fn type_follows(&mut self, by: usize) -> bool {
        self.at += by;
        let found = self.is_type();
        self.at -= by;
        found
    }

    fn type_name(&mut self) -> Result<Type, NotUnderstood> {
        let (ty, rom) = self.specifiers()?;
        Ok(self.stars(ty, rom).0)
    }

    fn postfix(&mut self) -> Result<Expr, NotUnderstood> {
        let mut expr = match self.words.get(self.at).map(|it| it.word.clone()) {
            Some(Word::Number(value, bits)) => {
                self.at += 1;
                Expr::Number(value, bits)
            }
            Some(Word::Name(name)) => {
                self.at += 1;
                match &*name {
                    "true" => Expr::Number(1, 8),
                    "false" => Expr::Number(0, 8),
                    "INT32_C" | "UINT32_C" | "INT64_C" | "UINT64_C" => {
                        self.need("(")?;
                        let inner = self.choice()?;
                        self.need(")")?;
                        inner
                    }
                    _ if self.eat("(") => {
                        let mut arguments = Vec::new();
                        while !self.eat(")") {
                            arguments.push(self.assignment()?);
                            self.eat(",");
                        }
                        Expr::Call(name, arguments)
                    }
                    _ => Expr::Name(name),
                }
            }
            Some(Word::Sign("(")) => {
                self.at += 1;
                let inner = self.expr()?;
                self.need(")")?;
                inner
            }
            Some(Word::Sign(_) | Word::Text | Word::UserCode) | None => {
                return self.wrong("an expression");
            }
        };
        loop {
            if self.eat("->") || self.eat(".") {
                let member = self.name()?;
                expr = Expr::Member(Box::new(expr), member);
            } else if self.eat("[") {
                let index = self.expr()?;
                self.need("]")?;
                expr = Expr::Index(Box::new(expr), Box::new(index));
            } else if self.eat("++") {
                expr = Expr::Count(Box::new(expr));
            } else {
                return Ok(expr);
            }
        }
    }
}
