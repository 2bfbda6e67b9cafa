//! The example of each page under `docs/codes` of this crate triggers its code.

#![allow(clippy::disallowed_methods, reason = "tests read files")]

use crate::code;
use grafsynth_c::Config;
use std::path::Path;

#[test]
fn each_example_triggers_its_code() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/codes");
    for known in grafsynth_c::codes::ALL {
        let page = std::fs::read_to_string(docs.join(format!("{}.md", known.id))).expect("a page");
        let fence = page.split_once("\n```c").expect("an example in C").1;
        let (_, rest) = fence.split_once('\n').expect("a fence");
        let text = rest.split_once("\n```").expect("the end of the example").0;
        // The page of a limit shows a small text, because a text that exceeds the limit would not be readable.
        let text = text.replace("/* and so on, 300 times */", &"(".repeat(300));
        assert_eq!(code(&text, &Config::host()), known.id);
    }
}
