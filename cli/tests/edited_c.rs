//! `compare CHART out/NAME.c`: C that `build` emitted, after somebody edited it, is proved, refuted with a run, or open with the reason.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use std::fs;
use std::path::Path;
use std::process::Command;

const PRESS: &str = "chart press {
    tick 100 ms
    evolution single
    conflict priority
    input start, stop
    output down, lamp
    var n: int 0..9
    initial step idle { lamp }
    step work { down }
    step rest {
        entry { n := n + 1 }
    }
    idle -> work when start
    work -> idle when stop
    work -> rest after 2 s
    rest -> idle after 1 s
}
";

/// The exit code, and everything that was printed.
fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        // No compiler is needed.
        .env("CC", "false")
        .output()
        .expect("grafsynth starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout) + &text(&output.stderr))
}

fn compare(folder: &Path) -> (Option<i32>, String) {
    run(folder, &["compare", "press.graf", "out/press.c"])
}

/// A folder with the chart and its C.
fn built(options: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("press.graf"), PRESS).expect("a chart");
    let build = ["build", "press.graf", "-t", "c", "-o", "out", "--no-proof", "--allow", "tested"];
    let arguments: Vec<&str> = build.iter().chain(options).copied().collect();
    run(folder.path(), &arguments);
    assert!(folder.path().join("out/press.map.json").is_file(), "build writes a map");
    folder
}

/// Replaces a text in a file, which must contain it.
fn edit(folder: &Path, file: &str, from: &str, to: &str) {
    let path = folder.join(file);
    let text = fs::read_to_string(&path).expect("a file");
    assert!(text.contains(from), "{file} does not contain `{from}`:\n{text}");
    fs::write(path, text.replace(from, to)).expect("a file");
}

#[test]
fn an_edit_without_an_effect_is_proved() {
    let folder = built(&[]);
    // Another name in code, header and map, and another comment.
    for file in ["out/press.c", "out/press.h", "out/press.map.json"] {
        edit(folder.path(), file, "state", "mode");
    }
    let (exit, text) = compare(folder.path());
    assert_eq!(exit, Some(0), "{text}");
    assert!(text.contains("proved by induction") && !text.contains("press_stop"), "{text}");
    // Files in either order, and the map in another place.
    fs::rename(folder.path().join("out/press.map.json"), folder.path().join("m.json")).unwrap();
    let (exit, text) =
        run(folder.path(), &["compare", "out/press.c", "press.graf", "--map", "m.json"]);
    assert_eq!(exit, Some(0), "{text}");
    // Without the map, the new name is not known.
    let (exit, text) = compare(folder.path());
    assert_eq!(exit, Some(4), "{text}");
    assert!(text.contains("there is no map beside it") && text.contains("tested:"), "{text}");
}

#[test]
fn a_difference_is_shown_in_the_names_of_the_chart() {
    let folder = built(&["--style", "bits"]);
    edit(folder.path(), "out/press.c", "= self->work;", "= self->work && !in->stop;");
    let (exit, text) = compare(folder.path());
    assert_eq!(exit, Some(3), "{text}");
    assert!(text.contains("differs from the chart after 1 reaction: down is `1` in the chart"));
    assert!(text.contains("idle_work"), "{text}");
}

#[test]
fn a_damaged_stop_is_not_proved() {
    let folder = built(&[]);
    edit(folder.path(), "out/press.h", "out->down = false;", "out->down = true;");
    let (exit, text) = compare(folder.path());
    assert_eq!(exit, Some(4), "{text}");
    assert!(text.contains("no induction"), "{text}");
}

#[test]
fn a_wrong_map_proves_nothing() {
    let folder = built(&[]);
    let map = "out/press.map.json";
    let good = fs::read_to_string(folder.path().join(map)).expect("a map");
    for (from, to, exit, why) in [
        ("\"idle\"", "\"work\"", 4, "no induction"),
        ("\"idle\"", "\"other\"", 4, "the step `other`, which the chart does not have"),
        ("\"code\": 1", "\"code\": 2", 4, "no induction"),
        ("c-map-1", "c-map-9", 1, "format `grafsynth-c-map-9`"),
        ("\"chart\"", "\"chat\"", 1, "unknown field `chat`"),
        ("\"press\"", "\"other\"", 1, "press.map.json: `chart`: the map is of the chart `other`"),
        (
            "\"style\"",
            "\"gate\": false, \"style\"",
            1,
            "`options.gate` is set to its default value",
        ),
        ("\"holds\"", "\"element\": 0, \"holds\"", 1, "`instance[0]`: `element`: `"),
        ("\"holds\"", "\"bit\": 0, \"holds\"", 1, "`instance[0]`: `bit`: "),
    ] {
        edit(folder.path(), map, from, to);
        let (found, text) = compare(folder.path());
        assert_eq!(found, Some(exit), "{to}: {text}");
        assert!(text.contains(why) && !text.contains("proved by induction"), "{to}: {text}");
        fs::write(folder.path().join(map), &good).expect("a map");
    }
}

