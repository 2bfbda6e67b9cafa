//! The format: its variants, errors, and damaged texts.

use super::{Kind, codes, read, write};
use grafsynth_ir::random::Random;
use grafsynth_ir::span::FileId;

fn ids(text: &str) -> Vec<&'static str> {
    read(FileId(0), text).1.iter().map(|finding| finding.code.id).collect()
}

#[test]
fn rows_may_be_split_joined_and_barred() {
    let plain = ".i 3\n.o 2\n10- 1~\n0-1 -1\n.e\n";
    let odd =
        "# a table\n.i 3 # three\n.o 2\n.p 2\n 1 0\n-|1 ~ 0 - # goes on\n1|-\n1\n.e\nanything";
    let (plain, findings) = read(FileId(0), plain);
    assert!(findings.is_empty(), "{findings:?}");
    let (odd, findings) = read(FileId(0), odd);
    assert!(findings.is_empty(), "{findings:?}");
    let (table, places) = plain.unwrap();
    assert_eq!(table, odd.unwrap().0);
    assert_eq!((places.on.len(), places.free.len()), (2, 1));
    assert_eq!((table.on.len(), table.free.len(), table.kind), (2, 1, Kind::Fd));
}

#[test]
fn the_kind_says_what_zero_and_dash_mean() {
    for (kind, on, free, off) in
        [("f", 1, 0, 0), ("fd", 1, 1, 0), ("fr", 1, 0, 1), ("fdr", 1, 1, 1)]
    {
        let text = format!(".i 2\n.o 3\n.type {kind}\n11 10-\n");
        let table = read(FileId(0), &text).0.unwrap().0;
        assert_eq!((table.on.len(), table.free.len(), table.off.len()), (on, free, off), "{kind}");
    }
}

#[test]
fn what_is_written_reads_back() {
    let text =
        ".i 2\n.o 2\n.ilb a<0> b\n.ob x y\n.phase 01\n.type fdr\n.p 3\n1- 1~\n-1 ~-\n00 00\n.e\n";
    let (table, findings) = read(FileId(0), text);
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(write(&table.unwrap().0), text);
}

#[test]
fn all_mistakes_are_found_at_once() {
    let text = ".i 2\n.o one\n.tpye fd\n.o 1\n1x 1\n.kiss\n1- 1 1\n.p 7\n";
    let found = ids(text);
    assert_eq!(
        found,
        [
            codes::SYNTAX.id,
            codes::UNKNOWN_DIRECTIVE.id,
            codes::SYNTAX.id,
            codes::UNSUPPORTED.id,
            codes::SYNTAX.id,
            codes::MISCOUNTED.id
        ]
    );
    assert_eq!(ids("11 1\n"), [codes::SYNTAX.id]);
    assert_eq!(ids(""), [codes::SYNTAX.id]);
    assert_eq!(ids(".i 2\n.o 1\n.ilb a\n11 1\n"), [codes::MISCOUNTED.id]);
    assert_eq!(ids(".i 99999999999999999999\n.o 1\n"), [codes::SYNTAX.id]);
    assert_eq!(ids(".i 1000000\n.o 1\n"), [codes::TOO_LARGE.id]);
}

#[test]
fn damaged_texts_are_read_or_refused() {
    let seeds = [
        ".i 3\n.o 2\n.ilb a b c\n.ob x y\n.p 2\n10- 1~\n0-1 -1\n.e\n",
        ".i 2\n.o 2\n.type fdr\n.phase 01\n1- 1~\n-1 ~-\n00 00\n.end\n",
        ".i 0\n.o 1\n1\n.e\n",
    ];
    let pieces = ["\n", ".i", ".o 9", "|", "~", "-", "\0", "ü", ".type", " fr", "4", "2", "?", "#"];
    let mut random = Random::new(1);
    let mut random = |n: usize| random.below(n);
    let mut n_read = 0;
    for round in 0..10_000 {
        let mut text: Vec<char> = seeds[round % seeds.len()].chars().collect();
        for _ in 0..=random(3) {
            let at = random(text.len() + 1);
            match random(4) {
                0 if !text.is_empty() => {
                    text.remove(at.min(text.len() - 1));
                }
                1 => text.truncate(at),
                2 => {
                    let from = random(text.len() + 1).min(at);
                    let copy: Vec<char> = text[from..at].to_vec();
                    text.splice(at..at, copy);
                }
                _ => {
                    text.splice(at..at, pieces[random(pieces.len())].chars());
                }
            }
        }
        let text: String = text.into_iter().collect();
        let (table, findings) = read(FileId(0), &text);
        assert!(table.is_some() || !findings.is_empty(), "{text:?}");
        for finding in &findings {
            for label in &finding.labels {
                assert!(text.get(label.span.range()).is_some(), "{text:?}: {finding:?}");
            }
        }
        if let Some((table, _)) = table {
            n_read += 1;
            let again = read(FileId(0), &write(&table)).0.map(|(table, _)| table);
            assert_eq!(again.as_ref(), Some(&table), "{text:?}");
        }
    }
    assert!(n_read > 1000, "only {n_read} damaged texts could still be read");
}

#[test]
fn clashes_are_found_with_their_rows() {
    let said = |text: &str| {
        let (table, places) = read(FileId(0), text).0.unwrap();
        let (function, findings) = super::function(&table, &places, 10_000);
        let labels: Vec<usize> =
            findings.iter().flat_map(|f| &f.labels).map(|l| l.span.start as usize).collect();
        (function.is_some(), findings.iter().map(|f| f.code.id).collect::<Vec<_>>(), labels)
    };
    assert_eq!(said(".i 2\n.o 1\n1- 1\n-1 -\n"), (true, vec![codes::OVERLAP.id], vec![10, 15]));
    assert_eq!(
        said(".i 2\n.o 1\n.type fr\n1- 1\n-1 0\n"),
        (false, vec![codes::CONTRADICTION.id], vec![19, 24])
    );
    assert_eq!(said(".i 2\n.o 1\n1- 1\n01 -\n"), (true, vec![], vec![]));
}
