//! The allowed attributes and children of the elements of SCXML.

/// The allowed attributes and children of an element.
pub(super) struct Rule {
    pub(super) name: &'static str,
    pub(super) attributes: &'static [&'static str],
    pub(super) children: &'static [&'static str],
}

const CONTENT: &[&str] =
    &["raise", "if", "foreach", "log", "assign", "send", "cancel", "script", "invoke"];

/// SCXML 1.0, §3 to §6. Elements that are never supported have no rule.
pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "scxml",
        attributes: &["initial", "name", "version", "datamodel", "binding", "exmode"],
        children: &["state", "parallel", "final", "datamodel", "script"],
    },
    Rule {
        name: "state",
        attributes: &["id", "initial"],
        children: &[
            "onentry",
            "onexit",
            "transition",
            "initial",
            "state",
            "parallel",
            "final",
            "history",
            "datamodel",
            "invoke",
        ],
    },
    Rule {
        name: "parallel",
        attributes: &["id"],
        children: &[
            "onentry",
            "onexit",
            "transition",
            "state",
            "parallel",
            "history",
            "datamodel",
            "invoke",
        ],
    },
    Rule { name: "final", attributes: &["id"], children: &["onentry", "onexit", "donedata"] },
    Rule { name: "initial", attributes: &[], children: &["transition"] },
    Rule { name: "history", attributes: &["id", "type"], children: &["transition"] },
    Rule {
        name: "transition",
        attributes: &["event", "cond", "target", "type"],
        children: CONTENT,
    },
    Rule { name: "onentry", attributes: &[], children: CONTENT },
    Rule { name: "onexit", attributes: &[], children: CONTENT },
    Rule { name: "datamodel", attributes: &[], children: &["data"] },
    Rule { name: "data", attributes: &["id", "expr", "src"], children: &[] },
    Rule { name: "raise", attributes: &["event"], children: &[] },
    Rule {
        name: "if",
        attributes: &["cond"],
        children: &[
            "raise", "if", "foreach", "log", "assign", "send", "cancel", "script", "elseif", "else",
        ],
    },
    Rule { name: "elseif", attributes: &["cond"], children: &[] },
    Rule { name: "else", attributes: &[], children: &[] },
    Rule { name: "foreach", attributes: &["array", "item", "index"], children: CONTENT },
    Rule { name: "log", attributes: &["label", "expr"], children: &[] },
    Rule { name: "assign", attributes: &["location", "expr"], children: &[] },
    Rule {
        name: "send",
        attributes: &[
            "event",
            "eventexpr",
            "target",
            "targetexpr",
            "type",
            "typeexpr",
            "id",
            "idlocation",
            "delay",
            "delayexpr",
            "namelist",
        ],
        children: &["param", "content"],
    },
    Rule { name: "cancel", attributes: &["sendid", "sendidexpr"], children: &[] },
];
