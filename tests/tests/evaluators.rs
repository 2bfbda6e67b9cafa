//! The simulator and the second encoding have their own arithmetic and make their own decisions: a mistake that they shared with `ir` would be proved correct.

use std::fs;
use std::path::{Path, PathBuf};

/// The evaluators of `ir`, as code names them, and the plan of a reaction. `Expr::eval` and `Expr::as_constant` are distinguished from methods of the same
/// name by the text before or after them: the first gets a closure for leaves, and the second is called on an expression.
const SHARED: [&str; 11] = [
    "simplify::",
    "simplify(",
    "interval::arith",
    "interval::{arith",
    ".eval(&mut ",
    "Expr::eval",
    "ArithOp::apply",
    "op.apply(",
    "expr.as_constant()",
    "Expr::as_constant",
    "grafsynth_ir::plan::",
];

#[allow(clippy::disallowed_methods, reason = "tests read files")]
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() && name != "tests" {
            sources(&path, found);
        } else if name.ends_with(".rs") && name != "tests.rs" {
            found.push(path);
        }
    }
}

/// The code of a file: its lines without comments, up to its unit tests.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.lines().take_while(|line| line.trim() != "mod tests {").enumerate();
    lines.filter(|(_, line)| !line.trim_start().starts_with("//"))
}

/// Each use of an evaluator of `ir` in a text, by the number of its line.
fn uses(text: &str) -> Vec<(usize, &'static str)> {
    let in_line = |line: &str| SHARED.into_iter().find(|word| line.contains(word));
    code(text).filter_map(|(at, line)| Some((at + 1, in_line(line)?))).collect()
}

#[test]
#[allow(clippy::disallowed_methods, reason = "tests read files")]
fn the_checking_evaluators_use_no_evaluator_of_ir() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files = Vec::new();
    for folder in ["sim/src", "verify/src/symbolic"] {
        sources(&root.join(folder), &mut files);
    }
    for evaluator in ["sim/src/reaction.rs", "verify/src/symbolic/number.rs"] {
        assert!(files.contains(&root.join(evaluator)), "{evaluator} was not read");
    }
    for file in files {
        let text = fs::read_to_string(&file).expect("a source");
        assert_eq!(uses(&text), [], "{} uses an evaluator of ir", file.display());
    }
}

#[test]
fn a_shared_evaluator_is_found() {
    let of_ir = "use grafsynth_ir::simplify::simplify;\nlet n = guard.eval(&mut |leaf, at| 0);\n";
    assert_eq!(uses(of_ir), [(1, "simplify::"), (2, ".eval(&mut ")]);
    assert_eq!(uses("// simplify::simplify\nlet n = self.eval(guard);\n"), []);
}
