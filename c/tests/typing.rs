//! The types and constants of texts, for both widths of `int`.

use crate::{code, good};
use grafsynth_c::tree::types::{IntKind, Type};
use grafsynth_c::tree::{ExprKind, Init, ItemKind, StmtKind, SymbolKind, Unit};
use grafsynth_c::{Config, Input, SourceFile, parse, print};
use grafsynth_ir::FileId;

const HEAD: &str = "#include <stdint.h>\n#include <stdbool.h>\n#include <limits.h>\n";

/// The type of an expression whose operands are `u8`, `u16`, `i32` and so on.
fn type_of(expr: &str, config: &Config) -> Type {
    let text = format!(
        "{HEAD}int f(uint8_t u8, int8_t i8, uint16_t u16, int16_t i16, uint32_t u32, int32_t i32, \
         uint64_t u64, int64_t i64, bool b) {{ ({expr}); return 0; }}"
    );
    let unit = good(&text, config);
    let last = unit.items.last().expect("a function");
    let ItemKind::Function { body, .. } = &last.kind else { panic!("{last:?}") };
    let first = body.first().expect("a statement");
    let StmtKind::Expr(value) = &first.kind else { panic!("{first:?}") };
    value.ty.clone()
}

#[test]
fn operands_are_promoted_and_balanced_for_each_width_of_int() {
    let (host, avr) = (Config::host(), Config::avr());
    let cases = [
        ("u8 + u8", IntKind::Int, IntKind::Int),
        ("u16 + u16", IntKind::Int, IntKind::UInt),
        ("u16 + 1", IntKind::Int, IntKind::UInt),
        ("-u16", IntKind::Int, IntKind::UInt),
        ("i16 + u16", IntKind::Int, IntKind::UInt),
        ("i32 + u16", IntKind::Int, IntKind::Long),
        ("u32 + i32", IntKind::UInt, IntKind::ULong),
        ("i64 + u32", IntKind::Long, IntKind::LLong),
        ("u64 + i64", IntKind::ULong, IntKind::ULLong),
        ("b + b", IntKind::Int, IntKind::Int),
        ("u32 << u64", IntKind::UInt, IntKind::ULong),
        ("u8 << 1", IntKind::Int, IntKind::Int),
        ("i64 == u64", IntKind::Int, IntKind::Int),
        ("b ? u8 : u32", IntKind::UInt, IntKind::ULong),
        ("40000", IntKind::Int, IntKind::Long),
        ("0x9000", IntKind::Int, IntKind::UInt),
        ("40000U", IntKind::UInt, IntKind::UInt),
        ("4294967296", IntKind::Long, IntKind::LLong),
        ("INT32_C(5)", IntKind::Int, IntKind::Long),
        ("UINT16_C(5)", IntKind::Int, IntKind::UInt),
        ("INT32_MAX", IntKind::Int, IntKind::Long),
        ("true", IntKind::Int, IntKind::Int),
        ("'a'", IntKind::Int, IntKind::Int),
        ("sizeof(u8)", IntKind::ULong, IntKind::UInt),
        ("u8 = i64", IntKind::UChar, IntKind::UChar),
        ("(uint16_t)i32", IntKind::UShort, IntKind::UInt),
    ];
    for (expr, on_host, on_avr) in cases {
        assert_eq!(type_of(expr, &host), Type::Int(on_host), "{expr} on the host");
        assert_eq!(type_of(expr, &avr), Type::Int(on_avr), "{expr} on the AVR");
    }
    assert_eq!(type_of("u16 + 1", &Config::sdcc()), Type::Int(IntKind::UInt));
}

fn constant(unit: &Unit, name: &str) -> i128 {
    let mut found = unit.symbols.iter().filter(|(_, symbol)| symbol.name == name);
    let (_, symbol) = found.next().expect("the constant");
    let SymbolKind::Constant(value) = symbol.kind else { panic!("{symbol:?}") };
    value
}

