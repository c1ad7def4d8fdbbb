//! Suggestions in networks.

use super::languages::{middlewares, settings_of};
use super::{
    Completion, FUNCTION, INSIDE, Item, Kind, PROPERTY, Path, PathBuf, STATEMENTS, Target,
    VARIABLE, items_of, key, keywords, of, words,
};
use crate::server::context::Context;
use rc_cdsl::model::Role;
use rc_vocabulary::{Middleware, RestartPolicy};
use std::collections::BTreeSet;

impl Completion<'_> {
    pub(super) fn in_network(&self, target: &Target<'_>, context: &Context<'_>) -> Vec<Item> {
        let around = context.around();
        let (word, last) = (context.word(), context.last());
        if let Some(string) = context.string {
            return match word.as_str() {
                "import" => self.importable(target, string, "ddsl"),
                "cdsl" => self.paths(target, string, &["cdsl"]),
                "schema" => self.paths(target, string, &["gdsl"]),
                "start" | "keep" => self.paths(target, string, &["graph", "json"]),
                "config" => self.paths(target, string, &["toml"]),
                _ => Vec::new(),
            };
        }
        let Some(block) = around.last() else {
            return if last.is_empty() {
                of(keywords::of(&STATEMENTS, "ddsl", ""))
            } else {
                Vec::new()
            };
        };
        let groups = context.groups();
        let prefix: String = groups.iter().map(|group| format!("{group}.")).collect();
        match (block.as_str(), word.as_str()) {
            ("parameters", "") => self.parameters_of(&component_at(target, context, &prefix)),
            ("slots", "") => {
                let arrays = self.slots_of(&component_at(target, context, &prefix), true);
                arrays
                    .into_iter()
                    .chain(of(keywords::of(&STATEMENTS, "ddsl", "slots")))
                    .collect()
            }
            ("middleware", "") => {
                let head = context.blocks.last().and_then(|block| block.head.get(1));
                let middleware = head.and_then(|word| Middleware::from_file(word));
                middleware.map_or_else(Vec::new, settings_of)
            }
            ("group", "") => {
                let mut items = of(keywords::of(&STATEMENTS, "ddsl", "group"));
                items.extend(of(keywords::of(&STATEMENTS, "ddsl", "export")));
                items
            }
            (block, "") => of(keywords::of(&STATEMENTS, "ddsl", block)),
            (_, "middleware") => match last {
                "auto" => of(keywords::of(&INSIDE, "ddsl", "middleware")),
                "remote" => words(["dds", "ros2"], "The middleware between hosts."),
                _ => {
                    let mut items = middlewares();
                    items.extend(words(["auto"], "The fastest one that reaches both ends."));
                    items
                }
            },
            (_, "proxy") if context.statement.len() == 1 => middlewares(),
            (_, "host") if context.statement.len() == 1 => {
                let hosts = items_of(target.names, Kind::Host, VARIABLE).into_iter();
                let hosts = hosts.map(|item| Item {
                    label: item.label.split('#').next().unwrap_or_default().to_owned(),
                    ..item
                });
                hosts.chain(words(["localhost"], "This machine.")).collect()
            }
            (_, "process") if context.statement.len() == 1 => {
                items_of(target.names, Kind::Process, VARIABLE)
            }
            (_, "restart") if context.statement.len() == 1 => words(
                RestartPolicy::ALL.map(RestartPolicy::word),
                "When the component restarts.",
            ),
            (_, "restart" | "time") if last != "by" => of(keywords::of(&INSIDE, "ddsl", &word)),
            (_, "after" | "time") => members(target, &prefix),
            (_, "require") if last == "." => ruled(self, target, context, &prefix),
            (_, "require") => {
                let mut items = members(target, &prefix);
                items.extend(of(keywords::of(&INSIDE, "ddsl", &word)));
                items
            }
            (_, "convert") if last == "via" => words(["process"], "A process of its own converts."),
            (_, "convert") if context.statement.len() == 1 => {
                of(keywords::of(&INSIDE, "ddsl", &word))
            }
            (_, "export") => {
                let inside = target
                    .names
                    .instances
                    .iter()
                    .filter(|(path, _)| path.starts_with(&prefix));
                inside
                    .flat_map(|(_, cdsl)| self.slots_of(cdsl, false))
                    .collect()
            }
            (_, "bind" | "external") => bound(self, target, context, &prefix),
            ("convert", "frames") if context.statement.len() == 1 => {
                frames(self, target, context, &prefix)
            }
            _ => Vec::new(),
        }
    }
    /// The slots of a component, each with its role and its interface; only arrays on demand.
    pub(super) fn slots_of(&self, cdsl: &Path, arrays: bool) -> Vec<Item> {
        let slots = self
            .files
            .readable(cdsl)
            .map_or(&[][..], |names| &names.slots);
        let slots = slots.iter().filter(|slot| !slot.of_world);
        let slots = slots.filter(|slot| slot.is_array || !arrays);
        slots
            .map(|slot| {
                let detail = format!("{} {}", slot.role.word(), slot.interface);
                Item {
                    detail,
                    ..Item::new(FUNCTION, slot.name.as_str(), "")
                }
            })
            .collect()
    }

    /// The shared world of a component, by its name: that of the first of its topics.
    fn world_of(&self, cdsl: &Path) -> Option<Item> {
        let mut slots = self.files.readable(cdsl)?.slots.iter();
        let world = slots.find(|slot| slot.of_world)?;
        Some(Item {
            detail: "world".to_owned(),
            ..Item::new(FUNCTION, world.name.as_str(), "")
        })
    }

    /// The parameters of a component by their paths.
    pub(super) fn parameters_of(&self, cdsl: &Path) -> Vec<Item> {
        let files = self
            .files
            .readable(cdsl)
            .map_or(&[][..], |names| &names.parameters);
        let files = files.iter().filter_map(|file| self.files.readable(file));
        files
            .flat_map(|names| items_of(names, Kind::Parameter, PROPERTY))
            .collect()
    }
}

