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
    files_of(folder, "rs")
}

fn files_of(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files_of(&path, ending));
        } else if path.extension().is_some_and(|extension| extension == ending) {
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
        "crates/terminal/src",
        "crates/window/src",
        "crates/phone/src/session_page",
        "lab/src",
        "src/cli",
        "wings",
    ] {
        let is_test = |path: &PathBuf| path.components().any(|part| part.as_os_str() == "tests");
        for path in sources(&checkout.join(folder)).into_iter().filter(|path| !is_test(path)) {
            let text = std::fs::read_to_string(&path).expect("readable");
            for sentence in literals(&text) {
                count += usize::from(sentence.contains(' '));
                assert_eq!(foreign(&sentence), [""; 0], "{}: {sentence:?}", path.display());
            }
        }
    }
    assert!(count > 300, "{count} sentences found");
}

/// Relative words of a doc comment: each makes the reader wait for its noun.
const RELATIVE: [&str; 9] =
    ["what", "which", "who", "whose", "whom", "whatever", "whichever", "whoever", "that"];
/// Pronouns of a first sentence: the reader doesn't know the noun yet.
const PRONOUNS: [&str; 19] = [
    "it",
    "its",
    "they",
    "them",
    "their",
    "theirs",
    "one",
    "ones",
    "this",
    "these",
    "those",
    "he",
    "she",
    "him",
    "her",
    "his",
    "itself",
    "themselves",
    "himself",
];

/// Doc comments of a source file, each as its lines without fenced blocks.
fn doc_comments(source: &str) -> Vec<Vec<&str>> {
    let (mut found, mut current, mut in_fence) = (Vec::new(), Vec::new(), false);
    for line in source.lines().map(str::trim_start) {
        match line.strip_prefix("///").or_else(|| line.strip_prefix("//!")) {
            Some(text) if text.trim_start().starts_with("```") => in_fence = !in_fence,
            Some(_) if in_fence => {}
            Some(text) => current.push(text.trim()),
            None if current.is_empty() => {}
            None => found.push(std::mem::take(&mut current)),
        }
    }
    found
}

/// Lower-case words of `text` without code.
fn plain_words(text: &str) -> Vec<String> {
    let outside = text.split('`').step_by(2).collect::<Vec<_>>().join(" code ");
    outside
        .split(|letter: char| !letter.is_ascii_alphabetic() && letter != '\'')
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect()
}

#[test]
fn doc_comments_name_things_by_their_nouns() {
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut words, mut relative, mut comments, mut with_pronoun) = (0, 0, 0_u32, 0_u32);
    let mut long = Vec::new();
    for folder in ["crates", "wings", "src", "lab", "python/src"] {
        for path in sources(&checkout.join(folder)) {
            let text = std::fs::read_to_string(&path).expect("readable");
            let is_comment = |line: &&str| line.trim_start().starts_with("//");
            let is_long = |line: &&str| is_comment(line) && line.chars().count() > 100;
            long.extend(text.lines().filter(is_long).map(|_| path.display().to_string()));
            for comment in doc_comments(&text) {
                let comment = comment.join(" ");
                let first = comment.split_inclusive(['.', ':', ';']).next().unwrap_or_default();
                let is_in = |list: &[&str], word: &String| list.contains(&word.as_str());
                let all = plain_words(&comment);
                words += all.len();
                relative += all.iter().filter(|word| is_in(&RELATIVE, word)).count();
                comments += 1;
                let pronouns = plain_words(first).iter().any(|word| is_in(&PRONOUNS, word));
                with_pronoun += u32::from(pronouns);
            }
        }
    }
    assert!(comments > 5000, "{comments} comments found");
    let per_hundred = 100.0 * relative as f64 / words as f64;
    assert!(per_hundred < 1.5, "{per_hundred:.2} relative words in 100");
    let share = 100.0 * f64::from(with_pronoun) / f64::from(comments);
    assert!(share < 15.0, "a pronoun in {share:.1} % of first sentences");
    // Schemas keep the line breaks of their comments, and drawings and tables can't be wrapped.
    assert!(long.len() < 46, "{} comment lines over 100 columns: {long:?}", long.len());
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

/// An apostrophe in a sentence ends a string, and the whole page with it.
#[test]
fn every_line_of_a_script_closes_its_strings() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    let scripts = files_of(&crates, "js");
    assert!(scripts.len() > 1, "{scripts:?}");
    for path in scripts {
        let script = std::fs::read_to_string(&path).expect("readable");
        for (number, line) in (1..).zip(script.lines()) {
            let is_comment = |at: usize| at == 0 || line.as_bytes()[at - 1] == b' ';
            let end = line.match_indices("//").map(|(at, _)| at).find(|at| is_comment(*at));
            let code = line[..end.unwrap_or(line.len())].replace("\\'", "");
            let quotes = code.matches('\'').count();
            assert!(quotes.is_multiple_of(2), "{path:?}, line {number}: {line}");
        }
    }
}
