//! Each code of the lowering has a page. Another test, in a crate that can read charts, checks that its example triggers the code.

use grafsynth_ir::lower::codes;

macro_rules! pages {
    ($($id:literal)*) => {
        &[$(($id, include_str!(concat!("../../docs/codes/", $id, ".md")))),*]
    };
}

const PAGES: &[(&str, &str)] = pages! {
    "G0201" "G0202" "G0203" "G0204" "G0205" "G0206" "G0207" "G0208" "G0209" "G0210"
    "G0211" "G0212" "G0213" "G0214" "G0215" "G0216" "G0217" "G0218" "G0219" "G0220"
    "G0221" "G0222" "G0223" "G0224" "G0225" "G0226" "G0227" "G0228" "G0229" "G0230"
    "G0231" "G0232" "G0233" "G0234" "G0235" "G0236" "G0237" "G0238" "G0239" "G0240"
    "G0241" "G0242" "G0243" "G0244" "G0245" "G0246" "G0247" "G0248" "G0249" "G0251"
    "G0252" "G0253" "G0254" "G0255" "G0256" "G0257" "G0258" "G0259"
};

#[test]
fn every_code_has_a_page_and_every_page_its_code() {
    let codes: Vec<_> = codes::ALL.iter().map(|code| code.id).collect();
    let pages: Vec<_> = PAGES.iter().map(|(id, _)| *id).collect();
    assert_eq!(codes, pages);
    for (code, (_, page)) in codes::ALL.iter().zip(PAGES) {
        let heading = format!("# {}: {}", code.id, code.title);
        assert_eq!(page.lines().next(), Some(heading.as_str()));
        for heading in ["## Cause", "## Example", "## Way out"] {
            let count = page.lines().filter(|line| *line == heading).count();
            assert_eq!(count, 1, "{} {heading}", code.id);
        }
        assert_eq!(page.matches("```").count(), 2, "{}: one example", code.id);
    }
}