/// The components and groups that are visible in a block.
fn members(target: &Target<'_>, prefix: &str) -> Vec<Item> {
    let ends = prefix.match_indices('.').map(|(at, _)| at + 1);
    let scopes: Vec<&str> = std::iter::once(0)
        .chain(ends)
        .map(|end| &prefix[..end])
        .collect();
    let places = target.names.instances.iter();
    let mut items = Vec::new();
    for (path, cdsl) in places {
        for scope in &scopes {
            let Some(rest) = path.strip_prefix(scope) else {
                continue;
            };
            let (label, detail) = match rest.split_once('.') {
                Some((group, _)) => (group, "a group".to_owned()),
                None => (
                    rest,
                    cdsl.file_name()
                        .unwrap_or_default()
                        .to_string_lossy()
                        .into_owned(),
                ),
            };
            items.push(Item {
                detail,
                ..Item::new(VARIABLE, label, "")
            });
        }
    }
    items
}

/// Names after the last `.` of a rule: the content of a group, or the parameters of a
/// component.
fn ruled(
    completion: &Completion<'_>,
    target: &Target<'_>,
    context: &Context<'_>,
    prefix: &str,
) -> Vec<Item> {
    let pairs = context.statement.rchunks_exact(2);
    let names = pairs.take_while(|pair| pair[1] == ".").map(|pair| pair[0]);
    let mut names: Vec<&str> = names.collect();
    names.reverse();
    let path = names.join(".");
    for scope in scopes(prefix) {
        let place = format!("{scope}{path}");
        let mut instances = target.names.instances.iter();
        if let Some((_, cdsl)) = instances.find(|(known, _)| *known == place) {
            let mut items = completion.parameters_of(cdsl);
            items.extend(words(["period"], "The period of `compute`."));
            return items;
        }
        let place = place + ".";
        let inside = target.names.instances.iter();
        let inside = inside.filter_map(|(known, _)| known.strip_prefix(&place));
        let names: BTreeSet<&str> = inside.filter_map(|rest| rest.split('.').next()).collect();
        if !names.is_empty() {
            return words(names, "A component or a group in it.");
        }
    }
    Vec::new()
}

