//! The parser. Errors become diagnostics, and parsing continues after the skipped input.

use crate::ast::{
    Annotation, Decl, DeclKind, Enumerator, File, Member, Module, Operation, Param, Scoped, Type,
    TypeKind,
};
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Name, ParseContext};

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "common.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

/// Parses one `.idsl` text.
pub fn parse(sources: &SourceMap, source: SourceId) -> (File, Diagnostics) {
    let mut reader = ParseContext::new(sources, source);
    let file = file(&mut reader);
    (file, reader.finish())
}

fn file(r: &mut ParseContext<'_>) -> File {
    let mut file = File::default();
    for pair in r.file::<Rule>().into_iter().flatten() {
        match pair.as_rule() {
            Rule::import => file.imports.extend(r.texts(pair)),
            Rule::module => file.module = Some(module(r, pair)),
            Rule::trailing => r.trailing(&pair),
            _ => {}
        }
    }
    file
}

fn module(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Module {
    let doc = r.doc(&pair);
    let mut module = Module {
        name: Name::new("", r.span(&pair)),
        doc,
        annotations: Vec::new(),
        decls: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::annotation => module.annotations.push(annotation(r, part)),
            Rule::name => module.name = r.name(&part),
            Rule::decl => module
                .decls
                .extend(part.into_inner().filter_map(|p| decl(r, p))),
            _ => {}
        }
    }
    module
}

