//! Compares declarations that have an `@ros` annotation with their ROS 2 types.

use super::mapping::{self, Field, Mapper};
use super::names::{self, Kind, TypeName};
use super::standard;
use crate::export::uses::{is_call, is_topic};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_idsl::Library;
use rc_idsl::model::{Interface, Member, ModuleId, Operation, TypeDecl, TypeDeclKind};
use rc_ros_types::words;
use rc_syntax::Name;

/// Checks every `@ros` against the types of ROS 2. Notes report types of unknown packages. The
/// library must be free of errors.
pub fn annotations(library: &Library) -> Diagnostics {
    let mut checker = Checker {
        library,
        found: Diagnostics::new(),
    };
    for module in &library.modules {
        checker.package(module.ros_package.as_ref());
    }
    for decl in &library.types {
        checker.structure(decl);
    }
    for interface in &library.interfaces {
        for operation in &interface.operations {
            checker.operation(interface, operation);
        }
    }
    checker.found
}

/// The finding about the name of an own package, if it is invalid or one of ROS 2.
pub(crate) fn wrong_package(name: &str, span: Span) -> Option<Diagnostic> {
    let (message, help) = if !words::is_package(name) {
        (
            format!("invalid name of a ROS 2 package `{name}`"),
            "use lower-case letters, digits and single `_`, and begin with a letter",
        )
    } else if standard::has_package(name) {
        (
            format!("`{name}` is a package of ROS 2"),
            "choose a name of your own; annotate single structs of an interface with `@ros`",
        )
    } else {
        return None;
    };
    Some(Diagnostic::error("ros-name", span, message).help(help))
}

/// A member, a parameter or a result, which is compared with a field of a ROS 2 type.
struct ComparedValue {
    /// How messages name it.
    what: String,
    span: Span,
    /// Name in ROS 2. `None` for a return value.
    name: Option<String>,
    /// Type in ROS 2.
    ty: String,
}

struct Checker<'a> {
    library: &'a Library,
    found: Diagnostics,
}

