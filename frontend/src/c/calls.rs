//! Relations between functions: finds the function that the chart runs, rejects recursion, and determines what pointer
//! parameters refer to.

use super::resolve::{FunctionId, Home, PointerUse, Reference, Resolver, VarId};
use super::types::Type;
use crate::codes;
use grafsynth_ir::Gather;
use grafsynth_ir::Span;
use grafsynth_ir::diag::{Diagnostic, nearest};
use std::collections::BTreeSet;

impl Resolver<'_, '_> {
    pub(super) fn entry(&mut self) -> Option<()> {
        let program = &mut self.program;
        if let Some(wanted) = &program.options.entry {
            if let Some(id) = program.by_name.get(wanted) {
                program.entry = *id;
                return Some(());
            }
            let near = nearest(wanted, program.by_name.keys().map(String::as_str)).map_or_else(
                || {
                    let known: Vec<&str> =
                        program.by_name.keys().take(10).map(String::as_str).collect();
                    format!("give one of its functions with --entry, such as {}", known.join(", "))
                },
                |near| format!("did you mean `{near}`?"),
            );
            self.findings.report(|| {
                let finding =
                    Diagnostic::error(codes::C_NO_FUNCTION, format!("unknown function `{wanted}`"))
                        .at(Span::new(program.file, 0, 0), "");
                finding.help(near)
            });
            return None;
        }
        let called: BTreeSet<FunctionId> = program
            .functions
            .iter()
            .flat_map(|one| one.calls.iter().map(|(callee, _)| *callee))
            .gather();
        let roots: Vec<FunctionId> = (0..program.functions.len())
            .filter(|id| !called.contains(id) && !program.functions[*id].is_kept)
            .collect();
        program.entry = match program.by_name.get("main") {
            Some(main) => *main,
            None => roots.last().copied().or_else(|| {
                (0..program.functions.len()).find(|id| !program.functions[*id].is_kept)
            })?,
        };
        let others: Vec<&str> = roots
            .iter()
            .filter(|id| **id != program.entry)
            .map(|id| program.functions[*id].def.name.text.as_str())
            .collect();
        if !others.is_empty() {
            let entry = &program.functions[program.entry].def.name;
            // The two functions that the main program of Arduino calls.
            let is_sketch = entry.text == "loop" && others == ["setup"];
            let quoted: Vec<String> = others.iter().map(|name| format!("`{name}`")).collect();
            let shown = quoted.join(", ");
            self.findings.report(|| {
                let finding = Diagnostic::note(
                    codes::C_ENTRY,
                    format!("the chart runs only `{entry}`; nothing calls {shown}"),
                )
                .at(entry.span, "the chart runs this function");
                if is_sketch {
                    finding.help("for an Arduino sketch, add `int main(void) { setup(); for (;;) loop(); }` and make each pin an `extern volatile` variable")
                } else {
                    finding.help("choose another function with --entry NAME")
                }
            });
        }
        Some(())
    }

    /// Rejects direct and indirect recursion: each function becomes a macro-step, and a macro-step cannot contain itself.
    pub(super) fn recursion(&mut self) {
        // Colours of a depth-first search with an explicit stack: 0 new, 1 open, 2 done.
        let mut colour = vec![0_u8; self.program.functions.len()];
        let mut stack = vec![(self.program.entry, 0_usize)];
        colour[self.program.entry] = 1;
        let mut reported = BTreeSet::new();
        while let Some((id, next)) = stack.last().copied() {
            let Some((callee, span)) = self.program.functions[id].calls.get(next).copied() else {
                colour[id] = 2;
                stack.pop();
                continue;
            };
            if let Some(top) = stack.last_mut() {
                top.1 += 1;
            }
            if self.program.functions[callee].is_kept {
                continue;
            }
            match colour[callee] {
                0 => {
                    colour[callee] = 1;
                    stack.push((callee, 0));
                }
                1 if reported.insert(callee) => {
                    let from = stack.iter().position(|(open, _)| *open == callee).unwrap_or(0);
                    let mut names: Vec<&str> = stack[from..]
                        .iter()
                        .map(|(open, _)| self.program.functions[*open].def.name.text.as_str())
                        .collect();
                    let name = self.program.functions[callee].def.name.clone();
                    names.push(&name.text);
                    let way = format!("`{}`", names.join("` calls `"));
                    self.findings.report(|| {
                        Diagnostic::error(
                            codes::C_RECURSION,
                            format!("`{name}` is recursive: {way}"),
                        )
                        .at(span, "this call completes the recursion")
                        .at(name.span, "the function")
                        .help(format!("use a loop, or keep the function as C with --keep {name}"))
                    });
                }
                _ => {}
            }
        }
    }

