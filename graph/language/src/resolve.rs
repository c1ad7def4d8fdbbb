//! Resolves the syntax tree into a schema.

use crate::ast::{self, Item, Type};
use crate::blocks::Blocks;
use crate::imports::{self, Imports};
use crate::members::{self, TYPES};
use graph_schema::{COMPOSED_BY, Entity, Kind, Placed, PoseOf, Relation, Schema, Tree};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Loader, Name};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Loads the schema that the file `from` names as `wanted`: in its folder, where the loader looks,
/// or a domain that comes with this crate. `None` if it has errors.
pub fn import(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    from: &Path,
    wanted: &Name,
) -> (Option<Schema>, Diagnostics) {
    let file = match imports::find(loader, from, wanted) {
        Ok(file) => file,
        Err(missing) => {
            let mut found = Diagnostics::new();
            found.push(missing);
            return (None, found);
        }
    };
    let source = sources.add(file.path, file.text);
    let (schema, found) = load(sources, loader, source);
    (schema.filter(|_| !found.has_errors()), found)
}

/// Loads one `.gdsl` text with its imports. `None` if nothing is readable. Use the schema only if
/// no diagnostic is an error.
pub fn load(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> (Option<Schema>, Diagnostics) {
    let mut imports = Imports::new(sources, loader);
    imports.file(source);
    let library = imports.library();
    let (domains, found) = (imports.domains, imports.found);
    let Some(own) = domains.last() else {
        return (None, found);
    };
    let schema = Schema {
        name: own.name.text.clone(),
        open: own.open,
        ..Schema::default()
    };
    let mut resolver = Resolver {
        schema,
        found,
        blocks: Blocks::new(library.as_ref()),
        declared: HashMap::new(),
        entities: HashMap::new(),
        relations: HashMap::new(),
    };
    for domain in &domains {
        resolver.declare(domain);
    }
    for domain in &domains {
        resolver.inherit(domain);
    }
    for domain in &domains {
        resolver.relations(domain);
    }
    for domain in &domains {
        resolver.consistent(domain);
    }
    resolver.convert(&domains);
    for domain in &domains {
        resolver.parts(domain);
        resolver.rules_and_queries(domain);
    }
    resolver.units_of_poses(&domains);
    (Some(resolver.schema), resolver.found)
}

pub(crate) struct Resolver<'l> {
    pub(crate) schema: Schema,
    pub(crate) found: Diagnostics,
    pub(crate) blocks: Blocks<'l>,
    /// Types, relations and queries by name.
    declared: HashMap<String, Span>,
    /// The places of entities in the schema: a file may have thousands.
    entities: HashMap<String, usize>,
    relations: HashMap<String, usize>,
}

