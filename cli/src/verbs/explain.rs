//! `grafsynth explain CODE`.

use crate::args::Explain;
use crate::exit::Exit;
use grafsynth_driver::pages;
use grafsynth_ir::diag::nearest;

pub(crate) fn run(arguments: &Explain) -> Result<Exit, String> {
    let Some(code) = &arguments.code else {
        let list: String =
            pages::codes().iter().map(|code| format!("{}  {}\n", code.id, code.title)).collect();
        crate::print(&list);
        return Ok(Exit::Done);
    };
    match pages::page(code) {
        Some(page) => {
            crate::print(page);
            Ok(Exit::Done)
        }
        None => {
            // `g201` and `201` are short for `G0201`.
            let full = format!("G{:0>4}", code.trim_start_matches(['G', 'g']));
            let near = pages::pages().map(|(code, _)| code).find(|known| *known == full);
            let near = near
                .or_else(|| nearest(&full, pages::pages().map(|(code, _)| code)))
                .map(|near| format!(", did you mean {near}?"))
                .unwrap_or_default();
            Err(format!("unknown code `{code}`{near} (without a code, explain lists all)"))
        }
    }
}
