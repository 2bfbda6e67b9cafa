//! The languages that a design can be written in: one row each.
//!
//! A row names everything that the verbs need to know about a language: how its files and texts are recognised, how it is read, written and formatted. The
//! order of the rows is that of the lists on the command line.

use crate::automaton;
use crate::codes;
use crate::design::NetDesign;
use crate::fuse_design;
use crate::jedec;
use crate::logic::LogicDesign;
use crate::pipeline;
use crate::recognise::{Words, names_a_gal};
use grafsynth_backend_pld::read::Text;
use grafsynth_backend_pld::{Dialect, pla};
use grafsynth_frontend::{c, graf, kiss2, plcopen, rules, scxml, st};
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, FileId, Valid, text};
use grafsynth_logic::minimise::Budget;
use grafsynth_verify::Limits;

/// The result of a parser: the design, if there is one, and all findings.
type Read<T> = (Option<T>, Vec<Diagnostic>);

/// A text, or why the language cannot express the design.
type Printed = Result<String, Vec<Diagnostic>>;

/// A language.
#[derive(Debug)]
pub struct Language {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its file extensions without the dot; written files have the first.
    pub extensions: &'static [&'static str],
    /// For an extension of several languages: true if a text is in this one.
    pub is_own: fn(&str) -> bool,
    /// How a text without a file name is recognised.
    pub sign: Sign,
    /// Its parser.
    pub read: Reader,
    /// Its writer.
    pub write: Writer,
    /// The function that prints the canonical form of a text, for `fmt`.
    pub canonical: Option<fn(FileId, &str) -> Printed>,
    /// True if its texts can name library files.
    pub has_libraries: bool,
    /// True if the files in a folder are charts of the user; false if `build` writes such files.
    pub in_folders: bool,
}

/// Of all languages whose test a text passes, the one with the lowest rank is recognised: a rare word before a frequent one.
#[derive(Debug)]
pub struct Sign(u8, fn(&Words) -> bool);

/// A parser, by the kind of design that it returns. The third argument of those of charts are the limits of the command line.
#[derive(Debug)]
pub enum Reader {
    /// A chart.
    Chart(fn(FileId, &str, &graf::Limits) -> graf::Parsed),
    /// A chart from a program in C.
    C(fn(FileId, &str, &graf::Limits, &c::Options) -> c::Parsed),
    /// A net; the last argument names it if the text does not.
    Net(fn(FileId, &str, &graf::Limits, &str) -> Read<Net>),
    /// A circuit in equations or as a netlist.
    Equations(Dialect),
    /// A circuit without pins.
    Circuit(fn(FileId, &str) -> Read<Text>),
    /// The macrocells of a device.
    Fuses(fn(FileId, &str) -> Read<LogicDesign>),
}

/// A text with what it does not contain or expresses differently, or why the language cannot express the chart.
type Written = Result<(String, Vec<Diagnostic>), Vec<Diagnostic>>;

/// A writer of a language, by the kind of design that it accepts.
#[derive(Debug)]
pub enum Writer {
    /// Charts.
    Chart(fn(&NetDesign) -> Written),
    /// Circuits, in equations or as a netlist.
    Equations(Dialect),
    /// Circuits: of a net, and imported ones.
    Circuit(fn(&Valid<Net>) -> Printed, fn(&LogicDesign) -> Printed),
    /// None, for the reason in this finding.
    None(fn() -> Diagnostic),
}

