//! Reserved words by target, sorted by byte, and Latin letters without their marks.

/// C99, with the words that C11 and C23 add.
#[rustfmt::skip]
pub(super) const C: &[&str] = &[
    "_Alignas", "_Alignof", "_Atomic", "_Bool", "_Complex", "_Generic", "_Imaginary", "_Noreturn", "_Static_assert", "_Thread_local",
    "alignas", "alignof", "asm", "auto", "bool", "break", "case", "char", "const", "constexpr", "continue", "default", "do", "double",
    "else", "enum", "extern", "false", "float", "for", "fortran", "goto", "if", "inline", "int", "long", "nullptr", "register", "restrict",
    "return", "short", "signed", "sizeof", "static", "static_assert", "struct", "switch", "thread_local", "true", "typedef", "typeof",
    "typeof_unqual", "union", "unsigned", "void", "volatile", "while",
];

/// The words of C++ up to C++20 that C does not have.
#[rustfmt::skip]
pub(super) const CPP: &[&str] = &[
    "and", "and_eq", "asm", "bitand", "bitor", "bool", "catch", "char16_t", "char32_t", "char8_t", "class", "co_await", "co_return",
    "co_yield", "compl", "concept", "const_cast", "consteval", "constexpr", "constinit", "decltype", "delete", "dynamic_cast", "explicit",
    "export", "false", "final", "friend", "import", "module", "mutable", "namespace", "new", "noexcept", "not", "not_eq", "nullptr",
    "operator", "or", "or_eq", "override", "private", "protected", "public", "reinterpret_cast", "requires", "static_cast", "template",
    "this", "throw", "true", "try", "typeid", "typename", "using", "virtual", "wchar_t", "xor", "xor_eq",
];

