//! Maps a module to ROS 2 messages and services. Their encoding equals that of components: in
//! XCDR1, a struct has the same encoding as its members.

use super::comments;
use super::fields::{Element, FieldType, Multiplicity};
use super::names::{self, Kind, TypeName};
use crate::export::literal::plain;
use crate::export::uses::{is_call, is_topic};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::Library;
use rc_idsl::model::{
    Const, Enumerator, Interface, InterfaceId, Member, ModuleId, Operation, Type, TypeDeclKind,
    TypeId,
};
use rc_ros_types::words;
use rc_syntax::Name;
use std::collections::{BTreeSet, HashMap};

/// The ROS 2 package of a module.
pub(crate) struct Package {
    pub(crate) name: String,
    pub(crate) messages: Vec<Message>,
    pub(crate) services: Vec<Service>,
}

pub(crate) struct Message {
    pub(crate) name: String,
    /// The declaration it is generated from.
    origin: Name,
    pub(crate) doc: Vec<String>,
    pub(crate) constants: Vec<Constant>,
    pub(crate) fields: Vec<Field>,
}

pub(crate) struct Service {
    pub(crate) name: String,
    /// The declaration it is generated from.
    origin: Name,
    pub(crate) doc: Vec<String>,
    pub(crate) request: Vec<Field>,
    /// The values of `code` in the response.
    pub(crate) constants: Vec<Constant>,
    pub(crate) response: Vec<Field>,
}

pub(crate) struct Constant {
    pub(crate) ty: String,
    pub(crate) name: String,
    pub(crate) value: String,
    pub(crate) doc: Vec<String>,
}

pub(crate) struct Field {
    pub(crate) ty: FieldType,
    pub(crate) name: String,
    /// The default value, as written after the name.
    pub(crate) default: Option<String>,
    pub(crate) doc: Vec<String>,
    pub(crate) unit: Option<String>,
}

impl Package {
    /// The other packages whose messages are types of fields.
    pub(crate) fn depends(&self) -> BTreeSet<&str> {
        let of_messages = self.messages.iter().flat_map(|m| &m.fields);
        let of_services = self.services.iter().flat_map(|s| [&s.request, &s.response]);
        let all = of_messages.chain(of_services.flatten());
        let packages = all.filter_map(|field| field.ty.package());
        packages.filter(|package| *package != self.name).collect()
    }
}

/// The packages of all modules, in the order of the modules.
pub(crate) fn packages(library: &Library, found: &mut Diagnostics) -> Vec<Package> {
    let ids = (0..library.modules.len()).map(ModuleId);
    let packages = ids.map(|id| package(library, id, found));
    let packages: Vec<Package> = packages.collect();
    let mut seen: HashMap<&str, &Name> = HashMap::new();
    for (package, module) in packages.iter().zip(&library.modules) {
        let Some(first) = seen.insert(&package.name, &module.name) else {
            continue;
        };
        let message = format!(
            "modules `{}` and `{}` both become the package `{}` in ROS 2",
            first.text, module.name.text, package.name
        );
        found.push(
            Diagnostic::error("ros-name", module.name.span, message)
                .label(first.span, "other module")
                .help("set another package before `module`: `@ros(\"robot_msgs\")`"),
        );
    }
    packages
}

fn package(library: &Library, id: ModuleId, found: &mut Diagnostics) -> Package {
    let module = library.module(id);
    let mut mapper = Mapper::new(library, id, found);
    for ty in &module.types {
        mapper.declared(*ty);
    }
    let mut services = Vec::new();
    for interface in &module.interfaces {
        services.extend(mapper.interface(*interface));
    }
    if !module.consts.is_empty() {
        mapper.constants(&module.consts, &module.name);
    }
    let (name, messages) = (mapper.package, mapper.messages);
    unique(
        messages.iter().map(|m| (&m.name, &m.origin)),
        Kind::Message,
        found,
    );
    unique(
        services.iter().map(|s| (&s.name, &s.origin)),
        Kind::Service,
        found,
    );
    Package {
        name,
        messages,
        services,
    }
}

