//! From the command line to a design: the texts, their companions, and the findings.

use crate::args::{Global, Input, Inputs, Reading};
use crate::exit::{Demands, Exit};
use crate::files;
use crate::lists::did_you_mean;
use crate::render::{self, Style};
use crate::report::{Answer, Report, Status};
use grafsynth_draw::MarkedError;
use grafsynth_driver::languages::{self, LANGUAGES, Language};
use grafsynth_driver::libraries;
use grafsynth_driver::read::{self, Design, LibraryText, NetDesign, ReadLimits, Texts};
use grafsynth_driver::source::Sources;
use grafsynth_driver::stem::FileStem;
use grafsynth_ir::Diagnostic;
use grafsynth_ir::diag::any_error;
use grafsynth_ir::net::Net;
use grafsynth_ir::plant::Plant;
use grafsynth_ir::{Span, Valid};
use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// The path shown for properties from the command line.
const ASSERT: &str = "<--assert>";

/// The maximum number of library files of a design.
const MOST_LIBRARIES: usize = 1_000;

/// The common data of all verbs.
pub(crate) struct Session {
    /// All texts read so far.
    pub(crate) sources: Sources,
    /// How findings are shown.
    pub(crate) style: Style,
    /// Print only findings and requested output.
    pub(crate) quiet: bool,
    /// The user's choice of strictness.
    pub(crate) demands: Demands,
    /// The machine-readable report.
    report: Report,
    limits: ReadLimits,
    pub(crate) source_limit: u64,
    /// Trace files written so far, by all sessions of this run.
    pub(crate) traces: Rc<Cell<usize>>,
    /// The errors so far, one line each; only for `--watch`.
    remarks: Rc<RefCell<Vec<String>>>,
    /// The texts of the last design with errors, and its findings.
    failed: Option<(Texts, Vec<Diagnostic>)>,
}

/// Why a verb cannot continue. If no message is included, it was already printed.
pub(crate) enum Stop {
    /// The input has errors, which were shown.
    Errors,
    /// The request is impossible for the input; with the message to show.
    Input(String),
    /// Wrong usage or an unreadable file; with the message to show.
    Usage(String),
}

impl From<String> for Stop {
    fn from(text: String) -> Self {
        Stop::Usage(text)
    }
}

impl Session {
    pub(crate) fn new(global: &Global, style: Style, report: Report) -> Self {
        Session {
            sources: Sources::default(),
            style,
            // Other messages would be read as part of the report.
            quiet: global.quiet || report.is_for_machines(),
            demands: global.demands(),
            report,
            limits: ReadLimits {
                nesting: global.nesting_limit,
                source: usize::try_from(global.source_limit).unwrap_or(usize::MAX),
                diagnostics: global.max_diagnostics,
            },
            source_limit: global.source_limit,
            traces: Rc::default(),
            remarks: Rc::default(),
            failed: None,
        }
    }

    /// A session like this one that has read nothing.
    pub(crate) fn another(&self) -> Session {
        Session {
            sources: Sources::default(),
            style: self.style,
            quiet: self.quiet,
            demands: self.demands,
            report: self.report.clone(),
            limits: self.limits,
            source_limit: self.source_limit,
            traces: Rc::clone(&self.traces),
            remarks: Rc::clone(&self.remarks),
            failed: None,
        }
    }

    /// Remembers an error for `--watch`.
    pub(crate) fn remark(&self, error: String) {
        self.remarks.borrow_mut().push(error.trim_end().to_owned());
    }

    /// The errors so far, each in one line.
    pub(crate) fn remarks(&self) -> Vec<String> {
        self.remarks.borrow().clone()
    }

    /// True if the answers are for programs; programs get every answer in full.
    pub(crate) fn is_for_machines(&self) -> bool {
        self.report.is_for_machines()
    }

    /// Begins a file: the results that follow belong to it.
    pub(crate) fn begin(&self, file: &str) {
        self.report.design(file);
    }

    /// The named designs, and those in folders.
    pub(crate) fn inputs(&self, inputs: &Inputs) -> Result<Vec<Input>, Stop> {
        let mut all = Vec::new();
        for file in &inputs.files {
            let reading = || inputs.reading.clone();
            if !files::is_folder(file) {
                all.push(Input { file: file.clone(), reading: reading() });
                continue;
            }
            let charts = charts_below(file)?;
            all.extend(charts.into_iter().map(|file| Input { file, reading: reading() }));
        }
        Ok(all)
    }

