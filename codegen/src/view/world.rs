//! The world of a component: the types of its schema, and the component's access to them.

use crate::project::Project;
use crate::world::World as Known;
use graph_language::Schema;
use graph_language::model::{Attribute as Declared, Kind, Port};
use rc_cdsl::model::Access;
use serde::Serialize;
use std::time::Duration;

/// The graph that a component shares with others.
#[derive(Debug, Serialize)]
pub struct World {
    /// Its name in the worker.
    pub name: String,
    /// The file of its schema, as written.
    pub schema: String,
    /// The domain that the file declares.
    pub domain: String,
    /// The types and attributes that it sets. `None` for everything.
    pub writes: Option<Vec<Written>>,
    /// The types of which it gets each change. `None` for everything.
    pub reads: Option<Vec<String>>,
    /// The types of the schema.
    #[serde(skip)]
    pub types: Vec<Type>,
    /// The queries that the schema names.
    #[serde(skip)]
    pub queries: Vec<Query>,
    /// The files of the schema, the one that the component names first: names and texts.
    #[serde(skip)]
    pub files: Vec<(String, String)>,
}

/// The world of any network, whose schema the worker reads when it starts.
#[derive(Debug, Serialize)]
pub struct AnyWorld {
    /// Its name in the worker, and that of its first slot.
    pub name: String,
    /// The types and attributes that the component sets. `None` for everything.
    pub writes: Option<Vec<Written>>,
    /// The types of which it gets each change. `None` for everything.
    pub reads: Option<Vec<String>>,
}

/// A type or an attribute that a component sets.
#[derive(Debug, Serialize)]
pub struct Written {
    /// Type of nodes or edges.
    pub kind: String,
    /// The attribute. `None` for all of them.
    pub attribute: Option<String>,
    /// The least time between two values of a stream, in nanoseconds.
    pub stream_ns: Option<u64>,
    /// Whether others write it, too.
    pub shared: bool,
}

/// A type of nodes or edges.
#[derive(Debug)]
pub struct Type {
    /// Name in the schema.
    pub name: String,
    /// Names of the ports of an edge: where it starts, where it ends. `None` for nodes.
    pub ports: Option<[String; 2]>,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// Attributes, inherited ones first.
    pub attributes: Vec<Attribute>,
    /// Whether the component adds and removes elements of the type.
    pub is_written: bool,
    /// Whether the component gets its changes.
    pub is_read: bool,
    /// Whether it is a type of the `geometry.gdsl` that comes with the framework.
    pub is_of_geometry: bool,
}

/// A query that the schema names.
#[derive(Debug)]
pub struct Query {
    /// Name in the schema.
    pub name: String,
    /// Parameters: names and types.
    pub parameters: Vec<(String, Parameter)>,
    /// The text, in openCypher, on one line.
    pub text: String,
}

/// The type of a parameter of a query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// `bool`
    Bool,
    /// `int`, `long`
    Int,
    /// `float`, `double`
    Float,
    /// `string`
    Text,
    /// `bytes`
    Bytes,
    /// `pose`: x, y, z and the angles about x, y, z.
    Pose,
    /// A node of an entity.
    Node,
}

/// An attribute of a type.
#[derive(Debug)]
pub struct Attribute {
    /// Name in the schema.
    pub name: String,
    /// Its values.
    pub kind: Kind,
    /// A description in words: type, unit and range.
    pub text: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// Whether the component sets it.
    pub is_written: bool,
}

/// The world of a project, if it has one.
pub(super) fn of(project: &Project) -> Option<World> {
    let declared = project.component.world.as_ref()?;
    let world = project.world.as_ref()?;
    let access = declared.access.as_ref();
    Some(World {
        name: declared.name.text.clone(),
        schema: declared.schema.as_ref()?.text.clone(),
        domain: world.schema.name.clone(),
        writes: writes(access),
        reads: reads(access),
        types: types(world, access),
        queries: world.schema.queries.iter().map(query).collect(),
        files: world.files.clone(),
    })
}

