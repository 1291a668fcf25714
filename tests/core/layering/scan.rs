//! Contents of a file: its paths and words, macros and attributes included.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use syn::UseTree;

use super::source::{Import, Source, imports};

/// A path in a file.
#[derive(Debug)]
pub(crate) struct Named {
    pub(crate) module: usize,
    pub(crate) path: Vec<String>,
    /// `pub use`: the name is passed on, not used.
    pub(crate) passed_on: bool,
}

/// A word of a file's code.
#[derive(Debug, PartialEq)]
pub(crate) enum Word {
    Name(String),
    Method(String),
    Macro(String),
}

/// Every path in `source`.
pub(crate) fn paths(source: &Source) -> Vec<Named> {
    let mut found = Vec::new();
    for seen in &source.uses {
        found.push(imported(seen.module, &seen.import, seen.passed_on));
    }
    for (module, tokens) in &source.code {
        let mut scan = Scan { module: *module, scopes: Vec::new(), found: &mut found };
        scan.tokens(tokens.clone(), Inside::Code);
    }
    found
}

fn imported(module: usize, import: &Import, passed_on: bool) -> Named {
    let mut path = import.path.clone();
    if import.name.is_none() {
        path.push("*".to_owned());
    }
    Named { module, path, passed_on }
}

/// Every word of `source`.
pub(crate) fn words(source: &Source) -> Vec<Word> {
    let mut found = Vec::new();
    for seen in &source.uses {
        found.extend(seen.import.path.iter().cloned().map(Word::Name));
    }
    for (_, tokens) in &source.code {
        collect_words(tokens.clone(), &mut found);
    }
    found
}

