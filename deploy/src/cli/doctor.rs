//! `rcdeploy doctor`.

use super::arguments::Input;
use super::description::load;
use super::output::{Failure, show, system};
use crate::doctor::{Grade, Machine, of_host};
use crate::process::identity::{Identity, Mark};
use rc_deploy_client::Format;
use rc_deploy_network::topology::remote_hosts;

/// Examines this machine, and the other machines of a network.
pub(super) fn doctor(input: Option<&Input>, format: Format) -> Result<u8, Failure> {
    let folder = std::env::current_dir().map_err(|e| system(&e))?;
    let machine = Machine {
        root: "/".into(),
        variable: &|name| std::env::var(name).ok(),
        user: rustix::process::getuid().as_raw(),
        folder,
    };
    let mut findings = machine.examine();
    if let Some(input) = input {
        let network = load(input, rc_diagnostics::Format::Human, |_, _| {})?;
        let own = Identity::own().ok_or_else(|| system(&"/proc cannot be read"))?;
        let mark = Mark::new(network.name(), own);
        let hosts = remote_hosts(&network);
        findings.extend(hosts.iter().map(|host| of_host(host, &mark)));
    }
    let worst = findings.iter().map(|finding| finding.grade).max();
    show(format, &findings, |findings| {
        findings.iter().map(ToString::to_string).collect()
    })?;
    Ok(u8::from(worst == Some(Grade::Error)))
}
