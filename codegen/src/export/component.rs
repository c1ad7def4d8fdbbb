//! Exports a component as a package of ROS 2, which `ros2 run` and launch files start.

use super::HEADER;
use super::ros2::package_file;
use crate::files::{Files, Owner};
use crate::note::Note;
use crate::{Project, names, ros};
use rc_cdsl::model::Middleware;
use rc_diagnostics::xml::escaped;
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::io;

/// Exports the component to a package in its own folder, with a launch file. Its generated code has
/// to be for ROS 2.
///
/// # Errors
/// The system cannot open the folder of the component.
pub fn component(project: &Project) -> io::Result<(Files, Diagnostics)> {
    let mut found = Diagnostics::new();
    let component = &project.component;
    let package = names::package(&component.name.text);
    if let Some(diagnostic) = ros::wrong_package(&package, component.name.span) {
        found.push(diagnostic);
    }
    let folder = project.folder().canonicalize()?;
    let ros2 = Middleware::Ros2;
    let is_slot = component
        .slots
        .iter()
        .any(|slot| slot.backend == Some(ros2));
    let of_ros = Note::of_generated(&folder).ok().flatten();
    if !is_slot && of_ros.is_none_or(|note| note.middleware != ros2.word()) {
        let message = format!("`{package}` was not generated for ROS 2");
        let diagnostic = Diagnostic::error("not-for-ros", component.name.span, message);
        let file = project.path.display();
        found.push(diagnostic.help(format!("generate it: `rcgen {file} --middleware ros2`")));
    }
    let source = project.path.file_name().unwrap_or_default();
    let source = source.to_string_lossy();
    let first = format!("{HEADER} from {source}; rewritten at every export.");
    let mut files = Files::default();
    let mut add = |path: &str, text: String| {
        files.add(format!("{package}/{path}"), Owner::Exported, text);
    };
    let folder = folder.to_string_lossy();
    add("CMakeLists.txt", cmake(&first, &package, &folder));
    add("package.xml", manifest(&first, &package, &component.doc));
    add(
        &format!("launch/{package}.launch.xml"),
        launch(&first, &package),
    );
    Ok((files, found))
}

fn cmake(first: &str, package: &str, folder: &str) -> String {
    // A text in brackets has no escapes.
    format!(
        "# {first}
cmake_minimum_required(VERSION 3.8)
project({package} NONE)

find_package(ament_cmake REQUIRED)

set(COMPONENT [==[{folder}]==] CACHE PATH \"The folder of the component.\")
set(PROGRAM \"\" CACHE FILEPATH \"The program, if cargo does not build it here.\")
if(NOT PROGRAM)
  find_program(CARGO cargo REQUIRED)
  set(TARGET \"${{CMAKE_CURRENT_BINARY_DIR}}/cargo\")
  set(PROGRAM \"${{TARGET}}/release/{package}\")
  add_custom_target(program ALL
    COMMAND \"${{CARGO}}\" build --release --bin {package} --target-dir \"${{TARGET}}\"
    WORKING_DIRECTORY \"${{COMPONENT}}\"
    USES_TERMINAL)
endif()

install(PROGRAMS \"${{PROGRAM}}\" DESTINATION \"lib/${{PROJECT_NAME}}\" RENAME {package})
install(DIRECTORY launch DESTINATION \"share/${{PROJECT_NAME}}\")
install(FILES \"${{COMPONENT}}/etc/config.toml\" DESTINATION \"share/${{PROJECT_NAME}}\" OPTIONAL)
ament_package()
"
    )
}

fn manifest(first: &str, package: &str, doc: &[String]) -> String {
    let doc: Vec<String> = doc.iter().map(|line| escaped(line)).collect();
    let description = match doc.join(" ") {
        text if text.trim().is_empty() => format!("The component {package}."),
        text => text,
    };
    let depends =
        "  <exec_depend>launch_ros</exec_depend>\n  <exec_depend>launch_xml</exec_depend>\n";
    package_file(first, package, &description, depends)
}

fn launch(first: &str, package: &str) -> String {
    format!(
        "<!-- {first} -->
<launch>
  <arg name=\"name\" default=\"{package}\" description=\"The name of the node.\"/>
  <arg name=\"namespace\" default=\"/\" description=\"The namespace of the node, its topics and its services.\"/>
  <arg name=\"config\" default=\"$(find-pkg-share {package})/config.toml\" description=\"The configuration.\"/>
  <node pkg=\"{package}\" exec=\"{package}\" name=\"$(var name)\" namespace=\"$(var namespace)\" output=\"screen\"
        args=\"--config $(var config)\"/>
</launch>
"
    )
}
