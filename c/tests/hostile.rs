//! Texts that would crash a reader if nesting and expansion were not bounded. They must be read with a small stack, and in time proportional to their size.

use crate::{code, good, read};
use grafsynth_c::{Config, print};

/// Runs `work` in a thread whose stack is as large as that of a test.
fn with_small_stack(work: impl FnOnce() + Send + 'static) {
    let thread = std::thread::Builder::new().stack_size(2 << 20).spawn(work).expect("a thread");
    thread.join().expect("no panic");
}

fn in_function(text: &str) -> String {
    format!("int f(int a, int *p) {{ {text} }}")
}

#[test]
fn nesting_is_bounded() {
    with_small_stack(|| {
        let deep = |open: &str, close: &str, n: usize| open.repeat(n) + "a" + &close.repeat(n);
        for (open, close) in [
            ("(", ")"),
            ("-", ""),
            ("!(", ")"),
            ("a ? a : ", ""),
            ("a ? (", ") : a"),
            ("a = ", ""),
            ("p[", "]"),
            ("f(", ", p)"),
            ("(int)", ""),
            ("*&", ""),
            ("sizeof ", ""),
            ("a || (", ")"),
            ("a + (", ")"),
            ("a || a && a | a ^ a & a == a < a << a + a * (", ")"),
        ] {
            let text = in_function(&format!("return {};", deep(open, close, 100_000)));
            eprintln!("{open}");
            assert_eq!(code(&text, &Config::host()), "G0644", "{open}");
        }
        for text in [
            in_function(&"{".repeat(100_000)),
            in_function(&"if (a) ".repeat(100_000)),
            in_function(&"while (a) do for (;;) ".repeat(100_000)),
            in_function(&"switch (a) { case 1: ".repeat(100_000)),
            format!("int {}a;", "*".repeat(100_000)),
            format!("int {}a{};", "(".repeat(100_000), ")".repeat(100_000)),
            format!("int a{};", "[2]".repeat(100_000)),
            format!("int a(int {}", "(*b)(int ".repeat(100_000)),
            format!("int a = {}1;", "{".repeat(100_000)),
            in_function(&format!("return a{};", " + a".repeat(100_000))),
            in_function(&format!("return a{};", ", a".repeat(100_000))),
        ] {
            assert_eq!(code(&text, &Config::host()), "G0644", "{}", &text[..60]);
        }
    });
}

#[test]
fn a_tree_at_the_limits_can_be_used() {
    with_small_stack(|| {
        for text in [
            in_function(&format!("return {}a{};", "-(".repeat(110), ")".repeat(110))),
            in_function(&format!("return a{};", " + a".repeat(900))),
            in_function(&format!("return a{};", " || a".repeat(100_000))),
            in_function(&format!("{}{} return 0;", "if (a) {".repeat(200), "}".repeat(200))),
            in_function(&format!(
                "if (a) {{ }} {} return 0;",
                "else if (a) { a = 1; }".repeat(20_000)
            )),
        ] {
            let unit = good(&text, &Config::host());
            assert!(good(&print(&unit), &Config::host()) == unit);
            assert_eq!(unit.clone(), unit);
        }
    });
}

