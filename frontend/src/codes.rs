//! The findings of the readers: `G01` for the chart language, its properties and boards, `G04` for rules text and the XML formats.

use grafsynth_ir::diag::Code;

/// Something else was expected at this place.
pub const UNEXPECTED: Code = Code { id: "G0101", title: "unexpected text" };
/// A character that the language does not use.
pub const CHARACTER: Code = Code { id: "G0102", title: "unexpected character" };
/// A string, or a name in backquotes, that does not end.
pub const UNCLOSED_QUOTE: Code = Code { id: "G0103", title: "unterminated quote" };
/// A word that is none of those possible here.
pub const UNKNOWN_WORD: Code = Code { id: "G0104", title: "unknown word" };
/// A number that cannot stand here.
pub const NUMBER: Code = Code { id: "G0105", title: "number not allowed here" };
/// A duration without a unit, with an unknown one, or out of range.
pub const DURATION: Code = Code { id: "G0106", title: "invalid duration" };
/// Deeper nesting than the limit.
pub const NESTING: Code = Code { id: "G0107", title: "nesting too deep" };
/// A larger source than the limit.
pub const TOO_LARGE: Code = Code { id: "G0108", title: "source too large" };
/// More findings than are shown.
pub const MORE: Code = Code { id: "G0109", title: "more errors than shown" };
/// A block without its closing brace.
pub const UNCLOSED_BLOCK: Code = Code { id: "G0111", title: "unclosed block" };
/// The same clause twice.
pub const TWICE: Code = Code { id: "G0112", title: "duplicate clause" };
/// A good item in a place where it has no meaning.
pub const MISPLACED: Code = Code { id: "G0113", title: "misplaced item" };
/// A range that is empty, missing or beyond 32 bits.
pub const RANGE: Code = Code { id: "G0114", title: "invalid integer range" };
/// An expression that readers would read in two ways.
pub const AMBIGUOUS: Code = Code { id: "G0115", title: "ambiguous expression" };
/// A file in which no chart stands.
pub const NO_CHART: Code = Code { id: "G0116", title: "no chart in the file" };
/// Something that needs a value, a condition or a name has none.
pub const MISSING: Code = Code { id: "G0117", title: "missing operand or word" };
/// An `edition` that this version does not know.
pub const EDITION: Code = Code { id: "G0118", title: "unknown edition" };
/// A backslash and a character that mean nothing together.
pub const ESCAPE: Code = Code { id: "G0119", title: "unknown escape in a string" };
/// A net holds something for which the chart language has no words.
pub const CANNOT_WRITE: Code = Code { id: "G0120", title: "not expressible as a chart" };
/// A transition of a chart that is no statechart says nothing behind its arrow.
pub const NO_TARGET: Code = Code { id: "G0121", title: "transition without a target step" };
/// A rule names something that no list names.
pub const UNLISTED: Code = Code { id: "G0401", title: "name missing from the lists of the rules" };
/// A transition is listed, but no rule says what it does.
pub const NO_RULE: Code = Code { id: "G0402", title: "transition without a rule" };
/// An `# option:` line that says nothing that rules need.
pub const OPTION: Code = Code { id: "G0403", title: "invalid option line" };
/// A step stands in a condition as if it were an input.
pub const STEP_IN_CONDITION: Code =
    Code { id: "G0404", title: "step inside the condition of a rule" };