    /// Runs a verb on each input separately, under its name. A failure does not stop the others; the worst exit code is returned.
    pub(crate) fn each(
        &self,
        inputs: &[Input],
        mut run: impl FnMut(&mut Session, &Input) -> Result<Exit, Stop>,
    ) -> Result<Exit, Stop> {
        let mut exit = Exit::Done;
        for input in inputs {
            self.headline(&input.file);
            let ended = run(&mut self.another(), input);
            exit = exit.worse(ended.unwrap_or_else(|stop| crate::stopped(&self.report, stop)));
        }
        Ok(exit)
    }

    /// Reports why a verb could not continue.
    pub(crate) fn stopped(&self, stop: Stop) -> Exit {
        crate::stopped(&self.report, stop)
    }

    /// Prints the name of the design that the following lines are about.
    pub(crate) fn headline(&self, name: &str) {
        if !self.quiet {
            crate::print(&format!("{name}:\n"));
        }
    }

    /// Shows findings on standard error, or in the report for machines.
    pub(crate) fn show(&self, found: &[Diagnostic]) {
        if found.is_empty() {
            return;
        }
        let found = render::spoken(&self.sources, found);
        for error in found.iter().filter(|finding| finding.is_error()) {
            self.remark(render::short(&self.sources, error));
        }
        self.report.know_findings(&Sources::default(), Vec::new());
        if self.report.is_for_machines() {
            self.report.findings(&self.sources, &found, self.style);
        } else {
            self.report.show(&self.sources, &found, self.style);
        }
    }

    /// True if no row of inputs satisfies all assumptions of the chart, so that there is nothing to compare or to run; this is reported.
    pub(crate) fn is_impossible(&self, net: &Valid<Net>) -> bool {
        let found = grafsynth_verify::check_assumption(net);
        self.show(found.as_slice());
        found.is_some()
    }

    /// Gives an answer: as `text` to people (with `quiet`, only if it is not positive), as data to machines.
    pub(crate) fn answer(&self, answer: &Answer, text: &str) {
        if self.report.is_for_machines() {
            self.report.answer(&self.sources, answer);
            return;
        }
        self.report.count(answer);
        if !self.quiet || matches!(answer.status, Status::Refuted | Status::Open) {
            crate::print(text);
        }
    }

    /// Adds an answer only to the report for machines: people read it in another form, or do not need it.
    pub(crate) fn keep(&self, answer: &Answer) {
        self.report.answer(&self.sources, answer);
    }

    /// Records findings that are shown later, so that they are printed if the user interrupts the program first.
    pub(crate) fn know_found(&self, found: &[Diagnostic]) {
        self.report.know_findings(&self.sources, render::spoken(&self.sources, found));
    }

    /// Records answers that are given at the end, so that they are printed if the user interrupts the program first.
    pub(crate) fn know(&self, known: Vec<(Answer, String)>) {
        self.report.know_answers(known);
    }

    /// Prints an important result, unless a report for machines contains it.
    pub(crate) fn tell(&self, text: &str) {
        if !self.report.is_for_machines() {
            crate::print(text);
        }
    }

    /// Prints an error on standard error, unless a report for machines contains it.
    pub(crate) fn warn(&self, text: &str) {
        if !self.report.is_for_machines() {
            crate::print_error(&format!("grafsynth: {text}\n"));
        }
    }

    /// Prints additional information on standard error, unless quiet.
    pub(crate) fn note(&self, text: &str) {
        if !self.quiet {
            crate::print_error(text);
        }
    }

    /// Reads one text.
    pub(crate) fn text(&mut self, path: &str) -> Result<grafsynth_ir::FileId, Stop> {
        let text = files::read_text(path, self.source_limit)?;
        let shown = if path == "-" { "<stdin>" } else { path };
        Ok(self.sources.add(shown, text))
    }

