//! Messages of TOML parsers about wrong values, in words for people.

/// Types with other names in Rust than in plain words.
const TYPES: [(&str, &str); 11] = [
    ("f64", "a number"),
    ("u64", WHOLE_POSITIVE),
    ("u32", WHOLE_POSITIVE),
    ("usize", WHOLE_POSITIVE),
    ("u16", "a whole number from 0 to 65535"),
    ("u8", "a whole number from 0 to 255"),
    ("i64", "a whole number"),
    ("i32", "a whole number"),
    ("a boolean", "true or false"),
    ("a sequence", "numbers in [ ]"),
    ("an array of length 2", "two numbers in [ ]"),
];
const WHOLE_POSITIVE: &str = "a whole number from 0";

/// A parser's `message` without Rust's names of types, and in a single line if about a value.
pub fn plain_words(message: &str) -> String {
    let message = message.trim_end().replace("\nin ", " in ");
    let Some(wrong) = message.strip_prefix("invalid ") else { return message };
    let Some((found, expected)) = wrong.rsplit_once(", expected ") else { return message };
    let found = ["type: ", "value: "].iter().find_map(|of| found.strip_prefix(of)).unwrap_or(found);
    let (kind, key) = expected.split_once(" in `").unwrap_or((expected, ""));
    let plain = TYPES.iter().find(|(name, _)| *name == kind).map_or(kind, |(_, plain)| plain);
    let key = if key.is_empty() { String::new() } else { format!(" in `{key}") };
    format!("found {found}, expected {plain}{key}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_type_of_rust_is_named() {
        for (message, plain) in [
            (
                "invalid type: string \"a\", expected f64\nin `technician.sway_mm`\n",
                "found string \"a\", expected a number in `technician.sway_mm`",
            ),
            (
                "invalid value: integer `-3`, expected u64",
                "found integer `-3`, expected a whole number from 0",
            ),
            (
                "invalid type: string \", expected u8\", expected a boolean\nin `fisheye`",
                "found string \", expected u8\", expected true or false in `fisheye`",
            ),
            (
                "invalid length 1, expected an array of length 2\nin `pp_px`\n",
                "found length 1, expected two numbers in [ ] in `pp_px`",
            ),
            ("unknown field `f`, expected one of `a`", "unknown field `f`, expected one of `a`"),
        ] {
            assert_eq!(plain_words(message), plain);
        }
    }
}
