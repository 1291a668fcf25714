//! Numbers that read back bit for bit.

/// 17 significant digits; always with a point, to be no integer for any reader, and with a signed
/// exponent, to be no text in YAML 1.1.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0.0".into();
    }
    let text = format!("{value:.16e}");
    match text.split_once('e') {
        Some((digits, exponent)) if !exponent.starts_with('-') => format!("{digits}e+{exponent}"),
        _ => text,
    }
}

/// Numbers separated by commas.
pub(super) fn numbers(values: &[f64]) -> String {
    let numbers: Vec<String> = values.iter().map(|value| number(*value)).collect();
    numbers.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_bit_for_bit() {
        for value in [1.0 / 3.0, -1234.567891, 1e-300, 640.0, f64::MAX, f64::MIN_POSITIVE] {
            assert_eq!(number(value).parse::<f64>().expect("a number").to_bits(), value.to_bits());
        }
        assert_eq!(numbers(&[0.0, -0.0, 0.5]), "0.0, 0.0, 5.0000000000000000e-1");
    }
}
