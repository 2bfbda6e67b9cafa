//! The folders of `build --package`, built by the tools that they are made for, and run if possible.
//!
//! A missing tool is skipped with a message; if `CI` is set in the environment, it is a failure. Arduino's core is a stub of our own
//! (`tests/arduino`): the test shows that a sketch is C++11 without warnings and runs, not that it works with the real Arduino core.

#![allow(clippy::disallowed_methods, reason = "tests write files for tools")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_backend_c::package::{Ecosystem, files};
use grafsynth_backend_c::{File, Io, Options, Package, Style, emit};
use grafsynth_driver::run::net_trace;
use grafsynth_engines::tools;
use grafsynth_ir::Valid;
use grafsynth_ir::net::{InputKind, Net};
use grafsynth_sim::{Stimulus, Trace};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, rounds};
use grafsynth_verify::structural_facts;
use itertools::Itertools as _;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

const LIMIT: Duration = Duration::from_secs(120);

/// Charts with difficult features for packages, and the options to build them with.
fn designs() -> Vec<(&'static str, Valid<Net>, Options)> {
    let default = Options::default;
    let truck = include_str!("../../examples/truck/truck.graf");
    let oven = include_str!("../../examples/microwave/oven.graf");
    let numbers = "chart `é` \"100% of [it]: a $ sign, a # and \\\"quotes\\\"\" {\n tick 1 ms\n input n: int -5..300, `X`\n output int: int 0..1000, `é_2`\n var k: int 0..1000\n \
        initial step a\n step b { `é_2` }\n a -> b when n > 3 and `X` do { k := k + n }\n b -> a after 20 ms\n a -> a when k > 900 do { k := 0; int := k }\n}\n";
    let library = "chart int {\n tick 3 us\n extern condition black\n extern action speed(int 0..9)\n event go\n input m\n output lamp\n \
        initial step a { speed(3) }\n step b { lamp }\n a -> b on go when black\n b -> a when m after 1 ms\n}\n";
    let parts = "chart left {\n input a\n output x\n initial step s\n step t { x }\n s -> t when a\n t -> s when not a\n}\n\
        chart X {\n input b\n output y\n initial step s\n step t { y }\n s -> t when b and left.t.active\n t -> s when not b\n}\n";
    let only_events = "chart toggle {\n event push\n output lamp\n initial step off\n step on { lamp }\n off -> on on push\n on -> off on push\n}\n";
    let mill = "chart mill {\n tick 1 ms\n input a, n: int 0..9\n output x\n initial step s\n step t { x }\n s -> t when a and n > 3\n t -> s after 5 ms\n}\n";
    vec![
        ("truck", chart("truck.graf", truck), default()),
        ("oven", chart("oven.graf", oven), default()),
        ("numbers", chart("numbers.graf", numbers), Options { gate: true, ..default() }),
        ("library", chart("library.graf", library), default()),
        ("parts", chart("parts.graf", parts), Options { io: Io::Words, ..default() }),
        ("toggle", chart("toggle.graf", only_events), Options { trace: Some(4), ..default() }),
        ("engine", chart("mill.graf", mill), Options { style: Style::Engine, ..default() }),
        (
            "words",
            chart("oven.graf", oven),
            Options { io: Io::Words, style: Style::Bits, ..default() },
        ),
    ]
}

fn package(net: &Valid<Net>, options: &Options) -> Package {
    emit(net, &structural_facts(net), options).unwrap_or_else(|found| panic!("{found:#?}"))
}

fn laid_out(net: &Valid<Net>, options: &Options, ecosystem: Ecosystem) -> Vec<File> {
    files(net, &package(net, options), ecosystem).unwrap_or_else(|found| panic!("{found:#?}"))
}

/// Writes a package; returns the temporary folder and the package's own folder in it.
fn written(net: &Valid<Net>, options: &Options, ecosystem: Ecosystem) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut root = String::new();
    for file in laid_out(net, options, ecosystem) {
        let path = folder.path().join(&file.name);
        root = file.name.split('/').next().expect("a folder").to_owned();
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("it is made");
        std::fs::write(path, &file.text).expect("it is written");
    }
    let root = folder.path().join(root);
    (folder, root)
}