fn decl(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Decl> {
    let rule = pair.as_rule();
    if rule == Rule::skipped {
        let first = pair
            .as_str()
            .split(|c: char| !(c.is_alphanumeric() || c == '_'));
        let likely = match first.into_iter().next().unwrap_or_default() {
            "enum" => Rule::enum_decl,
            "struct" => Rule::struct_decl,
            "sequence" => Rule::sequence_decl,
            "dictionary" => Rule::dictionary_decl,
            "exception" => Rule::exception_decl,
            "interface" => Rule::interface_decl,
            "const" => Rule::const_decl,
            _ => return unknown_decl(r, &pair),
        };
        r.report_skipped(&pair, likely);
        return None;
    }
    let doc = r.doc(&pair);
    let (mut name, mut annotations, mut members, mut enumerators) =
        (None, Vec::new(), Vec::new(), Vec::new());
    let (mut operations, mut types, mut literal, mut base) = (Vec::new(), Vec::new(), None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = Some(r.name(&part)),
            Rule::annotation => annotations.push(annotation(r, part)),
            Rule::member => members.extend(member(r, part)),
            Rule::enumerator => enumerators.extend(enumerator(r, part)),
            Rule::operation => operations.extend(operation(r, part)),
            Rule::skipped if rule == Rule::interface_decl => {
                r.report_skipped_with(&part, Rule::operation, operation_help);
            }
            Rule::skipped => r.report_skipped_with(&part, Rule::member, member_help),
            Rule::type_ref => types.push(type_ref(r, part)),
            Rule::sequence_type => {
                let span = r.span(&part);
                types.push(Type {
                    kind: sequence(r, part),
                    span,
                });
            }
            Rule::literal => literal = Some(r.literal(&part)),
            Rule::scoped => base = Some(scoped(r, part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    let name = name?;
    let kind = match rule {
        Rule::enum_decl => DeclKind::Enum(enumerators),
        Rule::struct_decl => DeclKind::Struct(members),
        Rule::exception_decl => DeclKind::Exception(base, members),
        Rule::interface_decl => DeclKind::Interface(operations),
        Rule::const_decl => DeclKind::Const(types.pop()?, literal?),
        Rule::dictionary_decl => {
            let (value, key) = (types.pop()?, types.pop()?);
            let span = key.span.to(value.span);
            DeclKind::Alias(Type {
                kind: TypeKind::Dictionary(Box::new(key), Box::new(value)),
                span,
            })
        }
        _ => DeclKind::Alias(types.pop()?),
    };
    Some(Decl {
        name,
        doc,
        annotations,
        kind,
    })
}

fn unknown_decl(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) -> Option<Decl> {
    const WORDS: [&str; 7] = [
        "enum",
        "struct",
        "sequence",
        "dictionary",
        "exception",
        "interface",
        "const",
    ];
    let text = pair.as_str();
    let length = text
        .find(|c: char| !(c.is_alphanumeric() || c == '_'))
        .unwrap_or(text.len());
    let word = if length == 0 {
        text.split_whitespace().next().unwrap_or(text)
    } else {
        &text[..length]
    };
    let start = pair.as_span().start();
    let span = Span::new(r.source, start, start + word.len());
    let message = format!("expected a declaration, found `{word}`");
    let diagnostic = Diagnostic::error("unknown-declaration", span, message);
    r.found.push(match word {
        "vector" | "list" | "array" => diagnostic.help("write `sequence<TYPE> NAME;`"),
        "map" => diagnostic.help("write `dictionary<KEY, VALUE> NAME;`"),
        _ => diagnostic.suggest(word, WORDS),
    });
    None
}

fn enumerator(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Enumerator> {
    let doc = r.doc(&pair);
    let mut parts = pair.into_inner();
    let name = parts.next().map(|p| r.name(&p))?;
    let value = parts
        .find(|p| p.as_rule() == Rule::number)
        .map(|p| r.literal(&p));
    Some(Enumerator { name, doc, value })
}

fn member(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Member> {
    let doc = r.doc(&pair);
    let (mut name, mut ty, mut annotations, mut default) = (None, None, Vec::new(), None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::annotation => annotations.push(annotation(r, part)),
            Rule::type_ref => ty = Some(type_ref(r, part)),
            Rule::name => name = Some(r.name(&part)),
            Rule::array => {
                let mut parts = part.into_inner();
                let size = parts.find(|p| p.as_rule() == Rule::number)?;
                let size = r.literal(&size);
                ty = ty.map(|element| Type {
                    span: element.span,
                    kind: TypeKind::Array(Box::new(element), size),
                });
            }
            Rule::literal => default = Some(r.literal(&part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Member {
        name: name?,
        doc,
        annotations,
        ty: ty?,
        default,
    })
}

fn operation(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Operation> {
    let doc = r.doc(&pair);
    let (mut name, mut pattern, mut result, mut idempotent) = (None, None, None, false);
    let (mut annotations, mut params, mut throws) = (Vec::new(), Vec::new(), Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::annotation => annotations.push(annotation(r, part)),
            Rule::kw_idempotent => idempotent = true,
            Rule::pattern => pattern = Some(r.name(&part)),
            Rule::type_ref => result = Some(type_ref(r, part)),
            Rule::name => name = Some(r.name(&part)),
            Rule::param => params.extend(param(r, part)),
            Rule::throws => {
                let thrown = part.into_inner().filter(|p| p.as_rule() == Rule::scoped);
                throws = thrown.map(|p| scoped(r, p)).collect();
            }
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Operation {
        name: name?,
        doc,
        annotations,
        idempotent,
        pattern,
        result,
        params,
        throws,
    })
}

fn param(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Param> {
    let (mut name, mut ty, mut out, mut annotations) = (None, None, false, Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::annotation => annotations.push(annotation(r, part)),
            Rule::kw_out => out = true,
            Rule::type_ref => ty = Some(type_ref(r, part)),
            Rule::name => name = Some(r.name(&part)),
            _ => {}
        }
    }
    Some(Param {
        name: name?,
        annotations,
        out,
        ty: ty?,
    })
}

fn type_ref(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Type {
    let span = r.span(&pair);
    let Some(inner) = pair.into_inner().next() else {
        return Type {
            kind: TypeKind::String(None),
            span,
        };
    };
    let kind = match inner.as_rule() {
        Rule::sequence_type => sequence(r, inner),
        Rule::foreign_type => foreign(r, inner),
        Rule::string_type => {
            let bound = inner.into_inner().find(|p| p.as_rule() == Rule::number);
            TypeKind::String(bound.map(|p| r.literal(&p)))
        }
        _ => TypeKind::Named(scoped(r, inner)),
    };
    Type { kind, span }
}

fn sequence(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> TypeKind {
    let span = r.span(&pair);
    let (mut element, mut bound) = (
        Type {
            kind: TypeKind::String(None),
            span,
        },
        None,
    );
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::type_ref => element = type_ref(r, part),
            Rule::number => bound = Some(r.literal(&part)),
            _ => {}
        }
    }
    TypeKind::Sequence(Box::new(element), bound)
}

/// The word at the end of `text`, and what precedes it.
fn last_word(text: &str) -> (&str, &str) {
    let text = text.trim_end();
    let before = text.trim_end_matches(|c: char| c.is_alphanumeric() || c == '_' || c == ':');
    text.split_at(before.len())
}

/// What to write instead of `float[3] a;`, `int[] a;` and `int a, b;`.
fn member_help(before: &str, from: &str) -> Option<String> {
    if from.starts_with(',') {
        return Some("each member has a type of its own: `int a; int b;`".to_owned());
    }
    let (_, ty) = last_word(before);
    let (size, rest) = from.strip_prefix('[')?.split_once(']')?;
    let name = rest.trim_end_matches(';').trim();
    let is_word = |text: &str| text.chars().all(|c| c.is_alphanumeric() || c == '_');
    if ty.is_empty() || !is_word(name) || name.is_empty() {
        return None;
    }
    Some(match size.trim() {
        "" => format!("write `sequence<{ty}> {name};`"),
        size => format!("the length follows the name: `{ty} {name}[{size}];`"),
    })
}

/// What to write instead of `int& a` and of `in Pose a` or `const Pose a`.
fn operation_help(before: &str, from: &str) -> Option<String> {
    let (rest, word) = last_word(before);
    if from.starts_with('&') && !word.is_empty() {
        return Some(format!(
            "write `out {word} NAME` for a result, and `{word} NAME` for an input"
        ));
    }
    let (_, direction) = last_word(rest);
    matches!(direction, "in" | "const" | "inout").then(|| match direction {
        "inout" => "write a parameter for the input, and one with `out` for the result".to_owned(),
        _ => format!("remove `{direction}`: a parameter without `out` is an input"),
    })
}

/// Reports `vector<T>`, `map<K, V>` and the like. Errors that follow from them are not reported.
fn foreign(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> TypeKind {
    let written: String = pair.as_str().split_whitespace().collect();
    let span = r.span(&pair);
    let parts: Vec<_> = pair.into_inner().collect();
    let name = parts.iter().find(|part| part.as_rule() == Rule::scoped);
    let name = name.map_or(String::new(), |name| {
        let name: String = name.as_str().split_whitespace().collect();
        name.rsplit("::").next().unwrap_or_default().to_lowercase()
    });
    let texts: Vec<String> = parts
        .iter()
        .filter(|part| matches!(part.as_rule(), Rule::type_ref | Rule::number))
        .map(|part| part.as_str().trim().to_owned())
        .collect();
    let mut types = parts
        .into_iter()
        .filter(|part| part.as_rule() == Rule::type_ref);
    let first = types.next().map(|part| type_ref(r, part));
    let second = types.next().map(|part| type_ref(r, part));
    let help = match (name.contains("map") || name == "dict", texts.as_slice()) {
        (true, [key, value]) => format!(
            "declare `dictionary<{key}, {value}> NAME;` in the module, and write its name here"
        ),
        (_, [element]) => format!("write `sequence<{element}>`"),
        (_, [element, size]) if second.is_none() => {
            format!("write `sequence<{element}, {size}>` for at most {size} elements")
        }
        _ => "there are `sequence<TYPE>` and `dictionary<KEY, VALUE>`".to_owned(),
    };
    let message = format!("unknown type `{written}`");
    r.found
        .push(Diagnostic::error("unknown-type", span, message).help(help));
    match (first, second) {
        (Some(element), None) => TypeKind::Sequence(Box::new(element), None),
        _ => TypeKind::String(None),
    }
}

fn scoped(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Scoped {
    let span = r.span(&pair);
    let mut names: Vec<Name> = pair.into_inner().map(|p| r.name(&p)).collect();
    let name = names.pop().unwrap_or_else(|| Name::new("", span));
    Scoped {
        module: names.pop(),
        name,
    }
}

fn annotation(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Annotation {
    let span = r.span(&pair);
    let mut annotation = Annotation {
        name: Name::new("", span),
        args: Vec::new(),
    };
    for part in pair.into_inner() {
        if part.as_rule() == Rule::name {
            annotation.name = r.name(&part);
            continue;
        }
        let mut name = None;
        for piece in part.into_inner() {
            match piece.as_rule() {
                Rule::name => name = Some(r.name(&piece)),
                Rule::equals => {}
                _ => annotation.args.push((name.take(), r.literal(&piece))),
            }
        }
    }
    annotation
}

rc_syntax::language!("`module NAME { … };`", words: [], {
    file | kw_module => "`module`",
    type_ref | scoped => "a type",
    param => "a parameter",
    enumerator => "an enumerator",
    open_angle => "`<`",
    close_angle => "`>`",
    open_square => "`[`",
    close_square => "`]`",
    equals => "`=`",
    member => "a member",
    operation => "an operation",
    decl => "a declaration",
});
