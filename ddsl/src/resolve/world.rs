//! The world of a network.

use super::{BlockContext, Resolver};
use crate::ast;
use crate::duplicates::{check_unique, report_duplicate};
use crate::fields::duration;
use crate::model::World;
use rc_diagnostics::Diagnostic;

impl Resolver<'_> {
    pub(super) fn world(&mut self, tree: &ast::World, context: &BlockContext<'_>) {
        if let Some(group) = context.group {
            let message = "a world belongs to the whole network, not to a group";
            let error = Diagnostic::error("misplaced-world", tree.name.span, message)
                .label(self.deployment.groups[group].name.span, "the group")
                .help("move it into the block of the deployment");
            return self.found.push(error);
        }
        if let Some(first) = &self.deployment.world {
            return report_duplicate(&tree.name, "world", first.name.span, &mut self.found);
        }
        self.length("world", &tree.name.text, tree.name.span);
        let words = tree.fields.iter().map(|(word, _)| word);
        check_unique(words, "field", &mut self.found);
        let mut world = World {
            name: tree.name.clone(),
            doc: tree.doc.clone(),
            folder: context.folder.to_path_buf(),
            schema: None,
            start: None,
            keep: None,
        };
        // The first field of a name counts.
        for (word, field) in tree.fields.iter().rev() {
            let file = field.file.clone();
            match (word.text.to_lowercase().as_str(), &field.time) {
                ("schema", _) => world.schema = Some(file),
                ("start", _) => world.start = Some(file),
                (_, Some(time)) => {
                    let time = duration(time, word, &mut self.found);
                    world.keep = time.map(|time| (file, time));
                }
                (_, None) => {}
            }
        }
        if world.schema.is_none() && !tree.incomplete {
            let message = format!("world `{}` has no field `schema`", tree.name.text);
            let error = Diagnostic::error("missing-clause", tree.name.span, message);
            self.found.push(error.help("add `schema \"FILE.gdsl\";`"));
        }
        self.deployment.world = Some(world);
    }
}
