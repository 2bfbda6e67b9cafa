//! Printing a tree and reading the text gives the same tree.

use crate::trees::{build, recipes};
use grafsynth_c::tree::{ItemKind, StmtKind};
use grafsynth_c::{Config, Input, SourceFile, parse, print};
use grafsynth_ir::FileId;
use proptest::prelude::*;
use proptest::test_runner::Config as Runs;

proptest! {
    #![proptest_config(Runs { cases: 400, failure_persistence: None, ..Runs::default() })]
    #[test]
    fn random_trees_are_read_as_they_were_printed(recipes in recipes(), config in 0_usize..4) {
        let config = &Config::all()[config];
        let unit = build(&recipes, config);
        let text = print(&unit);
        let files = [SourceFile { file: FileId(0), name: "p.c", text: &text }];
        let verbatim = ["user text;\n    'unbalanced"];
        let (again, found) = parse(&Input { files: &files, verbatim: &verbatim, readers: &[], config });
        prop_assert!(again.is_some(), "{}\n{:#?}", text, found);
        if again.as_ref() != Some(&unit) {
            let again = again.map(|it| print(&it)).unwrap_or_default();
            prop_assert!(false, "{}\n--- read as\n{}", text, again);
        }
    }
}

#[test]
fn the_random_trees_have_every_kind_of_statement() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut seen = [false; 13];
    let mut n_effects = 0;
    for _ in 0..300 {
        let recipe = recipes().new_tree(&mut runner).expect("a recipe").current();
        let unit = build(&recipe, &Config::host());
        let Some(ItemKind::Function { body, .. }) = unit.items.last().map(|it| &it.kind) else {
            panic!("the last item is the random function")
        };
        grafsynth_c::walk::each_stmt(body, &mut |stmt| {
            seen[match stmt.kind {
                StmtKind::Expr(_) => 0,
                StmtKind::Define { .. } => 1,
                StmtKind::If { .. } => 2,
                StmtKind::Switch { .. } => 3,
                StmtKind::While { .. } => 4,
                StmtKind::DoWhile { .. } => 5,
                StmtKind::For { .. } => 6,
                StmtKind::Break => 7,
                StmtKind::Continue => 8,
                StmtKind::Return(_) => 9,
                StmtKind::Block(_) => 10,
                StmtKind::Barrier => 11,
                StmtKind::Opaque(_) => 12,
            }] = true;
        });
        n_effects += grafsynth_c::uses::Accesses::of_body(body).writes.len();
    }
    assert_eq!(seen, [true; 13]);
    assert!(n_effects > 100, "{n_effects} writes");
}
