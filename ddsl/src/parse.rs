//! The parser. Errors become diagnostics, and parsing continues after the skipped input.

mod bind;
mod chain;
mod world;

use crate::ast::{
    Component, Decl, Deployment, Field, FieldBlock, File, Group, Host, HostBuild, HostField,
    Middleware, Parameter, ParameterValue, Process, Restart, SlotPath, Slots,
};
use crate::settings;
use bind::{bind, external};
use chain::chain;
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use rc_syntax::{Literal, Name, ParseContext};
use world::world;

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "common.pest"]
#[grammar = "condition.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

/// Keywords, each with the rule of its declaration.
type Keywords = [(&'static str, Rule)];

const GROUP: [(&str, Rule); 15] = [
    ("Component", Rule::component),
    ("Process", Rule::process),
    ("Host", Rule::host),
    ("Group", Rule::group),
    ("bind", Rule::bind),
    ("external", Rule::external),
    ("middleware", Rule::middleware),
    ("domain", Rule::domain),
    ("time", Rule::network_time),
    ("record", Rule::network_record),
    ("Chain", Rule::chain),
    ("World", Rule::world),
    ("require", Rule::require),
    ("export", Rule::export),
    ("proxy", Rule::proxy),
];
/// A deployment has all declarations of a group but `export` and `proxy`.
const DEPLOYMENT: &Keywords = GROUP.split_at(13).0;
const COMPONENT: [(&str, Rule); 20] = [
    ("cdsl", Rule::text_field),
    ("executable", Rule::text_field),
    ("config", Rule::text_field),
    ("host", Rule::host_ref),
    ("process", Rule::process_ref),
    ("endpoint", Rule::text_field),
    ("after", Rule::after),
    ("restart", Rule::restart),
    ("ready", Rule::time_field),
    ("stop", Rule::time_field),
    ("env", Rule::env),
    ("args", Rule::args),
    ("cpu", Rule::cpu),
    ("priority", Rule::priority),
    ("parameters", Rule::parameters),
    ("slots", Rule::slots),
    ("middleware", Rule::middleware),
    ("domain", Rule::domain),
    ("time", Rule::own_time),
    ("record", Rule::record),
];
const PROCESS: [(&str, Rule); 5] = [
    ("Component", Rule::component),
    ("host", Rule::host_ref),
    ("restart", Rule::restart),
    ("cpu", Rule::cpu),
    ("priority", Rule::priority),
];
const NETWORK_RECORD: [(&str, Rule); 1] = [("ring", Rule::ring)];
const RECORD: [(&str, Rule); 1] = [("exact", Rule::record_field)];
const HOST: [(&str, Rule); 6] = [
    ("address", Rule::host_text),
    ("user", Rule::host_text),
    ("workspace", Rule::host_text),
    ("link", Rule::host_text),
    ("arch", Rule::host_arch),
    ("build", Rule::host_build),
];

/// Parses one `.ddsl` text.
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
            Rule::deployment => file.deployment = Some(deployment(r, pair)),
            Rule::trailing => r.trailing(&pair),
            _ => {}
        }
    }
    file
}

fn deployment(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Deployment {
    let mut deployment = Deployment {
        name: Name::new("", r.span(&pair)),
        doc: r.doc(&pair),
        decls: Vec::new(),
        end: r.span(&pair),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => deployment.name = r.name(&part),
            Rule::close => deployment.end = r.span(&part),
            Rule::decl => {
                let what = "a declaration of a deployment";
                deployment.decls.extend(decl(r, part, DEPLOYMENT, what));
            }
            _ => {}
        }
    }
    deployment
}