/// True if the tool is available; reports it if not.
fn is_here(tool: &str) -> bool {
    let found = tools::find(&[tool]).is_some();
    if !found {
        assert!(std::env::var_os("CI").is_none(), "{tool} is missing, and CI must have it");
        println!("skipped: {tool} is not installed");
    }
    found
}

/// Runs a tool that must succeed; returns its standard output.
fn run(folder: &Path, tool: &str, arguments: &[&str], input: &[u8]) -> Vec<u8> {
    let program = if tool.contains('/') {
        PathBuf::from(tool)
    } else {
        tools::find(&[tool]).expect("the caller looked for it")
    };
    let run = tools::run(&program, arguments, folder, input, LIMIT).expect("it runs");
    assert!(
        run.is_success,
        "{tool} {arguments:?}: {}\n{}\n{}",
        run.ending,
        String::from_utf8_lossy(&run.stdout),
        run.stderr
    );
    run.stdout
}

/// The rows of a stimulus as an example reads them: ticks if the chart has time, then pins and events.
fn rows(net: &Valid<Net>, has_time: bool, stimulus: &Stimulus) -> String {
    let mut text = String::new();
    for row in stimulus.rows() {
        if has_time {
            let _ = write!(text, "{} ", row.dt);
        }
        for (id, _) in net.inputs.iter().filter(|(_, it)| it.kind.is_handed()) {
            let _ = write!(text, "{} ", row.value(id));
        }
        text.push('\n');
    }
    text
}

/// The columns of a trace that an example prints.
fn expected(net: &Valid<Net>, trace: &Trace) -> String {
    let wanted = |name: &str| {
        name == "scan" || name == "steps" || net.outputs.values().any(|it| it.name.text == name)
    };
    let columns = || trace.layout.columns.iter().enumerate().filter(|(_, it)| wanted(&it.name));
    let mut lines = vec![columns().map(|(_, it)| it.name.clone()).join(",")];
    for row in &trace.rows {
        lines.push(columns().map(|(at, _)| trace.layout.text(&row.values[at])).join(","));
    }
    lines.join("\n") + "\n"
}

/// Checks that the example prints the same as the simulator.
fn check_rows(net: &Valid<Net>, options: &Options, program: &Path) {
    let stimulus = Stimulus::random(net, 200, 7, 3);
    let package = package(net, options);
    let has_time = package.files.iter().any(|file| file.text.contains("_TICK_NS "));
    let printed = run(
        program.parent().expect("a folder"),
        &program.display().to_string(),
        &[],
        rows(net, has_time, &stimulus).as_bytes(),
    );
    assert_eq!(String::from_utf8_lossy(&printed), expected(net, &net_trace(net, &stimulus)));
}

fn has_library(net: &Net) -> bool {
    net.inputs.values().any(|it| it.kind == InputKind::Extern)
}

#[test]
fn the_plain_folder_is_made_by_each_compiler() {
    if !is_here("make") {
        return;
    }
    for (at, (name, net, options)) in designs().into_iter().enumerate() {
        let (_folder, root) = written(&net, &options, Ecosystem::Plain);
        // One of the cross compilers for each chart; all of them for the first chart, and for all charts in deep tests.
        let others = ["clang", "avr", "arm", "sdcc"];
        let is_asked = |index: usize| at == 0 || rounds(1, 2) > 1 || at % others.len() == index;
        let asked =
            others.iter().enumerate().filter(|(index, _)| is_asked(*index)).map(|(_, it)| *it);
        for toolchain in std::iter::once("gcc").chain(asked) {
            let tool = match toolchain {
                "avr" => "avr-gcc",
                "arm" => "arm-none-eabi-gcc",
                other => other,
            };
            // The engine's check of an image is too large for an 8051, and its tables need no separate test.
            if !is_here(tool) {
                continue;
            }
            let flag = format!("TOOLCHAIN={toolchain}");
            let strict = if toolchain == "sdcc" { "CFLAGS=" } else { "CFLAGS=-Werror" };
            run(&root, "make", &["-s", &flag, strict], b"");
            run(&root, "make", &["-s", &flag, strict, "size"], b"");
            let build = root.join("build").join(toolchain);
            let image = std::fs::read_dir(&build).expect("a folder").any(|entry| {
                let path = entry.expect("an entry").path();
                path.extension().is_some_and(|it| it == "hex" || it == "bin")
            });
            let is_host = matches!(toolchain, "gcc" | "clang");
            assert_eq!(image, !is_host, "{name}: an image for {toolchain}");
            if is_host && !has_library(&net) {
                let prefix = root
                    .file_name()
                    .and_then(|it| it.to_str())
                    .and_then(|it| it.strip_suffix("-plain"));
                check_rows(&net, &options, &build.join(prefix.expect("a folder NAME-plain")));
            }
        }
        let dry = run(
            &root,
            "make",
            &["-n", "TOOLCHAIN=avr", "MCU=attiny85", "PROGRAMMER=usbtiny", "flash"],
            b"",
        );
        assert!(
            String::from_utf8_lossy(&dry).contains("avrdude -p attiny85 -c usbtiny"),
            "{}",
            String::from_utf8_lossy(&dry)
        );
    }
}

