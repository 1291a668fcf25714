//! What a file says: the paths it names and the words it uses, macros and attributes included.

use std::collections::BTreeSet;

use proc_macro2::{Delimiter, Ident, TokenStream, TokenTree};
use syn::{
    UseTree, Visibility,
    visit::{self, Visit},
};

use super::source::{Crate, Import, Name, Source, attributes, defined_name, imports, is_test_only};

/// A path that a file names.
#[derive(Debug)]
pub(crate) struct Named {
    pub(crate) module: usize,
    pub(crate) path: Vec<String>,
    pub(crate) line: usize,
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

/// Every path that `source` names outside its unit tests.
pub(crate) fn paths(of: &Crate, source: &Source) -> Vec<Named> {
    let mut scan = Scan {
        of,
        module: source.module,
        scopes: Vec::new(),
        variables: Vec::new(),
        in_serde: false,
        found: Vec::new(),
    };
    scan.visit_file(&source.syntax);
    scan.found
}

/// Every word of `source` outside its unit tests, with its line.
pub(crate) fn words(source: &Source) -> Vec<(Word, usize)> {
    let mut found = Vec::new();
    collect_words(source.tokens.clone(), source, &mut found);
    found
}

fn collect_words(tokens: TokenStream, source: &Source, found: &mut Vec<(Word, usize)>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let punct = |at: Option<usize>, c| at.is_some_and(|at| is_punct(tokens.get(at), c));
    for (at, token) in tokens.iter().enumerate() {
        let here = token.span().byte_range();
        if source.test_bytes.iter().any(|test| test.contains(&here.start)) {
            continue;
        }
        match token {
            TokenTree::Group(group) => collect_words(group.stream(), source, found),
            TokenTree::Ident(name) => {
                let line = name.span().start().line;
                let name = name.to_string();
                let before = at.checked_sub(1);
                let is_call = matches!(tokens.get(at + 1), Some(TokenTree::Group(group))
                    if group.delimiter() == Delimiter::Parenthesis)
                    || (punct(Some(at + 1), ':') && punct(Some(at + 2), ':'));
                let after_range = punct(before, '.') && punct(at.checked_sub(2), '.');
                if punct(before, '.') && !after_range && is_call {
                    found.push((Word::Method(name.clone()), line));
                }
                if punct(Some(at + 1), '!')
                    && matches!(tokens.get(at + 2), Some(TokenTree::Group(_)))
                {
                    found.push((Word::Macro(name.clone()), line));
                }
                found.push((Word::Name(name), line));
            }
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

fn is_punct(token: Option<&TokenTree>, c: char) -> bool {
    matches!(token, Some(TokenTree::Punct(punct)) if punct.as_char() == c)
}

struct Scan<'a> {
    of: &'a Crate,
    module: usize,
    /// What the blocks around hold: imports, and items of their own.
    scopes: Vec<Vec<(String, Option<Vec<String>>)>>,
    /// Variables of the functions around.
    variables: Vec<BTreeSet<String>>,
    in_serde: bool,
    found: Vec<Named>,
}

impl Scan<'_> {
    fn name(&mut self, mut path: Vec<String>, line: usize, passed_on: bool) {
        let Some(first) = path.first() else { return };
        if first == "Self" {
            return;
        }
        if path.len() == 1 && self.variables.iter().any(|known| known.contains(first)) {
            return;
        }
        let local = self.scopes.iter().rev().flatten().find(|(name, _)| name == first);
        match local {
            Some((_, None)) => return,
            Some((_, Some(import))) if *import != path => {
                path = import.iter().chain(&path[1..]).cloned().collect();
            }
            _ => {}
        }
        self.found.push(Named { module: self.module, path, line, passed_on });
    }

    fn import(&mut self, tree: &UseTree, line: usize, passed_on: bool) {
        for Import { name, mut path } in imports(tree) {
            if name.is_none() {
                path.push("*".to_owned());
            }
            self.found.push(Named { module: self.module, path, line, passed_on });
        }
    }

    /// The paths in tokens that have not been parsed: macros and attributes.
    fn tokens(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let is = |at: usize, c| is_punct(tokens.get(at), c);
        let mut at = 0;
        while let Some(token) = tokens.get(at) {
            at += 1;
            match token {
                TokenTree::Group(group) => self.tokens(group.stream()),
                TokenTree::Literal(literal) if self.in_serde => {
                    // `with = "path"` is code.
                    let given = syn::parse_str::<syn::LitStr>(&literal.to_string());
                    let key = at.checked_sub(3).and_then(|key| tokens.get(key));
                    let names_code = matches!(key, Some(TokenTree::Ident(key))
                        if !["rename", "rename_all", "tag", "content", "alias"]
                            .contains(&key.to_string().as_str()));
                    if let Some(inner) = given.ok().filter(|_| names_code).map(|s| s.value())
                        && let Ok(inner) = inner.parse::<TokenStream>()
                    {
                        let from = self.found.len();
                        self.tokens(inner);
                        for named in &mut self.found[from..] {
                            named.line = literal.span().start().line;
                        }
                    }
                }
                TokenTree::Ident(first) if *first == "use" => {
                    let tree: TokenStream = tokens[at..]
                        .iter()
                        .take_while(|token| !is_punct(Some(token), ';'))
                        .cloned()
                        .collect();
                    if let Ok(tree) = syn::parse2::<UseTree>(tree) {
                        self.import(&tree, first.span().start().line, false);
                    }
                }
                TokenTree::Ident(first) => {
                    let member = at >= 2 && is(at - 2, '.') && !(at >= 3 && is(at - 3, '.'));
                    let lifetime = at >= 2 && is(at - 2, '\'');
                    let mut path = vec![first.to_string()];
                    while is(at, ':') && is(at + 1, ':') {
                        at += 2;
                        match tokens.get(at) {
                            Some(TokenTree::Ident(next)) => path.push(next.to_string()),
                            // `collect::<…>` ends a path, `Vec::<…>::new` goes on inside the item.
                            _ => break,
                        }
                        at += 1;
                    }
                    if !member && !lifetime {
                        self.name(path, first.span().start().line, false);
                    }
                }
                TokenTree::Punct(_) | TokenTree::Literal(_) => {}
            }
        }
    }

    fn in_function(&mut self, variables: BTreeSet<String>, walk: impl FnOnce(&mut Self)) {
        self.variables.push(variables);
        walk(self);
        self.variables.pop();
    }
}

impl<'ast> Visit<'ast> for Scan<'_> {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        if !is_test_only(attributes(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        let name = item.ident.to_string();
        let inner = self.of.modules[self.module].names.get(&name);
        let inner = inner.into_iter().flatten().find_map(|is| match is {
            Name::Module(inner) => Some(*inner),
            _ => None,
        });
        if let Some(inner) = inner.filter(|_| item.content.is_some()) {
            let outer = std::mem::replace(&mut self.module, inner);
            visit::visit_item_mod(self, item);
            self.module = outer;
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let passed_on = !matches!(item.vis, Visibility::Inherited);
        self.import(&item.tree, item.use_token.span.start().line, passed_on);
    }

    fn visit_impl_item(&mut self, item: &'ast syn::ImplItem) {
        let attributes = match item {
            syn::ImplItem::Fn(item) => &item.attrs[..],
            syn::ImplItem::Const(item) => &item.attrs,
            _ => &[],
        };
        if !is_test_only(attributes) {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        let variables = Variables::of(|names| names.visit_item_fn(item));
        self.in_function(variables, |scan| visit::visit_item_fn(scan, item));
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        let variables = Variables::of(|names| names.visit_impl_item_fn(item));
        self.in_function(variables, |scan| visit::visit_impl_item_fn(scan, item));
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        let variables = Variables::of(|names| names.visit_trait_item_fn(item));
        self.in_function(variables, |scan| visit::visit_trait_item_fn(scan, item));
    }

    fn visit_expr_closure(&mut self, closure: &'ast syn::ExprClosure) {
        let variables = Variables::of(|names| names.visit_expr_closure(closure));
        self.in_function(variables, |scan| visit::visit_expr_closure(scan, closure));
    }

    fn visit_block(&mut self, block: &'ast syn::Block) {
        let mut scope = Vec::new();
        for statement in &block.stmts {
            let syn::Stmt::Item(item) = statement else { continue };
            if let syn::Item::Use(item) = item {
                for Import { name, path } in imports(&item.tree) {
                    scope.extend(name.map(|name| (name, Some(path))));
                }
            }
            scope.extend(defined_name(item).map(|name| (name, None)));
        }
        self.scopes.push(scope);
        visit::visit_block(self, block);
        self.scopes.pop();
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|part| part.ident.to_string()).collect();
        let line = path.segments.first().map_or(0, |first| first.ident.span().start().line);
        self.name(names, line, false);
        visit::visit_path(self, path);
    }

    /// A constant in a pattern looks like a variable.
    fn visit_pat_ident(&mut self, pattern: &'ast syn::PatIdent) {
        if is_constant(&pattern.ident) {
            self.name(vec![pattern.ident.to_string()], pattern.ident.span().start().line, false);
        }
        visit::visit_pat_ident(self, pattern);
    }

    /// Who may see an item is not a use.
    fn visit_visibility(&mut self, _: &'ast Visibility) {}

    fn visit_attribute(&mut self, attribute: &'ast syn::Attribute) {
        self.in_serde = attribute.path().is_ident("serde");
        visit::visit_attribute(self, attribute);
        self.in_serde = false;
    }

    fn visit_token_stream(&mut self, tokens: &'ast TokenStream) {
        self.tokens(tokens.clone());
    }
}

fn is_constant(name: &Ident) -> bool {
    name.to_string().starts_with(char::is_uppercase)
}

/// The variables that patterns bind.
struct Variables(BTreeSet<String>);

impl Variables {
    fn of(walk: impl FnOnce(&mut Self)) -> BTreeSet<String> {
        let mut names = Self(BTreeSet::new());
        walk(&mut names);
        names.0
    }
}

impl<'ast> Visit<'ast> for Variables {
    fn visit_pat_ident(&mut self, pattern: &'ast syn::PatIdent) {
        if !is_constant(&pattern.ident) {
            self.0.insert(pattern.ident.to_string());
        }
        visit::visit_pat_ident(self, pattern);
    }
}
