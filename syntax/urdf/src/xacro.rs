//! Finds what `xacro` has not expanded yet: such a file has not the robot that its author means.

use rc_diagnostics::Diagnostic;
use rc_xml::XmlSource;
use roxmltree::Node as Xml;

/// The error of the first macro in a robot. The declaration of their namespace alone, which `xacro`
/// leaves in its output, is none.
pub(crate) fn unexpanded(text: &XmlSource<'_>, top: Xml<'_, '_>) -> Option<Diagnostic> {
    // Elements for plugins of Gazebo may have any form.
    let is_of_plugin = |xml: Xml<'_, '_>| {
        let mut above = xml.ancestors().skip(1);
        above.any(|above| above.has_tag_name("gazebo"))
    };
    for xml in top.descendants().filter(Xml::is_element) {
        let tag = text.tag(xml);
        let namespace = xml.tag_name().namespace().unwrap_or_default();
        if namespace.ends_with("/xacro") {
            let message = format!("`<{}>` is a macro of xacro", text.slice(tag));
            return Some(expand(Diagnostic::error("not-a-urdf", tag, message)));
        }
        let mut attributes = xml.attributes();
        let macros = attributes.find(|attribute| {
            let value = attribute.value();
            value.contains("${") || value.contains("$(")
        });
        let Some(name) = macros.map(|attribute| attribute.name()) else {
            continue;
        };
        if let Some(value) = text.attribute(xml, name).filter(|_| !is_of_plugin(xml)) {
            let message = format!("`{}` is an expression of xacro", value.text);
            return Some(expand(Diagnostic::error("not-a-urdf", value.span, message)));
        }
    }
    None
}

fn expand(error: Diagnostic) -> Diagnostic {
    error.help("expand the file first: `xacro robot.urdf.xacro > robot.urdf`")
}
