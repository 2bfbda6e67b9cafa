//! Detects the language of a text.

/// The languages that a design can be written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "each variant is the language it names")]
pub enum Format {
    Graf,
    Rules,
    Scxml,
    St,
    Plcopen,
    Net,
    Palasm,
    Cupl,
    Galasm,
    Verilog,
    Blif,
    Pla,
    Kiss2,
    Jedec,
    C,
}

impl Format {
    /// All formats with their name on the command line and their file extension.
    pub const ALL: [(Format, &'static str, &'static str); 15] = [
        (Format::Graf, "graf", "graf"),
        (Format::Rules, "rules", "rules"),
        (Format::Scxml, "scxml", "scxml"),
        (Format::St, "st", "st"),
        (Format::Plcopen, "plcopen", "xml"),
        (Format::Net, "net", "net"),
        (Format::Palasm, "palasm", "pds"),
        (Format::Cupl, "cupl", "pld"),
        (Format::Galasm, "galasm", "pld"),
        (Format::Verilog, "verilog", "v"),
        (Format::Blif, "blif", "blif"),
        (Format::Pla, "pla", "pla"),
        (Format::Kiss2, "kiss2", "kiss2"),
        (Format::Jedec, "jedec", "jed"),
        (Format::C, "c", "c"),
    ];

    /// The format of a file by its extension; `.pld` is GALasm if its first non-comment line names a GAL, otherwise CUPL.
    #[must_use]
    pub fn of(path: &str, text: &str) -> Option<Format> {
        let extension = path.rsplit(['/', '\\']).next()?.rsplit_once('.')?.1.to_ascii_lowercase();
        if extension == "pld" {
            let first =
                text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with(';'));
            let is_galasm = first.is_some_and(|line| {
                let word = line.split_whitespace().next().unwrap_or_default().to_ascii_uppercase();
                word.starts_with("GAL")
                    && word.bytes().any(|byte| byte.is_ascii_digit())
                    && !word.contains('=')
            });
            return Some(if is_galasm { Format::Galasm } else { Format::Cupl });
        }
        if extension == "kiss" {
            return Some(Format::Kiss2);
        }
        // IEC 61131-3 exports by other tools.
        if extension == "exp" {
            return Some(Format::St);
        }
        Format::ALL.iter().find(|(_, _, ext)| *ext == extension).map(|(format, _, _)| *format)
    }

    /// The format of a text without a file name, by its first words; `None` if no language is recognised.
    #[must_use]
    pub fn guess(text: &str) -> Option<Format> {
        let text = text.trim_start_matches('\u{feff}');
        if text.contains("<scxml") {
            return Some(Format::Scxml);
        }
        if text.contains("<project") {
            return Some(Format::Plcopen);
        }
        // A JEDEC transmission starts with STX, perhaps after a header of the programmer.
        if text.contains('\u{2}') {
            return Some(Format::Jedec);
        }
        let code = without_comments(text);
        let lines: Vec<Vec<&str>> = code
            .lines()
            .map(|line| line.split_whitespace().collect::<Vec<_>>())
            .filter(|words| !words.is_empty())
            .collect();
        let has = |word: &str| lines.iter().any(|words| words[0] == word);
        let has_any_case =
            |word: &str| lines.iter().any(|words| words[0].eq_ignore_ascii_case(word));
        if has(".model") {
            return Some(Format::Blif);
        }
        if has(".i") {
            return Some(if has(".s") { Format::Kiss2 } else { Format::Pla });
        }
        if has("module") || has("`timescale") {
            return Some(Format::Verilog);
        }
        if has("Transitions:") || has("Transition") || has("Marking") {
            return Some(Format::Rules);
        }
        const IEC: [&str; 7] = [
            "PROGRAM",
            "FUNCTION_BLOCK",
            "FUNCTION",
            "CONFIGURATION",
            "INITIAL_STEP",
            "TYPE",
            "VAR_GLOBAL",
        ];
        if IEC.iter().any(|word| has_any_case(word)) {
            return Some(Format::St);
        }
        if has_any_case("CHIP") && has_any_case("EQUATIONS") {
            return Some(Format::Palasm);
        }
        match lines.first()?[0] {
            "chart" | "library" | "use" | "function" => return Some(Format::Graf),
            "net" => return Some(Format::Net),
            _ => {}
        }
        if Format::of("stdin.pld", text) == Some(Format::Galasm) {
            return Some(Format::Galasm);
        }
        let is_statement = |word: &str| {
            lines.iter().any(|words| words[0].eq_ignore_ascii_case(word) && code.contains(';'))
        };
        if ["name", "device", "pin", "partno"].into_iter().any(is_statement) {
            return Some(Format::Cupl);
        }
        let is_c = |word: &&str| lines.iter().any(|words| words[0] == *word);
        const C: [&str; 8] =
            ["int", "void", "char", "static", "unsigned", "#include", "#define", "bool"];
        C.iter().any(is_c).then_some(Format::C)
    }

    /// The formats that [`crate::convert`] writes: all except C, which has several files.
    pub fn written() -> impl Iterator<Item = Format> {
        Format::ALL.iter().map(|(format, ..)| *format).filter(|format| *format != Format::C)
    }

    /// The format with that name on the command line.
    #[must_use]
    pub fn named(name: &str) -> Option<Format> {
        Format::ALL.iter().find(|(_, known, _)| *known == name).map(|(format, _, _)| *format)
    }

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        Format::ALL.iter().find(|(format, _, _)| *format == self).map_or("", |(_, name, _)| name)
    }

    /// Its file extension.
    #[must_use]
    pub fn extension(self) -> &'static str {
        Format::ALL
            .iter()
            .find(|(format, _, _)| *format == self)
            .map_or("", |(_, _, extension)| extension)
    }

    /// True for charts and nets, false for logic.
    #[must_use]
    pub fn is_chart(self) -> bool {
        matches!(
            self,
            Format::Graf
                | Format::Rules
                | Format::Scxml
                | Format::St
                | Format::Plcopen
                | Format::Net
                | Format::Kiss2
                | Format::C
        )
    }
}

