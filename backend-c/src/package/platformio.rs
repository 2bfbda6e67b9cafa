//! A library of PlatformIO: `library.json`, `include/`, `src/`, and an example project for this machine, an Uno and a Blue Pill.

use super::cmake::VERSION;
use super::{Chart, arduino, fill, host, written, yours};
use crate::File;

pub(super) fn files(chart: &Chart<'_>) -> Vec<File> {
    let name = chart.name();
    let mut files = chart.c_files("include/", "src/");
    files.push(written("library.json", manifest(chart)));
    files.push(written("README.md", chart.readme(&head(chart))));
    let example = format!("examples/{name}");
    files.push(yours(format!("{example}/platformio.ini"), fill(PROJECT, &[("NAME", name)])));
    files.push(yours(
        format!("{example}/src/arduino.cpp"),
        format!("#include <Arduino.h>\n\n{}", arduino::sketch(chart)),
    ));
    files.push(yours(
        format!("{example}/src/host.c"),
        host::text(chart, &format!("<{}.h>", chart.stem())),
    ));
    files
}

const PROJECT: &str = "; @NAME@: `pio run` builds the native program and the firmware for the Uno, `pio run -e uno -t upload` writes to a board.
; The native program reads a reaction from each line of standard input: .pio/build/native/program < rows

[platformio]
default_envs = native, uno

[env]
lib_deps = symlink://../..

[env:native]
platform = native
build_src_filter = +<host.c>

[env:uno]
platform = atmelavr
board = uno
framework = arduino
build_src_filter = +<arduino.cpp>

[env:bluepill]
platform = ststm32
board = bluepill_f103c8
framework = arduino
build_src_filter = +<arduino.cpp>
";

/// The manifest. The registry's limits: 50 characters for a name of letters, digits and dashes, 255 for the description.
fn manifest(chart: &Chart<'_>) -> String {
    let name = chart.name();
    let title: String = name.replace('_', "-").trim_matches('-').chars().take(50).collect();
    let about: String = chart.about().chars().take(255).collect();
    let headers: Vec<String> = chart.names_of(false).iter().map(|it| quoted(it)).collect();
    let home = env!("CARGO_PKG_REPOSITORY");
    format!(
        "{{\n  \"$schema\": \"https://raw.githubusercontent.com/platformio/platformio-core/develop/platformio/assets/schema/library.json\",\n  \
         \"name\": {},\n  \"version\": \"{VERSION}\",\n  \"description\": {},\n  \"keywords\": [\"controller\", \"chart\", \"state machine\"],\n  \"homepage\": \"{home}\",\n  \
         \"frameworks\": \"*\",\n  \"platforms\": \"*\",\n  \"headers\": [{}],\n  \"build\": {{ \"srcDir\": \"src\", \"includeDir\": \"include\" }},\n  \
         \"examples\": [\n    {{\n      \"name\": {},\n      \"base\": \"examples/{name}\",\n      \"files\": [\"platformio.ini\", \"src/arduino.cpp\", \"src/host.c\"]\n    }}\n  ]\n}}\n",
        quoted(&title),
        quoted(&about),
        headers.join(", "),
        quoted(name),
    )
}

fn head(chart: &Chart<'_>) -> String {
    let name = chart.name();
    format!(
        "A library for PlatformIO. In the `platformio.ini` of your project: `lib_deps = symlink://path/to/{name}-platformio`. The project in `examples/{name}` builds for this machine, an \
         Arduino Uno and a Blue Pill; the table of pins is at the top of `src/arduino.cpp`.\n\n```text\ncd examples/{name}\npio run                       builds\npio run -e uno -t upload      writes to the board\n```\n"
    )
}

/// A string of JSON.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => {
                out.push('\\');
                out.push(c);
            }
            c if c.is_control() => out.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