#[test]
fn long_texts_take_proportional_time() {
    with_small_stack(|| {
        let many = |part: &str| part.repeat(20_000);
        good(&format!("int f(int a) {{ {} return a; }}", many("a += 1; ")), &Config::host());
        good(&format!("int t[] = {{ {} }};", many("1, ")), &Config::host());
        let chain: String = (1..5_000).map(|n| format!("typedef t{} t{n};\n", n - 1)).collect();
        good(&format!("typedef int t0;\n{chain}"), &Config::host());
        let structs: String =
            (1..5_000).map(|n| format!("struct s{n} {{ struct s{} a; }};\n", n - 1)).collect();
        let text = format!("struct s0 {{ int a; }};\n{structs}");
        assert_eq!(code(&text, &Config::host()), "G0644");
        let doubled: String = (1..250)
            .map(|n| format!("struct s{n} {{ struct s{m} a; char b[{n}]; }};\n", m = n - 1))
            .collect();
        let text = format!("struct s0 {{ int a; }};\n{doubled}");
        good(&text, &Config::host());
        good(&format!("{text}struct s240 x = {{ 1 }};"), &Config::host());
        let functions: String =
            (1..5_000).map(|n| format!("void f{n}(void) {{ f{}(); }}\n", n - 1)).collect();
        good(&format!("void f0(void) {{ }}\n{functions}"), &Config::host());
        let writes: String = many("p[a++] + ");
        assert_eq!(code(&in_function(&format!("return {writes}0;")), &Config::host()), "G0644");
    });
}

#[test]
fn expansion_is_bounded() {
    with_small_stack(|| {
        let doubling: String =
            (1..60).map(|n| format!("#define M{n} M{m} M{m}\n", m = n - 1)).collect();
        let cases = [
            (format!("#define M0 1\n{doubling}int a = M59;"), "G0644"),
            (format!("#define D(x) x x\nint a = {}1{};", "D(".repeat(50), ")".repeat(50)), "G0644"),
            (
                format!("#define I(x) x\nint a = {}1{};", "I(".repeat(1_000), ")".repeat(1_000)),
                "G0644",
            ),
            ("#define A A\nint b = A;".to_owned(), "G0642"),
            ("#define A B\n#define B A\nint b = A;".to_owned(), "G0642"),
            ("#include \"test.c\"\n".to_owned(), "G0641"),
            ("#if 1\n".repeat(10_000), "G0641"),
            ("#define F(x) x\nint a = F(1;".to_owned(), "G0641"),
            ("#define F(x) x\nint a = F(1, 2);".to_owned(), "G0641"),
            ("#define A 1\n#define A 2\n".to_owned(), "G0641"),
            ("#if 1 +\n#endif\n".to_owned(), "G0641"),
            ("#endif\n".to_owned(), "G0641"),
            ("#else\n".to_owned(), "G0641"),
            ("#error stop\n".to_owned(), "G0641"),
            ("#include <math.h>\n".to_owned(), "G0641"),
            ("#define J(a, b) a ## b\n".to_owned(), "G0641"),
        ];
        for (text, wanted) in cases {
            assert_eq!(code(&text, &Config::host()), wanted, "{}", &text[..text.len().min(60)]);
        }
        let chain: String = (1..5_000).map(|n| format!("#define M{n} M{}\n", n - 1)).collect();
        let text = format!("#define M0 1\n{chain}int a = M4999;");
        assert_eq!(code(&text, &Config::host()), "G0644");
    });
}

#[test]
fn the_preprocessor_follows_the_standard() {
    let text = "#define EMPTY\n#define F(x, y) ((x) + (y))\n#define G F\n#define N 3\n\
        #if defined(N) && N > 2 && !defined X\n#define OK 1\n#elif 1 / 0\n#error no\n#else\n#error no\n#endif\n\
        #ifdef __cplusplus\n#error no\n#endif\n\
        #if 0\n it's not C \" at all\n#if 1\n#else\n#endif\n#endif\n\
        EMPTY enum { A = G(1, F(2, N)), B = OK, C = -1 < 0U };\n\
        #undef N\n#ifndef N\n#define N 4\n#endif\nint a[N];\n";
    let unit = good(text, &Config::host());
    let printed = print(&unit);
    assert!(printed.contains("A = 6,\n    B = 1,\n    C = 0\n"), "{printed}");
    assert!(printed.contains("int a[4];"), "{printed}");
}

#[test]
fn an_empty_text_is_a_unit() {
    assert!(read("", &Config::host()).0.is_some());
    assert!(read("/* nothing */ // at all", &Config::host()).0.is_some());
    assert_eq!(code("/* open", &Config::host()), "G0640");
}
