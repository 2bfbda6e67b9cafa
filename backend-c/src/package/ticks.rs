//! How an example converts the time of a clock to the ticks of a chart.

use super::Chart;

/// `elapsed * multiply / divide` ticks, with a remainder carried from call to call.
pub(super) struct Ratio {
    multiply: u64,
    divide: u64,
    /// The C type of the time since the last call.
    elapsed: &'static str,
}

impl Ratio {
    /// Ticks from a clock with units of `unit_ns`; the difference of two clock values has the type `elapsed`.
    pub(super) fn of(chart: &Chart<'_>, unit_ns: u64, elapsed: &'static str) -> Self {
        let tick = chart.net.settings.tick_ns.max(1);
        let common = gcd(tick, unit_ns);
        Ratio { multiply: unit_ns / common, divide: tick / common, elapsed }
    }

    /// The C type that can represent a product plus the remainder, if a 32-bit clock advances by less than 2^31 between two calls (24 days of milliseconds).
    fn type_name(&self) -> &'static str {
        let most = if self.elapsed == "uint16_t" { 0xffff } else { u64::from(u32::MAX / 2) };
        let most = self.multiply.saturating_mul(most).saturating_add(self.divide);
        if most <= u64::from(u32::MAX) { "uint32_t" } else { "uint64_t" }
    }

    /// The function `name`, which converts the time since the last call to ticks; empty for a chart without time.
    pub(super) fn function(&self, chart: &Chart<'_>, name: &str) -> String {
        let Some(ticks) = chart.package.interface.ticks else { return String::new() };
        let (ty, most, elapsed) = (self.type_name(), ticks.max(), self.elapsed);
        let suffix = if ty == "uint32_t" { "UL" } else { "ULL" };
        let times = match self.multiply {
            1 => format!("({ty})elapsed"),
            multiply => format!("({ty})(({ty})elapsed * {multiply}{suffix})"),
        };
        let count = match self.divide {
            1 => format!("    const {ty} ticks = rest;\n\n    rest = 0U;\n"),
            divide => format!(
                "    const {ty} ticks = ({ty})(rest / {divide}{suffix});\n\n    rest = ({ty})(rest - ({ty})(ticks * {divide}{suffix}));\n"
            ),
        };
        format!(
            "/* The ticks of the chart in this time; the remainder counts in the next call. */\n\
             static {0} {name}({elapsed} elapsed)\n{{\n    static {ty} rest = 0U;\n\n    rest = ({ty})(rest + {times});\n{count}    \
             return ({0})((ticks > {most}{suffix}) ? {most}{suffix} : ticks);\n}}\n\n",
            ticks.name()
        )
    }
}

fn gcd(mut a: u64, mut b: u64) -> u64 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::gcd;

    #[test]
    fn the_greatest_common_divisor_of_a_tick_and_a_millisecond() {
        assert_eq!(gcd(10_000_000, 1_000_000), 1_000_000);
        assert_eq!(gcd(1_500, 1_000_000), 500);
        assert_eq!(gcd(7, 1_000_000), 1);
    }
}
