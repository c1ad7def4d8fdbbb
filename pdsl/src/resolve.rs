//! Resolves names, types and flags into the model. Other modules check limits and conditions.

use crate::ast::{self, FlagKind, Item};
use crate::block::Block;
use crate::conditions;
use crate::imports::Imports;
use crate::limits::LimitChecker;
use heck::ToSnakeCase;
use rc_configuration::model::{Element, ElementKind, FileKind, Kind, Parameter, Parameters, Type};
use rc_configuration::violations_by_defaults;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Loader, Name};
use std::collections::{BTreeSet, HashMap};

/// The deepest nesting of groups and lists. A component can read it from JSON.
const DEEPEST: usize = 20;

/// Types of other languages, with those of PDSL.
const FOREIGN: [(&str, &str); 12] = [
    ("boolean", "bool"),
    ("integer", "int"),
    ("int32", "int"),
    ("int64", "long"),
    ("uint", "int"),
    ("number", "double"),
    ("real", "double"),
    ("float32", "float"),
    ("float64", "double"),
    ("str", "string"),
    ("enum", "string"),
    ("time", "duration"),
];

/// Loads one `.pdsl` text with its imports, and resolves it. `None` if nothing is readable.
pub fn load(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> (Option<Parameters>, Diagnostics) {
    let mut imports = Imports::new(sources, loader);
    let params = imports.file(source);
    let mut resolver = Resolver {
        found: imports.found,
        rules: Vec::new(),
        invalid: BTreeSet::new(),
        elements: Vec::new(),
    };
    let Some(params) = params else {
        return (None, resolver.found);
    };
    let parameters = resolver.items(&imports.items, &[]);
    resolver.files_of_elements(&parameters);
    let mut model = Parameters {
        name: params.name.text,
        doc: params.doc,
        parameters,
        rules: Vec::new(),
    };
    let rules = std::mem::take(&mut resolver.rules);
    resolver.rules(&mut model, rules);
    (Some(model), resolver.found)
}

/// The type whose misspelling a word is.
fn nearest_type(word: &Name) -> Option<&'static str> {
    if Type::from_word(&word.text).is_some() {
        return None;
    }
    rc_diagnostics::nearest(&word.text, Type::WORDS.iter().map(|(word, _)| *word))
}

/// The state of resolution.
struct Resolver<'t> {
    found: Diagnostics,
    /// The rules, each with the groups and lists around it.
    rules: Vec<(Vec<String>, &'t ast::Rule)>,
    /// Declarations with errors. A rule cannot refer to them.
    invalid: BTreeSet<Vec<String>>,
    /// The parameters whose files have elements that other parameters name.
    elements: Vec<&'t Name>,
}

impl<'t> Resolver<'t> {
    fn error(&mut self, code: &'static str, span: Span, message: impl Into<String>) {
        self.found.push(Diagnostic::error(code, span, message));
    }

