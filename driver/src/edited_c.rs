//! C that `build` emitted and somebody edited: recognised by the functions that it declares, and proved like C that was just emitted.
//!
//! The interface (which member is which input, which function answers which query) comes from the chart and the options of the build, never from the edited text
//! or from its map: the text must declare exactly the interface that `build` would emit. Only the state of the instance is taken from the map, and that is checked.

pub use crate::c_map::CMap;
use crate::c_proof::{TABLES, both, machines, prove_unit, tables_of, unit_of};
use crate::edit_scope;
use grafsynth_backend_c::{File, FileKind, Options, Package, Style, emit, style_of_header};
use grafsynth_c::tree::types::{Qualified, Type};
use grafsynth_c::tree::{ItemKind, StructId, Symbol, SymbolKind, Unit};
use grafsynth_c::walk::each_item;
use grafsynth_c::{Config, Input, SourceFile, parse};
use grafsynth_ir::Gather;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, FileId, Valid};
use grafsynth_verify::Limits;
use grafsynth_verify::c_code::Induction;
use std::collections::BTreeSet;

/// One text of the edited C.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CText {
    /// The number of the file, for the locations of findings.
    pub file: FileId,
    /// Its name, as in `#include "NAME"`.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// Edited C with what a comparison needs to know about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EditedC {
    /// The package that `build` would emit, with the edited texts in place of its own.
    pub package: Package,
    /// The text as a tree, for a 64-bit host.
    pub unit: Unit,
    /// The functions of the text that a proof does not cover.
    pub beyond: Vec<String>,
    /// Why the instance cannot be read as the state of the chart, if it cannot.
    pub unreadable: Option<String>,
    /// Why the proof would not cover the edit, if it would not.
    outside: Option<String>,
    /// The package as `build` would emit it.
    emitted: Package,
}

/// The style of C that includes the header of an engine.
#[must_use]
pub fn style_of_engine(texts: &[CText]) -> Option<Style> {
    let included: BTreeSet<String> = texts.iter().flat_map(|it| included(&it.text)).gather();
    included.iter().find_map(|name| style_of_header(name))
}

/// The names of the files that a text includes with `#include "NAME"`.
#[must_use]
pub fn included(text: &str) -> BTreeSet<String> {
    // A name in a comment is only one more file that could be read.
    let name = |line: &str| {
        let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("include")?;
        let (name, _) = rest.trim_start().strip_prefix('"')?.split_once('"')?;
        Some(name.to_owned())
    };
    text.lines().filter_map(name).gather()
}

/// The names of the macros that a text defines under some condition.
fn macros(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| {
        let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("define")?;
        let is_name = |it: char| it.is_ascii_alphanumeric() || it == '_';
        rest.trim_start().split(|it| !is_name(it)).next()
    })
}

/// True if a unit has a function with this name.
fn is_function(unit: &Unit, name: &str) -> bool {
    let mut all = unit.symbols.values();
    all.any(|it| it.name == name && matches!(it.kind, SymbolKind::Function(_)))
}

/// True if a text defines the functions of emitted C: `NAME_init` and `NAME_step`, which return nothing. Text that cannot be read is not recognised.
#[must_use]
pub fn is_emitted(texts: &[CText]) -> bool {
    let Ok(unit) = read(texts, &Config::host()) else { return false };
    let functions = defined(&unit);
    let procedure = |name: &str| {
        let mut all = functions.iter();
        all.any(|it| it.name == name && returns_nothing(it))
    };
    functions.iter().any(|function| {
        let prefix = function.name.strip_suffix("_step").filter(|it| !it.is_empty());
        prefix.is_some_and(|it| returns_nothing(function) && procedure(&format!("{it}_init")))
    })
}

fn returns_nothing(function: &Symbol) -> bool {
    function.canonical.ty.as_function().is_some_and(|it| it.result.ty == Type::Void)
}

