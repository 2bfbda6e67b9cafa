//! Tests of the program itself, started as a user starts it.

mod accessible;
mod case_files;
mod counterexamples;
mod drawings;
mod edited_c;
mod empty;
mod exit_codes;
mod fixes;
mod hostile;
mod interactive;
mod names;
mod new;
mod packages;
mod pages;
mod printed;
mod report_forms;
mod reports;
mod tested_c;
mod traced;
mod trust;
mod watched;
mod whole;
