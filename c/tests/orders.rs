//! Expressions that depend on the order of evaluation, and others that do not.

use crate::{code, good};
use grafsynth_c::{Config, Input, SourceFile, parse};
use grafsynth_ir::FileId;

const HEAD: &str = "#include <stdint.h>\n\
    typedef struct { uint8_t a; uint8_t b; int32_t n; uint8_t row[4]; } t;\n\
    static int32_t twice(int32_t x) { return x + x; }\n\
    static int32_t count(const t *s) { return s->n; }\n\
    static int32_t bump(t *s) { s->n += 1; return s->n; }\n\
    static void split(int32_t x, int32_t *low) { *low = x % 10; }\n\
    static int32_t digit(int32_t x) { int32_t low; split(x, &low); return low; }\n\
    int32_t unknown(int32_t x);\n";

fn body(statement: &str) -> String {
    format!("{HEAD}void f(t *s, t *r, int32_t i, uint8_t *p) {{ {statement} }}")
}

#[test]
fn unsequenced_effects_are_errors() {
    for statement in [
        "i = i++;",
        "s->row[i] = (uint8_t)i++;",
        "i = i++ + 1;",
        "i = (i = 1) + (i = 2);",
        "s->n = s->n++ + r->n;",
        "s->n = s->n + r->n++;",
        "i = bump(s) + s->n;",
        "i = bump(s) + bump(r);",
        "i = bump(s) + count(r);",
        "i = unknown(1) + unknown(2);",
        "s->n += bump(r);",
        "i = twice(i++) + i;",
        "*p = p[0]++;",
        "t a[2] = { { .n = i++ }, { .n = i++ } }; (void)a;",
        "s->row[s->a] = (uint8_t)(s->row[1]++ + 1);",
    ] {
        assert_eq!(code(&body(statement), &Config::host()), "G0643", "{statement}");
    }
}

#[test]
fn functions_that_are_known_to_write_nothing_may_be_called_in_any_order() {
    let text = body("i = unknown(1) + unknown(2) + s->n;");
    let file = FileId(0);
    let files = [SourceFile { file, name: "test.c", text: &text }];
    let config = Config::host();
    let input = Input { files: &files, verbatim: &[], readers: &["unknown"], config: &config };
    assert!(parse(&input).0.is_some());
    assert!(parse(&Input { readers: &["other"], ..input }).0.is_none());
}

#[test]
fn sequenced_effects_are_not() {
    for statement in [
        "i = i + 1;",
        "i = s->row[i];",
        "s->row[i] = (uint8_t)i;",
        "*p++ = 1;",
        "*p++ = *p_of;",
        "s->a = r->b++;",
        "s->row[0] = s->row[1]++;",
        "if (i++ && i) { i = 0; }",
        "s->n = (i++, i);",
        "i = i ? bump(s) : bump(r);",
        "i = twice(i) + twice(i + 1);",
        "i = twice(i) + bump(s);",
        "i = digit(i) + digit(i + 1) * twice(3);",
        "s->n = bump(s);",
        "t own = *s; s->n = bump(&own);",
        "i = bump(s) + i;",
        "i = count(s) + s->n;",
        "if (unknown(1) != 0 && unknown(2) != 0) { i = 0; }",
    ] {
        let statement = statement.replace("*p_of", "2");
        good(&body(&statement), &Config::host());
    }
}