/// Types, macros and functions of standard headers and of the headers of AVR, 8051, Cortex-M and Arduino that could clash with a name in a chart.
#[rustfmt::skip]
pub(super) const C_HEADERS: &[&str] = &[
    "ACBG", "ACD", "ACI", "ACIC", "ACIE", "ACME", "ACO", "ACSR", "ADC", "ADC1", "ADCH", "ADCL", "ADCSRA", "ADCW", "ADEN", "ADIE", "ADIF",
    "ADMUX", "ADSC", "AS2", "ASSR", "AVR", "BIN", "BODS", "BORF", "BUFSIZ", "CAL0", "CAL1", "CAL2", "CAL3", "CAL4", "CAL5", "CAL6", "CAL7",
    "CHAR_BIT", "CHAR_MAX", "CHAR_MIN", "CLKPR", "CPHA", "CPOL", "CS00", "CS01", "CS02", "CS10", "CS11", "CS12", "CS13", "CS20", "CS21",
    "CS22", "CS30", "CS31", "CS32", "CS40", "CS41", "CS42", "CS50", "CS51", "CS52", "CTC1", "CTPB", "DAC", "DD0", "DD1", "DD2", "DD3",
    "DD4", "DD5", "DD6", "DD7", "DDA0", "DDA1", "DDA2", "DDA3", "DDA4", "DDA5", "DDA6", "DDA7", "DDB0", "DDB1", "DDB2", "DDB3", "DDB4",
    "DDB5", "DDB6", "DDB7", "DDC0", "DDC1", "DDC2", "DDC3", "DDC4", "DDC5", "DDC6", "DDC7", "DDD0", "DDD1", "DDD2", "DDD3", "DDD4", "DDD5",
    "DDD6", "DDD7", "DDE0", "DDE1", "DDE2", "DDE3", "DDE4", "DDE5", "DDE6", "DDE7", "DDF0", "DDF1", "DDF2", "DDF3", "DDF4", "DDF5", "DDF6",
    "DDF7", "DDG0", "DDG1", "DDG2", "DDG3", "DDG4", "DDG5", "DDG6", "DDG7", "DDH0", "DDH1", "DDH2", "DDH3", "DDH4", "DDH5", "DDH6", "DDH7",
    "DDJ0", "DDJ1", "DDJ2", "DDJ3", "DDJ4", "DDJ5", "DDJ6", "DDJ7", "DDK0", "DDK1", "DDK2", "DDK3", "DDK4", "DDK5", "DDK6", "DDK7", "DDL0",
    "DDL1", "DDL2", "DDL3", "DDL4", "DDL5", "DDL6", "DDL7", "DDRA", "DDRB", "DDRC", "DDRD", "DDRE", "DDRF", "DDRG", "DDRH", "DDRJ", "DDRK",
    "DDRL", "DEC", "DMA1", "DOR0", "DOR1", "DOR2", "DOR3", "DORD", "DT1A", "DT1B", "DWDR", "E2END", "EEAR", "EECR", "EEDR", "EEPE", "EERE",
    "EICRA", "EIFR", "EIMSK", "EIND", "EOF", "EXIT_FAILURE", "EXIT_SUCCESS", "EXTI", "F", "FALSE", "FE0", "FE1", "FE2", "FE3", "FILE",
    "FLASHEND", "GF0", "GF1", "GIFR", "GPIO", "GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOR0", "HEX", "HIGH", "HUGE_VAL", "I", "I2C1",
    "I2C2", "ICF1", "ICF3", "ICF4", "ICF5", "ICR1", "ICR3", "ICR4", "ICR5", "IDL", "IDRD", "INFINITY", "INPUT", "INPUT_PULLUP", "INT0",
    "INT1", "INT16_MAX", "INT16_MIN", "INT2", "INT3", "INT32_MAX", "INT32_MIN", "INT4", "INT5", "INT6", "INT64_MAX", "INT64_MIN", "INT7",
    "INT8_MAX", "INT8_MIN", "INT_MAX", "INT_MIN", "IPR", "ISR", "IVCE", "JTD", "JTRF", "LED_BUILTIN", "LONG_MAX", "LONG_MIN", "LOW", "LSM",
    "MCUCR", "MCUSR", "MSTR", "MUX0", "MUX1", "MUX2", "MUX3", "MUX4", "MUX5", "NAN", "NULL", "NVIC", "OCDR", "OCR0A", "OCR0B", "OCR1A",
    "OCR1B", "OCT", "OSCCAL", "OUTPUT", "P0", "P1", "P2", "P3", "PA0", "PA1", "PA2", "PA3", "PA4", "PA5", "PA6", "PA7", "PB0", "PB1", "PB2",
    "PB3", "PB4", "PB5", "PB6", "PB7", "PC0", "PC1", "PC2", "PC3", "PC4", "PC5", "PC6", "PC7", "PCICR", "PCIE", "PCIF", "PCKE", "PCMSK0",
    "PD", "PD0", "PD1", "PD2", "PD3", "PD4", "PD5", "PD6", "PD7", "PE0", "PE1", "PE2", "PE3", "PE4", "PE5", "PE6", "PE7", "PF0", "PF1",
    "PF2", "PF3", "PF4", "PF5", "PF6", "PF7", "PG0", "PG1", "PG2", "PG3", "PG4", "PG5", "PG6", "PG7", "PH0", "PH1", "PH2", "PH3", "PH4",
    "PH5", "PH6", "PH7", "PI", "PIN0", "PIN1", "PIN2", "PIN3", "PIN4", "PIN5", "PIN6", "PIN7", "PINA", "PINA0", "PINA1", "PINA2", "PINA3",
    "PINA4", "PINA5", "PINA6", "PINA7", "PINB", "PINB0", "PINB1", "PINB2", "PINB3", "PINB4", "PINB5", "PINB6", "PINB7", "PINC", "PINC0",
    "PINC1", "PINC2", "PINC3", "PINC4", "PINC5", "PINC6", "PINC7", "PIND", "PIND0", "PIND1", "PIND2", "PIND3", "PIND4", "PIND5", "PIND6",
    "PIND7", "PINE", "PINE0", "PINE1", "PINE2", "PINE3", "PINE4", "PINE5", "PINE6", "PINE7", "PINF", "PINF0", "PINF1", "PINF2", "PINF3",
    "PINF4", "PINF5", "PINF6", "PINF7", "PING", "PING0", "PING1", "PING2", "PING3", "PING4", "PING5", "PING6", "PING7", "PINH", "PINH0",
    "PINH1", "PINH2", "PINH3", "PINH4", "PINH5", "PINH6", "PINH7", "PINJ", "PINK", "PINK0", "PINK1", "PINK2", "PINK3", "PINK4", "PINK5",
    "PINK6", "PINK7", "PINL", "PINL0", "PINL1", "PINL2", "PINL3", "PINL4", "PINL5", "PINL6", "PINL7", "PJ0", "PJ1", "PJ2", "PJ3", "PJ4",
    "PJ5", "PJ6", "PJ7", "PK0", "PK1", "PK2", "PK3", "PK4", "PK5", "PK6", "PK7", "PL0", "PL1", "PL2", "PL3", "PL4", "PL5", "PL6", "PL7",
    "PLLE", "PORF", "PORTA", "PORTA0", "PORTA1", "PORTA2", "PORTA3", "PORTA4", "PORTA5", "PORTA6", "PORTA7", "PORTB", "PORTB0", "PORTB1",
    "PORTB2", "PORTB3", "PORTB4", "PORTB5", "PORTB6", "PORTB7", "PORTC", "PORTC0", "PORTC1", "PORTC2", "PORTC3", "PORTC4", "PORTC5",
    "PORTC6", "PORTC7", "PORTD", "PORTD0", "PORTD1", "PORTD2", "PORTD3", "PORTD4", "PORTD5", "PORTD6", "PORTD7", "PORTE", "PORTE0",
    "PORTE1", "PORTE2", "PORTE3", "PORTE4", "PORTE5", "PORTE6", "PORTE7", "PORTF", "PORTF0", "PORTF1", "PORTF2", "PORTF3", "PORTF4",
    "PORTF5", "PORTF6", "PORTF7", "PORTG", "PORTG0", "PORTG1", "PORTG2", "PORTG3", "PORTG4", "PORTG5", "PORTG6", "PORTG7", "PORTH",
    "PORTH0", "PORTH1", "PORTH2", "PORTH3", "PORTH4", "PORTH5", "PORTH6", "PORTH7", "PORTK", "PORTK0", "PORTK1", "PORTK2", "PORTK3",
    "PORTK4", "PORTK5", "PORTK6", "PORTK7", "PORTL", "PORTL0", "PORTL1", "PORTL2", "PORTL3", "PORTL4", "PORTL5", "PORTL6", "PORTL7",
    "PROGMEM", "PRR", "PRR0", "PRR1", "PSR0", "PSR1", "PSTR", "PUD", "RAMEND", "RAND_MAX", "RCC", "RFLB", "RSIG", "RXC0", "RXC1", "RXC2",
    "RXC3", "SCB", "SCHAR_MAX", "SCHAR_MIN", "SDCC", "SE", "SHRT_MAX", "SHRT_MIN", "SIGNAL", "SIZE_MAX", "SM0", "SM1", "SM2", "SMCR",
    "SMOD", "SP", "SPCR", "SPDR", "SPE", "SPH", "SPI", "SPI1", "SPI2", "SPIE", "SPIF", "SPL", "SPR0", "SPR1", "SPSR", "SRE", "SREG", "SRL0",
    "SRL1", "SRL2", "SysTick", "TCCR0A", "TCCR0B", "TCCR1A", "TCCR1B", "TCNT0", "TCNT1", "TCNT2", "TIFR", "TIFR0", "TIFR1", "TIM1", "TIM2",
    "TIM3", "TIM4", "TIMSK0", "TIMSK1", "TOV0", "TOV1", "TOV2", "TOV3", "TOV4", "TOV5", "TRUE", "TSM", "TWA0", "TWA1", "TWA2", "TWA3",
    "TWA4", "TWA5", "TWA6", "TWAR", "TWBR", "TWCR", "TWD0", "TWD1", "TWD2", "TWD3", "TWD4", "TWD5", "TWD6", "TWD7", "TWDR", "TWEA", "TWEN",
    "TWIE", "TWS3", "TWS4", "TWS5", "TWS6", "TWS7", "TWSR", "TWWC", "TXC0", "TXC1", "TXC2", "TXC3", "U2X0", "U2X1", "U2X2", "U2X3", "UBRR0",
    "UCHAR_MAX", "UCSR0A", "UCSR0B", "UCSR0C", "UDR0", "UDR1", "UDR2", "UDR3", "UINT16_MAX", "UINT32_MAX", "UINT64_MAX", "UINT8_MAX",
    "UINT_MAX", "ULONG_MAX", "UPE0", "UPE1", "UPE2", "UPE3", "USART", "USART1", "USART2", "USHRT_MAX", "WCOL", "WDCE", "WDE", "WDIE",
    "WDIF", "WDP0", "WDP1", "WDP2", "WDP3", "WDRF", "WDTCSR", "XH", "XL", "XMBK", "XMM0", "XMM1", "XMM2", "YH", "YL", "ZH", "ZL", "_BV",
    "abort", "abs", "accept", "analogRead", "analogWrite", "assert", "atexit", "bind", "bit", "bitClear", "bitRead", "bitSet", "bitWrite",
    "boolean", "bsearch", "byte", "calloc", "ceil", "cli", "clock", "close", "code", "complex", "connect", "constrain", "cos", "cosf",
    "data", "delay", "digitalRead", "digitalWrite", "div", "errno", "exit", "exp", "expf", "fabs", "far", "floor", "fmaf", "fmod", "free",
    "gamma", "getchar", "getenv", "huge", "i386", "idata", "imaginary", "index", "int16_t", "int32_t", "int64_t", "int8_t", "int_fast16_t",
    "int_fast32_t", "int_fast64_t", "int_fast8_t", "int_least16_t", "int_least32_t", "int_least64_t", "int_least8_t", "interrupt",
    "interrupts", "intmax_t", "intptr_t", "isalpha", "isdigit", "j0", "j1", "jn", "kill", "labs", "ldiv", "link", "linux", "listen", "log",
    "logf", "loop", "main", "malloc", "max", "memcmp", "memcpy", "memmove", "memset", "micros", "millis", "min", "near", "near_",
    "noInterrupts", "offsetof", "open", "pause", "pdata", "pinMode", "pipe", "pow", "powf", "printf", "ptrdiff_t", "putchar", "puts",
    "qsort", "raise", "rand", "read", "realloc", "reentrant", "remove", "rename", "reti", "rindex", "round", "sbit", "scanf", "sei",
    "select", "send", "setup", "sfr", "sfr16", "signal", "sin", "sinf", "size_t", "sleep", "sq", "sqrt", "srand", "ssize_t", "stderr",
    "stdin", "stdout", "strcat", "strcmp", "strcpy", "strlen", "system", "tan", "tanf", "time", "time_t", "tolower", "toupper", "uint16_t",
    "uint32_t", "uint64_t", "uint8_t", "uint_fast16_t", "uint_fast32_t", "uint_fast64_t", "uint_fast8_t", "uint_least16_t",
    "uint_least32_t", "uint_least64_t", "uint_least8_t", "uintmax_t", "uintptr_t", "unix", "va_arg", "va_copy", "va_end", "va_list",
    "va_start", "wait", "wchar_t", "wint_t", "word", "write", "xdata", "y0", "y1", "yn",
];

