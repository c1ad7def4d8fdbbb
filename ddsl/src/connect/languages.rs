//! Which components can be threads of one process.

use crate::model::Deployment;
use rc_cdsl::Component;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_vocabulary::Language;

/// Reports components that cannot share a process, because of their language: one process has
/// one interpreter, whose lock only one thread holds at a time, and the program of a component in
/// C++ has that one component.
pub(super) fn check(
    deployment: &Deployment,
    components: &[Option<&Component>],
    found: &mut Diagnostics,
) {
    for process in &deployment.processes {
        for at in &process.instances {
            let component = components.get(*at).copied().flatten();
            let language = component.map(|component| component.language.text.as_str());
            let language = language.and_then(Language::from_file);
            let Some(needs) = language.and_then(Language::needs) else {
                continue;
            };
            let instance = &deployment.instances[*at];
            let message = format!(
                "`{}` needs {} of its own, and cannot be a thread of process `{}`",
                instance.path, needs.own, process.path
            );
            let error = Diagnostic::error(needs.shared, instance.name.span, message)
                .label(process.name.span, "the process")
                .help("run it in a process of its own: leave `process` out of the component");
            found.push(error);
        }
    }
}
