//! Diagnostic codes of the parsers and writers: `G01` for the chart language, its properties and boards, and state tables; `G04` for rules,
//! SCXML, IEC 61131-3, PLCopen and C.

use grafsynth_ir::diag::Code;

/// A different token was expected here.
pub const UNEXPECTED: Code = Code { id: "G0101", title: "unexpected text" };
/// A character that is not part of the language.
pub const CHARACTER: Code = Code { id: "G0102", title: "unexpected character" };
/// A string or backquoted name without its closing quote.
pub const UNCLOSED_QUOTE: Code = Code { id: "G0103", title: "unterminated quote" };
/// An unknown word where one of a fixed set is expected.
pub const UNKNOWN_WORD: Code = Code { id: "G0104", title: "unknown word" };
/// A number that is not allowed here.
pub const NUMBER: Code = Code { id: "G0105", title: "number not allowed here" };
/// A duration without a unit, with an unknown one, or out of range.
pub const DURATION: Code = Code { id: "G0106", title: "invalid duration" };
/// Nesting that is deeper than the limit.
pub const NESTING: Code = Code { id: "G0107", title: "nesting too deep" };
/// A source that is larger than the limit.
pub const TOO_LARGE: Code = Code { id: "G0108", title: "source too large" };
/// More findings than the limit.
pub const MORE: Code = Code { id: "G0109", title: "more errors than shown" };
/// A block without its closing brace.
pub const UNCLOSED_BLOCK: Code = Code { id: "G0111", title: "unclosed block" };
/// A clause that is given twice.
pub const TWICE: Code = Code { id: "G0112", title: "duplicate clause" };
/// A valid item in a place where it is not allowed.
pub const MISPLACED: Code = Code { id: "G0113", title: "misplaced item" };
/// An integer range that is empty, missing or wider than 32 bits.
pub const RANGE: Code = Code { id: "G0114", title: "invalid integer range" };
/// An expression or a second arrow that could be understood in two ways.
pub const AMBIGUOUS: Code = Code { id: "G0115", title: "ambiguous expression" };
/// A file without a chart.
pub const NO_CHART: Code = Code { id: "G0116", title: "no chart in the file" };
/// A missing value, condition or word.
pub const MISSING: Code = Code { id: "G0117", title: "missing operand or word" };
/// An `edition` that this version does not support.
pub const EDITION: Code = Code { id: "G0118", title: "unknown edition" };
/// An unknown escape sequence: a backslash and a character.
pub const ESCAPE: Code = Code { id: "G0119", title: "unknown escape in a string" };
/// A net contains something that the chart language cannot express.
pub const CANNOT_WRITE: Code = Code { id: "G0120", title: "not expressible as a chart" };
/// A transition without a target in a chart that is not a statechart.
pub const NO_TARGET: Code = Code { id: "G0121", title: "transition without a target step" };
/// A plant uses a name that is no quantity, input or output.
pub const PLANT_NAME: Code = Code { id: "G0122", title: "unknown name in a plant" };
/// A plant uses something of the chart, or of itself, in a way that is not possible.
pub const PLANT_BINDING: Code = Code { id: "G0123", title: "invalid use of a name in a plant" };
/// A rule uses a name that is in none of the lists.
pub const UNLISTED: Code = Code { id: "G0401", title: "name missing from the lists of the rules" };
/// A listed transition without a rule.
pub const NO_RULE: Code = Code { id: "G0402", title: "transition without a rule" };
/// An `# option:` line that the rules language does not support.
pub const OPTION: Code = Code { id: "G0403", title: "invalid option line" };
/// A step used in a condition as if it were an input.
pub const STEP_IN_CONDITION: Code =
    Code { id: "G0404", title: "step inside the condition of a rule" };
