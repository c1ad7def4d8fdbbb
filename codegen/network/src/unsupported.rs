//! Fields of a description that have no effect in this version.

use crate::keeper::KEEPER;
use crate::model::Network;
use rc_codegen::Project;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_vocabulary::Language;

/// Reports declarations of a network that have no effect in this version.
pub(crate) fn check(network: &Network, found: &mut Diagnostics) {
    warn_of_what_has_no_effect(network, found);
    refuse_languages_elsewhere(network, found);
}

/// Reports components on other hosts that need files which are not copied there.
fn refuse_languages_elsewhere(network: &Network, found: &mut Diagnostics) {
    for (instance, project) in network.deployment.instances.iter().zip(&network.projects) {
        let language = project.as_deref().and_then(Project::language);
        let code = language.and_then(Language::needs);
        let code = code.and_then(|needs| needs.elsewhere);
        let Some((language, code)) = language.zip(code) else {
            continue;
        };
        let language = language.title();
        let host = network.deployment.remote_host(instance).zip(instance.host);
        if let Some((host, (_, span))) = host {
            let message = format!(
                "`{}` is in {language}, and runs on this machine only, not on `{}`",
                instance.path, host.name.text
            );
            let error = Diagnostic::error(code, span, message);
            found.push(error.help(format!(
                "leave `host` out, or run it there in a network of its own: `rcgen explain {code}`"
            )));
        }
    }
}

/// Warns of each field that is read and checked, but changes nothing yet.
fn warn_of_what_has_no_effect(network: &Network, found: &mut Diagnostics) {
    for instance in &network.deployment.instances {
        if let Some((_, span)) = instance.endpoint {
            let message =
                "`endpoint` is read, but this version does not support it yet; it has no effect";
            found.push(Diagnostic::warning("not-supported-yet", span, message));
        }
    }
    let world = network.deployment.world.iter();
    let files = world.flat_map(|world| {
        let keep = world.keep.as_ref().map(|(file, _)| ("keep", file));
        let start = world.start.as_ref().map(|file| ("start", file));
        start.into_iter().chain(keep)
    });
    let mut projects = network.projects.iter().flatten();
    if projects.any(|project| project.component.name.text == KEEPER) {
        return;
    }
    for (word, file) in files {
        let message =
            format!("no component of the network is a `{KEEPER}`: `{word}` has no effect");
        let warning = Diagnostic::warning("no-world-keeper", file.span, message);
        found.push(warning.help(format!(
            "add `Component keeper {{ cdsl \"…/{KEEPER}.cdsl\"; }};`, which gets its files from here"
        )));
    }
}