/// Reports names that differ only in case: their files are equal on many file systems, and the
/// names are equal in generated code.
fn unique<'a>(
    names: impl Iterator<Item = (&'a String, &'a Name)>,
    kind: Kind,
    found: &mut Diagnostics,
) {
    let mut seen: HashMap<String, (&String, &Name)> = HashMap::new();
    for (name, origin) in names {
        let Some((other, first)) = seen.insert(name.to_lowercase(), (name, origin)) else {
            continue;
        };
        let word = kind.word();
        let message = if name == other {
            format!(
                "`{}` and `{}` both become `{word}/{name}` in ROS 2",
                first.text, origin.text
            )
        } else {
            format!(
                "`{}` and `{}` become `{word}/{other}` and `{word}/{name}` in ROS 2, which differ only in case",
                first.text, origin.text
            )
        };
        found.push(
            Diagnostic::error("ros-name", origin.span, message)
                .label(first.span, "other declaration")
                .help("rename one of them"),
        );
    }
}

/// Maps the declarations of one module.
pub(super) struct Mapper<'a, 'f> {
    library: &'a Library,
    package: String,
    messages: Vec<Message>,
    /// The current member.
    at: Name,
    found: &'f mut Diagnostics,
}

impl<'a, 'f> Mapper<'a, 'f> {
    pub(super) fn new(library: &'a Library, module: ModuleId, found: &'f mut Diagnostics) -> Self {
        Self {
            library,
            package: names::package(library, module),
            messages: Vec::new(),
            at: library.module(module).name.clone(),
            found,
        }
    }

    fn declared(&mut self, id: TypeId) {
        let decl = self.library.ty(id);
        let name = names::message(self.library, id).name;
        let (mut doc, mut constants, mut fields) = (decl.doc.clone(), Vec::new(), Vec::new());
        match &decl.kind {
            TypeDeclKind::Struct(_) if decl.ros_type.is_some() => return,
            TypeDeclKind::Struct(members) => fields = self.fields(&name, members),
            TypeDeclKind::Exception(members) => {
                doc.push("An exception.".to_owned());
                fields = self.fields(&name, members);
            }
            TypeDeclKind::Enum(values) => {
                doc.push("An enum: fields of it are an int32 with one of these values.".to_owned());
                constants = self.enumerators(values);
            }
            TypeDeclKind::Alias(Type::Dictionary { key, value }) => {
                doc.push("One entry of a dictionary.".to_owned());
                let field = |part: &str, ty: &Type| member(part, ty, &decl.name);
                fields = self.fields(&name, &[field("key", key), field("value", value)]);
            }
            TypeDeclKind::Alias(_) => return,
        }
        self.messages.push(Message {
            name,
            origin: decl.name.clone(),
            doc,
            constants,
            fields,
        });
    }

    fn enumerators(&mut self, values: &[Enumerator]) -> Vec<Constant> {
        let names = values
            .iter()
            .map(|v| (&v.name, words::constant(&v.name.text)));
        self.collisions(names.collect(), "enumerators");
        let constants = values.iter().map(|value| Constant {
            ty: "int32".to_owned(),
            name: words::constant(&value.name.text),
            value: value.value.to_string(),
            doc: value.doc.clone(),
        });
        constants.collect()
    }

    /// Maps the constants of a module to a message of their own.
    fn constants(&mut self, consts: &[Const], module: &Name) {
        let names = consts
            .iter()
            .map(|c| (&c.name, words::constant(&c.name.text)));
        self.collisions(names.collect(), "constants");
        let mut name = "Constants".to_owned();
        while self
            .messages
            .iter()
            .any(|m| m.name.eq_ignore_ascii_case(&name))
        {
            name = format!("Module{name}");
        }
        let mut doc = vec![format!("The constants of the module {}.", module.text)];
        let mut constants = Vec::new();
        for one in consts {
            let ty = self.library.resolved(&one.ty);
            let name = words::constant(&one.name.text);
            match comments::value(self.library, ty, &one.value) {
                Some(value) => constants.push(Constant {
                    // Constants have no bound.
                    ty: match ty {
                        Type::Text { .. } => "string".to_owned(),
                        Type::Primitive(_)
                        | Type::Sequence { .. }
                        | Type::Array { .. }
                        | Type::Dictionary { .. }
                        | Type::Named(_) => self.member_type(ty, false, "").written(&self.package),
                    },
                    name,
                    value,
                    doc: one.doc.clone(),
                }),
                None => doc.push(format!("{name} is {}", plain(&one.value))),
            }
        }
        self.messages.push(Message {
            name,
            origin: module.clone(),
            doc,
            constants,
            fields: Vec::new(),
        });
    }

