//! The crates as Rust sees them: files, modules, and the names in each module.

use std::{collections::BTreeMap, fs, path::Path};

use proc_macro2::TokenStream;
use quote::ToTokens;
use syn::{Attribute, ImplItem, Item, Meta, TraitItem, UseTree, Visibility};

/// A source file of the product, not of unit tests.
pub(crate) struct Source {
    /// Crate and path below `src`, for example `geometry/camera.rs`; `boresight` is the program's
    /// crate.
    pub(crate) path: String,
    /// First part of the path.
    pub(crate) krate: String,
    /// Module of the crate's root: `session`, or `lib` and `main` for the roots.
    pub(crate) room: String,
    /// Module of the file.
    pub(crate) module: usize,
    pub(crate) uses: Vec<Use>,
    /// Remaining code: items outside unit tests, with their modules.
    pub(crate) code: Vec<(usize, TokenStream)>,
}

/// A name of a `use` item.
pub(crate) struct Use {
    pub(crate) module: usize,
    pub(crate) import: Import,
    /// `pub use`: the name is passed on, not used.
    pub(crate) passed_on: bool,
}

/// A module: a file, or a `mod name { … }` within one.
pub(crate) struct Module {
    pub(crate) path: Vec<String>,
    pub(crate) source: usize,
    /// Parent module; a crate's root is its own parent.
    pub(crate) parent: usize,
    pub(crate) root: usize,
    pub(crate) names: BTreeMap<String, Vec<Name>>,
    pub(crate) globs: Vec<Vec<String>>,
    /// True if a macro writes items here: names may exist unseen in the source.
    pub(crate) has_item_macros: bool,
}

/// Meaning of a name in a module.
pub(crate) enum Name {
    Item,
    Module(usize),
    Import(Vec<String>),
}

/// A name, or a glob, of a `use`.
#[derive(Debug, Clone)]
pub(crate) struct Import {
    /// Name in the module; `None` for a glob, `_` for none.
    pub(crate) name: Option<String>,
    pub(crate) path: Vec<String>,
}

/// Every crate of the workspace, except bindings to foreign code.
pub(crate) struct Workspace {
    pub(crate) sources: Vec<Source>,
    pub(crate) modules: Vec<Module>,
    /// Root module of each library, by public name.
    pub(crate) libraries: BTreeMap<String, usize>,
    /// Files without a parse, without a path, or without a `mod`.
    pub(crate) problems: Vec<String>,
}

/// Name of the program's crate, with sources in `src`.
const PROGRAM: &str = "boresight";
/// Generated bindings: they have no rooms.
const MADE: [&str; 1] = ["v4l2-sys"];

impl Workspace {
    /// The crates in `checkout`: `src` and `crates/*/src`.
    pub(crate) fn load(checkout: &Path) -> std::io::Result<Self> {
        let mut texts = BTreeMap::new();
        read(&checkout.join("src"), PROGRAM, &mut texts)?;
        for entry in fs::read_dir(checkout.join("crates"))? {
            let folder = entry?.path();
            let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if !MADE.contains(&name.as_str()) {
                read(&folder.join("src"), &name, &mut texts)?;
            }
        }
        Ok(Self::from_texts(&texts))
    }

    /// Crates from texts of files by crate and path below `src`.
    pub(crate) fn from_texts(texts: &BTreeMap<String, String>) -> Self {
        let empty = Self {
            sources: Vec::new(),
            modules: Vec::new(),
            libraries: BTreeMap::new(),
            problems: Vec::new(),
        };
        let mut reader = Reader { texts, reached: Vec::new(), made: empty };
        let is_root = |path: &&String| path.ends_with("/lib.rs") || path.ends_with("/main.rs");
        let roots = texts.keys().filter(is_root).filter(|path| path.matches('/').count() == 1);
        for root in roots {
            let module = reader.file(root, Vec::new(), None);
            if let (Some(module), Some(name)) = (module, root.strip_suffix("/lib.rs")) {
                let name = match name {
                    PROGRAM => PROGRAM.to_owned(),
                    part => format!("{PROGRAM}_{part}"),
                };
                reader.made.libraries.insert(name, module);
            }
        }
        for path in texts.keys().filter(|path| !reader.reached.contains(path)) {
            let problem = format!("{}: no `mod` names this file", shown(path));
            reader.made.problems.push(problem);
        }
        reader.made
    }
}

