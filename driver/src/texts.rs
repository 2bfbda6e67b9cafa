//! The texts that a design is read from. The driver opens no files: the caller supplies them all.

use crate::languages::Language;
use crate::stem::FileStem;
use grafsynth_backend_c::cost::Machine;
use grafsynth_frontend::c::Options as COptions;
use grafsynth_ir::FileId;

/// The texts of one design.
#[derive(Debug, Clone, Default)]
pub struct Texts {
    /// The design itself.
    pub main: FileId,
    /// Its language; `None` if its name shows it.
    pub language: Option<&'static Language>,
    /// The stem of its file, which names a chart if the text does not. `None` for standard input.
    pub stem: Option<FileStem>,
    /// A board file.
    pub board: Option<FileId>,
    /// The texts of the files that the design and its libraries name.
    pub libraries: Vec<LibraryText>,
    /// Files that the design or a library names but that do not exist: each with the text that names it.
    pub absent: Vec<(FileId, String)>,
    /// Files with properties, and single properties from the command line.
    pub properties: Vec<FileId>,
    /// Options for reading a design in C.
    pub c: COptions,
    /// The machine whose cost model estimates the cost of tasks that declare none.
    pub machine: Option<&'static Machine>,
}

/// A text that another text names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LibraryText {
    /// The text that contains the name.
    pub from: FileId,
    /// The name as written there.
    pub name: String,
    /// The referenced text.
    pub text: FileId,
}
