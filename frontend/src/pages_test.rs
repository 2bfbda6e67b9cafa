//! Test: the page of each code has an example that triggers it.
#![expect(clippy::disallowed_methods, reason = "the test reads the pages")]

use grafsynth_ir::{FileId, lower};

use crate::{c, codes, graf, kiss2, plant, plcopen, rules, scxml, st};

/// Language, options and text of the example on a page.
fn example(page: &str) -> (String, Vec<String>, String) {
    let after = page.split_once("## Example\n```").unwrap().1;
    let (info, rest) = after.split_once('\n').unwrap();
    let text = rest.split_once("\n```").unwrap().0;
    let mut words = info.split(' ').map(str::to_owned);
    (words.next().unwrap(), words.collect(), format!("{text}\n"))
}

#[test]
fn every_code_has_a_page_whose_example_triggers_it() {
    for code in codes::ALL {
        let path = format!("{}/../docs/codes/{}.md", env!("CARGO_MANIFEST_DIR"), code.id);
        let page = std::fs::read_to_string(&path).unwrap_or_else(|_| panic!("{path}"));
        assert!(page.starts_with(&format!("# {}: {}\n", code.id, code.title)), "{path}");
        assert!(page.contains("\n## Cause\n") && page.contains("\n## Way out\n"), "{path}");
        let (language, options, text) = example(&page);
        let option = |name: &str, default: usize| {
            options
                .iter()
                .position(|option| option == name)
                .map_or(default, |at| options[at + 1].parse().unwrap())
        };
        let defaults = graf::Limits::default();
        let limits = graf::Limits {
            source: option("--source-limit", defaults.source),
            nesting: u32::try_from(option("--nesting-limit", defaults.nesting as usize)).unwrap(),
            diagnostics: option("--max-diagnostics", defaults.diagnostics),
        };
        if language == "c" {
            let parsed = c::parse_within(FileId(0), &text, &limits, &c::Options::default());
            let findings = parsed.diagnostics;
            assert!(findings.iter().any(|finding| finding.code == *code), "{path}: {findings:#?}");
            assert!(findings.iter().all(|finding| finding.code == *code), "{path}: {findings:#?}");
            continue;
        }
        if language == "plant" {
            let chart = "chart lamp { input button\n output light\n initial step s { light } }";
            let design = graf::parse(FileId(0), chart).design.unwrap();
            let net = lower::lower(&design).0.unwrap();
            let findings = plant::parse(&net, FileId(0), &text, &limits).1;
            assert!(!findings.is_empty(), "{path}");
            assert!(findings.iter().all(|finding| finding.code == *code), "{path}: {findings:#?}");
            continue;
        }
        if language == "kiss2" {
            let findings = kiss2::parse_within(FileId(0), &text, &limits).1;
            assert!(!findings.is_empty(), "{path}");
            assert!(findings.iter().all(|finding| finding.code == *code), "{path}: {findings:#?}");
            continue;
        }
        let parsed = match language.as_str() {
            "rules" => rules::parse_within(FileId(0), &text, &limits),
            "scxml" => scxml::parse_within(FileId(0), &text, &limits),
            "st" => st::parse_within(FileId(0), &text, &limits),
            "xml" => plcopen::parse_within(FileId(0), &text, &limits),
            _ => graf::parse_within(FileId(0), &text, &limits),
        };
        let mut findings = parsed.diagnostics;
        // The readable part of an invalid text must not cause further errors.
        if let Some(design) = &parsed.design {
            findings
                .extend(lower::lower(design).1.into_iter().filter(|finding| finding.is_error()));
        }
        if options.first().is_some_and(|verb| verb == "convert") {
            assert!(findings.is_empty(), "{path}");
            let (net, _) = lower::lower(&parsed.design.unwrap());
            let net = net.unwrap();
            findings.extend(match options.last().map(String::as_str) {
                Some("scxml") => scxml::write_net(&net).unwrap_err(),
                Some("st") => match st::write_net(&net) {
                    Ok((_, lost)) => lost,
                    Err(refused) => refused,
                },
                _ => rules::write_net(&net).unwrap_err(),
            });
        }
        assert!(findings.iter().any(|finding| finding.code == *code), "{path}: {findings:#?}");
        // The note that counts the rest only occurs together with others.
        let is_alone = *code == codes::MORE || findings.iter().all(|finding| finding.code == *code);
        assert!(is_alone, "{path}: {findings:#?}");
    }
}

#[test]
fn the_examples_of_the_reference_are_read() {
    let path = format!("{}/../docs/language.md", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    let mut n = 0;
    for part in text.split("\n```").skip(1) {
        let Some((info, example)) = part.split_once('\n') else { continue };
        let parsed = match info {
            "graf" => graf::parse(FileId(0), example),
            "rules" => rules::parse(FileId(0), example),
            _ => continue,
        };
        assert_eq!(parsed.diagnostics, [], "{example}");
        let (net, findings) = lower::lower(&parsed.design.unwrap());
        assert!(net.is_some(), "{findings:#?}");
        n += 1;
    }
    assert!(n >= 5, "{n} examples");
}
