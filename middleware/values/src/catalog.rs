//! The types and interfaces of several modules, with all names resolved.

use crate::description::{self, Kind, Module};
use crate::error::DescriptionError;
use crate::json;
use crate::parse::parse;
use crate::types::{Enum, Member, Named, Primitive, Range, Struct, Type, depth, limit};
use rc_vocabulary::Pattern;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The most levels of types inside a type.
const DEPTH: u32 = 64;
/// The most named types, members, enumerators and operations of a catalog together.
const ENTRIES: usize = 100_000;

/// The types and interfaces of several modules.
#[derive(Clone, Debug, Default)]
pub struct Catalog {
    types: BTreeMap<String, Type>,
    interfaces: BTreeMap<String, Arc<Interface>>,
}

/// An interface.
#[derive(Clone, Debug, PartialEq)]
pub struct Interface {
    /// The name with its module, `RoboCompLaser::Laser`.
    pub name: String,
    /// The operations, in their order.
    pub operations: Vec<Operation>,
}

/// An operation.
#[derive(Clone, Debug, PartialEq)]
pub struct Operation {
    /// The name.
    pub name: String,
    /// The hash of the name, which is in the envelope of a call.
    pub id: i32,
    /// The hash of the types.
    pub hash: u64,
    /// How it communicates.
    pub pattern: Pattern,
    /// The parameters of a request or of a sample.
    pub request: Arc<Struct>,
    /// Structure of a reply: the output parameters, then the returned value as `return`.
    pub reply: Arc<Struct>,
    /// Whether there is a returned value.
    pub has_result: bool,
    /// The exceptions, in their order.
    pub throws: Vec<Exception>,
}

/// An exception of an operation.
#[derive(Clone, Debug, PartialEq)]
pub struct Exception {
    /// The number that is in the envelope of a reply.
    pub id: i32,
    /// Structure of the exception.
    pub ty: Arc<Struct>,
}

impl Interface {
    /// An operation.
    pub fn operation(&self, name: &str) -> Option<&Operation> {
        self.operations.iter().find(|o| o.name == name)
    }
}

impl Operation {
    /// The name without that of the interface, and the types: `getPose(float32 x) -> ...`.
    pub fn signature(&self) -> String {
        let list = |of: &Struct| {
            let members = of.members.iter().map(|m| {
                let optional = if m.optional { "?" } else { "" };
                format!("{}{optional}: {}", m.name, m.ty)
            });
            members.collect::<Vec<_>>().join(", ")
        };
        let mut text = format!("{}({})", self.name, list(&self.request));
        if !self.reply.members.is_empty() {
            text += &format!(" -> ({})", list(&self.reply));
        }
        if !self.throws.is_empty() {
            let names: Vec<&str> = self.throws.iter().map(|e| e.ty.name.as_str()).collect();
            text += &format!(" throws {}", names.join(", "));
        }
        text
    }
}

impl Catalog {
    /// Resolves all names of these modules. A module that occurs twice is read once, if both are
    /// equal.
    pub fn new(modules: &[Module]) -> Result<Self, DescriptionError> {
        let mut resolver = Resolver::new(modules)?;
        let names: Vec<String> = resolver.declared.keys().cloned().collect();
        for name in names {
            resolver.named(&name, 0)?;
        }
        let mut described: BTreeMap<String, &description::Interface> = BTreeMap::new();
        let mut interfaces = BTreeMap::new();
        for module in modules {
            for interface in &module.interfaces {
                let name = format!("{}::{}", module.module, interface.name);
                match described.insert(name.clone(), interface) {
                    Some(other) if other == interface => continue,
                    Some(_) => return Err(DescriptionError::new(&name, "there are two of them")),
                    None => {}
                }
                let resolved = Arc::new(resolver.interface(&name, interface)?);
                interfaces.insert(name, resolved);
            }
        }
        Ok(Self {
            types: resolver.done,
            interfaces,
        })
    }

