//! The compilers for which a text can be parsed.

use crate::tree::types::Machine;

/// A compiler: its predefined macros, and the sizes of its types.
///
/// The configuration for C++ reads text as C with the macros of C++: `extern "C"` is visible. C++ gives comparisons the type `bool` and enumerators the type
/// of their enumeration; both become the same numbers as soon as they are used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Config {
    /// The name of the compiler in messages: `host`, `avr`, `sdcc` or `c++`.
    pub name: &'static str,
    /// The sizes of the types.
    pub machine: Machine,
    /// The predefined macros with their values; a macro with parameters is written `NAME(a,b)`, as in `-D NAME(a,b)=VALUE`.
    pub macros: Vec<(String, String)>,
}

impl Config {
    fn new(name: &'static str, machine: Machine, macros: &[(&str, &str)]) -> Self {
        let owned = |(name, value): &(&str, &str)| ((*name).to_owned(), (*value).to_owned());
        Config { name, machine, macros: macros.iter().map(owned).collect() }
    }

    /// gcc or clang on a 64-bit machine.
    #[must_use]
    pub fn host() -> Self {
        let machine = Machine {
            int_bits: 32,
            long_bits: 64,
            pointer_bytes: 8,
            code_pointer_bytes: 8,
            max_align: 8,
            has_signed_char: true,
            has_short_enums: false,
        };
        let macros = [
            ("__GNUC__", "12"),
            ("__STDC__", "1"),
            ("__STDC_VERSION__", "199901L"),
            ("__STRICT_ANSI__", "1"),
        ];
        Config::new("host", machine, &macros)
    }

    /// avr-gcc, with its extension `__flash`: `int` has 16 bits.
    #[must_use]
    pub fn avr() -> Self {
        let machine = Machine {
            int_bits: 16,
            long_bits: 32,
            pointer_bytes: 2,
            code_pointer_bytes: 2,
            max_align: 1,
            has_signed_char: true,
            has_short_enums: false,
        };
        let macros = [
            ("__AVR__", "1"),
            ("__FLASH", "1"),
            ("__GNUC__", "12"),
            ("__STDC__", "1"),
            ("__STDC_VERSION__", "199901L"),
        ];
        Config::new("avr", machine, &macros)
    }

    /// sdcc for an 8051: `int` has 16 bits, `char` is unsigned, enumerations are small, and pointers to program memory are marked with `__code`.
    #[must_use]
    pub fn sdcc() -> Self {
        let machine = Machine {
            int_bits: 16,
            long_bits: 32,
            pointer_bytes: 3,
            code_pointer_bytes: 2,
            max_align: 1,
            has_signed_char: false,
            has_short_enums: true,
        };
        let macros = [
            ("__SDCC", "1"),
            ("__SDCC_mcs51", "1"),
            ("__STDC__", "1"),
            ("__STDC_VERSION__", "199901L"),
        ];
        Config::new("sdcc", machine, &macros)
    }

    /// A C++ compiler on a 64-bit machine.
    #[must_use]
    pub fn cpp() -> Self {
        let macros = [("__GNUC__", "12"), ("__cplusplus", "201103L"), ("__STRICT_ANSI__", "1")];
        Config::new("c++", Config::host().machine, &macros)
    }

    /// All four configurations.
    #[must_use]
    pub fn all() -> [Config; 4] {
        [Config::host(), Config::avr(), Config::sdcc(), Config::cpp()]
    }

    /// The same configuration with one more macro, as `-D NAME=VALUE` defines it.
    #[must_use]
    pub fn define(mut self, name: impl Into<String>, value: impl Into<String>) -> Self {
        self.macros.push((name.into(), value.into()));
        self
    }
}
