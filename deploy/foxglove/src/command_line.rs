//! The command line of `rcfoxglove`, which `rcdeploy foxglove` writes.

use lexopt::{Arg, Parser, ValueExt};
use std::net::{IpAddr, Ipv4Addr};

/// Text of `--help`.
const HELP: &str = "\
Serves a running network to Foxglove, on a WebSocket

Usage: rcfoxglove [OPTIONS] NETWORK

Options:
      --port <PORT>          The TCP port; 0 for any free one [default: 8765]
      --address <ADDRESS>    The address of this machine to listen on [default: 127.0.0.1]
      --read-only            Serves no calls, and changes no parameters
      --frame <TOPIC=FRAME>  The frame of a topic's scans, clouds or poses
      --origin <ORIGIN>      Also serves web pages of this origin, as in https://viewer.example
  -h, --help                 Prints this help
  -V, --version              Prints the version

Exit codes: 0 success, 1 a name is wrong, 2 the command line is wrong, 3 the system refused something
";

/// Error that ends the program: its exit code, and the reason.
#[derive(Debug)]
pub(crate) struct Failure(pub(crate) u8, pub(crate) String);

impl From<lexopt::Error> for Failure {
    fn from(error: lexopt::Error) -> Self {
        Self(2, error.to_string())
    }
}

impl From<rc_observe::Error> for Failure {
    fn from(error: rc_observe::Error) -> Self {
        Self(if error.is_input() { 1 } else { 3 }, error.to_string())
    }
}

/// Error of the system.
pub(crate) fn system(action: &str, error: &dyn std::fmt::Display) -> Failure {
    Failure(3, format!("cannot {action}: {error}"))
}

/// Network to serve, and clients that may connect.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Options {
    pub(crate) network: String,
    pub(crate) address: IpAddr,
    pub(crate) port: u16,
    pub(crate) read_only: bool,
    /// Frames by names of topics.
    pub(crate) frames: Vec<(String, String)>,
    /// Origins of web pages that are served, besides those of Foxglove and of this machine.
    pub(crate) origins: Vec<String>,
}

/// Request of the command line.
#[derive(Debug, PartialEq)]
pub(crate) enum Command {
    /// Prints a text.
    Print(&'static str),
    /// Serves a network.
    Serve(Options),
}

/// Reads the command line.
pub(crate) fn parse(mut parser: Parser) -> Result<Command, Failure> {
    let mut network = None;
    let mut options = Options {
        network: String::new(),
        address: IpAddr::V4(Ipv4Addr::LOCALHOST),
        port: 8765,
        read_only: false,
        frames: Vec::new(),
        origins: Vec::new(),
    };
    while let Some(argument) = parser.next()? {
        match argument {
            Arg::Short('h') | Arg::Long("help") => return Ok(Command::Print(HELP)),
            Arg::Short('V') | Arg::Long("version") => {
                let version = concat!("rcfoxglove ", env!("CARGO_PKG_VERSION"), "\n");
                return Ok(Command::Print(version));
            }
            Arg::Long("port") => options.port = parser.value()?.parse()?,
            Arg::Long("address") => options.address = parser.value()?.parse()?,
            Arg::Long("read-only") => options.read_only = true,
            Arg::Long("frame") => {
                let text = parser.value()?.string()?;
                let frame = text.split_once('=').filter(|(topic, frame)| {
                    !topic.is_empty() && !frame.is_empty() && !frame.contains('\0')
                });
                let Some((topic, frame)) = frame else {
                    let text =
                        format!("`--frame {text}`: expected a topic and a frame, as in scan=laser");
                    return Err(Failure(2, text));
                };
                options.frames.push((topic.to_owned(), frame.to_owned()));
            }
            Arg::Long("origin") => options.origins.push(parser.value()?.string()?),
            Arg::Value(value) if network.is_none() => network = Some(value.string()?),
            other => return Err(other.unexpected().into()),
        }
    }
    let missing = || {
        Failure(
            2,
            "expected a network, as in `rcfoxglove patrol`".to_owned(),
        )
    };
    options.network = network.ok_or_else(missing)?;
    Ok(Command::Serve(options))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_read_and_wrong_ones_refused() {
        let read = |words: &[&str]| parse(Parser::from_args(words));
        let Ok(Command::Serve(options)) = read(&["patrol", "--port", "0", "--frame", "scan=laser"])
        else {
            panic!("options");
        };
        assert_eq!(
            (options.network.as_str(), options.port, options.read_only),
            ("patrol", 0, false)
        );
        assert!(options.address.is_loopback());
        assert_eq!(options.frames, [("scan".to_owned(), "laser".to_owned())]);
        for wrong in [
            &[][..],
            &["a", "b"],
            &["a", "--port", "65536"],
            &["a", "--frame", "x"],
            &["a", "--what"],
        ] {
            assert_eq!(read(wrong).expect_err("a failure").0, 2, "{wrong:?}");
        }
    }
}
