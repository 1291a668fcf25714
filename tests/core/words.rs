//! Words typical of translations don't return.

use std::path::{Path, PathBuf};

/// Never in a sentence for a person.
const NEVER: [&str; 17] = [
    "want",
    "wants",
    "wanted",
    "mend",
    "anew",
    "go on",
    "goes on",
    "going on",
    "gone on",
    "stands",
    "told",
    "by itself",
    "by themselves",
    "of another",
    "there already",
    "plug it out",
    "may not be",
];

/// String literals of a source file outside tests, without inserted values.
fn literals(source: &str) -> Vec<String> {
    let source = source.split("#[cfg(test)]").next().unwrap_or_default();
    let mut found = Vec::new();
    let mut letters = source.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '/' if letters.peek() == Some(&'/') => {
                letters.by_ref().find(|letter| *letter == '\n');
            }
            '\'' => {
                // A character, or a lifetime.
                let mut ahead = letters.clone();
                let first = ahead.next();
                if first == Some('\\') || ahead.next() == Some('\'') {
                    let escaped = letters.next() == Some('\\');
                    if escaped {
                        letters.next();
                    }
                    letters.find(|letter| *letter == '\'');
                }
            }
            '"' => {
                let (mut words, mut depth) = (String::new(), 0);
                while let Some(letter) = letters.next() {
                    match letter {
                        '"' => break,
                        '\\' => {
                            letters.next();
                        }
                        '{' => depth += 1,
                        '}' => depth -= 1,
                        letter if depth == 0 => words.push(letter),
                        _ => {}
                    }
                }
                found.push(words);
            }
            _ => {}
        }
    }
    found
}

/// Words of `NEVER` in `sentence`.
fn foreign(sentence: &str) -> Vec<&'static str> {
    let words: Vec<String> = sentence
        .split(|letter: char| !letter.is_alphanumeric() && letter != '\'')
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect();
    let padded = format!(" {} ", words.join(" "));
    NEVER.into_iter().filter(|never| padded.contains(&format!(" {never} "))).collect()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found
}

#[test]
fn sentences_read_as_if_written_in_english() {
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for folder in [
        "crates/present/src/text",
        "crates/present/src/report",
        "crates/present/src/sheet",
        "crates/present/src/chart",
        "crates/capture/src",
        "crates/app/src",
        "crates/fleet/src",
        "crates/phone/src/session_page",
        "lab/src",
        "src/cli",
        "src/ui",
    ] {
        for path in sources(&checkout.join(folder)) {
            let text = std::fs::read_to_string(&path).expect("readable");
            for sentence in literals(&text) {
                count += usize::from(sentence.contains(' '));
                assert_eq!(foreign(&sentence), [""; 0], "{}: {sentence:?}", path.display());
            }
        }
    }
    assert!(count > 300, "{count} sentences found");
}

#[test]
fn what_is_read_before_the_first_session_does_too() {
    for page in [
        "README.md",
        "CHANGELOG.md",
        "COMPARE.md",
        "docs/commands.md",
        "book/src/introduction.md",
        "book/src/first_session.md",
        "book/src/good.md",
        "book/src/ceiling.md",
        "book/src/board.md",
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(page);
        for line in std::fs::read_to_string(path).expect("readable").lines() {
            assert_eq!(foreign(line), [""; 0], "{page}: {line}");
        }
    }
}

#[test]
fn the_scanner_sees_sentences_only() {
    let source = r#"
        // "a comment wants this"
        fn f<'a>(c: char) { if c == '"' || c == '\'' { say("Tip it: {wanted_px} px") } }
        const B: &str = "He said \"told\" twice";
    "#;
    assert_eq!(literals(source), ["Tip it:  px", "He said told twice"]);
    assert_eq!(foreign("He said told twice"), ["told"]);
    assert_eq!(foreign("Tip it: 22°, want 40°"), ["want"]);
    assert_eq!(foreign("It wants more; go on"), ["wants", "go on"]);
    assert_eq!(foreign("Wantedness, storytold"), [""; 0]);
}
