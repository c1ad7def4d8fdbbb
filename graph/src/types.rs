//! The schema with symbols instead of names, as changes are checked against it.

use crate::names::{Names, Symbol};
use graph_schema::{Attribute, Block, Entity, Kind, PoseOf, Relation, Schema};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The attribute that a graph finds nodes by.
pub(crate) const NAME: &str = "name";

/// Attributes of a type.
#[derive(Debug, Default)]
pub(crate) struct Attributes {
    /// Symbols, with their places in the schema.
    all: Vec<(Symbol, usize)>,
    required: Vec<Symbol>,
    /// Attributes that have one value.
    groups: Vec<Vec<(Symbol, usize)>>,
}

impl Attributes {
    fn new(names: &mut Names, attributes: &[Attribute]) -> Self {
        let mut made = Self::default();
        for (at, attribute) in attributes.iter().enumerate() {
            let symbol = names.add(&attribute.name);
            made.all.push((symbol, at));
            if !attribute.optional {
                made.required.push(symbol);
            }
        }
        let mut groups: BTreeMap<&str, Vec<(Symbol, usize)>> = BTreeMap::new();
        for own in &made.all {
            let value = attributes[own.1].value_of();
            groups.entry(value).or_default().push(*own);
        }
        let groups = groups.into_values().filter(|group| group.len() > 1);
        made.groups = groups.collect();
        made
    }

    /// The attributes that have the same value as this one, itself included.
    pub(crate) fn group(&self, symbol: Symbol) -> Option<&[(Symbol, usize)]> {
        let mut groups = self.groups.iter();
        let found = groups.find(|group| group.iter().any(|(known, _)| *known == symbol));
        found.map(Vec::as_slice)
    }

    pub(crate) fn place(&self, symbol: Symbol) -> Option<usize> {
        let found = self.all.iter().find(|(known, _)| *known == symbol);
        found.map(|(_, at)| *at)
    }

    pub(crate) fn required(&self) -> &[Symbol] {
        &self.required
    }
}

/// A port of a relation, for nodes of one type.
#[derive(Debug)]
pub(crate) struct PortOf {
    pub(crate) relation: Symbol,
    pub(crate) port: usize,
    pub(crate) min: usize,
    pub(crate) max: Option<usize>,
}

#[derive(Debug)]
pub(crate) struct EntityType {
    at: usize,
    pub(crate) ancestors: Vec<Symbol>,
    pub(crate) attributes: Attributes,
    /// Attributes that are keys, each with the type that declares it first.
    pub(crate) keys: Vec<(Symbol, Symbol)>,
    /// Ports that limit how many edges a node has.
    pub(crate) ports: Vec<PortOf>,
}

#[derive(Debug)]
pub(crate) struct RelationType {
    at: usize,
    pub(crate) attributes: Attributes,
    pub(crate) ports: [Option<Symbol>; 2],
    pub(crate) tree: Option<TreeOf>,
    pub(crate) placed: Option<PlacedOf>,
    /// The entity of an edge as an end of others.
    pub(crate) promotes: Option<Symbol>,
    /// Places of rules in the schema, with the symbols of their attributes.
    pub(crate) rules: Vec<(usize, Symbol, Symbol)>,
}

/// A relation whose edges form a forest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeOf {
    pub(crate) child: usize,
    /// The attribute with the pose, or those with translation and angles.
    pub(crate) pose: Option<(Symbol, Option<Symbol>)>,
}

/// A relation whose edges say where one end is in the other one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedOf {
    pub(crate) child: usize,
    pub(crate) pose: (Symbol, Option<Symbol>),
}

#[derive(Debug)]
pub(crate) struct Types {
    pub(crate) schema: Arc<Schema>,
    pub(crate) name: Symbol,
    entities: Vec<Option<EntityType>>,
    relations: Vec<Option<RelationType>>,
    /// Whether any attribute keeps its history.
    pub(crate) has_history: bool,
    /// Whether a relation has poses and is not a tree.
    pub(crate) has_loops: bool,
    /// Whether several attributes of a type have one value.
    pub(crate) has_groups: bool,
}