fn decl(
    r: &mut ParseContext<'_>,
    pair: Pair<'_, Rule>,
    words: &Keywords,
    what: &str,
) -> Option<Decl> {
    let pair = pair.into_inner().next()?;
    Some(match pair.as_rule() {
        Rule::host => Decl::Host(host(r, pair)),
        Rule::component => Decl::Component(component(r, pair)),
        Rule::process => Decl::Process(process(r, pair)),
        Rule::group => Decl::Group(group(r, pair)),
        Rule::bind => Decl::Bind(bind(r, pair)?),
        Rule::external => Decl::External(external(r, pair)),
        Rule::chain => Decl::Chain(chain(r, pair)),
        Rule::world => Decl::World(world(r, pair)),
        Rule::require => Decl::Require(Box::new(rc_pdsl::condition::require(r, pair)?)),
        Rule::middleware => Decl::Middleware(middleware(r, pair)?),
        Rule::domain => {
            let word = r.first_word(&pair);
            Decl::Domain(word, values(r, pair).into_iter().next()?)
        }
        Rule::network_time => {
            let word = r.first_word(&pair);
            Decl::Time(word, r.texts(pair))
        }
        Rule::network_record => {
            let word = r.first_word(&pair);
            Decl::Record(word, network_record(r, pair))
        }
        _ => {
            report_skipped(r, &pair, words, what);
            return None;
        }
    })
}

fn slot_path(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<SlotPath> {
    let mut path = r.texts(pair);
    let slot = path.pop()?;
    Some(SlotPath { path, slot })
}

/// A declaration with fields of the rule `rule`, which `read` reads: `words` are their keywords, and
/// `what` is one of them, for people.
fn field_block<F>(
    r: &mut ParseContext<'_>,
    pair: Pair<'_, Rule>,
    (rule, words, what): (Rule, &Keywords, &str),
    read: impl Fn(&mut ParseContext<'_>, Pair<'_, Rule>) -> Vec<(Name, F)>,
) -> FieldBlock<F> {
    let mut block = FieldBlock {
        name: Name::new("", r.span(&pair)),
        doc: r.doc(&pair),
        fields: Vec::new(),
        incomplete: false,
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => block.name = r.name(&part),
            Rule::skipped => {
                block.incomplete = true;
                report_skipped(r, &part, words, what);
            }
            of if of == rule => block.fields.extend(read(r, part)),
            _ => {}
        }
    }
    block
}

