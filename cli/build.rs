//! Lets the linker fold functions with the same code in a release build, if it can: the program is then a twelfth smaller.

#![allow(
    clippy::disallowed_methods,
    reason = "cargo hands the facts of a build to its script in the environment"
)]
#![allow(clippy::print_stdout, reason = "a build script answers on its standard output")]

use std::env;
use std::process::Command;

const TARGET: &str = "x86_64-unknown-linux-gnu";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let is = |name: &str, value: &str| env::var(name).is_ok_and(|it| it == value);
    // Another linker than the usual one may not know the option.
    let is_usual = is("HOST", TARGET)
        && is("TARGET", TARGET)
        && is("CARGO_ENCODED_RUSTFLAGS", "")
        && env::var_os("RUSTC_LINKER").is_none();
    if is_usual && is("PROFILE", "release") && minor_version().is_some_and(|minor| minor >= 90) {
        println!("cargo::rustc-link-arg-bins=-Wl,--icf=all");
    }
}

/// The minor version of the compiler. Since 1.90, it links programs for this target with LLD.
fn minor_version() -> Option<u32> {
    let output = Command::new(env::var_os("RUSTC")?).arg("--version").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    text.strip_prefix("rustc 1.")?.split('.').next()?.parse().ok()
}
