//! Times in SCXML, which follow CSS: a number with `s` or `ms`.

/// Parses `1.5s`, `250ms` or `0`, in nanoseconds. `None` for other texts, for fractions of a nanosecond, and for values beyond 64 bits.
pub(super) fn nanoseconds(text: &str) -> Option<u64> {
    let (number, unit) = if let Some(number) = text.strip_suffix("ms") {
        (number, 1_000_000_u64)
    } else if let Some(number) = text.strip_suffix('s') {
        (number, 1_000_000_000)
    } else if text == "0" {
        (text, 1)
    } else {
        return None;
    };
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() && fraction.is_empty() || !digits(whole) || !digits(fraction) {
        return None;
    }
    let whole = if whole.is_empty() { 0 } else { whole.parse::<u64>().ok()? };
    let mut total = whole.checked_mul(unit)?;
    let mut scale = unit;
    for digit in fraction.bytes() {
        let digit = u64::from(digit - b'0');
        if scale % 10 != 0 {
            if digit == 0 {
                continue;
            }
            return None;
        }
        scale /= 10;
        total = total.checked_add(scale.checked_mul(digit)?)?;
    }
    Some(total)
}

/// Writes a time in the same syntax.
pub(super) fn text(ns: u64) -> String {
    if ns.is_multiple_of(1_000_000_000) {
        return format!("{}s", ns / 1_000_000_000);
    }
    if ns.is_multiple_of(1_000_000) {
        return format!("{}ms", ns / 1_000_000);
    }
    let (whole, rest) = (ns / 1_000_000, ns % 1_000_000);
    format!("{whole}.{}ms", format!("{rest:06}").trim_end_matches('0'))
}
