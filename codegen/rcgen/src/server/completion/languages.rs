//! Suggestions in interfaces, components, networks and parameters.

use super::{
    Completion, FILE, INSIDE, INTERFACE, Item, Kind, Loader, Names, PROPERTY, Path, PathBuf,
    STATEMENTS, STRUCT, Target, UNIT, VALUE, items_of, key, keywords, load, of, paths, words,
};
use crate::server::context::Context;
use rc_cdsl::model::Role;
use rc_cdsl::settings;
use rc_configuration::model::{ElementKind, FileKind, Type};
use rc_diagnostics::SourceMap;
use rc_idsl::ast::DeclKind;
use rc_syntax::import_edit;
use rc_vocabulary::qos::Values;
use rc_vocabulary::{Language, Middleware, Primitive};

impl Completion<'_> {
    pub(super) fn in_interfaces(&self, target: &Target<'_>, context: &Context<'_>) -> Vec<Item> {
        let around = context.around();
        let around: Vec<&str> = around.iter().map(String::as_str).collect();
        let last = context.last();
        if let Some(string) = context.string {
            return match (context.word().as_str(), context.statement.as_slice()) {
                ("import", _) => self.importable(target, string, "idsl"),
                (_, [.., "@", "unit", "("]) => units(),
                _ => Vec::new(),
            };
        }
        if last == "@" {
            let known = ["optional", "unit", "range", "default", "stamp", "ros"];
            return words(known, "An annotation of what follows.");
        }
        if let [.., module, "::"] = context.statement.as_slice() {
            return self.types_of(module);
        }
        match (around.as_slice(), last) {
            ([], "") => of(keywords::of(&STATEMENTS, "idsl", "")),
            (["module"], "") => of(keywords::of(&STATEMENTS, "idsl", "module")),
            (["module"], _) if context.word() == "exception" => {
                match context.statement.as_slice() {
                    [_, _] => of(keywords::of(&INSIDE, "idsl", "exception")),
                    [.., "extends"] => self.types(target),
                    _ => Vec::new(),
                }
            }
            (["module"], "<" | ",")
            | (["module", "struct" | "exception"], "" | ")" | "<" | ",")
            | (["module", "interface"], "throws") => self.types(target),
            (["module", "interface"], "" | "idempotent" | "command" | "query") => {
                let mut items = self.types(target);
                if last.is_empty() {
                    items.extend(of(keywords::of(&STATEMENTS, "idsl", "interface")));
                }
                items
            }
            (["module", "interface"], "(" | "," | "out" | "<") => {
                let mut items = self.types(target);
                if matches!(last, "(" | ",") {
                    let out = keywords::of(&INSIDE, "idsl", "interface").iter();
                    let out: Vec<_> = out.filter(|(word, _)| *word == "out").copied().collect();
                    items.extend(of(&out));
                }
                items
            }
            (["module", "interface"], ")") => {
                let all = keywords::of(&INSIDE, "idsl", "interface").iter();
                let throws: Vec<_> = all.filter(|(word, _)| *word == "throws").copied().collect();
                of(&throws)
            }
            _ => Vec::new(),
        }
    }

    /// All types that can be named: those of the language, of this module, and of imported ones.
    fn types(&self, target: &Target<'_>) -> Vec<Item> {
        let primitives = Primitive::idsl_words().map(|(word, _)| word);
        let primitives = primitives.chain(["string", "sequence", "dictionary"]);
        let mut items = items_of(target.names, Kind::Type, STRUCT);
        for symbol in target.names.imported() {
            let Some(names) = self.files.readable(&symbol.file) else {
                continue;
            };
            let types = items_of(names, Kind::Type, STRUCT).into_iter();
            items.extend(types.map(|item| Item {
                label: format!("{}::{}", symbol.name, item.label),
                ..item
            }));
        }
        items.extend(words(primitives, "A type of the language."));
        items
    }

    fn types_of(&self, module: &str) -> Vec<Item> {
        let declares = |names: &Names| names.declaration(Kind::Module, module).is_some();
        let mut modules = self
            .files
            .with_ending("idsl")
            .filter(|(_, names)| declares(names));
        let module = modules.next();
        module.map_or_else(Vec::new, |(_, names)| items_of(names, Kind::Type, STRUCT))
    }

    pub(super) fn in_component(&self, target: &Target<'_>, context: &Context<'_>) -> Vec<Item> {
        let around = context.around();
        let around: Vec<&str> = around.iter().map(String::as_str).collect();
        let (word, last) = (context.word(), context.last());
        if let Some(string) = context.string {
            return match word.as_str() {
                "import" => self.importable(target, string, "idsl"),
                "statemachine" => self.paths(target, string, &["smdsl", "scxml"]),
                "parameters" => self.paths(target, string, &["pdsl"]),
                "kinematics" => self.paths(target, string, &["kdsl"]),
                "world" => self.paths(target, string, &["gdsl"]),
                _ => Vec::new(),
            };
        }
        match around.as_slice() {
            [] if last.is_empty() => of(keywords::of(&STATEMENTS, "cdsl", "")),
            ["component"] if last.is_empty() => of(keywords::of(&STATEMENTS, "cdsl", "component")),
            ["component"] => match word.as_str() {
                "language" => words(
                    Language::ALL.map(Language::word),
                    "The language of the worker.",
                ),
                "options" | "gui" | "lifecycle" | "simulates" => {
                    of(keywords::of(&STATEMENTS, "cdsl", &word))
                }
                "statemachine" | "python" if context.statement.len() == 2 => {
                    of(keywords::of(&INSIDE, "cdsl", &word))
                }
                "world" if context.statement.len() == 1 => of(keywords::of(&INSIDE, "cdsl", &word)),
                _ => Vec::new(),
            },
            ["component", "communications"] => match (Role::from_file(&word), last) {
                (None, "") => of(keywords::of(&STATEMENTS, "cdsl", "communications")),
                (Some(_), "(") => middlewares(),
                (Some(_), "as" | "optional") => Vec::new(),
                (Some(_), ",") => self.interfaces(target),
                (Some(_), _) if context.statement.len() == 1 => self.interfaces(target),
                (Some(_), _) => of(keywords::of(&INSIDE, "cdsl", "communications")),
                _ => Vec::new(),
            },
            ["component", "communications", role] => match Role::from_file(role) {
                Some(role) => self.slot_settings(target, context, role),
                None => Vec::new(),
            },
            ["component", "world"] if last.is_empty() => {
                of(keywords::of(&STATEMENTS, "cdsl", "world"))
            }
            ["component", "world"] if !["writes", ",", "."].contains(&last) => {
                of(keywords::of(&INSIDE, "cdsl", &context.word()))
            }
            ["component", "statemachine"] if last.is_empty() => {
                of(keywords::of(&STATEMENTS, "cdsl", "statemachine"))
            }
            _ => Vec::new(),
        }
    }

    fn slot_settings(&self, target: &Target<'_>, context: &Context<'_>, role: Role) -> Vec<Item> {
        let word = context.word();
        if word.is_empty() {
            let available = (role == Role::Implements).then(|| {
                Item::new(
                    PROPERTY,
                    "available",
                    "The states in which calls are served: `available moving, holding;`",
                )
            });
            let all = settings(role).into_iter().map(|(word, allowed, _)| {
                Item::new(
                    PROPERTY,
                    word,
                    format!("The quality of service of this slot: {allowed}."),
                )
            });
            return all.chain(available).collect();
        }
        if word == "available" {
            let machines = target.names.places.iter().flat_map(|place| &place.symbols);
            let machines = machines.filter(|symbol| symbol.kind == Kind::File);
            let machines = machines.filter_map(|symbol| self.files.readable(&symbol.file));
            return machines
                .flat_map(|names| items_of(names, Kind::State, VALUE))
                .collect();
        }
        let setting = settings(role)
            .into_iter()
            .find(|(known, ..)| *known == word);
        match setting {
            Some((_, _, Some(Values::Words(all)))) => words(all, "A value of this policy."),
            Some((_, _, Some(Values::Within(_)))) if context.statement.len() == 1 => {
                of(keywords::of(&INSIDE, "cdsl", "wake"))
            }
            Some(("serve", ..)) if context.statement.len() == 1 => {
                of(keywords::of(&INSIDE, "cdsl", "serve"))
            }
            Some((_, _, None)) => words(["true", "false"], ""),
            _ => Vec::new(),
        }
    }

    /// All interfaces of the workspace, and those that come with the program; one that is not imported
    /// brings its import along.
    fn interfaces(&self, target: &Target<'_>) -> Vec<Item> {
        let loader = self.files.loader();
        // The names of the file may be those of an earlier text with other imports.
        let imported = imports_in(target.text);
        let found = imported
            .iter()
            .filter_map(|name| loader.find(target.path, name, "idsl").ok());
        let imported_files: Vec<PathBuf> = found.map(|found| key(&found.path)).collect();
        let mut items = Vec::new();
        for (path, names) in self.files.with_ending("idsl") {
            let known = imported_files.contains(path);
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let own = target.path.parent().unwrap_or(Path::new(""));
            // By its name alone, if that leads to it.
            let found = loader.find(target.path, &name, "idsl");
            let wanted = if found.is_ok_and(|found| key(&found.path) == *path) {
                name.into_owned()
            } else {
                paths::relative(own, path).display().to_string()
            };
            for item in items_of(names, Kind::Interface, INTERFACE) {
                let import = (!known).then(|| import_edit(target.text, &wanted));
                items.push(Item { import, ..item });
            }
        }
        for (file, text) in shipped("idsl") {
            let known = imported.contains(&file);
            let mut sources = SourceMap::new();
            let source = sources.add(file, text);
            let (parsed, _) = rc_idsl::parse(&sources, source);
            let declared = parsed.module.into_iter().flat_map(|module| module.decls);
            let interfaces = declared.filter(|one| matches!(one.kind, DeclKind::Interface(_)));
            for interface in interfaces {
                let name = interface.name.text;
                let mut doc = interface.doc;
                doc.push("It comes with this program.".to_owned());
                let item = Item::new(INTERFACE, name.as_str(), doc.join("\n"));
                items.push(Item {
                    import: (!known).then(|| import_edit(target.text, file)),
                    detail: format!("interface {name}"),
                    ..item
                });
            }
        }
        items
    }

    /// Files that an import may name.
    pub(super) fn importable(&self, target: &Target<'_>, written: &str, ending: &str) -> Vec<Item> {
        let loader = self.files.loader();
        let known = self
            .files
            .with_ending(ending)
            .filter(|(path, _)| *path != target.path);
        let known = known.filter_map(|(path, _)| {
            let name = path.file_name()?.to_str()?;
            let found = loader.find(target.path, name, ending).ok()?;
            (key(&found.path) == *path).then(|| Item::new(FILE, name, ""))
        });
        let mut items: Vec<Item> = known.collect();
        items.extend(self.paths(target, written, &[ending]));
        let shipped = shipped(ending).map(|(file, _)| file);
        items.extend(shipped.map(|file| Item::new(FILE, file, "It comes with this program.")));
        items
    }

    pub(super) fn in_parameters(&self, target: &Target<'_>, context: &Context<'_>) -> Vec<Item> {
        let (word, last) = (context.word(), context.last());
        if let Some(string) = context.string {
            return match last.to_ascii_lowercase().as_str() {
                "import" => self.importable(target, string, "pdsl"),
                "unit" => units(),
                "reads" => words(
                    FileKind::WORDS.map(|(word, _)| word),
                    "The kind of the file.",
                ),
                "element" => words(
                    ElementKind::WORDS.map(|(word, _)| word),
                    "The kind of the element.",
                ),
                _ => Vec::new(),
            };
        }
        let block = context.around().pop();
        match (block.as_deref(), context.statement.len()) {
            (None, 0) => of(keywords::of(&STATEMENTS, "pdsl", "")),
            (Some(block), 0) => of(keywords::of(&STATEMENTS, "pdsl", block)),
            (Some(_), _) if word == "require" => {
                // A rule names the parameters of its own block without the path of the block.
                let blocks = context.blocks.iter().skip(2);
                let blocks = blocks.filter_map(|block| block.head.get(1));
                let around: String = blocks.map(|name| format!("{name}.")).collect();
                let all = items_of(target.names, Kind::Parameter, PROPERTY).into_iter();
                let mut items: Vec<Item> = all
                    .map(|item| {
                        let own = item.label.strip_prefix(&around).unwrap_or(&item.label);
                        let label = own.to_owned();
                        Item { label, ..item }
                    })
                    .collect();
                items.extend(of(keywords::of(&INSIDE, "pdsl", "require")));
                items
            }
            (Some(_), _) if last.eq_ignore_ascii_case("of") => {
                items_of(target.names, Kind::Parameter, PROPERTY)
            }
            (Some(_), 1) if !matches!(word.as_str(), "group" | "list") => Type::WORDS
                .iter()
                .map(|(word, ty)| Item::new(VALUE, *word, ty.described()))
                .collect(),
            (Some(_), 2..) => of(keywords::of(&INSIDE, "pdsl", "*")),
            _ => Vec::new(),
        }
    }
}

/// The files that a text imports, as it writes them.
pub(super) fn imports_in(text: &str) -> Vec<&str> {
    let tokens = rc_syntax::tokens(text);
    let imports = tokens
        .windows(2)
        .filter(|two| two[0].text.eq_ignore_ascii_case("import"));
    imports.map(|two| two[1].text.trim_matches('"')).collect()
}

pub(super) fn units() -> Vec<Item> {
    rc_quantity::names()
        .map(|unit| Item::new(UNIT, unit, ""))
        .collect()
}

pub(super) fn middlewares() -> Vec<Item> {
    words(
        Middleware::in_files().map(Middleware::word),
        "A middleware.",
    )
}

/// The settings of a middleware.
pub(super) fn settings_of(middleware: Middleware) -> Vec<Item> {
    let keys = middleware.can().keys.iter();
    keys.map(|setting| Item::new(PROPERTY, setting.name, setting.doc))
        .collect()
}

/// The files with an ending that come with this program, and their texts.
fn shipped(ending: &str) -> impl Iterator<Item = (&'static str, &'static str)> {
    let all = load::all_shipped().chain(graph_language::DOMAINS);
    all.filter(move |(file, _)| Path::new(file).extension() == Some(ending.as_ref()))
}