impl Checker<'_> {
    fn wrong(&mut self, span: Span, message: String, help: impl Into<String>) {
        let diagnostic = Diagnostic::error("ros-type", span, message);
        self.found.push(diagnostic.help(help));
    }

    fn package(&mut self, name: Option<&Name>) {
        let Some(Name { text, span }) = name else {
            return;
        };
        self.found.extend(wrong_package(text, *span));
    }

    fn structure(&mut self, decl: &TypeDecl) {
        let (Some(ros), TypeDeclKind::Struct(members)) = (&decl.ros_type, &decl.kind) else {
            return;
        };
        let help = "write the name of a message such as `sensor_msgs/msg/LaserScan`";
        match TypeName::parse(&ros.text) {
            Some(name) if name.kind == Kind::Message => {
                if let Some(standard) = self.known(&name, ros.span) {
                    let own = self.members(decl.module, members);
                    let what = format!("struct `{}`", decl.name.text);
                    let wrong = different(&what, decl.name.span, &own, &name, &standard.fields);
                    self.found.extend(wrong);
                }
            }
            Some(_) => {
                let message = format!(
                    "expected a message for struct `{}`, found a service",
                    decl.name.text
                );
                self.wrong(ros.span, message, help);
            }
            None => {
                let message = format!("invalid name of a message `{}`", ros.text);
                self.wrong(ros.span, message, meant(&ros.text, help));
            }
        }
    }

    fn operation(&mut self, interface: &Interface, operation: &Operation) {
        let own = &operation.name.text;
        let mut seen: Vec<(Kind, Span)> = Vec::new();
        for ros in &operation.ros_types {
            let Some(name) = TypeName::parse(&ros.text) else {
                let message = format!("invalid name of a message or a service `{}`", ros.text);
                let help = "write a name such as `std_msgs/msg/String` for a topic, or `std_srvs/srv/Trigger` for a call";
                self.wrong(ros.span, message, meant(&ros.text, help));
                continue;
            };
            if let Some((_, first)) = seen.iter().find(|(kind, _)| *kind == name.kind) {
                let message = format!("duplicate `{}` type of `{own}`", name.kind.word());
                let diagnostic = Diagnostic::error("ros-type", ros.span, message);
                self.found.push(diagnostic.label(*first, "first used here"));
                continue;
            }
            seen.push((name.kind, ros.span));
            match name.kind {
                Kind::Message if !is_topic(interface, operation) => {
                    let message =
                        format!("expected a service for the call `{own}`, found a message");
                    let help = "write the name of a service such as `std_srvs/srv/Trigger`";
                    self.wrong(ros.span, message, help);
                }
                Kind::Service if !is_call(interface, operation) => {
                    let message =
                        format!("expected a message for the topic `{own}`, found a service");
                    let help = "write the name of a message such as `std_msgs/msg/String`";
                    self.wrong(ros.span, message, help);
                }
                Kind::Message => self.topic(interface, operation, &name, ros.span),
                Kind::Service => self.service(interface, operation, &name, ros.span),
            }
        }
    }

    fn topic(&mut self, interface: &Interface, operation: &Operation, name: &TypeName, at: Span) {
        let Some(standard) = self.known(name, at) else {
            return;
        };
        let what = format!("operation `{}`", operation.name.text);
        let own = self.members(interface.module, &operation.inputs);
        let wrong = different(&what, operation.name.span, &own, name, &standard.fields);
        if wrong.is_empty() {
            return;
        }
        // A struct has the same encoding as its members.
        let only = names::structure_of_topic(self.library, operation);
        let decl = only.map(|id| self.library.ty(id));
        let wrong = match decl.map(|decl| (decl, &decl.kind)) {
            Some((decl, TypeDeclKind::Struct(members))) => {
                let own = self.members(decl.module, members);
                different(&what, operation.name.span, &own, name, &standard.fields)
            }
            _ => wrong,
        };
        self.found.extend(wrong);
    }

    fn service(&mut self, interface: &Interface, operation: &Operation, name: &TypeName, at: Span) {
        let Some(standard) = self.known(name, at) else {
            return;
        };
        let own = &operation.name.text;
        let request = self.members(interface.module, &operation.inputs);
        let what = format!("the request of `{own}`");
        let at = operation.name.span;
        let wrong = different(&what, at, &request, name, &standard.fields);
        self.found.extend(wrong);
        if !operation.throws.is_empty() {
            let message = format!("`{own}` throws, but `{name}` has no field for exceptions");
            let help = "report errors in `out` parameters";
            let diagnostic = Diagnostic::error("ros-mismatch", at, message);
            self.found.push(diagnostic.help(help));
            return;
        }
        let mut response = self.members(interface.module, &operation.outputs);
        if let Some(ty) = &operation.result {
            let result = mapping::member("result", ty, &operation.name);
            let result = self.members(interface.module, &[result]);
            response.extend(result.into_iter().map(|result| ComparedValue {
                what: "the return value".to_owned(),
                name: None,
                ..result
            }));
        }
        let what = format!("the response of `{own}`");
        let wrong = different(&what, at, &response, name, &standard.response);
        self.found.extend(wrong);
    }

    /// The fields of a ROS 2 type. Reports a type or a package that is unknown.
    fn known(
        &mut self,
        name: &TypeName,
        at: Span,
    ) -> Option<&'static rc_ros_types::Definition<'static>> {
        let found = standard::of(name);
        if found.is_some() {
            return found;
        }
        let others = standard::names(&name.package, name.kind);
        if others.is_empty() {
            let message = format!("the fields of `{name}` are unknown and not compared");
            let note = Diagnostic::note("ros-unchecked", at, message);
            self.found
                .push(note.did_you_mean(&name.to_string(), standard::elsewhere(name)));
        } else {
            let message = format!(
                "`{}` has no `{}/{}`",
                name.package,
                name.kind.word(),
                name.name
            );
            let near = rc_diagnostics::nearest(&name.to_string(), others);
            let diagnostic = Diagnostic::error("ros-type", at, message);
            self.found
                .push(diagnostic.did_you_mean(&name.to_string(), near));
        }
        None
    }

    fn members(&self, module: ModuleId, members: &[Member]) -> Vec<ComparedValue> {
        let mut unused = Diagnostics::new();
        let fields = Mapper::new(self.library, module, &mut unused).fields("", members);
        let own = |(field, member): (&Field, &Member)| ComparedValue {
            what: called(member),
            span: member.name.span,
            name: Some(field.name.clone()),
            ty: field.ty.written(""),
        };
        fields.iter().zip(members).map(own).collect()
    }
}

