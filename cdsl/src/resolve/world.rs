//! The clause `world`: what a component writes and reads of a shared graph.

use crate::ast;
use crate::model::{Access, World, Write};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::Name;
use std::collections::HashMap;
use std::time::Duration;

/// What a component does with its world. Whether its schema has the types is not known here.
pub(super) fn world(tree: &ast::World, found: &mut Diagnostics) -> World {
    let access = tree.access.as_ref();
    World {
        schema: tree.schema.clone(),
        name: tree.name.clone(),
        access: access.map(|all| Clause { found }.access(all)),
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

    /// Reports what a component writes or reads twice.
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
            let message = format!("`{}` stands twice", word.text);
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
