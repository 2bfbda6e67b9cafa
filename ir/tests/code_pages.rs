//! Each code of nets has a page whose example triggers exactly that code.

use grafsynth_ir::{FileId, codes, text, validate};

macro_rules! pages {
    ($($id:literal)*) => {
        &[$(($id, include_str!(concat!("../../docs/codes/", $id, ".md")))),*]
    };
}

const PAGES: &[(&str, &str)] = pages! {
    "G0301" "G0302" "G0303" "G0304" "G0310" "G0311" "G0312" "G0313" "G0314" "G0315"
    "G0316" "G0317" "G0318" "G0319" "G0320" "G0321" "G0322" "G0323" "G0324" "G0325"
    "G0326" "G0327" "G0328" "G0329" "G0330" "G0331" "G0332" "G0333" "G0334" "G0335" "G0336" "G0337"
};

#[test]
fn every_code_has_a_page_and_every_page_its_code() {
    let codes: Vec<_> = codes::ALL.iter().map(|code| code.id).collect();
    let pages: Vec<_> = PAGES.iter().map(|(id, _)| *id).collect();
    assert_eq!(codes, pages);
    for (code, (_, page)) in codes::ALL.iter().zip(PAGES) {
        let mut lines = page.lines();
        assert_eq!(lines.next(), Some(format!("# {}: {}", code.id, code.title).as_str()));
        for heading in ["## Cause", "## Example", "## Way out"] {
            assert_eq!(
                page.lines().filter(|line| *line == heading).count(),
                1,
                "{} {heading}",
                code.id
            );
        }
    }
}

#[test]
fn every_example_gives_its_code() {
    for (id, page) in PAGES {
        let example =
            page.split("```net\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
        let findings = match text::parse(FileId(0), example) {
            (Some(net), _) => validate(net).err().unwrap_or_default(),
            (None, findings) => findings,
        };
        assert!(!findings.is_empty(), "{id}: nothing found");
        assert!(findings.iter().all(|finding| finding.code.id == *id), "{id}: {findings:#?}");
    }
}