/// All languages.
pub static LANGUAGES: [Language; 15] = [
    Language {
        canonical: Some(graf::format),
        has_libraries: true,
        ..row(
            "graf",
            &["graf"],
            Sign(4, |text| text.begins(&["chart", "library", "use", "function"])),
            Reader::Chart(graf::parse_within),
            Writer::Chart(|design| match &design.chart {
                Some(chart) => Ok((graf::write_design(chart), Vec::new())),
                None => lossless(graf::write_net(&design.net)),
            }),
        )
    },
    Language {
        canonical: Some(rules::format),
        ..row(
            "rules",
            &["rules"],
            Sign(3, |text| text.has(&["Transitions:", "Transition", "Marking"])),
            Reader::Chart(rules::parse_within),
            Writer::Chart(|design| lossless(rules::write_net(&design.net))),
        )
    },
    row(
        "scxml",
        &["scxml"],
        Sign(1, |text| text.all.contains("<scxml")),
        Reader::Chart(scxml::parse_within),
        Writer::Chart(|design| match &design.chart {
            Some(chart) => scxml::write_design(chart, &design.net),
            None => scxml::write_net(&design.net),
        }),
    ),
    row(
        "st",
        // `.exp`: IEC 61131-3 exports by other tools.
        &["st", "exp"],
        Sign(3, |text| IEC.split(' ').any(|word| text.has_any_case(word))),
        Reader::Chart(st::parse_within),
        Writer::Chart(|design| st::write_net(&design.net)),
    ),
    row(
        "plcopen",
        &["xml"],
        Sign(1, |text| text.all.contains("<project")),
        Reader::Chart(plcopen::parse_within),
        Writer::Chart(|design| plcopen::write_net(&design.net)),
    ),
    row(
        "net",
        &["net"],
        Sign(4, |text| text.begins(&["net"])),
        Reader::Net(|file, text, _, _| text::parse(file, text)),
        Writer::Chart(|design| Ok((text::print(&design.net), Vec::new()))),
    ),
    equations(
        Dialect::Palasm,
        &["pds"],
        Sign(3, |text| text.has_any_case("CHIP") && text.has_any_case("EQUATIONS")),
    ),
    Language {
        is_own: |text| !names_a_gal(text),
        ..equations(
            Dialect::Cupl,
            &["pld"],
            Sign(6, |text| {
                let words = ["name", "device", "pin", "partno"];
                text.code.contains(';') && words.iter().any(|word| text.has_any_case(word))
            }),
        )
    },
    Language {
        is_own: names_a_gal,
        ..equations(Dialect::Galasm, &["pld"], Sign(5, |text| names_a_gal(text.all)))
    },
    equations(Dialect::Verilog, &["v"], Sign(2, |text| text.has(&["module", "`timescale"]))),
    equations(Dialect::Blif, &["blif"], Sign(2, |text| text.has(&[".model"]))),
    row(
        "pla",
        &["pla"],
        Sign(2, |text| text.has(&[".i"]) && !text.has(&[".s"])),
        Reader::Circuit(pla::read_text),
        Writer::Circuit(|net| table(&circuit(net)?), |design| table(design.circuit()?)),
    ),
    row(
        "kiss2",
        &["kiss2", "kiss"],
        Sign(2, |text| text.has(&[".i"]) && text.has(&[".s"])),
        Reader::Net(|file, text, limits, name| {
            let (machine, found) = kiss2::parse_within(file, text, limits);
            (machine.map(|machine| kiss2::net(&machine, name)), found)
        }),
        Writer::Chart(|design| Ok((kiss2::write(&automaton::machine(&design.net)?), Vec::new()))),
    ),
    row(
        "jedec",
        &["jed"],
        // A transmission starts with STX, perhaps after a header of the programmer.
        Sign(1, |text| text.all.contains('\u{2}')),
        Reader::Fuses(read_fuses),
        Writer::Circuit(
            |net| Ok(jedec::burn(net, &circuit(net)?, None, None, None)?.text),
            |design| jedec::as_written(design.placement.as_ref().map_err(Clone::clone)?),
        ),
    ),
    Language {
        in_folders: false,
        ..row(
            "c",
            &["c"],
            Sign(7, |text| text.has(&C)),
            Reader::C(c::parse_within),
            Writer::None(|| {
                let why = "C output has several files, and `convert` writes one";
                let instead = "use `build FILE --target c -o FOLDER`, which also compares the C code with the chart";
                Diagnostic::error(codes::WRITES_C, why).help(instead)
            }),
        )
    },
];

/// The language of grafsynth itself.
pub static GRAF: &Language = &LANGUAGES[0];

/// The words at the start of a line in an IEC 61131-3 text, in any case.
const IEC: &str = "PROGRAM FUNCTION_BLOCK FUNCTION CONFIGURATION INITIAL_STEP TYPE VAR_GLOBAL";

/// The words at the start of a line in C.
const C: [&str; 8] = ["int", "void", "char", "static", "unsigned", "#include", "#define", "bool"];

/// A language with the usual properties: no other language has its extensions, no canonical form, no libraries.
const fn row(
    name: &'static str,
    extensions: &'static [&'static str],
    sign: Sign,
    read: Reader,
    write: Writer,
) -> Language {
    let (canonical, has_libraries, in_folders) = (None, false, true);
    let is_own: fn(&str) -> bool = |_| true;
    Language { name, extensions, is_own, sign, read, write, canonical, has_libraries, in_folders }
}

const fn equations(dialect: Dialect, extensions: &'static [&'static str], sign: Sign) -> Language {
    row(dialect.name(), extensions, sign, Reader::Equations(dialect), Writer::Equations(dialect))
}