#[test]
fn constants_are_computed_in_the_width_of_their_type() {
    let value = |expr: &str, config: &Config| {
        constant(&good(&format!("{HEAD}enum {{ A = {expr} }};"), config), "A")
    };
    for (expr, on_host, on_avr) in [
        ("(uint8_t)300", 44, 44),
        ("(int8_t)200", -56, -56),
        ("(0U - 1U) == 0xFFFFU", 0, 1),
        ("~0 == -1", 1, 1),
        ("-7 / 2", -3, -3),
        ("-7 % 2", -1, -1),
        ("1 ? 2 : 1 / 0", 2, 2),
        ("0 && 1 / 0", 0, 0),
        ("-8 >> 1", -4, -4),
        ("(bool)256", 1, 1),
        ("sizeof(int) == 2", 0, 1),
        ("INT_MAX == 32767", 0, 1),
        ("(signed char)-1 < 0U", 0, 0),
        ("'\\n'", 10, 10),
        ("0xFFFFFFFFFFFFFFFFU * 0xFFFFFFFFFFFFFFFFU == 1", 1, 1),
    ] {
        assert_eq!(value(expr, &Config::host()), on_host, "{expr} on the host");
        assert_eq!(value(expr, &Config::avr()), on_avr, "{expr} on the AVR");
    }
    // Overflow and shifts by too many bits are undefined, so they have no value.
    for expr in ["INT_MAX + 1", "1 / 0", "1 << 16", "-1 << 1"] {
        assert_eq!(
            code(&format!("{HEAD}enum {{ A = {expr} }};"), &Config::avr()),
            "G0642",
            "{expr}"
        );
    }
}

#[test]
fn sizes_depend_on_the_machine() {
    let text = "#include <stdint.h>\n#include <stdbool.h>\n\
        typedef struct { uint8_t a; uint32_t b; bool c : 1; bool d : 1; uint16_t *p; } t;\n\
        enum { A = sizeof(t), B = sizeof(t [3]), C = sizeof(int (*)(void)) };";
    let sizes = |config: &Config| {
        let unit = good(text, config);
        ["A", "B", "C"].map(|name| constant(&unit, name))
    };
    assert_eq!(sizes(&Config::host()), [24, 72, 8]);
    assert_eq!(sizes(&Config::avr()), [8, 24, 2]);
    assert_eq!(sizes(&Config::sdcc()), [9, 27, 2]);
}

#[test]
fn initialisers_have_all_braces_and_positions() {
    let text = "typedef struct { int a[2]; struct point { int x, y; } *p; } t;";
    assert_eq!(code(text, &Config::host()), "G0640", "structures are not nested");
    let text = "struct point { int x, y; };\n\
        struct line { struct point from, to; int tags[2]; };\n\
        static const struct line lines[] = { { 1, 2, { 3 }, 5, 6 }, [2] = { .tags = { [1] = 7 } } };\n";
    let unit = good(text, &Config::host());
    let printed = print(&unit);
    let rows =
        "lines[3] = {\n    { { 1, 2 }, { 3 }, { 5, 6 } },\n    [2] = { .tags = { [1] = 7 } },\n};";
    assert!(printed.contains(rows), "{printed}");
    let item = unit.items.last().expect("an object");
    assert!(
        matches!(&item.kind, ItemKind::Object { init: Some(Init::Parts(parts)), .. } if parts.len() == 2)
    );
}

#[test]
fn implicit_conversions_are_nodes() {
    let unit =
        good("#include <stdint.h>\nvoid f(uint8_t *p, uint16_t n) { p[1] = n; }", &Config::host());
    let Some(ItemKind::Function { body, .. }) = unit.items.last().map(|item| &item.kind) else {
        panic!("{unit:#?}")
    };
    let StmtKind::Expr(assign) = &body[0].kind else { panic!("{body:?}") };
    let ExprKind::Assign(place, value) = &assign.kind else { panic!("{assign:?}") };
    assert_eq!(place.ty, Type::Int(IntKind::UChar));
    let ExprKind::Convert(inner) = &value.kind else { panic!("{value:?}") };
    assert!(matches!(inner.kind, ExprKind::Read(_)));
    assert_eq!(inner.ty, Type::Int(IntKind::UShort));
}

