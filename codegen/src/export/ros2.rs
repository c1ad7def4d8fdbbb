//! Exports interface packages of ROS 2 for colcon.

use super::HEADER;
use crate::Files;
use crate::files::Owner;
use crate::ros::{self, Constant, Field, Package, sanitized};
use rc_diagnostics::xml::escaped;
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_idsl::Library;

/// Exports each module to a package in its own folder. Skips modules without messages and services.
pub fn ros2(library: &Library, sources: &SourceMap) -> (Files, Diagnostics) {
    let mut found = ros::annotations(library);
    let packages = ros::packages(library, &mut found);
    let mut files = Files::default();
    for (package, module) in packages.iter().zip(&library.modules) {
        if package.messages.is_empty() && package.services.is_empty() {
            continue;
        }
        let source = sources.path(module.source).file_name().unwrap_or_default();
        let first = format!(
            "{HEADER} from {}; rewritten at every export.",
            source.to_string_lossy()
        );
        let mut add = |path: &str, text: String| {
            files.add(format!("{}/{path}", package.name), Owner::Exported, text);
        };
        let mut interfaces = Vec::new();
        for message in &package.messages {
            let path = format!("msg/{}.msg", message.name);
            let mut text = head(&first, &message.doc);
            text += &constants(&message.constants);
            text += &fields(&message.fields, &package.name);
            add(&path, text);
            interfaces.push(path);
        }
        for service in &package.services {
            let path = format!("srv/{}.srv", service.name);
            let mut text = head(&first, &service.doc);
            text += &fields(&service.request, &package.name);
            // Without the empty line, the first comment would document the whole response.
            text += "---\n\n";
            text += &constants(&service.constants);
            text += &fields(&service.response, &package.name);
            add(&path, text.trim_end().to_owned() + "\n");
            interfaces.push(path);
        }
        add("CMakeLists.txt", cmake(&first, package, &interfaces));
        add(
            "package.xml",
            manifest(&first, package, &module.doc, &module.name.text),
        );
    }
    (files, found)
}

/// The comment at the start of a file.
fn head(first: &str, doc: &[String]) -> String {
    let doc: String = doc.iter().map(|line| comment(line)).collect();
    format!("# {first}\n{doc}\n")
}

fn comment(line: &str) -> String {
    format!("# {}", sanitized(line)).trim_end().to_owned() + "\n"
}

fn constants(all: &[Constant]) -> String {
    let text = all.iter().map(|one| {
        let doc: String = one.doc.iter().map(|line| comment(line)).collect();
        format!("{doc}{} {}={}\n", one.ty, one.name, one.value)
    });
    text.collect()
}

fn fields(all: &[Field], package: &str) -> String {
    let text = all.iter().map(|field| {
        let mut doc: Vec<String> = field.doc.iter().map(|line| comment(line)).collect();
        if let Some(unit) = &field.unit {
            // `rosidl` reads the unit in brackets.
            let unit = format!("[{}]\n", sanitized(unit));
            match doc.last_mut() {
                Some(last) => *last = format!("{} {unit}", last.trim_end()),
                None => doc.push(format!("# {unit}")),
            }
        }
        let default = field
            .default
            .as_ref()
            .map_or(String::new(), |value| format!(" {value}"));
        let ty = field.ty.written(package);
        format!("{}{ty} {}{default}\n", doc.concat(), field.name)
    });
    text.collect()
}

fn cmake(first: &str, package: &Package, interfaces: &[String]) -> String {
    let (name, depends) = (&package.name, package.depends());
    let find: String = depends
        .iter()
        .map(|other| format!("find_package({other} REQUIRED)\n"))
        .collect();
    let list: String = interfaces
        .iter()
        .map(|path| format!("  \"{path}\"\n"))
        .collect();
    let depends: String = depends.iter().map(|other| format!(" {other}")).collect();
    let depends = if depends.is_empty() {
        depends
    } else {
        format!("  DEPENDENCIES{depends}\n")
    };
    format!(
        "# {first}
cmake_minimum_required(VERSION 3.8)
project({name})

find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{find}
rosidl_generate_interfaces(${{PROJECT_NAME}}
{list}{depends})

ament_export_dependencies(rosidl_default_runtime)
ament_package()
"
    )
}

/// The file `package.xml`. It has no XML declaration, which would have to be before the first
/// comment.
fn manifest(first: &str, package: &Package, doc: &[String], module: &str) -> String {
    let doc: Vec<String> = doc.iter().map(|line| escaped(line)).collect();
    let description = match doc.join(" ") {
        text if text.trim().is_empty() => format!("The interfaces of the module {module}."),
        text => text,
    };
    let depends: String = package
        .depends()
        .iter()
        .map(|other| format!("  <depend>{other}</depend>\n"))
        .collect();
    let depends = format!(
        "  <buildtool_depend>rosidl_default_generators</buildtool_depend>

{depends}  <exec_depend>rosidl_default_runtime</exec_depend>

  <member_of_group>rosidl_interface_packages</member_of_group>
"
    );
    package_file(first, &package.name, &description, &depends)
}

/// A `package.xml` with lines about the dependencies of the package.
pub(super) fn package_file(first: &str, name: &str, description: &str, depends: &str) -> String {
    format!(
        "<!-- {first} -->
<package format=\"3\">
  <name>{name}</name>
  <version>0.1.0</version>
  <description>{description}</description>
  <maintainer email=\"nobody@example.com\">nobody</maintainer>
  <license>unspecified</license>

  <buildtool_depend>ament_cmake</buildtool_depend>
{depends}
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"
    )
}
