//! `NAME_user.h` and `NAME_user.c`: the declarations of the user's library functions, and stubs for them.

use crate::c::print::{Node, comment_text};
use crate::header::{Layout, described};
use crate::{File, FileKind, Object};
use grafsynth_c::storage;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Driver, InputKind};

impl Layout<'_> {
    /// The functions of the library: signature, comment, return value of the stub, origin.
    fn library(&self) -> Vec<(String, String, Option<&'static str>, Object)> {
        let mut all = Vec::new();
        for (id, input) in
            self.net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Extern)
        {
            let ty = storage(input.ty);
            let value = if input.ty.is_bool() { "false" } else { "0" };
            all.push((
                format!("{ty} {}(void)", self.names.provided[&id]),
                described(&input.name.text, &input.meta.label, &self.names.provided[&id], input.ty),
                Some(value),
                Object::Input(id),
            ));
        }
        for (id, output) in self.net.outputs.iter() {
            let Driver::Extern { params, .. } = &output.driver else { continue };
            let mut space = crate::names::namer();
            let list: Vec<String> = params
                .iter()
                .map(|param| {
                    let name =
                        space.name(if param.name.is_empty() { "value" } else { &param.name });
                    format!("{} {name}", storage(param.ty))
                })
                .collect();
            let list = if list.is_empty() { "void".to_string() } else { list.join(", ") };
            all.push((
                format!("void {}({list})", self.names.outputs[id]),
                described(
                    &output.name.text,
                    &output.meta.label,
                    &self.names.outputs[id],
                    Type::Bool,
                ),
                None,
                Object::Output(id),
            ));
        }
        all
    }

    fn callbacks(&self) -> Vec<(String, &'static str)> {
        if !self.options.callbacks {
            return Vec::new();
        }
        let prefix = &self.names.prefix;
        vec![
            (
                format!("void {prefix}_activated({prefix}_step_t step, bool active)"),
                "A step was activated or deactivated.",
            ),
            (
                format!("void {prefix}_enabled({prefix}_transition_t transition)"),
                "A transition became enabled: it waits for its receptivity from now on.",
            ),
        ]
    }

    pub(crate) fn library_header(&self) -> File {
        let mut nodes = Vec::new();
        for (signature, note, _, object) in self.library() {
            nodes.push(Node::line(format!("{signature};")).note(note).about(object));
        }
        if self.options.once && !self.names.provided.is_empty() {
            nodes.push(Node::comment(
                "The reaction calls these functions, which the link provides.",
            ));
            for id in self.names.provided.keys() {
                let ty = storage(self.net.inputs[*id].ty);
                let signature = format!("{ty} {}(void);", self.names.inputs[*id]);
                nodes.push(Node::line(signature).about(Object::Input(*id)));
            }
        }
        for (signature, note) in self.callbacks() {
            nodes.push(Node::comment(note));
            nodes.push(Node::line(format!("{signature};")));
        }
        nodes.push(Node::blank());
        let chart = format!("#include \"{}.h\"", self.names.stem);
        let include = self.options.callbacks.then(|| Node::directive(chart));
        let contents = include.into_iter().chain(Node::c_linkage(nodes)).collect();
        let what = "the functions that your library provides. Do not edit: it is regenerated from the chart.";
        self.header_file("_user", what, contents)
    }

    pub(crate) fn library_stub(&self) -> File {
        let mut nodes = vec![
            Node::comment(format!(
                "{}: your library. Fill it in; it is yours and is never overwritten.",
                comment_text(&self.net.name.text)
            )),
            Node::directive(format!("#include \"{}_user.h\"", self.names.stem)),
            Node::blank(),
        ];
        for (signature, note, value, object) in self.library() {
            let mut body = unused_parameters(&signature);
            body.extend(value.map(|value| Node::line(format!("return {value};"))));
            if !note.is_empty() {
                nodes.push(Node::comment(note));
            }
            nodes.push(Node::function(signature, body).about(object));
            nodes.push(Node::blank());
        }
        for (signature, note) in self.callbacks() {
            nodes.push(Node::comment(note));
            let body = unused_parameters(&signature);
            nodes.push(Node::function(signature, body));
            nodes.push(Node::blank());
        }
        nodes.pop();
        let name = format!("{}_user.c", self.names.stem);
        File { keep_existing: true, ..self.file(name, &nodes, FileKind::Source) }
    }
}

/// `(void)x;` for each parameter of a stub.
fn unused_parameters(signature: &str) -> Vec<Node> {
    let list = signature.split_once('(').map_or("", |(_, rest)| rest.trim_end_matches(')'));
    list.split(", ")
        .filter_map(|parameter| parameter.rsplit_once(' '))
        .map(|(_, name)| Node::line(format!("(void){};", name.trim_start_matches('*'))))
        .collect()
}
