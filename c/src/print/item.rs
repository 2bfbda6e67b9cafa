//! Declarations and types as text.

use super::{Printer, WIDTH};
use crate::tree::types::{IntKind, Qualified, Qualifiers, Space, Type};
use crate::tree::{EnumId, Init, Item, ItemKind, Part, StructId, SymbolId, SymbolKind, Tag};

impl Printer<'_> {
    pub(super) fn items(&mut self, items: &[Item]) {
        for (at, item) in items.iter().enumerate() {
            let before = at.checked_sub(1).and_then(|at| items.get(at));
            if before.is_some_and(|before| needs_space(before, item)) {
                self.line("", "");
            }
            self.comment(&item.note);
            self.item(item);
        }
    }

    fn item(&mut self, item: &Item) {
        match &item.kind {
            ItemKind::Include(header) => self.line(&format!("#include <{}>", header.name()), ""),
            ItemKind::DeclareStruct(id) => {
                let text = format!("{};", self.struct_name(*id));
                self.line(&text, "");
            }
            ItemKind::DefineStruct(id) => {
                self.tag(Tag::Struct(*id), "");
                self.line("};", "");
            }
            ItemKind::DefineEnum(id) => {
                self.tag(Tag::Enum(*id), "");
                self.line("};", "");
            }
            ItemKind::Typedef { symbol, defines } => {
                let head = self.defined(*defines, "typedef ");
                let declared = self.declared(*symbol, *defines);
                self.line(&format!("{head}{declared};"), "");
            }
            ItemKind::Object { symbol, defines, is_extern, init } => {
                let is_static = matches!(
                    self.unit.symbols[*symbol].kind,
                    SymbolKind::Object { is_static: true }
                );
                let storage = match (is_extern, is_static) {
                    (true, _) => "extern ",
                    (false, true) => "static ",
                    (false, false) => "",
                };
                let head = self.defined(*defines, storage);
                let declared = self.declared(*symbol, *defines);
                self.initialised(&format!("{head}{declared}"), *symbol, init.as_ref(), "");
            }
            ItemKind::Prototype { symbol, params } => {
                let names: Vec<&str> =
                    params.iter().map(|name| name.as_deref().unwrap_or_default()).collect();
                let head = self.function_head(*symbol, &names);
                self.line(&format!("{head};"), "");
            }
            ItemKind::Function { symbol, params, body } => {
                let head = self.definition_head(*symbol, params);
                self.line(&head, "");
                self.line("{", "");
                self.body(body);
                self.line("}", "");
            }
            ItemKind::ExternC(inner) => {
                self.line("#ifdef __cplusplus", "");
                self.line("extern \"C\" {", "");
                self.line("#endif", "");
                self.line("", "");
                self.items(inner);
                self.line("", "");
                self.line("#ifdef __cplusplus", "");
                self.line("}", "");
                self.line("#endif", "");
            }
        }
    }

    /// The words in front of a declarator; a structure that is defined here is printed up to its closing brace.
    fn defined(&mut self, defines: Option<Tag>, storage: &str) -> String {
        let Some(tag) = defines else { return storage.to_owned() };
        self.tag(tag, storage);
        "} ".to_owned()
    }

    /// The head and the members of a structure or enumeration, without the closing brace.
    fn tag(&mut self, tag: Tag, storage: &str) {
        match tag {
            Tag::Struct(id) => {
                let head = format!("{storage}{} {{", self.struct_name(id));
                self.line(&head, "");
                self.indent += 1;
                for member in &self.unit.structs[id].members {
                    let text = self.declarator(&member.ty, &member.name, None);
                    let width = if member.is_bit { " : 1" } else { "" };
                    self.line(&format!("{text}{width};"), &member.note);
                }
                self.indent -= 1;
            }
            Tag::Enum(id) => {
                let head = format!("{storage}{} {{", self.enum_name(id));
                self.line(&head, "");
                self.indent += 1;
                let one = &self.unit.enums[id];
                for (at, constant) in one.constants.iter().enumerate() {
                    let symbol = &self.unit.symbols[*constant];
                    let SymbolKind::Constant(value) = symbol.kind else { continue };
                    let comma = if at + 1 == one.constants.len() { "" } else { "," };
                    let note = one.notes.get(at).map(String::as_str).unwrap_or_default();
                    let value = self.enumerator(value);
                    self.line(&format!("{} = {value}{comma}", symbol.name), note);
                }
                self.indent -= 1;
            }
        }
    }

    /// The value of an enumerator; the smallest `int` is printed as a difference, because its magnitude is not an `int` constant.
    fn enumerator(&self, value: i128) -> String {
        let (lo, _) = self.unit.machine.range(IntKind::Int);
        if value == lo { format!("{} - 1", value + 1) } else { value.to_string() }
    }

    fn struct_name(&self, id: StructId) -> String {
        match &self.unit.structs[id].tag {
            Some(tag) => format!("struct {tag}"),
            None => "struct".to_owned(),
        }
    }

    fn enum_name(&self, id: EnumId) -> String {
        match &self.unit.enums[id].tag {
            Some(tag) => format!("enum {tag}"),
            None => "enum".to_owned(),
        }
    }

    fn definition_head(&self, symbol: SymbolId, params: &[SymbolId]) -> String {
        let declared = params.iter().map(|param| self.declared(*param, None));
        let list: Vec<String> = declared.collect();
        self.head_with(symbol, &list)
    }

    fn function_head(&self, symbol: SymbolId, names: &[&str]) -> String {
        let Type::Function(function) = &self.unit.symbols[symbol].ty.ty else {
            return String::new();
        };
        let list: Vec<String> = function
            .params
            .iter()
            .enumerate()
            .map(|(at, ty)| self.declarator(ty, names.get(at).copied().unwrap_or_default(), None))
            .collect();
        self.head_with(symbol, &list)
    }

    fn head_with(&self, id: SymbolId, params: &[String]) -> String {
        let symbol = &self.unit.symbols[id];
        let (Type::Function(function), SymbolKind::Function(kind)) = (&symbol.ty.ty, &symbol.kind)
        else {
            return String::new();
        };
        let list = if params.is_empty() { "void".to_owned() } else { params.join(", ") };
        let inner = format!("{}({list})", symbol.name);
        let head = self.declarator(&function.result, &inner, None);
        let storage = if kind.is_static { "static " } else { "" };
        let inline = if kind.is_inline { "inline " } else { "" };
        let stack = if kind.is_on_stack { " __reentrant" } else { "" };
        format!("{storage}{inline}{head}{stack}")
    }

    /// A symbol with its type. `defines` is the structure or enumeration whose definition is already printed.
    pub(super) fn declared(&self, id: SymbolId, defines: Option<Tag>) -> String {
        let symbol = &self.unit.symbols[id];
        self.declarator(&symbol.ty, &symbol.name, defines)
    }

    /// The declarator of a symbol without its base type, for the second and later symbols of a declaration.
    pub(super) fn declared_without_base(&self, id: SymbolId) -> String {
        let symbol = &self.unit.symbols[id];
        let (declarator, _) = self.around(&symbol.ty, symbol.name.clone());
        declarator
    }

    /// A declaration of `name` with this type (C99 6.7.5), read from the name outwards.
    pub(super) fn declarator(&self, ty: &Qualified, name: &str, defines: Option<Tag>) -> String {
        let (declarator, base) = self.around(ty, name.to_owned());
        let base = self.base(base, defines);
        match (base.is_empty(), declarator.is_empty()) {
            (true, _) => declarator,
            (false, true) => base,
            (false, false) => format!("{base} {declarator}"),
        }
    }

    /// The declarator around a name, and the base type.
    fn around<'t>(&self, ty: &'t Qualified, name: String) -> (String, &'t Qualified) {
        let (mut text, mut at) = (name, ty);
        // A pointer needs brackets in front of an array or a list of parameters.
        let mut is_pointer = false;
        loop {
            match &at.ty {
                Type::Pointer(target) => {
                    let words = qualifiers(at.qualifiers);
                    let space = if words.is_empty() || text.is_empty() { "" } else { " " };
                    text = format!("*{words}{space}{text}");
                    (is_pointer, at) = (true, target);
                }
                Type::Array(element, len) => {
                    let len = len.map(|len| len.to_string()).unwrap_or_default();
                    text = if is_pointer {
                        format!("({text})[{len}]")
                    } else {
                        format!("{text}[{len}]")
                    };
                    (is_pointer, at) = (false, element);
                }
                Type::Function(function) => {
                    let params: Vec<String> =
                        function.params.iter().map(|one| self.declarator(one, "", None)).collect();
                    let list =
                        if params.is_empty() { "void".to_owned() } else { params.join(", ") };
                    text = if is_pointer {
                        format!("({text})({list})")
                    } else {
                        format!("{text}({list})")
                    };
                    (is_pointer, at) = (false, &function.result);
                }
                Type::Void | Type::Int(_) | Type::Enum(_) | Type::Struct(_) | Type::Named(_) => {
                    return (text, at);
                }
            }
        }
    }

    fn base(&self, ty: &Qualified, defines: Option<Tag>) -> String {
        let words = qualifiers(ty.qualifiers);
        let name = match &ty.ty {
            Type::Void => "void".to_owned(),
            Type::Int(kind) => kind.name().to_owned(),
            Type::Struct(id) if defines == Some(Tag::Struct(*id)) => String::new(),
            Type::Enum(id) if defines == Some(Tag::Enum(*id)) => String::new(),
            Type::Struct(id) => self.struct_name(*id),
            Type::Enum(id) => self.enum_name(*id),
            Type::Named(id) => self.unit.symbols[*id].name.clone(),
            Type::Pointer(_) | Type::Array(..) | Type::Function(_) => {
                unreachable!("the base of a type is not derived")
            }
        };
        let space = if words.is_empty() || name.is_empty() { "" } else { " " };
        format!("{words}{space}{name}")
    }

    /// `head = init;`, on several lines if it is long.
    pub(super) fn initialised(
        &mut self,
        head: &str,
        id: SymbolId,
        init: Option<&Init>,
        note: &str,
    ) {
        let Some(init) = init else { return self.line(&format!("{head};"), note) };
        let ty = &self.unit.symbols[id].canonical.ty;
        let whole = format!("{head} = {};", self.init(init, ty));
        let Init::Parts(parts) = init else { return self.line(&whole, note) };
        if whole.len() + 4 * self.indent <= WIDTH && parts.len() <= 8 && !is_table(parts) {
            return self.line(&whole, note);
        }
        let texts = self.parts(parts, ty);
        self.line(&format!("{head} = {{"), note);
        self.indent += 1;
        let mut row = String::new();
        for text in texts {
            let is_full = is_table(parts) || row.len() + text.len() + 4 * self.indent + 2 > WIDTH;
            if is_full && !row.is_empty() {
                self.line(row.trim_end(), "");
                row.clear();
            }
            row.push_str(&text);
            row.push_str(", ");
        }
        self.line(row.trim_end(), "");
        self.indent -= 1;
        self.line("};", "");
    }

    /// An initialiser of an object of this canonical type, on one line.
    pub(super) fn init(&self, init: &Init, ty: &Type) -> String {
        match init {
            Init::Value(value) => self.item_expr(value),
            Init::Parts(parts) => format!("{{ {} }}", self.parts(parts, ty).join(", ")),
        }
    }

    /// The parts of an initialiser; a part that does not follow the one before it is designated.
    fn parts(&self, parts: &[Part], ty: &Type) -> Vec<String> {
        let mut next = 0;
        let mut texts = Vec::new();
        for part in parts {
            let (designator, ty) = match ty {
                Type::Struct(id) => {
                    let members = &self.unit.structs[*id].members;
                    let Some(member) = usize::try_from(part.at).ok().and_then(|at| members.get(at))
                    else {
                        unreachable!("an initialiser has only parts of its object")
                    };
                    (format!(".{} = ", member.name), &member.canonical.ty)
                }
                Type::Array(element, _) => (format!("[{}] = ", part.at), &element.ty),
                Type::Void
                | Type::Int(_)
                | Type::Enum(_)
                | Type::Pointer(_)
                | Type::Function(_)
                | Type::Named(_) => unreachable!("only arrays and structures have parts"),
            };
            let designator = if part.at == next { String::new() } else { designator };
            texts.push(format!("{designator}{}", self.init(&part.init, ty)));
            next = part.at + 1;
        }
        texts
    }
}

/// True if each part is a list; each list then gets a line of its own.
fn is_table(parts: &[Part]) -> bool {
    parts.iter().all(|part| matches!(part.init, Init::Parts(_)))
}

/// The words of qualifiers, separated by spaces.
fn qualifiers(it: Qualifiers) -> String {
    let space = match it.space {
        Space::Generic => None,
        Space::Flash => Some("__flash"),
        Space::Code => Some("__code"),
    };
    let words = [
        it.is_const.then_some("const"),
        it.is_volatile.then_some("volatile"),
        it.is_restrict.then_some("restrict"),
        space,
    ];
    words.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

fn needs_space(before: &Item, item: &Item) -> bool {
    let is_small = |it: &Item| {
        matches!(
            it.kind,
            ItemKind::Include(_) | ItemKind::Prototype { .. } | ItemKind::DeclareStruct(_)
        ) || matches!(
            it.kind,
            ItemKind::Typedef { defines: None, .. } | ItemKind::Object { defines: None, .. }
        )
    };
    let is_alike = std::mem::discriminant(&before.kind) == std::mem::discriminant(&item.kind);
    let is_close = is_alike && is_small(before) && is_small(item);
    !is_close || !item.note.is_empty()
}