/// The right side of a rule names an object of the wrong kind.
pub const RIGHT_SIDE: Code = Code { id: "G0405", title: "invalid right side of a rule" };
/// A list that is given twice.
pub const LIST_TWICE: Code = Code { id: "G0406", title: "duplicate list in the rules" };
/// A file that is not well-formed XML.
pub const XML: Code = Code { id: "G0421", title: "malformed XML" };
/// XML that is not supported: a document type, entities, or a document larger than a limit.
pub const XML_NOT_READ: Code = Code { id: "G0422", title: "unsupported XML" };
/// An unknown SCXML element, or one that is not allowed here.
pub const SCXML_ELEMENT: Code = Code { id: "G0423", title: "misplaced SCXML element" };
/// An SCXML attribute that is unknown, missing, or has an invalid value.
pub const SCXML_ATTRIBUTE: Code = Code { id: "G0424", title: "invalid SCXML attribute" };
/// An SCXML feature that needs more than integers, Booleans and time.
pub const SCXML_REFUSED: Code = Code { id: "G0425", title: "unsupported SCXML feature" };
/// A reference to a state that does not exist.
pub const SCXML_TARGET: Code = Code { id: "G0426", title: "unknown state" };
/// An identifier that is used twice.
pub const SCXML_TWICE: Code = Code { id: "G0427", title: "duplicate identifier" };
/// A text that is not a valid expression.
pub const SCXML_EXPRESSION: Code = Code { id: "G0428", title: "invalid SCXML expression" };
/// A number where a Boolean is needed, a Boolean where a number is needed, or an expression without a value.
pub const SCXML_KIND: Code = Code { id: "G0429", title: "type error in SCXML" };
/// An assignment target that cannot be assigned: an input, a system variable, or something that is not a data element.
pub const SCXML_LOCATION: Code = Code { id: "G0430", title: "invalid SCXML location" };
/// A part that is meaningless for a controller and is ignored.
pub const SCXML_IGNORED: Code = Code { id: "G0431", title: "ignored part of an SCXML document" };
/// A delay or tick that is invalid or not constant.
pub const SCXML_TIME: Code = Code { id: "G0432", title: "invalid SCXML delay" };
/// A loop that cannot be unrolled.
pub const SCXML_LOOP: Code = Code { id: "G0433", title: "loop over a non-constant array" };
/// A transition that waits for an event that never occurs.
pub const SCXML_NEVER: Code = Code { id: "G0434", title: "event that never occurs" };
/// The range of a data element is invalid, or does not contain the initial value.
pub const SCXML_RANGE: Code = Code { id: "G0435", title: "invalid range of a data element" };
/// Loops or event descriptors that expand beyond the limit.
pub const SCXML_SIZE: Code = Code { id: "G0436", title: "SCXML document too large" };
/// A document without a namespace, or with a wrong one.
pub const SCXML_NAMESPACE: Code = Code { id: "G0437", title: "wrong or missing SCXML namespace" };
/// A data element without an initial value.
pub const SCXML_NO_VALUE: Code =
    Code { id: "G0438", title: "data element without an initial value" };
/// A chart contains something that SCXML cannot express.
pub const SCXML_CANNOT_WRITE: Code = Code { id: "G0439", title: "not expressible in SCXML" };
/// A transition from one region of a parallel state to another.
pub const SCXML_REGIONS: Code =
    Code { id: "G0440", title: "transition between regions of a parallel state" };

/// Text that is not valid C.
pub const C_SYNTAX: Code = Code { id: "G0481", title: "C syntax error" };
/// A character, number, string or comment that is not valid in C.
pub const C_CHARACTERS: Code = Code { id: "G0482", title: "invalid C token" };
/// A preprocessor directive that is invalid or not supported.
pub const C_DIRECTIVE: Code = Code { id: "G0483", title: "unsupported preprocessor line" };
/// A header that is not read.
pub const C_INCLUDE: Code = Code { id: "G0484", title: "header not read" };
/// The requested function does not exist.
pub const C_NO_FUNCTION: Code = Code { id: "G0485", title: "missing C function" };
/// A recursive function.
pub const C_RECURSION: Code = Code { id: "G0486", title: "recursive function" };
/// `break`, `continue`, `goto`, `case` or a label that is not allowed here.
pub const C_JUMP: Code = Code { id: "G0487", title: "invalid jump or label" };
/// A name that is not declared.
pub const C_UNDECLARED: Code = Code { id: "G0488", title: "undeclared name in the C source" };
/// Two side effects, or a side effect and a use, without a defined order.
pub const C_UNSEQUENCED: Code =
    Code { id: "G0489", title: "unsequenced change and use of a variable" };
