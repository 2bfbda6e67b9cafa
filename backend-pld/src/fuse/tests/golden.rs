//! The files of the assembler galette, if available: equal fuses, checksum and signature.
#![allow(clippy::disallowed_methods, reason = "tests read files")]

use crate::fuse::{decode, differences, map};
use crate::{Dialect, jedec};
use grafsynth_ir::span::FileId;
use std::path::{Path, PathBuf};

/// The folder with `success` and `security`: named by `GRAFSYNTH_GAL_CORPUS`, or a sibling of the checkout.
fn corpus() -> Option<PathBuf> {
    let named = std::env::var_os("GRAFSYNTH_GAL_CORPUS").map(PathBuf::from);
    let sibling = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../gal-corpus");
    let found =
        [named, Some(sibling)].into_iter().flatten().find(|path| path.join("success").is_dir());
    if found.is_none() {
        eprintln!("skipped: no corpus of GALasm files (GRAFSYNTH_GAL_CORPUS names none)");
    }
    found
}

fn texts(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "pld"));
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), std::fs::read_to_string(&path).unwrap())).collect()
}

#[test]
fn the_files_of_others_come_out_equal() {
    let Some(corpus) = corpus() else { return };
    let mut n_files = 0;
    for (path, text) in
        texts(&corpus.join("success")).into_iter().chain(texts(&corpus.join("security")))
    {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let read = crate::read_text(Dialect::Galasm, FileId(0), &text);
        let mut placement = match read.placement {
            Ok(placement) => placement,
            Err(found) => panic!("{name}: {found:?}"),
        };
        let golden = std::fs::read_to_string(path.with_extension("jed")).unwrap();
        let (golden, found) = jedec::read(FileId(1), &golden);
        assert_eq!(found, [], "{name}");
        let golden = golden.unwrap();
        // The only file that was assembled with this option.
        placement.is_secured = golden.is_secured;
        let ours = map(&placement).unwrap_or_else(|found| panic!("{name}: {found:?}"));
        let theirs = golden.fuse_map(Some(placement.device)).unwrap();
        assert_eq!(ours.signature(), theirs.signature(), "{name}");
        let differing: Vec<usize> =
            (0..ours.fuses.len()).filter(|fuse| ours.fuses[*fuse] != theirs.fuses[*fuse]).collect();
        assert_eq!(differing, [0usize; 0], "{name}: fuses");
        assert_eq!(ours.checksum(), theirs.checksum(), "{name}");
        assert_eq!(ours, theirs, "{name}");
        // Their file decodes to the contents of the text.
        let said = decode(&theirs).unwrap_or_else(|found| panic!("{name}: {found:?}"));
        assert_eq!(differences(&placement, &said), [""; 0], "{name}");
        n_files += 1;
    }
    assert!(n_files >= 29, "{n_files} files");
}
