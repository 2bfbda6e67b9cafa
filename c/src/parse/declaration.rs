//! Declarations of a file (C99 6.7, 6.9).

use super::declarator::{Declared, Specifiers, Storage};
use super::lexer::TokenKind;
use super::{MAX_FINDINGS, Parser, Read, headers};
use crate::codes;
use crate::tree::types::{Qualified, Type};
use crate::tree::{FunctionKind, Init, Item, ItemKind, Note, Stmt, SymbolId, SymbolKind, Tag};
use crate::walk::init_values;
use grafsynth_ir::Span;
use grafsynth_ir::diag::ErrorReported;

impl Parser<'_, '_> {
    /// Reads the whole translation unit.
    pub(super) fn unit(&mut self) -> Read<()> {
        while self.peek().kind != TokenKind::End {
            let mut items = Vec::new();
            self.item(&mut items)?;
            self.unit.items.extend(items);
        }
        if self.found.is_empty() { Ok(()) } else { Err(ErrorReported) }
    }

    fn item(&mut self, items: &mut Vec<Item>) -> Read<()> {
        let token = self.peek();
        if token.kind == TokenKind::Header {
            self.next();
            if let Some(header) = headers::header(token.text) {
                self.show(headers::Source::Header(header));
                items.push(self.made(ItemKind::Include(header), token.span));
            }
            return Ok(());
        }
        let is_linkage = self.is_cpp
            && token.is_word("extern")
            && self.peek_at(1).kind == TokenKind::String
            && self.peek_at(1).text == "\"C\"";
        if !is_linkage {
            return self.declaration(items);
        }
        self.next();
        self.next();
        let mut inner = Vec::new();
        if self.take("{") {
            while !self.take("}") {
                if self.peek().kind == TokenKind::End {
                    return self.unexpected("`}`");
                }
                if self.peek().is_word("extern") && self.peek_at(1).kind == TokenKind::String {
                    return self.unexpected("a declaration");
                }
                self.item(&mut inner)?;
            }
        } else {
            self.declaration(&mut inner)?;
        }
        items.push(self.made(ItemKind::ExternC(inner), token.span));
        Ok(())
    }

    fn made(&self, kind: ItemKind, start: Span) -> Item {
        Item { kind, note: Note::new(), span: self.since(start) }
    }

    fn declaration(&mut self, items: &mut Vec<Item>) -> Read<()> {
        let specifiers = self.specifiers()?;
        if self.take(";") {
            return self.only_tag(&specifiers, items);
        }
        let mut is_first = true;
        loop {
            let declared = self.declare(&specifiers.base)?;
            let Some((name, span)) = declared.name.clone() else {
                return self.unexpected("a name");
            };
            if self.peek().is("{") && is_first && declared.params.is_some() {
                return self.function(&specifiers, declared, &name, span, items);
            }
            if !is_first && is_untagged(self, specifiers.defines) {
                let message = "a structure or enumeration without a tag can only be used once";
                return self.fail(codes::SYNTAX, message, span, "for the second time here");
            }
            let defines = specifiers.defines.filter(|_| is_first);
            self.declarator_item(&specifiers, defines, declared, &name, span, items)?;
            is_first = false;
            if !self.take(",") {
                self.expect(";")?;
                return Ok(());
            }
        }
    }

    /// Reads `struct TAG;`, `struct { .. };` or `enum { .. };`.
    fn only_tag(&mut self, specifiers: &Specifiers, items: &mut Vec<Item>) -> Read<()> {
        let kind = match (specifiers.defines, &specifiers.base.ty) {
            (Some(Tag::Struct(id)), _) => ItemKind::DefineStruct(id),
            (Some(Tag::Enum(id)), _) => ItemKind::DefineEnum(id),
            (None, Type::Struct(id)) if specifiers.mentions => ItemKind::DeclareStruct(*id),
            (None, _) => {
                let span = specifiers.span;
                return self.fail(codes::SYNTAX, "this declares nothing", span, "here");
            }
        };
        if specifiers.storage.is_some() || specifiers.is_inline {
            let span = specifiers.span;
            return self.fail(
                codes::SYNTAX,
                "a type cannot have a storage class or be `inline`",
                span,
                "here",
            );
        }
        items.push(self.made(kind, specifiers.span));
        Ok(())
    }

