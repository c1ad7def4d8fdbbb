//! A schema as shapes of SHACL, for the RDF that `turtle` writes.
//!
//! Types, ports, numbers of edges, types and ranges of values are core constraints; keys, cycles in
//! trees, rules and unknown attributes are queries of SHACL-SPARQL. The shapes leave out what SHACL
//! cannot express: that the numbers of a data prototype are a rotation, and errors of a file that
//! no graph has, such as two elements with one id.

use crate::turtle::{PREFIXES, class, member, own, quoted};
use graph_schema::{Attribute, Entity, Kind, Port, Relation, Schema};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Prints the shapes of a schema.
pub fn write(schema: &Schema) -> String {
    let shapes = Shapes { schema };
    let mut out = PREFIXES.to_owned();
    out.push_str(&shapes.common());
    for entity in &schema.entities {
        out.push_str(&shapes.entity(entity));
    }
    for relation in &schema.relations {
        out.push_str(&shapes.relation(relation));
        out.push_str(&shapes.tree(relation));
    }
    out
}

struct Shapes<'s> {
    schema: &'s Schema,
}

/// A constraint as a query, whose rows are the violations.
fn sparql(message: &str, query: &str) -> String {
    let message = quoted(message);
    format!("    sh:sparql [ sh:message {message} ; sh:select \"\"\"{query}\"\"\" ] ;\n")
}

const TYPE: &str = "<http://www.w3.org/1999/02/22-rdf-syntax-ns#type>";
const CELLS: &str = "[ sh:zeroOrMorePath rdf:rest ]";

impl Shapes<'_> {
    /// All types are known, in a strict domain; and the ends of edges exist.
    fn common(&self) -> String {
        let entities = self.schema.entities.iter().map(|entity| &entity.name);
        let relations = self.schema.relations.iter().map(|relation| &relation.name);
        let all: Vec<String> = entities
            .chain(relations)
            .map(|kind| class(self.schema, kind))
            .collect();
        let all = all.join(" ");
        let target = if self.schema.open {
            ""
        } else {
            "    sh:targetSubjectsOf rdf:type ;\n"
        };
        format!(
            "\nrc:Known a sh:NodeShape ;\n{target}    sh:property [ sh:path rdf:type ; sh:in ( {all} ) ] .\n\n\
            rc:There a sh:NodeShape ;\n    sh:property [ sh:path rdf:type ; sh:minCount 1 ] .\n"
        )
    }

    fn entity(&self, entity: &Entity) -> String {
        let own = own(self.schema, &entity.name);
        let mut out = self.start(&entity.name, &entity.attributes, Vec::new());
        out.push_str(&self.attributes(&entity.name, &own));
        for relation in &self.schema.relations {
            for port in relation
                .ports
                .iter()
                .filter(|port| port.entity == entity.name)
            {
                out.push_str(&self.counts(relation, port));
            }
        }
        for key in own.iter().filter(|attribute| attribute.key) {
            let name = member(self.schema, &entity.name, &key.name);
            out.push_str(&sparql(
                &format!("another node has the same `{}`, which is a key", key.name),
                &format!("SELECT $this ?value WHERE {{ $this {name} ?value . ?other {name} ?value . FILTER (?other != $this) }}"),
            ));
        }
        out.push_str("    .\n");
        out
    }

    /// How many edges a node has at a port.
    fn counts(&self, relation: &Relation, port: &Port) -> String {
        let path = format!(
            "[ sh:inversePath {} ]",
            member(self.schema, &relation.name, &port.name)
        );
        let mut out = String::new();
        if let Some(most) = port.max {
            let _ = writeln!(
                out,
                "    sh:property [ sh:path {path} ; sh:maxCount {most} ] ;"
            );
        }
        if port.min > 0 {
            // An edge that is an entity to others needs none.
            let _ = writeln!(
                out,
                "    sh:or ( [ sh:class rc:Edge ] [ sh:property [ sh:path {path} ; sh:minCount {} ] ] ) ;",
                port.min
            );
        }
        out
    }

    fn relation(&self, relation: &Relation) -> String {
        let name = &relation.name;
        let ports = relation.ports.iter();
        let ports: Vec<String> = ports.map(|p| member(self.schema, name, &p.name)).collect();
        let mut out = self.start(name, &relation.attributes, ports.clone());
        for (port, path) in relation.ports.iter().zip(&ports) {
            let class = class(self.schema, &port.entity);
            // In an open domain, a node of an unknown type fits everywhere.
            let fits = if self.schema.open {
                format!("sh:or ( [ sh:class {class} ] [ sh:not rc:Known ] )")
            } else {
                format!("sh:class {class}")
            };
            let _ = writeln!(
                out,
                "    sh:property [ sh:path {path} ; sh:minCount 1 ; sh:maxCount 1 ; sh:node rc:There ; {fits} ] ;"
            );
        }
        out.push_str(&self.attributes(name, &own(self.schema, name)));
        if relation.promotes.is_some() {
            let all = self.schema.relations.iter().flat_map(|relation| {
                let ports = relation.ports.iter();
                ports.map(|port| member(self.schema, &relation.name, &port.name))
            });
            let all: Vec<String> = all.collect();
            out.push_str(&sparql(
                "an edge leads to itself, over the edges at its ends",
                &format!("SELECT $this WHERE {{ $this ({})+ $this }}", all.join("|")),
            ));
        }
        for rule in self
            .schema
            .rules
            .iter()
            .filter(|rule| rule.relation == *name)
        {
            let side = |(port, attribute): &(usize, String)| {
                let at = relation.ports.get(*port)?;
                let attribute = member(self.schema, &at.entity, attribute);
                Some(format!("{} / {attribute}", ports.get(*port)?))
            };
            let (Some(left), Some(right)) = (side(&rule.left), side(&rule.right)) else {
                continue;
            };
            let comparison = match rule.comparison.text() {
                "==" => "=",
                other => other,
            };
            out.push_str(&sparql(
                &rule.message,
                &format!("SELECT $this WHERE {{ $this {left} ?a . $this {right} ?b . FILTER (!(?a {comparison} ?b)) }}"),
            ));
        }
        out.push_str("    .\n");
        out
    }

    /// The class, and that a strict domain has no other members. A type that inherits has more, so only the
    /// elements of exactly this type are asked.
    fn start(&self, kind: &str, attributes: &[Attribute], mut members: Vec<String>) -> String {
        let own = class(self.schema, kind);
        let mut out = format!("\n{own} a rdfs:Class, sh:NodeShape ;\n");
        if !self.schema.open {
            let names = attributes.iter();
            members.extend(names.map(|own| member(self.schema, kind, &own.name)));
            members.push(TYPE.to_owned());
            let members = members.join(", ");
            out.push_str(&sparql(
                &format!("`{kind}` has no such attribute"),
                &format!("SELECT $this ?path ?value WHERE {{ $this {TYPE} {own} . $this ?path ?value . FILTER (?path NOT IN ({members})) }}"),
            ));
        }
        out
    }

    fn attributes(&self, kind: &str, all: &[&Attribute]) -> String {
        let mut out = String::new();
        for attribute in all {
            let path = member(self.schema, kind, &attribute.name);
            let _ = writeln!(
                out,
                "    sh:property [ sh:path {path} ; sh:maxCount 1{} ] ;",
                fits(attribute)
            );
            if attribute.value_of() != attribute.name {
                continue;
            }
            let same = self.same(kind, &attribute.name);
            let path = match same.as_slice() {
                [one] => one.clone(),
                several => format!("[ sh:alternativePath ( {} ) ]", several.join(" ")),
            };
            let least = if attribute.optional {
                ""
            } else {
                " ; sh:minCount 1"
            };
            let _ = writeln!(
                out,
                "    sh:property [ sh:path {path} ; sh:maxCount 1{least} ] ;"
            );
        }
        out
    }

    /// The attributes that have the value of one, of which an element has one. A type that inherits may
    /// have more of them.
    fn same(&self, kind: &str, value: &str) -> Vec<String> {
        let types = self.schema.types();
        let types = types.filter(|below| self.schema.is_a(below, kind));
        let all = types.flat_map(|below| {
            let all = self.schema.attributes(below).unwrap_or_default().iter();
            let same = all.filter(|other| other.value_of() == value);
            same.map(|other| member(self.schema, below, &other.name))
        });
        all.collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// A child has one parent, and nothing is above itself.
    fn tree(&self, relation: &Relation) -> String {
        let Some(tree) = &relation.tree else {
            return String::new();
        };
        let port = |at: usize| {
            let port = relation.ports.get(at)?;
            Some(member(self.schema, &relation.name, &port.name))
        };
        let (Some(child), Some(parent)) = (port(tree.child), port(1 - tree.child)) else {
            return String::new();
        };
        let own = class(self.schema, &relation.name);
        let own = own.trim_end_matches('>');
        let circle = sparql(
            &format!("a node is above itself in `{}`", relation.name),
            &format!("SELECT $this WHERE {{ $this (^{child} / {parent})+ $this }}"),
        );
        format!(
            "\n{own}.tree> a sh:NodeShape ;\n    sh:targetObjectsOf {child} ;\n    \
            sh:property [ sh:path [ sh:inversePath {child} ] ; sh:maxCount 1 ] ;\n{circle}    .\n"
        )
    }
}