    fn interface(&mut self, id: InterfaceId) -> Vec<Service> {
        let interface = self.library.interface(id);
        let mut services = Vec::new();
        for operation in &interface.operations {
            if is_topic(interface, operation) {
                self.topic(id, interface, operation);
            }
            let annotated = names::annotated(operation, Kind::Service).is_some();
            if is_call(interface, operation) && !annotated {
                let name = names::service_type(self.library, id, operation).name;
                let (constants, response) = self.response(&name, operation);
                services.push(Service {
                    doc: doc_of(interface, operation),
                    request: self.fields(&format!("{name}Request"), &operation.inputs),
                    constants,
                    response,
                    name,
                    origin: operation.name.clone(),
                });
            }
        }
        services
    }

    fn topic(&mut self, id: InterfaceId, interface: &Interface, operation: &Operation) {
        let annotated = names::annotated(operation, Kind::Message).is_some();
        if annotated || names::structure_of_topic(self.library, operation).is_some() {
            return;
        }
        let name = names::topic_type(self.library, id, operation).name;
        let fields = self.fields(&name, &operation.inputs);
        self.messages.push(Message {
            name,
            origin: operation.name.clone(),
            doc: doc_of(interface, operation),
            constants: Vec::new(),
            fields,
        });
    }

    /// The response of an operation: if it throws, a code and a field for each exception; then the
    /// `out` parameters; then the return value.
    pub(super) fn response(
        &mut self,
        service: &str,
        operation: &Operation,
    ) -> (Vec<Constant>, Vec<Field>) {
        let place = format!("{service}Response");
        let out = self.fields(&place, &operation.outputs);
        let mut taken: BTreeSet<String> = out.iter().map(|field| field.name.clone()).collect();
        let (mut constants, mut fields) = (Vec::new(), Vec::new());
        if !operation.throws.is_empty() {
            constants.push(code("OK", 0));
            fields.push(Field {
                ty: FieldType::one(Element::Word("int32")),
                name: free(&mut taken, "code", "of_result"),
                default: None,
                doc: vec!["OK, or which of the exceptions was thrown.".to_owned()],
                unit: None,
            });
        }
        let mut codes = BTreeSet::from(["OK".to_owned()]);
        let mut seen: HashMap<String, &Name> = HashMap::new();
        for (exception, number) in operation.throws.iter().zip(1..) {
            let declared = &self.library.ty(*exception).name;
            let name = &declared.text;
            let field = words::field(name);
            if let Some(first) = seen.insert(field.clone(), declared) {
                let what = &operation.name.text;
                let message =
                    format!("`{what}` throws two exceptions that become `{field}` in ROS 2");
                self.found.push(
                    Diagnostic::error("ros-name", operation.name.span, message)
                        .label(first.span, "first exception")
                        .label(declared.span, "second exception"),
                );
            }
            let constant = free(&mut codes, &words::constant(name), "EXCEPTION");
            let doc = format!("Thrown where the code is {constant}; else of no meaning.");
            constants.push(code(&constant, number));
            fields.push(Field {
                ty: FieldType::one(self.message(*exception)),
                name: free(&mut taken, &field, "exception"),
                default: None,
                doc: vec![doc],
                unit: None,
            });
        }
        fields.extend(out);
        if let Some(ty) = &operation.result {
            let result = member("result", ty, &operation.name);
            let mut result = self.field(&place, &result);
            result.name = free(&mut taken, "result", "value");
            fields.push(result);
        }
        (constants, fields)
    }

    /// Maps members to the fields of the message `place`.
    pub(super) fn fields(&mut self, place: &str, members: &[Member]) -> Vec<Field> {
        let names = members
            .iter()
            .map(|m| (&m.name, words::field(&m.name.text)));
        self.collisions(names.collect(), "members");
        members.iter().map(|m| self.field(place, m)).collect()
    }

    fn field(&mut self, place: &str, member: &Member) -> Field {
        let inner = format!("{place}{}Element", words::camel(&member.name.text));
        self.at = member.name.clone();
        Field {
            ty: self.member_type(&member.ty, member.optional, &inner),
            name: words::field(&member.name.text),
            default: comments::default(self.library, member),
            doc: comments::of_member(self.library, member),
            unit: member.unit.clone(),
        }
    }

