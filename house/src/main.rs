//! Measures the structure of the sources: `scripts/house` prints each figure with its bound, and fails if a figure exceeds its bound.
//!
//! - **Code lines**: lines with at least one token, without comments, doc comments and tests (`tests` folders and files, items under `#[cfg(test)]`).
//! - **Long functions**: functions of more than [`LONG`] lines, from the signature to the closing brace.
//! - **Circles**: sets of files of one crate that name each other's items. Two things do not count: items of a file's own parents, and re-exported items of its
//!   children.
//! - **Listed variants**: lines that begin with `| Type::Variant`. They are acceptable if a forgotten variant would make the output wrong.
//! - **Text tests on C**: tests of the C back end on text, such as `starts_with("switch")`, that should be queries on data.

#![allow(
    clippy::disallowed_methods,
    clippy::exit,
    clippy::print_stdout,
    clippy::print_stderr,
    clippy::wildcard_enum_match_arm,
    reason = "a program that reads the sources and prints figures"
)]

use itertools::Itertools;
use petgraph::algo::tarjan_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use proc_macro2::{TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// The crates whose sources are measured; the crate of the tests is not.
const CRATES: [&str; 15] = [
    "ir",
    "logic",
    "frontend",
    "sim",
    "split",
    "verify",
    "c",
    "backend-c",
    "backend-pld",
    "backend-template",
    "draw",
    "page",
    "driver",
    "engines",
    "cli",
];
/// The maximum number of lines of a function that does not count as long.
const LONG: usize = 80;

/// The bounds of the figures. Lower them with the figures; raise one only with a reason in the commit.
const BOUNDS: [(&str, usize); 9] = [
    ("code lines of frontend", 36_920),
    ("code lines of c and backend-c", 29_470),
    ("code lines of ir", 21_150),
    ("code lines of driver", 14_620),
    ("code lines of all crates", 193_450),
    ("functions above 80 lines", 16),
    ("dependency cycles of files", 0),
    ("lines that list variants", 606),
    ("text tests on emitted C", 3),
];

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let crates: Vec<Measured> = CRATES
        .iter()
        .filter(|name| root.join(name).join("src").is_dir())
        .map(|name| Measured::of(name, &root.join(name).join("src")))
        .collect();
    let lines = |names: &[&str]| -> usize {
        crates.iter().filter(|one| names.contains(&one.name)).map(|one| one.n_lines).sum()
    };
    for one in &crates {
        println!("{:>7} code lines of {}", one.n_lines, one.name);
    }
    let details = std::env::args().any(|argument| argument == "--details");
    let long: Vec<String> = crates.iter().flat_map(|one| one.long.clone()).sorted().collect();
    let circles: Vec<String> = crates.iter().flat_map(Measured::circles).collect();
    let text_tests: Vec<String> = (crates.iter().filter(|one| one.name == "backend-c"))
        .flat_map(|one| one.text_tests.clone())
        .collect();
    if details {
        for (title, all) in
            [("long function", &long), ("circle", &circles), ("text test", &text_tests)]
        {
            all.iter().for_each(|one| println!("{title}: {one}"));
        }
    }
    let figures = [
        lines(&["frontend"]),
        lines(&["c", "backend-c"]),
        lines(&["ir"]),
        lines(&["driver"]),
        lines(&CRATES),
        long.len(),
        circles.len(),
        crates.iter().map(|one| one.n_listed).sum(),
        text_tests.len(),
    ];
    let mut is_beyond = false;
    for ((name, bound), figure) in BOUNDS.into_iter().zip(figures) {
        let verdict = if figure > bound { "BEYOND" } else { "at most" };
        is_beyond |= figure > bound;
        println!("{figure:>7} {name} ({verdict} {bound})");
    }
    if is_beyond {
        eprintln!("a figure is beyond its bound: scripts/house --details lists the places");
        std::process::exit(1);
    }
}

/// The measurements of a crate.
struct Measured {
    name: &'static str,
    /// The code lines of all its files.
    n_lines: usize,
    /// Long functions with their location and length.
    long: Vec<String>,
    n_listed: usize,
    text_tests: Vec<String>,
    /// The files of the modules, by their path in the crate.
    modules: BTreeMap<Vec<String>, String>,
    /// Paths that each module names, absolute in the crate.
    names: BTreeMap<Vec<String>, BTreeSet<Vec<String>>>,
}

