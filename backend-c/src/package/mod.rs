//! The emitted C as a folder that an ecosystem accepts unchanged: a Makefile, an Arduino library, a PlatformIO library, a CMake package.
//!
//! ```text
//! Package (STEM.h, STEM.c, ..)  ──► plain       Makefile, example/host.c, example/board.c
//!                                   cmake       CMakeLists.txt, include/, src/, example/
//!                                   arduino     library.properties, src/, examples/NAME/NAME.ino
//!                                   platformio  library.json, include/, src/, examples/NAME/
//! ```
//! A package adds text around the same C files; each ecosystem has one file in this folder. The chart's names in C come from the interface of the
//! [`Package`], so that examples fit every style and option. Files that the user is expected to change (`STEM_user.c`, the examples with their pins) are
//! the user's: [`File::keep_existing`].

mod arduino;
mod board;
mod cmake;
mod host;
mod plain;
mod platformio;
mod ticks;

use crate::{File, FileKind, Package, codes};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::names::is_unseen;
use grafsynth_ir::net::{InputKind, Net};

/// The ecosystem that a folder of C is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ecosystem {
    /// A folder with a Makefile for gcc, clang, avr-gcc, arm-none-eabi-gcc and sdcc.
    Plain,
    /// A library of the Arduino IDE and `arduino-cli`.
    Arduino,
    /// A library of PlatformIO.
    Platformio,
    /// A CMake project, for `add_subdirectory` and `find_package`.
    Cmake,
}

impl Ecosystem {
    /// All ecosystems.
    pub const ALL: [Ecosystem; 4] =
        [Ecosystem::Plain, Ecosystem::Arduino, Ecosystem::Platformio, Ecosystem::Cmake];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Ecosystem::Plain => "plain",
            Ecosystem::Arduino => "arduino",
            Ecosystem::Platformio => "platformio",
            Ecosystem::Cmake => "cmake",
        }
    }

    /// The ecosystem with that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Ecosystem::ALL.into_iter().find(|it| it.name() == name)
    }
}

/// The files of a chart in C laid out for an ecosystem, all in one folder `STEM-ECOSYSTEM`; their names have that folder in front, with `/`.
///
/// # Errors
/// If the chart's header or library functions would hide names of C or of Arduino (G0610).
pub fn files(
    net: &Net,
    package: &Package,
    ecosystem: Ecosystem,
) -> Result<Vec<File>, Vec<Diagnostic>> {
    let refusals = refusals(net, package, ecosystem);
    if !refusals.is_empty() {
        return Err(refusals);
    }
    let chart = Chart { net, package };
    let mut files = match ecosystem {
        Ecosystem::Plain => plain::files(&chart),
        Ecosystem::Arduino => arduino::files(&chart),
        Ecosystem::Platformio => platformio::files(&chart),
        Ecosystem::Cmake => cmake::files(&chart),
    };
    let folder = format!("{}-{}", chart.stem(), ecosystem.name());
    for file in &mut files {
        file.name = format!("{folder}/{}", file.name);
    }
    Ok(files)
}

/// The data from which the texts of a package are written.
struct Chart<'a> {
    net: &'a Net,
    package: &'a Package,
}

impl Chart<'_> {
    /// The chart's name in C.
    fn name(&self) -> &str {
        &self.package.interface.names.prefix
    }

    /// The prefix of the names of the C files.
    fn stem(&self) -> &str {
        self.package.stem()
    }

    /// The chart's name in C, in capitals.
    fn upper(&self) -> &str {
        &self.package.interface.names.upper
    }

    /// A description of the chart in one line: its label, or its name.
    fn about(&self) -> String {
        let label = self.net.parts.values().map(|part| part.meta.label.as_str());
        let label = label.into_iter().find(|label| !label.is_empty()).unwrap_or_default();
        let text = if label.is_empty() { &self.net.name.text } else { label };
        let plain: String = text.chars().map(|c| if is_unseen(c) { ' ' } else { c }).collect();
        plain.trim().to_owned()
    }

    /// The C files in a folder for headers and one for sources.
    fn c_files(&self, headers: &str, sources: &str) -> Vec<File> {
        let moved = |file: &File| File {
            name: format!("{}{}", if file.kind.is_source() { sources } else { headers }, file.name),
            ..file.clone()
        };
        self.package.files.iter().map(moved).collect()
    }

    /// The names of the `.c` files (`true`) or of the headers.
    fn names_of(&self, sources: bool) -> Vec<&str> {
        let files = self.package.files.iter();
        files
            .filter(|file| file.kind.is_source() == sources)
            .map(|file| file.name.as_str())
            .collect()
    }

    /// True for a chart with functions that the user must fill in.
    fn has_library(&self) -> bool {
        self.package.files.iter().any(|file| file.keep_existing)
    }

    /// The part of the README that every package has after its own text.
    fn readme(&self, head: &str) -> String {
        let mut text = format!("# {}\n\n", self.name());
        let about = self.about();
        if about != self.name() {
            text += &format!("{}\n\n", about.replace(['<', '>', '`'], "'"));
        }
        text += head;
        text += "\n## Files\n\n| file | contents |\n|---|---|\n";
        let (name, stem) = (self.name(), self.stem());
        text += &format!(
            "| `{stem}.h`, `{stem}.c` | the chart: inputs, outputs, `{name}_init`, `{name}_step`; regenerated by each build |\n"
        );
        text += &format!(
            "| `{stem}_port.h` | the machine-dependent parts; every macro can be defined beforehand |\n"
        );
        if self.has_library() {
            text += &format!(
                "| `{stem}_user.h`, `{stem}_user.c` | the functions of your library; `{stem}_user.c` is yours and is never overwritten |\n"
            );
        }
        text += "\nThe examples are yours too: they are written only if they do not exist.\n";
        text
    }
}

