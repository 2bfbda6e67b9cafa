//! Charts whose inputs, outputs, steps and variables are named like keywords of a target: real tools accept the emitted text, and texts of equations
//! are read back.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests write files for tools")]

use grafsynth_backend_c::{Options, Style};
use grafsynth_backend_pld::{Dialect, EmitOptions, emit};
use grafsynth_driver::convert::convert;
use grafsynth_driver::pipeline;
use grafsynth_driver::read::Design;
use grafsynth_engines::tools;
use grafsynth_ir::names::{self, Target};
use grafsynth_tests::conversions::{design_of, language};
use grafsynth_tests::{chart, fleet};
use grafsynth_verify::structural_facts;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(300);

/// Keywords of Verilog-AMS, of PSL, and of packages that some tools support in addition to the language.
#[rustfmt::skip]
const BESIDE_VERILOG: [&str; 60] = [
    "above", "abs", "abstol", "analog", "branch", "bool", "boolean", "ceil", "clock", "connectrules", "continuous", "ddt", "discipline", "discrete",
    "domain", "exclude", "exp", "fell", "floor", "flow", "forall", "from", "ground", "idt", "inf", "inherit", "ln", "log", "mailbox", "max", "min", "mod",
    "nature", "never", "next", "option", "paramset", "peek", "potential", "prev", "process", "psl", "put", "report", "root", "rose", "semaphore", "slew",
    "split", "sqrt", "stable", "std", "timer", "transition", "unit", "units", "vunit", "wone", "wreal", "white_noise",
];

/// Keywords of compilers for microcontrollers, and names that their headers define.
#[rustfmt::skip]
const BESIDE_C: [&str; 62] = [
    "ADEN", "AVR", "GF0", "IDL", "INT0", "PD", "PUD", "SDCC", "SE", "SMOD", "TWEN", "XH", "ZL", "alien", "asm", "at", "banked", "bdata", "bit", "code",
    "compact", "critical", "data", "eeprom", "endasm", "far", "flash", "fixed16x16", "generic", "huge", "idata", "interrupt", "isr", "large", "monitor",
    "naked", "near", "nonbanked", "overlay", "pdata", "priority", "ram", "reentrant", "rom", "saddr", "sbit", "sfr", "sfr16", "sfr32", "small", "smallc",
    "sram", "task", "tiny", "trap", "typeof", "using", "vector", "volatile", "wdt", "xdata", "zpage",
];

fn words_of(target: &Target, beside: &[&'static str]) -> Vec<&'static str> {
    let mut words: Vec<&str> =
        target.reserved.iter().flat_map(|list| list.iter().copied()).collect();
    words.extend(beside);
    words.sort_unstable();
    words.dedup();
    words
}

/// A ring of steps with objects of these names: inputs, outputs, steps and, if allowed, variables.
fn ring(name: &str, words: &[&str], has_variables: bool) -> String {
    let n_kinds = if has_variables { 4 } else { 3 };
    let kinds: Vec<&[&str]> = words.chunks(words.len().div_ceil(n_kinds).max(1)).collect();
    let none: &[&str] = &[];
    let kind = |at: usize| kinds.get(at).copied().unwrap_or(none);
    let (inputs, outputs, steps, variables) = (kind(0), kind(1), kind(2), kind(3));
    let mut text = format!(
        "chart `{name}` {{\n    conflict priority\n    input i0\n    step last\n    last -> `{}` when i0\n",
        steps[0]
    );
    inputs.iter().for_each(|word| _ = writeln!(text, "    input `{word}`"));
    outputs.iter().for_each(|word| _ = writeln!(text, "    output `{word}`"));
    variables.iter().for_each(|word| _ = writeln!(text, "    var `{word}`: int 0..9"));
    for (at, step) in steps.iter().enumerate() {
        let output = outputs.get(at).map_or(String::new(), |word| format!("`{word}`"));
        let list =
            variables.get(at).map_or(String::new(), |word| format!("; entry {{ `{word}` := 3 }}"));
        let initial = if at == 0 { "initial " } else { "" };
        _ = writeln!(text, "    {initial}step `{step}` {{ {output}{list} }}");
    }
    for (at, step) in steps.iter().enumerate() {
        let next = steps.get(at + 1).unwrap_or(&"last");
        let input = inputs.get(at).unwrap_or(&"i0");
        let number = variables.get(at).map_or(String::new(), |word| format!(" and `{word}` < 5"));
        _ = writeln!(text, "    `{step}` -> `{next}` when `{input}`{number}");
    }
    text + "}\n"
}

/// The words in another order, so that each names another kind of object.
fn turned<'w>(words: &[&'w str], by: usize, of: usize) -> Vec<&'w str> {
    let mut words = words.to_vec();
    let n_words = words.len();
    words.rotate_left(n_words * by / of);
    words
}