/// The end of a path in `bind` or `external`.
fn bound(
    completion: &Completion<'_>,
    target: &Target<'_>,
    context: &Context<'_>,
    prefix: &str,
) -> Vec<Item> {
    let tokens = &context.statement;
    let begins = tokens
        .iter()
        .rposition(|token| matches!(*token, "->" | "," | "bind" | "external"));
    let path: String = tokens[begins.map_or(0, |at| at + 1)..].concat();
    let is_provider = tokens.contains(&"->");
    // Values are also converted for programs outside that take them.
    let is_any = tokens.contains(&"external");
    if path.is_empty() {
        return members(target, prefix);
    }
    if !path.ends_with('.') {
        let words = keywords::of(&INSIDE, "ddsl", &context.word());
        return of(words);
    }
    for scope in scopes(prefix) {
        let place = format!("{scope}{path}");
        let place = place.trim_end_matches('.');
        if let Some((_, cdsl)) = target
            .names
            .instances
            .iter()
            .find(|(known, _)| known == place)
        {
            let slots = completion.slots_of(cdsl, false).into_iter();
            let fits = |item: &Item| {
                let role = item.detail.split(' ').next().and_then(Role::from_file);
                is_any || role.is_none_or(|role| role.is_provided() == is_provider)
            };
            return slots.filter(fits).collect();
        }
        // A member of an array.
        if let Some((instance, array)) = place.rsplit_once('.')
            && target
                .names
                .instances
                .iter()
                .any(|(known, _)| known == instance)
        {
            let within = format!("{instance}.{array}.");
            let all = items_of(target.names, Kind::ArrayMember, VARIABLE).into_iter();
            return all
                .filter_map(|item| {
                    let label = item.label.strip_prefix(&within)?.to_owned();
                    Some(Item { label, ..item })
                })
                .collect();
        }
        let inside = format!("{place}.");
        let within: Vec<_> = target
            .names
            .instances
            .iter()
            .filter(|(known, _)| known.starts_with(&inside))
            .collect();
        if !within.is_empty() {
            // In a group, only exported slots.
            let group = target.names.groups.get(place);
            let slots = within
                .iter()
                .flat_map(|(_, cdsl)| completion.slots_of(cdsl, false));
            return slots
                .filter(|item| group.is_some_and(|group| group.exports.contains(&item.label)))
                .collect();
        }
    }
    Vec::new()
}

/// The slots of the consumer of the connection around the cursor that take something, and its world.
fn frames(
    completion: &Completion<'_>,
    target: &Target<'_>,
    context: &Context<'_>,
    prefix: &str,
) -> Vec<Item> {
    let mut blocks = context.blocks.iter().rev();
    let head = blocks.find(|block| block.word() == "bind");
    let head = head.map_or(&[][..], |block| &block.head);
    let consumer = head.iter().skip(1).take_while(|token| **token != "->");
    let consumer: String = consumer.copied().collect();
    let Some((place, slot)) = consumer.rsplit_once('.') else {
        return Vec::new();
    };
    let places = scopes(prefix)
        .into_iter()
        .map(|scope| format!("{scope}{place}"));
    for place in places {
        let inside = format!("{place}.");
        let instances = target.names.instances.iter();
        let instances: Vec<_> = instances
            .filter(|(known, _)| *known == place || known.starts_with(&inside))
            .collect();
        let is_single = instances.len() == 1;
        let mut items = Vec::new();
        for (_, cdsl) in &instances {
            let slots = completion.slots_of(cdsl, false);
            if !is_single && !slots.iter().any(|item| item.label == slot) {
                continue;
            }
            items.extend(slots.into_iter().filter(|item| {
                let role = item.detail.split(' ').next().and_then(Role::from_file);
                role.is_some_and(|role| !role.is_provided())
            }));
            items.extend(completion.world_of(cdsl));
        }
        if !instances.is_empty() {
            items.dedup_by(|one, other| one.label == other.label);
            return items;
        }
    }
    Vec::new()
}

/// The blocks whose names a block sees, as prefixes of paths: the innermost first, as the resolver
/// looks for them.
fn scopes(prefix: &str) -> Vec<&str> {
    let ends = prefix.match_indices('.').map(|(at, _)| at + 1);
    let mut scopes: Vec<&str> = std::iter::once(0)
        .chain(ends)
        .map(|end| &prefix[..end])
        .collect();
    scopes.reverse();
    scopes
}

/// The component of the block around the cursor: by its place in the network, or by the `cdsl`
/// before it in a block that could not be read.
fn component_at(target: &Target<'_>, context: &Context<'_>, prefix: &str) -> PathBuf {
    let block = context
        .blocks
        .iter()
        .rev()
        .find(|block| block.word() == "component");
    let Some(block) = block else {
        return PathBuf::new();
    };
    let path = format!("{prefix}{}", block.head.get(1).copied().unwrap_or_default());
    if let Some((_, cdsl)) = target
        .names
        .instances
        .iter()
        .find(|(known, _)| *known == path)
    {
        return cdsl.clone();
    }
    let written = block
        .inside
        .windows(2)
        .find(|pair| pair[0].eq_ignore_ascii_case("cdsl"));
    let written = written.map_or("", |pair| pair[1].trim_matches('"'));
    let folder = target.path.parent().unwrap_or(Path::new(""));
    key(&folder.join(written))
}