/// The component's access to the world of any network, if it has that.
pub(super) fn any(project: &Project) -> Option<AnyWorld> {
    let declared = project.component.world.as_ref();
    let declared = declared.filter(|world| world.schema.is_none())?;
    let access = declared.access.as_ref();
    Some(AnyWorld {
        name: declared.name.text.clone(),
        writes: writes(access),
        reads: reads(access),
    })
}

fn writes(access: Option<&Access>) -> Option<Vec<Written>> {
    access.map(|access| access.writes.iter().map(written).collect())
}

fn reads(access: Option<&Access>) -> Option<Vec<String>> {
    access.map(|access| access.reads.iter().map(|kind| kind.text.clone()).collect())
}

fn written(write: &rc_cdsl::model::Write) -> Written {
    let nanoseconds = |time: Duration| time.as_nanos().try_into().unwrap_or(u64::MAX);
    Written {
        kind: write.kind.text.clone(),
        attribute: write.attribute.as_ref().map(|name| name.text.clone()),
        stream_ns: write.stream.map(nanoseconds),
        shared: write.shared,
    }
}

fn query(declared: &graph_language::model::Query) -> Query {
    let kind = |kind: &str| match kind {
        "bool" => Parameter::Bool,
        "int" | "long" => Parameter::Int,
        "float" | "double" => Parameter::Float,
        "string" => Parameter::Text,
        "bytes" => Parameter::Bytes,
        "pose" => Parameter::Pose,
        _ => Parameter::Node,
    };
    let parameters = declared.parameters.iter();
    Query {
        name: declared.name.clone(),
        parameters: parameters
            .map(|(name, of)| (name.clone(), kind(of)))
            .collect(),
        text: declared.text.replace(char::is_control, " "),
    }
}

/// The file whose types the library of a language may have.
const GEOMETRY: &str = "geometry.gdsl";

fn types(world: &Known, access: Option<&Access>) -> Vec<Type> {
    let schema: &Schema = &world.schema;
    let mut files = world.files.iter();
    let has_geometry = files.any(|file| file.0 == GEOMETRY && Known::comes_with_framework(file));
    let geometry = graph_language::builtin(GEOMETRY).filter(|_| has_geometry);
    // Another file may also declare a domain of this name.
    let is_of_geometry = |name: &str| {
        geometry.as_ref().is_some_and(|geometry| {
            let are_equal = geometry.entity(name) == schema.entity(name);
            are_equal && geometry.relation(name) == schema.relation(name)
        })
    };
    let one = |name: &str, doc: &[String], ports: Option<[String; 2]>, all: &[Declared]| {
        // A rule for a type also holds for those that inherit from it.
        let writes = |attribute: Option<&str>| {
            access.is_none_or(|access| {
                access.writes.iter().any(|write| {
                    let own = write.attribute.as_ref().map(|name| name.text.as_str());
                    schema.is_a(name, &write.kind.text) && (own.is_none() || own == attribute)
                })
            })
        };
        Type {
            name: name.to_owned(),
            ports,
            doc: doc.to_vec(),
            attributes: all
                .iter()
                .map(|attribute| Attribute {
                    name: attribute.name.clone(),
                    kind: attribute.kind.clone(),
                    // A unit may have any characters, and this is one line.
                    text: attribute.text().replace(char::is_control, " "),
                    doc: attribute.doc.clone(),
                    is_written: writes(Some(&attribute.name)),
                })
                .collect(),
            is_written: writes(None),
            is_read: access.is_none_or(|access| access.reads.iter().any(|kind| kind.text == name)),
            is_of_geometry: is_of_geometry(name),
        }
    };
    let entities = schema
        .entities
        .iter()
        .map(|entity| one(&entity.name, &entity.doc, None, &entity.attributes));
    let relations = schema.relations.iter().map(|relation| {
        let port = |at: usize| relation.ports.get(at).map_or("?", name_of).to_owned();
        let ports = Some([port(0), port(1)]);
        one(&relation.name, &relation.doc, ports, &relation.attributes)
    });
    entities.chain(relations).collect()
}

fn name_of(port: &Port) -> &str {
    &port.name
}
