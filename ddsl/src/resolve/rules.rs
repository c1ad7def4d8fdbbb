//! Rules between parameters: the components that they name.

use super::Resolver;
use crate::model::{InstanceOrGroup, Require};
use rc_pdsl::ast::Path;

impl Resolver<'_> {
    /// Resolves the groups and components of rules. Their parameters are resolved later, by the
    /// loader of the components.
    pub(super) fn resolve_rules(&mut self) {
        for (group, tree) in std::mem::take(&mut self.rules) {
            let mut paths = Vec::new();
            tree.condition.paths(&mut paths);
            let mut resolved = true;
            for path in paths {
                resolved &= self.component_of(path, group).is_some();
            }
            if resolved {
                let around = self.deployment.enclosing(group);
                let names = around.map(|group| self.deployment.groups[group].name.text.clone());
                let mut scope: Vec<String> = names.collect();
                scope.reverse();
                self.deployment.rules.push(Require {
                    scope,
                    rule: tree.clone(),
                });
            }
        }
    }

    /// Resolves the groups and the component at the beginning of `path`. `None` after an error.
    fn component_of(&mut self, path: &Path, group: Option<usize>) -> Option<()> {
        // One name is a choice of the parameter that it is compared with.
        let [first, rest @ ..] = path.names.as_slice() else {
            return Some(());
        };
        if rest.is_empty() {
            return Some(());
        }
        let mut place = self.first(first, group)?;
        let mut last = first;
        for name in rest {
            if matches!(place, InstanceOrGroup::Instance(_)) {
                break;
            }
            place = self.inside(place, last, name)?;
            last = name;
        }
        Some(())
    }
}
