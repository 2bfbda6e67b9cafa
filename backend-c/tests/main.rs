//! The emitted C with real compilers: golden text, random nets, and large charts.

mod differential;
mod scale;
mod support;
mod truck;