/// The functions of a unit that have a body.
fn defined(unit: &Unit) -> Vec<&Symbol> {
    let mut all = Vec::new();
    each_item(&unit.items, &mut |item| {
        if let ItemKind::Function { symbol, .. } = &item.kind {
            all.push(&unit.symbols[*symbol]);
        }
    });
    all
}

/// The tree of some texts, of which the first is the C file and the others are those that it may include.
fn read(texts: &[CText], config: &Config) -> Result<Unit, Vec<Diagnostic>> {
    let mut files: Vec<SourceFile> = texts
        .iter()
        .map(|it| SourceFile { file: it.file, name: &it.name, text: &it.text })
        .collect();
    let tables = texts.iter().skip(1).find(|it| it.name.ends_with(TABLES));
    let all = tables.zip(texts.first()).map(|(tables, main)| both(&tables.name, &main.name));
    if let Some(all) = &all {
        files.insert(0, SourceFile { file: FileId(u32::MAX), name: "", text: all });
    }
    let (unit, found) = parse(&Input { files: &files, verbatim: &[], readers: &[], config });
    unit.ok_or(found)
}

/// Prepares edited C for a comparison. Without a map, the text is read as C that `build` emits without options.
///
/// # Errors
/// Findings: the chart cannot be built with the options of the map, or the text is not C that can be read. A wrong map is no error, because a test may answer
/// nevertheless.
pub fn edited(
    net: &Valid<Net>,
    facts: &Facts,
    texts: &[CText],
    options: &Options,
    map: Option<&CMap>,
) -> Result<EditedC, Vec<Diagnostic>> {
    let emitted = emit(net, facts, options)?;
    let unit = read(texts, &Config::host())?;
    let mut package = emitted.clone();
    let main = format!("{}.c", package.stem());
    for (at, text) in texts.iter().enumerate() {
        let name = if at == 0 { &main } else { &text.name };
        match package.files.iter_mut().find(|file| file.name == *name) {
            Some(file) => file.text.clone_from(&text.text),
            None => package.files.push(File {
                name: name.clone(),
                text: text.text.clone(),
                keep_existing: false,
                map: Vec::new(),
                kind: FileKind::Header,
            }),
        }
    }
    let mut unreadable = None;
    match (&mut package.representation, map.map(|map| map.state(net))) {
        // The instance of an image has fixed members.
        (Some(_), Some(Ok(state))) if !emitted.image.is_empty() => {
            if !state.is_empty() {
                unreadable = Some("the map of an image has members".to_owned());
            }
        }
        (Some(hint), Some(Ok(state))) => hint.state = state,
        (_, Some(Err(why))) => unreadable = Some(format!("the map does not fit the chart: {why}")),
        (_, None) | (None, Some(Ok(_))) => {}
    }
    let tables = tables_of(package.stem());
    if !emitted.image.is_empty() && !texts.iter().any(|it| it.name == tables) {
        unreadable = Some(format!("the byte code is missing: there is no `{tables}` beside the C"));
    }
    let outside = {
        let all = texts.iter().map(|it| (it.name.as_str(), it.text.as_str()));
        edit_scope::within(all, &emitted, &package).err()
    };
    // The engine is the same for all charts, so it is no part of the edit.
    let own = texts.iter().enumerate();
    let own = own.filter(|(at, text)| *at == 0 || style_of_header(&text.name).is_some());
    let own: BTreeSet<FileId> = own.map(|(_, text)| text.file).gather();
    let beyond = beyond(&unit, &own, &package);
    Ok(EditedC { package, unit, beyond, unreadable, outside, emitted })
}