    /// Reads a design with its companions and returns its findings; shows them if there is no design.
    pub(crate) fn design(&mut self, input: &Input) -> Result<(Design, Vec<Diagnostic>), Stop> {
        let reading = &input.reading;
        let language = match &reading.from {
            None => None,
            Some(name) => Some(Language::named(name).ok_or_else(|| unknown_format(name))?),
        };
        let main = self.text(&input.file)?;
        let is_stdin = input.file == "-";
        let text = self.sources.get(main).filter(|_| is_stdin).map(|source| source.text.as_str());
        let language = language.or_else(|| text.and_then(Language::guess));
        let mut texts = Texts {
            main,
            language,
            stem: FileStem::of_path(&input.file),
            c: reading.c.options(),
            machine: reading.machine,
            ..Texts::default()
        };
        if let Some(board) = &reading.board {
            texts.board = Some(self.text(board)?);
        } else if let Some(beside) = self.companion(&input.file, "board")? {
            texts.board = Some(beside);
        }
        texts.properties.extend(self.companion(&input.file, "props")?);
        let folder = files::folder_of(Path::new(&input.file));
        self.libraries(main, &input.file, reading.root.as_deref().unwrap_or(folder), &mut texts);
        for text in &reading.assert {
            let line = if starts_with_role(text) { text.clone() } else { format!("assert {text}") };
            texts.properties.push(self.sources.add(ASSERT, line));
        }
        let (design, found) = read::read(&self.sources, &texts, self.limits);
        match design {
            Some(design) => Ok((design, found)),
            None => {
                self.show(&found);
                Err(if any_error(&found) {
                    self.failed = Some((texts, found));
                    Stop::Errors
                } else {
                    Stop::Input(format!("{} is empty", input.file))
                })
            }
        }
    }

    /// The chart of the last design with errors, as far as it was parsed, and its errors: their places in it, and each as a line of text.
    pub(crate) fn unchecked(&mut self) -> Option<(grafsynth_ir::chart::Design, Vec<MarkedError>)> {
        let (texts, found) = self.failed.take()?;
        let design = read::unchecked(&self.sources, &texts, self.limits)?;
        let source = self.sources.get(texts.main)?;
        let errors = found.iter().filter(|one| one.is_error()).map(|one| {
            let labels = one.labels.iter().map(|label| label.span);
            let places: Vec<Span> = labels.filter(|span| span.file == texts.main).collect();
            let line = places.first().map(|span| source.line_of(span.range().start) + 1);
            let line = line.map_or_else(String::new, |line| format!("line {line}: "));
            MarkedError { places, text: format!("{line}{}", one.message) }
        });
        Some((design, errors.collect()))
    }

    /// Reads the plant of a chart: the named file, or `NAME.plant` beside the chart. `None` if there is none; with errors, which are shown, there is no page and
    /// no run.
    pub(crate) fn plant(
        &mut self,
        net: &Net,
        chart: &str,
        named: Option<&str>,
    ) -> Result<Option<Plant>, Stop> {
        let file = match named {
            Some(named) => Some(self.text(named)?),
            None => self.companion(chart, "plant")?,
        };
        let Some(file) = file else { return Ok(None) };
        let (plant, found) = read::plant(&self.sources, file, net, self.limits);
        self.show(&found);
        if self.demands.refuse(&found) { Err(Stop::Errors) } else { Ok(plant) }
    }

    /// Reads the file `NAME.extension` in the folder of `path` if it exists, and reports that: answers may depend on its assumptions.
    fn companion(
        &mut self,
        path: &str,
        extension: &str,
    ) -> Result<Option<grafsynth_ir::FileId>, Stop> {
        let Some(beside) = files::companion(path, extension) else { return Ok(None) };
        if files::is_link(&beside) {
            self.note(&format!("{beside} is a symbolic link, which is not followed\n"));
            return Ok(None);
        }
        let text = self.text(&beside)?;
        self.note(&format!("{path} is read with {beside}\n"));
        self.report.beside(&beside);
        Ok(Some(text))
    }

    /// Reads the library files that a text names, and the library files that these name in turn. A file that cannot be read, is not below `root`, or is too large is
    /// left out: the driver reports it at its name.
    fn libraries(
        &mut self,
        main: grafsynth_ir::FileId,
        path: &str,
        root: &Path,
        texts: &mut Texts,
    ) {
        let mut left = self.source_limit;
        let mut known = vec![(files::canonical(path), main)];
        let mut open = vec![(main, path.to_owned())];
        while let Some((from, path)) = open.pop() {
            let Some(source) = self.sources.get(from) else { continue };
            let by_name = Language::of(&source.path, &source.text);
            if ![by_name, texts.language].into_iter().flatten().any(|it| it.has_libraries) {
                continue;
            }
            for name in libraries::wanted(from, &source.text.clone()) {
                let beside = Path::new(&path).parent().map(|folder| folder.join(&name));
                let Some(file) = beside.and_then(|file| file.to_str().map(str::to_owned)) else {
                    continue;
                };
                let one = files::canonical(&file);
                let text = match known.iter().find(|(other, _)| *other == one) {
                    Some((_, text)) => *text,
                    None => {
                        let Some(size) = files::size_within(Path::new(&file), root) else {
                            if files::is_absent_within(Path::new(&file), root) {
                                texts.absent.push((from, name));
                            }
                            continue;
                        };
                        if size > left || known.len() > MOST_LIBRARIES {
                            continue;
                        }
                        let Ok(text) = self.text(&file) else { continue };
                        left = left.saturating_sub(size);
                        known.push((one, text));
                        open.push((text, file));
                        text
                    }
                };
                texts.libraries.push(LibraryText { from, name, text });
            }
        }
    }