impl Language {
    /// The language with that name on the command line.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Language> {
        LANGUAGES.iter().find(|language| language.name == name)
    }

    /// The language of a file by its extension and, if several languages have it, by its text.
    #[must_use]
    pub fn of(path: &str, text: &str) -> Option<&'static Language> {
        let extension = path.rsplit(['/', '\\']).next()?.rsplit_once('.')?.1.to_ascii_lowercase();
        LANGUAGES.iter().find(|language| {
            language.extensions.contains(&extension.as_str()) && (language.is_own)(text)
        })
    }

    /// The language of a text without a file name, by its words; `None` if no language is recognised.
    #[must_use]
    pub fn guess(text: &str) -> Option<&'static Language> {
        let words = Words::of(text);
        let known = LANGUAGES.iter().filter(|language| (language.sign.1)(&words));
        known.min_by_key(|language| language.sign.0)
    }

    /// The languages that [`crate::convert`] writes.
    pub fn written() -> impl Iterator<Item = &'static Language> {
        LANGUAGES.iter().filter(|language| !matches!(language.write, Writer::None(_)))
    }

    /// The extension of written files.
    #[must_use]
    pub fn extension(&self) -> &'static str {
        self.extensions.first().copied().unwrap_or_default()
    }

    /// True for charts and nets, false for logic.
    #[must_use]
    pub fn is_chart(&self) -> bool {
        matches!(self.read, Reader::Chart(_) | Reader::C(_) | Reader::Net(_))
    }

    /// True if the options for C sources apply.
    #[must_use]
    pub fn is_c(&self) -> bool {
        matches!(self.read, Reader::C(_))
    }
}

/// The extensions of some languages, for messages: `.graf .rules`.
#[must_use]
pub fn extensions(which: impl Fn(&Language) -> bool) -> String {
    let some = LANGUAGES.iter().filter(|language| which(language));
    let mut all: Vec<String> = some.map(|language| format!(".{}", language.extension())).collect();
    all.dedup();
    all.join(" ")
}

fn lossless(text: Printed) -> Written {
    text.map(|text| (text, Vec::new()))
}

/// The circuit of a net.
fn circuit(net: &Valid<Net>) -> Result<Logic, Vec<Diagnostic>> {
    pipeline::logic(net, &pipeline::facts(net, &Limits::default()))
}

/// The table of a circuit's functions.
fn table(logic: &Logic) -> Printed {
    Ok(pla::write(&pla::table(logic, Budget::default())?))
}

fn read_fuses(file: FileId, text: &str) -> Read<LogicDesign> {
    let (fuses, mut found) = grafsynth_backend_pld::jedec::read(file, text);
    let design = fuses.map(|fuses| match fuse_design::design(&fuses, file) {
        Ok((design, more)) => (Some(design), more),
        Err(more) => (None, more),
    });
    let (design, more) = design.unwrap_or_default();
    found.extend(more);
    (design, found)
}

#[cfg(test)]
mod tests {
    use super::Language;

    #[test]
    fn a_text_without_a_name_is_recognised_by_its_words() {
        for (text, name) in [
            ("# a lamp\nchart lamp {\n}", Some("graf")),
            ("library chart debounce { }", Some("graf")),
            ("# c\nStep p1, p2\nTransition t1\n", Some("rules")),
            ("<?xml version=\"1.0\"?>\n<!-- c --><scxml version=\"1.0\">", Some("scxml")),
            ("<?xml version=\"1.0\"?>\n<project xmlns=\"..\">", Some("plcopen")),
            ("(* a\nmodule *)\nProgram p\nVAR END_VAR", Some("st")),
            ("net demo\npart demo level 1", Some("net")),
            ("; old\nTITLE t\nCHIP c PAL16R4\nPIN 1 clk\nEQUATIONS\n", Some("palasm")),
            ("Name truck;\nDevice g22v10;\nPin 1 = clk;", Some("cupl")),
            ("; old\nGAL16V8\nTruck\n", Some("galasm")),
            ("`include x\nmodule m;\nsub s (\n  .i (a),\n  .s (b));\nendmodule", Some("verilog")),
            ("// net\nmodule m(input wire a);\nendmodule", Some("verilog")),
            ("# c\n.model m\n.inputs a\n", Some("blif")),
            (".i 2\n.o 1\n11 1\n.e", Some("pla")),
            (".i 2\n.o 1\n.s 2\n.p 2\n", Some("kiss2")),
            ("header\n\u{2}QP20*QF2194*", Some("jedec")),
            ("#include <stdio.h>\n/* f */ int f(int a) { return a; }", Some("c")),
            ("int f(void) { return 1; }", Some("c")),
            ("hello", None),
            ("", None),
        ] {
            assert_eq!(Language::guess(text).map(|it| it.name), name, "{text}");
        }
    }

    #[test]
    fn the_extension_and_the_first_line_say_the_format() {
        let of = |path, text| Language::of(path, text).map(|it| it.name);
        assert_eq!(of("a/b.graf", ""), Some("graf"));
        assert_eq!(of("b.PDS", ""), Some("palasm"));
        assert_eq!(of("plant.exp", ""), Some("st"));
        assert_eq!(of("table.kiss", ""), Some("kiss2"));
        assert_eq!(of("plant.xml", ""), Some("plcopen"));
        assert_eq!(of("b.pld", "; old\nGAL16V8 ; device\nSig"), Some("galasm"));
        assert_eq!(of("b.pld", "Name truck;\nDevice g22v10;"), Some("cupl"));
        assert_eq!(of("graf", ""), None);
    }
}