    /// An interface, by its name with its module.
    pub fn interface(&self, name: &str) -> Option<&Arc<Interface>> {
        self.interfaces.get(name)
    }

    /// A type, by its name with its module.
    pub fn named(&self, name: &str) -> Option<&Type> {
        self.types.get(name)
    }

    /// All interfaces by their names.
    pub fn interfaces(&self) -> impl Iterator<Item = &Arc<Interface>> {
        self.interfaces.values()
    }

    /// All types by their names.
    pub fn types(&self) -> impl Iterator<Item = (&str, &Type)> {
        self.types.iter().map(|(name, ty)| (name.as_str(), ty))
    }
}

struct Resolver<'m> {
    declared: BTreeMap<String, &'m Kind>,
    done: BTreeMap<String, Type>,
    /// The types that are being resolved.
    open: Vec<String>,
}

impl<'m> Resolver<'m> {
    fn new(modules: &'m [Module]) -> Result<Self, DescriptionError> {
        let mut declared: BTreeMap<String, &Kind> = BTreeMap::new();
        let mut entries = 0_usize;
        for module in modules {
            for ty in &module.types {
                entries += 1 + match &ty.kind {
                    Kind::Struct(members) | Kind::Exception(members) => members.len(),
                    Kind::Enum(values) => values.len(),
                    Kind::Alias(_) => 0,
                };
                let name = format!("{}::{}", module.module, ty.name);
                let other = declared.insert(name.clone(), &ty.kind);
                if other.is_some_and(|other| *other != ty.kind) {
                    return Err(DescriptionError::new(&name, "there are two of them"));
                }
            }
            for interface in &module.interfaces {
                for operation in &interface.operations {
                    entries += 1 + operation.inputs.len() + operation.outputs.len();
                    entries += operation.throws.len();
                }
            }
        }
        if entries > ENTRIES {
            let reason = format!("it has more than {ENTRIES} types, members and operations");
            return Err(DescriptionError::new("the component", reason));
        }
        Ok(Self {
            declared,
            done: BTreeMap::new(),
            open: Vec::new(),
        })
    }

    /// A type with a name.
    fn named(&mut self, name: &str, level: u32) -> Result<Type, DescriptionError> {
        if let Some(done) = self.done.get(name) {
            return Ok(done.clone());
        }
        let wrong = |reason: String| Err(DescriptionError::new(name, reason));
        let Some(kind) = self.declared.get(name).copied() else {
            return wrong("there is no type of this name".to_owned());
        };
        if self.open.iter().any(|open| open == name) {
            return wrong("it contains itself".to_owned());
        }
        if level >= DEPTH {
            return wrong(format!("it has more than {DEPTH} levels"));
        }
        self.open.push(name.to_owned());
        let found = match kind {
            Kind::Struct(members) | Kind::Exception(members) => Type::Named(Named::Struct(
                Arc::new(self.structure(name, members, level)?),
            )),
            Kind::Enum(values) if values.is_empty() => return wrong("it has no value".to_owned()),
            Kind::Enum(values) => Type::Named(Named::Enum(Arc::new(Enum {
                name: name.to_owned(),
                values: values.clone(),
            }))),
            Kind::Alias(text) => self.ty(name, text, level)?,
        };
        self.open.pop();
        if depth(&found) > DEPTH {
            return wrong(format!("it has more than {DEPTH} levels"));
        }
        self.done.insert(name.to_owned(), found.clone());
        Ok(found)
    }

    fn structure(
        &mut self,
        name: &str,
        members: &[description::Member],
        level: u32,
    ) -> Result<Struct, DescriptionError> {
        let mut resolved: Vec<Member> = Vec::new();
        let mut names = BTreeSet::new();
        for member in members {
            let place = format!("{name}.{}", member.name);
            if !names.insert(member.name.as_str()) {
                return Err(DescriptionError::new(&place, "there are two of them"));
            }
            let ty = self.ty(&place, &member.ty, level)?;
            resolved.push(self::member(&place, member, ty)?);
        }
        Ok(Struct::new(name.to_owned(), resolved))
    }