fn called(member: &Member) -> String {
    format!("`{}`", member.name.text)
}

/// The help for an invalid name: a similar type, otherwise `help`.
fn meant(text: &str, help: &str) -> String {
    match standard::near(text) {
        Some(near) => format!("did you mean `{near}`?"),
        None => help.to_owned(),
    }
}

/// The differences between `own` and the fields of `name`.
fn different(
    what: &str,
    span: Span,
    own: &[ComparedValue],
    name: &TypeName,
    fields: &[rc_ros_types::Field<'static>],
) -> Vec<Diagnostic> {
    if own.len() != fields.len() {
        let message = format!(
            "{what} has {}, but `{name}` has {}",
            count(own.len(), "member"),
            count(fields.len(), "field")
        );
        let list: Vec<String> = fields.iter().map(|field| in_idsl(*field).0).collect();
        let diagnostic = Diagnostic::error("ros-mismatch", span, message);
        return vec![if list.is_empty() {
            diagnostic.help("remove the members")
        } else {
            diagnostic.help(format!("declare {}", list.join("; ")))
        }];
    }
    let pairs = own.iter().zip(fields);
    let wrong = pairs.filter_map(|(own, (ty, field))| {
        let name_fits = own.name.as_ref().is_none_or(|own| own == field);
        let same = normal(ty) == own.ty;
        if name_fits && same {
            return None;
        }
        let is = match &own.name {
            Some(name) => format!("{} {name}", own.ty),
            None => own.ty.clone(),
        };
        let message = format!(
            "{} is `{is}` in ROS 2, but `{name}` has `{ty} {field}`",
            own.what
        );
        let (wanted, marked) = in_idsl((ty, field));
        let help = match marked {
            Some(package) if !same => {
                format!("write `{wanted}` with a struct that has `@ros(\"{package}\")`")
            }
            _ => format!("write `{wanted}`"),
        };
        Some(Diagnostic::error("ros-mismatch", own.span, message).help(help))
    });
    wrong.collect()
}

fn count(number: usize, what: &str) -> String {
    match number {
        0 => format!("no {what}"),
        1 => format!("one {what}"),
        many => format!("{many} {what}s"),
    }
}

/// Replaces `byte` and `char` by their alias `uint8`.
fn normal(ty: &str) -> String {
    for word in ["byte", "char"] {
        if let Some(rest) = ty.strip_prefix(word)
            && (rest.is_empty() || rest.starts_with('['))
        {
            return format!("uint8{rest}");
        }
    }
    ty.to_owned()
}

/// A field as a member of a struct, and the message type of the member.
fn in_idsl((ty, field): rc_ros_types::Field<'static>) -> (String, Option<String>) {
    let ty = normal(ty);
    let (element, many) = ty.split_once('[').unwrap_or((&ty, ""));
    let (element, message) = match element.split_once('/') {
        Some((package, name)) => (name, Some(format!("{package}/msg/{name}"))),
        None => (element, None),
    };
    let many = many.trim_end_matches(']');
    let text = if many.is_empty() && ty.contains('[') {
        format!("sequence<{element}> {field}")
    } else if let Some(bound) = many.strip_prefix("<=") {
        format!("sequence<{element}, {bound}> {field}")
    } else if many.is_empty() {
        format!("{element} {field}")
    } else {
        format!("{element} {field}[{many}]")
    };
    (text, message)
}
