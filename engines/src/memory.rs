//! The sizes of a program on a microcontroller, from the compilers for it.
//!
//! The program is linked with the start-up code and the library of the compiler. Functions that the user provides are missing, so calls of them stay unresolved, which
//! the linkers accept on request; they add nothing to the sizes.

use crate::firmware::Bench;
use crate::{EngineError, arm, tools};
use grafsynth_driver::split::{Program, Sizes};
use grafsynth_split::cpu::{Cpu, Family};

/// The sizes of a program on a microcontroller; `None` if no compiler for it is installed.
#[must_use]
pub fn sizes(cpu: &Cpu, program: &Program) -> Option<Result<Sizes, String>> {
    let (compiler, measure): (&'static str, Measure) = match cpu.family {
        Family::Avr => ("avr-gcc", on_avr),
        Family::Stm32f1 => ("arm-none-eabi-gcc", on_arm),
        Family::Mcs51 => ("sdcc", on_8051),
        Family::Host => return None,
    };
    tools::find(&[compiler])?;
    let files = program.files.iter().map(|file| (file.name.as_str(), file.text.as_str()));
    let sizes = Bench::of_files(files).and_then(|bench| {
        let Bytes { flash, data, stack, unplaced } = measure(&bench, cpu, program)?;
        Ok(Sizes { compiler, flash, data, stack, unplaced })
    });
    Some(sizes.map_err(|error| match error {
        EngineError::Failed(why) => why,
        EngineError::Refused(found) => {
            found.first().map_or_else(String::new, |one| one.message.clone())
        }
    }))
}

type Measure = fn(&Bench, &Cpu, &Program) -> Result<Bytes, EngineError>;

/// What a compiler and its linker report.
#[derive(Debug, PartialEq, Eq)]
struct Bytes {
    flash: u64,
    data: u64,
    stack: Option<u64>,
    unplaced: u64,
}

fn sources(program: &Program) -> impl Iterator<Item = &str> {
    program.files.iter().map(|file| file.name.as_str()).filter(|name| name.ends_with(".c"))
}

fn on_avr(bench: &Bench, cpu: &Cpu, program: &Program) -> Result<Bytes, EngineError> {
    let machine = format!("-mmcu={}", cpu.name);
    let mut arguments = vec![machine.as_str(), "-std=gnu99", "-Os", "-fstack-usage"];
    // A program that does not fit has sizes too.
    arguments.extend(["-Wl,--gc-sections,--noinhibit-exec,--unresolved-symbols=ignore-all"]);
    arguments.extend(["-ffunction-sections", "-o", "chart.elf"]);
    arguments.extend(sources(program));
    bench.compile(&["avr-gcc"], &arguments, cpu.name)?;
    let printed = bench.start(&["avr-size"], &["chart.elf"])?;
    of_gnu(bench, &printed.stdout, program)
}

fn on_arm(bench: &Bench, cpu: &Cpu, program: &Program) -> Result<Bytes, EngineError> {
    bench.write("start.c", arm::START.as_bytes())?;
    bench.write("link.ld", arm::LINK.as_bytes())?;
    let mut arguments = vec!["-mcpu=cortex-m3", "-mthumb", "-std=c99", "-Os", "-fstack-usage"];
    arguments.extend(["-Wl,--gc-sections,--unresolved-symbols=ignore-all", "-ffunction-sections"]);
    arguments.extend(["-nostartfiles", "-T", "link.ld", "-o", "chart.elf", "start.c"]);
    arguments.extend(sources(program));
    bench.compile(&["arm-none-eabi-gcc"], &arguments, cpu.name)?;
    let printed = bench.start(&["arm-none-eabi-size"], &["chart.elf"])?;
    of_gnu(bench, &printed.stdout, program)
}

/// The sizes that `size` prints, and the stack of `main` and of the function for a round.
fn of_gnu(bench: &Bench, printed: &[u8], program: &Program) -> Result<Bytes, EngineError> {
    let (text, data, bss) = numbers(printed).ok_or_else(|| unread("size"))?;
    let mut stack = Some(0);
    let functions = [("main.c", "main"), (link_of(program), program.round.as_str())];
    for (source, function) in functions.into_iter().filter(|(source, _)| !source.is_empty()) {
        let usage = bench.read(&source.replace(".c", ".su")).unwrap_or_default();
        stack = stack.zip(usage_of(&usage, function)).map(|(sum, one)| sum + one);
    }
    Ok(Bytes { flash: text + data, data: data + bss, stack, unplaced: 0 })
}

/// The source of the link; empty if there is none.
fn link_of(program: &Program) -> &str {
    sources(program).find(|name| name.ends_with("_link.c")).unwrap_or_default()
}

fn unread(what: &str) -> EngineError {
    EngineError::Failed(format!("the output of {what} is not understood"))
}