fn host(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Host {
    let fields = (Rule::host_field, &HOST[..], "a field of a host");
    field_block(r, pair, fields, |r, part| fields_by(r, part, host_field))
}

fn host_field(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>, _: &Name) -> Option<HostField> {
    match pair.as_rule() {
        Rule::host_build => host_build(r, pair).map(HostField::Build),
        Rule::host_arch => Some(HostField::Arch(r.texts(pair).into_iter().next()?)),
        _ => Some(HostField::Text(r.texts(pair).into_iter().next()?)),
    }
}

fn host_build(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<HostBuild> {
    let (mut place, mut jobs, mut nice) = (None, None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => place = Some(r.name(&part)),
            Rule::jobs => jobs = values(r, part).into_iter().next(),
            Rule::nice => nice = values(r, part).into_iter().next(),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(HostBuild {
        place: place?,
        jobs,
        nice,
    })
}

fn group(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Group {
    let mut group = Group {
        name: Name::new("", r.span(&pair)),
        doc: r.doc(&pair),
        decls: Vec::new(),
        exports: Vec::new(),
        proxies: Vec::new(),
        incomplete: false,
        end: r.span(&pair),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => group.name = r.name(&part),
            Rule::close => group.end = r.span(&part),
            Rule::export => {
                let word = r.first_word(&part);
                group.exports.push((word, r.texts(part)));
            }
            Rule::proxy => {
                let word = r.first_word(&part);
                group.proxies.push((word, middleware(r, part)));
            }
            Rule::decl => match decl(r, part, &GROUP, "a declaration of a group") {
                Some(decl) => group.decls.push(decl),
                None => group.incomplete = true,
            },
            _ => {}
        }
    }
    group
}

fn process(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Process {
    let mut process = Process {
        name: Name::new("", r.span(&pair)),
        doc: r.doc(&pair),
        fields: Vec::new(),
        components: Vec::new(),
        incomplete: false,
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => process.name = r.name(&part),
            Rule::process_field => process.fields.extend(fields(r, part)),
            Rule::component => process.components.push(component(r, part)),
            Rule::skipped => {
                process.incomplete = true;
                report_skipped(r, &part, &PROCESS, "a field or a component of a process");
            }
            _ => {}
        }
    }
    process
}

/// A field, with its keyword.
fn fields(r: &mut ParseContext<'_>, part: Pair<'_, Rule>) -> Vec<(Name, Field)> {
    fields_by(r, part, field)
}

/// The fields that `read` reads, with their keyword.
fn fields_by<F>(
    r: &mut ParseContext<'_>,
    part: Pair<'_, Rule>,
    read: impl Fn(&mut ParseContext<'_>, Pair<'_, Rule>, &Name) -> Option<F>,
) -> Vec<(Name, F)> {
    let word = r.first_word(&part);
    let found = part.into_inner();
    found
        .filter_map(|pair| Some((word.clone(), read(r, pair, &word)?)))
        .collect()
}

fn component(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Component {
    let of = (Rule::field, &COMPONENT[..], "a field of a component");
    field_block(r, pair, of, fields)
}

fn field(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>, word: &Name) -> Option<Field> {
    let word = word.text.to_lowercase();
    Some(match pair.as_rule() {
        Rule::text_field => {
            let text = r.texts(pair).into_iter().next()?;
            match word.as_str() {
                "cdsl" => Field::Cdsl(text),
                "executable" => Field::Executable(text),
                "config" => Field::Config(text),
                _ => Field::Endpoint(text),
            }
        }
        Rule::host_ref => Field::Host(r.texts(pair).into_iter().next()?),
        Rule::process_ref => Field::Process(r.texts(pair).into_iter().next()?),
        Rule::after => Field::After(r.texts(pair)),
        Rule::args => Field::Args(r.texts(pair)),
        Rule::restart => Field::Restart(Box::new(restart(r, pair)?)),
        Rule::time_field => {
            let time = values(r, pair).into_iter().next()?;
            match word.as_str() {
                "ready" => Field::Ready(time),
                _ => Field::Stop(time),
            }
        }
        Rule::env => {
            let variables = pair.into_inner().filter(|p| p.as_rule() == Rule::variable);
            let variables = variables.filter_map(|v| <[Name; 2]>::try_from(r.texts(v)).ok());
            Field::Env(variables.map(|[name, value]| (name, value)).collect())
        }
        Rule::cpu => Field::Cpu(values(r, pair)),
        Rule::parameters => Field::Parameters(parameters(r, pair)),
        Rule::slots => Field::Slots(slots(r, pair)),
        Rule::middleware => Field::Middleware(middleware(r, pair)?),
        Rule::domain => Field::Domain(values(r, pair).into_iter().next()?),
        Rule::own_time => {
            r.texts(pair);
            Field::SystemTime
        }
        Rule::record => Field::Record(record(r, pair)),
        _ => Field::Priority(values(r, pair).into_iter().next()?),
    })
}

fn network_record(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<(Name, Option<Literal>)> {
    let mut fields = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::ring => {
                let word = r.first_word(&part);
                fields.push((word, values(r, part).into_iter().next()));
            }
            Rule::record_field => fields.push((r.first_word(&part), None)),
            Rule::skipped => report_skipped(r, &part, &NETWORK_RECORD, "`ring`"),
            _ => {}
        }
    }
    fields
}

fn record(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<Name> {
    let mut words = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::record_field => {
                words.push(r.first_word(&part));
                r.texts(part);
            }
            Rule::skipped => report_skipped(r, &part, &RECORD, "`exact`"),
            _ => {}
        }
    }
    words
}

fn slots(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Slots {
    let (mut slots, mut all) = (Vec::new(), None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::all_members => all = all.or(Some(r.span(&part))),
            Rule::members => {
                let mut names = r.texts(part);
                if !names.is_empty() {
                    slots.push((names.remove(0), names));
                }
            }
            Rule::skipped => r.report_skipped(&part, Rule::members),
            _ => {}
        }
    }
    Slots { lists: slots, all }
}

fn parameters(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<Parameter> {
    let mut parameters = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::parameter => parameters.extend(parameter(r, part)),
            Rule::skipped => r.report_skipped(&part, Rule::parameter),
            _ => {}
        }
    }
    parameters
}

fn parameter(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Parameter> {
    let (mut path, mut value) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::parameter_path => path = Some(r.name(&part)),
            Rule::literal => value = Some(ParameterValue::One(r.literal(&part))),
            Rule::list => value = Some(ParameterValue::Array(values(r, part))),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Parameter {
        path: path?,
        value: value?,
    })
}

fn middleware(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Middleware> {
    let (mut name, mut remote, mut settings) = (None, None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = Some(r.name(&part)),
            Rule::remote => {
                let named = part.into_inner().find(|part| part.as_rule() == Rule::name);
                remote = named.map(|part| r.name(&part));
            }
            Rule::semicolon => r.semicolon(&part),
            Rule::settings => {
                let list: &mut Vec<(Name, Vec<Literal>)> = settings.insert(Vec::new());
                for part in part.into_inner() {
                    match part.as_rule() {
                        Rule::setting => {
                            let word = r.first_word(&part);
                            list.push((word, values(r, part)));
                        }
                        Rule::skipped => {
                            let words = settings::words().map(|word| (word, Rule::setting));
                            let words: Vec<_> = words.collect();
                            report_skipped(r, &part, &words, "a setting of a middleware");
                        }
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
    Some(Middleware {
        name: name?,
        remote,
        settings,
    })
}

fn restart(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Restart> {
    let (mut policy, mut hung, mut limit, mut backoff) = (None, None, None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => policy = Some(r.name(&part)),
            Rule::limit => {
                let mut values = values(r, part).into_iter();
                limit = values.next().zip(values.next());
            }
            Rule::hung => hung = values(r, part).into_iter().next(),
            Rule::backoff => backoff = values(r, part).into_iter().next(),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Restart {
        policy: policy?,
        hung,
        limit,
        backoff,
    })
}

/// The literals directly inside a pair. Reports a missing `;`.
fn values(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<Literal> {
    let mut values = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::number | Rule::time | Rule::literal => values.push(r.literal(&part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    values
}

/// Reports skipped input where one of `words` is expected.
fn report_skipped(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>, words: &Keywords, what: &str) {
    let first = r.first_word(pair);
    let meant = words
        .iter()
        .find(|(word, _)| word.eq_ignore_ascii_case(&first.text));
    if let Some((_, rule)) = meant {
        return r.report_skipped_with(pair, *rule, |before, from| {
            let is_slot = before
                .trim_end()
                .ends_with(|c: char| c.is_alphanumeric() || c == '_')
                && (from.starts_with("->") || from.starts_with(';'));
            (*rule == Rule::bind && is_slot)
                .then(|| "name the slots, too: `bind CONSUMER.SLOT -> PROVIDER.SLOT;`".to_owned())
        });
    }
    let message = format!("expected {what}, found `{}`", first.text);
    let diagnostic = Diagnostic::error("unknown-field", first.span, message);
    let diagnostic = diagnostic.suggest(&first.text, words.iter().map(|(word, _)| *word));
    r.found.push(if diagnostic.help.is_some() {
        diagnostic
    } else {
        let all: Vec<String> = words.iter().map(|(word, _)| format!("`{word}`")).collect();
        diagnostic.help(format!("expected one of {}", all.join(", ")))
    });
}

rc_pdsl::condition_rules!();

rc_syntax::language!("`Deployment NAME { … };`", words: [number], {
    file | kw_deployment => "`Deployment`",
    chain_point => "a component, or an operation such as `lidar.LaserPub.scan`",
    chain_field => "a field of a chain",
    world_field => "a field of a world",
    slot_path => "a slot such as `simulator.Laser`",
    time | duration => "a duration such as `5s`",
    field | process_field => "a field",
    settings | bind_block | convert_block | peer => "`{`",
    frames => "`frames SLOT;`",
    setting => "a setting such as `lease 500ms;`",
    parameter => "a parameter such as `speed 300;`",
    members => "members such as `lasers \"front\", \"back\";`",
    parameter_path => "the path of a parameter such as `motors[2].max`",
    list | open_square => "`[`",
    close_square => "`]`",
    kw_at => "`at`",
    condition => "a condition",
    operand => "a value",
    operator => "an operator",
    close_bracket => "`)`",
    path => "a parameter such as `filter.gain`",
    literal => "a value",
    decl => "a declaration",
    arrow => "`->`",
    dot => "`.`",
    kw_within => "`within`",
    kw_simulated => "`simulated by NAME`",
    kw_by => "`by`",
    kw_system => "`system`",
    variable => "`NAME \"value\";`",
});
