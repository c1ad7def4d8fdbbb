//! The clause `world`: what a component writes and reads of a shared graph.

use crate::ast;
use crate::model::{Access, Role, Slot, World, Write};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_idsl::Library;
use rc_idsl::model::{InterfaceId, ModuleId};
use rc_syntax::Name;
use rc_vocabulary::qos::{Policies, Policy};
use rc_vocabulary::{WORLD_MODULE, WORLD_SLOTS};
use std::collections::HashMap;
use std::time::Duration;

/// Resolves the access of a component to its world. It does not know yet whether the schema has the
/// types.
pub(super) fn world(tree: &ast::World, found: &mut Diagnostics) -> World {
    let access = tree.access.as_ref();
    World {
        schema: tree.schema.clone(),
        span: tree.span,
        name: tree.name.clone(),
        access: access.map(|all| Clause { found }.access(all)),
    }
}

/// The option for a world with the types of DSR.
pub(super) const DSR: &str = "dsr";

/// Whether the option [`DSR`] has an effect: workers in other languages have no world.
pub(super) fn can_share_dsr(tree: &ast::Component) -> bool {
    tree.clauses.iter().any(|(_, clause)| match clause {
        ast::Clause::Language(name) => {
            let mut languages = ["rust", "python"].iter();
            languages.any(|own| name.text.eq_ignore_ascii_case(own))
        }
        _ => false,
    })
}

/// Writes `options dsr;` as `world "dsr.gdsl" as g;`, which reads and writes everything.
pub(super) fn share_dsr(tree: &mut ast::Component) {
    let options = tree.clauses.iter().filter_map(|(_, clause)| match clause {
        ast::Clause::Options(names) => Some(names),
        _ => None,
    });
    let mut names = options.flatten();
    let option = names.find(|name| name.text.eq_ignore_ascii_case(DSR));
    let Some(span) = option.map(|name| name.span) else {
        return;
    };
    if can_share_dsr(tree) {
        let world = ast::World {
            schema: Some(Name::new("dsr.gdsl", span)),
            span,
            name: Name::new("g", span),
            access: None,
        };
        let word = Name::new("world", span);
        tree.clauses.push((word, ast::Clause::World(world)));
    }
}

/// The file with the interfaces by which replicas meet.
pub(super) const FILE: &str = "World.idsl";

/// A finding about another file with the name of [`FILE`], which is found before it.
pub(super) fn other(tree: &ast::World, library: &Library, module: ModuleId) -> Option<Diagnostic> {
    let module = library.module(module);
    let is_other = module.name.text != WORLD_MODULE;
    is_other.then(|| {
        let message = format!(
            "a world needs the `{FILE}` that comes with the tools, and another file has this name"
        );
        Diagnostic::error("unknown-interface", tree.span, message)
            .label(module.name.span, "its module")
            .help("rename that file")
    })
}

/// The slots by which the replicas of a world meet. `own` are those of the component.
pub(super) fn slots(
    world: &World,
    own: &[Slot],
    library: &Library,
    found: &mut Diagnostics,
) -> Vec<Slot> {
    let module = library.modules.iter();
    let module = module.filter(|module| module.name.text == WORLD_MODULE);
    let ids: Vec<InterfaceId> = module.flat_map(|m| m.interfaces.iter().copied()).collect();
    let interface = |name: &str| {
        let mut ids = ids.iter();
        ids.find(|id| library.interface(**id).name.text == name)
    };
    let mut all = Vec::new();
    for of in WORLD_SLOTS {
        // A missing file has been reported already.
        let Some(interface) = interface(of.interface) else {
            continue;
        };
        let slot = format!("{}{}", world.name.text, of.suffix);
        if let Some(taken) = own.iter().find(|own| own.name.eq_ignore_ascii_case(&slot)) {
            let message = format!("the world has the slot `{slot}`, which is there already");
            let error = Diagnostic::error("duplicate-slot", world.name.span, message);
            let error = error.label(taken.span, "the other one");
            found.push(error.help("write another name after `as`"));
        }
        let mut qos = Policies::default();
        qos.extend([
            Policy::Reliability(of.qos.reliability),
            Policy::Depth(of.qos.depth),
        ]);
        all.push(Slot {
            name: slot,
            role: of.role,
            interface: *interface,
            is_array: false,
            backend: None,
            optional: of.role == Role::SubscribesTo,
            qos,
            in_place: false,
            asynchronous: false,
            available: Vec::new(),
            // The worker of a world of any schema has the slots itself.
            of_world: world.schema.is_some(),
            span: world.span,
            interface_span: world.span,
            name_span: Some(world.name.span),
        });
    }
    all
}

