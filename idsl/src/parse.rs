//! From text to tree. Never stops: what could not be read is a diagnostic, and the rest is read.

use crate::ast::{
    Annotation, Decl, DeclKind, Enumerator, File, Import, Member, Module, Operation, Param, Scoped,
    Type, TypeKind,
};
use pest::Parser;
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{
    Literal, Name, Trivia, explain, missing_semicolon, nesting, unclosed_comment, unescape,
};

#[derive(pest_derive::Parser)]
#[grammar = "../../syntax/src/common.pest"]
#[grammar = "grammar.pest"]
struct Grammar;

/// Reads one `.idsl` text.
pub fn parse(sources: &SourceMap, source: SourceId) -> (File, Diagnostics) {
    let text = sources.text(source);
    let mut reader = Reader {
        source,
        text,
        trivia: Trivia::new(text),
        found: Diagnostics::new(),
    };
    let file = reader.file();
    (file, reader.found)
}

struct Reader<'a> {
    source: SourceId,
    text: &'a str,
    trivia: Trivia<'a>,
    found: Diagnostics,
}

impl<'a> Reader<'a> {
    fn file(&mut self) -> File {
        if let Some(unclosed) = unclosed_comment(&self.trivia, self.source) {
            self.found.push(unclosed);
            return File::default();
        }
        if self.trivia.significant().is_empty() {
            let message = "this file is empty; it should hold `module NAME { … };`";
            self.found.push(Diagnostic::error(
                "empty-file",
                Span::new(self.source, 0, 0),
                message,
            ));
            return File::default();
        }
        if let Some(deep) = nesting(self.text, self.source) {
            self.found.push(deep);
            return File::default();
        }
        let Ok(mut pairs) = Grammar::parse(Rule::file, self.text) else {
            self.found.extend(explain::<Grammar, Rule>(
                Rule::file,
                self.text,
                self.source,
                0,
                word,
            ));
            return File::default();
        };
        let mut file = File::default();
        for pair in pairs.next().into_iter().flat_map(Pair::into_inner) {
            match pair.as_rule() {
                Rule::import => file.imports.extend(self.import(pair)),
                Rule::module => file.module = Some(self.module(pair)),
                Rule::trailing => {
                    let message =
                        "there is text after the end of the module; a file holds one module";
                    let first = pair
                        .as_str()
                        .lines()
                        .next()
                        .unwrap_or_default()
                        .trim_end()
                        .len();
                    let start = pair.as_span().start();
                    let span = Span::new(self.source, start, start + first);
                    self.found
                        .push(Diagnostic::error("text-after-end", span, message));
                }
                _ => {}
            }
        }
        file
    }

    fn span(&self, pair: &Pair<'a, Rule>) -> Span {
        let span = pair.as_span();
        Span::new(self.source, span.start(), span.end())
    }

    fn name(&self, pair: &Pair<'a, Rule>) -> Name {
        Name::new(pair.as_str(), self.span(pair))
    }

    fn literal(&self, pair: &Pair<'a, Rule>) -> Literal {
        Literal::parse(pair.as_str(), self.span(pair))
    }

    fn semicolon(&mut self, pair: &Pair<'a, Rule>) {
        if pair.as_str().is_empty() {
            self.found.push(missing_semicolon(
                &self.trivia,
                self.source,
                pair.as_span().start(),
            ));
        }
    }

    fn unread(&mut self, pair: &Pair<'a, Rule>, rule: Rule) {
        let offset = pair.as_span().start();
        let found = explain::<Grammar, Rule>(rule, pair.as_str(), self.source, offset, word);
        self.found.extend(found.or_else(|| {
            let span = self.span(pair);
            Some(Diagnostic::error(
                "syntax-error",
                span,
                "this cannot be read here",
            ))
        }));
    }