#[test]
fn random_charts_print_their_traces_from_the_plain_folder() {
    if !is_here("make") || !is_here("gcc") {
        return;
    }
    let features = Features {
        externs: false,
        unspecified: false,
        assumptions: false,
        ..Features::everything()
    };
    for seed in 0..rounds(2, 40) {
        let net = random_net(seed, &features);
        let options = Options::default();
        // Names that C's headers define are rejected, and charts that C does not support do not matter here.
        let Ok(emitted) = emit(&net, &structural_facts(&net), &options) else { continue };
        if files(&net, &emitted, Ecosystem::Plain).is_err() {
            continue;
        }
        let (_folder, root) = written(&net, &options, Ecosystem::Plain);
        run(&root, "make", &["-s", "CFLAGS=-Werror -O0"], b"");
        let prefix =
            root.file_name().and_then(|it| it.to_str()).and_then(|it| it.strip_suffix("-plain"));
        check_rows(
            &net,
            &options,
            &root.join("build/gcc").join(prefix.expect("a folder NAME-plain")),
        );
    }
}

#[test]
fn the_cmake_project_builds_and_is_found() {
    if !is_here("cmake") || !is_here("make") {
        return;
    }
    let flags = "-DCMAKE_C_FLAGS=-Wall -Wextra -pedantic -Wconversion -Werror";
    for (_, net, options) in designs().into_iter().take(rounds(2, 8) as usize) {
        let (folder, root) = written(&net, &options, Ecosystem::Cmake);
        let name = root
            .file_name()
            .and_then(|it| it.to_str())
            .and_then(|it| it.strip_suffix("-cmake"))
            .expect("a folder NAME-cmake")
            .to_owned();
        run(&root, "cmake", &["-S", ".", "-B", "build", flags], b"");
        run(&root, "cmake", &["--build", "build"], b"");
        run(&root, "cmake", &["--install", "build", "--prefix", "../installed"], b"");
        if !has_library(&net) {
            check_rows(&net, &options, &root.join(format!("build/{name}_host")));
        }
        // A user's project is built twice: once with the folder and once after installation.
        let user = folder.path().join("user");
        std::fs::create_dir(&user).expect("it is made");
        std::fs::write(
            user.join("main.c"),
            format!("#include <{name}.h>\nint main(void)\n{{\n    return 0;\n}}\n"),
        )
        .expect("it is written");
        let ways = [
            ("inside", format!("add_subdirectory(../{name}-cmake {name})")),
            ("found", format!("find_package({name} 1.0 REQUIRED)")),
        ];
        for (way, line) in ways {
            let project = format!(
                "cmake_minimum_required(VERSION 3.14)\nproject(user C)\n{line}\nadd_executable(user main.c)\ntarget_link_libraries(user PRIVATE {name}::{name})\n"
            );
            std::fs::write(user.join("CMakeLists.txt"), project).expect("it is written");
            let prefix =
                format!("-DCMAKE_PREFIX_PATH={}", folder.path().join("installed").display());
            run(&user, "cmake", &["-S", ".", "-B", way, &prefix, flags], b"");
            run(&user, "cmake", &["--build", way], b"");
        }
    }
}

