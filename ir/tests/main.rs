//! Tests of nets through the public interface: their text form, their validation, and the pages of all codes.

mod code_pages;
mod lowering_pages;
mod random_net;
mod text_form;
mod validation;