/// Reports slots by which replicas meet, of a component without the clause, unless its language has none.
pub(super) fn undeclared(
    slots: &[Slot],
    library: &Library,
    language: Option<&Name>,
    found: &mut Diagnostics,
) {
    let schema = match language.map_or("rust", |name| &name.text) {
        "rust" => "any",
        "python" => "\"FILE.gdsl\"",
        _ => return,
    };
    let of = WORLD_SLOTS[0];
    let slot = slots.iter().find(|slot| {
        slot.role == of.role && library.interface_path(slot.interface) == of.type_name
    });
    if let Some(slot) = slot {
        let message = format!(
            "`{}` is a slot of a world, and the component has no clause `world`",
            slot.name
        );
        let warning = Diagnostic::warning("undeclared-world", slot.span, message);
        found.push(warning.help(format!(
            "write `world {schema} as g;` in place of the slots of `World.idsl`"
        )));
    }
}

struct Clause<'a> {
    found: &'a mut Diagnostics,
}

impl Clause<'_> {
    fn access(&mut self, tree: &[(Name, Vec<ast::Access>)]) -> Access {
        let mut out = Access::default();
        let mut seen = HashMap::new();
        for (word, items) in tree {
            let writes = word.text.eq_ignore_ascii_case("writes");
            for item in items {
                if !self.is_first(word, item, &mut seen) {
                    continue;
                }
                if writes {
                    let write = self.write(item);
                    out.writes.push(write);
                } else {
                    self.read(item);
                    out.reads.push(item.kind.clone());
                }
            }
        }
        out
    }

    /// Reports duplicates among what a component writes or reads.
    fn is_first(
        &mut self,
        word: &Name,
        item: &ast::Access,
        seen: &mut HashMap<(String, String, String), Span>,
    ) -> bool {
        let attribute = item.attribute.as_ref().map_or("", |name| &name.text);
        let key = (
            word.text.to_lowercase(),
            item.kind.text.clone(),
            attribute.to_owned(),
        );
        let last = item.attribute.as_ref().unwrap_or(&item.kind);
        let span = item.kind.span.to(last.span);
        let Some(first) = seen.insert(key, span) else {
            return true;
        };
        let message = format!("`{}` names this twice", word.text);
        let error = Diagnostic::error("repeated-clause", span, message);
        self.found.push(error.label(first, "first named here"));
        false
    }

    fn write(&mut self, item: &ast::Access) -> Write {
        let repeated = item.stream.iter().map(|(word, _)| word).skip(1);
        let repeated: Vec<&Name> = repeated.chain(item.shared.iter().skip(1)).collect();
        for word in repeated {
            let message = format!("`{}` occurs twice", word.text);
            let error = Diagnostic::error("repeated-clause", word.span, message);
            self.found.push(error);
        }
        let stream = item.stream.first();
        if let (Some((word, _)), None) = (stream, &item.attribute) {
            let message = format!(
                "`{}` is a type, but attributes are streamed",
                item.kind.text
            );
            let help = format!("name the attribute: `{}.ATTRIBUTE stream`", item.kind.text);
            let error = Diagnostic::error("bad-world-access", word.span, message);
            self.found.push(error.help(help));
        }
        let least = stream.map(|(_, time)| match time {
            None => Duration::ZERO,
            Some(time) => {
                let least = time.as_nanoseconds().map(Duration::from_nanos);
                if least.is_none() {
                    let message = "expected the least time between two values, such as `20ms`";
                    let error = Diagnostic::error("bad-world-access", time.span, message);
                    self.found.push(error);
                }
                least.unwrap_or_default()
            }
        });
        Write {
            kind: item.kind.clone(),
            attribute: item.attribute.clone(),
            stream: least,
            shared: !item.shared.is_empty(),
        }
    }

    /// Reports what only writers say.
    fn read(&mut self, item: &ast::Access) {
        let mut wrong = |span: Span, message: String, help: &str| {
            let error = Diagnostic::error("bad-world-access", span, message);
            self.found.push(error.help(help));
        };
        if let Some(attribute) = &item.attribute {
            let message = format!("`{}` is an attribute, but types are read", attribute.text);
            let help = format!("write `reads {};`", item.kind.text);
            wrong(attribute.span, message, &help);
        }
        let streams = item.stream.iter().map(|(word, _)| word);
        for word in streams.chain(&item.shared) {
            let message = format!("`{}` belongs to what a component writes", word.text);
            wrong(word.span, message, "remove the word");
        }
    }
}