fn collect_words(tokens: TokenStream, found: &mut Vec<Word>) {
    let tokens = Tokens(tokens.into_iter().collect());
    for (at, token) in tokens.0.iter().enumerate() {
        match token {
            TokenTree::Group(group) => collect_words(group.stream(), found),
            TokenTree::Ident(name) => {
                let name = name.to_string();
                if tokens.is_member(at)
                    && (tokens.is_group(at + 1, Delimiter::Parenthesis) || tokens.colons(at + 1))
                {
                    found.push(Word::Method(name.clone()));
                }
                if tokens.is(at + 1, '!')
                    && matches!(tokens.0.get(at + 2), Some(TokenTree::Group(_)))
                {
                    found.push(Word::Macro(name.clone()));
                }
                found.push(Word::Name(name));
            }
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

/// Tokens of one depth.
struct Tokens(Vec<TokenTree>);

impl Tokens {
    fn is(&self, at: usize, c: char) -> bool {
        matches!(self.0.get(at), Some(TokenTree::Punct(punct)) if punct.as_char() == c)
    }

    fn is_group(&self, at: usize, delimiter: Delimiter) -> bool {
        matches!(self.0.get(at), Some(TokenTree::Group(group)) if group.delimiter() == delimiter)
    }

    fn colons(&self, at: usize) -> bool {
        self.is(at, ':') && self.is(at + 1, ':')
    }

    /// True if a word of `words` is right before `at`.
    fn follows(&self, at: usize, words: &[&str]) -> bool {
        at >= 1
            && matches!(&self.0[at - 1], TokenTree::Ident(before)
                if words.contains(&before.to_string().as_str()))
    }

    /// True if `at` is a field or method: after a single point, since two are a range.
    fn is_member(&self, at: usize) -> bool {
        at >= 1 && self.is(at - 1, '.') && !(at >= 2 && self.is(at - 2, '.'))
    }

    /// True if `at` continues a type's path: `<T>::name`.
    fn is_within_a_type(&self, at: usize) -> bool {
        at >= 3 && self.colons(at - 2) && self.is(at - 3, '>')
    }

    /// Path beginning at `at`, with the end.
    fn path(&self, at: usize) -> (Vec<String>, usize) {
        let mut path = vec![self.0[at].to_string()];
        let mut end = at + 1;
        while self.colons(end)
            && let Some(TokenTree::Ident(next)) = self.0.get(end + 2)
        {
            path.push(next.to_string());
            end += 3;
        }
        (path, end)
    }
}

/// Context of tokens.
#[derive(Clone, Copy, PartialEq)]
enum Inside {
    Code,
    /// In an enum: definitions of variants.
    Enum,
    /// In serde's attributes, where strings may be paths.
    Serde,
}

struct Scan<'a> {
    module: usize,
    /// Imports of `use` in the enclosing blocks.
    scopes: Vec<Vec<Import>>,
    found: &'a mut Vec<Named>,
}

impl Scan<'_> {
    fn tokens(&mut self, tokens: TokenStream, inside: Inside) {
        let tokens = Tokens(tokens.into_iter().collect());
        self.scopes.push(Vec::new());
        let mut in_enum = false;
        let mut at = 0;
        while let Some(token) = tokens.0.get(at) {
            at += 1;
            match token {
                TokenTree::Group(group) => {
                    let is_body = in_enum && group.delimiter() == Delimiter::Brace;
                    in_enum &= !is_body;
                    let inner = match inside {
                        _ if is_body => Inside::Enum,
                        _ if tokens.follows(at - 1, &["serde"]) => Inside::Serde,
                        Inside::Serde => Inside::Serde,
                        Inside::Code | Inside::Enum => Inside::Code,
                    };
                    self.tokens(group.stream(), inner);
                }
                TokenTree::Literal(literal) if inside == Inside::Serde => {
                    let key = at.checked_sub(3).map(|key| tokens.0[key].to_string());
                    let names_code = key.is_some_and(|key| {
                        !["rename", "rename_all", "tag", "content", "alias"].contains(&key.as_str())
                    });
                    if names_code
                        && let Ok(text) = syn::parse_str::<syn::LitStr>(&literal.to_string())
                        && let Ok(inner) = text.value().parse()
                    {
                        self.tokens(inner, Inside::Code);
                    }
                }
                TokenTree::Ident(first) if *first == "use" => {
                    let tree: TokenStream = tokens.0[at..]
                        .iter()
                        .take_while(|token| token.to_string() != ";")
                        .cloned()
                        .collect();
                    at += tree.clone().into_iter().count();
                    if let Ok(tree) = syn::parse2::<UseTree>(tree) {
                        for import in imports(&tree) {
                            self.found.push(imported(self.module, &import, false));
                            self.scopes.last_mut().expect("a scope").push(import);
                        }
                    }
                }
                TokenTree::Ident(_) => {
                    let (path, end) = tokens.path(at - 1);
                    in_enum |= path[0] == "enum";
                    let is_variant = inside == Inside::Enum
                        && (at == 1
                            || tokens.is(at - 2, ',')
                            || tokens.is_group(at - 2, Delimiter::Bracket));
                    let defined = ["fn", "struct", "enum", "trait", "type", "const", "static"];
                    let is_path = !is_variant
                        && !tokens.is_member(at - 1)
                        && !tokens.is_within_a_type(at - 1)
                        && (at < 2 || !tokens.is(at - 2, '\''))
                        && !tokens.follows(at - 1, &defined);
                    // A lone lowercase name is a variable or a field, unless called.
                    let alone = path.len() == 1
                        && path[0].starts_with(|c: char| c.is_lowercase() || c == '_')
                        && !tokens.is_group(end, Delimiter::Parenthesis)
                        && !tokens.colons(end);
                    if is_path && !alone {
                        self.name(path);
                    }
                    at = end;
                }
                TokenTree::Punct(_) | TokenTree::Literal(_) => {}
            }
        }
        self.scopes.pop();
    }

    fn name(&mut self, mut path: Vec<String>) {
        let keywords = ["Self", "self", "super", "crate"];
        if path[0] == "Self" || (path.len() == 1 && keywords.contains(&path[0].as_str())) {
            return;
        }
        let local = self.scopes.iter().rev().flatten();
        let import = local
            .filter(|import| import.path != path)
            .find(|import| import.name.as_ref() == Some(&path[0]));
        if let Some(import) = import {
            path = import.path.iter().chain(&path[1..]).cloned().collect();
        }
        self.found.push(Named { module: self.module, path, passed_on: false });
    }
}
