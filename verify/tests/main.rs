//! The proofs compared with each other and with enumeration, and the pages of the findings.

mod agreement;
mod classes;
mod directed;
mod far;
mod oracle;
mod pages;
mod reach;
mod scale;
mod statecharts;

#[path = "../../tests/src/random_net/mod.rs"]
#[allow(
    dead_code,
    unused_imports,
    unreachable_pub,
    unfulfilled_lint_expectations,
    reason = "shared with the differential tests; not all of it is used here"
)]
mod random_net;