    /// Determines what pointer parameters refer to.
    pub(super) fn references(&mut self) {
        // The use of a pointer that is passed on depends on the called function, so this loop runs until nothing changes.
        loop {
            let mut changed = false;
            let uses: Vec<(VarId, PointerUse)> =
                self.pointer_uses.iter().map(|(var, one)| (*var, one.clone())).collect();
            for (var, one) in uses {
                let (mut is_indexed, mut is_other, mut is_written) =
                    (one.is_indexed, one.is_other, false);
                for (callee, index) in &one.passed {
                    let Some(param) = self.program.functions[*callee].params.get(*index).copied()
                    else {
                        continue;
                    };
                    is_other |= self.program.functions[*callee].is_kept;
                    if let Some(theirs) = self.pointer_uses.get(&param) {
                        is_indexed |= theirs.is_indexed;
                        is_other |= theirs.is_other
                            && !matches!(self.program.vars[param].ty, Type::Scalar(_));
                    }
                    let is_array =
                        matches!(self.program.vars[param].ty, Type::Array(..) | Type::Pointer(_));
                    is_written |= is_array && self.program.vars[param].is_written;
                }
                if let Some(mine) = self.pointer_uses.get_mut(&var)
                    && (mine.is_indexed, mine.is_other) != (is_indexed, is_other)
                {
                    (mine.is_indexed, mine.is_other) = (is_indexed, is_other);
                    changed = true;
                }
                if is_written && !self.program.vars[var].is_written {
                    self.program.vars[var].is_written = true;
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        for id in 0..self.program.vars.len() {
            let uses = self.pointer_uses.get(&id).cloned().unwrap_or_default();
            let var = &mut self.program.vars[id];
            let is_param = matches!(var.home, Home::Param(..));
            match (&var.ty, is_param) {
                (Type::Pointer(_) | Type::Array(..), true) if uses.is_other => {
                    var.ty = Type::Opaque
                }
                (Type::Pointer(scalar), true) if uses.is_indexed => {
                    var.ty = Type::Array(*scalar, None, Vec::new());
                    var.reference = Reference::Array;
                }
                (Type::Pointer(scalar), true) => {
                    var.ty = Type::Scalar(*scalar);
                    var.reference = Reference::Scalar;
                }
                (Type::Array(..), true) => var.reference = Reference::Array,
                _ => {}
            }
        }
    }

    /// Determines the lengths of array parameters: the written length or that of the longest argument, whichever is larger; if neither is
    /// known, the default from the options.
    pub(super) fn lengths(&mut self) {
        let default = self.program.options.array_length.max(1);
        let entry = self.program.entry;
        for var in self.program.functions[entry].params.clone() {
            let var = &mut self.program.vars[var];
            if let Type::Array(_, first @ None, _) = &mut var.ty {
                *first = Some(default);
                let name = var.name.clone();
                self.findings.report(|| {
                    Diagnostic::note(
                        codes::C_ARRAY_LENGTH,
                        format!("array `{name}` has no length; {default} elements are used"),
                    )
                    .at(name.span, "no length given")
                    .help("write the length in the brackets, or set it with --array-length N")
                });
            }
        }
        // Lengths propagate from callers to callees. There is no recursion, so one round per function is enough.
        for _ in 0..self.program.functions.len() {
            let mut changed = false;
            for (param, length) in self.argument_lengths() {
                if let Type::Array(_, first, _) = &mut self.program.vars[param].ty
                    && first.is_none_or(|known| known < length)
                {
                    *first = Some(length);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        for var in &mut self.program.vars {
            if let Type::Array(_, first @ None, _) = &mut var.ty {
                *first = Some(default);
            }
        }
    }

    /// For each array that is passed as an argument: the parameter, and the first dimension of the array.
    fn argument_lengths(&self) -> Vec<(VarId, u32)> {
        let mut found = Vec::new();
        for (var, uses) in &self.pointer_uses {
            if let Type::Array(_, Some(length), _) = &self.program.vars[*var].ty {
                let of_callees = uses.passed.iter().filter_map(|(callee, index)| {
                    self.program.functions[*callee].params.get(*index)
                });
                found.extend(of_callees.map(|param| (*param, *length)));
            }
        }
        found
    }
}
