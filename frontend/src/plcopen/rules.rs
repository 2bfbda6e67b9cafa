//! The allowed attributes and elements of a PLCopen project, and which of them are supported.

/// The allowed values of an attribute.
#[derive(Debug, Clone, Copy)]
pub(super) enum Value {
    /// Any text: the code that reads the element checks it, or it has no meaning for a design.
    Any,
    /// `true`, `false`, `1` or `0`.
    Boolean,
    /// A Boolean; only false is supported.
    False,
    /// One of these words; the first is the default. The number is how many of them are supported, counted from the first.
    Word(&'static [&'static str], usize),
}

/// How often an element may occur in another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Times {
    /// At most once.
    One,
    /// Any number of times; only the first one is supported.
    First,
    Many,
    /// An alternative: a parent contains at most one of its elements with `Either`.
    Either,
    /// Part of the format but not supported, with an alternative.
    NotRead(&'static str),
}

pub(super) type Attribute = (&'static str, Value);
/// The name of an element, the kind with its rule, and how often it may occur.
pub(super) type Child = (&'static str, &'static str, Times);

/// The rule of an element kind. Elements with the same name but different meanings have different kinds.
pub(super) struct Rule {
    pub(super) kind: &'static str,
    pub(super) attributes: &'static [&'static [Attribute]],
    pub(super) children: &'static [&'static [Child]],
    /// Whether the element may contain text.
    pub(super) text: bool,
}

/// The kind of elements that are skipped with all their contents: layout, comments, data about the file, and texts that are parsed as a whole.
pub(super) const FREE: &str = "";
/// A child entry that matches every unlisted name.
pub(super) const OTHERS: &str = "*";

use Times::{Either, First, Many, NotRead, One};
use Value::{Any, Boolean, False, Word};

const EDGE: Value = Word(&["none", "rising", "falling"], 3);
const NO_EDGE: Value = Word(&["none", "rising", "falling"], 1);
const STORAGE: Value = Word(&["none", "set", "reset"], 3);
const NO_STORAGE: Value = Word(&["none", "set", "reset"], 1);

/// The attributes of every object in a diagram.
const OBJECT: &[Attribute] = &[
    ("localId", Any),
    ("height", Any),
    ("width", Any),
    ("executionOrderId", Any),
    ("globalId", Any),
];
const NAMED: &[Attribute] = &[("name", Any), ("globalId", Any)];
const NAME: &[Attribute] = &[("name", Any)];
const PARAMETER: &[Attribute] = &[("formalParameter", Any), ("hidden", Boolean)];

const POSITION: &[Child] = &[("position", FREE, Many), ("relPosition", FREE, Many)];
const IN: &[Child] = &[("connectionPointIn", "in", One)];
const OUT: &[Child] = &[("connectionPointOut", "out", One)];
const INS: &[Child] = &[("connectionPointIn", "in", Many)];
const OUTS: &[Child] =
    &[("connectionPointOut", "out", Many), ("connectionPointOutAction", "out", Many)];
const EXPRESSION: &[Child] = &[("expression", "words", One)];
const VARIABLE: &[Child] = &[("variable", "words", One)];
const BODIES: &[Child] = &[
    ("ST", FREE, Either),
    ("IL", FREE, Either),
    ("LD", "LD", Either),
    ("FBD", "FBD", Either),
    ("SFC", "SFC", Either),
];
const VALUES: &[Child] = &[
    ("simpleValue", "simpleValue", Either),
    ("arrayValue", "arrayValue", Either),
    ("structValue", "structValue", Either),
];
const PICTURE: &[Child] = &[
    ("comment", FREE, Many),
    ("error", FREE, Many),
    ("connector", "connector", Many),
    ("continuation", "continuation", Many),
    ("vendorElement", "vendorElement", Many),
    ("block", "block", Many),
    ("inVariable", "inVariable", Many),
    ("outVariable", "outVariable", Many),
    ("inOutVariable", "inOutVariable", Many),
    ("label", "label", Many),
    ("jump", "jump", NotRead("draw conditions instead")),
    ("return", "return", NotRead("draw conditions instead")),
];
const LADDER: &[Child] = &[
    ("leftPowerRail", "leftPowerRail", Many),
    ("rightPowerRail", "rightPowerRail", Many),
    ("contact", "contact", Many),
    ("coil", "coil", Many),
];
const NO_ACTIONS: &[Child] =
    &[("actionBlock", "actionBlock", NotRead("draw it on the page of a chart"))];
