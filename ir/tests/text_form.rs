//! The text form can represent every net, valid or not, and no text makes the parser panic.

use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, text};

use crate::random_net::{self, Random};

fn parsed(text: &str) -> Net {
    let (net, findings) = text::parse(FileId(0), text);
    net.unwrap_or_else(|| panic!("{findings:#?}\n{text}"))
}

#[test]
fn what_is_printed_is_read_back() {
    for seed in 0..800 {
        let net = random_net::net(seed);
        let printed = text::print(&net);
        let back = parsed(&printed).without_spans();
        assert!(back == net, "seed {seed}\n{printed}\n{net:#?}\n{back:#?}");
        assert_eq!(text::print(&back), printed, "seed {seed}");
    }
}

#[test]
fn validation_never_panics_and_its_spans_lie_in_the_text() {
    for seed in 0..800 {
        let printed = text::print(&random_net::net(seed));
        for finding in grafsynth_ir::validate::breaches(&parsed(&printed)) {
            assert!(
                finding.labels.iter().all(|label| printed.get(label.span.range()).is_some()),
                "{finding:?}"
            );
        }
    }
}

#[test]
fn mangled_texts_give_findings() {
    let mut findings = 0;
    for seed in 0..800 {
        let r = &mut Random::new(seed);
        let mut bytes = text::print(&random_net::net(seed % 200)).into_bytes();
        for _ in 0..=r.below(4) {
            if bytes.is_empty() {
                break;
            }
            let at = r.below(bytes.len());
            let to = (at + 1 + r.below(40)).min(bytes.len());
            match r.below(5) {
                0 => bytes[at] ^= 1 << r.below(7),
                1 => drop(bytes.drain(at..to)),
                2 => {
                    let again = bytes[at..to].to_vec();
                    bytes.splice(at..at, again);
                }
                3 => bytes.truncate(at.max(1)),
                _ => bytes.insert(at, r.pick(b"(){}[]\"`%?.\n-:=0\xE9")),
            }
        }
        let source = String::from_utf8_lossy(&bytes).into_owned();
        let (net, told) = text::parse(FileId(0), &source);
        assert_eq!(net.is_none(), !told.is_empty());
        assert!(told.len() <= 101);
        findings += usize::from(net.is_none());
        for finding in &told {
            assert!(source.get(finding.labels[0].span.range()).is_some(), "{finding:?}");
        }
        if let Some(net) = net {
            let _ = grafsynth_ir::validate::breaches(&net);
        }
    }
    assert!(findings > 300, "most mutations break something: {findings}");
}

#[test]
fn deep_and_long_texts_are_refused_without_trouble() {
    let many = 100_000;
    for source in [
        "(".repeat(many),
        format!("net a\nedge %0 = {}", "(".repeat(many)),
        format!("net a\nedge %0 = {}x", "not ".repeat(many)),
        format!("net a\nedge %0 = {}x", "-(".repeat(many)),
        format!("net a\nedge %0 = {}x", "and(".repeat(many)),
        format!("net a\nvar v bool\nedge %0 = {}x", "v[".repeat(many)),
        format!("net a\nedge %0 = 1{}", " + 1".repeat(many)),
        format!("net a\nedge %0 = 1{}", " < 1".repeat(many)),
        format!("net a\ntransition t in ?0 ->\n do {}", "{ if true ".repeat(many)),
        "step\n".repeat(many),
        "\"".repeat(many),
        "`\n".repeat(many),
        "?0.".repeat(many),
    ] {
        let (net, told) = text::parse(FileId(0), &source);
        assert!(net.is_none() && !told.is_empty() && told.len() <= 101, "{}", &source[..40]);
    }
    let wide = format!("net a\nedge %0 = true{}", " and true".repeat(many));
    assert_eq!(parsed(&wide).edges.len(), 1, "wide is not deep");
}
