//! Small programs, encoded and run against hand-made expectations.