    /// The texts read so far that determine what a build writes, with their names relative to the folder of the first.
    pub(crate) fn made_of(&self) -> Vec<files::Hashed> {
        let first = self.sources.get(grafsynth_ir::FileId(0));
        let folder = first.and_then(|source| Path::new(&source.path).parent());
        let folder = folder.unwrap_or(Path::new(""));
        let mut all = Vec::new();
        for (_, source) in self.sources.iter().filter(|(_, source)| source.path != ASSERT) {
            let path = Path::new(&source.path);
            let below = path.strip_prefix(folder).ok().or(path.file_name().map(Path::new));
            let name = below.unwrap_or(path).to_string_lossy().replace('\\', "/");
            all.push(files::hashed(&name, source.text.as_bytes()));
        }
        all
    }

    /// Writes files that the user named, but never over a text that was read.
    pub(crate) fn write_named(&self, files: Vec<(PathBuf, Vec<u8>)>) -> Result<(), Stop> {
        let read: Vec<String> = self.paths().into_iter().map(files::canonical).collect();
        let mut written: Vec<String> = Vec::new();
        for (path, _) in files.iter().filter(|(path, _)| files::exists(path) || files.len() > 1) {
            let one = files::canonical(&path.to_string_lossy());
            if read.contains(&one) {
                let path = path.display();
                return Err(Stop::Usage(format!(
                    "cannot write {path}: the design is read from it"
                )));
            }
            if written.contains(&one) {
                let path = path.display();
                return Err(Stop::Usage(format!("{path} would be written twice")));
            }
            written.push(one);
        }
        Ok(files::write_named(files)?)
    }

    /// All files read so far.
    pub(crate) fn paths(&self) -> Vec<&str> {
        self.sources.iter().map(|(_, source)| source.path.as_str()).collect()
    }

    /// Like [`Session::design`], for verbs that need a chart.
    pub(crate) fn net(&mut self, input: &Input) -> Result<(NetDesign, Vec<Diagnostic>), Stop> {
        match self.design(input)? {
            (Design::Net(design), found) => Ok((*design, found)),
            (Design::Logic(_), _) => Err(Stop::Input(format!(
                "{} is logic, but this verb needs a chart ({}); check, build, sim, compare and convert accept logic",
                input.file,
                languages::extensions(Language::is_chart)
            ))),
        }
    }

    /// Reads the chart at a path with the input options of another file.
    pub(crate) fn net_at(
        &mut self,
        path: &str,
        reading: &Reading,
    ) -> Result<(NetDesign, Vec<Diagnostic>), Stop> {
        self.net(&Input { file: path.to_owned(), reading: reading.clone() })
    }
}

/// The charts in and below a folder, in the order of their paths.
pub(crate) fn charts_below(folder: &str) -> Result<Vec<String>, Stop> {
    // C files are skipped unless requested: `build` writes them.
    let is_found = |language: &Language| language.is_chart() && language.in_folders;
    let mut charts = files::below(folder)?;
    charts.retain(|path| Language::of(path, "").is_some_and(is_found));
    if charts.is_empty() {
        let known = languages::extensions(is_found);
        return Err(Stop::Input(format!("{folder} contains no chart ({known})")));
    }
    Ok(charts)
}

fn unknown_format(name: &str) -> Stop {
    let known: Vec<&str> = LANGUAGES.iter().map(|it| it.name).collect();
    let hint = did_you_mean(name, known.iter().copied());
    Stop::Usage(format!("unknown format `{name}`{hint} (known: {})", known.join(", ")))
}

fn starts_with_role(text: &str) -> bool {
    let word = text.split_whitespace().next().unwrap_or_default();
    word == "assert" || word == "assume"
}