/// The right side of a rule names the wrong kind of thing.
pub const RIGHT_SIDE: Code = Code { id: "G0405", title: "invalid right side of a rule" };
/// A list given twice.
pub const LIST_TWICE: Code = Code { id: "G0406", title: "duplicate list in the rules" };
/// A file that is not well-formed XML.
pub const XML: Code = Code { id: "G0421", title: "malformed XML" };
/// XML that is well-formed perhaps, but not read: a document type, entities, or more of something than a reader of charts needs.
pub const XML_NOT_READ: Code = Code { id: "G0422", title: "unsupported XML" };
/// An element of SCXML that does not exist or cannot stand where it stands.
pub const SCXML_ELEMENT: Code = Code { id: "G0423", title: "misplaced SCXML element" };
/// An attribute that an element does not have, lacks, or has with a value that means nothing.
pub const SCXML_ATTRIBUTE: Code = Code { id: "G0424", title: "invalid SCXML attribute" };
/// A part of SCXML that needs more than integers, Booleans and time.
pub const SCXML_REFUSED: Code = Code { id: "G0425", title: "unsupported SCXML feature" };
/// The identifier of a state that no state has.
pub const SCXML_TARGET: Code = Code { id: "G0426", title: "unknown state" };
/// An identifier given to two things.
pub const SCXML_TWICE: Code = Code { id: "G0427", title: "duplicate identifier" };
/// A text that is no expression.
pub const SCXML_EXPRESSION: Code = Code { id: "G0428", title: "invalid SCXML expression" };
/// A number where a truth value is needed, or the other way round, or no value at all.
pub const SCXML_KIND: Code = Code { id: "G0429", title: "type error in SCXML" };
/// A place for a value that is none: no datum, the system's own, or an input.
pub const SCXML_LOCATION: Code = Code { id: "G0430", title: "invalid SCXML location" };
/// Something that has no meaning for a controller and is left out.
pub const SCXML_IGNORED: Code = Code { id: "G0431", title: "ignored part of an SCXML document" };
/// A delay or tick that is not understood or not constant.
pub const SCXML_TIME: Code = Code { id: "G0432", title: "invalid SCXML delay" };
/// A loop whose turns cannot be written out.
pub const SCXML_LOOP: Code = Code { id: "G0433", title: "loop over a non-constant array" };
/// An event that is waited for and never occurs.
pub const SCXML_NEVER: Code = Code { id: "G0434", title: "event that never occurs" };
/// A range of a datum that is none, or that its first value leaves.
pub const SCXML_RANGE: Code = Code { id: "G0435", title: "invalid range of a data element" };
/// Loops or descriptors that become too much when they are written out.
pub const SCXML_SIZE: Code = Code { id: "G0436", title: "SCXML document too large" };
/// A document of no namespace, or of another one.
pub const SCXML_NAMESPACE: Code = Code { id: "G0437", title: "wrong or missing SCXML namespace" };
/// A datum that has no first value.
pub const SCXML_NO_VALUE: Code =
    Code { id: "G0438", title: "data element without an initial value" };
/// A chart holds something for which SCXML has no words.
pub const SCXML_CANNOT_WRITE: Code = Code { id: "G0439", title: "not expressible in SCXML" };
/// A transition from one region of a parallel state to another.
pub const SCXML_REGIONS: Code =
    Code { id: "G0440", title: "transition between regions of a parallel state" };

/// C text that is no C.
pub const C_SYNTAX: Code = Code { id: "G0481", title: "C syntax error" };
/// A character, number, string or comment that C does not know.
pub const C_CHARACTERS: Code = Code { id: "G0482", title: "invalid C token" };
/// A line of the preprocessor that is not done here.
pub const C_DIRECTIVE: Code = Code { id: "G0483", title: "unsupported preprocessor line" };
/// A header that is not read.
pub const C_INCLUDE: Code = Code { id: "G0484", title: "header not read" };
/// A function that is wanted and not there.
pub const C_NO_FUNCTION: Code = Code { id: "G0485", title: "missing C function" };
/// A function that calls itself.
pub const C_RECURSION: Code = Code { id: "G0486", title: "recursive function" };
/// `break`, `continue`, `goto`, `case` or a label in a place where it leads nowhere.
pub const C_JUMP: Code = Code { id: "G0487", title: "invalid jump or label" };
/// A name that nothing declares.
pub const C_UNDECLARED: Code = Code { id: "G0488", title: "undeclared name in the C source" };
/// Two effects, or an effect and a use, in no order.
pub const C_UNSEQUENCED: Code =
    Code { id: "G0489", title: "unsequenced change and use of a variable" };
/// Something of the wrong kind for its place.
pub const C_TYPE: Code = Code { id: "G0490", title: "invalid or unsupported C construct" };
/// A constant is needed.
pub const C_CONSTANT: Code = Code { id: "G0491", title: "constant expression expected" };
/// A piece that only C can say.
pub const C_OPAQUE: Code = Code { id: "G0492", title: "code left to the C library" };
/// An array parameter without a length.
pub const C_ARRAY_LENGTH: Code = Code { id: "G0493", title: "array of unknown length" };
/// More or fewer arguments than parameters.
pub const C_ARGUMENTS: Code = Code { id: "G0494", title: "wrong number of arguments" };
/// Several functions that nothing calls.
pub const C_ENTRY: Code = Code { id: "G0495", title: "function not used in the chart" };
/// A condition that assigns.
pub const C_CONDITION_ASSIGNS: Code = Code { id: "G0496", title: "assignment used as a condition" };
/// An `if` or a loop whose body is only a semicolon.
pub const C_EMPTY_BODY: Code = Code { id: "G0497", title: "empty body of a C statement" };