#[test]
fn constraints_are_checked() {
    let cases = [
        ("int f(const int *p) { *p = 1; return 0; }", "G0642"),
        ("typedef struct { const int n; } t; void f(t *a, t *b) { *a = *b; }", "G0642"),
        ("int f(int *p, const int *q) { p = q; return 0; }", "G0642"),
        ("int f(int *p) { return p; }", "G0642"),
        ("int f(int a) { return a.b; }", "G0642"),
        ("int f(int a) { return f(a, a); }", "G0642"),
        ("int f(int a) { return g(a); }", "G0642"),
        ("int f(int a) { 1 = a; return 0; }", "G0642"),
        ("int f(int a) { int a; return 0; }", "G0642"),
        ("int f(int a) { switch (a) { case 1: case 1: break; } return 0; }", "G0642"),
        ("int f(int a) { break; }", "G0640"),
        ("void f(void) { return 1; }", "G0642"),
        ("int a; long a;", "G0642"),
        ("int f(void); int f(int a);", "G0642"),
        ("int a[0];", "G0642"),
        ("struct s; struct s a;", "G0642"),
        ("int a = f;", "G0642"),
        ("int f(); ", "G0640"),
        ("int n; int m = n;", "G0642"),
        ("float a;", "G0640"),
        ("int a = 1.5;", "G0640"),
        ("int f(int a) { goto end; end: return 0; }", "G0640"),
        ("int f(int n) { int a[n]; return 0; }", "G0642"),
        ("struct { unsigned a : 3; } s;", "G0640"),
        ("union u { int a; };", "G0640"),
        ("int f(int a) { switch (a) { a = 1; case 2: break; } return a; }", "G0640"),
        ("int f(int a) { while (a) { case 1: a = 0; } return a; }", "G0640"),
        ("char *s = \"text\";", "G0640"),
        ("int a = 'ab';", "G0640"),
        ("int a??(1??);", "G0640"),
        (
            "#include <stdbool.h>\ntypedef struct { bool b : 1; } t; void f(t *s) { bool *p = &s->b; (void)p; }",
            "G0642",
        ),
    ];
    for (text, wanted) in cases {
        assert_eq!(code(text, &Config::host()), wanted, "{text}");
    }
}

#[test]
fn several_errors_are_reported() {
    let text = "void f(void) { a = 1; }\nvoid g(void) { b(); }\nint c(int x) { return x; }\n";
    let (_, found) = crate::read(text, &Config::host());
    assert_eq!(found.len(), 2, "{found:?}");
}

#[test]
fn a_structure_is_constant_if_all_of_it_is() {
    let text = "struct all { const int x; const int y[2]; int *const z; };
        struct some { const int x; int y; };
        struct target { const int *x; };
        struct nested { struct all a; const struct some b; };
        struct mixed { const struct all a; struct some b; };";
    let unit = good(text, &Config::host());
    let found: Vec<(&str, bool, bool)> = unit
        .structs
        .values()
        .map(|it| (it.tag.as_deref().expect("a tag"), it.has_const, it.is_const))
        .collect();
    let wanted = [
        ("all", true, true),
        ("some", true, false),
        ("target", false, false),
        ("nested", true, true),
        ("mixed", true, false),
    ];
    assert_eq!(found, wanted);
}

#[test]
fn a_standard_header_is_never_a_file_of_the_project() {
    let local = "int from_file;";
    for (line, is_read) in [("#include \"own.h\"", true), ("#include <own.h>", false)] {
        let text = format!("{line}\n");
        let files = [("test.c", text.as_str()), ("own.h", local)].map(|(name, text)| SourceFile {
            file: FileId(0),
            name,
            text,
        });
        let config = &Config::host();
        let (unit, found) = parse(&Input { files: &files, verbatim: &[], readers: &[], config });
        assert_eq!(unit.is_some(), is_read, "{found:?}");
    }
}