/// IEEE 1364-2001, and `uwire` of 2005.
#[rustfmt::skip]
pub(super) const VERILOG: &[&str] = &[
    "always", "and", "assign", "automatic", "begin", "buf", "bufif0", "bufif1", "case", "casex", "casez", "cell", "cmos", "config",
    "deassign", "default", "defparam", "design", "disable", "edge", "else", "end", "endcase", "endconfig", "endfunction", "endgenerate",
    "endmodule", "endprimitive", "endspecify", "endtable", "endtask", "event", "for", "force", "forever", "fork", "function", "generate",
    "genvar", "highz0", "highz1", "if", "ifnone", "incdir", "include", "initial", "inout", "input", "instance", "integer", "join", "large",
    "liblist", "library", "localparam", "macromodule", "medium", "module", "nand", "negedge", "nmos", "nor", "noshowcancelled", "not",
    "notif0", "notif1", "or", "output", "parameter", "pmos", "posedge", "primitive", "pull0", "pull1", "pulldown", "pullup",
    "pulsestyle_ondetect", "pulsestyle_onevent", "rcmos", "real", "realtime", "reg", "release", "repeat", "rnmos", "rpmos", "rtran",
    "rtranif0", "rtranif1", "scalared", "showcancelled", "signed", "small", "specify", "specparam", "strong0", "strong1", "supply0",
    "supply1", "table", "task", "time", "tran", "tranif0", "tranif1", "tri", "tri0", "tri1", "triand", "trior", "trireg", "unsigned", "use",
    "uwire", "vectored", "wait", "wand", "weak0", "weak1", "while", "wire", "wor", "xnor", "xor",
];

