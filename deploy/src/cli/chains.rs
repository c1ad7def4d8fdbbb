//! `rcdeploy chains`: how long chains take, now or in a recording.

use super::arguments::format;
use super::bag::note_faults;
use super::completion::networks;
use super::networks::running;
use super::output::{Failure, print_note, show};
use clap::Args;
use rc_command_line::{files, words};
use rc_deploy_client::perfetto::write_trace_events;
use rc_deploy_client::{Format, connection};
use std::path::PathBuf;

/// Arguments of `chains`.
#[derive(Args)]
pub(super) struct Chains {
    /// The network or its .ddsl. Optional if only one network is up.
    #[arg(add = networks(), conflicts_with = "from")]
    network: Option<String>,
    /// Reads a recording in place of a running network.
    #[arg(long, value_name = "FILE.mcap", add = files(&["mcap"]))]
    from: Option<PathBuf>,
    /// Writes each message that came to the end, for ui.perfetto.dev: all of a recording, the last
    /// ones of a running network.
    #[arg(long, value_name = "FILE.json", add = files(&["json"]))]
    perfetto: Option<PathBuf>,
    /// The form of the output: human or json (one document).
    #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
    format: Format,
}

pub(super) fn chains(options: Chains) -> Result<u8, Failure> {
    let Chains {
        network,
        from,
        perfetto,
        format,
    } = options;
    let (mut report, code) = if let Some(path) = from {
        let (report, faults) = rc_record::chains::read(&path)?;
        (report, note_faults(&faults))
    } else {
        let known = perfetto.is_some().then(Vec::new);
        (connection::chains(&running(network)?, known)?, 0)
    };
    if let Some(path) = &perfetto {
        let failed = |error| Failure(3, format!("{}: {error}", path.display()));
        let written = rc_files::write_with(path, |out| write_trace_events(&report, out));
        written.map_err(failed)?;
        let count: usize = report.chains.iter().map(|chain| chain.traces.len()).sum();
        let path = path.display();
        print_note(&format_args!(
            "{path}: {count} messages; open it in ui.perfetto.dev"
        ));
    }
    // The table and its document are about all messages together.
    report
        .chains
        .iter_mut()
        .for_each(|chain| chain.traces.clear());
    Ok(show(format, &report, ToString::to_string)?.max(code))
}