impl Types {
    pub(crate) fn new(schema: Arc<Schema>, names: &mut Names) -> Self {
        let name = names.add(NAME);
        for entity in &schema.entities {
            names.add(&entity.name);
        }
        for relation in &schema.relations {
            names.add(&relation.name);
        }
        let entities = schema.entities.iter().enumerate();
        let entities = entities.map(|(at, entity)| {
            let symbol = names.add(&entity.name);
            (symbol, entity_type(&schema, names, at, entity))
        });
        let entities = table(entities.collect());
        let relations = schema.relations.iter().enumerate();
        let relations = relations.map(|(at, relation)| {
            let symbol = names.add(&relation.name);
            (symbol, relation_type(&schema, names, at, relation))
        });
        let relations = table(relations.collect());
        let of_entities = entities
            .iter()
            .flatten()
            .map(|e: &EntityType| &e.attributes);
        let of_relations = relations.iter().flatten();
        let of_relations = of_relations.map(|r: &RelationType| &r.attributes);
        let has_groups = of_entities
            .chain(of_relations)
            .any(|a| !a.groups.is_empty());
        let entity_attributes = schema.entities.iter().flat_map(|e| &e.attributes);
        let relation_attributes = schema.relations.iter().flat_map(|r| &r.attributes);
        let mut attributes = entity_attributes.chain(relation_attributes);
        Self {
            has_loops: schema
                .relations
                .iter()
                .any(|r| r.tree.is_none() && r.pose.is_some()),
            has_groups,
            has_history: attributes.any(|a| a.history.is_some()),
            name,
            entities,
            relations,
            schema,
        }
    }

    #[inline]
    pub(crate) fn entity(&self, symbol: Symbol) -> Option<&EntityType> {
        self.entities.get(symbol.0 as usize)?.as_ref()
    }

    #[inline]
    pub(crate) fn relation(&self, symbol: Symbol) -> Option<&RelationType> {
        self.relations.get(symbol.0 as usize)?.as_ref()
    }

    pub(crate) fn described(&self, entity: &EntityType) -> &Entity {
        &self.schema.entities[entity.at]
    }

    pub(crate) fn described_relation(&self, relation: &RelationType) -> &Relation {
        &self.schema.relations[relation.at]
    }

    /// The schema of an attribute of a type of nodes or edges.
    pub(crate) fn attribute(&self, kind: Symbol, attribute: Symbol) -> Option<&Attribute> {
        let (places, declared) = self.attributes_of(kind)?;
        declared.get(places.place(attribute)?)
    }

    /// The data prototype of an attribute of a type of nodes or edges.
    pub(crate) fn block(&self, kind: Symbol, attribute: Symbol) -> Option<&Block> {
        match &self.attribute(kind, attribute)?.kind {
            Kind::Block(block) => Some(block),
            _ => None,
        }
    }

    /// The attributes of a type of nodes or edges, with their schema.
    pub(crate) fn attributes_of(&self, kind: Symbol) -> Option<(&Attributes, &[Attribute])> {
        if let Some(entity) = self.entity(kind) {
            return Some((&entity.attributes, &self.described(entity).attributes));
        }
        let relation = self.relation(kind)?;
        let described = self.described_relation(relation);
        Some((&relation.attributes, &described.attributes))
    }

    /// The attributes that have the same value as this one, itself included.
    #[inline]
    pub(crate) fn group(&self, kind: Symbol, attribute: Symbol) -> Option<&[(Symbol, usize)]> {
        if !self.has_groups {
            return None;
        }
        self.attributes_of(kind)?.0.group(attribute)
    }

    /// The entity of an edge of a relation as an end of others.
    pub(crate) fn promoted(&self, relation: Symbol) -> Option<&EntityType> {
        self.entity(self.relation(relation)?.promotes?)
    }

    /// Whether a type is another one, inherits from it, or has edges that are ends of others as it.
    pub(crate) fn is_a(&self, kind: Symbol, wanted: Symbol) -> bool {
        if kind == wanted {
            return true;
        }
        let entity = self.entity(kind).or_else(|| self.promoted(kind));
        entity.is_some_and(|entity| entity.ancestors.contains(&wanted))
    }
}