    fn declarator_item(
        &mut self,
        specifiers: &Specifiers,
        defines: Option<Tag>,
        declared: Declared,
        name: &str,
        span: Span,
        items: &mut Vec<Item>,
    ) -> Read<()> {
        let is_function = matches!(self.unit.canonical(&declared.ty).ty, Type::Function(_));
        if specifiers.is_inline && !is_function {
            return self.fail(codes::SYNTAX, "only functions can be `inline`", span, "here");
        }
        let kind = if specifiers.storage == Some(Storage::Typedef) {
            let symbol = self.declare_symbol(name, span, SymbolKind::Typedef, declared.ty)?;
            ItemKind::Typedef { symbol, defines }
        } else if is_function {
            let Some(params) = &declared.params else {
                let message = "expected the parameters of the function in its declaration";
                return self.fail(codes::SYNTAX, message, span, "here");
            };
            if let Some(tag) = defines {
                items.push(self.made(define(tag), specifiers.span));
            }
            let params = params.iter().map(|one| one.name.clone().map(|(name, _)| name)).collect();
            let symbol = self.function_symbol(specifiers, &declared, name, span)?;
            ItemKind::Prototype { symbol, params }
        } else {
            self.object(specifiers, defines, declared.ty, name, span)?
        };
        items.push(self.made(kind, specifiers.span));
        Ok(())
    }

    fn object(
        &mut self,
        specifiers: &Specifiers,
        defines: Option<Tag>,
        ty: Qualified,
        name: &str,
        span: Span,
    ) -> Read<ItemKind> {
        let is_extern = specifiers.storage == Some(Storage::Extern);
        let is_static = specifiers.storage == Some(Storage::Static);
        let symbol = self.object_symbol(ty, is_static, is_extern, name, span)?;
        let mut init = None;
        if self.take("=") {
            if is_extern {
                let message = "an `extern` declaration with an initialiser is not supported";
                return self.fail(codes::SYNTAX, message, span, "here");
            }
            if !self.defined.insert(symbol) {
                return self.fail(codes::TYPE, "this object has two initialisers", span, "here");
            }
            init = Some(self.static_initialiser(symbol)?);
        }
        if !is_extern && self.unit.layout(&self.unit.symbols[symbol].canonical.ty).is_none() {
            return self.fail(codes::TYPE, "the object has no known size", span, "here");
        }
        Ok(ItemKind::Object { symbol, defines, is_extern, init })
    }

    /// Reads the initialiser of a symbol with static storage duration; its values must be constants (C99 6.7.8p4).
    pub(super) fn static_initialiser(&mut self, symbol: SymbolId) -> Read<Init> {
        let init = self.symbol_initialiser(symbol)?;
        let mut bad = None;
        init_values(&init, &mut |value| {
            if bad.is_none() && !self.unit.is_static_constant(value) {
                bad = Some(value.span);
            }
        });
        match bad {
            Some(span) => self.fail(
                codes::TYPE,
                "this value is not known before the program runs",
                span.0,
                "here",
            ),
            None => Ok(init),
        }
    }

    /// Reads the initialiser of a symbol, which may determine its length.
    pub(super) fn symbol_initialiser(&mut self, symbol: SymbolId) -> Read<Init> {
        let ty = self.unit.symbols[symbol].canonical.ty.clone();
        let (init, complete) = self.initialiser(&ty)?;
        if complete != ty {
            self.complete(symbol, &complete);
        }
        Ok(init)
    }

    /// Sets the length of an array that was declared without one.
    fn complete(&mut self, symbol: SymbolId, ty: &Type) {
        let known = &mut self.unit.symbols[symbol];
        known.canonical.ty = ty.clone();
        if let (Type::Array(_, len), Type::Array(_, new)) = (&mut known.ty.ty, ty) {
            *len = *new;
        } else {
            // The name of a typedef for an array without a length.
            known.ty = known.canonical.clone();
        }
    }

    /// The symbol of an object of the file, which may be declared several times (C99 6.2.2, 6.2.7).
    fn object_symbol(
        &mut self,
        ty: Qualified,
        is_static: bool,
        is_extern: bool,
        name: &str,
        span: Span,
    ) -> Read<SymbolId> {
        let canonical = self.unit.canonical(&ty);
        if canonical.ty == Type::Void {
            return self.fail(codes::TYPE, "an object cannot be `void`", span, "here");
        }
        let old = self.scopes.first().and_then(|scope| scope.names.get(name)).copied();
        let Some(id) = old else {
            return self.declare_symbol(name, span, SymbolKind::Object { is_static }, ty);
        };
        let symbol = &self.unit.symbols[id];
        let is_same = match (&symbol.canonical.ty, &canonical.ty) {
            (Type::Array(a, x), Type::Array(b, y)) => {
                a == b && (x == y || x.is_none() || y.is_none())
            }
            (a, b) => a == b,
        };
        let agrees = match symbol.kind {
            SymbolKind::Object { is_static: old } => old == is_static || old && is_extern,
            SymbolKind::Local { .. }
            | SymbolKind::Parameter
            | SymbolKind::Function(_)
            | SymbolKind::Typedef
            | SymbolKind::Constant(_) => false,
        };
        if !(agrees && is_same && symbol.canonical.qualifiers == canonical.qualifiers) {
            let message = format!("`{name}` is already declared as something else");
            return self.fail(codes::TYPE, message, span, "here");
        }
        if matches!(symbol.canonical.ty, Type::Array(_, None)) {
            self.complete(id, &canonical.ty);
        }
        Ok(id)
    }