/// The values that an attribute may have.
fn fits(attribute: &Attribute) -> String {
    let range = attribute.range.map_or_else(String::new, |(least, most)| {
        let side = |what: &str, number: f64| {
            if number.is_finite() {
                format!(" ; sh:{what}Inclusive {number:e}")
            } else {
                String::new()
            }
        };
        side("min", least) + &side("max", most)
    });
    let one = |datatype: &str| format!(" ; sh:datatype xsd:{datatype}{range}");
    let many = |datatype: &str, count: Option<usize>| {
        let cell = one(datatype);
        let cell = cell.trim_start_matches(" ; ");
        // A list of n has n + 1 rests, with itself and the empty one.
        let count = count.map_or_else(String::new, |n| {
            let n = n + 1;
            format!(" ; sh:property [ sh:path {CELLS} ; sh:minCount {n} ; sh:maxCount {n} ]")
        });
        format!(
            " ; sh:nodeKind sh:BlankNodeOrIRI ; sh:property [ sh:path ( {CELLS} rdf:first ) ; {cell} ]{count}"
        )
    };
    match &attribute.kind {
        Kind::Bool => one("boolean"),
        Kind::Int => one("integer"),
        Kind::Float => one("double"),
        Kind::Text => one("string"),
        Kind::Bytes => one("base64Binary"),
        Kind::Enum(words) => {
            let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
            format!(" ; sh:in ( {} )", words.join(" "))
        }
        Kind::Ints(count) => many("integer", *count),
        Kind::Floats(count) => many("double", *count),
        Kind::Texts => many("string", None),
        Kind::Block(block) => {
            let count = (!block.is_sequence).then_some(block.numbers.len());
            many("double", count)
        }
        Kind::Topic(kind) => {
            let own = kind.as_ref().map_or_else(String::new, |kind| {
                format!(" ; sh:hasValue {}", quoted(kind))
            });
            format!(
                " ; sh:nodeKind sh:BlankNode ; sh:property [ sh:path rc:sampleType ; sh:minCount 1{own} ]"
            )
        }
    }
}
