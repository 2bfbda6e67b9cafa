//! Reads the emitted C with [`grafsynth_c`] and reduces its typed tree to the parts that have a cost: implicit conversions and qualifiers are left out, but
//! objects and enumeration constants keep their names.
//!
//! A C construct that the emitters do not use gives [`NotUnderstood`]. If an emitter starts to use one, a test with random charts fails.

use super::NotUnderstood;
use super::machine::Machine;
use super::memory::size;
use super::tree::{Expr, Function, Global, Kind, Member, Stmt, Type, Unit};
use crate::File;
use grafsynth_c::tree::types::{self, Qualified, Space};
use grafsynth_c::tree::{
    self as c, Callee, ExprKind, Init, ItemKind, Label, LogicalOp, PlaceKind, SizeOfOperand,
    StmtKind, SymbolId, SymbolKind,
};
use grafsynth_c::walk::{each_item, init_values};
use grafsynth_c::{Config, Input, SourceFile, parse};
use grafsynth_ir::{FileId, Span};
use std::rc::Rc;

type Read<T> = Result<T, NotUnderstood>;

/// The id of `NAME.c` in locations; the file that includes everything has the id before it.
const SOURCE: FileId = FileId(1);

/// Reads the headers in this order, then the source. Lines of the source that the user wrote (`user`: first and last lines) are not read.
pub(super) fn read(
    headers: &[&File],
    source: &File,
    user: &[(u32, u32)],
    machine: &Machine,
) -> Read<Unit> {
    let named = headers.iter().chain([&source]);
    let all: String = named.map(|it| format!("#include \"{}\"\n", it.name)).collect();
    let mut files = vec![SourceFile { file: FileId(0), name: "", text: &all }];
    for (at, it) in (SOURCE.0..).zip([&source].into_iter().chain(headers)) {
        files.push(SourceFile { file: FileId(at), name: &it.name, text: &it.text });
    }
    let text = source.text.as_str();
    let lines: Vec<usize> =
        [0].into_iter().chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let start = |line: u32| lines.get(line as usize).copied().unwrap_or(text.len());
    let verbatim: Vec<&str> = user
        .iter()
        .filter_map(|(first, last)| text.get(start(first.saturating_sub(1))..start(*last)))
        .collect();
    let config = config(machine);
    let input = Input { files: &files, verbatim: &verbatim, readers: &[], config: &config };
    let (unit, found) = parse(&input);
    let Some(unit) = unit else {
        let found = found.into_iter().next();
        let place = found.as_ref().and_then(|it| it.labels.first());
        let line = place.map_or(0, |it| line_of(&lines, it.span));
        return Err(NotUnderstood::new(line, found.map_or_else(String::new, |it| it.message)));
    };
    let names = unit.symbols.values().map(|it| Rc::from(it.name.as_str())).collect();
    let reader =
        Reader { from: &unit, machine, lines: &lines, names, line: 0, unit: of_types(&unit) };
    reader.items()
}

/// The compiler of a machine.
fn config(machine: &Machine) -> Config {
    let sizes = types::Machine {
        int_bits: u32::from(machine.int_bits),
        long_bits: if machine.pointer == 8 { 64 } else { 32 },
        pointer_bytes: u64::from(machine.pointer),
        code_pointer_bytes: u64::from(machine.pointer),
        max_align: u64::from(machine.alignment),
        has_signed_char: false,
        has_short_enums: false,
    };
    let macros = machine.defines.iter().map(|it| ((*it).to_owned(), "1".to_owned())).collect();
    Config { name: machine.name, machine: sizes, macros }
}

/// The line of a location; 0 outside `NAME.c`.
fn line_of(lines: &[usize], span: Span) -> u32 {
    let n = lines.partition_point(|start| *start <= span.range().start);
    if span.file == SOURCE { u32::try_from(n).unwrap_or(u32::MAX) } else { 0 }
}