/// A text without its comments, in any language: block comments of C, IEC and XML, and lines that start with `//`, `;` or `#` (except C directives).
fn without_comments(text: &str) -> String {
    let mut rest = text;
    let mut code = String::new();
    while let Some((at, close)) = [("/*", "*/"), ("(*", "*)"), ("<!--", "-->")]
        .into_iter()
        .filter_map(|(open, close)| Some((rest.find(open)?, close)))
        .min()
    {
        code += &rest[..at];
        code.push(' ');
        rest = rest[at..].split_once(close).map_or("", |(_, after)| after);
    }
    code += rest;
    let is_code = |line: &&str| {
        let line = line.trim_start();
        let is_directive = line.starts_with("#include") || line.starts_with("#define");
        !line.starts_with("//")
            && !line.starts_with(';')
            && (!line.starts_with('#') || is_directive)
    };
    code.lines().filter(is_code).flat_map(|line| [line, "\n"]).collect()
}

#[cfg(test)]
mod tests {
    use super::Format;

    #[test]
    fn a_text_without_a_name_is_recognised_by_its_words() {
        for (text, format) in [
            ("# a lamp\nchart lamp {\n}", Some(Format::Graf)),
            ("library chart debounce { }", Some(Format::Graf)),
            ("# c\nStep p1, p2\nTransition t1\n", Some(Format::Rules)),
            ("<?xml version=\"1.0\"?>\n<!-- c --><scxml version=\"1.0\">", Some(Format::Scxml)),
            ("<?xml version=\"1.0\"?>\n<project xmlns=\"..\">", Some(Format::Plcopen)),
            ("(* a\nmodule *)\nProgram p\nVAR END_VAR", Some(Format::St)),
            ("net demo\npart demo level 1", Some(Format::Net)),
            ("; old\nTITLE t\nCHIP c PAL16R4\nPIN 1 clk\nEQUATIONS\n", Some(Format::Palasm)),
            ("Name truck;\nDevice g22v10;\nPin 1 = clk;", Some(Format::Cupl)),
            ("; old\nGAL16V8\nTruck\n", Some(Format::Galasm)),
            ("// net\nmodule m(input wire a);\nendmodule", Some(Format::Verilog)),
            ("# c\n.model m\n.inputs a\n", Some(Format::Blif)),
            (".i 2\n.o 1\n11 1\n.e", Some(Format::Pla)),
            (".i 2\n.o 1\n.s 2\n.p 2\n", Some(Format::Kiss2)),
            ("header\n\u{2}QP20*QF2194*", Some(Format::Jedec)),
            ("#include <stdio.h>\n/* f */ int f(int a) { return a; }", Some(Format::C)),
            ("int f(void) { return 1; }", Some(Format::C)),
            ("hello", None),
            ("", None),
        ] {
            assert_eq!(Format::guess(text), format, "{text}");
        }
    }

    #[test]
    fn the_extension_and_the_first_line_say_the_format() {
        assert_eq!(Format::of("a/b.graf", ""), Some(Format::Graf));
        assert_eq!(Format::of("b.PDS", ""), Some(Format::Palasm));
        assert_eq!(Format::of("plant.exp", ""), Some(Format::St));
        assert_eq!(Format::of("plant.xml", ""), Some(Format::Plcopen));
        assert_eq!(Format::of("b.pld", "; old\nGAL16V8 ; device\nSig"), Some(Format::Galasm));
        assert_eq!(Format::of("b.pld", "Name truck;\nDevice g22v10;"), Some(Format::Cupl));
        assert_eq!(Format::of("graf", ""), None);
    }
}
