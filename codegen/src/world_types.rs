//! The types of a world with their names, as every language prints them.

use crate::collisions::{bare, free};
use crate::view::world::{Attribute as Declared, Parameter as Kinds, Type as DeclaredType, World};
use graph_language::model::Kind;
use serde::Serialize;
use std::collections::BTreeSet;

/// How a language spells names, and which ones are taken.
pub(crate) struct Spelling {
    pub(crate) ty: fn(&str) -> String,
    pub(crate) function: fn(&str) -> String,
    pub(crate) attribute: fn(&str) -> String,
    pub(crate) argument: fn(&str) -> String,
    /// The types that the module of a world has for all schemas.
    pub(crate) types: &'static [&'static str],
    /// The functions of every view and every change.
    pub(crate) functions: &'static [&'static str],
    /// The members of every type, and of what changes one.
    pub(crate) members: &'static [&'static str],
    /// The arguments of every function.
    pub(crate) arguments: &'static [&'static str],
    /// The documentation of a query with this text.
    pub(crate) documentation: fn(&str) -> String,
    /// Whether an attribute is set by a function of its own.
    pub(crate) has_setters: bool,
}

/// A type of nodes or edges. `T` and `A` are what a language adds to a type and to an attribute.
#[derive(Debug, Serialize)]
pub(crate) struct Type<'a, T, A> {
    pub(crate) kind: &'a str,
    pub(crate) ty: String,
    edit: String,
    pub(crate) change: String,
    /// The function that finds one, the handler of its changes, and the function that adds one.
    function: String,
    pub(crate) handler: String,
    add: String,
    /// `edge` or `node`, and the same as the begin of names of types.
    word: &'static str,
    base: &'static str,
    is_edge: bool,
    /// The arguments of an edge: where it starts and ends.
    from: String,
    to: String,
    /// Whether nodes have an attribute `name`.
    has_name: bool,
    is_written: bool,
    /// Whether the type or one of its attributes is set.
    is_changed: bool,
    pub(crate) is_read: bool,
    attributes: Vec<Attribute<'a, A>>,
    /// The attributes that are set.
    written: Vec<Attribute<'a, A>>,
    #[serde(flatten)]
    pub(crate) own: T,
}

/// An attribute.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Attribute<'a, A> {
    name: &'a str,
    /// The function that reads it, and the one that sets it, if the language has such ones.
    get: String,
    set: String,
    #[serde(flatten)]
    own: A,
}

/// A query that the schema names. `P` is what a language adds to a parameter.
#[derive(Debug, Serialize)]
pub(crate) struct Query<'a, P> {
    name: &'a str,
    doc: String,
    /// The function that runs it.
    function: String,
    parameters: Vec<Parameter<'a, P>>,
}

/// A parameter of a query.
#[derive(Debug, Serialize)]
struct Parameter<'a, P> {
    name: &'a str,
    argument: String,
    #[serde(flatten)]
    own: P,
}

/// The types of a world, and its queries.
pub(crate) struct Declarations<'a, T, A, P> {
    pub(crate) types: Vec<Type<'a, T, A>>,
    pub(crate) queries: Vec<Query<'a, P>>,
}

fn taken(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// The types of a world, and the queries of its schema.
pub(crate) fn of<'a, T, A: Clone, P>(
    world: &'a World,
    spelling: &Spelling,
    own: impl Fn(&'a DeclaredType) -> T,
    attribute: impl Fn(&'a Declared) -> A,
    parameter: impl Fn(Kinds) -> P,
) -> Declarations<'a, T, A, P> {
    let (mut types, mut functions) = (taken(spelling.types), taken(spelling.functions));
    let one = |of: &'a DeclaredType| {
        let ty = free((spelling.ty)(&of.name), &mut types);
        let edit = free(format!("{}Edit", bare(&ty)), &mut types);
        let change = free(format!("{}Change", bare(&ty)), &mut types);
        let function = free((spelling.function)(&of.name), &mut functions);
        let handler = free(format!("{}_changed", bare(&function)), &mut functions);
        let add = free(format!("add_{}", bare(&function)), &mut functions);
        let mut members = taken(spelling.members);
        let attributes = of.attributes.iter().map(|declared| {
            let get = free((spelling.attribute)(&declared.name), &mut members);
            let set = if spelling.has_setters {
                free(format!("set_{}", bare(&get)), &mut members)
            } else {
                String::new()
            };
            let name = declared.name.as_str();
            let own = attribute(declared);
            (
                declared.is_written,
                Attribute {
                    name,
                    get,
                    set,
                    own,
                },
            )
        });
        let attributes: Vec<(bool, Attribute<A>)> = attributes.collect();
        let written = attributes.iter().filter(|(is_written, _)| *is_written);
        let written: Vec<_> = written.map(|(_, attribute)| attribute.clone()).collect();
        let mut arguments = taken(spelling.arguments);
        let ports = of.ports.as_ref().map(|ports| {
            ports
                .each_ref()
                .map(|port| free((spelling.argument)(port), &mut arguments))
        });
        let is_edge = ports.is_some();
        let [from, to] = ports.unwrap_or_default();
        let is_name = |own: &Declared| own.name == "name" && own.kind == Kind::Text;
        Type {
            kind: &of.name,
            ty,
            edit,
            change,
            function,
            handler,
            add,
            word: if is_edge { "edge" } else { "node" },
            base: if is_edge { "Edge" } else { "Node" },
            is_edge,
            from,
            to,
            has_name: !is_edge && of.attributes.iter().any(is_name),
            is_written: of.is_written,
            is_changed: of.is_written || !written.is_empty(),
            is_read: of.is_read,
            attributes: attributes.into_iter().map(|(_, own)| own).collect(),
            written,
            own: own(of),
        }
    };
    let types = world.types.iter().map(one).collect();
    let queries = world.queries.iter().map(|declared| {
        let mut arguments = taken(spelling.arguments);
        let parameters = declared.parameters.iter().map(|(name, kind)| Parameter {
            name,
            argument: free((spelling.argument)(name), &mut arguments),
            own: parameter(*kind),
        });
        Query {
            name: &declared.name,
            doc: (spelling.documentation)(&declared.text),
            parameters: parameters.collect(),
            function: free((spelling.function)(&declared.name), &mut functions),
        }
    });
    Declarations {
        types,
        queries: queries.collect(),
    }
}