/// The structures and types of a unit, without its functions and globals.
fn of_types(from: &c::Unit) -> Unit {
    let mut unit = Unit::default();
    for it in from.structs.values() {
        let member = |it: &c::Member| Member {
            name: Rc::from(it.name.as_str()),
            ty: ty(from, &it.canonical.ty),
            is_bit: it.is_bit,
        };
        unit.structs.push(it.members.iter().map(member).collect());
    }
    for it in from.symbols.values() {
        let name = || Rc::from(it.name.as_str());
        match it.kind {
            SymbolKind::Typedef => {
                unit.types.insert(name(), ty(from, &it.canonical.ty));
            }
            SymbolKind::Constant(value) => {
                unit.constants.insert(name(), value);
            }
            _ => {}
        }
    }
    unit
}

/// A canonical type. An enumeration counts as an `int`.
fn ty(from: &c::Unit, it: &types::Type) -> Type {
    let machine = &from.machine;
    let number = |kind| match kind {
        types::IntKind::Bool => Type::BOOL,
        kind => Type::number(
            u8::try_from(machine.bits(kind)).unwrap_or(u8::MAX),
            machine.is_signed(kind),
        ),
    };
    match it {
        types::Type::Int(kind) => number(*kind),
        types::Type::Enum(_) => number(types::IntKind::Int),
        types::Type::Struct(id) => Type::Struct(id.index()),
        types::Type::Pointer(target) => {
            Type::Pointer(Rc::new(ty(from, &target.ty)), is_in_rom(target))
        }
        types::Type::Array(element, n) => {
            Type::Array(Rc::new(ty(from, &element.ty)), n.unwrap_or(0))
        }
        types::Type::Void | types::Type::Function(_) | types::Type::Named(_) => Type::Void,
    }
}

fn is_in_rom(it: &Qualified) -> bool {
    match &it.ty {
        types::Type::Array(element, _) => is_in_rom(element),
        _ => it.qualifiers.space != Space::Generic,
    }
}

struct Reader<'a> {
    from: &'a c::Unit,
    machine: &'a Machine,
    lines: &'a [usize],
    /// The names of all symbols.
    names: Vec<Rc<str>>,
    /// The line of the current statement.
    line: u32,
    unit: Unit,
}

