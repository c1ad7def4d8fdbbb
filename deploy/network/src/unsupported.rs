//! Fields of a description that have no effect in this version.

use crate::model::Network;
use rc_codegen::Project;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_vocabulary::Language;

impl Network {
    /// Reports components on other hosts that need what is not copied there.
    pub(crate) fn refuse_languages_elsewhere(&self, found: &mut Diagnostics) {
        for (instance, project) in self.deployment.instances.iter().zip(&self.projects) {
            let language = project.as_deref().and_then(Project::language);
            let code = language.and_then(Language::needs);
            let code = code.and_then(|needs| needs.elsewhere);
            let Some((language, code)) = language.zip(code) else {
                continue;
            };
            let language = language.title();
            let host = self.deployment.remote_host(instance).zip(instance.host);
            if let Some((host, (_, span))) = host {
                let message = format!(
                    "`{}` is in {language}, and runs on this machine only, not on `{}`",
                    instance.path, host.name.text
                );
                let error = Diagnostic::error(code, span, message);
                found.push(error.help(format!("leave `host` out, or run it there in a network of its own: `rcgen explain {code}`")));
            }
        }
    }

    /// Reports processes of several components on other hosts: an agent there has one link for each
    /// process.
    pub(crate) fn refuse_processes_elsewhere(&self, found: &mut Diagnostics) {
        for process in &self.deployment.processes {
            let instances = process.instances.iter();
            let hosts = instances.map(|at| {
                let instance = &self.deployment.instances[*at];
                let host = self.deployment.remote_host(instance)?;
                Some((host, instance.host?.1))
            });
            // Two hosts were reported.
            let hosts: Option<Vec<_>> = hosts.collect();
            let host = hosts.into_iter().flatten().next();
            if let Some((host, span)) = host {
                let message = format!(
                    "process `{}` runs components as threads, and does so on this machine only, not on `{}`",
                    process.path, host.name.text
                );
                let error = Diagnostic::error("process-elsewhere", span, message);
                found.push(
                    error.help(
                        "leave `process` out: there, each component has a process of its own",
                    ),
                );
            }
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
