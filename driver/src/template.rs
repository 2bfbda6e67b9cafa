//! The JSON of a net, and the output of user templates that it fills. Neither is read back, because only the user knows the meaning of the output;
//! `docs/templates.md` describes how the two included templates are compared with the simulator.

pub use crate::built::TemplateFile;
use crate::built::{BuildOptions, Built, OutputFile};
use crate::codes;
use crate::output_report::{OutputReport, OutputVerdict};
use crate::target::Target;
pub use grafsynth_backend_template::codes::TEMPLATE_ENDLESS as ENDLESS;
use grafsynth_backend_template::{Template, json, render, text};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};

/// Adds the outputs of [`Target::Json`] or [`Target::Template`] to a build; returns the findings.
pub(crate) fn build(
    net: &Valid<Net>,
    target: Target,
    options: &BuildOptions,
    built: &mut Built,
) -> Vec<Diagnostic> {
    let json = match json(net) {
        Ok(json) => json,
        Err(found) => return found,
    };
    let stem = options.stem_for(net);
    if target == Target::Json {
        add(built, format!("{stem}.json"), text(&json));
    }
    let mut all = Vec::new();
    if target != Target::Template {
        return all;
    }
    for (at, template) in options.templates.iter().enumerate() {
        let name = template.output(&stem);
        let before = &options.templates[..at];
        let other = before.iter().find(|other| other.output(&stem) == name);
        if other.is_some() || built.files.iter().any(|file| file.name == name) {
            let (message, help) = match other {
                Some(other) if other.path == template.path => (
                    format!("`--template {}` is given twice", template.path),
                    "remove one of the two".to_owned(),
                ),
                Some(other) => (
                    format!("`{}` and `{}` would both be written to {name}", other.path, template.path),
                    "rename one of them, as in `my.py.j2` for a file `STEM.py`, or build them into two folders".to_owned(),
                ),
                None => (
                    format!("`{}` and another target would both be written to {name}", template.path),
                    "rename the template, as in `my.py.j2` for a file `STEM.py`, or build them into two folders".to_owned(),
                ),
            };
            all.push(Diagnostic::error(codes::SAME_OUTPUT, message).help(help));
            continue;
        }
        let source = Template { file: template.file, path: &template.path, text: &template.text };
        match render(&json, &source) {
            Ok(text) => add(built, name, text),
            Err(found) => all.extend(found),
        }
    }
    all
}

fn add(built: &mut Built, name: String, text: String) {
    built.lines.push(OutputReport::new(&name, OutputVerdict::NotChecked));
    built.files.push(OutputFile::new(name, text));
}

#[cfg(test)]
mod tests {
    use super::TemplateFile;
    use crate::stem::FileStem;
    use grafsynth_ir::FileId;

    #[test]
    fn the_template_says_how_its_output_ends() {
        let output = |path: &str| {
            let file = TemplateFile { file: FileId(0), path: path.into(), text: String::new() };
            file.output(&FileStem::of_name("truck"))
        };
        assert_eq!(output("a/my.py.j2"), "truck.py");
        assert_eq!(output("my.mjs.jinja"), "truck.mjs");
        assert_eq!(output("b\\my.ts"), "truck.ts");
        assert_eq!(output("plain.j2"), "truck.txt");
    }
}
