//! Makes hostile inputs of good inputs: bytes, texts, JSON trees.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

const NUMBERS: [&str; 30] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "nan",
    "NaN",
    ".nan",
    "inf",
    "-inf",
    ".inf",
    "Infinity",
    "1e308",
    "-1e308",
    "1e-308",
    "4e-324",
    "1e154",
    "1e19",
    "18446744073709551615",
    "18446744073709551616",
    "-9223372036854775808",
    "4294967295",
    "4294967296",
    "65535",
    "65536",
    "0x7f",
    "1_000",
    "1e999999",
    "0.5",
    "99999999999999999999999999999",
];
const WORDS: [&str; 30] = [
    "---\n",
    "...\n",
    "%YAML:1.0\n",
    "!!opencv-matrix",
    "&a",
    "*a",
    "<<: *a",
    "- ",
    ": ",
    "#",
    "{",
    "}",
    "[",
    "]",
    "\"",
    "'",
    ",",
    "\n",
    "\t",
    "\r\n",
    "\u{feff}",
    "\0",
    "é",
    "日本",
    "\u{202e}",
    "\u{1b}[2J",
    "<script>alert(1)</script>",
    "=",
    "]]",
    "\\",
];
const BYTES: [u8; 9] = [0, 0xff, 0x7f, 0x80, 1, 0xd9, 0xda, 0xc4, 0xdd];
const STRINGS: [&str; 11] = [
    "",
    "x",
    "<script>alert(1)</script>",
    "\0",
    "k1k2p1p2k3",
    "none",
    "bad",
    "good",
    "\"&'<>",
    "../../etc/passwd",
    "\u{1b}[2J",
];
/// Maximum size of an input.
const MOST_BYTES: usize = 200_000;

/// Random mutations.
pub(crate) struct Mutator {
    rng: ChaCha8Rng,
}

impl Mutator {
    pub(crate) fn new(rng: ChaCha8Rng) -> Self {
        Self { rng }
    }

