//! The targets of a build.

use grafsynth_backend_c::Style;
use grafsynth_backend_pld::Dialect;
use grafsynth_backend_pld::device::Device;
use grafsynth_backend_pld::ice40::PACKAGES;

/// A target of `build`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// C99, in this style or in the style of the options.
    C(Option<Style>),
    /// A language of logic.
    Logic(Dialect),
    /// A fuse map for a device programmer.
    Jedec,
    /// Verilog, pins and bitstream of an iCE40.
    Ice40,
    /// The net's text form.
    Net,
    /// The net and the program of one reaction as JSON.
    Json,
    /// A language defined by the user, through a template over that JSON.
    Template,
}

/// The devices for equations, fuse maps and bitstreams, each with its size and its other names.
pub fn devices() -> impl Iterator<Item = (&'static str, String)> {
    let packages = PACKAGES.iter().map(|package| {
        (package.name, format!("{} pins for signals, target ice40", package.pins.len()))
    });
    let devices = Device::all().map(|device| {
        let mut about = format!("{} macrocells", device.n_cells());
        if device.layout.is_none() {
            about += ", equations only";
        }
        if !device.aliases.is_empty() {
            about += &format!("; also {}", device.aliases.join(" "));
        }
        (device.name, about)
    });
    devices.chain(packages)
}

impl Target {
    /// All targets except those of C, with their names and descriptions.
    const OTHERS: [(Target, &'static str, &'static str); 10] = [
        (Target::Logic(Dialect::Palasm), "palasm", "PALASM 2 equations (.pds)"),
        (Target::Logic(Dialect::Cupl), "cupl", "CUPL equations (.pld)"),
        (Target::Logic(Dialect::Galasm), "galasm", "GALasm and galette equations (.pld)"),
        (
            Target::Logic(Dialect::Verilog),
            "verilog",
            "Verilog-2001, with a test bench if a stimulus is given",
        ),
        (Target::Logic(Dialect::Blif), "blif", "Berkeley Logic Interchange Format"),
        (Target::Jedec, "jedec", "the fuse map of a GAL, with test vectors (.jed)"),
        (
            Target::Ice40,
            "ice40",
            "Verilog, pins (.pcf) and, with yosys, nextpnr and icestorm, the bitstream of an iCE40",
        ),
        (Target::Net, "net", "the net itself, as text"),
        (Target::Json, "json", "the net and one reaction as a program, as JSON (docs/net-json.md)"),
        (
            Target::Template,
            "template",
            "your own language, through a template (--template FILE, docs/templates.md)",
        ),
    ];

    /// All targets with their names and descriptions.
    pub fn all() -> impl Iterator<Item = (Target, &'static str, &'static str)> {
        let c = (Target::C(None), "c", "C99: one instance structure, init, step, stop and getters");
        let styles = Style::ALL.into_iter().filter_map(|style| {
            style.target().map(|(name, about)| (Target::C(Some(style)), name, about))
        });
        std::iter::once(c).chain(styles).chain(Self::OTHERS)
    }

    /// The target with that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Target> {
        Self::all().find(|(_, known, _)| *known == name).map(|(target, _, _)| target)
    }

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::all().find(|(target, _, _)| *target == self).map_or("c", |(_, name, _)| name)
    }

    /// The language, for a target of logic.
    #[must_use]
    pub fn dialect(self) -> Option<Dialect> {
        match self {
            Target::Logic(dialect) => Some(dialect),
            Target::Ice40 => Some(Dialect::Verilog),
            Target::C(_) | Target::Jedec | Target::Net | Target::Json | Target::Template => None,
        }
    }

    /// True if it describes a circuit.
    #[must_use]
    pub fn is_circuit(self) -> bool {
        self == Target::Jedec || self.dialect().is_some()
    }

    /// True if its text assigns signals to the pins of a device.
    #[must_use]
    pub fn has_pins(self) -> bool {
        self == Target::Jedec || self.dialect().is_some_and(Dialect::is_flat)
    }

    /// True if its text can have a reset input.
    #[must_use]
    pub fn can_reset(self) -> bool {
        self.dialect() == Some(Dialect::Verilog)
    }
}
