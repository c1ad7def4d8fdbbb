//! `rcdeploy foxglove`: becomes the program that serves a network to Foxglove.
//!
//! It is a separate program, because nothing else needs a WebSocket.

use super::completion::networks;
use super::networks::network_of;
use super::output::{Failure, system};
use clap::Args;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::net::IpAddr;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;

/// The program.
const PROGRAM: &str = "rcfoxglove";

#[derive(Args)]
pub(super) struct Foxglove {
    /// The network or its .ddsl. Optional if only one network runs.
    #[arg(add = networks())]
    network: String,
    /// The TCP port; 0 for any free one.
    #[arg(long, default_value_t = 8765)]
    port: u16,
    /// The address of this machine to listen on. Whoever reaches it can call operations.
    #[arg(long, default_value = "127.0.0.1")]
    address: IpAddr,
    /// Serves no calls, and changes no parameters.
    #[arg(long)]
    read_only: bool,
    /// The frame of a topic's scans, clouds or poses, as in `scan=laser`. May be given several
    /// times.
    ///
    /// Without it, the frame has the name of the component.
    #[arg(long, value_name = "TOPIC=FRAME")]
    frame: Vec<String>,
    /// Also serves web pages of this origin, as in `https://viewer.example`.
    ///
    /// Those of Foxglove and of this machine are served anyway.
    #[arg(long, value_name = "ORIGIN")]
    origin: Vec<String>,
}

/// Replaces this program by the one that serves.
pub(super) fn foxglove(options: &Foxglove) -> Result<u8, Failure> {
    let mut arguments: Vec<OsString> = vec![
        format!("--port={}", options.port).into(),
        format!("--address={}", options.address).into(),
    ];
    if options.read_only {
        arguments.push("--read-only".into());
    }
    for frame in &options.frame {
        arguments.push(format!("--frame={frame}").into());
    }
    for origin in &options.origin {
        arguments.push(format!("--origin={origin}").into());
    }
    arguments.extend(["--".into(), network_of(&options.network)?.into()]);
    // The one next to this program fits it; otherwise the one in the PATH.
    let own = std::env::current_exe().ok();
    let beside = own.map(|own| own.with_file_name(PROGRAM));
    let program = beside.filter(|beside| beside.is_file());
    let program = program.unwrap_or_else(|| PathBuf::from(PROGRAM));
    let error = Command::new(&program).args(arguments).exec();
    if error.kind() == ErrorKind::NotFound {
        return Err(system(&format_args!(
            "there is no `{PROGRAM}`; `cargo xtask install --with {PROGRAM}`, in the folder of RoboComp, installs it"
        )));
    }
    Err(system(&format_args!("{}: {error}", program.display())))
}