#[test]
fn another_interface_is_not_proved() {
    let folder = built(&[]);
    let swapped = "bool lamp;\n    bool down;";
    let header = folder.path().join("out/press.h");
    let good = fs::read_to_string(&header).expect("a header");
    for (from, to, why) in [
        (
            "    bool down;\n    bool lamp;",
            &format!("    {swapped}")[..],
            "`press_out_t` has `bool lamp`",
        ),
        ("    bool stop;", "    uint8_t stop;", "`press_in_t` has `unsigned char stop`"),
        ("dt", "dt2", ""),
    ] {
        if !good.contains(from) {
            panic!("{good}");
        }
        fs::write(&header, good.replacen(from, to, 1)).expect("a header");
        let (exit, text) = compare(folder.path());
        if why.is_empty() {
            continue;
        }
        assert_eq!(exit, Some(4), "{text}");
        assert!(text.contains(why), "{text}");
    }
}

#[test]
fn what_is_undefined_or_unreadable_is_not_proved() {
    let folder = built(&[]);
    let c = folder.path().join("out/press.c");
    let good = fs::read_to_string(&c).expect("C");
    let begin =
        good.find("press_step(").and_then(|at| good[at..].find("{\n").map(|it| at + it + 2));
    let (before, after) = good.split_at(begin.expect("a reaction"));
    for (line, exit, why) in [
        (
            "    int z = 0; if (in->start && in->stop) { z = 1 / z; }\n",
            3,
            "divides by 0, at out/press.c:",
        ),
        ("    static int z = 0; z += 1;\n", 4, "the static object `z`"),
        ("    asm(\"nop\");\n", 1, "press.c"),
        ("    other(self);\n", 1, "other"),
    ] {
        fs::write(&c, format!("{before}{line}{after}")).expect("C");
        let (found, text) = compare(folder.path());
        assert_eq!(found, Some(exit), "{line}: {text}");
        assert!(text.contains(why) && !text.contains("proved by induction"), "{line}: {text}");
    }
}

/// Edits that callers or other compilers see differently from the text that the proof reads.
#[test]
fn an_edit_outside_the_scope_of_the_proof_is_open() {
    let line = "    out->down = self->work;";
    for (file, from, to) in [
        // A header other than the one that the C includes.
        ("out/press.h", "bool start;\n    bool stop;", "bool stop;\n    bool start;"),
        // A macro that callers see.
        ("out/press.h", "#ifdef __cplusplus", "#define stop start\n#ifdef __cplusplus"),
        // A condition that compilers may answer differently.
        ("out/press.c", line, "#if true\n    out->down = self->work;\n#endif"),
        // Lines that some compilers join.
        ("out/press.c", line, "    // what??/\n    out->down = self->work;"),
        ("out/press.c", line, "    // x \\ \n    out->down = self->work;"),
        // Data and qualifiers (`restrict`) that the emitted text does not have.
        (
            "out/press.c",
            line,
            "    static const bool yes = true;\n    out->down = self->work && yes;",
        ),
        ("out/press.c", line, "    const press_t *restrict p = self;\n    out->down = p->work;"),
        // A comment that swallows the next line of a header, or a directive.
        ("out/press_port.h", "    press_step(self", "    // x \\\n    press_step(self"),
        ("out/press.c", "#include \"press_port.h\"", "/*\n#include \"press_port.h\"\n*/"),
        // A macro that the user may define so that it does anything.
        ("out/press.c", line, "    PRESS_BAD_STATE(self);\n    out->down = self->work;"),
    ] {
        let folder = built(&["--style", "bits"]);
        edit(folder.path(), file, from, to);
        let (exit, text) = compare(folder.path());
        assert_ne!(exit, Some(0), "{to}: {text}");
    }
}