/// The words of IEEE 1800-2017 that Verilog does not have.
#[rustfmt::skip]
pub(super) const SYSTEM_VERILOG: &[&str] = &[
    "accept_on", "alias", "always_comb", "always_ff", "always_latch", "assert", "assume", "before", "bind", "bins", "binsof", "bit",
    "break", "byte", "chandle", "checker", "class", "clocking", "const", "constraint", "context", "continue", "cover", "covergroup",
    "coverpoint", "cross", "dist", "do", "endchecker", "endclass", "endclocking", "endgroup", "endinterface", "endpackage", "endprogram",
    "endproperty", "endsequence", "enum", "eventually", "expect", "export", "extends", "extern", "final", "first_match", "foreach",
    "forkjoin", "global", "iff", "ignore_bins", "illegal_bins", "implements", "implies", "import", "inside", "int", "interconnect",
    "interface", "intersect", "join_any", "join_none", "let", "local", "logic", "longint", "matches", "modport", "nettype", "new",
    "nexttime", "null", "package", "packed", "priority", "program", "property", "protected", "pure", "rand", "randc", "randcase",
    "randsequence", "ref", "reject_on", "restrict", "return", "s_always", "s_eventually", "s_nexttime", "s_until", "s_until_with",
    "sequence", "shortint", "shortreal", "soft", "solve", "static", "string", "strong", "struct", "super", "sync_accept_on",
    "sync_reject_on", "tagged", "this", "throughout", "timeprecision", "timeunit", "type", "typedef", "union", "unique", "unique0", "until",
    "until_with", "untyped", "var", "virtual", "void", "wait_order", "weak", "wildcard", "with", "within",
];

