//! The C code of a chart's author never runs on this machine unless the command line permits it.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A chart with C code in each kind of place; each text leaves a file behind when it runs.
fn chart(marker: &Path) -> String {
    let code = |place: &str| {
        let shell = format!("touch {}.{place}", marker.display());
        format!(r#"code c "extern int system(const char *); (void)system(\"{shell}\");""#)
    };
    format!(
        "chart lamp {{
    input dark
    output lit
    var n: int 0..3
    initial step off {{
        {level}
        entry {{
            {entry}
            n := 0
        }}
        exit {{
            if n == 0 {{
                {branch}
            }}
        }}
    }}
    step on {{
        lit
    }}
    off -> on when dark do {{
        {fired}
    }}
    on -> off when not dark
}}
",
        level = code("level"),
        entry = code("entry"),
        branch = code("branch"),
        fired = code("fired"),
    )
}

fn grafsynth(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .output()
        .expect("grafsynth starts")
}

/// The names of the marks (files `ran.NAME`) that code from the texts created; the files are then removed.
fn marks(folder: &Path) -> Vec<String> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if let Some(place) = name.strip_prefix("ran.") {
            all.push(place.to_owned());
            fs::remove_file(path).expect("it is removed");
        }
    }
    all.sort();
    all
}

#[test]
fn foreign_c_runs_only_where_it_is_trusted() {
    if grafsynth_engines::tools::c_compiler().is_none() {
        assert!(std::env::var_os("CI").is_none(), "CI must have a C compiler");
        println!("skipped: no C compiler is installed");
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    fs::write(folder.join("lamp.graf"), chart(&folder.join("ran"))).expect("it is written");
    let all = ["branch", "entry", "fired", "level"];
    let builds = ["c", "c-bits", "c-program"].map(|target| {
        ["build", "lamp.graf", "--target", target, "-o", "out"].map(str::to_owned).to_vec()
    });
    let runs =
        ["sim lamp.graf --random 50 --engine c", "compare lamp.graf --random 50 --engines c"];
    let runs = runs.map(|run| run.split(' ').map(str::to_owned).collect());
    for run in builds.into_iter().chain(runs) {
        let mut arguments: Vec<&str> = run.iter().map(String::as_str).collect();
        let output = grafsynth(folder, &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned()
            + &String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {said}");
        assert_eq!(marks(folder), Vec::<String>::new(), "{arguments:?}");
        assert!(
            said.contains("[G0016]")
                && said.contains("4 blocks of C code in the chart are left out"),
            "{said}"
        );
        if arguments[0] == "build" {
            let line = "without the chart's own C (see --trust-code)";
            assert!(said.contains(line), "{arguments:?}: {said}");
            let text = fs::read_to_string(folder.join("out/lamp.c")).expect("it was written");
            for place in all {
                assert!(
                    text.contains(&format!("ran.{place}")),
                    "{arguments:?}: {place} is missing"
                );
            }
        }
        arguments.push("--trust-code");
        let output = grafsynth(folder, &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned()
            + &String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {said}");
        assert_eq!(marks(folder), all, "{arguments:?}: the test can fail");
        assert!(!said.contains("left out"), "{arguments:?}: {said}");
    }
    // If nothing is compiled, there is no note about that, but there is one about proofs.
    let checked = grafsynth(folder, &["check", "lamp.graf"]);
    let said = String::from_utf8_lossy(&checked.stderr).into_owned();
    assert!(
        said.contains("4 blocks of C code in the chart are ignored by simulation, asserts"),
        "{said}"
    );
    // Without a proof, the C code is still compiled and tested.
    for (run, compiles) in [
        ("sim lamp.graf --random 5", false),
        ("build lamp.graf --target c -o out --no-proof", true),
    ] {
        let arguments: Vec<&str> = run.split(' ').collect();
        let said = String::from_utf8_lossy(&grafsynth(folder, &arguments).stderr).into_owned();
        assert_eq!(said.contains("left out"), compiles, "{run}: {said}");
        assert_eq!(marks(folder), Vec::<String>::new(), "{run}");
    }
}

/// Names, labels, comments, tags and file names reach the emitted texts as names and comments, never as code.
#[test]
fn nothing_else_of_a_chart_becomes_code() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let hostile = [
        "*/ BAD(); /*",
        "\\\" ); BAD(); (\\\"",
        "??/",
        "x\\nBAD();",
        "// \\\\",
        "$BAD() \\u{202e}",
        "'; BAD(); '",
    ];
    let mut n_built = 0;
    for (index, name) in hostile.iter().enumerate() {
        let comment = name.replace("\\n", " ").replace("\\\"", "\"");
        let text = format!(
            "# {comment}\nchart lamp \"{name}\" {{\n    input a \"{name}\"\n    output b \"{name}\"\n    # {comment}\n    initial step s \"{name}\" # {comment}\n    step t {{ b }}\n    s -> t when a # {comment}\n    t -> s when not a\n}}\n"
        );
        let file = format!("{index} BAD() .graf");
        fs::write(folder.join(&file), &text).expect("it is written");
        let out = format!("out{index}");
        let arguments = [
            "build",
            &file,
            "-t",
            "c,verilog,blif,palasm,galasm,cupl,jedec,json",
            "-o",
            &out,
            "--no-proof",
            "--emit",
            "map",
        ];
        let output = grafsynth(folder, &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.code() != Some(0) {
            assert_eq!(output.status.code(), Some(1), "{name}: {said}");
            println!("refused: {name}: {}", said.lines().next().unwrap_or_default());
            continue;
        }
        n_built += 1;
        for entry in fs::read_dir(folder.join(&out)).expect("the outputs") {
            let path = entry.expect("an entry").path();
            let shown = path.file_name().expect("a name").to_string_lossy().into_owned();
            let is_c = shown.ends_with(".c") || shown.ends_with(".h");
            if is_c || shown.ends_with(".v") {
                let text = fs::read_to_string(&path).expect("it is text");
                let code = without_comments(&text);
                assert!(!code.contains("BAD("), "{name}: {shown}\n{text}");
            }
        }
    }
    assert!(n_built > hostile.len() / 2, "{n_built} of {} are charts", hostile.len());
}

/// C or Verilog without its comments and strings.
fn without_comments(text: &str) -> String {
    let text = text.replace("??/", "\\").replace("\\\n", "");
    let mut code = String::new();
    let mut rest = text.as_str();
    while let Some(c) = rest.chars().next() {
        let (skip, kept) = if let Some(comment) = rest.strip_prefix("/*") {
            (comment.find("*/").map_or(rest.len(), |at| at + 4), " ")
        } else if rest.starts_with("//") {
            (rest.find('\n').unwrap_or(rest.len()), " ")
        } else if c == '"' {
            let mut end = 1;
            let bytes = rest.as_bytes();
            while end < bytes.len() && bytes[end] != b'"' && bytes[end] != b'\n' {
                end += if bytes[end] == b'\\' { 2 } else { 1 };
            }
            ((end + 1).min(rest.len()), "\"\"")
        } else {
            (c.len_utf8(), &rest[..c.len_utf8()])
        };
        code.push_str(kept);
        rest = &rest[skip..];
    }
    code
}

/// Files that a chart names are read only below its folder, and only if they are regular files.
#[test]
fn a_chart_names_files_below_its_folder() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    let library = "library chart valve(input on, output open) {\n initial step shut\n step wide { open }\n shut -> wide when on\n wide -> shut when not on\n}\n";
    fs::create_dir_all(at("plant/parts")).expect("it is made");
    fs::write(at("secret.graf"), library).expect("it is written");
    fs::write(at("plant/parts/valve.graf"), library).expect("it is written");
    let chart = |file: &str| {
        format!(
            "use \"{file}\"\nchart plant {{\n input on\n output open\n use valve as v(on = on, open -> open)\n initial step s\n step t\n s -> t when v.wide.active\n t -> s when v.shut.active\n}}\n"
        )
    };
    let check = |file: &str, more: &[&str]| {
        fs::write(at("plant/plant.graf"), chart(file)).expect("it is written");
        let arguments: Vec<&str> =
            ["check", "plant/plant.graf"].iter().chain(more).copied().collect();
        let output = grafsynth(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code().expect("no signal") != 1, said)
    };
    let (is_read, said) = check("parts/valve.graf", &[]);
    assert!(is_read, "{said}");
    #[cfg(unix)]
    std::os::unix::fs::symlink(at("secret.graf"), at("plant/link.graf")).expect("a link");
    let absolute = at("secret.graf").display().to_string();
    for file in
        ["../secret.graf", "parts/../../secret.graf", &absolute, "link.graf", "/dev/zero", "."]
    {
        let (is_read, said) = check(file, &[]);
        assert!(!is_read && said.contains("below the folder of the chart"), "{file}: {said}");
    }
    let (is_read, said) = check("../secret.graf", &["--root", "."]);
    assert!(is_read, "{said}");
}

/// A template that doubles a string in each step is rejected, not killed.
#[cfg(target_os = "linux")]
#[test]
fn a_template_that_grows_without_end_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let chart = "chart lamp {\n input a\n output b\n initial step s\n step t { b }\n s -> t when a\n t -> s when not a\n}\n";
    fs::write(folder.path().join("lamp.graf"), chart).expect("it is written");
    let endless = [
        "{% set ns = namespace(x=\"a\"*1000) %}{% for i in range(10000) %}{% set ns.x = ns.x ~ ns.x %}{% endfor %}{{ ns.x }}",
        "{% set ns = namespace(x=[1]) %}{% for i in range(10000) %}{% set ns.x = (ns.x + ns.x)|list %}{% endfor %}{{ ns.x }}",
        "{% macro f(x, n) %}{{ f(x ~ x, n - 1) if n else x }}{% endmacro %}{{ f('aaaaaaaaaa', 300) }}",
        "{{ 'a'|indent(99999999999) }}",
        "{{ 'a'|indent(width=99999999999) }}",
        "{{ '%99999999999d'|format(1) }}",
        "{{ '%*d'|format(99999999999, 1) }}",
        "{{ '{:99999999999}'.format(1) }}",
        "{{ [1]|batch(99999999999, 2)|list }}",
        "{{ [1]|slice(99999999999, 2)|list }}",
        "{{ [[1]]|tojson(indent=99999999999) }}",
        "{% set x %}{% for i in range(99999) %}{% for j in range(9999) %}aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa{% endfor %}{% endfor %}{% endset %}",
    ];
    for text in endless {
        fs::write(folder.path().join("t.txt.j2"), text).expect("it is written");
        let arguments =
            ["build", "lamp.graf", "-t", "template", "--template", "t.txt.j2", "-o", "out"];
        let output = grafsynth(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{text}: {said}");
        assert!(said.contains("error[G061"), "{text}: {said}");
        assert!(!folder.path().join("out").exists(), "{text}");
    }
}
