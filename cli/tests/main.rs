//! The program itself, started as a user starts it.

mod cases;
mod empty;
mod hostile;
mod packages;
mod pages;
mod tested_c;
mod traced;
mod trust;
mod whole;
