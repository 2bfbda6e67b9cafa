//! Embeds the pages of `docs/codes` in the program, so that `explain` needs no files.

#![allow(clippy::disallowed_methods, reason = "a build script reads and writes files")]

use std::fmt::Write as _;
use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder =
        PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("../docs/codes").canonicalize()?;
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut pages = Vec::new();
    for entry in fs::read_dir(&folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "md")
            && let Some(stem) = path.file_stem().and_then(|stem| stem.to_str())
        {
            pages.push((stem.to_owned(), path.clone()));
            println!("cargo::rerun-if-changed={}", path.display());
        }
    }
    pages.sort_unstable();
    let mut text = String::from("pub(crate) const PAGES: &[(&str, &str)] = &[\n");
    for (code, path) in pages {
        writeln!(text, "    ({code:?}, include_str!({:?})),", path.display().to_string())?;
    }
    text.push_str("];\n");
    fs::write(PathBuf::from(env::var("OUT_DIR")?).join("pages.rs"), text)?;
    Ok(())
}
