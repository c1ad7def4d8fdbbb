//! The parser. Errors become diagnostics, and parsing continues after the skipped input.

mod world;

use crate::ast::{
    Clause, Collect, Communication, Component, Dependency, File, OperationPath, Reaction, Setting,
    SlotDecl,
};
use crate::model::{Language, Role};
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Literal, Name, ParseContext, home_in_path};

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "common.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

/// The keywords of clauses.
const KEYWORDS: [&str; 15] = [
    "Communications",
    "language",
    "gui",
    "options",
    "statemachine",
    "parameters",
    "kinematics",
    "world",
    "dependencies",
    "python",
    "period",
    "collect",
    "reactions",
    "simulates",
    "lifecycle",
];

/// Parses one `.cdsl` text.
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
            Rule::component => file.component = Some(component(r, pair)),
            Rule::trailing => r.trailing(&pair),
            _ => {}
        }
    }
    file
}

fn component(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Component {
    let doc = r.doc(&pair);
    let mut component = Component {
        name: Name::new("", r.span(&pair)),
        doc,
        clauses: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => component.name = r.name(&part),
            Rule::clause => component
                .clauses
                .extend(part.into_inner().filter_map(|p| clause(r, p))),
            _ => {}
        }
    }
    component
}

fn clause(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<(Name, Clause)> {
    let rule = pair.as_rule();
    if rule == Rule::skipped {
        report_skipped_clause(r, &pair);
        return None;
    }
    let first = pair.clone().into_inner().next().map(|p| r.name(&p))?;
    let clause = match rule {
        Rule::communications => {
            let mut communications = Vec::new();
            for part in pair.into_inner() {
                match part.as_rule() {
                    Rule::communication => communications.extend(communication(r, part)),
                    Rule::skipped => report_skipped_communication(r, &part),
                    _ => {}
                }
            }
            Clause::Communications(communications)
        }
        Rule::dependencies => {
            let dependencies = pair
                .into_inner()
                .filter(|p| p.as_rule() == Rule::dependency);
            Clause::Dependencies(dependencies.filter_map(|p| dependency(r, p)).collect())
        }
        Rule::period => {
            let value = pair
                .clone()
                .into_inner()
                .find(|p| matches!(p.as_rule(), Rule::duration | Rule::number))?;
            let literal = Literal::parse(value.as_str(), r.span(&value));
            r.texts(pair);
            Clause::Period(literal)
        }
        Rule::collect => Clause::Collect(collect(r, pair)?),
        Rule::reactions => {
            let mut reactions = Vec::new();
            for part in pair.into_inner() {
                match part.as_rule() {
                    Rule::reaction => reactions.push(reaction(r, part)),
                    Rule::skipped => r.report_skipped(&part, Rule::reaction),
                    _ => {}
                }
            }
            Clause::Reactions(reactions)
        }
        Rule::statemachine => {
            let (mut file, mut visual, mut external) = (None, false, Vec::new());
            for part in pair.into_inner() {
                match part.as_rule() {
                    Rule::string => file = Some(r.string(&part)),
                    Rule::kw_visual => visual = true,
                    Rule::external => external.extend(keyword_and_names(r, part)),
                    Rule::semicolon => r.semicolon(&part),
                    _ => {}
                }
            }
            let file = file?;
            r.found.extend(home_in_path(&file.text, file.span));
            Clause::StateMachine(file, visual, external)
        }
        Rule::world => Clause::World(world::world(r, pair)?),
        Rule::python => {
            let (mut version, mut venv) = (None, false);
            for part in pair.into_inner() {
                match part.as_rule() {
                    Rule::string => version = Some(r.string(&part)),
                    Rule::kw_venv => venv = true,
                    Rule::semicolon => r.semicolon(&part),
                    _ => {}
                }
            }
            Clause::Python(version?, venv)
        }
        _ => {
            let mut texts = r.texts(pair).into_iter();
            match rule {
                Rule::language => Clause::Language(texts.next()?),
                Rule::simulates => Clause::SimulatesTime,
                Rule::lifecycle => Clause::Lifecycle(texts.next()?),
                Rule::gui => Clause::Gui(texts.next()?, texts.next()),
                Rule::options => Clause::Options(texts.collect()),
                Rule::kinematics => {
                    let file = texts.next()?;
                    r.found.extend(home_in_path(&file.text, file.span));
                    Clause::Kinematics(file, texts.next()?)
                }
                _ => {
                    let file = texts.next()?;
                    r.found.extend(home_in_path(&file.text, file.span));
                    Clause::Parameters(file)
                }
            }
        }
    };
    Some((first, clause))
}

fn collect(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Collect> {
    let (mut topics, mut within, mut name) = (Vec::new(), None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::operation => topics.extend(operation(r, part)),
            Rule::duration | Rule::number => {
                within = Some(Literal::parse(part.as_str(), r.span(&part)));
            }
            Rule::name => name = Some(r.name(&part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Collect {
        topics,
        within,
        name: name?,
    })
}

fn reaction(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Reaction {
    let mut reaction = Reaction {
        causes: Vec::new(),
        effects: Vec::new(),
        budget: None,
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::causes => reaction.causes = operations(r, part),
            Rule::effects => reaction.effects = operations(r, part),
            Rule::budget => {
                let mut parts = part.into_inner();
                let time = parts.find(|p| matches!(p.as_rule(), Rule::duration | Rule::number));
                reaction.budget = time.map(|time| Literal::parse(time.as_str(), r.span(&time)));
            }
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    reaction
}

fn operations(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<OperationPath> {
    let paths = pair.into_inner().filter(|p| p.as_rule() == Rule::operation);
    paths.filter_map(|path| operation(r, path)).collect()
}

fn operation(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<OperationPath> {
    let mut names = r.texts(pair).into_iter();
    let first = names.next()?;
    Some(match names.next() {
        Some(operation) => OperationPath {
            slot: Some(first),
            operation,
        },
        None => OperationPath {
            slot: None,
            operation: first,
        },
    })
}

fn communication(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Communication> {
    let (mut keyword, mut slots) = (None, Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::kw_communication => keyword = Some(r.name(&part)),
            Rule::slot => slots.extend(slot(r, part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Communication {
        keyword: keyword?,
        slots,
    })
}

fn slot(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<SlotDecl> {
    let span = r.span(&pair);
    let (mut interface, mut backend, mut name, mut qos) = (None, None, None, Vec::new());
    let (mut array, mut optional, mut available) = (None, None, Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => interface = Some(r.name(&part)),
            Rule::array => array = Some(r.span(&part)),
            Rule::backend => backend = Some(r.name(&part)),
            Rule::slot_name => name = Some(r.name(&part)),
            Rule::kw_optional => optional = Some(r.name(&part)),
            Rule::qos => {
                for part in part.into_inner() {
                    match part.as_rule() {
                        Rule::available => available.extend(keyword_and_names(r, part)),
                        _ => qos.extend(setting(r, part)),
                    }
                }
            }
            _ => {}
        }
    }
    let trimmed = r.trivia.end_of_token_before(span.end);
    Some(SlotDecl {
        interface: interface?,
        array,
        backend,
        name,
        optional,
        qos,
        available,
        span: Span::new(r.source, span.start, trimmed),
    })
}

/// `external go, stop;` and `available moving, holding;`
fn keyword_and_names(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<(Name, Vec<Name>)> {
    let keyword = pair.clone().into_inner().next().map(|p| r.name(&p))?;
    Some((keyword, r.texts(pair)))
}

fn setting(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Setting> {
    let (mut name, mut value, mut mode) = (None, None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = Some(r.name(&part)),
            Rule::literal => value = Some(Literal::parse(part.as_str(), r.span(&part))),
            Rule::mode => {
                let mut parts = part.into_inner();
                mode = parts.next().map(|word| word.as_str().to_owned());
                let time = parts.find(|p| p.as_rule() == Rule::literal)?;
                value = Some(Literal::parse(time.as_str(), r.span(&time)));
            }
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Setting {
        name: name?,
        value: value?,
        mode,
    })
}

fn report_skipped_clause(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) {
    let first = r.first_word(pair);
    let rule = match first.text.to_lowercase().as_str() {
        "communications" => Rule::communications,
        "language" => return report_skipped_language(r, pair),
        "gui" => Rule::gui,
        "options" => Rule::options,
        "statemachine" => Rule::statemachine,
        "parameters" => Rule::parameters,
        "kinematics" => Rule::kinematics,
        "world" => Rule::world,
        "dependencies" => Rule::dependencies,
        "python" => Rule::python,
        "period" => Rule::period,
        "collect" => Rule::collect,
        "reactions" => Rule::reactions,
        "simulates" => Rule::simulates,
        "lifecycle" => Rule::lifecycle,
        _ => return r.found.push(unknown_clause(&first)),
    };
    r.report_skipped(pair, rule);
}

fn dependency(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Dependency> {
    let (mut package, mut short, mut fields) = (None, None, Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::crate_name => package = Some(r.name(&part)),
            Rule::string => short = Some(r.string(&part)),
            Rule::semicolon => r.semicolon(&part),
            Rule::dependency_field => {
                let (mut name, mut values) = (None, Vec::new());
                for piece in part.into_inner() {
                    match piece.as_rule() {
                        Rule::name => name = Some(r.name(&piece)),
                        Rule::literal => values.push(r.literal(&piece)),
                        Rule::semicolon => r.semicolon(&piece),
                        _ => {}
                    }
                }
                fields.extend(name.map(|name| (name, values)));
            }
            _ => {}
        }
    }
    Some(Dependency {
        package: package?,
        short,
        fields,
    })
}

/// An unknown programming language.
pub(crate) fn unknown_language(name: &Name) -> Diagnostic {
    let message = format!("unknown language `{}`", name.text);
    Diagnostic::error("unknown-language", name.span, message)
        .suggest(&name.text, Language::WORDS.map(|(word, _)| word))
}

/// Reports a language that is not a name, such as `N++`, as an unknown language.
fn report_skipped_language(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) {
    let text = pair.as_str();
    let rest = &text["language".len()..];
    let written = rest.trim_end_matches(';').trim();
    if written.is_empty() || written.contains(char::is_whitespace) {
        return r.report_skipped(pair, Rule::language);
    }
    let start = pair.as_span().end() - rest.trim_start().len();
    let span = Span::new(r.source, start, start + written.len());
    r.found.push(unknown_language(&Name::new(written, span)));
}

fn report_skipped_communication(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) {
    let first = r.first_word(pair);
    if Role::from_file(&first.text).is_some() {
        return r.report_skipped(pair, Rule::communication);
    }
    let message = format!("expected a communication clause, found `{}`", first.text);
    let clause = |word: &&str| word.eq_ignore_ascii_case(&first.text);
    if let Some(word) = KEYWORDS.iter().find(|word| clause(word)) {
        let help = format!("end `Communications` with `}};` before `{word}`");
        let error = Diagnostic::error("unknown-communication", first.span, message);
        return r.found.push(error.help(help));
    }
    let all: Vec<String> = Role::words().map(|word| format!("`{word}`")).collect();
    let all = format!("expected one of {}", all.join(", "));
    // Keywords of other component models.
    let near = match first.text.to_lowercase().as_str() {
        "provides" | "provide" | "offers" | "serves" => Some("implements"),
        "uses" | "needs" | "calls" => Some("requires"),
        _ => rc_diagnostics::nearest(&first.text, Role::words()),
    };
    let help = near.map_or(all.clone(), |near| format!("did you mean `{near}`? {all}"));
    r.found
        .push(Diagnostic::error("unknown-communication", first.span, message).help(help));
}

/// Reports an unknown clause, or a clause of RoboComp's Eclipse tools with its replacement.
fn unknown_clause(first: &Name) -> Diagnostic {
    let replacement = match first.text.to_lowercase().as_str() {
        "robocompmodules" | "robocompclasses" => {
            Some("use `dependencies { NAME \"VERSION\"; };` with crates instead of classes")
        }
        "useqt" => Some("use `gui Qt (QWidget);`"),
        "worker" => {
            Some("remove it: the worker's loop needs no clause; `period 50ms;` sets its period")
        }
        _ => None,
    };
    if let Some(replacement) = replacement {
        let message = format!("clause `{}` is obsolete", first.text);
        Diagnostic::error("old-clause", first.span, message).help(replacement)
    } else {
        let message = format!("expected a clause of a component, found `{}`", first.text);
        Diagnostic::error("unknown-clause", first.span, message).suggest(&first.text, KEYWORDS)
    }
}

rc_syntax::language!("`Component NAME { … };`", words: [crate_name, dotted_name, language_word], {
    file | kw_component => "`Component`",
    operation | causes | effects => "an operation, or `compute`",
    collect | kw_collect => "`collect`",
    kw_exact => "`exact`",
    kw_within => "`within`",
    reaction => "a reaction such as `scan -> setSpeed budget 3ms;`",
    arrow => "`->`",
    budget | kw_budget => "`budget`",
    dot => "`.`",
    crate_name | dotted_name | slot | interface_name | backend | slot_name | language_word => "a name",
    duration | number => "a duration such as `50ms`",
    communication | kw_communication => "`implements`, `requires`, `publishes` or `subscribesTo`",
    array | open_square => "`[`",
    close_square => "`]`",
    clause => "a clause",
    kw_time => "`time`",
    kw_as => "`as`",
    access | kw_access => "`writes` or `reads`",
    access_item => "a type or an attribute of the world",
    kw_any => "`any`",
    kw_stream => "`stream`",
    kw_shared => "`shared`",
    kw_venv => "`venv`",
    external => "`external`",
    communication_end => "`;`",
});
