//! Definitions of types that are not part of ROS 2, from which a component computes its type
//! hashes.

use super::mapping::{self, Field, Mapper};
use super::names::{self, Kind};
use crate::export::uses::is_topic;
use rc_diagnostics::Diagnostics;
use rc_idsl::Library;
use rc_idsl::model::TypeDeclKind;
use rc_ros_types::{STANDARD, TypeDescription, Types};
use std::collections::BTreeSet;

/// The definitions of the types `wanted` and of the types that they refer to, sorted, in the form
/// that `rc_ros_types::Types` reads. Types of ROS 2 have none. Messages of other packages, which
/// annotations name, are assumed to have the fields of the annotated declaration; services of other
/// packages have no definition.
pub fn definitions(library: &Library, wanted: &[String]) -> Vec<String> {
    let all = all(library);
    let types = Types::read(all.iter().map(String::as_str));
    let mut needed = BTreeSet::new();
    for name in wanted {
        let Some(found) = TypeDescription::of(name, &types) else {
            continue;
        };
        for one in [&found.main].into_iter().chain(&found.referenced) {
            // The parts of a service are in the line of the service.
            needed.extend(types.name(&one.name));
        }
    }
    let is_needed = |line: &String| {
        let name = line.split(':').next().unwrap_or_default();
        needed.contains(name) && STANDARD.get(name).is_none()
    };
    let lines: BTreeSet<&String> = all.iter().filter(|line| is_needed(line)).collect();
    lines.into_iter().cloned().collect()
}

/// The definitions of all messages and services of a library.
fn all(library: &Library) -> Vec<String> {
    let mut unused = Diagnostics::new();
    let mut lines = Vec::new();
    for package in mapping::packages(library, &mut unused) {
        let name = &package.name;
        let messages = package.messages.iter();
        lines.extend(messages.map(|m| line(&format!("{name}/msg/{}", m.name), &m.fields)));
        for service in &package.services {
            let request = line(&format!("{name}/srv/{}", service.name), &service.request);
            lines.push(format!("{request} --- {}", fields(&service.response)));
        }
    }
    for decl in &library.types {
        if let (Some(ros), TypeDeclKind::Struct(members)) = (&decl.ros_type, &decl.kind) {
            let mut mapper = Mapper::new(library, decl.module, &mut unused);
            lines.push(line(&ros.text, &mapper.fields("", members)));
        }
    }
    for interface in &library.interfaces {
        for operation in interface
            .operations
            .iter()
            .filter(|o| is_topic(interface, o))
        {
            let annotated = names::annotated(operation, Kind::Message);
            let Some((_, name)) = annotated else {
                continue;
            };
            let members = names::structure_of_topic(library, operation)
                .map(|only| (library.ty(only).module, &library.ty(only).kind));
            let (module, members) = match members {
                Some((module, TypeDeclKind::Struct(members))) => (module, members),
                _ => (interface.module, &operation.inputs),
            };
            let mut mapper = Mapper::new(library, module, &mut unused);
            lines.push(line(&name.to_string(), &mapper.fields("", members)));
        }
    }
    lines
}

fn line(name: &str, all: &[Field]) -> String {
    format!("{name}: {}", fields(all))
}

fn fields(all: &[Field]) -> String {
    let all = all.iter();
    let all = all.map(|field| format!("{} {}", field.ty.written(""), field.name));
    all.collect::<Vec<_>>().join(", ")
}