impl Measured {
    fn of(name: &'static str, folder: &Path) -> Self {
        let mut measured = Measured {
            name,
            n_lines: 0,
            long: Vec::new(),
            n_listed: 0,
            text_tests: Vec::new(),
            modules: BTreeMap::new(),
            names: BTreeMap::new(),
        };
        let root = ["lib.rs", "main.rs"].map(|file| folder.join(file));
        if let Some(root) = root.into_iter().find(|file| file.is_file()) {
            measured.file(&root, folder, Vec::new());
        }
        measured
    }

    /// Measures a file and the files of its modules, which are below `folder`.
    fn file(&mut self, path: &Path, folder: &Path, module: Vec<String>) {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) => panic!("{}: {error}", path.display()),
        };
        let file = match syn::parse_file(&text) {
            Ok(file) => file,
            Err(error) => panic!("{}: {error}", path.display()),
        };
        let shown =
            format!("{}/src/{}", self.name, path.strip_prefix(folder).unwrap_or(path).display());
        let mut items = Items { shown: &shown, ..Items::default() };
        let mut lines = BTreeSet::new();
        for item in file.items.iter().filter(|item| !is_test(item_attributes(item))) {
            lines_of(quote::ToTokens::to_token_stream(item), &mut lines);
            items.visit_item(item);
        }
        // Items in blocks and implementations that are for tests.
        lines.retain(|line| !items.test_lines.contains(line));
        self.long.append(&mut items.long);
        let source: Vec<&str> = text.lines().collect();
        for line in &lines {
            let line = source.get(line - 1).copied().unwrap_or("").trim_start();
            self.n_listed += usize::from(lists_variant(line));
            if TEXT_TESTS.iter().any(|test| line.contains(test)) {
                self.text_tests.push(format!("{shown}: {line}"));
            }
        }
        self.n_lines += lines.len();
        self.names.insert(module.clone(), items.absolute(&module));
        self.modules.insert(module.clone(), shown.clone());
        for child in items.children {
            let name = child.to_string();
            let here = module.iter().fold(folder.to_owned(), |at, part| at.join(part));
            let candidates = [here.join(format!("{name}.rs")), here.join(&name).join("mod.rs")];
            if let Some(path) = candidates.into_iter().find(|path| path.is_file()) {
                self.file(&path, folder, [module.as_slice(), &[name]].concat());
            }
        }
    }

    /// The sets of files that name each other's items, each as one line.
    fn circles(&self) -> Vec<String> {
        let mut graph = DiGraph::new();
        let nodes: BTreeMap<&Vec<String>, NodeIndex> =
            self.modules.keys().map(|module| (module, graph.add_node(module))).collect();
        for (module, names) in &self.names {
            for name in names {
                // The longest prefix of the path that is a module.
                let target = (0..=name.len()).rev().find_map(|n| nodes.get(&name[..n].to_vec()));
                if let (Some(&from), Some(&to)) = (nodes.get(module), target)
                    && !module.starts_with(graph[to])
                {
                    graph.update_edge(from, to, ());
                }
            }
        }
        tarjan_scc(&graph)
            .into_iter()
            .filter(|set| set.len() > 1)
            .map(|set| {
                let ties = graph.edge_indices().filter_map(|edge| {
                    let (from, to) = graph.edge_endpoints(edge)?;
                    let is_inside = set.contains(&from) && set.contains(&to);
                    is_inside.then(|| {
                        format!("{} -> {}", self.modules[graph[from]], graph[to].join("::"))
                    })
                });
                format!("{} files: {}", set.len(), ties.sorted().join(", "))
            })
            .collect()
    }
}

/// Tests on text that should be queries on data.
const TEXT_TESTS: [&str; 6] = [
    ".starts_with(\"",
    ".ends_with(\"",
    ".contains(\"",
    ".replace(\"",
    ".strip_prefix(\"",
    ".strip_suffix(\"",
];

/// A line such as `| ExprKind::Bool(_)`.
fn lists_variant(line: &str) -> bool {
    let Some(rest) = line.strip_prefix("| ") else { return false };
    let name: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    name.starts_with(|c: char| c.is_uppercase()) && rest[name.len()..].starts_with("::")
}

/// The attributes of an item.
fn item_attributes(item: &syn::Item) -> &[syn::Attribute] {
    match item {
        syn::Item::Const(it) => &it.attrs,
        syn::Item::Enum(it) => &it.attrs,
        syn::Item::Fn(it) => &it.attrs,
        syn::Item::Impl(it) => &it.attrs,
        syn::Item::Macro(it) => &it.attrs,
        syn::Item::Mod(it) => &it.attrs,
        syn::Item::Static(it) => &it.attrs,
        syn::Item::Struct(it) => &it.attrs,
        syn::Item::Trait(it) => &it.attrs,
        syn::Item::Type(it) => &it.attrs,
        syn::Item::Use(it) => &it.attrs,
        _ => &[],
    }
}

