//! The subset of Python's literals in mrcal's files: dictionaries, lists, tuples, strings, bytes,
//! numbers, `None`, `True`, `False`, and comments. Nothing is evaluated.

use serde_json::{Map, Number, Value};

use super::old_calibration::NotImported;

/// Deepest nesting allowed.
pub(super) const MAX_DEPTH: usize = 32;

/// Parses a single literal up to the end of the text.
pub(super) fn parse(text: &str) -> Result<Value, NotImported> {
    let mut parser = Parser { text, at: 0 };
    let value = parser.value(0)?;
    match parser.peek() {
        None => Ok(value),
        Some(_) => Err(parser.wrong("something follows the closing brace")),
    }
}

struct Parser<'a> {
    text: &'a str,
    /// Bytes read; always at the border of a character.
    at: usize,
}

impl<'a> Parser<'a> {
    fn value(&mut self, depth: usize) -> Result<Value, NotImported> {
        if depth > MAX_DEPTH {
            return Err(self.wrong("nested too deeply"));
        }
        match self.peek() {
            Some('{') => self.dictionary(depth),
            Some('[') => Ok(Value::Array(self.items(']', depth)?)),
            Some('(') => Ok(Value::Array(self.items(')', depth)?)),
            Some('\'' | '"') => self.string().map(Value::String),
            Some('b') if matches!(self.rest().as_bytes().get(1), Some(b'\'' | b'"')) => {
                self.at += 1;
                self.string().map(Value::String)
            }
            Some(c) if c.is_ascii_alphabetic() => self.word(),
            Some(_) => self.number(),
            None => Err(self.wrong("it ends too early")),
        }
    }

    fn dictionary(&mut self, depth: usize) -> Result<Value, NotImported> {
        self.at += 1;
        let mut map = Map::new();
        while !self.take('}') {
            if !matches!(self.peek(), Some('\'' | '"')) {
                return Err(self.wrong("a key should be a string in quotes"));
            }
            let key = self.string()?;
            if !self.take(':') {
                return Err(self.wrong("a key should be followed by a colon"));
            }
            let value = self.value(depth + 1)?;
            if map.insert(key, value).is_some() {
                return Err(self.wrong("a key is there twice"));
            }
            self.comma_or('}')?;
        }
        Ok(Value::Object(map))
    }

    fn items(&mut self, end: char, depth: usize) -> Result<Vec<Value>, NotImported> {
        self.at += 1;
        let mut items = Vec::new();
        while !self.take(end) {
            items.push(self.value(depth + 1)?);
            self.comma_or(end)?;
        }
        Ok(items)
    }

    /// A string in quotes, on a line, without escapes: mrcal's keys, names and base-85 data need
    /// none.
    fn string(&mut self) -> Result<String, NotImported> {
        let quote = &self.rest()[..1];
        let body = &self.rest()[1..];
        match body.find(quote) {
            Some(length) if !body[..length].contains(['\\', '\n']) => {
                self.at += length + 2;
                Ok(body[..length].to_owned())
            }
            Some(_) => Err(self.wrong("a string with escapes or line breaks")),
            None => Err(self.wrong("a string has no end")),
        }
    }

    fn word(&mut self) -> Result<Value, NotImported> {
        let rest = self.rest();
        let length =
            rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let value = match &rest[..length] {
            "None" => Value::Null,
            "True" => Value::Bool(true),
            "False" => Value::Bool(false),
            _ => return Err(self.wrong("a word that is no value")),
        };
        self.at += length;
        Ok(value)
    }

    fn number(&mut self) -> Result<Value, NotImported> {
        let rest = self.rest();
        let length =
            rest.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(rest.len());
        let number = rest[..length].parse().ok().and_then(Number::from_f64);
        let value = number.ok_or_else(|| self.wrong("neither a value nor a finite number"))?;
        self.at += length;
        Ok(Value::Number(value))
    }

    fn comma_or(&mut self, end: char) -> Result<(), NotImported> {
        if self.take(',') || self.peek() == Some(end) {
            Ok(())
        } else {
            Err(self.wrong("a comma or a closing bracket is missing"))
        }
    }

    /// Takes `wanted` if next.
    fn take(&mut self, wanted: char) -> bool {
        let there = self.peek() == Some(wanted);
        if there {
            self.at += wanted.len_utf8();
        }
        there
    }

    /// The next character after spaces and comments.
    fn peek(&mut self) -> Option<char> {
        loop {
            let rest = self.rest();
            let trimmed = rest.trim_start();
            self.at += rest.len() - trimmed.len();
            if !trimmed.starts_with('#') {
                return trimmed.chars().next();
            }
            self.at += trimmed.find('\n').unwrap_or(trimmed.len());
        }
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn wrong(&self, what: &str) -> NotImported {
        let line = 1 + self.text[..self.at].matches('\n').count();
        NotImported::Malformed { reason: format!("line {line}: {what}") }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn literals_are_read_as_python_reads_them() {
        let text = "# made by a tool\n{ 'a': [ 1., -2e-3, ],\n  \"b\": (1,), # note\n 'c': b'{[x', 'd': None, 'e': {} }\n";
        let wanted = json!({ "a": [1.0, -2e-3], "b": [1.0], "c": "{[x", "d": null, "e": {} });
        assert_eq!(parse(text), Ok(wanted));
    }

    #[test]
    fn what_is_no_literal_is_refused_with_its_line() {
        let deep = "[".repeat(100_000);
        for wrong in [
            "{",
            "{'a'",
            "{'a': }",
            "{'a': 1 2}",
            "{a: 1}",
            "{'a': 1, 'a': 2}",
            "{'a': nan}",
            "{'a': 1e999}",
            "{'a': 'b}",
            "{'a': 'b\\x'}",
            "{'a': ü}",
            "{} {}",
            "{'a': __import__}",
            &deep,
        ] {
            let found = parse(wrong);
            assert!(
                matches!(&found, Err(NotImported::Malformed { reason }) if reason.starts_with("line 1")),
                "{found:?}"
            );
        }
    }
}
