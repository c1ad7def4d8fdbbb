//! The program that all adaptors and proxies run.

use rc_ddsl::model::{Deployment, Instance};
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::io;
use std::path::PathBuf;

/// The program, which is installed next to `rcdeploy`.
pub(crate) const PROGRAM: &str = "rcforward";
/// Its crate.
pub(crate) const CRATE: &str = "rc-forward";

/// Where the program is.
pub(crate) fn program() -> io::Result<PathBuf> {
    Ok(std::env::current_exe()?.with_file_name(PROGRAM))
}

/// Checks that the program exists, if an adaptor or a proxy needs it.
pub(crate) fn check_program(deployment: &Deployment, found: &mut Diagnostics) {
    let mut instances = deployment.instances.iter();
    let place = |instance: &Instance| {
        instance
            .adaptor
            .or(instance.proxy.map(|_| instance.name.span))
    };
    let Some(span) = instances.find_map(place) else {
        return;
    };
    let path = program().unwrap_or_else(|_| PROGRAM.into());
    if !path.is_file() {
        let message = format!(
            "the program of adaptors and proxies, {}, does not exist",
            path.display()
        );
        let error = Diagnostic::error("missing-executable", span, message);
        found.push(
            error.help("install it next to `rcdeploy`: `cargo xtask install --with rcforward`"),
        );
    }
}