impl Resolver<'_> {
    pub(crate) fn entity(&self, name: &str) -> Option<&Entity> {
        let at = self.entities.get(name)?;
        self.schema.entities.get(*at)
    }

    pub(crate) fn entity_mut(&mut self, name: &str) -> Option<&mut Entity> {
        let at = self.entities.get(name)?;
        self.schema.entities.get_mut(*at)
    }

    pub(crate) fn relation(&self, name: &str) -> Option<&Relation> {
        let at = self.relations.get(name)?;
        self.schema.relations.get(*at)
    }

    pub(crate) fn relation_mut(&mut self, name: &str) -> Option<&mut Relation> {
        let at = self.relations.get(name)?;
        self.schema.relations.get_mut(*at)
    }

    /// Whether an entity is `wanted`, or inherits from it.
    fn is_a(&self, name: &str, wanted: &str) -> bool {
        let parent = |name: &&str| self.entity(name)?.parent.as_deref();
        let ancestry = std::iter::successors(Some(name), parent);
        // A circle has a finding of its own.
        let mut ancestry = ancestry.take(graph_schema::DEEPEST + 2);
        ancestry.any(|name| name == wanted)
    }

    pub(crate) fn error(&mut self, code: &'static str, span: Span, message: String) {
        self.found.push(Diagnostic::error(code, span, message));
    }

    /// Whether a name is new.
    pub(crate) fn is_new(&mut self, name: &Name) -> bool {
        if let Some(first) = self.declared.get(&name.text) {
            let message = format!("`{}` is declared twice", name.text);
            let diagnostic = Diagnostic::error("duplicate-name", name.span, message);
            self.found
                .push(diagnostic.label(*first, "first declared here"));
            return false;
        }
        if members::is_reserved(&name.text) {
            let message = format!("`{}` is the name of a built-in type", name.text);
            self.error("reserved-name", name.span, message);
            return false;
        }
        self.declared.insert(name.text.clone(), name.span);
        true
    }

    fn check_members(&mut self, members: &[ast::Member]) {
        let mut seen: HashMap<&str, Span> = HashMap::new();
        for member in members {
            let first = *seen.entry(&member.name.text).or_insert(member.name.span);
            if first != member.name.span {
                let message = format!("`{}` is declared twice", member.name.text);
                let diagnostic = Diagnostic::error("duplicate-member", member.name.span, message);
                self.found
                    .push(diagnostic.label(first, "first declared here"));
            }
        }
    }

    /// Declares entities with their own attributes.
    fn declare(&mut self, domain: &ast::Domain) {
        for item in &domain.items {
            let Item::Entity(entity) = item else { continue };
            if !self.is_new(&entity.name) {
                continue;
            }
            self.check_members(&entity.members);
            let mut attributes = Vec::new();
            for member in &entity.members {
                match members::kind(member, &self.blocks, &mut self.found) {
                    Some(kind) => {
                        attributes.push(members::attribute(member, kind, &mut self.found));
                    }
                    None => self.unknown_type(member),
                }
            }
            let place = self.schema.entities.len();
            self.entities.insert(entity.name.text.clone(), place);
            self.schema.entities.push(Entity {
                name: entity.name.text.clone(),
                domain: domain.name.text.clone(),
                parent: None,
                attributes,
                parts: Vec::new(),
                doc: entity.doc.clone(),
            });
        }
    }

    fn unknown_type(&mut self, member: &ast::Member) {
        if let Type::Named(name, _) = &member.kind {
            let message = format!("unknown type `{}`", name.text);
            let diagnostic = Diagnostic::error("unknown-type", name.span, message);
            self.found.push(diagnostic.suggest(&name.text, TYPES));
        }
    }

    pub(crate) fn unknown_entity(&mut self, name: &Name) {
        let message = format!("unknown entity `{}`", name.text);
        let known = self
            .schema
            .entities
            .iter()
            .map(|entity| entity.name.as_str());
        let diagnostic = Diagnostic::error("unknown-entity", name.span, message);
        self.found.push(diagnostic.suggest(&name.text, known));
    }

    /// Resolves parents, and gives entities the attributes of these.
    fn inherit(&mut self, domain: &ast::Domain) {
        for item in &domain.items {
            let Item::Entity(entity) = item else { continue };
            let Some(parent) = &entity.parent else {
                continue;
            };
            if self.entity(&parent.text).is_none() {
                self.unknown_entity(parent);
                continue;
            }
            if self.is_a(&parent.text, &entity.name.text) {
                let message = format!("`{}` inherits from itself", entity.name.text);
                self.error("circular-entities", parent.span, message);
                continue;
            }
            if let Some(own) = self.entity_mut(&entity.name.text) {
                own.parent = Some(parent.text.clone());
            }
        }
        for item in &domain.items {
            let Item::Entity(entity) = item else { continue };
            self.collect(entity);
        }
    }

    /// Puts the attributes of all ancestors before those of an entity.
    fn collect(&mut self, entity: &ast::Entity) {
        let mut chain = Vec::new();
        let mut here = self.entity(&entity.name.text);
        while let Some(ancestor) = here.and_then(|e| e.parent.as_deref()) {
            if chain.len() >= graph_schema::DEEPEST {
                // A circle has a finding of its own.
                let message = format!(
                    "`{}` has more than {} ancestors",
                    entity.name.text,
                    graph_schema::DEEPEST
                );
                self.error("nested-too-deep", entity.name.span, message);
                return;
            }
            here = self.entity(ancestor);
            chain.extend(here);
        }
        let mut inherited: Vec<graph_schema::Attribute> = Vec::new();
        let mut known: HashSet<String> = HashSet::new();
        for ancestor in chain.iter().rev() {
            for attribute in &ancestor.attributes {
                if known.insert(attribute.name.clone()) {
                    inherited.push(attribute.clone());
                }
            }
        }
        let mut hidden = Vec::new();
        for member in &entity.members {
            if known.contains(&member.name.text) {
                hidden.push(member.name.clone());
            }
        }
        for name in hidden {
            let message = format!(
                "`{}` inherits an attribute `{}`",
                entity.name.text, name.text
            );
            self.error("duplicate-member", name.span, message);
        }
        if let Some(own) = self.entity_mut(&entity.name.text) {
            let kept = own.attributes.iter();
            let kept = kept.filter(|own| !known.contains(&own.name));
            inherited.extend(kept.cloned());
            own.attributes = inherited;
        }
    }

    fn relations(&mut self, domain: &ast::Domain) {
        for item in &domain.items {
            let Item::Relation(relation) = item else {
                continue;
            };
            if !self.is_new(&relation.name) {
                continue;
            }
            self.check_members(&relation.members);
            let mut made = Relation {
                name: relation.name.text.clone(),
                domain: domain.name.text.clone(),
                doc: relation.doc.clone(),
                ..Relation::default()
            };
            for member in &relation.members {
                if let Some(kind) = members::kind(member, &self.blocks, &mut self.found) {
                    let attribute = members::attribute(member, kind, &mut self.found);
                    made.attributes.push(attribute);
                    members::check_key_of_relation(member, &mut self.found);
                } else if let Type::Named(name, _) = &member.kind {
                    if self.entity(&name.text).is_none() {
                        self.unknown_entity(name);
                    }
                    let port = members::port(member, &name.text, &mut self.found);
                    made.ports.push(port);
                }
            }
            if made.ports.len() != 2 {
                let message = format!(
                    "expected two ports in `{}`, found {}",
                    relation.name.text,
                    made.ports.len()
                );
                let help = "make an entity of it, with a relation for each port";
                let diagnostic = Diagnostic::error("wrong-ports", relation.name.span, message);
                self.found.push(match made.ports.len() {
                    3.. => diagnostic.help(help),
                    _ => diagnostic.help("write `PORT ENTITY;` for each end"),
                });
            }
            if relation.trees.is_empty() {
                made.pose = placed(&made, &relation.members);
            }
            made.tree = relation.trees.first().map(|tree| self.tree(&made, tree));
            self.promotes(&mut made, relation);
            if let [first, others @ ..] = relation.trees.as_slice() {
                for other in others {
                    let message = format!("`{}` is a tree already", relation.name.text);
                    let diagnostic = Diagnostic::error("second-tree", other.span, message);
                    let diagnostic = diagnostic.label(first.span, "first given here");
                    self.found
                        .push(diagnostic.help("remove one, or declare a second relation"));
                }
            }
            let place = self.schema.relations.len();
            self.relations.insert(made.name.clone(), place);
            self.schema.relations.push(made);
        }
    }

    /// The parts that compose the entities. The relation `composed_by` leads to them.
    fn parts(&mut self, domain: &ast::Domain) {
        for item in &domain.items {
            let Item::Entity(entity) = item else { continue };
            for part in &entity.parts {
                self.part(&entity.name, part);
            }
        }
    }

    fn part(&mut self, whole: &Name, part: &Name) {
        if self.entity(&part.text).is_none() {
            self.unknown_entity(part);
            return;
        }
        let Some(relation) = self.schema.relation(COMPOSED_BY) else {
            let message = format!("there is no relation `{COMPOSED_BY}` from a whole to a part");
            let diagnostic = Diagnostic::error("unknown-relation", part.span, message);
            let help = "import \"geometry.gdsl\", or declare it with a port for each of them";
            self.found.push(diagnostic.help(help));
            return;
        };
        let ends = [whole, part];
        let wrong = relation.ports.iter().zip(ends);
        let mut wrong = wrong.filter(|(port, end)| !self.is_a(&end.text, &port.entity));
        if let Some((port, end)) = wrong.next() {
            let message = format!(
                "port `{}` of `{COMPOSED_BY}` is for {}, found {}",
                port.name, port.entity, end.text
            );
            self.error("wrong-port", part.span, message);
            return;
        }
        if self.has_part(&part.text, &whole.text) {
            let message = format!("`{}` is composed by itself", whole.text);
            self.error("circular-entities", part.span, message);
            return;
        }
        let own = self.schema.entities.iter_mut();
        for own in own.filter(|own| own.name == whole.text) {
            if own.parts.contains(&part.text) {
                let message = format!("`{}` occurs twice", part.text);
                let diagnostic = Diagnostic::error("duplicate-member", part.span, message);
                self.found.push(diagnostic);
            } else {
                own.parts.push(part.text.clone());
            }
        }
    }

    /// Whether `part` is `whole` or one of its ancestors, or is a part of it over others. Parts are
    /// inherited.
    fn has_part(&self, whole: &str, part: &str) -> bool {
        let mut seen = HashSet::new();
        let mut left = vec![whole];
        while let Some(name) = left.pop() {
            if self.is_a(name, part) {
                return true;
            }
            if seen.insert(name) {
                let types = self.schema.ancestry(name);
                let parts = types.filter_map(|name| self.entity(name));
                left.extend(parts.flat_map(|entity| &entity.parts).map(String::as_str));
            }
        }
        false
    }

    /// The entities that edges are to other edges, with the attributes of the entity before their
    /// own ones.
    fn promotes(&mut self, made: &mut Relation, relation: &ast::Relation) {
        let [first, others @ ..] = relation.promotes.as_slice() else {
            return;
        };
        for other in others {
            let message = format!("`{}` has this property already", made.name);
            let diagnostic = Diagnostic::error("repeated-flag", other.span, message);
            self.found
                .push(diagnostic.label(first.span, "first given here"));
        }
        let Some(entity) = self.entity(&first.text).cloned() else {
            self.unknown_entity(first);
            return;
        };
        if let Some(key) = entity.attributes.iter().find(|attribute| attribute.key) {
            let message = format!(
                "`{}` has the key `{}`, and only nodes have keys",
                entity.name, key.name
            );
            let diagnostic = Diagnostic::error("key-of-relation", first.span, message);
            self.found
                .push(diagnostic.help("name an entity without a key"));
            return;
        }
        for member in &relation.members {
            if entity.attribute(&member.name.text).is_some() {
                let name = &member.name.text;
                let message = format!("`{}` inherits an attribute `{name}`", made.name);
                self.error("duplicate-member", member.name.span, message);
            }
        }
        let inherited = entity.attributes.into_iter();
        made.attributes = inherited.chain(made.attributes.drain(..)).collect();
        made.promotes = Some(first.text.clone());
    }

    fn tree(&mut self, relation: &Relation, tree: &ast::Tree) -> Tree {
        let named = |name: &str| relation.ports.iter().position(|port| port.name == name);
        let child = match &tree.of {
            Some(of) => named(&of.text).unwrap_or_else(|| {
                let message = format!("`{}` has no port `{}`", relation.name, of.text);
                let ports = relation.ports.iter().map(|port| port.name.as_str());
                let diagnostic = Diagnostic::error("unknown-port", of.span, message);
                self.found.push(diagnostic.suggest(&of.text, ports));
                0
            }),
            None => child(relation),
        };
        let pose = tree
            .interpolated
            .then(|| self.pose(relation, tree))
            .flatten();
        Tree {
            child: child.min(1),
            pose,
        }
    }

    /// The attributes with the pose.
    fn pose(&mut self, relation: &Relation, tree: &ast::Tree) -> Option<PoseOf> {
        for name in &tree.pose {
            let Some(attribute) = relation.attribute(&name.text) else {
                let message = format!("`{}` has no attribute `{}`", relation.name, name.text);
                let known = relation.attributes.iter().map(|a| a.name.as_str());
                let diagnostic = Diagnostic::error("wrong-tree", name.span, message);
                self.found.push(diagnostic.suggest(&name.text, known));
                return None;
            };
            let length = if tree.pose.len() == 1 { 6 } else { 3 };
            let fits = match &attribute.kind {
                Kind::Floats(Some(n)) => *n == length,
                Kind::Block(block) => length == 6 && block.pose.is_some(),
                _ => false,
            };
            if !fits {
                let found = attribute.kind.text();
                let message = format!("`{}` is {found}, expected float[{length}]", name.text);
                self.error("wrong-tree", name.span, message);
                return None;
            }
        }
        if let [by, angles] = tree.pose.as_slice() {
            return Some(PoseOf::Two(by.text.clone(), angles.text.clone()));
        }
        let is_pose = |kind: &Kind| match kind {
            Kind::Floats(count) => *count == Some(6),
            Kind::Block(block) => block.pose.is_some(),
            _ => false,
        };
        let own = relation.attributes.iter().find(|a| is_pose(&a.kind));
        let named = tree.pose.first().map(|name| name.text.clone());
        let name = named.or_else(|| own.map(|a| a.name.clone()));
        if name.is_none() {
            let message = format!("`{}` has no attribute of type `pose`", relation.name);
            let diagnostic = Diagnostic::error("wrong-tree", tree.span, message);
            let help = "add `pose pose;`, or name two attributes: `interpolated(by, angles)`";
            self.found.push(diagnostic.help(help));
        }
        name.map(PoseOf::One)
    }
}

/// A relation without `tree` whose only attribute of type `pose` says where its child is.
fn placed(relation: &Relation, members: &[ast::Member]) -> Option<Placed> {
    let is_pose = |member: &&ast::Member| match &member.kind {
        Type::Named(name, None) => name.text == "pose",
        Type::Block(_) => {
            let attribute = relation.attribute(&member.name.text);
            let is_own = attribute.filter(|own| own.value_of() == own.name);
            is_own.is_some_and(|own| matches!(&own.kind, Kind::Block(b) if b.pose.is_some()))
        }
        _ => false,
    };
    let mut poses = members.iter().filter(is_pose);
    let (Some(pose), None) = (poses.next(), poses.next()) else {
        return None;
    };
    Some(Placed {
        child: child(relation),
        pose: PoseOf::One(pose.name.text.clone()),
    })
}

/// The port of the children, if nothing else is said.
fn child(relation: &Relation) -> usize {
    let mut ports = relation.ports.iter();
    ports.position(|port| port.name == "child").unwrap_or(0)
}
