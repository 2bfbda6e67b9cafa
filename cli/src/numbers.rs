//! Numbers on the command line.

use std::fmt::Display;
use std::num::ParseIntError;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A parser of whole numbers within a range, for an option.
pub(crate) fn whole<T>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr<Err = ParseIntError> + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    move |text| {
        let number = text.parse::<T>().ok().filter(|number| range.contains(number));
        let (least, most) = (range.start(), range.end());
        number.ok_or_else(|| format!("expected a whole number from {least} to {most}"))
    }
}

#[cfg(test)]
mod tests {
    use super::whole;

    #[test]
    fn numbers_outside_the_range_are_refused_with_the_range() {
        let parse = whole(1..=8192_u16);
        assert_eq!(parse("8192"), Ok(8192));
        for text in ["0", "8193", "70000", "", "x", "-1"] {
            assert_eq!(parse(text), Err("expected a whole number from 1 to 8192".to_owned()));
        }
    }
}
