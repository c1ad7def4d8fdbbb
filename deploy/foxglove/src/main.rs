//! `rcfoxglove`: serves a running network to Foxglove, on a WebSocket.
//!
//! `rcdeploy foxglove` starts it. One thread ([`bridge`]) serves all clients; one polls the network
//! ([`poll`]), and calls have a thread each ([`jobs`]).

mod bridge;
mod client;
mod command_line;
mod delivery;
mod frames;
mod graph;
mod jobs;
mod message;
mod offers;
mod origin;
mod parameters;
mod poll;
mod protocol;
mod queue;
mod shapes;
mod subscriptions;
mod world;

use bridge::Bridge;
use command_line::{Command, Failure, system};
use rc_diagnostics::print;
use std::os::unix::net::UnixStream;
use std::process::ExitCode;

fn main() -> ExitCode {
    let outcome =
        command_line::parse(lexopt::Parser::from_env()).and_then(|command| match command {
            Command::Print(text) => {
                print::data(text);
                Ok(())
            }
            Command::Serve(options) => {
                let interrupts = interrupts()?;
                Bridge::begin(options)?.serve(&interrupts)
            }
        });
    let (code, reason) = match outcome {
        Ok(()) => (0, None),
        Err(Failure(code, reason)) => (code, Some(reason)),
    };
    let (code, reason) = print::exit_code(code, reason, 3);
    if let Some(reason) = reason {
        print::error(format_args!("rcfoxglove: error: {reason}"));
    }
    ExitCode::from(code)
}

/// Becomes readable at Ctrl-C and its kin.
fn interrupts() -> Result<UnixStream, Failure> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let register = || {
        let (read, write) = UnixStream::pair()?;
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::low_level::pipe::register(signal, write.try_clone()?)?;
        }
        Ok(read)
    };
    register().map_err(|error: std::io::Error| system("listen to signals", &error))
}
