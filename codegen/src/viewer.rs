//! The options of InnerModel, and the parameters that they need.

use rc_cdsl::Component;
use rc_configuration::model::{Kind, Parameter, Parameters, Type};
use rc_diagnostics::{Diagnostic, Diagnostics};

/// The parameters: whether the window is shown, and the file of the tree.
const NEEDED: [(&str, Type, &str); 2] = [
    ("viewer", Type::Bool, "viewer bool false;"),
    ("inner_model", Type::Path, "inner_model path \"world.xml\";"),
];

fn is_declared(parameters: Option<&Parameters>, name: &str, wanted: Type) -> bool {
    let all = parameters.map_or(&[][..], |all| &all.parameters);
    let is_wanted = |parameter: &Parameter| {
        parameter.name == name
            && matches!(parameter.kind, Kind::Scalar { ty, array: None } if ty == wanted)
    };
    all.iter().any(is_wanted)
}

/// Whether the component shows its tree in a window: it has the option and both parameters.
pub(crate) fn is_on(component: &Component, parameters: Option<&Parameters>) -> bool {
    let mut needed = NEEDED.iter();
    component.viewer.is_some() && needed.all(|(name, ty, _)| is_declared(parameters, name, *ty))
}

/// Warns of an option that lacks its parameters.
pub(crate) fn check(
    component: &Component,
    parameters: Option<&Parameters>,
    found: &mut Diagnostics,
) {
    let of_viewer = NEEDED
        .iter()
        .map(|needed| (component.viewer, "InnerModelViewer", needed));
    let of_slots = [(component.scene_slots, "InnerModelSlots", &NEEDED[1])];
    for (option, word, (name, ty, declaration)) in of_viewer.chain(of_slots) {
        let Some(option) = option else {
            continue;
        };
        if !is_declared(parameters, name, *ty) {
            let message = format!("`{word}` has no effect without the parameter `{name}`");
            let finding = Diagnostic::warning("viewer-without-parameters", option, message);
            found.push(finding.help(format!(
                "declare `{declaration}` in the .pdsl of the component"
            )));
        }
    }
}
