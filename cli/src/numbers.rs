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
        number.ok_or_else(|| {
            format!("expected a whole number from {} to {}", range.start(), range.end())
        })
    }
}

/// A parser of whole numbers from 0 on, for an option without an upper bound of its own.
pub(crate) fn count<T>() -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr<Err = ParseIntError> + Clone + Send + Sync + 'static,
{
    |text| {
        text.parse::<T>().map_err(|_| {
            let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
            let what = if is_number { "a smaller number" } else { "a whole number, as in 1000" };
            format!("expected {what}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{count, whole};

    #[test]
    fn numbers_outside_the_range_are_refused_with_the_range() {
        let parse = whole(1..=8192_u16);
        assert_eq!(parse("8192"), Ok(8192));
        for text in ["0", "8193", "70000", "", "x", "-1"] {
            assert_eq!(parse(text), Err("expected a whole number from 1 to 8192".to_owned()));
        }
    }

    #[test]
    fn a_count_is_a_whole_number() {
        assert_eq!(count::<u32>()("17"), Ok(17));
        assert_eq!(count::<u32>()("4294967296"), Err("expected a smaller number".to_owned()));
        for text in ["x", "", "1.5", "-1"] {
            assert_eq!(count::<u32>()(text), Err("expected a whole number, as in 1000".to_owned()));
        }
    }
}
