//! Tests the examples on the pages of this crate's codes.

use crate::codes;
use crate::encode::{EncodeOptions, encode};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::{FileId, text, validate};

#[test]
fn each_page_has_an_example_that_shows_its_code() {
    for code in codes::ALL {
        let path = format!("{}/../docs/codes/{}.md", env!("CARGO_MANIFEST_DIR"), code.id);
        #[expect(clippy::disallowed_methods, reason = "a test reads the book")]
        let page = std::fs::read_to_string(&path).unwrap();
        assert!(page.starts_with(&format!("# {}: {}\n", code.id, code.title)), "{path}");
        let example =
            page.split("```net").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
        let (_, source) = example.split_once('\n').unwrap();
        let (net, findings) = text::parse(FileId(0), source);
        assert_eq!(findings, [], "{path}");
        let net = validate(net.unwrap()).unwrap();
        let program = program(&net, &ProgramOptions::default()).unwrap();
        let options = EncodeOptions { max_nodes: 200_000, ..EncodeOptions::default() };
        let found = encode(&net, &program, &Facts::default(), &options).unwrap_err();
        let found: Vec<_> = found.iter().map(|finding| finding.code.id).collect();
        assert_eq!(found, [code.id], "{path}");
    }
}
