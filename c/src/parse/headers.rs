//! The names of the standard headers (types, constants and functions), which are built in as symbols.

use crate::tree::types::{FunctionType, IntKind, Machine, Qualified, Qualifiers, Type};
use crate::tree::{FunctionKind, Header, Loc, Symbol, SymbolId, SymbolKind, Unit};
use grafsynth_ir::Arena;
use std::sync::Arc;

/// A name of a standard header or of the compiler.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// Visible after `#include`.
    Header(Header),
    /// A function of gcc, visible if `__GNUC__` is defined.
    Gcc,
}

impl Unit {
    /// A unit that contains only the symbols of the standard headers.
    #[must_use]
    pub fn new(machine: Machine) -> Unit {
        let symbols: Arena<Symbol> =
            standard(&machine).into_iter().map(|(_, symbol)| symbol).collect();
        Unit {
            machine,
            symbols,
            structs: Arena::default(),
            enums: Arena::default(),
            items: Vec::new(),
        }
    }

    /// The symbol of a standard header with this name. A program sees it only after the header is included.
    #[must_use]
    pub fn standard(&self, name: &str) -> Option<SymbolId> {
        let known = sources(&self.machine).len();
        self.symbols.iter().take(known).find(|(_, symbol)| symbol.name == name).map(|(id, _)| id)
    }
}

/// The header that declares each predefined symbol; these symbols are the first of every unit.
pub(crate) fn sources(machine: &Machine) -> Vec<Source> {
    standard(machine).into_iter().map(|(source, _)| source).collect()
}

/// The header with this name.
pub(crate) fn header(name: &str) -> Option<Header> {
    Header::ALL.into_iter().find(|header| header.name() == name)
}

/// The constants of a header, for `#if` and `#ifdef`.
pub(crate) fn constants(machine: &Machine, header: Header) -> Vec<(String, i128)> {
    let of_header = standard(machine).into_iter().filter(|(it, _)| *it == Source::Header(header));
    of_header
        .filter_map(|(_, symbol)| match symbol.kind {
            SymbolKind::Constant(value) => Some((symbol.name, value)),
            SymbolKind::Object { .. }
            | SymbolKind::Local { .. }
            | SymbolKind::Parameter
            | SymbolKind::Function(_)
            | SymbolKind::Typedef => None,
        })
        .collect()
}

/// The width and the sign of `INT32_C` and so on.
pub(crate) fn sized_constant(name: &str) -> Option<(u8, bool)> {
    let (is_signed, rest) = match name.strip_prefix('U') {
        Some(rest) => (false, rest),
        None => (true, name),
    };
    let bits = rest.strip_prefix("INT")?.strip_suffix("_C")?;
    [8, 16, 32, 64].into_iter().find(|it| it.to_string() == bits).map(|it| (it, is_signed))
}

fn symbol(name: impl Into<String>, kind: SymbolKind, ty: Qualified) -> Symbol {
    Symbol { name: name.into(), kind, canonical: ty.clone(), ty, span: Loc::default() }
}

fn standard(machine: &Machine) -> Vec<(Source, Symbol)> {
    let mut all = Vec::new();
    integers(machine, &mut all);
    limits(machine, &mut all);
    functions(machine, &mut all);
    all
}