/// The functions that a proof of a package does not cover: those that can be called from outside and are not the reset, a reaction, the
/// stop or a query.
fn beyond(unit: &Unit, own: &BTreeSet<FileId>, package: &Package) -> Vec<String> {
    let prefix = package.prefix();
    let mut covered: BTreeSet<String> =
        ["_init", "_step", "_stop"].iter().map(|suffix| format!("{prefix}{suffix}")).gather();
    if let Some(hint) = &package.representation {
        covered.extend(hint.active.iter().map(|(_, name)| name.clone()));
        covered.extend(hint.vars.iter().map(|(_, name)| name.clone()));
        covered.extend(hint.fault.clone());
    }
    let functions = defined(unit);
    // A static function of the C file, or of the header of an engine, can only be called by those that are covered or listed here.
    let callable = functions.iter().filter(|it| {
        let is_static = matches!(it.kind, SymbolKind::Function(kind) if kind.is_static);
        let is_local = is_static && own.contains(&it.span.0.file);
        !is_local && !covered.contains(&it.name)
    });
    callable.map(|it| it.name.clone()).collect()
}

impl EditedC {
    /// Checks that the text declares the interface that `build` would emit. The members of the instance may differ.
    ///
    /// # Errors
    /// The first difference.
    pub fn same_interface(&self) -> Result<(), String> {
        let wanted = unit_of(&self.emitted, &Config::host())?;
        same_interface(&self.package, &wanted, &self.unit)?;
        let prefix = format!("{}_", self.package.prefix());
        // A macro with the name of a function would hide the function from its callers.
        let texts = self.package.files.iter().map(|file| file.text.as_str());
        match texts
            .flat_map(macros)
            .find(|name| is_function(&self.unit, name) && name.starts_with(&prefix))
        {
            Some(name) => Err(format!("a macro hides the function `{name}`")),
            None => Ok(()),
        }
    }

    /// Proves that the text is the net, for every stimulus, on machines whose `int` has 16 or 32 bits.
    ///
    /// # Errors
    /// The reason why there is no proof. The text may be right nevertheless.
    pub fn prove(
        &self,
        net: &Valid<Net>,
        facts: &Facts,
        limits: &Limits,
    ) -> Result<Induction, String> {
        if let Some(why) = &self.unreadable {
            return Err(why.clone());
        }
        if let Some(why) = &self.outside {
            return Err(format!("the edit is outside the scope of the proof: {why}"));
        }
        let mut proved = Induction::default();
        for config in machines() {
            let unit = unit_of(&self.package, &config)?;
            let wanted = unit_of(&self.emitted, &config)?;
            edit_scope::same_items(&wanted, &unit)?;
            same_interface(&self.package, &wanted, &unit)?;
            proved = prove_unit(net, facts, &self.package, &unit, limits)?;
        }
        self.prove_without_hooks(net, facts, limits)?;
        Ok(proved)
    }

    /// Proves that no macro that the user may define is called while the memory is intact: such a macro could do anything. For this proof each of them does
    /// something undefined.
    fn prove_without_hooks(
        &self,
        net: &Valid<Net>,
        facts: &Facts,
        limits: &Limits,
    ) -> Result<(), String> {
        let hooks = self.package.hooks();
        let main = self.package.files.iter().find(|file| file.name.ends_with(".c"));
        let name = |hook: &str| hook.split('(').next().unwrap_or_default().to_owned();
        let is_used = |hook: &&String| main.is_some_and(|file| file.text.contains(&name(hook)));
        let Some(first) = hooks.iter().find(is_used) else { return Ok(()) };
        let with = |config: Config, hook: &String| config.define(hook, "((void)(1 / 0))");
        let unit = unit_of(&self.package, &hooks.iter().fold(Config::host(), with))?;
        prove_unit(net, facts, &self.package, &unit, limits).map(|_| ()).map_err(|_| {
            let first = name(first);
            format!("a macro that you may define, such as `{first}`, may be called although the memory is intact")
        })
    }
}