    fn import(&mut self, pair: Pair<'a, Rule>) -> Option<Import> {
        let mut import = None;
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::string => {
                    import = Some(Import {
                        path: unescape(part.as_str()),
                        span: self.span(&part),
                    });
                }
                Rule::semicolon => self.semicolon(&part),
                _ => {}
            }
        }
        import
    }

    fn module(&mut self, pair: Pair<'a, Rule>) -> Module {
        let doc = self.trivia.documentation(pair.as_span().start());
        let mut module = Module {
            name: Name::new("", self.span(&pair)),
            doc,
            decls: Vec::new(),
        };
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => module.name = self.name(&part),
                Rule::decl => module
                    .decls
                    .extend(part.into_inner().filter_map(|p| self.decl(p))),
                _ => {}
            }
        }
        module
    }

    fn decl(&mut self, pair: Pair<'a, Rule>) -> Option<Decl> {
        let rule = pair.as_rule();
        if rule == Rule::unread {
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
                _ => return self.unknown_decl(&pair),
            };
            self.unread(&pair, likely);
            return None;
        }
        let doc = self.trivia.documentation(pair.as_span().start());
        let (mut name, mut annotations, mut members, mut enumerators) =
            (None, Vec::new(), Vec::new(), Vec::new());
        let (mut operations, mut types, mut literal, mut base) =
            (Vec::new(), Vec::new(), None, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => name = Some(self.name(&part)),
                Rule::annotation => annotations.push(self.annotation(part)),
                Rule::member => members.extend(self.member(part)),
                Rule::enumerator => enumerators.extend(self.enumerator(part)),
                Rule::operation => operations.extend(self.operation(part)),
                Rule::unread if rule == Rule::interface_decl => self.unread(&part, Rule::operation),
                Rule::unread => self.unread(&part, Rule::member),
                Rule::type_ref => types.push(self.type_ref(part)),
                Rule::sequence_type => {
                    let span = self.span(&part);
                    types.push(Type {
                        kind: self.sequence(part),
                        span,
                    });
                }
                Rule::literal => literal = Some(self.literal(&part)),
                Rule::scoped => base = Some(self.scoped(part)),
                Rule::semicolon => self.semicolon(&part),
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

    fn unknown_decl(&mut self, pair: &Pair<'a, Rule>) -> Option<Decl> {
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
        let span = Span::new(self.source, start, start + word.len());
        let message = format!("`{word}` does not begin a declaration");
        self.found
            .push(Diagnostic::error("unknown-declaration", span, message).suggest(word, WORDS));
        None
    }

    fn enumerator(&mut self, pair: Pair<'a, Rule>) -> Option<Enumerator> {
        let doc = self.trivia.documentation(pair.as_span().start());
        let mut parts = pair.into_inner();
        let name = parts.next().map(|p| self.name(&p))?;
        let value = parts
            .find(|p| p.as_rule() == Rule::number)
            .map(|p| self.literal(&p));
        Some(Enumerator { name, doc, value })
    }

    fn member(&mut self, pair: Pair<'a, Rule>) -> Option<Member> {
        let doc = self.trivia.documentation(pair.as_span().start());
        let (mut name, mut ty, mut annotations, mut default) = (None, None, Vec::new(), None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::annotation => annotations.push(self.annotation(part)),
                Rule::type_ref => ty = Some(self.type_ref(part)),
                Rule::name => name = Some(self.name(&part)),
                Rule::array => {
                    let mut parts = part.into_inner();
                    let size = parts.find(|p| p.as_rule() == Rule::number)?;
                    let size = self.literal(&size);
                    ty = ty.map(|element| Type {
                        span: element.span,
                        kind: TypeKind::Array(Box::new(element), size),
                    });
                }
                Rule::literal => default = Some(self.literal(&part)),
                Rule::semicolon => self.semicolon(&part),
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

    fn operation(&mut self, pair: Pair<'a, Rule>) -> Option<Operation> {
        let doc = self.trivia.documentation(pair.as_span().start());
        let (mut name, mut pattern, mut result, mut idempotent) = (None, None, None, false);
        let (mut annotations, mut params, mut throws) = (Vec::new(), Vec::new(), Vec::new());
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::annotation => annotations.push(self.annotation(part)),
                Rule::kw_idempotent => idempotent = true,
                Rule::pattern => pattern = Some(self.name(&part)),
                Rule::type_ref => result = Some(self.type_ref(part)),
                Rule::name => name = Some(self.name(&part)),
                Rule::param => params.extend(self.param(part)),
                Rule::throws => {
                    let scoped = part.into_inner().filter(|p| p.as_rule() == Rule::scoped);
                    throws = scoped.map(|p| self.scoped(p)).collect();
                }
                Rule::semicolon => self.semicolon(&part),
                _ => {}
            }
        }
        let result = result.filter(|ty| !is_void(ty));
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

    fn param(&mut self, pair: Pair<'a, Rule>) -> Option<Param> {
        let (mut name, mut ty, mut out, mut annotations) = (None, None, false, Vec::new());
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::annotation => annotations.push(self.annotation(part)),
                Rule::kw_out => out = true,
                Rule::type_ref => ty = Some(self.type_ref(part)),
                Rule::name => name = Some(self.name(&part)),
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

    fn type_ref(&mut self, pair: Pair<'a, Rule>) -> Type {
        let span = self.span(&pair);
        let Some(inner) = pair.into_inner().next() else {
            return Type {
                kind: TypeKind::Text(None),
                span,
            };
        };
        let kind = match inner.as_rule() {
            Rule::sequence_type => self.sequence(inner),
            Rule::string_type => {
                let bound = inner.into_inner().find(|p| p.as_rule() == Rule::number);
                TypeKind::Text(bound.map(|p| self.literal(&p)))
            }
            _ => TypeKind::Named(self.scoped(inner)),
        };
        Type { kind, span }
    }

    fn sequence(&mut self, pair: Pair<'a, Rule>) -> TypeKind {
        let span = self.span(&pair);
        let (mut element, mut bound) = (
            Type {
                kind: TypeKind::Text(None),
                span,
            },
            None,
        );
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::type_ref => element = self.type_ref(part),
                Rule::number => bound = Some(self.literal(&part)),
                _ => {}
            }
        }
        TypeKind::Sequence(Box::new(element), bound)
    }

    fn scoped(&mut self, pair: Pair<'a, Rule>) -> Scoped {
        let span = self.span(&pair);
        let mut names: Vec<Name> = pair.into_inner().map(|p| self.name(&p)).collect();
        let name = names.pop().unwrap_or_else(|| Name::new("", span));
        Scoped {
            module: names.pop(),
            name,
        }
    }

    fn annotation(&mut self, pair: Pair<'a, Rule>) -> Annotation {
        let span = self.span(&pair);
        let mut annotation = Annotation {
            name: Name::new("", span),
            args: Vec::new(),
        };
        for part in pair.into_inner() {
            if part.as_rule() == Rule::name {
                annotation.name = self.name(&part);
                continue;
            }
            let mut name = None;
            for piece in part.into_inner() {
                match piece.as_rule() {
                    Rule::name => name = Some(self.name(&piece)),
                    Rule::equals => {}
                    _ => annotation.args.push((name.take(), self.literal(&piece))),
                }
            }
        }
        annotation
    }
}

fn is_void(ty: &Type) -> bool {
    matches!(&ty.kind, TypeKind::Named(Scoped { module: None, name }) if name.text == "void")
}

/// The words of messages for the rules that can be missing.
fn word(rule: Rule) -> Option<&'static str> {
    Some(match rule {
        Rule::EOI => "the end of the file",
        Rule::file | Rule::kw_module => "`module`",
        Rule::name => "a name",
        Rule::string => "a text in quotes",
        Rule::number => "a number",
        Rule::literal => "a value",
        Rule::type_ref | Rule::scoped => "a type",
        Rule::param => "a parameter",
        Rule::enumerator => "an enumerator",
        Rule::semicolon | Rule::begins_next => "`;`",
        Rule::open => "`{`",
        Rule::close => "`}`",
        Rule::open_round => "`(`",
        Rule::close_round => "`)`",
        Rule::open_angle => "`<`",
        Rule::close_angle => "`>`",
        Rule::open_square => "`[`",
        Rule::close_square => "`]`",
        Rule::comma => "`,`",
        Rule::equals => "`=`",
        Rule::member => "a member",
        Rule::operation => "an operation",
        Rule::decl => "a declaration",
        _ => return None,
    })
}