    fn limits(&mut self) -> LimitChecker<'_> {
        LimitChecker {
            found: &mut self.found,
        }
    }

    fn items(&mut self, items: &'t [Item], scope: &[String]) -> Vec<Parameter> {
        self.names(items.iter().filter_map(Item::name));
        let mut out = Vec::new();
        for item in items {
            match item {
                Item::Param(param) => {
                    let parameter = self.param(param);
                    if parameter.is_none() {
                        self.invalid.insert(inner(scope, &param.name));
                    }
                    out.extend(parameter);
                }
                Item::Group(group) => {
                    let parts = self.block(&group.name, &group.items, scope);
                    let mut parameter = Parameter::new(&group.name.text, Kind::Group(parts));
                    parameter.doc.clone_from(&group.doc);
                    out.push(parameter);
                }
                Item::List(list) => {
                    let parameters = self.block(&list.name, &list.items, scope);
                    let length = self.limits().length(list.length.as_ref());
                    let mut parameter =
                        Parameter::new(&list.name.text, Kind::List { length, parameters });
                    parameter.doc.clone_from(&list.doc);
                    out.push(parameter);
                }
                Item::Rule(rule) => self.rules.push((scope.to_vec(), rule)),
                Item::Broken(name, ty) => {
                    self.invalid.insert(inner(scope, name));
                    // The word may be anything: it is reported only if it is similar to a type.
                    if let Some(ty) = ty.as_ref().filter(|ty| nearest_type(ty).is_some()) {
                        self.unknown_type(name, ty);
                    }
                }
            }
        }
        out
    }

    fn block(&mut self, name: &Name, items: &'t [Item], scope: &[String]) -> Vec<Parameter> {
        let scope = inner(scope, name);
        if scope.len() > DEEPEST {
            let message = format!("groups and lists are nested more than {DEEPEST} levels deep");
            self.error("nested-too-deep", name.span, message);
            return Vec::new();
        }
        self.items(items, &scope)
    }

    /// Reports names of one block that are equal, or equal in generated code.
    fn names<'n>(&mut self, names: impl Iterator<Item = &'n Name>) {
        let mut folded: HashMap<String, &Name> = HashMap::new();
        let mut snakes: HashMap<String, &Name> = HashMap::new();
        for name in names {
            let snake = name.text.to_snake_case();
            let (code, message, first) =
                if let Some(first) = folded.get(&name.text.to_ascii_lowercase()) {
                    let message = if first.text == name.text {
                        format!("duplicate parameter `{}`", name.text)
                    } else {
                        format!(
                            "parameter `{}` differs from `{}` only in case",
                            name.text, first.text
                        )
                    };
                    ("duplicate-name", message, *first)
                } else if let Some(first) = snakes.get(&snake).filter(|_| !snake.is_empty()) {
                    let message = format!(
                        "parameters `{}` and `{}` are both `{snake}` in generated code",
                        first.text, name.text
                    );
                    ("name-collision", message, *first)
                } else {
                    folded.insert(name.text.to_ascii_lowercase(), name);
                    snakes.insert(snake, name);
                    continue;
                };
            let diagnostic = Diagnostic::error(code, name.span, message);
            self.found
                .push(diagnostic.label(first.span, "first declared here"));
        }
    }

    fn param(&mut self, tree: &'t ast::Param) -> Option<Parameter> {
        let Some(ty) = Type::from_word(&tree.ty.text) else {
            self.unknown_type(&tree.name, &tree.ty);
            return None;
        };
        let array = tree
            .array
            .as_ref()
            .map(|array| self.limits().length(array.length.as_ref()));
        let mut parameter = Parameter::new(&tree.name.text, Kind::Scalar { ty, array });
        parameter.doc.clone_from(&tree.doc);
        parameter.range = tree
            .range
            .as_ref()
            .and_then(|range| self.limits().range(ty, range));
        parameter.choices = self.limits().choices(ty, &tree.choices);
        parameter.default = tree
            .default
            .as_ref()
            .and_then(|default| self.limits().default(&parameter, ty, array, default, tree));
        self.flags(&mut parameter, ty, &tree.flags);
        Some(parameter)
    }

    fn unknown_type(&mut self, name: &Name, ty: &Name) {
        let message = format!("unknown type `{}`", ty.text);
        let words = Type::WORDS.iter().map(|(word, _)| *word);
        let diagnostic = Diagnostic::error("unknown-type", ty.span, message);
        let foreign = FOREIGN.iter().find(|(foreign, _)| *foreign == ty.text);
        let swapped = Type::from_word(&name.text).is_some() && nearest_type(ty).is_none();
        self.found.push(if let Some((_, ours)) = foreign {
            diagnostic.did_you_mean(&ty.text, Some(ours))
        } else if swapped {
            let order = format!("the name comes first: `{} {}`", ty.text, name.text);
            diagnostic.help(order)
        } else {
            diagnostic.suggest(&ty.text, words)
        });
    }

    fn flags(&mut self, parameter: &mut Parameter, ty: Type, flags: &'t [ast::Flag]) {
        for (at, flag) in flags.iter().enumerate() {
            let class = |kind: &FlagKind| match kind {
                FlagKind::Editable | FlagKind::Fixed => 0,
                FlagKind::Unit(_) => 1,
                FlagKind::Restart => 2,
                FlagKind::Secret => 3,
                FlagKind::Reads(_) => 4,
                FlagKind::Element(..) => 5,
            };
            if let Some(first) = flags[..at]
                .iter()
                .find(|f| class(&f.kind) == class(&flag.kind))
            {
                let message = if class(&flag.kind) == 0 && first.kind != flag.kind {
                    "a parameter is either `T`, changeable while the component runs, or `F`, fixed"
                } else {
                    "duplicate flag"
                };
                self.found.push(
                    Diagnostic::error("repeated-flag", flag.span, message)
                        .label(first.span, "first used here"),
                );
                continue;
            }
            match &flag.kind {
                FlagKind::Editable => parameter.editable = true,
                FlagKind::Fixed => {}
                FlagKind::Unit(_) if !ty.is_number() => {
                    let message =
                        format!("only numbers have a unit; this is of type `{}`", ty.word());
                    self.error("bad-unit", flag.span, message);
                }
                FlagKind::Unit(unit) => {
                    if let Some(warning) = rc_syntax::unknown_unit(unit, flag.span) {
                        self.found.push(warning);
                    }
                    parameter.unit = Some(unit.clone());
                }
                FlagKind::Restart => parameter.restart = true,
                FlagKind::Secret => parameter.secret = true,
                FlagKind::Reads(_) if ty != Type::Path => {
                    let message = format!(
                        "only a `path` names a file; this is of type `{}`",
                        ty.word()
                    );
                    self.error("bad-file-kind", flag.span, message);
                }
                FlagKind::Reads(kind) => {
                    parameter.reads =
                        self.kind("bad-file-kind", "kind of files", kind, &FileKind::WORDS);
                }
                FlagKind::Element(..) if ty != Type::String => {
                    let word = ty.word();
                    let message =
                        format!("only a `string` names an element; this is of type `{word}`");
                    self.error("bad-element", flag.span, message);
                }
                FlagKind::Element(kind, of) => {
                    let what = "kind of elements";
                    let kind = self.kind("bad-element", what, kind, &ElementKind::WORDS);
                    if let Some(kind) = kind {
                        let named = of.text.clone();
                        parameter.element = Some(Element { kind, of: named });
                        self.elements.push(of);
                    }
                }
            }
        }
    }

    /// The kind that a flag names.
    fn kind<K: Copy>(
        &mut self,
        code: &'static str,
        what: &str,
        written: &Name,
        words: &[(&'static str, K)],
    ) -> Option<K> {
        let known = words.iter().find(|(word, _)| *word == written.text);
        if known.is_none() {
            let message = format!("unknown {what} `{}`", written.text);
            let error = Diagnostic::error(code, written.span, message);
            let words = words.iter().map(|(word, _)| *word);
            self.found.push(error.suggest(&written.text, words));
        }
        known.map(|(_, kind)| *kind)
    }

    /// Checks that the files of elements are those of parameters which name InnerModel files.
    fn files_of_elements(&mut self, parameters: &[Parameter]) {
        for of in std::mem::take(&mut self.elements) {
            let mut names = parameters.iter().filter(|parameter| {
                let one = Kind::Scalar {
                    ty: Type::Path,
                    array: None,
                };
                parameter.reads == Some(FileKind::Innermodel) && parameter.kind == one
            });
            if !names.any(|parameter| parameter.name == of.text) {
                let message = format!("`{}` names no InnerModel file", of.text);
                let error = Diagnostic::error("bad-element", of.span, message);
                let help = "expected a parameter outside of groups, as in \
                    `inner_model path \"arm.xml\" reads \"innermodel\";`";
                self.found.push(error.help(help));
            }
        }
    }

    /// Resolves the rules, and evaluates them for the defaults.
    fn rules(&mut self, model: &mut Parameters, trees: Vec<(Vec<String>, &ast::Rule)>) {
        let (mut rules, mut spans) = (Vec::new(), Vec::new());
        let declared = Block::new(&model.parameters);
        for (scope, tree) in trees {
            let (invalid, found) = (&self.invalid, &mut self.found);
            if let Some(rule) = conditions::resolve(&declared, invalid, &scope, tree, found) {
                rules.push(rule);
                spans.push(tree.condition.span);
            }
        }
        model.rules = rules;
        for (at, why) in violations_by_defaults(model) {
            let message = format!("the defaults break this rule: {why}");
            let diagnostic = Diagnostic::error("default-breaks-rule", spans[at], message);
            self.found.push(diagnostic);
        }
    }
}

fn inner(scope: &[String], name: &Name) -> Vec<String> {
    let mut inner = scope.to_vec();
    inner.push(name.text.clone());
    inner
}