impl Types {
    /// The types that inherit from another one, in the order of their symbols.
    pub(crate) fn below(&self, wanted: Symbol) -> impl Iterator<Item = Symbol> {
        let entities = (0..).map(Symbol).zip(&self.entities);
        entities.filter_map(move |(symbol, entity)| {
            let is_below = entity.as_ref()?.ancestors.contains(&wanted);
            (is_below && symbol != wanted).then_some(symbol)
        })
    }

    /// The relations whose edges are another type as ends of others, or that have its name.
    pub(crate) fn relations_as(&self, wanted: Symbol) -> impl Iterator<Item = Symbol> {
        let relations = (0..).map(Symbol).zip(&self.relations);
        relations.filter_map(move |(symbol, relation)| {
            relation.as_ref()?;
            self.is_a(symbol, wanted).then_some(symbol)
        })
    }
}

fn table<T>(items: Vec<(Symbol, T)>) -> Vec<Option<T>> {
    let mut table: Vec<Option<T>> = Vec::new();
    for (symbol, item) in items {
        let at = symbol.0 as usize;
        if table.len() <= at {
            table.resize_with(at + 1, || None);
        }
        table[at] = Some(item);
    }
    table
}

fn entity_type(schema: &Schema, names: &mut Names, at: usize, entity: &Entity) -> EntityType {
    let mut ancestors = vec![names.add(&entity.name)];
    let mut here = entity.parent.as_deref();
    while let Some(parent) = here.and_then(|name| schema.entity(name)) {
        let symbol = names.add(&parent.name);
        if ancestors.contains(&symbol) {
            break;
        }
        ancestors.push(symbol);
        here = parent.parent.as_deref();
    }
    let keys = entity.attributes.iter().filter(|a| a.key).map(|attribute| {
        let declarer = ancestors.iter().rev().find(|ancestor| {
            let entity = schema.entity(names.text(**ancestor));
            entity.is_some_and(|e| e.attribute(&attribute.name).is_some_and(|a| a.key))
        });
        let declarer = declarer.copied().unwrap_or(ancestors[0]);
        (attribute.name.as_str(), declarer)
    });
    let keys: Vec<_> = keys.collect();
    let keys = keys
        .into_iter()
        .map(|(name, declarer)| (names.add(name), declarer))
        .collect();
    let mut ports = Vec::new();
    for relation in &schema.relations {
        for (number, port) in relation.ports.iter().enumerate().take(2) {
            if (port.min > 0 || port.max.is_some()) && schema.is_a(&entity.name, &port.entity) {
                ports.push(PortOf {
                    relation: names.add(&relation.name),
                    port: number,
                    min: port.min as usize,
                    max: port.max.map(|most| most as usize),
                });
            }
        }
    }
    EntityType {
        at,
        ancestors,
        attributes: Attributes::new(names, &entity.attributes),
        keys,
        ports,
    }
}

fn relation_type(
    schema: &Schema,
    names: &mut Names,
    at: usize,
    relation: &Relation,
) -> RelationType {
    let port = |at: usize, names: &mut Names| {
        let port = relation.ports.get(at)?;
        schema.entity(&port.entity)?;
        Some(names.add(&port.entity))
    };
    let ports = [port(0, names), port(1, names)];
    let placed = relation.placed().map(|placed| PlacedOf {
        child: placed.child.min(1),
        pose: match &placed.pose {
            PoseOf::One(pose) => (names.add(pose), None),
            PoseOf::Two(by, angles) => (names.add(by), Some(names.add(angles))),
        },
    });
    let tree = relation.tree.as_ref().map(|tree| TreeOf {
        child: tree.child,
        pose: placed.map(|placed| placed.pose),
    });
    let rules = schema.rules.iter().enumerate();
    let rules = rules.filter(|(_, rule)| rule.relation == relation.name);
    let rules = rules
        .map(|(at, rule)| (at, names.add(&rule.left.1), names.add(&rule.right.1)))
        .collect();
    RelationType {
        at,
        attributes: Attributes::new(names, &relation.attributes),
        ports,
        tree,
        placed,
        promotes: relation.promotes.as_ref().map(|entity| names.add(entity)),
        rules,
    }
}