/// Compiles a sketch as C++11 with a stub of Arduino's core, links it with the library's C and runs it.
fn run_sketch(root: &Path, sketch: &Path, sources: &Path, headers: &Path) {
    let stub = Path::new(env!("CARGO_MANIFEST_DIR")).join("arduino");
    let stub = stub.canonicalize().expect("tests/arduino is there");
    let (include, headers) = (format!("-I{}", stub.display()), format!("-I{}", headers.display()));
    let strict = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-c"];
    let sketch = sketch.display().to_string();
    let main = stub.join("stub.cpp").display().to_string();
    let mut objects = vec!["sketch.o".to_owned(), "stub.o".to_owned()];
    let as_sketch = [
        "-std=c++11",
        "-pedantic",
        "-x",
        "c++",
        "-include",
        "Arduino.h",
        &include,
        &headers,
        &sketch,
        "-o",
        "sketch.o",
    ];
    run(root, "g++", &[&strict[..], &as_sketch].concat(), b"");
    run(root, "g++", &["-std=c++11", "-c", &include, &main, "-o", "stub.o"], b"");
    for entry in std::fs::read_dir(sources).expect("sources") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|it| it == "c") {
            let object = format!("{}.o", path.file_stem().expect("a name").to_string_lossy());
            run(
                root,
                "gcc",
                &[&strict[..], &["-std=c11", &headers, &path.display().to_string(), "-o", &object]]
                    .concat(),
                b"",
            );
            objects.push(object);
        }
    }
    let mut link: Vec<&str> = objects.iter().map(String::as_str).collect();
    link.extend(["-o", "sketch"]);
    run(root, "g++", &link, b"");
    run(root, &root.join("sketch").display().to_string(), &[], b"");
    if is_here("avr-g++") {
        let machine =
            ["-mmcu=atmega328p", "-std=gnu++11", "-Os", "-Wall", "-Wextra", "-Werror", "-c"];
        let as_sketch =
            ["-x", "c++", "-include", "Arduino.h", &include, &headers, &sketch, "-o", "avr.o"];
        run(root, "avr-g++", &[&machine[..], &as_sketch].concat(), b"");
    }
}

#[test]
fn the_arduino_library_keeps_to_the_specification() {
    if !is_here("gcc") || !is_here("g++") {
        return;
    }
    for (at, (design, net, options)) in designs().into_iter().enumerate() {
        let (_folder, root) = written(&net, &options, Ecosystem::Arduino);
        let text = std::fs::read_to_string(root.join("library.properties")).expect("it is there");
        let fields: Vec<(&str, &str)> =
            text.lines().map(|line| line.split_once('=').expect("name=value")).collect();
        let field = |name: &str| {
            let mut found = fields.iter().filter(|(known, _)| *known == name);
            let (Some((_, value)), None) = (found.next(), found.next()) else {
                panic!("{design}: one `{name}`")
            };
            assert!(!value.trim().is_empty(), "{design}: `{name}` is empty");
            *value
        };
        let required = [
            "name",
            "version",
            "author",
            "maintainer",
            "sentence",
            "paragraph",
            "category",
            "url",
            "architectures",
        ];
        required.iter().for_each(|name| _ = field(name));
        let name = field("name");
        assert!(
            name.len() <= 63
                && name.chars().all(|c| c.is_ascii_alphanumeric() || " _.-".contains(c)),
            "{name}"
        );
        assert!(
            name.starts_with(|c: char| c.is_ascii_alphanumeric())
                && name.contains(|c: char| c.is_ascii_alphabetic())
        );
        assert!(
            field("version").split('.').filter(|part| part.parse::<u32>().is_ok()).count() == 3
        );
        assert_eq!(field("category"), "Device Control");
        assert!(field("url").starts_with("https://"));
        let header = field("includes");
        assert!(root.join("src").join(header).is_file(), "{design}: {header}");
        let stem = header.strip_suffix(".h").expect("a header");
        let sketch = root.join(format!("examples/{stem}/{stem}.ino"));
        // Half of the charts, and the others only in deep tests: each chart takes four runs of a compiler.
        if at % 2 == 0 || rounds(1, 2) > 1 {
            run_sketch(&root, &sketch, &root.join("src"), &root.join("src"));
        }
    }
}