const CHART: &[Child] = &[
    ("step", "step", Many),
    ("macroStep", "macroStep", Many),
    ("jumpStep", "jumpStep", Many),
    ("transition", "transition", Many),
    ("selectionDivergence", "branch", Many),
    ("selectionConvergence", "branch", Many),
    ("simultaneousDivergence", "branch", Many),
    ("simultaneousConvergence", "branch", Many),
    ("actionBlock", "actionBlock", Many),
];

/// An element with its own rules for attributes and children, and without text.
const fn rule(
    kind: &'static str,
    attributes: &'static [&'static [Attribute]],
    children: &'static [&'static [Child]],
) -> Rule {
    Rule { kind, attributes, children, text: false }
}

/// PLCopen TC6 XML 2.01, with extensions of 1.01 and of the files of CODESYS and Beremiz. `addData` and `documentation` are allowed
/// everywhere.
pub(super) const RULES: &[Rule] = &[
    rule(
        "project",
        &[],
        &[&[
            ("fileHeader", FREE, Many),
            ("contentHeader", FREE, Many),
            ("types", "types", One),
            ("instances", "instances", One),
        ]],
    ),
    rule("types", &[], &[&[("dataTypes", "dataTypes", One), ("pous", "pous", One)]]),
    rule("dataTypes", &[], &[&[("dataType", "dataType", Many)]]),
    rule("pous", &[], &[&[("pou", "pou", Many)]]),
    rule("instances", &[], &[&[("configurations", "configurations", One)]]),
    rule("configurations", &[], &[&[("configuration", "configuration", Many)]]),
    rule(
        "configuration",
        &[NAMED],
        &[&[
            ("resource", "resource", Many),
            ("globalVars", "variables", Many),
            ("accessVars", FREE, Many),
            ("configVars", FREE, NotRead("give variables their values in their declarations")),
        ]],
    ),
    rule(
        "resource",
        &[NAMED],
        &[&[
            ("task", "task", Many),
            ("globalVars", "variables", Many),
            ("pouInstance", "pouInstance", Many),
        ]],
    ),
    rule(
        "task",
        &[NAMED, &[("single", Any), ("interval", Any), ("priority", Any)]],
        &[&[("pouInstance", "pouInstance", Many)]],
    ),
    rule("pouInstance", &[NAMED, &[("typeName", Any), ("type", Any)]], &[]),
    // Types and variables
    rule("dataType", &[NAMED], &[&[("baseType", "type", One), ("initialValue", "value", One)]]),
    rule(
        "type",
        &[],
        &[&[
            ("array", "array", Either),
            ("derived", "derived", Either),
            ("enum", "enum", Either),
            ("struct", "struct", Either),
            ("subrangeSigned", "subrange", Either),
            ("subrangeUnsigned", "subrange", Either),
            ("pointer", "pointer", Either),
            ("string", "string", Either),
            ("wstring", "string", Either),
            (OTHERS, "elementary", Either),
        ]],
    ),
    rule("elementary", &[], &[]),
    rule("derived", &[NAME], &[]),
    rule("string", &[&[("length", Any)]], &[]),
    rule("array", &[], &[&[("dimension", "range", Many), ("baseType", "type", One)]]),
    rule("subrange", &[], &[&[("range", "range", One), ("baseType", "type", One)]]),
    rule("range", &[&[("lower", Any), ("upper", Any)]], &[]),
    rule("pointer", &[], &[&[("baseType", "type", One)]]),
    rule("enum", &[], &[&[("values", "enum values", One), ("baseType", "type", One)]]),
    rule("enum values", &[], &[&[("value", "enum value", Many)]]),
    rule("enum value", &[NAME, &[("value", Any)]], &[]),
    rule("struct", &[], &[&[("variable", "variable", Many)]]),
    rule("value", &[], &[VALUES]),
    rule("simpleValue", &[&[("value", Any)]], &[]),
    rule("arrayValue", &[], &[&[("value", "array element", Many)]]),
    rule("array element", &[&[("repetitionValue", Any)]], &[VALUES]),
    rule("structValue", &[], &[&[("value", "field", Many)]]),
    rule("field", &[&[("member", Any)]], &[VALUES]),
    rule(
        "variables",
        &[
            NAMED,
            &[
                ("constant", Boolean),
                ("retain", Boolean),
                ("nonretain", Boolean),
                ("persistent", Boolean),
                ("nonpersistent", Boolean),
            ],
        ],
        &[&[("variable", "variable", Many)]],
    ),
    rule(
        "variable",
        &[NAMED, &[("address", Any)]],
        &[&[("type", "type", One), ("initialValue", "value", One)]],
    ),
    // Units
    rule(
        "pou",
        &[NAMED, &[("pouType", Any)]],
        &[&[
            ("interface", "interface", One),
            ("actions", "actions", One),
            ("transitions", "transitions", One),
            ("body", "body", First),
        ]],
    ),
    rule(
        "interface",
        &[],
        &[&[
            ("returnType", "type", One),
            ("localVars", "variables", Many),
            ("tempVars", "variables", Many),
            ("inputVars", "variables", Many),
            ("outputVars", "variables", Many),
            ("inOutVars", "variables", Many),
            ("externalVars", "variables", Many),
            ("globalVars", "variables", Many),
            (
                "accessVars",
                FREE,
                NotRead("declare them as inputs, outputs, local or global variables"),
            ),
        ]],
    ),
    rule("actions", &[], &[&[("action", "named body", Many)]]),
    rule("transitions", &[], &[&[("transition", "named body", Many)]]),
    rule("named body", &[NAMED], &[&[("body", "body", One)]]),
    rule("body", &[NAMED, &[("WorksheetName", Any)]], &[BODIES]),
    rule("FBD", &[], &[PICTURE, LADDER, NO_ACTIONS]),
    rule("LD", &[], &[PICTURE, LADDER, NO_ACTIONS]),
    rule("SFC", &[], &[PICTURE, LADDER, CHART]),
    // Diagrams
    rule(
        "in",
        &[&[("globalId", Any)]],
        &[
            POSITION,
            &[
                ("connection", "connection", Many),
                ("expression", FREE, NotRead("draw a variable, and connect it")),
            ],
        ],
    ),
    rule(
        "out",
        &[&[("globalId", Any), ("formalParameter", Any)]],
        &[POSITION, &[("expression", FREE, NotRead("draw a variable, and connect it"))]],
    ),
    rule("written out", &[&[("globalId", Any), ("formalParameter", Any)]], &[POSITION, EXPRESSION]),
    rule(
        "connection",
        &[&[("globalId", Any), ("refLocalId", Any), ("formalParameter", Any)]],
        &[POSITION],
    ),
    Rule { kind: "words", attributes: &[], children: &[], text: true },
    rule("connector", &[OBJECT, NAME], &[POSITION, IN]),
    rule("continuation", &[OBJECT, NAME], &[POSITION, OUT]),
    rule(
        "vendorElement",
        &[OBJECT],
        &[
            POSITION,
            &[
                ("alternativeText", FREE, Many),
                ("inputVariables", "inputs", One),
                ("inOutVariables", "in-outs", One),
                ("outputVariables", "outputs", One),
            ],
        ],
    ),
    rule(
        "block",
        &[OBJECT, &[("typeName", Any), ("instanceName", Any)]],
        &[
            POSITION,
            &[
                ("inputVariables", "inputs", One),
                ("inOutVariables", "in-outs", One),
                ("outputVariables", "outputs", One),
            ],
        ],
    ),
    rule("inputs", &[], &[&[("variable", "input", Many)]]),
    rule("in-outs", &[], &[&[("variable", "in-out", Many)]]),
    rule("outputs", &[], &[&[("variable", "output", Many)]]),
    rule(
        "input",
        &[PARAMETER, &[("negated", Boolean), ("edge", EDGE), ("storage", NO_STORAGE)]],
        &[POSITION, IN],
    ),
    rule(
        "in-out",
        &[PARAMETER, &[("negated", False), ("edge", NO_EDGE), ("storage", NO_STORAGE)]],
        &[POSITION, IN, OUT],
    ),
    rule(
        "output",
        &[PARAMETER, &[("negated", Boolean), ("edge", NO_EDGE), ("storage", NO_STORAGE)]],
        &[POSITION, &[("connectionPointOut", "written out", One)]],
    ),
    rule(
        "inVariable",
        &[OBJECT, &[("negated", Boolean), ("edge", EDGE), ("storage", NO_STORAGE)]],
        &[POSITION, OUT, EXPRESSION],
    ),
    rule(
        "outVariable",
        &[OBJECT, &[("negated", Boolean), ("edge", EDGE), ("storage", STORAGE)]],
        &[POSITION, IN, EXPRESSION],
    ),
    rule(
        "inOutVariable",
        &[
            OBJECT,
            &[
                ("negatedIn", Boolean),
                ("edgeIn", EDGE),
                ("storageIn", STORAGE),
                ("negatedOut", Boolean),
                ("edgeOut", EDGE),
                ("storageOut", NO_STORAGE),
            ],
        ],
        &[POSITION, IN, OUT, EXPRESSION],
    ),
    rule("label", &[OBJECT, &[("label", Any)]], &[POSITION]),
    rule("jump", &[OBJECT, &[("label", Any)]], &[POSITION, IN]),
    rule("return", &[OBJECT], &[POSITION, IN]),
    rule("leftPowerRail", &[OBJECT], &[POSITION, OUTS]),
    rule("rightPowerRail", &[OBJECT], &[POSITION, INS]),
    rule(
        "contact",
        &[OBJECT, &[("negated", Boolean), ("edge", EDGE), ("storage", NO_STORAGE)]],
        &[POSITION, IN, OUT, VARIABLE],
    ),
    rule(
        "coil",
        &[OBJECT, &[("negated", Boolean), ("edge", EDGE), ("storage", STORAGE)]],
        &[POSITION, IN, OUT, VARIABLE],
    ),
    // Charts
    rule(
        "step",
        &[OBJECT, &[("name", Any), ("initialStep", Boolean), ("negated", False)]],
        &[POSITION, INS, OUTS],
    ),
    rule("macroStep", &[OBJECT, NAME], &[POSITION, INS, OUTS, &[("body", "body", One)]]),
    rule("jumpStep", &[OBJECT, &[("targetName", Any)]], &[POSITION, INS]),
    rule("branch", &[OBJECT, NAME], &[POSITION, INS, OUTS]),
    rule(
        "transition",
        &[OBJECT, &[("name", Any), ("priority", Any)]],
        &[POSITION, INS, OUTS, &[("condition", "condition", One)]],
    ),
    rule(
        "condition",
        &[&[("negated", Boolean)]],
        &[&[
            ("reference", "reference", Either),
            ("inline", "body", Either),
            ("connectionPointIn", "in", Either),
        ]],
    ),
    rule("reference", &[NAME], &[]),
    rule(
        "actionBlock",
        &[OBJECT, &[("negated", False)]],
        &[POSITION, INS, &[("action", "action", Many)]],
    ),
    rule(
        "action",
        &[OBJECT, &[("qualifier", Any), ("duration", Any), ("indicator", Any)]],
        &[POSITION, OUTS, &[("reference", "reference", Either), ("inline", "body", Either)]],
    ),
];

/// The rule of this kind.
pub(super) fn of(kind: &str) -> Option<&'static Rule> {
    RULES.iter().find(|rule| rule.kind == kind)
}
