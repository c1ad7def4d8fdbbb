//! Which components can be threads of one process.

use super::Connector;
use rc_diagnostics::Diagnostic;
use rc_vocabulary::Language;

impl Connector<'_> {
    /// Reports components that cannot share a process, because of their language: one process has
    /// one interpreter, whose lock only one thread holds at a time, and the program of a component in
    /// C++ has that one component.
    pub(super) fn check_languages(&mut self) {
        for process in &self.deployment.processes {
            for at in &process.instances {
                let component = self.components.get(*at).copied().flatten();
                let language = component.map(|component| component.language.text.as_str());
                let language = language.and_then(Language::from_file);
                let Some(needs) = language.and_then(Language::needs) else {
                    continue;
                };
                let instance = &self.deployment.instances[*at];
                let message = format!(
                    "`{}` needs {} of its own, and cannot be a thread of process `{}`",
                    instance.path, needs.own, process.path
                );
                let error = Diagnostic::error(needs.shared, instance.name.span, message)
                    .label(process.name.span, "the process")
                    .help("run it in a process of its own: leave `process` out of the component");
                self.found.push(error);
            }
        }
    }
}