/// Words that tools reserve in addition to both standards. These are words of Verilog-AMS and of earlier drafts that Icarus Verilog knows, and the classes of
/// the package `std`, whose names Verilator reads as types.
#[rustfmt::skip]
pub(super) const VERILOG_TOOLS: &[&str] = &[
    "bool", "mailbox", "process", "semaphore", "wone", "wreal",
];

/// PALASM 2 and 4, including words that follow a dot.
#[rustfmt::skip]
pub(super) const PALASM: &[&str] = &[
    "assign_misr", "author", "begin", "boolean_equation", "case", "check", "checkq", "chip", "clkf", "clockf", "cmbf", "comb", "combinatorial",
    "company", "condition", "conditions", "date", "declaration", "default_branch", "default_output", "device", "do", "else", "end",
    "equations", "for", "ghp", "global", "gnd", "group", "hold_state", "if", "ind_reg", "input", "io", "latched", "mealy_machine",
    "minimize_off", "minimize_on", "moore_machine", "nc", "next_state", "node", "not", "or", "out", "outf", "output", "output_enable",
    "output_hold", "pair", "pattern", "pin", "power_up", "preload", "prldf", "prload", "reg", "registered", "reset", "revision", "rstf",
    "setf", "signature", "simulation", "start_up", "state", "string", "test", "then", "title", "to", "trace_off", "trace_on", "transition",
    "trst", "vcc", "vector", "while", "xor",
];