fn read(src: &Path, name: &str, texts: &mut BTreeMap<String, String>) -> std::io::Result<()> {
    let mut folders = vec![src.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let below = path.strip_prefix(src).unwrap_or(&path).to_string_lossy();
                texts.insert(format!("{name}/{below}"), fs::read_to_string(&path)?);
            }
        }
    }
    Ok(())
}

/// Path of a file in the checkout.
pub(crate) fn shown(path: &str) -> String {
    match path.split_once('/') {
        Some((PROGRAM, below)) => format!("src/{below}"),
        Some((name, below)) => format!("crates/{name}/src/{below}"),
        None => path.to_owned(),
    }
}

struct Reader<'a> {
    texts: &'a BTreeMap<String, String>,
    reached: Vec<String>,
    made: Workspace,
}

impl Reader<'_> {
    /// Reads the file of the module `path` and all below.
    fn file(&mut self, file: &str, path: Vec<String>, parent: Option<usize>) -> Option<usize> {
        self.reached.push(file.to_owned());
        let text = &self.texts[file];
        let syntax = match syn::parse_file(text) {
            Ok(syntax) => syntax,
            Err(error) => {
                self.made.problems.push(format!("{}: not parsed: {error}", shown(file)));
                return None;
            }
        };
        let source = self.made.sources.len();
        let attributes = syntax.attrs.iter().map(ToTokens::to_token_stream).collect();
        self.made.sources.push(Source {
            path: file.to_owned(),
            krate: file.split('/').next().unwrap_or_default().to_owned(),
            room: file.split(['/', '.']).nth(1).unwrap_or_default().to_owned(),
            module: self.made.modules.len(),
            uses: Vec::new(),
            code: vec![(self.made.modules.len(), attributes)],
        });
        let module = self.module(source, path, parent);
        self.items(module, &syntax.items, &folder_of_children(file));
        Some(module)
    }

    fn module(&mut self, source: usize, path: Vec<String>, parent: Option<usize>) -> usize {
        let id = self.made.modules.len();
        self.made.modules.push(Module {
            path,
            source,
            parent: parent.unwrap_or(id),
            root: parent.map_or(id, |parent| self.made.modules[parent].root),
            names: BTreeMap::new(),
            globs: Vec::new(),
            has_item_macros: false,
        });
        id
    }

    fn items(&mut self, module: usize, items: &[Item], folder: &str) {
        for item in items {
            if is_test_only(attributes(item)) {
                if let Item::Mod(item) = item
                    && item.content.is_none()
                {
                    self.reach_tests(folder, &item.ident.to_string(), &item.attrs);
                }
                continue;
            }
            let source = self.made.modules[module].source;
            let code = tokens_of(item);
            self.made.sources[source].code.push((module, code));
            match item {
                Item::Use(item) => {
                    let passed_on = !matches!(item.vis, Visibility::Inherited);
                    for import in imports(&item.tree) {
                        let seen = Use { module, import: import.clone(), passed_on };
                        self.made.sources[source].uses.push(seen);
                        match import.name {
                            Some(name) => self.name(module, name, Name::Import(import.path)),
                            None => self.made.modules[module].globs.push(import.path),
                        }
                    }
                }
                Item::Mod(item) => {
                    let name = item.ident.to_string();
                    let mut path = self.made.modules[module].path.clone();
                    path.push(name.clone());
                    let inner = match &item.content {
                        Some((_, items)) => {
                            let inner = self.module(source, path, Some(module));
                            self.items(inner, items, &format!("{folder}{name}/"));
                            Some(inner)
                        }
                        None => match self.file_of(folder, &name, &item.attrs) {
                            Some(file) => self.file(&file, path, Some(module)),
                            None => {
                                let file = &self.made.sources[source].path;
                                let problem = format!("{}: no file for `mod {name}`", shown(file));
                                self.made.problems.push(problem);
                                None
                            }
                        },
                    };
                    if let Some(inner) = inner {
                        self.name(module, name, Name::Module(inner));
                    }
                }
                Item::Macro(item) => match &item.ident {
                    Some(name) => self.name(module, name.to_string(), Name::Item),
                    None => self.made.modules[module].has_item_macros = true,
                },
                other => {
                    if let Some(name) = defined_name(other) {
                        self.name(module, name, Name::Item);
                    }
                }
            }
        }
    }

    fn name(&mut self, module: usize, name: String, is: Name) {
        self.made.modules[module].names.entry(name).or_default().push(is);
    }

    /// File of `mod name;`, perhaps named by `#[path = "…"]`.
    fn file_of(&self, folder: &str, name: &str, attributes: &[Attribute]) -> Option<String> {
        let named = attributes.iter().find_map(|attribute| match &attribute.meta {
            Meta::NameValue(meta) if meta.path.is_ident("path") => {
                let value = &meta.value;
                let value: syn::LitStr = syn::parse2(value.to_token_stream()).ok()?;
                Some(format!("{folder}{}", value.value()))
            }
            _ => None,
        });
        [named.unwrap_or_else(|| format!("{folder}{name}.rs")), format!("{folder}{name}/mod.rs")]
            .into_iter()
            .find(|path| self.texts.contains_key(path))
    }

    /// Marks the files of a module for unit tests only.
    fn reach_tests(&mut self, folder: &str, name: &str, attributes: &[Attribute]) {
        if let Some(file) = self.file_of(folder, name, attributes) {
            let below = format!("{folder}{name}/");
            let inner = self.texts.keys().filter(|path| path.starts_with(&below)).cloned();
            self.reached.extend(inner);
            self.reached.push(file);
        }
    }
}