/// A construct that is invalid here or not supported.
pub const C_TYPE: Code = Code { id: "G0490", title: "invalid or unsupported C construct" };
/// A constant expression is required.
pub const C_CONSTANT: Code = Code { id: "G0491", title: "constant expression expected" };
/// Code that only C can express; it is kept as C.
pub const C_OPAQUE: Code = Code { id: "G0492", title: "code kept as C" };
/// An array parameter whose length is unknown.
pub const C_ARRAY_LENGTH: Code = Code { id: "G0493", title: "array of unknown length" };
/// More or fewer arguments than parameters.
pub const C_ARGUMENTS: Code = Code { id: "G0494", title: "wrong number of arguments" };
/// Functions that nothing calls, besides the one that the chart runs.
pub const C_ENTRY: Code = Code { id: "G0495", title: "function not used in the chart" };
/// An assignment used as a condition.
pub const C_CONDITION_ASSIGNS: Code = Code { id: "G0496", title: "assignment used as a condition" };
/// An `if` or a loop whose body is a single semicolon.
pub const C_EMPTY_BODY: Code = Code { id: "G0497", title: "empty body of a C statement" };

/// A different token was expected in an IEC 61131-3 text.
pub const ST_UNEXPECTED: Code = Code { id: "G0441", title: "unexpected structured text" };
/// A character, comment, pragma or string that is not a valid token.
pub const ST_CHARACTER: Code =
    Code { id: "G0442", title: "unexpected character in structured text" };
/// A feature of IEC 61131-3 that this version does not support.
pub const ST_NOT_READ: Code = Code { id: "G0443", title: "unsupported IEC 61131-3 feature" };
/// A name that is not declared.
pub const ST_UNKNOWN_NAME: Code = Code { id: "G0444", title: "unknown name in structured text" };
/// Mismatched types, or an assignment to something that cannot be assigned.
pub const ST_TYPE: Code = Code { id: "G0445", title: "type error in structured text" };
/// A constant that is missing or invalid.
pub const ST_CONSTANT: Code = Code { id: "G0446", title: "constant expected in structured text" };
/// A name that is declared twice, regardless of letter case, or a value that two labels of a CASE contain.
pub const ST_DUPLICATE: Code =
    Code { id: "G0447", title: "name or CASE label given twice in structured text" };
/// A call that does not match the declaration of the called object.
pub const ST_CALL: Code = Code { id: "G0448", title: "invalid call in structured text" };
/// A loop whose number of iterations has no constant bound.
pub const ST_LOOP: Code = Code { id: "G0449", title: "loop without a constant bound" };
/// The text has neither a program nor a function block with a chart.
pub const ST_NO_POU: Code = Code { id: "G0450", title: "no program in the text" };
/// A program organisation unit that is not part of the design, or a variable that is declared in another text.
pub const ST_LEFT_OUT: Code = Code { id: "G0451", title: "part omitted from the design" };
/// An integer type that is wider than the integers of a chart; it is narrowed.
pub const ST_NARROWED: Code = Code { id: "G0452", title: "narrowed integer type" };
/// A Boolean that is both an action of a step and assigned by a statement.
pub const ST_MIXED: Code = Code { id: "G0453", title: "Boolean used as an action and assigned" };
/// A time, timer or duration that is not constant, or a timer that is called twice.
pub const ST_TIMER: Code = Code { id: "G0454", title: "unsupported time in structured text" };
/// Loops, functions and blocks that expand beyond the limit.
pub const ST_SIZE: Code = Code { id: "G0455", title: "expansion of structured text too large" };

/// A chart contains something that IEC 61131-3 cannot express.
pub const ST_CANNOT_WRITE: Code = Code { id: "G0456", title: "not expressible in IEC 61131-3" };
/// Something that the writer omits, renames, or writes as a pragma.
pub const ST_LOST: Code =
    Code { id: "G0457", title: "parts changed or omitted in the written program" };