/// On an AVR, a pointer to program memory reads something else at the same address.
#[test]
fn a_pointer_to_another_address_space_is_not_proved() {
    let rom = "    PRESS_ROM uint8_t *rom = (PRESS_ROM uint8_t *)&self->n;\n    ";
    for (declaration, is_proved) in [(rom, false), (&*rom.replace("PRESS_ROM", "const"), true)] {
        let folder = built(&["--style", "switch"]);
        let text = fs::read_to_string(folder.path().join("out/press.c")).expect("the C");
        let line = text.lines().find(|line| line.contains("out->down = ")).expect("an output");
        let to = format!("{declaration}{} && (rom[0] == self->n);", line.trim_end_matches(';'));
        edit(folder.path(), "out/press.c", line, &to);
        let (exit, said) = compare(folder.path());
        assert_eq!(exit == Some(0), is_proved, "{to}: {said}");
    }
}

/// Of the files of an engine, only the C of the chart can be compared with the chart.
#[test]
fn another_file_of_the_c_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("press.graf"), PRESS).expect("a chart");
    run(
        folder.path(),
        &["build", "press.graf", "-t", "c-program", "-o", "out", "--no-proof", "--allow", "tested"],
    );
    for (file, why) in [
        ("out/grafsynth_program.c", "is the engine, which is the same for all charts"),
        ("out/press_tables.c", "out/press_tables.c has the tables of out/press.c: give that file"),
    ] {
        let (code, text) = run(folder.path(), &["compare", "press.graf", file]);
        assert_eq!(code, Some(1), "{text}");
        assert!(text.contains(why), "{text}");
    }
}

/// What `compare` answers about each form of C that `build` writes: the options, and why the form is refused.
const FORMS: [(&[&str], &str); 21] = [
    (&[], ""),
    (&["--style", "switch"], ""),
    (&["--style", "tables"], ""),
    (&["--style", "bits"], ""),
    (&["--style", "program"], ""),
    (&["--style", "engine"], "it is C of the style `engine`"),
    (&["--callbacks"], ""),
    (&["--gate"], ""),
    (&["--safe-state"], ""),
    (&["--trace-ring", "8"], ""),
    (&["--io", "words"], ""),
    (&["--for", "avr", "--optimise", "size"], ""),
    (&["--style", "bits", "--callbacks"], ""),
    (&["--style", "bits", "--gate", "--io", "words"], ""),
    (&["--gate", "--safe-state", "--callbacks"], ""),
    (&["--safe-state", "--callbacks", "--trace-ring", "8"], ""),
    (&["--style", "program", "--callbacks"], ""),
    (&["--style", "program", "--gate"], ""),
    (&["--style", "program", "--io", "words"], ""),
    (&["--style", "program", "--trace-ring", "8"], ""),
    (&["--style", "program", "--gate", "--callbacks", "--io", "words"], ""),
];

/// The C of a chart with these options.
fn form(options: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("press.graf"), PRESS).expect("a chart");
    let build = ["build", "press.graf", "-t", "c", "-o", "out", "--no-proof", "--allow", "tested"];
    let arguments: Vec<&str> = build.iter().chain(options).copied().collect();
    let (_, text) = run(folder.path(), &arguments);
    assert!(folder.path().join("out/press.c").is_file(), "{options:?}: {text}");
    folder
}

#[test]
fn each_form_is_proved_and_a_change_is_refuted() {
    for (options, refusal) in FORMS {
        let folder = form(options);
        let (exit, text) = compare(folder.path());
        if !refusal.is_empty() {
            assert_eq!(exit, Some(4), "{options:?}: {text}");
            assert!(text.contains(refusal) && text.contains("c-program"), "{options:?}: {text}");
            continue;
        }
        assert_eq!(exit, Some(0), "{options:?}: {text}");
        assert!(text.contains("proved by induction"), "{options:?}: {text}");
        assert!(text.contains("tested: 200 reactions"), "{options:?}: {text}");
        // The two seconds of the press.
        let is_image = options.contains(&"program");
        let (file, from, to) = match is_image {
            true => ("out/press_tables.c", "0x14, 0x10,", "0x13, 0x10,"),
            false => ("out/press.c", ">= 20U", ">= 19U"),
        };
        edit(folder.path(), file, from, to);
        let (exit, text) = compare(folder.path());
        assert_eq!(exit, Some(3), "{options:?}: {text}");
        assert!(text.contains("differs from the chart"), "{options:?}: {text}");
    }
}