    fn ty(&mut self, place: &str, text: &str, level: u32) -> Result<Type, DescriptionError> {
        let parsed = parse(text).map_err(|reason| DescriptionError::new(place, reason))?;
        let ty = parsed.replace(&mut |name| self.named(name, level + 1))?;
        if has_other_keys(&ty) {
            let reason = "the keys of a dictionary are numbers, text or enumerators";
            return Err(DescriptionError::new(place, reason));
        }
        Ok(ty)
    }

    fn interface(
        &mut self,
        name: &str,
        interface: &description::Interface,
    ) -> Result<Interface, DescriptionError> {
        let mut operations = Vec::new();
        for operation in &interface.operations {
            operations.push(self.operation(&format!("{name}.{}", operation.name), operation)?);
        }
        Ok(Interface {
            name: name.to_owned(),
            operations,
        })
    }

    fn operation(
        &mut self,
        place: &str,
        operation: &description::Operation,
    ) -> Result<Operation, DescriptionError> {
        let wrong = |reason: &str| DescriptionError::new(place, reason);
        let hash = u64::from_str_radix(&operation.hash, 16)
            .ok()
            .filter(|_| operation.hash.len() == 16)
            .ok_or_else(|| wrong("its hash has not 16 hexadecimal digits"))?;
        let pattern = Pattern::from_word(&operation.pattern)
            .ok_or_else(|| wrong("its pattern is not command, query or publish"))?;
        let mut outputs = operation.outputs.clone();
        outputs.extend(operation.result.iter().map(|ty| description::Member {
            name: "return".to_owned(),
            ty: ty.clone(),
            ..description::Member::default()
        }));
        let mut throws = Vec::new();
        for (exception, id) in &operation.throws {
            let Type::Named(Named::Struct(ty)) = self.named(exception, 0)? else {
                return Err(wrong("it throws what is not an exception"));
            };
            throws.push(Exception { id: *id, ty });
        }
        Ok(Operation {
            name: operation.name.clone(),
            id: operation.id,
            hash,
            pattern,
            request: Arc::new(self.structure(place, &operation.inputs, 0)?),
            reply: Arc::new(self.structure(place, &outputs, 0)?),
            has_result: operation.result.is_some(),
            throws,
        })
    }
}

/// Whether a dictionary in a type has keys that it cannot have. Named types were looked at.
fn has_other_keys(ty: &Type) -> bool {
    match ty {
        Type::Primitive(_) | Type::Text { .. } | Type::Named(_) => false,
        Type::Sequence { element, .. } | Type::Array { element, .. } => has_other_keys(element),
        Type::Dictionary { key, value } => match &**key {
            Type::Primitive(_) | Type::Text { .. } | Type::Named(Named::Enum(_)) => {
                has_other_keys(value)
            }
            Type::Named(Named::Struct(_))
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. } => true,
        },
    }
}

fn member(place: &str, member: &description::Member, ty: Type) -> Result<Member, DescriptionError> {
    let wrong = |reason: &str| DescriptionError::new(place, reason);
    let is_number = matches!(&ty, Type::Primitive(of) if *of != Primitive::Bool);
    if member.range.is_some() && !is_number {
        return Err(wrong("it has a range and is not a number"));
    }
    let is_integer = matches!(&ty, Type::Primitive(of) if of.limits().is_some());
    let ends = |end: &Option<_>| end.as_ref().map(|number| limit(number, is_integer));
    let range = member.range.as_ref();
    let resolved = Member {
        name: member.name.clone(),
        ty,
        optional: member.optional,
        unit: member.unit.clone(),
        range: range.map(|(min, max)| Range {
            min: ends(min),
            max: ends(max),
        }),
        default: member.default.clone(),
    };
    if let Some(default) = &resolved.default {
        json::of_type(&resolved.ty, default).map_err(|error| wrong(&error.reason))?;
    }
    Ok(resolved)
}