    /// A number below `count`; 0 for none.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        if count == 0 { 0 } else { self.rng.random_range(0..count) }
    }

    pub(crate) fn chance(&mut self, share: f64) -> bool {
        self.rng.random_bool(share)
    }

    pub(crate) fn share(&mut self) -> f64 {
        self.rng.random()
    }

    pub(crate) fn one<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.rng.random()
    }

    /// A text like a seed of `seeds`.
    pub(crate) fn text(&mut self, seeds: &[String]) -> Vec<u8> {
        let mut text = self.one(seeds).clone().into_bytes();
        for _ in 0..1 + self.below(4) {
            match self.below(11) {
                0..=3 => self.another_number(&mut text),
                4 => self.another_order_of_lines(&mut text),
                5 => {
                    let word = *self.one(&WORDS);
                    self.insert(&mut text, word.as_bytes());
                }
                6 => self.another_byte(&mut text),
                7 => self.without_a_part(&mut text, 40),
                8 => self.a_part_again(&mut text, 60),
                9 => {
                    let other = self.one(seeds).clone().into_bytes();
                    let part = self.part_of(&other, 200);
                    self.insert(&mut text, &part);
                }
                _ => {
                    let number = *self.one(&NUMBERS);
                    self.insert(&mut text, number.as_bytes());
                }
            }
            text.truncate(MOST_BYTES);
        }
        text
    }

    /// Bytes like a seed of `seeds`; mostly headers are changed.
    pub(crate) fn bytes(&mut self, seeds: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = self.one(seeds).clone();
        for _ in 0..1 + self.below(6) {
            if bytes.is_empty() {
                break;
            }
            let within = if self.chance(0.6) { bytes.len().min(700) } else { bytes.len() };
            let at = self.below(within);
            match self.below(8) {
                0 => bytes[at] ^= 1 << self.below(8),
                1 => bytes[at] = *self.one(&BYTES),
                2 => bytes[at] = self.bits() as u8,
                3 => self.without_a_part(&mut bytes, 20),
                4 => self.a_part_again(&mut bytes, 100),
                5 => {
                    let end = (at + 1 + self.below(64)).min(bytes.len());
                    bytes[at..end].fill(0);
                }
                6 => {
                    let end = self.below(bytes.len()).max(bytes.len() / 3);
                    bytes.truncate(end);
                }
                _ if at + 2 <= bytes.len() => {
                    let short =
                        *self.one(&[[0, 0], [0, 1], [0, 2], [0xff, 0xff], [0x80, 0], [0, 8]]);
                    bytes[at..at + 2].copy_from_slice(&short);
                }
                _ => {}
            }
        }
        bytes
    }

    /// Changes `times` places of a JSON tree.
    pub(crate) fn json(&mut self, tree: &mut Value, times: usize) {
        for _ in 0..times {
            let mut places = Vec::new();
            pointers(tree, String::new(), &mut places);
            let place = self.one(&places).clone();
            let Some(value) = tree.pointer_mut(&place) else { continue };
            match value {
                Value::Number(number) if self.chance(0.3) => {
                    let near = 1.0 + (self.share() - 0.5) * 10_f64.powi(-(self.below(8) as i32));
                    *value = json!(number.as_f64().unwrap_or(1.0) * near);
                }
                Value::Number(_) | Value::Null => *value = self.number(),
                Value::Array(items) if !items.is_empty() => match self.below(5) {
                    0 => items.clear(),
                    1 => drop(items.remove(self.below(items.len()))),
                    2 => items.push(items[self.below(items.len())].clone()),
                    3 => items.reverse(),
                    _ => {
                        let at = self.below(items.len());
                        items[at] = self.number();
                    }
                },
                Value::Object(fields) if self.chance(0.2) => {
                    let name = fields.keys().nth(self.below(fields.len())).cloned();
                    name.map(|name| fields.remove(&name));
                }
                Value::String(text) => *text = (*self.one(&STRINGS)).to_owned(),
                Value::Bool(is) => *is = !*is,
                Value::Array(_) | Value::Object(_) => {}
            }
        }
    }

    /// An unexpected number.
    pub(crate) fn number(&mut self) -> Value {
        match self.below(12) {
            0 => json!(0.0),
            1 => json!(-1.0),
            2 => json!(1e308),
            3 => json!(-1e308),
            4 => json!(1e-308),
            5 => json!(u64::MAX),
            6 => json!(i64::MIN),
            7 => json!(self.bits() as u32),
            8 => json!(self.below(10)),
            9 => json!(self.share()),
            10 => json!(null),
            _ => json!(1e154),
        }
    }

    fn another_number(&mut self, text: &mut Vec<u8>) {
        let is_part = |byte: &u8| byte.is_ascii_digit() || b".eE+-".contains(byte);
        let starts: Vec<usize> = (0..text.len())
            .filter(|&at| text[at].is_ascii_digit() && (at == 0 || !is_part(&text[at - 1])))
            .collect();
        if starts.is_empty() {
            return;
        }
        let from = *self.one(&starts);
        let end =
            text[from..].iter().position(|byte| !is_part(byte)).map_or(text.len(), |n| from + n);
        let number = if self.chance(0.8) {
            (*self.one(&NUMBERS)).to_owned()
        } else {
            f64::from_bits(self.bits()).to_string()
        };
        text.splice(from..end, number.into_bytes());
    }

    fn another_order_of_lines(&mut self, text: &mut Vec<u8>) {
        let mut lines: Vec<Vec<u8>> =
            text.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
        if lines.len() < 2 {
            return;
        }
        let (one, other) = (self.below(lines.len()), self.below(lines.len()));
        match self.below(3) {
            0 => drop(lines.remove(one)),
            1 => lines.swap(one, other),
            _ => lines.insert(other, lines[one].clone()),
        }
        *text = lines.concat();
    }

    fn another_byte(&mut self, bytes: &mut [u8]) {
        if !bytes.is_empty() {
            let at = self.below(bytes.len());
            bytes[at] = self.bits() as u8;
        }
    }

    fn insert(&mut self, bytes: &mut Vec<u8>, what: &[u8]) {
        let at = self.below(bytes.len() + 1);
        bytes.splice(at..at, what.iter().copied());
    }

    fn part_of(&mut self, bytes: &[u8], longest: usize) -> Vec<u8> {
        let from = self.below(bytes.len());
        let end = (from + self.below(longest)).min(bytes.len());
        bytes[from..end].to_vec()
    }

    fn without_a_part(&mut self, bytes: &mut Vec<u8>, longest: usize) {
        let from = self.below(bytes.len());
        let end = (from + self.below(longest)).min(bytes.len());
        bytes.drain(from..end);
    }

    fn a_part_again(&mut self, bytes: &mut Vec<u8>, longest: usize) {
        let part = self.part_of(bytes, longest);
        self.insert(bytes, &part);
    }
}

fn pointers(value: &Value, at: String, into: &mut Vec<String>) {
    match value {
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                pointers(item, format!("{at}/{index}"), into);
            }
        }
        Value::Object(fields) => {
            for (name, field) in fields {
                pointers(
                    field,
                    format!("{at}/{}", name.replace('~', "~0").replace('/', "~1")),
                    into,
                );
            }
        }
        _ => {}
    }
    into.push(at);
}