/// Something else was expected at this place of an IEC 61131-3 text.
pub const ST_UNEXPECTED: Code = Code { id: "G0441", title: "unexpected structured text" };
/// A character, comment, pragma or string that is no token.
pub const ST_CHARACTER: Code =
    Code { id: "G0442", title: "unexpected character in structured text" };
/// A part of IEC 61131-3 that this version does not read.
pub const ST_NOT_READ: Code = Code { id: "G0443", title: "unsupported IEC 61131-3 feature" };
/// A name that nothing declares.
pub const ST_UNKNOWN_NAME: Code = Code { id: "G0444", title: "unknown name in structured text" };
/// Types that do not fit, or something assigned that cannot be.
pub const ST_TYPE: Code = Code { id: "G0445", title: "type error in structured text" };
/// A constant that is missing or not understood.
pub const ST_CONSTANT: Code = Code { id: "G0446", title: "constant expected in structured text" };
/// A name declared twice, letter case aside, or a value that two labels of a CASE contain.
pub const ST_DUPLICATE: Code =
    Code { id: "G0447", title: "name or CASE label given twice in structured text" };
/// A call that does not fit what is called.
pub const ST_CALL: Code = Code { id: "G0448", title: "invalid call in structured text" };
/// A loop without a bound that is known before the program runs.
pub const ST_LOOP: Code = Code { id: "G0449", title: "loop without a constant bound" };
/// Neither a program nor a function block with a chart.
pub const ST_NO_POU: Code = Code { id: "G0450", title: "no program in the text" };
/// A unit that is not part of the design, or a variable that other texts declare.
pub const ST_LEFT_OUT: Code = Code { id: "G0451", title: "part omitted from the design" };
/// An integer type wider than a chart's.
pub const ST_NARROWED: Code = Code { id: "G0452", title: "narrowed integer type" };
/// A Boolean that steps use as an action and statements assign.
pub const ST_MIXED: Code = Code { id: "G0453", title: "Boolean used as an action and assigned" };
/// A time, timer or duration that is not constant, or a timer called twice.
pub const ST_TIMER: Code = Code { id: "G0454", title: "unsupported time in structured text" };
/// More than is written out for loops, functions and blocks.
pub const ST_SIZE: Code = Code { id: "G0455", title: "expansion of structured text too large" };

/// Something in a chart for which IEC 61131-3 has no words.
pub const ST_CANNOT_WRITE: Code = Code { id: "G0456", title: "not expressible in IEC 61131-3" };
/// Something that is left out, renamed, or said in a pragma.
pub const ST_LOST: Code =
    Code { id: "G0457", title: "parts changed or omitted in the written program" };
/// An assignment whose value nothing reads before the next one.
pub const ST_OVERWRITTEN: Code = Code { id: "G0458", title: "assignment without effect" };
/// An instance of a standard block that is read and never called.
pub const ST_NOT_CALLED: Code = Code { id: "G0459", title: "function block that is never called" };
/// The XML is no PLCopen project.
pub const PLC_PROJECT: Code = Code { id: "G0461", title: "not a PLCopen project" };
/// A chart of a project that does not hang together.
pub const PLC_CHART: Code = Code { id: "G0462", title: "incomplete chart in a PLCopen project" };
/// An element, attribute or value that PLCopen XML does not have, or not there.
pub const PLC_MARKUP: Code = Code { id: "G0463", title: "unknown PLCopen element or attribute" };

/// A KISS2 table whose lines do not follow the format.
pub const KISS2_SYNTAX: Code = Code { id: "G0131", title: "invalid state table" };
/// Rows of a KISS2 table that exclude each other.
pub const KISS2_CONTRADICTION: Code =
    Code { id: "G0132", title: "contradictory rows in a state table" };
/// The head of a KISS2 table counts otherwise than its rows.
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