/// True for `#[cfg(test)]` and `#[test]`.
fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let is_cfg = attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Path>().is_ok_and(|path| path.is_ident("test"));
        is_cfg || attribute.path().is_ident("test")
    })
}

/// Adds the lines of the tokens, without those of doc comments.
fn lines_of(tokens: TokenStream, lines: &mut BTreeSet<usize>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        // `#[doc = ".."]` and `#![doc = ".."]` are comments.
        let group = match tokens.get(at + 1) {
            Some(TokenTree::Punct(mark)) if mark.as_char() == '!' => tokens.get(at + 2),
            other => other,
        };
        if matches!(token, TokenTree::Punct(mark) if mark.as_char() == '#')
            && let Some(TokenTree::Group(group)) = group
            && matches!(group.stream().into_iter().next(), Some(TokenTree::Ident(word)) if word == "doc")
        {
            at += if matches!(tokens.get(at + 1), Some(TokenTree::Punct(_))) { 3 } else { 2 };
            continue;
        }
        match token {
            TokenTree::Group(group) => {
                lines.insert(group.span_open().start().line);
                lines_of(group.stream(), lines);
                lines.insert(group.span_close().end().line);
            }
            other => lines.extend(other.span().start().line..=other.span().end().line),
        }
        at += 1;
    }
}

/// The contents of the items of a file.
#[derive(Default)]
struct Items<'a> {
    shown: &'a str,
    long: Vec<String>,
    children: Vec<syn::Ident>,
    /// The paths in `use` declarations and in code, as written.
    paths: Vec<Vec<String>>,
    test_lines: BTreeSet<usize>,
}

impl Items<'_> {
    fn measure(&mut self, name: &syn::Ident, span: proc_macro2::Span) {
        let n_lines = span.end().line - span.start().line + 1;
        if n_lines > LONG {
            self.long.push(format!("{n_lines} lines: {}:{} {name}", self.shown, span.start().line));
        }
    }

    /// The paths below the crate, from its root.
    fn absolute(&self, module: &[String]) -> BTreeSet<Vec<String>> {
        let children: BTreeSet<String> = self.children.iter().map(ToString::to_string).collect();
        let absolute = |path: &Vec<String>| -> Option<Vec<String>> {
            let first = path.first()?;
            let mut at = match first.as_str() {
                "crate" => Vec::new(),
                "self" => module.to_vec(),
                "super" => module[..module.len().checked_sub(1)?].to_vec(),
                _ if children.contains(first) => [module, std::slice::from_ref(first)].concat(),
                _ => return None,
            };
            for part in &path[1..] {
                if part == "super" {
                    at.pop();
                } else {
                    at.push(part.clone());
                }
            }
            Some(at)
        };
        self.paths.iter().filter_map(absolute).collect()
    }

    fn tree(&mut self, tree: &syn::UseTree, before: &[String]) {
        match tree {
            syn::UseTree::Path(path) => {
                let before = [before, &[path.ident.to_string()]].concat();
                self.tree(&path.tree, &before);
            }
            syn::UseTree::Name(name) => {
                self.paths.push([before, &[name.ident.to_string()]].concat());
            }
            syn::UseTree::Rename(name) => {
                self.paths.push([before, &[name.ident.to_string()]].concat());
            }
            syn::UseTree::Glob(_) => self.paths.push(before.to_vec()),
            syn::UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.tree(tree, before));
            }
        }
    }
}

impl<'ast> Visit<'ast> for Items<'_> {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        if is_test(item_attributes(item)) {
            lines_of(quote::ToTokens::to_token_stream(item), &mut self.test_lines);
            return;
        }
        visit::visit_item(self, item);
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.measure(
            &item.sig.ident,
            item.sig.span().join(item.block.span()).unwrap_or(item.block.span()),
        );
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        if is_test(&item.attrs) {
            lines_of(quote::ToTokens::to_token_stream(item), &mut self.test_lines);
            return;
        }
        self.measure(
            &item.sig.ident,
            item.sig.span().join(item.block.span()).unwrap_or(item.block.span()),
        );
        visit::visit_impl_item_fn(self, item);
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if item.content.is_none() {
            self.children.push(item.ident.clone());
        }
        visit::visit_item_mod(self, item);
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        // A re-export of a child's items does not count.
        if matches!(item.vis, syn::Visibility::Inherited) {
            self.tree(&item.tree, &[]);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.segments.len() > 1 {
            self.paths.push(path.segments.iter().map(|part| part.ident.to_string()).collect());
        }
        visit::visit_path(self, path);
    }
}