/// Folder of the modules declared by a file.
fn folder_of_children(file: &str) -> String {
    let (folder, name) = file.rsplit_once('/').map_or(("", file), |(folder, name)| (folder, name));
    let folder = if folder.is_empty() { String::new() } else { format!("{folder}/") };
    match name.trim_end_matches(".rs") {
        "mod" | "lib" | "main" => folder,
        stem => format!("{folder}{stem}/"),
    }
}

/// Every name of a `use`, in order.
pub(crate) fn imports(tree: &UseTree) -> Vec<Import> {
    fn walk(tree: &UseTree, before: &[String], found: &mut Vec<Import>) {
        let with = |name: &syn::Ident| {
            let mut path = before.to_vec();
            if name != "self" || path.is_empty() {
                path.push(name.to_string());
            }
            path
        };
        match tree {
            UseTree::Path(part) => walk(&part.tree, &with(&part.ident), found),
            UseTree::Name(part) => {
                let path = with(&part.ident);
                found.push(Import { name: path.last().cloned(), path });
            }
            UseTree::Rename(part) => {
                let name = Some(part.rename.to_string());
                found.push(Import { name, path: with(&part.ident) });
            }
            UseTree::Glob(_) => found.push(Import { name: None, path: before.to_vec() }),
            UseTree::Group(group) => {
                for tree in &group.items {
                    walk(tree, before, found);
                }
            }
        }
    }
    let mut found = Vec::new();
    walk(tree, &[], &mut found);
    found
}

/// True if code with `attributes` is compiled for unit tests alone.
fn is_test_only(attributes: &[Attribute]) -> bool {
    fn needs_test(meta: &Meta) -> bool {
        let Meta::List(list) = meta else { return meta.path().is_ident("test") };
        let Ok(inner) = list
            .parse_args_with(syn::punctuated::Punctuated::<Meta, syn::Token![,]>::parse_terminated)
        else {
            return false;
        };
        match () {
            () if list.path.is_ident("all") => inner.iter().any(needs_test),
            () if list.path.is_ident("any") => !inner.is_empty() && inner.iter().all(needs_test),
            () => false,
        }
    }
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || (attribute.path().is_ident("cfg")
                && attribute.parse_args::<Meta>().is_ok_and(|meta| needs_test(&meta)))
    })
}

/// Code of an item; of a `use` and a module only the attributes, since the rest is read separately.
fn tokens_of(item: &Item) -> TokenStream {
    match item {
        Item::Use(_) | Item::Mod(_) => {
            attributes(item).iter().map(ToTokens::to_token_stream).collect()
        }
        Item::Impl(item) => {
            let mut kept = item.clone();
            kept.items.retain(|item| match item {
                ImplItem::Fn(item) => !is_test_only(&item.attrs),
                ImplItem::Const(item) => !is_test_only(&item.attrs),
                _ => true,
            });
            kept.into_token_stream()
        }
        Item::Trait(item) => {
            let mut kept = item.clone();
            kept.items.retain(|item| match item {
                TraitItem::Fn(item) => !is_test_only(&item.attrs),
                _ => true,
            });
            kept.into_token_stream()
        }
        other => other.to_token_stream(),
    }
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::ExternCrate(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::ForeignMod(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Union(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn defined_name(item: &Item) -> Option<String> {
    let name = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(name.to_string())
}