    fn function_symbol(
        &mut self,
        specifiers: &Specifiers,
        declared: &Declared,
        name: &str,
        span: Span,
    ) -> Read<SymbolId> {
        let kind = FunctionKind {
            is_static: specifiers.storage == Some(Storage::Static),
            is_inline: specifiers.is_inline,
            is_on_stack: declared.is_on_stack,
            is_pure: self.readers.contains(&name),
        };
        let old = self.scopes.first().and_then(|scope| scope.names.get(name)).copied();
        let Some(id) = old else {
            return self.declare_symbol(
                name,
                span,
                SymbolKind::Function(kind),
                declared.ty.clone(),
            );
        };
        let is_same = self.unit.symbols[id].canonical == self.unit.canonical(&declared.ty);
        if let SymbolKind::Function(known) = &mut self.unit.symbols[id].kind
            && is_same
            && (known.is_static || !kind.is_static)
        {
            known.is_inline |= kind.is_inline;
            known.is_on_stack |= kind.is_on_stack;
            return Ok(id);
        }
        let message = format!("`{name}` is already declared as something else");
        self.fail(codes::TYPE, message, span, "here")
    }

    /// Reads the definition of a function (C99 6.9.1).
    fn function(
        &mut self,
        specifiers: &Specifiers,
        declared: Declared,
        name: &str,
        span: Span,
        items: &mut Vec<Item>,
    ) -> Read<()> {
        if specifiers.storage == Some(Storage::Typedef) {
            return self.unexpected("`;`");
        }
        if let Some(tag) = specifiers.defines {
            items.push(self.made(define(tag), specifiers.span));
        }
        let symbol = self.function_symbol(specifiers, &declared, name, span)?;
        if !self.defined.insert(symbol) {
            return self.fail(codes::TYPE, format!("`{name}` is defined twice"), span, "here");
        }
        let Some(function) = self.function_result(symbol) else {
            return self.fail(
                codes::TYPE,
                "the return type of the function has no known size",
                span,
                "here",
            );
        };
        let params = declared.params.unwrap_or_default();
        let body_at = self.at;
        self.result = Some(function);
        let read = self.scoped(|parser| {
            let params = parser.define_parameters(params)?;
            let body = parser.body_here()?;
            Ok((params, body))
        });
        self.result = None;
        match read {
            Ok((params, body)) => {
                let kind = ItemKind::Function { symbol, params, body };
                items.push(self.made(kind, specifiers.span));
                Ok(())
            }
            // The next declaration can still be read.
            Err(reported) if self.found.len() < MAX_FINDINGS && self.skip_body(body_at) => {
                let _ = reported;
                Ok(())
            }
            Err(reported) => Err(reported),
        }
    }

    /// The return type of a function, if the type is complete.
    fn function_result(&self, symbol: SymbolId) -> Option<Type> {
        let Type::Function(function) = &self.unit.symbols[symbol].canonical.ty else { return None };
        let result = function.result.ty.clone();
        (result == Type::Void || self.unit.layout(&result).is_some()).then_some(result)
    }

    fn define_parameters(&mut self, params: Vec<Declared>) -> Read<Vec<SymbolId>> {
        let mut ids = Vec::new();
        for param in params {
            let Some((name, span)) = param.name else {
                return self.unexpected("a name for each parameter of the function");
            };
            let canonical = self.unit.canonical(&param.ty).ty;
            if self.unit.layout(&canonical).is_none() {
                return self.fail(codes::TYPE, "the parameter has no known size", span, "here");
            }
            ids.push(self.declare_symbol(&name, span, SymbolKind::Parameter, param.ty)?);
        }
        Ok(ids)
    }

    /// The statements of a function body, whose scope is that of the parameters.
    fn body_here(&mut self) -> Read<Vec<Stmt>> {
        self.expect("{")?;
        self.statements()
    }

    /// Moves past the block that begins at token `at`; returns false if the block has no end.
    fn skip_body(&mut self, at: usize) -> bool {
        self.at = at;
        self.depth = 0;
        (self.n_loops, self.n_switches) = (0, 0);
        let mut depth = 0_usize;
        while self.peek().kind != TokenKind::End {
            let token = self.next();
            if token.is("{") {
                depth += 1;
            } else if token.is("}") {
                depth -= 1;
                if depth == 0 {
                    return true;
                }
            }
        }
        false
    }
}

fn define(tag: Tag) -> ItemKind {
    match tag {
        Tag::Struct(id) => ItemKind::DefineStruct(id),
        Tag::Enum(id) => ItemKind::DefineEnum(id),
    }
}

fn is_untagged(parser: &Parser, tag: Option<Tag>) -> bool {
    match tag {
        Some(Tag::Struct(id)) => parser.unit.structs[id].tag.is_none(),
        Some(Tag::Enum(id)) => parser.unit.enums[id].tag.is_none(),
        None => false,
    }
}