#[test]
fn the_platformio_library_has_a_manifest_and_an_example() {
    if !is_here("gcc") || !is_here("g++") {
        return;
    }
    for (at, (design, net, options)) in designs().into_iter().enumerate() {
        let (_folder, root) = written(&net, &options, Ecosystem::Platformio);
        let text = std::fs::read_to_string(root.join("library.json")).expect("it is there");
        let manifest: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
        let name = manifest["name"].as_str().expect("a name");
        assert!(
            name.len() <= 50 && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-'),
            "{name}"
        );
        assert_eq!(manifest["version"], "1.0.0");
        let about = manifest["description"].as_str().expect("a description");
        assert!(!about.is_empty() && about.chars().count() <= 255, "{design}");
        assert_eq!(manifest["frameworks"], "*");
        assert_eq!(manifest["platforms"], "*");
        assert_eq!(manifest["build"]["srcDir"], "src");
        assert_eq!(manifest["build"]["includeDir"], "include");
        for header in manifest["headers"].as_array().expect("headers") {
            assert!(root.join("include").join(header.as_str().expect("a name")).is_file());
        }
        let example = &manifest["examples"][0];
        let base = root.join(example["base"].as_str().expect("a folder"));
        for file in example["files"].as_array().expect("files") {
            assert!(base.join(file.as_str().expect("a name")).is_file(), "{design}: {file}");
        }
        let project = std::fs::read_to_string(base.join("platformio.ini")).expect("it is there");
        for environment in ["[env:native]", "[env:uno]", "[env:bluepill]"] {
            assert!(project.lines().any(|line| line == environment), "{design}: {environment}");
        }
        let (sources, headers) = (root.join("src"), root.join("include"));
        if at == 0 || rounds(1, 2) > 1 {
            run_sketch(&root, &base.join("src/arduino.cpp"), &sources, &headers);
        }
        if !has_library(&net) {
            let include = format!("-I{}", headers.display());
            let mut arguments = vec![
                "-std=c99",
                "-Wall",
                "-Wextra",
                "-pedantic",
                "-Werror",
                include.as_str(),
                "-o",
                "native",
            ];
            let host = base.join("src/host.c").display().to_string();
            let sources: Vec<String> = std::fs::read_dir(sources)
                .expect("sources")
                .map(|it| it.expect("an entry").path().display().to_string())
                .collect();
            arguments.extend(sources.iter().map(String::as_str));
            arguments.push(&host);
            run(&root, "gcc", &arguments, b"");
            check_rows(&net, &options, &root.join("native"));
        }
    }
}

#[test]
fn names_of_an_ecosystem_are_refused_in_it_alone() {
    let timed = |name: &str| {
        chart(
            "chart.graf",
            &format!(
                "chart `{name}` {{\n input a\n output x\n initial step s\n step t {{ x }}\n s -> t when a\n}}\n"
            ),
        )
    };
    let refused = |net: &Valid<Net>, ecosystem| match files(
        net,
        &package(net, &Options::default()),
        ecosystem,
    ) {
        Ok(_) => false,
        Err(found) => {
            assert!(found.iter().all(|it| it.code.id == "G0610"), "{found:?}");
            true
        }
    };
    for ecosystem in Ecosystem::ALL {
        let is_arduino = matches!(ecosystem, Ecosystem::Arduino | Ecosystem::Platformio);
        assert!(refused(&timed("String"), ecosystem));
        assert_eq!(refused(&timed("Servo"), ecosystem), is_arduino);
        assert!(!refused(&timed("truck"), ecosystem));
        let library = chart(
            "chart.graf",
            "chart c {\n extern condition shiftIn\n initial step s\n step t\n s -> t when shiftIn\n}\n",
        );
        assert_eq!(refused(&library, ecosystem), is_arduino);
    }
}

/// The files that the user fills in are marked as the user's; no other file is.
#[test]
fn the_files_of_the_user_are_kept() {
    for (design, net, options) in designs() {
        for ecosystem in Ecosystem::ALL {
            for file in laid_out(&net, &options, ecosystem) {
                let is_example = file.name.contains("/example");
                let is_library = file.name.ends_with("_user.c");
                assert_eq!(file.keep_existing, is_example || is_library, "{design}: {}", file.name);
                // A placeholder that was not replaced: `@NAME@`.
                let is_open = file
                    .text
                    .split('@')
                    .skip(1)
                    .any(|part| part.len() > 2 && part.chars().all(|c| c.is_ascii_uppercase()));
                assert!(!is_open, "{design}: {} still has a placeholder", file.name);
            }
        }
    }
}