/// Bytes of `.text`, `.data` and `.bss` in the output of `size`.
fn numbers(printed: &[u8]) -> Option<(u64, u64, u64)> {
    let text = String::from_utf8_lossy(printed);
    let numbers = text.lines().nth(1)?.split_whitespace();
    let mut numbers = numbers.map_while(|word| word.parse().ok());
    Some((numbers.next()?, numbers.next()?, numbers.next()?))
}

/// The bytes of stack of a function, from the file that `-fstack-usage` writes: `main.c:7:5:main`, a tab, the bytes.
fn usage_of(text: &str, function: &str) -> Option<u64> {
    let of = |line: &str| {
        let (place, rest) = line.split_once('\t')?;
        let bytes = rest.split('\t').next()?.parse().ok()?;
        (place.rsplit(':').next() == Some(function)).then_some(bytes)
    };
    text.lines().find_map(of)
}

fn on_8051(bench: &Bench, cpu: &Cpu, program: &Program) -> Result<Bytes, EngineError> {
    let ram = cpu.ram.to_string();
    let flags = ["-mmcs51", "--model-small", "--std-sdcc99", "--iram-size", ram.as_str()];
    let mut objects = Vec::new();
    for source in sources(program) {
        let mut arguments = flags.to_vec();
        arguments.extend(["-c", source]);
        bench.compile(&["sdcc"], &arguments, cpu.name)?;
        objects.push(source.replace(".c", ".rel"));
    }
    let mut arguments = flags.to_vec();
    arguments.extend(["--code-size", "65536", "-o", "main.ihx"]);
    // The first object has the function `main`.
    objects.sort_by_key(|name| name != "main.rel");
    arguments.extend(objects.iter().map(String::as_str));
    // The linker reports the sizes of a program that does not fit, too.
    bench.start(&["sdcc"], &arguments)?;
    of_sdcc(&bench.read("main.mem")?).ok_or_else(|| unread("the linker of sdcc"))
}

/// The sizes in the report of the linker of sdcc: `Stack starts at: 0x21 (sp set to 0x20) with ..`, `ROM/EPROM/FLASH 0x0000 0x01ff 512 65536`, and
/// `ERROR: Couldn't get 12 bytes allocated in internal RAM for area OSEG.`
fn of_sdcc(text: &str) -> Option<Bytes> {
    let after = |start: &'static str| {
        let lines = text.lines().filter_map(move |line| line.trim().strip_prefix(start));
        lines.map(|rest| rest.split_whitespace())
    };
    let data = u64::from_str_radix(after("Stack starts at: 0x").next()?.next()?, 16).ok()?;
    let mut of_flash = after("ROM/EPROM/FLASH").next()?;
    let flash = of_flash.find(|word| !word.starts_with("0x"))?.parse().ok()?;
    let missing = after("ERROR: Couldn't get ").filter_map(|mut words| words.next());
    let unplaced = missing.filter_map(|bytes| bytes.parse::<u64>().ok()).sum();
    // Variables have fixed addresses, so `main` and the function for a round have only their return addresses on the stack.
    Some(Bytes { flash, data, stack: Some(4), unplaced })
}

#[cfg(test)]
mod tests {
    use super::{Bytes, numbers, of_sdcc, usage_of};

    #[test]
    fn the_reports_of_compilers_are_read() {
        let text = b"   text\t   data\t    bss\t    dec\t    hex\tfilename\n    562\t      6\t     36\t    604\t    25c\tx\n";
        assert_eq!(numbers(text), Some((562, 6, 36)));
        assert_eq!(numbers(b"avr-size: no such file\n"), None);
        let usage = "truck_link.c:12:6:truck_link_init\t4\tstatic\ntruck_link.c:20:6:truck_link_round\t17\tstatic\n";
        assert_eq!(usage_of(usage, "truck_link_round"), Some(17));
        assert_eq!(usage_of(usage, "round"), None);
    }

    #[test]
    fn the_report_of_the_linker_of_sdcc_is_read() {
        let text = "Internal RAM layout:\n\nStack starts at: 0x21 (sp set to 0x20) with 223 bytes available.\n\nOther memory:\n   Name             Start    End      Size     Max     \n   EXTERNAL RAM                           0    65536   \n   ROM/EPROM/FLASH  0x0000   0x01ff     512    65536   \n";
        assert_eq!(
            of_sdcc(text),
            Some(Bytes { flash: 512, data: 33, stack: Some(4), unplaced: 0 })
        );
        let failed = text.replace(
            "Other",
            "ERROR: Couldn't get 12 bytes allocated in internal RAM for area OSEG.\nOther",
        );
        assert_eq!(of_sdcc(&failed).map(|bytes| bytes.unplaced), Some(12));
        assert_eq!(of_sdcc("Stack starts at: 0x21"), None);
    }
}