/// A text with each `@KEY@` replaced.
fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut text = template.to_owned();
    for (key, value) in values {
        text = text.replace(&format!("@{key}@"), value);
    }
    text
}

/// A file that is rewritten by each build.
fn written(name: impl Into<String>, text: impl Into<String>) -> File {
    File {
        name: name.into(),
        text: text.into(),
        keep_existing: false,
        map: Vec::new(),
        kind: FileKind::Other,
    }
}

/// A file that belongs to the user.
fn yours(name: impl Into<String>, text: impl Into<String>) -> File {
    File { keep_existing: true, ..written(name, text) }
}

/// Headers of C99 and C11 without `.h`: a header of the chart with such a name on the include path would be read instead. Sorted.
const C_HEADERS: [&str; 29] = [
    "assert",
    "complex",
    "ctype",
    "errno",
    "fenv",
    "float",
    "inttypes",
    "iso646",
    "limits",
    "locale",
    "math",
    "setjmp",
    "signal",
    "stdalign",
    "stdarg",
    "stdatomic",
    "stdbool",
    "stddef",
    "stdint",
    "stdio",
    "stdlib",
    "stdnoreturn",
    "string",
    "strings",
    "tgmath",
    "threads",
    "time",
    "uchar",
    "wchar",
];

/// Headers of Arduino cores, in lower case. Sorted.
const ARDUINO_HEADERS: [&str; 15] = [
    "arduino",
    "binary",
    "client",
    "eeprom",
    "ethernet",
    "hardwareserial",
    "pins_arduino",
    "print",
    "printable",
    "server",
    "servo",
    "spi",
    "stream",
    "wire",
    "wstring",
];

/// Functions of Arduino cores with C linkage, which a user library cannot define again. Sorted.
const ARDUINO_FUNCTIONS: [&str; 23] = [
    "analogRead",
    "analogReference",
    "analogWrite",
    "attachInterrupt",
    "delay",
    "delayMicroseconds",
    "detachInterrupt",
    "digitalRead",
    "digitalWrite",
    "init",
    "initVariant",
    "interrupts",
    "loop",
    "micros",
    "millis",
    "noInterrupts",
    "pinMode",
    "pulseIn",
    "setup",
    "shiftIn",
    "shiftOut",
    "tone",
    "yield",
];

fn refusals(net: &Net, package: &Package, ecosystem: Ecosystem) -> Vec<Diagnostic> {
    let names = &package.interface.names;
    let is_arduino = matches!(ecosystem, Ecosystem::Arduino | Ecosystem::Platformio);
    let mut found = Vec::new();
    // Folders of Windows and macOS do not distinguish capital and small letters.
    let stem = names.stem.to_ascii_lowercase();
    let hidden = if C_HEADERS.binary_search(&stem.as_str()).is_ok() {
        Some("C")
    } else if is_arduino && ARDUINO_HEADERS.binary_search(&stem.as_str()).is_ok() {
        Some("Arduino")
    } else {
        None
    };
    if let Some(whose) = hidden {
        let message = format!(
            "the header `{}.h` of this chart would hide a header of {whose} in the {} package (some systems ignore letter case in file names)",
            names.stem,
            ecosystem.name()
        );
        found.push(
            Diagnostic::error(codes::PACKAGE_REFUSED, message)
                .at(net.name.span, "this chart")
                .help("give its file another name"),
        );
    }
    if !is_arduino {
        return found;
    }
    let conditions = net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Extern);
    let actions = net.outputs.iter().filter(|(_, it)| it.is_extern());
    let functions = conditions
        .map(|(id, it)| (&names.inputs[id], it.name.span))
        .chain(actions.map(|(id, it)| (&names.outputs[id], it.name.span)));
    for (function, span) in functions {
        if ARDUINO_FUNCTIONS.binary_search(&function.as_str()).is_ok() {
            let message = format!(
                "`{function}` is a function of Arduino, so an Arduino library cannot define it again"
            );
            found.push(
                Diagnostic::error(codes::PACKAGE_REFUSED, message)
                    .at(span, "declared here")
                    .help("give it another name in the chart"),
            );
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_sorted_as_they_are_searched() {
        assert!(
            C_HEADERS.is_sorted() && ARDUINO_HEADERS.is_sorted() && ARDUINO_FUNCTIONS.is_sorted()
        );
    }
}