/// An assignment whose value is overwritten before it is read.
pub const ST_OVERWRITTEN: Code = Code { id: "G0458", title: "assignment without effect" };
/// An instance of a standard block whose outputs are read but which is never called.
pub const ST_NOT_CALLED: Code = Code { id: "G0459", title: "function block that is never called" };
/// XML that is not a PLCopen project.
pub const PLC_PROJECT: Code = Code { id: "G0461", title: "not a PLCopen project" };
/// A chart of a project with missing or inconsistent connections.
pub const PLC_CHART: Code = Code { id: "G0462", title: "incomplete chart in a PLCopen project" };
/// An element, attribute or value that is unknown in PLCopen XML or not allowed here.
pub const PLC_MARKUP: Code = Code { id: "G0463", title: "unknown PLCopen element or attribute" };

/// A KISS2 table whose lines do not follow the format.
pub const KISS2_SYNTAX: Code = Code { id: "G0131", title: "invalid state table" };
/// Contradictory rows of a KISS2 table.
pub const KISS2_CONTRADICTION: Code =
    Code { id: "G0132", title: "contradictory rows in a state table" };
/// The sizes in the header of a KISS2 table differ from its rows.
pub const KISS2_COUNT: Code =
    Code { id: "G0133", title: "state table size that differs from its header" };

/// Every code of this crate.
pub const ALL: &[Code] = &[
    UNEXPECTED,
    CHARACTER,
    UNCLOSED_QUOTE,
    UNKNOWN_WORD,
    NUMBER,
    DURATION,
    NESTING,
    TOO_LARGE,
    MORE,
    UNCLOSED_BLOCK,
    TWICE,
    MISPLACED,
    RANGE,
    AMBIGUOUS,
    NO_CHART,
    MISSING,
    EDITION,
    ESCAPE,
    CANNOT_WRITE,
    NO_TARGET,
    PLANT_NAME,
    PLANT_BINDING,
    UNLISTED,
    NO_RULE,
    OPTION,
    STEP_IN_CONDITION,
    RIGHT_SIDE,
    LIST_TWICE,
    XML,
    XML_NOT_READ,
    SCXML_ELEMENT,
    SCXML_ATTRIBUTE,
    SCXML_REFUSED,
    SCXML_TARGET,
    SCXML_TWICE,
    SCXML_EXPRESSION,
    SCXML_KIND,
    SCXML_LOCATION,
    SCXML_IGNORED,
    SCXML_TIME,
    SCXML_LOOP,
    SCXML_NEVER,
    SCXML_RANGE,
    SCXML_SIZE,
    SCXML_NAMESPACE,
    SCXML_NO_VALUE,
    SCXML_CANNOT_WRITE,
    SCXML_REGIONS,
    C_SYNTAX,
    C_CHARACTERS,
    C_DIRECTIVE,
    C_INCLUDE,
    C_NO_FUNCTION,
    C_RECURSION,
    C_JUMP,
    C_UNDECLARED,
    C_UNSEQUENCED,
    C_TYPE,
    C_CONSTANT,
    C_OPAQUE,
    C_ARRAY_LENGTH,
    C_ARGUMENTS,
    C_ENTRY,
    C_CONDITION_ASSIGNS,
    C_EMPTY_BODY,
    ST_UNEXPECTED,
    ST_CHARACTER,
    ST_NOT_READ,
    ST_UNKNOWN_NAME,
    ST_TYPE,
    ST_CONSTANT,
    ST_DUPLICATE,
    ST_CALL,
    ST_LOOP,
    ST_NO_POU,
    ST_LEFT_OUT,
    ST_NARROWED,
    ST_MIXED,
    ST_TIMER,
    ST_SIZE,
    ST_CANNOT_WRITE,
    ST_LOST,
    ST_OVERWRITTEN,
    ST_NOT_CALLED,
    PLC_PROJECT,
    PLC_CHART,
    PLC_MARKUP,
    KISS2_SYNTAX,
    KISS2_CONTRADICTION,
    KISS2_COUNT,
];