    /// The type of a field. If its elements have no type in ROS 2, they get a message named
    /// `inner`.
    fn member_type(&mut self, ty: &Type, optional: bool, inner: &str) -> FieldType {
        if optional {
            let element = self.element(ty, inner);
            return FieldType {
                element,
                multiplicity: Multiplicity::Sequence(Some(1)),
            };
        }
        match ty {
            Type::Sequence { element, bound } => FieldType {
                element: self.element(element, inner),
                multiplicity: Multiplicity::Sequence(*bound),
            },
            Type::Array {
                element,
                length: size,
            } => FieldType {
                element: self.element(element, inner),
                multiplicity: Multiplicity::Array(*size),
            },
            Type::Named(id) => match &self.library.ty(*id).kind {
                TypeDeclKind::Alias(Type::Dictionary { .. }) => FieldType {
                    element: self.message(*id),
                    multiplicity: Multiplicity::Sequence(None),
                },
                TypeDeclKind::Alias(ty) => self.member_type(ty, false, inner),
                TypeDeclKind::Enum(_) => FieldType::one(Element::Word("int32")),
                TypeDeclKind::Struct(_) | TypeDeclKind::Exception(_) => {
                    FieldType::one(self.message(*id))
                }
            },
            Type::Primitive(primitive) => FieldType::one(Element::primitive(*primitive)),
            Type::Text { bound } => FieldType::one(Element::String(*bound)),
            // Only an alias can be a dictionary. It has a message for its entries.
            Type::Dictionary { value, .. } => self.member_type(value, false, inner),
        }
    }

    fn message(&self, id: TypeId) -> Element {
        Element::Message(names::message(self.library, id))
    }

    /// The type of an element. ROS 2 has no nested arrays: a nested array becomes a message with
    /// one field, which has the same encoding.
    fn element(&mut self, ty: &Type, name: &str) -> Element {
        let inner = self.member_type(ty, false, &format!("{name}Element"));
        if inner.multiplicity == Multiplicity::One {
            return inner.element;
        }
        self.messages.push(Message {
            name: name.to_owned(),
            origin: self.at.clone(),
            doc: vec!["One element, which ROS 2 has no type for.".to_owned()],
            constants: Vec::new(),
            fields: vec![Field {
                ty: inner,
                name: "data".to_owned(),
                default: None,
                doc: Vec::new(),
                unit: None,
            }],
        });
        Element::Message(TypeName {
            package: self.package.clone(),
            kind: Kind::Message,
            name: name.to_owned(),
        })
    }

    /// Reports names that become equal in ROS 2.
    fn collisions(&mut self, names: Vec<(&Name, String)>, what: &str) {
        let mut seen: HashMap<String, &Name> = HashMap::new();
        for (name, ros) in names {
            let Some(first) = seen.insert(ros.clone(), name) else {
                continue;
            };
            let message = format!(
                "{what} `{}` and `{}` both become `{ros}` in ROS 2",
                first.text, name.text
            );
            self.found.push(
                Diagnostic::error("ros-name", name.span, message)
                    .label(first.span, "other declaration")
                    .help("rename one of them"),
            );
        }
    }
}

fn doc_of(interface: &Interface, operation: &Operation) -> Vec<String> {
    let mut doc = operation.doc.clone();
    let (interface, operation) = (&interface.name.text, &operation.name.text);
    doc.push(format!(
        "The operation {operation} of the interface {interface}."
    ));
    doc
}

/// A member without a declaration.
pub(super) fn member(name: &str, ty: &Type, at: &Name) -> Member {
    Member::plain(Name::new(name, at.span), ty.clone())
}

fn code(name: &str, value: u32) -> Constant {
    Constant {
        ty: "int32".to_owned(),
        name: name.to_owned(),
        value: value.to_string(),
        doc: Vec::new(),
    }
}

/// An unused name: `name`, with `_more` appended until it is unused.
fn free(taken: &mut BTreeSet<String>, name: &str, more: &str) -> String {
    let mut name = name.to_owned();
    while !taken.insert(name.clone()) {
        name = format!("{name}_{more}");
    }
    name
}
