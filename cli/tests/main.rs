//! The program itself, started as a user starts it.

mod cases;
mod packages;
mod pages;
mod traced;
mod whole;
