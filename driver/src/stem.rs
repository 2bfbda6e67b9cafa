//! The beginning of the names of output files: the name of the input file, without folder and extension.

use grafsynth_ir::names::{GRAF, Namer};

/// The beginning of the names of all files that are made of one design.
///
/// Letters and digits of every script stay, and `_ - . +`. Blanks, control characters and the characters with a special meaning for a shell, make or a
/// file system become `_`. The name is never hidden (`.x`), never looks like an option (`-x`), is not a device name of Windows (`con`), and is short
/// enough for every extension.
///
/// ```
/// use grafsynth_driver::stem::FileStem;
/// let stem = |path| FileStem::of_path(path).unwrap();
/// assert_eq!(stem("charts/größe 2.graf").as_str(), "größe_2");
/// assert_eq!(stem("charts/größe 2.graf").identifier(), "größe_2");
/// assert_eq!(FileStem::of_path("-"), None, "standard input");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileStem(String);

/// The maximum length of a stem in bytes. File systems allow 255 bytes for a name, and the longest extension of an output has fewer than
/// 50.
const MOST_BYTES: usize = 200;

/// Names that Windows reserves for devices in every folder, with any extension.
const DEVICES: [&str; 4] = ["aux", "con", "nul", "prn"];

impl FileStem {
    /// The stem of a path; `None` for standard input (`-`).
    #[must_use]
    pub fn of_path(path: &str) -> Option<Self> {
        if path == "-" {
            return None;
        }
        let file = path.rsplit(['/', '\\']).next().unwrap_or_default();
        let stem = match file.rsplit_once('.') {
            Some((stem, _)) if !stem.is_empty() => stem,
            Some(_) | None => file,
        };
        Some(Self::of_name(stem))
    }

    /// The stem of a design without a file: the name of its first chart.
    #[must_use]
    pub fn of_name(name: &str) -> Self {
        let mut stem = String::new();
        for c in name.chars() {
            let is_kept = if c.is_ascii() {
                c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | '+')
            } else {
                !c.is_whitespace() && !grafsynth_ir::names::is_unseen(c)
            };
            let c = if is_kept { c } else { '_' };
            if stem.len() + c.len_utf8() > MOST_BYTES {
                break;
            }
            stem.push(c);
        }
        if stem.starts_with(['-', '.']) {
            stem.replace_range(..1, "_");
        }
        // The part before the first dot decides whether it is a device name.
        let device = stem.split('.').next().unwrap_or_default().to_ascii_lowercase();
        let numbered = device.strip_prefix("com").or_else(|| device.strip_prefix("lpt"));
        let is_numbered = numbered.is_some_and(|rest| {
            rest.len() == 1 && rest.bytes().all(|byte| (b'1'..=b'9').contains(&byte))
        });
        if is_numbered || DEVICES.contains(&device.as_str()) {
            stem.insert(0, '_');
        }
        FileStem(if stem.is_empty() { "chart".to_owned() } else { stem })
    }

    /// The stem itself.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The suffixes after a stem in C: `STEM_port.h`, `STEM_user.c` and `STEM_tables.c` are further files of a design.
    const OF_C: [&str; 3] = ["_port", "_user", "_tables"];

    /// True if the design with the longer stem would write a C file that the design with the shorter one also writes. For example, `lamp_port.h` is the port of
    /// `lamp` and the header of `lamp_port`.
    #[must_use]
    pub fn meets_in_c(&self, other: &FileStem) -> bool {
        let (one, two) = (self.key(), other.key());
        let is_further = |long: &str, short: &str| {
            long.strip_prefix(short).is_some_and(|ending| Self::OF_C.contains(&ending))
        };
        is_further(&one, &two) || is_further(&two, &one)
    }

    /// The stem as an identifier: the name of a chart whose language has no names for charts.
    #[must_use]
    pub fn identifier(&self) -> String {
        Namer::new(&GRAF).name(&self.0.replace(['.', '-', '+'], "_"))
    }

    /// The key by which two stems must differ: folders of Windows and macOS do not distinguish capital and small letters.
    #[must_use]
    pub fn key(&self) -> String {
        self.0.to_lowercase()
    }
}

impl std::fmt::Display for FileStem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::FileStem;

    #[test]
    fn a_stem_is_a_name_for_every_file_system_and_tool() {
        for (path, stem) in [
            ("lamp.graf", "lamp"),
            ("a/b.c/lamp.v2.graf", "lamp.v2"),
            (r"C:\charts\lamp.graf", "lamp"),
            ("größe.rules", "größe"),
            ("two words.st", "two_words"),
            ("a$(b)&c.st", "a__b__c"),
            ("-o.graf", "_o"),
            (".graf", "_graf"),
            ("..", "_"),
            ("CON.graf", "_CON"),
            ("com1.x.graf", "_com1.x"),
            ("company.graf", "company"),
            ("a\u{202e}b.graf", "a_b"),
            ("", "chart"),
        ] {
            assert_eq!(FileStem::of_path(path).unwrap().as_str(), stem, "{path}");
        }
        let long = FileStem::of_name(&"ö".repeat(300));
        assert_eq!(long.as_str().len(), 200);
    }

    #[test]
    fn a_chart_without_a_name_is_called_as_its_file() {
        for (path, name) in [
            ("lamp.rules", "lamp"),
            ("größe.rules", "größe"),
            ("a-b.c.kiss2", "a_b_c"),
            ("2nd.kiss2", "x2nd"),
            ("step.rules", "step_"),
        ] {
            assert_eq!(FileStem::of_path(path).unwrap().identifier(), name, "{path}");
        }
    }
}