/// Runs a tool on some files; false if it is not available.
fn takes(program: &str, arguments: &[&str], folder: &Path) -> bool {
    let Some(found) = tools::find(&[program]) else {
        assert!(std::env::var_os("CI").is_none(), "{program} is missing, and CI must have it");
        println!("skipped: {program} is not installed");
        return false;
    };
    let done = tools::run(&found, arguments, folder, b"", LIMIT).expect("the tool starts");
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), done.stderr);
    assert!(done.is_success, "{program} {}: {said}", arguments.join(" "));
    true
}

#[test]
fn words_of_verilog_are_names_in_every_tool() {
    let words = words_of(&names::VERILOG, &BESIDE_VERILOG);
    let folder = tempfile::tempdir().expect("a folder");
    for (at, module) in ["bool", "process", "module"].iter().enumerate() {
        let net = chart("a.graf", &ring(module, &turned(&words, at, 3), false));
        let logic = pipeline::logic(&net, &structural_facts(&net)).expect("it is a circuit");
        let emitted =
            emit(&logic, Dialect::Verilog, &EmitOptions::default()).expect("it is written");
        fs::write(folder.path().join("w.v"), emitted.text).expect("a file");
        let folder = folder.path();
        takes("iverilog", &["-o", "w.vvp", "w.v"], folder);
        takes("iverilog", &["-g2012", "-o", "w.vvp", "w.v"], folder);
        takes("verilator", &["--lint-only", "-Wno-fatal", "w.v"], folder);
        takes("yosys", &["-q", "-p", "read_verilog w.v; hierarchy -check"], folder);
        takes("yosys", &["-q", "-p", "read_verilog -sv w.v; hierarchy -check"], folder);
    }
}

#[test]
fn words_of_c_are_names_in_every_compiler() {
    let words = words_of(&names::C, &BESIDE_C);
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    for (at, style) in
        [Style::Switch, Style::Tables, Style::Bits, Style::Program].into_iter().enumerate()
    {
        // Each style gets the words in another order, so that each word names several kinds of objects.
        let words = turned(&words, at, 4);
        let net = chart("a.graf", &ring("words", &words, true));
        let options = Options { style, prefix: Some("volatile".to_owned()), ..Options::default() };
        let (package, _) =
            fleet::emitted(&net, options).unwrap_or_else(|why| panic!("{style:?}: {why}"));
        let mut sources = Vec::new();
        // An 8051 compiler takes minutes for this many steps; their names are in the headers.
        let mut headers = "#include <8052.h>\n".to_owned();
        for file in package.files.iter().filter(|file| !file.keep_existing) {
            fs::write(folder.join(&file.name), &file.text).expect("it is written");
            if file.name.ends_with(".c") {
                sources.push(file.name.clone());
            } else {
                _ = writeln!(headers, "#include \"{}\"", file.name);
            }
        }
        fs::write(folder.join("headers.c"), headers).expect("it is written");
        takes("sdcc", &["-mmcs51", "--model-large", "-S", "-o", "w.asm", "headers.c"], folder);
        for source in &sources {
            let strict = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only", source];
            takes("gcc", &[&["-std=c99"], strict.as_slice()].concat(), folder);
            takes("gcc", &[&["-x", "c++", "-std=c++11"], strict.as_slice()].concat(), folder);
            let avr = ["-mmcu=atmega1284p", "-include", "avr/io.h", "-include", "avr/interrupt.h"];
            takes("avr-gcc", &[avr.as_slice(), &["-fsyntax-only", source]].concat(), folder);
        }
    }
}

#[test]
fn words_of_equations_are_names_when_read_back() {
    let of = [(&names::PALASM, "palasm"), (&names::CUPL, "cupl"), (&names::GALASM, "galasm")];
    for (target, name) in of {
        // The usual names of clocks are tested as words too.
        let words = words_of(target, &["clk", "clock", "ck"]);
        // The last group is padded, so that there is an object of each kind.
        let words = words.chunks(9).map(|words| [words, &["w1", "w2", "w3"]].concat());
        for words in words {
            for by in 0..3 {
                let text = ring("pin", &turned(&words, by, 3), false);
                let design =
                    design_of("a.graf", &text).unwrap_or_else(|why| panic!("{why}\n{text}"));
                let written = convert(&Design::Net(design), language(name));
                written.unwrap_or_else(|why| panic!("{name} {why:#?}\n{text}"));
            }
        }
    }
}