impl Reader<'_> {
    fn unknown<T>(&self, what: &str) -> Read<T> {
        Err(NotUnderstood::new(self.line, what))
    }

    fn name(&self, id: SymbolId) -> Rc<str> {
        self.names[id.index()].clone()
    }

    fn ty(&self, it: &types::Type) -> Type {
        ty(self.from, it)
    }

    fn items(mut self) -> Read<Unit> {
        let mut all = Vec::new();
        each_item(&self.from.items, &mut |item| all.push(&item.kind));
        for item in all {
            match item {
                ItemKind::Object { symbol, init, .. } => {
                    let it = &self.from.symbols[*symbol].canonical;
                    let (ty, rom) = (self.ty(&it.ty), is_in_rom(it));
                    let init = init.as_ref().filter(|_| self.from.is_const(it));
                    let numbers = init.and_then(|init| self.numbers(&ty, init));
                    self.unit.globals.insert(self.name(*symbol), Global { ty, rom, numbers });
                }
                ItemKind::Prototype { symbol, .. } => self.declared(*symbol),
                ItemKind::Function { symbol, params, body } => {
                    self.declared(*symbol);
                    self.function(*symbol, params, body)?;
                }
                // Types are already known.
                _ => {}
            }
        }
        Ok(self.unit)
    }

    fn declared(&mut self, symbol: SymbolId) {
        if let Some(it) = self.from.symbols[symbol].canonical.ty.as_function() {
            self.unit.declared.insert(self.name(symbol), self.ty(&it.result.ty));
        }
    }

    /// The numbers of a constant table, one for each element; `None` if it is not a table of numbers.
    fn numbers(&self, ty: &Type, init: &Init) -> Option<Rc<[i64]>> {
        let (Type::Array(element, n), Init::Parts(parts)) = (ty, init) else { return None };
        // Elements that are not listed are 0.
        let mut all = vec![0; usize::try_from(*n).ok()?];
        for part in parts {
            let (Type::Number { .. }, Init::Value(value)) = (&**element, &part.init) else {
                return None;
            };
            let value = i64::try_from(self.from.constant(value)?).ok()?;
            *all.get_mut(usize::try_from(part.at).ok()?)? = value;
        }
        Some(all.into())
    }

    fn function(&mut self, symbol: SymbolId, params: &[SymbolId], body: &[c::Stmt]) -> Read<()> {
        let SymbolKind::Function(kind) = self.from.symbols[symbol].kind else { return Ok(()) };
        let parameter =
            |id: &SymbolId| (self.name(*id), self.ty(&self.from.symbols[*id].canonical.ty));
        let parameters = params.iter().map(parameter).collect();
        let body = self.stmts(body)?;
        self.unit.functions.push(Function {
            name: self.name(symbol),
            parameters,
            body,
            is_static: kind.is_static,
            is_inline: kind.is_static && kind.is_inline,
        });
        Ok(())
    }

    // --- statements ------------------------------------------------------------------------------------------------------------------------

    fn stmts(&mut self, list: &[c::Stmt]) -> Read<Vec<Stmt>> {
        list.iter().map(|it| self.stmt(it)).collect()
    }

    fn stmt(&mut self, stmt: &c::Stmt) -> Read<Stmt> {
        let line = line_of(self.lines, stmt.span.0);
        self.line = line;
        let kind = match &stmt.kind {
            StmtKind::Expr(value) => Kind::Expr(self.expr(value)?),
            StmtKind::Define { symbol, init } => {
                let it = &self.from.symbols[*symbol].canonical;
                let init = init.as_ref().map(|it| self.initial(it)).transpose()?;
                let (ty, rom) = (self.ty(&it.ty), is_in_rom(it));
                Kind::Local { name: self.name(*symbol), ty, rom, init }
            }
            StmtKind::If { arms, otherwise } => {
                let arm = |it: &c::Arm| Ok((self.expr(&it.condition)?, self.stmts(&it.body)?));
                Kind::If(arms.iter().map(arm).collect::<Read<_>>()?, self.stmts(otherwise)?)
            }
            StmtKind::Switch { on, cases } => {
                let label = |it: &Label| if let Label::Case(_, it) = it { Some(*it) } else { None };
                let on = self.expr(on)?;
                let section = |it: &c::Case| {
                    Ok((it.labels.iter().map(label).collect(), self.stmts(&it.body)?))
                };
                Kind::Switch(on, cases.iter().map(section).collect::<Read<_>>()?)
            }
            StmtKind::While { condition, body } => {
                let condition = Some(self.expr(condition)?);
                Kind::Loop { init: None, condition, step: None, body: self.stmts(body)? }
            }
            StmtKind::For { init, condition, step, body } => {
                let init = match init.as_slice() {
                    [] => None,
                    [only] => Some(Box::new(Stmt { line, ..self.stmt(only)? })),
                    _ => return self.unknown("a loop over several variables"),
                };
                let condition = condition.as_ref().map(|it| self.expr(it)).transpose()?;
                let step = step.as_ref().map(|it| self.expr(it)).transpose()?;
                Kind::Loop { init, condition, step, body: self.stmts(body)? }
            }
            StmtKind::DoWhile { .. } => return self.unknown("`do`"),
            StmtKind::Break => Kind::Break,
            StmtKind::Continue => Kind::Continue,
            StmtKind::Return(value) => {
                Kind::Return(value.as_ref().map(|it| self.expr(it)).transpose()?)
            }
            StmtKind::Block(body) => Kind::Block(self.stmts(body)?),
            StmtKind::Barrier => Kind::Expr(Expr::Nothing),
            StmtKind::Opaque(_) => Kind::UserCode,
        };
        self.unit.n_stmts += 1;
        Ok(Stmt { id: self.unit.n_stmts - 1, line, kind })
    }

    /// The initial value of a local. Of a list in braces, only its length matters.
    fn initial(&self, init: &Init) -> Read<Expr> {
        let Init::Value(value) = init else {
            let mut n = 0;
            init_values(init, &mut |_| n += 1);
            return Ok(Expr::List(n));
        };
        self.expr(value)
    }

    // --- expressions -----------------------------------------------------------------------------------------------------------------------

    fn boxed(&self, expr: &c::Expr) -> Read<Box<Expr>> {
        self.expr(expr).map(Box::new)
    }

    fn expr(&self, expr: &c::Expr) -> Read<Expr> {
        Ok(match &expr.kind {
            ExprKind::Literal(value, _) => Expr::Number(i128::from(*value)),
            ExprKind::Bool(value) => Expr::Number(i128::from(*value)),
            ExprKind::Null => Expr::Number(0),
            ExprKind::Constant(id) | ExprKind::Function(id) => Expr::Name(self.name(*id)),
            ExprKind::Read(place) | ExprKind::Decay(place) => self.place(place)?,
            ExprKind::Address(place) => Expr::Unary("&", Box::new(self.place(place)?)),
            ExprKind::Unary(op, a) => Expr::Unary(op.sign(), self.boxed(a)?),
            ExprKind::Binary(op, a, b) => Expr::Binary(op.sign(), self.boxed(a)?, self.boxed(b)?),
            ExprKind::Logical(op, all) => self.logical(*op, all)?,
            ExprKind::Choose(condition, yes, no) => {
                Expr::Choice(self.boxed(condition)?, self.boxed(yes)?, self.boxed(no)?)
            }
            ExprKind::Convert(a) => self.expr(a)?,
            ExprKind::Cast(_, a) => Expr::Cast(self.ty(&expr.ty), self.boxed(a)?),
            ExprKind::Assign(place, value) => {
                Expr::Assign(None, Box::new(self.place(place)?), self.boxed(value)?)
            }
            ExprKind::Update(op, place, value, _) => {
                Expr::Assign(Some(op.sign()), Box::new(self.place(place)?), self.boxed(value)?)
            }
            ExprKind::Step { is_increment: true, place, .. } => {
                Expr::Count(Box::new(self.place(place)?))
            }
            ExprKind::Call(Callee::Function(id), all) => {
                let all = all.iter().map(|it| self.expr(it)).collect::<Read<_>>()?;
                Expr::Call(self.name(*id), all)
            }
            ExprKind::Member(base, at) => self.member(&base.ty, self.boxed(base)?, *at)?,
            ExprKind::SizeOf(operand) => {
                let ty = match &**operand {
                    SizeOfOperand::Type(written) => &self.from.canonical(written).ty,
                    SizeOfOperand::Place(place) => &place.ty,
                    SizeOfOperand::Value(value) => &value.ty,
                };
                Expr::Number(i128::from(size(&self.unit, self.machine, &self.ty(ty))))
            }
            ExprKind::Step { is_increment: false, .. } => return self.unknown("`--`"),
            ExprKind::Comma(..) => return self.unknown("a comma"),
            ExprKind::Call(Callee::Pointer(_), _) => {
                return self.unknown("a call through a pointer");
            }
        })
    }

    fn logical(&self, op: LogicalOp, all: &[c::Expr]) -> Read<Expr> {
        let mut all = all.iter().map(|it| self.expr(it));
        let first = all.next().unwrap_or(Ok(Expr::Nothing))?;
        all.try_fold(first, |a, b| Ok(Expr::Binary(op.sign(), Box::new(a), Box::new(b?))))
    }

    fn place(&self, place: &c::Place) -> Read<Expr> {
        Ok(match &place.kind {
            PlaceKind::Symbol(id) => Expr::Name(self.name(*id)),
            PlaceKind::Member(base, at) => {
                // `pointer->member`
                let inner = if let PlaceKind::Deref(it) = &base.kind {
                    self.expr(it)
                } else {
                    self.place(base)
                };
                self.member(&base.ty, Box::new(inner?), *at)?
            }
            PlaceKind::Element(base, index) => {
                Expr::Index(Box::new(self.place(base)?), self.boxed(index)?)
            }
            PlaceKind::At(pointer, index) => Expr::Index(self.boxed(pointer)?, self.boxed(index)?),
            PlaceKind::Deref(pointer) => Expr::Unary("*", self.boxed(pointer)?),
        })
    }

    fn member(&self, of: &types::Type, base: Box<Expr>, at: usize) -> Read<Expr> {
        let member = self.unit.members(&self.ty(of)).and_then(|all| all.get(at));
        match member {
            Some(member) => Ok(Expr::Member(base, member.name.clone())),
            None => self.unknown("a member"),
        }
    }
}
