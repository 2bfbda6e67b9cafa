//! `build --report`: its three forms have the same facts, and nothing that the author of a chart wrote is markup.

#![allow(clippy::disallowed_methods, reason = "tests read files and start programs")]

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

const CHART: &str = "chart hostile \"</script><img src=x onerror=alert(1)>\" {
    input m \"request & <b>more</b> | \\\"quoted\\\"\" req \"R<1>\", b \"مرحبا بالعالم\", p \"😀 `code` *x*\", a
    output R \"</td></table>\" req \"R2\", Z, L
    assume never (a and b)
    assert never (R and L) req \"R3\"
    initial step p1 \"wäiting\"
    step p2 { R }
    step p3 { Z }
    step p4 { L }
    t1: p1 -> p2 when m req \"R4\"
    t2: p2 -> p3 when b
    t3: p3 -> p4 when p
    t4: p4 -> p1 when a
}
";

fn report(folder: &Path, form: &str) -> String {
    fs::write(folder.join("hostile.graf"), CHART).expect("it is written");
    let option = if form == "html" { "--report".to_owned() } else { format!("--report={form}") };
    let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(["build", "hostile.graf", "-t", "jedec", "-t", "c", "-t", "verilog"])
        .args(["--device", "gal22v10", "--for", "avr", "--allow", "tested", "-o", "out", &option])
        .current_dir(folder)
        .output()
        .expect("grafsynth starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::read_to_string(folder.join(format!("out/hostile.report.{form}"))).expect("it was written")
}

/// A text without blanks and without the signs of Markdown.
fn bare(text: &str) -> String {
    text.chars().filter(|c| !c.is_whitespace() && !"\\`*|".contains(*c)).collect()
}

/// The text of an HTML document.
fn text_of(page: &str) -> String {
    let body = page.split_once("<body>").map_or("", |(_, body)| body);
    let parts = body.split('<').map(|part| part.split_once('>').map_or("", |(_, text)| text));
    let text: String = parts.collect();
    let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"");
    text.replace("&amp;", "&")
}

/// All texts in the blocks of a report, except drawings.
fn texts(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::String(text) => found.push(text.clone()),
        Value::Array(all) => all.iter().for_each(|one| texts(one, found)),
        Value::Object(all) => {
            let is_shown =
                |key: &&String| !matches!(key.as_str(), "kind" | "id" | "svg" | "about" | "output");
            all.keys().filter(is_shown).for_each(|key| texts(&all[key], found));
        }
        _ => {}
    }
}

#[test]
fn all_forms_have_the_same_facts() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [html, markdown, json] = ["html", "md", "json"].map(|form| report(folder.path(), form));
    let value: Value = serde_json::from_str(&json).expect("JSON");
    let ids: Vec<&str> = value["sections"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|one| one["id"].as_str())
        .collect();
    for id in [
        "design",
        "proofs",
        "equations",
        "product-terms",
        "pins",
        "power-up",
        "cpu",
        "requirements",
    ] {
        assert!(ids.contains(&id), "{id} of {ids:?}");
    }
    let mut found = Vec::new();
    texts(&value["sections"], &mut found);
    assert!(found.len() > 300, "{}", found.len());
    let (page, plain) = (bare(&text_of(&html)), bare(&markdown));
    for fact in &found {
        let fact = bare(fact);
        assert!(page.contains(&fact), "not in the HTML: {fact}");
        assert!(plain.contains(&fact), "not in the Markdown: {fact}");
    }
    // And nothing else: what remains of the page are the headings of the chart and of the navigation.
    let total: usize = found.iter().map(|fact| bare(fact).len()).sum();
    assert!(page.len() < total + 400, "{} and {total}", page.len());
    assert_eq!(html, report(folder.path(), "html"));
}

#[test]
fn a_page_is_complete_and_runs_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let page = report(folder.path(), "html");
    assert!(!folder.path().join("out/hostile.jed.svg").exists());
    for tag in [
        "<script",
        "<img src=x",
        "<b>",
        "<iframe",
        "<link",
        "onerror=alert(1)>\"",
        "http://",
        "https://",
    ] {
        assert!(!page.contains(tag), "{tag}");
    }
    for part in [
        "default-src 'none'",
        "&lt;/script&gt;",
        "مرحبا بالعالم",
        "😀",
        "class=\"bar\"",
        "data:image/svg+xml;base64,",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // The chart, and two outputs that are chips.
    assert_eq!(page.matches("<figure>").count(), 3);
    for tag in ["section", "table", "tr", "td", "bdi", "ul", "li", "p", "pre", "figure"] {
        let n = |start: &str| page.matches(start).count();
        let opened = n(&format!("<{tag}>")) + n(&format!("<{tag} "));
        assert_eq!(opened, n(&format!("</{tag}>")), "{tag}");
    }
}