/// `<stdint.h>` (C99 7.18) and `<stddef.h>` (C99 7.17).
fn integers(machine: &Machine, all: &mut Vec<(Source, Symbol)>) {
    let mut add =
        |header: Header, name: String, kind: IntKind, has_limits: Option<(&str, bool)>| {
            let source = Source::Header(header);
            let ty = Type::Int(kind);
            all.push((source, symbol(name, SymbolKind::Typedef, ty.into())));
            let Some((upper, has_min)) = has_limits else { return };
            let (lo, hi) = machine.range(kind);
            let ty = Type::Int(machine.promoted(kind));
            let mut limit = |suffix: &str, value: i128| {
                let name = format!("{upper}_{suffix}");
                all.push((source, symbol(name, SymbolKind::Constant(value), ty.clone().into())));
            };
            limit("MAX", hi);
            if has_min {
                limit("MIN", lo);
            }
        };
    for bits in [8, 16, 32, 64] {
        for is_signed in [true, false] {
            let sign = if is_signed { "" } else { "u" };
            let kind = machine.exact(bits, is_signed);
            // The widths of the fast types differ between libraries, so they are unknown here.
            for word in ["", "_least"] {
                let lower = format!("{sign}int{word}{bits}");
                let upper = lower.to_uppercase();
                let name = format!("{lower}_t");
                add(Header::StdInt, name, kind, Some((&upper, is_signed)));
            }
        }
    }
    let (size, difference) = (machine.size_type(), machine.difference_type());
    let pointer = machine.exact(if machine.pointer_bytes > 4 { 64 } else { 32 }, false);
    let pointer = if machine.pointer_bytes == 2 { machine.exact(16, false) } else { pointer };
    add(Header::StdInt, "uintptr_t".to_owned(), pointer, Some(("UINTPTR", false)));
    let wide = machine.exact(64, true);
    add(Header::StdInt, "intmax_t".to_owned(), wide, Some(("INTMAX", true)));
    add(Header::StdInt, "uintmax_t".to_owned(), wide.unsigned(), Some(("UINTMAX", false)));
    add(Header::StdDef, "size_t".to_owned(), size, None);
    add(Header::StdDef, "ptrdiff_t".to_owned(), difference, None);
    let (_, hi) = machine.range(size);
    let ty = Type::Int(size).into();
    let source = Source::Header(Header::StdInt);
    all.push((source, symbol("SIZE_MAX", SymbolKind::Constant(hi), ty)));
}

/// `<limits.h>` (C99 5.2.4.2.1).
fn limits(machine: &Machine, all: &mut Vec<(Source, Symbol)>) {
    let mut add = |name: String, value: i128, kind: IntKind| {
        let ty = Type::Int(machine.promoted(kind));
        let source = Source::Header(Header::Limits);
        all.push((source, symbol(name, SymbolKind::Constant(value), ty.into())));
    };
    add("CHAR_BIT".to_owned(), 8, IntKind::Int);
    let kinds = [
        ("CHAR", IntKind::Char),
        ("SCHAR", IntKind::SChar),
        ("UCHAR", IntKind::UChar),
        ("SHRT", IntKind::Short),
        ("USHRT", IntKind::UShort),
        ("INT", IntKind::Int),
        ("UINT", IntKind::UInt),
        ("LONG", IntKind::Long),
        ("ULONG", IntKind::ULong),
        ("LLONG", IntKind::LLong),
        ("ULLONG", IntKind::ULLong),
    ];
    for (name, kind) in kinds {
        let (lo, hi) = machine.range(kind);
        add(format!("{name}_MAX"), hi, kind);
        if lo < 0 || kind == IntKind::Char {
            add(format!("{name}_MIN"), lo, kind);
        }
    }
}

/// The functions of `<string.h>` and `<stdlib.h>`, and of gcc.
fn functions(machine: &Machine, all: &mut Vec<(Source, Symbol)>) {
    let int = || Qualified::from(Type::INT);
    let long = || Qualified::from(Type::Int(IntKind::Long));
    let size = || Qualified::from(Type::Int(machine.size_type()));
    let void = || Qualified::from(Type::Void);
    let to = || Qualified::from(Type::pointer(void()));
    let from = || {
        let qualifiers = Qualifiers { is_const: true, ..Qualifiers::default() };
        Qualified::from(Type::pointer(Qualified { qualifiers, ty: Type::Void }))
    };
    let mut add = |source, name: &str, result, params, is_pure| {
        let ty = Type::Function(Arc::new(FunctionType { result, params }));
        let kind = FunctionKind { is_pure, ..FunctionKind::default() };
        all.push((source, symbol(name, SymbolKind::Function(kind), ty.into())));
    };
    let (string, library) = (Source::Header(Header::String), Source::Header(Header::StdLib));
    add(string, "memcpy", to(), vec![to(), from(), size()], false);
    add(string, "memmove", to(), vec![to(), from(), size()], false);
    add(string, "memset", to(), vec![to(), int(), size()], false);
    add(string, "memcmp", int(), vec![from(), from(), size()], true);
    add(library, "abs", int(), vec![int()], true);
    add(library, "labs", long(), vec![long()], true);
    add(library, "abort", void(), Vec::new(), false);
    add(Source::Gcc, "__sync_synchronize", void(), Vec::new(), false);
}