/// Reserved words of CUPL.
#[rustfmt::skip]
pub(super) const CUPL: &[&str] = &[
    "append", "assembly", "assy", "b", "ckmux", "company", "condition", "d", "date", "declare", "default", "designer", "device", "dfb",
    "dq", "else", "feedback", "field", "fld", "flip", "format", "function", "fuse", "group", "h", "if", "imux", "in", "inc", "int", "io", "iod",
    "iodap", "iodar", "iodfb", "ios", "jump", "lemux", "loc", "location", "lq", "macro", "macrocell", "max", "min", "name", "next", "node",
    "o", "oe", "oemux", "out", "partno", "pin", "pinnode", "pld", "present", "property", "repeat", "rev", "revision", "sequence",
    "sequenced", "sequencejk", "sequencers", "sequencet", "table", "tec", "tfb", "undef", "until", "x",
];

/// Reserved words of GALasm and galette.
#[rustfmt::skip]
pub(super) const GALASM: &[&str] = &[
    "ar", "description", "gnd", "nc", "sp", "vcc",
];

/// Words of the chart language that begin an item.
#[rustfmt::skip]
pub(super) const GRAF: &[&str] = &[
    "after", "and", "assert", "assume", "band", "bnot", "board", "bor", "bxor", "chart", "code", "const", "deadline", "device", "do", "edition", "enclosed", "enclosing",
    "event", "extern", "false", "force", "if", "initial", "input", "internal", "macro", "mod", "not", "on", "or", "otherwise", "output",
    "parallel", "place", "priority", "region", "restart", "shl", "shr", "state", "step", "tick", "timer", "true", "use", "var", "when",
];

/// Words of rules text.
#[rustfmt::skip]
pub(super) const RULES: &[&str] = &[
    "Board", "Input", "Inputs", "Marking", "Mealy", "Output", "Outputs", "Registered", "Step", "Steps", "Transition", "Transitions", "and",
    "div", "false", "mod", "not", "or", "true",
];

/// Letters with marks, and their replacements.
pub(super) const LATIN: &[(&str, &str)] = &[
    ("àáâãåāăą", "a"),
    ("ÀÁÂÃÅĀĂĄ", "A"),
    ("ä", "ae"),
    ("Ä", "Ae"),
    ("æ", "ae"),
    ("Æ", "Ae"),
    ("çćĉċč", "c"),
    ("ÇĆĈĊČ", "C"),
    ("ďđð", "d"),
    ("ĎĐÐ", "D"),
    ("èéêëēĕėęě", "e"),
    ("ÈÉÊËĒĔĖĘĚ", "E"),
    ("ĝğġģ", "g"),
    ("ĜĞĠĢ", "G"),
    ("ĥħ", "h"),
    ("ĤĦ", "H"),
    ("ìíîïĩīĭįı", "i"),
    ("ÌÍÎÏĨĪĬĮİ", "I"),
    ("ĵ", "j"),
    ("Ĵ", "J"),
    ("ķ", "k"),
    ("Ķ", "K"),
    ("ĺļľŀł", "l"),
    ("ĹĻĽĿŁ", "L"),
    ("ñńņňŋ", "n"),
    ("ÑŃŅŇŊ", "N"),
    ("òóôõōŏő", "o"),
    ("ÒÓÔÕŌŎŐ", "O"),
    ("öøœ", "oe"),
    ("ÖØŒ", "Oe"),
    ("ŕŗř", "r"),
    ("ŔŖŘ", "R"),
    ("śŝşšș", "s"),
    ("ŚŜŞŠȘ", "S"),
    ("ß", "ss"),
    ("ẞ", "SS"),
    ("ţťŧț", "t"),
    ("ŢŤŦȚ", "T"),
    ("þ", "th"),
    ("Þ", "Th"),
    ("ùúûũūŭůűų", "u"),
    ("ÙÚÛŨŪŬŮŰŲ", "U"),
    ("ü", "ue"),
    ("Ü", "Ue"),
    ("ŵ", "w"),
    ("Ŵ", "W"),
    ("ýÿŷ", "y"),
    ("ÝŸŶ", "Y"),
    ("źżž", "z"),
    ("ŹŻŽ", "Z"),
    ("µμ", "u"),
    ("²", "2"),
    ("³", "3"),
    ("¹", "1"),
];
