//! Which language a text is written in.

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
    /// All of them with their name on the command line and their file extension.
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

    /// The format of a file by its extension; `.pld` is GALasm if its first line that is no comment names a GAL, else CUPL.
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

    /// The format of that name on the command line.
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

#[cfg(test)]
mod tests {
    use super::Format;

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
