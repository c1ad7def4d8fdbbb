//! Fields of a description that have no effect in this version.

use crate::model::Network;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_vocabulary::Language;

impl Network {
    /// Reports components in Python on other hosts: their packages are not copied.
    pub(crate) fn refuse_python_elsewhere(&self, found: &mut Diagnostics) {
        for (instance, project) in self.deployment.instances.iter().zip(&self.projects) {
            let is_python = project
                .as_ref()
                .is_some_and(|project| project.language().is_some_and(Language::has_interpreter));
            let host = self.deployment.remote_host(instance).zip(instance.host);
            if let Some((host, (_, span))) = host.filter(|_| is_python) {
                let message = format!(
                    "`{}` is in Python, and runs on this machine only, not on `{}`",
                    instance.path, host.name.text
                );
                let error = Diagnostic::error("python-elsewhere", span, message);
                found.push(error.help("leave `host` out, or run it there in a network of its own: `rcgen explain python-elsewhere`"));
            }
        }
    }

    /// Refuses processes of several components: this version starts each as a process of its own, in
    /// which a panic or a restart would not be that of the process.
    pub fn refuse_shared_processes(&self, found: &mut Diagnostics) {
        let processes = self.deployment.processes.iter();
        for process in processes.filter(|process| !process.instances.is_empty()) {
            let message = format!(
                "`{}` is a process of components; this version runs each component as a process of its own",
                process.path
            );
            let error = Diagnostic::error("not-supported-yet", process.name.span, message);
            found.push(error.help("leave `process` out"));
        }
    }

    /// Warns of each field that is read and checked, but changes nothing yet.
    pub(crate) fn warn_of_what_has_no_effect(&self, found: &mut Diagnostics) {
        for instance in &self.deployment.instances {
            if let Some((_, span)) = instance.endpoint {
                let message = "`endpoint` is read, but this version does not support it yet; it has no effect";
                found.push(Diagnostic::warning("not-supported-yet", span, message));
            }
        }
    }
}