/// Checks that two units declare the same interface: functions with the same parameters, and structures of inputs and outputs with the same members.
fn same_interface(package: &Package, wanted: &Unit, unit: &Unit) -> Result<(), String> {
    let prefix = package.prefix();
    for suffix in ["_in_t", "_out_t"] {
        let name = format!("{prefix}{suffix}");
        let (wanted, found) = (members(wanted, &name), members(unit, &name));
        if let Some((at, member)) =
            wanted.iter().enumerate().find(|(at, it)| found.get(*at) != Some(it))
        {
            return Err(match found.get(at) {
                Some(found) => format!("`{name}` has `{found}` where the chart needs `{member}`"),
                None => format!("`{name}` lacks `{member}`, which the chart needs"),
            });
        }
        if let Some(member) = found.get(wanted.len()) {
            return Err(format!("`{name}` has `{member}`, which the chart does not have"));
        }
    }
    let hint = package.representation.as_ref();
    let names = hint.into_iter().flat_map(|hint| {
        let active = hint.active.iter().map(|(_, name)| name);
        active.chain(hint.vars.iter().map(|(_, name)| name)).chain(&hint.fault)
    });
    let names =
        names.cloned().chain(["_init", "_step", "_stop"].map(|suffix| format!("{prefix}{suffix}")));
    for name in names {
        let function = |unit: &Unit| {
            let symbol = unit.symbols.values().find(|symbol| {
                symbol.name == name && matches!(symbol.kind, SymbolKind::Function(_))
            });
            symbol.map(|symbol| {
                let is_static = matches!(symbol.kind, SymbolKind::Function(it) if it.is_static);
                (is_static, shape(unit, &symbol.canonical))
            })
        };
        match (function(wanted), function(unit)) {
            (wanted, found) if wanted == found => {}
            (_, None) => return Err(format!("the text has no function `{name}`")),
            _ => {
                return Err(format!(
                    "the parameters or the result of `{name}` differ from those that `build` emits"
                ));
            }
        }
    }
    Ok(())
}

/// The members of a structure with this name, with their types.
fn members(unit: &Unit, name: &str) -> Vec<String> {
    let is_it =
        |symbol: &&Symbol| symbol.name == name && matches!(symbol.kind, SymbolKind::Typedef);
    let symbol = unit.symbols.values().find(is_it);
    let Some(id) = symbol.and_then(|it| it.canonical.ty.as_struct()) else { return Vec::new() };
    let member = |it: &grafsynth_c::tree::Member| {
        let bits = if it.is_bit { " : 1" } else { "" };
        format!("{} {}{bits}", shape(unit, &it.canonical), it.name)
    };
    unit.structs[id].members.iter().map(member).collect()
}

/// A type as text, the same in every unit with the same declarations.
fn shape(unit: &Unit, ty: &Qualified) -> String {
    let mut text = String::new();
    for (is_set, word) in [
        (ty.qualifiers.is_const, "const "),
        (ty.qualifiers.is_volatile, "volatile "),
        (ty.qualifiers.is_restrict, "restrict "),
    ] {
        text += if is_set { word } else { "" };
    }
    text + &match &ty.ty {
        Type::Void => "void".to_owned(),
        Type::Int(kind) => kind.name().to_owned(),
        Type::Enum(_) => unit.integer(&ty.ty).map_or("enum", |kind| kind.name()).to_owned(),
        Type::Struct(id) => struct_name(unit, *id),
        Type::Pointer(target) => format!("{} *", shape(unit, target)),
        Type::Array(element, len) => {
            let len = len.map_or(String::new(), |len| len.to_string());
            format!("{} [{len}]", shape(unit, element))
        }
        Type::Function(function) => {
            let params: Vec<String> = function.params.iter().map(|it| shape(unit, it)).collect();
            format!("{} ({})", shape(unit, &function.result), params.join(", "))
        }
        Type::Named(id) => unit.symbols[*id].name.clone(),
    }
}

fn struct_name(unit: &Unit, id: StructId) -> String {
    let is_it = |symbol: &&Symbol| {
        matches!(symbol.kind, SymbolKind::Typedef) && symbol.canonical.ty == Type::Struct(id)
    };
    let named = unit.symbols.values().find(is_it).map(|symbol| symbol.name.clone());
    named.or_else(|| unit.structs[id].tag.clone()).unwrap_or_else(|| "struct".to_owned())
}