#[test]
fn a_wrong_callback_is_refuted() {
    for style in ["switch", "bits", "program"] {
        for is_twice in [false, true] {
            let folder = form(&["--style", style, "--callbacks"]);
            let text = fs::read_to_string(folder.path().join("out/press.c")).expect("the C");
            let call = text.lines().find(|it| it.contains("_activated(PRESS_STEP_work"));
            let line = call.expect("a call");
            let new = if is_twice { format!("{line}\n{line}") } else { String::new() };
            edit(folder.path(), "out/press.c", line, &new);
            let (exit, text) = compare(folder.path());
            assert_eq!(exit, Some(3), "{style}: {text}");
            let why = "`press_activated` and `press_enabled` are not called for exactly";
            assert!(text.contains(why), "{style}: {text}");
        }
    }
}

/// Numbers of an image: some have no effect, some change the meaning, and some damage the byte code.
#[test]
fn edited_byte_code_is_judged() {
    let tables = "out/press_tables.c";
    for (file, from, to, exit, why) in [
        // The checksum is not read by the reset.
        (tables, "0xB7, 0x7F,", "0x00, 0x7F,", 0, "of the image"),
        (tables, "0x14, 0x10,", "/* 2 s */ 20, 0x10,", 0, "of the image"),
        (tables, "0x14, 0x10,", "0x00, 0x10,", 3, "differs from the chart"),
        // The maximum of `n`, the length of the reaction, and an instruction that does not exist.
        (
            tables,
            "0x09, 0x00, 0x00, 0x00, /* n",
            "0x08, 0, 0, 0, /* n",
            3,
            "differs from the chart",
        ),
        (tables, "0xDA, 0x00", "0xD9, 0x00", 4, "no induction"),
        (tables, "0x11, 0x14, 0x00", "0xFF, 0x14, 0x00", 4, "no induction"),
        // What the proof does not read.
        (tables, "= {", "= {\n#if 1\n#endif\n", 4, "the lines with `#`"),
        (tables, "GS_ROM uint8_t", "const uint8_t", 4, "differ in more than numbers"),
        (tables, "0x14, 0x10,", "20 + 0, 0x10,", 4, "differ in more than numbers"),
        ("out/press.h", "PRESS_BITS 1U", "PRESS_BITS 2U", 4, "`press.h` differs"),
    ] {
        let folder = form(&["--style", "program"]);
        edit(folder.path(), file, from, to);
        let (found, text) = compare(folder.path());
        assert_eq!(found, Some(exit), "{to}: {text}");
        assert!(text.contains(why), "{to}: {text}");
    }
    let folder = form(&["--style", "program"]);
    fs::remove_file(folder.path().join("out/press_tables.c")).expect("a file");
    let (exit, text) = compare(folder.path());
    assert_eq!(exit, Some(4), "{text}");
    assert!(text.contains("there is no `press_tables.c` beside the C"), "{text}");
    // Without the map, the header of the engine shows which style it is.
    let folder = form(&["--style", "program"]);
    fs::remove_file(folder.path().join("out/press.map.json")).expect("a map");
    let (exit, text) = compare(folder.path());
    assert_eq!(exit, Some(0), "{text}");
}

/// A statechart with a history, a queue and delayed sends.
const DOOR: &str = "chart door {
    tick 100 ms
    conflict inner-first
    queue 2
    event push, pull, close
    input light
    output open, lamp
    var n: int 0..3
    initial state shut
    state ajar { open
        history last -> low
        initial state low
        state high { lamp; entry { raise pull; send close after 3 s as later } }
        low -> high on push when n < 3 do { n := n + 1 }
        high -> low after 1 s do { cancel later } }
    shut -> last on push when light
    ajar -> shut on pull when not light
    ajar -> shut on close
}
";

#[test]
fn each_form_of_a_statechart_is_proved() {
    for style in ["switch", "bits", "program"] {
        for options in [&[][..], &["--callbacks"], &["--gate"]] {
            let folder = tempfile::tempdir().expect("a folder");
            fs::write(folder.path().join("door.graf"), DOOR).expect("a chart");
            let build = ["build", "door.graf", "-t", "c", "-o", "out", "--no-proof", "--style"];
            let all: Vec<&str> = build.iter().chain(&[style]).chain(options).copied().collect();
            let (_, text) = run(folder.path(), &all);
            assert!(folder.path().join("out/door.c").is_file(), "{style} {options:?}: {text}");
            let (exit, text) = run(folder.path(), &["compare", "door.graf", "out/door.c"]);
            assert_eq!(exit, Some(0), "{style} {options:?}: {text}");
        }
    }
}
