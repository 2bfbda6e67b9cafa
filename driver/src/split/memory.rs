//! The flash and RAM that the part on the CPU needs with its link: compiled if a compiler is here, else estimated.

use super::link::names;
use super::{BuiltPart, Linked};
use crate::built::OutputFile;
use grafsynth_backend_c::cost;
use grafsynth_backend_c::firmware::stored_bytes;
use grafsynth_ir::Diagnostic;
use grafsynth_ir::net::Net;
use grafsynth_split::codes::MEMORY;
use grafsynth_split::cpu::{Cpu, LinkBytes};
use grafsynth_split::link::smallest_program_alone;

/// Compiles a program for a microcontroller and returns its sizes, or the reason why the compiler fails. It returns `None` if no compiler is installed.
pub type Compile = fn(&Cpu, &Program) -> Option<Result<Sizes, String>>;

/// A program for a microcontroller: the part on the CPU, its link, and a `main` that only calls the link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// The sources and headers.
    pub files: Vec<OutputFile>,
    /// The name of the function for a round; empty if `main` calls the reaction.
    pub round: String,
}

/// The sizes of a compiled program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// The name of the compiler.
    pub compiler: &'static str,
    /// Bytes of flash.
    pub flash: u64,
    /// Bytes of static data.
    pub data: u64,
    /// Bytes of stack of `main` and of the function for a round, without what that calls; `None` if the compiler does not report them.
    pub stack: Option<u64>,
    /// Bytes of data for which the linker found no place in the RAM, although it may have more bytes: an 8051 addresses only half of it directly.
    pub unplaced: u64,
}

/// The memories that the part on the CPU needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory {
    /// Bytes of flash: the part, its link, the start-up code, and a `main` that only calls the link. Functions that the user provides are not included.
    pub flash: u64,
    /// Bytes of static data.
    pub data: u64,
    /// The maximum bytes of stack, without interrupts.
    pub stack: u64,
    /// As in [`Sizes::unplaced`].
    pub unplaced: u64,
    /// The compiler that was used; `None` if the sizes are estimated. The stack of the reaction is always the bound from the emitted text.
    pub compiler: Option<&'static str>,
}

impl Memory {
    /// Bytes of RAM.
    #[must_use]
    pub fn ram(&self) -> u64 {
        self.data + self.stack
    }

    /// The source of the figures.
    #[must_use]
    pub fn source(&self) -> String {
        match self.compiler {
            Some(compiler) => format!("compiled with {compiler}"),
            None => "estimated".to_owned(),
        }
    }

    /// What the microcontroller has too little of: the memory (0 for flash, 1 for RAM), the needed and the available bytes.
    pub(super) fn excess(&self, cpu: &Cpu) -> Vec<(usize, u64, u64)> {
        let (flash, ram) = (u64::from(cpu.flash), u64::from(cpu.ram));
        let least = if self.unplaced > 0 { ram + self.unplaced } else { 0 };
        let both = [(0, self.flash, flash), (1, self.ram().max(least), ram)];
        both.into_iter().filter(|(_, need, have)| need > have).collect()
    }

    /// The finding if the microcontroller has too little memory.
    pub(super) fn misfit(&self, part: &str, cpu: &Cpu) -> Option<Diagnostic> {
        let text = |(memory, need, have): (usize, u64, u64)| match (memory, self.unplaced) {
            (0, _) => format!("needs {need} bytes of flash, but has {have}"),
            (_, 0) => format!("needs {need} bytes of RAM, but has {have}"),
            (_, unplaced) => format!("has no place for {unplaced} bytes of data in its RAM"),
        };
        let needs: Vec<String> = self.excess(cpu).into_iter().map(text).collect();
        let message = format!(
            "`{part}` does not fit the {}: it {} ({})",
            cpu.name,
            needs.join(", and it "),
            self.source()
        );
        let help = "place more objects on the chips, or use a CPU with more memory";
        (!needs.is_empty()).then(|| Diagnostic::error(MEMORY, message).help(help))
    }
}

/// The memories that the part on the CPU needs with this link.
///
/// # Errors
/// The reason why they are not known.
pub(super) fn memory(
    net: &Net,
    part: &BuiltPart,
    linked: &Linked,
    compile: Option<Compile>,
) -> Result<Memory, String> {
    let latched = linked.calls.members.iter();
    let is_c = |file: &&OutputFile| file.name.ends_with(".c") || file.name.ends_with(".h");
    let main = MainProgram {
        text: linked.main.clone(),
        round: format!("{}_link_round", linked.name),
        more: linked.files.iter().filter(is_c).cloned().collect(),
        acts: linked.link.acts.len() as u64,
        data: latched.map(|(id, _)| stored_bytes(net.inputs[*id].ty) as u64).sum(),
    };
    of_program(part, linked.cpu, main, compile)
}

/// The memories that a net alone needs on a microcontroller.
///
/// # Errors
/// The reason why they are not known.
pub(super) fn memory_alone(
    net: &Net,
    built: &BuiltPart,
    cpu: &'static Cpu,
    compile: Option<Compile>,
) -> Result<Memory, String> {
    let package = built.built.packages.first().ok_or("the C was not built")?;
    let names = names(package, net);
    let main = MainProgram {
        text: smallest_program_alone(&names),
        // `main` calls the reaction itself.
        round: String::new(),
        more: Vec::new(),
        acts: 0,
        data: 0,
    };
    of_program(built, cpu, main, compile)
}

/// What is around the emitted C.
struct MainProgram {
    /// The text of `main`.
    text: String,
    /// The function that calls the reaction.
    round: String,
    /// The files of the link.
    more: Vec<OutputFile>,
    /// The number of acts of a round of the link.
    acts: u64,
    /// Bytes of the inputs of the link.
    data: u64,
}

fn of_program(
    part: &BuiltPart,
    cpu: &'static Cpu,
    main: MainProgram,
    compile: Option<Compile>,
) -> Result<Memory, String> {
    let package = part.built.packages.first().ok_or("the part on the CPU was not built")?;
    let machine = cost::machine(cpu.machine).ok_or("the processor has no cost model")?;
    let bound = cost::bound(package, machine).map_err(|why| why.to_string())?;
    let MainProgram { text, round, more, acts, data } = main;
    let sizes = compile.and_then(|compile| {
        let of_package = package.files.iter().filter(|file| !file.keep_existing);
        let of_package =
            of_package.map(|file| OutputFile::new(file.name.clone(), file.text.clone()));
        let main = OutputFile::new("main.c".to_owned(), text);
        compile(cpu, &Program { files: of_package.chain(more).chain([main]).collect(), round })
    });
    let of_link = |bytes: LinkBytes| u64::from(bytes.stack) + data + bound.io;
    if let Some(sizes) = sizes.transpose()? {
        return Ok(Memory {
            flash: sizes.flash,
            data: sizes.data,
            stack: bound.stack + sizes.stack.or(cpu.link_bytes.map(of_link)).unwrap_or(0),
            unplaced: sizes.unplaced,
            compiler: Some(sizes.compiler),
        });
    }
    let bytes = cpu.link_bytes.ok_or_else(|| {
        format!("no compiler for an {} is installed, and its cost model assumes more RAM", cpu.name)
    })?;
    let waits = if acts > 0 { u64::from(bytes.waits) } else { 0 };
    let of_code = u64::from(bytes.program) + waits + u64::from(bytes.act) * acts;
    Ok(Memory {
        flash: bound.text + of_code,
        data: bound.instance + bound.io + bound.ring + data,
        stack: bound.stack + of_link(bytes),
        unplaced: 0,
        compiler: None,
    })
}
